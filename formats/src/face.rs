//! A face on its way from the file to a polygon of the scene.

use glam::DVec3;

/// One corner of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Corner {
    /// Index of its position.
    pub vertex: u32,
    /// What else the file says of the corner: equal where texture coordinate and shading normal are equal.
    pub seam: u32,
}

/// A face: its outline counter-clockwise from the front, what it is made of, and where it stands in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Face {
    pub corners: Vec<Corner>,
    pub material: u32,
    pub object: u32,
    /// Line of the file, counted from 1.
    pub line: usize,
}

impl Face {
    /// The positions of the corners.
    pub fn outline(&self, vertices: &[DVec3]) -> Vec<DVec3> {
        outline(&self.corners, vertices)
    }
}

/// The positions of corners.
pub(crate) fn outline(corners: &[Corner], vertices: &[DVec3]) -> Vec<DVec3> {
    corners.iter().map(|corner| vertices[corner.vertex as usize]).collect()
}

/// The diagonal of the box around an outline, metres: what "the size of a polygon" means here.
pub(crate) fn size(outline: &[DVec3]) -> f64 {
    let low = outline.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = outline.iter().copied().reduce(DVec3::max).unwrap_or_default();
    low.distance(high)
}
