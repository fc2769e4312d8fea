//! What bakes cost as scenes grow: a generated hall of boxes at constant density, baked to one measured error at every size.
//!
//! `cargo bench --bench growth` prints a page for data/record/; `cargo bench --bench growth -- 1000 256000` takes other sizes.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;
#[allow(unused_imports, reason = "halls alone, no rooms")]
#[path = "common/generated/mod.rs"]
mod generated;

use std::path::Path;
use std::time::Instant;

use common::{halflight, machine, scratch};
use serde_json::Value;

/// Polygons asked for, where the command line names none.
const SIZES: [u32; 4] = [1_000, 4_000, 16_000, 64_000];

/// The relative root mean square error that `verify` is to find at every size, and how far off it may be, as a part of it: `verify` knows it
/// no better.
const ERROR: f64 = 0.03;
const NEAR: f64 = 0.05;

/// The tolerance of the first bake of a size, and bakes of it at most.
const FIRST_TOLERANCE: f64 = 0.06;
const BAKES: u32 = 5;

/// How the tolerance follows the error that was found: in halls their logarithms are in this ratio.
const FOLLOWS: f64 = 1.8;

/// No second round is begun after so long: large halls would take several for the last of the error.
const SECONDS: &str = "15";

/// Points at which a bake is held against paths.
const POINTS: &str = "2000";

fn main() {
    let asked: Vec<u32> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if asked.is_empty() { SIZES.to_vec() } else { asked };
    println!("# A hall that grows\n");
    println!("{}", machine());
    println!("Command: `cargo bench --bench growth`, {}.\n", env!("CARGO_PKG_VERSION"));
    println!(
        "`bake --max-seconds {SECONDS}` of `hall` in benches/common/generated, at tolerances by which `verify --points {POINTS}` finds"
    );
    println!(
        "{:.0} %, one run each; rows are points at which reflectors were looked at, entries of memory by far the most.\n",
        100.0 * ERROR
    );
    println!("| polygons | tolerance | seconds | MB | triangles | rows | rounds | claimed rms | measured rms |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let (mut times, mut memory) = (Vec::new(), Vec::new());
    for size in sizes {
        let scene = generated::hall(size);
        let (model, output) = (scratch("growth.obj"), scratch("growth.hlf"));
        std::fs::write(scratch("growth.mtl"), generated::mtl(&scene)).unwrap();
        std::fs::write(&model, generated::obj(&scene, "growth.mtl")).unwrap();
        let mut tolerance = FIRST_TOLERANCE;
        let mut nearest: Option<Measured> = None;
        for _ in 0..BAKES {
            let measured = measure(&model, &output, tolerance);
            let times = ERROR / measured.error();
            tolerance *= times.powf(FOLLOWS).clamp(0.4, 2.0);
            let off = |measured: &Measured| (ERROR / measured.error()).ln().abs();
            if nearest.as_ref().is_none_or(|nearest| off(&measured) < off(nearest)) {
                nearest = Some(measured);
            }
            if (times - 1.0).abs() < NEAR {
                break;
            }
        }
        let Measured { tolerance, seconds, report, found } = nearest.unwrap();
        let polygons = scene.polygons.len() as f64;
        let bytes = report["peak_memory_bytes"].as_f64().unwrap_or(0.0);
        let percent = |value: &Value| format!("{:.2} %", 100.0 * value.as_f64().unwrap_or(f64::NAN));
        println!(
            "| {polygons} | {tolerance:.3} | {seconds:.1} | {:.0} | {} | {} | {} | {} | {} ± {} |",
            bytes * 1e-6,
            report["triangles"],
            report["rows"],
            report["rounds"],
            percent(&report["error"]["rms"]),
            percent(&found["relative_rmse"]),
            percent(&found["standard_error"]),
        );
        times.push((polygons.ln(), seconds.ln()));
        memory.push((polygons.ln(), bytes.ln()));
    }
    if times.len() > 1 {
        println!("\nExponents over polygons: time {:.2}, memory {:.2}.", slope(&times), slope(&memory));
    }
}

/// A bake, and what was found of it.
struct Measured {
    tolerance: f64,
    seconds: f64,
    report: Value,
    found: Value,
}

impl Measured {
    fn error(&self) -> f64 {
        self.found["relative_rmse"].as_f64().unwrap()
    }
}

/// Bakes a model, and holds it against paths.
fn measure(model: &Path, output: &Path, tolerance: f64) -> Measured {
    let [model, output] = [model, output].map(|path| path.to_str().unwrap());
    let start = Instant::now();
    let asked = tolerance.to_string();
    let bake = ["bake", model, "-o", output, "--tolerance", &asked, "--max-seconds", SECONDS, "--json"];
    let report = serde_json::from_slice(&halflight(&bake).stdout).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let verify = ["verify", output, "--points", POINTS, "--json"];
    let found = serde_json::from_slice(&halflight(&verify).stdout).unwrap();
    Measured { tolerance, seconds, report, found }
}

/// Slope of the line that fits best.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    mean(&|point| (point.0 - x) * (point.1 - y)) / mean(&|point| (point.0 - x).powi(2))
}
