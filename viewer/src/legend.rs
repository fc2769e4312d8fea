//! The scale of false colours, drawn into a picture.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::{FalseColorScale, Picture};

/// Letters are as high as to be read, and as wide as that makes them.
const LETTER: RasterHeight = RasterHeight::Size16;
const LETTER_HEIGHT: usize = LETTER.val();
const LETTER_WIDTH: usize = get_raster_width(FontWeight::Regular, LETTER);

/// Letters of the longest number.
const DIGITS: usize = 5;

/// Pixels between what stands side by side, and between the legend and the picture's border.
const GAP: usize = 6;
const MARGIN: usize = 16;

/// Width of the ramp, pixels, and its greatest height.
const RAMP_WIDTH: usize = 18;
const RAMP_HEIGHT: usize = 320;

/// Width of the whole, pixels.
const WIDTH: usize = 4 * GAP + 2 * DIGITS * LETTER_WIDTH + RAMP_WIDTH;

/// How much of the picture shines through the legend's ground.
const TRANSPARENCY: f32 = 0.25;

const WHITE: [u8; 3] = [255; 3];
const BLACK: [u8; 3] = [0; 3];

impl Picture {
    /// Draws the scale of false colours into the lower right corner: the illuminance of its lines, lux, and their irradiance,
    /// W·m⁻². A picture that would lose more than a third of its width to it stays as it is.
    pub fn add_legend(&mut self) {
        let (width, height) = (self.width as usize, self.height as usize);
        let around = 3 * GAP + LETTER_HEIGHT + LETTER_HEIGHT / 2;
        let ramp = RAMP_HEIGHT.min(height.saturating_sub(2 * MARGIN + around));
        if width < 3 * WIDTH || ramp < 4 * LETTER_HEIGHT {
            return;
        }
        let (left, top) = (width - MARGIN - WIDTH, height - MARGIN - ramp - around);
        for y in top..height - MARGIN {
            for x in left..left + WIDTH {
                self.blend([x, y], BLACK, 1.0 - TRANSPARENCY);
            }
        }
        let (ramp_left, ramp_top) = (left + 2 * GAP + DIGITS * LETTER_WIDTH, top + 2 * GAP + LETTER_HEIGHT);
        let right = ramp_left + RAMP_WIDTH + GAP;
        self.write("lx", [ramp_left - GAP, top + GAP], true);
        self.write("W/m²", [right, top + GAP], false);
        for y in 0..ramp {
            let colour = FalseColorScale::colour(1.0 - (y as f64 + 0.5) / ramp as f64);
            (0..RAMP_WIDTH).for_each(|x| self.blend([ramp_left + x, ramp_top + y], colour, 1.0));
        }
        let mut last = usize::MAX;
        for line in FalseColorScale::new(self.exposure).isolines() {
            let y = ((1.0 - line.place) * (ramp - 1) as f64).round() as usize;
            // Numbers that would overlap are left out.
            if last - y < LETTER_HEIGHT {
                continue;
            }
            last = y;
            let tick = if line.place < 0.4 { WHITE } else { BLACK };
            (0..RAMP_WIDTH).for_each(|x| self.blend([ramp_left + x, ramp_top + y], tick, 1.0));
            let text_top = ramp_top + y - LETTER_HEIGHT / 2;
            self.write(&round_number(line.lux), [ramp_left - GAP, text_top], true);
            self.write(&number(line.irradiance), [right, text_top], false);
        }
    }

    /// Writes a line from its left upper corner on, or up to its right one.
    fn write(&mut self, text: &str, [x, y]: [usize; 2], ends_there: bool) {
        let letters = text.chars().filter_map(|letter| get_raster(letter, FontWeight::Regular, LETTER));
        let first = if ends_there { x - LETTER_WIDTH * letters.clone().count() } else { x };
        for (i, letter) in letters.enumerate() {
            for (row, pixels) in letter.rows().enumerate() {
                for (column, &ink) in pixels.iter().enumerate() {
                    let place = [first + i * LETTER_WIDTH + column, y + row];
                    self.blend(place, WHITE, f32::from(ink) / 255.0);
                }
            }
        }
    }

    fn blend(&mut self, [x, y]: [usize; 2], colour: [u8; 3], part: f32) {
        let pixel = &mut self.rgb[y * self.width as usize + x];
        for (channel, colour) in pixel.iter_mut().zip(colour) {
            *channel = (f32::from(*channel) * (1.0 - part) + f32::from(colour) * part).round() as u8;
        }
    }
}

/// A number in as many letters as there is room for, with the digits that count.
fn number(value: f64) -> String {
    let places = 2 - value.log10().floor() as i32;
    match places {
        // 0.00279 is the least that fits, 99999 the most.
        -2..=4 => format!("{value:.*}", places.clamp(0, 3) as usize),
        _ => format!("{value:.0e}"),
    }
}

/// A number of few digits, without the noughts after them.
fn round_number(value: f64) -> String {
    let text = number(value);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use scene::Exposure;

    use super::*;

    fn picture(width: u32, height: u32, ev: f32) -> Picture {
        let rgb = vec![[100, 0, 200]; width as usize * height as usize];
        Picture { width, height, radiance: Vec::new(), rgb, background: 0, exposure: Exposure { ev } }
    }

    #[test]
    fn a_small_picture_stays_as_it_is() {
        for (width, height) in [(0, 0), (1, 1), (100, 1000), (1000, 100)] {
            let mut small = picture(width, height, 0.0);
            small.add_legend();
            assert_eq!(small, picture(width, height, 0.0));
        }
    }

    #[test]
    fn the_legend_fits_at_any_size_and_exposure_and_shows_the_whole_ramp() {
        for (width, height) in [(340, 160), (640, 480), (1920, 1080)] {
            for ev in [-60.0, -3.3, 0.0, 7.0, 60.0] {
                let mut drawn = picture(width, height, ev);
                drawn.add_legend();
                for end in [0.01, 0.99] {
                    let colour = FalseColorScale::colour(end);
                    let near = |pixel: &&[u8; 3]| pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 6);
                    assert!(drawn.rgb.iter().filter(near).count() >= RAMP_WIDTH, "{width}x{height} at {ev}: {end}");
                }
                assert_eq!(drawn.rgb[0], [100, 0, 200]);
            }
        }
    }

    #[test]
    fn numbers_have_the_digits_that_count_and_fit() {
        let written = [50_000.0, 2000.0, 500.0, 2.793, 0.5, 0.279, 0.02, 0.0279, 1e7, 2e-9].map(number);
        assert_eq!(written, ["50000", "2000", "500", "2.79", "0.500", "0.279", "0.020", "0.028", "1e7", "2e-9"]);
        assert_eq!([500.0, 50.0, 5.0, 0.5, 0.02, 2e-9].map(round_number), ["500", "50", "5", "0.5", "0.02", "2e-9"]);
        for exponent in -12..12 {
            for digit in [1.0, 2.0, 5.0, 5.59] {
                let text = number(digit * 10f64.powi(exponent));
                assert!(text.chars().count() <= DIGITS, "{text}");
            }
        }
    }
}
