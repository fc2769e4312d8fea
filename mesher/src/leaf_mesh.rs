//! The triangulation of leaves (Hardt & Teller 1996, section 2.1): a constrained Delaunay triangulation of each leaf's
//! border and discontinuities, which adds no vertex on a border. The only file that names spade.
//!
//! spade is handed points that the edge table keeps apart and constraints that do not cross; its answer is counted and
//! its area checked, and where something is amiss the leaf becomes a star around its middle, which cannot fail.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::EdgeKind;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::EdgeTable;
use crate::edge_table::{BorderEdge, LeafEdges};

/// Area that a triangulation may differ from its leaf's by, as a fraction: roundings of the sum, nothing else.
const AREA_TOLERANCE: f64 = 1e-9;

/// Triangles that fill all leaves without overlap or T-junction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, metres.
    pub vertices: Vec<DVec3>,
    /// Number of vertices on borders of leaves; they come first.
    pub border_vertices: u32,
    /// Triangles, leaf by leaf.
    pub triangles: Vec<MeshTriangle>,
    /// What did not go as planned.
    pub statistics: MeshStatistics,
}

/// A triangle of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshTriangle {
    /// Vertex ids, counter-clockwise from the front.
    pub vertices: [u32; 3],
    /// Index of the leaf.
    pub leaf: u32,
    /// What the edges 0→1, 1→2 and 2→0 are.
    pub edges: [EdgeKind; 3],
}

/// Counts of a triangulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshStatistics {
    /// Constraints that the triangulation does not follow.
    pub dropped_constraints: u64,
    /// Leaves that became stars around their middle.
    pub star_leaves: u64,
    /// Leaves too thin for the welding distance, without triangles.
    pub collapsed_leaves: u64,
}

/// Triangulates every leaf of a table, in order.
pub fn leaf_meshes(table: &EdgeTable) -> Mesh {
    let leaves: Vec<LeafTriangles> = table.leaves.par_iter().map(|leaf| triangulate(leaf, &table.vertices)).collect();
    let mut mesh = Mesh {
        vertices: table.vertices.clone(),
        border_vertices: table.border_vertices,
        triangles: Vec::with_capacity(leaves.iter().map(|leaf| leaf.triangles.len()).sum()),
        statistics: MeshStatistics::default(),
    };
    for (id, (edges, leaf)) in (0..).zip(table.leaves.iter().zip(leaves)) {
        let centre = mesh.vertices.len() as u32;
        mesh.vertices.extend(leaf.centre);
        let on_border = edges.border.len() as u32;
        let name = |local: u32| match edges.border.get(local as usize) {
            Some(edge) => edge.from,
            None if leaf.centre.is_some() => centre,
            None => edges.interior.start + local - on_border,
        };
        let kind = |a: u32, b: u32| {
            if a.max(b) < on_border && (a + 1) % on_border == b {
                return edges.border[a as usize].kind;
            }
            let ends = [name(a), name(b)];
            let along = edges.constraints.iter().find(|edge| edge.ends == ends || edge.ends == [ends[1], ends[0]]);
            along.map_or(EdgeKind::Interior, |edge| EdgeKind::Discontinuity(edge.line))
        };
        mesh.triangles.extend(leaf.triangles.iter().map(|&[a, b, c]| MeshTriangle {
            vertices: [a, b, c].map(name),
            leaf: id,
            edges: [kind(a, b), kind(b, c), kind(c, a)],
        }));
        mesh.statistics.dropped_constraints += leaf.dropped;
        mesh.statistics.star_leaves += u64::from(leaf.centre.is_some());
        mesh.statistics.collapsed_leaves += u64::from(edges.border.is_empty());
    }
    mesh
}

/// One leaf's triangles, in indices of its border vertices and then its interior ones or, in a star, its centre.
#[derive(Debug, Default, PartialEq)]
struct LeafTriangles {
    triangles: Vec<[u32; 3]>,
    dropped: u64,
    /// Middle of a star.
    centre: Option<DVec3>,
}

fn triangulate(leaf: &LeafEdges, vertices: &[DVec3]) -> LeafTriangles {
    if leaf.border.is_empty() {
        return LeafTriangles { dropped: leaf.constraints.len() as u64, ..LeafTriangles::default() };
    }
    delaunay(leaf, vertices).unwrap_or_else(|| star(leaf, vertices))
}

/// The constrained Delaunay triangulation; none if it does not fill the border exactly.
fn delaunay(leaf: &LeafEdges, vertices: &[DVec3]) -> Option<LeafTriangles> {
    let border: Vec<u32> = leaf.border.iter().map(|edge| edge.from).collect();
    let points: Vec<DVec2> = border
        .iter()
        .copied()
        .chain(leaf.interior.clone())
        .map(|id| leaf.frame.to_plane(vertices[id as usize]))
        .collect();
    let mut triangulation = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(points.len());
    for point in &points {
        let handle = triangulation.insert(Point2::new(point.x, point.y)).ok()?;
        if handle.index() != handles.len() {
            return None; // It coincides with an earlier point.
        }
        handles.push(handle);
    }
    for (i, from) in handles[..border.len()].iter().enumerate() {
        if triangulation.try_add_constraint(*from, handles[(i + 1) % border.len()]).is_empty() {
            return None;
        }
    }
    let mut dropped = 0;
    for constraint in &leaf.constraints {
        let local = constraint.ends.map(|end| match border.iter().position(|&id| id == end) {
            Some(i) => i,
            None => border.len() + (end - leaf.interior.start) as usize,
        });
        dropped += u64::from(triangulation.try_add_constraint(handles[local[0]], handles[local[1]]).is_empty());
    }
    let triangles: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| vertex.fix().index() as u32))
        .filter(|triangle| !lies_on_one_side(triangle, &leaf.border))
        .collect();

    // Euler's formula for a disc, and the area: together they leave no room for a hole, an overlap or a stray triangle.
    let expected = border.len() + 2 * (points.len() - border.len()) - 2;
    let area = |corners: &[DVec2]| {
        let origin = corners[0];
        corners.windows(2).map(|edge| (edge[0] - origin).perp_dot(edge[1] - origin)).sum::<f64>()
    };
    let whole = area(&points[..border.len()]);
    let sum: f64 = triangles.iter().map(|triangle| area(&triangle.map(|i| points[i as usize]))).sum();
    let fills = triangles.len() == expected && (sum - whole).abs() <= AREA_TOLERANCE * whole;
    fills.then_some(LeafTriangles { triangles, dropped, centre: None })
}

/// Whether all corners of a triangle are vertices of one side of the border. Sides are straight but for roundings, so
/// such a triangle is a chip between the border and its hull, which belongs to nobody.
fn lies_on_one_side(triangle: &[u32; 3], border: &[BorderEdge]) -> bool {
    let sides = |i: u32| {
        let i = i as usize;
        (i < border.len()).then(|| [border[(i + border.len() - 1) % border.len()].side, border[i].side])
    };
    let [Some(a), Some(b), Some(c)] = triangle.map(sides) else { return false };
    a.iter().any(|side| b.contains(side) && c.contains(side))
}

/// Triangles between the border's edges and its middle.
fn star(leaf: &LeafEdges, vertices: &[DVec3]) -> LeafTriangles {
    let count = leaf.border.len() as u32;
    let outline: Vec<DVec3> = leaf.border.iter().map(|edge| vertices[edge.from as usize]).collect();
    LeafTriangles {
        triangles: (0..count).map(|i| [i, (i + 1) % count, count]).collect(),
        dropped: leaf.constraints.len() as u64,
        centre: Some(scene::centroid(&outline)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::collections::HashMap;

    use proptest::prelude::*;
    use scene::area_vector;

    use super::*;
    use solver::Cut;

    use crate::edge_table::Constraint;
    use crate::testing::{Room, room, scene_of};
    use crate::{Leaf, LeafSegment, edge_table};

    fn point(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.0)
    }

    fn square() -> Vec<DVec3> {
        vec![point(0.0, 0.0), point(1.0, 0.0), point(1.0, 1.0), point(0.0, 1.0)]
    }

    fn segment(line: u32, ax: f64, ay: f64, bx: f64, by: f64) -> LeafSegment {
        LeafSegment { ends: [point(ax, ay), point(bx, by)], line }
    }

    /// The mesh of a unit square that is one leaf, checked.
    fn square_with(segments: Vec<LeafSegment>) -> Mesh {
        mesh_of(square(), segments)
    }

    fn mesh_of(outline: Vec<DVec3>, segments: Vec<LeafSegment>) -> Mesh {
        let scene = scene_of(&[square()]);
        let leaves = [Leaf { element: 1, polygon: 0, outline, segments }];
        let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
        let sum: f64 = mesh.triangles.iter().map(|triangle| area(&mesh, triangle)).sum();
        assert!((sum - area_vector(&leaves[0].outline).length()).abs() < 1e-9, "area {sum}");
        mesh
    }

    fn area(mesh: &Mesh, triangle: &MeshTriangle) -> f64 {
        let corners = triangle.vertices.map(|vertex| mesh.vertices[vertex as usize]);
        area_vector(&corners).length()
    }

    fn lines_of(mesh: &Mesh) -> Vec<u32> {
        let mut lines: Vec<u32> = mesh
            .triangles
            .iter()
            .flat_map(|triangle| triangle.edges)
            .filter_map(|edge| if let EdgeKind::Discontinuity(line) = edge { Some(line) } else { None })
            .collect();
        lines.sort_unstable();
        lines.dedup();
        lines
    }

    #[test]
    fn degenerate_outlines_give_nothing_or_their_area() {
        let (a, b) = (point(0.0, 0.0), point(1.0, 1.0));
        for outline in [vec![], vec![a], vec![a, b], vec![a; 5], vec![a, b, a.lerp(b, 0.5)], vec![a, b, a, b]] {
            let mesh = mesh_of(outline, vec![segment(0, 0.1, 0.1, 0.9, 0.4)]);
            assert_eq!((mesh.triangles.len(), mesh.statistics.collapsed_leaves), (0, 1));
        }
        let repeated = [0, 0, 1, 1, 1, 2, 3, 3, 0].map(|i: usize| square()[i]).to_vec();
        assert_eq!(mesh_of(repeated, vec![]).triangles.len(), 2);
        let mut flat = square();
        flat.insert(1, point(0.5, 0.0));
        flat.insert(1, point(0.25, 0.0));
        assert_eq!(mesh_of(flat, vec![]).triangles.len(), 4);
    }

    #[test]
    fn degenerate_segments_are_dropped() {
        let nan = f64::NAN;
        let mesh = square_with(vec![
            segment(0, 0.3, 0.3, 0.3, 0.3),
            segment(1, nan, 0.3, 0.7, 0.3),
            segment(2, 0.2, 0.2, 0.2 + 1e-12, 0.2),
            segment(3, 0.5, 0.0, 0.5, 0.001),
        ]);
        assert_eq!(lines_of(&mesh), []);
    }

    #[test]
    fn a_segment_along_the_border_marks_it() {
        for offset in [0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
            let mesh = square_with(vec![segment(4, 0.25, offset, 0.75, offset)]);
            assert_eq!((mesh.triangles.len(), lines_of(&mesh)), (4, vec![4]));
            let marked = mesh.triangles.iter().flat_map(|triangle| triangle.edges);
            assert_eq!(marked.filter(|&edge| edge == EdgeKind::Discontinuity(4)).count(), 1);
        }
        let whole = square_with(vec![segment(4, 0.0, 1.0, 1.0, 1.0)]);
        assert_eq!((whole.triangles.len(), lines_of(&whole)), (2, vec![4]));
    }

    #[test]
    fn twenty_segments_through_one_point() {
        let segments = (0..20)
            .map(|line| {
                let (sin, cos) = (f64::from(line) * std::f64::consts::PI / 20.0 + 0.01).sin_cos();
                let reach = 0.5 / sin.abs().max(cos.abs());
                segment(line, 0.5 - cos * reach, 0.5 - sin * reach, 0.5 + cos * reach, 0.5 + sin * reach)
            })
            .collect();
        let mesh = square_with(segments);
        assert_eq!(mesh.statistics, MeshStatistics::default());
        assert_eq!((mesh.triangles.len(), lines_of(&mesh).len()), (44, 20));
    }

    #[test]
    fn what_the_triangulation_cannot_do_becomes_a_star() {
        let scene = scene_of(&[square()]);
        let leaf = Leaf { outline: square(), segments: vec![segment(0, 0.2, 0.2, 0.8, 0.7)], ..Leaf::default() };
        let mut table = edge_table(&scene, &[], &[leaf]);
        // An end of the segment is moved onto a corner, which the table would never do.
        let end = table.leaves[0].interior.start as usize;
        table.vertices[end] = table.vertices[0];
        let mesh = leaf_meshes(&table);
        let statistics = MeshStatistics { dropped_constraints: 1, star_leaves: 1, collapsed_leaves: 0 };
        assert_eq!((mesh.triangles.len(), mesh.statistics), (4, statistics));
        assert!(mesh.triangles.iter().all(|triangle| (area(&mesh, triangle) - 0.25).abs() < 1e-12));
        assert!(mesh.triangles.iter().all(|triangle| triangle.edges[0] == EdgeKind::Leaf));
    }

    #[test]
    fn a_refused_constraint_is_counted() {
        let scene = scene_of(&[square()]);
        let leaf = Leaf { outline: square(), segments: vec![segment(0, 0.2, 0.2, 0.8, 0.7)], ..Leaf::default() };
        let mut table = edge_table(&scene, &[], &[leaf]);
        table.leaves[0].constraints.push(Constraint { ends: [1, 3], line: 1 });
        let mesh = leaf_meshes(&table);
        assert_eq!(mesh.statistics, MeshStatistics { dropped_constraints: 1, ..MeshStatistics::default() });
        assert_eq!(lines_of(&mesh), [0]);
    }

    #[test]
    fn cuts_put_vertices_at_their_ends_and_mark_the_border() {
        let scene = scene_of(&[square()]);
        let half = |y: f64| Leaf {
            outline: vec![point(0.0, y), point(1.0, y), point(1.0, y + 0.5), point(0.0, y + 0.5)],
            ..Leaf::default()
        };
        let cut = Cut { ends: [point(0.2, 0.5), point(0.7, 0.5)], other: 1 };
        let mesh = leaf_meshes(&edge_table(&scene, &[vec![cut]], &[half(0.0), half(0.5)]));
        let cuts: Vec<_> = mesh
            .triangles
            .iter()
            .flat_map(|t| t.edges.map(|edge| (t.leaf, edge)))
            .filter(|e| e.1 == EdgeKind::Cut)
            .collect();
        assert_eq!((mesh.vertices.len(), cuts), (8, vec![(0, EdgeKind::Cut), (1, EdgeKind::Cut)]));
    }

    #[test]
    fn a_line_that_one_leaf_drops_leaves_its_vertex_with_both() {
        let scene = scene_of(&[square()]);
        let half = |y: f64, segments| Leaf {
            outline: vec![point(0.0, y), point(1.0, y), point(1.0, y + 0.5), point(0.0, y + 0.5)],
            segments,
            ..Leaf::default()
        };
        let leaves = [half(0.0, vec![segment(0, 0.4, 0.0, 0.4, 0.5)]), half(0.5, vec![])];
        let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
        // Two triangles on each side of the line, and three in the other leaf.
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (8, 7));
    }

    #[test]
    fn nearly_coincident_segments_become_one() {
        for offset in [1e-15, 1e-12, 1e-9, 1e-6, 1e-4] {
            let segments = (0..8)
                .map(|line| {
                    let shift = f64::from(line) * offset;
                    segment(line, 0.0, 0.2 + shift, 1.0, 0.7 - shift)
                })
                .chain([segment(8, 0.4, 1.0, 0.4 + offset, 0.0)])
                .collect();
            let mesh = square_with(segments);
            assert_eq!(mesh.statistics, MeshStatistics::default());
            assert_eq!((mesh.vertices.len(), lines_of(&mesh)), (9, vec![0, 8]));
        }
    }

    #[test]
    fn near_coincident_corners_neither_panic_nor_lose_area() {
        for offset in [1e-12, 1e-9, 1e-6, 3e-6, 1e-5] {
            for shift in [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 0.5, 0.0)] {
                let mut outline = square();
                outline.insert(2, outline[1] + shift.abs() * offset * DVec3::new(0.0, 1.0, 0.0));
                outline.insert(1, outline[0] + shift.abs() * offset * DVec3::new(1.0, 0.0, 0.0));
                let mesh = mesh_of(outline, vec![segment(0, offset, 0.0, 0.6, 0.8), segment(1, 0.0, offset, 1.0, 0.3)]);
                assert_eq!(mesh.statistics.dropped_constraints, 0);
            }
        }
    }

    /// Every edge of a closed room belongs to two triangles that pass it in opposite directions.
    fn assert_watertight(mesh: &Mesh) {
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices;
            for edge in [(a, b), (b, c), (c, a)] {
                assert_eq!(edges.insert(edge, 1), None, "two triangles pass an edge in the same direction");
            }
        }
        for &(from, to) in edges.keys() {
            assert!(
                edges.contains_key(&(to, from)),
                "only one triangle has the edge {} – {}",
                mesh.vertices[from as usize],
                mesh.vertices[to as usize]
            );
        }
    }

    fn assert_fills_leaves(mesh: &Mesh, leaves: &[Leaf]) {
        let mut areas = vec![0.0; leaves.len()];
        for triangle in &mesh.triangles {
            areas[triangle.leaf as usize] += area(mesh, triangle);
        }
        for (leaf, area) in leaves.iter().zip(areas) {
            let expected = area_vector(&leaf.outline).length();
            assert!((area - expected).abs() <= 1e-9 * expected, "{area} of {expected}");
        }
    }

    /// Constraints are edges, and segments lie within a few snapping distances of edges that are not interior.
    fn assert_follows_segments(mesh: &Mesh, table: &EdgeTable, leaves: &[Leaf]) {
        let mut missing = 0;
        for (id, (leaf, edges)) in (0..).zip(leaves.iter().zip(&table.leaves)) {
            let mut ends = Vec::new();
            for triangle in mesh.triangles.iter().filter(|triangle| triangle.leaf == id) {
                let [a, b, c] = triangle.vertices;
                for (edge, kind) in [[a, b], [b, c], [c, a]].into_iter().zip(triangle.edges) {
                    if kind != EdgeKind::Interior {
                        ends.push(edge);
                    }
                }
            }
            missing += edges.constraints.iter().filter(|edge| !ends.contains(&edge.ends)).count() as u64;
            let snap = edges.frame.scale / 256.0;
            for segment in leaf.segments.iter().filter(|segment| segment.ends[0].distance(segment.ends[1]) > snap) {
                for step in 0..=16 {
                    let point = segment.ends[0].lerp(segment.ends[1], f64::from(step) / 16.0);
                    let distance = ends
                        .iter()
                        .map(|edge| {
                            let [a, b] = edge.map(|vertex| mesh.vertices[vertex as usize]);
                            let t = ((point - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
                            a.lerp(b, t).distance(point)
                        })
                        .fold(f64::INFINITY, f64::min);
                    assert!(distance <= 4.0 * snap, "{distance} from line {}", segment.line);
                }
            }
        }
        assert_eq!(missing, mesh.statistics.dropped_constraints);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn rooms_are_watertight_full_and_follow_their_lines(Room { scene, leaves } in room()) {
            let table = edge_table(&scene, &[], &leaves);
            let mesh = leaf_meshes(&table);
            assert_watertight(&mesh);
            assert_fills_leaves(&mesh, &leaves);
            assert_follows_segments(&mesh, &table, &leaves);
            prop_assert_eq!(mesh.statistics, MeshStatistics::default());
        }

        #[test]
        fn points_on_a_coarse_grid_give_no_panic(ends in prop::collection::vec(prop::array::uniform4(0..=4u8), 0..30), jitter in 0..4usize) {
            let jitter = [0.0, 1e-12, 1e-9, 1e-6][jitter];
            let segments = (0..).zip(&ends).map(|(line, ends)| {
                let wobble = 1.0 + jitter * f64::from(line % 5) - 2.0 * jitter;
                let [ax, ay, bx, by] = ends.map(|x| (f64::from(x) / 4.0 * wobble).clamp(0.0, 1.0));
                segment(line, ax, ay, bx, by)
            });
            let mesh = square_with(segments.collect());
            prop_assert_eq!(mesh.statistics, MeshStatistics::default());
        }
    }
}
