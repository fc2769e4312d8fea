//! The sky cut into pieces that are small beside what one light stands for: what lights are made of.

use glam::DVec3;
use rayon::prelude::*;
use scene::{Environment, Rgb, Sky, luminance, texel_solid_angle};

/// Rows at least: a map of few texels is cut finer, so that many lights find a place in it. A piece is then 1.4° high.
const FEWEST_ROWS: u32 = 128;

/// Rows at most: larger maps are taken together, so that a light's cell holds hundreds of pieces and not millions. A piece
/// keeps the mean direction of its light, so that a sun of one texel stays where it is.
const MOST_ROWS: u32 = 512;

/// A part of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Unit direction that its light comes from on average; its middle where it is black.
    pub direction: DVec3,
    /// Solid angle, sr.
    pub solid_angle: f64,
    /// Irradiance on a surface that faces it, W·m⁻².
    pub irradiance: Rgb,
}

/// All of a sky, row by row.
pub(crate) struct SkyPieces {
    pub width: u32,
    pub height: u32,
    pub pieces: Vec<Piece>,
}

impl SkyPieces {
    /// Cuts a sky, without its sun.
    pub fn of(environment: &Environment) -> Self {
        let (width, height) = match &environment.sky {
            Sky::Map(map) => (map.width, map.height),
            Sky::Cie(_) => (4 * FEWEST_ROWS, 2 * FEWEST_ROWS),
        };
        // Whole texels are cut into whole pieces, or taken together.
        let finer = (FEWEST_ROWS.div_ceil(height), (2 * FEWEST_ROWS).div_ceil(width));
        let (width, height) = (width * finer.1, height * finer.0);
        let together = |sides: u32, most: u32| sides.div_ceil(most);
        let (columns, rows) = (together(width, 2 * MOST_ROWS), together(height, MOST_ROWS));
        let (across, down) = (width.div_ceil(columns), height.div_ceil(rows));
        let piece = |i: u32| {
            let (x, y) = (i % across * columns, i / across * rows);
            let place = |x: f64, y: f64| (x / f64::from(width), y / f64::from(height));
            let (mut solid_angle, mut irradiance, mut flow) = (0.0, Rgb::ZERO, DVec3::ZERO);
            let (right, bottom) = ((x + columns).min(width), (y + rows).min(height));
            for row in y..bottom {
                let texel = texel_solid_angle(width, height, row);
                for column in x..right {
                    let (u, v) = place(f64::from(column) + 0.5, f64::from(row) + 0.5);
                    let light = environment.radiance_at(u, v) * texel;
                    (solid_angle, irradiance) = (solid_angle + texel, irradiance + light);
                    flow += environment.direction(u, v) * luminance(light);
                }
            }
            let (u, v) = place(f64::from(x + right) / 2.0, f64::from(y + bottom) / 2.0);
            let direction = flow.try_normalize().unwrap_or_else(|| environment.direction(u, v));
            Piece { direction, solid_angle, irradiance }
        };
        Self { width: across, height: down, pieces: (0..across * down).into_par_iter().map(piece).collect() }
    }

    /// Numbers of the pieces beside one, left, right, above and below; across a pole the row goes on half a turn away.
    pub fn beside(&self, piece: usize) -> [usize; 4] {
        let (width, height) = (self.width as usize, self.height as usize);
        let (x, y) = (piece % width, piece / width);
        let beyond_pole = y * width + (x + width / 2) % width;
        [
            y * width + (x + width - 1) % width,
            y * width + (x + 1) % width,
            if y == 0 { beyond_pole } else { piece - width },
            if y + 1 == height { beyond_pole } else { piece + width },
        ]
    }
}

/// By piece, the nearest of some unit directions, the first of those that are equally near; there is at least one.
pub(crate) fn nearest_directions(pieces: &[Piece], directions: &[DVec3]) -> Vec<u32> {
    let nearest = |piece: &Piece| {
        let mut best = (f64::NEG_INFINITY, 0);
        for (id, direction) in (0..).zip(directions) {
            let cosine = direction.dot(piece.direction);
            if cosine > best.0 {
                best = (cosine, id);
            }
        }
        best.1
    };
    pieces.par_iter().map(nearest).collect()
}
