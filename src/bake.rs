//! `halflight bake`: a scene's light, solved and stored.

use std::time::Instant;

use anyhow::Result;
use formats::Imported;
use scene::{Answers, Baked, BakedError};
use serde::Serialize;

use crate::args::BakeFlags;
use crate::failure::Outcome;
use crate::input::{read_scene, require_light};
use crate::interrupt::Interrupt;
use crate::memory;
use crate::output::Outputs;
use crate::pipeline::{self, BakeReport};
use crate::progress::say;
use crate::report::{peak_memory, print_json};
use crate::resume::{Resumed, unfinished};

/// Bakes a scene into a file.
pub fn run(flags: &BakeFlags, outputs: &Outputs, interrupt: &Interrupt) -> Result<Outcome> {
    let output = outputs.claim(&flags.output)?;
    let resumed = if flags.resume { Some(Resumed::read(flags)?) } else { None };
    memory::check_file(flags)?;
    let (Imported { scene, .. }, import_seconds) = read_scene(&flags.scene, &flags.reading)?;
    require_light(&flags.scene, &scene)?;
    memory::check_scene(flags, scene.polygons.len())?;
    let answers = resumed.map_or_else(|| Ok(Answers::default()), |resumed| resumed.answers_about(&scene, flags))?;
    let known = answers.count();
    let pipeline::Bake { baked, mut report, answers, .. } =
        pipeline::resume(&scene, &flags.light, &flags.limits, answers, interrupt, None);
    let start = Instant::now();
    let interrupted = answers.is_some();
    match answers {
        // The file has as much already, and maybe a better bake: this one has not come as far.
        Some(answers) if flags.resume && answers.count() <= known => {
            say(format_args!("interrupted before anything new was found: {} stays as it was", output.path().display()));
            return Ok(Outcome::Interrupted);
        }
        Some(answers) => {
            let unfinished = unfinished(answers, flags)?;
            output.write(|path| formats::write_unfinished(path, &baked, &unfinished))?;
        }
        None => output.write(|path| formats::write_baked(path, &baked))?,
    }
    report.seconds.import = import_seconds;
    report.seconds.write = start.elapsed().as_secs_f64();
    report.peak_memory_bytes = peak_memory();
    if flags.json {
        print_json(&BakeJson { program: pipeline::PROGRAM, interrupted, report: &report })?;
    } else {
        say(summary(&report, &baked, output.path()));
    }
    if interrupted {
        say("interrupted; what was found is kept: the same command with --resume goes on");
        return Ok(Outcome::Interrupted);
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
        "the bake does not keep --tolerance {tolerance}: it was measured at {}; allow it more triangles, seconds or memory, or a \
         larger tolerance",
        measured(baked.error)
    )
}

/// An error in words.
fn measured(error: BakedError) -> String {
    if error.points == 0 {
        return "no point".to_owned();
    }
    format!("{:.2} % rms, {:.2} % at 99 %", 100.0 * error.rms, 100.0 * error.p99)
}

#[derive(Serialize)]
struct BakeJson<'a> {
    program: &'static str,
    interrupted: bool,
    #[serde(flatten)]
    report: &'a BakeReport,
}

fn summary(report: &BakeReport, baked: &Baked, path: &std::path::Path) -> String {
    format!(
        "{} elements, {} links, {} of {} discontinuities, {} triangles; error measured at {}: {}",
        report.elements,
        report.links,
        report.discontinuities_kept,
        report.discontinuities_found,
        report.triangles,
        measured(baked.error),
        path.display()
    )
}
