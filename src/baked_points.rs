//! The light of a bake at points of its surfaces.

use renderer::SurfacePoint;
use scene::{Baked, Bvh, Rgb};

/// How far a point of a surface may lie from the triangle of the mesh that stands for it, as a fraction of the scene's size: the
/// mesh has positions in f32.
const REACH: f64 = 1e-6;

/// A bake, and what finds its triangles.
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

    /// Irradiance, W·m⁻²; nothing where the mesh has no triangle.
    pub fn irradiance(&self, point: &SurfacePoint) -> Rgb {
        self.locate(point).map_or(Rgb::ZERO, |(triangle, s, t)| self.baked.irradiance(triangle, s, t))
    }

    /// The part of it that does not come straight from the scene's environment.
    pub fn irradiance_from_surfaces(&self, point: &SurfacePoint) -> Rgb {
        self.locate(point).map_or(Rgb::ZERO, |(triangle, s, t)| self.baked.irradiance_from_surfaces(triangle, s, t))
    }

    fn locate(&self, point: &SurfacePoint) -> Option<(u32, f64, f64)> {
        self.baked.locate(&self.mesh, point.position, point.normal, self.reach)
    }
}
