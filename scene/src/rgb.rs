//! Linear RGB quantities and their luminance.

use glam::DVec3;

/// Three colour channels in linear Rec. 709 primaries, x = red, y = green, z = blue; the unit is the field's.
pub type Rgb = DVec3;

/// Rec. 709 luminance weights: what an eye adapted to D65 makes of linear red, green and blue.
const LUMINANCE: Rgb = Rgb::new(0.2126, 0.7152, 0.0722);

/// The luminance of a linear colour, in the unit of the colour (W stays W: no luminous efficacy is applied).
pub fn luminance(colour: Rgb) -> f64 {
    colour.dot(LUMINANCE)
}

/// Lumens of a watt of light: what Radiance takes its white for, so that its users' scenes keep their lux. Of 683 lm/W at the eye's
/// best green, equal energy over the visible spectrum makes 179.
pub const LUMINOUS_EFFICACY: f64 = 179.0;
