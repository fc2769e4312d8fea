//! The flags of `halflight render --environment`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use renderer::{SkySampling, Visibility};
use scene::{CIE_SKIES, UpAxis};

use super::{non_negative, number, png_path, positive};

/// Most lights: more than a picture tells apart.
const MOST_LIGHTS: i64 = 4096;

/// Light from the sky.
#[derive(Clone, Debug, Args)]
pub struct SkyFlags {
    /// Light the scene by the sky alone, a ray from each pixel's middle: a picture of all directions (.hdr, .exr), or a general
    /// sky of the CIE, cie:1 to cie:16
    #[arg(long, value_name = "MAP|cie:N", value_parser = source, conflicts_with_all = [
        "sampler", "radiance", "paths", "bounces", "budget", "level", "interval", "perceptual", "rule", "filter", "interpolation", "snapshots",
        "sample_map", "seed",
    ])]
    pub environment: Option<SkySource>,
    /// Lights that stand for the environment
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=MOST_LIGHTS), requires = "environment", allow_negative_numbers = true)]
    pub lights: u32,
    /// How the lights are placed
    #[arg(long, value_enum, default_value_t, requires = "environment")]
    pub sky_sampling: SkySamplingChoice,
    /// How it is found which lights are seen: a ray to each (full), or by the names of Ben-Artzi et al.: scanline or grid,
    /// warping or none, boundary or uncertainty flooding; opt is gnu with both restrictions, of which each may stand alone
    #[arg(long, default_value = "gnu", value_parser = visibility(), requires = "environment")]
    pub visibility: NamedVisibility,
    /// Of the lights that are brightest on a pixel so many are doubted wherever seen and hidden lights meet: more rays, fewer
    /// errors that are seen
    #[arg(long, value_name = "K", default_value_t = 0, requires = "environment", allow_negative_numbers = true)]
    pub brightest: u32,
    /// Part of an unobstructed pixel's light that may be guessed: the faintest of the lights that are in doubt are not traced
    #[arg(long, value_name = "F", default_value_t = 0.0, value_parser = share, requires = "environment", allow_hyphen_values = true)]
    pub guessed: f64,
    /// How far the sky is turned clockwise, seen from above, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = number, requires = "environment", allow_hyphen_values = true)]
    pub sky_rotation: f64,
    /// What the sky's light is multiplied by; the zenith of a CIE sky has 1 W/(sr m²)
    #[arg(long, value_name = "F", default_value_t = 1.0, value_parser = positive, requires = "environment", allow_hyphen_values = true)]
    pub sky_scale: f64,
    /// The axis of the scene that points up under the sky
    #[arg(long, default_value = "z", value_parser = up_axis(), requires = "environment")]
    pub sky_up: UpAxis,
    /// Where the sun stands in a CIE sky: degrees clockwise from north, which is y where z is up, and over the horizon
    /// [default: 135,45]
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = sun, requires = "environment", allow_hyphen_values = true)]
    pub sun: Option<[f64; 2]>,
    /// What the sun itself sends to a surface that faces it in a CIE sky, W/m², before --sky-scale [default: nothing]
    #[arg(long, value_name = "E", value_parser = non_negative, requires = "environment", allow_hyphen_values = true)]
    pub sun_irradiance: Option<f64>,
    /// Trace every shadow ray as well, and count the predictions that are wrong
    #[arg(long, requires = "environment")]
    pub check: bool,
    /// Where a map of the shadow rays goes: from black, none in a pixel, to white, one to each light; with --check red where a
    /// prediction is wrong
    #[arg(long, value_name = "FILE.png", value_parser = png_path, requires = "environment")]
    pub ray_map: Option<PathBuf>,
    /// Where a picture of the sky goes, with the lights and the cells of directions that they stand for
    #[arg(long, value_name = "FILE.png", value_parser = png_path, requires = "environment")]
    pub sky_picture: Option<PathBuf>,
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

/// How lights are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SkySamplingChoice {
    /// By layers of brightness (Agarwal et al. 2003).
    #[default]
    Structured,
    /// Lights of about the same strength (Kollig and Keller 2003).
    Equal,
}

impl From<SkySamplingChoice> for SkySampling {
    fn from(choice: SkySamplingChoice) -> Self {
        match choice {
            SkySamplingChoice::Structured => Self::Structured,
            SkySamplingChoice::Equal => Self::EqualLight,
        }
    }
}

/// A way to find what is seen, with its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedVisibility {
    /// The name on the command line.
    pub name: &'static str,
    /// The way.
    pub visibility: Visibility,
}

fn visibility() -> impl TypedValueParser<Value = NamedVisibility> {
    let named = |text: String| {
        let found = Visibility::NAMED.into_iter().find(|(name, _)| *name == text);
        found.map(|(name, visibility)| NamedVisibility { name, visibility }).ok_or("no such way")
    };
    PossibleValuesParser::new(Visibility::NAMED.map(|(name, _)| name)).try_map(named)
}

fn share(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if (0.0..1.0).contains(&value) { Ok(value) } else { Err("must be 0 or more and less than 1, such as 0.01".into()) }
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
