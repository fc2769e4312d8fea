//! Interpolants are continuous across the edges that triangles share, cuts and contact corners excepted.

use std::collections::HashMap;

use glam::DVec3;
use scene::{Baked, EdgeKind, SAMPLE_BARYCENTRICS, Scene};

use crate::fixture::{cornell_box, office};

/// One side of an edge: the triangle, and the number of its edge (0→1, 1→2, 2→0).
type Side = (u32, usize);

/// Sample slots of an edge, from its start over its middle to its end.
fn slots(edge: usize) -> [usize; 3] {
    [2 * edge, 2 * edge + 1, (2 * edge + 2) % 6]
}

/// Pairs of sides that face each other on one polygon.
fn shared_edges(baked: &Baked) -> Vec<(Side, Side)> {
    let mut by_edge: HashMap<(u32, u32, u32), Side> = HashMap::new();
    for (id, triangle) in (0..).zip(&baked.triangles) {
        for edge in 0..3 {
            let (from, to) = (triangle.vertices[edge], triangle.vertices[(edge + 1) % 3]);
            assert_eq!(by_edge.insert((triangle.polygon, from, to), (id, edge)), None, "an edge of two triangles");
        }
    }
    let pairs = by_edge.iter().filter(|((_, from, to), _)| from < to);
    let mut pairs: Vec<(Side, Side)> =
        pairs.filter_map(|(&(polygon, from, to), &side)| Some((side, *by_edge.get(&(polygon, to, from))?))).collect();
    pairs.sort_unstable();
    pairs
}

/// Whether a polygon other than the point's own, and not in its plane, touches a point.
fn is_touched(scene: &Scene, polygon: u32, point: DVec3) -> bool {
    let own = scene.plane(polygon).normal;
    scene.polygon_ids().filter(|&other| other != polygon).any(|other| {
        let (plane, outline) = (scene.plane(other), scene.outline(other));
        let inside = (0..outline.len()).all(|i| {
            let edge = outline[(i + 1) % outline.len()] - outline[i];
            plane.normal.cross(edge).normalize().dot(point - outline[i]) > -1e-5
        });
        plane.distance(point).abs() < 1e-5 && plane.normal.cross(own).length() > 1e-6 && inside
    })
}

fn is_continuous(baked: &Baked) {
    let mean = baked.mean_irradiance().element_sum() / 3.0;
    let edges = shared_edges(baked);
    let mut compared = 0;
    for &((a, edge_a), (b, edge_b)) in &edges {
        let (left, right) = (&baked.triangles[a as usize], &baked.triangles[b as usize]);
        if left.edges[edge_a] == EdgeKind::Cut {
            continue;
        }
        let ours = slots(edge_a).map(|slot| left.samples[slot]);
        let theirs = slots(edge_b).map(|slot| right.samples[slot]);
        if ours != [theirs[2], theirs[1], theirs[0]] {
            // Only where the limit depends on the direction may each triangle have its own.
            let ends = [edge_a, (edge_a + 1) % 3].map(|i| baked.vertices[left.vertices[i] as usize].as_dvec3());
            assert!(
                ends.into_iter().chain([(ends[0] + ends[1]) / 2.0]).any(|end| is_touched(
                    &baked.scene,
                    left.polygon,
                    end
                )),
                "triangles {a} and {b} differ between {} and {}, where nothing touches",
                ends[0],
                ends[1]
            );
            continue;
        }
        for t in [0.0, 0.13, 0.5, 0.71, 1.0] {
            let along = |edge: usize, t: f64| {
                let [start, _, end] = slots(edge).map(|slot| SAMPLE_BARYCENTRICS[slot]);
                (start.0 + (end.0 - start.0) * t, start.1 + (end.1 - start.1) * t)
            };
            let ((s, u), (p, q)) = (along(edge_a, t), along(edge_b, 1.0 - t));
            let jump = (baked.irradiance(a, s, u) - baked.irradiance(b, p, q)).abs().max_element();
            assert!(jump <= 1e-6 * mean, "triangles {a} and {b}: {jump}");
        }
        compared += 1;
    }
    assert!(compared * 10 > edges.len() * 8, "only {compared} of {} edges are shared in full", edges.len());
}

#[test]
fn the_office_is_continuous() {
    is_continuous(&formats::read_baked(office()).unwrap());
}

#[test]
fn the_cornell_box_is_continuous() {
    is_continuous(&formats::read_baked(cornell_box()).unwrap());
}
