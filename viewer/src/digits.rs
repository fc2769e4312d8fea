//! Numbers as a person reads them: with the digits that count.

use scene::Rgb;

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
    fn numbers_have_the_digits_that_count() {
        let written =
            [0.0, 1.0, 0.5, 12.345, 312.6, 45_678.0, 1e-7, 1e12].map(|number| format!("{:.3}", Number(number)));
        assert_eq!(written, ["0.00", "1.00", "0.500", "12.3", "313", "45678", "1.00e-7", "1.00e12"]);
    }
}
