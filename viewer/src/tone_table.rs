//! Exposure, tone curve and sRGB by a table: what takes two transcendental functions a channel takes one load.

use scene::encode_srgb;

/// The darkest light that is told from black, and the brightest that is told from white: an eighth of an 8-bit step is at
/// the one, and any tone curve has come to its end at the other.
const DARKEST: f32 = 1.0 / 32768.0;
const BRIGHTEST: f32 = 16.0;

/// Bits of a number's fraction that are told apart: in steps of a thousandth a value is off by a twentieth of an 8-bit step
/// at most, and the table stays within the nearest cache.
const FRACTION_BITS: u32 = 10;

/// How far a number's bits are shifted to become a place in the table.
const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - FRACTION_BITS;

/// What a display shows of exposed light, by its exponent and the first bits of its fraction.
pub(crate) struct ToneTable(Vec<u8>);

impl ToneTable {
    /// The table of a tone curve, from linear to display-linear.
    pub fn new(curve: impl Fn(f32) -> f32) -> Self {
        let places = (DARKEST.to_bits() >> SHIFT)..=(BRIGHTEST.to_bits() >> SHIFT);
        let middle = |place: u32| f32::from_bits((place << SHIFT) + (1 << (SHIFT - 1)));
        Self(places.map(|place| (encode_srgb(curve(middle(place))) * 255.0 + 0.5) as u8).collect())
    }

    /// The 8-bit sRGB value of exposed light; what is no number is black.
    pub fn shown(&self, light: f32) -> u8 {
        self.at(Self::place(light))
    }

    /// Where exposed light stands in every table.
    #[inline(always)]
    #[expect(clippy::manual_clamp, reason = "of a number and no number, max takes the number")]
    pub fn place(light: f32) -> u32 {
        (light.max(DARKEST).min(BRIGHTEST).to_bits() >> SHIFT) - (DARKEST.to_bits() >> SHIFT)
    }

    /// The 8-bit sRGB value of a place.
    #[inline(always)]
    pub fn at(&self, place: u32) -> u8 {
        self.0[place as usize]
    }
}

#[cfg(test)]
mod tests {
    use scene::ToneCurve;

    use super::*;

    #[test]
    fn what_is_no_light_is_black_and_too_much_is_white() {
        let tables = ToneCurve::ALL.map(|curve| ToneTable::new(|light| curve.apply(light)));
        for dark in [0.0, -0.0, -1.0, f32::NEG_INFINITY, f32::NAN, f32::MIN_POSITIVE, 1e-30] {
            assert!(tables.iter().all(|table| table.shown(dark) == 0), "{dark}");
        }
        for bright in [16.0, 1e9, f32::MAX, f32::INFINITY] {
            assert!(tables.iter().all(|table| table.shown(bright) == 255), "{bright}");
        }
    }

    #[test]
    fn the_table_is_the_curve_within_a_step_and_seldom_off() {
        for curve in ToneCurve::ALL.map(|curve| move |light: f32| curve.apply(light)) {
            let table = ToneTable::new(curve);
            let lights: Vec<f32> = (0..100_000).map(|i| 20.0 * (-i as f32 * 2e-4).exp()).collect();
            let exact = |light: f32| encode_srgb(curve(light)) * 255.0;
            assert!(lights.iter().all(|&light| (f32::from(table.shown(light)) - exact(light)).abs() < 0.6));
            let off = lights.iter().filter(|&&light| table.shown(light) != (exact(light) + 0.5) as u8).count();
            assert!(off < lights.len() / 20, "{off}");
        }
    }
}
