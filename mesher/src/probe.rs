//! The measured error of a bake: interpolants against exact irradiance at points that they were not fitted to.
//!
//! The error at a point is the root mean square over the colours of |E − E_exact| ÷ max(own, mean), where own is the
//! point's exact irradiance averaged over its colours and mean is the scene's. It is measured of the samples as they are
//! stored, after the clamp at 0.

use glam::{DVec3, Vec3};
use scene::{BakedError, Interpolant, Rgb};

use crate::samples::{Evaluate, Progress, evaluate_samples};
use crate::{Leaf, Mesh, SampleQuery, SampleTable};

/// Barycentrics of the probe point of a triangle, which turns from triangle to triangle. A cubic that vanishes at all
/// six samples is a combination of the bubble p q r, of which the point sees 90 % of its root mean square, and of
/// p q (p − q) for the three edges, of which it sees 104 % on average over the turns. More points a triangle would
/// cost as much again as the samples themselves.
const PROBE: [f64; 3] = [0.6, 0.3, 0.1];

/// Barycentrics (s, t) of a triangle's probe point.
fn probe_point(triangle: usize) -> (f64, f64) {
    (PROBE[(triangle + 1) % 3], PROBE[(triangle + 2) % 3])
}

/// Errors that probing found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Probes {
    /// Per triangle, the error at its point.
    pub triangle_errors: Vec<f32>,
    /// Over all points.
    pub error: BakedError,
    /// Area-weighted mean of the exact irradiance over points and colours, W·m⁻².
    pub mean: f64,
}

/// Probes every triangle of a mesh. `samples` are the values of the table's samples, W·m⁻², as stored.
pub fn probe(
    leaves: &[Leaf],
    mesh: &Mesh,
    table: &SampleTable,
    samples: &[Vec3],
    evaluate: Evaluate<'_>,
    progress: Progress<'_>,
) -> Probes {
    let mut queries = Vec::with_capacity(mesh.triangles.len());
    let mut areas = Vec::with_capacity(mesh.triangles.len());
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.vertices.map(|vertex| mesh.vertices[vertex as usize]);
        let Leaf { polygon, element, .. } = leaves[triangle.leaf as usize];
        let (s, t) = probe_point(i);
        let position = a * (1.0 - s - t) + b * s + c * t;
        let inward = ((a + b + c) / 3.0 - position).normalize_or_zero();
        queries.push(SampleQuery { position, polygon, element, inward });
        areas.push((b - a).cross(c - a).length() / 2.0);
    }
    let exact = evaluate_samples(&queries, evaluate, progress);
    let fitted = table.triangles.iter().enumerate().map(|(i, ids)| {
        let (s, t) = probe_point(i);
        Interpolant::through(ids.map(|id| samples[id as usize].as_dvec3())).evaluate(s, t)
    });
    compare(fitted, &exact, &areas)
}

/// Compares values at the probe points of all triangles.
fn compare(fitted: impl Iterator<Item = Rgb>, exact: &[Rgb], areas: &[f64]) -> Probes {
    let of_colours = |rgb: Rgb| rgb.element_sum() / 3.0;
    let area: f64 = areas.iter().sum();
    if area <= 0.0 {
        return Probes { triangle_errors: vec![0.0; areas.len()], ..Probes::default() };
    }
    let mean = areas.iter().zip(exact).map(|(area, &exact)| area * of_colours(exact)).sum::<f64>() / area;
    let errors: Vec<f64> = fitted
        .zip(exact)
        .map(|(fitted, &exact)| {
            let scale = of_colours(exact).max(mean);
            let difference: DVec3 = fitted - exact;
            if scale > 0.0 { (of_colours(difference * difference)).sqrt() / scale } else { 0.0 }
        })
        .collect();
    let square_sum: f64 = areas.iter().zip(&errors).map(|(area, error)| area * error * error).sum();
    let error = BakedError {
        rms: (square_sum / area).sqrt(),
        p99: percentile(&errors, areas, 0.99),
        max: errors.iter().copied().fold(0.0, f64::max),
        points: errors.len() as u64,
    };
    let triangle_errors = errors.iter().map(|&error| error as f32).collect();
    Probes { triangle_errors, error, mean }
}

/// The smallest error that is not exceeded on the given fraction of the area.
fn percentile(errors: &[f64], areas: &[f64], fraction: f64) -> f64 {
    let mut order: Vec<(f64, f64)> = errors.iter().copied().zip(areas.iter().copied()).collect();
    order.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut left = fraction * order.iter().map(|(_, area)| area).sum::<f64>();
    for &(error, area) in &order {
        left -= area;
        if left <= 0.0 {
            return error;
        }
    }
    order.last().map_or(0.0, |last| last.0)
}

#[cfg(test)]
mod tests {
    use scene::SAMPLE_BARYCENTRICS;

    use super::*;
    use crate::testing::scene_of;
    use crate::{edge_table, leaf_meshes, sample_table};

    /// Bakes a function over the unit square and probes it against another.
    fn probed(fitted: impl Fn(DVec3) -> Rgb + Sync, exact: impl Fn(DVec3) -> Rgb + Sync) -> Probes {
        let outline = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let leaves = [Leaf { element: 3, polygon: 0, outline: outline.clone(), segments: Vec::new() }];
        let scene = scene_of(&[outline]);
        let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
        let table = sample_table(&scene, &leaves, &mesh, &|_, _| solver::Contact::None);
        let values =
            |f: &dyn Fn(DVec3) -> Rgb, queries: &[SampleQuery]| queries.iter().map(|q| f(q.position)).collect();
        let samples: Vec<Rgb> = values(&fitted, &table.queries);
        let samples: Vec<Vec3> = samples.iter().map(|rgb| rgb.as_vec3()).collect();
        probe(&leaves, &mesh, &table, &samples, &|queries| values(&exact, queries), &|_| ())
    }

    #[test]
    fn nothing_and_darkness_have_no_error() {
        let nothing = probe(&[], &Mesh::default(), &SampleTable::default(), &[], &|_| Vec::new(), &|_| ());
        assert_eq!(nothing, Probes::default());
        let dark = probed(|_| Rgb::ZERO, |_| Rgb::ZERO);
        assert_eq!((dark.error.max, dark.error.points, dark.mean), (0.0, 2, 0.0));
    }

    #[test]
    fn a_constant_offset_is_the_error_everywhere() {
        let probes = probed(|_| Rgb::splat(5.0), |_| Rgb::splat(4.0));
        assert_eq!(probes.triangle_errors, [0.25, 0.25]);
        assert_eq!(probes.error, BakedError { rms: 0.25, p99: 0.25, max: 0.25, points: 2 });
        assert_eq!(probes.mean, 4.0);
    }

    #[test]
    fn dark_points_are_measured_against_the_mean_and_bright_ones_against_themselves() {
        let exact = |p: DVec3| Rgb::new(3.0, 6.0, 9.0) * (p.x * p.x + 1e-3);
        let probes = probed(|p| exact(p) + 0.6, exact);
        assert!((probes.error.max - 0.6 / probes.mean).abs() < 1e-6);
        assert!(probes.error.rms < probes.error.max);
    }

    #[test]
    fn error_is_measured_after_the_clamp() {
        let probes = probed(|_| Rgb::splat(-1.0), |_| Rgb::ZERO);
        assert_eq!(probes.error.max, 0.0);
    }

    /// The figures in the comment on [`PROBE`], from the closed forms of the integrals.
    #[test]
    fn the_remainders_of_cubics_are_seen() {
        let bubble = |s: f64, t: f64| s * t * (1.0 - s - t);
        let edge = |s: f64, t: f64| s * t * (s - t);
        assert!(SAMPLE_BARYCENTRICS.iter().all(|&(s, t)| bubble(s, t) == 0.0 && edge(s, t) == 0.0));
        let points = [0, 1, 2].map(probe_point);
        let seen =
            |f: &dyn Fn(f64, f64) -> f64| (points.map(|(s, t)| f(s, t).powi(2)).iter().sum::<f64>() / 3.0).sqrt();
        assert!((seen(&bubble) * 2520f64.sqrt() - 0.90).abs() < 0.005);
        assert!((seen(&edge) * 840f64.sqrt() - 1.04).abs() < 0.005);
    }

    #[test]
    fn percentiles_are_of_area() {
        let (errors, areas) = ([2.0, 1.0, 3.0], [0.08, 0.9, 0.02]);
        assert_eq!(percentile(&errors, &areas, 0.5), 1.0);
        assert_eq!(percentile(&errors, &areas, 0.95), 2.0);
        assert_eq!(percentile(&errors, &areas, 0.99), 3.0);
        assert_eq!(percentile(&[], &[], 0.99), 0.0);
    }
}
