//! The general skies of the CIE: the radiance of a sky from how cloudy it is and where the sun stands.
//!
//! ISO 15469:2004 (CIE S 011/E:2003), "Spatial distribution of daylight, CIE standard general sky": fifteen pairs of a
//! gradation from zenith to horizon and an indicatrix about the sun, and as a sixteenth sky the traditional overcast one of
//! Moon and Spencer 1942.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use serde::{Deserialize, Serialize};

/// How many skies there are; they are numbered from 1.
pub const CIE_SKIES: u8 = 16;

/// Parameters a, b of the gradation and c, d, e of the indicatrix, of skies 1 to 15: the standard's table 1.
const PARAMETERS: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.80, 0.0, -1.0, 0.0],
    [1.1, -0.80, 2.0, -1.5, 0.15],
    [0.0, -1.00, 0.0, -1.0, 0.0],
    [0.0, -1.00, 2.0, -1.5, 0.15],
    [0.0, -1.00, 5.0, -2.5, 0.30],
    [0.0, -1.00, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// A sky of the standard. Below the horizon it is black.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CieSky {
    /// Its number, 1..=16: 1 is overcast, 5 uniform, 12 clear, 16 traditionally overcast.
    kind: u8,
    /// Where the sun stands: radians clockwise from north, and above the horizon.
    sun: [f64; 2],
    /// Irradiance from the sun itself on a surface that faces it, W·m⁻².
    sun_irradiance: f64,
}

impl CieSky {
    /// Where the sun stands if nothing is said: in the south-east, half-way up. Radians clockwise from north, and above the
    /// horizon.
    pub const DEFAULT_SUN: [f64; 2] = [3.0 * FRAC_PI_4, FRAC_PI_4];

    /// The sky of a number, 1..=16, with the sun at an azimuth (radians clockwise from north) and an altitude (radians over the
    /// horizon, 0..=π/2), which by itself sends so much to a surface that faces it, W·m⁻². None if a number is out of its
    /// range.
    pub fn new(kind: u8, [azimuth, altitude]: [f64; 2], sun_irradiance: f64) -> Option<Self> {
        let sky = Self { kind, sun: [azimuth, altitude], sun_irradiance };
        sky.is_valid().then_some(sky)
    }

    /// Whether every number is in its range; one that was read from a file may not be.
    pub(crate) fn is_valid(&self) -> bool {
        let [azimuth, altitude] = self.sun;
        (1..=CIE_SKIES).contains(&self.kind)
            && azimuth.is_finite()
            && (0.0..=FRAC_PI_2).contains(&altitude)
            && (0.0..f64::INFINITY).contains(&self.sun_irradiance)
    }

    /// Its number, 1..=16.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// Where the sun stands: radians clockwise from north, and above the horizon.
    pub fn sun(&self) -> [f64; 2] {
        self.sun
    }

    /// Irradiance from the sun itself on a surface that faces it, W·m⁻².
    pub fn sun_irradiance(&self) -> f64 {
        self.sun_irradiance
    }

    /// Radiance of the sky at an azimuth (radians clockwise from north) and an altitude (radians over the horizon), as a
    /// multiple of that of the zenith.
    pub fn relative_radiance(&self, azimuth: f64, altitude: f64) -> f64 {
        if altitude <= 0.0 {
            return 0.0;
        }
        let height = altitude.sin();
        let Some([a, b, c, d, e]) = PARAMETERS.get(usize::from(self.kind) - 1) else {
            return (1.0 + 2.0 * height) / 3.0;
        };
        let [sun_azimuth, sun_altitude] = self.sun;
        let gradation = |height: f64| 1.0 + a * (b / height).exp();
        let indicatrix = |cosine: f64| {
            let angle = cosine.clamp(-1.0, 1.0).acos();
            1.0 + c * ((d * angle).exp() - (d * FRAC_PI_2).exp()) + e * cosine * cosine
        };
        let to_sun = height * sun_altitude.sin() + altitude.cos() * sun_altitude.cos() * (azimuth - sun_azimuth).cos();
        gradation(height) * indicatrix(to_sun) / (gradation(1.0) * indicatrix(sun_altitude.sin()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::PI;

    use super::*;

    fn sky(kind: u8) -> CieSky {
        CieSky::new(kind, [0.7, 0.6], 0.0).unwrap()
    }

    #[test]
    fn what_is_out_of_range_is_no_sky() {
        for (kind, sun, irradiance) in [
            (0, [0.0, 0.5], 0.0),
            (17, [0.0, 0.5], 0.0),
            (1, [f64::NAN, 0.5], 0.0),
            (1, [0.0, -0.1], 0.0),
            (1, [0.0, 1.6], 0.0),
            (1, [0.0, 0.5], -1.0),
            (1, [0.0, 0.5], f64::INFINITY),
        ] {
            assert_eq!(CieSky::new(kind, sun, irradiance), None);
        }
    }

    #[test]
    fn the_zenith_is_one_the_ground_black_and_all_is_finite() {
        for kind in 1..=CIE_SKIES {
            let sky = sky(kind);
            assert!((sky.relative_radiance(1.0, FRAC_PI_2) - 1.0).abs() < 1e-12, "{kind}");
            assert_eq!(sky.relative_radiance(1.0, -0.1), 0.0);
            for i in 1..=90 {
                for j in 0..36 {
                    let radiance = sky.relative_radiance(f64::from(j) * 0.1745, f64::from(i) * 0.01745);
                    assert!(radiance.is_finite() && radiance > 0.0, "{kind}: {radiance}");
                }
            }
        }
    }

    /// Values by hand: the horizon of overcast skies, and the sun's own place in a clear one.
    #[test]
    fn skies_are_those_of_the_standard() {
        assert!((sky(16).relative_radiance(0.0, 1e-9) - 1.0 / 3.0).abs() < 1e-8);
        assert!((sky(1).relative_radiance(0.0, 1e-9) - 1.0 / (1.0 + 4.0 * (-0.7f64).exp())).abs() < 1e-8);
        assert!((sky(5).relative_radiance(2.0, 0.3) - 1.0).abs() < 1e-12);
        // Without an indicatrix the sun does not matter, with one the sky is brightest around it.
        assert_eq!(sky(3).relative_radiance(0.0, 0.4), sky(3).relative_radiance(3.0, 0.4));
        let clear = sky(12);
        let [azimuth, altitude] = clear.sun();
        let at_sun = clear.relative_radiance(azimuth, altitude);
        let gradation = |height: f64| 1.0 - (-0.32 / height).exp();
        let indicatrix = |angle: f64| {
            1.0 + 10.0 * ((-3.0 * angle).exp() - (-3.0 * FRAC_PI_2).exp()) + 0.45 * angle.cos() * angle.cos()
        };
        let expected =
            gradation(altitude.sin()) * indicatrix(0.0) / (gradation(1.0) * indicatrix(FRAC_PI_2 - altitude));
        assert!((at_sun / expected - 1.0).abs() < 1e-12);
        assert!(at_sun > clear.relative_radiance(azimuth + 0.5, altitude));
        assert!(at_sun > clear.relative_radiance(azimuth + PI, altitude));
    }
}
