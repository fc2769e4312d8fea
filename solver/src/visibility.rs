//! What may stand between two polygons: shafts (Haines & Wallace 1991) and blocker lists (Teller & Hanrahan 1993).
//!
//! Where those build a shaft from the boxes around its ends, ours is the convex hull of the ends themselves. Both
//! answers that spare work are proofs: a blocker called clear blocks no segment between the ends, and one that is called
//! total blocks them all. Nothing is concluded from samples.

use std::collections::HashMap;

use glam::DVec3;
use scene::Plane;

use crate::BlockerLists;
use crate::clip::clip_convex;

/// Depth to which a blocker may reach into a shaft and still only touch it, as a fraction of the shaft's diagonal.
/// Above the rounding of corners that elements share with their neighbours, far below what can be seen.
const TOUCH: f64 = 1e-9;

/// One less the cosine of the angle below which two sides are the same. Dropping one then loses no blocker.
const SAME_DIRECTION: f64 = 1e-15;

/// What one blocker does to a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occlusion {
    /// It stays outside, or touches from there: no segment between the ends meets it.
    Clear,
    /// Neither is proved.
    Partial,
    /// It crosses the whole shaft: every segment between the ends meets it.
    Total,
}

/// The convex hull of two convex planar polygons in front of each other.
#[derive(Clone, Debug)]
pub struct Shaft<'a> {
    ends: [&'a [DVec3]; 2],
    /// The shaft is where all distances are ≥ 0.
    planes: Vec<Plane>,
    /// Corners of the box around it.
    low: DVec3,
    high: DVec3,
    tolerance: f64,
}

impl<'a> Shaft<'a> {
    /// The shaft between two outlines, counter-clockwise from their fronts, each clipped to the front of the other's
    /// plane. For outlines that are not, it may be larger than their hull in front of both, never smaller.
    pub fn between(a: &'a [DVec3], b: &'a [DVec3]) -> Self {
        let corners = || a.iter().chain(b).copied();
        let (low, high) =
            (corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max));
        Self::within(a, b, TOUCH * (high - low).length())
    }

    /// The same where only what blockers do to it that fit into `size` metres counts: for an end that is far away from all of them.
    pub fn between_far(a: &'a [DVec3], b: &'a [DVec3], size: f64) -> Self {
        Self::within(a, b, TOUCH * size)
    }

    fn within(a: &'a [DVec3], b: &'a [DVec3], tolerance: f64) -> Self {
        let corners = || a.iter().chain(b).copied();
        let (low, high) =
            (corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max));
        let mut shaft = Self { ends: [a, b], planes: Vec::with_capacity(a.len() + b.len() + 2), low, high, tolerance };
        shaft.planes.extend([a, b].map(Plane::through).into_iter().filter(|front| front.normal != DVec3::ZERO));
        for (near, far) in [(a, b), (b, a)] {
            for (i, &from) in near.iter().enumerate() {
                shaft.add_side(from, near[(i + 1) % near.len()], far);
            }
        }
        shaft
    }

    /// The shaft between an outline and the corners of any body in front of it. It has the sides through the outline's edges
    /// alone, so that it is larger than the hull of both, never smaller.
    pub fn towards(a: &'a [DVec3], body: &'a [DVec3]) -> Self {
        let corners = || a.iter().chain(body).copied();
        let (low, high) =
            (corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max));
        let tolerance = TOUCH * (high - low).length();
        let mut shaft = Self { ends: [a, body], planes: Vec::with_capacity(a.len() + 1), low, high, tolerance };
        shaft.planes.extend(Some(Plane::through(a)).filter(|front| front.normal != DVec3::ZERO));
        for (i, &from) in a.iter().enumerate() {
            shaft.add_side(from, a[(i + 1) % a.len()], body);
        }
        shaft
    }

    /// Whether a box, given by its lower and upper corner, may reach into the shaft: false is a proof.
    pub fn may_enter(&self, low: DVec3, high: DVec3) -> bool {
        (high - self.low).min_element() > self.tolerance
            && (self.high - low).min_element() > self.tolerance
            && self.planes.iter().all(|plane| {
                let farthest = DVec3::select(plane.normal.cmpgt(DVec3::ZERO), high, low);
                plane.distance(farthest) > self.tolerance
            })
    }

    /// Adds the side through an edge of one end that just holds the other end.
    fn add_side(&mut self, from: DVec3, to: DVec3, far: &[DVec3]) {
        let edge = to - from;
        let on_edge = (self.tolerance * edge.length()).powi(2);
        // Seen along the edge, the side turns outwards from its own polygon until the other lies behind it.
        let mut normal = DVec3::ZERO;
        for &corner in far {
            if normal == DVec3::ZERO || normal.dot(corner - from) < 0.0 {
                let turned = (corner - from).cross(edge);
                if turned.length_squared() > on_edge {
                    normal = turned;
                }
            }
        }
        let Some(normal) = normal.try_normalize() else { return };
        // It moves out to any corner that rounding, or an end that is not in front of the other, leaves outside: so
        // it holds the hull whatever happened before.
        let offset =
            self.ends.iter().copied().flatten().map(|&corner| normal.dot(corner)).fold(f64::INFINITY, f64::min);
        let same = |plane: &Plane| {
            plane.normal.dot(normal) >= 1.0 - SAME_DIRECTION && (plane.offset - offset).abs() <= self.tolerance
        };
        if !self.planes.iter().any(same) {
            self.planes.push(Plane { normal, offset });
        }
    }

    /// What a convex planar polygon, of either winding, does to the shaft.
    ///
    /// What a polygon would hide only by lying in the plane of an end or of a side is nothing: it is clear.
    pub fn classify(&self, blocker: &[DVec3]) -> Occlusion {
        let low = blocker.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = blocker.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        if (high - self.low).min_element() <= self.tolerance || (self.high - low).min_element() <= self.tolerance {
            return Occlusion::Clear;
        }
        let outside = |plane: &Plane| blocker.iter().all(|&corner| plane.distance(corner) <= self.tolerance);
        if self.planes.iter().any(outside) {
            return Occlusion::Clear;
        }
        let across = Plane::through(blocker);
        let sides = self.ends.map(|end| {
            end.iter()
                .map(|&corner| across.distance(corner))
                .fold((0.0, 0.0), |(low, high), distance: f64| (f64::min(low, distance), f64::max(high, distance)))
        });
        let [(low_a, high_a), (low_b, high_b)] = sides;
        if across.normal == DVec3::ZERO
            || low_a.min(low_b) >= -self.tolerance
            || high_a.max(high_b) <= self.tolerance
            || !self.is_entered_by(blocker)
        {
            return Occlusion::Clear;
        }
        let divides = |low: f64, high: f64| low >= -self.tolerance && high <= self.tolerance;
        if (divides(low_a, high_b) || divides(low_b, high_a)) && self.is_covered_by(blocker, &across) {
            Occlusion::Total
        } else {
            Occlusion::Partial
        }
    }

    /// Whether a part of a blocker is left inside all planes.
    fn is_entered_by(&self, blocker: &[DVec3]) -> bool {
        let mut part = blocker.to_vec();
        let mut clipped = Vec::with_capacity(blocker.len() + self.planes.len());
        for plane in &self.planes {
            if part.iter().any(|&corner| plane.distance(corner) < -self.tolerance) {
                clipped.clear();
                clip_convex(&part, self.tolerance, |corner| plane.distance(corner), &mut clipped);
                std::mem::swap(&mut part, &mut clipped);
            }
            if part.iter().all(|&corner| plane.distance(corner) <= self.tolerance) {
                return false;
            }
        }
        true
    }

    /// Whether every segment from corner to corner, and so every segment between the ends, which lie on the two sides
    /// of the blocker's plane, passes through the blocker: a segment's point on the plane is a mean of the corners'
    /// points, with weights that are not negative.
    fn is_covered_by(&self, blocker: &[DVec3], across: &Plane) -> bool {
        let [a, b] = self.ends;
        a.iter().all(|&p| {
            b.iter().all(|&q| {
                let (from, to) = (across.distance(p).abs(), across.distance(q).abs());
                // A segment within the plane has no weight in any mean.
                from.max(to) <= self.tolerance
                    || contains(blocker, across.normal, p.lerp(q, from / (from + to)), self.tolerance)
            })
        })
    }
}

/// Whether a convex outline, counter-clockwise about `normal`, contains a point of its plane, to within a tolerance.
fn contains(outline: &[DVec3], normal: DVec3, point: DVec3, tolerance: f64) -> bool {
    outline.iter().enumerate().all(|(i, &from)| {
        let edge = outline[(i + 1) % outline.len()] - from;
        normal.cross(edge).dot(point - from) >= -tolerance * edge.length()
    })
}

/// The part of each of two outlines that lies in front of the other's plane; none where either has no such part.
pub fn facing_parts(
    a: &[DVec3],
    plane_a: &Plane,
    b: &[DVec3],
    plane_b: &Plane,
    tolerance: f64,
) -> Option<[Vec<DVec3>; 2]> {
    let (mut front_a, mut front_b) = (Vec::new(), Vec::new());
    clip_convex(a, tolerance, |p| plane_b.distance(p), &mut front_a);
    clip_convex(b, tolerance, |p| plane_a.distance(p), &mut front_b);
    (!front_a.is_empty() && !front_b.is_empty()).then_some([front_a, front_b])
}

/// Builds [`BlockerLists`]: equal lists get one id, in order of their first appearance; the empty list is 0.
#[derive(Clone, Debug)]
pub struct BlockerInterner {
    lists: BlockerLists,
    ids: HashMap<Box<[u32]>, u32>,
}

impl Default for BlockerInterner {
    fn default() -> Self {
        let lists = BlockerLists { lists: vec![(0, 0)], polygons: Vec::new() };
        Self { lists, ids: HashMap::from([(Box::default(), 0)]) }
    }
}

impl BlockerInterner {
    /// The id of a list of polygons, which ascend.
    pub fn intern(&mut self, list: &[u32]) -> u32 {
        debug_assert!(list.is_sorted());
        if let Some(&id) = self.ids.get(list) {
            return id;
        }
        let id = self.lists.lists.len() as u32;
        self.lists.lists.push((self.lists.polygons.len() as u32, list.len() as u32));
        self.lists.polygons.extend_from_slice(list);
        self.ids.insert(list.into(), id);
        id
    }

    /// The polygons of a list, ascending.
    pub fn get(&self, list: u32) -> &[u32] {
        self.lists.get(list)
    }

    /// All lists.
    pub fn into_lists(self) -> BlockerLists {
        self.lists
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn parallelogram(corner: DVec3, first: DVec3, second: DVec3) -> Vec<DVec3> {
        vec![corner, corner + first, corner + first + second, corner + second]
    }

    /// A square of the given half side about (x, y) at a height, its front up.
    fn square(x: f64, y: f64, half: f64, height: f64) -> Vec<DVec3> {
        parallelogram(v(x - half, y - half, height), DVec3::X * 2.0 * half, DVec3::Y * 2.0 * half)
    }

    fn reversed(mut outline: Vec<DVec3>) -> Vec<DVec3> {
        outline.reverse();
        outline
    }

    /// Classifies a blocker, in both windings and both orders of the ends.
    #[track_caller]
    fn classify(a: &[DVec3], b: &[DVec3], blocker: &[DVec3]) -> Occlusion {
        let answer = Shaft::between(a, b).classify(blocker);
        let turned = reversed(blocker.to_vec());
        for shaft in [Shaft::between(a, b), Shaft::between(b, a)] {
            assert_eq!(shaft.classify(blocker), answer);
            assert_eq!(shaft.classify(&turned), answer);
        }
        answer
    }

    #[test]
    fn degenerate_input_is_clear_or_partial() {
        let (a, b) = (square(0., 0., 1., 0.), reversed(square(0., 0., 1., 2.)));
        for blocker in [vec![], vec![DVec3::Z], vec![DVec3::Z; 4], vec![v(-2., 0., 1.), v(0., 0., 1.), v(2., 0., 1.)]] {
            assert_eq!(classify(&a, &b, &blocker), Occlusion::Clear);
        }
        let blocker = square(0., 0., 3., 1.);
        for end in [vec![], vec![DVec3::ZERO], vec![DVec3::ZERO; 4], vec![v(-1., 0., 0.), DVec3::ZERO, DVec3::X]] {
            assert_ne!(classify(&end, &b, &blocker), Occlusion::Partial);
            assert_ne!(classify(&end, &end, &blocker), Occlusion::Total);
        }
    }

    #[test]
    fn blockers_between_two_squares() {
        let (a, b) = (square(0., 0., 1., 0.), reversed(square(0., 0., 0.5, 2.)));
        let shaft = Shaft::between(&a, &b);
        // Two ends and four sides that both ends' edges share.
        assert_eq!(shaft.planes.len(), 6);
        // Half way up the shaft is 1.5 wide.
        for (blocker, answer) in [
            (square(0., 0., 0.76, 1.), Occlusion::Total),
            (square(0., 0., 0.75, 1.), Occlusion::Total),
            (square(0., 0., 0.74, 1.), Occlusion::Partial),
            (square(0., 0., 0.01, 1.), Occlusion::Partial),
            (square(1.0, 0., 0.26, 1.), Occlusion::Partial),
            (square(1.0, 0., 0.25, 1.), Occlusion::Clear),
            (square(1.0, 0., 0.24, 1.), Occlusion::Clear),
            (square(0., 0., 5.0, 2.1), Occlusion::Clear),
            (square(0., 0., 5.0, -0.1), Occlusion::Clear),
            // On the planes of the ends.
            (square(0., 0., 5.0, 0.), Occlusion::Clear),
            (square(0., 0., 0.2, 2.), Occlusion::Clear),
            // Upright: through all of it, in the plane of a side, along its outside.
            (parallelogram(v(0., -5., -1.), DVec3::Y * 10., DVec3::Z * 5.), Occlusion::Partial),
            (parallelogram(v(1., -1., 0.), DVec3::Y * 2., v(-0.5, 0., 2.)), Occlusion::Clear),
            (parallelogram(v(1., -5., 0.), DVec3::Y * 10., DVec3::Z * 5.), Occlusion::Clear),
            // Tilted, so that its box fills the shaft's, but beside the edge at the corner.
            (vec![v(1.5, 0.4, 1.), v(0.4, 1.5, 1.), v(1.5, 1.5, 1.)], Occlusion::Clear),
            (vec![v(1.5, -0.1, 1.), v(-0.1, 1.5, 1.), v(1.5, 1.5, 1.)], Occlusion::Partial),
        ] {
            assert_eq!(classify(&a, &b, &blocker), answer, "{blocker:?}");
        }
    }

    /// A wall that stands on the receiver's border hides nothing of what is on its side, and everything of what is
    /// beyond it and lower than its shadow.
    #[test]
    fn blockers_that_touch_the_ends() {
        let floor = square(0., 0., 1., 0.);
        let wall = parallelogram(v(1., -9., 0.), DVec3::Y * 18., DVec3::Z * 3.);
        assert_eq!(classify(&floor, &reversed(square(0., 0., 1., 2.)), &wall), Occlusion::Clear);
        let beyond = |low: f64| parallelogram(v(2., -1., low), DVec3::Z, DVec3::Y * 2.);
        // From the far border, 2 m away from the wall, to 1 m behind it: the ray grazes the wall's top at 3 m.
        assert_eq!(classify(&floor, &beyond(0.), &wall), Occlusion::Total);
        assert_eq!(classify(&floor, &beyond(2.0), &wall), Occlusion::Total);
        assert_eq!(classify(&floor, &beyond(3.6), &wall), Occlusion::Partial);
        // The same wall in the middle of the floor: its own foot sees both sides.
        let middle = parallelogram(v(0., -9., 0.), DVec3::Y * 18., DVec3::Z * 3.);
        assert_eq!(classify(&floor, &beyond(0.), &middle), Occlusion::Partial);
        // A wall that leaves a gap at its foot.
        let raised = parallelogram(v(1., -9., 0.01), DVec3::Y * 18., DVec3::Z * 3.);
        assert_eq!(classify(&floor, &beyond(0.), &raised), Occlusion::Partial);
        // Ends that share an edge: nothing fits between them but what reaches into the angle.
        let side = parallelogram(v(1., -1., 0.), DVec3::Z, DVec3::Y * 2.);
        assert_eq!(classify(&floor, &side, &wall), Occlusion::Clear);
        let shelf = parallelogram(v(0.5, -1., 0.2), DVec3::Y * 2., DVec3::X * 0.5);
        assert_eq!(classify(&floor, &side, &shelf), Occlusion::Partial);
        let above = parallelogram(v(-0.5, -1., 0.5), DVec3::Y * 2., DVec3::X * 0.5);
        assert_eq!(classify(&floor, &side, &above), Occlusion::Clear);
    }

    #[test]
    fn equal_lists_share_an_id() {
        let mut interner = BlockerInterner::default();
        assert_eq!(interner.intern(&[]), 0);
        let lists: [&[u32]; 5] = [&[3, 7], &[3], &[3, 7], &[], &[7]];
        assert_eq!(lists.map(|list| interner.intern(list)), [1, 2, 1, 0, 3]);
        assert_eq!(interner.get(1), [3, 7]);
        let lists = interner.into_lists();
        assert_eq!((lists.lists.len(), lists.polygons.len()), (4, 4));
        assert_eq!((lists.get(0), lists.get(2), lists.get(3)), (&[][..], &[3][..], &[7][..]));
    }

    fn corner() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array)
    }

    /// Two triangles, each clipped to the front of the other; none if they do not face each other.
    fn facing(a: [DVec3; 3], b: [DVec3; 3]) -> Option<[Vec<DVec3>; 2]> {
        let front = |of: &[DVec3], other: &[DVec3]| {
            let (plane, mut part) = (Plane::through(other), Vec::new());
            clip_convex(of, 1e-9, |corner| plane.distance(corner), &mut part);
            (!part.is_empty()).then_some(part)
        };
        Some([front(&a, &b)?, front(&b, &a)?])
    }

    /// A point of a convex outline, from two numbers in 0..1.
    fn point_in(outline: &[DVec3], i: usize, s: f64, t: f64) -> DVec3 {
        let fan = 1 + i % (outline.len() - 2);
        let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        outline[0] * (1.0 - s - t) + outline[fan] * s + outline[fan + 1] * t
    }

    /// How deep within the blocker's border a segment between its two sides passes, metres; negative if it misses.
    fn depth(blocker: &[DVec3], from: DVec3, to: DVec3) -> f64 {
        let plane = Plane::through(blocker);
        let (start, end) = (plane.distance(from), plane.distance(to));
        if start * end >= 0.0 {
            return -1.0;
        }
        let point = from.lerp(to, start / (start - end));
        let inward = |i: usize| {
            let edge = blocker[(i + 1) % blocker.len()] - blocker[i];
            plane.normal.cross(edge).normalize().dot(point - blocker[i])
        };
        (0..blocker.len()).map(inward).fold(f64::INFINITY, f64::min)
    }

    /// Least depth, metres, to which the hull of some points and a polygon overlap along any axis that can separate
    /// them: across two directions between their corners. Negative if one does.
    fn smallest_overlap(hull: &[DVec3], polygon: &[DVec3]) -> f64 {
        let directions = |points: &[DVec3]| -> Vec<DVec3> {
            (0..points.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| points[i] - points[j]).collect()
        };
        let all = [directions(hull), directions(polygon)].concat();
        let range = |points: &[DVec3], axis: DVec3| {
            points
                .iter()
                .map(|&point| axis.dot(point))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let mut least = f64::INFINITY;
        for first in &all {
            for second in &all {
                let Some(axis) = first.cross(*second).try_normalize() else { continue };
                let ((low, high), (polygon_low, polygon_high)) = (range(hull, axis), range(polygon, axis));
                least = least.min((high - polygon_low).min(polygon_high - low));
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Clear is never said of a blocker that a segment hits, total never of one that a segment misses. And both are
        /// said whenever they hold: where a plane separates the blocker from the ends, and where the segments between
        /// corners all hit it.
        #[test]
        fn answers_are_safe_and_tight(
            a in [corner(), corner(), corner()], b in [corner(), corner(), corner()],
            middle in corner(), first in corner(), second in corner(), scale in 0.01..6.0,
            samples in proptest::collection::vec((0usize..8, [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0]), 64),
        ) {
            let Some([a, b]) = facing(a, b) else { return Ok(()) };
            let blocker = parallelogram(middle - (first + second) * scale / 2.0, first * scale, second * scale);
            let answer = Shaft::between(&a, &b).classify(&blocker);
            for (i, [s, t, p, q]) in samples {
                let depth = depth(&blocker, point_in(&a, i, s, t), point_in(&b, i / 2, p, q));
                match answer {
                    Occlusion::Clear => prop_assert!(depth < 1e-8),
                    Occlusion::Partial => {}
                    Occlusion::Total => prop_assert!(depth > -1e-8),
                }
            }
            let overlap = smallest_overlap(&[&a[..], &b].concat(), &blocker);
            if overlap.abs() > 1e-7 {
                prop_assert_eq!(answer == Occlusion::Clear, overlap < 0.0);
            }
            let shallowest =
                a.iter().flat_map(|&p| b.iter().map(move |&q| (p, q))).map(|(p, q)| depth(&blocker, p, q)).fold(1.0, f64::min);
            if shallowest.abs() > 1e-7 {
                prop_assert_eq!(answer == Occlusion::Total, shallowest > 0.0);
            }
        }
    }
}
