//! `halflight bake`: a scene's light, solved and stored.

use std::time::Instant;

use anyhow::Result;
use formats::Imported;
use scene::Baked;
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
    let (Imported { scene, .. }, import_seconds) = read_scene(&flags.scene, flags.reading)?;
    require_light(&flags.scene, &scene)?;
    let pipeline::Bake { baked, mut report, .. } = pipeline::bake(&scene, &flags.light, &flags.limits);
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
    if baked.error.holds {
        return Ok(Outcome::Done);
    }
    say(format_args!("warning: {}", missed(&baked, flags.light.tolerance)));
    Ok(Outcome::Differs)
}

/// Says of a bake that does not keep its tolerance what it reached, and the cure.
pub fn missed(baked: &Baked, tolerance: f64) -> String {
    format!(
        "the bake does not keep --tolerance {tolerance}: it was measured at {:.2} % rms and {:.2} % at 99 %; allow it more \
         triangles or seconds, or a larger tolerance",
        100.0 * baked.error.rms,
        100.0 * baked.error.p99
    )
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
