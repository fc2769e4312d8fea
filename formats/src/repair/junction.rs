//! T-junctions: a vertex that lies on the side of a neighbour becomes a corner of it.
//!
//! Only open sides are looked at, of which one lies along the other: they are one border that two modellers cut
//! differently, or one did twice. A leg that stands on a floor makes no junction, nor do the edges of closed things.

use glam::DVec3;
use scene::{Plane, is_convex};

use super::edges::{Side, sorted_sides};
use super::point_tree::PointTree;
use crate::attributes::AttributeTable;
use crate::convex::PLANARITY;
use crate::face::{Corner, Face, size};
use crate::merge::STRAIGHT;

/// Distance of a vertex from the side that it lies on, as a fraction of the scene's size: coordinates of six digits
/// pass, gaps that could be seen do not.
const REACH: f64 = 5e-7;

/// What was done about T-junctions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Junctions {
    /// Corners that were inserted.
    pub closed: usize,
    /// Corners that would have bent their face or made it concave, and are missing still.
    pub left: usize,
}

/// A vertex on a side, by face, corner that the side starts at, and place along it.
type Insertion = (u32, u32, f64, u32);

/// Inserts the vertices that lie on open sides of other faces as corners of these, without moving anything; what their corners
/// have beside positions is interpolated along the side.
pub(crate) fn close_junctions(faces: &mut [Face], vertices: &[DVec3], attributes: &mut AttributeTable) -> Junctions {
    let sides = sorted_sides(faces);
    let open: Vec<Side> =
        sides.chunk_by(|a, b| a.ends == b.ends).filter(|group| group.len() == 1).map(|group| group[0]).collect();
    drop(sides);
    // Open sides by their vertices.
    let mut at: Vec<(u32, u32)> = (0..).zip(&open).flat_map(|(i, side)| side.ends.map(|end| (end, i))).collect();
    at.sort_unstable();
    let ends: Vec<u32> = at.chunk_by(|a, b| a.0 == b.0).map(|group| group[0].0).collect();
    let tree = PointTree::new(ends.into_iter().map(|vertex| (vertices[vertex as usize], vertex)).collect());
    let reach = REACH * size(vertices);

    let mut insertions: Vec<Insertion> = Vec::new();
    let mut near = Vec::new();
    for side in &open {
        let face = &faces[side.face as usize];
        let next = (side.corner as usize + 1) % face.corners.len();
        let [from, to] = [face.corners[side.corner as usize].vertex, face.corners[next].vertex];
        let line = Segment { from: vertices[from as usize], to: vertices[to as usize] };
        near.clear();
        tree.near_segment(line.from, line.to, reach, &mut |vertex| near.push(vertex));
        for &vertex in &near {
            let point = vertices[vertex as usize];
            let (place, distance) = line.place(point);
            let inside = place > 0.0 && place < 1.0 && distance <= reach;
            if !inside || line.from.distance(point) <= reach || line.to.distance(point) <= reach {
                continue;
            }
            let first = at.partition_point(|entry| entry.0 < vertex);
            let others = at[first..].iter().take_while(|entry| entry.0 == vertex).map(|entry| open[entry.1 as usize]);
            let along = |other: Side| {
                let end = vertices[(other.ends[0] ^ other.ends[1] ^ vertex) as usize];
                let (end_place, distance) = line.place(end);
                // A side that reaches far beyond may leave the line by as much more.
                other.face != side.face && distance <= reach * end_place.abs().max(1.0)
            };
            if others.into_iter().any(along) && face.corners.iter().all(|corner| corner.vertex != vertex) {
                insertions.push((side.face, side.corner, place, vertex));
            }
        }
    }
    insertions.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)).then(a.3.cmp(&b.3)));
    insertions.dedup_by_key(|insertion| (insertion.0, insertion.3));
    let mut junctions = Junctions::default();
    for group in insertions.chunk_by(|a, b| a.0 == b.0) {
        let face = &mut faces[group[0].0 as usize];
        match with_corners(face, group, vertices, attributes) {
            Some(corners) => {
                face.corners = corners;
                junctions.closed += group.len();
            }
            None => junctions.left += group.len(),
        }
    }
    junctions
}

/// A face's corners with those of `insertions`, which belong to it and are sorted; none if it is convex and planar no
/// longer.
fn with_corners(
    face: &Face,
    insertions: &[Insertion],
    vertices: &[DVec3],
    attributes: &mut AttributeTable,
) -> Option<Vec<Corner>> {
    let mut corners = Vec::with_capacity(face.corners.len() + insertions.len());
    let mut rest = insertions.iter().peekable();
    for (place, &corner) in (0..).zip(&face.corners) {
        corners.push(corner);
        let next = face.corners[(place as usize + 1) % face.corners.len()];
        while let Some(&(.., along, vertex)) = rest.next_if(|insertion| insertion.1 == place) {
            corners.push(Corner { vertex, seam: attributes.between([corner.seam, next.seam], along) });
        }
    }
    let outline = crate::face::outline(&corners, vertices);
    let plane = Plane::through(&outline);
    let flat = outline.iter().all(|&point| plane.distance(point).abs() <= PLANARITY * size(&outline));
    (flat && is_convex(&outline, plane.normal, STRAIGHT)).then_some(corners)
}

struct Segment {
    from: DVec3,
    to: DVec3,
}

impl Segment {
    /// Where along the line a point is, 0 at `from` and 1 at `to`, and how far from the line, metres.
    fn place(&self, point: DVec3) -> (f64, f64) {
        let along = self.to - self.from;
        let place = (point - self.from).dot(along) / along.length_squared();
        (place, (self.from + along * place).distance(point))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use glam::{Vec2, Vec3};
    use proptest::prelude::*;
    use scene::area_vector;

    use super::*;
    use crate::attributes::Attributes;

    fn close(faces: &mut [Face], vertices: &[DVec3]) -> Junctions {
        close_junctions(faces, vertices, &mut AttributeTable::default())
    }

    fn face(corners: &[u32]) -> Face {
        let corners = corners.iter().map(|&vertex| Corner { vertex, seam: 0 }).collect();
        Face { corners, material: 0, object: 0, line: 1 }
    }

    fn at(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.5)
    }

    fn vertices_of(face: &Face) -> Vec<u32> {
        face.corners.iter().map(|corner| corner.vertex).collect()
    }

    #[test]
    fn nothing_stays_nothing() {
        assert_eq!(close(&mut [], &[]), Junctions::default());
        let mut alone = [face(&[0, 1, 2])];
        assert_eq!(close(&mut alone, &[DVec3::ZERO, DVec3::X, DVec3::Y]), Junctions::default());
    }

    /// A square beside two halves, whose middle vertex lies on its side.
    fn wall(offset: f64) -> (Vec<Face>, Vec<DVec3>) {
        let vertices = vec![
            at(0., 0.),
            at(1., 0.),
            at(1., 1.),
            at(0., 1.),
            at(2., 0.),
            at(2., 0.5),
            at(2., 1.),
            at(1. + offset, 0.5),
        ];
        (vec![face(&[0, 1, 2, 3]), face(&[1, 4, 5, 7]), face(&[7, 5, 6, 2])], vertices)
    }

    #[test]
    fn a_vertex_on_a_neighbours_side_becomes_its_corner() {
        let (mut faces, vertices) = wall(0.0);
        assert_eq!(close(&mut faces, &vertices), Junctions { closed: 1, left: 0 });
        assert_eq!(vertices_of(&faces[0]), [0, 1, 7, 2, 3]);
        // Once is enough.
        assert_eq!(close(&mut faces, &vertices), Junctions::default());
    }

    #[test]
    fn an_inserted_corner_has_what_lies_between_its_neighbours() {
        let (mut faces, mut vertices) = wall(0.0);
        vertices[5].y = 0.25;
        vertices[7].y = 0.25;
        let mut table = AttributeTable::default();
        for (corner, uv) in faces[0].corners.iter_mut().zip([(0., 0.), (4., 0.), (4., 8.), (0., 8.)]) {
            let normal = Vec3::new(corner.vertex as f32 - 1.5, 0.0, 1.0).normalize();
            corner.seam = table.intern(Attributes { uv: Some(uv.into()), normal: Some(normal) });
        }
        assert_eq!(close_junctions(&mut faces, &vertices, &mut table), Junctions { closed: 1, left: 0 });
        assert_eq!(vertices_of(&faces[0]), [0, 1, 7, 2, 3]);
        let [from, inserted, to] = [1, 2, 3].map(|i| table.get(faces[0].corners[i].seam));
        assert_eq!(inserted.uv, Some(Vec2::new(4.0, 2.0)));
        let expected = from.normal.unwrap().lerp(to.normal.unwrap(), 0.25).normalize();
        assert!((inserted.normal.unwrap() - expected).length() < 1e-6);
        // Faces without any stay without.
        assert!(faces[1..].iter().flat_map(|face| &face.corners).all(|corner| corner.seam == 0));
        let (mut plain, _) = wall(0.0);
        close_junctions(&mut plain, &vertices, &mut table);
        assert!(plain[0].corners.len() == 5 && plain[0].corners.iter().all(|corner| corner.seam == 0));
    }

    #[test]
    fn a_vertex_that_would_dent_the_neighbour_is_left_and_counted_and_one_that_lies_off_is_none() {
        let (mut faces, vertices) = wall(-1e-6);
        assert_eq!(close(&mut faces, &vertices), Junctions { closed: 0, left: 1 });
        for offset in [1e-2, -1e-2, 3e-6] {
            let (mut faces, vertices) = wall(offset);
            assert_eq!(close(&mut faces, &vertices), Junctions::default(), "{offset}");
        }
    }

    #[test]
    fn what_merely_touches_a_side_is_no_junction() {
        // A triangle with one corner in the middle of the square's side, pointing away.
        let vertices = [at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.), at(1., 0.5), at(2., 0.2), at(2., 0.8)];
        let mut faces = [face(&[0, 1, 2, 3]), face(&[4, 5, 6])];
        assert_eq!(close(&mut faces, &vertices), Junctions::default());
    }

    #[test]
    fn a_long_side_along_many_is_found_without_trying_all_pairs() {
        const STEPS: u32 = 20_000;
        let mut vertices = vec![at(0., 0.), at(f64::from(STEPS), 0.)];
        let mut faces = Vec::new();
        for i in 0..=STEPS {
            vertices.extend([at(f64::from(i), 1.0), at(f64::from(i), 2.0)]);
            if i < STEPS {
                let a = 2 + 2 * i;
                faces.push(face(&[a, a + 2, a + 3, a + 1]));
            }
        }
        faces.push(face(&[0, 1, 2 + 2 * STEPS, 2]));
        let junctions = close(&mut faces, &vertices);
        assert_eq!(junctions, Junctions { closed: STEPS as usize - 1, left: 0 });
        assert_eq!(faces.last().unwrap().corners.len(), STEPS as usize + 3);
    }

    proptest! {
        /// Rows of rectangles cut at random: afterwards both sides of the seam have the same vertices, nothing moved.
        #[test]
        fn a_seam_between_two_rows_is_closed(
            below in proptest::collection::btree_set(1..40u32, 0..8), above in proptest::collection::btree_set(1..40u32, 0..8),
        ) {
            let (mut vertices, mut ids) = (Vec::new(), std::collections::HashMap::new());
            let mut faces = Vec::new();
            for (cuts, y) in [(&below, 0u32), (&above, 1)] {
                let places: Vec<u32> = [0].into_iter().chain(cuts.iter().copied()).chain([40]).collect();
                for pair in places.windows(2) {
                    let corners = [(pair[0], y), (pair[1], y), (pair[1], y + 1), (pair[0], y + 1)].map(|place| {
                        *ids.entry(place).or_insert_with(|| {
                            vertices.push(DVec3::new(f64::from(place.0) / 7.0, f64::from(place.1), f64::from(place.0)));
                            vertices.len() as u32 - 1
                        })
                    });
                    faces.push(face(&corners));
                }
            }
            let area = |faces: &[Face]| faces.iter().map(|face| area_vector(&face.outline(&vertices))).sum::<DVec3>();
            let before = area(&faces);
            let junctions = close(&mut faces, &vertices);
            let both = below.intersection(&above).count();
            prop_assert_eq!(junctions, Junctions { closed: below.len() + above.len() - 2 * both, left: 0 });
            prop_assert!((area(&faces) - before).length() < 1e-9);
            prop_assert_eq!(close(&mut faces, &vertices), Junctions::default());
        }
    }
}
