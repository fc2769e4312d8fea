//! The sources of the light at a point of a bake: who sends how much, past what.
//!
//! A bake holds the light that arrives, not where it comes from. So its scene is solved once more, which takes moments: for
//! the elements, their links and blockers. What the elements reflect is then read from the bake, and gathered at the point.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec2, DVec3};
use scene::{Baked, Bvh, Rgb, Scene, centroid};
use solver::{Contribution, ElementLight, Gather, NodeId, Sender, Solution, SolveOptions, Surroundings, colour_slope};
use viewer::{LightSource, SurfacePoint};

use crate::pipeline;
use crate::probe::REACH;

/// What part of the way from an element's centre to its corners light is read at: the corners of a quad then tell the mean of a
/// quadratic over it exactly.
const WAY: f64 = 0.577;

/// Finds sources, and keeps the solution of the bake that was asked about last.
#[derive(Default)]
pub struct LightSources {
    solved: Mutex<Option<(Arc<Baked>, Arc<Solution>)>>,
}

impl LightSources {
    /// The sources of the light at a point, the strongest first.
    pub fn at(
        &self,
        baked: &Arc<Baked>,
        SurfacePoint { triangle, s, t }: SurfacePoint,
    ) -> Result<Vec<LightSource>, String> {
        let solution = self.solution(baked);
        let scene = &baked.scene;
        let record = baked.triangles.get(triangle as usize).ok_or("the point is not on this bake")?;
        let [a, b, c] = baked.corners(triangle);
        let position = a * (1.0 - s - t) + b * s + c * t;
        // On a contact line the side of the triangle counts.
        let inward = (a + b + c) / 3.0 - position;
        let found = Gather::new(&Surroundings::new(scene, &solution), &solution).contributions_at(
            record.polygon,
            position,
            inward,
        );
        Ok(found.into_iter().map(|contribution| light_source(scene, contribution)).collect())
    }

    /// The solution of a bake's scene, with the light of the bake.
    pub fn solution(&self, baked: &Arc<Baked>) -> Arc<Solution> {
        let mut solved = self.solved.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, solution)) = &*solved
            && Arc::ptr_eq(of, baked)
        {
            return solution.clone();
        }
        let solution = Arc::new(solved_as(baked));
        *solved = Some((baked.clone(), solution.clone()));
        solution
    }
}

fn solved_as(baked: &Baked) -> Solution {
    let flags = pipeline::light_flags(&baked.provenance);
    let options = SolveOptions { link_error: flags.link_error, bounces: flags.bounces };
    let mut solution = solver::solve(&baked.scene, &options, &|_| ());
    let (bvh, reach) = (baked.bvh(), REACH * baked.scene.size());
    let leaves: Vec<NodeId> = solution.elements.leaves().collect();
    let light: Vec<(NodeId, ElementLight)> = leaves
        .into_iter()
        .filter_map(|leaf| Some((leaf, element_light(baked, &bvh, &solution, leaf, reach)?)))
        .collect();
    if solution.reflects() {
        solution.set_light(light);
    }
    solution.mean_irradiance = baked.mean_irradiance();
    solution
}

/// The plane that is nearest to a bake's light between an element's centre and its corners.
fn element_light(baked: &Baked, bvh: &Bvh, solution: &Solution, leaf: NodeId, reach: f64) -> Option<ElementLight> {
    let elements = &solution.elements;
    let patch = &elements.patches[elements.patch_of(leaf)? as usize];
    let centre = elements.nodes[leaf as usize].centre;
    let read = |&corner: &DVec3| {
        let place = centre + (corner - centre) * WAY;
        let (triangle, s, t) = baked.locate(bvh, place, patch.normal(), reach)?;
        Some((patch.along(place - centre), baked.irradiance(triangle, s, t)))
    };
    let points: Vec<(DVec2, Rgb)> = elements.outline(leaf).iter().filter_map(read).collect();
    let count = points.len() as f64;
    let middle = points.iter().map(|point| point.0).sum::<DVec2>() / count;
    let mean = points.iter().map(|point| point.1).sum::<Rgb>() / count;
    let around = points.iter().map(|&(place, irradiance)| (place - middle, irradiance - mean, 1.0));
    let (gradient_u, gradient_v) = colour_slope(around);
    let irradiance = mean - gradient_u * middle.x - gradient_v * middle.y;
    (count > 0.0).then_some(ElementLight { irradiance, gradient_u, gradient_v, deviation: 0.0 })
}

/// A contribution as a user calls it.
fn light_source(scene: &Scene, contribution: Contribution) -> LightSource {
    let irradiance = contribution.irradiance();
    let without_surface =
        |name: &str| LightSource { name: name.to_owned(), emits: true, irradiance, middle: None, blockers: Vec::new() };
    let polygon = match contribution.sender {
        Sender::Polygon(polygon) => polygon,
        Sender::FaintEmitters => return without_surface("faint lamps together"),
        Sender::Sky => return without_surface("sky"),
    };
    let material = &scene.material(polygon).name;
    let object = &scene.objects[scene.polygons[polygon as usize].object as usize];
    LightSource {
        name: if object.is_empty() { material.clone() } else { format!("{object} · {material}") },
        emits: contribution.emitted.max_element() > 0.0,
        irradiance,
        middle: Some(centroid(&scene.outline(polygon))),
        blockers: contribution.blockers.iter().map(|&blocker| scene.outline(blocker)).collect(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use scene::luminance;

    use super::*;
    use crate::args::LightFlags;

    /// What is gathered from the sources is the irradiance of the bake, to its tolerance and that of planes over elements.
    #[test]
    fn the_sources_of_a_bake_sum_up_to_its_light() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes/cornell_box.obj");
        let scene = formats::read_scene(&path).unwrap().scene;
        let flags = LightFlags { tolerance: 0.05, ..LightFlags::default() };
        let baked = Arc::new(pipeline::bake(&scene, &flags, None).baked);
        let sources = LightSources::default();
        let mean = luminance(baked.mean_irradiance());
        for triangle in (0..baked.triangles.len() as u32).step_by(200) {
            let found = sources.at(&baked, SurfacePoint { triangle, s: 0.3, t: 0.3 }).unwrap();
            let gathered = luminance(found.iter().map(|source| source.irradiance).sum());
            let own = luminance(baked.irradiance(triangle, 0.3, 0.3));
            assert!((gathered - own).abs() < 0.05 * own.max(mean), "triangle {triangle}: {gathered} {own}");
        }
        assert!(sources.at(&baked, SurfacePoint { triangle: u32::MAX, s: 0.0, t: 0.0 }).is_err());
    }
}
