//! Points of a bake's surfaces: where on its mesh they lie.

use renderer::SurfacePoint;
use scene::{Baked, Bvh};

/// How far a point of a surface may lie from the triangle of the mesh that stands for it, as a fraction of the scene's size: the
/// mesh has positions in f32.
const REACH: f64 = 1e-6;

/// Finds triangles of a bake.
pub struct BakedPoints<'a> {
    baked: &'a Baked,
    mesh: Bvh,
    /// Metres.
    reach: f64,
}

impl<'a> BakedPoints<'a> {
    /// Prepares a search on a valid bake.
    pub fn new(baked: &'a Baked) -> Self {
        Self { baked, mesh: baked.bvh(), reach: REACH * baked.scene.size() }
    }

    /// The triangle that a point lies on, and its barycentrics (s, t) there; none where the mesh has no triangle.
    pub fn locate(&self, point: &SurfacePoint) -> Option<(u32, f64, f64)> {
        self.baked.locate(&self.mesh, point.position, point.normal, self.reach)
    }
}
