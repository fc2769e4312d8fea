//! What surrounds a point whatever its light is: the scene's polygons, bodies, emitters and patches, each as a point asks for
//! them. Elements and light change while a scene is baked, these do not: one look at the scene serves all gathers.

use glam::DVec3;
use scene::{Scene, centroid, luminance};

use crate::clip::{Position, locate};
use crate::emitter::{Emitter, emitter_tree, emitters};
use crate::geometry::Geometry;
use crate::light_tree::LightTree;
use crate::patch_tree::PatchTree;
use crate::polygon_tree::PolygonTree;
use crate::ray_gather::SMALL_LEAF;
use crate::solid::Solids;
use crate::{Node, NodeId, Solution, Visibility};

/// Cosine between normals from which on polygons lie along each other: what stands upright on an element has its foot on its border.
const ALONG: f64 = 0.5;

/// How far apart the feet on an element are, in what it reaches: two sides of one board have one foot.
const APART: f64 = 0.25;

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

    /// Number of emitters: polygons, or convex bodies that emit the same all over.
    pub fn emitters(&self) -> usize {
        self.emitters.len()
    }

    /// Places on an element that something stands over, no farther off than half its length: the feet of polygons' middles, at most
    /// so many, first of those that hide most.
    pub fn feet(&self, solution: &Solution, element: NodeId, most: usize) -> Vec<DVec3> {
        let elements = &solution.elements;
        let Node { area, .. } = elements.nodes[element as usize];
        let polygon = elements.polygon_of(element).unwrap_or_default();
        let (outline, plane) = (elements.outline(element), self.geometry.plane(polygon));
        let reach = elements.cell_length(element) / 2.0;
        let foot = |other: u32| {
            let (shape, facing) = (self.geometry.outline(other), self.geometry.plane(other));
            let middle = centroid(shape);
            let height = plane.distance(middle);
            let is_over = height > self.geometry.contact_tolerance && height < reach;
            if !is_over || plane.normal.dot(facing.normal).abs() < ALONG {
                return None;
            }
            let foot = middle - plane.normal * height;
            let is_inside = locate(outline, plane.normal, foot, self.geometry.contact_tolerance) == Position::Interior;
            let hides = self.scene.area(other).min(area) / (height * height);
            is_inside.then_some((hides, foot))
        };
        let mut feet: Vec<(f64, DVec3)> = self.tree.around(outline, reach).into_iter().filter_map(foot).collect();
        feet.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<DVec3> = Vec::new();
        for (_, foot) in feet {
            if chosen.len() == most {
                break;
            }
            if chosen.iter().all(|other| other.distance(foot) > APART * reach) {
                chosen.push(foot);
            }
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Builder;
    use crate::{SolveOptions, solve};

    /// A floor under two boards, the nearer one smaller; beside a third; and beyond the reach of one far above. A wall stands on it.
    #[test]
    fn what_stands_over_an_element_has_a_foot_on_it() {
        let board = |x: f64, z: f64, side: f64| {
            let corner = |dx: f64, dy: f64| DVec3::new(x + dx * side, 0.3 + dy * side, z);
            [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)].to_vec()
        };
        let floor = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let wall = [[0.5, 0.0], [0.6, 0.0], [0.6, 0.3], [0.5, 0.3]].map(|[x, z]| DVec3::new(x, 0.9, z));
        let scene =
            [board(0.2, 0.05, 0.1), board(0.7, 0.2, 0.3), board(1.4, 0.1, 0.2), board(0.5, 3.0, 1.0), wall.to_vec()]
                .iter()
                .fold(Builder::default().material(0.5, 0.0).polygon(&floor), |scene, outline| scene.polygon(outline))
                .build();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let surroundings = Surroundings::new(&scene, &solution);
        let area = |root: &NodeId| solution.elements.nodes[*root as usize].area;
        let root = solution.patch_roots(0).max_by(|a, b| area(a).total_cmp(&area(b))).expect("the floor has patches");
        let feet = surroundings.feet(&solution, root, 9);
        let expected = [DVec3::new(0.2, 0.3, 0.0), DVec3::new(0.7, 0.3, 0.0)];
        assert!(feet.len() == 2 && feet.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-12), "{feet:?}");
        assert_eq!(surroundings.feet(&solution, root, 1), feet[..1]);
        assert_eq!(surroundings.feet(&solution, root, 0), []);
    }
}
