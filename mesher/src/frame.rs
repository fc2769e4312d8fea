//! A leaf's frame: its plane, scaled to unit size.

use glam::{DVec2, DVec3};

use crate::arrangement::on_grid;

/// Coordinates in the plane of a leaf, of order 1 over the leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frame {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    /// Metres per unit: the leaf's diameter.
    pub(crate) scale: f64,
}

impl Frame {
    /// The frame around an outline in the plane across `normal`; u × v = normal.
    pub(crate) fn around(outline: &[DVec3], normal: DVec3) -> Self {
        let origin = outline.first().copied().unwrap_or_default();
        let scale = outline.iter().map(|corner| corner.distance(origin)).fold(0.0, f64::max);
        let u = normal.try_normalize().map_or(DVec3::X, |normal| normal.any_orthonormal_vector());
        Self { origin, u, v: normal.cross(u), scale: if scale > 0.0 { scale } else { 1.0 } }
    }

    /// The nearest point of the plane, in the frame.
    pub(crate) fn to_plane(self, point: DVec3) -> DVec2 {
        let offset = (point - self.origin) / self.scale;
        on_grid(DVec2::new(offset.dot(self.u), offset.dot(self.v)))
    }

    /// The point in space.
    pub(crate) fn to_space(self, point: DVec2) -> DVec3 {
        self.origin + (self.u * point.x + self.v * point.y) * self.scale
    }
}
