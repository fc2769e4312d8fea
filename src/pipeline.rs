//! Scene → Solution → Baked, with the counts and seconds of every stage.

use mesher::{BakeOptions, BakeStatistics};
use scene::{Baked, BakedError, Provenance, Scene};
use serde::Serialize;
use solver::{Solution, SolveOptions};

use crate::args::LightFlags;
use crate::progress::Stage;

/// The program as a bake's provenance names it.
pub const PROGRAM: &str = concat!("halflight ", env!("CARGO_PKG_VERSION"));

/// What one bake took and gave; `bake --json` prints it.
#[derive(Debug, Serialize)]
pub struct BakeReport {
    /// Polygons of the scene.
    pub polygons: usize,
    /// Leaf elements.
    pub elements: usize,
    /// Links between elements.
    pub links: usize,
    /// Bytes of the links.
    pub link_bytes: usize,
    /// Polygons named in the links' blocker lists, each list counted once.
    pub blockers: usize,
    /// Bytes of the blocker lists.
    pub blocker_bytes: usize,
    /// What transport left undone: largest change of the last iteration relative to the largest irradiance.
    pub residual: f64,
    /// Actual discontinuities found.
    pub discontinuities_found: usize,
    /// Discontinuities that the mesh follows.
    pub discontinuities_kept: usize,
    /// Triangles.
    pub triangles: usize,
    /// Irradiance samples, each evaluated once.
    pub samples: usize,
    /// Errors measured at probe points, relative to max(own, mean) irradiance.
    pub error: ErrorReport,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// Largest part of memory held, bytes; null where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// [`BakedError`], as JSON names it.
#[derive(Debug, Serialize)]
pub struct ErrorReport {
    rms: f64,
    p99: f64,
    max: f64,
    points: u64,
}

impl From<BakedError> for ErrorReport {
    fn from(BakedError { rms, p99, max, points }: BakedError) -> Self {
        Self { rms, p99, max, points }
    }
}

/// Seconds of wall clock.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading and repairing the scene.
    pub import: f64,
    /// Cutting, refining and transport.
    pub solve: f64,
    /// Discontinuities, mesh, samples and their errors.
    pub mesh: f64,
    /// Writing the file.
    pub write: f64,
}

/// Solves the scene's light.
pub fn solve(scene: &Scene, flags: &LightFlags) -> (Solution, f64) {
    let stage = Stage::start("solve");
    let options = SolveOptions { link_error: flags.link_error, bounces: flags.bounces };
    let solution = solver::solve(scene, &options, &|fraction| stage.advance(fraction));
    (solution, stage.end())
}
