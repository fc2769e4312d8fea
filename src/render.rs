//! `halflight render`: a picture from samples of the image plane, each along a ray.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use formats::FormatError;
use glam::{DVec2, Vec3};
use rayon::prelude::*;
use renderer::{
    AdaptiveOptions, AdaptiveSampler, Evaluation, Evaluator, Film, ScatteredFilm, Surface, Tile, UniformSampler,
    sample_histogram, sample_map,
};
use scene::{Display, Exposure, encode_srgb, luminance};
use serde::Serialize;

use crate::args::{Budget, ExposureChoice, ImageKind, Interpolation, RenderFlags, SamplerChoice};
use crate::failure::{Outcome, Usage};
use crate::input::Input;
use crate::interrupt::Interrupt;
use crate::output::{Output, Outputs};
use crate::progress::{Stage, say};
use crate::radiance;
use crate::report::print_json;

/// Samples a pixel of the full sampler, where no budget is given.
const FULL: f64 = 4.0;

/// Columns and rows of the grid that the light of a picture is metered on, as `shot` has it.
const METER_GRID: u32 = 32;

/// Samples that are evaluated between two looks at the clock and at Ctrl-C: a tenth of a second where each takes two hundred
/// microseconds, and work for many threads.
const CHUNK: usize = 1024;

/// Samples of the first snapshot.
const FIRST_SNAPSHOT: u64 = 1024;

/// Makes a picture.
pub fn run(flags: &RenderFlags, outputs: &Outputs, interrupt: &Interrupt) -> Result<Outcome> {
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
        let mut picture = Picture::new(flags, exposure, &limit, evaluate)?;
        let snapshots = flags.snapshots.as_deref().map(|folder| (folder, outputs));
        interrupt.heeded_by(|| picture.sample(&limit, evaluate, interrupt, snapshots))?;
        picture.write(&output)?;
        picture.report(flags, map.as_ref(), interrupt.pressed())
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

/// A sampler of either kind.
enum Sampler {
    Adaptive(Box<AdaptiveSampler>),
    Uniform(UniformSampler),
}

impl Sampler {
    fn next_batch(&mut self, most: usize) -> Vec<DVec2> {
        match self {
            Self::Adaptive(sampler) => sampler.next_batch(most),
            Self::Uniform(sampler) => sampler.next_batch(most.min(CHUNK)),
        }
    }

    fn take(&mut self, seen: &[Evaluation]) -> Vec<Tile> {
        match self {
            Self::Adaptive(sampler) => sampler.take(seen),
            Self::Uniform(sampler) => sampler.take(seen),
        }
    }

    fn samples(&self) -> u64 {
        match self {
            Self::Adaptive(sampler) => sampler.samples() as u64,
            Self::Uniform(sampler) => sampler.samples(),
        }
    }

    fn excluded(&self) -> u64 {
        match self {
            Self::Adaptive(sampler) => sampler.excluded(),
            Self::Uniform(sampler) => sampler.excluded(),
        }
    }

    /// Pixels that are known, 0..=1; none where the sampler does not ask.
    fn closed_share(&self) -> Option<f64> {
        match self {
            Self::Adaptive(sampler) => Some(sampler.closed_share()),
            Self::Uniform(_) => None,
        }
    }

    fn samples_per_pixel(&self) -> Vec<u32> {
        match self {
            Self::Adaptive(sampler) => sampler.samples_per_pixel(),
            Self::Uniform(sampler) => sampler.samples_per_pixel(),
        }
    }
}

/// What makes a picture of samples.
enum Reconstruction {
    Cells(Film),
    Triangles(ScatteredFilm, Surface),
}

impl Reconstruction {
    fn new(flags: &RenderFlags, display: Option<Display>) -> Self {
        let ((width, height), filter) = (flags.size, flags.filter.into());
        let surface = match flags.interpolation {
            Interpolation::Constant => return Self::Cells(Film::new(width, height, filter, display)),
            Interpolation::Planar => Surface::Planar,
            Interpolation::Smooth => Surface::Smooth,
        };
        Self::Triangles(ScatteredFilm::new(width, height, filter, display), surface)
    }

    /// Adds what was seen at points, and the cells that changed by it.
    fn add(&mut self, points: &[DVec2], seen: &[Evaluation], tiles: &[Tile]) {
        match self {
            Self::Cells(film) => film.add(tiles),
            Self::Triangles(film, _) => {
                let finite = points.iter().zip(seen).filter(|(_, seen)| seen.radiance.is_finite());
                finite.for_each(|(&point, seen)| film.add(point, seen.radiance));
            }
        }
    }

    fn picture(&self) -> Vec<Vec3> {
        match self {
            Self::Cells(film) => film.picture(),
            Self::Triangles(film, surface) => film.picture(*surface),
        }
    }
}

/// A picture in the making.
struct Picture {
    size: (u32, u32),
    exposure: Exposure,
    sampler: Sampler,
    film: Reconstruction,
    /// Of snapshots, as of the picture.
    extension: &'static str,
    /// Rays of all samples, those from the eye included.
    rays: u64,
    seconds: Seconds,
}

impl Picture {
    fn new(flags: &RenderFlags, exposure: Exposure, limit: &Limit, evaluate: &Evaluator<'_>) -> Result<Self> {
        let (width, height) = flags.size;
        let is_exr = ImageKind::of(&flags.output) == Some(ImageKind::Exr);
        let display = Display::new(exposure, flags.tone_curve);
        let mut film = Reconstruction::new(flags, (!is_exr).then_some(display));
        let sampler = match flags.sampler {
            SamplerChoice::Adaptive => {
                let options = AdaptiveOptions {
                    seed: flags.seed,
                    rule: flags.confidence.rule.into(),
                    level: flags.confidence.level,
                    interval: flags.confidence.interval(),
                    display,
                };
                let sampler = AdaptiveSampler::new(width, height, &options, evaluate);
                sampler.map(|sampler| Sampler::Adaptive(Box::new(sampler)))
            }
            SamplerChoice::Full => {
                let a_pixel = limit.samples as f64 / (f64::from(width) * f64::from(height));
                UniformSampler::new(width, height, a_pixel, flags.seed).map(Sampler::Uniform)
            }
        };
        let Some(sampler) = sampler else {
            bail!(Usage(format!(
                "--size {width}x{height} with --budget: that many samples cannot be counted; ask for fewer"
            )))
        };
        // The adaptive sampler begins with one.
        if let Sampler::Adaptive(sampler) = &sampler {
            let (points, seen): (Vec<DVec2>, Vec<Evaluation>) = sampler
                .points()
                .map(|(point, radiance)| (point, Evaluation { radiance, ..Evaluation::default() }))
                .unzip();
            film.add(&points, &seen, &sampler.tiles());
        }
        let seconds = Seconds { generate: 0.0, evaluate: 0.0, reconstruct: 0.0 };
        let extension = if is_exr { "exr" } else { "png" };
        Ok(Self { size: flags.size, exposure, rays: sampler.samples(), sampler, film, extension, seconds })
    }

    /// Samples until the limit is reached, nothing is left to do, or Ctrl-C; writes snapshots on the way.
    fn sample(
        &mut self,
        limit: &Limit,
        evaluate: &Evaluator<'_>,
        interrupt: &Interrupt,
        snapshots: Option<(&Path, &Outputs)>,
    ) -> Result<()> {
        let (stage, start) = (Stage::start("render"), Instant::now());
        let late = || interrupt.pressed() || start.elapsed().as_secs_f64() >= limit.seconds;
        let mut snapshot = FIRST_SNAPSHOT;
        while !late() {
            let left = limit.samples.saturating_sub(self.sampler.samples());
            let batch = timed(&mut self.seconds.generate, || {
                self.sampler.next_batch(usize::try_from(left).unwrap_or(usize::MAX))
            });
            if batch.is_empty() {
                break;
            }
            let seen = timed(&mut self.seconds.evaluate, || seen_at(&batch, evaluate, &late));
            self.rays += seen.iter().map(|evaluation| u64::from(evaluation.cost)).sum::<u64>();
            let tiles = timed(&mut self.seconds.generate, || self.sampler.take(&seen));
            timed(&mut self.seconds.reconstruct, || self.film.add(&batch, &seen, &tiles));
            let samples = self.sampler.samples();
            let of_limit = samples as f64 / limit.samples as f64;
            let of_time = start.elapsed().as_secs_f64() / limit.seconds;
            stage.advance(of_limit.max(of_time).max(self.sampler.closed_share().unwrap_or(0.0)));
            if let Some((folder, outputs)) = snapshots.filter(|_| samples >= snapshot) {
                let name = format!("{samples:012}.{}", self.extension);
                self.write(&outputs.claim(&folder.join(name))?)?;
                snapshot = (samples + 1).next_power_of_two();
            }
        }
        stage.end();
        Ok(())
    }

    /// Writes the picture so far.
    fn write(&mut self, output: &Output) -> Result<(), FormatError> {
        let light = timed(&mut self.seconds.reconstruct, || self.film.picture());
        let (width, height) = self.size;
        output.write(|path| match ImageKind::of(path) {
            Some(ImageKind::Exr) => formats::write_exr(path, width, height, &light),
            _ => formats::write_png(path, width, height, &encoded(&light)),
        })
    }

    /// Says what was done.
    fn report(&self, flags: &RenderFlags, map: Option<&Output>, interrupted: bool) -> Result<Outcome> {
        let (width, height) = self.size;
        let counts = self.sampler.samples_per_pixel();
        if let Some(map) = map {
            map.write(|path| formats::write_png(path, width, height, &sample_map(&counts)))?;
        }
        let (samples, excluded) = (self.sampler.samples(), self.sampler.excluded());
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
            all_rays_per_pixel: self.rays as f64 / pixels,
            closed_share: self.sampler.closed_share(),
            excluded,
            exposure: self.exposure.ev,
            interrupted,
            histogram: sample_histogram(&counts),
            seconds: self.seconds,
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
}

/// Looks at points, on all threads, until it is late: what was seen at the first of them.
fn seen_at(points: &[DVec2], evaluate: &Evaluator<'_>, late: &dyn Fn() -> bool) -> Vec<Evaluation> {
    let mut seen = Vec::with_capacity(points.len());
    for chunk in points.chunks(CHUNK) {
        seen.par_extend(chunk.par_iter().map(|&point| evaluate(point)));
        if late() {
            break;
        }
    }
    seen
}

/// The exposure of a picture: metered where something is seen that light reaches.
fn meter(evaluate: &Evaluator<'_>, (width, height): (u32, u32)) -> Exposure {
    let place = |i: u32, pixels: u32| (f64::from(i) + 0.5) * f64::from(pixels) / f64::from(METER_GRID);
    let point = |i: u32| DVec2::new(place(i % METER_GRID, width), place(i / METER_GRID, height));
    let seen: Vec<Evaluation> = (0..METER_GRID * METER_GRID).into_par_iter().map(|i| evaluate(point(i))).collect();
    let luminances = seen.iter().map(|seen| luminance(seen.radiance.as_dvec3()));
    Exposure::metered(luminances.filter(|luminance| luminance.is_finite() && *luminance > 0.0))
}

/// Light that a display shows, as it takes it.
fn encoded(light: &[Vec3]) -> Vec<[u8; 3]> {
    let channel = |light: f32| (encode_srgb(light) * 255.0 + 0.5) as u8;
    light.iter().map(|pixel| pixel.to_array().map(channel)).collect()
}

/// Runs a part of the work; its seconds are added.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = work();
    *seconds += start.elapsed().as_secs_f64();
    done
}

/// Seconds of the stages of a picture, the paper's three.
#[derive(Clone, Copy, Debug, Serialize)]
struct Seconds {
    generate: f64,
    evaluate: f64,
    reconstruct: f64,
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

    #[test]
    fn what_is_seen_late_is_not_waited_for() {
        let points = vec![DVec2::ZERO; 3 * CHUNK];
        let evaluate = |_: DVec2| Evaluation::default();
        assert_eq!(seen_at(&points, &evaluate, &|| false).len(), 3 * CHUNK);
        assert_eq!(seen_at(&points, &evaluate, &|| true).len(), CHUNK);
        assert!(seen_at(&[], &evaluate, &|| true).is_empty());
    }

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

    #[test]
    fn light_beyond_white_is_white() {
        let all = [Vec3::ZERO, Vec3::splat(1.07), Vec3::splat(0.18)];
        assert_eq!(encoded(&all), [[0; 3], [255; 3], [118; 3]]);
    }
}
