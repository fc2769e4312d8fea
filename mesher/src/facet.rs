//! The polygons around one receiver, measured once, so that the search among thousands of swaths allocates nothing.

use std::collections::HashMap;

use glam::DVec3;
use scene::{HalfEdges, Plane, Scene, centroid};
use solver::Interaction;

use crate::interval::{Interval, Intervals};

/// Lengths below this fraction of the scene's size are rounding: a vertex that near a plane lies in it. Coordinates of
/// a scene file carry six or seven digits, the arithmetic on them fifteen.
const TOLERANCE: f64 = 1e-9;

/// Edges that turn by less than this (sine of the angle) are one straight edge.
const FLAT: f64 = 1e-9;

/// What is asked of a polygon again and again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub(crate) plane: Plane,
    /// Centre and radius of a sphere around the polygon, metres.
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
    /// Lower bound of the distance between a point of the polygon and a point of the receiver, metres; points behind
    /// the receiver's plane do not count. Infinite where all are behind.
    pub(crate) clearance: f64,
}

/// Facets of a receiver's sources and blockers and of the polygons across the blockers' edges.
pub(crate) struct Facets<'a> {
    scene: &'a Scene,
    half_edges: &'a HalfEdges,
    /// By polygon, its place in the table: no more than what is named, so that many receivers of a large scene can be searched.
    slots: HashMap<u32, u32>,
    facets: Vec<Facet>,
    /// Corners of sources that are no polygons.
    far_outlines: HashMap<u32, &'a [DVec3]>,
    /// Length below which two points are one, metres.
    pub(crate) tolerance: f64,
    /// (vertex, half-edge that starts there) of all blockers, ascending.
    fans: Vec<(u32, u32)>,
}

impl<'a> Facets<'a> {
    /// Gathers what the interactions of a receiver name, which is a polygon or the part of it that has the given outline.
    pub(crate) fn around(
        scene: &'a Scene,
        half_edges: &'a HalfEdges,
        (receiver, outline): (u32, &[DVec3]),
        interactions: &[&'a Interaction],
    ) -> Self {
        let tolerance = TOLERANCE * scene.size();
        let slots = HashMap::new();
        let far = |interaction: &&'a Interaction| Some((interaction.source, interaction.far_outline.as_deref()?));
        let far_outlines = interactions.iter().filter_map(far).collect();
        let mut table =
            Self { scene, half_edges, slots, facets: Vec::new(), far_outlines, tolerance, fans: Vec::new() };
        let target = Target::new(outline);
        table.add(receiver, &target);
        for interaction in interactions {
            for &blocker in &interaction.blockers {
                if table.add(blocker, &target) {
                    table.fans.extend(table.half_edges_of(blocker).map(|edge| (scene.corners[edge as usize], edge)));
                }
            }
        }
        // Only now: a blocker that is also a source or a neighbour must not be added without its fans.
        for interaction in interactions {
            table.add(interaction.source, &target);
        }
        for i in 0..table.fans.len() {
            if let Some(neighbour) = half_edges.neighbour(table.fans[i].1) {
                table.add(neighbour, &target);
            }
        }
        table.fans.sort_unstable();
        table
    }

    /// Whether it was not there yet.
    fn add(&mut self, polygon: u32, target: &Target) -> bool {
        let slot = self.facets.len() as u32;
        if *self.slots.entry(polygon).or_insert(slot) != slot {
            return false;
        }
        let outline: Vec<DVec3> = self.corners(polygon).collect();
        let centre = centroid(&outline);
        let radius = outline.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        let clearance = target.clearance(&outline, self.tolerance);
        self.facets.push(Facet { plane: Plane::through(&outline), centre, radius, clearance });
        true
    }

    pub(crate) fn get(&self, polygon: u32) -> &Facet {
        &self.facets[self.slots[&polygon] as usize]
    }

    /// The half-edges of blockers that start at the same vertex as one of them.
    pub(crate) fn fan(&self, half_edge: u32) -> &[(u32, u32)] {
        let vertex = self.vertex(half_edge);
        let first = self.fans.partition_point(|&(other, _)| other < vertex);
        let count = self.fans[first..].partition_point(|&(other, _)| other == vertex);
        &self.fans[first..first + count]
    }

    /// Corner positions of a polygon, or of a source that is none.
    pub(crate) fn corners(&self, polygon: u32) -> impl Iterator<Item = DVec3> + Clone {
        let far = self.far_outlines.get(&polygon).copied();
        let record = if far.is_some() { None } else { self.scene.polygons.get(polygon as usize) };
        let corners = record.map_or(&[][..], |record| &self.scene.corners[record.corner_range()]);
        let vertices = corners.iter().map(|&vertex| self.scene.vertices[vertex as usize]);
        far.unwrap_or_default().iter().copied().chain(vertices)
    }

    /// The half-edges around a polygon.
    pub(crate) fn half_edges_of(&self, polygon: u32) -> impl Iterator<Item = u32> + use<> {
        let range = self.scene.polygons[polygon as usize].corner_range();
        range.start as u32..range.end as u32
    }

    /// The vertex that a half-edge starts from.
    pub(crate) fn vertex(&self, half_edge: u32) -> u32 {
        self.scene.corners[half_edge as usize]
    }

    /// The point that a half-edge starts from.
    pub(crate) fn start(&self, half_edge: u32) -> DVec3 {
        self.scene.vertices[self.vertex(half_edge) as usize]
    }

    /// The point that a half-edge ends at.
    pub(crate) fn end(&self, half_edge: u32) -> DVec3 {
        self.start(self.half_edges.next[half_edge as usize])
    }

    /// The half-edge before one in its polygon.
    pub(crate) fn previous(&self, half_edge: u32) -> u32 {
        let range = self.scene.polygons[self.polygon(half_edge) as usize].corner_range();
        if half_edge as usize == range.start { range.end as u32 - 1 } else { half_edge - 1 }
    }

    /// The polygon that a half-edge bounds.
    pub(crate) fn polygon(&self, half_edge: u32) -> u32 {
        self.half_edges.polygon[half_edge as usize]
    }

    /// The half-edge on the other side, if there is exactly one.
    pub(crate) fn twin(&self, half_edge: u32) -> Option<u32> {
        Some(self.half_edges.twin[half_edge as usize]).filter(|&twin| twin != scene::NO_TWIN)
    }

    /// Whether an edge is part of the outline that a point sees: the surface ends there, or one of its two faces is
    /// turned to the point and the other is not. A face seen edge-on counts as turned away, so that of its edges, which
    /// all look the same from the point, only the near ones are in the outline.
    pub(crate) fn is_silhouette(&self, half_edge: u32, point: DVec3) -> bool {
        let faces = |edge| self.get(self.polygon(edge)).plane.distance(point) > self.tolerance;
        self.twin(half_edge).is_none_or(|twin| faces(twin) != faces(half_edge))
    }

    /// The rays of a pencil, through points of an edge of the source, to which the vertex that a half-edge starts from
    /// is a corner of the outline they see: two edges of the silhouette meet there, and not in a straight line.
    pub(crate) fn silhouette_corner(&self, half_edge: u32, source: [DVec3; 2], rays: Interval) -> Intervals {
        // What the vertex looks like changes where the source's edge passes through the plane of a face.
        let fan = self.fan(half_edge);
        let edges = || fan.iter().flat_map(|&(_, edge)| [edge, self.previous(edge)]);
        let faces = edges().flat_map(|edge| [Some(edge), self.twin(edge)]).flatten().map(|edge| self.polygon(edge));
        let mut changes = vec![rays[0], rays[1]];
        for face in faces {
            let [from, to] = source.map(|point| self.get(face).plane.distance(point));
            if (from > 0.0) != (to > 0.0) {
                changes.push((from / (from - to)).clamp(rays[0], rays[1]));
            }
        }
        changes.sort_unstable_by(f64::total_cmp);
        let is_corner = |point: DVec3| {
            let vertex = self.start(half_edge);
            let far_end =
                |edge| if self.vertex(edge) == self.vertex(half_edge) { self.end(edge) } else { self.start(edge) };
            let mut first: Option<DVec3> = None;
            let mut straight = false;
            for edge in edges().filter(|&edge| self.is_silhouette(edge, point)) {
                let direction = (far_end(edge) - vertex).normalize_or_zero();
                let before = *first.get_or_insert(direction);
                if before.cross(direction).length() > FLAT {
                    return true;
                }
                straight |= before.dot(direction) < 0.0;
            }
            first.is_some() && !straight
        };
        let mut corner = Intervals::from(rays);
        for part in changes.windows(2).filter(|part| part[0] < part[1]) {
            if !is_corner(source[0].lerp(source[1], (part[0] + part[1]) / 2.0)) {
                corner.subtract([part[0], part[1]]);
            }
        }
        corner
    }

    /// The segment in which a polygon meets a plane. With `limit` the polygon must cross the plane or touch it from the
    /// front along an edge; without, it must cross.
    pub(crate) fn section(&self, polygon: u32, plane: &Plane, limit: bool) -> Option<[DVec3; 2]> {
        let facet = self.get(polygon);
        if plane.distance(facet.centre).abs() > facet.radius {
            return None;
        }
        let corners = self.corners(polygon);
        let (mut low, mut high) = (0.0, 0.0);
        for distance in corners.clone().map(|corner| plane.distance(corner)) {
            low = distance.min(low);
            high = distance.max(high);
        }
        if high <= self.tolerance || (low >= -self.tolerance && !limit) {
            return None;
        }
        let along = plane.normal.cross(facet.plane.normal);
        let mut ends: Option<[DVec3; 2]> = None;
        let mut include = |point: DVec3| {
            let [first, last] = ends.get_or_insert([point; 2]);
            if point.dot(along) < first.dot(along) {
                *first = point;
            }
            if point.dot(along) > last.dot(along) {
                *last = point;
            }
        };
        let on_plane = |distance: f64| distance.abs() <= self.tolerance;
        for (from, to) in corners.clone().zip(corners.clone().skip(1).chain(corners.take(1))) {
            let (before, after) = (plane.distance(from), plane.distance(to));
            if on_plane(before) {
                include(from);
            } else if !on_plane(after) && (before < 0.0) != (after < 0.0) {
                include(from.lerp(to, before / (before - after)));
            }
        }
        ends.filter(|[first, last]| first.distance(*last) > self.tolerance)
    }

    /// Whether a point in the plane of a polygon lies inside it, not on its border.
    pub(crate) fn contains(&self, polygon: u32, point: DVec3) -> bool {
        let normal = self.get(polygon).plane.normal;
        self.half_edges_of(polygon).all(|edge| {
            let (from, to) = (self.start(edge), self.end(edge));
            let inward = normal.cross(to - from).normalize_or_zero();
            inward == DVec3::ZERO || inward.dot(point - from) > self.tolerance
        })
    }
}

/// The receiver, as something to keep a distance from.
struct Target {
    plane: Plane,
    low: DVec3,
    high: DVec3,
}

impl Target {
    fn new(outline: &[DVec3]) -> Self {
        let (low, high) = bounds(outline);
        Self { plane: Plane::through(outline), low, high }
    }

    /// See [`Facet::clearance`]: the larger of the least height over the plane and the gap between bounding boxes.
    fn clearance(&self, outline: &[DVec3], tolerance: f64) -> f64 {
        let heights = || outline.iter().map(|&corner| self.plane.distance(corner));
        if heights().all(|height| height <= tolerance) {
            return f64::INFINITY;
        }
        let (low, high) = bounds(outline);
        let gap = (low - self.high).max(self.low - high).max(DVec3::ZERO).length();
        heights().fold(f64::INFINITY, f64::min).max(gap)
    }
}

fn bounds(outline: &[DVec3]) -> (DVec3, DVec3) {
    let first = outline.first().copied().unwrap_or_default();
    outline.iter().fold((first, first), |(low, high), &corner| (low.min(corner), high.max(corner)))
}
