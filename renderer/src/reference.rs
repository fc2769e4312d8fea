//! Reference irradiance: as many paths at every point as a stated standard error asks for.

use rayon::prelude::*;
use scene::{Bvh, Scene};

use crate::{Estimate, PathOptions, SurfacePoint, path_trace::PathTracer};

/// Paths per point of the pilot run that measures how many the main run needs: enough to meet the small bright
/// surfaces that make most of the variance, a tenth of what the main run takes.
const PILOT_SAMPLES: u32 = 8192;

/// Paths taken beyond what the pilot asks for, as a factor. Still points miss their target where rare bright paths,
/// which the pilot met too few of, make most of the variance: in the office a third of them, the worst by a factor of
/// 2.5. None of them is run again, since a choice by an estimate's own scatter would bias it.
const CAUTION: f64 = 1.3;

/// Least variance that a point is taken to have, as a fraction of the mean over all points: the pilot may have met
/// nothing bright from there.
const LEAST_VARIANCE: f64 = 0.25;

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

/// Estimates direct and total irradiance at points, by their shading normals if any.
///
/// How many paths a point gets is decided by a pilot run whose own paths are thrown away, so that no estimate is
/// biased by when it stopped. `bvh` is [`Bvh::of_scene`] of the same scene.
pub fn reference(scene: &Scene, bvh: &Bvh, points: &[SurfacePoint], options: &ReferenceOptions) -> Reference {
    let tracer = PathTracer::new(scene, bvh);
    let run = |samples: &[u32], bounces, pass: u64| -> Vec<Estimate> {
        let estimate = |(index, (&point, &samples)): (usize, (&SurfacePoint, &u32))| {
            // Four passes a seed: no two of them, of any seed, draw the same numbers.
            let options = PathOptions { samples, bounces, seed: options.seed.wrapping_mul(4).wrapping_add(pass) };
            tracer.irradiance(&tracer.surfaces.looked_at(&point), &options, index as u64)
        };
        points.par_iter().zip(samples).enumerate().map(estimate).collect()
    };
    let two_runs = |bounces, error: f64, pass: u64| {
        let pilot = run(&vec![PILOT_SAMPLES; points.len()], bounces, pass);
        let target = error * mean(&pilot);
        let variances: Vec<_> = pilot.iter().map(|estimate| estimate.variance.max_element()).collect();
        let samples = samples_for(&variances, target);
        let paths: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
        (run(&samples, bounces, pass + 1), paths)
    };
    let (direct, direct_paths) = two_runs(Some(0), options.direct_error, 0);
    let (total, total_paths) = two_runs(None, options.total_error, 2);
    let mean = mean(&total);
    Reference { direct, total, mean, samples: direct_paths + total_paths }
}

/// Paths that bring the standard errors of a pilot's estimates, given as variances, down to a target, W·m⁻². Points
/// that nothing reached in the pilot are as dark as they look, and get no more than it.
fn samples_for(variances: &[f64], target: f64) -> Vec<u32> {
    let mean = variances.iter().sum::<f64>() / variances.len().max(1) as f64;
    let samples = |&variance: &f64| {
        let variance = if variance > 0.0 { variance.max(LEAST_VARIANCE * mean) } else { 0.0 };
        let wanted = f64::from(PILOT_SAMPLES) * CAUTION * variance / (target * target);
        // Not a clamp: max takes the number where the target is 0 and nothing is wanted.
        wanted.max(f64::from(PILOT_SAMPLES)).min(MOST_SAMPLES) as u32
    };
    variances.iter().map(samples).collect()
}

/// Mean over points and colours.
fn mean(estimates: &[Estimate]) -> f64 {
    estimates.iter().map(|estimate| estimate.mean.element_sum()).sum::<f64>() / (3 * estimates.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        path_trace::test_scenes::{grey, room, scene_of},
        spread_by_area,
    };

    #[test]
    fn no_points_and_no_light_need_no_paths_beyond_the_pilot() {
        assert_eq!(samples_for(&[], 0.0), vec![]);
        assert_eq!(samples_for(&[0.0; 2], 0.0), vec![PILOT_SAMPLES; 2], "0 / 0 asks for nothing");
        assert_eq!(samples_for(&[1.0, 0.0], 1e-9), vec![MOST_SAMPLES as u32, PILOT_SAMPLES]);
    }

    #[test]
    fn the_stated_error_is_reached() {
        let mut faces: Vec<_> = room(DVec3::ZERO, DVec3::ONE).into_iter().map(|face| (face, grey(0.6, 0.0))).collect();
        faces[1].1 = grey(0.0, 5.0);
        let scene = scene_of(&faces);
        let points = spread_by_area(&scene, 8, 1e-6, 2, |polygon| !scene.material(polygon).emits());
        let options = ReferenceOptions { total_error: 3e-3, direct_error: 1e-3, seed: 1 };
        let result = reference(&scene, &Bvh::of_scene(&scene), &points, &options);
        let rms = |estimates: &[Estimate]| {
            (estimates.iter().map(|e| e.variance.x).sum::<f64>() / estimates.len() as f64).sqrt() / mean(estimates)
        };
        assert!(rms(&result.total) <= options.total_error && rms(&result.direct) <= options.direct_error);
        assert!(result.direct.iter().zip(&result.total).all(|(direct, total)| direct.mean.x < total.mean.x));
    }
}
