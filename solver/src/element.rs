//! Elements: the quadtree over every patch, in one flat arena.
//!
//! A patch is a convex piece of an input polygon after it has been cut along its contact lines. Its quadtree divides
//! the patch's bounding rectangle; every cell is clipped to the patch. The arena has one root, a cluster whose
//! children are the patches, so that clusters between the root and the patches need no new kind of node.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

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
