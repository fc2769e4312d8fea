//! The table of all edges (Hardt & Teller 1996, section 2.1): what the leaves' triangulations have in common.
//!
//! Leaves are triangulated in parallel and must still agree on their borders, within a polygon and across polygons,
//! or pictures show pinholes and interpolants jump. So everything that lies on a border is decided here, once:
//! 1. Corners of leaves and ends of cuts are welded into vertices, and every leaf's border takes up all the vertices
//!    that lie on it. After that borders conform: where two leaves meet they have the same edges.
//! 2. A discontinuity that ends on a border splits an edge of it, by name, for all leaves that have the edge. A line
//!    that only one of two neighbours keeps so leaves its vertex with both.
//! 3. What remains of the discontinuities is inside single leaves and is arranged there.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;
use scene::{Bvh, EdgeKind, Scene, Welder};
use solver::Cut;

use crate::arrangement::{self, Arrangement, Segment, arrange};
use crate::frame::Frame;

/// Points nearer than this fraction of the scene's size (or of its largest coordinate, if that is larger) are one
/// vertex. It is about what the f32 positions that are stored can tell apart. Larger would close wider cracks between
/// polygons that a modeller left apart, but move vertices off lines of contact, to where irradiance is another.
const WELD: f64 = 1e-7;

/// A discontinuity goes through a vertex that it passes within this fraction of the leaf's diameter. Larger saves
/// slivers and samples; but where a penumbra is as wide as the leaf, moving its edge costs that fraction of the light.
const SNAP: f64 = 1.0 / 256.0;

/// Corners that turn by less than this (sine of the angle) belong to one side of the outline.
const FLAT: f64 = 1e-7;

/// A leaf element, and what divides it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leaf {
    /// The solver's node.
    pub element: u32,
    /// The polygon that it is a part of.
    pub polygon: u32,
    /// Convex outline, counter-clockwise from the front, metres.
    pub outline: Vec<DVec3>,
    /// The discontinuities chosen for this leaf, clipped to it.
    pub segments: Vec<LeafSegment>,
}

/// What is asked of a leaf once it is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshedLeaf {
    /// The solver's node.
    pub element: u32,
    /// The polygon that it is a part of.
    pub polygon: u32,
}

impl From<&Leaf> for MeshedLeaf {
    fn from(leaf: &Leaf) -> Self {
        Self { element: leaf.element, polygon: leaf.polygon }
    }
}

/// The part of a discontinuity inside one leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafSegment {
    /// Ends in the polygon's plane, metres.
    pub ends: [DVec3; 2],
    /// Index of the discontinuity's line.
    pub line: u32,
}

/// The vertices of the mesh, and the edges that every leaf's triangulation must have.
#[derive(Clone, Debug, Default)]
pub struct EdgeTable {
    /// Positions, metres: first all that lie on borders, then those inside leaves.
    pub(crate) vertices: Vec<DVec3>,
    /// Number of vertices that lie on borders.
    pub(crate) border_vertices: u32,
    /// By leaf.
    pub(crate) leaves: Vec<LeafEdges>,
}

/// What the triangulation of one leaf is given.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeafEdges {
    pub(crate) frame: Frame,
    /// The closed border, counter-clockwise; empty for a leaf that welding has collapsed.
    pub(crate) border: Vec<BorderEdge>,
    /// Vertices inside.
    pub(crate) interior: std::ops::Range<u32>,
    /// Edges inside, which meet only at vertices.
    pub(crate) constraints: Vec<Constraint>,
}

/// An edge of a leaf's border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BorderEdge {
    /// The vertex that it starts from; it ends where the next one starts.
    pub(crate) from: u32,
    /// The side of the outline that it is a part of.
    pub(crate) side: u32,
    pub(crate) kind: EdgeKind,
}

/// An edge along a discontinuity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Constraint {
    pub(crate) ends: [u32; 2],
    pub(crate) line: u32,
}

/// Builds the table for all leaves of a scene. `cuts` are by polygon.
pub fn edge_table(scene: &Scene, cuts: &[Vec<Cut>], leaves: &[Leaf]) -> EdgeTable {
    let (low, high) = scene.bounds();
    let size = scene.size().max(low.abs().max_element()).max(high.abs().max_element()).max(f64::MIN_POSITIVE);
    let weld = WELD * size;

    let (mut vertices, corners) = weld_corners(scene, cuts, leaves, weld);
    let index = VertexIndex::new(&vertices, size);
    let mut leaf_edges: Vec<LeafEdges> = leaves
        .par_iter()
        .zip(corners)
        .map(|(leaf, corners)| {
            let frame = Frame::around(&leaf.outline, scene.plane(leaf.polygon).normal);
            LeafEdges { frame, border: border(&corners, &vertices, &index), ..LeafEdges::default() }
        })
        .collect();

    let places: Vec<Vec<[Place; 2]>> = leaves
        .par_iter()
        .zip(&leaf_edges)
        .map(|(leaf, edges)| leaf.segments.iter().map(|segment| place(segment, edges, &vertices, weld)).collect())
        .collect();
    let splits = split_edges(&places, &mut vertices);

    let cuts: Vec<CutIndex<'_>> = cuts.par_iter().map(|cuts| CutIndex::new(cuts)).collect();
    let arrangements: Vec<Arrangement> = leaves
        .par_iter()
        .zip(&mut leaf_edges)
        .zip(places.into_par_iter().enumerate())
        .map(|((leaf, edges), (index, places))| {
            edges.border = splits.applied_to(&edges.border);
            let ends = |segment: usize, end: usize| splits.ends.get(&(index as u32, segment as u32, end as u32));
            let arrangement = arrange_leaf(leaf, edges, &places, ends, &vertices, weld);
            let cuts = cuts.get(leaf.polygon as usize).map_or_else(Vec::new, |cuts| cuts.around(&leaf.outline, weld));
            mark_border(&mut edges.border, &vertices, &cuts, &arrangement.along_border, weld);
            arrangement
        })
        .collect();

    let border_vertices = vertices.len() as u32;
    for (edges, arrangement) in leaf_edges.iter_mut().zip(arrangements) {
        let first = vertices.len() as u32;
        let on_border = edges.border.len();
        vertices.extend(arrangement.points[on_border..].iter().map(|&point| edges.frame.to_space(point)));
        edges.interior = first..vertices.len() as u32;
        let name = |local: u32| match edges.border.get(local as usize) {
            Some(edge) => edge.from,
            None => first + local - on_border as u32,
        };
        let constraint = |segment: &Segment| Constraint { ends: segment.ends.map(name), line: segment.line };
        edges.constraints = arrangement.segments.iter().map(constraint).collect();
    }
    EdgeTable { vertices, border_vertices, leaves: leaf_edges }
}

/// Vertices for the corners of polygons and leaves and for the ends of cuts; and the corners of each leaf by vertex.
fn weld_corners(scene: &Scene, cuts: &[Vec<Cut>], leaves: &[Leaf], weld: f64) -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let mut welder = Welder::new(weld);
    for &corner in &scene.corners {
        welder.vertex(scene.vertices[corner as usize]);
    }
    let corners =
        leaves.iter().map(|leaf| leaf.outline.iter().map(|&corner| welder.vertex(corner)).collect()).collect();
    for end in cuts.iter().flatten().flat_map(|cut| cut.ends) {
        welder.vertex(end);
    }
    (welder.into_vertices(), corners)
}

/// The border through the corners of a leaf and all vertices that lie on it.
fn border(corners: &[u32], vertices: &[DVec3], index: &VertexIndex<'_>) -> Vec<BorderEdge> {
    let mut corners = corners.to_vec();
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let count = corners.len();
    let position = |i: usize| vertices[corners[i % count] as usize];
    let turns = |i: usize| {
        let before = (position(i) - position(i + count - 1)).normalize_or_zero();
        let after = (position(i + 1) - position(i)).normalize_or_zero();
        before.cross(after).length() > FLAT || before.dot(after) < 0.0
    };
    let sides = (0..count).filter(|&i| turns(i)).count().max(1);
    let mut side = 0;
    let mut border = Vec::with_capacity(count);
    for (i, &corner) in corners.iter().enumerate() {
        side += usize::from(turns(i));
        let edge = |from: u32| BorderEdge { from, side: (side % sides) as u32, kind: EdgeKind::Leaf };
        border.push(edge(corner));
        border.extend(index.between(position(i), position(i + 1)).into_iter().map(edge));
    }
    remove_spurs(&mut border);
    border
}

/// Finds the cuts of a polygon that pass a leaf.
struct CutIndex<'a> {
    cuts: &'a [Cut],
    boxes: Bvh,
}

impl<'a> CutIndex<'a> {
    fn new(cuts: &'a [Cut]) -> Self {
        let segment = |cut: &Cut| [cut.ends[0], cut.ends[1], cut.ends[1]];
        Self { cuts, boxes: Bvh::of_triangles(cuts.iter().map(segment).collect()) }
    }

    /// The cuts whose boxes overlap that of an outline, padded by twice the weld; ascending.
    fn around(&self, outline: &[DVec3], weld: f64) -> Vec<&'a Cut> {
        let low = outline.iter().copied().fold(DVec3::INFINITY, DVec3::min) - 2.0 * weld;
        let high = outline.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max) + 2.0 * weld;
        let mut found = Vec::new();
        self.boxes.within(|from, to| from.cmple(high).all() && low.cmple(to).all(), |id| found.push(id));
        found.sort_unstable();
        found.into_iter().map(|id| &self.cuts[id as usize]).collect()
    }
}

/// Finds the vertices on an edge.
struct VertexIndex<'a> {
    vertices: &'a [DVec3],
    /// Boxes around the vertices, in units of the scene's size: the hierarchy works in f32 and takes directions for
    /// zero that are small against 1.
    boxes: Bvh,
    size: f64,
}

/// How far a vertex may be off an edge, as a fraction of the scene's size: it and the edge's ends may each have been
/// welded to something else.
const OFF_EDGE: f64 = 2.0 * WELD;

impl<'a> VertexIndex<'a> {
    fn new(vertices: &'a [DVec3], size: f64) -> Self {
        let around = |vertex: &DVec3| [-OFF_EDGE, 0.0, OFF_EDGE].map(|reach| *vertex / size + reach);
        Self { vertices, boxes: Bvh::of_triangles(vertices.iter().map(around).collect()), size }
    }

    /// The vertices on the way between two others, in order.
    fn between(&self, from: DVec3, to: DVec3) -> Vec<u32> {
        let mut between = Vec::new();
        self.boxes.near_segment(from / self.size, to / self.size, |id| {
            let point = self.vertices[id as usize];
            let t = (point - from).dot(to - from) / from.distance_squared(to);
            let off = point.distance(from.lerp(to, t));
            if point != from && point != to && t > 0.0 && t < 1.0 && off <= OFF_EDGE * self.size {
                between.push((t, id));
            }
        });
        between.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        between.into_iter().map(|(_, id)| id).collect()
    }
}

/// Takes out of a closed border where it goes to a vertex and straight back; nothing remains of one without area.
fn remove_spurs(border: &mut Vec<BorderEdge>) {
    while border.len() >= 3
        && let Some(i) = (0..border.len()).find(|&i| border[i].from == border[(i + 2) % border.len()].from)
    {
        let next = (i + 1) % border.len();
        border.remove(i.max(next));
        border.remove(i.min(next));
    }
    if border.len() < 3 {
        border.clear();
    }
}

/// Where the end of a segment lies in its leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// On an edge between two vertices, the smaller first: the parameter from it, and how far the end may be moved.
    Border { edge: [u32; 2], parameter: f64, reach: f64 },
    /// Inside, where nothing outside the leaf depends on it.
    Inside,
    /// Nowhere: the end is not a number, or the leaf has collapsed.
    Nowhere,
}

fn reach(frame: &Frame, weld: f64) -> f64 {
    (SNAP * frame.scale).max(4.0 * weld)
}

/// Finds out where the ends of a segment lie.
fn place(segment: &LeafSegment, edges: &LeafEdges, vertices: &[DVec3], weld: f64) -> [Place; 2] {
    let reach = reach(&edges.frame, weld);
    segment.ends.map(|end| {
        if edges.border.is_empty() || !segment.ends.iter().all(|end| end.is_finite()) {
            return Place::Nowhere;
        }
        let point = edges.frame.to_plane(end);
        let mut outside = true;
        let mut nearest = (f64::INFINITY, Place::Nowhere);
        for (i, edge) in edges.border.iter().enumerate() {
            let ends = [edge.from, edges.border[(i + 1) % edges.border.len()].from];
            let [a, b] = ends.map(|vertex| edges.frame.to_plane(vertices[vertex as usize]));
            let t = ((point - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
            let distance = a.lerp(b, t).distance(point) * edges.frame.scale;
            // A ray to the right crosses the border an odd number of times from inside.
            let crosses = (a.y > point.y) != (b.y > point.y) && ((b - a).perp_dot(point - a) > 0.0) == (b.y > a.y);
            outside ^= crosses;
            if distance < nearest.0 {
                let parameter = if ends[0] < ends[1] { t } else { 1.0 - t };
                let edge = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                nearest = (distance, Place::Border { edge, parameter, reach });
            }
        }
        if outside || nearest.0 <= reach { nearest.1 } else { Place::Inside }
    })
}

/// Vertices that discontinuities put on borders.
struct EdgeSplits {
    /// The new vertices on an edge, from its smaller vertex to its larger one.
    inserted: HashMap<[u32; 2], Vec<u32>>,
    /// The vertex of each segment's end that lies on a border, by leaf, segment and end.
    ends: HashMap<(u32, u32, u32), u32>,
}

/// Gives every end on a border a vertex, one of those within its reach if there is one.
fn split_edges(places: &[Vec<[Place; 2]>], vertices: &mut Vec<DVec3>) -> EdgeSplits {
    let mut requests = Vec::new();
    for (leaf, places) in (0..).zip(places) {
        for (segment, ends) in (0..).zip(places) {
            for (end, place) in (0..).zip(ends) {
                if let Place::Border { edge, parameter, reach } = *place {
                    requests.push((edge, parameter, reach, (leaf, segment, end)));
                }
            }
        }
    }
    requests.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)).then(x.3.cmp(&y.3)));
    let mut splits = EdgeSplits { inserted: HashMap::new(), ends: HashMap::new() };
    for requests in requests.chunk_by(|x, y| x.0 == y.0) {
        let edge = requests[0].0;
        let [from, to] = edge.map(|vertex| vertices[vertex as usize]);
        let length = from.distance(to);
        let mut last = (0.0, edge[0]);
        for &(_, parameter, reach, end) in requests {
            let vertex = if (parameter - last.0) * length <= reach {
                last.1
            } else if (1.0 - parameter) * length <= reach {
                edge[1]
            } else {
                last = (parameter, vertices.len() as u32);
                vertices.push(from.lerp(to, parameter));
                splits.inserted.entry(edge).or_default().push(last.1);
                last.1
            };
            splits.ends.insert(end, vertex);
        }
    }
    splits
}

impl EdgeSplits {
    /// A border with the new vertices in it.
    fn applied_to(&self, border: &[BorderEdge]) -> Vec<BorderEdge> {
        let mut split = Vec::with_capacity(border.len());
        for (i, edge) in border.iter().enumerate() {
            split.push(*edge);
            let to = border[(i + 1) % border.len()].from;
            let inserted = self.inserted.get(&[edge.from.min(to), edge.from.max(to)]).map_or(&[][..], Vec::as_slice);
            let part = |&from: &u32| BorderEdge { from, ..*edge };
            if edge.from < to {
                split.extend(inserted.iter().map(part));
            } else {
                split.extend(inserted.iter().rev().map(part));
            }
        }
        split
    }
}

/// Arranges the segments of one leaf.
fn arrange_leaf<'a>(
    leaf: &Leaf,
    edges: &LeafEdges,
    places: &[[Place; 2]],
    vertex_of: impl Fn(usize, usize) -> Option<&'a u32>,
    vertices: &[DVec3],
    weld: f64,
) -> Arrangement {
    let border = &edges.border;
    let local: HashMap<u32, u32> = (0..).zip(border).map(|(i, edge)| (edge.from, i)).collect();
    let mut segments = Vec::with_capacity(places.len());
    for (s, (segment, places)) in leaf.segments.iter().zip(places).enumerate() {
        let end = |e: usize| match places[e] {
            Place::Border { .. } => {
                vertex_of(s, e).and_then(|vertex| local.get(vertex)).map(|&i| arrangement::End::Point(i))
            }
            Place::Inside => Some(arrangement::End::Inside(edges.frame.to_plane(segment.ends[e]))),
            Place::Nowhere => None,
        };
        if let (Some(from), Some(to)) = (end(0), end(1)) {
            segments.push(([from, to], segment.line));
        }
    }
    let points = border.iter().map(|edge| edges.frame.to_plane(vertices[edge.from as usize])).collect();
    // A vertex lies on the sides of the edges before and after it.
    let sides = |i: u32| [border[(i as usize + border.len() - 1) % border.len()].side, border[i as usize].side];
    let same_side = |i: u32, j: u32| sides(i).iter().any(|side| sides(j).contains(side));
    arrange(points, &segments, reach(&edges.frame, weld) / edges.frame.scale, same_side)
}

/// Marks the edges of a border that lie on cuts or along discontinuities.
fn mark_border(border: &mut [BorderEdge], vertices: &[DVec3], cuts: &[&Cut], along: &[Segment], weld: f64) {
    let count = border.len();
    for segment in along {
        let [a, b] = segment.ends.map(|end| end as usize);
        for (from, to) in [(a, b), (b, a)] {
            let run = (to + count - from) % count;
            let side = border[from].side;
            if (0..run).all(|step| border[(from + step) % count].side == side) {
                for step in 0..run {
                    border[(from + step) % count].kind = EdgeKind::Discontinuity(segment.line);
                }
            }
        }
    }
    for i in 0..count {
        let ends = [border[i].from, border[(i + 1) % count].from].map(|vertex| vertices[vertex as usize]);
        let lies_on = |cut: &&Cut| ends.iter().all(|&end| distance_to_segment(end, cut.ends) <= 2.0 * weld);
        if cuts.iter().any(lies_on) {
            border[i].kind = EdgeKind::Cut;
        }
    }
}

fn distance_to_segment(point: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let length = a.distance_squared(b);
    let t = if length > 0.0 { ((point - a).dot(b - a) / length).clamp(0.0, 1.0) } else { 0.0 };
    a.lerp(b, t).distance(point)
}
