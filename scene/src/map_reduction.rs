//! Pictures of all directions made smaller, with all of their light.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::LatLongMap;

/// Most columns and rows of a map that is part of a scene: texels of 0.18°, a third of the sun, in 25 MB of a bake's file.
const LARGEST: [u32; 2] = [2048, 1024];

impl LatLongMap {
    /// The map, averaged over solid angle to at most 2048 × 1024 texels: what a scene has, whose bake keeps it.
    pub fn bounded(self) -> Self {
        let [width, height] = LARGEST;
        let (width, height) = (self.width.min(width), self.height.min(height));
        if (width, height) == (self.width, self.height) { self } else { self.reduced(width, height) }
    }

    /// The mean radiance of a map, which is not empty, over each texel of another one that is not larger: as much light comes
    /// from each of its texels.
    fn reduced(&self, width: u32, height: u32) -> Self {
        let columns = overlaps(self.width, width, |edge| edge);
        // Solid angle goes by the height of a row on the sphere.
        let rows = overlaps(self.height, height, |edge| -(PI * edge).cos());
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        for row in &rows {
            for column in &columns {
                let mut mean = DVec3::ZERO;
                for &(y, of_row) in row {
                    for &(x, of_column) in column {
                        let texel = self.texels[y as usize * self.width as usize + x as usize];
                        mean += texel.as_dvec3() * (of_row * of_column);
                    }
                }
                texels.push(mean.as_vec3().min(Vec3::MAX));
            }
        }
        Self { width, height, texels }
    }
}

/// By coarse cell of 0..1, the fine cells that it overlaps, and the part of its measure that each makes; `measure` rises.
fn overlaps(fine: u32, coarse: u32, measure: impl Fn(f64) -> f64) -> Vec<Vec<(u32, f64)>> {
    let cell = |i: u32| {
        let [from, to] = [i, i + 1].map(|edge| f64::from(edge) / f64::from(coarse));
        let whole = measure(to) - measure(from);
        let first = (from * f64::from(fine)) as u32;
        let parts = (first..fine).map_while(|j| {
            let [left, right] = [j, j + 1].map(|edge| (f64::from(edge) / f64::from(fine)).clamp(from, to));
            (f64::from(j) < to * f64::from(fine)).then(|| (j, (measure(right) - measure(left)) / whole))
        });
        parts.collect()
    };
    (0..coarse).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texel_solid_angle;

    fn map(width: u32, height: u32) -> LatLongMap {
        let texel = |i: u32| Vec3::new((i % 11) as f32, (i % 7) as f32, if i == 40 { 1e6 } else { 0.0 });
        LatLongMap { width, height, texels: (0..width * height).map(texel).collect() }
    }

    /// ∫ L dω of the rows from one to another.
    fn light(map: &LatLongMap, rows: std::ops::Range<u32>) -> DVec3 {
        let row = |row: u32| {
            let texels = &map.texels[(row * map.width) as usize..][..map.width as usize];
            let sum: DVec3 = texels.iter().map(|texel| texel.as_dvec3()).sum();
            sum * texel_solid_angle(map.width, map.height, row)
        };
        rows.map(row).sum()
    }

    #[test]
    fn small_maps_stay_as_they_are() {
        for (width, height) in [(1, 1), (2048, 1), (3, 1024)] {
            assert_eq!(map(width, height).bounded(), map(width, height));
        }
        let even = LatLongMap { width: 4097, height: 1, texels: vec![Vec3::splat(0.1); 4097] }.bounded();
        assert_eq!((even.width, even.height), (2048, 1));
        assert!(even.texels.iter().all(|texel| (*texel - Vec3::splat(0.1)).abs().max_element() < 1e-7));
    }

    #[test]
    fn no_light_is_lost_and_rows_keep_theirs() {
        let large = map(30, 20);
        for (width, height) in [(30, 10), (15, 20), (7, 9), (1, 1), (29, 19)] {
            let small = large.reduced(width, height);
            assert_eq!((small.width, small.height, small.texels.len() as u32), (width, height, width * height));
            let (before, after) = (light(&large, 0..20), light(&small, 0..height));
            assert!((after / before - DVec3::ONE).abs().max_element() < 1e-6, "{before} {after}");
        }
        let halved = large.reduced(30, 10);
        for row in 0..10 {
            let (before, after) = (light(&large, 2 * row..2 * row + 2), light(&halved, row..row + 1));
            assert!((after - before).abs().max_element() < 1e-6 * before.max_element(), "{before} {after}");
        }
    }
}
