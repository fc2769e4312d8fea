//! The Voronoi diagram over directions: which light stands for a direction, and which lights are beside each other.
//!
//! A table over all directions, as Ben-Artzi, Ramamoorthi and Agrawala 2004 have it for the upper half: cells that meet in the
//! table are neighbours. Here the table goes all around and over the poles.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

/// Columns and rows of the table: 513² of the paper's upper half, for the whole sphere.
const COLUMNS: usize = 1024;
const ROWS: usize = 512;

/// The diagram of some lights.
#[derive(Clone, Debug, PartialEq)]
pub struct Voronoi {
    /// By place in the table, the nearest light.
    nearest: Vec<u32>,
    /// Where the neighbours of a light begin in the list of all; one more at the end.
    first_neighbour: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Voronoi {
    /// The diagram of unit directions, at least one.
    pub fn new(directions: &[DVec3]) -> Self {
        let mut nearest = vec![0; COLUMNS * ROWS];
        nearest.par_chunks_mut(COLUMNS).enumerate().for_each(|(row, cells)| {
            for (column, cell) in cells.iter_mut().enumerate() {
                let direction = table_direction(column, row);
                let mut best = f64::NEG_INFINITY;
                for (id, light) in (0..).zip(directions) {
                    let cosine = light.dot(direction);
                    if cosine > best {
                        (best, *cell) = (cosine, id);
                    }
                }
            }
        });
        // A cell that is smaller than a place of the table still has its light's own place.
        for (id, &direction) in (0..).zip(directions) {
            nearest[table_place(direction)] = id;
        }
        let mut pairs: Vec<(u32, u32)> = (0..COLUMNS * ROWS)
            .flat_map(|place| {
                let (column, row) = (place % COLUMNS, place / COLUMNS);
                let right = row * COLUMNS + (column + 1) % COLUMNS;
                let opposite = row * COLUMNS + (column + COLUMNS / 2) % COLUMNS;
                let below = if row + 1 == ROWS { opposite } else { place + COLUMNS };
                let beyond = if row == 0 { opposite } else { place };
                [right, below, beyond].map(|other| (nearest[place], nearest[other]))
            })
            .filter(|(one, other)| one != other)
            .flat_map(|(one, other)| [(one, other), (other, one)])
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let first = |light: u32| pairs.partition_point(|&(one, _)| one < light) as u32;
        Self {
            nearest,
            first_neighbour: (0..=directions.len() as u32).map(first).collect(),
            neighbours: pairs.into_iter().map(|(_, other)| other).collect(),
        }
    }

    /// The light that stands for a direction of any length but 0.
    pub fn nearest(&self, direction: DVec3) -> u32 {
        self.nearest[table_place(direction)]
    }

    /// The lights beside one, in order.
    pub fn neighbours(&self, light: u32) -> &[u32] {
        let at = |light: u32| self.first_neighbour[light as usize] as usize;
        &self.neighbours[at(light)..at(light + 1)]
    }
}

/// The direction in the middle of a place of the table.
fn table_direction(column: usize, row: usize) -> DVec3 {
    let (sin, cos) = ((row as f64 + 0.5) / ROWS as f64 * PI).sin_cos();
    let (y, x) = ((column as f64 + 0.5) / COLUMNS as f64 * TAU).sin_cos();
    DVec3::new(x * sin, y * sin, cos)
}

/// The place of the table that a direction lies in.
fn table_place(direction: DVec3) -> usize {
    let cell = |turn: f64, cells: usize| ((turn * cells as f64) as usize).min(cells - 1);
    let row = cell(direction.x.hypot(direction.y).atan2(direction.z) / PI, ROWS);
    row * COLUMNS + cell(direction.y.atan2(direction.x).rem_euclid(TAU) / TAU, COLUMNS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::{Kronecker, Stream};

    fn spread(count: u32) -> Vec<DVec3> {
        let mut sequence = Kronecker::<2>::shifted_by(&mut Stream::new(1, 1));
        let direction = |[u, v]: [f64; 2]| {
            let z = 2.0 * u - 1.0;
            let (sin, cos) = (v * TAU).sin_cos();
            DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
        };
        (0..count).map(|_| direction(sequence.point())).collect()
    }

    #[test]
    fn the_table_knows_the_nearest() {
        let lights = spread(100);
        let diagram = Voronoi::new(&lights);
        let mut wrong = 0;
        for direction in spread(2000) {
            let nearest =
                |&a: &u32, &b: &u32| lights[a as usize].dot(direction).total_cmp(&lights[b as usize].dot(direction));
            wrong += u32::from((0..100).max_by(nearest) != Some(diagram.nearest(direction * 2.0)));
        }
        assert!(wrong < 40, "{wrong} of 2000: those within half a place of a border");
        for (id, &light) in (0..).zip(&lights) {
            assert_eq!(diagram.nearest(light), id);
        }
    }

    /// Each is the other's neighbour; Euler's formula gives 6 − 12/n neighbours on average where three cells meet in a corner.
    #[test]
    fn neighbours_are_mutual_and_as_many_as_a_sphere_has() {
        for count in [12, 50, 400] {
            let diagram = Voronoi::new(&spread(count));
            let mut sum = 0;
            for light in 0..count {
                for &other in diagram.neighbours(light) {
                    assert!(other != light && diagram.neighbours(other).contains(&light));
                    sum += 1;
                }
            }
            let expected = 6.0 * f64::from(count) - 12.0;
            assert!((f64::from(sum) / expected - 1.0).abs() < 0.02, "{sum}, expected {expected}");
        }
    }

    #[test]
    fn one_light_has_no_neighbour_and_two_have_each_other() {
        assert!(Voronoi::new(&[DVec3::Z]).neighbours(0).is_empty());
        let two = Voronoi::new(&[DVec3::Z, DVec3::NEG_Z]);
        assert_eq!((two.neighbours(0), two.neighbours(1)), (&[1][..], &[0][..]));
        assert_eq!((two.nearest(DVec3::new(1.0, 0.0, 0.1)), two.nearest(DVec3::new(-1.0, 0.0, -0.1))), (0, 1));
    }
}
