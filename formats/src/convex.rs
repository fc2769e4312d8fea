//! Splitting: faces that are not planar or not convex become pieces that are both.

use std::f64::consts::PI;

use earcut::Earcut;
use glam::DVec3;
use scene::{Plane, area_vector, is_convex};

use crate::face::{Corner, Face, size};
use crate::merge::{STRAIGHT, merge_triangles};

/// Largest distance of a corner from its polygon's plane, as a fraction of the polygon's size: coordinates written
/// with six digits pass, a quad that is visibly bent does not.
pub(crate) const PLANARITY: f64 = 1e-5;

/// Largest part of an outline's area that its triangles may miss or cover twice before it counts as crossing itself;
/// far above rounding, and a crossing that small could not be seen.
const AREA_TOLERANCE: f64 = 1e-6;

/// What a face needs before it is a polygon of the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Planar and convex: nothing.
    Convex,
    /// Planar but not convex; these are convex pieces, as places in the outline.
    Concave(Vec<Vec<u32>>),
    /// Not planar; these are planar, convex pieces, as places in the outline.
    Bent(Vec<Vec<u32>>),
    /// Fewer than three distinct corners, or no area: nothing is left of it.
    Degenerate,
    /// The outline crosses itself: which parts are inside cannot be known.
    Crossing,
}

/// Decides what a face needs. Thinner than `thickness` (metres) counts as no area.
pub(crate) fn shape_of(outline: &[DVec3], thickness: f64) -> Shape {
    let (size, area) = (size(outline), area_vector(outline).length());
    // What a strip of that thickness, as long as the outline, would cover.
    let least_area = thickness * size / 2.0;
    if outline.len() < 3 || area <= least_area {
        return Shape::Degenerate;
    }
    let plane = Plane::through(outline);
    let planar = outline.iter().all(|&point| plane.distance(point).abs() <= PLANARITY * size);
    if outline.len() == 3 || planar && turns_once(outline, plane.normal) {
        return Shape::Convex;
    }
    let triangles = triangulate(outline, plane.normal, least_area);
    let covered: f64 = triangles.iter().map(|t| doubled_area(outline, *t).dot(plane.normal).abs() / 2.0).sum();
    if (covered - area).abs() > AREA_TOLERANCE * area {
        return Shape::Crossing;
    }
    let pieces = rejoin(triangles, outline);
    if planar { Shape::Concave(pieces) } else { Shape::Bent(pieces) }
}

/// Whether an outline turns one way only, and once around.
fn turns_once(outline: &[DVec3], normal: DVec3) -> bool {
    let count = outline.len();
    let turns = (0..count).map(|i| {
        let (arrives, leaves) =
            (outline[(i + 1) % count] - outline[i], outline[(i + 2) % count] - outline[(i + 1) % count]);
        arrives.cross(leaves).dot(normal).atan2(arrives.dot(leaves))
    });
    // A turn of half a circle is a spike; twice around is a star.
    is_convex(outline, normal, STRAIGHT)
        && turns.clone().all(|turn| turn.abs() < PI - STRAIGHT)
        && turns.sum::<f64>() < 3.0 * PI
}

/// Triangles that cover an outline, seen along its normal, as places in the outline. None is of less than `least_area`,
/// and every corner that lies on the border of the covered part is a corner of a triangle there.
fn triangulate(outline: &[DVec3], normal: DVec3, least_area: f64) -> Vec<[u32; 3]> {
    let (u, v) = normal.any_orthonormal_pair();
    let mut ears: Vec<u32> = Vec::new();
    Earcut::new().earcut(outline.iter().map(|&p| [(p - outline[0]).dot(u), (p - outline[0]).dot(v)]), &[], &mut ears);
    // Straight corners come out of ear clipping in triangles without area, or not at all.
    let (mut used, mut triangles) = (vec![false; outline.len()], Vec::new());
    for &[a, b, c] in ears.as_chunks().0 {
        let doubled = doubled_area(outline, [a, b, c]);
        if doubled.length() > 2.0 * least_area {
            [a, b, c].iter().for_each(|&place| used[place as usize] = true);
            triangles.push(if doubled.dot(normal) < 0.0 { [a, c, b] } else { [a, b, c] });
        }
    }
    restore_corners(triangles, &used, |triangle| doubled_area(outline, triangle).length() <= 2.0 * least_area)
}

/// Splits triangles at the corners of the outline that lie straight on their sides and are in no triangle: a neighbour
/// may end there.
fn restore_corners(
    mut triangles: Vec<[u32; 3]>,
    used: &[bool],
    is_straight: impl Fn([u32; 3]) -> bool,
) -> Vec<[u32; 3]> {
    let after = |place: u32| (place + 1) % used.len() as u32;
    // Whether all corners of the outline between the two places were left out, and the first of them lies on the side.
    let skipped = |from: u32, to: u32| {
        let mut place = after(from);
        while place != to && !used[place as usize] {
            place = after(place);
        }
        place == to && after(from) != to && is_straight([from, after(from), to])
    };
    let mut whole = Vec::with_capacity(triangles.len());
    while let Some([a, b, c]) = triangles.pop() {
        match [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|&[from, to, _]| skipped(from, to)) {
            None => whole.push([a, b, c]),
            // The first skipped corner of a side; the rest of the side is split in turn.
            Some([from, to, apex]) => triangles.extend([[after(from), to, apex], [from, after(from), apex]]),
        }
    }
    whole
}

/// A vector along a triangle's normal, of twice its area.
fn doubled_area(outline: &[DVec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|place| outline[place as usize]);
    (b - a).cross(c - a)
}

/// Joins the triangles of one face into convex pieces again.
fn rejoin(triangles: Vec<[u32; 3]>, outline: &[DVec3]) -> Vec<Vec<u32>> {
    let corner = |vertex| Corner { vertex, seam: 0 };
    let faces = triangles.into_iter().map(|triangle| Face {
        corners: triangle.map(corner).to_vec(),
        material: 0,
        object: 0,
        line: 0,
    });
    let (pieces, _) = merge_triangles(faces.collect(), outline, PLANARITY, &|_| true);
    pieces.into_iter().map(|piece| piece.corners.into_iter().map(|corner| corner.vertex).collect()).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, y, 0.25 * x - 0.5 * y)).collect()
    }

    /// The pieces' areas along the outline's normal, after checking that each is convex.
    fn areas(outline: &[DVec3], pieces: &[Vec<u32>]) -> Vec<f64> {
        let normal = area_vector(outline).normalize();
        pieces
            .iter()
            .map(|piece| {
                let points: Vec<DVec3> = piece.iter().map(|&place| outline[place as usize]).collect();
                assert!(is_convex(&points, area_vector(&points).normalize(), STRAIGHT));
                area_vector(&points).dot(normal)
            })
            .collect()
    }

    #[test]
    fn degenerate_outlines() {
        for points in [&[][..], &[(1., 1.)], &[(0., 0.), (1., 0.)], &[(0., 0.), (1., 0.), (2., 0.)], &[(2., 2.); 5]] {
            assert_eq!(shape_of(&flat(points), 1e-9), Shape::Degenerate);
        }
        let sliver = flat(&[(0., 0.), (1., 0.), (0.5, 1e-8)]);
        assert_eq!(shape_of(&sliver, 1e-7), Shape::Degenerate);
        assert_eq!(shape_of(&sliver, 1e-10), Shape::Convex);
    }

    #[test]
    fn convex_outlines_stay_whole_with_their_straight_corners() {
        assert_eq!(shape_of(&flat(&[(0., 0.), (1., 0.), (2., 0.), (2., 2.), (0., 1.)]), 1e-9), Shape::Convex);
    }

    #[test]
    fn an_l_shape_is_cut_and_loses_no_straight_corner() {
        let outline =
            flat(&[(0., 0.), (1., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.), (0., 1.5), (0., 0.5)]);
        let Shape::Concave(pieces) = shape_of(&outline, 1e-9) else { panic!("an L is concave") };
        // At most two diagonals an inward corner are needed (Hertel and Mehlhorn).
        assert!(pieces.len() <= 3);
        assert!((areas(&outline, &pieces).iter().sum::<f64>() - area_vector(&outline).length()).abs() < 1e-12);
        assert!((0..9).all(|place| pieces.iter().flatten().any(|&p| p == place)));
    }

    #[test]
    fn a_bent_quad_becomes_two_triangles() {
        let mut outline = flat(&[(0., 0.), (1., 0.), (1., 1.), (0., 1.)]);
        outline[2].z += 1e-3;
        let Shape::Bent(pieces) = shape_of(&outline, 1e-9) else { panic!("it is bent by 1e-3") };
        assert_eq!(pieces.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
        outline[2].z += 1e-7 - 1e-3;
        assert_eq!(shape_of(&outline, 1e-9), Shape::Convex);
    }

    #[test]
    fn bow_ties_stars_and_spikes() {
        let bow = flat(&[(0., 0.), (2., 0.), (0., 1.), (3., 1.)]);
        assert_eq!(shape_of(&bow, 1e-9), Shape::Crossing);
        let star: Vec<(f64, f64)> = (0..5).map(|i| (0.8 * PI * f64::from(i)).sin_cos()).collect();
        let star = flat(&star);
        assert!(!matches!(shape_of(&star, 1e-9), Shape::Convex));
        let spike = flat(&[(0., 0.), (1., 0.), (2., 0.), (1., 0.), (1., 1.), (0., 1.)]);
        assert!(!matches!(shape_of(&spike, 1e-9), Shape::Convex));
    }

    #[test]
    fn a_ring_cut_open_at_a_seam_keeps_its_hole() {
        // How modellers without holes write a frame: in along a seam, around the hole, out again.
        let frame =
            flat(&[(0., 0.), (3., 0.), (3., 3.), (0., 3.), (0., 0.), (1., 1.), (1., 2.), (2., 2.), (2., 1.), (1., 1.)]);
        let Shape::Concave(pieces) = shape_of(&frame, 1e-9) else { panic!("a frame is concave") };
        let unit = area_vector(&flat(&[(0., 0.), (1., 0.), (1., 1.), (0., 1.)])).length();
        assert!((areas(&frame, &pieces).iter().sum::<f64>() - 8.0 * unit).abs() < 1e-9);
        assert!(pieces.len() <= 8);
    }

    proptest! {
        /// Corners around a centre at different distances, and straight ones between some of them.
        #[test]
        fn pieces_of_a_star_shaped_outline_cover_it(
            rays in proptest::collection::vec((0.2..1.0f64, any::<bool>()), 3..40),
        ) {
            let step = 2.0 * PI / rays.len() as f64;
            let at = |i: usize| {
                let (radius, angle) = (rays[i % rays.len()].0, step * (i % rays.len()) as f64);
                (radius * angle.cos(), radius * angle.sin())
            };
            let mut points = Vec::new();
            for (i, &(_, halved)) in rays.iter().enumerate() {
                points.push(at(i));
                if halved {
                    points.push(((at(i).0 + at(i + 1).0) / 2.0, (at(i).1 + at(i + 1).1) / 2.0));
                }
            }
            let outline = flat(&points);
            let normal = area_vector(&outline).normalize();
            match shape_of(&outline, 1e-9) {
                Shape::Convex => prop_assert!(is_convex(&outline, normal, STRAIGHT)),
                Shape::Concave(pieces) => {
                    let areas = areas(&outline, &pieces);
                    prop_assert!(areas.iter().all(|&area| area > 0.0));
                    prop_assert!((areas.iter().sum::<f64>() - area_vector(&outline).length()).abs() < 1e-7);
                    prop_assert!((0..points.len() as u32).all(|place| pieces.iter().flatten().any(|&p| p == place)));
                    // At most two diagonals an inward corner are needed (Hertel and Mehlhorn).
                    let inward = (0..points.len()).filter(|&i| {
                        let [a, b, c] = [i, i + 1, i + 2].map(|i| outline[i % points.len()]);
                        (b - a).normalize().cross((c - b).normalize()).dot(normal) < -STRAIGHT
                    });
                    prop_assert!(pieces.len() <= 2 * inward.count() + 1);
                }
                other => prop_assert!(false, "{:?}", other),
            }
        }

        #[test]
        fn no_outline_panics(points in proptest::collection::vec((-4..4i8, -4..4i8, -1..2i8), 0..20)) {
            let outline: Vec<DVec3> = points.iter().map(|&(x, y, z)| DVec3::new(x.into(), y.into(), z.into())).collect();
            shape_of(&outline, 1e-6);
        }
    }
}
