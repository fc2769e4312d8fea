//! Directions drawn by how much light comes from them: a table over the cells of a picture of all directions.
//!
//! As in Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.5.2, a row is drawn and then a cell
//! of it. Within a cell directions are even over its solid angle, as the light of a texel is, and not over the picture.

use std::f64::consts::PI;

use scene::{Environment, Sky, texel_solid_angle};

/// Rows of the table of a sky by the standard, and half of its columns: cells of 0.7°, over which the light
/// beside the sun changes by 4 % at most. In finer ones samples would not scatter less.
const ROWS: u32 = 256;

/// The light of every cell of an environment that is not black, without its sun.
pub(crate) struct SkyTable {
    width: u32,
    height: u32,
    /// By cell, row by row, its own light and that of all cells before it: radiance, summed over colours, × solid angle.
    ends: Vec<f64>,
    /// Solid angle of the cells of a row, sr.
    solid_angles: Vec<f64>,
}

impl SkyTable {
    /// The table of a valid environment, a cell for each texel of a map; none if all of them are black.
    pub fn new(environment: &Environment) -> Option<Self> {
        let (width, height) = match &environment.sky {
            Sky::Map(map) => (map.width, map.height),
            Sky::Cie(_) => (2 * ROWS, ROWS),
        };
        let solid_angles: Vec<f64> = (0..height).map(|row| texel_solid_angle(width, height, row)).collect();
        let mut ends = Vec::with_capacity(width as usize * height as usize);
        let mut sum = 0.0;
        for (row, solid_angle) in (0..height).zip(&solid_angles) {
            let v = (f64::from(row) + 0.5) / f64::from(height);
            for column in 0..width {
                let u = (f64::from(column) + 0.5) / f64::from(width);
                sum += environment.radiance_at(u, v).element_sum() * solid_angle;
                ends.push(sum);
            }
        }
        (sum > 0.0 && sum.is_finite()).then_some(Self { width, height, ends, solid_angles })
    }

    /// The place in the picture that two uniform numbers in 0..1 draw.
    pub fn draw(&self, [across, down]: [f64; 2]) -> (f64, f64) {
        let (width, height) = (self.width as usize, self.height as usize);
        let (row, down) = part(0.0, height, |row| self.ends[row * width + width - 1], down);
        let start = self.start(row * width);
        let (column, across) = part(start, width, |column| self.ends[row * width + column], across);
        let edge = |row: usize| (PI * row as f64 / height as f64).cos();
        let cosine = edge(row) + (edge(row + 1) - edge(row)) * down;
        ((column as f64 + across) / width as f64, cosine.clamp(-1.0, 1.0).acos() / PI)
    }

    /// The density with which directions at a place are drawn, sr⁻¹.
    pub fn density(&self, (u, v): (f64, f64)) -> f64 {
        let cell = |at: f64, cells: u32| ((at * f64::from(cells)) as usize).min(cells as usize - 1);
        let row = cell(v, self.height);
        let index = row * self.width as usize + cell(u, self.width);
        (self.ends[index] - self.start(index)) / (self.ends[self.ends.len() - 1] * self.solid_angles[row])
    }

    /// Light of all cells before one.
    fn start(&self, index: usize) -> f64 {
        if index == 0 { 0.0 } else { self.ends[index - 1] }
    }
}

/// Of parts that begin at `start` and of which each ends at `end`, the one that a share of the whole falls into, and the place
/// in it, 0..=1.
fn part(start: f64, count: usize, end: impl Fn(usize) -> f64, share: f64) -> (usize, f64) {
    let target = start + share * (end(count - 1) - start);
    let (mut first, mut last) = (0, count - 1);
    while first < last {
        let middle = (first + last) / 2;
        if end(middle) > target { last = middle } else { first = middle + 1 }
    }
    let from = if first == 0 { start } else { end(first - 1) };
    let length = end(first) - from;
    // A part without length is met by rounding alone; nothing comes from there.
    (first, if length > 0.0 { ((target - from) / length).clamp(0.0, 1.0) } else { 0.5 })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use glam::{DVec3, Vec3};
    use scene::{CieSky, LatLongMap, UpAxis};

    use super::*;
    use crate::sequence::{Kronecker, Stream};

    fn map(width: u32, height: u32, texels: Vec<Vec3>) -> Environment {
        let sky = Sky::Map(LatLongMap { width, height, texels });
        Environment { sky, up: UpAxis::Z, rotation: 0.4, scale: 2.0 }
    }

    #[test]
    fn what_is_black_has_no_table() {
        assert!(SkyTable::new(&map(2, 1, vec![Vec3::ZERO; 2])).is_none());
        assert!(SkyTable::new(&Environment { scale: 0.0, ..map(1, 1, vec![Vec3::ONE]) }).is_none());
    }

    #[test]
    fn no_number_draws_what_is_black() {
        let mut texels = vec![Vec3::ZERO; 12];
        texels[5] = Vec3::ONE;
        let environment = map(4, 3, texels);
        let table = SkyTable::new(&environment).unwrap();
        for across in [0.0, 0.5, 1.0 - f64::EPSILON] {
            for down in [0.0, 0.5, 1.0 - f64::EPSILON] {
                let (u, v) = table.draw([across, down]);
                assert!((0.25..=0.5).contains(&u) && (1.0 / 3.0..=2.0 / 3.0).contains(&v), "{u}, {v}");
            }
        }
        assert_eq!(table.density((0.1, 0.5)), 0.0);
        assert!((table.density((0.3, 0.5)) * texel_solid_angle(4, 3, 1) - 1.0).abs() < 1e-12);
    }

    /// The mean of 1/density over directions drawn is the solid angle that they fill; of light/density it is all light.
    #[test]
    fn directions_are_drawn_with_the_density_that_is_said() {
        let varied = (0..35).map(|i| Vec3::new((i % 4) as f32, (i % 7) as f32, 1.0)).collect();
        let clear = Sky::Cie(CieSky::new(12, [2.0, 0.6], 0.0).unwrap());
        let clear = Environment { sky: clear, up: UpAxis::Y, rotation: 0.4, scale: 1.0 };
        let half = 2.0 * PI;
        for (environment, lit) in
            [(map(7, 5, varied), 2.0 * half), (map(1, 1, vec![Vec3::ONE]), 2.0 * half), (clear, half)]
        {
            let table = SkyTable::new(&environment).unwrap();
            let mut numbers = Kronecker::<2>::shifted_by(&mut Stream::new(1, 1));
            let count = 1 << 17;
            let (mut angle, mut flow) = (0.0, DVec3::ZERO);
            for _ in 0..count {
                let (u, v) = table.draw(numbers.point());
                let direction = environment.direction(u, v);
                let density = table.density((u, v));
                angle += 1.0 / density / f64::from(count);
                flow += direction / density / f64::from(count);
            }
            assert!((angle / lit - 1.0).abs() < 2e-3, "{angle} sr of {lit}");
            // The mean direction over a half of the sphere is half of its axis.
            let expected = if lit == half { DVec3::Y * half / 2.0 } else { DVec3::ZERO };
            assert!((flow - expected).length() < 2e-2, "{flow}");
        }
    }
}
