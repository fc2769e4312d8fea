//! Merging: triangles that a modeller cut a polygon into become convex polygons again.
//!
//! Pairs are united across whole shared edges, the longest first: the diagonal of a quad is longer than its sides, so
//! a triangulated quad becomes the same quad again before anything else happens (after Hertel and Mehlhorn, "Fast
//! triangulation of simple polygons", 1983, who take the diagonals in any order).

use glam::DVec3;
use scene::{Plane, area_vector, is_convex};

use crate::face::{Corner, Face, outline, size};

/// Sine of the largest reflex turn that still counts as straight: far above the rounding of coordinates in f64, far
/// below a turn that anyone models.
pub(crate) const STRAIGHT: f64 = 1e-6;

/// An edge that exactly two triangles share, in opposite directions.
struct SharedEdge {
    length: f64,
    faces: [usize; 2],
    /// The edge as the first of the faces runs along it.
    ends: [Corner; 2],
}

/// Unites triangles of one material and one object into convex polygons, as far as every corner of a union is within
/// `flatness` × its size of one plane. Faces of more corners stay as the file has them. A union stands at the place
/// of its first part.
///
/// Only what `agrees` with the outline of a union is made.
///
/// Returns the faces and, beside each, whether it is a union.
pub(crate) fn merge_triangles(
    faces: Vec<Face>,
    vertices: &[DVec3],
    flatness: f64,
    agrees: &dyn Fn(&[Corner]) -> bool,
) -> (Vec<Face>, Vec<bool>) {
    let mut edges = shared_edges(&faces, vertices);
    // Of triangles and their unions; no other face has a shared edge.
    let area = |face: &Face| if face.corners.len() == 3 { area_vector(&face.outline(vertices)) } else { DVec3::ZERO };
    let mut areas: Vec<DVec3> = faces.iter().map(area).collect();
    let mut faces: Vec<Option<Face>> = faces.into_iter().map(Some).collect();
    let mut united = vec![false; faces.len()];
    let mut part_of: Vec<usize> = (0..faces.len()).collect();
    // A union may make another possible (rows of a grid), so until a round changes nothing.
    loop {
        let before = edges.len();
        edges.retain(|edge| {
            let [p, q] = edge.faces.map(|face| whole(&mut part_of, face));
            let (Some(first), Some(second)) = (&faces[p], &faces[q]) else { return false };
            if p == q {
                return false;
            }
            let normal = (areas[p] + areas[q]).normalize_or_zero();
            let union = unite([&first.corners, &second.corners], edge.ends, normal, vertices, flatness);
            let Some(corners) = union.filter(|corners| agrees(corners)) else {
                return true;
            };
            let (keep, drop) = (p.min(q), p.max(q));
            faces[drop] = None;
            part_of[drop] = keep;
            areas[keep] = areas[p] + areas[q];
            united[keep] = true;
            if let Some(face) = &mut faces[keep] {
                face.corners = corners;
            }
            false
        });
        if edges.len() == before {
            break;
        }
    }
    faces.into_iter().zip(united).filter_map(|(face, united)| Some((face?, united))).unzip()
}

/// Edges between two triangles of one material and one object, the longest first, ties by face.
fn shared_edges(faces: &[Face], vertices: &[DVec3]) -> Vec<SharedEdge> {
    let mut half_edges = Vec::new();
    for (id, face) in faces.iter().enumerate().filter(|(_, face)| face.corners.len() == 3) {
        for i in 0..3 {
            let (from, to) = (face.corners[i], face.corners[(i + 1) % 3]);
            half_edges.push(((face.object, face.material, from.min(to), from.max(to)), from > to, id));
        }
    }
    half_edges.sort_unstable();
    let mut edges = Vec::new();
    for group in half_edges.chunk_by(|a, b| a.0 == b.0) {
        if let &[((.., low, high), false, p), (_, true, q)] = group {
            let [a, b] = [low, high].map(|corner| vertices[corner.vertex as usize]);
            edges.push(SharedEdge { length: a.distance(b), faces: [p, q], ends: [low, high] });
        }
    }
    edges.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.faces.cmp(&b.faces)));
    edges
}

/// The union that a face is now a part of.
fn whole(part_of: &mut [usize], mut face: usize) -> usize {
    while part_of[face] != face {
        part_of[face] = part_of[part_of[face]];
        face = part_of[face];
    }
    face
}

/// The union of two convex outlines p and q across the chain of edges that they share around `from`→`to` (in the direction
/// of p), or none if it is not convex and flat; `normal` is the union's. Corners inside the chain vanish: nothing outside can end at them.
fn unite(
    [p, q]: [&[Corner]; 2],
    [from, to]: [Corner; 2],
    normal: DVec3,
    at: &[DVec3],
    flatness: f64,
) -> Option<Vec<Corner>> {
    let (in_p, in_q) = (|i: usize| p[i % p.len()], |j: usize| q[j % q.len()]);
    // The chain runs from corner `first` to corner `last` of p, and from `start` to `end` of q.
    let mut first = (0..p.len()).find(|&i| in_p(i) == from && in_p(i + 1) == to)?;
    let mut start = (0..q.len()).find(|&j| in_q(j) == to && in_q(j + 1) == from)?;
    let (mut last, mut end) = (first + 1, start + 1);
    let longest = p.len().min(q.len()) - 1;
    while last - first < longest && in_p(last + 1) == in_q(start + q.len() - 1) {
        last += 1;
        start += q.len() - 1;
        end += q.len();
    }
    while last - first < longest && in_p(first + p.len() - 1) == in_q(end + 1) {
        first += p.len() - 1;
        last += p.len();
        end += 1;
    }
    let shared = last - first;
    // Most unions that are not convex are so where the outlines meet, which is looked at before anything is copied.
    let reflex = |corners: [Corner; 3]| {
        let [before, here, after] = corners.map(|corner| at[corner.vertex as usize]);
        let turn = (here - before).normalize_or_zero().cross((after - here).normalize_or_zero());
        // Twice, so that the exact test below decides whatever is near.
        turn.dot(normal) < -2.0 * STRAIGHT
    };
    if reflex([in_q(start + q.len() - 1), in_p(last), in_p(last + 1)])
        || reflex([in_p(first + p.len() - 1), in_p(first), in_q(end + 1)])
    {
        return None;
    }
    let union: Vec<Corner> =
        (last..=last + p.len() - shared).map(in_p).chain((end + 1..end + q.len() - shared).map(in_q)).collect();
    if union.len() < 3 {
        return None;
    }
    let points = outline(&union, at);
    let plane = Plane::through(&points);
    let reach = flatness * size(&points);
    let agrees = |part: &[Corner]| Plane::through(&outline(part, at)).normal.dot(plane.normal) > 0.0;
    let flat = || points.iter().all(|&point| plane.distance(point).abs() <= reach);
    (is_convex(&points, plane.normal, STRAIGHT) && flat() && agrees(p) && agrees(q)).then_some(union)
}

/// Removes the corners that merging left in the middle of straight sides, where every polygon that uses such a vertex
/// is a union and straight there. A vertex that any other polygon has as a corner stays in all: without it there would
/// be a T-junction.
pub(crate) fn drop_straight_corners(faces: &mut [Face], united: &[bool], vertices: &[DVec3]) {
    let mut needed = vec![false; vertices.len()];
    for (face, united) in faces.iter().zip(united) {
        let count = face.corners.len();
        for i in 0..count {
            let [before, here, after] =
                [i + count - 1, i, i + 1].map(|i| vertices[face.corners[i % count].vertex as usize]);
            let (arrives, leaves) = ((here - before).normalize_or_zero(), (after - here).normalize_or_zero());
            let straight = arrives.cross(leaves).length() <= STRAIGHT && arrives.dot(leaves) > 0.0;
            needed[face.corners[i].vertex as usize] |= !(*united && straight);
        }
    }
    for (face, _) in faces.iter_mut().zip(united).filter(|(_, united)| **united) {
        // A polygon has at least three corners that are not straight, but a round one of millions might not.
        if face.corners.iter().filter(|corner| needed[corner.vertex as usize]).count() >= 3 {
            face.corners.retain(|corner| needed[corner.vertex as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    fn face(corners: &[u32]) -> Face {
        let corners = corners.iter().map(|&vertex| Corner { vertex, seam: 0 }).collect();
        Face { corners, material: 0, object: 0, line: 1 }
    }

    fn grid(columns: u32, rows: u32) -> (Vec<Face>, Vec<DVec3>) {
        let mut vertices = Vec::new();
        for y in 0..=rows {
            for x in 0..=columns {
                vertices.push(DVec3::new(f64::from(x) * 0.7, f64::from(y) * 0.3, 1.0));
            }
        }
        let mut faces = Vec::new();
        for y in 0..rows {
            for x in 0..columns {
                let a = y * (columns + 1) + x;
                let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
                // The diagonals alternate.
                let halves = if (x + y) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                faces.extend(halves.map(|half| face(&half)));
            }
        }
        (faces, vertices)
    }

    fn merge(faces: Vec<Face>, vertices: &[DVec3]) -> Vec<Face> {
        let (mut faces, united) = merge_triangles(faces, vertices, 1e-6, &|_| true);
        drop_straight_corners(&mut faces, &united, vertices);
        faces
    }

    fn total_area(faces: &[Face], vertices: &[DVec3]) -> DVec3 {
        faces.iter().map(|face| area_vector(&face.outline(vertices))).sum()
    }

    #[test]
    fn nothing_and_one_triangle_stay() {
        assert!(merge(vec![], &[]).is_empty());
        assert_eq!(merge(vec![face(&[0, 1, 2])], &[DVec3::ZERO, DVec3::X, DVec3::Y]).len(), 1);
    }

    #[test]
    fn a_triangulated_quad_becomes_the_quad_and_quads_stay_apart() {
        let (faces, vertices) = grid(1, 1);
        let merged = merge(faces, &vertices);
        assert_eq!(merged.len(), 1);
        assert_eq!(merged[0].corners.len(), 4);
        let (_, vertices) = grid(2, 1);
        assert_eq!(merge(vec![face(&[0, 1, 4, 3]), face(&[1, 2, 5, 4])], &vertices).len(), 2);
    }

    #[test]
    fn a_triangulated_grid_becomes_one_rectangle_of_four_corners() {
        let (faces, vertices) = grid(5, 4);
        let area = total_area(&faces, &vertices);
        let merged = merge(faces, &vertices);
        assert_eq!(merged.len(), 1);
        assert_eq!(merged[0].corners.len(), 4);
        assert!((total_area(&merged, &vertices) - area).length() < 1e-12);
    }

    #[test]
    fn a_corner_that_a_neighbour_needs_stays() {
        let (mut faces, mut vertices) = grid(2, 1);
        // A fin that stands on the middle of the lower side, and one on the whole of the upper side.
        vertices.extend([DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.0, 0.3, 2.0)]);
        faces.extend([face(&[0, 1, 6]), face(&[5, 3, 7])]);
        let merged = merge(faces, &vertices);
        let floor = merged[0].corners.iter().map(|corner| corner.vertex).collect::<Vec<_>>();
        assert_eq!(merged.len(), 3);
        assert!(floor.len() == 5 && floor.contains(&1) && !floor.contains(&4), "{floor:?}");
    }

    #[test]
    fn other_materials_objects_seams_and_planes_stay_apart() {
        let (faces, mut vertices) = grid(1, 1);
        let mut other = faces.clone();
        other[1].material = 1;
        assert_eq!(merge(other, &vertices).len(), 2);
        let mut other = faces.clone();
        other[1].object = 1;
        assert_eq!(merge(other, &vertices).len(), 2);
        let mut other = faces.clone();
        other[1].corners[0].seam = 1;
        assert_eq!(merge(other, &vertices).len(), 2);
        vertices[3].z += 1e-4;
        assert_eq!(merge(faces, &vertices).len(), 2);
    }

    #[test]
    fn the_two_sides_of_a_sheet_are_not_united() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(merge(vec![face(&[0, 1, 2]), face(&[2, 1, 0])], &vertices).len(), 2);
    }

    #[test]
    fn an_l_shape_stays_two_convex_parts() {
        let vertices = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]].map(|corners| face(&corners)).to_vec();
        let merged = merge(faces, &vertices);
        assert_eq!(merged.len(), 2);
        for part in &merged {
            assert!(is_convex(&part.outline(&vertices), DVec3::Z, 1e-12));
        }
        assert!((total_area(&merged, &vertices).z - 3.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn unions_are_convex_and_cover_the_same_area(
            columns in 1..5u32, rows in 1..5u32, kept in proptest::collection::vec(any::<bool>(), 32),
        ) {
            let (faces, vertices) = grid(columns, rows);
            let faces: Vec<Face> = faces.into_iter().zip(kept.iter().cycle()).filter(|(_, k)| **k).map(|f| f.0).collect();
            let area = total_area(&faces, &vertices);
            let count = faces.len();
            let merged = merge(faces, &vertices);
            prop_assert!(merged.len() <= count);
            prop_assert!((total_area(&merged, &vertices) - area).length() < 1e-12);
            for part in &merged {
                prop_assert!(is_convex(&part.outline(&vertices), DVec3::Z, 1e-9));
            }
        }
    }
}
