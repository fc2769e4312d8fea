//! Ranking of discontinuities by strength (Hardt & Teller 1996, section 4.2): the choice of the strongest in a leaf.
//! What strength is, [`Weight`] says.

use glam::DVec3;
use scene::{LineKind, Scene};

use crate::critical_surface::{Receiver, diameter};
use crate::discontinuity::Discontinuity;
use crate::horizon::Horizon;
use crate::weight::Weight;

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
    /// Weight over the part inside the leaf, W·m⁻² or W·m⁻³ as the measure has it.
    pub weight: f64,
}

/// The `count` strongest discontinuities inside a leaf, of those that `candidates` name by their index, strongest first, ties by
/// index.
///
/// `leaf` is a convex outline in the plane of the receiver of `discontinuities`, counter-clockwise from the front. The
/// weights are those of the parts inside the leaf. Lines along the leaf's border divide nothing and are left out.
/// Segments that overlap on one line are joined; pieces of one event that are apart count as one of the `count`.
pub fn rank(
    scene: &Scene,
    leaf: &[DVec3],
    discontinuities: &[Discontinuity],
    candidates: impl IntoIterator<Item = u32>,
    measure: Weight,
    count: usize,
) -> Vec<RankedLine> {
    let leaf_diameter = diameter(leaf);
    let Some(leaf) = Receiver::new(leaf, SAME_LINE * leaf_diameter) else { return Vec::new() };
    let inside = |index: u32| {
        let discontinuity = &discontinuities[index as usize];
        let part = leaf.clip(discontinuity.ends)?;
        let ends = part.map(|t| discontinuity.ends[0].lerp(discontinuity.ends[1], t));
        if ends[0].distance(ends[1]) <= SAME_LINE * leaf_diameter || leaf.is_on_border(ends) {
            return None;
        }
        let floor = measure.floor_in_leaf(leaf_diameter);
        let weight = match discontinuity.kind {
            LineKind::Horizon => horizon_weight(scene, discontinuity, measure, ends, floor),
            _ => measure.of_swath(discontinuity, leaf.plane.normal, part, floor),
        };
        Some(RankedLine { discontinuity: index, ends, weight })
    };
    let mut lines: Vec<RankedLine> = candidates.into_iter().filter_map(inside).collect();
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

/// The weight over a part of a horizon line, given by its ends.
fn horizon_weight(scene: &Scene, line: &Discontinuity, measure: Weight, ends: [DVec3; 2], floor: f64) -> f64 {
    let (source, receiver) = (scene.plane(line.source), scene.plane(line.receiver));
    let horizon = Horizon::new(&scene.outline(line.source), &source, &receiver);
    horizon.map_or(0.0, |horizon| line.radiosity * measure.of_horizon(&horizon, ends, floor))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use scene::HalfEdges;
    use solver::Interaction;

    use super::*;
    use crate::critical_surface::GrazingRay;
    use crate::discontinuity::discontinuities;
    use crate::discontinuity::tests::{rectangle, welded};
    use crate::weight::{Sweep, ray_between};

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
            sweep: Sweep::default(),
            radiosity,
            weight: 1.0,
        }
    }

    fn leaf() -> Vec<DVec3> {
        rectangle((0.0, 0.0), (1.0, 1.0), 0.0, false)
    }

    fn ranked(leaf: &[DVec3], lines: &[Discontinuity], count: usize) -> Vec<RankedLine> {
        rank(&Scene::default(), leaf, lines, 0..lines.len() as u32, Weight::Ratio, count)
    }

    fn chosen(lines: &[Discontinuity], count: usize) -> Vec<RankedLine> {
        ranked(&leaf(), lines, count)
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
        assert!(ranked(&[], &lines, 10).is_empty());
        assert!(ranked(&[DVec3::ZERO; 4], &lines, 10).is_empty());
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
        let weight = ranked(&at_foot, &[post], 1)[0].weight;
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

    #[test]
    fn a_dim_distant_horizon_ranks_below_a_shadow() {
        let wall = vec![v(0.0, 0.3, 0.0), v(0.0, 0.3, 0.4), v(0.0, 0.7, 0.4), v(0.0, 0.7, 0.0)];
        let wall: Vec<DVec3> = wall.into_iter().map(|corner| corner + v(0.5, 0.0, 3.0)).collect();
        let light = rectangle((0.2, 0.2), (0.4, 0.4), 2.0, true);
        let scene = welded(&[leaf(), light, rectangle((0.4, 0.4), (0.6, 0.6), 0.5, false), wall]);
        let interactions = [
            Interaction { source: 1, far_outline: None, radiosity: 30.0, blockers: vec![2] },
            Interaction { source: 3, far_outline: None, radiosity: 1.0, blockers: vec![] },
        ];
        let lines = discontinuities(&scene, &HalfEdges::new(&scene), 0, &interactions, Weight::Ratio, 0.0);
        let kept = rank(&scene, &leaf(), &lines, 0..lines.len() as u32, Weight::Ratio, 100);
        let horizons: Vec<&RankedLine> =
            kept.iter().filter(|line| lines[line.discontinuity as usize].kind == LineKind::Horizon).collect();
        assert_eq!(horizons.len(), 1);
        assert!(horizons[0].weight < 0.2 && horizons[0].weight > 0.05);
        let of_light = kept.iter().filter(|line| lines[line.discontinuity as usize].source == 1);
        assert!(of_light.map(|line| line.weight).fold(f64::INFINITY, f64::min) > 10.0);
    }
}
