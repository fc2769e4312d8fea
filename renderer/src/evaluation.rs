//! What a sampler asks of the world: the light at a point of the image plane. Samplers know nothing else of a scene.

use glam::{DVec2, Vec3};

/// What is seen at a point of the image plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// The surface that is seen: the same number wherever nothing but light changes, another one beyond an edge; 0 where nothing
    /// is seen.
    pub object: u32,
    /// Rays followed to find it out, that from the eye included.
    pub cost: u32,
}

/// From a point of the image plane to what is seen there. Points are in pixels from the upper left corner; the centre of a pixel
/// is at (i + ½, j + ½). The same point always sees the same.
pub type Evaluator<'a> = dyn Fn(DVec2) -> Evaluation + Sync + 'a;
