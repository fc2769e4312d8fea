//! Light where a bake was stopped before it was found: the best guess that is to be had.
//!
//! In a scene with links it is what these carry. Without, it is the mean of what is known on the same polygon, or if nothing is,
//! of what is known anywhere, or if that is nothing, of a closed room with the scene's lamps; and light over reflectors is as much
//! everywhere as a closed room of the scene's reflectance has.

use std::collections::HashMap;

use glam::Vec3;
use scene::Rgb;
use solver::{Solution, Visibility};

use crate::SampleQuery;
use crate::reflected_light::offset;

/// Irradiance from emitters, W·m⁻²: as it is known, or guessed.
pub(crate) fn guessed_emitted(solution: &Solution, queries: &[SampleQuery], known: &[Option<Vec3>]) -> Vec<Vec3> {
    let pairs = || queries.iter().zip(known);
    if solution.visibility == Visibility::Links {
        let over_links = |query: &SampleQuery| {
            solution.direct[query.element as usize].at(offset(solution, query.element, query.position)).as_vec3()
        };
        return pairs().map(|(query, known)| known.unwrap_or_else(|| over_links(query))).collect();
    }
    let mean = |(sum, count): (Rgb, u32)| (sum / f64::from(count.max(1))).as_vec3();
    let mut of_all = (Rgb::ZERO, 0);
    let mut of_polygons: HashMap<u32, (Rgb, u32)> = HashMap::new();
    for (query, light) in pairs().filter_map(|(query, known)| Some((query, (*known)?))) {
        for (sum, count) in [&mut of_all, of_polygons.entry(query.polygon).or_default()] {
            *sum += light.as_dvec3();
            *count += 1;
        }
    }
    let of_all = if of_all.1 == 0 { (solution.mean_irradiance, 1) } else { of_all };
    let guess = |query: &SampleQuery| mean(*of_polygons.get(&query.polygon).unwrap_or(&of_all));
    pairs().map(|(query, known)| known.unwrap_or_else(|| guess(query))).collect()
}

/// Irradiance over reflectors, W·m⁻², where nothing is known of it; `reflectance` is the part of all light that is reflected.
pub(crate) fn guessed_reflected(solution: &Solution, query: &SampleQuery, reflectance: f64) -> Rgb {
    match solution.visibility {
        Visibility::Links => {
            solution.reflected_over_links(query.element, offset(solution, query.element, query.position))
        }
        Visibility::Rays => solution.mean_irradiance * reflectance,
    }
}
