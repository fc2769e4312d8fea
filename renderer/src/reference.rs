//! Reference irradiance: as many paths at every point as a stated standard error asks for.

use rayon::prelude::*;
use scene::{Bvh, Scene};

use crate::{Estimate, PathOptions, SurfacePoint, path_trace::PathTracer};

/// Paths per point of the pilot run that measures how many the main run needs.
const PILOT_SAMPLES: u32 = 2048;

/// Paths taken beyond what the pilot asks for, as a factor: it knows a standard error to within an eighth, so that
/// without any a third of the points would miss their target by more than that.
const CAUTION: f64 = 1.5;

/// Most paths at one point; what takes more misses its target, and the estimate says so.
const MOST_SAMPLES: f64 = (1 << 24) as f64;

/// What a reference is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceOptions {
    /// Standard error of the total irradiance at every point and colour, as a fraction of the scene's mean.
    pub total_error: f64,
    /// The same for direct light alone, as a fraction of the mean of direct light.
    pub direct_error: f64,
    /// References with different seeds are independent.
    pub seed: u64,
}

/// Irradiance at a list of points, with what it cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Light straight from emitters, per point.
    pub direct: Vec<Estimate>,
    /// All light, per point; estimated independently of the direct part.
    pub total: Vec<Estimate>,
    /// Mean of the total over points and colours, W·m⁻².
    pub mean: f64,
    /// Paths followed in the main runs.
    pub samples: u64,
}

/// Estimates direct and total irradiance at points.
///
/// How many paths a point gets is decided by a pilot run whose own paths are thrown away, so that no estimate is
/// biased by when it stopped. `bvh` is [`Bvh::of_scene`] of the same scene.
pub fn reference(scene: &Scene, bvh: &Bvh, points: &[SurfacePoint], options: &ReferenceOptions) -> Reference {
    let tracer = PathTracer::new(scene, bvh);
    let run = |samples: &[u32], bounces, pass: u64| -> Vec<Estimate> {
        let estimate = |(index, (&point, &samples)): (usize, (&SurfacePoint, &u32))| {
            // Four passes a seed: no two of them, of any seed, draw the same numbers.
            let options = PathOptions { samples, bounces, seed: options.seed.wrapping_mul(4).wrapping_add(pass) };
            tracer.irradiance(&point.into(), &options, index as u64)
        };
        points.par_iter().zip(samples).enumerate().map(estimate).collect()
    };
    let two_runs = |bounces, error: f64, pass: u64| {
        let pilot = run(&vec![PILOT_SAMPLES; points.len()], bounces, pass);
        let target = error * mean(&pilot);
        let samples: Vec<_> = pilot.iter().map(|estimate| samples_for(estimate, target)).collect();
        let paths: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
        (run(&samples, bounces, pass + 1), paths)
    };
    let (direct, direct_paths) = two_runs(Some(0), options.direct_error, 0);
    let (total, total_paths) = two_runs(None, options.total_error, 2);
    let mean = mean(&total);
    Reference { direct, total, mean, samples: direct_paths + total_paths }
}

/// Paths that bring the largest standard error of a pilot's estimate down to a target, W·m⁻².
fn samples_for(pilot: &Estimate, target: f64) -> u32 {
    let wanted = f64::from(PILOT_SAMPLES) * CAUTION * pilot.variance.max_element() / (target * target);
    wanted.clamp(f64::from(PILOT_SAMPLES), MOST_SAMPLES) as u32
}

/// Mean over points and colours.
fn mean(estimates: &[Estimate]) -> f64 {
    estimates.iter().map(|estimate| estimate.mean.element_sum()).sum::<f64>() / (3 * estimates.len()).max(1) as f64
}
