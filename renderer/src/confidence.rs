//! Whether a mean is known well enough (Painter & Sloan 1989, section 3.1.3): Student's interval of confidence, and how wide it
//! may be.

use std::f64::consts::FRAC_PI_2;

use glam::Vec3A;
use scene::encode_srgb;

/// How far from the truth the mean of a pixel may be, of what a display shows at most, 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// In the light that a display shows; behind the tone curve it is wide in highlights.
    Linear(f64),
    /// In what an eye makes of that light, behind the transfer function: narrow in the dark, too.
    Perceptual(f64),
}

/// Degrees of freedom from which on the distribution is taken for that of as many: the quantile at 99 % is 2 % above the
/// normal one's.
const MOST_DEGREES: usize = 100;

/// Means that the width of an interval is known at, spread by their square root. Between two of them it is the smaller one's.
const STEPS: usize = 1024;

/// A level and an interval, ready to be asked often.
pub(crate) struct Confidence {
    /// Student's t, by degrees of freedom.
    quantiles: Vec<f32>,
    /// Largest half width of the interval of confidence, by the mean.
    widths: Vec<f32>,
}

impl Confidence {
    /// With a level between 0 and 1, such as 0.99, and an interval above 0.
    pub fn new(level: f64, interval: Interval) -> Self {
        let quantiles = (0..=MOST_DEGREES as u32).map(|degrees| student_t(level, degrees) as f32).collect();
        let mean = |step: usize| (step as f32 / STEPS as f32).powi(2);
        let widths = (0..=STEPS).map(|step| interval.half_width(mean(step))).collect();
        Self { quantiles, widths }
    }

    /// How many times too large a variance of a mean is, that of the channel where it is largest: up to 1 the mean is known well
    /// enough.
    pub fn excess(&self, mean: Vec3A, variance: f32, degrees: f32) -> f32 {
        let quantile = self.quantiles[(degrees as usize).min(MOST_DEGREES)];
        let step = |channel: f32| (channel.max(0.0).sqrt() * STEPS as f32) as usize;
        let width = |channel: f32| {
            let step = step(channel).min(STEPS - 1);
            self.widths[step].min(self.widths[step + 1])
        };
        let narrowest = mean.to_array().map(width).into_iter().fold(f32::INFINITY, f32::min);
        let root = quantile / narrowest;
        // Of 0 degrees the quantile is infinite, whatever the variance.
        if root.is_finite() { variance * root * root } else { f32::INFINITY }
    }
}

impl Interval {
    /// The largest distance from a mean at which light differs by no more than the interval.
    fn half_width(self, mean: f32) -> f32 {
        let interval = match self {
            Self::Linear(interval) => return interval as f32,
            Self::Perceptual(interval) => interval as f32,
        };
        let seen = encode_srgb;
        let within =
            |width: f32| seen(mean + width) - seen(mean) <= interval && seen(mean) - seen(mean - width) <= interval;
        // A bisection of the width, which is a number between nothing and all that is shown.
        let halve = |(low, high): (f32, f32), _| {
            let middle = (low + high) / 2.0;
            if within(middle) { (middle, high) } else { (low, middle) }
        };
        (0..32).fold((0.0, 1.0), halve).0
    }
}

/// Student's t: where the distribution with so many degrees of freedom has the share `level` between −t and t. Infinite for
/// none.
fn student_t(level: f64, degrees: u32) -> f64 {
    if degrees == 0 {
        return f64::INFINITY;
    }
    // The share as a function of θ = atan(t / √ν) (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4) grows from 0 to 1.
    let share = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let odd = degrees % 2;
        let (mut term, mut sum) = (if odd == 1 { cos } else { 1.0 }, 0.0);
        for k in (odd + 1..degrees).step_by(2) {
            sum += term;
            term *= f64::from(k) / f64::from(k + 1) * cos * cos;
        }
        if odd == 1 { (angle + sin * sum) / FRAC_PI_2 } else { sin * sum }
    };
    let halve = |(low, high): (f64, f64), _| {
        let middle = (low + high) / 2.0;
        if share(middle) < level { (middle, high) } else { (low, middle) }
    };
    let (angle, _) = (0..60).fold((0.0, FRAC_PI_2), halve);
    angle.tan() * f64::from(degrees).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        assert_eq!(student_t(0.99, 0), f64::INFINITY);
        for (level, degrees, expected) in [
            (0.99, 1, 63.657),
            (0.99, 2, 9.925),
            (0.99, 3, 5.841),
            (0.99, 4, 4.604),
            (0.99, 8, 3.355),
            (0.99, 30, 2.750),
            (0.99, 100, 2.626),
            (0.95, 1, 12.706),
            (0.95, 10, 2.228),
            (0.5, 1, 1.0),
        ] {
            let t = student_t(level, degrees);
            assert!((t - expected).abs() < 6e-4, "{t} for {expected} at {level}, {degrees}");
        }
    }

    #[test]
    fn nothing_is_known_from_one_sample_and_all_where_nothing_varies() {
        let confidence = Confidence::new(0.99, Interval::Linear(0.01));
        assert_eq!(confidence.excess(Vec3A::ONE, 0.0, 0.0), f32::INFINITY);
        assert_eq!(confidence.excess(Vec3A::ONE, 0.0, 1.0), 0.0);
        let half = |t: f32| (0.01 / t).powi(2);
        for (t, degrees) in [(3.3554, 8.0), (2.6259, 1e9)] {
            assert!((confidence.excess(Vec3A::ONE, half(t), degrees) - 1.0).abs() < 1e-3);
            assert!((confidence.excess(Vec3A::ONE, 4.0 * half(t), degrees) - 4.0).abs() < 4e-3);
        }
    }

    /// A step of what an eye sees is a small step of light in the dark, and a large one in highlights.
    #[test]
    fn a_perceptual_interval_follows_the_transfer_function() {
        let interval = Interval::Perceptual(1.0 / 255.0);
        for mean in [0.0, 0.01, 0.18, 0.6, 1.0] {
            let width = interval.half_width(mean);
            let seen = |light: f32| encode_srgb(light) * 255.0;
            let change = (seen(mean + width) - seen(mean)).max(seen(mean) - seen(mean - width));
            assert!((change - 1.0).abs() < 1e-2, "{change} at {mean}");
        }
        let widths = [0.0, 0.01, 0.1, 0.5, 1.0].map(|mean| interval.half_width(mean));
        assert!(widths.is_sorted(), "{widths:?}");
        let confidence = Confidence::new(0.99, interval);
        let variance = (0.003_f32 / 3.4).powi(2);
        assert!(confidence.excess(Vec3A::splat(0.5), variance, 8.0) < 1.0);
        assert!(confidence.excess(Vec3A::new(0.5, 0.01, 0.5), variance, 8.0) > 1.0, "the dark channel counts, too");
    }
}
