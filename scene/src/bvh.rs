//! What a ray meets: a bounding volume hierarchy over triangles. This file and `wide_tree` alone name the BVH library.
//!
//! Boxes are walked in f32 (`wide_tree`); they are padded so that no triangle is skipped that the exact f64
//! intersection would hit, and hits are decided by [`ShearedRay::intersect`] alone.

use std::time::Duration;

use glam::DVec3;
use obvhs::{BvhBuildParams, aabb::Aabb, cwbvh::builder::build_cwbvh};

use crate::wide_tree::WideTree;
use crate::{Ray, Scene, ShearedRay};

/// Padding of every box, as a fraction of the largest coordinate: several f32 roundings of a point and of a ray's
/// direction. Larger only costs time.
const PADDING: f64 = 4e-6;

/// Cosine of the largest angle at which a surface's normal agrees with a stated one: 25°, wide enough for a normal
/// that was rounded or interpolated, far from that of the next face of a box.
const AGREEMENT: f64 = 0.9;

/// A hierarchy over triangles.
pub struct Bvh {
    tree: WideTree,
    /// In the order of the hierarchy's leaves, so that those that are met together lie together.
    triangles: Vec<[DVec3; 3]>,
    /// Where each was in the list that the hierarchy was made of.
    indices: Vec<u32>,
    /// What the caller calls each triangle, in the same order.
    owners: Vec<u32>,
}

/// The nearest thing that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Owner of the triangle: the polygon for [`Bvh::of_scene`], the triangle's index for [`Bvh::of_triangles`].
    pub id: u32,
    /// Distance in lengths of the ray's direction.
    pub distance: f64,
    /// Barycentric of the triangle's second vertex.
    pub s: f64,
    /// Barycentric of the triangle's third vertex.
    pub t: f64,
    /// Geometric normal of the triangle, unit length, on the side it is counter-clockwise from.
    pub normal: DVec3,
}

impl Bvh {
    /// A hierarchy over a list of triangles; a hit's `id` is the index in the list.
    pub fn of_triangles(triangles: Vec<[DVec3; 3]>) -> Self {
        let owners = (0..triangles.len() as u32).collect();
        Self::new(triangles, owners)
    }

    /// A hierarchy over a scene's polygons, each cut into a fan; a hit's `id` is the polygon.
    pub fn of_scene(scene: &Scene) -> Self {
        let (mut triangles, mut owners) = (Vec::new(), Vec::new());
        for polygon in scene.polygon_ids() {
            let outline = scene.outline(polygon);
            for pair in outline[1..].windows(2) {
                triangles.push([outline[0], pair[0], pair[1]]);
                owners.push(polygon);
            }
        }
        Self::new(triangles, owners)
    }

    fn new(triangles: Vec<[DVec3; 3]>, owners: Vec<u32>) -> Self {
        let largest = triangles.iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let pad = DVec3::splat(largest * PADDING + f64::MIN_POSITIVE);
        let padded: Vec<Aabb> = triangles
            .iter()
            .map(|&[a, b, c]| Aabb::new((a.min(b).min(c) - pad).as_vec3a(), (a.max(b).max(c) + pad).as_vec3a()))
            .collect();
        let bvh = build_cwbvh(&padded, BvhBuildParams::medium_build(), &mut Duration::default());
        let order = || bvh.primitive_indices.iter().map(|&index| index as usize);
        let boxes: Vec<Aabb> = order().map(|i| padded[i]).collect();
        let tree = WideTree::new(&bvh, &boxes);
        let (triangles, owners) = (order().map(|i| triangles[i]).collect(), order().map(|i| owners[i]).collect());
        Self { tree, triangles, indices: bvh.primitive_indices, owners }
    }

    /// The nearest triangle, from either side, farther away than `nearest` (in lengths of the direction).
    /// Of two at the same distance the one with the smaller index wins, so that the answer does not depend on
    /// the order of traversal.
    pub fn closest_hit(&self, ray: &Ray, nearest: f64) -> Option<Hit> {
        self.closest(ray, |_, distance| distance > nearest)
    }

    /// The same among the triangles whose id `accept` takes.
    pub fn closest_hit_beyond(&self, ray: &Ray, nearest: f64, accept: impl Fn(u32) -> bool) -> Option<Hit> {
        self.closest(ray, |id, distance| distance > nearest && accept(id))
    }

    fn closest(&self, ray: &Ray, accept: impl Fn(u32, f64) -> bool) -> Option<Hit> {
        let mut best: Option<(f64, usize, f64, f64)> = None;
        let sheared = ShearedRay::new(ray);
        self.tree.along(ray, f64::INFINITY, |slot| {
            let Some((distance, s, t)) = sheared.intersect(&self.triangles[slot]) else { return f64::INFINITY };
            let first = |other: usize| self.indices[slot] < self.indices[other];
            let is_nearer = best.is_none_or(|(d, other, ..)| distance < d || (distance == d && first(other)));
            if !(is_nearer && accept(self.owners[slot], distance)) {
                return f64::INFINITY;
            }
            best = Some((distance, slot, s, t));
            distance
        });
        best.map(|(distance, slot, s, t)| {
            let [a, b, c] = self.triangles[slot];
            Hit { id: self.owners[slot], distance, s, t, normal: (b - a).cross(c - a).normalize_or_zero() }
        })
    }

    /// Whether anything lies between two points, ends excluded by `margin` (a fraction of the distance).
    pub fn is_blocked(&self, from: DVec3, to: DVec3, margin: f64) -> bool {
        self.blocker(from, to, |_, distance| distance > margin && distance < 1.0 - margin).is_some()
    }

    fn blocker(&self, from: DVec3, to: DVec3, accept: impl Fn(u32, f64) -> bool) -> Option<u32> {
        let ray = Ray { origin: from, direction: to - from };
        let sheared = ShearedRay::new(&ray);
        let mut found = None;
        self.tree.along(&ray, 1.0, |slot| {
            let owner = self.owners[slot];
            let hits = sheared.intersect(&self.triangles[slot]).is_some_and(|(distance, ..)| accept(owner, distance));
            if hits {
                found = Some(owner);
            }
            if hits { -1.0 } else { f64::INFINITY }
        });
        found
    }

    /// The nearest triangle that the ray meets, from either side, among those whose id `accept` takes: without the
    /// polygon that the ray starts on, say, where no margin would do.
    pub fn closest_hit_among(&self, ray: &Ray, accept: impl Fn(u32) -> bool) -> Option<Hit> {
        self.closest(ray, |id, _| accept(id))
    }

    /// Whether anything whose id `accept` takes lies strictly between two points.
    pub fn is_blocked_among(&self, from: DVec3, to: DVec3, accept: impl Fn(u32) -> bool) -> bool {
        self.blocker_among(from, to, accept).is_some()
    }

    /// The id of something that `accept` takes and that lies strictly between two points: of several, the one that is met first
    /// on the way through the hierarchy.
    pub fn blocker_among(&self, from: DVec3, to: DVec3, accept: impl Fn(u32) -> bool) -> Option<u32> {
        self.blocker(from, to, |id, distance| distance < 1.0 && accept(id))
    }

    /// Calls `visit` with the id of every triangle whose padded box a segment touches, in no particular order.
    pub fn near_segment(&self, from: DVec3, to: DVec3, mut visit: impl FnMut(u32)) {
        let ray = Ray { origin: from, direction: to - from };
        self.tree.along(&ray, 1.0, |slot| {
            visit(self.owners[slot]);
            f64::INFINITY
        });
    }

    /// Calls `visit` with the id of every triangle below the boxes that `enters` takes, given by their lower and upper
    /// corners; in no particular order.
    pub fn within(&self, enters: impl Fn(DVec3, DVec3) -> bool, mut visit: impl FnMut(u32)) {
        self.tree.within(enters, |slot| visit(self.owners[slot]));
    }

    /// The triangle nearest to a point, at most `reach` metres away, whose normal agrees with `normal`; the hit's
    /// distance is in metres. Of two at the same distance the one with the smaller index wins.
    pub fn nearest_surface(&self, point: DVec3, normal: DVec3, reach: f64) -> Option<Hit> {
        let axis = normal.normalize_or_zero();
        let mut best: Option<(u32, Hit)> = None;
        let touches = |low: DVec3, high: DVec3| (point + reach).cmpge(low).all() && (point - reach).cmple(high).all();
        self.tree.within(touches, |slot| {
            let (index, [a, b, c]) = (self.indices[slot], self.triangles[slot]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.dot(axis) < AGREEMENT {
                return;
            }
            let (s, t) = nearest_barycentrics([a, b, c], point);
            let distance = (a * (1.0 - s - t) + b * s + c * t).distance(point);
            let nearer = |(other, hit): &(u32, Hit)| (distance, index) < (hit.distance, *other);
            if distance <= reach && best.as_ref().is_none_or(nearer) {
                best = Some((index, Hit { id: self.owners[slot], distance, s, t, normal }));
            }
        });
        best.map(|(_, hit)| hit)
    }
}

/// Barycentrics (s, t) of the point of a triangle nearest to `point`.
fn nearest_barycentrics([a, b, c]: [DVec3; 3], point: DVec3) -> (f64, f64) {
    let (u, v, w) = (b - a, c - a, point - a);
    let (uu, uv, vv, wu, wv) = (u.dot(u), u.dot(v), v.dot(v), w.dot(u), w.dot(v));
    let determinant = uu * vv - uv * uv;
    if determinant > 0.0 {
        let (s, t) = ((wu * vv - wv * uv) / determinant, (wv * uu - wu * uv) / determinant);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return (s, t);
        }
    }
    // Outside: the nearest of the three edges' nearest points.
    let along = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let length = edge.length_squared();
        if length > 0.0 { ((point - from).dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 }
    };
    let (ab, bc, ca) = (along(a, b), along(b, c), along(c, a));
    let candidates = [(ab, 0.0), (1.0 - bc, bc), (0.0, 1.0 - ca)];
    let distance = |(s, t): (f64, f64)| (a + u * s + v * t).distance_squared(point);
    candidates.into_iter().min_by(|x, y| distance(*x).total_cmp(&distance(*y))).unwrap_or((0.0, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_hierarchy_is_never_hit() {
        let bvh = Bvh::of_triangles(Vec::new());
        assert_eq!(bvh.closest_hit(&Ray { origin: DVec3::ZERO, direction: DVec3::X }, 0.0), None);
        assert!(!bvh.is_blocked(DVec3::ZERO, DVec3::ONE, 0.0));
    }

    /// The hierarchy against its oracle: trying every triangle.
    #[test]
    fn the_same_hits_as_trying_every_triangle() {
        // A low-discrepancy sequence instead of a random one: the same points in every run.
        let halton = |index: u32, base: u32| {
            let (mut i, mut f, mut r) = (index, 1.0, 0.0);
            while i > 0 {
                f /= f64::from(base);
                r += f * f64::from(i % base);
                i /= base;
            }
            r
        };
        let point = |i: u32| DVec3::new(halton(i, 2), halton(i, 3), halton(i, 5));
        let mut hits = 0;
        for scale in [1.0, 1e-4, 1e5] {
            let corner = |i: u32| (point(4 * i + 1), point(4 * i + 2), point(4 * i + 3), point(4 * i + 4));
            let triangles: Vec<_> = (0..300)
                .map(|i| {
                    let (at, a, b, c) = corner(i);
                    [a, b, c].map(|p| (at + 0.6 * p) * scale)
                })
                .collect();
            let bvh = Bvh::of_triangles(triangles.clone());
            for i in 5000..6000 {
                let origin = (point(i) * 2.0 - 0.5) * scale;
                let mut direction = point(i + 1000) * 1.5 * scale - origin;
                match i % 10 {
                    0 => direction.x = 0.0,
                    1 => direction.y = -0.0,
                    2 => direction.z = -1e-60,
                    _ => {}
                }
                let ray = Ray { origin, direction };
                let sheared = ShearedRay::new(&ray);
                let all = triangles
                    .iter()
                    .enumerate()
                    .filter_map(|(id, triangle)| Some((sheared.intersect(triangle)?.0, id as u32)));
                let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
                let hit = bvh.closest_hit(&ray, 0.0);
                assert_eq!(hit.map(|hit| (hit.distance, hit.id)), nearest);
                let blocked = nearest.is_some_and(|(distance, _)| distance < 1.0);
                assert_eq!(bvh.is_blocked(ray.origin, ray.at(1.0), 0.0), blocked);
                if let Some(nearest) = nearest {
                    // From as near as a millionth of the way, which a hierarchy in f32 must not take for behind.
                    let near = Ray { origin: ray.at(nearest.0 * (1.0 - 1e-6)), direction };
                    assert_eq!(bvh.closest_hit(&near, 0.0).map(|hit| hit.id), Some(nearest.1));
                    let others = |id| id != nearest.1;
                    let second = bvh.closest_hit(&ray, nearest.0);
                    assert_eq!(bvh.closest_hit_among(&ray, others), second);
                    let blocked = second.is_some_and(|hit| hit.distance < 1.0);
                    assert_eq!(bvh.is_blocked_among(ray.origin, ray.at(1.0), others), blocked);
                }
                hits += usize::from(nearest.is_some());
            }
        }
        assert!(hits > 900, "only {hits} rays hit anything");
    }

    #[test]
    fn nearest_barycentrics_clamps_to_the_triangle() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(nearest_barycentrics(triangle, DVec3::new(0.25, 0.5, 7.0)), (0.25, 0.5));
        assert_eq!(nearest_barycentrics(triangle, DVec3::new(-1.0, -1.0, 0.0)), (0.0, 0.0));
        assert_eq!(nearest_barycentrics(triangle, DVec3::new(2.0, 2.0, 0.0)), (0.5, 0.5));
        assert!(nearest_barycentrics([DVec3::ONE; 3], DVec3::ZERO).0.is_finite());
    }

    #[test]
    fn the_nearest_surface_faces_the_right_way_and_lies_within_reach() {
        let floor = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let ceiling = [DVec3::ZERO, DVec3::Y, DVec3::X];
        let bvh = Bvh::of_triangles(vec![ceiling, floor, floor]);
        let find = |point, normal, reach| bvh.nearest_surface(point, normal, reach).map(|hit| (hit.id, hit.s, hit.t));
        assert_eq!(find(DVec3::new(0.25, 0.5, 1e-4), DVec3::Z, 1e-3), Some((1, 0.25, 0.5)));
        assert_eq!(find(DVec3::new(0.25, 0.5, 1e-4), -DVec3::Z, 1e-3).map(|found| found.0), Some(0));
        assert_eq!(find(DVec3::new(0.25, 0.5, 1e-2), DVec3::Z, 1e-3), None);
        assert_eq!(find(DVec3::new(0.25, 0.5, 0.0), DVec3::X, 1e-3), None);
        assert_eq!(find(DVec3::new(0.25, 0.5, 0.0), DVec3::ZERO, 1e-3), None);
        assert_eq!(find(DVec3::NAN, DVec3::Z, 1e-3), None);
        // Off the border, in the plane, in no direction in particular.
        assert_eq!(find(DVec3::new(-5e-4, -4e-4, 0.0), DVec3::Z, 1e-3), Some((1, 0.0, 0.0)));
        assert_eq!(Bvh::of_triangles(Vec::new()).nearest_surface(DVec3::ZERO, DVec3::Z, 1.0), None);
    }
}
