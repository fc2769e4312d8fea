//! Reconstruction: one more gather, to the corners and centres of all leaves.
//!
//! It replaces the light that came over the links by planes through exact irradiances; inner nodes get the planes that
//! fit their children best. A point close to a reflector then sees hardly a step. (Hardt & Teller gather from
//! constants.)

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::Rgb;

use crate::irradiance::Gather;
use crate::linear_fit::{colour_slope, fit_inner_nodes};
use crate::solution::ElementLight;
use crate::{NodeId, Solution};

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
    fit_inner_nodes(elements, &mut light);
    light
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
        let (gradient_u, gradient_v) = colour_slope(samples.iter().map(|&(at, value)| (at, value - mean, 1.0)));
        // The mean of a quadratic over a rectangle: its corners count a twelfth each, its centre eight twelfths.
        let irradiance = mean / 3.0 + middle * (2.0 / 3.0);
        leaves.push((node, ElementLight { irradiance, gradient_u, gradient_v, deviation: 0.0 }));
    }
    leaves
}
