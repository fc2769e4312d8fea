//! The half-edge table: which polygon lies on the other side of an edge.
//!
//! A half-edge is named by its corner: half-edge `i` runs from corner `i` to the next corner of the same
//! polygon. Silhouettes need the table; without it every edge of a mesh would cast a shadow line of its own.

use std::collections::HashMap;

use crate::Scene;

/// The twin of a half-edge that has none: a border of the surface, or an edge more than two polygons share.
pub const NO_TWIN: u32 = u32::MAX;

/// Twins and owners of all half-edges of a scene, by corner index.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HalfEdges {
    /// Twin half-edge, which runs the other way between the same two vertices, or [`NO_TWIN`].
    pub twin: Vec<u32>,
    /// The polygon that a half-edge bounds.
    pub polygon: Vec<u32>,
    /// The next half-edge around the same polygon.
    pub next: Vec<u32>,
}

impl HalfEdges {
    /// Builds the table. Two half-edges are twins when they run opposite ways between the same two welded
    /// vertices and no third half-edge joins those vertices.
    pub fn new(scene: &Scene) -> Self {
        let count = scene.corners.len();
        let mut table = Self { twin: vec![NO_TWIN; count], polygon: vec![0; count], next: vec![0; count] };
        let mut by_vertices: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(count);
        for (polygon, record) in (0..).zip(&scene.polygons) {
            let range = record.corner_range();
            for corner in range.clone() {
                let next = if corner + 1 == range.end { range.start } else { corner + 1 };
                table.polygon[corner] = polygon;
                table.next[corner] = next as u32;
                let (from, to) = (scene.corners[corner], scene.corners[next]);
                by_vertices.entry((from.min(to), from.max(to))).or_default().push(corner as u32);
            }
        }
        for pair in by_vertices.values() {
            if let &[a, b] = pair.as_slice()
                && scene.corners[a as usize] != scene.corners[b as usize]
            {
                table.twin[a as usize] = b;
                table.twin[b as usize] = a;
            }
        }
        table
    }

    /// The polygon across a half-edge, if there is exactly one.
    pub fn neighbour(&self, half_edge: u32) -> Option<u32> {
        match self.twin[half_edge as usize] {
            NO_TWIN => None,
            twin => Some(self.polygon[twin as usize]),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::Polygon;

    fn scene(faces: &[&[u32]]) -> Scene {
        let mut scene = Scene { vertices: vec![DVec3::ZERO; 8], ..Scene::default() };
        for face in faces {
            scene.polygons.push(Polygon {
                first_corner: scene.corners.len() as u32,
                corner_count: face.len() as u32,
                material: 0,
                object: 0,
            });
            scene.corners.extend_from_slice(face);
        }
        scene
    }

    #[test]
    fn an_edge_of_three_polygons_and_one_of_equal_winding_have_no_twin() {
        let fan = HalfEdges::new(&scene(&[&[0, 1, 2], &[1, 0, 3], &[0, 1, 4]]));
        assert!(fan.twin.iter().all(|&twin| twin == NO_TWIN));
        let flipped = HalfEdges::new(&scene(&[&[0, 1, 2], &[0, 1, 3]]));
        assert!(flipped.twin.iter().all(|&twin| twin == NO_TWIN));
    }

    #[test]
    fn a_cube_is_closed() {
        let cube = scene(&[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]);
        let edges = HalfEdges::new(&cube);
        for half_edge in 0..24 {
            let twin = edges.twin[half_edge as usize];
            assert_eq!(edges.twin[twin as usize], half_edge);
            assert_ne!(edges.neighbour(half_edge), Some(edges.polygon[half_edge as usize]));
            assert_eq!(cube.corners[edges.next[half_edge as usize] as usize], cube.corners[twin as usize]);
        }
    }
}
