//! Light from polygons by a power of the cosine to an axis, in closed form (J. Arvo, "Applications of Irradiance Tensors to the
//! Simulation of Non-Lambertian Phenomena", SIGGRAPH 1995, section 5).
//!
//! The moment τⁿ of a part of the sphere is the integral of (w·u)ⁿ over its directions u. By Stokes' theorem
//! (n + 1) τⁿ = (n − 1) τⁿ⁻² − Σ over edges (w·m) ∫ (w·u)ⁿ⁻¹ ds, m an edge's outward normal. For odd n the recurrence ends in
//! τ¹, which is Lambert's formula.

use glam::DVec3;

/// Exponent from which on a highlight is taken for as small as that: by then it is a degree or two wide.
const LARGEST_EXPONENT: f64 = 2047.0;

/// The nearest odd whole number to an exponent, at least 1.
pub(crate) fn odd(exponent: f64) -> u32 {
    2 * ((exponent.clamp(1.0, LARGEST_EXPONENT) - 1.0) / 2.0).round() as u32 + 1
}

/// The part of a convex cone of directions, by its corners, in front of a plane through its tip.
pub(crate) fn in_front_of(normal: DVec3, corners: &[DVec3]) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    let Some(&last) = corners.last() else { return kept };
    let (mut before, mut height) = (last, normal.dot(last));
    for &corner in corners {
        let next = normal.dot(corner);
        if (height > 0.0) != (next > 0.0) {
            kept.push(before.lerp(corner, height / (height - next)));
        }
        if next > 0.0 {
            kept.push(corner);
        }
        (before, height) = (corner, next);
    }
    kept
}

/// The integral of the cosine to a unit axis, to an odd power, over a convex cone of directions, sr. The cone is given by its
/// corners, of any length and in any orientation, and lies in front of the plane across the axis.
pub(crate) fn moment(corners: &[DVec3], axis: DVec3, exponent: u32) -> f64 {
    let corners: Vec<DVec3> = corners.iter().map(|corner| corner.normalize_or_zero()).collect();
    let middle: DVec3 = corners.iter().sum();
    let mut turn = 0.0;
    let mut edges = Vec::with_capacity(corners.len());
    let mut from = corners.last().copied().unwrap_or_default();
    for &to in &corners {
        let across = from.cross(to);
        if let Some(inward) = across.try_normalize() {
            turn += inward.dot(middle);
            edges.push(Edge::new(axis, from, inward, across.length().atan2(from.dot(to))));
        }
        from = to;
    }
    let mut moment = 0.0;
    for power in (1..=exponent).step_by(2) {
        let border: f64 = edges.iter_mut().map(|edge| edge.next(power - 1)).sum();
        moment = (f64::from(power - 1) * moment + border * turn.signum()) / f64::from(power + 1);
    }
    moment.max(0.0)
}

/// The integrals of even powers of w·u along an edge, one after another. With w·u = c cos x they follow from each other:
/// k ∫ cosᵏ = cosᵏ⁻¹ sin + (k − 1) ∫ cosᵏ⁻².
struct Edge {
    /// w·m for the inward normal m.
    weight: f64,
    /// c², and for both ends c sin x and the even power of c cos x that was reached, less one.
    square: f64,
    ends: [(f64, f64, f64); 2],
    integral: f64,
}

impl Edge {
    fn new(axis: DVec3, from: DVec3, inward: DVec3, length: f64) -> Self {
        // Along the edge u = from cos θ + tangent sin θ.
        let tangent = inward.cross(from);
        let (a, b) = (axis.dot(from), axis.dot(tangent));
        let (sin, cos) = length.sin_cos();
        // c cos x, and c sin x, its derivative less the sign.
        let end = |cos: f64, sin: f64| (a * cos + b * sin, a * sin - b * cos);
        let ends = [end(1.0, 0.0), end(cos, sin)].map(|(cosine, sine)| (cosine, sine, cosine));
        Self { weight: axis.dot(inward), square: a * a + b * b, ends, integral: length }
    }

    /// The weighted integral of the power `k`, which is 0 the first time and grows by two.
    fn next(&mut self, k: u32) -> f64 {
        if k > 0 {
            let [start, end] = self.ends.map(|(_, sine, power)| power * sine);
            self.integral = (end - start + self.square * f64::from(k - 1) * self.integral) / f64::from(k);
            for (cosine, _, power) in &mut self.ends {
                *power *= *cosine * *cosine;
            }
        }
        self.weight * self.integral
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    /// The integral over a triangle by a fine midpoint rule.
    fn summed([a, b, c]: [DVec3; 3], axis: DVec3, exponent: u32) -> f64 {
        let n = 400;
        let normal = (b - a).cross(c - a);
        let area = normal.length() / 2.0 / f64::from(n * n);
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n - i {
                let mut add = |shift: f64| {
                    let (s, t) = ((f64::from(i) + shift) / f64::from(n), (f64::from(j) + shift) / f64::from(n));
                    let place = a + (b - a) * s + (c - a) * t;
                    let way = place.normalize();
                    let seen = (normal.normalize().dot(way)).abs() / place.length_squared();
                    sum += axis.dot(way).max(0.0).powi(exponent as i32) * seen * area;
                };
                add(1.0 / 3.0);
                if j + 1 < n - i {
                    add(2.0 / 3.0);
                }
            }
        }
        sum
    }

    #[test]
    fn nothing_and_what_is_seen_edge_on_has_no_moment() {
        assert_eq!(moment(&[], DVec3::Z, 5), 0.0);
        assert_eq!(moment(&[DVec3::Z], DVec3::Z, 5), 0.0);
        let line = [DVec3::new(1., 0., 1.), DVec3::new(2., 0., 1.), DVec3::new(5., 0., 1.)];
        assert!(moment(&line, DVec3::Z, 5).abs() < 1e-15);
        assert!(in_front_of(DVec3::Z, &[]).is_empty() && in_front_of(-DVec3::Z, &line).is_empty());
    }

    #[test]
    fn it_is_what_a_sum_over_directions_is() {
        let wide = [DVec3::new(-3., -2., 0.4), DVec3::new(4., -1., 0.3), DVec3::new(0., 5., 0.6)];
        let small = wide.map(|corner| DVec3::new(1., 2., 9.0) + corner * 0.2);
        let axis = DVec3::new(0.2, -0.3, 0.8).normalize();
        for corners in [wide, small] {
            for exponent in [1, 3, 9, 51] {
                let seen = in_front_of(axis, &corners);
                let (ours, truth) = (moment(&seen, axis, exponent), summed(corners, axis, exponent));
                assert!((ours - truth).abs() < 2e-3 * truth, "{ours} for {truth}, exponent {exponent}");
                let turned: Vec<DVec3> = seen.into_iter().rev().collect();
                assert!((moment(&turned, axis, exponent) - ours).abs() < 1e-12);
            }
        }
    }

    /// The faces of a cube around the eye, cut at the plane across the axis, are the half sphere: 2π/(n + 1).
    #[test]
    fn the_parts_of_the_half_sphere_add_up() {
        let axis = DVec3::new(0.3, 0.5, 0.9).normalize();
        for exponent in [1, 5, 101, 2047] {
            let mut sum = 0.0;
            for axes in [[DVec3::X, DVec3::Y, DVec3::Z], [DVec3::Y, DVec3::Z, DVec3::X], [DVec3::Z, DVec3::X, DVec3::Y]]
            {
                for side in [1.0, -1.0] {
                    let [u, v, w] = axes;
                    let face = [(1., 1.), (-1., 1.), (-1., -1.), (1., -1.)].map(|(a, b)| u * a + v * b + w * side);
                    sum += moment(&in_front_of(axis, &face), axis, exponent);
                }
            }
            assert!((sum * f64::from(exponent + 1) / TAU - 1.0).abs() < 1e-9, "{sum} for the exponent {exponent}");
        }
        // Lambert: a square light above.
        let square = [(1., 1.), (-1., 1.), (-1., -1.), (1., -1.)].map(|(x, y)| DVec3::new(x, y, 1.0));
        let factor = 4.0 / PI * (0.5_f64).sqrt() * (0.5_f64).sqrt().atan();
        assert!((moment(&square, DVec3::Z, 1) / PI - factor).abs() < 1e-12);
    }

    #[test]
    fn exponents_are_the_nearest_odd_numbers() {
        assert_eq!([0.0, 0.9, 2.1, 50.0, 60.9, 1e9, f64::INFINITY].map(odd), [1, 1, 3, 51, 61, 2047, 2047]);
    }
}
