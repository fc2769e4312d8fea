//! What every node reflects, and what rows receive of it: in the digits that light needs, so that the light of a room stays in a
//! processor's cache.

use glam::Vec3;
use rayon::prelude::*;
use scene::{Rgb, Scene, Seen};
use solver::{ElementLight, Solution};

/// What a sample sees of the reflectors.
pub(crate) type Row = [Seen];

/// By node, its radiosity in the middle, W·m⁻², and its change by the unit of a row's offsets along u and v.
pub(crate) struct Radiosity(Vec<[Vec3; 3]>);

impl Radiosity {
    /// Of the light that a solution has.
    pub fn of(scene: &Scene, solution: &Solution) -> Self {
        let node = |(node, light): (usize, &ElementLight)| {
            let polygon = solution.elements.polygon_of(node as u32);
            let reflectance = polygon.map_or(Rgb::ZERO, |polygon| scene.reflectance(polygon));
            let unit = solution.elements.cell_length(node as u32) / f64::from(Seen::LENGTH);
            [light.irradiance, light.gradient_u * unit, light.gradient_v * unit]
                .map(|part| (reflectance * part).as_vec3())
        };
        Self(solution.light.par_iter().enumerate().with_min_len(256).map(node).collect())
    }

    /// How much what a row sees differs by direction: the standard deviation of its radiosity, relative to its mean.
    pub fn spread(&self, row: &Row) -> f64 {
        let [mut all, mut sum, mut square] = [0.0; 3];
        for seen in row {
            let radiosity = f64::from(self.0[seen.node as usize][0].element_sum());
            let part = f64::from(seen.form_factor());
            all += part;
            sum += part * radiosity;
            square += part * radiosity * radiosity;
        }
        // What meets nothing sees the dark.
        let variance = square * all.max(1.0) - sum * sum;
        if sum > 0.0 { variance.max(0.0).sqrt() / sum } else { 0.0 }
    }

    /// What rows receive, W·m⁻².
    pub fn received(&self, rows: &[&Row]) -> Vec<Vec3> {
        let part = |seen: &Seen| {
            let [middle, along_u, along_v] = self.0[seen.node as usize];
            // Light that is linear and nowhere negative is nowhere more than twice its mean.
            let [u, v] = seen.offset.map(f32::from);
            let there = middle + along_u * u + along_v * v;
            there.min(middle * 2.0).max(Vec3::ZERO) * seen.form_factor()
        };
        rows.par_iter().with_min_len(64).map(|row| row.iter().map(part).sum::<Vec3>()).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn light_that_differs_by_direction_is_spread() {
        let radiosity = Radiosity([0.0, 3.0, 3.0].map(|light| [Vec3::splat(light), Vec3::ZERO, Vec3::ZERO]).to_vec());
        let seen = |node: u32, form_factor: f64| Seen::new(node, form_factor, DVec2::ZERO);
        let spread = |row: &[Seen]| radiosity.spread(row);
        assert_eq!([spread(&[]), spread(&[seen(0, 1.0)]), spread(&[seen(1, 0.5), seen(2, 0.5)])], [0.0; 3]);
        assert_eq!(spread(&[seen(0, 0.5), seen(1, 0.25), seen(2, 0.25)]), 1.0);
        assert_eq!(spread(&[seen(1, 0.5)]), 1.0, "the rest is dark");
        assert!(spread(&[seen(0, 0.9), seen(1, 0.1)]) > 2.9);
    }

    /// Light of 2 in the middle of a node that rises by 4 along it.
    #[test]
    fn what_is_received_is_linear_but_neither_negative_nor_more_than_twice_the_mean() {
        let rise = Vec3::splat(4.0 / Seen::LENGTH);
        let radiosity = Radiosity(vec![[Vec3::splat(2.0), rise, Vec3::ZERO]]);
        let rows = [0.0, 0.25, -0.75, 0.75].map(|u| [Seen::new(0, 0.5, DVec2::new(u, 0.3))]);
        let rows: Vec<&Row> = rows.iter().map(|row| row.as_slice()).chain([[].as_slice()]).collect();
        let received: Vec<f32> = radiosity.received(&rows).iter().map(|light| light.x).collect();
        for (found, expected) in received.iter().zip([1.0, 1.5, 0.0, 2.0, 0.0]) {
            assert!((found - expected).abs() < 0.05, "{received:?}");
        }
    }
}
