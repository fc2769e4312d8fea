//! What a bake's light is off by, and whether that is within a tolerance: plain numbers in, a verdict out.
//!
//! The measure is the relative RMSE: the root of the mean, over points and colours, of ((E − E_ref) ÷ max(own, mean))².
//! E_ref is an estimate, and its own noise must not count. (E − R̄)² − v, with v the variance of the mean R̄ measured
//! from n independent batches, is the mean of (E − R_i)(E − R_j) over all pairs of batches: unbiased, whatever the noise
//! is distributed like. Two halves, i.e. a single pair, would be as unbiased with twice the variance.
//!
//! The scale max(own, mean) comes from other paths than R̄. If it came from the same, a reference that happens to be
//! bright would weigh its own error less, which biases the square by about 4·δ·v/s³, as much as the figure itself at
//! tolerances that matter. From independent paths of relative variance u it only multiplies the square by 1 + 3u.

use scene::Rgb;

/// The 99 % quantile of the standard normal distribution: a bake that just keeps its tolerance is refused once in a
/// hundred verifications.
const ONE_SIDED_99: f64 = 2.326;

/// The 99th percentile may be this many times the tolerance.
const PERCENTILE_FACTOR: f64 = 5.0;

/// Standard errors by which a point must lie beyond the limit of the percentile to be counted: 1 in 200 of those
/// exactly at the limit are counted by mistake, against 1 in 100 that may lie beyond.
const BEYOND: f64 = 2.6;

/// A bake and its reference at one point.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// Irradiance of the bake, W·m⁻².
    pub found: Rgb,
    /// The reference, W·m⁻²: the mean of independent batches of paths.
    pub truth: Rgb,
    /// Variance of the reference, (W·m⁻²)², unbiased.
    pub variance: Rgb,
    /// max(own, mean), W·m⁻², from paths that the reference does not share; more than 0.
    pub scale: f64,
}

impl Comparison {
    /// Difference from the reference, relative to the scale.
    pub fn difference(&self) -> Rgb {
        (self.found - self.truth) / self.scale
    }

    /// Standard error of the reference, W·m⁻².
    pub fn standard_error(&self) -> Rgb {
        Rgb::from_array(self.variance.to_array().map(f64::sqrt))
    }

    /// Variance of the reference, relative to the scale's square.
    fn variance(&self) -> Rgb {
        self.variance / (self.scale * self.scale)
    }

    /// Unbiased estimate of the relative error's square, averaged over the colours; negative where noise has it so.
    fn square(&self) -> f64 {
        let difference = self.difference();
        (difference * difference - self.variance()).element_sum() / 3.0
    }

    /// Variance of [`Comparison::square`] by the reference's noise alone, as if that were normal: 4δ²v + 2v², for which
    /// 4d²v − 2v² is unbiased. The colours share their paths, so their mean has at most the mean of their variances.
    fn square_variance(&self) -> f64 {
        let (difference, variance) = (self.difference(), self.variance());
        ((4.0 * difference * difference - 2.0 * variance) * variance).element_sum() / 3.0
    }

    /// Relative error, root mean square over the colours, less the reference's variance where it is more than that.
    pub fn error(&self) -> f64 {
        self.square().max(0.0).sqrt()
    }

    /// Relative difference, root mean square over the colours; the reference's noise is in it.
    fn size(&self) -> f64 {
        (self.difference().length_squared() / 3.0).sqrt()
    }

    /// Signed relative error, averaged over the colours.
    pub fn signed(&self) -> f64 {
        self.difference().element_sum() / 3.0
    }

    /// Whether noise alone would make a difference as large once in twenty times.
    pub fn is_noise(&self) -> bool {
        self.difference().length_squared() <= 4.0 * self.variance().element_sum()
    }

    /// Whether the relative error exceeds a limit by more than noise explains.
    fn is_beyond(&self, limit: f64) -> bool {
        self.size() > limit + BEYOND * (self.variance().element_sum() / 3.0).sqrt()
    }
}

/// What was found of a bake. Errors are fractions, 0.01 = 1 %.
#[derive(Clone, Debug, PartialEq)]
pub struct Verification {
    /// Relative RMSE, the reference's noise removed; 0 where less than the noise was found.
    pub relative_rmse: f64,
    /// Standard error of the relative RMSE, from the scatter over the points: noise and choice of points together.
    pub standard_error: f64,
    /// Percentiles over the points of the relative difference from the reference. Its noise is in them, since it can
    /// be removed from a mean but not from a single point: they are upper bounds.
    pub percentiles: Percentiles,
    /// Mean of the signed relative error over points and colours; positive is too bright.
    pub bias: f64,
    /// Standard error of the bias.
    pub bias_standard_error: f64,
    /// Relative standard error of the reference at one point, root mean square: what was removed.
    pub noise: f64,
    /// The relative error that one point in a hundred may exceed.
    pub percentile_limit: f64,
    /// Points that exceed it by more than noise explains.
    pub beyond: usize,
    /// Whether the relative RMSE is within the tolerance, as far as a one-sided test at 99 % can tell.
    pub rmse_holds: bool,
    /// Whether at most one point in a hundred exceeds the limit, as far as a one-sided test at 99 % can tell.
    pub percentile_holds: bool,
    /// Indices of the points with the largest errors, the largest first.
    pub worst: Vec<usize>,
}

/// Percentiles of the relative difference, root mean square over the colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
}

impl Verification {
    /// Whether the bake keeps its tolerance.
    pub fn holds(&self) -> bool {
        self.rmse_holds && self.percentile_holds
    }
}

/// Judges a bake at points spread evenly by area against a tolerance; `worst` points are listed.
pub fn verify(points: &[Comparison], tolerance: f64, worst: usize) -> Verification {
    let count = points.len().max(1) as f64;
    let (mean_square, square_error) = mean(points.iter().map(Comparison::square));
    let (bias, bias_standard_error) = mean(points.iter().map(Comparison::signed));
    let relative_rmse = mean_square.max(0.0).sqrt();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[b].error().total_cmp(&points[a].error()).then(a.cmp(&b)));
    let mut differences: Vec<f64> = points.iter().map(Comparison::size).collect();
    differences.sort_by(f64::total_cmp);
    // The smallest difference that at least the given part of the points does not exceed.
    let percentile = |part: f64| {
        let rank = (part * points.len() as f64).ceil() as usize;
        differences.get(rank.saturating_sub(1)).copied().unwrap_or_default()
    };
    let limit = PERCENTILE_FACTOR * tolerance;
    let beyond = points.iter().filter(|point| point.is_beyond(limit)).count();
    Verification {
        relative_rmse,
        // As far as the figure rises when the square rises by its standard error: defined at 0, too.
        standard_error: (mean_square.max(0.0) + square_error).sqrt() - relative_rmse,
        percentiles: Percentiles { p50: percentile(0.5), p95: percentile(0.95), p99: percentile(0.99) },
        bias,
        bias_standard_error,
        noise: (points.iter().map(|point| point.variance().element_sum() / 3.0).sum::<f64>() / count).sqrt(),
        percentile_limit: limit,
        beyond,
        rmse_holds: mean_square - ONE_SIDED_99 * square_error <= tolerance * tolerance,
        percentile_holds: at_least(beyond, points.len(), 0.01) > 0.01,
        worst: order.into_iter().take(worst).collect(),
    }
}

/// Standard error of the mean square: by the reference's noise alone, which more paths would take away, and by all
/// that makes the points differ.
pub fn errors_of_the_square(points: &[Comparison]) -> (f64, f64) {
    let noise =
        points.iter().map(Comparison::square_variance).sum::<f64>().max(0.0).sqrt() / points.len().max(1) as f64;
    (noise, mean(points.iter().map(Comparison::square)).1)
}

/// Mean of independent values, and its standard error.
fn mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean) * (value - mean)).sum();
    (mean, (squares / (count * (count - 1.0).max(1.0))).sqrt())
}

/// Probability that at least `successes` of `trials` succeed, each with a probability in 0..1.
fn at_least(successes: usize, trials: usize, probability: f64) -> f64 {
    if successes == 0 {
        return 1.0;
    }
    let odds = (probability / (1.0 - probability)).ln();
    // By logarithms: with many trials the first terms are less than any f64.
    let mut term = trials as f64 * (-probability).ln_1p();
    let mut sum = 0.0;
    for k in 0..=trials {
        if k >= successes {
            sum += term.exp();
        }
        term += ((trials - k) as f64 / (k + 1) as f64).ln() + odds;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that scatter like the standard normal distribution (a sum of twelve uniform ones), the same in every run.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            // SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
            let mut uniform = || {
                self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    /// A point whose true light is 2 and whose bake is off by `error` of that, with a reference from 32 batches that
    /// leave it a relative standard error of `noise`.
    fn point(random: &mut Noise, error: f64, noise: f64) -> Comparison {
        let truth = Rgb::splat(2.0);
        let scatter = noise * 2.0 * 32.0_f64.sqrt();
        let batches: Vec<Rgb> = (0..32).map(|_| truth + scatter * Rgb::splat(random.next())).collect();
        let mean = batches.iter().sum::<Rgb>() / 32.0;
        let squares: Rgb = batches.iter().map(|batch| (batch - mean) * (batch - mean)).sum();
        Comparison { found: truth * (1.0 + error), truth: mean, variance: squares / (32.0 * 31.0), scale: 2.0 }
    }

    fn points(seed: u64, count: usize, noise: f64, error: impl Fn(usize) -> f64) -> Vec<Comparison> {
        let mut random = Noise(seed << 32);
        (0..count).map(|i| point(&mut random, error(i), noise)).collect()
    }

    /// Errors of ±1 %, root mean square.
    fn one_percent(i: usize) -> f64 {
        if i.is_multiple_of(2) { 0.01 } else { -0.01 }
    }

    #[test]
    fn nothing_is_no_error() {
        let found = verify(&[], 0.01, 10);
        assert_eq!((found.relative_rmse, found.standard_error, found.percentiles.p99), (0.0, 0.0, 0.0));
        assert!(found.holds() && found.worst.is_empty());
        let exact = Comparison { found: Rgb::ONE, truth: Rgb::ONE, variance: Rgb::ZERO, scale: 1.0 };
        let found = verify(&[exact; 5], 1e-9, 2);
        assert_eq!((found.relative_rmse, found.bias, found.beyond), (0.0, 0.0, 0));
        assert!(found.holds());
        assert_eq!(found.worst, [0, 1]);
    }

    #[test]
    fn noise_alone_averages_to_nothing() {
        let squares = (0..50).map(|seed| mean(points(seed, 400, 0.03, |_| 0.0).iter().map(Comparison::square)).0);
        let (average, error) = mean(squares.collect::<Vec<_>>().into_iter());
        assert!(average.abs() < 3.0 * error && error < 0.05 * 0.03 * 0.03, "{average} ± {error}");
        let found = verify(&points(1, 4000, 0.03, |_| 0.0), 0.01, 0);
        assert!(found.holds() && found.beyond <= 4 && found.bias.abs() < 4.0 * found.bias_standard_error, "{found:?}");
        assert!((found.noise / 0.03 - 1.0).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_known_error_is_found_under_three_times_as_much_noise() {
        let found = verify(&points(2, 20_000, 0.03, one_percent), 0.01, 0);
        assert!((found.relative_rmse - 0.01).abs() < 3.0 * found.standard_error, "{found:?}");
        assert!(found.standard_error < 6e-4 && found.bias.abs() < 1e-3, "{found:?}");
        let found = verify(&points(3, 2000, 0.01, |_| 0.03), 0.01, 0);
        assert!((found.bias - 0.03).abs() < 1e-3 && !found.rmse_holds && found.percentile_holds, "{found:?}");
    }

    /// The noise that is predicted point by point is the noise that is there.
    #[test]
    fn the_noise_of_the_square_is_its_scatter() {
        let samples: Vec<_> = (0..300).map(|seed| points(seed, 100, 0.02, one_percent)).collect();
        let squares: Vec<f64> = samples.iter().map(|sample| mean(sample.iter().map(Comparison::square)).0).collect();
        let (_, error) = mean(squares.iter().copied());
        let scatter = error * 300.0_f64.sqrt();
        let (predicted, _) = errors_of_the_square(&samples[0]);
        assert!((predicted / scatter - 1.0).abs() < 0.3, "{predicted} for {scatter}");
        assert_eq!(errors_of_the_square(&[]), (0.0, 0.0));
    }

    /// At the tolerance one in a hundred is refused, below it none, well above it all.
    #[test]
    fn the_test_refuses_as_often_as_it_says() {
        let refused = |factor: f64| {
            let holds = |seed: u64| verify(&points(seed, 300, 0.01, |i| factor * one_percent(i)), 0.01, 0).rmse_holds;
            (0..500).filter(|&seed| !holds(seed)).count()
        };
        // 5 are expected; 13 or more come once in a thousand.
        let at_the_tolerance = refused(1.0);
        assert!((1..=12).contains(&at_the_tolerance), "{at_the_tolerance} of 500");
        assert_eq!(refused(0.85), 0);
        assert_eq!(refused(1.5), 500);
    }

    #[test]
    fn one_point_in_a_hundred_may_be_far_off() {
        let off = |every: usize| points(5, 2000, 0.01, move |i| if i.is_multiple_of(every) { 0.15 } else { 0.0 });
        let within = verify(&off(100), 0.01, 3);
        assert!(within.percentile_holds && within.beyond == 20, "{within:?}");
        let beyond = verify(&off(50), 0.01, 3);
        assert!(!beyond.percentile_holds && beyond.beyond == 40, "{beyond:?}");
        assert!(beyond.worst.iter().all(|index| index.is_multiple_of(50)), "{beyond:?}");
        assert!(beyond.percentiles.p99 > 0.1 && beyond.percentiles.p50 < 0.02, "{beyond:?}");
        // Noise alone, however large, puts no point beyond.
        let noisy = verify(&points(6, 2000, 0.1, |_| 0.0), 0.01, 0);
        assert!(noisy.percentile_holds, "{noisy:?}");
    }

    #[test]
    fn chances_by_hand() {
        assert_eq!(at_least(0, 0, 0.5), 1.0);
        assert!((at_least(2, 3, 0.5) - 0.5).abs() < 1e-12);
        assert!((at_least(1, 100, 0.01) - (1.0 - 0.99_f64.powi(100))).abs() < 1e-12);
        let far = at_least(10_000, 1_000_000, 0.01);
        assert!((far - 0.5).abs() < 0.01, "{far}");
        assert_eq!(at_least(5, 3, 0.5), 0.0);
    }
}
