//! Critical surfaces: the swaths of light rays along which a source begins to be hidden (Hardt & Teller 1996, 4.1).
//!
//! A swath is the part of a plane that a pencil of rays sweeps: rays through one point, the apex, and the points of an
//! edge. A VE swath has a vertex of the source for its apex and an edge of the blocker; an EV swath has a vertex of the
//! blocker for its apex and an edge of the source. A ray is named by its parameter u along the edge, in 0..=1. All that
//! bounds a swath bounds u: before the perspective division every condition is linear in u, so that swaths which run to
//! infinity need no special case.
//!
//! Surfaces that three edges make (EEE) are left out, as in the paper, and so are those that blockers make among
//! themselves.

use glam::DVec3;
use scene::Plane;

use crate::interval::{Interval, clip};

/// Which feature all rays of a pencil go through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Apex {
    /// A vertex of the source (VE and horizon).
    Source,
    /// A vertex of the blocker (EV).
    Blocker,
}

/// A ray of a swath: the point of the source that it leaves, and the point of the blocker that it grazes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrazingRay {
    /// Point of the source, metres.
    pub source: DVec3,
    /// Point of the blocker, metres.
    pub blocker: DVec3,
}

/// The polygon that swaths are followed to.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    pub(crate) plane: Plane,
    /// Planes through the sides, across the polygon's plane, inside in front.
    sides: Vec<Plane>,
    /// Largest distance between two corners, metres.
    pub(crate) diameter: f64,
    /// Length below which two points are one, metres.
    tolerance: f64,
}

impl Receiver {
    /// None for an outline without area.
    pub(crate) fn new(outline: &[DVec3], tolerance: f64) -> Option<Self> {
        let plane = Plane::through(outline);
        let sides = edges(outline).filter_map(|[from, to]| {
            let normal = plane.normal.cross(to - from).try_normalize()?;
            Some(Plane { normal, offset: normal.dot(from) })
        });
        let diameter = diameter(outline);
        let has_area = plane.normal != DVec3::ZERO && diameter > tolerance;
        has_area.then(|| Self { plane, sides: sides.collect(), diameter, tolerance })
    }

    /// Whether a segment of the plane runs along the outline, where it divides nothing.
    pub(crate) fn is_on_border(&self, ends: [DVec3; 2]) -> bool {
        self.sides.iter().any(|side| ends.iter().all(|&end| side.distance(end).abs() <= self.tolerance))
    }

    /// The part of a segment of the plane that lies inside the outline.
    pub(crate) fn clip(&self, [from, to]: [DVec3; 2]) -> Option<Interval> {
        let mut inside = [0.0, 1.0];
        let meets = self.sides.iter().all(|side| clip(&mut inside, side.distance(from), side.distance(to)));
        meets.then_some(inside)
    }
}

/// Largest distance between two corners of an outline.
pub(crate) fn diameter(outline: &[DVec3]) -> f64 {
    let distances = outline.iter().flat_map(|a| outline.iter().map(|b| a.distance_squared(*b)));
    distances.fold(0.0, f64::max).sqrt()
}

/// The edges around an outline.
pub(crate) fn edges(outline: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> {
    outline.iter().zip(outline.iter().cycle().skip(1)).map(|(&from, &to)| [from, to])
}

/// Rays through an apex and the points of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pencil {
    pub(crate) apex: DVec3,
    pub(crate) edge: [DVec3; 2],
    pub(crate) at: Apex,
}

impl Pencil {
    fn on_edge(&self, u: f64) -> DVec3 {
        self.edge[0].lerp(self.edge[1], u)
    }

    /// The ray with parameter u.
    pub(crate) fn ray(&self, u: f64) -> GrazingRay {
        match self.at {
            Apex::Source => GrazingRay { source: self.apex, blocker: self.on_edge(u) },
            Apex::Blocker => GrazingRay { source: self.on_edge(u), blocker: self.apex },
        }
    }

    /// The rays that leave the front of the source, pass the blocker above the receiver and meet the receiver.
    pub(crate) fn landing(&self, source: &Plane, receiver: &Receiver) -> Option<Interval> {
        let tolerance = receiver.tolerance;
        let height = |point| receiver.plane.distance(point);
        let (apex, [from, to]) = (height(self.apex), self.edge.map(height));
        if apex <= tolerance {
            return None;
        }
        let mut rays = [0.0, 1.0];
        match self.at {
            Apex::Source => {
                let front = self.edge.map(|point| source.distance(point));
                if from.max(to) <= tolerance || front[0].max(front[1]) <= tolerance {
                    return None;
                }
                (clip(&mut rays, from, to) && clip(&mut rays, front[0], front[1])).then_some(())?;
            }
            Apex::Blocker => (source.distance(self.apex) > tolerance).then_some(())?,
        }
        // A ray meets the plane at apex + τ (edge point − apex), τ = h_apex / (h_apex − h_edge): beyond the edge from a
        // source's vertex, where the divisor is positive; beyond the apex from a source's edge, where it is negative.
        let sign = if self.at == Apex::Source { 1.0 } else { -1.0 };
        clip(&mut rays, sign * (apex - from), sign * (apex - to)).then_some(())?;
        for side in &receiver.sides {
            let [s, a, b] = [self.apex, self.edge[0], self.edge[1]].map(|point| side.distance(point));
            clip(&mut rays, sign * (apex * a - from * s), sign * (apex * b - to * s)).then_some(())?;
        }
        Some(rays)
    }

    /// Where the ray with parameter u, one of [`Pencil::landing`], meets the receiver's plane.
    pub(crate) fn point(&self, u: f64, plane: &Plane) -> DVec3 {
        let through = self.on_edge(u);
        let (apex, edge) = (plane.distance(self.apex), plane.distance(through));
        let point = (through * apex - self.apex * edge) / (apex - edge);
        point - plane.normal * plane.distance(point)
    }
}

/// A pencil in its plane: what lies in the plane has two coordinates, (α, β) at apex + α (from − apex) + β (to − apex),
/// where `from` and `to` are the ends of the edge. So u = β / (α + β), and α + β is 0 at the apex and 1 on the edge.
#[derive(Clone, Debug)]
pub(crate) struct Swath {
    pub(crate) pencil: Pencil,
    pub(crate) plane: Plane,
    dual: [DVec3; 2],
}

impl Swath {
    /// None where the apex lies on the line of the edge, up to a rounding `tolerance` in metres.
    pub(crate) fn new(pencil: Pencil, tolerance: f64) -> Option<Self> {
        let [from, to] = pencil.edge.map(|point| point - pencil.apex);
        let across = from.cross(to);
        if across.length() <= tolerance * from.distance(to).max(from.length()).max(to.length()) {
            return None;
        }
        let normal = across.normalize();
        let dual = [to.cross(across), across.cross(from)].map(|direction| direction / across.length_squared());
        Some(Self { pencil, plane: Plane { normal, offset: normal.dot(pencil.apex) }, dual })
    }

    /// The rays that a segment of the swath's plane stops between the source and the receiver: for a vertex of the
    /// blocker, those that it stops before and those that it stops behind the vertex. The segment's line must not pass
    /// through the apex.
    pub(crate) fn stopped(&self, segment: [DVec3; 2], receiver: &Receiver) -> [Option<Interval>; 2] {
        let heights = segment.map(|point| receiver.plane.distance(point));
        if heights[0].max(heights[1]) <= receiver.tolerance {
            return [None; 2];
        }
        let [a, b] = segment.map(|point| {
            let offset = point - self.pencil.apex;
            self.dual.map(|dual| dual.dot(offset))
        });
        let within = |sign: f64| {
            let mut part = [0.0, 1.0];
            let mut keep = |at_a: f64, at_b: f64| clip(&mut part, at_a, at_b).then_some(());
            keep(sign * a[0], sign * b[0])?;
            keep(sign * a[1], sign * b[1])?;
            keep(heights[0], heights[1])?;
            if self.pencil.at == Apex::Blocker {
                // The source is on the edge.
                keep(1.0 - a[0] - a[1], 1.0 - b[0] - b[1])?;
            }
            let u = |t: f64| {
                let (alpha, beta) = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]));
                beta / (alpha + beta)
            };
            let (first, last) = (u(part[0]), u(part[1]));
            Some([first.min(last), first.max(last)])
        };
        match self.pencil.at {
            Apex::Source => [within(1.0), None],
            Apex::Blocker => [within(1.0), within(-1.0)],
        }
    }
}
