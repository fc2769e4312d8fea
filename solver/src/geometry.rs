//! The scene's polygons as the solver asks for them again and again: outlines, planes, tolerances.

use glam::DVec3;
use scene::{Plane, Scene};

/// Distance below which a point touches a polygon, as a fraction of the scene's size. Above the rounding of welded
/// coordinates, below any gap that a modeller means.
const CONTACT_TOLERANCE: f64 = 1e-9;

/// Outlines and planes of all polygons, by id.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Corners of each polygon, counter-clockwise from its front, metres.
    pub outlines: Vec<Vec<DVec3>>,
    /// Plane of each polygon.
    pub planes: Vec<Plane>,
    /// Diagonal of the scene's bounding box, metres.
    pub size: f64,
    /// Distance below which a point touches a polygon, metres.
    pub contact_tolerance: f64,
}

impl Geometry {
    /// Looks a scene over once.
    pub fn new(scene: &Scene) -> Self {
        let outlines: Vec<_> = scene.polygon_ids().map(|polygon| scene.outline(polygon)).collect();
        let planes = outlines.iter().map(|outline| Plane::through(outline)).collect();
        let size = scene.size();
        Self { outlines, planes, size, contact_tolerance: size * CONTACT_TOLERANCE }
    }

    /// Corners of a polygon.
    pub fn outline(&self, polygon: u32) -> &[DVec3] {
        &self.outlines[polygon as usize]
    }

    /// Plane of a polygon.
    pub fn plane(&self, polygon: u32) -> Plane {
        self.planes[polygon as usize]
    }
}
