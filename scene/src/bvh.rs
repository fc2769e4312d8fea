//! What a ray meets: a bounding volume hierarchy over triangles. The only file that names the BVH library.
//!
//! The library walks boxes in f32; boxes are padded so that it never skips a triangle that the exact f64
//! intersection would hit, and hits are decided by [`intersect_triangle`] alone.

use std::time::Duration;

use glam::DVec3;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2, ray::RayHit};

use crate::{Ray, Scene, intersect_triangle};

/// Padding of every box, as a fraction of the largest coordinate: several f32 roundings of a point and of a ray's
/// direction. Larger only costs time.
const PADDING: f64 = 4e-6;

/// A hierarchy over triangles.
pub struct Bvh {
    bvh: Bvh2,
    triangles: Vec<[DVec3; 3]>,
    /// What the caller calls each triangle.
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

struct Padded<'a>(&'a [DVec3; 3], f64);

impl Boundable for Padded<'_> {
    fn aabb(&self) -> Aabb {
        let [a, b, c] = *self.0;
        let pad = DVec3::splat(self.1);
        Aabb::new((a.min(b).min(c) - pad).as_vec3a(), (a.max(b).max(c) + pad).as_vec3a())
    }
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
        let padded: Vec<_> =
            triangles.iter().map(|triangle| Padded(triangle, largest * PADDING + f64::MIN_POSITIVE)).collect();
        let bvh = build_bvh2(&padded, BvhBuildParams::medium_build(), &mut Duration::default());
        Self { bvh, triangles, owners }
    }

    /// The nearest triangle, from either side, farther away than `nearest` (in lengths of the direction).
    /// Of two at the same distance the one with the smaller index wins, so that the answer does not depend on
    /// the order of traversal.
    pub fn closest_hit(&self, ray: &Ray, nearest: f64) -> Option<Hit> {
        let mut best: Option<(f64, usize, f64, f64)> = None;
        self.bvh.ray_traverse(library_ray(ray, f32::INFINITY), &mut RayHit::none(), |_, slot| {
            let index = self.bvh.primitive_indices[slot] as usize;
            match intersect_triangle(ray, self.triangles[index]) {
                Some((distance, s, t)) if distance > nearest => {
                    if best.is_none_or(|(d, i, ..)| distance < d || (distance == d && index < i)) {
                        best = Some((distance, index, s, t));
                    }
                    // Rounded up, so that boxes at the same distance are still visited.
                    (distance as f32) * (1.0 + 4.0 * f32::EPSILON)
                }
                _ => f32::INFINITY,
            }
        });
        best.map(|(distance, index, s, t)| {
            let [a, b, c] = self.triangles[index];
            Hit { id: self.owners[index], distance, s, t, normal: (b - a).cross(c - a).normalize_or_zero() }
        })
    }

    /// Whether anything lies between two points, ends excluded by `margin` (a fraction of the distance).
    pub fn is_blocked(&self, from: DVec3, to: DVec3, margin: f64) -> bool {
        let ray = Ray { origin: from, direction: to - from };
        let hits = |slot: usize| {
            let triangle = self.triangles[self.bvh.primitive_indices[slot] as usize];
            intersect_triangle(&ray, triangle).is_some_and(|(d, ..)| d > margin && d < 1.0 - margin)
        };
        let missed =
            self.bvh.ray_traverse_miss(library_ray(&ray, 1.0), |_, slot| if hits(slot) { 0.5 } else { f32::INFINITY });
        !missed
    }

    /// Calls `visit` with the id of every triangle whose padded box a segment touches; for nearest-surface queries.
    pub fn near_segment(&self, from: DVec3, to: DVec3, mut visit: impl FnMut(u32)) {
        let ray = Ray { origin: from, direction: to - from };
        self.bvh.ray_traverse_anyhit(library_ray(&ray, 1.0), |_, slot| {
            visit(self.owners[self.bvh.primitive_indices[slot] as usize]);
        });
    }
}

fn library_ray(ray: &Ray, farthest: f32) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.as_vec3a(), ray.direction.as_vec3a(), 0.0, farthest)
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
        let triangles: Vec<_> =
            (0..300).map(|i| [0, 1, 2].map(|k| point(4 * i + 1) + 0.6 * point(4 * i + 2 + k))).collect();
        let bvh = Bvh::of_triangles(triangles.clone());
        let mut hits = 0;
        for i in 5000..6000 {
            let ray = Ray { origin: point(i) * 2.0 - 0.5, direction: point(i + 1000) - point(i) };
            let all =
                triangles.iter().enumerate().filter_map(|(id, t)| Some((intersect_triangle(&ray, *t)?.0, id as u32)));
            let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
            let hit = bvh.closest_hit(&ray, 0.0);
            assert_eq!(hit.map(|hit| (hit.distance, hit.id)), nearest);
            let blocked = nearest.is_some_and(|(distance, _)| distance < 1.0);
            assert_eq!(bvh.is_blocked(ray.origin, ray.at(1.0), 0.0), blocked);
            hits += usize::from(nearest.is_some());
        }
        assert!(hits > 300, "only {hits} rays hit anything");
    }
}
