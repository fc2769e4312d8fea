//! Which patch a ray meets: a hierarchy over all patches of a scene, which stay as they are while their elements are divided.

use scene::Bvh;

use crate::Elements;

/// A bounding volume hierarchy over patches.
pub(crate) struct PatchTree {
    pub bvh: Bvh,
    /// By triangle of the hierarchy, the patch that it is a part of.
    pub patches: Vec<u32>,
}

impl PatchTree {
    /// Looks the patches over once.
    pub fn new(elements: &Elements) -> Self {
        let (mut triangles, mut patches) = (Vec::new(), Vec::new());
        for (id, patch) in (0..).zip(&elements.patches) {
            let outline = elements.outline(patch.root);
            for edge in outline[1..].windows(2) {
                triangles.push([outline[0], edge[0], edge[1]]);
                patches.push(id);
            }
        }
        Self { bvh: Bvh::of_triangles(triangles), patches }
    }
}
