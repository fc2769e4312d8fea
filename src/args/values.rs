//! How single values of the command line are read, and what makes them valid.

use std::path::PathBuf;

use bytesize::ByteSize;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use scene::{Exposure, ToneCurve};
use viewer::Mode;

/// Largest side of a picture, pixels: what every GPU of the last ten years takes as a texture.
const LARGEST_SIDE: u32 = 16_384;

/// Largest exposure value of either sign: beyond it 2^EV leaves the numbers that a picture is made of.
const LARGEST_EV: f64 = 64.0;

/// A fixed exposure, or one metered from the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExposureChoice {
    /// Metered.
    Auto,
    /// As given.
    Fixed(Exposure),
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "must be a finite number".into())
}

/// A number of 0 or more.
pub fn non_negative(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value >= 0.0 { Ok(value) } else { Err("must be 0 or more".into()) }
}

/// Smallest and largest tolerance: the one is beyond what f32 samples and the f64 geometry of a file with seven digits can
/// keep, the other promises nothing.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-4..=0.5;

/// A tolerance of a bake or a test, a fraction.
pub fn tolerance(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let (low, high) = (TOLERANCES.start(), TOLERANCES.end());
    if TOLERANCES.contains(&value) {
        Ok(value)
    } else {
        Err(format!("must lie between {low} and {high}, such as 0.01"))
    }
}

/// A size in bytes, with or without a unit.
pub fn size_in_bytes(text: &str) -> Result<u64, String> {
    match text.parse::<ByteSize>() {
        Ok(ByteSize(bytes)) if bytes > 0 => Ok(bytes),
        _ => Err("must be a size of more than nothing, such as 2GB or 500MB".into()),
    }
}

/// A number of more than 0.
pub fn positive(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 { Ok(value) } else { Err("must be more than 0".into()) }
}

/// A number between 0 and 1.
pub fn fraction(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("must lie between 0 and 1, such as 0.01 for 1 %".into()) }
}

/// An opening angle, degrees.
pub fn opening_angle(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 && value < 180.0 { Ok(value) } else { Err("must lie between 0 and 180 degrees".into()) }
}

/// Three numbers.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let [x, y, z] = numbers[..] else {
        return Err("must be three numbers with commas between, such as 1,2.5,-3".into());
    };
    Ok(DVec3::new(x, y, z))
}

/// Width and height of a picture, pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=LARGEST_SIDE).contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| format!("must be two numbers of pixels between 1 and {LARGEST_SIDE}, such as 640x480"))
}

/// An exposure.
pub fn exposure(text: &str) -> Result<ExposureChoice, String> {
    if text == "auto" {
        return Ok(ExposureChoice::Auto);
    }
    match number(text) {
        Ok(ev) if ev.abs() <= LARGEST_EV => Ok(ExposureChoice::Fixed(Exposure { ev: ev as f32 })),
        _ => Err(format!("must be auto or a number between -{LARGEST_EV} and {LARGEST_EV}")),
    }
}

/// A picture file of a kind that can be written.
pub fn image_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match ImageKind::of(&path) {
        Some(_) => Ok(path),
        None => Err("the name must end in .png or .exr".into()),
    }
}

/// A PNG file.
pub fn png_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if ImageKind::of(&path) == Some(ImageKind::Png) { Ok(path) } else { Err("the name must end in .png".into()) }
}

/// What a picture shows.
pub fn mode() -> impl TypedValueParser<Value = Mode> {
    PossibleValuesParser::new(Mode::ALL.map(Mode::name)).try_map(|text| text.parse::<Mode>())
}

/// A tone curve.
pub fn tone_curve() -> impl TypedValueParser<Value = ToneCurve> {
    let named = |text: String| ToneCurve::ALL.into_iter().find(|curve| curve.name() == text).ok_or("no such curve");
    PossibleValuesParser::new(ToneCurve::ALL.map(ToneCurve::name)).try_map(named)
}

/// A kind of picture file, by the end of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// What a display shows: 8 bits, sRGB.
    Png,
    /// Radiance, linear.
    Exr,
}

impl ImageKind {
    /// The kind that a file name says, if it is one of ours.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            _ => None,
        }
    }
}
