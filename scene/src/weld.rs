//! Welding: points nearer to each other than a distance become one vertex.

use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

/// Width of the cells that vertices are kept in, in distances: a point asks every cell that its ball touches, which is mostly
/// one of so wide ones.
const CELL_WIDTH: f64 = 16.0;

/// Gives points vertex ids. A point takes the id of the earliest vertex within the distance, else it becomes a vertex;
/// so all vertices are farther apart than the distance, points pushed first never move, and there are no chains.
#[derive(Clone, Debug)]
pub struct Welder {
    distance: f64,
    vertices: Vec<DVec3>,
    cells: HashMap<I64Vec3, Vec<u32>>,
}

impl Welder {
    /// No vertices yet. At a distance of 0, metres, equal points alone are welded.
    pub fn new(distance: f64) -> Self {
        Self { distance, vertices: Vec::new(), cells: HashMap::new() }
    }

    /// The vertex of a point.
    pub fn vertex(&mut self, point: DVec3) -> u32 {
        self.near(point).min().unwrap_or_else(|| self.push(point))
    }

    /// The vertices within the distance of a point, in no particular order.
    pub fn near(&self, point: DVec3) -> impl Iterator<Item = u32> {
        let (low, high) = (self.cell(point - self.distance), self.cell(point + self.distance));
        let cells = (low.x..=high.x).flat_map(move |x| {
            (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| I64Vec3::new(x, y, z)))
        });
        let ids = cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied();
        ids.filter(move |&id| self.vertices[id as usize].distance(point) <= self.distance)
    }

    /// Makes a vertex of a point, whatever is near it.
    pub fn push(&mut self, point: DVec3) -> u32 {
        let id = self.vertices.len() as u32;
        self.vertices.push(point);
        self.cells.entry(self.cell(point)).or_default().push(id);
        id
    }

    /// All vertices, by id.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// The same, and nothing else.
    pub fn into_vertices(self) -> Vec<DVec3> {
        self.vertices
    }

    fn cell(&self, point: DVec3) -> I64Vec3 {
        let width = if self.distance > 0.0 { self.distance * CELL_WIDTH } else { 1.0 };
        (point / width).floor().as_i64vec3()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn weld(points: &[DVec3], distance: f64) -> (Vec<DVec3>, Vec<u32>) {
        let mut welder = Welder::new(distance);
        let ids = points.iter().map(|&point| welder.vertex(point)).collect();
        (welder.into_vertices(), ids)
    }

    #[test]
    fn nothing_and_equal_points() {
        assert_eq!(weld(&[], 1e-7), (vec![], vec![]));
        assert_eq!(weld(&[DVec3::ONE; 5], 0.0), (vec![DVec3::ONE], vec![0; 5]));
    }

    #[test]
    fn neighbours_across_a_cell_border_weld_and_chains_do_not() {
        let at = |x: f64| DVec3::new(x, 0.0, 0.0);
        // 16 distances is a border of the cells.
        let points = [at(0.0), at(15.9), at(16.1), at(16.95), at(18.0)];
        let (vertices, ids) = weld(&points, 1.0);
        assert_eq!(ids, [0, 1, 1, 2, 3]);
        assert_eq!(vertices, [at(0.0), at(15.9), at(16.95), at(18.0)]);
    }

    #[test]
    fn what_is_pushed_is_a_vertex_and_all_near_are_found() {
        let mut welder = Welder::new(1.0);
        for x in [0.0, 0.5, 3.0, -0.5] {
            welder.push(DVec3::X * x);
        }
        let mut near: Vec<u32> = welder.near(DVec3::X * 0.4).collect();
        near.sort_unstable();
        assert_eq!((near, welder.vertices().len()), (vec![0, 1, 3], 4));
    }

    proptest! {
        #[test]
        fn agrees_with_the_quadratic_search(points in proptest::collection::vec((0..60i32, 0..60i32, 0..4i32), 0..80)) {
            let points: Vec<DVec3> = points.into_iter()
                .map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.45).collect();
            let mut vertices: Vec<DVec3> = Vec::new();
            let mut ids = Vec::new();
            for &point in &points {
                let found = vertices.iter().position(|v| v.distance(point) <= 1.0);
                ids.push(found.unwrap_or(vertices.len()) as u32);
                if found.is_none() {
                    vertices.push(point);
                }
            }
            prop_assert_eq!(weld(&points, 1.0), (vertices, ids));
        }
    }
}
