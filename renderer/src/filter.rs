//! Filters that a picture is seen through, as sums over the part of a line that is left of a point (Painter & Sloan 1989, section
//! 3.3.1, after Crow 1984): what a filter makes of a stretch of even light is the difference of two of them.
//!
//! All are separable, so that one table over a line is enough, and have the integral 1.

use std::f64::consts::PI;

/// A filter; widths are in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// A sinc windowed by a wider one (Lanczos), over 7 × 7 pixels: the sharpest, with overshoots at borders.
    #[default]
    Lanczos,
    /// The pixel's own square.
    Box,
    /// A tent over 2 × 2 pixels.
    Triangle,
    /// A Gaussian with a standard deviation of half a pixel, cut off at four of them.
    Gaussian,
    /// The cubic with B = C = 1/3 over 4 × 4 pixels (Mitchell and Netravali 1988).
    Mitchell,
}

/// Steps of a table over one pixel: 4096 entries over the seven of the widest filter, as the paper has. Between two of them light
/// moves by less than 1e-6 of its amount.
const STEPS: usize = 585;

/// A filter's integral from its left end to any point.
#[derive(Clone, Debug)]
pub(crate) struct SummedFilter {
    /// Where the filter ends on both sides, pixels.
    pub radius: f64,
    sums: Sums,
}

#[derive(Clone, Debug)]
enum Sums {
    /// At [`STEPS`] places of a pixel and one more: a row of `width` each, with those at the same place of the pixels before. It
    /// begins with the first pixel right of the filter, and ends with the last one left of it.
    Table { width: usize, sums: Vec<f64> },
    /// Of a filter that is even and a polynomial between whole numbers of a step: for each piece right of the middle, the
    /// coefficients of the integral from 0 over x to powers from 0 on.
    Polynomials { step: f64, pieces: Vec<[f64; 5]> },
}

impl SummedFilter {
    pub fn new(filter: Filter) -> Self {
        match filter {
            Filter::Lanczos => {
                let sinc = |x: f64| if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
                Self::table(3.5, |x| sinc(x) * sinc(x / 3.5))
            }
            Filter::Gaussian => Self::table(2.0, |x| (-2.0 * x * x).exp()),
            Filter::Box => Self::polynomials(0.5, vec![vec![1.0]]),
            Filter::Triangle => Self::polynomials(1.0, vec![vec![1.0, -1.0]]),
            Filter::Mitchell => Self::polynomials(
                1.0,
                // ((12−9B−6C)|x|³ + (−18+12B+6C)x² + 6−2B)/6 and ((−B−6C)|x|³ + (6B+30C)x² + (−12B−48C)|x| + 8B+24C)/6.
                vec![vec![16.0 / 18.0, 0.0, -2.0, 7.0 / 6.0], vec![32.0 / 18.0, -10.0 / 3.0, 2.0, -7.0 / 18.0]],
            ),
        }
    }

    /// Sums a function with Simpson's rule.
    fn table(radius: f64, filter: impl Fn(f64) -> f64) -> Self {
        let step = 1.0 / STEPS as f64;
        let entries = (2.0 * radius) as usize * STEPS + 1;
        let mut line = vec![0.0];
        for entry in 1..entries {
            let from = -radius + (entry - 1) as f64 * step;
            let area = (filter(from) + 4.0 * filter(from + step / 2.0) + filter(from + step)) * step / 6.0;
            line.push(line[entry - 1] + area);
        }
        let total = line[entries - 1];
        let width = (2.0 * radius) as usize + 2;
        let sum = |place: usize, column: usize| match ((width - 1 - column) * STEPS + place).checked_sub(STEPS) {
            Some(entry) if entry < entries => line[entry] / total,
            Some(_) => 1.0,
            None => 0.0,
        };
        let sums = (0..=STEPS).flat_map(|place| (0..width).map(move |column| (place, column)));
        Self { radius, sums: Sums::Table { width, sums: sums.map(|(place, column)| sum(place, column)).collect() } }
    }

    /// Integrates pieces that are each given by coefficients of powers of x.
    fn polynomials(step: f64, filter: Vec<Vec<f64>>) -> Self {
        let radius = step * filter.len() as f64;
        let mut pieces: Vec<[f64; 5]> = Vec::new();
        for (place, coefficients) in filter.iter().enumerate() {
            let start = step * place as f64;
            let mut piece = [0.0; 5];
            for (power, coefficient) in coefficients.iter().enumerate() {
                piece[power + 1] = coefficient / (power + 1) as f64;
            }
            let before = pieces.last().map_or(0.0, |last| polynomial(last, start));
            piece[0] = before - polynomial(&piece, start);
            pieces.push(piece);
        }
        Self { radius, sums: Sums::Polynomials { step, pieces } }
    }

    /// The integral of the filter left of a point, pixels from its middle: 0 left of all of it, 1 right of it.
    pub fn left_of(&self, x: f64) -> f64 {
        let mut sum = [0.0];
        self.left_of_row(x, &mut sum);
        sum[0]
    }

    /// The same of a row of pixels, for a point `x` pixels from the middle of the first: how much of each filter is left of it.
    pub fn left_of_row(&self, x: f64, into: &mut [f64]) {
        match &self.sums {
            Sums::Table { width, sums } => {
                // From a pixel before the filter on. The last pixel of the table ends where all of the filter is passed.
                let place = (x + self.radius + 1.0).max(0.0);
                let pixel = place as usize;
                let entry = (place - pixel as f64) * STEPS as f64;
                let row = (entry as usize).min(STEPS - 1);
                let part = entry - row as f64;
                let [low, high] = [row, row + 1].map(|row| &sums[row * width..(row + 1) * width]);
                // Filters before those in the table are passed, those behind are not met yet.
                let passed = (pixel + 1).saturating_sub(*width).min(into.len());
                let (ones, rest) = into.split_at_mut(passed);
                ones.fill(1.0);
                let first = width.saturating_sub(pixel + 1);
                let met = rest.len().min(width - first);
                let (met, zeros) = rest.split_at_mut(met);
                zeros.fill(0.0);
                for (sum, (low, high)) in met.iter_mut().zip(low[first..].iter().zip(&high[first..])) {
                    *sum = low + (high - low) * part;
                }
            }
            Sums::Polynomials { step, pieces } => {
                for (i, sum) in into.iter_mut().enumerate() {
                    let x = (x - i as f64).clamp(-self.radius, self.radius);
                    let piece = ((x.abs() / step) as usize).min(pieces.len() - 1);
                    *sum = 0.5 + polynomial(&pieces[piece], x.abs()).copysign(x);
                }
            }
        }
    }
}

fn polynomial(coefficients: &[f64; 5], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Filter; 5] = [Filter::Lanczos, Filter::Box, Filter::Triangle, Filter::Gaussian, Filter::Mitchell];

    #[test]
    fn the_whole_is_one_and_halves_are_alike() {
        for filter in ALL {
            let sums = SummedFilter::new(filter);
            for x in [sums.radius, sums.radius + 0.3, 9.0, 1e4] {
                assert!(sums.left_of(-x).abs() < 1e-15 && (sums.left_of(x) - 1.0).abs() < 1e-15, "{filter:?} at {x}");
            }
            let mut row = [0.0; 20];
            sums.left_of_row(7.3, &mut row);
            assert!((0..20).all(|i| (row[i] - sums.left_of(7.3 - i as f64)).abs() < 1e-12), "{filter:?}");
            for i in 0..=50 {
                let x = f64::from(i) / 50.0 * sums.radius;
                assert!((sums.left_of(x) + sums.left_of(-x) - 1.0).abs() < 1e-9, "{filter:?} at {x}");
            }
            // No jump anywhere, ends of pieces and of the whole included.
            let step = |i: i32| sums.left_of(f64::from(i) * 1e-3);
            assert!((-4000..4000).all(|i| (step(i + 1) - step(i)).abs() < 2e-3), "{filter:?}");
        }
    }

    #[test]
    fn polynomials_are_integrated_exactly() {
        let left_of = |filter, x| SummedFilter::new(filter).left_of(x);
        assert_eq!(left_of(Filter::Box, 0.25), 0.75);
        assert!((left_of(Filter::Triangle, -0.5) - 0.125).abs() < 1e-15);
        assert!((left_of(Filter::Triangle, 0.25) - (1.0 - 0.75 * 0.75 / 2.0)).abs() < 1e-15);
        // Mitchell's cubic by Simpson's rule, which is exact for it, from 1 to 2 and from 0.5 to 1.
        let outer = |x: f64| (-7.0 / 3.0 * x.powi(3) + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0;
        let inner = |x: f64| (7.0 * x.powi(3) - 12.0 * x * x + 16.0 / 3.0) / 6.0;
        let simpson = |f: &dyn Fn(f64) -> f64, a: f64, b: f64| (f(a) + 4.0 * f((a + b) / 2.0) + f(b)) * (b - a) / 6.0;
        let right = simpson(&outer, 1.0, 2.0);
        assert!((left_of(Filter::Mitchell, 1.0) - (1.0 - right)).abs() < 1e-14);
        assert!((left_of(Filter::Mitchell, 0.5) - (1.0 - right - simpson(&inner, 0.5, 1.0))).abs() < 1e-14);
    }

    #[test]
    fn a_table_is_the_function_summed() {
        let gauss = SummedFilter::new(Filter::Gaussian);
        // The normal distribution within one standard deviation, and within the cut at four.
        assert!((gauss.left_of(0.5) - gauss.left_of(-0.5) - 0.682_689_49 / 0.999_936_66).abs() < 1e-6);
        let lanczos = SummedFilter::new(Filter::Lanczos);
        let highest = (0..=3500).map(|i| lanczos.left_of(f64::from(i) * 1e-3)).fold(0.0, f64::max);
        assert!((highest - lanczos.left_of(1.0)).abs() < 1e-6, "the first zero of the sinc is at 1");
        assert!((highest - 1.073265).abs() < 1e-5, "it overshoots: {highest}");
    }
}
