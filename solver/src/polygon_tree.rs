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
