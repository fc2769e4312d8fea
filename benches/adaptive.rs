//! Adaptive pictures: the tables of Painter & Sloan 1989 again, how many pixels are as near to the truth as they claim, and the
//! same rays spread evenly.
//!
//! `cargo bench --bench adaptive` prints a page for data/record/; `-- tables`, `-- uniform` and `-- speed` one part of it. The
//! teapot is not in this repository: `HALFLIGHT_TEAPOT=FILE.obj` says where it is, without it its rows are left out.

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::unwrap_used)]

mod common;
#[path = "../src/point_gather.rs"]
mod point_gather;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};
use point_gather::PointGather;
use rayon::prelude::*;
use renderer::{
    AdaptiveOptions, AdaptiveSampler, Evaluation, Evaluator, Eye, Film, Filter, Rule, Sight, SurfacePoint,
    UniformSampler, Whitted, sample_histogram,
};
use scene::{Bvh, Camera, Display, Exposure, Gloss, Light, Material, Rgb, Scene, ToneCurve};
use solver::{Gather, SolveOptions, Surroundings};

/// The interval of the paper's confidence, which pixels are held to.
const INTERVAL: f64 = 1.0 / 255.0;

/// The paper's sizes.
const SIZES: [u32; 4] = [64, 128, 256, 512];

/// The side of the pictures that uniform sampling is compared on, pixels.
const COMPARED: u32 = 256;

/// Seeds of the pictures that are compared.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;

/// Points along a side of a pixel that its true mean is taken from: where all of a few agree to two intervals, and elsewhere. What
/// a straight border of contrast 0.3 leaves is then a fourth of the interval, and less in pixels without one.
const POINTS: [u32; 2] = [8, 48];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let is_wanted = |part: &str| wanted.is_empty() || wanted.iter().any(|name| name == part);
    println!("# Adaptive pictures\n");
    println!("{}", common::machine());
    println!("Command: `cargo bench --bench adaptive`, {}.", env!("CARGO_PKG_VERSION"));
    if is_wanted("speed") {
        speed();
    }
    if is_wanted("tables") {
        tables();
    }
    if is_wanted("uniform") {
        uniform();
    }
}

/// A scene to take pictures of.
struct View {
    name: &'static str,
    scene: Scene,
    camera: Camera,
    display: Display,
    /// What the light of a point is multiplied by: a solid texture.
    texture: Option<fn(DVec3) -> f64>,
}

impl View {
    /// A scene of data/scenes/.
    fn of_data(name: &'static str, ev: f32) -> Self {
        Self::of_file(name, &common::file(&format!("data/scenes/{name}")), ev)
    }

    fn of_file(name: &'static str, path: &Path, ev: f32) -> Self {
        let scene = formats::read_scene(path).unwrap().scene;
        let camera = scene.cameras[0].camera;
        Self { name, scene, camera, display: display(ev), texture: None }
    }

    /// Has `work` look at the scene with Whitted's rays, in a square picture of a side of so many pixels.
    fn look<T>(&self, side: u32, work: impl FnOnce(&Evaluator<'_>) -> T) -> T {
        let options = SolveOptions { link_error: None, bounces: Some(0) };
        let solution = solver::solve(&self.scene, &options, &|_| {});
        let surroundings = Surroundings::new(&self.scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        let points = PointGather::new(&self.scene, &solution, &gather);
        let direct = |point: &SurfacePoint| points.irradiance(point);
        let bvh = Bvh::of_scene(&self.scene);
        let eye = || Eye::new(&self.scene, &bvh, self.camera, side, side);
        let whitted = Whitted::new(eye(), &direct);
        let Some(texture) = self.texture else { return work(&|point| whitted.evaluate(point)) };
        let eye = eye();
        work(&|point| {
            let mut seen = whitted.evaluate(point);
            if let Sight::Front(front) = eye.look(&eye.ray(point))
                && self.scene.material(front.point.polygon).name == "teapot"
            {
                seen.radiance *= texture(front.point.position) as f32;
            }
            seen
        })
    }
}

/// A display with an exposure value and the usual tone curve.
fn display(ev: f32) -> Display {
    Display::new(Exposure { ev }, ToneCurve::default())
}

/// The teapot on a table, under a light that is far away and one at a point: as it is, and with normals at its vertices.
fn teapots() -> Vec<View> {
    let Some(path) = std::env::var_os("HALFLIGHT_TEAPOT").map(PathBuf::from) else {
        eprintln!("SKIPPED, the teapot: set HALFLIGHT_TEAPOT to its OBJ file");
        return Vec::new();
    };
    let flat = teapot(&path);
    let mut round = flat.clone();
    let mut normals = vec![DVec3::ZERO; round.vertices.len()];
    let is_table = |scene: &Scene, polygon: u32| scene.material(polygon).name == "table";
    for polygon in round.polygon_ids().filter(|&polygon| !is_table(&round, polygon)) {
        let normal = round.plane(polygon).normal * round.area(polygon);
        round.corners[round.polygons[polygon as usize].corner_range()]
            .iter()
            .for_each(|&v| normals[v as usize] += normal);
    }
    round.shading_normals = round.corners.iter().map(|&v| normals[v as usize].normalize_or_zero().as_vec3()).collect();
    let camera =
        Camera { eye: DVec3::new(1.5, -9.0, 5.0), target: DVec3::new(0.2, 0.0, 1.3), up: DVec3::Z, vertical_fov: 0.75 };
    let view =
        |name, scene: &Scene, texture| View { name, scene: scene.clone(), camera, display: display(0.0), texture };
    vec![
        view("teapot", &flat, None),
        view("teapot with normals", &round, None),
        view("solid texture", &round, Some(bands as fn(DVec3) -> f64)),
        view("fractal texture", &round, Some(fractal as fn(DVec3) -> f64)),
    ]
}

/// The teapot's triangles on a table.
fn teapot(path: &Path) -> Scene {
    let folder = common::scratch("teapot");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("table.obj"), "v -60 -60 0\nv 60 -60 0\nv 60 60 0\nv -60 60 0\nf 1 2 3 4\n").unwrap();
    let file = path.canonicalize().unwrap();
    let models =
        format!("up = \"z\"\n[[model]]\nfile = {:?}\n[[model]]\nfile = \"table.obj\"\n", file.to_str().unwrap());
    std::fs::write(folder.join("teapot.toml"), models).unwrap();
    let mut scene = formats::read_scene(&folder.join("teapot.toml")).unwrap().scene;
    let table = scene.polygon_ids().max_by(|&a, &b| scene.area(a).total_cmp(&scene.area(b))).unwrap();
    let diffuse = Rgb::new(0.55, 0.42, 0.22);
    let gloss = Gloss { diffuse, specular: Rgb::splat(0.03), exponent: 40.0, is_mirror: false };
    scene.materials = vec![
        Material { reflectance: diffuse, gloss: Some(gloss), ..Material::grey("teapot") },
        Material { reflectance: Rgb::splat(0.4), ..Material::grey("table") },
    ];
    for (id, polygon) in (0..).zip(&mut scene.polygons) {
        polygon.material = u32::from(id == table);
    }
    scene.lights = vec![
        Light::Directional { direction: DVec3::new(-0.5, -0.6, 0.8).normalize(), irradiance: Rgb::splat(3.0) },
        Light::Point { position: DVec3::new(4.0, -7.0, 9.0), intensity: Rgb::splat(60.0) },
    ];
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// Bent bands of two shades.
fn bands(p: DVec3) -> f64 {
    if (p.x * 3.0 + (p.z * 7.0).sin() * 0.7 + p.y * 2.0).sin() > 0.0 { 1.0 } else { 0.5 }
}

/// Twelve octaves, each 0.7 times as strong as the one before.
fn fractal(p: DVec3) -> f64 {
    let octave = |i: i32| {
        let (strength, frequency) = (0.7_f64.powi(i), 3.0 * 2f64.powi(i));
        let wave = |x: f64, shift: f64| (x * frequency + shift * strength).sin();
        strength * wave(p.x, 1.3) * wave(p.y * 1.1, 1.0) * wave(p.z * 0.9, 2.0)
    };
    (0.5 + 0.4 * (0..12).map(octave).sum::<f64>()).clamp(0.0, 1.0)
}

/// The true mean of what is shown of every pixel.
fn truth(view: &View, side: u32) -> Vec<Vec3> {
    view.look(side, |evaluate| {
        let mean = |pixel: u32, points: u32| {
            // A golden shift from row to row, so that no border lies along the points.
            let place = |i: u32| {
                let (x, y) = (f64::from(i % points) + 0.5, f64::from(i / points) + 0.5);
                DVec2::new((x + 0.618_034 * y).rem_euclid(f64::from(points)), y) / f64::from(points)
            };
            let corner = DVec2::new(f64::from(pixel % side), f64::from(pixel / side));
            let (mut sum, mut low, mut high) = (DVec3::ZERO, Vec3::INFINITY, Vec3::NEG_INFINITY);
            for i in 0..points * points {
                let seen = view.display.light(evaluate(corner + place(i)).radiance);
                (low, high) = (low.min(seen), high.max(seen));
                sum += seen.as_dvec3();
            }
            ((sum / f64::from(points * points)).as_vec3(), (high - low).max_element())
        };
        let pixel = |pixel: u32| {
            let (few, range) = mean(pixel, POINTS[0]);
            if f64::from(range) < 2.0 * INTERVAL { few } else { mean(pixel, POINTS[1]).0 }
        };
        (0..side * side).into_par_iter().map(pixel).collect()
    })
}

/// The same at half the size: means of four.
fn halved(picture: &[Vec3], side: u32) -> Vec<Vec3> {
    let at = |x: u32, y: u32| picture[(y * side + x) as usize];
    let half = side / 2;
    let pixel = |i: u32| {
        let (x, y) = (2 * (i % half), 2 * (i / half));
        (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0
    };
    (0..half * half).map(pixel).collect()
}

/// An adaptive picture and what it took.
struct Made {
    sampler: AdaptiveSampler,
    picture: Vec<Vec3>,
    /// CPU seconds of generation, evaluation and reconstruction.
    seconds: [f64; 3],
}

/// The paper's confidence.
fn options(display: Display, rule: Rule, seed: u64) -> AdaptiveOptions {
    AdaptiveOptions { seed, rule, ..AdaptiveOptions::of(display) }
}

/// Makes a picture until it is complete or has so many samples.
fn adaptive(evaluate: &Evaluator<'_>, side: u32, options: &AdaptiveOptions, most: usize, filter: Filter) -> Made {
    let mut sampler = AdaptiveSampler::new(side, side, options, evaluate).unwrap();
    let mut film = Film::new(side, side, filter, Some(options.display));
    film.add(&sampler.tiles());
    let mut seconds = [0.0; 3];
    loop {
        let batch = timed(&mut seconds[0], || sampler.next_batch(most - sampler.samples()));
        if batch.is_empty() {
            break;
        }
        let seen =
            timed(&mut seconds[1], || batch.par_iter().map(|&point| evaluate(point)).collect::<Vec<Evaluation>>());
        let tiles = timed(&mut seconds[0], || sampler.take(&seen));
        timed(&mut seconds[2], || film.add(&tiles));
    }
    let picture = timed(&mut seconds[2], || film.picture());
    Made { sampler, picture, seconds }
}

/// Runs work; the CPU seconds of all threads are added.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = common::seconds_of_this_program();
    let done = work();
    *seconds += common::seconds_of_this_program() - start;
    done
}

fn rmse(picture: &[Vec3], truth: &[Vec3]) -> f64 {
    let squares = picture.iter().zip(truth).map(|(a, b)| f64::from((*a - *b).length_squared()) / 3.0);
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

/// Share of the pixels within the interval of the truth, of those that `counts`.
fn share_within(picture: &[Vec3], truth: &[Vec3], counts: impl Fn(usize) -> bool) -> f64 {
    let within = |i: &usize| f64::from((picture[*i] - truth[*i]).abs().max_element()) <= INTERVAL;
    let counted: Vec<usize> = (0..truth.len()).filter(|&i| counts(i)).collect();
    counted.iter().filter(|i| within(i)).count() as f64 / counted.len().max(1) as f64
}

/// The paper's two tables, for either rule.
fn tables() {
    println!("\n## The paper's tables\n");
    println!(
        "Pictures until every pixel is known to 1/255 at 99 %, with Whitted's rays. CPU seconds on one thread; reconstruction"
    );
    println!(
        "is the incremental one, through the 7 × 7 Lanczos filter. Within is the share of pixels whose box mean lies within 1/255"
    );
    println!("of that of {0} × {0} points, of all pixels, and of those with more than one sample.\n", POINTS[1]);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut histograms = HashMap::new();
    let mut views = teapots();
    views.push(View::of_data("lamp.obj", 1.0));
    views.push(View::of_data("office.obj", 1.5));
    for view in &views {
        println!("### {}\n", view.name);
        println!("| rule | size | generate | evaluate | reconstruct | rays per pixel | within | of more than one |");
        println!("|---|---|---|---|---|---|---|---|");
        let mut truths = vec![truth(view, SIZES[3])];
        for size in SIZES[1..].iter().rev() {
            truths.push(halved(truths.last().unwrap(), *size));
        }
        for (rule, name) in [(Rule::Paper, "the paper's"), (Rule::Calibrated, "calibrated")] {
            for (side, truth) in SIZES.iter().zip(truths.iter().rev()) {
                let pixels = f64::from(side * side);
                let (made, means) = one.install(|| {
                    view.look(*side, |evaluate| {
                        let made =
                            adaptive(evaluate, *side, &options(view.display, rule, 1), usize::MAX, Filter::Lanczos);
                        let mut film = Film::new(*side, *side, Filter::Box, Some(view.display));
                        film.add(&made.sampler.tiles());
                        (made, film.picture())
                    })
                });
                let counts = made.sampler.samples_per_pixel();
                let [generate, evaluate, reconstruct] = made.seconds;
                println!(
                    "| {name} | {side} | {generate:.2} | {evaluate:.2} | {reconstruct:.2} | {:.3} | {:.2} % | {:.1} % |",
                    made.sampler.samples() as f64 / pixels,
                    100.0 * share_within(&means, truth, |_| true),
                    100.0 * share_within(&means, truth, |i| counts[i] > 1)
                );
                if *side == SIZES[3] {
                    histograms.insert((view.name, name), sample_histogram(&counts));
                }
            }
        }
        println!();
        println!("Pixels with 1, 2, 3–5, 6–10, 11–20 and more samples at {}²:", SIZES[3]);
        for name in ["the paper's", "calibrated"] {
            let counts = &histograms[&(view.name, name)];
            let sums = [1..2, 2..3, 3..6, 6..11, 11..21, 21..22].map(|range| counts[range].iter().sum::<u64>());
            println!("{name} {}.", sums.map(|sum| sum.to_string()).join(", "));
        }
        println!();
    }
}

/// Adaptive beside uniform stratified sampling with the same number of rays.
fn uniform() {
    println!("\n## Beside uniform stratified sampling\n");
    println!(
        "RMSE of what is shown over four seeds, box filter, {COMPARED} × {COMPARED} pixels, Whitted's rays; uniform ÷ adaptive.\n"
    );
    println!("| scene | rays per pixel | adaptive | uniform | ratio |");
    println!("|---|---|---|---|---|");
    let mut views = teapots();
    views.push(View::of_data("lamp.obj", 1.0));
    views.push(View::of_data("office.obj", 1.5));
    views.push(View::of_data("office_evening.toml", 1.5));
    views.push(View::of_data("cornell_box.obj", -1.0));
    for view in &views {
        let truth = truth(view, COMPARED);
        view.look(COMPARED, |evaluate| {
            let pixels = f64::from(COMPARED * COMPARED);
            for a_pixel in [0.1, 0.25, 0.5, 1.0, 1.5, f64::INFINITY] {
                let most = (a_pixel * pixels) as usize;
                let of_seed = |seed: u64| {
                    let options = options(view.display, Rule::Calibrated, seed);
                    let made = adaptive(evaluate, COMPARED, &options, most, Filter::Box);
                    let a_pixel = made.sampler.samples() as f64 / pixels;
                    let mut even = UniformSampler::new(COMPARED, COMPARED, a_pixel, seed).unwrap();
                    let batch = even.next_batch(usize::MAX);
                    let seen: Vec<Evaluation> = batch.par_iter().map(|&point| evaluate(point)).collect();
                    let mut film = Film::new(COMPARED, COMPARED, Filter::Box, Some(view.display));
                    film.add(&even.take(&seen));
                    [a_pixel, rmse(&made.picture, &truth).powi(2), rmse(&film.picture(), &truth).powi(2)]
                };
                let of_seeds: Vec<[f64; 3]> = SEEDS.map(of_seed).collect();
                let mean = |i: usize| of_seeds.iter().map(|found| found[i]).sum::<f64>() / of_seeds.len() as f64;
                let (a_pixel, ours, theirs) = (mean(0), mean(1).sqrt(), mean(2).sqrt());
                println!("| {} | {a_pixel:.2} | {ours:.5} | {theirs:.5} | {:.1} |", view.name, theirs / ours);
            }
        });
    }
}

/// What sampling and pictures cost by themselves.
fn speed() {
    println!("\n## Speed\n");
    println!(
        "One thread, 512 × 512 pixels, an evaluator that costs next to nothing (a hundred disks): CPU nanoseconds a sample.\n"
    );
    println!(
        "| rule | samples | generate | million a second | reconstruct | bytes a sample | a picture at any time, ms | all tiles anew, ms |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let disks: Vec<(DVec2, f64)> = (0..100)
        .map(|i| (DVec2::new(f64::from(i * 197 % 512), f64::from(i * 331 % 512)), 8.0 + f64::from(i * 71 % 40)))
        .collect();
    let evaluate = |point: DVec2| {
        let top = disks.iter().position(|(centre, radius)| point.distance_squared(*centre) < radius * radius);
        let shade = top.map_or(0.0, |i| 0.1 + 0.005 * i as f32);
        Evaluation { radiance: Vec3::new(shade, shade * 0.5, 0.05), object: 1, cost: 1 }
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(|| {
        for (rule, name) in [(Rule::Paper, "the paper's"), (Rule::Calibrated, "calibrated")] {
            let made = adaptive(&evaluate, 512, &options(display(0.0), rule, 1), usize::MAX, Filter::Lanczos);
            let samples = made.sampler.samples() as f64;
            let [generate, _, reconstruct] = made.seconds.map(|seconds| seconds * 1e9 / samples);
            let (mut anew, mut asked) = (0.0, 0.0);
            let mut film = Film::new(512, 512, Filter::Lanczos, Some(display(0.0)));
            timed(&mut anew, || film.add(&made.sampler.tiles()));
            timed(&mut asked, || film.picture());
            println!(
                "| {name} | {samples} | {generate:.0} | {:.2} | {reconstruct:.0} | {:.0} | {:.0} | {:.0} |",
                1e3 / generate,
                made.sampler.bytes() as f64 / samples,
                1e3 * asked,
                1e3 * anew
            );
        }
    });
}
