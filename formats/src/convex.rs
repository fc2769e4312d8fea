//! Splitting: faces that are not planar or not convex become pieces that are both.

use std::f64::consts::PI;

use earcut::Earcut;
use glam::DVec3;
use scene::{Plane, area_vector, is_convex};

use crate::face::{Corner, Face, size};
use crate::merge::{STRAIGHT, merge_triangles};

/// Largest distance of a corner from its polygon's plane, as a fraction of the polygon's size: coordinates written
/// with six digits pass, a quad that is visibly bent does not.
const PLANARITY: f64 = 1e-5;

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
    if outline.len() < 3 || area <= thickness * size / 2.0 || area <= 0.0 {
        return Shape::Degenerate;
    }
    let plane = Plane::through(outline);
    let planar = outline.iter().all(|&point| plane.distance(point).abs() <= PLANARITY * size);
    if outline.len() == 3 || planar && turns_once(outline, plane.normal) {
        return Shape::Convex;
    }
    let triangles = triangulate(outline, plane.normal);
    let covered: f64 = triangles.iter().map(|t| signed_area(outline, *t, plane.normal).abs()).sum();
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

/// Triangles that cover an outline, seen along its normal, as places in the outline; every corner is in one.
fn triangulate(outline: &[DVec3], normal: DVec3) -> Vec<[u32; 3]> {
    let (u, v) = normal.any_orthonormal_pair();
    let mut flat: Vec<u32> = Vec::new();
    Earcut::new().earcut(outline.iter().map(|&p| [(p - outline[0]).dot(u), (p - outline[0]).dot(v)]), &[], &mut flat);
    let mut used = vec![false; outline.len()];
    flat.iter().for_each(|&place| used[place as usize] = true);
    let mut triangles = Vec::new();
    for &[a, b, c] in flat.as_chunks::<3>().0 {
        let turned = signed_area(outline, [a, b, c], normal) < 0.0;
        restore_corners(if turned { [a, c, b] } else { [a, b, c] }, &used, &mut triangles);
    }
    triangles
}

/// Splits a triangle at the corners of the outline that lie straight on its sides: ear clipping leaves them out, but
/// a neighbour may end there.
fn restore_corners([a, b, c]: [u32; 3], used: &[bool], triangles: &mut Vec<[u32; 3]>) {
    let after = |place: u32| (place + 1) % used.len() as u32;
    // Whether all corners of the outline between the two places were left out, and there are some.
    let skipped = |from: u32, to: u32| {
        let mut place = after(from);
        while place != to && !used[place as usize] {
            place = after(place);
        }
        place == to && after(from) != to
    };
    // Each split takes the first skipped corner of a side; the rest of the side is split in turn.
    let mut waiting = vec![[a, b, c]];
    while let Some([a, b, c]) = waiting.pop() {
        match [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|&[from, to, _]| skipped(from, to)) {
            None => triangles.push([a, b, c]),
            Some([from, to, apex]) => waiting.extend([[after(from), to, apex], [from, after(from), apex]]),
        }
    }
}

/// Twice-counted areas are positive where a triangle faces along `normal`.
fn signed_area(outline: &[DVec3], triangle: [u32; 3], normal: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|place| outline[place as usize]);
    (b - a).cross(c - a).dot(normal) / 2.0
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
    let (pieces, _) = merge_triangles(faces.collect(), outline, PLANARITY);
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
    fn an_l_shape_is_cut_in_two_and_loses_no_straight_corner() {
        let outline =
            flat(&[(0., 0.), (1., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.), (0., 1.5), (0., 0.5)]);
        let Shape::Concave(pieces) = shape_of(&outline, 1e-9) else { panic!("an L is concave") };
        assert_eq!(pieces.len(), 2);
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
        assert_eq!(shape_of(&flat(&[(0., 0.), (2., 0.), (0., 1.), (3., 1.)]), 1e-9), Shape::Crossing);
        let star: Vec<(f64, f64)> = (0..5).map(|i| (0.8 * PI * f64::from(i)).sin_cos()).collect();
        let star = flat(&star);
        assert!(!matches!(shape_of(&star, 1e-9), Shape::Convex));
        let spike = flat(&[(0., 0.), (1., 0.), (2., 0.), (1., 0.), (1., 1.), (0., 1.)]);
        let Shape::Concave(pieces) = shape_of(&spike, 1e-9) else { panic!("a spike is not convex") };
        assert!((areas(&spike, &pieces).iter().sum::<f64>() - area_vector(&spike).length()).abs() < 1e-12);
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
        #[test]
        fn pieces_of_a_star_shaped_outline_cover_it(radii in proptest::collection::vec(0.2..1.0f64, 3..40)) {
            let step = 2.0 * PI / radii.len() as f64;
            let points: Vec<_> = radii.iter().enumerate().map(|(i, r)| (r * (step * i as f64).cos(), r * (step * i as f64).sin())).collect();
            let outline = flat(&points);
            match shape_of(&outline, 1e-9) {
                Shape::Convex => prop_assert!(is_convex(&outline, area_vector(&outline).normalize(), STRAIGHT)),
                Shape::Concave(pieces) => {
                    let areas = areas(&outline, &pieces);
                    prop_assert!(areas.iter().all(|&area| area > 0.0));
                    prop_assert!((areas.iter().sum::<f64>() - area_vector(&outline).length()).abs() < 1e-9);
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
