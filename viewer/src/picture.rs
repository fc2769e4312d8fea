//! What is asked of a picture, and the picture.

use glam::Vec3;
use scene::{Camera, Exposure, ToneCurve};

use crate::Mode;

/// What is asked of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Where it is taken from.
    pub camera: Camera,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// What it shows.
    pub mode: Mode,
    /// How bright it is; none meters it: surfaces that reflect, not the lamps, are brought to middle grey.
    pub exposure: Option<Exposure>,
    /// How exposed light is brought into what a display shows.
    pub curve: ToneCurve,
}

impl Frame {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Linear radiance before exposure, W·sr⁻¹·m⁻², for the modes that show light alone ([`Mode::is_light`]). For the
    /// others, whose colours are not radiance, the display-linear colour, 0..=1. Zero on back sides; where nothing was hit that
    /// of the scene's environment, in modes that show light alone, or zero. Empty where it was not asked for.
    pub radiance: Vec<Vec3>,
    /// What a display shows, sRGB: light after exposure and tone curve, other colours as they are.
    pub rgb: Vec<[u8; 3]>,
    /// Number of pixels where nothing was hit.
    pub background: u64,
    /// The exposure that was given or metered.
    pub exposure: Exposure,
}
