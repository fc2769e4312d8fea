//! Dim sources: polygons so small, far or dark that their outline is not worth its exact shadow at a point.

use std::f64::consts::PI;

use glam::DVec3;
use scene::{Rgb, Scene, luminance};

use crate::Solution;
use crate::backprojection::Viewpoint;

/// A polygon as it shines from its centre.
#[derive(Clone, Debug)]
pub struct DimSource {
    /// Area centroid, metres.
    pub centre: DVec3,
    /// Distance from the centre to the farthest corner, metres.
    radius: f64,
    area: f64,
    radiosity: Rgb,
    /// Luminance of the brightest spot's radiosity, W·m⁻².
    brightest: f64,
}

impl DimSource {
    /// A polygon that may be dim; none for emitters and for polygons that were cut, which are large and in the middle
    /// of things.
    pub fn of(scene: &Scene, solution: &Solution, polygon: u32) -> Option<Self> {
        let elements = &solution.elements;
        if scene.material(polygon).emits() || !solution.is_one_patch(polygon) {
            return None;
        }
        let root = solution.patch_roots(polygon).next()?;
        let node = &elements.nodes[root as usize];
        let radius = elements.outline(root).iter().map(|corner| corner.distance(node.centre)).fold(0.0, f64::max);
        let brightness = |node: u32| luminance(solution.radiosity(scene, node));
        let brightest = solution.leaves_of(polygon).into_iter().map(brightness).fold(0.0, f64::max);
        let radiosity = solution.radiosity(scene, root);
        Some(Self { centre: node.centre, radius, area: node.area, radiosity, brightest })
    }

    /// A bound of the irradiance at a position `depth` metres in front of the source's plane, luminance, W·m⁻².
    pub fn most_irradiance(&self, depth: f64, position: DVec3) -> f64 {
        let nearest = self.centre.distance(position) - self.radius;
        if nearest <= 0.0 {
            return f64::INFINITY;
        }
        self.brightest * self.area * (depth / nearest).min(1.0) / (PI * nearest * nearest)
    }

    /// Irradiance from the whole source as if it were at its centre, W·m⁻²; nothing if the centre is `hidden`.
    pub fn irradiance(&self, depth: f64, from: &Viewpoint, hidden: impl FnOnce() -> bool) -> Rgb {
        let offset = self.centre - from.position;
        let height = from.up.dot(offset);
        if height <= 0.0 || hidden() {
            return Rgb::ZERO;
        }
        self.radiosity * (self.area * height * depth / (PI * offset.length_squared().powi(2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::form_factor_at;
    use crate::testing::Builder;
    use crate::{SolveOptions, solve};

    #[test]
    fn from_afar_it_is_the_form_factor_and_never_above_the_bound() {
        let plate = [(0., 0.), (0.2, 0.), (0.2, 0.1), (0., 0.1)].map(|(x, y)| DVec3::new(x, y, 2.0));
        let lamp = plate.map(|p| DVec3::new(p.x, -p.y, 5.0 - 4.0 * p.y));
        let scene = Builder::default().material(0.5, 0.0).polygon(&plate).material(0.0, 3.0).polygon(&lamp).build();
        let mut solution = solve(&scene, &SolveOptions::default(), &|_| ());
        for light in &mut solution.light {
            *light = crate::ElementLight { irradiance: Rgb::splat(4.0), ..Default::default() };
        }
        assert!(DimSource::of(&scene, &solution, 1).is_none(), "an emitter is never dim");
        let source = DimSource::of(&scene, &solution, 0).expect("the plate is whole");
        for (x, z) in [(0.0, 0.0), (2.0, -1.0), (0.5, 1.0), (0.1, 1.9)] {
            let position = DVec3::new(x, 0.3, z);
            // The plate's front is +z: from below it is behind, so look from above at its mirror image.
            let above = DVec3::new(position.x, position.y, 4.0 - position.z);
            let from = Viewpoint { position: above, up: -DVec3::Z, inward: DVec3::ZERO };
            let exact = 2.0 * form_factor_at(above, -DVec3::Z, &plate);
            let depth = above.z - 2.0;
            let dim = source.irradiance(depth, &from, || false).x;
            let apart = above.distance(source.centre) / source.radius;
            assert!((dim / exact - 1.0).abs() < 2.0 / (apart * apart), "{position}: {dim} {exact}");
            assert!(exact <= source.most_irradiance(depth, above));
            assert_eq!(source.irradiance(depth, &from, || true), Rgb::ZERO);
        }
    }
}
