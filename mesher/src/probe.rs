//! The measured error of a bake: interpolants against exact irradiance at points that they were not fitted to.
//!
//! The error at a point is the root mean square over the colours of |E − E_exact| ÷ max(own, mean), where own is the
//! point's exact irradiance averaged over its colours and mean is the scene's. It is measured of the samples as they are
//! stored, after the clamp at 0.

use glam::{DVec3, Vec3};
use scene::{BakedError, Interpolant, Rgb};

use crate::samples::{Evaluate, Progress, evaluate_samples};
use crate::{Leaf, Mesh, SampleQuery, SampleTable};

/// Barycentrics (s, t) of the probe points, each of which stands for a third of its triangle: the rule is exact for
/// quadratics. A cubic that vanishes at all six samples is a combination of the bubble s t (1 − s − t), of which these
/// points see 93 % of its root mean square, and of p q (p − q) for the three edges, of which they see 132 %. (Unseen is
/// their sum around the triangle; a fourth point would cost a third more.)
pub(crate) const PROBES: [(f64, f64); 3] = [(1.0 / 6.0, 1.0 / 6.0), (2.0 / 3.0, 1.0 / 6.0), (1.0 / 6.0, 2.0 / 3.0)];

/// Errors that probing found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Probes {
    /// Per triangle, the largest error over its points.
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
    let mut queries = Vec::with_capacity(PROBES.len() * mesh.triangles.len());
    let mut areas = Vec::with_capacity(mesh.triangles.len());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices.map(|vertex| mesh.vertices[vertex as usize]);
        let Leaf { polygon, element, .. } = leaves[triangle.leaf as usize];
        queries.extend(PROBES.map(|(s, t)| {
            let position = a * (1.0 - s - t) + b * s + c * t;
            let inward = ((a + b + c) / 3.0 - position).normalize_or_zero();
            SampleQuery { position, polygon, element, inward }
        }));
        areas.push((b - a).cross(c - a).length() / 2.0);
    }
    let exact = evaluate_samples(&queries, evaluate, progress);
    let fitted = table.triangles.iter().flat_map(|ids| {
        let interpolant = Interpolant::through(ids.map(|id| samples[id as usize].as_dvec3()));
        PROBES.map(|(s, t)| interpolant.evaluate(s, t))
    });
    compare(fitted, &exact, &areas)
}

/// Compares values at the probe points of all triangles.
fn compare(fitted: impl Iterator<Item = Rgb>, exact: &[Rgb], areas: &[f64]) -> Probes {
    let of_colours = |rgb: Rgb| rgb.element_sum() / 3.0;
    let share = 1.0 / PROBES.len() as f64;
    let area: f64 = areas.iter().sum();
    if area <= 0.0 {
        return Probes { triangle_errors: vec![0.0; areas.len()], ..Probes::default() };
    }
    let per_triangle = || areas.iter().zip(exact.chunks(PROBES.len()));
    let sums = per_triangle().map(|(area, exact)| area * share * exact.iter().copied().map(of_colours).sum::<f64>());
    let mean = sums.sum::<f64>() / area;
    let errors: Vec<f64> = fitted
        .zip(exact)
        .map(|(fitted, &exact)| {
            let scale = of_colours(exact).max(mean);
            let difference: DVec3 = fitted - exact;
            if scale > 0.0 { (of_colours(difference * difference)).sqrt() / scale } else { 0.0 }
        })
        .collect();
    let largest = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
    let squares = areas.iter().zip(errors.chunks(PROBES.len()));
    let square_sum: f64 = squares.map(|(area, errors)| area * share * errors.iter().map(|e| e * e).sum::<f64>()).sum();
    let error = BakedError {
        rms: (square_sum / area).sqrt(),
        p99: percentile(&errors, areas, 0.99),
        max: largest(&errors),
        points: errors.len() as u64,
    };
    let triangle_errors = errors.chunks(PROBES.len()).map(|errors| largest(errors) as f32).collect();
    Probes { triangle_errors, error, mean }
}

/// The smallest error that is not exceeded on the given fraction of the area.
fn percentile(errors: &[f64], areas: &[f64], fraction: f64) -> f64 {
    let mut order: Vec<(f64, f64)> =
        errors.iter().enumerate().map(|(point, &error)| (error, areas[point / PROBES.len()])).collect();
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
        assert_eq!((dark.error.max, dark.error.points, dark.mean), (0.0, 6, 0.0));
    }

    #[test]
    fn a_constant_offset_is_the_error_everywhere() {
        let probes = probed(|_| Rgb::splat(5.0), |_| Rgb::splat(4.0));
        assert_eq!(probes.triangle_errors, [0.25, 0.25]);
        assert_eq!(probes.error, BakedError { rms: 0.25, p99: 0.25, max: 0.25, points: 6 });
        assert_eq!(probes.mean, 4.0);
    }

    #[test]
    fn dark_points_are_measured_against_the_mean_and_bright_ones_against_themselves() {
        let exact = |p: DVec3| Rgb::new(3.0, 6.0, 9.0) * (p.x * p.x + 1e-3);
        let probes = probed(|p| exact(p) + 0.6, exact);
        assert!((probes.mean - 6.0 * (1.0 / 3.0 + 1e-3)).abs() < 1e-12);
        assert!((probes.error.max - 0.6 / probes.mean).abs() < 1e-6);
        assert!(probes.error.rms < probes.error.max);
    }

    #[test]
    fn error_is_measured_after_the_clamp() {
        let probes = probed(|_| Rgb::splat(-1.0), |_| Rgb::ZERO);
        assert_eq!(probes.error.max, 0.0);
    }

    /// The figures in the comment on [`PROBES`], from the closed forms of the integrals.
    #[test]
    fn the_remainders_of_cubics_are_seen() {
        let bubble = |s: f64, t: f64| s * t * (1.0 - s - t);
        let edge = |s: f64, t: f64| s * t * (s - t);
        assert!(SAMPLE_BARYCENTRICS.iter().all(|&(s, t)| bubble(s, t) == 0.0 && edge(s, t) == 0.0));
        let seen =
            |f: &dyn Fn(f64, f64) -> f64| (PROBES.map(|(s, t)| f(s, t).powi(2)).iter().sum::<f64>() / 3.0).sqrt();
        assert!((seen(&bubble) * 2520f64.sqrt() - 0.93).abs() < 0.005);
        assert!((seen(&edge) * 840f64.sqrt() - 1.315).abs() < 0.005);
    }

    #[test]
    fn percentiles_are_of_area() {
        let errors = [1.0, 1.0, 1.0, 2.0, 2.0, 3.0];
        assert_eq!(percentile(&errors, &[0.9, 0.1], 0.5), 1.0);
        assert_eq!(percentile(&errors, &[0.9, 0.1], 0.95), 2.0);
        assert_eq!(percentile(&errors, &[0.9, 0.1], 0.99), 3.0);
        assert_eq!(percentile(&[], &[], 0.99), 0.0);
    }
}
