//! Scene → Solution → Baked, with the counts and seconds of every stage.

use std::time::Instant;

use mesher::{BakeOptions, Control, Weight};
use scene::{Answers, Baked, BakedError, Provenance, Scene};
use serde::Serialize;
use solver::{Solution, SolveOptions};

use crate::args::{LightFlags, LimitFlags, WeightChoice};
use crate::interrupt::Interrupt;
use crate::progress::Stage;

/// The program as a bake's provenance names it.
pub const PROGRAM: &str = concat!("halflight ", env!("CARGO_PKG_VERSION"));

/// Who looks on while a bake is made: told of every stage and its fraction that is done, 0..=1, and shown what there is of the
/// light.
#[derive(Clone, Copy)]
pub struct Onlooker<'a> {
    /// Is told how far the work is.
    pub work: &'a (dyn Fn(&'static str, f64) + Sync),
    /// Is shown the bake as it grows.
    pub bake: &'a (dyn Fn(Baked) + Sync),
}

/// Solves the scene's light; the seconds it took stand beside it.
pub fn solve(scene: &Scene, flags: &LightFlags, onlooker: Option<Onlooker<'_>>) -> (Solution, f64) {
    let stage = Stage::start("solve");
    let options = SolveOptions { link_error: flags.link_error, bounces: flags.bounces };
    let solution = solver::solve(scene, &options, &|fraction| {
        stage.advance(fraction);
        if let Some(onlooker) = onlooker {
            (onlooker.work)("solve", fraction);
        }
    });
    (solution, stage.end())
}

/// A bake and what is known of how it was made.
pub struct Bake {
    /// The bake, with its provenance.
    pub baked: Baked,
    /// The solution with the elements and the light of the bake.
    pub solution: Solution,
    /// Counts and seconds.
    pub report: BakeReport,
    /// If the bake was interrupted, what it has found out so far.
    pub answers: Option<Answers>,
}

/// Bakes a scene, whoever looks on.
pub fn bake(scene: &Scene, flags: &LightFlags, onlooker: Option<Onlooker<'_>>) -> Bake {
    resume(scene, flags, &LimitFlags::default(), Answers::default(), &Interrupt::default(), onlooker)
}

/// Bakes a scene within limits, with what an interrupted bake of it has found out. Seconds are looked at between rounds, and once
/// the scene is solved, Ctrl-C at any time.
pub fn resume(
    scene: &Scene,
    flags: &LightFlags,
    limits: &LimitFlags,
    answers: Answers,
    interrupt: &Interrupt,
    onlooker: Option<Onlooker<'_>>,
) -> Bake {
    let start = Instant::now();
    let (solution, solve_seconds) = solve(scene, flags, onlooker);
    if let Some(onlooker) = onlooker {
        (onlooker.bake)(mesher::flat_bake(scene, &solution));
    }
    let links = solution.links.len();
    let stage = Stage::start("mesh");
    let defaults = BakeOptions::default();
    let options = BakeOptions {
        tolerance: flags.tolerance,
        discontinuities: flags.discontinuities.unwrap_or(defaults.discontinuities),
        weight: match flags.weight {
            WeightChoice::Ratio => Weight::Ratio,
            WeightChoice::Change => Weight::Change,
        },
        min_weight: flags.min_weight,
        max_triangles: limits.max_triangles.map_or(defaults.max_triangles, |most| most as usize),
        max_bytes: limits.max_memory.map_or(defaults.max_bytes, |most| usize::try_from(most).unwrap_or(usize::MAX)),
    };
    let late = || limits.max_seconds.is_some_and(|seconds| start.elapsed().as_secs_f64() >= seconds);
    let progress = |fraction| {
        stage.advance(fraction);
        if let Some(onlooker) = onlooker {
            (onlooker.work)("mesh", fraction);
        }
    };
    let watch = onlooker.map(|onlooker| onlooker.bake);
    let control = Control { progress: &progress, stop: &late, interrupted: &|| interrupt.pressed(), watch };
    let mesher::Bake { mut baked, solution, statistics, answers } =
        interrupt.heeded_by(|| mesher::resume(scene, solution, &options, control, answers));
    let mesh_seconds = stage.end();
    let report = BakeReport {
        polygons: scene.polygons.len(),
        patches: solution.elements.patches.len(),
        elements: solution.elements.leaves().count(),
        links,
        link_bytes: size_of_val(solution.links.as_slice()),
        blockers: solution.blockers.polygons.len(),
        blocker_bytes: solution.blockers.bytes(),
        iterations: solution.convergence.iterations,
        residual: solution.convergence.residual,
        converged: solution.convergence.reached,
        discontinuities_found: statistics.discontinuities_found,
        discontinuities_kept: statistics.discontinuities_kept,
        triangles: baked.triangles.len(),
        samples: baked.samples.len(),
        rows: statistics.rows,
        rounds: statistics.rounds,
        error: baked.error.into(),
        seconds: Seconds { solve: solve_seconds, mesh: mesh_seconds, ..Seconds::default() },
        counted_memory_bytes: statistics.bytes,
        peak_memory_bytes: None,
    };
    baked.provenance = provenance(&solution, &options, &report, statistics.min_weight);
    Bake { baked, solution, report, answers }
}

/// What made a bake: the options as they were used, and the counts. No seconds: the same input gives the same bytes.
fn provenance(solution: &Solution, options: &BakeOptions, report: &BakeReport, min_weight: Option<f64>) -> Provenance {
    let bounces = solution.bounces.map_or_else(|| "all".to_owned(), |bounces| bounces.to_string());
    let min_weight = min_weight.map_or_else(|| "by leaf".to_owned(), |weight| weight.to_string());
    let option = |name: &str, value: String| (name.to_owned(), value);
    let count = |name: &str, value: usize| (name.to_owned(), value as f64);
    Provenance {
        program: PROGRAM.to_owned(),
        options: vec![
            option(TOLERANCE, options.tolerance.to_string()),
            option(BOUNCES, bounces),
            option(LINK_ERROR, solution.link_error.to_string()),
            option(DISCONTINUITIES, options.discontinuities.to_string()),
            option(WEIGHT, options.weight.name().to_owned()),
            option(MIN_WEIGHT, min_weight),
        ],
        statistics: vec![
            count("elements", report.elements),
            count("links", report.links),
            count("blockers", report.blockers),
            count("discontinuities found", report.discontinuities_found),
            count("discontinuities kept", report.discontinuities_kept),
            ("residual".to_owned(), report.residual),
        ],
    }
}

const BOUNCES: &str = "bounces";
const DISCONTINUITIES: &str = "discontinuities";
const LINK_ERROR: &str = "link-error";
const MIN_WEIGHT: &str = "min-weight";
const TOLERANCE: &str = "tolerance";
const WEIGHT: &str = "weight";

/// The options that a bake was made with, so that it can be made again.
pub fn light_flags(provenance: &Provenance) -> LightFlags {
    let value =
        |name: &str| provenance.options.iter().find(|(option, _)| option == name).map(|(_, value)| value.as_str());
    let number = |name: &str| value(name).and_then(|value| value.parse().ok());
    let defaults = LightFlags::default();
    LightFlags {
        tolerance: number(TOLERANCE).unwrap_or(defaults.tolerance),
        bounces: value(BOUNCES).and_then(|value| value.parse().ok()),
        discontinuities: value(DISCONTINUITIES).and_then(|value| value.parse().ok()),
        weight: if value(WEIGHT) == Some(Weight::Ratio.name()) { WeightChoice::Ratio } else { WeightChoice::Change },
        min_weight: number(MIN_WEIGHT),
        link_error: number(LINK_ERROR),
    }
}

/// What one bake took and gave; `bake --json` prints it.
#[derive(Debug, Serialize)]
pub struct BakeReport {
    /// Polygons of the scene.
    pub polygons: usize,
    /// Polygons after they were cut along their contact lines.
    pub patches: usize,
    /// Leaf elements.
    pub elements: usize,
    /// Links between elements.
    pub links: usize,
    /// Bytes of the links.
    pub link_bytes: usize,
    /// Polygons named in the links' blocker lists, each distinct list counted once.
    pub blockers: usize,
    /// Bytes of the blocker lists.
    pub blocker_bytes: usize,
    /// Gathers over all links.
    pub iterations: u32,
    /// Power that the last gather still moved, as a fraction of the power that leaves all surfaces.
    pub residual: f64,
    /// Whether the residual, or the number of bounces, that was asked for was reached.
    pub converged: bool,
    /// Actual discontinuities found.
    pub discontinuities_found: usize,
    /// Discontinuities that the mesh follows.
    pub discontinuities_kept: usize,
    /// Triangles.
    pub triangles: usize,
    /// Irradiance samples, each evaluated once.
    pub samples: usize,
    /// Points at which reflectors were looked at.
    pub rows: usize,
    /// Rounds of meshing and measurement.
    pub rounds: u32,
    /// Errors as they were measured, relative to max(own, mean) irradiance.
    pub error: ErrorReport,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// Bytes held by the tables of a bake at most, as `--max-memory` counts them.
    pub counted_memory_bytes: usize,
    /// Largest part of memory held, bytes; null where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// [`BakedError`] as JSON names it.
#[derive(Debug, Serialize)]
pub struct ErrorReport {
    /// Root of the area-weighted mean square.
    pub rms: f64,
    /// 99th percentile by area.
    pub p99: f64,
    /// Largest.
    pub max: f64,
    /// Number of points compared.
    pub points: u64,
    /// Whether the tolerance is kept.
    pub holds: bool,
}

impl ErrorReport {
    /// The errors in words.
    pub fn text(&self) -> String {
        if self.points == 0 && !self.holds {
            return "none: the bake was stopped before".to_owned();
        }
        format!(
            "{:.3} % rms, {:.3} % at 99 %, {:.3} % at most, over {} points: the tolerance is {}",
            100.0 * self.rms,
            100.0 * self.p99,
            100.0 * self.max,
            self.points,
            if self.holds { "kept" } else { "not kept" }
        )
    }
}

impl From<BakedError> for ErrorReport {
    fn from(BakedError { rms, p99, max, points, holds }: BakedError) -> Self {
        Self { rms, p99, max, points, holds }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_options_of_a_solution_are_read_back() {
        let options = |bounces: &str, error: &str| Provenance {
            options: vec![(BOUNCES.into(), bounces.into()), (LINK_ERROR.into(), error.into())],
            ..Provenance::default()
        };
        let flags = light_flags(&options("all", "0.30000000000000004"));
        assert_eq!((flags.bounces, flags.link_error), (None, Some(0.300_000_000_000_000_04)));
        assert_eq!(light_flags(&options("0", "x")).bounces, Some(0));
        assert_eq!(light_flags(&Provenance::default()).link_error, None);
    }
}
