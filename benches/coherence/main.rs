//! Directional coherence maps: the table of Guo 1998 again, beside adaptive sampling with as many samples.
//!
//! `cargo bench --workspace --bench coherence` prints a page for data/record/: direct light, exact at every pixel. `-- bounces`
//! gathers all light, in pictures of half the side, for half an hour of processor time; `-- relocation` compares pictures with
//! noise, `-- mirrors` those of flat and curved mirrors.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod discontinuities;
#[allow(unused_imports, reason = "of the scenes two are looked at")]
#[path = "../common/generated/mod.rs"]
mod generated;
mod mirrors;
mod pictures;
#[path = "../../src/point_gather.rs"]
mod point_gather;
mod relocation;

use glam::Vec3;
use pictures::{Compared, errors, picture, rmse, seen_at, timed};
use point_gather::PointGather;
use renderer::{AdaptiveOptions, AdaptiveSampler, Evaluator, Eye, Film, Filter};
use scene::{Bvh, Display, Exposure, ToneCurve, luminance};
use solver::{Gather, SolveOptions, Surroundings};

/// Side of the pictures, pixels.
const SIDE: u32 = 512;

/// Shares of the work image's pixels that pictures are made of.
const SHARES: [f64; 4] = [0.02, 0.03, 0.04, 0.06];

fn main() {
    let part = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    println!("# Directional coherence maps\n");
    println!("{}", common::machine());
    println!("Command: `cargo bench --workspace --bench coherence`, {}.\n", env!("CARGO_PKG_VERSION"));
    match part.as_deref() {
        None => tables(Some(0), SIDE),
        Some("bounces") => tables(None, SIDE / 2),
        Some("relocation") => relocation::run(),
        Some("mirrors") => mirrors::run(),
        Some("discontinuities") => discontinuities::run(),
        Some(other) => panic!("{other} is no part; give bounces, relocation, mirrors or discontinuities, or nothing"),
    }
}

/// The paper's table 1 for both scenes, with so many interreflections.
fn tables(bounces: Option<u32>, side: u32) {
    for name in ["shelf_office", "gallery"] {
        let scene = formats::read_scene(&common::file(&format!("data/scenes/{name}.obj"))).unwrap().scene;
        let solution = solver::solve(&scene, &SolveOptions { link_error: None, bounces }, &|_| {});
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        let points = PointGather::new(&scene, &solution, &gather);
        let bvh = Bvh::of_scene(&scene);
        let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, side, side);
        let evaluate = |point| eye.diffuse(point, |seen| (points.irradiance(seen), 0));
        table(name, &eye, side, &evaluate);
    }
}

/// The paper's table 1 for one scene, and as many samples of the adaptive sampler beside it.
fn table(name: &str, eye: &Eye<'_>, side: u32, evaluate: &Evaluator<'_>) {
    let evaluate_all =
        || picture(eye, side, usize::MAX, Compared { exposure: Exposure { ev: 0.0 }, curve: None }, evaluate);
    let (full, of_full) = timed(evaluate_all);
    let radiance = full.map.picture(Filter::Gaussian, None);
    let luminances = radiance.iter().map(|pixel| luminance(pixel.as_dvec3())).filter(|light| *light > 0.0);
    let exposure = Exposure::metered(luminances);
    let display = Display::new(exposure, ToneCurve::Shoulder);
    let shown = full.map.picture(Filter::Gaussian, Some(display));
    let polygons = eye.scene().polygons.len();
    println!("## {name}\n");
    println!("{polygons} polygons, {side} × {side} pixels of 3 × 3, the full picture in {of_full:.1} s.\n");
    println!("| share | L1 | L2 | seconds ÷ full | map ÷ full | on demand, ms | RMSE shown | adaptive |");
    println!("|---|---|---|---|---|---|---|---|");
    for share in SHARES {
        let most = (share * full.map.pixels() as f64) as usize;
        let (made, seconds) = timed(|| picture(eye, side, most, Compared { exposure, curve: None }, evaluate));
        let (light, on_demand) = timed(|| made.map.picture(Filter::Gaussian, None));
        let [l1, l2] = errors(&light, &radiance);
        let for_display = Compared { exposure, curve: Some(ToneCurve::Shoulder) };
        let as_shown = picture(eye, side, most, for_display, evaluate).map.picture(Filter::Gaussian, Some(display));
        let ours = rmse(&as_shown, &shown);
        let theirs = rmse(&adaptive(side, most, display, evaluate), &shown);
        println!(
            "| {:.1} % | {l1:.4} | {l2:.4} | {:.3} | {:.4} | {:.0} | {ours:.5} | {theirs:.5} |",
            100.0 * made.map.evaluated() as f64 / made.map.pixels() as f64,
            seconds / of_full,
            made.of_map / of_full,
            1e3 * on_demand
        );
    }
    println!();
}

fn adaptive(side: u32, most: usize, display: Display, evaluate: &Evaluator<'_>) -> Vec<Vec3> {
    let mut sampler = AdaptiveSampler::new(side, side, &AdaptiveOptions::of(display), evaluate).unwrap();
    loop {
        let batch = sampler.next_batch(most - sampler.samples());
        if batch.is_empty() {
            break;
        }
        sampler.take(&seen_at(&batch, evaluate));
    }
    let mut film = Film::new(side, side, Filter::Gaussian, Some(display));
    film.add(&sampler.tiles());
    film.picture()
}
