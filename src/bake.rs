//! `halflight bake`: a scene's light, solved and stored.

use std::time::Instant;

use anyhow::Result;
use serde::Serialize;

use crate::args::BakeFlags;
use crate::failure::Outcome;
use crate::input::{read_scene, require_light};
use crate::output::Outputs;
use crate::pipeline::{self, BakeReport};
use crate::progress::say;
use crate::report::{peak_memory, print_json};

/// Bakes a scene into a file.
pub fn run(flags: &BakeFlags, outputs: &Outputs) -> Result<Outcome> {
    let output = outputs.claim(&flags.output)?;
    let (scene, import_seconds) = read_scene(&flags.scene)?;
    require_light(&flags.scene, &scene)?;
    let (baked, mut report) = pipeline::bake(&scene, &flags.light);
    let start = Instant::now();
    output.write(|path| formats::write_baked(path, &baked))?;
    report.seconds.import = import_seconds;
    report.seconds.write = start.elapsed().as_secs_f64();
    report.peak_memory_bytes = peak_memory();
    if flags.json {
        print_json(&BakeJson { program: pipeline::PROGRAM, report: &report })?;
    } else {
        say(summary(&report, output.path()));
    }
    Ok(Outcome::Done)
}

#[derive(Serialize)]
struct BakeJson<'a> {
    program: &'static str,
    #[serde(flatten)]
    report: &'a BakeReport,
}

fn summary(report: &BakeReport, path: &std::path::Path) -> String {
    format!(
        "{} elements, {} links, {} of {} discontinuities, {} triangles; error {:.2} % rms, {:.2} % at 99 %: {}",
        report.elements,
        report.links,
        report.discontinuities_kept,
        report.discontinuities_found,
        report.triangles,
        100.0 * report.error.rms,
        100.0 * report.error.p99,
        path.display()
    )
}
