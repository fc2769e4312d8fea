//! Probes: points of triangles that no interpolant was fitted to, and what an error there counts.

use glam::{DVec2, DVec3};
use scene::Rgb;

/// Barycentrics of the probe point of a triangle, which turns from triangle to triangle. A cubic that vanishes at all
/// six samples is a combination of the bubble p q r, of which the point sees 90 % of its root mean square, and of
/// p q (p − q) for the three edges, of which it sees 104 % on average over the turns. More points a triangle would
/// cost as much again as the samples themselves.
const PROBE: [f64; 3] = [0.6, 0.3, 0.1];

/// Barycentrics (s, t) of a triangle's probe point.
pub(crate) fn probe_point(number: u32) -> (f64, f64) {
    let DVec2 { x: s, y: t } = solver::spread(DVec2::ZERO, number);
    if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) }
}

/// Average over the colours.
pub(crate) fn colour_mean(rgb: Rgb) -> f64 {
    rgb.element_sum() / 3.0
}

/// The position at barycentrics (s, t) of a triangle.
pub(crate) fn at([a, b, c]: [DVec3; 3], (s, t): (f64, f64)) -> DVec3 {
    a * (1.0 - s - t) + b * s + c * t
}

/// The smallest error that is not exceeded on the given fraction of the area.
pub(crate) fn percentile(errors: &[f64], areas: &[f64], fraction: f64) -> f64 {
    let mut order: Vec<(f64, f64)> = errors.iter().copied().zip(areas.iter().copied()).collect();
    order.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut left = fraction * order.iter().map(|(_, area)| area).sum::<f64>();
    for &(error, area) in &order {
        left -= area;
        if left <= 0.0 {
            return error;
        }
    }
    order.last().map_or(0.0, |last| last.0)
}

#[cfg(test)]
mod tests {
    use scene::SAMPLE_BARYCENTRICS;

    use super::*;

    /// The figures in the comment on [`PROBE`], from the closed forms of the integrals.
    #[test]
    fn the_remainders_of_cubics_are_seen() {
        let bubble = |s: f64, t: f64| s * t * (1.0 - s - t);
        let edge = |s: f64, t: f64| s * t * (s - t);
        assert!(SAMPLE_BARYCENTRICS.iter().all(|&(s, t)| bubble(s, t) == 0.0 && edge(s, t) == 0.0));
        let points = [0, 1, 2].map(probe_point);
        let seen =
            |f: &dyn Fn(f64, f64) -> f64| (points.map(|(s, t)| f(s, t).powi(2)).iter().sum::<f64>() / 3.0).sqrt();
        assert!((seen(&bubble) * 2520f64.sqrt() - 0.90).abs() < 0.005);
        assert!((seen(&edge) * 840f64.sqrt() - 1.04).abs() < 0.005);
    }

    #[test]
    fn percentiles_are_of_area() {
        let (errors, areas) = ([2.0, 1.0, 3.0], [0.08, 0.9, 0.02]);
        assert_eq!(percentile(&errors, &areas, 0.5), 1.0);
        assert_eq!(percentile(&errors, &areas, 0.95), 2.0);
        assert_eq!(percentile(&errors, &areas, 0.99), 3.0);
        assert_eq!(percentile(&[], &[], 0.99), 0.0);
    }
}
