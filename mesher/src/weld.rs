//! Welding: points nearer to each other than a distance become one vertex.

use std::collections::HashMap;

use glam::DVec3;

/// Gives points vertex ids. A point takes the id of the earliest vertex within the distance, else it becomes a vertex;
/// so all vertices are farther apart than the distance, and points pushed first never move.
pub(crate) struct Welder {
    distance: f64,
    vertices: Vec<DVec3>,
    /// Vertices by grid cell. A cell is two distances wide, so that a ball of one distance touches at most eight.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Welder {
    pub(crate) fn new(distance: f64) -> Self {
        Self { distance, vertices: Vec::new(), cells: HashMap::new() }
    }

    /// The vertex of a point.
    pub(crate) fn vertex(&mut self, point: DVec3) -> u32 {
        let reach = DVec3::splat(self.distance);
        let (low, high) = (self.cell(point - reach), self.cell(point + reach));
        let mut nearby = Vec::new();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    nearby.extend(self.cells.get(&[x, y, z]).into_iter().flatten());
                }
            }
        }
        let within = |id: &u32| self.vertices[*id as usize].distance(point) <= self.distance;
        nearby.into_iter().filter(within).min().unwrap_or_else(|| {
            let id = self.vertices.len() as u32;
            self.vertices.push(point);
            self.cells.entry(self.cell(point)).or_default().push(id);
            id
        })
    }

    /// All vertices, by id.
    pub(crate) fn into_vertices(self) -> Vec<DVec3> {
        self.vertices
    }

    fn cell(&self, point: DVec3) -> [i64; 3] {
        (point / (2.0 * self.distance)).floor().to_array().map(|x| x as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_at_cell_borders_are_welded_and_the_first_stays() {
        let mut welder = Welder::new(1e-6);
        for k in -3..=3 {
            let border = DVec3::new(2e-6 * f64::from(k), 0.0, 1.0);
            let id = welder.vertex(border);
            for offset in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Z, DVec3::ONE * 0.5] {
                assert_eq!(welder.vertex(border + offset * 9e-7), id);
            }
        }
        let vertices = welder.into_vertices();
        assert_eq!(vertices.len(), 7);
        assert_eq!(vertices[0], DVec3::new(-6e-6, 0.0, 1.0));
    }
}
