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

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use scene::Ray;

    use super::*;
    use crate::testing::Builder;
    use crate::{SolveOptions, solve};

    /// A board that stands on a floor cuts it: a ray from before the middle of each patch meets that patch.
    #[test]
    fn rays_meet_the_patches_of_what_was_cut() {
        let board = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]].map(|[y, z]| DVec3::new(1.0, y, z));
        let floor = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let scene = Builder::default().material(0.5, 0.0).polygon(&floor).polygon(&board).build();
        let elements = solve(&scene, &SolveOptions::default(), &|_| ()).elements;
        let tree = PatchTree::new(&elements);
        assert_eq!(elements.patches.len(), 3);
        for (id, patch) in (0..).zip(&elements.patches) {
            let origin = elements.nodes[patch.root as usize].centre + patch.normal() * 0.1;
            let hit = tree.bvh.closest_hit(&Ray { origin, direction: -patch.normal() }, 0.0);
            assert_eq!(hit.map(|hit| tree.patches[hit.id as usize]), Some(id));
        }
    }
}
