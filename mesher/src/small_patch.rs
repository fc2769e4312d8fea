//! Small patches of scenes of many: one look at the emitters in the middle stands for all samples of such a patch, until a
//! probe elsewhere on it says otherwise and it is divided. A tessellated lamp or chair so costs two looks a triangle, not
//! seven. Where it has shading normals this is what it passes on; what is looked at is looked for at every sample, so that
//! neighbours agree where they meet.

use glam::DVec3;
use solver::{Cosine, Solution, Visibility};

use crate::SampleQuery;

/// The query in the middle of the patch that stands for a query, if the patch is shorter than `length`, metres, has not been
/// divided, the scene is one without links, and the light is not looked at by shading normals.
pub(crate) fn middle_of_small(solution: &Solution, query: &SampleQuery, length: f64) -> Option<SampleQuery> {
    let elements = &solution.elements;
    let root = elements.patches[elements.patch_of(query.element)? as usize].root;
    let is_small = solution.visibility == Visibility::Rays
        && query.cosine == Cosine::Own
        && query.element == root
        && elements.cell_length(root) < length
        && elements.nodes[root as usize].child_count == 0;
    let position = elements.nodes[root as usize].centre;
    is_small.then_some(SampleQuery { position, inward: DVec3::ZERO, ..*query })
}
