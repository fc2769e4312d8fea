//! `halflight render`: a picture from samples of the image plane, each along a ray.

use std::time::Instant;

use anyhow::{Context, Result, bail};
use formats::FormatError;
use glam::DVec2;
use rayon::prelude::*;
use renderer::{AdaptiveOptions, Evaluation, Evaluator, sample_histogram, sample_map};
use scene::{Display, Exposure, luminance};
use serde::Serialize;

use crate::args::{Budget, ExposureChoice, ImageKind, RenderFlags, SamplerChoice};
use crate::failure::{Outcome, Usage};
use crate::input::Input;
use crate::interrupt::Interrupt;
use crate::output::{Output, Outputs};
use crate::picture::{Picture, Reconstruction, Seconds, encoded};
use crate::progress::{Stage, say};
use crate::radiance;
use crate::report::print_json;
use crate::sky;

/// Samples a pixel of the full sampler, where no budget is given.
const FULL: f64 = 4.0;

/// Columns and rows of the grid that the light of a picture is metered on, as `shot` has it.
const METER_GRID: u32 = 32;

/// Samples of the first snapshot.
const FIRST_SNAPSHOT: u64 = 1024;

/// Makes a picture.
pub fn run(flags: &RenderFlags, outputs: &Outputs, interrupt: &Interrupt) -> Result<Outcome> {
    if let Some(source) = &flags.sky.environment {
        return sky::run(flags, source, outputs);
    }
    flags.camera.viewpoint()?;
    radiance::check(&flags.radiance)?;
    let limit = Limit::of(flags)?;
    let output = outputs.claim(&flags.output)?;
    let map = flags.sample_map.as_deref().map(|path| outputs.claim(path)).transpose()?;
    if let Some(folder) = &flags.snapshots {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let input = Input::read(&flags.input, flags.reading)?;
    radiance::with_evaluator(input, flags, outputs, |evaluate| {
        let exposure = match flags.exposure {
            ExposureChoice::Fixed(exposure) => exposure,
            ExposureChoice::Auto => meter(evaluate, flags.size),
        };
        let display = Display::new(exposure, flags.tone_curve);
        let mut picture = begin(flags, display, &limit, evaluate)?;
        let snapshot = |picture: &mut Picture| -> Result<()> {
            let Some(folder) = &flags.snapshots else { return Ok(()) };
            let name = format!("{:012}", picture.samples());
            let name = folder.join(name).with_extension(flags.output.extension().unwrap_or_default());
            Ok(write(picture, flags.size, &outputs.claim(&name)?)?)
        };
        interrupt.heeded_by(|| sample(&mut picture, &limit, evaluate, interrupt, &snapshot))?;
        write(&mut picture, flags.size, &output)?;
        report(&picture, flags, exposure, map.as_ref(), interrupt.pressed())
    })
}

/// How much is done at most.
struct Limit {
    /// Samples.
    samples: u64,
    /// Seconds.
    seconds: f64,
}

impl Limit {
    fn of(flags: &RenderFlags) -> Result<Self> {
        let pixels = f64::from(flags.size.0) * f64::from(flags.size.1);
        let samples =
            |a_pixel: f64| Self { samples: (a_pixel * pixels).round().max(1.0) as u64, seconds: f64::INFINITY };
        Ok(match (flags.budget, flags.sampler) {
            (None, SamplerChoice::Full) => samples(FULL),
            (None, SamplerChoice::Adaptive) => samples(f64::INFINITY),
            (Some(Budget::RaysPerPixel(a_pixel) | Budget::Share(a_pixel) | Budget::Bare(a_pixel)), _) => {
                samples(a_pixel)
            }
            (Some(Budget::Seconds(seconds)), SamplerChoice::Adaptive) => Self { samples: u64::MAX, seconds },
            (Some(Budget::Seconds(seconds)), SamplerChoice::Full) => bail!(Usage(format!(
                "--budget {seconds}s: the full sampler takes as many samples in each pixel, and must know how many; give \
                 rays per pixel, such as 4rpp"
            ))),
        })
    }
}

/// Begins the picture that flags ask for.
fn begin(flags: &RenderFlags, display: Display, limit: &Limit, evaluate: &Evaluator<'_>) -> Result<Picture> {
    let (width, height) = flags.size;
    let is_exr = ImageKind::of(&flags.output) == Some(ImageKind::Exr);
    let film = Reconstruction::new(flags.size, flags.filter.into(), flags.interpolation, (!is_exr).then_some(display));
    let picture = match flags.sampler {
        SamplerChoice::Adaptive => {
            let options = AdaptiveOptions {
                seed: flags.seed,
                rule: flags.confidence.rule.into(),
                level: flags.confidence.level,
                interval: flags.confidence.interval(),
                display,
            };
            Picture::adaptive(flags.size, &options, film, evaluate)
        }
        SamplerChoice::Full => {
            let a_pixel = limit.samples as f64 / (f64::from(width) * f64::from(height));
            Picture::uniform(flags.size, a_pixel, flags.seed, film)
        }
    };
    picture.ok_or_else(|| {
        let why = "that many samples cannot be counted; ask for fewer";
        Usage(format!("--size {width}x{height} with --budget: {why}")).into()
    })
}

/// Samples until the limit is reached, nothing is left to do, or Ctrl-C; writes snapshots on the way.
fn sample(
    picture: &mut Picture,
    limit: &Limit,
    evaluate: &Evaluator<'_>,
    interrupt: &Interrupt,
    snapshot: &dyn Fn(&mut Picture) -> Result<()>,
) -> Result<()> {
    let (stage, start) = (Stage::start("render"), Instant::now());
    let late = || interrupt.pressed() || start.elapsed().as_secs_f64() >= limit.seconds;
    let mut next_snapshot = FIRST_SNAPSHOT;
    while !late() && picture.advance(limit.samples.saturating_sub(picture.samples()), evaluate, &late) {
        let of_limit = picture.samples() as f64 / limit.samples as f64;
        let of_time = start.elapsed().as_secs_f64() / limit.seconds;
        stage.advance(of_limit.max(of_time).max(picture.closed_share().unwrap_or(0.0)));
        if picture.samples() >= next_snapshot {
            snapshot(picture)?;
            next_snapshot = (picture.samples() + 1).next_power_of_two();
        }
    }
    stage.end();
    Ok(())
}

/// Writes the picture so far.
fn write(picture: &mut Picture, (width, height): (u32, u32), output: &Output) -> Result<(), FormatError> {
    let light = picture.light();
    output.write(|path| match ImageKind::of(path) {
        Some(ImageKind::Exr) => formats::write_exr(path, width, height, &light),
        _ => formats::write_png(path, width, height, &encoded(&light)),
    })
}

/// Says what was done.
fn report(
    picture: &Picture,
    flags: &RenderFlags,
    exposure: Exposure,
    map: Option<&Output>,
    interrupted: bool,
) -> Result<Outcome> {
    let (width, height) = flags.size;
    let counts = picture.samples_per_pixel();
    if let Some(map) = map {
        map.write(|path| formats::write_png(path, width, height, &sample_map(&counts)))?;
    }
    let (samples, excluded) = (picture.samples(), picture.excluded());
    if excluded > 0 {
        say(format_args!(
            "warning: {excluded} of {samples} samples saw no finite radiance and are left out; check the scene's lights \
             and materials for numbers that are far too large"
        ));
    }
    let pixels = f64::from(width) * f64::from(height);
    let report = RenderJson {
        width,
        height,
        radiance: flags.radiance.radiance.name(),
        samples,
        rays_per_pixel: samples as f64 / pixels,
        all_rays_per_pixel: picture.rays() as f64 / pixels,
        closed_share: picture.closed_share(),
        excluded,
        exposure: exposure.ev,
        interrupted,
        histogram: sample_histogram(&counts),
        seconds: picture.seconds(),
    };
    if flags.json {
        print_json(&report)?;
    } else {
        say(report.sentence());
    }
    if interrupted {
        say("interrupted; the picture is of what was sampled so far");
        return Ok(Outcome::Interrupted);
    }
    Ok(Outcome::Done)
}

/// The exposure of a picture: metered where something is seen that light reaches.
fn meter(evaluate: &Evaluator<'_>, (width, height): (u32, u32)) -> Exposure {
    let place = |i: u32, pixels: u32| (f64::from(i) + 0.5) * f64::from(pixels) / f64::from(METER_GRID);
    let point = |i: u32| DVec2::new(place(i % METER_GRID, width), place(i / METER_GRID, height));
    let seen: Vec<Evaluation> = (0..METER_GRID * METER_GRID).into_par_iter().map(|i| evaluate(point(i))).collect();
    let luminances = seen.iter().map(|seen| luminance(seen.radiance.as_dvec3()));
    Exposure::metered(luminances.filter(|luminance| luminance.is_finite() && *luminance > 0.0))
}

/// What `render --json` prints.
#[derive(Serialize)]
struct RenderJson {
    width: u32,
    height: u32,
    radiance: &'static str,
    samples: u64,
    rays_per_pixel: f64,
    /// With the rays that a sample follows beyond the first: to lights, in mirrors, paths.
    all_rays_per_pixel: f64,
    /// Part of the pixels that are known with the confidence asked for; null for the full sampler, which does not ask.
    closed_share: Option<f64>,
    /// Samples without a finite radiance.
    excluded: u64,
    /// Exposure value.
    exposure: f32,
    interrupted: bool,
    /// Pixels with 0, 1, 2 … 20 samples, and with more.
    histogram: Vec<u64>,
    seconds: Seconds,
}

impl RenderJson {
    fn sentence(&self) -> String {
        let known =
            self.closed_share.map_or_else(String::new, |share| format!(", {:.1} % of them known", 100.0 * share));
        let Seconds { generate, evaluate, reconstruct } = self.seconds;
        format!(
            "{} samples, {:.2} a pixel{known}; {generate:.2} s to place them, {evaluate:.2} s to look, {reconstruct:.2} s for the \
             picture",
            self.samples, self.rays_per_pixel
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn background_and_what_is_no_number_do_not_meter() {
        let seen = |point: DVec2| match (point.x / 3.0) as u32 % 3 {
            0 => Evaluation::default(),
            1 => Evaluation { radiance: Vec3::NAN, object: 1, cost: 1 },
            _ => Evaluation { radiance: Vec3::splat(3.0), object: 1, cost: 1 },
        };
        assert!((3.0 * meter(&seen, (96, 96)).factor() - 0.18).abs() < 1e-6);
        assert_eq!(meter(&|_| Evaluation::default(), (96, 96)).ev, 0.0);
    }
}
