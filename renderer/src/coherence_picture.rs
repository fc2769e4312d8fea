//! Pictures of a coherence map, at any time (Guo 1998, sections 2 and 5): of the work image no more than strips are made, and
//! what is evaluated is never overwritten.

use std::ops::Range;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use scene::Display;

use crate::block::{Block, ELEMENTARY};
use crate::coherence_map::{CoherenceMap, Kind, Leaf};
use crate::coherence_step::place;
use crate::filter::Filter;
use crate::oriented_element::{Boundary, DIRECTIONS, unit_vector};
use crate::reduction::Reduction;

/// Rows of the picture that are made at once; fewer have more rows of the work image in common with their neighbours.
const BAND: u32 = 32;

impl CoherenceMap {
    /// The picture so far, row by row: radiance, W·sr⁻¹·m⁻², or what a display shows, through a filter. Of the work image no
    /// more than strips are made.
    pub fn picture(&self, filter: Filter, display: Option<Display>) -> Vec<Vec3> {
        let [width, height] = self.image.size();
        let reduction = Reduction::new(filter, self.options.supersample);
        let rows = height / self.options.supersample;
        let in_strips = self.leaves_in_strips();
        let band = |first: u32| {
            let rows = first * BAND..rows.min((first + 1) * BAND);
            let of_work = reduction.rows(&rows, height);
            let mut strip = self.strip(&of_work, &in_strips);
            if let Some(display) = display {
                strip.iter_mut().for_each(|radiance| *radiance = display.light(*radiance));
            }
            reduction.reduce(&rows, width, &strip, &of_work)
        };
        (0..rows.div_ceil(BAND)).into_par_iter().flat_map_iter(band).collect()
    }

    /// The work image as far as it is known, row by row: radiance, W·sr⁻¹·m⁻².
    pub fn work_image(&self) -> Vec<Vec3> {
        self.strip(&(0..self.image.size()[1]), &self.leaves_in_strips())
    }

    /// The map itself, as large as the work image: evaluated pixels white; smooth blocks black, and those with a direction of its
    /// colour, full where they are simple, pale where they are to be parted; blocks in the making grey.
    pub fn map(&self) -> Vec<[u8; 3]> {
        let [width, height] = self.image.size();
        let mut map = vec![[0; 3]; self.pixels()];
        let at = |[x, y]: [u32; 2]| (y * width + x) as usize;
        for leaf in self.leaves.iter().filter(|leaf| leaf.block.is_elementary()) {
            let [columns, rows] = self.own(&leaf.block);
            let colour = match leaf.kind {
                Kind::Smooth => [0; 3],
                Kind::Edge => [128; 3],
                Kind::Simple { direction, .. } => hue(direction).map(|channel| (channel * 230.0) as u8),
                Kind::Complex { direction } => hue(direction).map(|channel| (channel * 100.0) as u8 + 60),
            };
            rows.flat_map(|y| columns.clone().map(move |x| [x, y])).for_each(|pixel| map[at(pixel)] = colour);
        }
        self.image.in_rows(0..height).for_each(|(pixel, _)| map[at(pixel)] = [255; 3]);
        map
    }

    /// By elementary rows, the leaves that have pixels in them.
    fn leaves_in_strips(&self) -> Vec<Vec<u32>> {
        let mut strips = vec![Vec::new(); self.image.size()[1].div_ceil(ELEMENTARY) as usize];
        for (number, leaf) in (0..).zip(&self.leaves) {
            let rows = self.own(&leaf.block)[1].clone();
            for strip in &mut strips[(rows.start / ELEMENTARY) as usize..rows.end.div_ceil(ELEMENTARY) as usize] {
                strip.push(number);
            }
        }
        strips
    }

    /// Columns and rows of the pixels that are a block's own: those on its right and lower side are its neighbours', if there
    /// are any.
    fn own(&self, block: &Block) -> [Range<u32>; 2] {
        let size = self.image.size();
        [0, 1].map(|axis| {
            let is_last = block.high[axis] + 1 == size[axis];
            block.low[axis]..block.high[axis] + u32::from(is_last)
        })
    }

    /// Rows of the work image.
    fn strip(&self, rows: &Range<u32>, in_strips: &[Vec<u32>]) -> Vec<Vec3> {
        let width = self.image.size()[0] as usize;
        let mut strip = vec![Vec3::ZERO; width * rows.len()];
        if self.image.evaluated() == 0 {
            return strip;
        }
        let mut put = |[x, y]: [u32; 2], radiance: Vec3| {
            if rows.contains(&y) {
                strip[(y - rows.start) as usize * width + x as usize] = radiance;
            }
        };
        for some in (rows.start / ELEMENTARY)..rows.end.div_ceil(ELEMENTARY) {
            let of_strip = (some * ELEMENTARY).max(rows.start)..((some + 1) * ELEMENTARY).min(rows.end);
            for &leaf in &in_strips[some as usize] {
                let leaf = &self.leaves[leaf as usize];
                let [columns, own_rows] = self.own(&leaf.block);
                let own_rows = own_rows.start.max(of_strip.start)..own_rows.end.min(of_strip.end);
                self.draw(leaf, columns, own_rows, &mut put);
            }
        }
        for (pixel, evaluated) in self.image.in_rows(rows.clone()) {
            put(pixel, evaluated.radiance);
        }
        strip
    }

    /// Light of some of a leaf's pixels.
    fn draw(&self, leaf: &Leaf, columns: Range<u32>, rows: Range<u32>, put: &mut impl FnMut([u32; 2], Vec3)) {
        let block = &leaf.block;
        let pixels = rows.flat_map(|y| columns.clone().map(move |x| [x, y]));
        let sides = block.sides().map(|side| side.max(1) as f32);
        let corners = block.corners().map(|corner| self.image.get(corner).map_or(Vec3::ZERO, |pixel| pixel.radiance));
        let bilinear = |pixel: [u32; 2]| {
            let part = place(block, pixel) / Vec2::from_array(sides);
            corners[0].lerp(corners[1], part.x).lerp(corners[3].lerp(corners[2], part.x), part.y)
        };
        if !block.is_elementary() || block.sides().contains(&0) {
            return pixels.for_each(|pixel| put(pixel, bilinear(pixel)));
        }
        let boundary = Boundary::of(block, &self.image);
        // Of a block in the making, too few pixels are known to tell a direction.
        let direction = match leaf.kind {
            Kind::Smooth | Kind::Edge if !boundary.is_refined => {
                return pixels.for_each(|pixel| put(pixel, bilinear(pixel)));
            }
            Kind::Smooth | Kind::Edge => None,
            Kind::Simple { direction, .. } | Kind::Complex { direction } => Some(direction),
        };
        for pixel in pixels {
            let place = place(block, pixel);
            let is_inner = pixel[0] != block.low[0]
                && pixel[1] != block.low[1]
                && pixel[0] != block.high[0]
                && pixel[1] != block.high[1];
            let radiance = match direction {
                Some(index) if is_inner => boundary.along(unit_vector(index), place),
                _ => boundary.blended(place),
            };
            put(pixel, radiance);
        }
    }
}

/// The colour of a direction, red, green and blue in 0..=1: directions that are alike have colours that are.
fn hue(direction: u8) -> [f32; 3] {
    let turn = f32::from(direction) / DIRECTIONS as f32;
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| 0.5 + 0.5 * (std::f32::consts::TAU * (turn - shift)).cos())
}
