//! Irradiance at a point (Hardt & Teller 1996, section 5): exact visibility, exact form factors.
//!
//! For every source polygon, its blockers are projected back onto it, and Lambert's formula is summed over the
//! fragments that remain. The radiosity of a reflector is piecewise linear over its elements; which cut through its
//! quadtree a fragment is integrated over depends on the point and the source alone, and sources are summed in
//! order of id, so that neighbouring leaves agree on their common border.
//!
//! What we do differently: blockers in contact with the point enter by their limit ([`Viewpoint::tangent_cone`]).

use std::cell::OnceCell;

use glam::DVec3;
use scene::{Rgb, Scene, luminance};

use crate::backprojection::Viewpoint;
use crate::clip::{Position, locate};
use crate::emitter::Emitter;
use crate::geometry::Geometry;
use crate::lamp_rays::FaintGroups;
use crate::leaf_gather::{LeafGather, Source};
use crate::light_tree::{Horizon, LightTree};
use crate::polygon_tree::PolygonTree;
use crate::ray_gather::{RayGather, rays_for};
use crate::seen_node::SeenNode;
use crate::shafts::Shafts;
use crate::sky_view::SkyView;
use crate::solid::Solids;
use crate::solution::Solution;
use crate::surroundings::Surroundings;
use crate::{LinkSource, NodeId};

/// How much light one reflector may misplace at a point, as a fraction of the scene's mean irradiance, where nothing else is
/// asked for. Smaller opens more elements at every point, and takes fewer reflectors for dim.
const SOURCE_ERROR: f64 = 1e-3;

/// What nodes may misplace where a bake is checked by other rays, as a part of what they may in the bake.
const SMALLER: f64 = 0.25;

/// What rises over the plane of a polygon by no more than this fraction of the scene's size does not rise: in the six digits
/// that files keep, the next faces of a round body seem to.
const RISE: f64 = 1e-6;

/// Which normal the cosine of arriving light is to, on a polygon with shading normals ([`Scene::shading_normal`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cosine {
    /// The polygon's own: of light that it passes on.
    Own,
    /// The shading normal: of light that is looked at.
    Shading,
}

/// Answers with the irradiance at points of a solved scene.
pub struct Gather<'a> {
    pub(crate) solution: &'a Solution,
    pub(crate) scene: &'a Scene,
    pub(crate) geometry: &'a Geometry,
    pub(crate) solids: &'a Solids,
    pub(crate) tree: &'a PolygonTree,
    pub(crate) emitters: &'a [Emitter],
    /// Where there are no links to say which emitters an element sees.
    emitter_tree: Option<&'a LightTree>,
    /// Rays to the solution's elements, where they stand in for links.
    rays: Option<RayGather<'a>>,
    /// Rays from a point, and their turn.
    pub(crate) sampling: (u32, u32),
    opening: Opening,
    /// Area below which an element is small, m².
    pub(crate) small: f64,
    /// Mean luminance of the radiosity that each polygon reflects, W·m⁻².
    radiosity: Vec<f64>,
}

/// Which nodes of a reflector are opened. Luminances, W·m⁻².
#[derive(Clone, Copy)]
enum Opening {
    /// Those that may misplace more irradiance than this at the point that asks.
    ByIrradiance(f64),
    /// Those whose radiosity strays from their plane by more than this, whoever asks.
    ByRadiosity(f64),
}

impl Opening {
    fn budget(self) -> f64 {
        match self {
            Self::ByIrradiance(budget) => budget,
            Self::ByRadiosity(_) => 0.0,
        }
    }
}

/// What a gather needs to know of a link.
struct LinkSummary {
    /// The source's polygon and patch.
    polygon: u32,
    patch: u32,
    blockers: u32,
    /// Form factor from the element, and its visible part.
    form_factor: f64,
    visible: f64,
}

impl<'a> Gather<'a> {
    /// Prepares a gather over a solution of the scene.
    pub fn new(surroundings: &'a Surroundings<'a>, solution: &'a Solution) -> Self {
        Self::with_source_error(surroundings, solution, SOURCE_ERROR)
    }

    /// The same with a choice of how much light one reflector may misplace at a point, as a fraction of the scene's mean
    /// irradiance.
    pub fn with_source_error(surroundings: &'a Surroundings<'a>, solution: &'a Solution, source_error: f64) -> Self {
        let budget = source_error * luminance(solution.mean_irradiance);
        Self::with(surroundings, solution, Opening::ByIrradiance(budget), (rays_for(source_error), 0))
    }

    /// The same with so many rays, and with the leaves that they meet: for light over reflectors alone.
    pub(crate) fn with_leaves(surroundings: &'a Surroundings<'a>, solution: &'a Solution, rays: u32) -> Self {
        Self::with(surroundings, solution, Opening::ByIrradiance(f64::NEG_INFINITY), (rays, 0))
    }

    /// The same with rays that have nothing in common with those of another `turn`, and with smaller nodes.
    pub fn with_turned_rays(
        surroundings: &'a Surroundings<'a>,
        solution: &'a Solution,
        source_error: f64,
        turn: u32,
    ) -> Self {
        let budget = SMALLER * source_error * luminance(solution.mean_irradiance);
        Self::with(surroundings, solution, Opening::ByIrradiance(budget), (rays_for(source_error), turn))
    }

    /// The same with the same nodes of a reflector for every point that asks: those over which its radiosity strays from a
    /// plane by no more than a fraction of the scene's mean irradiance. Nothing is too dim to be looked at exactly.
    pub fn with_even_nodes(surroundings: &'a Surroundings<'a>, solution: &'a Solution, strays: f64) -> Self {
        let opening = Opening::ByRadiosity(strays * luminance(solution.mean_irradiance));
        Self::with(surroundings, solution, opening, (rays_for(SOURCE_ERROR), 0))
    }

    fn with(
        surroundings: &'a Surroundings<'a>,
        solution: &'a Solution,
        opening: Opening,
        sampling: (u32, u32),
    ) -> Self {
        let scene = surroundings.scene;
        let radiosity = |polygon| {
            let area = |root: NodeId| solution.elements.nodes[root as usize].area;
            let power = |root: NodeId| luminance(solution.light[root as usize].irradiance) * area(root);
            let total: f64 = solution.patch_roots(polygon).map(power).sum();
            luminance(scene.reflectance(polygon)) * total / scene.area(polygon)
        };
        let radiosity = scene.polygon_ids().map(radiosity).collect();
        Self {
            solution,
            scene,
            geometry: &surroundings.geometry,
            solids: &surroundings.solids,
            tree: &surroundings.tree,
            emitters: &surroundings.emitters,
            emitter_tree: surroundings.emitter_tree.as_ref(),
            rays: RayGather::new(surroundings, sampling),
            sampling,
            opening,
            small: surroundings.small,
            radiosity,
        }
    }

    /// The emitters, in a scene without links.
    pub(crate) fn emitter_tree(&self) -> Option<&LightTree> {
        self.emitter_tree
    }

    /// Rays over the solution's elements, where they stand in for links.
    pub(crate) fn rays(&self) -> Option<&RayGather<'a>> {
        self.rays.as_ref()
    }

    /// A point of a polygon as light arrives there; `inward` as [`Viewpoint`] has it.
    pub(crate) fn viewpoint(&self, polygon: u32, position: DVec3, inward: DVec3, cosine: Cosine) -> Viewpoint {
        let up = self.geometry.plane(polygon).normal;
        let normal = match cosine {
            Cosine::Own => up,
            Cosine::Shading => self.scene.shading_normal(polygon, position).unwrap_or(up),
        };
        Viewpoint { normal, rise: RISE * self.geometry.size, ..Viewpoint::flat(position, up, inward) }
    }

    /// What bounds the light on a polygon.
    pub(crate) fn horizon(&self, polygon: u32) -> Horizon {
        Horizon { plane: self.geometry.plane(polygon), tilt: self.scene.shading_tilt(polygon) }
    }

    /// A gather for the points in the closure of one element.
    pub fn over(&'a self, element: NodeId) -> LeafGather<'a> {
        match self.emitter_tree {
            Some(_) => {
                let emitters = self.over_shafts(element, &mut Shafts::default());
                LeafGather { rays: self.rays_over(element), ..emitters }
            }
            None => self.over_sources(element, |_| true),
        }
    }

    /// The same for light over reflectors alone.
    pub fn over_reflectors(&'a self, element: NodeId) -> LeafGather<'a> {
        match self.emitter_tree {
            Some(_) => {
                let elements = &self.solution.elements;
                let polygon = elements.polygon_of(element).unwrap_or_default();
                LeafGather {
                    gather: self,
                    polygon,
                    centre: elements.nodes[element as usize].centre,
                    sources: Vec::new(),
                    faint: FaintGroups::default(),
                    rays: self.rays_over(element),
                    budget: self.budget_over(element),
                    sky: SkyView::default(),
                    blockers: Vec::new(),
                }
            }
            None => self.over_sources(element, |_| true),
        }
    }

    /// Rays from each point of an element to reflectors: none with links.
    fn rays_over(&self, element: NodeId) -> u32 {
        self.rays().map_or(0, |rays| rays.rays_over(self.solution, element))
    }

    /// How much light, luminance, W·m⁻², the plane over a reflector's node misplaces at a point with the given form factor to
    /// it: as far as is known, nothing for a leaf.
    pub fn misplaced(&self, node: NodeId, form_factor: f64) -> f64 {
        let solution = self.solution;
        if let Some(rays) = self.rays() {
            return rays.misplaced(solution, node, form_factor);
        }
        let polygon = solution.elements.polygon_of(node).unwrap_or_default();
        let reflectance = luminance(self.scene.reflectance(polygon));
        reflectance * solution.light[node as usize].deviation * form_factor
    }

    /// What the light over reflectors at a point of an element scatters by, root mean square, in standard deviations of the light
    /// that it sees by direction: nothing but where rays find it.
    pub fn scatter(&self, element: NodeId) -> f64 {
        self.rays().map_or(0.0, |rays| rays.scatter(self.solution, element))
    }

    /// Irradiance, luminance, W·m⁻², that one reflector may misplace at a point; nothing where that is not what decides.
    pub fn budget(&self) -> f64 {
        self.opening.budget()
    }

    /// The same at points of an element: where it is dim, less.
    pub(crate) fn budget_over(&self, element: NodeId) -> f64 {
        self.budget() * self.solution.brightness(element)
    }

    /// Whether a node is opened for a point that has a form factor to it, of which the plane misplaces the `curved` part.
    pub(crate) fn opens(&self, node: NodeId, form_factor: f64, curved: f64) -> bool {
        let has_parts = self.solution.elements.nodes[node as usize].child_count > 0;
        has_parts
            && match self.opening {
                Opening::ByIrradiance(budget) => self.misplaced(node, form_factor) * curved > budget,
                Opening::ByRadiosity(strays) => self.misplaced(node, 1.0) > strays,
            }
    }

    /// Whether a reflector is no more at a point than what it may misplace there, for its form factor if nothing hides it.
    pub(crate) fn is_dim(&self, polygon: u32, form_factor: f64) -> bool {
        form_factor * self.radiosity[polygon as usize] <= self.budget()
    }

    pub(crate) fn over_sources(&'a self, element: NodeId, wanted: impl Fn(u32) -> bool) -> LeafGather<'a> {
        let (solution, elements) = (self.solution, &self.solution.elements);
        let area = elements.nodes[element as usize].area;
        let mut links: Vec<LinkSummary> = Vec::new();
        for node in elements.ancestors(element).chain(elements.descendants(element)) {
            let share = (elements.nodes[node as usize].area / area).min(1.0);
            for link in solution.links_of(node) {
                let LinkSource::Node(source) = link.source;
                let Some(patch) = elements.patch_of(source) else { continue };
                let polygon = elements.patches[patch as usize].polygon;
                if wanted(polygon) {
                    let form_factor = share * link.form_factor;
                    links.push(LinkSummary {
                        polygon,
                        patch,
                        blockers: link.blockers,
                        form_factor,
                        visible: form_factor * link.visibility,
                    });
                }
            }
        }
        links.sort_by_key(|link| (link.polygon, link.patch, link.blockers));
        let mut sources = Vec::new();
        let mut blockers = Vec::new();
        for links in links.chunk_by(|a, b| a.polygon == b.polygon) {
            let source = self.source(links);
            blockers.extend(source.blockers.iter().flatten());
            // What hides a patch from all of the element is named by no link: such a patch must not be looked at, and so the
            // others are looked at one by one.
            if source.roots.len() == solution.patches_of(source.polygon).len() {
                sources.push(source);
            } else {
                let part = |&(root, visibility): &(NodeId, f64)| Source {
                    roots: vec![(root, visibility)],
                    part: Some(root),
                    ..source.clone()
                };
                sources.extend(source.roots.iter().map(part));
            }
        }
        blockers.sort_unstable();
        blockers.dedup();
        let polygon = elements.polygon_of(element).unwrap_or_default();
        let centre = elements.nodes[element as usize].centre;
        LeafGather {
            gather: self,
            polygon,
            centre,
            sources,
            faint: FaintGroups::default(),
            rays: 0,
            budget: self.budget(),
            sky: SkyView::default(),
            blockers,
        }
    }

    /// A source polygon by all links from it.
    fn source(&self, links: &[LinkSummary]) -> Source {
        let lists = links.chunk_by(|a, b| a.blockers == b.blockers).map(|links| links[0].blockers);
        let mut blockers: Vec<u32> = lists.flat_map(|list| self.solution.blockers.get(list)).copied().collect();
        blockers.sort_unstable();
        blockers.dedup();
        let root = |links: &[LinkSummary]| {
            let (all, visible) =
                links.iter().fold((0.0, 0.0), |sum, link| (sum.0 + link.form_factor, sum.1 + link.visible));
            let root = self.solution.elements.patches[links[0].patch as usize].root;
            (root, if all > 0.0 { visible / all } else { 0.0 })
        };
        let roots = links.chunk_by(|a, b| a.patch == b.patch).map(root).collect();
        Source {
            polygon: links[0].polygon,
            body: None,
            roots,
            part: None,
            blockers: Some(blockers),
            before: OnceCell::new(),
        }
    }

    /// Irradiance at a position in the plane of a polygon, by its shading normal if it has one, W·m⁻²; `inward` is the
    /// direction in the plane from whose side the limit is taken where other polygons touch the position. Finds the leaf by
    /// itself: for single points.
    pub fn irradiance_at(&self, polygon: u32, position: DVec3, inward: DVec3) -> Rgb {
        match self.leaf_under(polygon, position, DVec3::ZERO, inward) {
            Some(leaf) => self.over(leaf).irradiance(position, inward),
            None => Rgb::ZERO,
        }
    }

    /// Irradiance from the reflectors that a point sees, W·m⁻².
    pub fn irradiance_from(&self, seen: &[SeenNode]) -> Rgb {
        seen.iter()
            .map(|seen| {
                let polygon = self.solution.elements.polygon_of(seen.node).unwrap_or_default();
                let reflectance = self.scene.reflectance(polygon);
                reflectance * self.solution.light[seen.node as usize].at(seen.offset) * seen.form_factor
            })
            .sum()
    }

    /// The leaf of a polygon that contains a position; of several one on the side of `above`, and of these the one that
    /// lies farthest along `towards`.
    pub(crate) fn leaf_under(&self, polygon: u32, position: DVec3, above: DVec3, towards: DVec3) -> Option<NodeId> {
        let elements = &self.solution.elements;
        let normal = self.geometry.plane(polygon).normal;
        // Points given in a file carry a rounding of their own: the nearest patch is good enough.
        let contains = |node: NodeId, tolerance: f64| {
            locate(elements.outline(node), normal, position, tolerance) != Position::Outside
        };
        let mut tolerance = self.geometry.contact_tolerance;
        while tolerance < self.geometry.size {
            let mut best: Option<((bool, f64), NodeId)> = None;
            let mut open: Vec<NodeId> = self.solution.patch_roots(polygon).collect();
            while let Some(node) = open.pop() {
                if !contains(node, tolerance) {
                    continue;
                }
                if !elements.is_leaf(node) {
                    open.extend(elements.children(node).rev());
                    continue;
                }
                let middle = (elements.nodes[node as usize].centre - position).normalize_or_zero();
                let (on_side, along) = (middle.dot(above) > 1e-9, middle.dot(towards));
                if best.is_none_or(|((side, most), _)| (on_side && !side) || (on_side == side && along > most + 1e-9)) {
                    best = Some(((on_side, along), node));
                }
            }
            if let Some((_, leaf)) = best {
                return Some(leaf);
            }
            tolerance *= 10.0;
        }
        None
    }
}

#[cfg(test)]
mod tests;
