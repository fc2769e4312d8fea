//! A picture in the making: samples of the image plane, and what is made of them.

use std::time::Instant;

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use renderer::{
    AdaptiveOptions, AdaptiveSampler, CoherenceMap, Evaluation, Evaluator, Film, Filter, ScatteredFilm, Surface, Tile,
    UniformSampler,
};
use scene::{Display, encode_srgb};
use serde::Serialize;

use crate::args::Interpolation;

/// Samples that are evaluated between two looks at the clock and at Ctrl-C: a tenth of a second where each takes two hundred
/// microseconds, and work for many threads.
const CHUNK: usize = 1024;

/// A picture in the making.
pub struct Picture {
    sampler: Sampler,
    /// Rays of all samples, those from the eye included.
    rays: u64,
    seconds: Seconds,
}

/// Seconds of the stages of a picture, the three of Painter & Sloan 1989.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// To place samples.
    pub generate: f64,
    /// To look.
    pub evaluate: f64,
    /// To make a picture of what was seen.
    pub reconstruct: f64,
}

impl Picture {
    /// One whose samples go where it is not known yet; the first of them is taken. None of a size that cannot be.
    pub fn adaptive(
        (width, height): (u32, u32),
        options: &AdaptiveOptions,
        film: Reconstruction,
        evaluate: &Evaluator<'_>,
    ) -> Option<Self> {
        let sampler = AdaptiveSampler::new(width, height, options, evaluate)?;
        let mut film = film;
        let seen = |radiance| Evaluation { radiance, ..Evaluation::default() };
        let (points, first): (Vec<DVec2>, Vec<Evaluation>) =
            sampler.points().map(|(point, radiance)| (point, seen(radiance))).unzip();
        film.add(&points, &first, &sampler.tiles());
        let sampler = Sampler::Adaptive(Box::new(sampler), film);
        Some(Self { rays: sampler.samples(), sampler, seconds: Seconds::default() })
    }

    /// One with so many samples a pixel, spread evenly. None of a size that cannot be.
    pub fn uniform((width, height): (u32, u32), a_pixel: f64, seed: u64, film: Reconstruction) -> Option<Self> {
        let sampler = Sampler::Uniform(UniformSampler::new(width, height, a_pixel, seed)?, film);
        Some(Self { rays: 0, sampler, seconds: Seconds::default() })
    }

    /// One of a coherence map, through a filter: of what a display shows, or of radiance.
    pub fn coherent(map: CoherenceMap, filter: Filter, display: Option<Display>) -> Self {
        let sampler = Sampler::Coherent { map: Box::new(map), filter, display };
        Self { rays: 0, sampler, seconds: Seconds::default() }
    }

    /// Takes a batch of samples, at most so many, fewer if it gets late; false if there is nothing left to do.
    pub fn advance(&mut self, most: u64, evaluate: &Evaluator<'_>, late: &dyn Fn() -> bool) -> bool {
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        let batch = timed(&mut self.seconds.generate, || self.sampler.next_batch(most));
        if batch.is_empty() {
            return false;
        }
        let seen = timed(&mut self.seconds.evaluate, || seen_at(&batch, evaluate, late));
        self.rays += seen.iter().map(|evaluation| u64::from(evaluation.cost)).sum::<u64>();
        let tiles = timed(&mut self.seconds.generate, || self.sampler.take(&seen));
        if let Sampler::Adaptive(_, film) | Sampler::Uniform(_, film) = &mut self.sampler {
            timed(&mut self.seconds.reconstruct, || film.add(&batch, &seen, &tiles));
        }
        true
    }

    /// The picture so far, row by row: radiance, W·sr⁻¹·m⁻², or what a display shows.
    pub fn light(&mut self) -> Vec<Vec3> {
        timed(&mut self.seconds.reconstruct, || match &self.sampler {
            Sampler::Adaptive(_, film) | Sampler::Uniform(_, film) => film.picture(),
            Sampler::Coherent { map, filter, display } => map.picture(*filter, *display),
        })
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.sampler.samples()
    }

    /// Rays so far, those from the eye included.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Samples whose radiance was no finite number.
    pub fn excluded(&self) -> u64 {
        match &self.sampler {
            Sampler::Adaptive(sampler, _) => sampler.excluded(),
            Sampler::Uniform(sampler, _) => sampler.excluded(),
            Sampler::Coherent { map, .. } => map.excluded(),
        }
    }

    /// The coherence map, if it is one's picture.
    pub fn map(&self) -> Option<&CoherenceMap> {
        match &self.sampler {
            Sampler::Coherent { map, .. } => Some(map),
            Sampler::Adaptive(..) | Sampler::Uniform(..) => None,
        }
    }

    /// Pixels that are known, 0..=1; none where the sampler does not ask.
    pub fn closed_share(&self) -> Option<f64> {
        match &self.sampler {
            Sampler::Adaptive(sampler, _) => Some(sampler.closed_share()),
            Sampler::Uniform(..) | Sampler::Coherent { .. } => None,
        }
    }

    /// How many samples lie in each pixel, row by row.
    pub fn samples_per_pixel(&self) -> Vec<u32> {
        match &self.sampler {
            Sampler::Adaptive(sampler, _) => sampler.samples_per_pixel(),
            Sampler::Uniform(sampler, _) => sampler.samples_per_pixel(),
            Sampler::Coherent { map, .. } => map.samples_per_pixel(),
        }
    }

    /// What the stages took so far.
    pub fn seconds(&self) -> Seconds {
        self.seconds
    }
}

/// A sampler of any kind, and what makes a picture of its samples; a coherence map makes its own.
enum Sampler {
    Adaptive(Box<AdaptiveSampler>, Reconstruction),
    Uniform(UniformSampler, Reconstruction),
    Coherent { map: Box<CoherenceMap>, filter: Filter, display: Option<Display> },
}

impl Sampler {
    fn next_batch(&mut self, most: usize) -> Vec<DVec2> {
        match self {
            Self::Adaptive(sampler, _) => sampler.next_batch(most),
            Self::Uniform(sampler, _) => sampler.next_batch(most.min(CHUNK)),
            Self::Coherent { map, .. } => map.next_batch(most),
        }
    }

    fn take(&mut self, seen: &[Evaluation]) -> Vec<Tile> {
        match self {
            Self::Adaptive(sampler, _) => sampler.take(seen),
            Self::Uniform(sampler, _) => sampler.take(seen),
            Self::Coherent { map, .. } => {
                map.take(seen);
                Vec::new()
            }
        }
    }

    fn samples(&self) -> u64 {
        match self {
            Self::Adaptive(sampler, _) => sampler.samples() as u64,
            Self::Uniform(sampler, _) => sampler.samples(),
            Self::Coherent { map, .. } => map.evaluated() as u64,
        }
    }
}

/// What makes a picture of samples.
pub enum Reconstruction {
    /// Of the cells of samples.
    Cells(Film),
    /// Of a surface over their triangulation.
    Triangles(ScatteredFilm, Surface),
}

impl Reconstruction {
    /// Of a picture of what a display shows, or of radiance.
    pub fn new(
        (width, height): (u32, u32),
        filter: Filter,
        interpolation: Interpolation,
        display: Option<Display>,
    ) -> Self {
        let surface = match interpolation {
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

/// Light that a display shows, as it takes it.
pub fn encoded(light: &[Vec3]) -> Vec<[u8; 3]> {
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
    fn light_beyond_white_is_white() {
        let all = [Vec3::ZERO, Vec3::splat(1.07), Vec3::splat(0.18)];
        assert_eq!(encoded(&all), [[0; 3], [255; 3], [118; 3]]);
    }
}
