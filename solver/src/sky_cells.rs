//! The sky as the solver has it: a hierarchy of cells of directions, each as bright all over as it is on average.
//!
//! A cell is a part of a face of a cube around everything, so that its sides are great circles, and what a point sees of it is
//! clipped by planes like anything else. Faces are quartered where light varies most. A sun beside the sky is a cell of its own.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::DVec3;
use scene::{Environment, Rgb, SUN_RADIUS, Sky, luminance, texel_solid_angle};
use serde::{Deserialize, Serialize};

use crate::form_factor::form_vector;

/// Cells at most that are not parted. More follow a sky more closely, and take time at every element that sees half of many.
const MOST_CELLS: usize = 768;

/// Cells whose light strays by less than this part of all light are not parted.
const LEAST_STRAY: f64 = 2e-4;

/// Times that every face is quartered at least: what stands before a larger cell is seldom a few polygons.
const LEAST_LEVEL: u32 = 2;

/// Times that a face may be quartered: of a texel of the largest map is seen no less.
const MOST_LEVEL: u32 = 8;

/// Rows that a sky by the standard is looked at in.
const ROWS: u32 = 256;

/// Corners of the sun.
const SUN_CORNERS: u32 = 16;

/// The faces of the cube: the way to the middle, and two axes across it; turned so that corners that go from one axis to the
/// next run counter-clockwise seen from inside.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Z, DVec3::Y],
    [DVec3::NEG_X, DVec3::Y, DVec3::Z],
    [DVec3::Y, DVec3::X, DVec3::Z],
    [DVec3::NEG_Y, DVec3::Z, DVec3::X],
    [DVec3::Z, DVec3::Y, DVec3::X],
    [DVec3::NEG_Z, DVec3::X, DVec3::Y],
];

/// Some directions, and the light from there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkyCell {
    /// Directions to the corners, counter-clockwise seen from inside; not of unit length, and in one plane.
    pub corners: Vec<DVec3>,
    /// Mean exitance, W·m⁻²: π times the radiance.
    pub exitance: Rgb,
    /// For each colour, what the normal of a surface that has all of the cell above it is multiplied by for the irradiance from
    /// the cell, W·m⁻².
    pub light: [DVec3; 3],
    /// Its parts; none where it is not parted.
    pub parts: Range<u32>,
}

/// The cells of a sky; empty without one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SkyCells {
    /// All cells; parts come after what they are parts of.
    pub cells: Vec<SkyCell>,
    /// How many of them, from the first on, are not parts of others.
    pub roots: u32,
}

impl SkyCells {
    /// Cells of an environment; none without one.
    pub fn new(environment: Option<&Environment>) -> Self {
        let Some(environment) = environment else { return Self::default() };
        let faces = Pyramid::of_faces(environment);
        let mut sky = Growth { cells: Vec::new(), blocks: Vec::new() };
        for face in 0..FACES.len() {
            sky.add(&faces, Block { face, level: 0, x: 0, y: 0 });
        }
        let sun = environment.sun();
        let (blocks, roots) = (sky.blocks.len(), sky.blocks.len() as u32 + u32::from(sun.is_some()));
        if let Some((direction, irradiance)) = sun {
            sky.cells.push(sun_cell(direction, irradiance));
            sky.blocks.push(Block { face: 0, level: MOST_LEVEL, x: 0, y: 0 });
        }
        let total: f64 = faces.iter().map(|face| face.at(0, 0, 0).luminance()).sum();
        let mut open: BinaryHeap<Straying> = (0..blocks).map(|cell| sky.straying(&faces, cell)).collect();
        let mut leaves = open.len();
        while let Some(Straying { strays, cell }) = open.pop() {
            let is_coarse = sky.blocks[cell].level < LEAST_LEVEL;
            if !is_coarse && (leaves >= MOST_CELLS || strays <= LEAST_STRAY * total) {
                break;
            }
            if sky.blocks[cell].level == faces[0].finest() {
                continue;
            }
            let first = sky.cells.len();
            for part in sky.blocks[cell].parts() {
                sky.add(&faces, part);
            }
            sky.cells[cell].parts = first as u32..sky.cells.len() as u32;
            open.extend((first..sky.cells.len()).map(|part| sky.straying(&faces, part)));
            leaves += sky.cells.len() - first - 1;
        }
        // What a cell sends is what its parts do: the mean over it has another place.
        for cell in (0..sky.cells.len()).rev() {
            let parts = sky.cells[cell].parts.clone();
            if !parts.is_empty() {
                let light = |colour: usize| parts.clone().map(|part| sky.cells[part as usize].light[colour]).sum();
                sky.cells[cell].light = [0, 1, 2].map(light);
            }
        }
        Self { cells: sky.cells, roots }
    }

    /// Whether no light comes from anywhere.
    pub fn is_dark(&self) -> bool {
        self.cells[..self.roots as usize].iter().all(|cell| cell.exitance == Rgb::ZERO)
    }
}

/// The sun, as a polygon of the same solid angle.
fn sun_cell(direction: DVec3, irradiance: Rgb) -> SkyCell {
    let (x, y) = direction.any_orthonormal_pair();
    let radius = SUN_RADIUS.tan();
    let corner = |i: u32| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(SUN_CORNERS)).sin_cos();
        direction + (x * cos - y * sin) * radius
    };
    let corners: Vec<DVec3> = (0..SUN_CORNERS).map(corner).collect();
    // The pair turns left about the direction, seen from its tip; from inside that is right.
    let exitance = irradiance / form_vector(&corners).dot(direction);
    cell(corners, exitance)
}

fn cell(corners: Vec<DVec3>, exitance: Rgb) -> SkyCell {
    let vector = form_vector(&corners);
    SkyCell { light: exitance.to_array().map(|exitance| vector * exitance), corners, exitance, parts: 0..0 }
}

/// Cells while they are parted.
struct Growth {
    cells: Vec<SkyCell>,
    /// Where each cell lies on its face.
    blocks: Vec<Block>,
}

impl Growth {
    /// Adds a cell, unless it is black.
    fn add(&mut self, faces: &[Pyramid], block: Block) {
        let sums = faces[block.face].at(block.level, block.x, block.y);
        if sums.light != Rgb::ZERO {
            self.cells.push(cell(block.corners(), sums.light / sums.solid_angle * PI));
            self.blocks.push(block);
        }
    }

    fn straying(&self, faces: &[Pyramid], cell: usize) -> Straying {
        let Block { face, level, x, y } = self.blocks[cell];
        let strays = if level < LEAST_LEVEL { f64::INFINITY } else { faces[face].at(level, x, y).strays() };
        Straying { strays, cell }
    }
}

/// A square of a face: of 2^level to a side the one in a column and row.
#[derive(Clone, Copy)]
struct Block {
    face: usize,
    level: u32,
    x: u32,
    y: u32,
}

impl Block {
    fn parts(self) -> [Self; 4] {
        let Self { face, level, x, y } = self;
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| Self { face, level: level + 1, x: 2 * x + i, y: 2 * y + j })
    }

    fn corners(self) -> Vec<DVec3> {
        let [middle, u, v] = FACES[self.face];
        let along = |i: u32| 2.0 * f64::from(i) / f64::from(1u32 << self.level) - 1.0;
        let corner = |(i, j): (u32, u32)| middle + u * along(self.x + i) + v * along(self.y + j);
        [(0, 0), (1, 0), (1, 1), (0, 1)].map(corner).to_vec()
    }
}

/// A cell by how far its light strays from its mean; the one that strays most is the greatest.
struct Straying {
    strays: f64,
    cell: usize,
}

impl Ord for Straying {
    fn cmp(&self, other: &Self) -> Ordering {
        self.strays.total_cmp(&other.strays).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Straying {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Straying {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Straying {}

/// Light from a square of a face.
#[derive(Clone, Copy, Default)]
struct Sums {
    solid_angle: f64,
    /// Radiance times solid angle, and the same of the square of its luminance.
    light: Rgb,
    square: f64,
}

impl Sums {
    fn luminance(self) -> f64 {
        luminance(self.light)
    }

    /// Solid angle times how far radiance strays from its mean, root mean square, luminance.
    fn strays(self) -> f64 {
        (self.square * self.solid_angle - self.luminance().powi(2)).max(0.0).sqrt()
    }
}

impl std::ops::AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.solid_angle += other.solid_angle;
        self.light += other.light;
        self.square += other.square;
    }
}

/// The light from a face, of all squares from the whole down to the finest.
struct Pyramid {
    /// By level, row by row.
    levels: Vec<Vec<Sums>>,
}

impl Pyramid {
    /// Deals the light of an environment to the squares of all faces. Each texel is a few directions, as many as to leave no
    /// square without any: so a small bright one keeps its light, and an even sky is even.
    fn of_faces(environment: &Environment) -> Vec<Self> {
        let (width, height) = match &environment.sky {
            Sky::Map(map) => (map.width, map.height),
            Sky::Cie(_) => (2 * ROWS, ROWS),
        };
        let level = (height / 4).max(1).next_power_of_two().ilog2().clamp(LEAST_LEVEL + 2, MOST_LEVEL);
        let side = 1u32 << level;
        let within = |texels: u32, turn: u32| (4 * turn * side).div_ceil(texels).max(4);
        let (columns, rows) = (within(width, 4), within(height, 2));
        let mut finest = vec![vec![Sums::default(); (side * side) as usize]; FACES.len()];
        for y in 0..height {
            let part = texel_solid_angle(width, height, y) / f64::from(columns * rows);
            for (x, (i, j)) in
                (0..width).flat_map(|x| (0..columns * rows).map(move |k| (x, (k % columns, k / columns))))
            {
                let u = (f64::from(x) + (f64::from(i) + 0.5) / f64::from(columns)) / f64::from(width);
                let v = (f64::from(y) + (f64::from(j) + 0.5) / f64::from(rows)) / f64::from(height);
                let radiance = environment.radiance_at(u, v);
                let (face, place) = place(environment.direction(u, v), side);
                finest[face][place] +=
                    Sums { solid_angle: part, light: radiance * part, square: luminance(radiance).powi(2) * part };
            }
        }
        finest.into_iter().map(Self::over).collect()
    }

    /// All levels over the finest.
    fn over(finest: Vec<Sums>) -> Self {
        let mut levels = vec![finest];
        while levels[0].len() > 1 {
            let side = levels[0].len().isqrt();
            let mut coarser = vec![Sums::default(); levels[0].len() / 4];
            for (i, sums) in levels[0].iter().enumerate() {
                coarser[i / side / 2 * (side / 2) + i % side / 2] += *sums;
            }
            levels.insert(0, coarser);
        }
        Self { levels }
    }

    fn at(&self, level: u32, x: u32, y: u32) -> Sums {
        self.levels[level as usize][((y << level) + x) as usize]
    }

    fn finest(&self) -> u32 {
        self.levels.len() as u32 - 1
    }
}

/// The face that a direction meets, and the square there, of `side` × `side`.
fn place(direction: DVec3, side: u32) -> (usize, usize) {
    let axis = direction.abs().max_position();
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let [middle, u, v] = FACES[face];
    let along = |axis: DVec3| {
        let place = (axis.dot(direction) / middle.dot(direction) + 1.0) / 2.0;
        ((place * f64::from(side)) as usize).min(side as usize - 1)
    };
    (face, along(v) * side as usize + along(u))
}
