//! View factors: the solver's own between polygons, and from an element to a polygon, beside Howell's closed forms.

use std::f64::consts::TAU;

use glam::DVec3;
use solver::{form_factor, form_factor_at};

use super::closed_form::{
    coaxial_disks, element_to_parallel_rectangle, element_to_perpendicular_rectangle, opposed_rectangles,
    parallel_rectangles, perpendicular_rectangles,
};
use super::room::{FLOOR, LOW_Y, cuboid, facing_down, reversed};
use super::{Case, EXACT, Group};

/// C-11: F = 2/(πXY) { ½ ln[(1+X²)(1+Y²)/(1+X²+Y²)] + … } with X = a/c, Y = b/c: [`opposed_rectangles`].
const OPPOSED: Group = Group { name: "opposed rectangles", source: "Howell C-11", bound: EXACT };

/// The sum of sixteen terms, one a pair of corners: [`parallel_rectangles`].
const PARALLEL: Group = Group { name: "parallel rectangles", source: "Howell, by corners", bound: EXACT };

/// C-14, with H = h/l and W = w/l: [`perpendicular_rectangles`].
const PERPENDICULAR: Group = Group { name: "perpendicular rectangles", source: "Howell C-14", bound: EXACT };

/// All that leaves a wall of a closed room arrives somewhere: the row of its view factors sums to 1.
const CLOSURE: Group = Group { name: "rows of closed rooms", source: "Σ F = 1", bound: EXACT };

/// F = { A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²)) }/(2π): [`element_to_parallel_rectangle`].
const ELEMENT_PARALLEL: Group =
    Group { name: "element to parallel rectangle", source: "Howell, corner on the normal", bound: EXACT };

/// F = { atan X − atan(X/√(1+Y²))/√(1+Y²) }/(2π): [`element_to_perpendicular_rectangle`].
const ELEMENT_PERPENDICULAR: Group =
    Group { name: "element to perpendicular rectangle", source: "Howell, corner at the foot", bound: EXACT };

/// F = (S − √(S² − 4 (r₂/r₁)²))/2: [`coaxial_disks`]. Polygons of 16, 32 and 64 sides, without their n⁻² and n⁻⁴ terms
/// (Richardson's extrapolation); what is left falls as n⁻⁶.
const DISKS: Group = Group { name: "coaxial disks", source: "Howell, disks as polygons", bound: EXACT };

/// A polygon of n sides misses its disk by a fraction of n⁻² of it: with twice the sides the error is a quarter. From 32 to
/// 64 sides the next term of the series still shows in the third digit.
const DISK_ORDER: Group = Group { name: "order of the polygons", source: "error as n⁻²", bound: 1e-2 };

/// All groups of this file.
pub fn cases() -> Vec<Case> {
    [opposed(), parallel(), perpendicular(), closure(), element_parallel(), element_perpendicular(), disks()].concat()
}

fn opposed() -> Vec<Case> {
    let shapes = [
        (1.0, 1.0, 1.0, Some(0.1998248957)),
        (1.0, 1.0, 0.5, Some(0.4152532836)),
        (1.0, 1.0, 1e-3, None),
        (1.0, 1.0, 5.0, None),
        (1.0, 0.1, 0.3, None),
        (1.0, 7.0, 1.9, None),
    ];
    let case = |(a, b, c, published)| {
        let ours = form_factor(&cuboid(DVec3::ZERO, DVec3::new(a, b, c))[FLOOR], &facing_down([0.0, a], [0.0, b], c));
        OPPOSED.case(format!("{a} × {b} at {c}"), published, opposed_rectangles(a, b, c), ours)
    };
    shapes.into_iter().map(case).collect()
}

fn parallel() -> Vec<Case> {
    let shapes = [
        ("a lamp over a floor", [[-2.0, 2.0], [-2.0, 2.0]], [[-0.5, 0.5], [-0.5, 0.5]], 1.0),
        ("side by side", [[0.0, 1.0], [0.0, 2.0]], [[1.0, 3.0], [0.5, 1.0]], 0.7),
        ("far apart", [[0.0, 1.0], [0.0, 1.0]], [[4.0, 5.0], [-3.0, -1.0]], 2.0),
    ];
    let case = |(name, first, second, c): (_, [[f64; 2]; 2], [[f64; 2]; 2], f64)| {
        let floor = reversed(facing_down(first[0], first[1], 0.0));
        let ours = form_factor(&floor, &facing_down(second[0], second[1], c));
        PARALLEL.case(name, None, parallel_rectangles(first, second, c), ours)
    };
    shapes.into_iter().map(case).collect()
}

fn perpendicular() -> Vec<Case> {
    let shapes = [
        (1.0, 1.0, 1.0, Some(0.2000437761)),
        (1.0, 2.0, 1.0, Some(0.2328526028)),
        (0.1, 1.0, 1.0, None),
        (30.0, 0.5, 1.0, None),
        (1e-3, 1e-3, 1.0, None),
        (2.0, 3.0, 0.1, None),
    ];
    let case = |(w, h, l, published)| {
        let sides = cuboid(DVec3::ZERO, DVec3::new(l, w, h));
        let ours = form_factor(&sides[FLOOR], &sides[LOW_Y]);
        PERPENDICULAR.case(format!("{w} and {h} along {l}"), published, perpendicular_rectangles(w, h, l), ours)
    };
    shapes.into_iter().map(case).collect()
}

fn closure() -> Vec<Case> {
    let row = |size: DVec3| {
        let sides = cuboid(DVec3::ZERO, size);
        sides.iter().map(|side| form_factor(&sides[FLOOR], side)).sum::<f64>()
    };
    let cube = opposed_rectangles(1.0, 1.0, 1.0) + 4.0 * perpendicular_rectangles(1.0, 1.0, 1.0);
    vec![
        CLOSURE.case("cube, C-11 + 4 · C-14", 1.0, cube, row(DVec3::ONE)),
        CLOSURE.case("office, 4 × 5 × 2.7", 1.0, 1.0, row(DVec3::new(4.0, 5.0, 2.7))),
        CLOSURE.case("gap, 10 × 10 × 0.01", 1.0, 1.0, row(DVec3::new(10.0, 10.0, 0.01))),
    ]
}

/// Bounds along and across, the distance, and a name: of rectangles before an element.
const BEFORE_AN_ELEMENT: [(&str, [f64; 2], [f64; 2], f64); 5] = [
    ("1 × 1 at 1", [0.0, 1.0], [0.0, 1.0], 1.0),
    ("0.01 × 3 at 0.7", [0.0, 0.01], [0.0, 3.0], 0.7),
    ("100 × 20 at 0.1", [0.0, 100.0], [0.0, 20.0], 0.1),
    ("around the normal", [-0.5, 0.7], [0.0, 0.4], 0.3),
    ("aside", [1.0, 1.5], [2.0, 2.2], 0.5),
];

fn element_parallel() -> Vec<Case> {
    let case = |(name, x, y, c)| {
        let ours = form_factor_at(DVec3::ZERO, DVec3::Z, &facing_down(x, y, c));
        ELEMENT_PARALLEL.case(name, None, element_to_parallel_rectangle(x, y, c), ours)
    };
    BEFORE_AN_ELEMENT.into_iter().map(case).collect()
}

fn element_perpendicular() -> Vec<Case> {
    let case = |(name, x, up, c): (&'static str, [f64; 2], [f64; 2], f64)| {
        // The rectangle stands at y = c and faces the element.
        let wall = [(x[0], up[0]), (x[1], up[0]), (x[1], up[1]), (x[0], up[1])].map(|(x, z)| DVec3::new(x, c, z));
        let ours = form_factor_at(DVec3::ZERO, DVec3::Z, &wall);
        ELEMENT_PERPENDICULAR.case(name, None, element_to_perpendicular_rectangle(x, up, c), ours)
    };
    BEFORE_AN_ELEMENT.into_iter().map(case).collect()
}

fn disks() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut orders = Vec::new();
    for (first, second, h) in [(1.0, 1.0, 1.0), (0.5, 2.0, 0.7), (1.0, 0.5, 6.0)] {
        let exact = coaxial_disks(first, second, h);
        let polygons = |sides| form_factor(&regular(sides, first, 0.0, 1.0), &regular(sides, second, h, -1.0));
        let [p, q, r] = [16, 32, 64].map(polygons);
        let (coarse, fine) = ((4.0 * q - p) / 3.0, (4.0 * r - q) / 3.0);
        let name = format!("radii {first} and {second} at {h}");
        cases.push(DISKS.case(name.clone(), None, exact, (16.0 * fine - coarse) / 15.0));
        orders.push(DISK_ORDER.case(name, None, 4.0, (q - exact) / (r - exact)));
    }
    cases.extend(orders);
    cases
}

/// A regular polygon inscribed in a circle around the z axis; it faces up for a `turn` of 1, down for −1.
fn regular(sides: u32, radius: f64, z: f64, turn: f64) -> Vec<DVec3> {
    let angle = |i: u32| turn * TAU * f64::from(i) / f64::from(sides);
    (0..sides).map(|i| DVec3::new(radius * angle(i).cos(), radius * angle(i).sin(), z)).collect()
}
