//! From radiance to what a display shows: exposure, tone curve, sRGB encoding.

/// How bright a picture is made: radiance is multiplied by 2^EV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure value; +1 doubles the brightness.
    pub ev: f32,
}

/// Where the tone curve leaves the straight line: below it colours are reproduced exactly, above it highlights
/// are compressed instead of clipped. Higher keeps more contrast, lower keeps more of a lamp's surroundings.
const SHOULDER: f32 = 0.6;

/// Mean log-luminance that automatic exposure places a picture at: the "18 % grey" of photography.
const MIDDLE_GREY: f64 = 0.18;

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

/// The tone curve, linear to display-linear: identity up to a shoulder, then an exponential approach to 1 with a
/// continuous slope. The shader `tone_map_pass.wgsl` says the same.
pub fn tone_curve(linear: f32) -> f32 {
    let room = 1.0 - SHOULDER;
    if linear <= SHOULDER { linear.max(0.0) } else { SHOULDER + room * (1.0 - (-(linear - SHOULDER) / room).exp()) }
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
    fn tone_curve_is_monotone_and_stays_below_one() {
        let values: Vec<f32> = (0..1000).map(|i| tone_curve(i as f32 * 0.01)).collect();
        assert!(values.windows(2).all(|pair| pair[0] <= pair[1]));
        assert!(values.iter().all(|&value| (0.0..=1.0).contains(&value)));
        assert_eq!(tone_curve(-1.0), 0.0);
    }

    #[test]
    fn metering_brings_an_even_picture_to_middle_grey() {
        let exposure = Exposure::metered([3.0; 16].into_iter());
        assert!((3.0 * exposure.factor() - 0.18).abs() < 1e-6);
        assert_eq!(Exposure::metered([0.0; 4].into_iter()).ev, 0.0);
        assert_eq!(Exposure::metered(std::iter::empty()).ev, 0.0);
    }
}
