//! The command line: flags, and what makes them valid. Nothing here touches a file.

use std::path::PathBuf;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use scene::ToneCurve;
use serde::Serialize;
use viewer::Mode;

mod camera;
mod environment;
mod render;
mod sky;
mod values;

pub use camera::{CameraFlags, Viewpoint};
pub use environment::{EnvironmentFlags, SkySource};
pub use render::{Budget, CoherenceFlags, Interpolation, RadianceChoice, RadianceFlags, RenderFlags, SamplerChoice};
pub use sky::SkyFlags;
pub use values::{ExposureChoice, ImageKind};

use values::{
    exposure, fraction, image_path, mode, non_negative, png_path, positive, size, size_in_bytes, tolerance, tone_curve,
};

/// Most paths at a point: a quarter of a minute for one point, and 0.02 % of its light.
const MOST_SAMPLES: i64 = 1 << 24;

/// Bakes light: diffuse global illumination as a piecewise-quadratic description on every surface.
#[derive(Debug, Parser)]
#[command(name = "halflight", version, infer_long_args = false, after_help = EXIT_CODES)]
pub struct Flags {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 a comparison or verification did not hold, 130 interrupted.";

/// The subcommands, each in a file of its own.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solve a scene's light and store it as a .hlf file
    Bake(BakeFlags),
    /// Draw a picture
    Shot(ShotFlags),
    /// Make a picture from samples of the image plane, each along a ray
    Render(Box<RenderFlags>),
    /// Walk through the light in a window
    View(ViewFlags),
    /// Write a page to walk through the light in a browser
    Export(ExportFlags),
    /// Print the irradiance at points
    Probe(ProbeFlags),
    /// Hold a bake against an independent, path-traced reference
    Verify(VerifyFlags),
    /// Print what a file holds
    Info(InfoFlags),
    /// Hold the program's own light against closed forms
    Validate(ValidateFlags),
}

/// `halflight bake`.
#[derive(Debug, Args)]
pub struct BakeFlags {
    /// Scene to bake (.obj, .glb, .gltf, or a scene file .toml)
    pub scene: PathBuf,
    /// Where the bake goes
    #[arg(short, long, value_name = "OUT.hlf")]
    pub output: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// What the light is asked for
    #[command(flatten)]
    pub light: LightFlags,
    /// What the bake may take
    #[command(flatten)]
    pub limits: LimitFlags,
    /// Go on with the interrupted bake at the output path; what comes of it is the same as without the interruption
    #[arg(long)]
    pub resume: bool,
    /// Print one JSON object on stdout: counts, seconds by stage, memory and measured error
    #[arg(long)]
    pub json: bool,
}

/// How a scene is read; a bake holds its scene as it was read then.
#[derive(Clone, Debug, Default, Args)]
pub struct SceneFlags {
    /// Take faces as two-sided, where the scene's winding is not to be trusted: all but closed solids and rooms, and materials
    /// of which a scene file says two_sided = false, get the other side that they lack
    #[arg(long)]
    pub two_sided: bool,
    /// The light from far away
    #[command(flatten)]
    pub sky: EnvironmentFlags,
}

/// What a bake's light depends on; none means the default of the stage that it belongs to.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LightFlags {
    /// Relative error of irradiance that is accepted, as a fraction: root mean square over all surfaces, and a fifth of the
    /// error that is accepted on 99 % of them
    #[arg(long, value_name = "F", default_value_t = TOLERANCE, value_parser = tolerance, allow_hyphen_values = true)]
    pub tolerance: f64,
    /// Interreflections followed; 0 is direct light only [default: to convergence]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub bounces: Option<u32>,
    /// Largest number of discontinuities that one leaf follows (the paper's k); in scenes of more than 400 polygons at most 3
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    pub discontinuities: Option<u32>,
    /// How the strength of discontinuities is measured
    #[arg(long, value_enum, default_value_t)]
    pub weight: WeightChoice,
    /// Smallest weight that a discontinuity must have to be followed (the paper's w_min), W/m² for --weight ratio, W/m³
    /// for change [default: from the scene's light]
    #[arg(long, value_name = "W", value_parser = non_negative, allow_hyphen_values = true)]
    pub min_weight: Option<f64>,
    /// Irradiance, W/m², that one link may misplace [default: from the scene's mean irradiance]
    #[arg(long, value_name = "E", value_parser = positive, allow_hyphen_values = true)]
    pub link_error: Option<f64>,
}

/// What a bake may take: where the tolerance is not kept within it, the best bake so far is written, and the exit code is 3.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct LimitFlags {
    /// Triangles beyond which the bake is not refined further
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub max_triangles: Option<u32>,
    /// Seconds after which no further round of refinement begins
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub max_seconds: Option<f64>,
    /// Memory that the bake may hold, such as 2GB or 500MB; a scene that needs more at least is refused [default: a scene is
    /// refused that needs more at least than the machine has to give]
    #[arg(long, value_name = "SIZE", value_parser = size_in_bytes)]
    pub max_memory: Option<u64>,
}

/// The error that is accepted where none is named: what no eye sees.
const TOLERANCE: f64 = 0.01;

impl Default for LightFlags {
    fn default() -> Self {
        Self {
            tolerance: TOLERANCE,
            bounces: None,
            discontinuities: None,
            weight: WeightChoice::default(),
            min_weight: None,
            link_error: None,
        }
    }
}

/// `halflight shot`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("many").args(["path", "timing"]).multiple(true))]
pub struct ShotFlags {
    /// Bake to draw, or a scene, which is baked first
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Where the picture goes; the name ends in .png (as displayed) or .exr (radiance, W/(sr m²)). Pictures along a path have
    /// their number before the ending: a.0001.png
    #[arg(short, long, value_name = "IMAGE", value_parser = image_path, required_unless_present = "timing")]
    pub output: Option<PathBuf>,
    /// The point of view
    #[command(flatten)]
    pub camera: CameraFlags,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size, allow_hyphen_values = true)]
    pub size: (u32, u32),
    /// What is drawn
    #[arg(long, default_value = "shaded", value_parser = mode())]
    pub mode: Mode,
    /// What draws; auto is the GPU where there is one
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub backend: Backend,
    /// Exposure value, by which radiance is multiplied as 2^EV, or auto
    #[arg(long, value_name = "EV|auto", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: ExposureChoice,
    /// How exposed light is brought into what a display shows: straight with a shoulder, straight and clipped, or as film has it
    #[arg(long, default_value = "shoulder", value_parser = tone_curve())]
    pub tone_curve: ToneCurve,
    /// Picture to compare with: an EXR by the relative RMSE of radiance, a PNG by the share of pixels off by more
    /// than 1/255
    #[arg(long, value_name = "REFERENCE", value_parser = image_path, requires_all = ["max_error", "output"])]
    pub compare: Option<PathBuf>,
    /// Largest difference from the reference that is accepted; exit code 3 above it
    #[arg(long, value_name = "E", value_parser = non_negative, requires = "compare", allow_hyphen_values = true)]
    pub max_error: Option<f64>,
    /// A camera's path, a TOML file of `[[camera]]` entries with eye and target in metres, and, if needed, time in seconds, up
    /// and fov: pictures are taken along it, evenly in time
    #[arg(long, value_name = "PATH.toml", requires = "frames", conflicts_with_all = ["camera", "eye", "compare"])]
    pub path: Option<PathBuf>,
    /// Draw frames without writing them, and print how long they take, and what of them each pass takes: medians, milliseconds
    #[arg(long)]
    pub timing: bool,
    /// Pictures along the path, or frames that are timed [default: 60]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_FRAMES), requires = "many", allow_negative_numbers = true)]
    pub frames: Option<u32>,
    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

impl ShotFlags {
    /// Frames that are asked for where there may be many.
    pub fn frames(&self) -> u32 {
        self.frames.unwrap_or(FRAMES)
    }
}

/// Frames that are timed if nothing is said: half a second to a few, without a GPU.
const FRAMES: u32 = 60;

/// Most frames: an hour of film.
const MOST_FRAMES: i64 = 100_000;

/// `halflight view`.
#[derive(Debug, Args)]
pub struct ViewFlags {
    /// Bake to walk through, or a scene, which is baked first
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// The first point of view
    #[command(flatten)]
    pub camera: CameraFlags,
    /// What the picture is refined with while the view rests (key V)
    #[command(flatten)]
    pub radiance: RadianceFlags,
}

/// `halflight export`.
#[derive(Debug, Args)]
pub struct ExportFlags {
    /// Bake to walk through, or a scene, which is baked first
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Folder that the page goes to, for any server of files: a new or an empty one, or a page that was exported before, which is
    /// replaced
    #[arg(long, value_name = "OUT/")]
    pub web: PathBuf,
    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// `halflight probe`.
#[derive(Debug, Args)]
pub struct ProbeFlags {
    /// Bake to probe, or a scene, which is baked first
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Points and normals of faces: a CSV file with the header x,y,z,nx,ny,nz; on faces with shading normals light is told by these
    #[arg(long, value_name = "POINTS.csv")]
    pub points: PathBuf,
    /// Where the irradiance goes; stdout without it
    #[arg(short, long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// How irradiance is found: the bake's interpolants, an exact gather from the solution at each point, or paths,
    /// which know nothing of the solver
    #[arg(long, value_enum, default_value_t = Method::Interpolant)]
    pub method: Method,
    /// Paths at each point, with --method path [default: 4096]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES), allow_negative_numbers = true)]
    pub samples: Option<u32>,
    /// Interreflections followed; 0 is direct light only [default: to convergence, or as a .hlf file was baked]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub bounces: Option<u32>,
}

/// `halflight verify`.
#[derive(Debug, Args)]
pub struct VerifyFlags {
    /// Bake to verify, or a scene, which is baked first
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Points compared, spread by area over all surfaces
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(100..=1_000_000), allow_negative_numbers = true)]
    pub points: u32,
    /// Paths at each point [default: as many as the tolerance asks for]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES), allow_negative_numbers = true)]
    pub samples: Option<u32>,
    /// Relative RMSE that the bake must keep, as a fraction (0.01 is 1 %), with the 99th percentile five times that
    /// [default: the tolerance that it was baked for]
    #[arg(long, value_name = "F", value_parser = fraction, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// Seed of points and paths; another one is another, independent opinion
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Where a picture of the error goes: blue is too dark, red too bright, grey within a quarter of the tolerance
    #[arg(long, value_name = "IMAGE.png", value_parser = png_path)]
    pub picture: Option<PathBuf>,
    /// The point of view of the picture
    #[command(flatten)]
    pub camera: CameraFlags,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH", default_value = "960x720", value_parser = size, allow_hyphen_values = true)]
    pub size: (u32, u32),
    /// Where every point, its light and its reference go
    #[arg(short, long, value_name = "TABLE.csv")]
    pub output: Option<PathBuf>,
    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// `halflight info`.
#[derive(Debug, Args)]
pub struct InfoFlags {
    /// Bake or scene; a scene is described as it is, without a bake
    #[arg(value_name = "SCENE|OUT.hlf")]
    pub input: PathBuf,
    /// How a scene is read
    #[command(flatten)]
    pub reading: SceneFlags,
    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// `halflight validate`.
#[derive(Debug, Args)]
pub struct ValidateFlags {
    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// What draws a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// The GPU where there is one, else the CPU.
    Auto,
    /// The GPU, or an error.
    Gpu,
    /// The CPU.
    Cpu,
}

/// How the strength of a discontinuity is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum WeightChoice {
    /// Distance from source to blocker over that from blocker to receiver, times the source's radiosity.
    Ratio,
    /// Bound on the change of irradiance per metre on the receiver.
    #[default]
    Change,
}

/// How `probe` finds irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// The quadratic of the triangle under the point.
    Interpolant,
    /// Backprojection of every source at the point itself.
    Gather,
    /// Unbiased path tracing from the point, with its standard error.
    Path,
}

#[cfg(test)]
mod tests;
