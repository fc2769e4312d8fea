//! What a point sees of a reflector, as nodes of the reflector's hierarchy: opened as far as the light on them asks for, each with the
//! mean place of what is seen.

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use crate::NodeId;
use crate::backprojection::{Fragments, SLIVER, Viewpoint};
use crate::clip::clip_convex;
use crate::form_factor::point_form_factor;
use crate::leaf_gather::{LeafGather, Source};

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

impl LeafGather<'_> {
    /// What a point sees of a reflector that is too dim for its blockers to be projected: the links know what is visible of it
    /// well enough. Its patches share what is seen by their areas.
    pub(crate) fn see_dim(&self, source: &Source, form_factor: f64, seen: &mut Vec<SeenNode>) {
        let elements = &self.gather.solution.elements;
        let area = |root: NodeId| elements.nodes[root as usize].area;
        let per_area = form_factor / source.roots.iter().map(|&(root, _)| area(root)).sum::<f64>();
        for &(node, visibility) in source.roots.iter().filter(|root| root.1 > 0.0) {
            seen.push(SeenNode { node, form_factor: per_area * area(node) * visibility, offset: DVec2::ZERO });
        }
    }

    /// What a point sees of a reflector that it touches: in the limit the whole cone meets the reflector at the point.
    pub(crate) fn see_contact(&self, source: u32, form_factor: f64, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
        if let Some(leaf) = self.gather.leaf_under(source, from.position, from.up, from.inward) {
            seen.push(SeenNode { node: leaf, form_factor, offset: self.offset(leaf, from.position) });
        }
    }

    /// What a point sees of a reflector that nothing hides.
    pub(crate) fn see_whole(&self, source: &Source, from: &Viewpoint, seen: &mut Vec<SeenNode>) {
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
    pub(crate) fn see_fragments(
        &self,
        source: &Source,
        fragments: &Fragments,
        from: &Viewpoint,
        seen: &mut Vec<SeenNode>,
    ) {
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
