//! Reconstruction: from constant elements to light that is linear over each element.
//!
//! One more gather, to the corners and centres of all leaves, replaces the solver's constants by planes through exact
//! irradiances; inner nodes get the planes that fit their children best. A point close to a reflector then sees no
//! steps. (Hardt & Teller gather from constants.)

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::{Rgb, luminance};

use crate::irradiance::Gather;
use crate::solution::ElementLight;
use crate::{Elements, NodeId, Solution};

/// Light that is constant over every node.
pub fn constant_light(irradiance: &[Rgb], elements: &Elements) -> Vec<ElementLight> {
    let leaves = irradiance.iter().map(|&irradiance| ElementLight { irradiance, ..ElementLight::default() });
    fit_inner_nodes(elements, leaves.collect())
}

/// Linear light, by a gather to the leaves' corners and centres. The light in `gather`'s solution must be one bounce
/// earlier than the light asked for.
pub fn linear_light(gather: &Gather<'_>, solution: &Solution, progress: &(dyn Fn(f64) + Sync)) -> Vec<ElementLight> {
    let elements = &solution.elements;
    let mut light = vec![ElementLight::default(); elements.nodes.len()];
    let patches: Vec<u32> = (0..elements.patches.len() as u32).collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let fitted: Vec<Vec<(NodeId, ElementLight)>> = patches
        .par_iter()
        .map(|&patch| {
            let fitted = fit_leaves(gather, solution, patch);
            let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            progress(done as f64 / patches.len() as f64);
            fitted
        })
        .collect();
    for (leaf, fit) in fitted.into_iter().flatten() {
        light[leaf as usize] = fit;
    }
    fit_inner_nodes(elements, light)
}

fn fit_leaves(gather: &Gather<'_>, solution: &Solution, patch: u32) -> Vec<(NodeId, ElementLight)> {
    let elements = &solution.elements;
    let frame = &elements.patches[patch as usize];
    let patch_centre = elements.nodes[frame.root as usize].centre;
    let mut corners: HashMap<[u64; 3], Rgb> = HashMap::new();
    let mut leaves = Vec::new();
    let mut open = vec![frame.root];
    while let Some(node) = open.pop() {
        open.extend(elements.children(node).rev());
        if !elements.is_leaf(node) {
            continue;
        }
        let leaf_gather = gather.over(node);
        let centre = elements.nodes[node as usize].centre;
        let middle = leaf_gather.irradiance(centre, DVec3::ZERO);
        let samples: Vec<(DVec2, Rgb)> = elements
            .outline(node)
            .iter()
            .map(|&corner| {
                let offset = corner - centre;
                let key = corner.to_array().map(f64::to_bits);
                // The limit from the middle of the patch: all leaves around a corner agree on it.
                let value =
                    *corners.entry(key).or_insert_with(|| leaf_gather.irradiance(corner, patch_centre - corner));
                (DVec2::new(frame.u.dot(offset), frame.v.dot(offset)), value)
            })
            .collect();
        let mean = samples.iter().map(|sample| sample.1).sum::<Rgb>() / samples.len().max(1) as f64;
        let (gradient_u, gradient_v) = slope(samples.iter().map(|&(at, value)| (at, value - mean, 1.0)));
        // The mean of a quadratic over a rectangle: its corners count a twelfth each, its centre eight twelfths.
        let irradiance = mean / 3.0 + middle * (2.0 / 3.0);
        leaves.push((node, ElementLight { irradiance, gradient_u, gradient_v, deviation: 0.0 }));
    }
    leaves
}

/// Gradient of the plane through the origin that fits weighted samples best.
fn slope(samples: impl Iterator<Item = (DVec2, Rgb, f64)>) -> (Rgb, Rgb) {
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    let (mut u, mut v) = (Rgb::ZERO, Rgb::ZERO);
    for (at, value, weight) in samples {
        uu += weight * at.x * at.x;
        uv += weight * at.x * at.y;
        vv += weight * at.y * at.y;
        u += value * (weight * at.x);
        v += value * (weight * at.y);
    }
    let determinant = uu * vv - uv * uv;
    if determinant > 1e-12 * uu * vv {
        ((u * vv - v * uv) / determinant, (v * uu - u * uv) / determinant)
    } else {
        (Rgb::ZERO, Rgb::ZERO)
    }
}

/// Sets every inner node to the plane that fits its children's planes best, and records how far they stray from it.
fn fit_inner_nodes(elements: &Elements, mut light: Vec<ElementLight>) -> Vec<ElementLight> {
    for node in (0..light.len()).rev() {
        let Some(patch) = elements.patch_of(node as u32) else { continue };
        if elements.nodes[node].child_count == 0 {
            continue;
        }
        let frame = &elements.patches[patch as usize];
        let parent = &elements.nodes[node];
        let children =
            || elements.children(node as u32).map(|child| (&elements.nodes[child as usize], light[child as usize]));
        let irradiance = children().map(|(child, light)| light.irradiance * child.area).sum::<Rgb>() / parent.area;
        let place =
            |centre: DVec3| DVec2::new(frame.u.dot(centre - parent.centre), frame.v.dot(centre - parent.centre));
        // A child counts as the four points of its plane at ±1/√12 of its cell, which have the cell's second moments.
        let samples = children().flat_map(|(child, light)| {
            let reach = (child.cell_max - child.cell_min) / 12f64.sqrt();
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| {
                let offset = reach * DVec2::new(x, y);
                let value = light.irradiance + light.gradient_u * offset.x + light.gradient_v * offset.y;
                (place(child.centre) + offset, value - irradiance, child.area)
            })
        });
        let (gradient_u, gradient_v) = slope(samples);
        let mut deviation: f64 = 0.0;
        for (child, light) in children() {
            let at = place(child.centre);
            let half = (child.cell_max - child.cell_min) / 2.0;
            let step = (light.irradiance - irradiance - gradient_u * at.x - gradient_v * at.y).abs();
            let twist = (light.gradient_u - gradient_u).abs() * half.x + (light.gradient_v - gradient_v).abs() * half.y;
            deviation = deviation.max(luminance(step + twist) + light.deviation);
        }
        light[node] = ElementLight { irradiance, gradient_u, gradient_v, deviation };
    }
    light
}
