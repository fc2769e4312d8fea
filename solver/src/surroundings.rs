//! What surrounds a point whatever its light is: the scene's polygons, bodies, emitters and patches, each as a point asks for
//! them. Elements and light change while a scene is baked, these do not: one look at the scene serves all gathers.

use scene::{Bvh, Scene, luminance};

use crate::emitter::{Emitter, emitter_tree, emitters};
use crate::geometry::Geometry;
use crate::light_tree::LightTree;
use crate::polygon_tree::PolygonTree;
use crate::ray_gather::SMALL_LEAF;
use crate::solid::Solids;
use crate::{Elements, Solution, Visibility};

/// A scene and the patches of its solutions, prepared for gathers.
pub struct Surroundings<'a> {
    /// The scene.
    pub scene: &'a Scene,
    pub(crate) geometry: Geometry,
    pub(crate) solids: Solids,
    pub(crate) tree: PolygonTree,
    pub(crate) emitters: Vec<Emitter>,
    /// Where there are no links to say which emitters an element sees.
    pub(crate) emitter_tree: Option<LightTree>,
    /// Where there are none to say which reflectors it sees.
    pub(crate) patches: Option<PatchTree>,
    /// By polygon, luminance of its reflectance.
    pub(crate) reflectances: Vec<f64>,
    /// Area below which an element is small, m².
    pub(crate) small: f64,
}

/// A hierarchy over patches, for rays.
pub(crate) struct PatchTree {
    pub bvh: Bvh,
    /// By triangle of the hierarchy, the patch that it is a part of.
    pub patches: Vec<u32>,
}

impl<'a> Surroundings<'a> {
    /// Looks a scene over once, and the patches of a solution of it. They serve all solutions with the same patches.
    pub fn new(scene: &'a Scene, solution: &Solution) -> Self {
        let geometry = Geometry::new(scene);
        let emitters = emitters(scene);
        let has_links = solution.visibility == Visibility::Links;
        Self {
            solids: Solids::new(scene, &geometry),
            tree: PolygonTree::new(scene),
            emitter_tree: (!has_links).then(|| emitter_tree(scene, &emitters)),
            patches: (!has_links && solution.reflects()).then(|| PatchTree::new(&solution.elements)),
            reflectances: scene.polygon_ids().map(|polygon| luminance(scene.reflectance(polygon))).collect(),
            small: SMALL_LEAF * scene.surface_area(),
            scene,
            geometry,
            emitters,
        }
    }
}

impl PatchTree {
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
