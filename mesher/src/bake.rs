//! Solution → Baked: rounds of meshing, exchange of light and measurement until the bake keeps its tolerance.
//!
//! A round divides the leaves on which light from emitters is interpolated badly (`fine_mesh`), then those on which light over
//! reflectors is (`reflected_light`), and then measures the whole (`residual`). Where that misses the tolerance, the next round
//! asks both for less. Rounds are global: what is divided depends on the light alone, never on threads.

use glam::Vec3;
use rayon::prelude::*;
use scene::{Baked, BakedElement, BakedError, BakedTriangle, HalfEdges, Provenance, Rgb, Scene};
use solver::{NodeId, Solution};

use crate::fine_mesh::FineMesh;
use crate::probe::{colour_mean, percentile};
use crate::refinement::worst;
use crate::reflected_light::{Exchange, ReflectedLight};
use crate::residual::{ResidualPoint, residual};
use crate::{Discontinuity, Leaf, Mesh, MeshStatistics, Progress, Weight, discontinuities};

/// What a bake is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Relative root mean square error of irradiance that is accepted, and a fifth of the error that is accepted at 99 % of
    /// the area; 0..1.
    pub tolerance: f64,
    /// Discontinuities that a leaf follows at most (k of Hardt & Teller 1996, section 4.2).
    pub discontinuities: u32,
    /// How discontinuities are weighed.
    pub weight: Weight,
    /// Weight below which a discontinuity is not followed, in the weight's unit (w_min). None takes
    /// [`Weight::default_minimum`], in proportion to the tolerance.
    pub min_weight: Option<f64>,
    /// With more triangles than this a bake is not refined further; the last one with fewer is kept if there is one.
    pub max_triangles: usize,
}

/// The share of the tolerance that the interpolation of emitters' light, and as much again that of reflectors' light, may use
/// up in the first round, as probes see it. Probes miss what lies between them, and the sum of bounces what each is off by:
/// with more a first round seldom does, with less it takes leaves that nobody asked for.
const FIRST_SHARE: f64 = 0.36;

/// What the error is aimed at where a round has missed the tolerance, as a part of the tolerance; and by how much a share
/// shrinks for it at most and at least. Less divides too much, more asks for one round more.
const NEXT_AIM: f64 = 0.85;
const NEXT_SHARE: [f64; 2] = [0.5, 0.9];

/// Of the error that is allowed, as much is aimed at when leaves are chosen: their parts keep some of it.
const AIM: f64 = 0.6;

/// Meshes in one round at most. Each divides what the last one found wanting.
const MESHES: u32 = 12;

/// Rounds at most: by then a share is a small part of the tolerance, and the fault lies elsewhere.
const ROUNDS: u32 = 6;

/// Leaves with a cell shorter than this fraction of the scene's size are not divided: at a corner of contact the error falls
/// no faster than its area.
const SMALLEST_LEAF: f64 = 1e-3;

/// Length of the elements that light over reflectors is found on first, as a fraction of the scene's size. Longer ones miss
/// what lies between their probes, shorter ones cost more than a room needs.
const FRONT_LENGTH: f64 = 0.1;

/// The part of [`BakeOptions::tolerance`] that a row may misplace on account of each reflector, in the first round. What is
/// misplaced has one sign, since a point sees most of what is near and light is mostly brightest in the middle: many
/// reflectors, and many bounces, add up. More is faster where they are few.
const FIRST_SOURCE_SHARE: f64 = 0.12;

/// What that part shrinks by from round to round where the bake as a whole is too dark or too bright by more than `BIAS` of
/// the tolerance.
const NEXT_SOURCE_SHARE: f64 = 0.3;
const BIAS: f64 = 0.25;

/// The part of the tolerance, relative to the scene's mean irradiance, that all further exchanges may still change a sample by:
/// the last one's change, summed over the bounces to come.
const RESIDUAL_SHARE: f64 = 0.02;

impl Default for BakeOptions {
    /// One percent, and the paper's k.
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            discontinuities: 10,
            weight: Weight::default(),
            min_weight: None,
            max_triangles: usize::MAX,
        }
    }
}

/// What is told of a bake while it is made, and asked.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Is told the fraction that is done.
    pub progress: Progress<'a>,
    /// Whether to stop with the best bake so far: asked between rounds.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// A bake, the solution as it was refined for it, and counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Bake {
    /// The bake; its provenance is left empty.
    pub baked: Baked,
    /// The solution with the elements and the light of the bake.
    pub solution: Solution,
    /// Counts.
    pub statistics: BakeStatistics,
}

/// Counts of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BakeStatistics {
    /// Rounds of meshing and measurement.
    pub rounds: u32,
    /// The least weight that was used, in the weight's unit.
    pub min_weight: f64,
    /// Discontinuities of at least the least weight, over all polygons.
    pub discontinuities_found: usize,
    /// Discontinuities that at least one leaf follows.
    pub discontinuities_kept: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Samples, each evaluated once.
    pub samples: usize,
    /// Points at which reflectors were looked at.
    pub rows: usize,
    /// What the triangulation could not do as planned.
    pub mesh: MeshStatistics,
}

/// Bakes a solved scene.
pub fn bake(scene: &Scene, solution: Solution, options: &BakeOptions, control: Control<'_>) -> Bake {
    let relative = options.tolerance / BakeOptions::default().tolerance;
    let min_weight = options.min_weight.unwrap_or_else(|| relative * options.weight.default_minimum(scene, &solution));
    (control.progress)(0.0);
    let found = all_discontinuities(scene, &solution, options.weight, min_weight);
    let reflectance = mean_reflectance(scene, &solution);
    let mut rounds = Rounds {
        scene,
        options,
        reflected: ReflectedLight::new(&solution, FRONT_LENGTH * scene.size()),
        mean: colour_mean(solution.mean_irradiance),
        solution,
        found,
        share: FIRST_SHARE,
        source_share: FIRST_SOURCE_SHARE,
        reflectance,
    };
    let mut statistics = BakeStatistics { min_weight, ..BakeStatistics::default() };
    let mut without_gain = 0;
    let mut best: Option<(FineMesh, Vec<Rgb>, BakedError)> = None;
    let (fine, samples, error) = loop {
        let fine = rounds.mesh();
        let samples = rounds.samples(&fine);
        let reflecting = &rounds.reflected.reflecting;
        let points = residual(scene, &rounds.solution, &fine, &samples, reflecting, options.tolerance);
        let (error, bias) = measured(&points, options.tolerance, rounds.reflectance);
        statistics.rounds += 1;
        let too_many = fine.triangles() > options.max_triangles;
        let missed = |error: &BakedError| (error.rms / options.tolerance).max(error.p99 / (P99 * options.tolerance));
        let (last, stop) = (missed(&error), error.holds || too_many || statistics.rounds == ROUNDS || (control.stop)());
        if best.as_ref().is_none_or(|(.., least)| last < missed(least) && !too_many) {
            best = Some((fine, samples, error));
            without_gain = 0;
        } else {
            without_gain += 1;
        }
        // What finer leaves do not mend twice is not theirs to mend; once it may have been a few points.
        if (stop || without_gain == 2)
            && let Some(best) = best
        {
            break best;
        }
        if bias > BIAS * options.tolerance {
            rounds.source_share *= NEXT_SOURCE_SHARE;
        } else {
            rounds.share *= (NEXT_AIM / last).clamp(NEXT_SHARE[0], NEXT_SHARE[1]);
        }
        (control.progress)(1.0 - 0.5f64.powi(statistics.rounds as i32));
    };
    (control.progress)(1.0);
    let samples: Vec<Vec3> = samples.iter().map(|value| value.max(Rgb::ZERO).as_vec3()).collect();
    let (vertices, triangles) = stored_triangles(&fine.leaves, &fine.mesh, &fine.table.triangles);
    let statistics = BakeStatistics {
        discontinuities_found: rounds.found.iter().map(Vec::len).sum(),
        discontinuities_kept: fine.lines.len(),
        vertices: vertices.len(),
        triangles: triangles.len(),
        samples: samples.len(),
        rows: rounds.reflected.rows(),
        mesh: fine.mesh.statistics,
        ..statistics
    };
    let solution = &rounds.solution;
    let light = if solution.reflects() { &solution.light } else { &solution.irradiance };
    let element = |leaf: &Leaf| BakedElement {
        polygon: leaf.polygon,
        irradiance: light[leaf.element as usize].irradiance.as_vec3(),
    };
    let baked = Baked {
        scene: scene.clone(),
        vertices,
        samples,
        triangle_errors: vec![0.0; triangles.len()],
        triangles,
        elements: fine.leaves.iter().map(element).collect(),
        lines: fine.lines,
        error,
        provenance: Provenance::default(),
    };
    Bake { baked, solution: rounds.solution, statistics }
}

/// What goes from round to round.
struct Rounds<'a> {
    scene: &'a Scene,
    options: &'a BakeOptions,
    solution: Solution,
    found: Vec<Vec<Discontinuity>>,
    reflected: ReflectedLight,
    /// Mean irradiance of all surfaces, averaged over the colours, W·m⁻².
    mean: f64,
    /// The share of the tolerance that each of the two kinds of light may use up in this round.
    share: f64,
    /// The part of the tolerance that a row may misplace on account of each reflector.
    source_share: f64,
    /// The part of the light on all surfaces that they reflect, 0..=1.
    reflectance: f64,
}

impl Rounds<'_> {
    /// One round: divides leaves until both kinds of light are interpolated well enough; the mesh of the last division.
    fn mesh(&mut self) -> FineMesh {
        let mut fine = self.mesh_emitted();
        if !self.solution.reflects() {
            return fine;
        }
        for _ in 0..MESHES {
            let exchange = Exchange {
                source_error: self.source_share * self.options.tolerance,
                residual: RESIDUAL_SHARE * self.options.tolerance * self.mean * (1.0 - self.reflectance),
            };
            self.reflected.solve(self.scene, &mut self.solution, &fine, &exchange);
            let errors = self.reflected.leaf_errors(self.scene, &self.solution, &exchange);
            let leaves: Vec<(NodeId, f64)> = errors
                .iter()
                .map(|error| {
                    let own = error.irradiance + colour_mean(self.solution.direct[error.element as usize].irradiance);
                    (error.element, error.error / own.max(self.mean))
                })
                .collect();
            let divided = self.wanting(&leaves);
            if divided.is_empty() || fine.triangles() > self.options.max_triangles {
                break;
            }
            if self.reflected.divide(&mut self.solution, &divided) {
                fine = self.fine_mesh();
            }
        }
        fine
    }

    /// The mesh of the solution's leaves as they are.
    fn fine_mesh(&self) -> FineMesh {
        let BakeOptions { discontinuities, weight, .. } = *self.options;
        FineMesh::new(self.scene, &self.solution, &self.found, weight, discontinuities as usize)
    }

    /// Irradiance at the samples of a mesh, W·m⁻².
    fn samples(&self, fine: &FineMesh) -> Vec<Rgb> {
        if self.solution.reflects() { self.reflected.irradiance(&self.solution, fine) } else { fine.emitted.clone() }
    }

    /// Divides leaves until light from emitters is interpolated well enough.
    fn mesh_emitted(&mut self) -> FineMesh {
        let mut fine = self.fine_mesh();
        for _ in 0..MESHES {
            let mut leaves: Vec<(NodeId, f64)> = fine.leaves.iter().map(|leaf| (leaf.element, 0.0)).collect();
            for (triangle, (error, emitted)) in fine.probe_emitted(self.scene, &self.solution).into_iter().enumerate() {
                let leaf = fine.mesh.triangles[triangle].leaf as usize;
                let element = leaves[leaf].0;
                let own = emitted + colour_mean(self.solution.reflected_over_links(element, glam::DVec2::ZERO));
                let part = scene::area_vector(&fine.corners(triangle)).length()
                    / self.solution.elements.nodes[element as usize].area;
                leaves[leaf].1 += part * (error / own.max(self.mean)).powi(2);
            }
            leaves.iter_mut().for_each(|leaf| leaf.1 = leaf.1.sqrt());
            let divided = self.wanting(&leaves);
            if divided.is_empty() || fine.triangles() > self.options.max_triangles {
                break;
            }
            for leaf in divided {
                self.solution.subdivide(leaf);
            }
            fine = self.fine_mesh();
        }
        fine
    }

    /// Of elements with their relative errors, those that are to be divided so that this round's share is kept; ascending.
    fn wanting(&self, leaves: &[(NodeId, f64)]) -> Vec<NodeId> {
        let elements = &self.solution.elements;
        let area = |leaf: NodeId| elements.nodes[leaf as usize].area;
        let total: f64 = leaves.iter().map(|&(leaf, _)| area(leaf)).sum();
        let allowed = (self.share * self.options.tolerance).powi(2) * total;
        let smallest = SMALLEST_LEAF * self.scene.size();
        let weighted: Vec<f64> = leaves
            .iter()
            .map(|&(leaf, error)| {
                let divides = elements.cell_length(leaf) > smallest && error.is_finite();
                if divides { error * error * area(leaf) } else { 0.0 }
            })
            .collect();
        if weighted.iter().sum::<f64>() <= allowed {
            return Vec::new();
        }
        let mut divided: Vec<NodeId> = worst(&weighted, AIM * allowed).into_iter().map(|i| leaves[i].0).collect();
        divided.sort_unstable();
        divided
    }
}

/// The error that is accepted at 99 % of the area, in tolerances.
const P99: f64 = 5.0;

/// One-sided 99 % of the normal distribution.
const CONFIDENCE: f64 = 2.326;

/// The error of a bake by its residual at points spread evenly by area, each relative to max(own, mean) irradiance.
/// `reflectance` is the part of all light that is reflected. And the part of it that the bake as a whole is off by, after all
/// bounces.
fn measured(points: &[ResidualPoint], tolerance: f64, reflectance: f64) -> (BakedError, f64) {
    let count = points.len() as f64;
    if points.is_empty() {
        return (BakedError { holds: true, ..BakedError::default() }, 0.0);
    }
    let mean = points.iter().map(|point| point.irradiance).sum::<f64>() / count;
    let scale = |point: &ResidualPoint| point.irradiance.max(mean).max(f64::MIN_POSITIVE);
    let product = |point: &ResidualPoint| {
        let [a, b] = point.differences;
        colour_mean(a * b) / scale(point).powi(2)
    };
    let mean_square = points.iter().map(product).sum::<f64>() / count;
    // What the residual is off by on average, or may be for all that was measured, is reflected again and again: the bake is
    // off by the sum of it.
    let excess = |point: &ResidualPoint| colour_mean(point.differences[0] + point.differences[1]) / 2.0;
    let mean_excess = points.iter().map(excess).sum::<f64>() / count;
    let spread = points.iter().map(|point| (excess(point) - mean_excess).powi(2)).sum::<f64>() / count;
    let limit = mean_excess.abs() + CONFIDENCE * (spread / count).sqrt();
    let sum_of_bounces = |excess: f64| if mean > 0.0 { excess / mean / (1.0 - reflectance) } else { 0.0 };
    let amplified = sum_of_bounces(limit).powi(2) * reflectance * (2.0 - reflectance);
    let scatter = points.iter().map(|point| (product(point) - mean_square).powi(2)).sum::<f64>() / count;
    let limit = mean_square + CONFIDENCE * (scatter / count).sqrt();
    let errors: Vec<f64> = points
        .iter()
        .map(|point| {
            let difference = (point.differences[0] + point.differences[1]) / 2.0;
            colour_mean(difference * difference).sqrt() / scale(point)
        })
        .collect();
    let p99 = percentile(&errors, &vec![1.0; errors.len()], 0.99);
    let rms = (limit.max(0.0) + amplified).sqrt();
    let error = BakedError {
        rms,
        p99,
        max: errors.iter().copied().fold(0.0, f64::max),
        points: points.len() as u64,
        holds: rms <= tolerance && p99 <= P99 * tolerance,
    };
    (error, sum_of_bounces(mean_excess.abs()))
}

/// Reflectance that a mean is taken for at most: beyond it nothing can be said by a sum.
const LARGEST_REFLECTANCE: f64 = 0.95;

/// The part of the light on all surfaces that they reflect, 0..=1.
fn mean_reflectance(scene: &Scene, solution: &Solution) -> f64 {
    if !solution.reflects() {
        return 0.0;
    }
    let (mut arrives, mut leaves) = (0.0, 0.0);
    for leaf in solution.elements.leaves() {
        let Some(polygon) = solution.elements.polygon_of(leaf) else { continue };
        let irradiance = solution.irradiance[leaf as usize].irradiance * solution.elements.nodes[leaf as usize].area;
        arrives += colour_mean(irradiance);
        leaves += colour_mean(irradiance * scene.material(polygon).reflectance);
    }
    if arrives > 0.0 { (leaves / arrives).min(LARGEST_REFLECTANCE) } else { 0.0 }
}

/// The discontinuities on every polygon.
fn all_discontinuities(scene: &Scene, solution: &Solution, weight: Weight, min_weight: f64) -> Vec<Vec<Discontinuity>> {
    let half_edges = HalfEdges::new(scene);
    scene
        .polygon_ids()
        .into_par_iter()
        .map(|receiver| {
            let interactions = solution.interactions(scene, receiver);
            discontinuities(scene, &half_edges, receiver, &interactions, weight, min_weight)
        })
        .collect()
}

/// The mesh as it is stored: without the vertices that no triangle uses.
fn stored_triangles(leaves: &[Leaf], mesh: &Mesh, samples: &[[u32; 6]]) -> (Vec<Vec3>, Vec<BakedTriangle>) {
    const UNUSED: u32 = u32::MAX;
    let mut stored = vec![UNUSED; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .zip(samples)
        .map(|(triangle, &samples)| BakedTriangle {
            vertices: triangle.vertices.map(|vertex| {
                let id = &mut stored[vertex as usize];
                if *id == UNUSED {
                    *id = vertices.len() as u32;
                    vertices.push(mesh.vertices[vertex as usize].as_vec3());
                }
                *id
            }),
            samples,
            polygon: leaves[triangle.leaf as usize].polygon,
            element: triangle.leaf,
            edges: triangle.edges,
        })
        .collect();
    (vertices, triangles)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::DVec3;
    use scene::Rgb;
    use solver::{SolveOptions, solve};

    use super::*;
    use crate::testing::scene_of;

    /// A rectangle across z around a middle, facing up or down.
    fn rectangle(middle: [f64; 3], half: f64, up: bool) -> Vec<DVec3> {
        let mut corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)]
            .map(|(x, y)| DVec3::from(middle) + DVec3::new(x, y, 0.0) * half)
            .to_vec();
        if !up {
            corners.reverse();
        }
        corners
    }

    /// A floor under a lamp, half hidden from it by a plate.
    fn floor_lamp_and_plate() -> Scene {
        let outlines = [
            rectangle([0.0, 0.0, 0.0], 2.0, true),
            rectangle([0.0, 0.0, 2.0], 0.2, false),
            rectangle([0.31, 0.17, 1.0], 0.4, true),
        ];
        let mut scene = scene_of(&outlines);
        let lamp = scene::Material { name: "lamp".into(), radiance: Rgb::splat(100.0), ..scene.materials[0].clone() };
        scene.materials.push(lamp);
        scene.polygons[1].material = 1;
        scene
    }

    /// The direct light of a scene.
    fn baked(scene: &Scene, options: &BakeOptions) -> (Baked, BakeStatistics) {
        baked_with(scene, options, Some(0))
    }

    fn baked_with(scene: &Scene, options: &BakeOptions, bounces: Option<u32>) -> (Baked, BakeStatistics) {
        let solution = solve(scene, &SolveOptions { bounces, ..SolveOptions::default() }, &|_| ());
        let progress = |fraction| assert!((0.0..=1.0).contains(&fraction));
        let bake = bake(scene, solution, options, Control { progress: &progress, stop: &|| false });
        (bake.baked, bake.statistics)
    }

    #[test]
    fn an_empty_scene_bakes_to_nothing() {
        let (baked, statistics) = baked(&Scene::default(), &BakeOptions::default());
        let error = BakedError { holds: true, ..BakedError::default() };
        assert_eq!(baked, Baked { error, ..Baked::default() });
        assert_eq!((statistics.triangles, statistics.samples, statistics.rounds), (0, 0, 1));
    }

    #[test]
    fn triangles_fill_every_polygon_and_all_is_in_range() {
        let scene = floor_lamp_and_plate();
        let (baked, statistics) = baked(&scene, &BakeOptions { min_weight: Some(1.0), ..BakeOptions::default() });
        baked.validate().unwrap();
        assert_eq!(statistics.mesh, MeshStatistics::default());
        assert_eq!(statistics.discontinuities_kept, baked.lines.len());
        assert!(baked.error.holds && baked.error.points > 0);
        for polygon in scene.polygon_ids() {
            let of_polygon = (0..baked.triangles.len() as u32)
                .filter(|&triangle| baked.triangles[triangle as usize].polygon == polygon);
            let area: f64 = of_polygon.map(|triangle| scene::area_vector(&baked.corners(triangle)).length()).sum();
            assert!((area / scene.area(polygon) - 1.0).abs() < 1e-6, "the rounding to f32");
        }
    }

    #[test]
    fn following_discontinuities_saves_triangles() {
        let scene = floor_lamp_and_plate();
        let triangles = |discontinuities| {
            let options = BakeOptions {
                tolerance: 1e-3,
                discontinuities,
                weight: Weight::Ratio,
                min_weight: Some(1.0),
                ..BakeOptions::default()
            };
            let (baked, statistics) = baked(&scene, &options);
            assert!(baked.error.holds);
            statistics.triangles
        };
        let (none, all) = (triangles(0), triangles(20));
        assert!(all * 2 < none, "{all} of {none}");
    }

    #[test]
    fn the_error_falls_with_the_tolerance() {
        let scene = floor_lamp_and_plate();
        let error = |tolerance| baked(&scene, &BakeOptions { tolerance, ..BakeOptions::default() }).0.error.rms;
        let errors = [0.03, 0.003, 3e-4].map(error);
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
        assert!(errors[2] <= 3e-4);
    }

    #[test]
    fn too_few_triangles_are_said_to_miss() {
        let scene = floor_lamp_and_plate();
        let options = BakeOptions { tolerance: 1e-3, max_triangles: 100, ..BakeOptions::default() };
        let (baked, _) = baked(&scene, &options);
        assert!(!baked.error.holds && baked.error.rms > 1e-3);
        baked.validate().unwrap();
    }

    #[test]
    fn any_number_of_threads_bakes_the_same() {
        let scene = floor_lamp_and_plate();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| baked_with(&scene, &BakeOptions { tolerance: 0.05, ..BakeOptions::default() }, None))
        };
        assert!(run(1) == run(3));
    }
}
