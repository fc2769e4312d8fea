//! Irradiance at a point (Hardt & Teller 1996, section 5): exact visibility, exact form factors.
//!
//! For every source polygon, its blockers are projected back onto it, and Lambert's formula is summed over the
//! fragments that remain. The radiosity of a reflector is piecewise linear over its elements; which cut through its
//! quadtree a fragment is integrated over depends on the point and the source alone, and sources are summed in
//! order of id, so that neighbouring leaves agree on their common border.
//!
//! What we do differently: blockers in contact with the point enter by their limit ([`Viewpoint::tangent_cone`]).

use glam::DVec3;
use scene::{Rgb, Scene, luminance};

use crate::backprojection::{BlockerCone, Fragments, SLIVER, Viewpoint};
use crate::blocker::Blocker;
use crate::clip::{Position, clip_convex, locate};
use crate::form_factor::point_form_factor;
use crate::geometry::Geometry;
use crate::solution::{ElementLight, Solution};
use crate::{LinkSource, NodeId};

/// How much light a reflector's linear elements may misplace at a point before finer ones are opened, as a fraction
/// of the scene's mean irradiance. Per source and point; smaller opens more elements at every point.
const SOURCE_BUDGET: f64 = 6e-3;

/// How other polygons touch a point of a polygon: how many values irradiance has there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// Nothing touches: one value.
    None,
    /// Contact along one line through the point, with its unit direction: one value for each side.
    Line {
        /// Unit direction of the line.
        direction: DVec3,
    },
    /// Contact ends or turns here: the value depends on the direction that the point is approached from.
    Corner,
}

/// Answers with the irradiance at points of a solved scene.
pub struct Gather<'a> {
    scene: &'a Scene,
    solution: &'a Solution,
    geometry: Geometry,
    /// The luminance that [`SOURCE_BUDGET`] stands for, W·m⁻².
    budget: f64,
}

/// A gather for the points of one leaf element: sources and blockers that its links name.
pub struct LeafGather<'a> {
    gather: &'a Gather<'a>,
    polygon: u32,
    sources: Vec<Source>,
    /// Number of distinct blockers of all sources.
    blocker_count: usize,
}

struct Source {
    polygon: u32,
    /// The patches of it that links name, ascending. What hides another from the whole leaf is no blocker of any link,
    /// so the gather must not look there at all.
    patches: Vec<u32>,
    /// Each with the number that its polygon has among the leaf's blockers.
    blockers: Vec<(usize, Blocker)>,
}

impl<'a> Gather<'a> {
    /// Prepares a gather over a solution of the scene.
    pub fn new(scene: &'a Scene, solution: &'a Solution) -> Self {
        let budget = SOURCE_BUDGET * luminance(solution.mean_irradiance);
        Self { scene, solution, geometry: Geometry::new(scene), budget }
    }

    /// How other polygons touch a point of a polygon, on its front.
    pub fn contact(&self, polygon: u32, position: DVec3) -> Contact {
        let up = self.geometry.plane(polygon).normal;
        let mut line: Option<DVec3> = None;
        for (other, plane) in self.geometry.planes.iter().enumerate() {
            let across = up.cross(plane.normal);
            if plane.distance(position).abs() > self.geometry.contact_tolerance || across.length_squared() < 1e-18 {
                continue;
            }
            let outline = &self.geometry.outlines[other];
            let direction = match locate(outline, plane.normal, position, self.geometry.contact_tolerance) {
                Position::Outside => continue,
                Position::Interior => across.normalize(),
                Position::Edge(i) => {
                    let edge = (outline[(i + 1) % outline.len()] - outline[i]).normalize();
                    if edge.dot(up).abs() > 1e-9 {
                        return Contact::Corner;
                    }
                    if plane.normal.cross(edge).dot(up) < 0.0 {
                        continue; // It hangs below the horizon.
                    }
                    edge
                }
                Position::Corner(i) => {
                    let count = outline.len();
                    let leaving = (outline[(i + 1) % count] - outline[i]).normalize();
                    let arriving = (outline[(i + count - 1) % count] - outline[i]).normalize();
                    if leaving.dot(up) <= 1e-9 && arriving.dot(up) <= 1e-9 {
                        let straight = leaving.dot(arriving) < -1.0 + 1e-12;
                        if !straight || plane.normal.cross(leaving).dot(up) < 0.0 {
                            continue;
                        }
                        leaving
                    } else {
                        return Contact::Corner;
                    }
                }
            };
            match line {
                Some(first) if first.cross(direction).length_squared() > 1e-12 => return Contact::Corner,
                _ => line = Some(direction),
            }
        }
        line.map_or(Contact::None, |direction| Contact::Line { direction })
    }

    /// A gather for the points in the closure of one leaf element.
    pub fn over(&'a self, leaf: NodeId) -> LeafGather<'a> {
        let elements = &self.solution.elements;
        let polygon = elements.polygon_of(leaf).unwrap_or_default();
        let mut pairs: Vec<(u32, u32)> = Vec::new(); // (source polygon, blocker), and (source, source) for each source
        let mut patches: Vec<u32> = Vec::new();
        let mut node = leaf;
        loop {
            for link in self.solution.links_of(node) {
                let LinkSource::Node(source) = link.source;
                patches.extend(elements.patch_of(source));
                let Some(source) = elements.polygon_of(source) else { continue };
                pairs.push((source, source));
                pairs.extend(self.solution.blockers.get(link.blockers).iter().map(|&blocker| (source, blocker)));
            }
            let parent = elements.nodes[node as usize].parent;
            if parent == node {
                break;
            }
            node = parent;
        }
        self.leaf_gather(polygon, pairs, patches)
    }

    /// Irradiance at a position in the plane of a polygon, W·m⁻²; `inward` is the direction in the plane from whose
    /// side the limit is taken where other polygons touch the position. Finds the leaf by itself: for single points.
    pub fn irradiance_at(&self, polygon: u32, position: DVec3, inward: DVec3) -> Rgb {
        match self.leaf_under(polygon, position, DVec3::ZERO, inward) {
            Some(leaf) => self.over(leaf).irradiance(position, inward),
            None => Rgb::ZERO,
        }
    }

    fn leaf_gather(&'a self, polygon: u32, mut pairs: Vec<(u32, u32)>, mut patches: Vec<u32>) -> LeafGather<'a> {
        pairs.sort_unstable();
        pairs.dedup();
        patches.sort_unstable();
        patches.dedup();
        let mut blockers: Vec<u32> = pairs.iter().filter(|(s, b)| s != b).map(|&(_, blocker)| blocker).collect();
        blockers.sort_unstable();
        blockers.dedup();
        let sources = pairs.chunk_by(|a, b| a.0 == b.0).map(|group| self.source(group, &blockers, &patches)).collect();
        LeafGather { gather: self, polygon, sources, blocker_count: blockers.len() }
    }

    fn source(&self, group: &[(u32, u32)], all: &[u32], patches: &[u32]) -> Source {
        let polygon = group[0].0;
        let own = self.solution.patches_of(polygon);
        let linked =
            patches.partition_point(|&patch| patch < own.start)..patches.partition_point(|&patch| patch < own.end);
        let blockers = group
            .iter()
            .filter(|(source, blocker)| source != blocker)
            .filter_map(|&(_, blocker)| {
                let number = all.partition_point(|&other| other < blocker);
                Some((number, Blocker::before(&self.geometry, &self.geometry.plane(polygon), blocker)?))
            })
            .collect();
        Source { polygon, patches: patches[linked].to_vec(), blockers }
    }

    /// The leaf of a polygon that contains a position; of several one on the side of `above`, and of these the one that
    /// lies farthest along `towards`.
    fn leaf_under(&self, polygon: u32, position: DVec3, above: DVec3, towards: DVec3) -> Option<NodeId> {
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

impl LeafGather<'_> {
    /// Irradiance at a position of the leaf, W·m⁻², exact for sources of constant radiosity. `inward` is a direction in
    /// the leaf's plane: where other polygons touch the position, the limit is taken from that side; elsewhere it
    /// has no influence.
    pub fn irradiance(&self, position: DVec3, inward: DVec3) -> Rgb {
        let gather = self.gather;
        let up = gather.geometry.plane(self.polygon).normal;
        let from = Viewpoint { position, up, inward: inward.reject_from_normalized(up).normalize_or_zero() };
        let mut cones: Vec<Option<Option<BlockerCone>>> = vec![None; self.blocker_count];
        let mut fragments = Fragments::new(gather.geometry.size);
        let mut total = Rgb::ZERO;
        for source in &self.sources {
            let outline = &gather.geometry.outlines[source.polygon as usize];
            let plane = gather.geometry.planes[source.polygon as usize];
            let depth = plane.distance(position);
            let touches = depth.abs() <= gather.geometry.contact_tolerance;
            if touches {
                if plane.normal.dot(from.inward) <= 0.0 {
                    continue;
                }
                fragments.start(&from.tangent_cone(outline, plane.normal, gather.geometry.contact_tolerance), up);
            } else if depth > 0.0 {
                let corners: Vec<DVec3> = outline.iter().map(|corner| corner - position).collect();
                fragments.start(&corners, up);
            } else {
                continue;
            }
            for (number, blocker) in &source.blockers {
                if fragments.is_empty() {
                    break;
                }
                let (shape, normal) = blocker.shape(&gather.geometry);
                let project = || BlockerCone::of_polygon(shape, normal, &from, gather.geometry.contact_tolerance);
                match blocker {
                    // A whole polygon looks the same before every source: projected once for the point.
                    Blocker::Whole { .. } => {
                        if let Some(cone) = cones[*number].get_or_insert_with(project) {
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
            let form_factor = fragments.measure(up);
            total += self.light(source, &fragments, form_factor, touches, &from);
        }
        total
    }

    /// Irradiance from the visible fragments of one source.
    fn light(&self, source: &Source, fragments: &Fragments, form_factor: f64, touches: bool, from: &Viewpoint) -> Rgb {
        let (gather, solution) = (self.gather, self.gather.solution);
        let polygon = source.polygon;
        let material = gather.scene.material(polygon);
        let reflects = solution.reflects() && material.reflectance != Rgb::ZERO;
        let mut reflected = Rgb::ZERO;
        if touches {
            // In the limit the whole cone meets the source at the point itself.
            if reflects && let Some(leaf) = gather.leaf_under(polygon, from.position, from.up, from.inward) {
                let at = solution.reflected_irradiance(leaf, from.position);
                reflected = at * form_factor;
            }
            return form_factor * material.exitance() + reflected * material.reflectance;
        }
        let all_linked = source.patches.len() == solution.patches_of(polygon).len();
        if all_linked && !reflects {
            return form_factor * material.exitance();
        }
        let budget = gather.budget / luminance(material.reflectance).max(1e-3);
        let mut linked_form_factor = 0.0;
        for (fragment, form_factor) in fragments.iter() {
            for &patch in &source.patches {
                let root = solution.elements.patches[patch as usize].root;
                if solution.is_one_patch(polygon) {
                    self.open(root, fragment, form_factor, budget, from, &mut reflected);
                    continue;
                }
                let part = self.clip_to_outline(fragment, root, from);
                if part.is_empty() {
                    continue;
                }
                let form_factor = point_form_factor(&part, from.up);
                linked_form_factor += form_factor;
                if reflects {
                    self.open(root, &part, form_factor, budget, from, &mut reflected);
                }
            }
        }
        let form_factor = if all_linked { form_factor } else { linked_form_factor };
        form_factor * material.exitance() + reflected * material.reflectance
    }

    /// Adds form factor × irradiance over a fragment, which lies within a node; opens the node where its linear
    /// light is not good enough.
    fn open(&self, node: NodeId, fragment: &[DVec3], form_factor: f64, budget: f64, from: &Viewpoint, sum: &mut Rgb) {
        let solution = self.gather.solution;
        let elements = &solution.elements;
        if form_factor <= SLIVER {
            return; // The neighbour's, but for a rounding: there may be a wall on the border between the two.
        }
        let light = &solution.light[node as usize];
        if elements.is_leaf(node) || light.deviation * form_factor <= budget {
            *sum += form_factor * self.weighted_light(light, node, fragment, from);
            return;
        }
        for child in elements.children(node) {
            let part = self.clip_to_cell(fragment, node, child, from);
            if !part.is_empty() {
                self.open(child, &part, point_form_factor(&part, from.up), budget, from, sum);
            }
        }
    }

    /// The linear light of a node at the centre of a fragment, each part of the fragment weighted by what it sends
    /// to the point.
    fn weighted_light(&self, light: &ElementLight, node: NodeId, fragment: &[DVec3], from: &Viewpoint) -> Rgb {
        let solution = self.gather.solution;
        let Some(patch) = solution.elements.patch_of(node) else { return light.irradiance };
        let patch = &solution.elements.patches[patch as usize];
        let normal = patch.u.cross(patch.v);
        let centre = fragment.iter().sum::<DVec3>() / fragment.len() as f64;
        let (mut weighted, mut total) = (DVec3::ZERO, 0.0);
        for (i, &corner) in fragment.iter().enumerate() {
            let next = fragment[(i + 1) % fragment.len()];
            let middle = (centre + corner + next) / 3.0;
            let area = (corner - centre).cross(next - centre).length();
            let weight = area * (from.up.dot(middle) * normal.dot(middle)).abs() / middle.length_squared().powi(2);
            weighted += middle * weight;
            total += weight;
        }
        let middle = if total > 0.0 { weighted / total } else { centre };
        light.at(patch, solution.elements.nodes[node as usize].centre, from.position + middle)
    }

    /// The part of a fragment that lies in the outline of a patch's root.
    fn clip_to_outline(&self, fragment: &[DVec3], node: NodeId, from: &Viewpoint) -> Vec<DVec3> {
        let elements = &self.gather.solution.elements;
        let outline = elements.outline(node);
        let Some(patch) = elements.patch_of(node) else { return Vec::new() };
        let patch = &elements.patches[patch as usize];
        let normal = patch.u.cross(patch.v);
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
    fn clip_to_cell(&self, fragment: &[DVec3], node: NodeId, child: NodeId, from: &Viewpoint) -> Vec<DVec3> {
        let elements = &self.gather.solution.elements;
        let (parent, cell) = (&elements.nodes[node as usize], &elements.nodes[child as usize]);
        let mut rest = fragment.to_vec();
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
                if border != outer {
                    let mut kept = Vec::with_capacity(rest.len() + 1);
                    clip_convex(&rest, 0.0, |d| sign * (axis.dot(d) - offset - border), &mut kept);
                    rest = kept;
                }
            }
        }
        rest
    }
}
