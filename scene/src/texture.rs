//! A texture: what the reflectance of a surface is multiplied by, from point to point.

use glam::{DVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::{Rgb, decode_srgb};

/// Most scanlines that the mean over one triangle is taken from. At this number neighbouring ones of a footprint that spans
/// a texture of the largest size are two texels apart; a footprint of many repeats meets every row often enough.
const MOST_SCANLINES: f64 = 1024.0;

/// Fewest scanlines of a triangle: the rule across the scanlines is the midpoint's, off by 1/(4n²) of a triangle's share.
const FEWEST_SCANLINES: f64 = 8.0;

/// Points along the outline of a footprint without area, whose mean stands for it.
const EDGE_POINTS: u32 = 16;

/// Texels of reflectance, repeated in both directions.
///
/// Texture coordinates (u, v) run to the right and down; (0, 0) is the upper left corner of the first texel and (1, 1) the
/// lower right one of the last.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Name in the scene file.
    pub name: String,
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 8-bit sRGB colours, row after row from the top.
    pub texels: Vec<[u8; 3]>,
}

impl Texture {
    /// Whether there are texels, as many as the size says, and fewer than 65,536 in a row and in a column.
    pub fn is_valid(&self) -> bool {
        let largest = u32::from(u16::MAX);
        !self.texels.is_empty()
            && self.width.max(self.height) <= largest
            && u64::from(self.width) * u64::from(self.height) == self.texels.len() as u64
    }

    /// The linear colour at (u, v), each channel in 0..=1: bilinear between the middles of four texels. In f32 and in this
    /// order of operations, because the viewer's shader does the same.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let place = (uv - uv.floor()) * size - 0.5;
        let (corner, part) = (place.floor(), place - place.floor());
        let texel = |x: f32, y: f32| {
            let column = (corner.x + x).rem_euclid(size.x) as usize;
            let row = (corner.y + y).rem_euclid(size.y) as usize;
            let texel = self.texels.get(row * self.width as usize + column).copied().unwrap_or_default();
            Vec3::from_array(texel.map(decode_srgb))
        };
        let upper = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part.x);
        upper.lerp(texel(0.0, 1.0).lerp(texel(1.0, 1.0), part.x), part.y)
    }

    /// The mean linear colour of all texels, each channel in 0..=1.
    pub fn mean(&self) -> Rgb {
        let sum: Rgb = self.texels.iter().map(|texel| linear(*texel)).sum();
        sum / self.texels.len().max(1) as f64
    }
}

fn linear(texel: [u8; 3]) -> Rgb {
    Rgb::from_array(texel.map(|channel| f64::from(decode_srgb(channel))))
}

/// A texture that knows the mean colours of parts of it.
///
/// Sums along the rows make the integral over a piece of a row one subtraction, however long it is.
pub(crate) struct TextureSums {
    width: usize,
    height: usize,
    /// Row after row, `width` + 1 sums of the texels to the left, in units of 1/65535.
    sums: Vec<[u32; 3]>,
}

impl TextureSums {
    /// The sums of a valid texture.
    pub fn new(texture: &Texture) -> Self {
        let width = texture.width as usize;
        let units: Vec<u32> =
            (0..=255).map(|channel| (f64::from(decode_srgb(channel)) * 65535.0).round() as u32).collect();
        let mut sums = Vec::with_capacity(texture.texels.len() + texture.height as usize);
        for row in texture.texels.chunks(width) {
            let mut sum = [0u32; 3];
            sums.push(sum);
            for texel in row {
                for (sum, channel) in sum.iter_mut().zip(texel) {
                    *sum += units[*channel as usize];
                }
                sums.push(sum);
            }
        }
        Self { width, height: texture.height as usize, sums }
    }

    /// The mean linear colour over a triangle of texture coordinates; none where it has no area.
    pub fn mean(&self, triangle: [DVec2; 3]) -> Option<Rgb> {
        let size = DVec2::new(self.width as f64, self.height as f64);
        // Near the origin, so that no digits are lost far from it.
        let base = triangle[0].floor();
        let corners = triangle.map(|corner| (corner - base) * size);
        let (low, high) = corners
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), corner| (low.min(corner.y), high.max(corner.y)));
        let count = (2.0 * (high - low)).ceil().clamp(FEWEST_SCANLINES, MOST_SCANLINES);
        let (mut colour, mut length) = (Rgb::ZERO, 0.0);
        for line in 0..count as u32 {
            let y = low + (high - low) * (f64::from(line) + 0.5) / count;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
                if (a.y <= y) != (b.y <= y) {
                    let x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            if right > left {
                let row = (y.floor() as i64).rem_euclid(self.height as i64) as usize;
                colour += self.integral(row, right) - self.integral(row, left);
                length += right - left;
            }
        }
        // A thousandth of a texel wide on the mean: the subtractions above would be of nothing but rounding.
        (length > 1e-3 * count).then(|| (colour / length).clamp(Rgb::ZERO, Rgb::ONE))
    }

    /// The mean along the outline of a footprint that has no area.
    pub fn mean_of_outline(&self, outline: &[DVec2]) -> Rgb {
        let size = DVec2::new(self.width as f64, self.height as f64);
        let (mut sum, mut count) = (Rgb::ZERO, 0.0);
        for (i, &from) in outline.iter().enumerate() {
            let to = outline[(i + 1) % outline.len()];
            for point in 0..EDGE_POINTS {
                let place = from.lerp(to, (f64::from(point) + 0.5) / f64::from(EDGE_POINTS));
                let [x, y] = ((place - place.floor()) * size).to_array();
                let row = (y as usize).min(self.height - 1) * (self.width + 1);
                let column = (x as usize).min(self.width - 1);
                sum += self.units(row + column + 1) - self.units(row + column);
                count += 65535.0;
            }
        }
        if count > 0.0 { sum / count } else { Rgb::ONE }
    }

    fn units(&self, index: usize) -> Rgb {
        Rgb::from_array(self.sums[index].map(f64::from))
    }

    /// The integral of a row from 0 to `x`, in texels; the row repeats.
    fn integral(&self, row: usize, x: f64) -> Rgb {
        let (width, first) = (self.width as f64, row * (self.width + 1));
        let repeats = (x / width).floor();
        let place = (x - repeats * width).clamp(0.0, width);
        let column = (place as usize).min(self.width - 1);
        let before = self.units(first + column);
        let here = self.units(first + column + 1) - before;
        (self.units(first + self.width) * repeats + before + here * (place - column as f64)) / 65535.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black and white, alternating both ways.
    fn checkers(width: u32, height: u32) -> Texture {
        let texel = |i: u32| if (i % width + i / width).is_multiple_of(2) { [0; 3] } else { [255; 3] };
        Texture { name: "checkers".into(), width, height, texels: (0..width * height).map(texel).collect() }
    }

    #[test]
    fn a_size_that_the_texels_do_not_have_is_not_valid() {
        assert!(!Texture::default().is_valid());
        assert!(!Texture { width: u32::MAX, height: u32::MAX, ..checkers(1, 1) }.is_valid());
        assert!(checkers(3, 2).is_valid());
        // Not valid, and yet nothing breaks.
        assert_eq!(Texture::default().sample(Vec2::splat(0.3)), Vec3::ZERO);
        assert_eq!(Texture::default().mean(), Rgb::ZERO);
    }

    #[test]
    fn samples_meet_the_texels_and_repeat() {
        let texture = checkers(4, 2);
        let middle = |x: u32, y: u32| Vec2::new((x as f32 + 0.5) / 4.0, (y as f32 + 0.5) / 2.0);
        for shift in [Vec2::ZERO, Vec2::new(3.0, -2.0)] {
            assert!(texture.sample(middle(0, 0) + shift).length() < 1e-6);
            assert!((texture.sample(middle(3, 0) + shift) - Vec3::ONE).length() < 1e-6);
            assert!((texture.sample(Vec2::ZERO + shift) - Vec3::splat(0.5)).length() < 1e-6);
        }
    }

    #[test]
    fn means_of_triangles_against_areas_by_hand() {
        // Left half black, right half white.
        let texture = Texture { name: String::new(), width: 2, height: 1, texels: vec![[0; 3], [255; 3]] };
        let sums = TextureSums::new(&texture);
        let mean = |points: [(f64, f64); 3]| sums.mean(points.map(|(u, v)| DVec2::new(u, v))).map(|colour| colour.x);
        let near = |found: Option<f64>, exact: f64| {
            assert!(found.is_some_and(|found| (found - exact).abs() < 4e-3), "{found:?} {exact}");
        };
        near(mean([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), 0.25);
        near(mean([(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]), 0.75);
        near(mean([(-7.0, 5.0), (-7.0, 6.0), (-6.0, 5.0)]), 0.25);
        near(mean([(0.6, 0.1), (0.9, 0.1), (0.7, 0.9)]), 1.0);
        // Many repeats are as bright as the whole.
        near(mean([(0.0, 0.0), (300.0, 10.0), (20.0, 200.0)]), 0.5);
        assert_eq!(mean([(0.2, 0.2); 3]), None);
        assert_eq!(mean([(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)]), None);
        assert_eq!(sums.mean_of_outline(&[DVec2::new(0.75, 0.5); 3]), Rgb::ONE);
        assert!((sums.mean_of_outline(&[DVec2::ZERO, DVec2::X]).x - 0.5).abs() < 1e-12);
        assert_eq!(sums.mean_of_outline(&[]), Rgb::ONE);
    }
}
