//! A gather to the points of one leaf (Hardt & Teller 1996, section 5): its sources with their blockers, the fragments
//! that a point sees of them, and the nodes that these fragments are parts of.
//!
//! What a point sees of reflectors does not depend on how bright they are. It is told as a list of [`SeenNode`]s, so that
//! light can be sent over it again and again, until it no longer changes, for one search for what is visible.
//!
//! A room of a hundred polygons has a dozen that matter at any one point. The others are told from them by their form factor
//! as if nothing hid them; for these the links' visibility is good enough.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashMap;

use glam::{DVec2, DVec3};
use scene::{Plane, Rgb, luminance};

use crate::backprojection::{BlockerCone, Fragments, SLIVER, Viewpoint};
use crate::blocker::Blocker;
use crate::clip::clip_convex;
use crate::emitter::outline_of;
use crate::form_factor::point_form_factor;
use crate::lamp_rays::FaintGroups;
use crate::sky_view::SkyView;
use crate::{Cosine, Gather, NodeId};

/// The part of a source's form factor from which on nothing is taken to hide it: above the rounding of its clipping.
const WHOLE: f64 = 1.0 - 1e-9;

/// The second derivative of what a point sees of a place, relative to it and in units of the distance, is a few at most, at
/// all angles that matter. Less opens fewer nodes.
const CURVATURE: f64 = 2.0;

/// Six points that integrate a polynomial of degree 4 over a triangle: weights, and barycentrics of which the second counts
/// twice (Dunavant, "High Degree Efficient Symmetrical Gaussian Quadrature Rules for the Triangle", 1985). A point a
/// triangle leaves nodes too dark by a fifth of a percent a bounce: what a point sees of a near node is mostly its near side.
const TRIANGLE_RULE: [(f64, [f64; 2]); 2] = [
    (0.223_381_589_678_011, [0.108_103_018_168_070, 0.445_948_490_915_965]),
    (0.109_951_743_655_322, [0.816_847_572_980_459, 0.091_576_213_509_771]),
];

/// A gather for the points of one leaf element: sources and blockers that its links name.
pub struct LeafGather<'a> {
    pub(crate) gather: &'a Gather<'a>,
    pub(crate) polygon: u32,
    /// Centre of the element, metres.
    pub(crate) centre: DVec3,
    pub(crate) sources: Vec<Source>,
    pub(crate) faint: FaintGroups,
    /// Rays that each of its points looks at reflectors with, in a scene without links.
    pub(crate) rays: u32,
    /// Irradiance, luminance, W·m⁻², that one of many sources may misplace at its points.
    pub(crate) budget: f64,
    /// What its points may see of the sky.
    pub(crate) sky: SkyView,
    /// All blockers of all sources, ascending.
    pub(crate) blockers: Vec<u32>,
}

/// A source polygon before a leaf, or one patch of it.
#[derive(Clone)]
pub(crate) struct Source {
    pub polygon: u32,
    /// The emitter that it is, if it is a convex body.
    pub body: Option<u32>,
    /// Root nodes of the patches that it stands for, each with its visible fraction, 0..=1, as the links know it.
    pub roots: Vec<(NodeId, f64)>,
    /// The root, if it stands for one patch of several alone.
    pub part: Option<NodeId>,
    /// Polygons that may hide it, ascending; none if rays tell what is seen of it.
    pub blockers: Option<Vec<u32>>,
    /// The same as they are before the source: found out when a point needs them first, since most sources are too dim for
    /// that.
    pub before: OnceCell<Vec<Obstacle>>,
}

/// What may hide a source: a polygon, or several that are faces of one convex solid.
#[derive(Clone)]
pub(crate) struct Obstacle {
    solid: Option<u32>,
    /// Each with its number among the leaf's blockers.
    faces: Vec<(usize, Blocker)>,
}

impl Source {
    /// Corners, metres.
    pub fn outline<'a>(&self, gather: &'a Gather<'_>) -> &'a [DVec3] {
        match self.part {
            Some(root) => gather.solution.elements.outline(root),
            None => gather.geometry.outline(self.polygon),
        }
    }

    fn blockers(&self) -> &[u32] {
        self.blockers.as_deref().unwrap_or_default()
    }
}

/// What obstacles hide from one point, as far as it has been asked: no cone where one hides nothing, or a solid has none.
pub(crate) struct Cones {
    of_solids: HashMap<u32, Option<BlockerCone>>,
    /// By number among the leaf's blockers.
    of_faces: Vec<Option<Option<BlockerCone>>>,
}

/// What a point sees of a node of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenNode {
    /// The node.
    pub node: NodeId,
    /// Form factor from the point to what it sees of the node, 0..=1.
    pub form_factor: f64,
    /// Mean place of what is seen, each part weighted by what it sends to the point: offset from the node's centre along
    /// its patch's u and v, metres.
    pub offset: DVec2,
}

/// Irradiance straight from what shines by itself, W·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DirectIrradiance {
    /// From surfaces that emit.
    pub emitters: Rgb,
    /// From the scene's environment.
    pub sky: Rgb,
}

impl DirectIrradiance {
    /// From both.
    pub fn total(&self) -> Rgb {
        self.emitters + self.sky
    }
}

/// Which of its sources' light a point is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Light {
    Emitted,
    Reflected,
    Both,
}

impl LeafGather<'_> {
    /// Irradiance at a position of the leaf, by the shading normal if it has one, W·m⁻². `inward` is a direction in the leaf's
    /// plane: where other polygons touch the position, the limit is taken from that side; elsewhere it has no influence.
    pub fn irradiance(&self, position: DVec3, inward: DVec3) -> Rgb {
        let mut seen = Vec::new();
        let emitted = match self.gather.rays() {
            None => self.look(position, inward, (Light::Both, Cosine::Shading), &mut seen),
            Some(_) => {
                self.seen_nodes(position, inward, Cosine::Shading, &mut seen);
                self.emitted(position, inward, Cosine::Shading)
            }
        };
        emitted.total() + self.gather.irradiance_from(&seen)
    }

    /// The part of the irradiance that comes straight from emitters and from the sky: exact but where rays tell what is seen.
    pub fn emitted(&self, position: DVec3, inward: DVec3, cosine: Cosine) -> DirectIrradiance {
        self.look(position, inward, (Light::Emitted, cosine), &mut Vec::new())
    }

    /// Appends the nodes of reflectors that a position sees. Nodes are opened as far as the light of the solution asks for.
    pub fn seen_nodes(&self, position: DVec3, inward: DVec3, cosine: Cosine, seen: &mut Vec<SeenNode>) {
        match self.gather.rays() {
            None => {
                self.look(position, inward, (Light::Reflected, cosine), seen);
            }
            Some(rays) => {
                let from = self.gather.viewpoint(self.polygon, position, inward, cosine);
                rays.seen_nodes(self.gather.solution, (self.polygon, self.rays, self.budget), &from, seen);
            }
        }
    }

    /// What may hide a source in a plane, its front towards the element: blockers before it, gathered to solids where all of a
    /// solid is.
    pub(crate) fn before(&self, plane: &Plane, blockers: &[u32]) -> Vec<Obstacle> {
        let Gather { scene, geometry, solids, .. } = self.gather;
        let mut obstacles: Vec<Obstacle> = Vec::new();
        for &polygon in blockers {
            let number = self.blockers.partition_point(|&other| other < polygon);
            let Some(blocker) = Blocker::before(geometry, plane, polygon) else { continue };
            let known = |solid: u32| obstacles.iter().position(|obstacle| obstacle.solid == Some(solid));
            let solid = solids.of_polygon(polygon);
            if let Some(place) = solid.and_then(known) {
                obstacles[place].faces.push((number, blocker));
                continue;
            }
            let whole = |&solid: &u32| solids.is_before(scene, solid, plane, geometry.contact_tolerance);
            obstacles.push(Obstacle { solid: solid.filter(whole), faces: vec![(number, blocker)] });
        }
        obstacles
    }

    /// The plane that a source lies in, its front towards the element. For a body it is the one through the middle: what is
    /// beyond it hides nothing.
    fn plane(&self, source: &Source) -> Plane {
        let Some(body) = source.body else { return self.gather.geometry.plane(source.polygon) };
        let corners = &self.gather.emitters[body as usize].body;
        let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let normal = (self.centre - middle).normalize_or_zero();
        Plane { normal, offset: normal.dot(middle) }
    }

    /// Irradiance of unit exitance from a body, as far as it is seen. From so near that it has no outline its faces count one
    /// by one, and nothing is taken to stand between.
    fn body_form_factor(
        &self,
        source: &Source,
        body: u32,
        from: &Viewpoint,
        cones: &mut Cones,
        fragments: &mut Fragments,
    ) -> f64 {
        let Gather { geometry, emitters, .. } = self.gather;
        let emitter = &emitters[body as usize];
        let Some(cone) = outline_of(&emitter.body, from.position) else {
            let faces = emitter.polygons.iter().filter(|&&face| geometry.plane(face).distance(from.position) > 0.0);
            return faces.map(|&face| from.form_factor(geometry.outline(face))).sum();
        };
        fragments.start(cone.corners(), from);
        let obstacles = source.before.get_or_init(|| self.before(&self.plane(source), source.blockers()));
        let unoccluded = fragments.measure(from.normal);
        let irradiance = luminance(unoccluded * self.gather.scene.material(source.polygon).exitance());
        if self.is_seen_by_rays(source, obstacles.len(), irradiance) {
            let distance = emitter.body[0].distance(from.position);
            let outline: Vec<DVec3> = cone.corners().iter().map(|corner| from.position + corner * distance).collect();
            let passes = |polygon: u32| emitter.polygons.binary_search(&polygon).is_ok();
            return unoccluded * self.seen_share(&outline, irradiance, from, passes);
        }
        for obstacle in obstacles {
            if fragments.is_empty() {
                return 0.0;
            }
            self.subtract(obstacle, from, cones, fragments);
        }
        fragments.measure(from.normal)
    }

    /// Cuts away what an obstacle hides from a point. `cones` are those that the point has needed so far, by number.
    pub(crate) fn subtract(&self, obstacle: &Obstacle, from: &Viewpoint, cones: &mut Cones, fragments: &mut Fragments) {
        let Gather { scene, geometry, solids, .. } = self.gather;
        if let Some(solid) = obstacle.solid {
            let cone = cones.of_solids.entry(solid).or_insert_with(|| solids.cone(scene, geometry, solid, from));
            if let Some(cone) = cone {
                return fragments.subtract(cone);
            }
        }
        for (number, blocker) in &obstacle.faces {
            let (shape, normal) = blocker.shape(geometry);
            let project = || BlockerCone::of_polygon(shape, normal, from, geometry.contact_tolerance);
            match blocker {
                // A whole polygon looks the same before every source: projected once for the point.
                Blocker::Whole { .. } => {
                    if let Some(cone) = cones.of_faces[*number].get_or_insert_with(project) {
                        fragments.subtract(cone);
                    }
                }
                Blocker::Part { .. } => {
                    if let Some(cone) = project() {
                        fragments.subtract(&cone);
                    }
                }
            }
        }
    }

    /// Direct irradiance, and the nodes of reflectors that are seen.
    fn look(
        &self,
        position: DVec3,
        inward: DVec3,
        (wanted, cosine): (Light, Cosine),
        seen: &mut Vec<SeenNode>,
    ) -> DirectIrradiance {
        let gather = self.gather;
        let mut from = gather.viewpoint(self.polygon, position, inward, cosine);
        from.inward = inward.reject_from_normalized(from.up).normalize_or_zero();
        let mut cones = Cones { of_solids: HashMap::new(), of_faces: vec![None; self.blockers.len()] };
        let mut fragments = Fragments::new(gather.geometry.size);
        let mut total = Rgb::ZERO;
        for source in &self.sources {
            let material = gather.scene.material(source.polygon);
            let emits = wanted != Light::Reflected && material.emits();
            let reflects = wanted != Light::Emitted
                && gather.solution.reflects()
                && gather.scene.reflectance(source.polygon) != Rgb::ZERO;
            if !emits && !reflects {
                continue;
            }
            if let Some(body) = source.body {
                total += self.body_form_factor(source, body, &from, &mut cones, &mut fragments) * material.exitance();
                continue;
            }
            let outline = source.outline(gather);
            let plane = gather.geometry.planes[source.polygon as usize];
            let depth = plane.distance(position);
            let touches = depth.abs() <= gather.geometry.contact_tolerance;
            let unoccluded = if reflects && depth > 0.0 && !touches { from.form_factor(outline) } else { 0.0 };
            if !emits && !touches && gather.is_dim(source.polygon, unoccluded) {
                self.see_dim(source, unoccluded, seen);
                continue;
            }
            if touches {
                if plane.normal.dot(from.inward) <= 0.0 {
                    continue;
                }
                fragments.start(&from.tangent_cone(outline, plane.normal, gather.geometry.contact_tolerance), &from);
            } else if depth > 0.0 {
                let corners: Vec<DVec3> = outline.iter().map(|corner| corner - position).collect();
                fragments.start(&corners, &from);
            } else {
                continue;
            }
            let obstacles = source.before.get_or_init(|| self.before(&self.plane(source), source.blockers()));
            let is_open = source.blockers.is_some() && obstacles.is_empty();
            if !is_open && !touches && gather.emitter_tree().is_some() {
                let unoccluded = fragments.measure(from.normal);
                let irradiance = luminance(unoccluded * material.exitance());
                if self.is_seen_by_rays(source, obstacles.len(), irradiance) {
                    let share = self.seen_share(outline, irradiance, &from, |polygon| polygon == source.polygon);
                    total += share * unoccluded * material.exitance();
                    continue;
                }
            }
            for obstacle in obstacles {
                if fragments.is_empty() {
                    break;
                }
                self.subtract(obstacle, &from, &mut cones, &mut fragments);
            }
            let form_factor = fragments.measure(from.normal);
            if emits {
                total += form_factor * material.exitance();
            }
            if reflects && form_factor > 0.0 {
                if touches {
                    self.see_contact(source.polygon, form_factor, &from, seen);
                } else if form_factor >= unoccluded * WHOLE {
                    self.see_whole(source, &from, seen);
                } else {
                    self.see_fragments(source, &fragments, &from, seen);
                }
            }
        }
        if wanted == Light::Reflected {
            return DirectIrradiance::default();
        }
        let sky = self.light_of_sky(&from, &mut cones, &mut fragments);
        DirectIrradiance { emitters: total + self.light_of_faint_groups(&from), sky }
    }

    /// What a point sees of a reflector that is too dim for its blockers to be projected: the links know what is visible of it
    /// well enough. Its patches share what is seen by their areas.
    fn see_dim(&self, source: &Source, form_factor: f64, seen: &mut Vec<SeenNode>) {
        let elements = &self.gather.solution.elements;
        let area = |root: NodeId| elements.nodes[root as usize].area;
        let per_area = form_factor / source.roots.iter().map(|&(root, _)| area(root)).sum::<f64>();
        for &(node, visibility) in source.roots.iter().filter(|root| root.1 > 0.0) {
            seen.push(SeenNode { node, form_factor: per_area * area(node) * visibility, offset: DVec2::ZERO });
        }
    }

    /// What a point sees of a reflector that it touches: in the limit the whole cone meets the reflector at the point.
    fn see_contact(&self, source: u32, form_factor: f64, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        if let Some(leaf) = self.gather.leaf_under(source, from.position, from.up, from.inward) {
            seen.push(SeenNode { node: leaf, form_factor, offset: self.offset(leaf, from.position) });
        }
    }

    /// What a point sees of a reflector that nothing hides.
    fn see_whole(&self, source: &Source, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        for &(root, _) in &source.roots {
            let outline = self.gather.solution.elements.outline(root);
            self.open_whole(root, from.form_factor(outline), from, seen);
        }
    }

    /// Adds a node that nothing hides; opens it where its linear light is not good enough. As the plane has the mean and the
    /// slope of the light, what it misplaces is only what the point's view of the node is not linear by.
    fn open_whole(&self, node: NodeId, form_factor: f64, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        if form_factor <= SLIVER {
            return;
        }
        let elements = &self.gather.solution.elements;
        let record = &elements.nodes[node as usize];
        let (size, distance) = (record.cell_max - record.cell_min, record.centre - from.position);
        let curved = (size.length_squared() / 4.0 * CURVATURE / distance.length_squared()).min(1.0);
        if !self.gather.opens(node, form_factor, curved) {
            let corners: Vec<DVec3> = elements.outline(node).iter().map(|corner| corner - from.position).collect();
            let middle = from.position + self.mean_place(&corners, node, from);
            seen.push(SeenNode { node, form_factor, offset: self.offset(node, middle) });
            return;
        }
        for child in elements.children(node) {
            self.open_whole(child, from.form_factor(elements.outline(child)), from, seen);
        }
    }

    /// What a point sees of a reflector: the visible fragments, cut up along the nodes of its hierarchy.
    fn see_fragments(&self, source: &Source, fragments: &Fragments, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        for (fragment, form_factor) in fragments.iter() {
            if let [(root, _)] = source.roots[..] {
                self.open(root, fragment, form_factor, from, seen);
                continue;
            }
            for &(root, _) in &source.roots {
                let part = self.clip_to_outline(fragment, root, from);
                if !part.is_empty() {
                    self.open(root, &part, point_form_factor(&part, from.normal), from, seen);
                }
            }
        }
    }

    /// Adds a fragment, which lies within a node; opens the node where its linear light is not good enough.
    fn open(&self, node: NodeId, fragment: &[DVec3], form_factor: f64, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        let solution = self.gather.solution;
        let elements = &solution.elements;
        if form_factor <= SLIVER {
            return; // The neighbour's, but for a rounding: there may be a wall on the border between the two.
        }
        if !self.gather.opens(node, form_factor, 1.0) {
            let middle = from.position + self.mean_place(fragment, node, from);
            seen.push(SeenNode { node, form_factor, offset: self.offset(node, middle) });
            return;
        }
        for child in elements.children(node) {
            let part = self.clip_to_cell(fragment, node, child, from);
            if !part.is_empty() {
                self.open(child, &part, point_form_factor(&part, from.normal), from, seen);
            }
        }
    }

    /// Where a position on a node lies from the node's centre, along its patch's u and v, metres.
    fn offset(&self, node: NodeId, position: DVec3) -> DVec2 {
        let elements = &self.gather.solution.elements;
        let Some(patch) = elements.patch_of(node) else { return DVec2::ZERO };
        elements.patches[patch as usize].along(position - elements.nodes[node as usize].centre)
    }

    /// The centre of a fragment of a node, each part of it weighted by what it sends to the point; relative to the point.
    fn mean_place(&self, fragment: &[DVec3], node: NodeId, from: &Viewpoint) -> DVec3 {
        let elements = &self.gather.solution.elements;
        let centre = fragment.iter().sum::<DVec3>() / fragment.len() as f64;
        let Some(patch) = elements.patch_of(node) else { return centre };
        let normal = elements.patches[patch as usize].normal();
        let (mut weighted, mut total) = (DVec3::ZERO, 0.0);
        for (i, &corner) in fragment.iter().enumerate() {
            let next = fragment[(i + 1) % fragment.len()];
            let area = (corner - centre).cross(next - centre).length();
            for (share, [a, b]) in TRIANGLE_RULE {
                for [p, q, r] in [[a, b, b], [b, a, b], [b, b, a]] {
                    let place = centre * p + corner * q + next * r;
                    let square = place.length_squared();
                    let weight = share * area * from.height(place) * normal.dot(place).abs() / (square * square);
                    weighted += place * weight;
                    total += weight;
                }
            }
        }
        if total > 0.0 { weighted / total } else { centre }
    }

    /// The part of a fragment that lies in the outline of a patch's root.
    fn clip_to_outline(&self, fragment: &[DVec3], node: NodeId, from: &Viewpoint) -> Vec<DVec3> {
        let elements = &self.gather.solution.elements;
        let outline = elements.outline(node);
        let Some(patch) = elements.patch_of(node) else { return Vec::new() };
        let patch = &elements.patches[patch as usize];
        let normal = patch.normal();
        let edges = outline.iter().enumerate().map(|(i, &corner)| {
            let inward = normal.cross(outline[(i + 1) % outline.len()] - corner);
            (inward, inward.dot(corner - from.position))
        });
        // Most patches of a polygon that was cut to pieces have nothing of a fragment: found out without copying it.
        if edges.clone().any(|(inward, border)| fragment.iter().all(|d| inward.dot(*d) <= border)) {
            return Vec::new();
        }
        let mut rest = fragment.to_vec();
        for (inward, border) in edges {
            let mut kept = Vec::with_capacity(rest.len() + 1);
            clip_convex(&rest, 0.0, |d| inward.dot(d) - border, &mut kept);
            rest = kept;
        }
        rest
    }

    /// The part of a fragment of `node` that lies in the cell of its child.
    fn clip_to_cell<'b>(
        &self,
        fragment: &'b [DVec3],
        node: NodeId,
        child: NodeId,
        from: &Viewpoint,
    ) -> Cow<'b, [DVec3]> {
        let elements = &self.gather.solution.elements;
        let (parent, cell) = (&elements.nodes[node as usize], &elements.nodes[child as usize]);
        let mut rest = Cow::Borrowed(fragment);
        let Some(patch) = elements.patch_of(node) else { return rest };
        let patch = &elements.patches[patch as usize];
        let origin = patch.origin - from.position;
        for (axis, index) in [(patch.u, 0), (patch.v, 1)] {
            let offset = axis.dot(origin);
            let borders = [
                (1.0, cell.cell_min[index], parent.cell_min[index]),
                (-1.0, cell.cell_max[index], parent.cell_max[index]),
            ];
            for (sign, border, outer) in borders {
                let inside = |d: DVec3| sign * (axis.dot(d) - offset - border);
                // Most fragments lie in one child.
                if border != outer && rest.iter().any(|&d| inside(d) < 0.0) {
                    let mut kept = Vec::with_capacity(rest.len() + 1);
                    clip_convex(&rest, 0.0, inside, &mut kept);
                    rest = Cow::Owned(kept);
                }
            }
        }
        rest
    }
}
