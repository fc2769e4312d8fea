//! The error that a bake claims: what its residual says of the whole, at 99 % confidence and after all bounces.

use scene::{BakedError, Scene};
use solver::Solution;

use crate::probe::{colour_mean, percentile};
use crate::residual::ResidualPoint;

/// The error that is accepted at 99 % of the area, in tolerances.
pub(crate) const P99: f64 = 5.0;

/// One-sided 99 % of the normal distribution.
const CONFIDENCE: f64 = 2.326;

/// The error of a bake by its residual at points spread evenly by area, each relative to max(own, mean) irradiance.
/// `reflectance` is the part of all light that is reflected. And the part of it that the bake as a whole is off by, after all
/// bounces.
pub(crate) fn measured(points: &[ResidualPoint], tolerance: f64, reflectance: f64) -> (BakedError, f64) {
    let count = points.len() as f64;
    if points.is_empty() {
        return (BakedError { holds: true, ..BakedError::default() }, 0.0);
    }
    let mean = points.iter().map(|point| point.irradiance).sum::<f64>() / count;
    let scale = |point: &ResidualPoint| point.irradiance.max(mean).max(f64::MIN_POSITIVE);
    let product = |point: &ResidualPoint| {
        let [a, b] = point.differences;
        colour_mean(a * b) / scale(point).powi(2)
    };
    let mean_square = points.iter().map(product).sum::<f64>() / count;
    // What the residual is off by on average, or may be for all that was measured, is reflected again and again: the bake is
    // off by the sum of it.
    let excess = |point: &ResidualPoint| colour_mean(point.differences[0] + point.differences[1]) / 2.0;
    let mean_excess = points.iter().map(excess).sum::<f64>() / count;
    let spread = points.iter().map(|point| (excess(point) - mean_excess).powi(2)).sum::<f64>() / count;
    let limit = mean_excess.abs() + CONFIDENCE * (spread / count).sqrt();
    let sum_of_bounces = |excess: f64| if mean > 0.0 { excess / mean / (1.0 - reflectance) } else { 0.0 };
    let amplified = sum_of_bounces(limit).powi(2) * reflectance * (2.0 - reflectance);
    let scatter = points.iter().map(|point| (product(point) - mean_square).powi(2)).sum::<f64>() / count;
    let limit = mean_square + CONFIDENCE * (scatter / count).sqrt();
    let errors: Vec<f64> = points
        .iter()
        .map(|point| {
            let difference = (point.differences[0] + point.differences[1]) / 2.0;
            colour_mean(difference * difference).sqrt() / scale(point)
        })
        .collect();
    let p99 = percentile(&errors, &vec![1.0; errors.len()], 0.99);
    let rms = (limit.max(0.0) + amplified).sqrt();
    let error = BakedError {
        rms,
        p99,
        max: errors.iter().copied().fold(0.0, f64::max),
        points: points.len() as u64,
        holds: rms <= tolerance && p99 <= P99 * tolerance,
    };
    (error, sum_of_bounces(mean_excess.abs()))
}

/// Reflectance that a mean is taken for at most: beyond it nothing can be said by a sum.
pub(crate) const LARGEST_REFLECTANCE: f64 = 0.95;

/// The part of the light on all surfaces that they reflect, 0..=1.
pub(crate) fn mean_reflectance(scene: &Scene, solution: &Solution) -> f64 {
    if !solution.reflects() {
        return 0.0;
    }
    let (mut arrives, mut leaves) = (0.0, 0.0);
    for leaf in solution.elements.leaves() {
        let Some(polygon) = solution.elements.polygon_of(leaf) else { continue };
        let irradiance = solution.irradiance_over_links(leaf) * solution.elements.nodes[leaf as usize].area;
        arrives += colour_mean(irradiance);
        leaves += colour_mean(irradiance * scene.reflectance(polygon));
    }
    if arrives > 0.0 { (leaves / arrives).min(LARGEST_REFLECTANCE) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use scene::Rgb;

    use super::*;

    #[test]
    fn what_rays_scatter_by_is_no_error_and_what_they_agree_about_is() {
        let point =
            |a: f64, b: f64| ResidualPoint { differences: [a, b].map(Rgb::splat), irradiance: 1.0, triangle: 0 };
        let noise: Vec<_> = (0..1000).map(|i| if i % 2 == 0 { point(0.1, -0.1) } else { point(-0.1, 0.1) }).collect();
        // The product of independent halves is as often of either sign; here it is always negative, so nothing is left.
        assert_eq!(measured(&noise, 0.01, 0.5).0.rms, 0.0);
        let bright = vec![point(0.02, 0.02); 1000];
        let (error, bias) = measured(&bright, 0.03, 0.5);
        assert!((bias - 0.04).abs() < 1e-12 && (error.rms - 0.04).abs() < 1e-12, "two bounces of what one is off by");
        assert!((error.p99 - 0.02).abs() < 1e-12 && !error.holds);
        assert!(measured(&bright, 0.03, 0.0).0.holds);
        assert!(measured(&[], 0.01, 0.5).0.holds);
    }
}
