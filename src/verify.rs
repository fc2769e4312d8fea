//! `halflight verify`: a bake against an independent, path-traced reference, at random points of all surfaces.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use formats::FormatError;
use renderer::{SurfacePoint, spread_by_area};
use scene::{Baked, Camera, Provenance, Rgb};
use serde::Serialize;

use crate::args::{LightFlags, VerifyFlags};
use crate::error_picture::error_picture;
use crate::failure::{Outcome, Usage};
use crate::ground_truth::{Truth, TruthOptions, ground_truth};
use crate::input::{Input, require_light};
use crate::output::Outputs;
use crate::pipeline;
use crate::probe::REACH;
use crate::progress::say;
use crate::report::print_json;
use crate::shot::camera;
use crate::verification::{Comparison, Verification, verify};

/// Distance that points keep from the edges of their polygon, as a fraction of the scene's size: above the rounding of
/// the mesh's positions, below any triangle that counts.
const BORDER: f64 = 1e-6;

/// Number of points listed with the largest errors.
const WORST: usize = 10;

/// Name of the option that a bake's file keeps its tolerance under.
const TOLERANCE: &str = "tolerance";

/// Holds a bake against paths, prints what it is off by, and says whether it keeps its tolerance.
pub fn run(flags: &VerifyFlags, outputs: &Outputs) -> Result<Outcome> {
    let viewpoint = flags.camera.viewpoint()?;
    let picture = flags.picture.as_deref().map(|path| outputs.claim(path)).transpose()?;
    let table = flags.output.as_deref().map(|path| outputs.claim(path)).transpose()?;
    let input = Input::read(&flags.input, &flags.reading)?;
    let defaults = LightFlags::default();
    let asked = LightFlags { tolerance: flags.tolerance.unwrap_or(defaults.tolerance), ..defaults };
    let baked = input.into_baked(&flags.input, &asked, outputs)?;
    require_light(&flags.input, &baked.scene)?;
    let tolerance = tolerance(flags.tolerance, &baked.provenance, &flags.input)?;
    let camera = picture.is_some().then(|| camera(&viewpoint, &baked.scene)).transpose()?;

    let scene = &baked.scene;
    // The paths' seeds are 64 times the seed and more; the points' own is none of them.
    let points = spread_by_area(scene, flags.points, BORDER * scene.size(), flags.seed.wrapping_mul(64), |_| true);
    let found = interpolate(&baked, &points);
    let bounces = pipeline::light_flags(&baked.provenance).bounces;
    let options = TruthOptions { samples: flags.samples, bounces, tolerance, seed: flags.seed };
    let truth = ground_truth(scene, &points, &found, &options);
    ensure!(
        !truth.comparisons.is_empty(),
        "{}: no light reaches any of {} points; check that the emitters' fronts face the scene",
        flags.input.display(),
        points.len()
    );
    let verification = verify(&truth.comparisons, tolerance, WORST);
    let report = Report::of(&baked, &points, &truth, &verification, tolerance);
    say(format_args!(
        "{} paths a point; their noise is {:.2} % at one point{}",
        report.samples,
        100.0 * verification.noise,
        if truth.precise { "" } else { ", more than the tolerance asks for: give more --samples or more --points" }
    ));
    if let Some(table) = table {
        table.write(|path| formats::write_atomically(path, |file| write_table(file, &points, &truth.comparisons)))?;
    }
    if let (Some(picture), Some(camera)) = (picture, camera) {
        let (width, height): (u32, u32) = flags.size;
        let view: (&Camera, u32, u32) = (&camera, width, height);
        let pixels = error_picture(scene, view, &points, &truth.comparisons, tolerance);
        picture.write(|path| formats::write_png(path, width, height, &pixels))?;
    }
    if flags.json {
        print_json(&report)?;
    } else {
        std::io::stdout().lock().write_all(report.text().as_bytes()).context("cannot write to stdout")?;
    }
    Ok(if verification.holds() { Outcome::Done } else { Outcome::Differs })
}

/// The tolerance given, or the one that the bake was made for.
fn tolerance(given: Option<f64>, provenance: &Provenance, input: &Path) -> Result<f64> {
    let baked_for = || {
        let (_, value) = provenance.options.iter().find(|(name, _)| name == TOLERANCE)?;
        value.parse().ok().filter(|tolerance: &f64| *tolerance > 0.0 && *tolerance < 1.0)
    };
    given.or_else(baked_for).ok_or_else(|| {
        let cause = format!(
            "{} does not say the tolerance that it was baked for; give the one that it must keep, such as \
             --tolerance 0.01 for 1 %",
            input.display()
        );
        Usage(cause).into()
    })
}

/// The bake's irradiance at points of its scene, W·m⁻². Where the mesh has a hole there is none, as in a picture.
fn interpolate(baked: &Baked, points: &[SurfacePoint]) -> Vec<Rgb> {
    let (bvh, reach) = (baked.bvh(), REACH * baked.scene.size());
    let irradiance = |point: &SurfacePoint| {
        let (triangle, s, t) = baked.locate(&bvh, point.position, point.normal, reach)?;
        Some(baked.irradiance(triangle, s, t))
    };
    let found: Vec<Option<Rgb>> = points.iter().map(irradiance).collect();
    let holes = found.iter().filter(|irradiance| irradiance.is_none()).count();
    if holes > 0 {
        say(format_args!(
            "warning: {holes} of {} points meet no triangle of the mesh; they count as dark",
            points.len()
        ));
    }
    found.into_iter().map(Option::unwrap_or_default).collect()
}

/// One row a point: place, normal, polygon, the bake's irradiance, the reference and its standard error, W·m⁻². The
/// columns have the names that `probe` and the tables of data/reference/ give them.
fn write_table(to: &mut dyn Write, points: &[SurfacePoint], comparisons: &[Comparison]) -> Result<(), FormatError> {
    writeln!(to, "x,y,z,nx,ny,nz,polygon,er,eg,eb,E_r,E_g,E_b,se_r,se_g,se_b")?;
    for (point, comparison) in points.iter().zip(comparisons) {
        let [x, y, z] = point.position.to_array();
        let [nx, ny, nz] = point.normal.to_array();
        write!(to, "{x:?},{y:?},{z:?},{nx:?},{ny:?},{nz:?},{}", point.polygon)?;
        for colour in [comparison.found, comparison.truth, comparison.standard_error()] {
            write!(to, ",{:?},{:?},{:?}", colour.x, colour.y, colour.z)?;
        }
        writeln!(to)?;
    }
    Ok(to.flush()?)
}

/// What `verify` prints. Errors are fractions, relative to max(own, mean) irradiance.
#[derive(Serialize)]
struct Report {
    relative_rmse: f64,
    standard_error: f64,
    /// Percentiles of the difference from the reference, whose noise is in them.
    p50: f64,
    p95: f64,
    p99: f64,
    bias: f64,
    bias_standard_error: f64,
    /// Relative standard error of the reference at one point, root mean square; removed from the relative RMSE.
    noise: f64,
    points: usize,
    /// Paths a point, on average.
    samples: u64,
    /// Interreflections; null is all.
    bounces: Option<u32>,
    tolerance: f64,
    /// What one point in a hundred may exceed.
    percentile_limit: f64,
    /// Points that exceed it by more than noise explains.
    beyond: usize,
    rmse_holds: bool,
    percentile_holds: bool,
    holds: bool,
    worst: Vec<Worst>,
}

/// One of the points with the largest errors.
#[derive(Serialize)]
struct Worst {
    error: f64,
    /// Place, metres.
    position: [f64; 3],
    normal: [f64; 3],
    polygon: u32,
    object: String,
    /// Irradiance of the bake, W·m⁻².
    irradiance: [f64; 3],
    /// The reference, and its standard error.
    reference: [f64; 3],
    standard_error: [f64; 3],
}

impl Report {
    fn of(baked: &Baked, points: &[SurfacePoint], truth: &Truth, found: &Verification, tolerance: f64) -> Self {
        let scene = &baked.scene;
        let worst = |&index: &usize| {
            let (point, comparison) = (&points[index], &truth.comparisons[index]);
            Worst {
                error: comparison.error(),
                position: point.position.to_array(),
                normal: point.normal.to_array(),
                polygon: point.polygon,
                object: scene.objects[scene.polygons[point.polygon as usize].object as usize].clone(),
                irradiance: comparison.found.to_array(),
                reference: comparison.truth.to_array(),
                standard_error: comparison.standard_error().to_array(),
            }
        };
        Self {
            relative_rmse: found.relative_rmse,
            standard_error: found.standard_error,
            p50: found.percentiles.p50,
            p95: found.percentiles.p95,
            p99: found.percentiles.p99,
            bias: found.bias,
            bias_standard_error: found.bias_standard_error,
            noise: found.noise,
            points: points.len(),
            samples: truth.paths / points.len().max(1) as u64,
            bounces: pipeline::light_flags(&baked.provenance).bounces,
            tolerance,
            percentile_limit: found.percentile_limit,
            beyond: found.beyond,
            rmse_holds: found.rmse_holds,
            percentile_holds: found.percentile_holds,
            holds: found.holds(),
            worst: found.worst.iter().map(worst).collect(),
        }
    }

    fn text(&self) -> String {
        let percent = |fraction: f64| format!("{:.3} %", 100.0 * fraction);
        let verdict = |holds: bool| if holds { "holds" } else { "does not hold" };
        let light = match self.bounces {
            None => "all light".to_owned(),
            Some(0) => "direct light".to_owned(),
            Some(bounces) => format!("light of {bounces} bounces"),
        };
        let mut text = format!(
            "compared         {light} at {} points, {} paths each\n\
             relative RMSE    {} ± {}; tolerance {}: {}\n\
             percentiles      {} at 50 %, {} at 95 %, {} at 99 %, noise in them\n\
             beyond {:<9} {} points for certain, {:.0} may be: {}\n\
             bias             {:+.3} % ± {}\n\
             noise            {} at a point, removed from the relative RMSE\n\
             verdict          {}\n\
             worst points     irradiance and reference ± standard error are means over the colours, W/m²\n\
             {:>10} {:>10} {:>10} {:>9} {:>24} {:>17} {:>7}  object\n",
            self.points,
            self.samples,
            percent(self.relative_rmse),
            percent(self.standard_error),
            percent(self.tolerance),
            verdict(self.rmse_holds),
            percent(self.p50),
            percent(self.p95),
            percent(self.p99),
            format!("{:.1} %", 100.0 * self.percentile_limit),
            self.beyond,
            0.01 * self.points as f64,
            verdict(self.percentile_holds),
            100.0 * self.bias,
            percent(self.bias_standard_error),
            percent(self.noise),
            verdict(self.holds),
            "error",
            "irradiance",
            "reference",
            "±",
            "place, m",
            "normal",
            "polygon"
        );
        let mean = |colour: &[f64; 3]| colour.iter().sum::<f64>() / 3.0;
        for point in &self.worst {
            text += &format!(
                "{:>10} {:>10.5} {:>10.5} {:>9.5} {:>24} {:>17} {:>7}  {}\n",
                percent(point.error),
                mean(&point.irradiance),
                mean(&point.reference),
                mean(&point.standard_error),
                point.position.map(|x| format!("{x:.4}")).join(","),
                point.normal.map(|x| format!("{:.2}", x + 0.0)).join(","),
                point.polygon,
                point.object
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_tolerance_is_the_one_given_or_the_bakes_own_or_missing() {
        let baked_for =
            |value: &str| Provenance { options: vec![(TOLERANCE.into(), value.into())], ..Provenance::default() };
        let path = Path::new("a.hlf");
        assert_eq!(tolerance(Some(0.02), &baked_for("0.01"), path).unwrap(), 0.02);
        assert_eq!(tolerance(None, &baked_for("0.01"), path).unwrap(), 0.01);
        for provenance in [Provenance::default(), baked_for("none"), baked_for("nan"), baked_for("-1")] {
            let error = tolerance(None, &provenance, path).unwrap_err();
            assert!(error.is::<Usage>() && error.to_string().contains("--tolerance 0.01"), "{error}");
        }
    }
}
