//! Where lights stand in a sky, after Agarwal, Ramamoorthi, Belongie and Jensen, "Structured Importance Sampling of Environment
//! Maps", SIGGRAPH 2003: layers of brightness are cut into regions that hang together, each gets lights by its light and its
//! size, and within a region the next light goes where it is farthest from all others (Hochbaum and Shmoys 1985).
//!
//! What we do differently: regions of less than half a light get none, and what rounding leaves over goes to the largest
//! remainders, so that the number of lights is the one asked for. Strata are the Voronoi cells of all lights, not those within
//! a layer, and lights are relaxed to the middle of their cells: points that are as far from each other as can be have cells of
//! uneven shape, which doubles the error of irradiance.

use std::collections::VecDeque;

use glam::DVec3;
use rayon::prelude::*;
use scene::luminance;

use crate::kollig_keller::{RELAXATIONS, relax};
use crate::sky_pieces::SkyPieces;

/// Layers of brightness, the paper's number: a layer begins at each multiple of the standard deviation of radiance.
const LAYERS: u32 = 6;

/// The paper's exponent of solid angle in a region's importance: between sampling by light (0) and by area.
const AREA_EXPONENT: f64 = 0.25;

/// The solid angle, sr, below which a region is as important as if it were that large: the paper's, of half a degree's radius
/// or so.
const LEAST_ANGLE: f64 = 0.01;

/// Directions of so many lights, fewer where the sky has not as many pieces that are lit.
pub(crate) fn structured_directions(sky: &SkyPieces, count: usize) -> Vec<DVec3> {
    let regions = regions(sky);
    let shares = shares(sky, &regions, count);
    let mut placement = Placement::new(sky);
    // From the brightest layer down, as the paper has it: what lies below knows of the lights above.
    for (region, &share) in regions.iter().zip(&shares) {
        placement.fill(region, share);
    }
    let lit: Vec<u32> = (0..).zip(&sky.pieces).filter(|(_, piece)| is_lit(piece.irradiance)).map(|(i, _)| i).collect();
    placement.fill(&lit, count - placement.directions.len());
    let mut directions = placement.directions;
    relax(&sky.pieces, &mut directions, RELAXATIONS);
    directions
}

/// Whether light counts: any of it.
pub(crate) fn is_lit(light: scene::Rgb) -> bool {
    luminance(light) > 0.0
}

/// Pieces of every region, from those of the brightest layer to those of the whole sky.
fn regions(sky: &SkyPieces) -> Vec<Vec<u32>> {
    let radiance: Vec<f64> = sky.pieces.iter().map(|piece| luminance(piece.irradiance) / piece.solid_angle).collect();
    let weighted = |value: &dyn Fn(f64) -> f64| {
        let sum: f64 = radiance.iter().zip(&sky.pieces).map(|(&l, piece)| value(l) * piece.solid_angle).sum();
        sum / sky.pieces.iter().map(|piece| piece.solid_angle).sum::<f64>()
    };
    let mean = weighted(&|l| l);
    let deviation = weighted(&|l| (l - mean) * (l - mean)).sqrt();
    let mut regions = Vec::new();
    for layer in (0..LAYERS).rev() {
        let least = f64::from(layer) * deviation;
        let mut is_open: Vec<bool> = radiance.iter().map(|&l| l > 0.0 && l >= least).collect();
        for first in 0..radiance.len() {
            if !std::mem::take(&mut is_open[first]) {
                continue;
            }
            let (mut region, mut border) = (Vec::new(), VecDeque::from([first]));
            while let Some(piece) = border.pop_front() {
                region.push(piece as u32);
                for beside in sky.beside(piece) {
                    if std::mem::take(&mut is_open[beside]) {
                        border.push_back(beside);
                    }
                }
            }
            regions.push(region);
        }
    }
    regions
}

/// Lights of every region: as its importance L·min(Δω, Δω₀)^¼ of that of all.
fn shares(sky: &SkyPieces, regions: &[Vec<u32>], count: usize) -> Vec<usize> {
    let importance = |region: &Vec<u32>| {
        let pieces = || region.iter().map(|&piece| &sky.pieces[piece as usize]);
        let angle: f64 = pieces().map(|piece| piece.solid_angle).sum();
        pieces().map(|piece| luminance(piece.irradiance)).sum::<f64>() * angle.max(LEAST_ANGLE).powf(AREA_EXPONENT)
    };
    let importances: Vec<f64> = regions.iter().map(importance).collect();
    let all: f64 = importances.iter().sum();
    let exact = |importance: f64| if all > 0.0 { count as f64 * importance / all } else { 0.0 };
    let mut shares: Vec<usize> = importances.iter().map(|&importance| exact(importance) as usize).collect();
    let mut order: Vec<usize> = (0..regions.len()).collect();
    let remainder = |i: usize| exact(importances[i]).fract();
    order.sort_by(|&a, &b| remainder(b).total_cmp(&remainder(a)));
    let left = count - shares.iter().sum::<usize>().min(count);
    order.iter().take(left).filter(|&&i| remainder(i) >= 0.5).for_each(|&i| shares[i] += 1);
    shares
}

/// Lights in the making.
struct Placement<'a> {
    sky: &'a SkyPieces,
    directions: Vec<DVec3>,
    /// By piece, the cosine to the nearest light; 2 on a piece that has one.
    nearest: Vec<f32>,
}

impl<'a> Placement<'a> {
    fn new(sky: &'a SkyPieces) -> Self {
        Self { sky, directions: Vec::new(), nearest: vec![-2.0; sky.pieces.len()] }
    }

    /// Adds lights to a region, each as far as can be from all others; fewer if there is one on every piece.
    fn fill(&mut self, region: &[u32], count: usize) {
        for _ in 0..count {
            let farthest = region.iter().copied().min_by(|&a, &b| {
                let by = |piece: u32| self.nearest[piece as usize];
                // The first light of all goes to the brightest piece.
                let light = |piece: u32| luminance(self.sky.pieces[piece as usize].irradiance);
                by(a).total_cmp(&by(b)).then(light(b).total_cmp(&light(a)))
            });
            let Some(piece) = farthest.filter(|&piece| self.nearest[piece as usize] < 2.0) else { return };
            let direction = self.sky.pieces[piece as usize].direction;
            self.directions.push(direction);
            self.nearest.par_iter_mut().zip(&self.sky.pieces).for_each(|(nearest, piece)| {
                *nearest = nearest.max(direction.dot(piece.direction) as f32);
            });
            self.nearest[piece as usize] = 2.0;
        }
    }
}
