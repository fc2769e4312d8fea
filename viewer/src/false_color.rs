//! Illuminance in false colours: the ramp, the lines on it, and the scale that tells both.

use glam::{Vec2, Vec3};
use scene::{Exposure, LUMINOUS_EFFICACY, encode_srgb};

use crate::{
    frame::FrameUniform,
    records::{Corners, TriangleRecord},
    twin::{barycentrics, light},
};

/// Stops from one end of the ramp to the other: what lies between a dark corner and a bright wall.
const STOPS: f32 = 10.0;

/// Luminance that is in the middle of the ramp, once exposed: middle grey.
const MIDDLE: f32 = 0.18;

/// The colour map "inferno" of matplotlib at ten places, display-linear.
const RAMP: [Vec3; 10] = [
    Vec3::new(0.0000, 0.0000, 0.0012),
    Vec3::new(0.0110, 0.0037, 0.0545),
    Vec3::new(0.0704, 0.0037, 0.1470),
    Vec3::new(0.1878, 0.0116, 0.1529),
    Vec3::new(0.3763, 0.0252, 0.1170),
    Vec3::new(0.6240, 0.0578, 0.0612),
    Vec3::new(0.8469, 0.1413, 0.0185),
    Vec3::new(0.9647, 0.3231, 0.0018),
    Vec3::new(0.9301, 0.6308, 0.0452),
    Vec3::new(0.9734, 1.0000, 0.3712),
];

/// What the colours of [`Mode::FalseColor`](crate::Mode::FalseColor) mean at an exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FalseColorScale {
    exposure: Exposure,
}

/// A line of equal illuminance, and its place on the scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isoline {
    /// From the dark end of the scale, 0, to the bright one, 1.
    pub place: f64,
    /// Illuminance, lux: 1, 2 or 5 times a power of ten.
    pub lux: f64,
    /// Irradiance of white light that is as bright, W·m⁻².
    pub irradiance: f64,
}

impl FalseColorScale {
    /// The scale of pictures that have this exposure.
    pub fn new(exposure: Exposure) -> Self {
        Self { exposure }
    }

    /// The lines of the picture that the scale has room for, from the dark end.
    pub fn isolines(&self) -> Vec<Isoline> {
        let middle = LUX * f64::from(MIDDLE) / f64::from(self.exposure.ev).exp2();
        let reach = (f64::from(STOPS) / 2.0).exp2();
        let decades = (middle / reach).log10().floor() as i32..=(middle * reach).log10().floor() as i32;
        let values = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(decade)));
        let line = |lux: f64| {
            let place = (lux / middle).log2() / f64::from(STOPS) + 0.5;
            Isoline { place, lux, irradiance: lux / LUMINOUS_EFFICACY }
        };
        values.map(line).filter(|line| (0.0..=1.0).contains(&line.place)).collect()
    }

    /// The colour of a place on the scale, as a display shows it.
    pub fn colour(place: f64) -> [u8; 3] {
        ramp(place as f32).to_array().map(|channel| (encode_srgb(channel) * 255.0 + 0.5) as u8)
    }
}

/// Lux by the luminance of a white surface, W·sr⁻¹·m⁻².
const LUX: f64 = std::f64::consts::PI * LUMINOUS_EFFICACY;

/// The ramp, display-linear, from 0 to 1.
fn ramp(place: f32) -> Vec3 {
    let part = place.clamp(0.0, 1.0) * 9.0;
    let index = (part as usize).min(8);
    RAMP[index].lerp(RAMP[index + 1], part - index as f32)
}

/// The colour of a place on a triangle, display-linear; the shader's `false_color`, operation for operation.
pub(crate) fn false_color(
    frame: &FrameUniform,
    record: &TriangleRecord,
    corners: &Corners,
    [s, t]: [f32; 2],
    place: Vec2,
) -> Vec3 {
    let luminance = |[s, t]: [f32; 2]| light(record, s, t).dot(Vec3::new(0.2126, 0.7152, 0.0722)).max(1e-30);
    let here = luminance([s, t]);
    let on_ramp = (here * frame.exposure / MIDDLE).log2() / STOPS + 0.5;
    // Change of the logarithm from pixel to pixel.
    let change = [Vec2::X, Vec2::Y].map(|step| (luminance(barycentrics(frame, corners, place + step)) / here).ln());
    let change = Vec2::from(change).length();
    let lux = LUX as f32 * here;
    let digits = lux / 10f32.powf(lux.log10().floor());
    let away = [1.0, 2.0, 5.0, 10.0].map(|line| (digits / line).ln().abs());
    let pixels = away.into_iter().fold(f32::INFINITY, f32::min) / change.max(1e-6);
    // Where lines would be denser than pixels there are none.
    let coverage = (1.1 - pixels).clamp(0.0, 1.0) * (2.0 - change / 0.35).clamp(0.0, 1.0);
    let line = if on_ramp < 0.4 { Vec3::ONE } else { Vec3::ZERO };
    ramp(on_ramp).lerp(line, 0.7 * coverage)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use glam::DVec3;
    use scene::Camera;

    use super::*;
    use crate::{Frame, Mode};

    /// A picture of a plane a metre away, and of a triangle on it that covers it, lit from 0 at the left border of the
    /// picture to `right` at its right one: luminance of white.
    fn lit(right: f32) -> (FrameUniform, TriangleRecord, Corners) {
        let camera = Camera { eye: DVec3::ZERO, target: DVec3::X, up: DVec3::Z, vertical_fov: 1.0 };
        let frame = Frame {
            camera,
            width: 400,
            height: 100,
            mode: Mode::FalseColor,
            exposure: None,
            curve: Default::default(),
        };
        let uniform = FrameUniform::of(&frame, Exposure { ev: 0.0 });
        let reach = 200.0 / uniform.focal;
        // s grows to the right, along -y, and is 0 and 1/2 at the borders.
        let corners = [[1.0, reach, -9.0], [1.0, -3.0 * reach, -9.0], [1.0, reach, 9.0]];
        (uniform, TriangleRecord { c2: [2.0 * right; 3], ..TriangleRecord::zeroed() }, corners)
    }

    fn colour_at(right: f32, x: f32) -> Vec3 {
        let (frame, record, corners) = lit(right);
        let place = Vec2::new(x, 50.5);
        false_color(&frame, &record, &corners, barycentrics(&frame, &corners, place), place)
    }

    #[test]
    fn colours_climb_with_illuminance_through_ten_stops() {
        assert_eq!([0.0, 1.0, -3.0, 3.0, f32::NAN].map(ramp)[..4], [RAMP[0], RAMP[9], RAMP[0], RAMP[9]]);
        let brightness: Vec<f32> = (0..=20).map(|i| ramp(i as f32 / 20.0).element_sum()).collect();
        assert!(brightness.windows(2).all(|pair| pair[0] < pair[1]), "{brightness:?}");
        // Without light at all, and with five stops more and less than middle grey, between lines.
        assert_eq!(colour_at(0.0, 200.5), RAMP[0]);
        assert_eq!(colour_at(2.0 * MIDDLE * 40.0, 200.0), RAMP[9]);
    }

    /// Lines are where the illuminance is 1, 2 or 5 times a power of ten, and nowhere else.
    #[test]
    fn lines_are_where_the_numbers_are_round() {
        let right = 1.0;
        let plain = |x: f32| ramp((right * x / 400.0 / MIDDLE).log2() / STOPS + 0.5);
        let lines: Vec<f32> = [50.0, 100.0, 200.0, 500.0].map(|lux| lux / LUX as f32 / right * 400.0).to_vec();
        assert!(lines.iter().all(|&x| x > 30.0 && x < 400.0), "{lines:?}");
        for pixel in 25..399 {
            let x = pixel as f32 + 0.5;
            let nearest = lines.iter().map(|line| (line - x).abs()).fold(f32::INFINITY, f32::min);
            let drawn = (colour_at(right, x) - plain(x)).length();
            assert!(nearest < 1.3 || drawn < 1e-3, "{x}: {drawn}");
            assert!(nearest > 0.6 || drawn > 0.02, "{x}: {drawn}");
        }
    }

    #[test]
    fn the_scale_says_what_the_lines_are() {
        let scale = FalseColorScale::new(Exposure { ev: 0.0 });
        let lines = scale.isolines();
        assert_eq!(lines.iter().map(|line| line.lux).collect::<Vec<_>>()[..4], [5.0, 10.0, 20.0, 50.0]);
        assert!(lines.windows(2).all(|pair| pair[0].place < pair[1].place));
        // Ten stops are three decades, of three lines each.
        assert!((9..=10).contains(&lines.len()), "{}", lines.len());
        for line in &lines {
            assert!((line.irradiance * LUMINOUS_EFFICACY - line.lux).abs() < 1e-9 * line.lux);
            let exposed = line.lux / LUX / f64::from(MIDDLE);
            assert!((exposed.log2() / 10.0 + 0.5 - line.place).abs() < 1e-6);
        }
        // A brighter picture is of less light.
        let darker = FalseColorScale::new(Exposure { ev: 3.0 }).isolines();
        assert!(darker[0].lux < lines[0].lux / 4.0);
        for ev in [-64.0, 64.0] {
            let lines = FalseColorScale::new(Exposure { ev }).isolines();
            assert!(lines.len() >= 9 && lines.iter().all(|line| line.lux > 0.0 && line.lux.is_finite()), "{lines:?}");
        }
    }
}
