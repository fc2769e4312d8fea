//! What a bake holds in memory: counted from the lengths of its tables, so that the same bake is stopped by the same limit at the
//! same place on every machine.

use glam::Vec3;
use solver::Solution;

use crate::fine_mesh::FineMesh;
use crate::samples::QueryKey;
use crate::{MeshTriangle, SampleQuery};

/// Bytes of an entry of a map from queries to answers, with the part of the table that is empty on average.
const ENTRY: usize = size_of::<(QueryKey, u32)>() * 8 / 5;

/// Bytes of an answer about emitters, of which a part may be the sky's.
pub(crate) const fn emitted(has_sky: bool) -> usize {
    ENTRY + size_of::<Vec3>() * if has_sky { 2 } else { 1 }
}

/// Bytes of a row without what is seen in it.
const ROW: usize = ENTRY + size_of::<usize>();

/// Bytes that a row is expected to take where none is known yet: a room shows some fifty elements to a point.
pub(crate) const TYPICAL_ROW: usize = row(50);

/// Meshes that are held at a time: the best so far, and one while it replaces another; and as much again on the way to one. With it
/// the count of a bake of hundreds of megabytes is what rooms and halls were seen to take at most, to a fifth.
const MESHES: usize = 6;

/// Bytes of a row that names so many elements.
pub(crate) const fn row(length: usize) -> usize {
    ROW + length * size_of::<scene::Seen>()
}

/// Bytes of a solution, and of meshes like the one given; what was found out comes on top.
pub(crate) fn held(solution: &Solution, fine: &FineMesh) -> usize {
    let Solution { elements, cuts, links, blockers, irradiance, direct, light, outlooks, .. } = solution;
    let solution = size_of_val(elements.nodes.as_slice())
        + size_of_val(elements.patches.as_slice())
        + size_of_val(elements.outlines.as_slice())
        + cuts.iter().map(|cuts| size_of_val(cuts.as_slice())).sum::<usize>()
        + size_of_val(links.as_slice())
        + blockers.bytes()
        + size_of_val(outlooks.as_slice())
        + [irradiance, direct, light].map(|light| size_of_val(light.as_slice())).iter().sum::<usize>();
    let of_sample = size_of::<SampleQuery>() + 2 * size_of::<Vec3>();
    let of_triangle = size_of::<MeshTriangle>() + size_of::<[u32; 6]>() + size_of::<Vec3>();
    let mesh = size_of_val(fine.leaves.as_slice())
        + size_of_val(fine.mesh.vertices.as_slice())
        + fine.table.queries.len() * of_sample
        + fine.triangles() * of_triangle;
    solution + MESHES * mesh
}
