//! The part of a source that a point sees: blockers are projected back onto the source and cut away.
//!
//! Hardt & Teller 1996, section 5 (after Drettakis & Fiume 1994). Everything happens in directions from the point, so
//! that a cone of directions stands for a polygon: its corners relative to the point, in order. All cutting planes
//! pass through the point.
//!
//! A polygon that touches the point has no such cone; what counts there is the limit as the point is approached along a
//! direction. In that limit the polygon looks like its tangent cone seen from beside its tip ([`tangent_cone`]):
//! no nudging of points, no epsilon that light could leak through.

use std::ops::Range;

use glam::DVec3;

use crate::bounding_cone::BoundingCone;
use crate::clip::{Position, clip_convex, locate};
use crate::form_factor::{form_factor_at, point_form_factor};

/// Distances from a cutting plane, as a fraction of the scene's size, that count as on it. Some roundings of f64
/// above zero; larger would only drop thin fragments.
pub const PLANE_TOLERANCE: f64 = 1e-13;

/// Form factor of a fragment that is no more than the rounding between two blockers that share an edge. Dark rooms
/// are exactly dark for it; nothing that could be seen through such a slit is lost.
pub const SLIVER: f64 = 1e-12;

/// What a blocker hides from a point: a convex cone of directions.
#[derive(Clone, Debug)]
pub struct BlockerCone {
    bounds: BoundingCone,
    corners: Vec<DVec3>,
    /// Inward unit normals of the planes through the point and each edge.
    planes: Vec<DVec3>,
}

/// A point on a receiver, its horizon, and where it is approached from.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    /// The point, metres.
    pub position: DVec3,
    /// Unit normal of the receiver's plane: only what is above it is seen.
    pub up: DVec3,
    /// Unit normal that the cosine of arriving light is to: `up`, or a shading normal, below whose horizon nothing counts
    /// either.
    pub normal: DVec3,
    /// Direction in the receiver's plane: where something touches the point, the limit from point + ε·inward counts.
    /// Zero for a point that nothing touches.
    pub inward: DVec3,
    /// What rises over the plane by no more than this, metres, is not met on any way from the point; minus infinity where all
    /// may be.
    pub rise: f64,
}

impl Viewpoint {
    /// A point of a flat surface, which is lit by its own normal.
    pub fn flat(position: DVec3, up: DVec3, inward: DVec3) -> Self {
        Self { position, up, normal: up, inward, rise: f64::NEG_INFINITY }
    }

    /// The length of a way from the point times its cosine, as arriving light is weighed; 0 below a horizon.
    pub fn height(&self, way: DVec3) -> f64 {
        if self.up.dot(way) > 0.0 { self.normal.dot(way).max(0.0) } else { 0.0 }
    }

    /// Whether a way from the point may meet an outline. A round body's faces all hang below the plane of each, though rays from a
    /// common corner seem to meet them.
    pub fn may_meet(&self, outline: &[DVec3]) -> bool {
        outline.iter().any(|corner| self.up.dot(corner - self.position) > self.rise)
    }

    /// The point so many metres along its direction of approach.
    pub fn aside(&self, distance: f64) -> Self {
        Self { position: self.position + self.inward * distance, ..*self }
    }

    /// Form factor to a convex polygon if nothing hides it, 0..=1: clipped by both horizons, seen from either side.
    pub fn form_factor(&self, outline: &[DVec3]) -> f64 {
        if self.normal == self.up {
            return form_factor_at(self.position, self.up, outline);
        }
        let corners: Vec<DVec3> = outline.iter().map(|corner| corner - self.position).collect();
        let mut above = Vec::with_capacity(corners.len() + 1);
        clip_convex(&corners, 0.0, |way| self.up.dot(way), &mut above);
        let mut seen = Vec::with_capacity(above.len() + 1);
        clip_convex(&above, 0.0, |way| self.normal.dot(way), &mut seen);
        point_form_factor(&seen, self.normal)
    }

    /// The cone of a polygon that touches the point within `tolerance` metres; empty if it is seen edge-on.
    pub fn tangent_cone(&self, outline: &[DVec3], normal: DVec3, tolerance: f64) -> Vec<DVec3> {
        if normal.dot(self.inward).abs() < 1e-9 {
            return Vec::new();
        }
        tangent_cone(outline, normal, self.position, (self.up, self.inward), tolerance)
    }
}

impl BlockerCone {
    /// Unit directions of the corners, in order.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// What a polygon with unit normal `normal` hides from a point; none where it is seen edge-on.
    pub fn of_polygon(outline: &[DVec3], normal: DVec3, from: &Viewpoint, tolerance: f64) -> Option<Self> {
        let depth = normal.dot(from.position - outline.first()?);
        if depth.abs() > tolerance {
            Self::new(outline.iter().map(|corner| corner - from.position).collect())
        } else {
            Self::new(from.tangent_cone(outline, normal, tolerance))
        }
    }

    /// The cone over corners given relative to the point, in either orientation. None where it has no solid angle.
    pub fn new(corners: Vec<DVec3>) -> Option<Self> {
        // Unit vectors: the length of their cross product is the sine of an edge's angle, free of scale.
        let mut corners = corners;
        corners.iter_mut().for_each(|corner| *corner = corner.normalize_or_zero());
        let middle: DVec3 = corners.iter().sum();
        let mut planes = Vec::with_capacity(corners.len());
        let mut facing = 0.0;
        let mut corner = corners.last().copied().unwrap_or_default();
        for &next in &corners {
            if let Some(plane) = corner.cross(next).try_normalize() {
                facing += plane.dot(middle);
                planes.push(plane);
            }
            corner = next;
        }
        if planes.len() < 3 || facing == 0.0 {
            return None;
        }
        if facing < 0.0 {
            planes.iter_mut().for_each(|plane| *plane = -*plane);
        }
        Some(Self { bounds: BoundingCone::around(&corners), corners, planes })
    }
}

/// Fragments of one source, as seen from one point. The buffers are reused from source to source.
#[derive(Clone, Debug, Default)]
pub struct Fragments {
    bounds: Option<BoundingCone>,
    points: Vec<DVec3>,
    ranges: Vec<Range<usize>>,
    /// Form factor of each fragment, once measured.
    factors: Vec<f64>,
    spare: Vec<Range<usize>>,
    corners: Vec<DVec3>,
    tolerance: f64,
}

impl Fragments {
    /// Buffers for a scene of the given size, metres.
    pub fn new(scene_size: f64) -> Self {
        Self { tolerance: scene_size * PLANE_TOLERANCE, ..Self::default() }
    }

    /// Starts over with the part of a source above the horizons of a point. `corners` are relative to the point.
    pub fn start(&mut self, corners: &[DVec3], from: &Viewpoint) {
        self.points.clear();
        self.ranges.clear();
        self.factors.clear();
        self.bounds = None;
        clip_convex(corners, self.tolerance, |d| from.up.dot(d), &mut self.points);
        let mut above = 0..self.points.len();
        if from.normal != from.up {
            above = self.clipped(above, from.normal);
        }
        if !above.is_empty() {
            self.ranges.push(above);
        }
    }

    /// Cuts away what a blocker hides.
    pub fn subtract(&mut self, blocker: &BlockerCone) {
        let Some(whole) = self.ranges.first() else { return };
        // Before the first blocker there is one fragment: the source.
        let bounds = *self.bounds.get_or_insert_with(|| BoundingCone::around(&self.points[whole.clone()]));
        if bounds.misses(&blocker.bounds) {
            return;
        }
        self.spare.clear();
        std::mem::swap(&mut self.ranges, &mut self.spare);
        let fragments = std::mem::take(&mut self.spare);
        for fragment in &fragments {
            if self.misses(fragment, blocker) {
                self.ranges.push(fragment.clone());
            } else {
                self.carve(fragment.clone(), blocker);
            }
        }
        self.spare = fragments;
    }

    /// Whether some edge plane of the fragment or of the blocker separates the two.
    fn misses(&self, fragment: &Range<usize>, blocker: &BlockerCone) -> bool {
        let points = &self.points[fragment.clone()];
        if blocker.planes.iter().any(|plane| points.iter().all(|point| plane.dot(*point) <= self.tolerance)) {
            return true;
        }
        let middle: DVec3 = points.iter().sum();
        (0..points.len()).any(|i| {
            let plane = points[i].cross(points[(i + 1) % points.len()]);
            let (side, margin) = (plane.dot(middle), self.tolerance * plane.length());
            let outside = |d: f64| if side > 0.0 { d <= margin } else { d >= -margin };
            side != 0.0 && blocker.corners.iter().all(|corner| outside(plane.dot(*corner)))
        })
    }

    /// Replaces a fragment by its convex pieces outside the blocker: what lies beyond the first edge plane, of the
    /// rest what lies beyond the second, and so on.
    fn carve(&mut self, fragment: Range<usize>, blocker: &BlockerCone) {
        let mut rest = fragment;
        for &plane in &blocker.planes {
            if self.points[rest.clone()].iter().all(|point| plane.dot(*point) >= -self.tolerance) {
                continue;
            }
            let outer = self.clipped(rest.clone(), -plane);
            if !outer.is_empty() {
                self.ranges.push(outer);
            }
            rest = self.clipped(rest, plane);
            if rest.is_empty() {
                return;
            }
        }
    }

    /// Appends the part of a fragment on the inner side of a plane through the point.
    fn clipped(&mut self, fragment: Range<usize>, plane: DVec3) -> Range<usize> {
        let first = self.points.len();
        self.corners.clear();
        self.corners.extend_from_slice(&self.points[fragment]);
        clip_convex(&self.corners, self.tolerance, |d| plane.dot(d), &mut self.points);
        first..self.points.len()
    }

    /// Whether nothing of the source is left.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// Measures the form factor of each fragment, and drops those that are mere rounding. Returns the sum. To be called
    /// after the last blocker.
    pub fn measure(&mut self, normal: DVec3) -> f64 {
        let (points, factors) = (&self.points, &mut self.factors);
        factors.clear();
        self.ranges.retain(|range| {
            let factor = point_form_factor(&points[range.clone()], normal);
            if factor > SLIVER {
                factors.push(factor);
            }
            factor > SLIVER
        });
        factors.iter().sum()
    }

    /// The measured fragments with their form factors: convex cones, corners relative to the point.
    pub fn iter(&self) -> impl Iterator<Item = (&[DVec3], f64)> {
        self.ranges.iter().map(|range| &self.points[range.clone()]).zip(self.factors.iter().copied())
    }
}

/// The cone that a polygon touching a point fills in the limit, as the point is approached from its side `inward`
/// (from point + ε·inward, ε → 0), above the horizon of a receiver with unit normal `up`, which `inward` is
/// perpendicular to. `normal` is the polygon's. Empty where the polygon does not touch the point within `tolerance`
/// metres. The corners are directions, in order.
fn tangent_cone(
    outline: &[DVec3],
    normal: DVec3,
    point: DVec3,
    (up, inward): (DVec3, DVec3),
    tolerance: f64,
) -> Vec<DVec3> {
    let count = outline.len();
    let towards = |from: DVec3, to: DVec3| (to - from).normalize_or_zero();
    let (leaving, arriving) = match locate(outline, normal, point, tolerance) {
        Position::Outside => return Vec::new(),
        // A sector: from the tip along one edge, back along the other.
        Position::Corner(i) => {
            (towards(outline[i], outline[(i + 1) % count]), towards(outline[i], outline[(i + count - 1) % count]))
        }
        // A half plane.
        Position::Edge(i) => {
            let edge = towards(outline[i], outline[(i + 1) % count]);
            (edge, -edge)
        }
        // A plane, which meets the receiver's along a line: of it the half above.
        Position::Interior => {
            let Some(along) = up.cross(normal).try_normalize() else { return Vec::new() };
            let rising = normal.cross(along);
            return vec![-inward, along, if rising.dot(up) > 0.0 { rising } else { -rising }, -along];
        }
    };
    // In the plane, a quarter turn inwards from the leaving edge: keeps neighbouring directions less than 180° apart.
    let across = normal.cross(leaving);
    if leaving.dot(arriving) < 0.0 {
        vec![-inward, leaving, across, arriving]
    } else {
        vec![-inward, leaving, arriving]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::form_factor_at;

    fn square(half: f64, x: f64, y: f64, z: f64) -> Vec<DVec3> {
        [(-1., -1.), (-1., 1.), (1., 1.), (1., -1.)].map(|(a, b)| DVec3::new(x + a * half, y + b * half, z)).to_vec()
    }

    const FROM: Viewpoint =
        Viewpoint { position: DVec3::ZERO, up: DVec3::Z, normal: DVec3::Z, inward: DVec3::X, rise: f64::NEG_INFINITY };

    fn visible(source: &[DVec3], blockers: &[Vec<DVec3>]) -> f64 {
        let mut fragments = Fragments::new(10.0);
        fragments.start(source, &FROM);
        for blocker in blockers {
            let normal = scene::area_vector(blocker).normalize_or_zero();
            if let Some(cone) = BlockerCone::of_polygon(blocker, normal, &FROM, 1e-9) {
                fragments.subtract(&cone);
            }
        }
        fragments.measure(DVec3::Z)
    }

    #[test]
    fn degenerate_blockers_hide_nothing() {
        let source = square(0.5, 0.0, 0.0, 1.0);
        let whole = form_factor_at(DVec3::ZERO, DVec3::Z, &source);
        let edge_on =
            [(1., 0.5), (2., 0.5), (2., 0.9), (1., 0.9)].map(|(x, z)| DVec3::new(x, 0.0, z) - DVec3::X).to_vec();
        let coplanar = square(0.25, 2.0, 0.0, 0.0);
        let point = vec![DVec3::Z * 0.5; 4];
        let line = vec![DVec3::new(-1., 0., 0.5), DVec3::new(0., 0., 0.5), DVec3::new(1., 0., 0.5)];
        for blocker in [edge_on, coplanar, point, line, Vec::new()] {
            assert_eq!(visible(&source, std::slice::from_ref(&blocker)), whole, "{blocker:?}");
        }
    }

    /// A square half-way to a square source hides a part that is known by similar triangles.
    #[test]
    fn a_hidden_square_is_subtracted_to_rounding() {
        let source = square(0.5, 0.3, 0.1, 1.0);
        let whole = form_factor_at(DVec3::ZERO, DVec3::Z, &source);
        let hidden = form_factor_at(DVec3::ZERO, DVec3::Z, &square(0.2, 0.3, 0.1, 1.0));
        assert!((visible(&source, &[square(0.1, 0.15, 0.05, 0.5)]) - (whole - hidden)).abs() < 1e-15);
        // Twice the same, and one that covers all.
        assert!((visible(&source, &vec![square(0.1, 0.15, 0.05, 0.5); 2]) - (whole - hidden)).abs() < 1e-15);
        assert_eq!(visible(&source, &[square(0.1, 0.15, 0.05, 0.5), square(3.0, 0.0, 0.0, 0.25)]), 0.0);
    }

    /// Many overlapping blockers against midpoint quadrature of the visible kernel.
    #[test]
    fn overlapping_blockers_agree_with_quadrature() {
        let source = square(0.7, 0.2, -0.3, 1.3);
        let blockers = [square(0.2, 0.0, 0.0, 0.4), square(0.15, 0.2, -0.1, 0.7), square(0.3, 0.3, -0.4, 1.0)];
        const N: i32 = 800;
        let mut sum = 0.0;
        for i in 0..N * N {
            let (u, v) = (f64::from(i % N) + 0.5, f64::from(i / N) + 0.5);
            let y = DVec3::new(0.2 - 0.7 + 1.4 * u / f64::from(N), -0.3 - 0.7 + 1.4 * v / f64::from(N), 1.3);
            let blocked = [(0.2, 0.0, 0.0, 0.4), (0.15, 0.2, -0.1, 0.7), (0.3, 0.3, -0.4, 1.0)].iter().any(
                |&(half, x, z, depth)| {
                    let p: DVec3 = y * (depth / 1.3);
                    (p.x - x).abs() < half && (p.y - z).abs() < half
                },
            );
            if !blocked {
                sum += 1.3 * 1.3 / (std::f64::consts::PI * y.length_squared().powi(2));
            }
        }
        let area = 1.4 * 1.4 / f64::from(N * N);
        assert!((visible(&source, &blockers) - sum * area).abs() < 2e-4);
    }

    /// A wall that stands on the point's plane and touches the point hides exactly its half of the hemisphere from one
    /// side; from the other side it hides the other half.
    #[test]
    fn a_touching_wall_hides_its_side() {
        let wall = [(-1., 0.), (1., 0.), (1., 2.), (-1., 2.)].map(|(y, z)| DVec3::new(0.0, y, z)).to_vec();
        let (left, right) = (square(0.5, -1.0, 0.0, 1.0), square(0.5, 1.0, 0.0, 1.0));
        for (inward, seen, hidden) in [(-DVec3::X, &left, &right), (DVec3::X, &right, &left)] {
            let from = Viewpoint { inward, ..FROM };
            let cone = BlockerCone::of_polygon(&wall, DVec3::X, &from, 1e-9).expect("the wall touches");
            let mut fragments = Fragments::new(4.0);
            fragments.start(hidden, &from);
            fragments.subtract(&cone);
            assert!(fragments.is_empty());
            fragments.start(seen, &from);
            fragments.subtract(&cone);
            assert_eq!(fragments.measure(DVec3::Z), form_factor_at(DVec3::ZERO, DVec3::Z, seen));
        }
    }

    /// The limit is what points ever closer to the contact tend to: at a wall's foot, at the foot of its end, and
    /// where it passes through the point's plane.
    #[test]
    fn the_limit_is_approached() {
        let inward = DVec3::new(0.6, 0.8, 0.0);
        let foot = [(-1., 0.), (1., 0.), (1., 2.), (-1., 2.)];
        let end = [(0., 0.), (1., 0.), (1., 2.), (0., 2.)];
        let through = [(-1., -1.), (1., -1.), (1., 2.), (-1., 2.)];
        for corners in [foot, end, through] {
            let wall = corners.map(|(y, z)| DVec3::new(0.0, y, z)).to_vec();
            let cone = Viewpoint { inward, ..FROM }.tangent_cone(&wall, DVec3::X, 1e-9);
            let mut fragments = Fragments::new(4.0);
            fragments.start(&cone, &FROM);
            let limit = fragments.measure(DVec3::Z);
            let near = form_factor_at(inward * 1e-7, DVec3::Z, &wall);
            assert!((limit - near).abs() < 1e-6 && limit > 0.1, "{limit} {near}");
        }
    }
}
