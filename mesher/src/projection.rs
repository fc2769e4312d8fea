//! Light on a mesh as planes over elements: what a quadratic on each triangle of a leaf is as one linear function, in the
//! least-squares sense and with the same mean.
//!
//! A far point cannot tell the two apart; a near one sees no step within the leaf.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use scene::Rgb;
use solver::{ElementLight, NodeId, Solution};

use crate::edge_table::MeshedLeaf;
use crate::fine_mesh::FineMesh;

/// The weights of samples in the planes of leaves.
pub(crate) struct Projection {
    leaves: Vec<LeafWeights>,
}

/// Corners of a triangle, from the centre of its leaf, metres, and its samples.
type Part = ([DVec2; 3], [u32; 6]);

struct LeafWeights {
    element: NodeId,
    /// Sample, and its weight in the mean and in the gradients along u and v, m⁻¹. There are a dozen for every sample, and f32 has the
    /// digits that a plane's light needs.
    weights: Vec<(u32, [f32; 3])>,
}

impl Projection {
    /// The projection from a mesh's samples to its leaves, which are leaf elements of the solution.
    pub fn new(fine: &FineMesh, solution: &Solution) -> Self {
        let mut first = vec![0; fine.leaves.len() + 1];
        for triangle in &fine.mesh.triangles {
            first[triangle.leaf as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let leaf = |(i, leaf): (usize, &MeshedLeaf)| {
            let elements = &solution.elements;
            let patch = elements.patches[elements.patch_of(leaf.element).unwrap_or_default() as usize];
            let centre = elements.nodes[leaf.element as usize].centre;
            let triangles = (first[i]..first[i + 1]).map(|triangle| {
                let corners = fine.corners(triangle).map(|corner: DVec3| patch.along(corner - centre));
                (corners, fine.table.triangles[triangle])
            });
            let short =
                |(sample, mean, slope): (u32, f64, DVec2)| (sample, [mean, slope.x, slope.y].map(|part| part as f32));
            LeafWeights { element: leaf.element, weights: plane_weights(triangles).into_iter().map(short).collect() }
        };
        Self { leaves: fine.leaves.par_iter().enumerate().map(leaf).collect() }
    }

    /// The planes of all leaves for given values of the samples, W·m⁻².
    pub fn planes(&self, samples: &[Vec3]) -> Vec<(NodeId, ElementLight)> {
        let plane = |leaf: &LeafWeights| {
            let mut light = ElementLight::default();
            for &(sample, weights) in &leaf.weights {
                let value = samples[sample as usize].as_dvec3();
                let [mean, along_u, along_v] = weights.map(f64::from);
                light.irradiance += value * mean;
                light.gradient_u += value * along_u;
                light.gradient_v += value * along_v;
            }
            // A plane that falls below zero within the leaf is no light: less steep, it keeps its mean.
            light.irradiance = light.irradiance.max(Rgb::ZERO);
            (leaf.element, light)
        };
        self.leaves.par_iter().with_min_len(64).map(plane).collect()
    }
}

/// The weights of samples in the best plane over some triangles, whose corners are given from the centre of them all.
///
/// With λ the barycentrics of a triangle of area A, a vertex' sample has the basis function λᵢ(2λᵢ−1), a midpoint's 4λᵢλⱼ.
/// Their integrals against 1 and λ follow from ∫ λ₁ᵃ λ₂ᵇ λ₃ᶜ = 2A a! b! c! / (a+b+c+2)!.
fn plane_weights(triangles: impl Iterator<Item = Part>) -> Vec<(u32, f64, DVec2)> {
    let mut moments: Vec<(u32, f64, DVec2)> = Vec::new();
    let (mut area, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0);
    for ([a, b, c], samples) in triangles {
        let part = (b - a).perp_dot(c - a).abs() / 2.0;
        let sum = a + b + c;
        area += part;
        xx += part / 12.0 * (a.x * a.x + b.x * b.x + c.x * c.x + sum.x * sum.x);
        xy += part / 12.0 * (a.x * a.y + b.x * b.y + c.x * c.y + sum.x * sum.y);
        yy += part / 12.0 * (a.y * a.y + b.y * b.y + c.y * c.y + sum.y * sum.y);
        let vertex = |own: DVec2| (0.0, (own / 30.0 - (sum - own) / 60.0) * part);
        let middle = |p: DVec2, q: DVec2| (part / 3.0, ((p + q) * (2.0 / 15.0) + (sum - p - q) / 15.0) * part);
        let integrals = [vertex(a), middle(a, b), vertex(b), middle(b, c), vertex(c), middle(c, a)];
        moments.extend(samples.into_iter().zip(integrals).map(|(sample, (mean, first))| (sample, mean, first)));
    }
    moments.sort_by_key(|moment| moment.0);
    let mut weights: Vec<(u32, f64, DVec2)> = Vec::with_capacity(moments.len());
    for (sample, mean, first) in moments {
        match weights.last_mut().filter(|last| last.0 == sample) {
            Some(last) => *last = (sample, last.1 + mean, last.2 + first),
            None => weights.push((sample, mean, first)),
        }
    }
    let determinant = xx * yy - xy * xy;
    let solve = |m: DVec2| {
        // A sliver of a leaf has no gradient to speak of.
        if determinant <= 1e-12 * xx * yy {
            return DVec2::ZERO;
        }
        DVec2::new(m.x * yy - m.y * xy, m.y * xx - m.x * xy) / determinant
    };
    let scale = if area > 0.0 { 1.0 / area } else { 0.0 };
    weights.iter_mut().for_each(|weight| *weight = (weight.0, weight.1 * scale, solve(weight.2)));
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a trapezium about its centroid, and samples at their stations.
    fn trapezium() -> ([Part; 2], Vec<DVec2>) {
        let corners = [(0., 0.), (4., 0.), (3., 2.), (0., 2.)].map(|(x, y)| DVec2::new(x, y));
        let (first, second) = ([0, 1, 2], [0, 2, 3]);
        let centroid = |t: [usize; 3]| t.map(|i| corners[i]).iter().sum::<DVec2>() / 3.0;
        let middle = (centroid(first) * 4.0 + centroid(second) * 3.0) / 7.0;
        let [a, b, c, d] = corners.map(|corner| corner - middle);
        let points = vec![a, (a + b) / 2.0, b, (b + c) / 2.0, c, (a + c) / 2.0, (c + d) / 2.0, d, (a + d) / 2.0];
        ([([a, b, c], [0, 1, 2, 3, 4, 5]), ([a, c, d], [0, 5, 4, 6, 7, 8])], points)
    }

    #[test]
    fn nothing_has_no_weights() {
        assert!(plane_weights(std::iter::empty()).is_empty());
        let flat = [DVec2::ZERO, DVec2::X, DVec2::X * 2.0];
        let weights = plane_weights(std::iter::once((flat, [0, 1, 2, 3, 4, 5])));
        assert!(weights.iter().all(|weight| weight.1 == 0.0 && weight.2 == DVec2::ZERO));
    }

    #[test]
    fn planes_are_kept_and_a_parabola_keeps_its_mean() {
        let (triangles, points) = trapezium();
        let weights = plane_weights(triangles.into_iter());
        let plane = |p: DVec2| 3.0 + 0.7 * p.x - 1.3 * p.y;
        let fit = |f: &dyn Fn(DVec2) -> f64| {
            weights.iter().fold((0.0, DVec2::ZERO), |(mean, slope), weight| {
                let value = f(points[weight.0 as usize]);
                (mean + weight.1 * value, slope + weight.2 * value)
            })
        };
        let (mean, slope) = fit(&plane);
        assert!((mean - 3.0).abs() < 1e-12 && slope.distance(DVec2::new(0.7, -1.3)) < 1e-12);
        // ∫ y² over the trapezium, which is 4 − y/2 wide at height y, about its centroid at 20/21.
        let (mean, _) = fit(&|p| p.y * p.y);
        assert!((mean - 146.0 / 441.0).abs() < 1e-12);
    }
}
