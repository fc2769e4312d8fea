//! Directional coherence maps: the table of Guo 1998 again, beside adaptive sampling with as many samples.
//!
//! `cargo bench --workspace --bench coherence` prints a page for data/record/: direct light, exact at every pixel. `-- bounces`
//! gathers all light, in pictures of half the side, for half an hour of processor time.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;
#[path = "../src/point_gather.rs"]
mod point_gather;

use glam::{DVec2, Vec3};
use point_gather::PointGather;
use rayon::prelude::*;
use renderer::{
    AdaptiveOptions, AdaptiveSampler, CoherenceMap, CoherenceOptions, Evaluation, Evaluator, Eye, Film, Filter,
    object_edges, visible_lines,
};
use scene::{Bvh, Display, Exposure, ToneCurve, luminance};
use solver::{Gather, SolveOptions};

/// Pixels of the work image along a side of the picture's.
const SUPERSAMPLE: u32 = 3;

/// Side of the pictures, pixels.
const SIDE: u32 = 512;

/// Shares of the work image's pixels that pictures are made of.
const SHARES: [f64; 4] = [0.02, 0.03, 0.04, 0.06];

fn main() {
    let bounces = std::env::args().skip(1).any(|argument| argument == "bounces");
    let side = if bounces { SIDE / 2 } else { SIDE };
    println!("# Directional coherence maps\n");
    println!("{}", common::machine());
    println!("Command: `cargo bench --workspace --bench coherence`, {}.\n", env!("CARGO_PKG_VERSION"));
    for name in ["shelf_office", "gallery"] {
        let scene = formats::read_scene(&common::file(&format!("data/scenes/{name}.obj"))).unwrap().scene;
        let options = SolveOptions { link_error: None, bounces: (!bounces).then_some(0) };
        let solution = solver::solve(&scene, &options, &|_| {});
        let gather = Gather::new(&scene, &solution);
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

/// How light is compared.
struct Compared {
    exposure: Exposure,
    curve: Option<ToneCurve>,
}

struct Made {
    map: CoherenceMap,
    /// Seconds of all but evaluation, visible lines included.
    of_map: f64,
}

fn picture(eye: &Eye<'_>, side: u32, most: usize, compared: Compared, evaluate: &Evaluator<'_>) -> Made {
    let Compared { exposure, curve } = compared;
    let options = CoherenceOptions { supersample: SUPERSAMPLE, exposure, curve };
    let (lines, mut of_map) = timed(|| visible_lines(eye, &object_edges(eye)));
    let mut map = CoherenceMap::new(side, side, &options, &lines).unwrap();
    loop {
        let (batch, placing) = timed(|| map.next_batch(most - map.evaluated()));
        if batch.is_empty() {
            return Made { map, of_map };
        }
        let seen = seen_at(&batch, evaluate);
        let ((), taking) = timed(|| map.take(&seen));
        of_map += placing + taking;
    }
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

fn seen_at(points: &[DVec2], evaluate: &Evaluator<'_>) -> Vec<Evaluation> {
    points.par_iter().map(|&point| evaluate(point)).collect()
}

/// L1 and L2 norms of the difference, relative to the full picture's.
fn errors(picture: &[Vec3], full: &[Vec3]) -> [f64; 2] {
    let sum =
        |of: &dyn Fn(Vec3, Vec3) -> f32| picture.iter().zip(full).map(|(a, b)| f64::from(of(*a, *b))).sum::<f64>();
    let l1 = sum(&|a, b| (a - b).abs().element_sum()) / sum(&|_, b| b.element_sum());
    [l1, (sum(&|a, b| (a - b).length_squared()) / sum(&|_, b| b.length_squared())).sqrt()]
}

/// The root mean square of the difference of what is shown.
fn rmse(picture: &[Vec3], truth: &[Vec3]) -> f64 {
    let squares = picture.iter().zip(truth).map(|(a, b)| f64::from((*a - *b).length_squared()) / 3.0);
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

/// Runs work; the seconds that it takes.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = std::time::Instant::now();
    let done = work();
    (done, start.elapsed().as_secs_f64())
}
