//! `halflight probe`: irradiance at points, from the interpolants, by an exact gather, or by paths.

use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, Result, bail};
use formats::SurfaceQuery;
use rayon::prelude::*;
use renderer::{Estimate, SurfacePoint};
use scene::{Baked, Bvh, Provenance, Rgb, Scene, centroid};
use solver::{Gather, Surroundings};

use crate::args::{LightFlags, Method, ProbeFlags};
use crate::failure::{Outcome, Usage};
use crate::input::{Input, require_light};
use crate::output::Outputs;
use crate::pipeline;
use crate::progress::{Stage, say};

/// How far a point may lie from the surface that it means, as a fraction of the scene's size: above the rounding of
/// a point printed with six digits, below the distance of surfaces that are meant to be apart.
pub const REACH: f64 = 1e-4;

/// Paths at a point where nobody says how many: 1 to 3 % of the light in a room with lamps of some size.
const SAMPLES: u32 = 4096;

/// Seed of the paths.
const SEED: u64 = 1;

/// Writes the irradiance at every point.
pub fn run(flags: &ProbeFlags, outputs: &Outputs) -> Result<Outcome> {
    if flags.samples.is_some() && flags.method != Method::Path {
        bail!(Usage("--samples: only paths are counted; give --method path, or leave --samples out".into()));
    }
    let output = flags.output.as_deref().map(|path| outputs.claim(path)).transpose()?;
    let points = formats::read_points(&flags.points)?;
    let input = Input::read(&flags.input, &flags.reading)?;
    let asked = LightFlags { bounces: flags.bounces, ..LightFlags::default() };
    let mut standard_errors = None;
    let found = match (flags.method, input) {
        (Method::Path, input) => {
            let (scene, bounces) = match input {
                Input::Scene(scene) => (scene, asked.bounces),
                Input::Baked(baked) => {
                    let bounces = as_baked(&baked.provenance, &asked).bounces;
                    (baked.scene, bounces)
                }
            };
            require_light(&flags.input, &scene)?;
            let estimates = trace(&scene, bounces, flags.samples.unwrap_or(SAMPLES), &points);
            standard_errors =
                Some(estimates.iter().map(|found| Some(found.as_ref()?.standard_error())).collect::<Vec<_>>());
            estimates.into_iter().map(|estimate| Some(estimate?.mean)).collect()
        }
        (Method::Gather, Input::Scene(scene)) => {
            require_light(&flags.input, &scene)?;
            gather(&scene, &asked, &points)
        }
        (Method::Gather, Input::Baked(baked)) => gather(&baked.scene, &as_baked(&baked.provenance, &asked), &points),
        (Method::Interpolant, Input::Baked(baked)) => {
            let made = pipeline::light_flags(&baked.provenance).bounces;
            if flags.bounces.is_some() && flags.bounces != made {
                bail!(Usage(format!(
                    "--bounces: {} holds the light of {} bounces; give the scene, or --method gather",
                    flags.input.display(),
                    made.map_or_else(|| "all".to_owned(), |bounces| bounces.to_string())
                )));
            }
            interpolate(&baked, &points)
        }
        (Method::Interpolant, scene) => interpolate(&scene.into_baked(&flags.input, &asked, outputs)?, &points),
    };
    let errors = standard_errors.as_deref();
    match output {
        Some(output) => output.write(|path| {
            formats::write_atomically(path, |file| formats::write_irradiance(file, &points, &found, errors))
        })?,
        None => {
            let mut stdout = std::io::stdout().lock();
            formats::write_irradiance(&mut stdout, &points, &found, errors).context("cannot write to stdout")?;
            stdout.flush().context("cannot write to stdout")?;
        }
    }
    let missing = found.iter().filter(|irradiance| irradiance.is_none()).count();
    if missing > 0 {
        say(format_args!(
            "warning: {missing} of {} points meet no surface: none within {REACH} of the scene's size has their normal",
            points.len()
        ));
    }
    Ok(Outcome::Done)
}

/// The options that bake a bake's scene again as it was baked, with the bounces asked for instead of its own.
pub fn as_baked(provenance: &Provenance, asked: &LightFlags) -> LightFlags {
    let made = pipeline::light_flags(provenance);
    LightFlags { bounces: asked.bounces.or(made.bounces), ..made }
}

fn interpolate(baked: &Baked, points: &[SurfaceQuery]) -> Vec<Option<Rgb>> {
    let (bvh, reach) = (baked.bvh(), REACH * baked.scene.size());
    let irradiance = |point: &SurfaceQuery| {
        let (triangle, s, t) = baked.locate(&bvh, point.position, point.normal, reach)?;
        Some(baked.irradiance(triangle, s, t))
    };
    points.iter().map(irradiance).collect()
}

fn gather(scene: &Scene, flags: &LightFlags, points: &[SurfaceQuery]) -> Vec<Option<Rgb>> {
    // A gather from the bake: its reflectors send what the bake says that they do.
    let solution = pipeline::bake(scene, flags, None).solution;
    let surroundings = Surroundings::new(scene, &solution);
    let gather = Gather::new(&surroundings, &solution);
    let (bvh, reach) = (Bvh::of_scene(scene), REACH * scene.size());
    let (stage, done) = (Stage::start("gather"), AtomicUsize::new(0));
    let irradiance = |point: &SurfaceQuery| {
        stage.advance(done.fetch_add(1, Ordering::Relaxed) as f64 / points.len() as f64);
        let polygon = bvh.nearest_surface(point.position, point.normal, reach)?.id;
        let plane = scene.plane(polygon);
        let position = point.position - plane.normal * plane.distance(point.position);
        // On a contact line the side towards the middle of the polygon counts.
        Some(gather.irradiance_at(polygon, position, centroid(&scene.outline(polygon)) - position))
    };
    let found = points.par_iter().map(irradiance).collect();
    stage.end();
    found
}

/// Path-traced irradiance at every point that meets a surface.
fn trace(scene: &Scene, bounces: Option<u32>, samples: u32, points: &[SurfaceQuery]) -> Vec<Option<Estimate>> {
    let (bvh, reach) = (Bvh::of_scene(scene), REACH * scene.size());
    let surface = |point: &SurfaceQuery| {
        let polygon = bvh.nearest_surface(point.position, point.normal, reach)?.id;
        let plane = scene.plane(polygon);
        let position = point.position - plane.normal * plane.distance(point.position);
        Some(SurfacePoint { position, normal: plane.normal, polygon })
    };
    let met: Vec<Option<SurfacePoint>> = points.par_iter().map(surface).collect();
    let surfaces: Vec<SurfacePoint> = met.iter().flatten().copied().collect();
    let (stage, done) = (Stage::start("trace"), AtomicUsize::new(0));
    let advance = || stage.advance(done.fetch_add(1, Ordering::Relaxed) as f64 / points.len() as f64);
    let samples = vec![samples; surfaces.len()];
    let mut estimates =
        renderer::irradiance_on(scene, &bvh, &surfaces, &samples, (bounces, SEED), &advance).into_iter();
    stage.end();
    met.into_iter().map(|surface| surface.and_then(|_| estimates.next())).collect()
}
