//! Lights without a surface. A bake knows none of them: what it stores is light from surfaces, which has edges that are soft.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::Rgb;

/// A light that is no surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// At a point.
    Point {
        /// Metres.
        position: DVec3,
        /// Radiant intensity, the same all around, W·sr⁻¹.
        intensity: Rgb,
    },
    /// Far away.
    Directional {
        /// Unit direction towards the light.
        direction: DVec3,
        /// Irradiance on a surface that faces it, W·m⁻².
        irradiance: Rgb,
    },
}

impl Light {
    /// Whether all numbers are finite and in their ranges.
    pub fn is_valid(&self) -> bool {
        let (place, light) = match *self {
            Self::Point { position, intensity } => (position.is_finite(), intensity),
            Self::Directional { direction, irradiance } => (direction.is_normalized(), irradiance),
        };
        place && light.is_finite() && light.min_element() >= 0.0
    }
}
