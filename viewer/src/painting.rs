//! The panels as triangles: what egui hands to whoever paints them.

use egui::{ClippedPrimitive, TexturesDelta};

/// One frame of the panels.
pub(crate) struct Painting {
    /// Triangles, back to front.
    pub primitives: Vec<ClippedPrimitive>,
    /// Textures that are new, and that are no longer needed.
    pub textures: TexturesDelta,
    /// Physical pixels of one point.
    pub pixels_per_point: f32,
}

impl Drop for Painting {
    fn drop(&mut self) {
        // egui panics, in a debug build, over textures that nobody has taken; a window that ends does not.
        self.textures.clear();
    }
}
