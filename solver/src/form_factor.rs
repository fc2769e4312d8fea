//! Form factors of convex polygons, unoccluded: from a point by Lambert's formula, and from area to area.
//!
//! A form factor is the fraction of the light leaving the one that arrives at the other. From area to area there are
//! two ways. Far apart, Gauss rules sum the kernel or exact point form factors: all terms are positive, so that slivers
//! and grazing views keep their digits. Near or touching, the double contour integral of ln r (`contour`) needs no
//! resolution where the kernel peaks.

use glam::DVec3;
use scene::{Plane, area_vector};

use crate::clip::clip_convex;
use crate::contour::{double_contour, edges, segment_distance};
use crate::quadrature::{MOST_POINTS, gauss_legendre, points_needed};

/// Points of the far method from which on the contour integral is cheaper, at full accuracy of both.
const MOST_FAR_POINTS: usize = 40;

/// Evaluations of the kernel between two points that take as long as one edge in Lambert's formula.
const KERNELS_PER_EDGE: usize = 12;

/// −ln of the relative error of the far method: 1e-11.
const DIGITS: f64 = 25.0;

/// A polygon that rises less than this fraction of the scene's extent over another's plane lies in that plane: what
/// it would receive is less than the square of it, and the rounding of its corners decides.
const COPLANAR: f64 = 1e-12;

/// Fraction of the hemisphere's cosine measure around the unit vector `normal` that a convex spherical polygon covers,
/// 0..=1 (Lambert 1760). Its corners are given by directions of any length, all with normal·d ≥ 0; either winding.
///
/// An edge that passes through the origin has no angle and contributes nothing: on a polygon's own border this is not
/// the limit from either side.
pub fn point_form_factor(directions: &[DVec3], normal: DVec3) -> f64 {
    fraction(edges(directions).map(|[from, to]| edge_term(from, to, normal)).sum())
}

/// What the unit normal of a surface is multiplied by for the form factor to a convex cone of directions, all of which are above
/// the surface. The corners run counter-clockwise seen from the surface.
pub fn form_vector(directions: &[DVec3]) -> DVec3 {
    let term = |[from, to]: [DVec3; 2]| {
        let across = to.cross(from);
        let sine = across.length();
        if sine > 0.0 { across * (sine.atan2(from.dot(to)) / sine) } else { DVec3::ZERO }
    };
    edges(directions).map(term).sum::<DVec3>() / std::f64::consts::TAU
}

/// Form factor from a surface element at `position` (metres) with the unit vector `normal` to a convex polygon, 0..=1.
/// The polygon is clipped by the element's horizon and seen from either side.
pub fn form_factor_at(position: DVec3, normal: DVec3, outline: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    // Where the outline dips below the horizon and where it comes up again; at most once each for a convex one.
    let (mut descent, mut ascent) = (None, None);
    for [from, to] in edges(outline) {
        let (mut from, mut to) = (from - position, to - position);
        let (height_from, height_to) = (normal.dot(from), normal.dot(to));
        if height_from < 0.0 && height_to < 0.0 {
            continue;
        }
        if height_from < 0.0 {
            from = crossing(to, height_to, from, height_from);
            ascent = Some(from);
        } else if height_to < 0.0 {
            to = crossing(from, height_from, to, height_to);
            descent = Some(to);
        }
        sum += edge_term(from, to, normal);
    }
    if let (Some(descent), Some(ascent)) = (descent, ascent) {
        sum += edge_term(descent, ascent, normal);
    }
    fraction(sum)
}

/// Form factor F(a→b), 0..=1: the fraction of the light leaving the front of `a` that arrives at the front of `b`.
/// The polygons are convex, counter-clockwise seen from the front; see [`exchange`]. 0 for an `a` without area.
pub fn form_factor(a: &[DVec3], b: &[DVec3]) -> f64 {
    let area = area_vector(a).length();
    if area > 0.0 { exchange(a, b) / area } else { 0.0 }
}

/// A(a)·F(a→b) = A(b)·F(b→a), m²: what two convex planar polygons, counter-clockwise seen from the front, exchange at
/// unit radiosity. Each is clipped to the front of the other's plane; nothing stands between them.
///
/// Bitwise symmetric in its arguments. Relative error at most 1e-9 for polygons that are apart, at most 1e-7 where they
/// touch; in a view so grazing or so thin that F is below 1e-6, those fractions of 1e-6. Never negative, never NaN.
pub fn exchange(a: &[DVec3], b: &[DVec3]) -> f64 {
    let in_order = a.iter().flat_map(DVec3::to_array).partial_cmp(b.iter().flat_map(DVec3::to_array))
        != Some(std::cmp::Ordering::Greater);
    let (a, b) = if in_order { (a, b) } else { (b, a) };
    let Some(&origin) = a.first() else { return 0.0 };
    let all = || a.iter().chain(b);
    // Lengths are counted in the extent of both, from a corner: coordinates far from zero cost no digits twice.
    let scale = all().map(|corner| (*corner - origin).abs().max_element()).fold(0.0, f64::max);
    let largest = all().map(|corner| corner.abs().max_element()).fold(scale, f64::max);
    if !(scale > 0.0 && largest.is_finite()) {
        return 0.0;
    }
    let local = |outline: &[DVec3]| outline.iter().map(|&corner| (corner - origin) / scale).collect::<Vec<_>>();
    let (a, b) = (local(a), local(b));
    let tolerance = COPLANAR * largest / scale;
    let (Some(front_a), Some(front_b)) = (in_front(&a, &b, tolerance), in_front(&b, &a, tolerance)) else {
        return 0.0;
    };
    let (small, large) =
        if perimeter(&front_a) <= perimeter(&front_b) { (&front_a, &front_b) } else { (&front_b, &front_a) };
    let value =
        far_exchange(small, large).unwrap_or_else(|| double_contour(small, large).abs() / std::f64::consts::TAU);
    value * scale * scale
}

/// The point between two others where a linear function vanishes that is not negative at the first and negative at
/// the second.
fn crossing(inside: DVec3, height_inside: f64, outside: DVec3, height_outside: f64) -> DVec3 {
    inside + (outside - inside) * (height_inside / (height_inside - height_outside))
}

/// The angle between two directions times the component along `normal` of the unit vector across both.
fn edge_term(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    // from × to, with its digits for a small angle: the difference is exact there, and the shorter factor loses none.
    let across =
        if from.length_squared() <= to.length_squared() { from.cross(to - from) } else { (from - to).cross(to) };
    let sine = across.length();
    if sine > 0.0 { sine.atan2(from.dot(to)) * normal.dot(across) / sine } else { 0.0 }
}

/// A sum of edge terms as a form factor.
fn fraction(sum: f64) -> f64 {
    (sum.abs() / std::f64::consts::TAU).min(1.0)
}

/// The part of a polygon in front of another's plane; none if either has no area or nothing rises over the plane.
fn in_front(polygon: &[DVec3], other: &[DVec3], tolerance: f64) -> Option<Vec<DVec3>> {
    let plane = Plane::through(other);
    if plane.normal == DVec3::ZERO {
        return None;
    }
    let mut front = Vec::with_capacity(polygon.len() + 1);
    clip_convex(polygon, tolerance, |corner| plane.distance(corner), &mut front);
    (area_vector(&front) != DVec3::ZERO).then_some(front)
}

fn perimeter(outline: &[DVec3]) -> f64 {
    edges(outline).map(|[from, to]| from.distance(to)).sum()
}

/// The exchange by quadrature; none if the polygons, which are in front of each other, are too near for that.
///
/// Over both polygons if that takes few points, else over the smaller one, of the exact form factor to the other.
fn far_exchange(small: &[DVec3], large: &[DVec3]) -> Option<f64> {
    let distance = polygon_distance(small, large);
    let normal = area_vector(small).normalize();
    let nodes = polygon_rule(small, distance)?;
    if let Some(others) = polygon_rule(large, distance)
        && others.len() <= large.len() * KERNELS_PER_EDGE
    {
        let other_normal = area_vector(large).normalize();
        let kernels = |&(position, weight): &(DVec3, f64)| {
            let kernel = |&(other, other_weight): &(DVec3, f64)| {
                let between = other - position;
                other_weight * normal.dot(between) * other_normal.dot(between) / between.length_squared().powi(2)
            };
            weight * others.iter().map(kernel).sum::<f64>()
        };
        return Some(nodes.iter().map(kernels).sum::<f64>().abs() / std::f64::consts::PI);
    }
    let from_point = |&(position, weight): &(DVec3, f64)| {
        let terms = edges(large).map(|[from, to]| edge_term(from - position, to - position, normal));
        weight * fraction(terms.sum())
    };
    Some(nodes.iter().map(from_point).sum())
}

/// Positions and weights, m², that integrate over a convex polygon a function with singularities at a `distance`;
/// none if that takes too many. Product Gauss rules on the quadrilaterals of its fan.
fn polygon_rule(outline: &[DVec3], distance: f64) -> Option<Vec<(DVec3, f64)>> {
    let normal = area_vector(outline).normalize();
    let mut nodes = Vec::new();
    for i in (1..outline.len() - 1).step_by(2) {
        let [p, q, r] = [outline[0], outline[i], outline[i + 1]];
        // The last one of an even fan is a triangle: its third corner counts twice.
        let s = *outline.get(i + 2).unwrap_or(&r);
        let along = points_needed(p.distance(q).max(s.distance(r)), distance, DIGITS);
        let across = points_needed(p.distance(s).max(q.distance(r)), distance, DIGITS);
        if along.max(across) > MOST_POINTS || nodes.len() + along * across > MOST_FAR_POINTS {
            return None;
        }
        for &(u, weight_u) in gauss_legendre(along) {
            let (low, high) = (p.lerp(q, u), s.lerp(r, u));
            for &(v, weight_v) in gauss_legendre(across) {
                let area = (q - p).lerp(r - s, v).cross(high - low).dot(normal);
                nodes.push((low.lerp(high, v), weight_u * weight_v * area));
            }
        }
    }
    Some(nodes)
}

/// Distance between two convex polygons that do not cross each other, or something less if they are far apart.
fn polygon_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    // Balls around them give the distance soon, once they are small before it.
    let ball = |outline: &[DVec3]| {
        let centre = outline.iter().sum::<DVec3>() / outline.len() as f64;
        (centre, outline.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max))
    };
    let ((centre_a, radius_a), (centre_b, radius_b)) = (ball(a), ball(b));
    let between_balls = centre_a.distance(centre_b) - radius_a - radius_b;
    if between_balls > 4.0 * (radius_a + radius_b) {
        return between_balls;
    }
    let to_edges = |edge| edges(b).map(|other| segment_distance(edge, other)).fold(f64::INFINITY, f64::min);
    let between_edges = edges(a).map(to_edges).fold(f64::INFINITY, f64::min);
    between_edges.min(face_distance(a, b)).min(face_distance(b, a))
}

/// Distance of the nearest corner that lies right over the inside of a face; infinite if none does.
fn face_distance(corners: &[DVec3], face: &[DVec3]) -> f64 {
    let plane = Plane::through(face);
    let over = |corner: DVec3| edges(face).all(|[from, to]| (to - from).cross(corner - from).dot(plane.normal) >= 0.0);
    corners
        .iter()
        .filter(|&&corner| over(corner))
        .map(|&corner| plane.distance(corner).abs())
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// A parallelogram from a corner along two sides; its front is along first × second.
    fn parallelogram(corner: DVec3, first: DVec3, second: DVec3) -> [DVec3; 4] {
        [corner, corner + first, corner + first + second, corner + second]
    }

    fn reversed<const N: usize>(mut outline: [DVec3; N]) -> [DVec3; N] {
        outline.reverse();
        outline
    }

    #[track_caller]
    fn assert_close(value: f64, exact: f64, relative: f64) {
        assert!((value - exact).abs() <= relative * exact.abs(), "{value} is not {exact} ± {relative:e}");
    }

    /// Howell's C-11: directly opposed rectangles a × b at distance c.
    fn opposed(a: f64, b: f64, c: f64) -> f64 {
        let (x, y) = (a / c, b / c);
        let (xx, yy) = (1.0 + x * x, 1.0 + y * y);
        2.0 / (PI * x * y)
            * (0.5 * (xx * yy / (xx + yy - 1.0)).ln()
                + x * yy.sqrt() * (x / yy.sqrt()).atan()
                + y * xx.sqrt() * (y / xx.sqrt()).atan()
                - x * x.atan()
                - y * y.atan())
    }

    /// Howell's C-14 times its area: rectangles w × l and h × l at right angles with the common edge l.
    fn cornered(w: f64, h: f64, l: f64) -> f64 {
        if l == 0.0 {
            return 0.0;
        }
        let (ww, hh) = ((w / l).powi(2), (h / l).powi(2));
        let (wide, high, both) = (1.0 + ww, 1.0 + hh, 1.0 + ww + hh);
        let root = (ww + hh).sqrt();
        let logarithms = (wide * high / both).ln()
            + ww * (ww * both / (wide * (ww + hh))).ln()
            + hh * (hh * both / (high * (ww + hh))).ln();
        l * l / PI * (w / l * (l / w).atan() + h / l * (l / h).atan() - root * (1.0 / root).atan() + 0.25 * logarithms)
    }

    #[test]
    fn degenerate_polygons_exchange_nothing() {
        let square = parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y);
        let facing = reversed(square.map(|corner| corner + DVec3::Z));
        let sliver = [v(0., 0., 1.), v(1., 0., 1.), v(2., 0., 1.)];
        let not_a_number = [v(f64::NAN, 0., 1.), v(1., 0., 1.), v(0., 1., 1.)];
        let infinite = [v(f64::INFINITY, 0., 1.), v(1., 0., 1.), v(0., 1., 1.)];
        for bad in [&[][..], &facing[..1], &facing[..2], &[DVec3::Z; 4], &sliver, &not_a_number, &infinite] {
            assert_eq!(exchange(&square, bad), 0.0);
            assert_eq!(exchange(bad, &square), 0.0);
            assert_eq!(form_factor(bad, &square), 0.0);
        }
        for thin in [&[][..], &facing[..1], &facing[..2], &[DVec3::Z; 4], &sliver] {
            assert!(form_factor_at(DVec3::ZERO, DVec3::Z, thin) < 1e-15);
            assert!(point_form_factor(thin, DVec3::Z) < 1e-15);
        }
        assert_eq!(exchange(&square, &square), 0.0);
        assert_eq!(exchange(&square, &reversed(square)), 0.0);
        // Neighbours in one plane, which rounding lifts over each other.
        let tilt = v(0.6, 0.64, 0.48);
        let (u, w) = tilt.any_orthonormal_pair();
        let at = |x: f64| parallelogram(tilt * 7.3 + u * x + w * 0.1, u, w);
        assert_eq!(exchange(&at(0.0), &at(1.0)), 0.0);
        // Back to back, and back to front.
        assert_eq!(exchange(&square, &square.map(|corner| corner + DVec3::Z)), 0.0);
        assert_eq!(exchange(&reversed(square), &square.map(|corner| corner + DVec3::Z)), 0.0);
        assert!(exchange(&square, &facing) > 0.1);
    }

    #[test]
    fn point_on_the_outline_is_finite() {
        let wall = parallelogram(DVec3::ZERO, DVec3::X, DVec3::Z);
        for position in [DVec3::ZERO, v(0.5, 0., 0.), v(0.5, 0., 0.5)] {
            for normal in [DVec3::Z, DVec3::Y, -DVec3::Y, DVec3::X] {
                let value = form_factor_at(position, normal, &wall);
                assert!((0.0..=1.0).contains(&value));
            }
        }
        assert_eq!(point_form_factor(&[DVec3::ZERO; 3], DVec3::Z), 0.0);
    }

    #[test]
    fn element_to_rectangle() {
        for (a, b, c) in [(1.0_f64, 1.0_f64, 1.0_f64), (0.01, 3.0, 0.7), (100.0, 20.0, 0.1)] {
            let (x, y) = (a / c, b / c);
            let term = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
            let parallel = parallelogram(v(0., 0., c), DVec3::X * a, DVec3::Y * b);
            assert_close(
                form_factor_at(DVec3::ZERO, DVec3::Z, &parallel),
                (term(x, y) + term(y, x)) / (2.0 * PI),
                1e-13,
            );
            let upright = parallelogram(v(0., c, 0.), DVec3::X * a, DVec3::Z * b);
            let exact = (x.atan() - (x / (1.0 + y * y).sqrt()).atan() / (1.0 + y * y).sqrt()) / (2.0 * PI);
            assert_close(form_factor_at(DVec3::ZERO, DVec3::Z, &upright), exact, 1e-12);
            // The half below the horizon adds nothing.
            let deep = parallelogram(v(0., c, -5.0), DVec3::X * a, DVec3::Z * (b + 5.0));
            assert_close(form_factor_at(DVec3::ZERO, DVec3::Z, &deep), exact, 1e-12);
            let mut clipped = Vec::new();
            clip_convex(&deep, 0.0, |direction| direction.z, &mut clipped);
            assert_close(point_form_factor(&clipped, DVec3::Z), exact, 1e-12);
        }
    }

    /// A far and thin polygon: what is left of the sum of its edges has lost no digits that the corners had.
    #[test]
    fn point_to_small_polygons() {
        for size in [1e-2, 1e-4, 1e-6] {
            let square = parallelogram(v(0.3, 0.4, 1.2) - v(size, size, 0.) / 2.0, DVec3::X * size, DVec3::Y * size);
            let exact = size * size * 1.2_f64.powi(2) / (PI * 1.69_f64.powi(2));
            assert_close(form_factor_at(DVec3::ZERO, DVec3::Z, &square), exact, 0.5 * size * size + 1e-14 / size);
        }
        let width = 1e-6;
        let strip = parallelogram(v(-1., -width / 2., 1.), DVec3::X * 2.0, DVec3::Y * width);
        // ∫ dx / (π (1 + x²)²) over −1..1, by hand.
        assert_close(form_factor_at(DVec3::ZERO, DVec3::Z, &strip), width * (0.5 + PI / 4.0) / PI, 1e-9);
    }

    #[test]
    fn opposed_rectangles() {
        for (a, b, c, number) in [(1.0, 1.0, 1.0, 0.1998248957), (1.0, 1.0, 0.5, 0.4152532836)] {
            assert_close(opposed(a, b, c), number, 3e-10);
        }
        for c in [1e-6, 1e-3, 0.03, 0.3, 0.5, 1.0, 1.9, 2.1, 5.0] {
            for b in [1.0, 0.1, 7.0] {
                let low = parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y * b);
                let high = reversed(low.map(|corner| corner + DVec3::Z * c));
                assert_close(form_factor(&low, &high), opposed(1.0, b, c), if c < 3.0 { 1e-10 } else { 1e-9 });
            }
        }
    }

    #[test]
    fn rectangles_with_a_common_edge() {
        assert_close(cornered(1.0, 1.0, 1.0), 0.2000437761, 3e-10);
        assert_close(cornered(1.0, 2.0, 1.0), 0.2328526028, 3e-10);
        for w in [1e-3, 0.1, 1.0, 2.0, 30.0] {
            for h in [1e-3, 0.5, 1.0, 30.0] {
                let floor = parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y * w);
                let wall = parallelogram(DVec3::ZERO, DVec3::Z * h, DVec3::X);
                assert_close(exchange(&floor, &wall), cornered(w, h, 1.0), 1e-9);
            }
        }
    }

    /// Intervals of a common edge, by view-factor algebra: the exchange is half of a sum of four whole ones.
    #[test]
    fn rectangles_that_touch_along_part_of_an_edge_or_at_a_vertex() {
        for (from, to) in [(0.5, 2.0), (0.25, 0.75), (1.0, 2.0), (1.0, 1.01), (1.001, 3.0), (3.0, 4.0), (-1.0, 0.3)] {
            let floor = parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y);
            let wall = parallelogram(v(from, 0., 0.), DVec3::Z * 0.7, DVec3::X * (to - from));
            let whole = |length: f64| cornered(1.0, 0.7, length.abs());
            let exact = (whole(1.0 - from) + whole(to) - whole(from) - whole(1.0 - to)) / 2.0;
            assert_close(exchange(&floor, &wall), exact, 2e-9);
        }
    }

    /// Row sums of closed rooms, in which every pair of walls touches, at right and at oblique angles.
    #[test]
    fn rows_of_closed_rooms_sum_to_one() {
        let hexahedron = |corners: [DVec3; 8]| {
            [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
                .map(|face| face.map(|corner| corners[corner]).to_vec())
                .to_vec()
        };
        let cube = [0, 1].map(|z| [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| v(x.into(), y.into(), z.into())));
        let cube: [DVec3; 8] = std::array::from_fn(|i| cube[i / 4][i % 4]);
        let office = cube.map(|corner| corner * v(4.0, 5.0, 2.7) + v(100.0, -30.0, 0.0));
        let sheared = cube.map(|corner| v(corner.x + 0.4 * corner.y, corner.y + 0.9 * corner.z, corner.z * 0.6));
        // A frustum: all walls lean.
        let frustum = cube.map(|corner| (corner - 0.5) * v(1.0 - 0.4 * corner.z, 1.0 - 0.4 * corner.z, 1.0));
        let thin = cube.map(|corner| corner * v(10.0, 10.0, 0.01));
        let [p, q, r, s] = [v(0.1, 0., 0.), v(1.3, 0.2, 0.), v(0.4, 1.1, 0.1), v(0.5, 0.3, 0.7)];
        let tetrahedron = [[p, q, r], [p, s, q], [q, s, r], [r, s, p]].map(|face| face.to_vec()).to_vec();
        let rooms = [
            (hexahedron(cube), 1e-11),
            (hexahedron(office), 1e-9),
            (hexahedron(sheared), 1e-9),
            (hexahedron(frustum), 1e-9),
            (hexahedron(thin), 1e-9),
            (tetrahedron, 1e-9),
        ];
        for (room, tolerance) in rooms {
            for face in &room {
                let sum: f64 = room.iter().map(|other| form_factor(face, other)).sum();
                assert!((sum - 1.0).abs() < tolerance, "{sum} for {face:?}");
            }
        }
    }

    /// Many-sided polygons converge to disks as the square of the angle of a side.
    #[test]
    fn coaxial_disks() {
        let disk = |radius: f64, height: f64, sides: u32, turn: f64| -> Vec<DVec3> {
            (0..sides)
                .map(|i| {
                    let angle = turn * 2.0 * PI * f64::from(i) / f64::from(sides);
                    v(radius * angle.cos(), radius * angle.sin(), height)
                })
                .collect()
        };
        for (r1, r2, h) in [(1.0_f64, 1.0_f64, 1.0_f64), (0.5, 2.0, 0.7), (1.0, 0.5, 6.0)] {
            let s = 1.0 + (1.0 + (r2 / h).powi(2)) / (r1 / h).powi(2);
            let exact = (s - (s * s - 4.0 * (r2 / r1).powi(2)).sqrt()) / 2.0;
            let error = |sides| form_factor(&disk(r1, 0.0, sides, 1.0), &disk(r2, h, sides, -1.0)) / exact - 1.0;
            let errors = [error(16), error(32), error(64)];
            for pair in errors.windows(2) {
                assert_close(pair[0] / pair[1], 4.0, 0.02);
            }
            // Richardson: without its h² and h⁴ terms the sequence is the disk.
            let (first, second) = ((4.0 * errors[1] - errors[0]) / 3.0, (4.0 * errors[2] - errors[1]) / 3.0);
            assert!(((16.0 * second - first) / 15.0).abs() < 1e-7);
        }
    }

    #[test]
    fn far_apart_it_is_the_kernel() {
        let a = parallelogram(v(-0.5, -0.5, 0.), DVec3::X, DVec3::Y);
        let direction = v(0.48, 0.64, 0.6);
        for distance in [1e2, 1e3, 1e4] {
            let centre = direction * distance;
            let b = [v(0.5, 0., -0.5), v(0., 0., 1.), v(-0.5, 0., -0.5)].map(|corner| corner + centre);
            let strip = b.map(|corner| v(corner.x, corner.y, centre.z + (corner.z - centre.z) * 1e-4));
            for b in [b, strip] {
                let exact = area_vector(&b).length() * 0.6 * 0.64 / (PI * distance * distance);
                assert_close(exchange(&a, &b), exact, 2.0 / distance.powi(2) + 1e-9);
            }
        }
    }

    /// A wall that runs through the floor: only its part above counts, and only the floor in front of it.
    #[test]
    fn polygons_that_cross_each_others_planes() {
        let floor = parallelogram(v(0., -1.0, 0.), DVec3::X, DVec3::Y * 3.0);
        let wall = parallelogram(v(0., 0., -2.0), DVec3::Z * 3.5, DVec3::X);
        assert_close(exchange(&floor, &wall), cornered(2.0, 1.5, 1.0), 1e-10);
    }

    fn corner() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array)
    }

    proptest! {
        /// The whole is the sum of its parts, also where the parts touch the other polygon and the whole is far, and
        /// where the method changes between them.
        #[test]
        fn exchange_is_additive(
            a in [corner(), corner(), corner()], b in [corner(), corner(), corner()], lift in 0.0..4.0, t in 0.01..0.99,
        ) {
            let b = b.map(|corner| corner + DVec3::Z * lift);
            let split = a[1].lerp(a[2], t);
            let parts = [[a[0], a[1], split], [a[0], split, a[2]]];
            let whole = exchange(&a, &b);
            let sum: f64 = parts.iter().map(|part| exchange(part, &b)).sum();
            prop_assert!((whole - sum).abs() <= 1e-9 * whole + 1e-13, "{} and {}", whole, sum);
            prop_assert_eq!(whole.to_bits(), exchange(&b, &a).to_bits());
            prop_assert!(form_factor(&a, &b) <= 1.0 + 1e-9);
        }

        /// Both formulas for a point agree, and winding does not matter.
        #[test]
        fn streaming_clip_is_clip_then_sum(position in corner(), outline in [corner(), corner(), corner()]) {
            let directions = outline.map(|corner| corner - position);
            let mut clipped = Vec::new();
            clip_convex(&directions, 0.0, |direction| direction.z, &mut clipped);
            let value = form_factor_at(position, DVec3::Z, &outline);
            prop_assert!((value - point_form_factor(&clipped, DVec3::Z)).abs() < 1e-14);
            prop_assert!((value - form_factor_at(position, DVec3::Z, &reversed(outline))).abs() < 1e-14);
            prop_assert!((0.0..=1.0).contains(&value));
        }
    }
}
