//! Welding: positions that a file repeats become one vertex, so that neighbours share their corners.

use std::collections::HashMap;

use glam::DVec3;

/// Cells of the hash per tolerance: a point asks every cell that its ball of radius `tolerance` touches, and in cells
/// this much wider that is mostly one.
const CELL_WIDTH: f64 = 16.0;

/// The vertices that remain, and for each given position the vertex that stands for it.
///
/// A position joins the earliest remaining vertex within `tolerance` (metres; 0 welds equal positions alone), else it
/// remains itself. No chains: a position is never farther than `tolerance` from its vertex.
pub(crate) fn weld(positions: &[DVec3], tolerance: f64) -> (Vec<DVec3>, Vec<u32>) {
    let origin = positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let width = if tolerance > 0.0 { tolerance * CELL_WIDTH } else { 1.0 };
    let cell = |p: DVec3| ((p - origin) / width).floor().as_i64vec3();
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut cells: HashMap<glam::I64Vec3, Vec<u32>> = HashMap::with_capacity(positions.len());
    let mut stands_for = Vec::with_capacity(positions.len());
    for &position in positions {
        let (low, high) = (cell(position - tolerance), cell(position + tolerance));
        let mut found: Option<u32> = None;
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let near = cells.get(&glam::I64Vec3::new(x, y, z)).into_iter().flatten().copied();
                    let first = near.filter(|&v| vertices[v as usize].distance(position) <= tolerance).min();
                    found = [found, first].into_iter().flatten().min();
                }
            }
        }
        stands_for.push(found.unwrap_or_else(|| {
            let vertex = vertices.len() as u32;
            vertices.push(position);
            cells.entry(cell(position)).or_default().push(vertex);
            vertex
        }));
    }
    (vertices, stands_for)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn nothing_and_equal_points() {
        assert_eq!(weld(&[], 1e-7), (vec![], vec![]));
        assert_eq!(weld(&[DVec3::ONE; 5], 0.0), (vec![DVec3::ONE], vec![0; 5]));
    }

    #[test]
    fn neighbours_across_a_cell_border_weld_and_chains_do_not() {
        let at = |x: f64| DVec3::new(x, 0.0, 0.0);
        // 16 tolerances is a border of the hash's cells.
        let points = [at(0.0), at(15.9), at(16.1), at(16.95), at(18.0)];
        let (vertices, stands_for) = weld(&points, 1.0);
        assert_eq!(stands_for, [0, 1, 1, 2, 3]);
        assert_eq!(vertices, [at(0.0), at(15.9), at(16.95), at(18.0)]);
    }

    proptest! {
        #[test]
        fn agrees_with_the_quadratic_search(points in proptest::collection::vec((0..60i32, 0..60i32, 0..4i32), 0..80)) {
            let points: Vec<DVec3> = points.into_iter()
                .map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.45).collect();
            let mut vertices: Vec<DVec3> = Vec::new();
            let mut stands_for = Vec::new();
            for &point in &points {
                let found = vertices.iter().position(|v| v.distance(point) <= 1.0);
                stands_for.push(found.unwrap_or(vertices.len()) as u32);
                if found.is_none() {
                    vertices.push(point);
                }
            }
            prop_assert_eq!(weld(&points, 1.0), (vertices, stands_for));
        }
    }
}
