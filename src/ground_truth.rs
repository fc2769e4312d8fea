//! Path-traced irradiance at a bake's points: as many paths as a verdict on the bake needs.
//!
//! A pilot run gives the scales that errors are relative to, and decides how many paths each point gets. Its own paths
//! are not used for anything else, so that neither biases the reference. Then the planned run, and as many paths again
//! for as long as noise is too large.

use std::sync::atomic::{AtomicUsize, Ordering};

use renderer::{Estimate, SurfacePoint, irradiance_on};
use scene::{Bvh, Rgb, Scene};

use crate::progress::Stage;
use crate::verification::{Comparison, errors_of_the_square};

/// Paths per point of the pilot. Scales are known to a few percent by it, which multiplies the mean square by less than
/// 1.01; twice as many cost a sixth of a verification more.
const PILOT: u32 = 1024;

/// Standard error of the mean square by noise, as a fraction of the tolerance's square, that is small enough: a bake
/// at 1.2 times its tolerance is then told from one that keeps it, as far as noise is concerned. Half as much would
/// take 1.5 to 4 times the paths.
const PRECISION: f64 = 1.0 / 6.0;

/// Least relative variance that a point is taken to have, as a fraction of the mean over all points: the pilot may
/// have met nothing bright from there.
const LEAST_VARIANCE: f64 = 0.25;

/// Fewest paths at a point that any light reaches: eight a batch.
const FEWEST: u32 = 256;

/// Most paths a point on average: ten minutes for 2,000 points on two cores. What needs more is judged with more noise,
/// which the test allows for and the standard error tells.
const MOST: f64 = (1 << 18) as f64;

/// What is asked of a reference.
pub struct TruthOptions {
    /// Paths at every point; none is as many as the tolerance asks for.
    pub samples: Option<u32>,
    /// Interreflections followed; none is all.
    pub bounces: Option<u32>,
    /// Relative RMSE that is to be told from a larger one.
    pub tolerance: f64,
    /// References with different seeds are independent.
    pub seed: u64,
}

/// Bake and reference at every point.
pub struct Truth {
    /// The comparisons, in the order of the points; empty where no light reaches any of them.
    pub comparisons: Vec<Comparison>,
    /// Paths followed, the pilot's left out.
    pub paths: u64,
    /// Whether the noise is as small as the tolerance asks for, or the smaller part of the standard error.
    pub precise: bool,
}

/// Holds irradiance found at points against paths.
pub fn ground_truth(scene: &Scene, points: &[SurfacePoint], found: &[Rgb], options: &TruthOptions) -> Truth {
    let bvh = Bvh::of_scene(scene);
    let stage = Stage::start("trace");
    // A seed for every run, none of them that of the points, and none of another seed's.
    let run = |samples: &[u32], number: u64| {
        let done = AtomicUsize::new(0);
        let advance = || stage.advance(done.fetch_add(1, Ordering::Relaxed) as f64 / points.len() as f64);
        let seed = options.seed.wrapping_mul(64).wrapping_add(number);
        irradiance_on(scene, &bvh, points, samples, (options.bounces, seed), &advance)
    };
    let average = |estimate: &Estimate| estimate.mean.element_sum() / 3.0;
    let pilot = run(&vec![PILOT; points.len()], 1);
    let mean = pilot.iter().map(average).sum::<f64>() / points.len().max(1) as f64;
    if mean <= 0.0 {
        stage.end();
        return Truth { comparisons: Vec::new(), paths: 0, precise: true };
    }
    let scales: Vec<f64> = pilot.iter().map(|estimate| average(estimate).max(mean)).collect();
    let mut samples = match options.samples {
        Some(samples) => vec![samples; points.len()],
        None => {
            let relative =
                |(estimate, scale): (&Estimate, &f64)| estimate.variance.element_sum() / 3.0 / (scale * scale);
            plan(&pilot.iter().zip(&scales).map(relative).collect::<Vec<_>>(), options.tolerance)
        }
    };
    let compared = |estimates: &[Estimate]| -> Vec<Comparison> {
        let all = found.iter().zip(estimates).zip(&scales);
        all.map(|((&found, estimate), &scale)| Comparison {
            found,
            truth: estimate.mean,
            variance: estimate.variance,
            scale,
        })
        .collect()
    };
    let total = |samples: &[u32]| samples.iter().map(|&samples| u64::from(samples)).sum::<u64>();
    // Where noise is the smaller part of the error anyway, paths without end would not halve it: points are too few.
    let is_precise = |comparisons: &[Comparison]| {
        let (noise, all) = errors_of_the_square(comparisons);
        noise <= (PRECISION * options.tolerance * options.tolerance).max(all / 2.0_f64.sqrt())
    };
    let mut estimates = run(&samples, 2);
    let mut comparisons = compared(&estimates);
    for number in 3.. {
        let enough = options.samples.is_some() || is_precise(&comparisons);
        if enough || 2.0 * total(&samples) as f64 > MOST * points.len() as f64 {
            break;
        }
        // As many again, so that both count alike. Whether to go on is decided for all points at once, by the noise and
        // not by the error: what bias that leaves is far below the standard error.
        let more = run(&samples, number);
        for (estimate, more) in estimates.iter_mut().zip(more) {
            estimate.mean = (estimate.mean + more.mean) / 2.0;
            estimate.variance = (estimate.variance + more.variance) / 4.0;
        }
        samples.iter_mut().for_each(|samples| *samples = samples.saturating_mul(2));
        comparisons = compared(&estimates);
    }
    stage.end();
    let precise = is_precise(&comparisons);
    Truth { comparisons, paths: total(&samples), precise }
}

/// Paths for every point, from its relative variance in the pilot, that bring the noise of the mean square down to
/// [`PRECISION`] of the tolerance's square with the fewest paths in all.
///
/// Where noise is more than error, it adds 2·(v/n)² at a point; the sum of these is least for n in proportion to v^⅔.
fn plan(variances: &[f64], tolerance: f64) -> Vec<u32> {
    let count = variances.len().max(1) as f64;
    let least = LEAST_VARIANCE * variances.iter().sum::<f64>() / count;
    let weight = |variance: f64| if variance > 0.0 { variance.max(least).powf(2.0 / 3.0) } else { 0.0 };
    // With c·weight paths a point of error F adds (2·(q/c)² + 4·F²·q/c)/N², where q/c is its variance.
    let (mut quadratic, mut linear) = (0.0, 0.0);
    for &variance in variances.iter().filter(|&&variance| variance > 0.0) {
        let per_path = f64::from(PILOT) * variance.max(least) / weight(variance);
        quadratic += 2.0 * per_path * per_path / (count * count);
        linear += 4.0 * tolerance * tolerance * per_path / (count * count);
    }
    let goal = (PRECISION * tolerance * tolerance).powi(2);
    let wanted = (linear + (linear * linear + 4.0 * goal * quadratic).sqrt()) / (2.0 * goal);
    let weights = variances.iter().map(|&variance| weight(variance)).sum::<f64>();
    let factor = if weights > 0.0 { wanted.min(MOST * count / weights) } else { 0.0 };
    variances.iter().map(|&variance| ((factor * weight(variance)).min(1e9) as u32).max(FEWEST)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_scatter_gets_the_fewest_paths() {
        assert!(plan(&[], 0.01).is_empty());
        assert_eq!(plan(&[0.0; 3], 0.01), [FEWEST; 3]);
        assert_eq!(plan(&[0.0, 1e-30], 0.01), [FEWEST; 2]);
    }

    #[test]
    fn the_plan_reaches_its_precision_and_no_more() {
        let variances: Vec<f64> = (0..2000).map(|i| if i % 10 == 0 { 0.04 } else { 0.002 }).collect();
        let samples = plan(&variances, 0.01);
        let noise = |(variance, samples): (&f64, &u32)| {
            let variance = variance * f64::from(PILOT) / f64::from(*samples);
            2.0 * variance * variance + 4e-4 * variance
        };
        let error = variances.iter().zip(&samples).map(noise).sum::<f64>().sqrt() / 2000.0;
        let goal = PRECISION * 1e-4;
        assert!(error <= 1.01 * goal && error >= 0.8 * goal, "{error} for {goal}");
        assert!(samples[0] > 4 * samples[1], "{} and {}", samples[0], samples[1]);
    }

    #[test]
    fn there_is_an_end_to_the_paths() {
        let samples = plan(&[10.0; 100], 1e-6);
        let total: f64 = samples.iter().map(|&samples| f64::from(samples)).sum();
        assert!((99.0 * MOST..=100.0 * MOST).contains(&total), "{total}");
    }
}
