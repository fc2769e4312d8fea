//! Numbers as a person reads them: with the digits that count.

use glam::DVec3;
use scene::Rgb;

/// A place with so many digits after the point, and no zero below zero.
pub(crate) fn place(at: DVec3, digits: usize, between: &str) -> String {
    let number = |value: f64| {
        let text = format!("{value:.digits$}");
        if text.trim_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
    };
    at.to_array().map(number).join(between)
}

/// Three channels, each with three digits that count.
pub(crate) fn colour(Rgb { x, y, z }: Rgb) -> String {
    format!("{:.3} {:.3} {:.3}", Number(x), Number(y), Number(z))
}

/// A number that is written with as many digits that count as its precision says.
pub(crate) struct Number(pub f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(3) as i32;
        let whole = if self.0 == 0.0 { 1 } else { self.0.abs().log10().floor() as i32 + 1 };
        if (-2..=7).contains(&whole) {
            write!(f, "{:.*}", (digits - whole).max(0) as usize, self.0)
        } else {
            write!(f, "{:.*e}", (digits - 1).max(0) as usize, self.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_have_no_negative_zero() {
        assert_eq!(place(DVec3::new(-0.0004, 1.0, -1.25), 3, ","), "0.000,1.000,-1.250");
    }

    #[test]
    fn numbers_have_the_digits_that_count() {
        let written =
            [0.0, 1.0, 0.5, 12.345, 312.6, 45_678.0, 1e-7, 1e12].map(|number| format!("{:.3}", Number(number)));
        assert_eq!(written, ["0.00", "1.00", "0.500", "12.3", "313", "45678", "1.00e-7", "1.00e12"]);
    }
}
