//! View factors in closed form: what the solver's own form factors are held against. Nothing here knows the solver.
//!
//! J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*; letters and numbers are its own. Lengths in
//! any one unit, factors 0..=1.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// C-11, identical rectangles `a` × `b`, parallel and directly opposed at the distance `c`; with X = a/c, Y = b/c:
/// F = 2/(πXY) { ½ ln[(1+X²)(1+Y²)/(1+X²+Y²)] + X√(1+Y²) atan(X/√(1+Y²)) + Y√(1+X²) atan(Y/√(1+X²)) − X atan X − Y atan Y }.
pub fn opposed_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (xx, yy) = (1.0 + x * x, 1.0 + y * y);
    let logarithm = (xx * yy / (xx + yy - 1.0)).ln() / 2.0;
    let along = |x: f64, yy: f64| x * yy.sqrt() * (x / yy.sqrt()).atan() - x * x.atan();
    2.0 / (PI * x * y) * (logarithm + along(x, yy) + along(y, xx))
}

/// C-14, from a rectangle `w` × `l` to one `h` × `l` at right angles to it, with the common edge `l`; with H = h/l, W = w/l:
/// F = 1/(πW) { W atan(1/W) + H atan(1/H) − √(H²+W²) atan(1/√(H²+W²)) + ¼ ln[ (1+W²)(1+H²)/(1+W²+H²)
/// · (W²(1+W²+H²)/((1+W²)(W²+H²)))^(W²) · (H²(1+H²+W²)/((1+H²)(H²+W²)))^(H²) ] }.
pub fn perpendicular_rectangles(w: f64, h: f64, l: f64) -> f64 {
    let (w, h) = (w / l, h / l);
    let (ww, hh) = (w * w, h * h);
    let (wide, high, all, root) = (1.0 + ww, 1.0 + hh, 1.0 + ww + hh, (ww + hh).sqrt());
    let logarithms = (wide * high / all).ln()
        + ww * (ww * all / (wide * (ww + hh))).ln()
        + hh * (hh * all / (high * (ww + hh))).ln();
    (w * (1.0 / w).atan() + h * (1.0 / h).atan() - root * (1.0 / root).atan() + logarithms / 4.0) / (PI * w)
}

/// Parallel rectangles of any size and place at the distance `c`, from the first to the second, each given by its bounds in
/// x and y: F = 1/A₁ Σ ± B(x−ξ, y−η) over all pairs of corners, where B, with U² = u²+c² and V² = v²+c², is
/// { vU atan(v/U) + uV atan(u/V) − ½c² ln(u²+v²+c²) }/(2π).
pub fn parallel_rectangles(first: [[f64; 2]; 2], second: [[f64; 2]; 2], c: f64) -> f64 {
    let term = |u: f64, v: f64| {
        let (u_root, v_root) = (u.hypot(c), v.hypot(c));
        let angles = v * u_root * (v / u_root).atan() + u * v_root * (u / v_root).atan();
        (angles - c * c / 2.0 * (u * u + v * v + c * c).ln()) / TAU
    };
    let ([x, y], [xi, eta]) = (first, second);
    let sum = signed_sum(x, |x| signed_sum(y, |y| signed_sum(xi, |xi| signed_sum(eta, |eta| term(x - xi, y - eta)))));
    sum / ((x[1] - x[0]) * (y[1] - y[0]))
}

/// From an element to a parallel rectangle at the distance `c`, given by its bounds in x and y about the element's normal. With
/// a corner on the normal, A = a/c and B = b/c, F = { A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²)) }/(2π); any other
/// is the signed sum of four of these.
pub fn element_to_parallel_rectangle(x: [f64; 2], y: [f64; 2], c: f64) -> f64 {
    let half = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    signed_sum(x, |x| signed_sum(y, |y| (half(x / c, y / c) + half(y / c, x / c)) / TAU))
}

/// From an element to a rectangle in a plane at right angles to the element's, at the distance `c`, given by its bounds in x
/// along the line where the planes meet and in `up` above it. With a corner at the foot of the perpendicular, X = a/c and
/// Y = b/c, F = { atan X − atan(X/√(1+Y²))/√(1+Y²) }/(2π); any other is the signed sum of four of these.
pub fn element_to_perpendicular_rectangle(x: [f64; 2], up: [f64; 2], c: f64) -> f64 {
    let corner = |x: f64, y: f64| (x.atan() - (x / y.hypot(1.0)).atan() / y.hypot(1.0)) / TAU;
    signed_sum(x, |x| signed_sum(up, |up| corner(x / c, up / c)))
}

/// From an element to a polygon that lies wholly above its horizon (Lambert 1760):
/// F = | Σ angle(vᵢ, vᵢ₊₁) n·(vᵢ×vᵢ₊₁)/|vᵢ×vᵢ₊₁| |/(2π).
pub fn element_to_polygon(position: DVec3, normal: DVec3, outline: &[DVec3]) -> f64 {
    let directions: Vec<DVec3> = outline.iter().map(|&corner| corner - position).collect();
    let next = directions.iter().cycle().skip(1);
    let term = |(a, b): (&DVec3, &DVec3)| a.angle_between(*b) * normal.dot(a.cross(*b).normalize());
    directions.iter().zip(next).map(term).sum::<f64>().abs() / TAU
}

/// From a disk of radius `first` to a coaxial, parallel one of radius `second` at the distance `h`; with R = r/h and
/// S = 1 + (1 + R₂²)/R₁²: F = (S − √(S² − 4 (r₂/r₁)²))/2, here without its difference of two numbers that are nearly equal.
pub fn coaxial_disks(first: f64, second: f64, h: f64) -> f64 {
    let s = 1.0 + (1.0 + (second / h).powi(2)) / (first / h).powi(2);
    let ratio = (second / first).powi(2);
    2.0 * ratio / (s + (s * s - 4.0 * ratio).sqrt())
}

/// The value at the upper bound less the one at the lower.
fn signed_sum([low, high]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    value(high) - value(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} is not {expected} ± {tolerance:e}");
    }

    /// Half a unit in the last of ten published digits.
    const DIGITS: f64 = 0.5e-10;

    #[test]
    fn the_published_digits() {
        assert_close(opposed_rectangles(1.0, 1.0, 1.0), 0.1998248957, DIGITS);
        assert_close(opposed_rectangles(1.0, 1.0, 0.5), 0.4152532836, DIGITS);
        assert_close(perpendicular_rectangles(1.0, 1.0, 1.0), 0.2000437761, DIGITS);
        assert_close(perpendicular_rectangles(1.0, 2.0, 1.0), 0.2328526028, DIGITS);
        assert_close(opposed_rectangles(1.0, 1.0, 1.0) + 4.0 * perpendicular_rectangles(1.0, 1.0, 1.0), 1.0, 1e-14);
    }

    #[test]
    fn limits_and_reciprocity() {
        // Nearly touching, and an element under an endless ceiling or before an endless wall.
        assert_close(opposed_rectangles(1.0, 1.0, 1e-9), 1.0, 1e-8);
        assert_close(element_to_parallel_rectangle([-1e9, 1e9], [-1e9, 1e9], 1.0), 1.0, 1e-8);
        assert_close(element_to_perpendicular_rectangle([-1e9, 1e9], [0.0, 1e9], 1.0), 0.5, 1e-8);
        assert_close(coaxial_disks(1.0, 1e9, 1.0), 1.0, 1e-8);
        let (w, h) = (0.3, 1.7);
        assert_close(w * perpendicular_rectangles(w, h, 1.0), h * perpendicular_rectangles(h, w, 1.0), 1e-14);
        assert_close(0.09 * coaxial_disks(0.3, 2.0, 0.7), 4.0 * coaxial_disks(2.0, 0.3, 0.7), 1e-14);
    }

    /// Formulas that share no term give the same where both apply.
    #[test]
    fn formulas_agree_where_they_meet() {
        let bounds = [[0.0, 1.0], [0.0, 2.5]];
        assert_close(parallel_rectangles(bounds, bounds, 0.8), opposed_rectangles(1.0, 2.5, 0.8), 1e-14);
        // A small rectangle is an element.
        let small = [[-1e-4, 1e-4], [-1e-4, 1e-4]];
        let (x, y) = ([-0.2, 1.3], [0.4, 0.9]);
        assert_close(parallel_rectangles(small, [x, y], 0.6), element_to_parallel_rectangle(x, y, 0.6), 1e-7);
        // Lambert's polygon is both rectangles.
        let corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])];
        let ceiling = corners.map(|(x, y)| DVec3::new(x, y, 0.6));
        let wall = corners.map(|(x, y)| DVec3::new(x, 0.6, y));
        let lambert = |outline: &[DVec3]| element_to_polygon(DVec3::ZERO, DVec3::Z, outline);
        assert_close(lambert(&ceiling), element_to_parallel_rectangle(x, y, 0.6), 1e-14);
        assert_close(lambert(&wall), element_to_perpendicular_rectangle(x, y, 0.6), 1e-14);
    }
}
