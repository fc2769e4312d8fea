//! The flags of `halflight render`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use renderer::{Filter, Interval, Rule};
use scene::ToneCurve;

use super::values::{exposure, fraction, image_path, number, png_path, positive, size, tone_curve};
use super::{CameraFlags, ExposureChoice, ImageKind, MOST_SAMPLES, SceneFlags, SkyFlags};

/// Pixels of a coherence map's work image along a side of each of the picture's, where nothing is said: Guo's.
const SUPERSAMPLE: u32 = 3;

/// `halflight render`.
#[derive(Debug, Args)]
#[command(mut_arg("environment", |environment| environment.conflicts_with_all([
    "sampler", "radiance", "paths", "bounces", "budget", "level", "interval", "perceptual", "rule", "filter", "interpolation", "snapshots",
    "sample_map", "seed", "compare", "error_map", "supersample", "map", "relocate",
])))]
pub struct RenderFlags {
    /// Scene, or a bake
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Where the picture goes; the name ends in .png (as displayed) or .exr (radiance, W/(sr m²))
    #[arg(short, long, value_name = "IMAGE", value_parser = image_path)]
    pub output: PathBuf,
    /// The point of view
    #[command(flatten)]
    pub camera: CameraFlags,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size, allow_hyphen_values = true)]
    pub size: (u32, u32),
    /// Exposure value, by which radiance is multiplied as 2^EV, or auto, which looks at 1024 points more
    #[arg(long, value_name = "EV|auto", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: ExposureChoice,
    /// How exposed light is brought into what a display shows: straight with a shoulder, straight and clipped, or as film has it
    #[arg(long, default_value = "shoulder", value_parser = tone_curve())]
    pub tone_curve: ToneCurve,
    /// Where samples go
    #[arg(long, value_enum, default_value_t)]
    pub sampler: SamplerChoice,
    /// What a sample sees
    #[command(flatten)]
    pub radiance: RadianceFlags,
    /// How a picture is made under --environment
    #[command(flatten)]
    pub sky: SkyFlags,
    /// How much is done: samples a pixel (1.9rpp, or a bare number), seconds (30s), or samples as a share of the pixels (6%);
    /// with --sampler coherence-map of those of the work image, and a bare number is a share, too [default: until every pixel
    /// is known; with --sampler full 4 samples a pixel]
    #[arg(long, value_name = "N|Nrpp|Ns|N%", value_parser = budget, allow_hyphen_values = true)]
    pub budget: Option<Budget>,
    /// When a pixel is known
    #[command(flatten)]
    pub confidence: ConfidenceFlags,
    /// The filter that the picture is seen through [default: lanczos; with --sampler coherence-map gaussian]
    #[arg(long, value_enum)]
    pub filter: Option<FilterChoice>,
    /// The surface through the samples that is filtered
    #[arg(long, value_enum, default_value_t)]
    pub interpolation: Interpolation,
    /// Folder for a picture at every doubling of the samples, named by their number
    #[arg(long, value_name = "DIR")]
    pub snapshots: Option<PathBuf>,
    /// Where a map of the samples goes: from black, none in a pixel, to white, twenty; red above
    #[arg(long, value_name = "FILE.png", value_parser = png_path)]
    pub sample_map: Option<PathBuf>,
    /// The coherence map
    #[command(flatten)]
    pub coherence: CoherenceFlags,
    /// Full picture (.exr) that this one is compared with: the L1 and L2 norms of the difference, relative to its own
    #[arg(long, value_name = "FULL.exr")]
    pub compare: Option<PathBuf>,
    /// Where a map of the difference goes, with --compare: blue where this picture is too dark, red where it is too bright
    #[arg(long, value_name = "FILE.png", value_parser = png_path)]
    pub error_map: Option<PathBuf>,
    /// Seed of all that is left to chance; the same seed gives the same picture
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Print one JSON object on stdout: samples, and seconds by stage
    #[arg(long)]
    pub json: bool,
}

impl RenderFlags {
    /// Whether the picture is one of radiance, and not of what a display shows.
    pub fn is_exr(&self) -> bool {
        ImageKind::of(&self.output) == Some(ImageKind::Exr)
    }

    /// Pixels of a coherence map's work image along a side of each of the picture's.
    pub fn supersample(&self) -> u32 {
        self.coherence.supersample.unwrap_or(SUPERSAMPLE)
    }
}

/// What a sample sees.
#[derive(Clone, Copy, Debug, Args)]
pub struct RadianceFlags {
    /// Where radiance comes from
    #[arg(long, value_enum, default_value_t)]
    pub radiance: RadianceChoice,
    /// Paths for one sample, with --radiance path [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES), allow_negative_numbers = true)]
    pub paths: Option<u32>,
    /// Interreflections followed, with --radiance path, gather or interpolant; 0 is direct light only [default: to convergence,
    /// or as a .hlf file was baked]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub bounces: Option<u32>,
}

/// What is asked of a coherence map.
#[derive(Debug, Args)]
pub struct CoherenceFlags {
    /// Pixels of the work image along a side of each of the picture's, with --sampler coherence-map [default: 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16), allow_negative_numbers = true)]
    pub supersample: Option<u32>,
    /// Where the map goes, with --sampler coherence-map: evaluated pixels white, blocks in the colour of their direction
    #[arg(long, value_name = "FILE.png", value_parser = png_path)]
    pub map: Option<PathBuf>,
    /// Evaluate pixels of the work image over their area, by as many samples as it takes until they are known (--level,
    /// --interval), with --sampler coherence-map: for light with noise, that of a full picture goes to the few pixels
    #[arg(long)]
    pub relocate: bool,
}

/// When the adaptive sampler, or a coherence map with --relocate, takes a pixel for known: when its mean is within an interval
/// with a probability.
#[derive(Clone, Copy, Debug, Args)]
pub struct ConfidenceFlags {
    /// That probability, between 0 and 1
    #[arg(long, value_name = "P", default_value_t = 0.99, value_parser = fraction, allow_hyphen_values = true)]
    pub level: f64,
    /// How far from the truth the mean of a pixel may be, as a fraction of the light that a display shows at most
    #[arg(long, value_name = "F", default_value_t = 1.0 / 255.0, value_parser = positive, allow_hyphen_values = true)]
    pub interval: f64,
    /// Take the interval as one of what an eye makes of that light: narrow in the dark, wide in highlights
    #[arg(long)]
    pub perceptual: bool,
    /// How the variance of a pixel's mean is told
    #[arg(long, value_enum, default_value_t)]
    pub rule: RuleChoice,
}

impl ConfidenceFlags {
    /// The interval asked for.
    pub fn interval(&self) -> Interval {
        if self.perceptual { Interval::Perceptual(self.interval) } else { Interval::Linear(self.interval) }
    }
}

/// Where samples go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SamplerChoice {
    /// Everywhere alike: one sample in each cell of a grid.
    Full,
    /// Where the picture is not known yet.
    #[default]
    Adaptive,
    /// On the borders of blocks that edges cross: a directional coherence map.
    CoherenceMap,
}

/// Where radiance comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RadianceChoice {
    /// The reference path tracer: all light, and noise.
    Path,
    /// An exact gather at each point from what the bake's reflectors send.
    Gather,
    /// The interpolants of the bake; a scene is baked first.
    #[default]
    Interpolant,
    /// Direct light, mirrors and highlights, without noise: exact light of surfaces, and lights without one; of an environment
    /// what is seen and mirrored, not its light on surfaces.
    Whitted,
}

impl RadianceChoice {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Gather => "gather",
            Self::Interpolant => "interpolant",
            Self::Whitted => "whitted",
        }
    }
}

/// How the variance of a pixel's mean is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RuleChoice {
    /// As Painter & Sloan have it: fewest samples, but borders are missed.
    Paper,
    /// By the samples around each, wherever the pixel ends: keeps the level.
    #[default]
    Calibrated,
}

impl From<RuleChoice> for Rule {
    fn from(choice: RuleChoice) -> Self {
        match choice {
            RuleChoice::Paper => Self::Paper,
            RuleChoice::Calibrated => Self::Calibrated,
        }
    }
}

/// The filter that a picture is seen through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FilterChoice {
    /// A windowed sinc over 7 × 7 pixels.
    #[default]
    Lanczos,
    /// The pixel's own square.
    Box,
    /// A tent over 2 × 2 pixels.
    Triangle,
    /// A Gaussian, cut off at two pixels.
    Gaussian,
    /// A cubic over 4 × 4 pixels.
    Mitchell,
}

impl From<FilterChoice> for Filter {
    fn from(choice: FilterChoice) -> Self {
        match choice {
            FilterChoice::Lanczos => Self::Lanczos,
            FilterChoice::Box => Self::Box,
            FilterChoice::Triangle => Self::Triangle,
            FilterChoice::Gaussian => Self::Gaussian,
            FilterChoice::Mitchell => Self::Mitchell,
        }
    }
}

/// The surface through the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Interpolation {
    /// Each sample's cell has its light; the fastest.
    #[default]
    Constant,
    /// Planes over the Delaunay triangles of the samples.
    Planar,
    /// Quadratics over them that meet without folds.
    Smooth,
}

/// How much is done at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Samples a pixel.
    RaysPerPixel(f64),
    /// Seconds of sampling.
    Seconds(f64),
    /// Samples as a fraction of the pixels.
    Share(f64),
    /// A number without a unit: each sampler has its own.
    Bare(f64),
}

fn budget(text: &str) -> Result<Budget, String> {
    type Kind = fn(f64) -> Budget;
    let units: [(&str, Kind); 3] =
        [("rpp", Budget::RaysPerPixel), ("s", Budget::Seconds), ("%", |percent| Budget::Share(percent / 100.0))];
    let text = text.trim();
    let of_unit = |(unit, kind): (&str, Kind)| text.strip_suffix(unit).map(|value| (value, kind));
    let (value, kind) = units.into_iter().find_map(of_unit).unwrap_or((text, Budget::Bare));
    match number(value) {
        Ok(value) if value > 0.0 => Ok(kind(value)),
        _ => {
            Err("must be more than 0: rays per pixel (1.9rpp or 1.9), seconds (30s) or a share of the pixels (6%)"
                .into())
        }
    }
}
