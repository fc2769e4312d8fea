//! Confidence relocation (Guo 1998, section 6.2): what a full picture spends on every pixel, spent on few. `-- relocation`.

use renderer::{
    CoherenceMap, CoherenceOptions, Evaluator, Eye, Filter, Interval, PathLight, PathOptions, PixelIntegral,
    VisibleLine, object_edges, visible_lines,
};
use scene::{Bvh, Exposure, Scene};
use solver::{Gather, SolveOptions, Surroundings};

use crate::common;
use crate::pictures::{SUPERSAMPLE, columns, errors, seen_at};
use crate::point_gather::PointGather;

/// Side of the pictures, pixels: the truth takes an exact gather at six points of every pixel of the work image.
const SIDE: u32 = 128;

/// Exposure value of the office.
const EXPOSURE: f32 = -2.5;

/// Paths that a full picture has for a pixel of the work image, those of a sample of the map, and the map's interval: the fewer
/// rays there are, the wider.
const WAYS: [(u32, u32, Interval); 3] =
    [(1, 4, Interval::Linear(0.6)), (4, 4, Interval::Perceptual(0.4)), (16, 16, Interval::Perceptual(0.2))];

const SEEDS: u64 = 4;

/// Pixels of a batch at most, so that rays do not go far beyond what there is of them.
const BATCH: usize = 256;

/// Prints the part of the page.
pub fn run() {
    let scene = formats::read_scene(&common::file("data/scenes/shelf_office.obj")).unwrap().scene;
    let bvh = Bvh::of_scene(&scene);
    let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, SIDE, SIDE);
    let lines = visible_lines(&eye, &object_edges(&eye));
    let [truth, without_noise] = truth(&eye, &scene, &lines).map(|map| map.picture(Filter::Gaussian, None));
    println!("## shelf_office, all light, by paths\n");
    println!(
        "{SIDE} × {SIDE} pixels of 3 × 3, the mean of {SEEDS} seeds. The full picture without noise: {}.\n",
        columns(&[errors(&without_noise, &truth)])
    );
    println!("| paths a pixel | full: L1 | L2 | relocated: L1 | L2 | its share | its paths ÷ full |");
    println!("|---|---|---|---|---|---|---|");
    for (of_full, of_sample, interval) in WAYS {
        let (mut means, mut share, mut spent) = ([[0.0; 2]; 2], 0.0, 0.0);
        for seed in 1..=SEEDS {
            let light = |samples| PathLight::new(&scene, &bvh, PathOptions { samples, bounces: None, seed });
            let [every, some] = [of_full, of_sample].map(light);
            let evaluate =
                |light: &PathLight<'_>, point| eye.diffuse(point, |seen| (light.irradiance(seen), light.paths()));
            let (map, rays) = seen(&lines, u64::MAX, &|point| evaluate(&every, point));
            let full = map.picture(Filter::Gaussian, None);
            let integral = PixelIntegral::new(&options(), 0.99, interval, seed);
            let (map, of_map) = seen(&lines, rays, &|point| integral.mean(point, &|point| evaluate(&some, point)));
            let relocated = map.picture(Filter::Gaussian, None);
            let of_seed = [full, relocated].map(|picture| errors(&picture, &truth));
            for (mean, error) in means.iter_mut().flatten().zip(of_seed.iter().flatten()) {
                *mean += error / SEEDS as f64;
            }
            share += map.evaluated() as f64 / map.pixels() as f64 / SEEDS as f64;
            spent += of_map as f64 / rays as f64 / SEEDS as f64;
        }
        println!("| {of_full} | {} | {:.1} % | {spent:.2} |", columns(&means), 100.0 * share);
    }
    println!();
}

fn options() -> CoherenceOptions {
    CoherenceOptions { supersample: SUPERSAMPLE, exposure: Exposure { ev: EXPOSURE }, curve: None }
}

/// A map of all pixels, or of those that so many rays are enough for; the rays.
fn seen(lines: &[VisibleLine], rays: u64, evaluate: &Evaluator<'_>) -> (CoherenceMap, u64) {
    let mut map = CoherenceMap::new(SIDE, SIDE, &options(), lines).unwrap();
    let mut spent = 0;
    while spent < rays {
        let batch = map.next_batch(BATCH);
        if batch.is_empty() {
            break;
        }
        let seen = seen_at(&batch, evaluate);
        spent += seen.iter().map(|seen| u64::from(seen.cost)).sum::<u64>();
        map.take(&seen);
    }
    (map, spent)
}

/// Without noise, by a gather: every pixel over its area, and every pixel at its centre.
fn truth(eye: &Eye<'_>, scene: &Scene, lines: &[VisibleLine]) -> [CoherenceMap; 2] {
    let solution = solver::solve(scene, &SolveOptions { link_error: None, bounces: None }, &|_| {});
    let surroundings = Surroundings::new(scene, &solution);
    let gather = Gather::new(&surroundings, &solution);
    let points = PointGather::new(scene, &solution, &gather);
    let exact = |point| eye.diffuse(point, |seen| (points.irradiance(seen), 0));
    let integral = PixelIntegral::new(&options(), 0.99, Interval::Linear(0.02), 1);
    let over_areas: &Evaluator<'_> = &|point| integral.mean(point, &exact);
    [over_areas, &exact].map(|evaluate| seen(lines, u64::MAX, evaluate).0)
}
