//! Elements: the quadtree over every patch, in one flat arena.
//!
//! A patch is a convex piece of an input polygon after it has been cut along its contact lines. Its quadtree divides
//! the patch's bounding rectangle; every cell is clipped to the patch. The arena has one root, a cluster whose
//! children are the patches, so that clusters between the root and the patches need no new kind of node.

use glam::{DVec2, DVec3};
use scene::{area_vector, centroid};
use serde::{Deserialize, Serialize};

use crate::clip::clip_convex;

/// Index of a node in [`Elements::nodes`].
pub type NodeId = u32;

/// What a node of the hierarchy is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NodeKind {
    /// A group of nodes that are not in one plane.
    Cluster,
    /// A patch or a part of one.
    Surface {
        /// Index into [`Elements::patches`].
        patch: u32,
    },
}

/// One node of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Cluster or surface.
    pub kind: NodeKind,
    /// The node that this one is a part of; the root is its own parent.
    pub parent: NodeId,
    /// First of the children, which are consecutive; meaningless without children.
    pub first_child: NodeId,
    /// Number of children; 0 for a leaf.
    pub child_count: u32,
    /// First corner of the outline in [`Elements::outlines`]; clusters have none.
    pub first_corner: u32,
    /// Number of the outline's corners.
    pub corner_count: u32,
    /// Area, m².
    pub area: f64,
    /// Area centroid, metres.
    pub centre: DVec3,
    /// Lower corner of the unclipped cell in the patch's frame, metres.
    pub cell_min: DVec2,
    /// Upper corner of the unclipped cell in the patch's frame, metres.
    pub cell_max: DVec2,
}

/// A convex piece of an input polygon, and the frame that its quadtree lives in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// The polygon of the scene.
    pub polygon: u32,
    /// Node of the whole patch.
    pub root: NodeId,
    /// Origin of the frame, a corner of the bounding rectangle, metres.
    pub origin: DVec3,
    /// Unit vector along the longest edge.
    pub u: DVec3,
    /// Unit vector across it, in the plane; u × v is the polygon's normal.
    pub v: DVec3,
}

/// The arena of nodes, the patches, and the corners of all outlines.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Elements {
    /// All nodes; 0 is the root cluster, whose children are the patches in order.
    pub nodes: Vec<Node>,
    /// All patches, those of one polygon consecutive.
    pub patches: Vec<Patch>,
    /// Corners of all outlines, counter-clockwise from the front, metres.
    pub outlines: Vec<DVec3>,
}

impl Elements {
    /// The convex outline of a surface node, counter-clockwise from the front.
    pub fn outline(&self, node: NodeId) -> &[DVec3] {
        let node = &self.nodes[node as usize];
        &self.outlines[node.first_corner as usize..(node.first_corner + node.corner_count) as usize]
    }

    /// Ids of a node's children.
    pub fn children(&self, node: NodeId) -> std::ops::Range<NodeId> {
        let node = &self.nodes[node as usize];
        node.first_child..node.first_child + node.child_count
    }

    /// Whether a node is a leaf element: a surface without children.
    pub fn is_leaf(&self, node: NodeId) -> bool {
        let node = &self.nodes[node as usize];
        node.child_count == 0 && node.kind != NodeKind::Cluster
    }

    /// All leaf elements, in order of id.
    pub fn leaves(&self) -> impl Iterator<Item = NodeId> {
        (0..self.nodes.len() as u32).filter(|&node| self.is_leaf(node))
    }

    /// A node, its parent, and so on up to the root.
    pub fn ancestors(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        std::iter::successors(Some(node), |&node| {
            let parent = self.nodes[node as usize].parent;
            (parent != node).then_some(parent)
        })
    }

    /// All nodes below a node, parents before their children.
    pub fn descendants(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        let mut open: Vec<NodeId> = self.children(node).rev().collect();
        std::iter::from_fn(move || {
            let node = open.pop()?;
            open.extend(self.children(node).rev());
            Some(node)
        })
    }

    /// The patch of a surface node; none for a cluster.
    pub fn patch_of(&self, node: NodeId) -> Option<u32> {
        match self.nodes[node as usize].kind {
            NodeKind::Surface { patch } => Some(patch),
            NodeKind::Cluster => None,
        }
    }

    /// The scene's polygon under a surface node; none for a cluster.
    pub fn polygon_of(&self, node: NodeId) -> Option<u32> {
        self.patch_of(node).map(|patch| self.patches[patch as usize].polygon)
    }
}

/// A cell longer than this times its width is halved across its length alone. At 2 a child is never thinner than its
/// parent.
const LONG_CELL: f64 = 2.0;

impl Elements {
    /// One root cluster over patches without children. `pieces` are the convex pieces of every polygon of the scene,
    /// polygon by polygon.
    pub fn new(pieces: &[Vec<Vec<DVec3>>]) -> Self {
        let count = pieces.iter().map(Vec::len).sum::<usize>() as u32;
        let mut elements = Self::default();
        elements.nodes.push(Node {
            kind: NodeKind::Cluster,
            parent: 0,
            first_child: 1,
            child_count: count,
            first_corner: 0,
            corner_count: 0,
            area: 0.0,
            centre: DVec3::ZERO,
            cell_min: DVec2::ZERO,
            cell_max: DVec2::ZERO,
        });
        for (polygon, pieces) in (0..).zip(pieces) {
            for outline in pieces {
                let (frame, cell) = Patch::around(polygon, elements.nodes.len() as u32, outline);
                let patch = elements.patches.len() as u32;
                elements.patches.push(frame);
                elements.push_surface(0, patch, outline, DVec2::ZERO, cell);
            }
        }
        let total: f64 = elements.nodes.iter().map(|node| node.area).sum();
        let centre = elements.nodes.iter().map(|node| node.centre * node.area).sum::<DVec3>();
        elements.nodes[0].area = total;
        elements.nodes[0].centre = if total > 0.0 { centre / total } else { DVec3::ZERO };
        elements
    }

    fn push_surface(&mut self, parent: NodeId, patch: u32, outline: &[DVec3], cell_min: DVec2, cell_max: DVec2) {
        self.nodes.push(Node {
            kind: NodeKind::Surface { patch },
            parent,
            first_child: 0,
            child_count: 0,
            first_corner: self.outlines.len() as u32,
            corner_count: outline.len() as u32,
            area: area_vector(outline).length(),
            centre: centroid(outline),
            cell_min,
            cell_max,
        });
        self.outlines.extend_from_slice(outline);
    }

    /// Longer side of a surface node's cell, metres.
    pub fn cell_length(&self, node: NodeId) -> f64 {
        let node = &self.nodes[node as usize];
        (node.cell_max - node.cell_min).max_element()
    }

    /// Divides all leaves whose cell is longer than `length`, metres, until none is.
    pub fn divide_larger(&mut self, length: f64) {
        let mut node = 0;
        // New nodes come at the end, and are looked at in their turn.
        while (node as usize) < self.nodes.len() {
            if self.is_leaf(node) && self.cell_length(node) > length {
                self.subdivide(node);
            }
            node += 1;
        }
    }

    /// Divides a leaf into four, or into two across its length if it is long; children that the patch leaves empty
    /// are omitted. Nothing happens to a node that has children already, and to clusters.
    pub fn subdivide(&mut self, node: NodeId) {
        let NodeKind::Surface { patch } = self.nodes[node as usize].kind else { return };
        if self.nodes[node as usize].child_count > 0 {
            return;
        }
        let Node { cell_min, cell_max, area, .. } = self.nodes[node as usize];
        let (size, middle) = (cell_max - cell_min, (cell_min + cell_max) / 2.0);
        let frame = self.patches[patch as usize];
        let mut cells = vec![(self.outline(node).to_vec(), cell_min, cell_max)];
        for (axis, index, split) in
            [(frame.u, 0, size.x * LONG_CELL > size.y), (frame.v, 1, size.y * LONG_CELL > size.x)]
        {
            if !split {
                continue;
            }
            let line = axis.dot(frame.origin) + middle[index];
            let tolerance = size[index] * 1e-9;
            cells = cells
                .into_iter()
                .flat_map(|(outline, low, high)| {
                    let (mut below, mut above) = (Vec::new(), Vec::new());
                    clip_convex(&outline, tolerance, |p| line - axis.dot(p), &mut below);
                    clip_convex(&outline, tolerance, |p| axis.dot(p) - line, &mut above);
                    let (mut end, mut start) = (high, low);
                    end[index] = middle[index];
                    start[index] = middle[index];
                    [(below, low, end), (above, start, high)]
                })
                .collect();
        }
        let first_child = self.nodes.len() as u32;
        // A sliver that rounding left over is not worth an element.
        for (outline, low, high) in cells {
            if area_vector(&outline).length() > area * 1e-9 {
                self.push_surface(node, patch, &outline, low, high);
            }
        }
        self.nodes[node as usize].first_child = first_child;
        self.nodes[node as usize].child_count = self.nodes.len() as u32 - first_child;
    }
}

impl Patch {
    /// The frame along the longest edge of an outline, and the size of the bounding rectangle in it.
    fn around(polygon: u32, root: NodeId, outline: &[DVec3]) -> (Self, DVec2) {
        let normal = area_vector(outline).normalize_or_zero();
        let mut longest = DVec3::ZERO;
        for (i, &corner) in outline.iter().enumerate() {
            let edge = outline[(i + 1) % outline.len()] - corner;
            if edge.length_squared() > longest.length_squared() * (1.0 + 1e-9) {
                longest = edge;
            }
        }
        let u = longest.normalize_or_zero();
        let v = normal.cross(u);
        let project = |p: &DVec3| DVec2::new(u.dot(*p), v.dot(*p));
        let low = outline.iter().map(project).fold(DVec2::INFINITY, DVec2::min);
        let high = outline.iter().map(project).fold(DVec2::NEG_INFINITY, DVec2::max);
        let depth = outline.first().map_or(0.0, |p| normal.dot(*p));
        (Self { polygon, root, origin: u * low.x + v * low.y + normal * depth, u, v }, high - low)
    }

    /// Coordinates of a position in the patch's frame, metres.
    pub fn coordinates(&self, position: DVec3) -> DVec2 {
        self.along(position - self.origin)
    }

    /// Components of an offset along u and v, metres.
    pub fn along(&self, offset: DVec3) -> DVec2 {
        DVec2::new(self.u.dot(offset), self.v.dot(offset))
    }

    /// Unit normal, to the front.
    pub fn normal(&self) -> DVec3 {
        self.u.cross(self.v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(outline: Vec<DVec3>) -> Elements {
        Elements::new(&[vec![outline]])
    }

    #[test]
    fn nothing_and_slivers() {
        let mut empty = Elements::new(&[]);
        empty.subdivide(0);
        assert_eq!(empty.nodes.len(), 1);
        let mut sliver =
            elements([(0., 0.), (1e-3, 0.), (1e-3, 4.), (0., 4.)].map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec());
        for node in 1..9 {
            sliver.subdivide(node);
        }
        assert!(
            sliver
                .leaves()
                .all(|leaf| sliver.nodes[leaf as usize].cell_min.x == 0.0
                    || sliver.nodes[leaf as usize].cell_min.y == 0.0)
        );
    }

    #[test]
    fn children_cover_their_parent() {
        let hexagon =
            (0..6).map(|i| DVec3::new((f64::from(i) * 1.04).cos() * 2.0, 0.3, -(f64::from(i) * 1.04).sin())).collect();
        let mut elements = elements(hexagon);
        for node in 1..60 {
            elements.subdivide(node);
            let sum: f64 = elements.children(node).map(|child| elements.nodes[child as usize].area).sum();
            assert!((sum / elements.nodes[node as usize].area - 1.0).abs() < 1e-9);
            for child in elements.children(node) {
                let cell = elements.nodes[child as usize];
                let patch = &elements.patches[0];
                for corner in elements.outline(child) {
                    let at = patch.coordinates(*corner);
                    assert!((at.cmpge(cell.cell_min - 1e-12) & at.cmple(cell.cell_max + 1e-12)).all());
                }
            }
        }
    }
}
