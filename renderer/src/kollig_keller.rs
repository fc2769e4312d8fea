//! Where lights stand in a sky, after Kollig and Keller, "Efficient Illumination by High Dynamic Range Images", EGSR 2003: the
//! cell with the most light is split until there are as many as asked for, and cells are relaxed (Lloyd 1982) to the middle of
//! their light.
//!
//! What we do differently: a cell is split across the axis along which its light is spread widest, at the mean, where the paper
//! adds a point and relaxes after each; relaxation is left to the end, which costs a few looks at all pieces instead of one a
//! light.

use glam::{DMat3, DVec3};
use scene::luminance;

use crate::sky_pieces::{Piece, SkyPieces, nearest_directions};
use crate::structured_sampling::is_lit;

/// Rounds of relaxation: after these the error of irradiance in an even sky falls no further.
pub(crate) const RELAXATIONS: u32 = 10;

/// Rounds of the power iteration that finds a cell's longest axis; a wrong axis costs a cell that is less round.
const AXIS_ROUNDS: u32 = 16;

/// A part of the sky whose light one light stands for.
struct Cell {
    pieces: Vec<u32>,
    light: f64,
}

/// Directions of so many lights, fewer where the sky has not as many pieces that are lit.
pub(crate) fn split_directions(sky: &SkyPieces, count: usize) -> Vec<DVec3> {
    let of = |pieces: Vec<u32>| {
        let light = pieces.iter().map(|&piece| luminance(sky.pieces[piece as usize].irradiance)).sum();
        Cell { pieces, light }
    };
    let lit = (0..).zip(&sky.pieces).filter(|(_, piece)| is_lit(piece.irradiance)).map(|(id, _)| id);
    let mut cells = vec![of(lit.collect())];
    while cells.len() < count {
        let can_split = |cell: &&mut Cell| cell.pieces.len() > 1;
        let brightest = cells.iter_mut().filter(can_split).max_by(|a, b| a.light.total_cmp(&b.light));
        let Some(cell) = brightest else { break };
        let (one, other) = split(&sky.pieces, std::mem::take(&mut cell.pieces));
        *cell = of(one);
        cells.push(of(other));
    }
    let mut directions: Vec<DVec3> = cells.iter().map(|cell| middle(&sky.pieces, &cell.pieces)).collect();
    relax(&sky.pieces, &mut directions, RELAXATIONS);
    directions
}

/// Moves each direction to the middle of the light that is nearest to it, round after round.
pub(crate) fn relax(sky: &[Piece], directions: &mut [DVec3], rounds: u32) {
    for _ in 0..rounds {
        let mut sums = vec![DVec3::ZERO; directions.len()];
        for (piece, cell) in sky.iter().zip(nearest_directions(sky, directions)) {
            sums[cell as usize] += piece.direction * luminance(piece.irradiance);
        }
        for (direction, sum) in directions.iter_mut().zip(sums) {
            *direction = sum.try_normalize().unwrap_or(*direction);
        }
    }
}

/// The mean direction of the light of some pieces, of which there is one at least.
fn middle(sky: &[Piece], pieces: &[u32]) -> DVec3 {
    let piece = |&id: &u32| &sky[id as usize];
    let sum: DVec3 = pieces.iter().map(|id| piece(id).direction * luminance(piece(id).irradiance)).sum();
    sum.try_normalize().unwrap_or_else(|| piece(&pieces[0]).direction)
}

/// Two parts of pieces of which there are two at least, none empty.
fn split(sky: &[Piece], mut pieces: Vec<u32>) -> (Vec<u32>, Vec<u32>) {
    let (mut mean, mut weight) = (DVec3::ZERO, 0.0);
    for &id in &pieces {
        let light = luminance(sky[id as usize].irradiance);
        (mean, weight) = (mean + sky[id as usize].direction * light, weight + light);
    }
    mean /= weight;
    let mut spread = DMat3::ZERO;
    for &id in &pieces {
        let off = sky[id as usize].direction - mean;
        spread +=
            DMat3::from_cols(off * off.x, off * off.y, off * off.z) * (luminance(sky[id as usize].irradiance) / weight);
    }
    let mut axis = DVec3::new(0.6, 0.5, 0.7);
    for _ in 0..AXIS_ROUNDS {
        axis = (spread * axis).try_normalize().unwrap_or(DVec3::X);
    }
    let along = |id: u32| sky[id as usize].direction.dot(axis);
    let (one, other): (Vec<u32>, Vec<u32>) = pieces.iter().partition(|&&id| along(id) < mean.dot(axis));
    if !one.is_empty() && !other.is_empty() {
        return (one, other);
    }
    let other = pieces.split_off(pieces.len() / 2);
    (pieces, other)
}
