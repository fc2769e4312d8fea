//! The residual of a bake: what one more bounce, found by other means, would change.
//!
//! At points spread evenly by area light is found once more: from emitters exactly, over reflectors by the means of the nodes
//! that a point sees, whose form factors are exact, corrected by rays. A ray reads at its end by how much the bake differs from
//! the mean that was taken for it. So the answer has no bias, and rays have little to scatter about (a control variate): it
//! sees the error of interpolants, of planes over nodes and of what was not opened, all together. There are two independent halves of the rays, and
//! the mean square is that of the products of the two differences, in which what scatter there is cancels.

use std::collections::HashSet;

use glam::{DVec2, DVec3, Vec3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use scene::{Bvh, Interpolant, Ray, Rgb, Scene, other_sides};
use solver::{Cosine, Gather, NodeId, SeenNode, Shafts, Solution, Surroundings, Visibility, hemisphere};

use crate::fine_mesh::FineMesh;
use crate::inquiry::Inquiry;
use crate::probe::{at, colour_mean};

/// Points of which a residual is taken. Twice as many halve the variance of the measured error at twice the cost.
pub(crate) const POINTS: usize = 1024;

/// What each half may scatter by at a point, as a part of the tolerance; and the rays that it takes at least and at most.
const SCATTER: f64 = 1.0;
const RAYS: [f64; 2] = [4.0, 4096.0];

/// The source error whose rays measure a scene without links, as a part of the tolerance: what each half scatters by is then
/// about what the bake may be off by.
const TURNED_ERROR: f64 = 0.12;

/// How far the light of a reflector may stray from a plane over the nodes that points see, as a fraction of the scene's mean
/// irradiance. More leaves more to rays, less more to form factors. The nodes are the same for all that a point sees of a
/// reflector: a ray must know which of them its end was counted with.
const STRAYS: f64 = 0.1;

/// What was measured at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ResidualPoint {
    /// Bake minus exact of the two halves, W·m⁻².
    pub differences: [Rgb; 2],
    /// The exact irradiance by both halves, averaged over the colours, W·m⁻².
    pub irradiance: f64,
    pub triangle: u32,
}

impl ResidualPoint {
    /// Its numbers, as they are remembered.
    pub fn numbers(&self) -> [f64; 7] {
        let [a, b] = self.differences;
        [a.x, a.y, a.z, b.x, b.y, b.z, self.irradiance]
    }

    /// The point of a triangle that has such numbers.
    pub fn of(triangle: u32, [ax, ay, az, bx, by, bz, irradiance]: [f64; 7]) -> Self {
        Self { differences: [Rgb::new(ax, ay, az), Rgb::new(bx, by, bz)], irradiance, triangle }
    }
}

/// Measures at a fixed set of points; at the first of them, if the bake is stopped meanwhile. `samples` are the bake's
/// irradiances at the samples of the fine mesh, `reflecting` what its reflectors send, W·m⁻².
pub(crate) fn residual(
    surroundings: &Surroundings<'_>,
    solution: &Solution,
    fine: &FineMesh,
    samples: &[Vec3],
    reflecting: &[Vec3],
    tolerance: f64,
    inquiry: &mut Inquiry<'_>,
) -> Vec<ResidualPoint> {
    if inquiry.stopped() {
        return Vec::new();
    }
    if solution.visibility == Visibility::Rays {
        return residual_by_rays(surroundings, solution, fine, samples, tolerance, inquiry);
    }
    let scene = surroundings.scene;
    let gather = Gather::with_even_nodes(surroundings, solution, STRAYS);
    let bvh = Bvh::of_triangles((0..fine.triangles()).map(|triangle| fine.corners(triangle)).collect());
    let mean = colour_mean(solution.mean_irradiance);
    let misfits = misfits(scene, solution, fine, reflecting);
    let value = |samples: &[Vec3], triangle: usize, s: f64, t: f64| {
        Interpolant::through(fine.table.triangles[triangle].map(|sample| samples[sample as usize].as_dvec3()))
            .evaluate(s, t)
    };
    let polygon_of = |triangle: u32| fine.leaves[fine.mesh.triangles[triangle as usize].leaf as usize].polygon;
    let other_sides = other_sides(scene);
    let normals: Vec<DVec3> = scene.polygon_ids().map(|polygon| scene.plane(polygon).normal).collect();
    // By how much the bake at the end of a ray differs from the mean of the seen node that it lies on.
    let correction = |origin: DVec3, direction: DVec3, polygon: u32, seen: &HashSet<NodeId>| {
        // A ray neither meets the surface that it starts on, nor the back of a surface whose other side is in the same place.
        let meets = |triangle: u32| {
            let met = polygon_of(triangle);
            let faces = normals[met as usize].dot(direction) < 0.0;
            met != polygon
                && other_sides[polygon as usize] != Some(met)
                && (faces || other_sides[met as usize].is_none())
        };
        let hit = bvh.closest_hit_among(&Ray { origin, direction }, meets)?;
        if hit.normal.dot(direction) >= 0.0 {
            return None;
        }
        let leaf = &fine.leaves[fine.mesh.triangles[hit.id as usize].leaf as usize];
        let node = solution.elements.ancestors(leaf.element).find(|node| seen.contains(node));
        let known = node.map_or(Rgb::ZERO, |node| solution.light[node as usize].irradiance);
        Some(scene.reflectance(leaf.polygon) * (value(reflecting, hit.id as usize, hit.s, hit.t) - known))
    };
    inquiry.residuals(&points(fine), |number, (triangle, s, t)| {
        let leaf = &fine.leaves[fine.mesh.triangles[triangle].leaf as usize];
        let position = at(fine.corners(triangle), (s, t));
        let element = gather.over(leaf.element);
        let mut seen = Vec::new();
        element.seen_nodes(position, DVec3::ZERO, Cosine::Shading, &mut seen);
        seen.iter_mut().for_each(|seen| seen.offset = DVec2::ZERO);
        let known = element.emitted(position, DVec3::ZERO, Cosine::Shading).total() + gather.irradiance_from(&seen);
        let seen_nodes: HashSet<NodeId> = seen.iter().map(|seen| seen.node).collect();
        let own = normals[leaf.polygon as usize];
        let normal = scene.shading_normal(leaf.polygon, position).unwrap_or(own);
        let mut random = ChaCha8Rng::seed_from_u64(number as u64);
        let differs = |direction| correction(position, direction, leaf.polygon, &seen_nodes).unwrap_or(Rgb::ZERO);
        // A ray scatters by what it finds, and finds a node as often as its form factor says: known before the first ray,
        // where a few rays would miss the small bright node that matters most.
        let square = |seen: &SeenNode| seen.form_factor * misfits[seen.node as usize];
        let scatter = seen.iter().map(square).sum::<f64>();
        let accepted = SCATTER * tolerance * colour_mean(known).max(mean);
        let rays = if seen.is_empty() { 0 } else { (scatter / (accepted * accepted)).clamp(RAYS[0], RAYS[1]) as u32 };
        let halves = [(); 2].map(|()| {
            let shift = DVec2::new(uniform(&mut random), uniform(&mut random));
            let above = |direction: &DVec3| normal == own || own.dot(*direction) > 0.0;
            let sum: Rgb = hemisphere(normal, rays, shift).filter(above).map(differs).sum();
            known + sum / f64::from(rays.max(1))
        });
        let baked = value(samples, triangle, s, t);
        ResidualPoint {
            differences: halves.map(|half| baked - half),
            irradiance: colour_mean((halves[0] + halves[1]) / 2.0),
            triangle: triangle as u32,
        }
    })
}

/// The same in a scene whose reflected light is found by rays: each half looks anew, with rays of its own, at what the leaf
/// elements reflect. It sees the error of interpolants, of the nodes that stood for leaves, and of the bake's own rays.
fn residual_by_rays(
    surroundings: &Surroundings<'_>,
    solution: &Solution,
    fine: &FineMesh,
    samples: &[Vec3],
    tolerance: f64,
    inquiry: &mut Inquiry<'_>,
) -> Vec<ResidualPoint> {
    let halves = [1, 2].map(|turn| Gather::with_turned_rays(surroundings, solution, TURNED_ERROR * tolerance, turn));
    inquiry.residuals(&points(fine), |_, (triangle, s, t)| {
        let leaf = &fine.leaves[fine.mesh.triangles[triangle].leaf as usize];
        let position = at(fine.corners(triangle), (s, t));
        let emitters = halves[0].over_emitters(leaf.element, &mut Shafts::default());
        let emitted = emitters.emitted(position, DVec3::ZERO, Cosine::Shading).total();
        let halves = halves.each_ref().map(|half| {
            let mut seen = Vec::new();
            half.over_reflectors(leaf.element).seen_nodes(position, DVec3::ZERO, Cosine::Shading, &mut seen);
            emitted + half.irradiance_from(&seen)
        });
        let baked =
            Interpolant::through(fine.table.triangles[triangle].map(|sample| samples[sample as usize].as_dvec3()))
                .evaluate(s, t);
        ResidualPoint {
            differences: halves.map(|half| baked - half),
            irradiance: colour_mean((halves[0] + halves[1]) / 2.0),
            triangle: triangle as u32,
        }
    })
}

/// By node, the mean square of what the radiosity of the bake differs by from the node's mean, averaged over the colours.
fn misfits(scene: &Scene, solution: &Solution, fine: &FineMesh, reflecting: &[Vec3]) -> Vec<f64> {
    let elements = &solution.elements;
    let mut sums = vec![0.0; elements.nodes.len()];
    if !solution.reflects() {
        return sums;
    }
    for (triangle, samples) in fine.table.triangles.iter().enumerate() {
        let leaf = &fine.leaves[fine.mesh.triangles[triangle].leaf as usize];
        let reflectance = scene.reflectance(leaf.polygon);
        let part = scene::area_vector(&fine.corners(triangle)).length() / samples.len() as f64;
        for &sample in samples {
            for node in elements.ancestors(leaf.element).filter(|&node| elements.patch_of(node).is_some()) {
                let difference =
                    reflectance * (reflecting[sample as usize].as_dvec3() - solution.light[node as usize].irradiance);
                sums[node as usize] += part * colour_mean(difference * difference);
            }
        }
    }
    sums.iter().zip(&elements.nodes).map(|(sum, node)| if node.area > 0.0 { sum / node.area } else { 0.0 }).collect()
}

/// Points spread evenly by area: triangle and barycentrics.
fn points(fine: &FineMesh) -> Vec<(usize, f64, f64)> {
    let mut sum = 0.0;
    let ends: Vec<f64> = (0..fine.triangles())
        .map(|triangle| {
            sum += scene::area_vector(&fine.corners(triangle)).length();
            sum
        })
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(u64::MAX);
    (0..POINTS)
        .filter_map(|i| {
            let area = (i as f64 + uniform(&mut random)) / POINTS as f64 * sum;
            let triangle = ends.partition_point(|&end| end <= area);
            let (s, t) = (uniform(&mut random), uniform(&mut random));
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            (triangle < ends.len()).then_some((triangle, s, t))
        })
        .collect()
}

/// Uniform in 0..1, never 1: the 53 bits that an f64 holds.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 * (0.5 / (1u64 << 52) as f64)
}
