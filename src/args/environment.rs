//! The flags of the light from far away: part of how a scene is read.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use scene::{CIE_SKIES, UpAxis};

use super::values::{non_negative, number, positive};

/// An environment, in place of the one that a scene file has.
#[derive(Clone, Debug, Default, Args)]
pub struct EnvironmentFlags {
    /// Light from far away, in place of a scene file's: a picture of all directions (.hdr, .exr), or a general sky of the CIE,
    /// cie:1 to cie:16; `render` then makes its picture under it alone, by --lights lights
    #[arg(long, value_name = "MAP|cie:N", value_parser = source)]
    pub environment: Option<SkySource>,
    /// How far the sky is turned clockwise, seen from above, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = number, requires = "environment", allow_hyphen_values = true)]
    pub sky_rotation: f64,
    /// What the sky's light is multiplied by; the zenith of a CIE sky has 1 W/(sr m²)
    #[arg(long, value_name = "F", default_value_t = 1.0, value_parser = positive, requires = "environment", allow_hyphen_values = true)]
    pub sky_scale: f64,
    /// The axis of the scene that points up under the sky [default: y in glTF files, that of a bake's own sky, else z]
    #[arg(long, value_parser = up_axis(), requires = "environment")]
    pub sky_up: Option<UpAxis>,
    /// Where the sun stands in a CIE sky: degrees clockwise from north, which is y where z is up, and over the horizon
    /// [default: 135,45]
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = sun, requires = "environment", allow_hyphen_values = true)]
    pub sun: Option<[f64; 2]>,
    /// What the sun itself sends to a surface that faces it in a CIE sky, W/m², before --sky-scale [default: nothing]
    #[arg(long, value_name = "E", value_parser = non_negative, requires = "environment", allow_hyphen_values = true)]
    pub sun_irradiance: Option<f64>,
}

/// Where an environment comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SkySource {
    /// A picture.
    Map(PathBuf),
    /// A sky of the CIE, by its number.
    Cie(u8),
}

impl std::fmt::Display for SkySource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Map(path) => write!(f, "{}", path.display()),
            Self::Cie(kind) => write!(f, "cie:{kind}"),
        }
    }
}

fn up_axis() -> impl TypedValueParser<Value = UpAxis> {
    let named = |text: String| UpAxis::ALL.into_iter().find(|axis| axis.name() == text).ok_or("no such axis");
    PossibleValuesParser::new(UpAxis::ALL.map(UpAxis::name)).try_map(named)
}

fn source(text: &str) -> Result<SkySource, String> {
    let Some(kind) = text.strip_prefix("cie:") else { return Ok(SkySource::Map(text.into())) };
    match kind.parse() {
        Ok(kind) if (1..=CIE_SKIES).contains(&kind) => Ok(SkySource::Cie(kind)),
        _ => Err(format!("the skies of the CIE are cie:1 to cie:{CIE_SKIES}")),
    }
}

/// Azimuth and altitude, radians.
fn sun(text: &str) -> Result<[f64; 2], String> {
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    match numbers[..] {
        [azimuth, altitude] if (0.0..=90.0).contains(&altitude) => Ok([azimuth.to_radians(), altitude.to_radians()]),
        _ => Err("must be an azimuth and an altitude from 0 to 90 in degrees, such as 135,45".into()),
    }
}
