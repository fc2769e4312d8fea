//! The figures of Hardt & Teller 1996, section 7, beside this project's, on the machine at hand.
//!
//! `cargo bench --bench paper` prints a page for data/record/.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;

use scene::Baked;
use serde_json::Value;
use viewer::{Capture, Frame, FrameTimes, Gpu, Mode, Twin};

/// Frames of which the median counts.
const FRAMES: usize = 41;

/// The parameters that the paper states for its office.
/// And a tolerance that asks for no refinement, which the paper has none of.
const OF_THE_PAPER: [&str; 10] = [
    "--link-error",
    "0.1",
    "--discontinuities",
    "10",
    "--weight",
    "ratio",
    "--min-weight",
    "100",
    "--tolerance",
    "0.5",
];

fn main() {
    println!("# The paper's figures and ours\n");
    println!("{}", common::machine());
    println!("Command: `cargo bench --bench paper`, {}.\n", env!("CARGO_PKG_VERSION"));
    let (paper, baked) = bake(&OF_THE_PAPER);
    let (default, _) = bake(&[]);
    println!("| data/scenes/office.obj | the paper (4 × 250 MHz) | its parameters | default parameters |");
    println!("|---|---|---|---|");
    let row = |name: &str, theirs: &str, ours: &dyn Fn(&Value) -> String| {
        println!("| {name} | {theirs} | {} | {} |", ours(&paper), ours(&default));
    };
    let count = |name: &'static str| move |report: &Value| report[name].to_string();
    let seconds =
        |name: &'static str| move |report: &Value| format!("{:.2} s", report["seconds"][name].as_f64().unwrap());
    row("polygons", "about 60", &count("polygons"));
    row("elements", "1622", &count("elements"));
    row("links", "–", &count("links"));
    row("discontinuities followed", "–", &count("discontinuities_kept"));
    row("triangles", "6576", &count("triangles"));
    row("solve", "< 2 min", &seconds("solve"));
    row("mesh and interpolants", "2.5 h", &seconds("mesh"));
    row("measured error, rms", "–", &|report| format!("{:.3} %", 100.0 * report["error"]["rms"].as_f64().unwrap()));
    row("peak memory", "–", &|report| {
        report["peak_memory_bytes"].as_u64().map_or("–".to_owned(), |bytes| format!("{} MB", bytes >> 20))
    });
    println!(
        "\nThe bake with the paper's parameters, drawn; median of {FRAMES} frames, tone map and read-back included.\n"
    );
    println!("| drawn by | picture | mode | milliseconds | frames/s (the paper: 2.3 at 640 × 480) |");
    println!("|---|---|---|---|---|");
    let gpu = Gpu::headless().ok();
    let twin = Twin::new(&baked);
    for (width, height) in [(640, 480), (1920, 1080)] {
        for mode in [Mode::Shaded, Mode::Gouraud] {
            let frame = Frame {
                camera: baked.scene.cameras[0].camera,
                width,
                height,
                mode,
                exposure: None,
                curve: scene::ToneCurve::default(),
            };
            let line = |name: &str, frames: Vec<FrameTimes>| {
                let milliseconds = FrameTimes::medians(&frames).unwrap().frame_ms;
                let rate = 1000.0 / milliseconds;
                println!("| {name} | {width} × {height} | {} | {milliseconds:.1} | {rate:.1} |", mode.name());
            };
            line("CPU", (0..FRAMES).map(|_| twin.draw_timed(&frame).1).collect());
            if let Some(gpu) = &gpu {
                let capture = Capture::new(gpu, &baked, &twin, width, height).unwrap();
                line(&gpu.adapter_name(), (0..FRAMES).map(|_| capture.time(&frame).unwrap()).collect());
            }
        }
    }
}

/// Bakes the office with the program itself: its report and the bake.
fn bake(options: &[&str]) -> (Value, Baked) {
    let output = common::scratch("paper.hlf");
    let report = common::bake("office", options, &output);
    (report, formats::read_baked(&output).unwrap())
}
