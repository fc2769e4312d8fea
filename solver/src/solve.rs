//! The solve: cut → link → refine and transport in turns → reconstruct.

use scene::{Rgb, Scene, luminance};

use crate::cut::{contact_lines, cut_polygon};
use crate::irradiance::Gather;
use crate::reconstruct::linear_light;
use crate::refine::{Network, SourceLight};
use crate::transport::{Transport, transport};
use crate::{Elements, Solution, SolveOptions};

/// Link error as a fraction of the scene's mean irradiance where none is asked for. Halving it doubles the elements.
const RELATIVE_LINK_ERROR: f64 = 0.1;

/// Times that links are refined by the light of the transport before. The first has seen patches only, the second
/// elements; later ones hardly change a link.
const REFINEMENTS: u32 = 3;

/// Solves diffuse global illumination for a scene. `progress` is told the fraction that is done, 0..=1.
///
/// A scene without emitters solves to darkness.
pub fn solve(scene: &Scene, options: &SolveOptions, progress: &(dyn Fn(f64) + Sync)) -> Solution {
    let cuts = contact_lines(scene);
    let pieces: Vec<_> =
        scene.polygon_ids().map(|polygon| cut_polygon(&scene.outline(polygon), &cuts[polygon as usize])).collect();
    let mut first_patch = vec![0];
    for pieces in &pieces {
        first_patch.push(first_patch.last().unwrap_or(&0) + pieces.len() as u32);
    }
    let mut network =
        Network::of_patches(scene, Elements::new(&pieces), &first_patch, options.bounces == Some(0));
    progress(0.1);
    let (mut links, mut first_link) = network.sorted_links();
    let mut carried = transport(scene, &network.elements, &links, &first_link, options.bounces);
    let mean = mean_irradiance(&network.elements, &carried);
    let link_error = options.link_error.unwrap_or(RELATIVE_LINK_ERROR * luminance(mean));
    for pass in 0..REFINEMENTS {
        let light = source_light(scene, &network.elements, &carried);
        let refined = network.refine(&light, link_error);
        progress(0.1 + 0.6 * f64::from(pass + 1) / f64::from(REFINEMENTS));
        if !refined {
            break;
        }
        (links, first_link) = network.sorted_links();
        carried = transport(scene, &network.elements, &links, &first_link, options.bounces);
    }
    let (elements, blockers) = network.finish();
    let mean_irradiance = mean_irradiance(&elements, &carried);
    let mut solution = Solution {
        elements,
        cuts,
        first_patch,
        links,
        first_link,
        blockers,
        irradiance: carried.irradiance,
        light: carried.before,
        mean_irradiance,
        convergence: carried.convergence,
        link_error,
        bounces: options.bounces,
    };
    if solution.reflects() {
        solution.light = linear_light(&Gather::new(scene, &solution), &solution, &|done| progress(0.7 + 0.3 * done));
    }
    progress(1.0);
    solution
}

/// What refinement goes by: radiosity as a source, and how far it varies below each node.
fn source_light(scene: &Scene, elements: &Elements, transport: &Transport) -> SourceLight {
    let (radiosity, deviation) = (0..elements.nodes.len() as u32)
        .map(|node| {
            let Some(polygon) = elements.polygon_of(node) else { return (0.0, 0.0) };
            let (material, light) = (scene.material(polygon), &transport.reflected[node as usize]);
            let radiosity = material.reflectance * light.irradiance + material.exitance();
            // A source's own slope counts as variation, too: a link carries its mean.
            let size = elements.nodes[node as usize].cell_max - elements.nodes[node as usize].cell_min;
            let slope = luminance(light.gradient_u.abs() * size.x + light.gradient_v.abs() * size.y) / 2.0;
            (luminance(radiosity), (light.deviation + slope) * luminance(material.reflectance))
        })
        .unzip();
    SourceLight { radiosity, deviation }
}

/// Area-weighted mean irradiance over all leaves, W·m⁻².
fn mean_irradiance(elements: &Elements, transport: &Transport) -> Rgb {
    let area = |leaf: u32| elements.nodes[leaf as usize].area;
    let total: f64 = elements.leaves().map(area).sum();
    let sum: Rgb = elements.leaves().map(|leaf| transport.irradiance[leaf as usize].irradiance * area(leaf)).sum();
    if total > 0.0 { sum / total } else { Rgb::ZERO }
}
