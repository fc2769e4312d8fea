//! Mirrors, flat and curved, and the pictures that are supersampled pixel by pixel (Guo 1998, sections 4.2 and 6.3). `--
//! mirrors`.

use glam::{BVec3, DVec2, Vec3};
use renderer::{
    Evaluation, Evaluator, Eye, Filter, SurfacePoint, VisibleLine, Whitted, object_edges, reflected_lines,
    visible_lines,
};
use scene::{Bvh, Exposure, Rgb, Scene};
use solver::{Gather, SolveOptions, Surroundings};

use crate::generated;
use crate::pictures::{Compared, SUPERSAMPLE, columns, errors, refined, seen_at};
use crate::point_gather::PointGather;

/// Side of the pictures, pixels.
const SIDE: u32 = 512;

/// Exposure value of both scenes.
const EXPOSURE: f32 = 1.5;

/// Contrast of red, green and blue from which on a pixel is supersampled (Rayshade's, which are Mitchell's), and multiples of
/// it: with the last none is.
const CONTRAST: Vec3 = Vec3::new(0.25, 0.2, 0.4);
const MULTIPLES: [f32; 3] = [1.0, 2.0, f32::INFINITY];

/// Prints the part of the page.
pub fn run() {
    flat();
    curved();
}

/// A room with a mirror: with and without the lines that are seen in it.
fn flat() {
    let scene = generated::looking_glass(9);
    let solution = solver::solve(&scene, &SolveOptions { link_error: None, bounces: Some(0) }, &|_| {});
    let surroundings = Surroundings::new(&scene, &solution);
    let gather = Gather::new(&surroundings, &solution);
    let points = PointGather::new(&scene, &solution, &gather);
    let bvh = Bvh::of_scene(&scene);
    let direct = |point: &SurfacePoint| points.irradiance(point);
    let whitted = Whitted::new(eye(&scene, &bvh), &direct);
    let evaluate: &Evaluator<'_> = &|point| whitted.evaluate(point);
    let eye = eye(&scene, &bvh);
    let direct_lines = visible_lines(&eye, &object_edges(&eye));
    let all_lines = [&direct_lines[..], &reflected_lines(&eye, &[])].concat();
    let full = made(&direct_lines, usize::MAX, evaluate);
    println!("## looking glass\n");
    println!("{} polygons, {SIDE} × {SIDE} pixels of 3 × 3, Whitted's rays.\n", scene.polygons.len());
    println!("| share | without lines in the mirror: L1 | L2 | with them: L1 | L2 |");
    println!("|---|---|---|---|---|");
    for share in [0.03, 0.04, 0.06, 0.08] {
        let of_both = [&direct_lines, &all_lines].map(|lines| errors(&made(lines, most(share), evaluate), &full));
        println!("| {:.1} % | {} |", 100.0 * share, columns(&of_both));
    }
    println!();
    beside_pixel_by_pixel(&all_lines, &full, evaluate);
}

/// A pile of curved mirrors, beside as many samples pixel by pixel.
fn curved() {
    let scene = generated::tori(48);
    let bvh = Bvh::of_scene(&scene);
    let whitted = Whitted::new(eye(&scene, &bvh), &|_| Rgb::ZERO);
    let evaluate: &Evaluator<'_> = &|point| whitted.evaluate(point);
    let eye = eye(&scene, &bvh);
    let lines = visible_lines(&eye, &object_edges(&eye));
    let full = made(&lines, usize::MAX, evaluate);
    println!("## tori\n");
    println!("{} polygons, {SIDE} × {SIDE} pixels of 3 × 3, Whitted's rays.\n", scene.polygons.len());
    println!("| share | L1 | L2 |\n|---|---|---|");
    for share in [0.06, 0.1, 0.15, 0.2] {
        let error = errors(&made(&lines, most(share), evaluate), &full);
        println!("| {:.1} % | {} |", 100.0 * share, columns(&[error]));
    }
    println!();
    beside_pixel_by_pixel(&lines, &full, evaluate);
}

/// Pictures that are supersampled pixel by pixel, and a map's of as many samples.
fn beside_pixel_by_pixel(lines: &[VisibleLine], full: &[Vec3], evaluate: &Evaluator<'_>) {
    println!("| times the contrast | share | pixel by pixel: L1 | L2 | coherence map: L1 | L2 |");
    println!("|---|---|---|---|---|---|");
    for multiple in MULTIPLES {
        let (share, picture) = pixel_by_pixel(lines, multiple * CONTRAST, evaluate);
        let of_both = [picture, made(lines, most(share), evaluate)].map(|picture| errors(&picture, full));
        println!("| {multiple} | {:.1} % | {} |", 100.0 * share, columns(&of_both));
    }
    println!();
}

fn eye<'a>(scene: &'a Scene, bvh: &'a Bvh) -> Eye<'a> {
    Eye::new(scene, bvh, scene.cameras[0].camera, SIDE, SIDE)
}

/// Pixels of a share of the work image.
fn most(share: f64) -> usize {
    (share * f64::from(SIDE * SUPERSAMPLE).powi(2)).round() as usize
}

/// The picture of so many pixels of the work image.
fn made(lines: &[VisibleLine], most: usize, evaluate: &Evaluator<'_>) -> Vec<Vec3> {
    let compared = Compared { exposure: Exposure { ev: EXPOSURE }, curve: None };
    refined(lines, SIDE, most, compared, evaluate).map.picture(Filter::Gaussian, None)
}

/// As Rayshade does it: a sample for each pixel of the picture, and all of the work image's where one of the four around
/// differs; a pixel without them is even. The share of the work image that is evaluated, and the picture through the same
/// filter.
fn pixel_by_pixel(lines: &[VisibleLine], contrast: Vec3, evaluate: &Evaluator<'_>) -> (f64, Vec<Vec3>) {
    let centres: Vec<DVec2> =
        (0..SIDE * SIDE).map(|i| DVec2::new((i % SIDE).into(), (i / SIDE).into()) + 0.5).collect();
    let first = seen_at(&centres, evaluate);
    let mut is_fine = vec![false; first.len()];
    for i in 0..SIDE * SIDE {
        let (x, y) = (i % SIDE, i / SIDE);
        let ends = [x > 0, x + 1 < SIDE, y > 0, y + 1 < SIDE];
        let around = [i.wrapping_sub(1), i + 1, i.wrapping_sub(SIDE), i + SIDE];
        let cross =
            || std::iter::once(i).chain(around.into_iter().zip(ends).filter_map(|(near, is)| is.then_some(near)));
        let light = |i: u32| first[i as usize].radiance;
        let [low, high] =
            cross().fold([Vec3::MAX, Vec3::ZERO], |[low, high], i| [low.min(light(i)), high.max(light(i))]);
        if (high - low).cmpgt(contrast * (high + low)) != BVec3::FALSE {
            cross().for_each(|i| is_fine[i as usize] = true);
        }
    }
    let work = |point: DVec2| -> Evaluation {
        let pixel = (point.y as u32 * SIDE + point.x as u32) as usize;
        if is_fine[pixel] { evaluate(point) } else { first[pixel] }
    };
    let a_pixel = f64::from(SUPERSAMPLE * SUPERSAMPLE);
    let fine = is_fine.iter().filter(|is_fine| **is_fine).count() as f64 / is_fine.len() as f64;
    (fine + (1.0 - fine) / a_pixel, made(lines, usize::MAX, &work))
}
