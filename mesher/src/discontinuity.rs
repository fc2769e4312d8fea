//! The discontinuities of irradiance on a receiver (Hardt & Teller 1996, section 4.1): horizon lines, and the EV and VE
//! swaths between its sources and their blockers.
//!
//! Only actual discontinuities are reported. A swath ends where it leaves the receiver, and everything that stands in
//! it casts a gap; what is left of one event may be several segments.
//!
//! What we do differently: sources are whole polygons, not the links' elements, so that a line does not depend on how
//! far the solver divided its source; and a bound on the weight is tested before a swath is built.

use std::collections::HashSet;

use glam::DVec3;
use scene::{HalfEdges, LineKind, Plane, Scene};
use solver::Interaction;

use crate::critical_surface::{Apex, GrazingRay, Pencil, Receiver, Swath, edges};
use crate::facet::Facets;
use crate::horizon::{Horizon, in_front};
use crate::interval::{Interval, Intervals, clip};
use crate::weight::{Sweep, Weight};

/// A line on a receiver across which a derivative of irradiance jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discontinuity {
    /// The event that makes it.
    pub kind: LineKind,
    /// Receiving polygon.
    pub receiver: u32,
    /// Source: a polygon, or what [`Interaction::source`] has for others.
    pub source: u32,
    /// Polygon whose edge or vertex is grazed, that of smaller id where two share it; the source for a horizon line.
    pub blocker: u32,
    /// Pieces of one event share its number, which counts up over the receiver's discontinuities.
    pub event: u32,
    /// Ends in the receiver's plane, metres.
    pub ends: [DVec3; 2],
    /// The rays that graze the blocker on their way to the ends; for a horizon line they touch the source's nearest
    /// corner only.
    pub rays: [GrazingRay; 2],
    /// Luminance of the source's radiosity, W·m⁻².
    pub radiosity: f64,
    /// What a swath's light and shadow sweep over; nothing for a horizon line.
    pub sweep: Sweep,
    /// Weight of the whole event on this receiver, W·m⁻² or W·m⁻³ as [`Weight`] has it; see [`rank`](crate::rank) for a
    /// leaf's.
    pub weight: f64,
}

/// The discontinuities of weight at least `min_weight` that the interactions of a receiver cause on it.
///
/// The weight, by the given measure, is that of a whole event on the whole receiver, so that all its leaves agree on which lines there are.
/// `half_edges` must be the scene's own. What an interaction does not list as a blocker stops no light of its source.
/// Interactions that name polygons which do not exist are passed over. The order is that of the interactions, within
/// one of them by event, within an event along the line.
pub fn discontinuities(
    scene: &Scene,
    half_edges: &HalfEdges,
    receiver: u32,
    interactions: &[Interaction],
    measure: Weight,
    min_weight: f64,
) -> Vec<Discontinuity> {
    let outline = if (receiver as usize) < scene.polygons.len() { scene.outline(receiver) } else { Vec::new() };
    discontinuities_within(scene, half_edges, (receiver, &outline), interactions, measure, min_weight)
}

/// The same within a part of the receiver, given by its convex outline: as if the receiver were no larger.
pub(crate) fn discontinuities_within(
    scene: &Scene,
    half_edges: &HalfEdges,
    (receiver, outline): (u32, &[DVec3]),
    interactions: &[Interaction],
    measure: Weight,
    min_weight: f64,
) -> Vec<Discontinuity> {
    let count = scene.polygons.len() as u32;
    let exists = |interaction: &Interaction| {
        (interaction.source < count || interaction.far_outline.is_some())
            && receiver < count
            && interaction.blockers.iter().all(|&blocker| blocker < count)
    };
    let interactions: Vec<&Interaction> = interactions.iter().filter(|interaction| exists(interaction)).collect();
    if interactions.is_empty() {
        return Vec::new();
    }
    let facets = Facets::around(scene, half_edges, (receiver, outline), &interactions);
    let Some(target) = Receiver::new(outline, facets.tolerance) else { return Vec::new() };
    let mut search = Search {
        id: receiver,
        floor: measure.floor_on_receiver(target.diameter),
        receiver: target,
        measure,
        min_weight,
        found: Vec::new(),
        events: 0,
        facets,
    };
    for interaction in interactions {
        if let Some(case) = search.case(interaction) {
            // One that is far away has its horizon where the receiver's plane is: nowhere on it.
            if interaction.far_outline.is_none() {
                search.horizon(&case);
            }
            search.vertex_edge(&case);
            search.edge_vertex(&case);
        }
    }
    search.found
}

/// What the search for a receiver's discontinuities carries along.
struct Search<'a> {
    facets: Facets<'a>,
    id: u32,
    receiver: Receiver,
    /// Shortest length that weights count with, metres.
    floor: f64,
    measure: Weight,
    min_weight: f64,
    found: Vec<Discontinuity>,
    events: u32,
}

/// One interaction, prepared.
struct Case {
    source: u32,
    radiosity: f64,
    plane: Plane,
    /// The source's corners, without those that lie on a straight side: nothing changes where light leaves them.
    outline: Vec<DVec3>,
    /// The part of the outline in front of the receiver.
    front: Vec<DVec3>,
    /// Everything that may stand in a swath.
    occluders: Vec<u32>,
    /// The occluders that may cause a discontinuity of sufficient weight, ascending.
    strong: Vec<u32>,
}

impl Case {
    /// 1 for a source in front of a plane, −1 behind it, 0 on both sides or in it.
    fn side_of(&self, plane: &Plane, tolerance: f64) -> f64 {
        let is_behind = self.outline.iter().any(|&corner| plane.distance(corner) < -tolerance);
        let is_in_front = self.outline.iter().any(|&corner| plane.distance(corner) > tolerance);
        f64::from(i8::from(is_in_front) - i8::from(is_behind))
    }
}

impl Search<'_> {
    /// Prepares an interaction; none if no light can pass.
    fn case(&self, interaction: &Interaction) -> Option<Case> {
        let Interaction { source, radiosity, .. } = *interaction;
        let tolerance = self.facets.tolerance;
        let facet = *self.facets.get(source);
        let rises = |plane: &Plane, polygon| self.facets.corners(polygon).any(|p| plane.distance(p) > tolerance);
        if source == self.id || !rises(&facet.plane, self.id) || !rises(&self.receiver.plane, source) {
            return None;
        }
        let is_between = |&polygon: &u32| {
            polygon != source
                && polygon != self.id
                && rises(&facet.plane, polygon)
                && rises(&self.receiver.plane, polygon)
        };
        let occluders: Vec<u32> = interaction.blockers.iter().copied().filter(is_between).collect();
        let can_matter = |&blocker: &u32| {
            radiosity * self.measure.bound(&facet, self.facets.get(blocker), self.floor) >= self.min_weight
        };
        let strong: Vec<u32> = occluders.iter().copied().filter(can_matter).collect();
        let outline = without_flat_corners(&self.facets.corners(source).collect::<Vec<_>>(), tolerance);
        let front = in_front(&outline, &self.receiver.plane);
        Some(Case { source, radiosity, plane: facet.plane, outline, front, occluders, strong })
    }

    /// Swaths between the source's vertices and the blockers' silhouette edges.
    fn vertex_edge(&mut self, case: &Case) {
        for &blocker in &case.strong {
            for half_edge in self.facets.half_edges_of(blocker) {
                let is_strong = |twin| case.strong.binary_search(&self.facets.polygon(twin)).is_ok();
                if self.facets.twin(half_edge).is_some_and(|twin| twin < half_edge && is_strong(twin)) {
                    continue;
                }
                let edge = [self.facets.start(half_edge), self.facets.end(half_edge)];
                for &apex in &case.outline {
                    let pencil = Pencil { apex, edge, at: Apex::Source };
                    if let Some((rays, sweep)) = self.landing(case, blocker, &pencil)
                        && self.facets.is_silhouette(half_edge, apex)
                    {
                        self.trace(case, blocker, &pencil, sweep, Intervals::from(rays));
                    }
                }
            }
        }
    }

    /// Swaths between the source's edges and the corners of the blockers' silhouettes.
    fn edge_vertex(&mut self, case: &Case) {
        let mut visited = HashSet::new();
        for &blocker in &case.strong {
            for half_edge in self.facets.half_edges_of(blocker) {
                if !visited.insert(self.facets.vertex(half_edge)) {
                    continue;
                }
                let apex = self.facets.start(half_edge);
                for edge in edges(&case.outline) {
                    let pencil = Pencil { apex, edge, at: Apex::Blocker };
                    if let Some((rays, sweep)) = self.landing(case, blocker, &pencil) {
                        let rays = self.facets.silhouette_corner(half_edge, edge, rays);
                        self.trace(case, blocker, &pencil, sweep, rays);
                    }
                }
            }
        }
    }

    /// The rays of a pencil that could reach the receiver, if the line where they meet it divides it and is strong
    /// enough; and what they sweep over.
    fn landing(&self, case: &Case, blocker: u32, pencil: &Pencil) -> Option<(Interval, Sweep)> {
        let rays = pencil.landing(&case.plane, &self.receiver)?;
        let ends = rays.map(|u| pencil.point(u, &self.receiver.plane));
        if ends[0].distance(ends[1]) <= self.facets.tolerance || self.receiver.is_on_border(ends) {
            return None;
        }
        let diameter = 2.0 * self.facets.get(blocker).radius;
        let sweep = Sweep::new(pencil, &case.front, case.plane.normal, self.receiver.plane.normal, diameter);
        (self.piece(case, blocker, pencil, sweep, rays).weight >= self.min_weight).then_some((rays, sweep))
    }

    /// A piece of the line in which a swath meets the receiver, weighed by itself.
    fn piece(&self, case: &Case, blocker: u32, pencil: &Pencil, sweep: Sweep, rays: Interval) -> Discontinuity {
        let line = Discontinuity {
            kind: if pencil.at == Apex::Source { LineKind::VertexEdge } else { LineKind::EdgeVertex },
            receiver: self.id,
            source: case.source,
            blocker,
            event: self.events,
            ends: rays.map(|u| pencil.point(u, &self.receiver.plane)),
            rays: rays.map(|u| pencil.ray(u)),
            radiosity: case.radiosity,
            sweep,
            weight: 0.0,
        };
        let weight = self.measure.of_swath(&line, self.receiver.plane.normal, [0.0, 1.0], self.floor);
        Discontinuity { weight, ..line }
    }

    /// Takes out of a swath what is stopped on its way and records the rest.
    fn trace(&mut self, case: &Case, blocker: u32, pencil: &Pencil, sweep: Sweep, mut rays: Intervals) {
        let Some(swath) = Swath::new(*pencil, self.facets.tolerance) else { return };
        for &occluder in &case.occluders {
            if rays.is_empty() {
                return;
            }
            self.stop(case, occluder, &swath, &mut rays);
        }
        let first = self.found.len();
        for piece in rays.iter() {
            self.record(self.piece(case, blocker, pencil, sweep, piece));
        }
        self.close_event(first);
    }

    /// Takes out of a swath the rays that one polygon stops. A polygon that only touches the swath's plane, as the
    /// faces at the grazed edge do, stops none.
    fn stop(&self, case: &Case, occluder: u32, swath: &Swath, rays: &mut Intervals) {
        let Pencil { apex, edge, at } = swath.pencil;
        let tolerance = self.facets.tolerance;
        let plane = self.facets.get(occluder).plane;
        if plane.distance(apex).abs() > tolerance {
            let Some(section) = self.facets.section(occluder, &swath.plane, false) else { return };
            if section.iter().any(|&end| case.plane.distance(end) > tolerance) {
                swath.stopped(section, &self.receiver).into_iter().flatten().for_each(|stopped| rays.subtract(stopped));
            } else if edge.iter().all(|&end| plane.distance(end).abs() <= tolerance)
                && case.side_of(&plane, tolerance) * plane.distance(apex) < 0.0
            {
                // The source's edge lies on the polygon, and the blocker is behind it.
                rays.subtract(project(section, edge));
            }
        } else if self.facets.contains(occluder, apex) {
            match at {
                // A vertex in the middle of another polygon is no corner of the outline.
                Apex::Blocker => rays.clear(),
                // A source's corner there is hidden from the other side of the polygon than the source's.
                Apex::Source => {
                    let beyond = edge.map(|end| -case.side_of(&plane, tolerance) * plane.distance(end));
                    let mut hidden = [0.0, 1.0];
                    if beyond[0].max(beyond[1]) > tolerance && clip(&mut hidden, beyond[0], beyond[1]) {
                        rays.subtract(hidden);
                    }
                }
            }
        }
    }

    /// The line in which the source's plane meets the receiver, as far as some of the source is seen from it: one of
    /// its corners or its centre, of the part in front of the receiver.
    fn horizon(&mut self, case: &Case) {
        let tolerance = self.facets.tolerance;
        let Some(line) = self.facets.section(self.id, &case.plane, false) else { return };
        let Some(horizon) = Horizon::new(&case.outline, &case.plane, &self.receiver.plane) else { return };
        if case.radiosity * self.measure.of_horizon(&horizon, line, self.floor) < self.min_weight {
            return;
        }
        let section = |&occluder: &u32| self.facets.section(occluder, &case.plane, true);
        let sections: Vec<[DVec3; 2]> = case.occluders.iter().filter_map(section).collect();
        let mut seen = Intervals::default();
        for apex in horizon.probes().filter(|&probe| self.receiver.plane.distance(probe) > tolerance) {
            let Some(swath) = Swath::new(Pencil { apex, edge: line, at: Apex::Source }, tolerance) else { continue };
            let mut rays = Intervals::from([0.0, 1.0]);
            for &section in &sections {
                if !is_on_line(apex, section, tolerance) {
                    swath.stopped(section, &self.receiver).into_iter().flatten().for_each(|gap| rays.subtract(gap));
                }
            }
            seen.unite(&rays);
        }
        // Where the source itself stands on the line, the solver has cut the receiver.
        if let Some(contact) = self.facets.section(case.source, &self.receiver.plane, true) {
            seen.subtract(project(contact, line));
        }
        let first = self.found.len();
        for piece in seen.iter() {
            let ends = piece.map(|u| line[0].lerp(line[1], u));
            let rays = ends.map(|end| {
                let corner = horizon.nearest_corner(end);
                GrazingRay { source: corner, blocker: corner }
            });
            self.record(Discontinuity {
                kind: LineKind::Horizon,
                receiver: self.id,
                source: case.source,
                blocker: case.source,
                event: self.events,
                ends,
                rays,
                radiosity: case.radiosity,
                sweep: Sweep::default(),
                weight: case.radiosity * self.measure.of_horizon(&horizon, ends, self.floor),
            });
        }
        self.close_event(first);
    }

    fn record(&mut self, piece: Discontinuity) {
        if piece.ends[0].distance(piece.ends[1]) > self.facets.tolerance {
            self.found.push(piece);
        }
    }

    /// Gives the pieces from `first` on, which are one event, their common weight, or drops them if it is too small.
    fn close_event(&mut self, first: usize) {
        let weight = self.found[first..].iter().map(|piece| piece.weight).fold(0.0, f64::max);
        if weight < self.min_weight {
            self.found.truncate(first);
        }
        if first < self.found.len() {
            self.found[first..].iter_mut().for_each(|piece| piece.weight = weight);
            self.events += 1;
        }
    }
}

/// The parameters along a segment between which another on the same line lies.
fn project(other: [DVec3; 2], [from, to]: [DVec3; 2]) -> Interval {
    let along = (to - from) / from.distance_squared(to);
    let [a, b] = other.map(|point| (point - from).dot(along));
    [a.min(b), a.max(b)]
}

/// Whether the line of a segment passes through a point.
fn is_on_line(point: DVec3, [from, to]: [DVec3; 2], tolerance: f64) -> bool {
    (to - from).cross(point - from).length() <= tolerance * from.distance(to)
}

/// An outline without the corners at which it does not turn.
fn without_flat_corners(outline: &[DVec3], tolerance: f64) -> Vec<DVec3> {
    let count = outline.len();
    let turns =
        |&i: &usize| !is_on_line(outline[i], [outline[(i + count - 1) % count], outline[(i + 1) % count]], tolerance);
    (0..count).filter(turns).map(|i| outline[i]).collect()
}

#[cfg(test)]
pub(crate) mod tests;
