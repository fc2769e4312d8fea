//! Tolerances asked for, beside what they cost and what they keep: whole bakes, by the program itself.
//!
//! `cargo bench --bench tolerance` prints a page for data/record/.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;

use std::time::Instant;

use common::irradiance_error::{ErrorOfPoints, Table};
use common::{bake, file, halflight, machine, median, scratch, seconds_of_programs};
use serde_json::Value;

/// The scenes that have a reference in data/reference/.
const SCENES: [&str; 2] = ["office", "cornell_box"];

/// `bake --tolerance`: from a preview to what a photograph resolves.
const TOLERANCES: [&str; 5] = ["0.1", "0.03", "0.01", "0.005", "0.003"];

/// Bakes of which the median time counts.
const TURNS: usize = 3;

fn main() {
    println!("# Tolerance, cost and error\n");
    println!("{}", machine());
    println!("Command: `cargo bench --bench tolerance`, {}.\n", env!("CARGO_PKG_VERSION"));
    println!(
        "Whole bakes from the scene's file to the bake's, median of {TURNS}; CPU seconds are user and system time."
    );
    println!("Claimed is the error that the bake measured of itself, rms and 99th percentile; measured is that of");
    println!("`halflight probe` at the points of data/reference/, less the reference's own variance.");
    for scene in SCENES {
        let reference = file(&format!("data/reference/{scene}.csv"));
        let truth = Table::read(&reference);
        println!("\n## {scene}\n");
        println!("| tolerance | seconds | CPU seconds | triangles | bytes | claimed rms, 99 % | measured rms, 99 % |");
        println!("|---|---|---|---|---|---|---|");
        for tolerance in TOLERANCES {
            let (output, probed) = (scratch("tolerance.hlf"), scratch("tolerance.csv"));
            let (mut seconds, mut cpu_seconds, mut report) = (Vec::new(), Vec::new(), Value::Null);
            for _ in 0..TURNS {
                let (start, cpu_start) = (Instant::now(), seconds_of_programs());
                report = bake(scene, &["--tolerance", tolerance], &output);
                seconds.push(start.elapsed().as_secs_f64());
                cpu_seconds.extend(seconds_of_programs().zip(cpu_start).map(|(end, start)| end - start));
            }
            let [bake, points, probe] = [&output, &reference, &probed].map(|path| path.to_str().unwrap());
            halflight(&["probe", bake, "--points", points, "-o", probe]);
            let claimed = |name: &str| report["error"][name].as_f64().map_or("–".to_owned(), percent);
            let measured = ErrorOfPoints::of(&truth, &Table::read(&probed));
            println!(
                "| {tolerance} | {:.2} | {} | {} | {} | {}, {} | {}, {} |",
                median(seconds),
                if cpu_seconds.is_empty() { "–".to_owned() } else { format!("{:.2}", median(cpu_seconds)) },
                report["triangles"],
                std::fs::metadata(&output).unwrap().len(),
                claimed("rms"),
                claimed("p99"),
                percent(measured.rms),
                percent(measured.p99),
            );
        }
    }
}

fn percent(fraction: f64) -> String {
    format!("{:.2} %", 100.0 * fraction)
}
