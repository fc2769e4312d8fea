//! The quadratic over one triangle (Hardt & Teller 1996, section 2.2, equation 1).
//!
//! In barycentrics (s, t), where vertex 0 is (0, 0), vertex 1 is (1, 0) and vertex 2 is (0, 1):
//! R(s, t) = A s² + 2B st + 2C s + D t² + 2E t + F through six samples. The paper's printed inverse has r5 where
//! E needs 2 r5; the coefficients here are the ones that interpolate.

use crate::Rgb;

/// Barycentrics (s, t) of the six samples r0 … r5: the vertices are r0, r2 and r4, the midpoints between them
/// r1, r3 and r5.
pub const SAMPLE_BARYCENTRICS: [(f64, f64); 6] =
    [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 1.0), (0.0, 0.5)];

/// The coefficients (A, 2B, 2C, D, 2E, F), W·m⁻² per colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpolant(pub [Rgb; 6]);

impl Interpolant {
    /// The quadratic through six samples in the order of [`SAMPLE_BARYCENTRICS`].
    pub fn through([r0, r1, r2, r3, r4, r5]: [Rgb; 6]) -> Self {
        Self([
            2.0 * r0 - 4.0 * r1 + 2.0 * r2,
            4.0 * (r0 - r1 + r3 - r5),
            -3.0 * r0 + 4.0 * r1 - r2,
            2.0 * r0 + 2.0 * r4 - 4.0 * r5,
            -3.0 * r0 - r4 + 4.0 * r5,
            r0,
        ])
    }

    /// The value at barycentrics (s, t), clamped at 0 in each channel.
    pub fn evaluate(&self, s: f64, t: f64) -> Rgb {
        let [a, b2, c2, d, e2, f] = self.0;
        ((a * s + b2 * t + c2) * s + (d * t + e2) * t + f).max(Rgb::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_six_samples_are_met_and_quadratics_reproduced() {
        let quadratic =
            |s: f64, t: f64| Rgb::new(5.0 + s - 2.0 * t + 3.0 * s * t, 4.0 * s * s + t * t, 2.0 + s * s - s * t);
        let interpolant = Interpolant::through(SAMPLE_BARYCENTRICS.map(|(s, t)| quadratic(s, t)));
        for (s, t) in SAMPLE_BARYCENTRICS.into_iter().chain([(0.2, 0.3), (1.0 / 3.0, 1.0 / 3.0), (0.05, 0.9)]) {
            assert!((interpolant.evaluate(s, t) - quadratic(s, t)).length() < 1e-14);
        }
    }

    #[test]
    fn undershoot_is_clamped() {
        let dip = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].map(Rgb::splat);
        assert_eq!(Interpolant::through(dip).evaluate(0.75, 0.1), Rgb::ZERO);
    }
}
