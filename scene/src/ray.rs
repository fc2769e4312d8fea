//! A ray, and where it meets a triangle, without gaps between neighbours.

use glam::{DVec2, DVec3};

/// A half-line from an origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, metres.
    pub origin: DVec3,
    /// Direction; distances along the ray count in its length.
    pub direction: DVec3,
}

impl Ray {
    /// The point at a distance along the ray.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}

/// A ray in the space that is sheared so that the ray becomes the z axis through the origin: made once for all triangles
/// that it is tried on.
///
/// Watertight: a ray that hits the shared edge of two triangles hits at least one of them (Woop, Benthin and Wald,
/// "Watertight Ray/Triangle Intersection", JCGT 2013; here in f64, where the edge functions of two triangles that
/// share an edge are exact negatives of each other).
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: [f64; 3],
    /// The axes, of which the last is the one along which the direction is largest: it is the divisor.
    axes: [usize; 3],
    shear: [f64; 3],
}

impl ShearedRay {
    /// Prepares a ray.
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = if d.x.abs() > d.y.abs() && d.x.abs() > d.z.abs() {
            0
        } else if d.y.abs() > d.z.abs() {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self { origin: ray.origin.to_array(), axes: [x, y, z], shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]] }
    }

    /// Where the ray meets the triangle (a, b, c), from either side: the distance and the barycentrics (s, t) of b and c.
    #[inline]
    pub fn intersect(&self, [a, b, c]: &[DVec3; 3]) -> Option<(f64, f64, f64)> {
        let [x, y, z] = self.axes;
        let [shear_x, shear_y, scale] = self.shear;
        let sheared = |p: &DVec3| {
            let p: &[f64; 3] = p.as_ref();
            let depth = p[z] - self.origin[z];
            (DVec2::new(p[x] - self.origin[x] - shear_x * depth, p[y] - self.origin[y] - shear_y * depth), depth)
        };
        let ((pa, za), (pb, zb), (pc, zc)) = (sheared(a), sheared(b), sheared(c));
        let (u, v, w) = (edge(pc, pb), edge(pa, pc), edge(pb, pa));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let distance = (u * (za * scale) + v * (zb * scale) + w * (zc * scale)) / sum;
        (distance > 0.0).then_some((distance, v / sum, w / sum))
    }
}

/// Twice the signed area of (origin, p, q), exactly antisymmetric in its arguments.
fn edge(p: DVec2, q: DVec2) -> f64 {
    p.x * q.y - p.y * q.x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degenerate_triangles_are_missed() {
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::Z };
        assert_eq!(ShearedRay::new(&ray).intersect(&[DVec3::Z; 3]), None);
        assert_eq!(ShearedRay::new(&ray).intersect(&[DVec3::Z, DVec3::Z * 2.0, DVec3::Z * 3.0]), None);
        let behind = [DVec3::new(-1., -1., -1.), DVec3::new(1., -1., -1.), DVec3::new(0., 1., -1.)];
        assert_eq!(ShearedRay::new(&ray).intersect(&behind), None);
    }

    #[test]
    fn barycentrics_rebuild_the_point() {
        let triangle = [DVec3::new(0.3, -1.0, 2.0), DVec3::new(2.0, 0.1, 2.5), DVec3::new(-0.7, 1.9, 3.0)];
        for (s, t) in [(0.25, 0.5), (0.7, 0.2), (0.01, 0.01)] {
            let point = triangle[0] * (1.0 - s - t) + triangle[1] * s + triangle[2] * t;
            for origin in [DVec3::ZERO, DVec3::new(3.0, 3.0, 9.0)] {
                let ray = Ray { origin, direction: (point - origin) * 0.5 };
                let (distance, hit_s, hit_t) =
                    ShearedRay::new(&ray).intersect(&triangle).expect("the ray aims at the triangle");
                assert!((distance - 2.0).abs() < 1e-12 && (hit_s - s).abs() < 1e-12 && (hit_t - t).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_shared_edge_has_no_gap() {
        let (p, q) = (DVec3::new(0.1, -0.93, 1.7), DVec3::new(-0.37, 1.1, 2.9));
        let (left, right) = (DVec3::new(-2.0, 0.3, 2.0), DVec3::new(2.0, -0.2, 2.2));
        for i in 1..1000 {
            let ray = Ray {
                origin: DVec3::new(0.01, 0.02, 0.0),
                direction: p.lerp(q, f64::from(i) / 1000.0) - DVec3::new(0.01, 0.02, 0.0),
            };
            assert!(
                ShearedRay::new(&ray).intersect(&[p, q, left]).is_some()
                    || ShearedRay::new(&ray).intersect(&[q, p, right]).is_some()
            );
        }
    }
}
