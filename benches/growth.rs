//! What bakes cost as scenes grow: a generated hall of boxes at constant density, baked to one tolerance at every size.
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

/// The error that is asked for: halls are then off by 3 to 5 %, which nobody sees in a hall.
const TOLERANCE: &str = "0.1";

/// No second round is begun after so long: large halls would take several for the last of the error.
const SECONDS: &str = "15";

/// Points at which a bake is held against paths.
const POINTS: &str = "1000";

fn main() {
    let asked: Vec<u32> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if asked.is_empty() { SIZES.to_vec() } else { asked };
    println!("# A hall that grows\n");
    println!("{}", machine());
    println!("Command: `cargo bench --bench growth`, {}.\n", env!("CARGO_PKG_VERSION"));
    println!(
        "`bake --tolerance {TOLERANCE} --max-seconds {SECONDS}` of `hall` in benches/common/generated, one run each; rows are points at which"
    );
    println!("reflectors were looked at, entries of memory by far the most. Measured by `verify --points {POINTS}`.\n");
    println!("| polygons | seconds | MB | triangles | rows | rounds | claimed rms | measured rms |");
    println!("|---|---|---|---|---|---|---|---|");
    let (mut times, mut memory) = (Vec::new(), Vec::new());
    for size in sizes {
        let scene = generated::hall(size);
        let (model, output) = (scratch("growth.obj"), scratch("growth.hlf"));
        std::fs::write(scratch("growth.mtl"), generated::mtl(&scene)).unwrap();
        std::fs::write(&model, generated::obj(&scene, "growth.mtl")).unwrap();
        let polygons = scene.polygons.len() as f64;
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        let start = Instant::now();
        let bake =
            ["bake", &text(&model), "-o", &text(&output), "--tolerance", TOLERANCE, "--max-seconds", SECONDS, "--json"];
        let report: Value = serde_json::from_slice(&halflight(&bake).stdout).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let verify = ["verify", &text(&output), "--points", POINTS, "--json"];
        let found: Value = serde_json::from_slice(&halflight(&verify).stdout).unwrap();
        let bytes = report["peak_memory_bytes"].as_f64().unwrap_or(0.0);
        let percent = |value: &Value| format!("{:.2} %", 100.0 * value.as_f64().unwrap_or(f64::NAN));
        println!(
            "| {polygons} | {seconds:.1} | {:.0} | {} | {} | {} | {} | {} ± {} |",
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
    println!("\nExponents over polygons: time {:.2}, memory {:.2}.", slope(&times), slope(&memory));
}

/// Slope of the line that fits best.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    mean(&|point| (point.0 - x) * (point.1 - y)) / mean(&|point| (point.0 - x).powi(2))
}
