//! The edges of faces, those between the same two vertices side by side.

use crate::face::Face;

/// One side of one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Its two vertices, the smaller first.
    pub ends: [u32; 2],
    /// The face, as its place in the list.
    pub face: u32,
    /// The corner of the face that it starts at.
    pub corner: u32,
    /// Whether it runs from the greater vertex to the smaller.
    pub down: bool,
}

/// All sides of faces, sorted: those between the same two vertices stand side by side.
pub(super) fn sorted_sides(faces: &[Face]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(faces.iter().map(|face| face.corners.len()).sum());
    for (id, face) in (0..).zip(faces) {
        for (place, corner) in (0..).zip(&face.corners) {
            let next = face.corners[(place as usize + 1) % face.corners.len()].vertex;
            let ends = [corner.vertex.min(next), corner.vertex.max(next)];
            sides.push(Side { ends, face: id, corner: place, down: corner.vertex > next });
        }
    }
    sides.sort_unstable();
    sides
}
