//! Convex solids: polygons that bound a convex body between them hide from a point what the body's outline encloses. One
//! cone in place of up to all its faces; what is left of a source falls into as many fewer fragments.
//!
//! A body may lack the face that it stands on. Seen from the other sides that makes no difference.

use glam::DVec3;
use scene::{HalfEdges, NO_TWIN, Plane, Scene};

use crate::backprojection::{BlockerCone, Viewpoint};
use crate::clip::{Position, locate};
use crate::geometry::Geometry;

/// The convex solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    solids: Vec<Solid>,
    /// By polygon, the solid that it is a face of.
    of_polygon: Vec<Option<u32>>,
}

/// A convex solid.
#[derive(Clone, Debug)]
struct Solid {
    /// Polygons.
    faces: Vec<u32>,
    edges: Vec<Edge>,
    /// The plane of the face that is missing, outwards.
    opening: Option<Plane>,
}

/// An edge of a solid, along the winding of a face.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: u32,
    to: u32,
    face: u32,
    /// The face on the other side, none at the opening.
    other: Option<u32>,
}

impl Solids {
    /// Finds the solids among the polygons that share edges.
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let half_edges = HalfEdges::new(scene);
        let mut found = Self { solids: Vec::new(), of_polygon: vec![None; scene.polygons.len()] };
        let mut visited = vec![false; scene.polygons.len()];
        for first in scene.polygon_ids() {
            let mut faces = Vec::new();
            let mut open = vec![first];
            while let Some(face) = open.pop() {
                if std::mem::replace(&mut visited[face as usize], true) {
                    continue;
                }
                faces.push(face);
                let range = scene.polygons[face as usize].corner_range();
                open.extend(range.filter_map(|edge| half_edges.neighbour(edge as u32)));
            }
            if let Some(solid) = Solid::of_faces(scene, geometry, &half_edges, faces) {
                let id = found.solids.len() as u32;
                solid.faces.iter().for_each(|&face| found.of_polygon[face as usize] = Some(id));
                found.solids.push(solid);
            }
        }
        found
    }

    /// The solid that a polygon is a face of.
    pub fn of_polygon(&self, polygon: u32) -> Option<u32> {
        self.of_polygon[polygon as usize]
    }

    /// Whether all of a solid lies in front of a plane, or on it.
    pub fn is_before(&self, scene: &Scene, solid: u32, plane: &Plane, tolerance: f64) -> bool {
        let edges = &self.solids[solid as usize].edges;
        edges.iter().all(|edge| plane.distance(scene.vertices[edge.from as usize]) >= -tolerance)
    }

    /// What a solid hides from a point. None where the point is inside, touches a face, or lies before the opening: there the
    /// faces count one by one.
    pub fn cone(&self, scene: &Scene, geometry: &Geometry, solid: u32, from: &Viewpoint) -> Option<BlockerCone> {
        let solid = &self.solids[solid as usize];
        let tolerance = geometry.contact_tolerance;
        if solid.opening.is_some_and(|plane| plane.distance(from.position) > tolerance) {
            return None;
        }
        let depth = |face: u32| geometry.planes[face as usize].distance(from.position);
        let touches = |face: u32| {
            let normal = geometry.planes[face as usize].normal;
            depth(face).abs() <= tolerance
                && locate(geometry.outline(face), normal, from.position, tolerance) != Position::Outside
        };
        if solid.faces.iter().any(|&face| touches(face)) {
            return None;
        }
        // A face that is seen edge-on is none that faces the point.
        let faces = |face: u32| depth(face) > tolerance;
        let outline: Vec<Edge> =
            solid.edges.iter().copied().filter(|edge| faces(edge.face) && !edge.other.is_some_and(faces)).collect();
        let mut at = outline.first()?.from;
        let mut corners: Vec<DVec3> = Vec::with_capacity(outline.len());
        for _ in &outline {
            corners.push(scene.vertices[at as usize] - from.position);
            at = outline.iter().find(|edge| edge.from == at)?.to;
        }
        // One loop that closes; anything else is no outline.
        if at == outline[0].from { BlockerCone::new(corners) } else { None }
    }
}

impl Solid {
    /// The solid that some polygons bound; none if they bound no convex body, or one that lacks more than one face.
    fn of_faces(scene: &Scene, geometry: &Geometry, half_edges: &HalfEdges, mut faces: Vec<u32>) -> Option<Self> {
        if faces.len() < 3 {
            return None;
        }
        faces.sort_unstable();
        let mut edges = Vec::new();
        for &face in &faces {
            for edge in scene.polygons[face as usize].corner_range() {
                edges.push(Edge {
                    from: scene.corners[edge],
                    to: scene.corners[half_edges.next[edge] as usize],
                    face,
                    other: (half_edges.twin[edge] != NO_TWIN)
                        .then(|| half_edges.polygon[half_edges.twin[edge] as usize]),
                });
            }
        }
        let vertex = |edge: &Edge| scene.vertices[edge.from as usize];
        let tolerance = geometry.contact_tolerance;
        let bounds = |plane: &Plane| {
            edges.iter().all(|edge| plane.distance(vertex(edge)) <= tolerance)
                && edges.iter().any(|edge| plane.distance(vertex(edge)) < -tolerance)
        };
        if !faces.iter().all(|&face| bounds(&geometry.planes[face as usize])) {
            return None;
        }
        // Around the opening run the free edges the other way.
        let mut rim: Vec<&Edge> = edges.iter().filter(|edge| edge.other.is_none()).collect();
        let opening = if let Some(first) = rim.pop() {
            let mut outline = vec![scene.vertices[first.to as usize], vertex(first)];
            let mut end = first.from;
            while let Some(next) = rim.iter().position(|edge| edge.to == end) {
                let edge = rim.swap_remove(next);
                outline.push(vertex(edge));
                end = edge.from;
            }
            outline.pop();
            let plane = Plane::through(&outline);
            let flat = outline.iter().all(|&corner| plane.distance(corner).abs() <= tolerance);
            if end != first.to || !rim.is_empty() || !flat || !bounds(&plane) {
                return None;
            }
            Some(plane)
        } else {
            None
        };
        Some(Self { faces, edges, opening })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backprojection::Fragments;
    use crate::testing::Builder;

    fn solids(scene: &Scene) -> (Geometry, Solids) {
        let geometry = Geometry::new(scene);
        let solids = Solids::new(scene, &geometry);
        (geometry, solids)
    }

    #[test]
    fn rooms_plates_and_open_pairs_are_no_solids() {
        let room = Builder::default().material(0.5, 0.0).cuboid([0.0; 3], [1.0, 2.0, 3.0], true).build();
        let sides = |kept| Builder::default().material(0.5, 0.0).sides(DVec3::ZERO, DVec3::ONE, false, kept).build();
        let corner = sides([true, false, true, false, true, false]);
        let tube = sides([true, true, true, true, false, false]);
        for scene in [Scene::default(), room, corner, tube] {
            assert!(solids(&scene).1.solids.is_empty());
        }
    }

    /// A box, with and without its floor, hides what its faces do, from everywhere that is neither in it nor on it.
    #[test]
    fn a_box_hides_what_its_faces_hide() {
        let (low, high) = (DVec3::new(-0.4, -0.3, 0.0), DVec3::new(0.5, 0.2, 0.7));
        for kept in [[true; 6], [true, true, true, true, false, true]] {
            let scene = Builder::default().material(0.5, 0.0).sides(low, high, false, kept).build();
            let (geometry, solids) = solids(&scene);
            assert_eq!(solids.solids.len(), 1);
            let source: Vec<DVec3> =
                [(-3., -3.), (-3., 3.), (3., 3.), (3., -3.)].map(|(x, y)| DVec3::new(x, y, 2.0)).to_vec();
            for (x, y, z) in [
                (1.0, 0.7, 0.0),
                (-1.3, 0.05, 0.0),
                (0.1, -2.0, 0.3),
                (0.9, 0.1, 0.65),
                (0.1, 0.1, -0.5),
                (0.5, 1.0, 0.1),
            ] {
                let position = DVec3::new(x, y, z);
                let from = Viewpoint::flat(position, DVec3::Z, DVec3::ZERO);
                let seen = |cones: &[BlockerCone]| {
                    let mut fragments = Fragments::new(10.0);
                    let corners: Vec<DVec3> = source.iter().map(|corner| corner - position).collect();
                    fragments.start(&corners, &from);
                    cones.iter().for_each(|cone| fragments.subtract(cone));
                    fragments.measure(DVec3::Z)
                };
                let faces: Vec<BlockerCone> = scene
                    .polygon_ids()
                    .filter_map(|face| {
                        let normal = geometry.plane(face).normal;
                        BlockerCone::of_polygon(geometry.outline(face), normal, &from, geometry.contact_tolerance)
                    })
                    .collect();
                let cone = solids.cone(&scene, &geometry, 0, &from);
                assert_eq!(cone.is_some(), kept[4] || z >= 0.0, "{position}");
                if let Some(cone) = cone {
                    assert!((seen(&faces) - seen(&[cone])).abs() < 1e-12, "{position}");
                }
            }
            for inside in [DVec3::new(0.1, 0.0, 0.2), DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.5, 0.2, 0.1)] {
                let from = Viewpoint::flat(inside, DVec3::Z, DVec3::ZERO);
                assert!(solids.cone(&scene, &geometry, 0, &from).is_none(), "{inside}");
            }
        }
    }
}
