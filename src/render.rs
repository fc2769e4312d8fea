//! `halflight render`: a picture from samples of the image plane, each along a ray.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use formats::FormatError;
use glam::{DVec2, Vec3};
use rayon::prelude::*;
use renderer::{
    AdaptiveOptions, CoherenceMap, CoherenceOptions, Evaluation, Evaluator, Filter, PixelIntegral, sample_histogram,
    sample_map,
};
use scene::{Display, Exposure, luminance};
use serde::Serialize;

use crate::args::{Budget, CoherenceFlags, ExposureChoice, ImageKind, Interpolation, RenderFlags, SamplerChoice};
use crate::compare::relative_norms;
use crate::error_map::error_map;
use crate::failure::{Outcome, Usage};
use crate::input::Input;
use crate::interrupt::Interrupt;
use crate::output::{Output, Outputs};
use crate::picture::{Picture, Reconstruction, Seconds, encoded};
use crate::progress::{Stage, say};
use crate::radiance::{self, Lines};
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
    if let Some(source) = &flags.reading.sky.environment {
        return sky::run(flags, source, outputs);
    }
    flags.camera.viewpoint()?;
    radiance::check(&flags.radiance)?;
    check(flags)?;
    let limit = Limit::of(flags)?;
    if flags.sampler == SamplerChoice::CoherenceMap {
        check_budget(flags, &limit)?;
    }
    let full = flags.compare.as_deref().map(|path| full_picture(path, flags.size)).transpose()?;
    let output = outputs.claim(&flags.output)?;
    let coherence = flags.coherence.map.as_deref().map(|path| outputs.claim(path)).transpose()?;
    let map = flags.sample_map.as_deref().map(|path| outputs.claim(path)).transpose()?;
    let errors = flags.error_map.as_deref().map(|path| outputs.claim(path)).transpose()?;
    if let Some(folder) = &flags.snapshots {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let input = Input::read(&flags.input, &flags.reading)?;
    radiance::with_evaluator(input, flags, outputs, |evaluate, lines| {
        let exposure = match flags.exposure {
            ExposureChoice::Fixed(exposure) => exposure,
            ExposureChoice::Auto => meter(evaluate, flags.size),
        };
        let integral = flags.coherence.relocate.then(|| {
            let confidence = &flags.confidence;
            PixelIntegral::new(&coherence_options(flags, exposure), confidence.level, confidence.interval(), flags.seed)
        });
        let evaluate: &Evaluator<'_> = &|point| match &integral {
            Some(integral) => integral.mean(point, evaluate),
            None => evaluate(point),
        };
        let mut picture = begin(flags, exposure, &limit, evaluate, lines)?;
        let snapshot = |picture: &mut Picture| -> Result<()> {
            let Some(folder) = &flags.snapshots else { return Ok(()) };
            let name = format!("{:012}", picture.samples());
            let name = folder.join(name).with_extension(flags.output.extension().unwrap_or_default());
            Ok(write(picture, flags.size, &outputs.claim(&name)?)?)
        };
        interrupt.heeded_by(|| sample(&mut picture, &limit, evaluate, interrupt, &snapshot))?;
        write(&mut picture, flags.size, &output)?;
        if let (Some(output), Some(map)) = (&coherence, picture.map()) {
            let [width, height] = map.work_size();
            output.write(|path| formats::write_png(path, width, height, &map.map()))?;
        }
        let compared = full.map(|full| (picture.light(), full));
        if let (Some(output), Some((light, full))) = (&errors, &compared) {
            let (width, height) = flags.size;
            output.write(|path| formats::write_png(path, width, height, &error_map(light, full)))?;
        }
        let norms = compared.map(|(light, full)| relative_norms(&light, &full));
        report(&picture, flags, exposure, map.as_ref(), norms, interrupt.pressed())
    })
}

/// Refuses flags that say nothing of the picture that is asked for.
fn check(flags: &RenderFlags) -> Result<()> {
    let is_coherent = flags.sampler == SamplerChoice::CoherenceMap;
    let CoherenceFlags { supersample, map, relocate } = &flags.coherence;
    if !is_coherent && (supersample.is_some() || map.is_some() || *relocate) {
        let why = "--supersample, --map and --relocate are of a coherence map; give --sampler coherence-map";
        bail!(Usage(why.into()));
    }
    if is_coherent && flags.interpolation != Interpolation::Constant {
        bail!(Usage("--interpolation: a coherence map has its own; leave it out".into()));
    }
    if flags.error_map.is_some() && flags.compare.is_none() {
        bail!(Usage("--error-map is of the difference from a full picture; give one with --compare FULL.exr".into()));
    }
    if flags.compare.is_some() && !flags.is_exr() {
        bail!(Usage("--compare is of radiance; let the name of --output end in .exr".into()));
    }
    Ok(())
}

/// Refuses a budget that a coherence map's first blocks need more than.
fn check_budget(flags: &RenderFlags, limit: &Limit) -> Result<()> {
    let ((width, height), supersample) = (flags.size, flags.supersample());
    let (least, samples) = (CoherenceMap::least(width, height, supersample), limit.samples);
    if samples < least {
        let pixels = f64::from(width) * f64::from(height) * f64::from(supersample).powi(2);
        let share = 100.0 * least as f64 / pixels;
        bail!(Usage(format!(
            "--budget: {samples} samples are too few for the corners of the map's first blocks; they need {least}, {share:.2} % \
             of the work image"
        )));
    }
    Ok(())
}

/// A picture of radiance to compare with.
fn full_picture(path: &Path, (width, height): (u32, u32)) -> Result<Vec<Vec3>> {
    let (of_width, of_height, pixels) = formats::read_exr(path)?;
    if (of_width, of_height) != (width, height) {
        bail!(Usage(format!(
            "--compare {}: its size is {of_width}x{of_height}, the picture's {width}x{height}; give --size {of_width}x{of_height}",
            path.display()
        )));
    }
    Ok(pixels)
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
        let supersample = f64::from(flags.supersample());
        Ok(match (flags.budget, flags.sampler) {
            (Some(Budget::Share(share) | Budget::Bare(share)), SamplerChoice::CoherenceMap) => {
                samples(share * supersample * supersample)
            }
            (None, SamplerChoice::Full) => samples(FULL),
            (None, SamplerChoice::Adaptive | SamplerChoice::CoherenceMap) => samples(f64::INFINITY),
            (Some(Budget::RaysPerPixel(a_pixel) | Budget::Share(a_pixel) | Budget::Bare(a_pixel)), _) => {
                samples(a_pixel)
            }
            (Some(Budget::Seconds(seconds)), SamplerChoice::Adaptive | SamplerChoice::CoherenceMap) => {
                Self { samples: u64::MAX, seconds }
            }
            (Some(Budget::Seconds(seconds)), SamplerChoice::Full) => bail!(Usage(format!(
                "--budget {seconds}s: the full sampler takes as many samples in each pixel, and must know how many; give \
                 rays per pixel, such as 4rpp"
            ))),
        })
    }
}

/// Begins the picture that flags ask for.
fn begin(
    flags: &RenderFlags,
    exposure: Exposure,
    limit: &Limit,
    evaluate: &Evaluator<'_>,
    lines: &Lines<'_>,
) -> Result<Picture> {
    let (width, height) = flags.size;
    let display = Display::new(exposure, flags.tone_curve);
    let filter = flags.filter.map_or(Filter::Lanczos, Filter::from);
    let film = || Reconstruction::new(flags.size, filter, flags.interpolation, (!flags.is_exr()).then_some(display));
    let picture = match flags.sampler {
        SamplerChoice::Adaptive => {
            let options = AdaptiveOptions {
                seed: flags.seed,
                rule: flags.confidence.rule.into(),
                level: flags.confidence.level,
                interval: flags.confidence.interval(),
                display,
            };
            Picture::adaptive(flags.size, &options, film(), evaluate)
        }
        SamplerChoice::CoherenceMap => return begin_coherent(flags, exposure, lines),
        SamplerChoice::Full => {
            let a_pixel = limit.samples as f64 / (f64::from(width) * f64::from(height));
            Picture::uniform(flags.size, a_pixel, flags.seed, film())
        }
    };
    picture.ok_or_else(|| {
        let why = "that many samples cannot be counted; ask for fewer";
        Usage(format!("--size {width}x{height} with --budget: {why}")).into()
    })
}

fn coherence_options(flags: &RenderFlags, exposure: Exposure) -> CoherenceOptions {
    let curve = (!flags.is_exr()).then_some(flags.tone_curve);
    CoherenceOptions { supersample: flags.supersample(), exposure, curve }
}

/// Begins the picture of a coherence map.
fn begin_coherent(flags: &RenderFlags, exposure: Exposure, lines: &Lines<'_>) -> Result<Picture> {
    let (width, height) = flags.size;
    let supersample = flags.supersample();
    let options = coherence_options(flags, exposure);
    let map = CoherenceMap::new(width, height, &options, &lines.visible()).ok_or_else(|| {
        let why = "the work image cannot be that large; ask for fewer pixels";
        Usage(format!("--size {width}x{height} with --supersample {supersample}: {why}"))
    })?;
    let filter = flags.filter.map_or(Filter::Gaussian, Filter::from);
    Ok(Picture::coherent(map, filter, (!flags.is_exr()).then_some(Display::new(exposure, flags.tone_curve))))
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
    norms: Option<[f64; 2]>,
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
    let seconds = picture.seconds();
    let report = RenderJson {
        width,
        height,
        radiance: flags.radiance.radiance.name(),
        samples,
        rays_per_pixel: samples as f64 / pixels,
        all_rays_per_pixel: picture.rays() as f64 / pixels,
        closed_share: picture.closed_share(),
        evaluated_share: picture.map().map(|map| map.evaluated() as f64 / map.pixels() as f64),
        l1: norms.map(|[l1, _]| l1),
        l2: norms.map(|[_, l2]| l2),
        excluded,
        exposure: exposure.ev,
        interrupted,
        histogram: sample_histogram(&counts),
        seconds: SecondsJson { map: picture.map().map(|_| seconds.generate + seconds.reconstruct), stages: seconds },
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

/// The exposure of a picture: metered where a surface is seen that light reaches, as in `shot`.
fn meter(evaluate: &Evaluator<'_>, (width, height): (u32, u32)) -> Exposure {
    let place = |i: u32, pixels: u32| (f64::from(i) + 0.5) * f64::from(pixels) / f64::from(METER_GRID);
    let point = |i: u32| DVec2::new(place(i % METER_GRID, width), place(i / METER_GRID, height));
    let seen: Vec<Evaluation> = (0..METER_GRID * METER_GRID).into_par_iter().map(|i| evaluate(point(i))).collect();
    let luminances = seen.iter().filter(|seen| seen.object != 0).map(|seen| luminance(seen.radiance.as_dvec3()));
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
    /// Part of the work image's pixels that are evaluated, of a coherence map.
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluated_share: Option<f64>,
    /// With --compare: norms of the difference, relative to those of the full picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    l1: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    l2: Option<f64>,
    /// Samples without a finite radiance.
    excluded: u64,
    /// Exposure value.
    exposure: f32,
    interrupted: bool,
    /// Pixels with 0, 1, 2 … 20 samples, and with more.
    histogram: Vec<u64>,
    seconds: SecondsJson,
}

/// Seconds of the stages.
#[derive(Serialize)]
struct SecondsJson {
    #[serde(flatten)]
    stages: Seconds,
    /// All of a coherence map but evaluation.
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<f64>,
}

impl RenderJson {
    fn sentence(&self) -> String {
        let known =
            self.closed_share.map_or_else(String::new, |share| format!(", {:.1} % of them known", 100.0 * share));
        let share = self
            .evaluated_share
            .map_or_else(String::new, |share| format!(", {:.1} % of the work image", 100.0 * share));
        let apart = match (self.l1, self.l2) {
            (Some(l1), Some(l2)) => format!("; apart from the full picture L1 {l1:.4}, L2 {l2:.4}"),
            _ => String::new(),
        };
        let Seconds { generate, evaluate, reconstruct } = self.seconds.stages;
        format!(
            "{} samples, {:.2} a pixel{known}{share}{apart}; {generate:.2} s to place them, {evaluate:.2} s to look, {reconstruct:.2} s for the \
             picture",
            self.samples, self.rays_per_pixel
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn background_and_what_is_no_number_do_not_meter() {
        let seen = |point: DVec2| match (point.x / 3.0) as u32 % 3 {
            0 => Evaluation { radiance: Vec3::ONE, object: 0, cost: 1 },
            1 => Evaluation { radiance: Vec3::NAN, object: 1, cost: 1 },
            _ => Evaluation { radiance: Vec3::splat(3.0), object: 1, cost: 1 },
        };
        assert!((3.0 * meter(&seen, (96, 96)).factor() - 0.18).abs() < 1e-6);
        assert_eq!(meter(&|_| Evaluation::default(), (96, 96)).ev, 0.0);
    }
}
