//! How a surface reflects and emits: Lambertian, on its front side only.

use serde::{Deserialize, Serialize};

use crate::Rgb;

/// A diffuse material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// Diffuse reflectance ρ (`Kd`), each channel in 0..=1; what the texture multiplies, where there is one.
    pub reflectance: Rgb,
    /// Index into [`crate::Scene::textures`], if the reflectance differs from point to point.
    pub texture: Option<u32>,
    /// Emitted radiance (`Ke`), W·sr⁻¹·m⁻², each channel ≥ 0; the exitance is π times it.
    pub radiance: Rgb,
}

impl Material {
    /// A grey that stands in where a file names a material it does not define.
    pub fn grey(name: impl Into<String>) -> Self {
        Self { name: name.into(), reflectance: Rgb::splat(0.5), texture: None, radiance: Rgb::ZERO }
    }

    /// Whether any channel emits.
    pub fn emits(&self) -> bool {
        self.radiance.max_element() > 0.0
    }

    /// Emitted exitance π·Ke, W·m⁻².
    pub fn exitance(&self) -> Rgb {
        self.radiance * std::f64::consts::PI
    }
}
