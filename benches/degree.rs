//! Constant, linear, quadratic and cubic interpolants on the same meshes (Hardt & Teller 1996, section 2.1: lower than
//! quadratic is inadequate, higher does not significantly improve the fit).
//!
//! `cargo bench --bench degree` prints a page for data/record/. Each degree interpolates the exact gather at the
//! lattice of its degree over a triangle; a constant takes the middle.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod measure;

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use measure::{SCENES, Truth, on_curve, percent, read, solved, unrefined};
use mesher::BakeOptions;
use rayon::prelude::*;
use scene::{Baked, Rgb, Scene};
use solver::{Gather, Solution, Surroundings};

/// Multiples of the default link error and of the default w_min, coarse meshes to fine ones.
const MESHES: [(f64, f64); 4] = [(32.0, 16.0), (8.0, 4.0), (1.0, 1.0), (0.125, 0.25)];

/// How many of them all light is baked on: the finest takes minutes.
const OF_ALL_LIGHT: usize = 3;

const NAMES: [&str; 4] = ["constant", "linear", "quadratic", "cubic"];

/// How far samples are moved towards the middle of their triangle, as a fraction of the scene's size: a bake's vertices
/// are f32, and one on a line of contact must stay on its own side.
const INSET: f64 = 1e-6;

fn main() {
    println!("# The degree of interpolants\n");
    println!("Command: `cargo bench --bench degree`, {}. The figures do not depend on the", env!("CARGO_PKG_VERSION"));
    println!(
        "machine. Errors: relative RMSE against the exact gather of the same solution at 4,000 points. Samples that"
    );
    println!("triangles of one polygon share count once.");
    for name in SCENES {
        let scene = read(name);
        for (light, bounces, meshes) in
            [("direct light", Some(0), &MESHES[..]), ("all light", None, &MESHES[..OF_ALL_LIGHT])]
        {
            println!("\n## {name}, {light}\n");
            println!("| triangles | constant | linear | quadratic | cubic | samples of each |");
            println!("|---|---|---|---|---|---|");
            let mut curves: [Vec<(f64, f64)>; 4] = Default::default();
            for &(coarseness, minimum) in meshes {
                let solution = solved(&scene, bounces, coarseness);
                let default = BakeOptions::default();
                let min_weight = Some(minimum * default.weight.default_minimum(&scene, &solution));
                let (baked, _) = unrefined(&scene, &solution, &BakeOptions { min_weight, ..default });
                let (errors, samples) = (errors(&scene, &solution, &baked), samples(&baked));
                let [e0, e1, e2, e3] = errors.map(percent);
                let [s0, s1, s2, s3] = samples;
                println!("| {} | {e0} | {e1} | {e2} | {e3} | {s0}, {s1}, {s2}, {s3} |", baked.triangles.len());
                for (degree, curve) in curves.iter_mut().enumerate() {
                    curve.push((samples[degree] as f64, errors[degree]));
                }
            }
            println!("\nAt equal numbers of samples, between the meshes:\n");
            println!("| samples | {} |\n|---|---|---|---|---|", NAMES.join(" | "));
            for &(samples, _) in &curves[2] {
                let error = |curve: &Vec<(f64, f64)>| on_curve(curve, samples).map_or("–".to_owned(), percent);
                println!("| {samples:.0} | {} |", curves.each_ref().map(error).join(" | "));
            }
        }
    }
}

/// Numbers of samples that the four degrees need on a mesh.
fn samples(baked: &Baked) -> [usize; 4] {
    let (mut vertices, mut edges) = (HashSet::new(), HashSet::new());
    for triangle in &baked.triangles {
        for i in 0..3 {
            let (a, b) = (triangle.vertices[i], triangle.vertices[(i + 1) % 3]);
            vertices.insert((triangle.polygon, a));
            edges.insert((triangle.polygon, a.min(b), a.max(b)));
        }
    }
    let (triangles, vertices, edges) = (baked.triangles.len(), vertices.len(), edges.len());
    [triangles, vertices, vertices + edges, vertices + 2 * edges + triangles]
}

/// Errors of the four degrees on a mesh.
fn errors(scene: &Scene, solution: &Solution, baked: &Baked) -> [f64; 4] {
    let truth = Truth::of(scene, solution);
    let places = truth.places(baked);
    let surroundings = Surroundings::new(scene, solution);
    let gather = Gather::new(&surroundings, solution);
    let mut hit: Vec<u32> = places.iter().map(|place| place.0).collect();
    hit.sort_unstable();
    hit.dedup();
    let of_triangle = |&id: &u32| {
        let (corners, polygon) = (baked.corners(id), baked.triangles[id as usize].polygon);
        let (plane, middle) = (scene.plane(polygon), corners.iter().sum::<DVec3>() / 3.0);
        let exact = |[a, b, c]: [f64; 3]| {
            let position = corners[0] * a + corners[1] * b + corners[2] * c;
            let inward = (middle - position).normalize_or_zero();
            let position = position + inward * (INSET * scene.size()).min(position.distance(middle));
            gather.irradiance_at(polygon, position - plane.normal * plane.distance(position), inward)
        };
        (id, [0, 1, 2, 3].map(|degree| lattice(degree).map(|node| exact(at(degree, node))).collect::<Vec<Rgb>>()))
    };
    let fits: HashMap<u32, [Vec<Rgb>; 4]> = hit.par_iter().map(of_triangle).collect();
    [0, 1, 2, 3].map(|degree| {
        let value = |&(triangle, s, t): &(u32, f64, f64)| {
            let samples = &fits[&triangle][degree];
            let terms =
                lattice(degree).zip(samples).map(|(node, sample)| *sample * basis(degree, node, [1.0 - s - t, s, t]));
            terms.sum::<Rgb>().max(Rgb::ZERO)
        };
        truth.relative_rmse(places.iter().map(value))
    })
}

/// The nodes of a degree, each as three counts that add up to it.
fn lattice(degree: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..=degree).flat_map(move |i| (0..=degree - i).map(move |j| [degree - i - j, i, j]))
}

/// Barycentrics of a node.
fn at(degree: usize, node: [usize; 3]) -> [f64; 3] {
    if degree == 0 { [1.0 / 3.0; 3] } else { node.map(|count| count as f64 / degree as f64) }
}

/// The polynomial that is 1 at a node and 0 at all others (Silvester 1969).
fn basis(degree: usize, node: [usize; 3], barycentrics: [f64; 3]) -> f64 {
    let factor = |(count, coordinate): (usize, f64)| -> f64 {
        (0..count).map(|q| (degree as f64 * coordinate - q as f64) / (q as f64 + 1.0)).product()
    };
    node.into_iter().zip(barycentrics).map(factor).product()
}
