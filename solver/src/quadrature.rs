//! Gauss–Legendre rules, and how many points a smooth integrand needs.

/// Largest rule kept. A segment that needs more points is halved instead, which is cheaper.
pub(crate) const MOST_POINTS: usize = 16;

/// A node in 0..=1 and its weight; the weights of a rule sum to 1.
type Node = (f64, f64);

const RULES: [[Node; MOST_POINTS]; MOST_POINTS + 1] = rules();

/// The Gauss–Legendre rule of `points` points on 0..=1, at least one and at most [`MOST_POINTS`].
pub(crate) fn gauss_legendre(points: usize) -> &'static [(f64, f64)] {
    let points = points.clamp(1, MOST_POINTS);
    &RULES[points][..points]
}

/// Points that integrate an analytic function over a segment of a given length to about e^−`digits`, when the nearest
/// singularity of the function is `distance` away, in the worst direction: beside the segment's middle.
///
/// The error falls as ρ^−2n with the Bernstein ellipse ρ = y + √(1 + y²) through the singularity at y half lengths
/// (Trefethen, Approximation Theory and Approximation Practice, theorem 19.3).
pub(crate) fn points_needed(length: f64, distance: f64, digits: f64) -> usize {
    // A length of 0 needs one point; a distance of 0 saturates.
    (0.5 * digits / (2.0 * distance / length).asinh()).ceil().max(1.0) as usize
}

/// All rules, by Newton's iteration on P_n from above, divided by the roots already found.
const fn rules() -> [[Node; MOST_POINTS]; MOST_POINTS + 1] {
    let mut rules = [[(0.0, 0.0); MOST_POINTS]; MOST_POINTS + 1];
    let mut n = 1;
    while n <= MOST_POINTS {
        let mut roots = [0.0; MOST_POINTS];
        let mut k = 0;
        while k < n {
            // From 1, above all roots, the iteration falls on the next one; 20 steps are more than twice what it takes.
            let mut x = 1.0;
            let mut step = 0;
            while step < 20 {
                let (value, slope) = legendre(n, x);
                let mut poles = 0.0;
                let mut i = 0;
                while i < k {
                    poles += 1.0 / (x - roots[i]);
                    i += 1;
                }
                x -= value / (slope - value * poles);
                step += 1;
            }
            roots[k] = x;
            let (_, slope) = legendre(n, x);
            rules[n][k] = ((1.0 + x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope));
            k += 1;
        }
        n += 1;
    }
    rules
}

/// P_n(x) and its derivative.
const fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    let (mut slope_before, mut slope) = (0.0, 1.0);
    let mut k = 1;
    while k < n {
        let m = k as f64;
        let next = ((2.0 * m + 1.0) * x * value - m * before) / (m + 1.0);
        let slope_next = slope_before + (2.0 * m + 1.0) * value;
        (before, value) = (value, next);
        (slope_before, slope) = (slope, slope_next);
        k += 1;
    }
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_exact_to_its_degree_and_not_beyond() {
        for points in 1..=MOST_POINTS {
            let moment = |power: i32| -> f64 { gauss_legendre(points).iter().map(|&(x, w)| w * x.powi(power)).sum() };
            for power in 0..2 * points as i32 {
                assert!((moment(power) * f64::from(power + 1) - 1.0).abs() < 1e-14, "{points} points, x^{power}");
            }
        }
        let quartic: f64 = gauss_legendre(2).iter().map(|&(x, w)| w * x.powi(4)).sum();
        assert!((quartic - 0.2).abs() > 1e-3);
    }

    /// 1/(1 + (x − ½)²/d²) over the unit segment has its singularities exactly beside the middle.
    #[test]
    fn the_points_needed_reach_the_digits_asked_for() {
        for distance in [0.4_f64, 1.0, 3.0, 20.0, 1e4] {
            let exact = 2.0 * distance * (0.5 / distance).atan();
            let points = points_needed(1.0, distance, 25.0);
            if points <= MOST_POINTS {
                let value: f64 =
                    gauss_legendre(points).iter().map(|&(x, w)| w / (1.0 + ((x - 0.5) / distance).powi(2))).sum();
                assert!((value / exact - 1.0).abs() < 1e-10, "{points} points at {distance}");
            }
        }
        assert_eq!(points_needed(0.0, 1.0, 25.0), 1);
        assert!(points_needed(1.0, 0.0, 25.0) > MOST_POINTS);
    }
}
