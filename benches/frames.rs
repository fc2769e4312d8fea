//! What frames take: interpolants beside Gouraud colours, the host beside the adapter's shaders, and the first frame.
//!
//! `cargo bench --bench frames` prints a page for data/record/. Frames that are set side by side are drawn in turn, so that what
//! else the machine does comes to both; a ratio is the median of those of neighbours. CPU is the time of all threads.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;
#[allow(unused_imports, reason = "halls alone, no rooms")]
#[path = "common/generated/mod.rs"]
mod generated;

use std::path::{Path, PathBuf};

use common::{bake, halflight, machine, median, scratch};
use scene::Baked;
use serde_json::Value;
use viewer::{Capture, Evaluator, Frame, FrameTimes, Gpu, Mode, Twin};

/// Frames of every kind of which the median counts.
const FRAMES: usize = 41;

/// Starts of the program of which the median counts.
const STARTS: usize = 9;

const SIZES: [(u32, u32); 2] = [(640, 480), (1920, 1080)];

/// A kind of frame: who evaluates it, and what it shows.
type Kind = (Evaluator, Mode);

const GOURAUD: Kind = (Evaluator::Host, Mode::Gouraud);
const KINDS: [Kind; 3] = [GOURAUD, (Evaluator::Host, Mode::Shaded), (Evaluator::Adapter, Mode::Shaded)];

/// Times of a frame, and milliseconds of all threads.
struct Measured {
    times: FrameTimes,
    cpu_ms: f64,
}

fn main() {
    let scenes = scenes();
    let gpus = [Evaluator::Host, Evaluator::Adapter].map(|evaluator| (evaluator, gpu(evaluator)));
    println!("# Frames\n");
    println!("{}", machine());
    println!("Adapter: {}.", gpus[0].1.adapter_name());
    println!("Command: `cargo bench --bench frames`, {}.\n", env!("CARGO_PKG_VERSION"));
    println!(
        "Milliseconds, medians of {FRAMES} frames of each kind, drawn in turn, from the camera to what a display shows in the"
    );
    println!(
        "host's memory. Gouraud: one indexed pass of vertex colours. Interpolants: by the host's threads, which is the default"
    );
    println!("on an adapter that is a CPU, and by the adapter's shaders. CPU: all threads.\n");
    println!(
        "| bake | triangles | picture | interpolants ÷ Gouraud | by CPU time | Gouraud | interpolants, host | by shaders |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut parts = Vec::new();
    for (name, path) in &scenes {
        let baked = formats::read_baked(path).unwrap();
        let twin = Twin::new(&baked);
        for size in SIZES {
            let measured = measure(&gpus, &baked, &twin, size);
            let [gouraud, host, _] = &measured;
            let ratio = |of: &dyn Fn(&Measured) -> f64| {
                median(host.iter().zip(gouraud).map(|(ours, theirs)| of(ours) / of(theirs)).collect())
            };
            let all = measured.each_ref().map(|frames| {
                let frame_ms = median(frames.iter().map(|frame| frame.times.frame_ms).collect());
                let cpu_ms = median(frames.iter().map(|frame| frame.cpu_ms).collect());
                format!("{frame_ms:.1} (CPU {cpu_ms:.1})")
            });
            println!(
                "| {name} | {} | {} × {} | {:.2} | {:.2} | {} |",
                baked.triangles.len(),
                size.0,
                size.1,
                ratio(&|frame| frame.times.frame_ms),
                ratio(&|frame| frame.cpu_ms),
                all.join(" | ")
            );
            for ((evaluator, mode), frames) in KINDS.into_iter().zip(&measured) {
                let times: Vec<FrameTimes> = frames.iter().map(|frame| frame.times.clone()).collect();
                let medians = FrameTimes::medians(&times).unwrap();
                let told = medians.parts_ms.iter().map(|(part, ms)| format!("{part} {ms:.1}"));
                let told = told.collect::<Vec<_>>().join(", ");
                let by = if (evaluator, mode) == GOURAUD { String::new() } else { format!(", {evaluator:?}") };
                parts.push(format!("| {name} | {} × {} | {mode}{} | {told} |", size.0, size.1, by.to_lowercase()));
            }
        }
    }
    println!("\nWhat of it the passes take:\n\n| bake | picture | frame | milliseconds |\n|---|---|---|---|");
    println!("{}", parts.join("\n"));
    println!("\nFrom the start of the program to the first frame, 640 × 480, medians of {STARTS} starts:\n");
    println!("| bake | milliseconds | read | adapter and bake made ready | drawn | CPU |");
    println!("|---|---|---|---|---|---|");
    for (name, path) in &scenes {
        first_frame(name, path);
    }
}

/// Bakes of some thousand, many thousand and a quarter of a million triangles.
fn scenes() -> Vec<(&'static str, PathBuf)> {
    let office = |name: &str, options: &[&str]| {
        let path = scratch(name);
        bake("office", options, &path);
        path
    };
    let (model, hall) = (scratch("frames.obj"), scratch("frames_hall.hlf"));
    let scene = generated::hall(16_000);
    std::fs::write(scratch("frames.mtl"), generated::mtl(&scene)).unwrap();
    std::fs::write(&model, generated::obj(&scene, "frames.mtl")).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    halflight(&["bake", &text(&model), "-o", &text(&hall), "--tolerance", "0.05", "--max-seconds", "15"]);
    vec![
        ("office, 0.2", office("frames_coarse.hlf", &["--tolerance", "0.2"])),
        ("office, 0.01", office("frames_office.hlf", &[])),
        ("hall of 16,638 polygons, 0.05", hall),
    ]
}

fn gpu(evaluator: Evaluator) -> Gpu {
    Gpu::headless().unwrap().with_evaluator(evaluator)
}

/// Frames of every kind, in turn.
fn measure(
    gpus: &[(Evaluator, Gpu); 2],
    baked: &Baked,
    twin: &Twin,
    (width, height): (u32, u32),
) -> [Vec<Measured>; 3] {
    let captures = gpus.each_ref().map(|(_, gpu)| Capture::new(gpu, baked, twin, width, height).unwrap());
    let frame = Frame {
        camera: baked.scene.cameras[0].camera,
        width,
        height,
        mode: Mode::Shaded,
        exposure: None,
        curve: scene::ToneCurve::default(),
    };
    let frame = Frame { exposure: Some(twin.meter(&frame)), ..frame };
    let mut measured = [(); 3].map(|()| Vec::new());
    // The first round compiles shaders and fills caches.
    for round in 0..=FRAMES {
        for ((evaluator, mode), frames) in KINDS.into_iter().zip(&mut measured) {
            let capture = &captures[gpus.iter().position(|(of, _)| *of == evaluator).unwrap()];
            let before = seconds(common::seconds_of_threads());
            let times = capture.time(&Frame { mode, ..frame }).unwrap();
            let cpu_ms = (seconds(common::seconds_of_threads()) - before) * 1e3;
            if round > 0 {
                frames.push(Measured { times, cpu_ms });
            }
        }
    }
    measured
}

fn first_frame(name: &str, path: &Path) {
    let arguments = ["shot", path.to_str().unwrap(), "--timing", "--frames", "1", "--json"];
    let mut columns = [(); 5].map(|()| Vec::new());
    for _ in 0..STARTS {
        let before = seconds(common::seconds_of_programs());
        let report: Value = serde_json::from_slice(&halflight(&arguments).stdout).unwrap();
        let cpu_ms = (seconds(common::seconds_of_programs()) - before) * 1e3;
        let start = |part: &str| report["start_ms"][part].as_f64().unwrap();
        let first = report["first_frame_ms"].as_f64().unwrap();
        for (column, value) in columns.iter_mut().zip([first, start("read"), start("set_up"), start("draw"), cpu_ms]) {
            column.push(value);
        }
    }
    let told = columns.map(|column| format!("{:.0}", median(column)));
    println!("| {name} | {} |", told.join(" | "));
}

/// No number where the system does not tell.
fn seconds(told: Option<f64>) -> f64 {
    told.unwrap_or(f64::NAN)
}
