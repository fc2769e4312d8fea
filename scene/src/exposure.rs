//! From radiance to what a display shows: exposure, tone curve, sRGB encoding.

use glam::Vec3;

/// How bright a picture is made: radiance is multiplied by 2^EV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure value; +1 doubles the brightness.
    pub ev: f32,
}

/// Where the tone curve leaves the straight line: below it colours are reproduced exactly, above it highlights
/// are compressed instead of clipped. Higher keeps more contrast, lower keeps more of a lamp's surroundings.
const SHOULDER: f32 = 0.6;

/// Where the filmic curve has long passed 1.
const FILMIC_END: f32 = 1e3;

/// Mean log-luminance that automatic exposure places a picture at: the "18 % grey" of photography.
pub const MIDDLE_GREY: f64 = 0.18;

impl Exposure {
    /// The exposure that brings the logarithmic mean of the given luminances (W·sr⁻¹·m⁻²) to middle grey.
    /// Black samples count as the darkest 1e-4 of the brightest. EV 0 when there is no light at all.
    pub fn metered(luminances: impl Iterator<Item = f64> + Clone) -> Self {
        let brightest = luminances.clone().fold(0.0, f64::max);
        if brightest <= 0.0 {
            return Self { ev: 0.0 };
        }
        let (sum, count) =
            luminances.fold((0.0, 0u64), |(sum, count), l| (sum + l.max(brightest * 1e-4).ln(), count + 1));
        let mean = (sum / count as f64).exp();
        Self { ev: (MIDDLE_GREY / mean).log2() as f32 }
    }

    /// The factor 2^EV.
    pub fn factor(self) -> f32 {
        self.ev.exp2()
    }
}

/// How exposed light is brought into what a display shows, linear to display-linear 0..=1. The shader `frame.wgsl` says the
/// same, and numbers the curves in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Identity up to a shoulder, then an exponential approach to 1 with a continuous slope.
    #[default]
    Shoulder,
    /// Identity, clipped at 1: for measuring.
    Linear,
    /// As film has it, with a toe and a shoulder: the fit of K. Narkowicz, "ACES Filmic Tone Mapping Curve" (2015).
    Filmic,
}

impl ToneCurve {
    /// All curves, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Shoulder, Self::Linear, Self::Filmic];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shoulder => "shoulder",
            Self::Linear => "linear",
            Self::Filmic => "filmic",
        }
    }

    /// What a display shows of an exposed value.
    pub fn apply(self, linear: f32) -> f32 {
        let x = linear.max(0.0);
        match self {
            Self::Shoulder if x <= SHOULDER => x,
            Self::Shoulder => {
                let room = 1.0 - SHOULDER;
                SHOULDER + room * (1.0 - (-(x - SHOULDER) / room).exp())
            }
            Self::Linear => x.min(1.0),
            // Beyond the bound the fit is past 1 anyway, and the squares of huge numbers are no numbers.
            Self::Filmic => {
                let x = x.min(FILMIC_END);
                (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
            }
        }
    }
}

/// What a display shows of radiance, before its transfer function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    factor: f32,
    curve: ToneCurve,
}

impl Display {
    /// A display with an exposure and a tone curve.
    pub fn new(exposure: Exposure, curve: ToneCurve) -> Self {
        Self { factor: exposure.factor(), curve }
    }

    /// The light that is shown of a radiance, W·sr⁻¹·m⁻²; each channel in 0..=1.
    pub fn light(self, radiance: Vec3) -> Vec3 {
        (radiance * self.factor).map(|channel| self.curve.apply(channel))
    }
}

/// An 8-bit sRGB value as a linear one, 0..=1: the inverse of [`encode_srgb`].
pub fn decode_srgb(encoded: u8) -> f32 {
    let encoded = f32::from(encoded) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB transfer function (IEC 61966-2-1), display-linear 0..=1 to encoded 0..=1.
pub fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_curves_are_monotone_from_zero_to_one() {
        for curve in ToneCurve::ALL {
            let values: Vec<f32> = (0..1000).map(|i| curve.apply(i as f32 * 0.01)).collect();
            assert!(values.windows(2).all(|pair| pair[0] <= pair[1]), "{curve:?}");
            assert!(values.iter().all(|&value| (0.0..=1.0).contains(&value)), "{curve:?}");
            assert_eq!([-1.0, 0.0].map(|dark| curve.apply(dark)), [0.0; 2]);
            assert!([1e30, f32::MAX, f32::INFINITY].iter().all(|&bright| curve.apply(bright) > 0.999), "{curve:?}");
        }
    }

    #[test]
    fn a_display_shows_what_its_exposure_and_its_curve_make_of_radiance() {
        let light = |curve| Display::new(Exposure { ev: 1.0 }, curve).light(Vec3::new(0.1, 0.4, -1.0));
        assert_eq!(light(ToneCurve::Linear), Vec3::new(0.2, 0.8, 0.0));
        assert_eq!(light(ToneCurve::Filmic).y, ToneCurve::Filmic.apply(0.8));
    }

    #[test]
    fn tone_curves_are_what_they_are_named_for() {
        assert_eq!([0.1, 0.5, 0.9, 1.1].map(|x| ToneCurve::Linear.apply(x)), [0.1, 0.5, 0.9, 1.0]);
        assert_eq!([0.1, 0.5].map(|x| ToneCurve::Shoulder.apply(x)), [0.1, 0.5]);
        // (2.51 + 0.03) / (2.43 + 0.59 + 0.14); and a toe: the dark is darker.
        assert!((ToneCurve::Filmic.apply(1.0) - 0.803_797_5).abs() < 1e-6);
        assert!(ToneCurve::Filmic.apply(0.01) < 0.005);
    }

    #[test]
    fn metering_brings_an_even_picture_to_middle_grey() {
        let exposure = Exposure::metered([3.0; 16].into_iter());
        assert!((3.0 * exposure.factor() - 0.18).abs() < 1e-6);
        assert_eq!(Exposure::metered([0.0; 4].into_iter()).ev, 0.0);
        assert_eq!(Exposure::metered(std::iter::empty()).ev, 0.0);
    }
}
