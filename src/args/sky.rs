//! The flags of `halflight render --environment`: a picture by lights that stand for the environment.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use renderer::{SkySampling, Visibility};

use super::values::{number, png_path};

/// Most lights: more than a picture tells apart.
const MOST_LIGHTS: i64 = 4096;

/// How a picture is made under an environment.
#[derive(Clone, Debug, Args)]
pub struct SkyFlags {
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
