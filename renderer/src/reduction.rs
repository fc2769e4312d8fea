//! From a work image to the picture (Guo 1998, section 5): a filter over so many pixels of the work image a side for each of the
//! picture.

use std::ops::Range;

use glam::Vec3;

use crate::filter::{Filter, SummedFilter};

/// What a pixel of the picture has of the pixels of the work image around it, along either axis.
pub(crate) struct Reduction {
    supersample: u32,
    /// Pixels of the work image before a pixel's own that the filter reaches.
    reach: u32,
    weights: Vec<f32>,
}

impl Reduction {
    /// By a filter, whose widths are in pixels of the picture, from so many pixels of the work image along a pixel's side.
    pub fn new(filter: Filter, supersample: u32) -> Self {
        let filter = SummedFilter::new(filter);
        let reach = ((filter.radius - 0.5) * f64::from(supersample)).ceil() as u32;
        let left_of = |step: u32| filter.left_of((f64::from(step) - f64::from(reach)) / f64::from(supersample) - 0.5);
        let weights = (0..supersample + 2 * reach).map(|step| (left_of(step + 1) - left_of(step)) as f32).collect();
        Self { supersample, reach, weights }
    }

    /// The rows of a work image of so many that rows of the picture are made of.
    pub fn rows(&self, rows: &Range<u32>, of: u32) -> Range<u32> {
        let first = (rows.start * self.supersample).saturating_sub(self.reach);
        first..(rows.end * self.supersample + self.reach).min(of)
    }

    /// Rows of a picture, from those rows of the work image, so many pixels each. Where the filter ends beyond the image what lies
    /// within counts for the whole, and less than nothing is nothing.
    pub fn reduce(&self, rows: &Range<u32>, width: u32, strip: &[Vec3], strip_rows: &Range<u32>) -> Vec<Vec3> {
        let columns = width / self.supersample;
        let mut across = Vec::with_capacity(columns as usize * strip_rows.len());
        for line in strip.chunks_exact(width as usize) {
            across.extend((0..columns).map(|column| self.sum(column, 0..width, |place| line[place as usize])));
        }
        let at = |row: u32, column: u32| across[((row - strip_rows.start) * columns + column) as usize];
        let pixel =
            |row: u32, column: u32| self.sum(row, strip_rows.clone(), |place| at(place, column)).max(Vec3::ZERO);
        rows.clone()
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .map(|(row, column)| pixel(row, column))
            .collect()
    }

    fn sum(&self, pixel: u32, within: Range<u32>, value: impl Fn(u32) -> Vec3) -> Vec3 {
        let first = i64::from(pixel * self.supersample) - i64::from(self.reach);
        let (mut sum, mut inside) = (Vec3::ZERO, 0.0);
        let from = (i64::from(within.start) - first).max(0) as usize;
        let to = ((i64::from(within.end) - first).max(0) as usize).min(self.weights.len());
        for (step, weight) in self.weights[from..to].iter().enumerate() {
            sum += *weight * value((first + (from + step) as i64) as u32);
            inside += weight;
        }
        sum / inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_stays_even_and_a_box_is_the_mean() {
        for filter in [Filter::Lanczos, Filter::Box, Filter::Triangle, Filter::Gaussian, Filter::Mitchell] {
            for supersample in [1, 2, 3, 5] {
                let reduction = Reduction::new(filter, supersample);
                let (width, rows) = (6 * supersample, 1..3);
                let strip = reduction.rows(&rows, 4 * supersample);
                let even = vec![Vec3::splat(0.7); width as usize * strip.len()];
                let picture = reduction.reduce(&rows, width, &even, &strip);
                assert_eq!(picture.len(), 12);
                assert!(picture.iter().all(|pixel| (*pixel - 0.7).abs().max_element() < 1e-5), "{filter:?}");
            }
        }
        let reduction = Reduction::new(Filter::Box, 2);
        let values: Vec<Vec3> = (0..8).map(|i| Vec3::splat(i as f32)).collect();
        let picture = reduction.reduce(&(0..1), 4, &values, &(0..2));
        assert!((picture[0].x - 2.5).abs() < 1e-6 && (picture[1].x - 4.5).abs() < 1e-6);
    }
}
