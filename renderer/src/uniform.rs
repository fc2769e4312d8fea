//! Uniform stratified sampling: one sample anywhere in every cell of a regular grid. What an adaptive picture is held against.

use glam::{DVec2, Vec3};

use crate::cell::MOST_PIXELS;
use crate::evaluation::Evaluation;
use crate::film::Tile;
use crate::sequence::scatter;

/// Most cells, so that they are counted exactly wherever they are.
const MOST_CELLS: f64 = (1u64 << 52) as f64;

/// Samples of a picture, row by row from the top. Asked for batches as [`crate::AdaptiveSampler`] is.
pub struct UniformSampler {
    size: DVec2,
    /// Columns and rows of cells.
    cells: [u64; 2],
    seed: u64,
    samples: u64,
    excluded: u64,
}

impl UniformSampler {
    /// A picture of so many pixels, at most [`MOST_PIXELS`] to a side, with about so many samples a pixel. Square numbers divide
    /// every pixel alike; with others the grid has cells that lie in two. None without pixels or samples.
    pub fn new(width: u32, height: u32, samples_per_pixel: f64, seed: u64) -> Option<Self> {
        let size = DVec2::new(width.into(), height.into());
        let cells = size.x * size.y * samples_per_pixel;
        let has_pixels = [width, height].iter().all(|side| (1..=MOST_PIXELS).contains(side));
        let can_count = cells > 0.0 && cells <= MOST_CELLS;
        if !(has_pixels && can_count) {
            return None;
        }
        let columns = (size.x * samples_per_pixel.sqrt()).round().clamp(1.0, cells.max(1.0));
        let rows = (cells / columns).round().max(1.0);
        Some(Self { size, cells: [columns as u64, rows as u64], seed, samples: 0, excluded: 0 })
    }

    /// The points to be looked at next, at most so many; none at the end.
    pub fn next_batch(&mut self, most: usize) -> Vec<DVec2> {
        let end = self.all().min(self.samples.saturating_add(most as u64));
        (self.samples..end).map(|cell| self.point(cell)).collect()
    }

    /// Takes what is seen at the points of the last batch, or at the first of them: the cells that were filled. Radiance that is no
    /// finite number is excluded, and its cell black.
    pub fn take(&mut self, seen: &[Evaluation]) -> Vec<Tile> {
        let first = self.samples;
        self.samples = self.all().min(first.saturating_add(seen.len() as u64));
        let mut tiles = Vec::with_capacity(seen.len());
        for (cell, evaluation) in (first..self.samples).zip(seen) {
            let is_number = evaluation.radiance.is_finite();
            self.excluded += u64::from(!is_number);
            let radiance = if is_number { evaluation.radiance } else { Vec3::ZERO };
            let low = self.corner(cell);
            // The next cell's corner, to the last digit, so that nothing is left between the two.
            let next = self.corner(cell) + self.step();
            tiles.push(Tile { bounds: [low, next.min(self.size)], radiance, before: Vec3::ZERO });
        }
        tiles
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples of the whole picture.
    pub fn all(&self) -> u64 {
        self.cells[0] * self.cells[1]
    }

    /// Samples whose radiance was no finite number.
    pub fn excluded(&self) -> u64 {
        self.excluded
    }

    /// How many samples lie in each pixel, row by row.
    pub fn samples_per_pixel(&self) -> Vec<u32> {
        let [width, height] = self.size.to_array().map(|side| side as usize);
        let mut counts = vec![0; width * height];
        for cell in 0..self.samples {
            let point = self.point(cell);
            counts[(point.y as usize).min(height - 1) * width + (point.x as usize).min(width - 1)] += 1;
        }
        counts
    }

    fn point(&self, cell: u64) -> DVec2 {
        let number = scatter(self.seed, cell);
        let [across, down] = [number as u32, (number >> 32) as u32].map(|part| f64::from(part) / 2f64.powi(32));
        self.corner(cell) + DVec2::new(across, down) * self.step()
    }

    fn step(&self) -> DVec2 {
        self.size / DVec2::new(self.cells[0] as f64, self.cells[1] as f64)
    }

    fn corner(&self, cell: u64) -> DVec2 {
        DVec2::new((cell % self.cells[0]) as f64, (cell / self.cells[0]) as f64) * self.step()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Film, Filter};

    #[test]
    fn no_pixels_and_no_samples_are_none() {
        for (width, height, samples) in [
            (0, 5, 1.0),
            (5, 0, 1.0),
            (5, 5, 0.0),
            (5, 5, -1.0),
            (5, 5, f64::NAN),
            (5, 5, 1e30),
            (MOST_PIXELS + 1, 1, 1.0),
        ] {
            assert!(UniformSampler::new(width, height, samples, 1).is_none());
        }
    }

    #[test]
    fn the_cells_fill_the_picture_and_hold_their_samples() {
        for samples_per_pixel in [0.01, 0.7, 1.0, 1.9, 4.0, 9.0] {
            let mut sampler = UniformSampler::new(31, 17, samples_per_pixel, 3).expect("a picture");
            let mut film = Film::new(31, 17, Filter::Box, None);
            loop {
                let batch = sampler.next_batch(50);
                if batch.is_empty() {
                    break;
                }
                let seen: Vec<Evaluation> =
                    batch.iter().map(|_| Evaluation { radiance: Vec3::ONE, object: 1, cost: 1 }).collect();
                let tiles = sampler.take(&seen);
                for (point, Tile { bounds: [low, high], .. }) in batch.iter().zip(&tiles) {
                    assert!(point.cmpge(*low).all() && point.cmple(*high).all());
                }
                film.add(&tiles);
            }
            assert_eq!(sampler.samples(), sampler.all());
            let counts = sampler.samples_per_pixel();
            assert_eq!(counts.iter().map(|&count| u64::from(count)).sum::<u64>(), sampler.all());
            assert!(
                samples_per_pixel.sqrt().fract() > 0.0 || counts.iter().all(|&n| f64::from(n) == samples_per_pixel)
            );
            let asked = 31.0 * 17.0 * samples_per_pixel;
            assert!((sampler.all() as f64 - asked).abs() <= 0.5 + 0.5 * asked.sqrt(), "{asked}: {}", sampler.all());
            assert!(film.picture().iter().all(|pixel| (*pixel - Vec3::ONE).length() < 1e-6));
        }
    }

    #[test]
    fn what_is_no_number_is_black() {
        let mut sampler = UniformSampler::new(2, 1, 1.0, 3).expect("a picture");
        assert_eq!(sampler.next_batch(9).len(), 2);
        let bad = Evaluation { radiance: Vec3::new(1.0, f32::NAN, 1.0), object: 1, cost: 1 };
        let tiles = sampler.take(&[bad, Evaluation { radiance: Vec3::ONE, ..bad }, bad]);
        assert_eq!((tiles.len(), sampler.excluded(), tiles[0].radiance), (2, 1, Vec3::ZERO));
    }
}
