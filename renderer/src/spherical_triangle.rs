//! The directions in which a triangle is seen: their solid angle, and uniform samples of them.
//!
//! Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983; Arvo, "Stratified Sampling of Spherical
//! Triangles", SIGGRAPH 1995. Sampling directions rather than area keeps an estimate of irradiance within L·Ω: with
//! uniform area sampling a receiver near an emitter's edge has an unbounded one, and paths past it infinite variance.

use glam::DVec3;

/// A triangle as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphericalTriangle {
    /// Unit directions to the corners, the second opposite the longest side: sliding a point along that side is well
    /// conditioned even where two corners are seen in opposite directions, at a contact.
    corners: [DVec3; 3],
    /// Steradians; 0 where the triangle is seen edge-on or has no extent.
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle as seen from `eye`. From a point of the triangle itself the solid angle is meaningless.
    pub fn seen_from(eye: DVec3, triangle: [DVec3; 3]) -> Self {
        let [a, b, c] = triangle.map(|corner| (corner - eye).normalize_or_zero());
        let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
        let solid_angle = 2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + ab + bc + ca);
        let corners = if ca <= ab && ca <= bc {
            [a, b, c]
        } else if ab <= bc {
            [b, c, a]
        } else {
            [c, a, b]
        };
        Self { corners, solid_angle: if corners.contains(&DVec3::ZERO) { 0.0 } else { solid_angle } }
    }

    /// A unit direction into the triangle, uniform in solid angle for uniform `u`, `v` in 0..1; none where the
    /// triangle has no directions.
    ///
    /// The first number slides the corner c along the side ac until the triangle abc' has that share Ω' of the solid
    /// angle; the second goes from b towards c'. Arvo's formula for the side ac' is replaced by
    /// tan(ac'/2) = sin(Ω'/2) / (tan(ab/2) · sin(α − Ω'/2)), α the angle at a, which cancels nothing.
    pub fn sample(&self, u: f64, v: f64) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        let half = u * self.solid_angle / 2.0;
        let alpha = angle(a.cross(b), a.cross(c));
        let slid = 2.0 * (half.sin() * (a + b).length()).atan2((a - b).length() * (alpha - half).sin());
        let corner = a * slid.cos() + c.reject_from_normalized(a).try_normalize()? * slid.sin();
        // Uniform in 1 − cosine from b to the corner; squared chords keep it exact for small triangles.
        let drop = v * (corner - b).length_squared() / 2.0;
        let side = corner.reject_from_normalized(b).try_normalize()?;
        Some(b * (1.0 - drop) + side * (drop * (2.0 - drop)).max(0.0).sqrt())
    }
}

/// Angle between two vectors, to full precision where they are nearly parallel (an arc cosine has half of it).
fn angle(p: DVec3, q: DVec3) -> f64 {
    p.cross(q).length().atan2(p.dot(q))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn degenerate_triangles_have_no_solid_angle_and_no_samples() {
        let line = [DVec3::new(1., 0., 1.), DVec3::new(2., 0., 1.), DVec3::new(5., 0., 1.)];
        let corner_at_eye = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for triangle in [[DVec3::X; 3], line, corner_at_eye] {
            let seen = SphericalTriangle::seen_from(DVec3::ZERO, triangle);
            assert!(seen.solid_angle.abs() < 1e-15);
            let direction = seen.sample(0.3, 0.6);
            assert!(direction.is_none_or(|d| d.is_finite()));
        }
    }

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = SphericalTriangle::seen_from(DVec3::ZERO, [DVec3::X, DVec3::Y * 3.0, DVec3::Z * 0.1]);
        assert!((octant.solid_angle - FRAC_PI_2).abs() < 1e-15);
        for (u, v) in [(0.0, 0.0), (0.5, 0.5), (0.999, 0.001), (0.1, 1.0)] {
            let direction = octant.sample(u, v).unwrap();
            assert!(direction.min_element() >= -1e-15 && direction.is_normalized());
        }
    }

    /// The integral of directions over the triangle (the vector irradiance) has Lambert's closed form
    /// ½ Σ angle(vᵢ, vᵢ₊₁) (vᵢ × vᵢ₊₁) / |vᵢ × vᵢ₊₁|. Its mean over a fine grid of samples must be the same vector,
    /// for wide, small and thin triangles.
    #[test]
    fn samples_are_uniform_in_solid_angle() {
        let wide = [DVec3::new(-3.0, -2.0, 0.3), DVec3::new(4.0, -1.0, 0.2), DVec3::new(0.0, 5.0, 0.4)];
        let small = wide.map(|corner| DVec3::new(0.2, 0.1, 7.0) + corner * 1e-2);
        let thin = [DVec3::new(-3.0, 1.0, 1e-3), DVec3::new(4.0, 2.0, 1e-3), DVec3::new(0.0, 5.0, 1e-3)];
        for triangle in [wide, small, thin] {
            let seen = SphericalTriangle::seen_from(DVec3::ZERO, triangle);
            let n = 600;
            let cell = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let mut sum = DVec3::ZERO;
            for i in 0..n * n {
                sum += seen.sample(cell(i / n), cell(i % n)).unwrap();
            }
            let sampled = sum / f64::from(n * n) * seen.solid_angle;
            let edge = |p: DVec3, q: DVec3| p.cross(q).normalize() * angle(p, q) / 2.0;
            let [a, b, c] = triangle;
            let exact = edge(a, b) + edge(b, c) + edge(c, a);
            let error = (sampled - exact).length().min((sampled + exact).length());
            // What is left is the error of the midpoint rule, which falls as the grid gets finer.
            assert!(error < 2e-5 * exact.length(), "{sampled} for {exact}");
        }
    }
}
