//! Transport: gather over the links, push down, pull up, until little moves (Hanrahan et al. 1991).

use rayon::prelude::*;
use scene::{Rgb, Scene, luminance};

use crate::linear_fit::fit_inner_nodes;
use crate::solution::{Convergence, ElementLight};
use crate::{Elements, Link, LinkSource};

/// The iteration stops when a gather moves less than this fraction of the power that leaves all surfaces: far below
/// any error of the form factors, and each further iteration costs as much as all others.
const RESIDUAL: f64 = 1e-7;

/// Iterations after which a scene is declared not to converge; at reflectance 0.99 about 1,600 are needed.
const MOST_ITERATIONS: u32 = 5000;

/// The light on all nodes after transport.
#[derive(Clone, Debug, Default)]
pub struct Transport {
    /// Irradiance per node.
    pub irradiance: Vec<ElementLight>,
    /// The part of it that comes straight from emitters.
    pub direct: Vec<ElementLight>,
    /// The irradiance one bounce earlier: what the nodes reflect.
    pub reflected: Vec<ElementLight>,
    /// How the iteration ended.
    pub convergence: Convergence,
}

/// Iterates B = M + ρ·E from the emitters' light. `links` are sorted by receiver, `first_link` holds the first of each
/// node. `bounces` limits the interreflections.
pub fn transport(
    scene: &Scene,
    elements: &Elements,
    links: &[Link],
    first_link: &[u32],
    bounces: Option<u32>,
) -> Transport {
    let nodes = elements.nodes.len();
    let materials: Vec<_> = (0..nodes as u32)
        .map(|node| elements.polygon_of(node))
        .map(|polygon| polygon.map(|polygon| (scene.reflectance(polygon), scene.material(polygon).exitance())))
        .map(|material| material.unwrap_or((Rgb::ZERO, Rgb::ZERO)))
        .collect();
    let leaving = |light: &[ElementLight]| -> Vec<Rgb> {
        let pairs = light.iter().zip(&materials);
        pairs.map(|(light, &(reflectance, exitance))| reflectance * light.irradiance + exitance).collect()
    };
    let leaf_power = |radiosity: &dyn Fn(usize) -> f64| -> f64 {
        elements.leaves().map(|leaf| radiosity(leaf as usize) * elements.nodes[leaf as usize].area).sum()
    };
    let mut result = Transport { irradiance: vec![ElementLight::default(); nodes], ..Transport::default() };
    result.reflected = result.irradiance.clone();
    let mut radiosity = leaving(&result.irradiance);
    let gathers = bounces.map_or(MOST_ITERATIONS, |bounces| bounces.saturating_add(1).min(MOST_ITERATIONS));
    while result.convergence.iterations < gathers {
        let gathered = gather(links, first_link, &radiosity);
        result.reflected = std::mem::take(&mut result.irradiance);
        result.irradiance = push_pull(elements, gathered);
        if result.convergence.iterations == 0 {
            result.direct = result.irradiance.clone();
        }
        let next = leaving(&result.irradiance);
        let moved = leaf_power(&|i| luminance((next[i] - radiosity[i]).abs()));
        let total = leaf_power(&|i| luminance(next[i]));
        radiosity = next;
        result.convergence.iterations += 1;
        result.convergence.residual = if total > 0.0 { moved / total } else { 0.0 };
        if result.convergence.residual <= RESIDUAL {
            break;
        }
    }
    result.convergence.reached = result.convergence.residual <= RESIDUAL || bounces.is_some();
    result
}

/// Irradiance that arrives at each node over its own links.
fn gather(links: &[Link], first_link: &[u32], radiosity: &[Rgb]) -> Vec<ElementLight> {
    first_link
        .par_windows(2)
        .with_min_len(64)
        .map(|range| {
            let mut light = ElementLight::default();
            for link in &links[range[0] as usize..range[1] as usize] {
                let LinkSource::Node(source) = link.source;
                let radiosity = radiosity[source as usize];
                light.irradiance += radiosity * (link.form_factor * link.visibility);
                light.gradient_u += radiosity * link.gradient.x;
                light.gradient_v += radiosity * link.gradient.y;
            }
            light
        })
        .collect()
}

/// Adds to every node what its ancestors received, then fits inner nodes to their children. Children have higher ids
/// than their parents.
fn push_pull(elements: &Elements, mut light: Vec<ElementLight>) -> Vec<ElementLight> {
    for node in 0..light.len() {
        let Some(patch) = elements.patch_of(node as u32) else { continue };
        let (frame, centre) = (&elements.patches[patch as usize], elements.nodes[node].centre);
        let received = light[node];
        for child in elements.children(node as u32) {
            let offset = elements.nodes[child as usize].centre - centre;
            let slope = received.gradient_u * frame.u.dot(offset) + received.gradient_v * frame.v.dot(offset);
            let child = &mut light[child as usize];
            child.irradiance += received.irradiance + slope;
            child.gradient_u += received.gradient_u;
            child.gradient_v += received.gradient_v;
        }
    }
    // Planes that fall below zero in a shadow would take light from the room.
    for leaf in elements.leaves() {
        light[leaf as usize].irradiance = light[leaf as usize].irradiance.max(Rgb::ZERO);
    }
    fit_inner_nodes(elements, &mut light);
    light
}
