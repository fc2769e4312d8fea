//! An environment as a few hundred lights that are far away, each for a cell of the sky around it.

use glam::{DVec3, Vec3};
use scene::{Environment, Rgb, luminance};

use crate::irradiance_fit::fitted;
use crate::kollig_keller::split_directions;
use crate::sky_pieces::{SkyPieces, nearest_directions};
use crate::structured_sampling::{is_lit, structured_directions};
use crate::voronoi::Voronoi;

/// How the places of lights are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SkySampling {
    /// By layers of brightness: many lights where the sky is bright, some in every part of it.
    #[default]
    Structured,
    /// By splitting the brightest cell: lights of about the same strength.
    EqualLight,
}

/// Lights that stand for an environment.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentLights {
    /// Unit directions towards the lights.
    pub directions: Vec<DVec3>,
    /// What each sends to a surface that faces it, W·m⁻².
    pub irradiance: Vec<Rgb>,
    /// The cells that they stand for.
    pub voronoi: Voronoi,
}

impl EnvironmentLights {
    /// At most `count` lights, fewer if the sky has not as many pieces that are lit; the sun of a sky by the standard is one of
    /// them. None if `count` is 0 or the environment is black.
    pub fn new(environment: &Environment, count: u32, sampling: SkySampling) -> Option<Self> {
        let sky = SkyPieces::of(environment);
        let sun = environment.sun();
        let has_sky = sky.pieces.iter().any(|piece| is_lit(piece.irradiance));
        let of_sky = (count as usize).saturating_sub(usize::from(sun.is_some()));
        let (mut directions, mut irradiance) = (Vec::new(), Vec::new());
        if has_sky && of_sky > 0 {
            let places = match sampling {
                SkySampling::Structured => structured_directions(&sky, of_sky),
                SkySampling::EqualLight => split_directions(&sky, of_sky),
            };
            (directions, irradiance) = lights_at(&sky, &places);
        }
        if let Some((direction, light)) = sun.filter(|_| count > 0) {
            directions.push(direction);
            irradiance.push(light);
        }
        let voronoi = (!directions.is_empty()).then(|| Voronoi::new(&directions))?;
        Some(Self { directions, irradiance, voronoi })
    }

    /// How many lights there are.
    pub fn count(&self) -> u32 {
        self.directions.len() as u32
    }

    /// Irradiance of an unobstructed surface, W·m⁻².
    pub fn unobstructed(&self, normal: DVec3) -> Rgb {
        let lights = self.directions.iter().zip(&self.irradiance);
        lights.map(|(direction, irradiance)| irradiance * direction.dot(normal).max(0.0)).sum()
    }

    /// A picture of the environment, row by row, W·sr⁻¹·m⁻², with the borders of the lights' cells and the lights in a colour.
    pub fn picture(&self, environment: &Environment, width: u32, height: u32, colour: Vec3) -> Vec<Vec3> {
        let direction = |x: u32, y: u32| {
            let place = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
            environment.direction(place(x, width), place(y, height))
        };
        let nearest = |x: u32, y: u32| self.voronoi.nearest(direction(x % width, y.min(height - 1)));
        let mut picture: Vec<Vec3> = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let here = nearest(x, y);
                let is_border = here != nearest(x + 1, y) || here != nearest(x, y + 1);
                if is_border { colour } else { environment.radiance(direction(x, y)).as_vec3() }
            })
            .collect();
        for &light in &self.directions {
            let (u, v) = environment.place(light);
            let (x, y) = ((u * f64::from(width)) as u32, ((v * f64::from(height)) as u32).min(height - 1));
            for (dx, dy) in [(0, 0), (1, 0), (width - 1, 0), (0, 1), (0, height - 1)] {
                picture[((y + dy) % height * width + (x + dx) % width) as usize] = colour;
            }
        }
        picture
    }
}

/// Lights about some places: each in the mean direction of the light that is nearest to its place, and as strong. So all of a
/// cell that is above a surface's horizon is exact on it, whatever its normal.
fn lights_at(sky: &SkyPieces, places: &[DVec3]) -> (Vec<DVec3>, Vec<Rgb>) {
    let mut flows = vec![[DVec3::ZERO; 3]; places.len()];
    for (piece, cell) in sky.pieces.iter().zip(nearest_directions(&sky.pieces, places)) {
        for (channel, flow) in flows[cell as usize].iter_mut().enumerate() {
            *flow += piece.direction * piece.irradiance[channel];
        }
    }
    let weights = [luminance(Rgb::X), luminance(Rgb::Y), luminance(Rgb::Z)];
    let lights = flows.iter().filter_map(|flow| {
        let direction = flow.iter().zip(weights).map(|(flow, weight)| flow * weight).sum::<DVec3>().try_normalize()?;
        Some((direction, Rgb::from_array(flow.map(|flow| flow.dot(direction).max(0.0)))))
    });
    let (directions, strengths): (Vec<DVec3>, Vec<Rgb>) = lights.unzip();
    let strengths = fitted(&sky.pieces, &directions, &strengths);
    (directions, strengths)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use scene::{CIE_SKIES, CieSky, LatLongMap, Sky, UpAxis};

    use super::*;
    use crate::irradiance_fit::{irradiance, spread_normals};

    const BOTH: [SkySampling; 2] = [SkySampling::Structured, SkySampling::EqualLight];

    fn map(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3) -> Environment {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        let sky = Sky::Map(LatLongMap { width, height, texels });
        Environment { sky, up: UpAxis::Z, rotation: 0.3, scale: 1.0 }
    }

    /// Dark below, bright above, a small sun and a coloured window.
    fn varied() -> Environment {
        map(256, 128, |x, y| match (x, y) {
            (40..=41, 30..=31) => Vec3::splat(8000.0),
            (150..=180, 50..=62) => Vec3::new(9.0, 14.0, 20.0),
            (_, 0..=63) => Vec3::splat(1.0 + y as f32 / 30.0),
            _ => Vec3::new(0.2, 0.15, 0.1),
        })
    }

    /// The largest error of irradiance over normals that were not fitted to, as a fraction of the largest irradiance.
    fn largest_error(environment: &Environment, lights: &EnvironmentLights) -> f64 {
        let pieces = SkyPieces::of(environment).pieces;
        let (mut error, mut largest) = (0.0f64, 0.0f64);
        for normal in spread_normals(1501) {
            let truth = irradiance(&pieces, normal);
            error = error.max((lights.unobstructed(normal) - truth).abs().max_element());
            largest = largest.max(truth.max_element());
        }
        error / largest
    }

    #[test]
    fn irradiance_of_every_normal_is_that_of_the_sky() {
        let mut environments = vec![map(1, 1, |_, _| Vec3::ONE), varied()];
        for kind in [5, 12] {
            let sky = Sky::Cie(CieSky::new(kind, [1.0, 0.6], 0.0).unwrap());
            environments.push(Environment { sky, up: UpAxis::Y, rotation: 0.0, scale: 1.0 });
        }
        for (i, environment) in environments.iter().enumerate() {
            for sampling in BOTH {
                let lights = EnvironmentLights::new(environment, 200, sampling).unwrap();
                let error = largest_error(environment, &lights);
                assert_eq!(lights.count(), 200);
                assert!(error < 5e-3, "{i}, {sampling:?}: {error}");
            }
        }
    }

    /// Horizontal irradiance ∫ L sin γ dω over the upper half, by Gauss's rule of so many bands.
    #[test]
    fn skies_of_the_standard_send_what_quadrature_says() {
        for kind in 1..=CIE_SKIES {
            let sky = CieSky::new(kind, [2.0, 0.7], 0.0).unwrap();
            let bands = 2000;
            let mut expected = 0.0;
            for band in 0..bands {
                let altitude = (f64::from(band) + 0.5) / f64::from(bands) * FRAC_PI_2;
                let mean =
                    (0..720).map(|i| sky.relative_radiance(f64::from(i) * TAU / 720.0, altitude)).sum::<f64>() / 720.0;
                expected += mean * altitude.sin() * altitude.cos() * TAU * FRAC_PI_2 / f64::from(bands);
            }
            let environment = Environment { sky: Sky::Cie(sky), up: UpAxis::Z, rotation: 0.5, scale: 1.0 };
            let lights = EnvironmentLights::new(&environment, 200, SkySampling::Structured).unwrap();
            let found = lights.unobstructed(DVec3::Z).x;
            assert!((found / expected - 1.0).abs() < 5e-3, "sky {kind}: {found}, expected {expected}");
            if kind == 16 {
                assert!((expected - 7.0 * PI / 9.0).abs() < 1e-5, "the closed form of Moon and Spencer's sky");
            }
        }
    }

    #[test]
    fn the_sun_is_a_light_of_its_own() {
        let sky = Sky::Cie(CieSky::new(12, [0.5, 0.8], 900.0).unwrap());
        let environment = Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
        let lights = EnvironmentLights::new(&environment, 50, SkySampling::EqualLight).unwrap();
        assert_eq!((lights.count(), lights.irradiance[49]), (50, Rgb::splat(900.0)));
        assert!((lights.directions[49].z - 0.8f64.sin()).abs() < 1e-12);
        let alone = EnvironmentLights::new(&environment, 1, SkySampling::Structured).unwrap();
        assert_eq!((alone.count(), alone.irradiance[0]), (1, Rgb::splat(900.0)));
    }

    #[test]
    fn a_sky_of_three_lit_texels_has_three_lights_and_a_black_one_none() {
        let few = map(256, 128, |x, y| Vec3::splat(if (x % 100, y) == (7, 60) { 4.0 } else { 0.0 }));
        for sampling in BOTH {
            let lights = EnvironmentLights::new(&few, 200, sampling).unwrap();
            assert_eq!(lights.count(), 3);
            assert!(largest_error(&few, &lights) < 1e-9);
            assert_eq!(EnvironmentLights::new(&map(8, 4, |_, _| Vec3::ZERO), 200, sampling), None);
            assert_eq!(EnvironmentLights::new(&few, 0, sampling), None);
        }
    }

    #[test]
    fn bright_parts_have_many_lights_and_dark_ones_some() {
        for sampling in BOTH {
            let environment = varied();
            let lights = EnvironmentLights::new(&environment, 100, sampling).unwrap();
            let above = lights.directions.iter().filter(|direction| direction.z > 0.0).count();
            assert!((55..98).contains(&above), "{sampling:?}: {above} of 100 above the horizon");
        }
    }

    #[test]
    fn a_picture_has_every_light() {
        let environment = varied();
        let lights = EnvironmentLights::new(&environment, 50, SkySampling::Structured).unwrap();
        let red = Vec3::new(50.0, 0.0, 0.0);
        let picture = lights.picture(&environment, 300, 150, red);
        let marked = picture.iter().filter(|pixel| **pixel == red).count();
        assert!(picture.len() == 300 * 150 && (1000..20_000).contains(&marked), "{marked}");
    }
}
