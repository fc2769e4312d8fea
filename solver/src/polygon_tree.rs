//! Which polygons touch a point, stand in a shaft, or block a ray: a hierarchy over all of them, asked in place of each.

use std::cell::Cell;

use glam::DVec3;
use scene::{Bvh, Ray, Scene, other_sides};

use crate::geometry::Geometry;
use crate::visibility::{Occlusion, Shaft};

/// What stands in a shaft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stands {
    /// These polygons, ascending; what each hides is for a point to find out.
    Some(Vec<u32>),
    /// Too many to look at each.
    Many,
    /// So much that nothing passes.
    All,
}

/// Polygons whose boxes reach into a shaft, at most, that are looked at one by one. Behind more, rays will tell what is seen
/// in any case.
const MOST_CANDIDATES: usize = 160;

/// A bounding volume hierarchy over the polygons of a scene.
pub struct PolygonTree {
    bvh: Bvh,
    /// By polygon, the one that is the other side of the same surface.
    other_sides: Vec<Option<u32>>,
}

impl PolygonTree {
    /// Looks a scene over once.
    pub fn new(scene: &Scene) -> Self {
        Self { bvh: Bvh::of_scene(scene), other_sides: other_sides(scene) }
    }

    /// Polygons whose padded boxes contain a point to within `reach` metres, ascending.
    pub fn near(&self, point: DVec3, reach: f64) -> Vec<u32> {
        self.ascending(|low, high| (point + reach).cmpge(low).all() && (point - reach).cmple(high).all())
    }

    /// Polygons whose boxes overlap that of an outline, padded by `reach` metres, ascending.
    pub fn around(&self, outline: &[DVec3], reach: f64) -> Vec<u32> {
        let lowest = outline.iter().copied().fold(DVec3::INFINITY, DVec3::min) - reach;
        let highest = outline.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max) + reach;
        self.ascending(|low, high| low.cmple(highest).all() && lowest.cmple(high).all())
    }

    /// What stands in a shaft.
    pub fn in_shaft(&self, geometry: &Geometry, shaft: &Shaft<'_>) -> Stands {
        self.few_in_shaft(geometry, shaft, MOST_CANDIDATES)
    }

    /// The same where more than so many that may stand there are many: a quick look.
    pub fn few_in_shaft(&self, geometry: &Geometry, shaft: &Shaft<'_>, most: usize) -> Stands {
        let mut found = Vec::new();
        let entered = Cell::new(0);
        // Two for each polygon.
        let most_triangles = 2 * most;
        self.bvh.within(
            |low, high| entered.get() <= most_triangles && shaft.may_enter(low, high),
            |polygon| {
                found.push(polygon);
                entered.set(found.len());
            },
        );
        if entered.get() > most_triangles {
            return Stands::Many;
        }
        found.sort_unstable();
        found.dedup();
        if found.len() > most {
            return Stands::Many;
        }
        Self::narrowed(geometry, shaft, found)
    }

    /// What of some polygons, which ascend, stands in a shaft.
    pub fn narrowed(geometry: &Geometry, shaft: &Shaft<'_>, mut polygons: Vec<u32>) -> Stands {
        let mut is_total = false;
        polygons.retain(|&polygon| {
            let occlusion = shaft.classify(geometry.outline(polygon));
            is_total |= occlusion == Occlusion::Total;
            occlusion != Occlusion::Clear
        });
        // Shafts are kept by the hundred thousand.
        polygons.shrink_to_fit();
        if is_total { Stands::All } else { Stands::Some(polygons) }
    }

    /// The nearest polygon that a ray meets, apart from the one that it starts on and its other side.
    pub fn first_met(&self, polygon: u32, origin: DVec3, direction: DVec3) -> Option<u32> {
        self.bvh.closest_hit_among(&Ray { origin, direction }, |other| !self.is_own(polygon, other)).map(|hit| hit.id)
    }

    /// Whether a polygon stands between a point of a polygon and another point, apart from the polygon, its other side, and
    /// those that `passes` lets through.
    pub fn is_blocked(&self, polygon: u32, from: DVec3, to: DVec3, passes: impl Fn(u32) -> bool) -> bool {
        self.bvh.is_blocked_among(from, to, |other| !self.is_own(polygon, other) && !passes(other))
    }

    /// Whether a polygon is the one that rays start from, or its other side.
    pub fn is_own(&self, polygon: u32, other: u32) -> bool {
        other == polygon || self.other_sides[polygon as usize] == Some(other)
    }

    /// Whether a polygon is one of two sides of the same surface.
    pub fn has_other_side(&self, polygon: u32) -> bool {
        self.other_sides[polygon as usize].is_some()
    }

    fn ascending(&self, enters: impl Fn(DVec3, DVec3) -> bool) -> Vec<u32> {
        let mut found = Vec::new();
        self.bvh.within(enters, |polygon| found.push(polygon));
        found.sort_unstable();
        found.dedup();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Builder;

    fn square(corner: DVec3, side: f64) -> [DVec3; 4] {
        [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y].map(|way| corner + way * side)
    }

    fn turned(mut outline: [DVec3; 4]) -> [DVec3; 4] {
        outline.reverse();
        outline
    }

    /// A floor of four by four, 0, under a hundred small plates a metre above it.
    fn floor_under_plates() -> Scene {
        let plate = |i: u32| square(DVec3::new(f64::from(i % 10) * 0.4, f64::from(i / 10) * 0.4, 1.0), 0.1);
        let floor = Builder::default().material(0.5, 0.0).polygon(&square(DVec3::ZERO, 4.0));
        (0..100).fold(floor, |scene, i| scene.polygon(&plate(i))).build()
    }

    #[test]
    fn nothing_is_near_nothing() {
        let tree = PolygonTree::new(&Scene::default());
        assert_eq!(tree.near(DVec3::ZERO, 1.0), []);
        assert_eq!(tree.around(&[], 1.0), []);
        assert!(!tree.is_blocked(0, DVec3::ZERO, DVec3::Z, |_| false));
    }

    #[test]
    fn what_is_near_is_what_a_loop_over_all_finds() {
        let scene = floor_under_plates();
        let tree = PolygonTree::new(&scene);
        let within = |low: DVec3, high: DVec3| -> Vec<u32> {
            let meets = |polygon: &u32| {
                let outline = scene.outline(*polygon);
                let (lowest, highest) = (outline[0], outline[2]);
                lowest.cmple(high).all() && low.cmple(highest).all()
            };
            scene.polygon_ids().filter(meets).collect()
        };
        for (point, reach) in [(DVec3::new(0.43, 0.83, 0.98), 0.05), (DVec3::splat(1.0), 0.37), (DVec3::Z * 9.0, 1.0)] {
            assert_eq!(tree.near(point, reach), within(point - reach, point + reach));
            let outline = square(point, 0.55);
            assert_eq!(tree.around(&outline, reach), within(outline[0] - reach, outline[2] + reach));
        }
    }

    #[test]
    fn a_shaft_has_what_each_polygon_is_classified_as() {
        let scene = floor_under_plates();
        let (tree, geometry) = (PolygonTree::new(&scene), Geometry::new(&scene));
        let (below, above) = (square(DVec3::new(0.3, 0.3, 0.5), 1.0), turned(square(DVec3::new(0.6, 0.5, 1.5), 1.2)));
        let shaft = Shaft::between(&below, &above);
        let stands = |polygon: &u32| shaft.classify(geometry.outline(*polygon)) != Occlusion::Clear;
        let all: Vec<u32> = scene.polygon_ids().filter(stands).collect();
        assert!((5..12).contains(&all.len()) && !all.contains(&0), "{all:?}");
        let few = all.len() - 1;
        assert_eq!(tree.in_shaft(&geometry, &shaft), Stands::Some(all));
        assert_eq!(tree.few_in_shaft(&geometry, &shaft, few), Stands::Many);
        // One plate covers a narrow shaft.
        let narrow = [0.9, 1.1].map(|height| square(DVec3::new(0.42, 0.42, height), 0.05));
        let covered = tree.in_shaft(&geometry, &Shaft::between(&narrow[0], &turned(narrow[1])));
        assert_eq!(covered, Stands::All);
    }

    #[test]
    fn rays_meet_all_but_their_own_polygon_and_what_lets_them_through() {
        let scene = floor_under_plates();
        let tree = PolygonTree::new(&scene);
        let (floor, plate) = (0, 12);
        let [on_floor, beyond] = [0.0, 2.0].map(|height| DVec3::new(0.43, 0.46, height));
        assert_eq!(tree.first_met(floor, on_floor, DVec3::Z), Some(plate));
        assert_eq!(tree.first_met(plate, beyond, -DVec3::Z), Some(floor));
        assert_eq!(tree.first_met(floor, on_floor + DVec3::X * 0.2, DVec3::Z), None);
        assert!(tree.is_blocked(floor, on_floor, beyond, |_| false));
        assert!(!tree.is_blocked(floor, on_floor, beyond, |polygon| polygon == plate));
        assert!(!tree.is_blocked(plate, on_floor, beyond, |_| false));
    }
}
