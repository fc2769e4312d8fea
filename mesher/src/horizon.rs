//! Horizon lines (Hardt & Teller 1996, section 4.1): where the plane of a source meets a receiver, and how fast light
//! grows in front of it.

use std::f64::consts::PI;

use glam::DVec3;
use scene::{Plane, area_vector, centroid};

use crate::critical_surface::edges;

/// A source seen from its horizon: from points of the line in which its plane meets the receiver's.
pub(crate) struct Horizon {
    /// The part of the source in front of the receiver.
    outline: Vec<DVec3>,
    normal: DVec3,
    /// Unit vector in the source's plane, from the line towards the source.
    up: DVec3,
    /// Squared sine of the angle between the planes.
    sine_squared: f64,
    centre: DVec3,
    area: f64,
}

impl Horizon {
    /// None if the planes are parallel or the source is behind the receiver.
    pub(crate) fn new(source: &[DVec3], plane: &Plane, receiver: &Plane) -> Option<Self> {
        let outline = in_front(source, receiver);
        let up = receiver.normal.reject_from(plane.normal);
        let area = area_vector(&outline).length();
        let centre = centroid(&outline);
        let sine_squared = up.length_squared();
        (area > 0.0 && sine_squared > 0.0).then(|| Self {
            outline,
            normal: plane.normal,
            up: up.normalize(),
            sine_squared,
            centre,
            area,
        })
    }

    /// Points that stand for the source when it is asked what sees it: its corners and its centre.
    pub(crate) fn probes(&self) -> impl Iterator<Item = DVec3> {
        self.outline.iter().copied().chain([self.centre])
    }

    pub(crate) fn nearest_corner(&self, point: DVec3) -> DVec3 {
        let nearer = |a: &DVec3, b: &DVec3| a.distance_squared(point).total_cmp(&b.distance_squared(point));
        self.outline.iter().copied().min_by(nearer).unwrap_or(self.centre)
    }

    /// Irradiance per metre and unit radiosity, m⁻¹, by which the receiver's light grows in front of the line, at a
    /// point of it; behind it there is none.
    ///
    /// A distance ε in front of the line, with φ the angle between the planes, the point is ε sin φ in front of the
    /// source, and what the source's point at r does is, by Lambert, B/π · (y sin φ / r) (ε sin φ / r) / r² dA, where
    /// y is the point's distance from the line. So the slope is sin²φ / π · ∫ y r⁻⁴ dA. As y r⁻⁴ is the divergence of
    /// −y r⁻⁴ **r**, the integral is a sum over edges.
    pub(crate) fn slope(&self, point: DVec3) -> f64 {
        let mut integral = 0.0;
        for [from, to] in edges(&self.outline) {
            let (from, to) = (from - point, to - point);
            let Some(along) = (to - from).try_normalize() else { continue };
            let outward = along.cross(self.normal);
            let distance = from.dot(outward);
            if distance == 0.0 {
                continue;
            }
            let (s, t) = (from.dot(along), to.dot(along));
            let (near, far) = (from.length_squared(), to.length_squared());
            let angle = (distance * (t - s)).atan2(distance * distance + s * t);
            integral -= self.up.dot(outward) / 2.0 * (t / far - s / near + angle / distance);
            integral += self.up.dot(along) / 2.0 * distance * (1.0 / far - 1.0 / near);
        }
        self.sine_squared / PI * integral
    }

    /// The largest [`slope`](Self::slope) along a segment of the line, m⁻¹.
    pub(crate) fn steepest(&self, ends: [DVec3; 2], floor: f64) -> f64 {
        self.largest(ends, floor, |point| self.slope(point))
    }

    /// The largest ratio d_sb / d_br along a segment of the line, of the swath across which light would change as fast.
    pub(crate) fn equivalent_ratio(&self, ends: [DVec3; 2], floor: f64) -> f64 {
        let ratio = |point| self.slope(point) * PI * self.centre.distance_squared(point) / self.area.sqrt();
        self.largest(ends, floor, ratio)
    }

    /// The largest value at the ends of a segment and at its point nearest to the source. Distances to the source are
    /// taken `floor` metres longer, so that a source that stands on the line does not make it infinite.
    fn largest(&self, [from, to]: [DVec3; 2], floor: f64, value: impl Fn(DVec3) -> f64) -> f64 {
        let along = to - from;
        let nearest = ((self.centre - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        [0.0, nearest, 1.0].into_iter().map(|t| value(from.lerp(to, t) - self.up * floor)).fold(0.0, f64::max)
    }
}

/// The part of a convex outline in front of a plane.
pub(crate) fn in_front(outline: &[DVec3], plane: &Plane) -> Vec<DVec3> {
    let mut part = Vec::with_capacity(outline.len() + 1);
    for [from, to] in edges(outline) {
        let (before, after) = (plane.distance(from), plane.distance(to));
        if before >= 0.0 {
            part.push(from);
        }
        if before * after < 0.0 {
            part.push(from.lerp(to, before / (before - after)));
        }
    }
    part
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;

    use super::*;
    use crate::discontinuity::tests::rectangle;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// A source in the plane x = 0, facing +x, over the receiver z = 0: the line is the y axis.
    fn upright(outline: &[(f64, f64)]) -> Vec<DVec3> {
        outline.iter().map(|&(y, z)| v(0.0, y, z)).collect()
    }

    fn horizon_over_floor(outline: &[DVec3]) -> Option<Horizon> {
        let plane = Plane::through(outline);
        Horizon::new(outline, &plane, &Plane { normal: DVec3::Z, offset: 0.0 })
    }

    #[test]
    fn horizons_of_degenerate_sources() {
        assert!(horizon_over_floor(&[]).is_none());
        assert!(horizon_over_floor(&upright(&[(0.0, -1.0), (1.0, -1.0), (1.0, -2.0)])).is_none());
        assert!(horizon_over_floor(&rectangle((0.0, 0.0), (1.0, 1.0), 1.0, true)).is_none());
        let standing = upright(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        let horizon = horizon_over_floor(&standing).unwrap();
        assert!(horizon.equivalent_ratio([v(0.0, -1.0, 0.0), v(0.0, 2.0, 0.0)], 0.01).is_finite());
    }

    #[test]
    fn a_small_distant_source_by_hand() {
        // Area 1e-4 m² at height 3 m, seen from 4 m aside: y = 3, r = 5.
        let half = 0.005;
        let outline = upright(&[(-half, 3.0 - half), (half, 3.0 - half), (half, 3.0 + half), (-half, 3.0 + half)]);
        let horizon = horizon_over_floor(&outline).unwrap();
        let slope = 3.0 * 1e-4 / (PI * 625.0);
        assert!((horizon.slope(v(0.0, 4.0, 0.0)) / slope - 1.0).abs() < 1e-5);
        // w = slope · π d² / √A = y √A / r², largest at the nearest point of a segment.
        let weight = horizon.equivalent_ratio([v(0.0, 4.0, 0.0), v(0.0, 9.0, 0.0)], 0.0);
        assert!((weight / (3.0 * 0.01 / 25.0) - 1.0).abs() < 1e-5);
        let steepest = horizon.steepest([v(0.0, 4.0, 0.0), v(0.0, 9.0, 0.0)], 0.0);
        assert!((steepest / slope - 1.0).abs() < 1e-5);
        let over = horizon.equivalent_ratio([v(0.0, -4.0, 0.0), v(0.0, 9.0, 0.0)], 0.0);
        assert!((over / (0.01 / 3.0) - 1.0).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn the_slope_is_the_derivative_of_irradiance(
            centre in (-2.0..2.0f64, 1.2..3.0f64), size in 0.1..1.0f64, y in -3.0..3.0f64,
        ) {
            let turns = [(0.9, -0.3), (0.4, 0.8), (-0.7, 0.5), (-0.5, -0.8)];
            let outline: Vec<(f64, f64)> =
                turns.iter().map(|(dy, dz)| (centre.0 + size * dy, centre.1 + size * dz)).collect();
            let outline = upright(&outline);
            let horizon = horizon_over_floor(&outline).unwrap();
            // Lambert's formula for the irradiance of the floor, per unit radiosity, a little in front of the line.
            let step = 1e-6;
            let point = v(step, y, 0.0);
            let irradiance: f64 = edges(&outline)
                .map(|[from, to]| {
                    let (from, to) = ((from - point).normalize(), (to - point).normalize());
                    let normal = from.cross(to);
                    normal.z / normal.length() * normal.length().atan2(from.dot(to)) / (2.0 * PI)
                })
                .sum();
            let slope = horizon.slope(v(0.0, y, 0.0));
            prop_assert!((irradiance.abs() / step / slope - 1.0).abs() < 1e-4, "{} {}", irradiance / step, slope);
        }
    }
}
