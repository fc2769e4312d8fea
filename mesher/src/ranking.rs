//! Ranking of discontinuities by strength (Hardt & Teller 1996, section 4.2), and the choice of the strongest in a leaf.
//!
//! The weight of a swath is w = max(d_sb / d_br) · B_src: the distance from source to blocker over that from blocker to
//! receiver is how fast the blocker's edge seems to sweep across the source when the receiver's point moves, and B_src
//! is how much light it covers. We write d_br where the paper's text has d_sr, as its formula does.
//!
//! A horizon line has no blocker. It is given the weight of the swath across which irradiance would change as fast
//! (section 7.1's measure). An edge that sweeps across a source of area A at distance d, with both surfaces facing each
//! other, uncovers w / B · √A m² per metre, which changes irradiance by w √A / (π d²) per metre. So a horizon line across
//! which the derivative of irradiance jumps by g W·m⁻² per metre weighs
//!
//! w = g · π d² / √A.
//!
//! The jump itself has a closed form, see [`Horizon::slope`].

use std::f64::consts::PI;

use glam::DVec3;
use scene::{LineKind, Plane, Scene, area_vector, centroid};

use crate::critical_surface::{GrazingRay, Receiver, diameter, edges};
use crate::discontinuity::Discontinuity;

/// Least distance from blocker to receiver that a weight counts with, as a fraction of the diameter of the leaf (of the
/// receiver, for the weight of a whole line). At a contact the distance is 0 and every weight would be infinite. Larger
/// lets strong distant shadows win over the contact shadows of dim sources; smaller lets contacts displace everything.
pub(crate) const CONTACT_FLOOR: f64 = 0.01;

/// Lines in a leaf that are nearer to each other than this fraction of its diameter are one. Parallel edges of a source
/// and a blocker put four swaths in one plane; the fraction is far below what a mesh resolves.
const SAME_LINE: f64 = 1e-6;

/// The part of a discontinuity that a leaf keeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankedLine {
    /// Index into the receiver's discontinuities, of the strongest where several lie on one line.
    pub discontinuity: u32,
    /// Ends inside the leaf or on its border, metres.
    pub ends: [DVec3; 2],
    /// Weight over the part inside the leaf, W·m⁻².
    pub weight: f64,
}

/// The `count` strongest discontinuities inside a leaf, strongest first, ties by index.
///
/// `leaf` is a convex outline in the plane of the receiver of `discontinuities`, counter-clockwise from the front. The
/// weights are those of the parts inside the leaf. Lines along the leaf's border divide nothing and are left out.
/// Segments that overlap on one line are joined; pieces of one event that are apart count as one of the `count`.
pub fn rank(scene: &Scene, leaf: &[DVec3], discontinuities: &[Discontinuity], count: usize) -> Vec<RankedLine> {
    let leaf_diameter = diameter(leaf);
    let Some(leaf) = Receiver::new(leaf, SAME_LINE * leaf_diameter) else { return Vec::new() };
    let inside = |(index, discontinuity): (u32, &Discontinuity)| {
        let part = leaf.clip(discontinuity.ends)?;
        let ends = part.map(|t| discontinuity.ends[0].lerp(discontinuity.ends[1], t));
        if ends[0].distance(ends[1]) <= SAME_LINE * leaf_diameter || leaf.is_on_border(ends) {
            return None;
        }
        let weight = weight_within(scene, discontinuity, ends, part, CONTACT_FLOOR * leaf_diameter);
        Some(RankedLine { discontinuity: index, ends, weight })
    };
    let mut lines: Vec<RankedLine> = (0..).zip(discontinuities).filter_map(inside).collect();
    lines.sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight).then(a.discontinuity.cmp(&b.discontinuity)));

    let event = |line: &RankedLine| discontinuities[line.discontinuity as usize].event;
    let mut kept: Vec<RankedLine> = Vec::new();
    let mut events: Vec<u32> = Vec::new();
    for line in lines {
        if kept.iter_mut().any(|stronger| join(stronger, &line, SAME_LINE * leaf_diameter)) {
            continue;
        }
        if !events.contains(&event(&line)) {
            if events.len() == count {
                continue;
            }
            events.push(event(&line));
        }
        kept.push(line);
    }
    kept
}

/// Extends a segment by another that lies on the same line and meets it; false if it does not.
fn join(line: &mut RankedLine, other: &RankedLine, tolerance: f64) -> bool {
    let [from, to] = line.ends;
    let along = (to - from).normalize_or_zero();
    let place = |point: DVec3| (point - from).dot(along);
    let is_on_line = |point: DVec3| (point - from).reject_from_normalized(along).length() <= tolerance;
    if !other.ends.iter().all(|&end| is_on_line(end)) {
        return false;
    }
    let [a, b] = other.ends;
    let (low, high) = if place(a) < place(b) { (a, b) } else { (b, a) };
    let meets = place(low) <= place(to) + tolerance && place(high) >= -tolerance;
    if meets {
        line.ends = [if place(low) < 0.0 { low } else { from }, if place(high) > place(to) { high } else { to }];
    }
    meets
}

/// The weight over a part of a discontinuity, given as parameters along it and as their points.
fn weight_within(scene: &Scene, line: &Discontinuity, ends: [DVec3; 2], part: [f64; 2], floor: f64) -> f64 {
    if line.kind == LineKind::Horizon {
        let (source, receiver) = (scene.plane(line.source), scene.plane(line.receiver));
        let horizon = Horizon::new(&scene.outline(line.source), &source, &receiver);
        return horizon.map_or(0.0, |horizon| line.radiosity * horizon.weight(ends, floor));
    }
    let weight = |i: usize| swath_weight(line.radiosity, ray_between(line, part[i]), ends[i], floor);
    weight(0).max(weight(1))
}

/// w at one point of a swath's line.
pub(crate) fn swath_weight(radiosity: f64, ray: GrazingRay, point: DVec3, floor: f64) -> f64 {
    radiosity * ray.source.distance(ray.blocker) / ray.blocker.distance(point).max(floor)
}

/// The ray of a swath to the point at parameter t of its line.
pub(crate) fn ray_between(line: &Discontinuity, t: f64) -> GrazingRay {
    // Perspective: the point on the edge moves by weights that are (1−t), t times the ratio of the two legs of the
    // rays at the ends, from the apex to the receiver and from the apex to the edge.
    let [first, last] = line.rays;
    let ratio = |ray: GrazingRay, end: DVec3| match line.kind {
        LineKind::EdgeVertex => ray.blocker.distance(end) / ray.blocker.distance(ray.source),
        _ => ray.source.distance(end) / ray.source.distance(ray.blocker),
    };
    let (a, b) = ((1.0 - t) * ratio(first, line.ends[0]), t * ratio(last, line.ends[1]));
    let u = if a + b > 0.0 { b / (a + b) } else { t };
    GrazingRay { source: first.source.lerp(last.source, u), blocker: first.blocker.lerp(last.blocker, u) }
}

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
        let mut outline = Vec::with_capacity(source.len() + 1);
        for [from, to] in edges(source) {
            let (before, after) = (receiver.distance(from), receiver.distance(to));
            if before >= 0.0 {
                outline.push(from);
            }
            if before * after < 0.0 {
                outline.push(from.lerp(to, before / (before - after)));
            }
        }
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

    /// The largest weight per unit radiosity along a segment of the line. Distances to the source are taken `floor`
    /// metres longer, so that a source that stands on the line does not make it infinite.
    pub(crate) fn weight(&self, [from, to]: [DVec3; 2], floor: f64) -> f64 {
        let along = to - from;
        let nearest = ((self.centre - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let weight = |point: DVec3| {
            let point = point - self.up * floor;
            self.slope(point) * PI * self.centre.distance_squared(point) / self.area.sqrt()
        };
        [0.0, nearest, 1.0].into_iter().map(|t| weight(from.lerp(to, t))).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;
    use scene::HalfEdges;
    use solver::Interaction;

    use super::*;
    use crate::discontinuity::discontinuities;
    use crate::discontinuity::tests::{rectangle, welded};

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// A VE line on the plane z = 0 with the source at height 1 above its first end, and the blocker at the given
    /// heights on the rays to its ends.
    fn line(event: u32, ends: [(f64, f64); 2], heights: [f64; 2], radiosity: f64) -> Discontinuity {
        let ends = ends.map(|(x, y)| v(x, y, 0.0));
        let source = ends[0] + DVec3::Z;
        let ray = |i: usize| GrazingRay { source, blocker: ends[i].lerp(source, heights[i]) };
        Discontinuity {
            kind: LineKind::VertexEdge,
            receiver: 0,
            source: 1,
            blocker: 2,
            event,
            ends,
            rays: [ray(0), ray(1)],
            radiosity,
            weight: 1.0,
        }
    }

    fn leaf() -> Vec<DVec3> {
        rectangle((0.0, 0.0), (1.0, 1.0), 0.0, false)
    }

    fn chosen(lines: &[Discontinuity], count: usize) -> Vec<RankedLine> {
        rank(&Scene::default(), &leaf(), lines, count)
    }

    #[test]
    fn lines_that_divide_nothing_are_left_out() {
        let lines = [
            line(0, [(-1.0, 0.0), (2.0, 0.0)], [0.5; 2], 1.0),
            line(1, [(-1.0, 1.0), (1.0, 3.0)], [0.5; 2], 1.0),
            line(2, [(1.0, 1.0), (2.0, 2.0)], [0.5; 2], 1.0),
            line(3, [(1.5, 0.0), (1.5, 1.0)], [0.5; 2], 1.0),
        ];
        assert!(chosen(&lines, 10).is_empty());
        assert!(rank(&Scene::default(), &[], &lines, 10).is_empty());
        assert!(rank(&Scene::default(), &[DVec3::ZERO; 4], &lines, 10).is_empty());
        assert!(chosen(&[line(0, [(0.5, 0.0), (0.5, 1.0)], [0.5; 2], 1.0)], 0).is_empty());
    }

    #[test]
    fn the_strongest_are_kept_in_order_and_ties_go_by_index() {
        let across = |y: f64| [(-1.0, y), (2.0, y)];
        let lines = [
            line(0, across(0.2), [0.5; 2], 1.0),
            line(1, across(0.4), [0.5; 2], 3.0),
            line(2, across(0.6), [0.5; 2], 1.0),
            line(3, across(0.8), [0.25; 2], 1.0),
        ];
        let kept = chosen(&lines, 3);
        let ids: Vec<u32> = kept.iter().map(|line| line.discontinuity).collect();
        assert_eq!(ids, [1, 3, 0]);
        for (line, weight) in kept.iter().zip([3.0, 3.0, 1.0]) {
            assert!((line.weight - weight).abs() < 1e-12);
            assert!(line.ends[0].distance(v(0.0, line.ends[0].y, 0.0)) < 1e-12);
            assert!(line.ends[1].distance(v(1.0, line.ends[1].y, 0.0)) < 1e-12);
        }
    }

    #[test]
    fn weights_are_those_inside_the_leaf_and_finite_at_a_contact() {
        // A post at x = −1 that stands on the plane, lit from (−2, ½, 1): it is grazed at height (x + 1) / (x + 2), so
        // that source to blocker is to blocker to receiver as 1 is to x + 1.
        let source = v(-2.0, 0.5, 1.0);
        let ray = |x: f64| GrazingRay { source, blocker: v(-1.0, 0.5, (x + 1.0) / (x + 2.0)) };
        let mut post = line(0, [(-1.0, 0.5), (3.0, 0.5)], [0.5; 2], 2.0);
        post.rays = [ray(-1.0), ray(3.0)];
        let kept = chosen(&[post], 1);
        assert!((kept[0].weight - 2.0).abs() < 1e-12, "strongest where the line enters the leaf, x = 0");
        for t in [0.0, 0.3, 1.0] {
            let (found, expected) = (ray_between(&post, t), ray(-1.0 + 4.0 * t));
            assert!(found.blocker.distance(expected.blocker) < 1e-12 && found.source == source);
        }
        // In a leaf at the foot d_br is 0: it counts as 1 % of the leaf's diameter.
        let at_foot = [v(-1.0, 0.0, 0.0), v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(-1.0, 1.0, 0.0)];
        let weight = rank(&Scene::default(), &at_foot, &[post], 1)[0].weight;
        assert!((weight - 2.0 * 2f64.sqrt() / (0.01 * 2f64.sqrt())).abs() < 1e-9);
    }

    #[test]
    fn overlapping_segments_of_one_line_are_joined_and_count_once() {
        let lines = [
            line(0, [(0.1, 0.5), (0.5, 0.5)], [0.5; 2], 4.0),
            line(1, [(0.8, 0.5), (0.4, 0.5)], [0.5; 2], 3.0),
            line(2, [(0.2, 0.5), (0.3, 0.5)], [0.5; 2], 2.0),
            line(3, [(0.5, 0.9), (0.5, 0.1)], [0.5; 2], 1.0),
            line(3, [(0.95, 0.5), (0.9, 0.5)], [0.5; 2], 0.9),
        ];
        let kept = chosen(&lines, 2);
        let ids: Vec<u32> = kept.iter().map(|line| line.discontinuity).collect();
        assert_eq!(ids, [0, 3, 4], "two events; what touches neither is a piece of the second");
        assert_eq!(kept[0].ends, [v(0.1, 0.5, 0.0), v(0.8, 0.5, 0.0)]);
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
        assert!(horizon.weight([v(0.0, -1.0, 0.0), v(0.0, 2.0, 0.0)], 0.01).is_finite());
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
        let weight = horizon.weight([v(0.0, 4.0, 0.0), v(0.0, 9.0, 0.0)], 0.0);
        assert!((weight / (3.0 * 0.01 / 25.0) - 1.0).abs() < 1e-5);
        let over = horizon.weight([v(0.0, -4.0, 0.0), v(0.0, 9.0, 0.0)], 0.0);
        assert!((over / (0.01 / 3.0) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_dim_distant_horizon_ranks_below_a_shadow() {
        let wall = vec![v(0.0, 0.3, 0.0), v(0.0, 0.3, 0.4), v(0.0, 0.7, 0.4), v(0.0, 0.7, 0.0)];
        let wall: Vec<DVec3> = wall.into_iter().map(|corner| corner + v(0.5, 0.0, 3.0)).collect();
        let light = rectangle((0.2, 0.2), (0.4, 0.4), 2.0, true);
        let scene = welded(&[leaf(), light, rectangle((0.4, 0.4), (0.6, 0.6), 0.5, false), wall]);
        let interactions = [
            Interaction { source: 1, radiosity: 30.0, blockers: vec![2] },
            Interaction { source: 3, radiosity: 1.0, blockers: vec![] },
        ];
        let lines = discontinuities(&scene, &HalfEdges::new(&scene), 0, &interactions, 0.0);
        let kept = rank(&scene, &leaf(), &lines, 100);
        let horizons: Vec<&RankedLine> =
            kept.iter().filter(|line| lines[line.discontinuity as usize].kind == LineKind::Horizon).collect();
        assert_eq!(horizons.len(), 1);
        assert!(horizons[0].weight < 0.2 && horizons[0].weight > 0.05);
        let of_light = kept.iter().filter(|line| lines[line.discontinuity as usize].source == 1);
        assert!(of_light.map(|line| line.weight).fold(f64::INFINITY, f64::min) > 10.0);
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
