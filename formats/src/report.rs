//! What an import found and did.

use serde::Serialize;

/// Counts of what an import found and repaired, and a sentence for each thing that a user should know.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImportReport {
    /// Faces in the file.
    pub polygons_read: usize,
    /// Positions that became one with an earlier, equal or very near one. Objects that share a vertex of the file count
    /// it once each.
    pub welded_vertices: usize,
    /// Faces of fewer than three distinct corners or without area: skipped.
    pub degenerate_faces: usize,
    /// Faces whose outline crosses itself: skipped.
    pub crossing_faces: usize,
    /// Faces that repeat an earlier one, corner for corner with the same front: skipped.
    pub repeated_faces: usize,
    /// Faces that were not planar: split into planar pieces.
    pub non_planar_faces: usize,
    /// Planar faces that were not convex: split into convex pieces.
    pub concave_faces: usize,
    /// By how many polygons the merging of triangles made the scene smaller.
    pub merged_faces: usize,
    /// Corners inserted where a vertex of another face lies on an open edge.
    pub junctions: usize,
    /// Such corners that would have bent their polygon, and were left out.
    pub open_junctions: usize,
    /// Faces that were wound against the larger part of their surface: turned.
    pub turned_faces: usize,
    /// Surfaces that no turning makes consistent, like a Möbius strip: left as they are.
    pub one_sided_surfaces: usize,
    /// Polygons added as the other sides of ones that the file has.
    pub other_sides: usize,
    /// Materials that faces use and no library defines: grey.
    pub missing_materials: usize,
    /// Materials whose reflectance was limited.
    pub clamped_materials: usize,
    /// Materials with a texture that is not read: no image, or a texture of something else than reflectance.
    pub textured_materials: usize,
    /// Materials that reflect as a mirror or a metal does and are taken as diffuse.
    pub mirror_materials: usize,
    /// Faces that are seen through for the most part: left out.
    pub transparent_faces: usize,
    /// One sentence for each kind of problem: how many, where the first is, what was done, and the cure.
    pub warnings: Vec<String>,
}

impl ImportReport {
    /// Adds what another import found.
    pub(crate) fn add(&mut self, other: Self) {
        self.polygons_read += other.polygons_read;
        self.missing_materials += other.missing_materials;
        self.clamped_materials += other.clamped_materials;
        self.textured_materials += other.textured_materials;
        self.mirror_materials += other.mirror_materials;
        self.transparent_faces += other.transparent_faces;
        self.warnings.extend(other.warnings);
    }

    pub(crate) fn warn(&mut self, sentence: impl Into<String>) {
        self.warnings.push(sentence.into());
    }
}

/// A count and its noun.
pub(crate) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
