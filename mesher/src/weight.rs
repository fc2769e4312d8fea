//! The weight of a discontinuity: how strong it is on its receiver. Two measures, of which a bake takes one.
//! [`Weight::Change`] is the default: at equal numbers of triangles, chosen by w_min, the office's error is smaller by 4 to
//! 25 % in direct light and by 13 to 60 % in all light; the Cornell box has so few lines that it hardly matters, but with
//! one line a leaf its error is half. It is behind only where w_min discards most of what matters, and then both are
//! little better than no lines at all (data/record/2026-11-24-discontinuities.md).
//!
//! [`Weight::Ratio`] (Hardt & Teller 1996, section 4.2) is w = max(d_sb / d_br) · B_src, W·m⁻²: the distance from source
//! to blocker over that from blocker to receiver is how fast the blocker's edge seems to sweep across the source when the
//! receiver's point moves, and B_src is how much light it covers. We write d_br where the paper's text has d_sr, as its
//! formula does. A horizon line has no blocker. It is given the weight of the swath across which irradiance would change
//! as fast: an edge that sweeps across a source of area A at distance d, with both surfaces facing each other, uncovers
//! w / B · √A m² per metre, which changes irradiance by w √A / (π d²) per metre. So a horizon line across which the
//! derivative of irradiance jumps by g W·m⁻² per metre weighs w = g · π d² / √A.
//!
//! [`Weight::Change`] (section 7.1) is the largest change of irradiance per metre on the receiver that the sweep can
//! cause, W·m⁻³. A horizon line weighs the jump itself, g: swaths and horizons compete in one unit. For a swath, let the
//! point move a distance ε across its line. With α the angle between the planes of swath and receiver, it leaves the
//! swath's plane by ε sin α, and the grazed edge (for EV, the vertex and the edges at it) turns by ε sin α / d_br about
//! the point while the source behind it turns by ε sin α / d_sr. So the border between what is lit and what is hidden
//! moves over the source by the angle
//!
//! ε sin α (1 / d_br − 1 / d_sr) = ε sin α · d_sb / (d_br d_sr).
//!
//! What it sweeps over is a strip along the swath's plane, whose form factor is 1/π times the angle of its width times
//! ∫ cos θ dφ over its length, θ from the receiver's normal. That integral has a closed form ([`cosine_arc`]). So
//!
//! w = B_src / π · max(sin α · d_sb / (d_br d_sr) · ∫ cos θ dφ).
//!
//! At the line itself the strip has no length: a corner begins to be covered, and only the second derivative jumps,
//! unless edges are parallel. The bound is over the penumbra that the line begins, so the strip is as long as it may
//! become there: the longest chord of the source parallel to the swath's plane, or what the blocker can cover of it,
//! whichever looks the shorter.

use std::f64::consts::PI;

use glam::DVec3;
use scene::{LineKind, Scene, luminance};
use solver::Solution;

use crate::critical_surface::{Apex, GrazingRay, Pencil, edges};
use crate::discontinuity::Discontinuity;
use crate::facet::Facet;
use crate::horizon::Horizon;

/// Least distance from blocker to receiver that a ratio counts with, as a fraction of the diameter of the leaf (of the
/// receiver, for the weight of a whole line). At a contact the distance is 0 and every weight would be infinite. Larger
/// lets strong distant shadows win over the contact shadows of dim sources; smaller lets contacts displace everything.
const CONTACT_FLOOR: f64 = 0.01;

/// Least width of a penumbra that a change counts with, as a fraction of the diameter of the leaf: the same light changes
/// over that length at least. A leaf's interpolants cannot tell a narrower penumbra from a step, however fast light
/// changes in it. With a tenth of it, contacts and narrow shadows displaced wide ones that were worth more.
const PENUMBRA_FLOOR: f64 = 0.1;

/// The same for a whole line, as a fraction of the diameter of the receiver, which is some ten leaves across. With ten
/// times as much, lines that matter in small leaves were discarded.
const LINE_PENUMBRA_FLOOR: f64 = 0.01;

/// w_min of [`Weight::Ratio`] as a fraction of the luminance of the brightest emitter's radiosity where none is asked
/// for. Three times as much costs the office a third more error; a third of it a third more triangles, and gains next to
/// nothing.
const RATIO_MINIMUM: f64 = 0.4;

/// What light must change by across a leaf, in tolerances of the scene's mean irradiance, for a line that it follows. A
/// quadratic is off by a sixteenth of that where light bends. A sixth of it makes a twentieth more triangles, and mends nothing.
const LEAST_CHANGE: f64 = 48.0;

/// w_min of [`Weight::Change`] where none is asked for, in mean irradiances of the scene per size of the scene: so bright a
/// change moves irradiance by its mean over an eighth of the scene. Eight times as much costs the office's direct light two
/// thirds more error; half as much gains nothing.
const CHANGE_MINIMUM: f64 = 8.0;

/// Corners as level as this, relative to their distance from the origin, lie on one chord.
const LEVEL: f64 = 1e-12;

/// A measure of how strong a discontinuity is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// Ratio of distances times the source's radiosity, W·m⁻² (Hardt & Teller 1996, section 4.2).
    Ratio,
    /// Bound on the change of irradiance per metre, W·m⁻³ (section 7.1).
    #[default]
    Change,
}

impl Weight {
    /// Its name, as options and provenance have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ratio => "ratio",
            Self::Change => "change",
        }
    }

    /// The least weight that is followed where none is asked for.
    pub fn default_minimum(self, scene: &Scene, solution: &Solution) -> f64 {
        let brightest = || scene.emitters().map(|e| luminance(scene.material(e).exitance())).fold(0.0, f64::max);
        match self {
            Self::Ratio => RATIO_MINIMUM * brightest(),
            Self::Change if scene.size() > 0.0 => CHANGE_MINIMUM * luminance(solution.mean_irradiance) / scene.size(),
            Self::Change => 0.0,
        }
    }

    /// The same for a leaf of a given diameter, metres, that alone is looked over for lines.
    pub(crate) fn minimum_in_leaf(self, scene: &Scene, solution: &Solution, tolerance: f64, diameter: f64) -> f64 {
        match self {
            Self::Ratio => self.default_minimum(scene, solution),
            Self::Change => LEAST_CHANGE * tolerance * luminance(solution.mean_irradiance) / diameter,
        }
    }

    /// The shortest length that counts in a leaf of a given diameter, metres.
    pub(crate) fn floor_in_leaf(self, diameter: f64) -> f64 {
        match self {
            Self::Ratio => CONTACT_FLOOR * diameter,
            Self::Change => PENUMBRA_FLOOR * diameter,
        }
    }

    /// The shortest length that counts for a whole line on a receiver of a given diameter, metres.
    pub(crate) fn floor_on_receiver(self, diameter: f64) -> f64 {
        match self {
            Self::Ratio => CONTACT_FLOOR * diameter,
            Self::Change => LINE_PENUMBRA_FLOOR * diameter,
        }
    }

    /// Upper bound, per unit radiosity, of the weight of every swath between a source and a blocker.
    pub(crate) fn bound(self, source: &Facet, blocker: &Facet, floor: f64) -> f64 {
        let (near, far) = (blocker.clearance, source.clearance);
        match self {
            Self::Ratio => (source.centre.distance(blocker.centre) + source.radius + blocker.radius) / near.max(floor),
            // d_sb / d_sr is at most 1; the cosine's integral at most 2, and no more than what either arc may be.
            Self::Change => {
                let turn = near.recip().min(2.0 * source.radius / (floor * far));
                turn * 2f64.min(2.0 * source.radius / far).min(2.0 * blocker.radius / near) / PI
            }
        }
    }

    /// The weight of a swath over the part of its line between two parameters.
    pub(crate) fn of_swath(self, line: &Discontinuity, normal: DVec3, part: [f64; 2], floor: f64) -> f64 {
        let at = |t: f64| line.ends[0].lerp(line.ends[1], t);
        let largest = |places: &[f64], weight: &dyn Fn(GrazingRay, DVec3) -> f64| {
            let weights = places.iter().map(|&t| weight(ray_between(line, t), at(t)));
            line.radiosity * weights.fold(0.0, f64::max)
        };
        match self {
            // The ratio of distances is that of heights over the receiver, of which one is constant and the other linear
            // in the ray's parameter: it is largest at one of the ends (but for the floor).
            Self::Ratio => largest(&part, &|ray, point| ray.ratio(point, floor)),
            // Light falls off to both sides of the place that is nearest to the source.
            Self::Change => {
                let along = line.ends[1] - line.ends[0];
                let middle = (line.sweep.chord[0] + line.sweep.chord[1]) / 2.0;
                let nearest = (middle - line.ends[0]).dot(along) / along.length_squared();
                let places = [part[0], nearest.max(part[0]).min(part[1]), part[1]];
                largest(&places, &|ray, point| line.sweep.change(ray, point, normal, floor))
            }
        }
    }

    /// The weight per unit radiosity of a horizon line between two of its points.
    pub(crate) fn of_horizon(self, horizon: &Horizon, ends: [DVec3; 2], floor: f64) -> f64 {
        match self {
            Self::Ratio => horizon.equivalent_ratio(ends, floor),
            Self::Change => horizon.steepest(ends, floor),
        }
    }
}

impl GrazingRay {
    /// d_sb / d_br on the way to a point.
    fn ratio(self, point: DVec3, floor: f64) -> f64 {
        self.source.distance(self.blocker) / self.blocker.distance(point).max(floor)
    }
}

/// What the light and shadow of a swath can sweep over when the receiver's point moves across its line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Longest chord of the source parallel to the swath's plane, metres; of the part in front of the receiver.
    pub chord: [DVec3; 2],
    /// Longest that the blocker's edge can be, metres: the grazed edge, or for a vertex the diameter of its polygon.
    pub edge: f64,
    /// Width of the source across the chord, metres.
    pub width: f64,
    /// Sine of the angle between the planes of swath and receiver.
    pub sine: f64,
}

impl Sweep {
    /// The sweep of a pencil. `outline` is the source, in front of the receiver; `blocker` the diameter of the polygon
    /// that is grazed. Without length where the swath's plane is the source's.
    pub(crate) fn new(pencil: &Pencil, outline: &[DVec3], source: DVec3, receiver: DVec3, blocker: f64) -> Self {
        let [from, to] = pencil.edge.map(|end| end - pencil.apex);
        let normal = from.cross(to).normalize_or_zero();
        let direction = normal.cross(source).normalize_or_zero();
        let edge = match pencil.at {
            Apex::Source => from.distance(to),
            Apex::Blocker => blocker,
        };
        let across = source.cross(direction);
        let places = outline.iter().map(|corner| across.dot(*corner));
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high): (f64, f64), place| {
            (low.min(place), high.max(place))
        });
        Self {
            chord: longest_chord(outline, direction, source),
            edge,
            width: (high - low).max(0.0),
            sine: normal.cross(receiver).length(),
        }
    }

    /// Change of irradiance per metre and unit radiosity, m⁻¹, at a point of the swath's line.
    fn change(&self, ray: GrazingRay, point: DVec3, normal: DVec3, floor: f64) -> f64 {
        let (to_source, between) = (ray.source.distance(point), ray.source.distance(ray.blocker));
        // The penumbra's width is about the source's, seen through the blocker's edge.
        let to_blocker = ray.blocker.distance(point).max(floor * between / self.width);
        let arc = cosine_arc(self.chord.map(|end| end - point), normal).min(self.edge / to_blocker);
        self.sine * between / (to_blocker * to_source) * arc / PI
    }
}

/// ∫ cos θ dφ over the arc that a segment covers on the sphere around the origin, θ from the normal: for the unit vectors
/// u and v to its ends and the normal m of their plane, it is **n** · ((u − v) × m).
fn cosine_arc(segment: [DVec3; 2], normal: DVec3) -> f64 {
    let [from, to] = segment.map(DVec3::normalize_or_zero);
    normal.dot((from - to).cross(from.cross(to).normalize_or_zero())).abs()
}

/// The longest chord of a convex outline in a direction of its plane. Lengths of parallel chords are a concave function of
/// where they cross the outline, linear between its corners: the longest passes through one.
fn longest_chord(outline: &[DVec3], direction: DVec3, normal: DVec3) -> [DVec3; 2] {
    let across = normal.cross(direction);
    let mut longest = [DVec3::ZERO; 2];
    for corner in outline {
        let level = across.dot(*corner);
        let (mut low, mut high) = (*corner, *corner);
        for [from, to] in edges(outline) {
            let (a, b) = (across.dot(from) - level, across.dot(to) - level);
            if a * b < 0.0 {
                let crossing = from.lerp(to, a / (a - b));
                let place = direction.dot(crossing);
                low = if place < direction.dot(low) { crossing } else { low };
                high = if place > direction.dot(high) { crossing } else { high };
            } else if a.abs() <= LEVEL * from.length() {
                low = if direction.dot(from) < direction.dot(low) { from } else { low };
                high = if direction.dot(from) > direction.dot(high) { from } else { high };
            }
        }
        if low.distance_squared(high) > longest[0].distance_squared(longest[1]) {
            longest = [low, high];
        }
    }
    longest
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use scene::HalfEdges;
    use solver::Interaction;

    use super::*;
    use crate::discontinuities;
    use crate::discontinuity::tests::{rectangle, welded};

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn the_longest_chord_of_a_pentagon() {
        let outline = [v(0., 0., 1.), v(2., 0., 1.), v(3., 1., 1.), v(1., 3., 1.), v(0., 1., 1.)];
        let chord = longest_chord(&outline, DVec3::X, DVec3::Z);
        assert!(chord[0].distance(v(0., 1., 1.)) < 1e-12 && chord[1].distance(v(3., 1., 1.)) < 1e-12, "{chord:?}");
        assert_eq!(longest_chord(&outline, DVec3::ZERO, DVec3::Z).map(|end| end.z).len(), 2);
        let side = longest_chord(&rectangle((-1.0, -2.0), (1.0, 2.0), 3.0, true), DVec3::Y, -DVec3::Z);
        assert!((side[0].distance(side[1]) - 4.0).abs() < 1e-12);
        assert_eq!(longest_chord(&[], DVec3::X, DVec3::Z), [DVec3::ZERO; 2]);
    }

    #[test]
    fn arcs_by_hand() {
        // A quarter turn from the horizon to the zenith, and one along the horizon.
        assert!((cosine_arc([DVec3::X, 3.0 * DVec3::Z], DVec3::Z) - 1.0).abs() < 1e-12);
        assert!(cosine_arc([DVec3::X, DVec3::Y], DVec3::Z).abs() < 1e-12);
        assert_eq!(cosine_arc([DVec3::ZERO; 2], DVec3::Z), 0.0);
    }

    /// Irradiance of the plane z = 0 by Lambert's formula, per unit radiosity.
    fn irradiance(point: DVec3, outline: &[DVec3]) -> f64 {
        let sum: f64 = edges(outline)
            .map(|[from, to]| {
                let (from, to) = ((from - point).normalize(), (to - point).normalize());
                let normal = from.cross(to);
                normal.z / normal.length() * normal.length().atan2(from.dot(to)) / (2.0 * PI)
            })
            .sum();
        sum.abs()
    }

    /// A long plate, half-way between a small lamp and the floor, whose straight edge is parallel to the lamp's: the
    /// change across the penumbra is nearly constant, and has a closed form.
    #[test]
    fn the_change_is_that_of_irradiance_across_a_straight_penumbra() {
        for (lift, drift) in [(0.5, 0.0), (0.3, 0.0), (0.5, 0.6)] {
            let (height, half) = (2.0, 0.05);
            let lamp = rectangle((drift - half, -half), (drift + half, half), height, true);
            let plate = rectangle((0.0, -4.0), (5.0, 4.0), lift * height, false);
            let scene = welded(&[rectangle((-1.5, -0.5), (1.5, 0.5), 0.0, false), lamp, plate]);
            let interaction = Interaction { source: 1, far_outline: None, radiosity: 7.0, blockers: vec![2] };
            let half_edges = HalfEdges::new(&scene);
            let found = discontinuities(&scene, &half_edges, 0, &[interaction], Weight::Change, 0.0);
            assert!(!found.is_empty());
            // What is seen of the lamp from (x, 0) is left of the line from the point over the plate's edge.
            let light = |x: f64| {
                let end = (x - x / lift).clamp(drift - half, drift + half);
                7.0 * irradiance(v(x, 0.0, 0.0), &rectangle((drift - half, -half), (end, half), height, true))
            };
            let step = 1e-5;
            let steepest = (-30_000..30_000)
                .map(|i| f64::from(i) * 5e-5)
                .filter(|x| {
                    let end = x - x / lift;
                    end > drift - half + step && end < drift + half - step
                })
                .map(|x| ((light(x + step) - light(x - step)) / (2.0 * step)).abs())
                .fold(0.0, f64::max);
            let weight = found.iter().map(|line| line.weight).fold(0.0, f64::max);
            assert!((weight / steepest - 1.0).abs() < 0.03, "{weight} {steepest}");

            // In a leaf so large that the penumbra is a fifth of what it resolves, the change is a fifth.
            let penumbra = 2.0 * half * lift / (1.0 - lift);
            let resolved = found[0].sweep.change(found[0].rays[0], found[0].ends[0], DVec3::Z, 0.0);
            let coarse = found[0].sweep.change(found[0].rays[0], found[0].ends[0], DVec3::Z, 5.0 * penumbra);
            assert!((coarse / resolved - 0.2).abs() < 1e-9, "{coarse} {resolved}");
        }
    }
}
