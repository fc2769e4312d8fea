//! How a surface reflects and emits: Lambertian, on its front side only. What a file says of mirrors and highlights stands beside
//! that, for those who look along rays.

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
    /// What is not diffuse of it. Bakes know the reflectance alone, which stands for all of it.
    pub gloss: Option<Gloss>,
}

/// A mirror, or highlights (Phong 1975, Whitted 1980).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gloss {
    /// What is diffuse beside it (`Kd`), each channel in 0..=1; what the texture multiplies, where there is one.
    pub diffuse: Rgb,
    /// Reflectance of the mirror or of the highlights (`Ks`), each channel in 0..=1.
    pub specular: Rgb,
    /// Exponent of the cosine that highlights fall off with (`Ns`), at least 0.
    pub exponent: f64,
    /// Whether everything is mirrored, or lamps alone, in highlights.
    pub is_mirror: bool,
}

impl Gloss {
    /// Whether all numbers are in their ranges.
    pub fn is_valid(&self) -> bool {
        let within = |colour: Rgb| colour.is_finite() && colour.min_element() >= 0.0 && colour.max_element() <= 1.0;
        within(self.diffuse) && within(self.specular) && self.exponent.is_finite() && self.exponent >= 0.0
    }
}

impl Material {
    /// A grey that stands in where a file names a material it does not define.
    pub fn grey(name: impl Into<String>) -> Self {
        Self { name: name.into(), reflectance: Rgb::splat(0.5), texture: None, radiance: Rgb::ZERO, gloss: None }
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
