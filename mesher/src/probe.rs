//! Probes: points of triangles that no interpolant was fitted to, and what an error there counts.

use glam::{DVec2, DVec3};
use scene::Rgb;

/// Barycentrics (s, t) of a probe point: those of different numbers are spread evenly over the triangle. One at a fixed place
/// would miss in all triangles alike what lies along their borders; more of them would cost as much again as the samples.
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

    /// Cubics that vanish at all six samples are combinations of the bubble and of one cubic along each edge: their mean squares
    /// are what probes see of them on average.
    #[test]
    fn the_remainders_of_cubics_are_seen() {
        let bubble = |s: f64, t: f64| s * t * (1.0 - s - t);
        let edge = |s: f64, t: f64| s * t * (s - t);
        assert!(SAMPLE_BARYCENTRICS.iter().all(|&(s, t)| bubble(s, t) == 0.0 && edge(s, t) == 0.0));
        let points: Vec<(f64, f64)> = (0..1000).map(probe_point).collect();
        assert!(points.iter().all(|&(s, t)| s >= 0.0 && t >= 0.0 && s + t <= 1.0));
        let seen =
            |f: &dyn Fn(f64, f64) -> f64| (points.iter().map(|&(s, t)| f(s, t).powi(2)).sum::<f64>() / 1000.0).sqrt();
        assert!((seen(&bubble) * 2520f64.sqrt() - 1.0).abs() < 0.02);
        assert!((seen(&edge) * 840f64.sqrt() - 1.0).abs() < 0.02);
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
