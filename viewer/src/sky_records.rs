//! The environment as the passes read it: a picture of all directions in words, whatever the environment is made of.
//!
//! | words | content |
//! |---|---|
//! | 0 | width, and height in the upper half; there is no word at all without an environment |
//! | then | the texels, row after row: three mantissas of nine bits, red lowest, and an exponent of two in the upper five |
//!
//! Columns are angles about the scene's z axis from −y by −x, and rows angles from it, so that a direction finds its texel by
//! the scene's own axes.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use scene::{Baked, Environment, Rgb};

/// Columns and rows: texels of 0.35°, four or so of a picture's pixels, in 2 MB.
const SIZE: [u32; 2] = [1024, 512];

/// Looks along each side of a texel: so many that no texel of a map twice as fine is missed.
const LOOKS: u32 = 2;

/// What exponents are counted from: with 24 texels hold radiance from 6e-8 to 65,408 W·sr⁻¹·m⁻²; beyond it the sun's disc is
/// shown as that, which is white by any exposure that shows the rest.
const BIAS: i32 = 24;

/// The largest mantissa.
const LARGEST: f32 = 511.0;

/// The words of a bake's environment.
pub(crate) fn sky_words(baked: &Baked) -> Vec<u32> {
    let Some(environment) = &baked.scene.environment else { return Vec::new() };
    let [width, height] = SIZE;
    let texel = |i: u32| packed(mean(environment, [i % width, i / width]).as_vec3());
    let mut words = vec![width | height << 16];
    words.par_extend((0..width * height).into_par_iter().map(texel));
    words
}

/// The radiance of a texel's direction, over some looks.
fn mean(environment: &Environment, [x, y]: [u32; 2]) -> Rgb {
    let place = |cell: u32, look: u32, cells: u32| {
        (f64::from(cell) + (f64::from(look) + 0.5) / f64::from(LOOKS)) / f64::from(cells)
    };
    let looks = (0..LOOKS * LOOKS).map(|look| {
        let (azimuth, polar) = ((place(x, look % LOOKS, SIZE[0]) - 0.5) * TAU, place(y, look / LOOKS, SIZE[1]) * PI);
        let (sin, cos) = azimuth.sin_cos();
        environment.seen(DVec3::new(sin * polar.sin(), cos * polar.sin(), polar.cos()))
    });
    looks.sum::<Rgb>() / f64::from(LOOKS * LOOKS)
}

/// Radiance in a word.
fn packed(radiance: Vec3) -> u32 {
    let largest = radiance.max_element().min(LARGEST * 128.0);
    // The smallest exponent by which the largest channel has a mantissa.
    let exponent = (0..31).find(|&exponent| largest <= LARGEST * scale(exponent)).unwrap_or(31);
    let [r, g, b] = radiance.to_array().map(|channel| (channel / scale(exponent) + 0.5).min(LARGEST) as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

fn scale(exponent: i32) -> f32 {
    ((exponent - BIAS) as f32).exp2()
}

/// Radiance of a word.
fn unpacked(word: u32) -> Vec3 {
    let mantissa = |shift: u32| (word >> shift & 511) as f32;
    Vec3::new(mantissa(0), mantissa(9), mantissa(18)) * scale((word >> 27) as i32)
}

/// The radiance of the environment in a direction, bilinear, W·sr⁻¹·m⁻²; 0 without one. The shader's `sky_along`, operation for
/// operation.
pub(crate) fn sky_along(words: &[u32], direction: Vec3) -> Vec3 {
    let Some(&size) = words.first() else { return Vec3::ZERO };
    let (width, height) = ((size & 0xffff) as i32, (size >> 16) as i32);
    // At the very zenith any column will do.
    let azimuth = direction.x.atan2(direction.y + f32::MIN_POSITIVE);
    let polar = direction.truncate().length().atan2(direction.z);
    let u = azimuth / std::f32::consts::TAU + 0.5;
    let v = polar / std::f32::consts::PI;
    let place = Vec2::new(u * width as f32, v * height as f32) - 0.5;
    let (first, part) = (place.floor(), place - place.floor());
    let texel = |x: i32, y: i32| {
        let (column, row) = ((first.x as i32 + x).rem_euclid(width), (first.y as i32 + y).clamp(0, height - 1));
        unpacked(words[(1 + row * width + column) as usize])
    };
    let row = |y: i32| texel(0, y) * (1.0 - part.x) + texel(1, y) * part.x;
    row(0) * (1.0 - part.y) + row(1) * part.y
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use scene::{CieSky, LatLongMap, Scene, Sky, UpAxis};

    use super::*;

    fn words(environment: Environment) -> Vec<u32> {
        sky_words(&Baked { scene: Scene { environment: Some(environment), ..Scene::default() }, ..Baked::default() })
    }

    #[test]
    fn without_an_environment_there_are_no_words_and_no_light() {
        assert_eq!(sky_words(&Baked::default()), Vec::<u32>::new());
        assert_eq!(sky_along(&[], Vec3::X), Vec3::ZERO);
    }

    #[test]
    fn a_word_holds_radiance_to_a_five_hundredth_of_its_brightest_channel() {
        for radiance in [0.0, 1e-9, 3e-5, 0.999, 1.0, 511.0, 511.5, 65_000.0] {
            let colour = Vec3::new(radiance, 0.3 * radiance, 0.0);
            let error = (unpacked(packed(colour)) - colour).abs().max_element();
            assert!(error <= radiance / 500.0 + 3e-8, "{radiance}: {error}");
        }
        for bright in [65_408.0, 1e9, f32::MAX] {
            assert_eq!(unpacked(packed(Vec3::splat(bright))), Vec3::splat(65_408.0));
        }
    }

    /// Where a sky is smooth its picture is the sky, whatever points up; every direction has a colour.
    #[test]
    fn directions_see_the_environment() {
        for (up, rotation) in [(UpAxis::X, 0.3), (UpAxis::Y, -2.0), (UpAxis::Z, 0.0)] {
            let sky = Sky::Cie(CieSky::new(7, [2.0, 0.4], 0.0).unwrap());
            let environment = Environment { sky, up, rotation, scale: 5.0 };
            let words = words(environment.clone());
            for i in 0..400 {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0;
                let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
                let direction = DVec3::new(sin * (1.0 - z * z).sqrt(), cos * (1.0 - z * z).sqrt(), z);
                let height = environment.direction(0.0, 0.0).dot(direction);
                let (ours, exact) = (sky_along(&words, 7.0 * direction.as_vec3()), environment.seen(direction));
                if height.abs() > 0.05 {
                    assert!((ours.as_dvec3() - exact).abs().max_element() <= 0.02 * exact.x, "{ours} {exact}");
                }
            }
            for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
                assert!(sky_along(&words, axis).is_finite());
            }
        }
    }

    /// A map of as many texels lies on its picture, texel on texel.
    #[test]
    fn a_map_of_that_size_is_its_own_picture() {
        let [width, height] = SIZE;
        let texels = (0..width * height).map(|i| Vec3::new((i % 7) as f32, (i % 5) as f32, (i % 3) as f32)).collect();
        let map = Sky::Map(LatLongMap { width, height, texels });
        let environment = Environment { sky: map, up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
        let words = words(environment.clone());
        assert_eq!(words.len() as u32, 1 + width * height);
        for i in (0..width * height).step_by(997) {
            let place = |cell: u32, cells: u32| (f64::from(cell) + 0.5) / f64::from(cells);
            let direction = environment.direction(place(i % width, width), place(i / width, height));
            let (ours, exact) = (sky_along(&words, direction.as_vec3()), environment.seen(direction));
            assert!((ours.as_dvec3() - exact).abs().max_element() < 1e-2, "{i}: {ours} {exact}");
        }
    }
}
