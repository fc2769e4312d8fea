//! Blockers before a source: only what lies in front of the source's plane can hide it.

use glam::DVec3;
use scene::Plane;

use crate::clip::clip_convex;
use crate::geometry::Geometry;

/// A blocking polygon, or the part of it in front of one source's plane.
#[derive(Clone, Debug)]
pub enum Blocker {
    /// All of a polygon.
    Whole {
        /// The polygon.
        polygon: u32,
    },
    /// The part in front of the source's plane of a polygon that crosses it.
    Part {
        /// Corners, metres.
        outline: Vec<DVec3>,
        /// Unit normal of the polygon.
        normal: DVec3,
    },
}

impl Blocker {
    /// What a polygon can hide of a source in the given plane; none for a polygon behind it.
    pub fn before(geometry: &Geometry, source: &Plane, polygon: u32) -> Option<Self> {
        let (outline, tolerance) = (geometry.outline(polygon), geometry.contact_tolerance);
        let depths = || outline.iter().map(|&corner| source.distance(corner));
        if depths().all(|depth| depth <= tolerance) {
            return None;
        }
        if depths().all(|depth| depth >= -tolerance) {
            return Some(Self::Whole { polygon });
        }
        let mut part = Vec::new();
        clip_convex(outline, tolerance, |p| source.distance(p), &mut part);
        let normal = geometry.plane(polygon).normal;
        (!part.is_empty()).then_some(Self::Part { outline: part, normal })
    }

    /// Corners and unit normal.
    pub fn shape<'a>(&'a self, geometry: &'a Geometry) -> (&'a [DVec3], DVec3) {
        match self {
            Self::Whole { polygon } => (geometry.outline(*polygon), geometry.plane(*polygon).normal),
            Self::Part { outline, normal } => (outline, *normal),
        }
    }
}
