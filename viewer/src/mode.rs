//! What a picture shows.

use std::{fmt, str::FromStr};

/// What a picture shows of a bake. Back sides are black in every mode. Past all surfaces pictures of light
/// ([`Mode::is_light`]) show the scene's environment; without one, and in other modes, the background is black.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The light: quadratic interpolants, evaluated at every pixel.
    #[default]
    Shaded,
    /// The light as polygon hardware would show it: irradiance linear between a triangle's corners (the paper's
    /// figure 7). Interpolated perspective-correctly on the surface, which flatters the comparison: the hardware of
    /// 1996 interpolated colours in screen space, so its picture swam as the camera moved.
    Gouraud,
    /// A colour for every triangle (color plate A).
    Ids,
    /// The barycentrics, s as red and t as green (color plate B).
    Barycentrics,
    /// The solver's constant light on each leaf element, and the leaves' borders.
    Elements,
    /// The light, and the edges of all triangles (figures 4–6).
    Mesh,
    /// The light, dimmed, and the discontinuities that the mesh follows: horizon lines yellow, edge–vertex events
    /// magenta, vertex–edge events cyan, the brighter the heavier; cuts white, leaf borders faint grey.
    Discontinuities,
    /// Illuminance on a logarithmic ramp of ten stops around middle grey: black, purple, red, orange, yellow; with lines
    /// where it is 1, 2 or 5 times a power of ten lux ([`FalseColorScale`](crate::FalseColorScale)).
    FalseColor,
    /// The light alone: what the picture would be if every surface were white, without its texture.
    Light,
    /// Gouraud in the left half, the quadratic interpolants in the right one (the paper's figures 7 and 8 in one).
    Split,
}

impl Mode {
    /// All modes. The shader `evaluation.wgsl` numbers them in this order.
    pub const ALL: [Self; 10] = [
        Self::Shaded,
        Self::Gouraud,
        Self::Ids,
        Self::Barycentrics,
        Self::Elements,
        Self::Mesh,
        Self::Discontinuities,
        Self::FalseColor,
        Self::Light,
        Self::Split,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shaded => "shaded",
            Self::Gouraud => "gouraud",
            Self::Ids => "ids",
            Self::Barycentrics => "barycentrics",
            Self::Elements => "elements",
            Self::Mesh => "mesh",
            Self::Discontinuities => "discontinuities",
            Self::FalseColor => "false-color",
            Self::Light => "light",
            Self::Split => "split",
        }
    }

    /// Whether the picture is light alone, which the tone map exposes. The others are diagrams: the interpolant pass
    /// has exposed what light they show and drawn over it, so their colours go to the display as they are.
    pub fn is_light(self) -> bool {
        matches!(self, Self::Shaded | Self::Gouraud | Self::Light | Self::Split)
    }

    /// Whether the picture shows the light that arrives, whatever the surface makes of it.
    pub fn is_of_white(self) -> bool {
        matches!(self, Self::Light | Self::FalseColor)
    }

    /// The next mode in the order of [`Mode::ALL`], around the end.
    pub fn next(self) -> Self {
        Self::ALL[(self as usize + 1) % Self::ALL.len()]
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no mode has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no mode is called “{0}”: use shaded, gouraud, ids, barycentrics, elements, mesh, discontinuities, false-color, light or \
     split"
)]
pub struct UnknownMode(String);

impl FromStr for Mode {
    type Err = UnknownMode;

    fn from_str(name: &str) -> Result<Self, UnknownMode> {
        Self::ALL.into_iter().find(|mode| mode.name() == name).ok_or_else(|| UnknownMode(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn names_are_read_back_and_unknown_ones_refused() {
        for mode in Mode::ALL {
            assert_eq!(mode.name().parse(), Ok(mode));
        }
        let error = "Shaded ".parse::<Mode>().unwrap_err().to_string();
        assert!(error.contains("“Shaded ”") && Mode::ALL.iter().all(|mode| error.contains(mode.name())), "{error}");
    }

    #[test]
    fn modes_are_numbered_in_order_and_next_goes_round() {
        for (number, mode) in Mode::ALL.into_iter().enumerate() {
            assert_eq!(mode as usize, number);
            assert_eq!(mode.next(), Mode::ALL[(number + 1) % Mode::ALL.len()]);
        }
    }
}
