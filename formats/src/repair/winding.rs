//! Winding: neighbours that face opposite ways are turned to the side that most of their surface faces.
//!
//! Two faces agree where they run along their common edge in opposite directions. From face to face that decides how a
//! whole surface is turned, unless it has one side only. What emits is never turned, and nothing is turned for its
//! sake: a lamp may well shine the other way than the panel beside it.

use glam::DVec3;
use scene::area_vector;

use super::edges::sorted_sides;
use crate::face::Face;

/// What was done about faces that disagree with their neighbours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Winding {
    /// The faces that were turned, as their places in the list.
    pub turned: Vec<u32>,
    /// Surfaces with one side only, like a Möbius strip, which stay as they are.
    pub one_sided: usize,
}

/// How a face is joined to a neighbour.
#[derive(Clone, Copy)]
struct Joint {
    faces: [u32; 2],
    agree: bool,
}

/// Turns faces so that neighbours agree, where edges are of exactly two faces of which neither `stays` as it is; the side with the greater
/// area wins, of equal ones that of the earliest face.
pub(crate) fn orient(faces: &mut [Face], vertices: &[DVec3], stays: impl Fn(&Face) -> bool) -> Winding {
    let mut joints = Vec::new();
    for pair in sorted_sides(faces).chunk_by(|a, b| a.ends == b.ends) {
        let [p, q] = pair else { continue };
        let fixed = [p, q].iter().any(|side| stays(&faces[side.face as usize]));
        if p.face != q.face && !fixed {
            joints.push(Joint { faces: [p.face, q.face], agree: p.down != q.down });
        }
    }
    let mut winding = Winding::default();
    if joints.iter().all(|joint| joint.agree) {
        return winding;
    }
    // By face, its joints: a run of one list for each.
    let mut by_face: Vec<(u32, u32)> = (0..).zip(&joints).flat_map(|(i, joint)| joint.faces.map(|f| (f, i))).collect();
    by_face.sort_unstable();
    let mut first = vec![0; faces.len() + 1];
    by_face.iter().for_each(|&(face, _)| first[face as usize + 1] += 1);
    (1..first.len()).for_each(|i| first[i] += first[i - 1]);

    // Whether a face is turned against the first of its surface.
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    for start in 0..faces.len() as u32 {
        if turned[start as usize].is_some() {
            continue;
        }
        turned[start as usize] = Some(false);
        let (mut surface, mut next, mut two_sided) = (vec![start], 0, true);
        while let Some(&face) = surface.get(next) {
            next += 1;
            let way = turned[face as usize] == Some(true);
            for &(_, joint) in &by_face[first[face as usize]..first[face as usize + 1]] {
                let Joint { faces: [p, q], agree } = joints[joint as usize];
                let other = if p == face { q } else { p };
                let expected = if agree { way } else { !way };
                match turned[other as usize] {
                    Some(known) => two_sided &= known == expected,
                    None => {
                        turned[other as usize] = Some(expected);
                        surface.push(other);
                    }
                }
            }
        }
        settle(faces, vertices, (&surface, two_sided), &turned, &mut winding);
    }
    winding.turned.sort_unstable();
    winding
}

/// Turns the smaller part of one surface.
fn settle(
    faces: &mut [Face],
    vertices: &[DVec3],
    (surface, two_sided): (&[u32], bool),
    turned: &[Option<bool>],
    winding: &mut Winding,
) {
    if !two_sided {
        winding.one_sided += 1;
        return;
    }
    let is_turned = |face: u32| turned[face as usize] == Some(true);
    if !surface.iter().any(|&face| is_turned(face)) {
        return;
    }
    let mut areas = [0.0; 2];
    for &face in surface {
        areas[usize::from(is_turned(face))] += area_vector(&faces[face as usize].outline(vertices)).length();
    }
    // The first of the surface is its earliest face, so the others are turned where areas are equal.
    let wrong = areas[1] <= areas[0];
    for &face in surface.iter().filter(|&&face| is_turned(face) == wrong) {
        faces[face as usize].corners.reverse();
        winding.turned.push(face);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;
    use crate::face::Corner;

    const CUBE: [[u32; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

    fn corners() -> Vec<DVec3> {
        let base = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)];
        [0.0, 1.0].into_iter().flat_map(|z| base.map(|(x, y)| DVec3::new(x, y, z))).collect()
    }

    fn faces(outlines: &[Vec<u32>]) -> Vec<Face> {
        let corners = |outline: &Vec<u32>| outline.iter().map(|&vertex| Corner { vertex, seam: 0 }).collect();
        (1..).zip(outlines).map(|(line, o)| Face { corners: corners(o), material: 0, object: 0, line }).collect()
    }

    fn cube(turned: &[usize]) -> Vec<Face> {
        let mut faces = faces(&CUBE.map(|outline| outline.to_vec()));
        turned.iter().for_each(|&face| faces[face].corners.reverse());
        faces
    }

    #[test]
    fn nothing_and_what_is_right_stay() {
        assert_eq!(orient(&mut [], &[], |_| false), Winding::default());
        for faces in [cube(&[]), cube(&[0, 1, 2, 3, 4, 5])] {
            let mut same = faces.clone();
            assert_eq!(orient(&mut same, &corners(), |_| false), Winding::default());
            assert_eq!(same, faces);
        }
    }

    #[test]
    fn the_greater_area_wins() {
        for (turned, places) in [(vec![2], vec![2]), (vec![0, 1, 2, 3, 5], vec![4]), (vec![1, 4], vec![1, 4])] {
            let mut faces = cube(&turned);
            assert_eq!(orient(&mut faces, &corners(), |_| false).turned, places);
            assert_eq!(orient(&mut faces, &corners(), |_| false), Winding::default());
        }
    }

    #[test]
    fn of_equal_areas_the_earliest_face_stays() {
        let mut faces = cube(&[0, 3, 4]);
        assert_eq!(orient(&mut faces, &corners(), |_| false).turned, [1, 2, 5]);
    }

    #[test]
    fn what_emits_is_not_turned_and_turns_nothing() {
        let mut faces = cube(&[1]);
        let before = faces.clone();
        assert_eq!(orient(&mut faces, &corners(), |face| face.line == 2), Winding::default());
        assert_eq!(faces, before);
    }

    #[test]
    fn a_moebius_strip_stays_and_is_counted() {
        let vertices: Vec<DVec3> = (0..3)
            .flat_map(|i| {
                let (sin, cos) = (f64::from(i) * 2.1).sin_cos();
                let (tilt_sin, tilt_cos) = (f64::from(i) * 1.05).sin_cos();
                let out = DVec3::new(cos, sin, 0.0);
                [-0.3, 0.3].map(|s| out * (1.0 + s * tilt_cos) + DVec3::Z * s * tilt_sin)
            })
            .collect();
        let mut strip = faces(&[vec![0, 2, 3, 1], vec![2, 4, 5, 3], vec![4, 1, 0, 5]]);
        let before = strip.clone();
        assert_eq!(orient(&mut strip, &vertices, |_| false), Winding { turned: vec![], one_sided: 1 });
        assert_eq!(strip, before);
    }

    proptest! {
        #[test]
        fn whatever_is_turned_the_cube_is_closed_again(turned in proptest::collection::btree_set(0..6usize, 0..6)) {
            let turned: Vec<usize> = turned.into_iter().collect();
            let mut faces = cube(&turned);
            let winding = orient(&mut faces, &corners(), |_| false);
            prop_assert_eq!(winding.turned.len(), turned.len().min(6 - turned.len()));
            let sum: DVec3 = faces.iter().map(|face| area_vector(&face.outline(&corners()))).sum();
            prop_assert!(sum.length() < 1e-12);
        }
    }
}
