//! What a block of a coherence map wants next (Guo 1998, sections 4.1 to 4.3): a pure function of the block and of what is
//! evaluated.

use std::ops::Range;

use glam::Vec2;

use crate::block::{Block, ELEMENTARY};
use crate::coherence_map::{CONTRAST, CoherenceMap, DARK, Kind, Leaf, contrast};
use crate::oriented_element::{Boundary, unit_vector};
use crate::simplicity::{Simplicity, simplicity};

/// Contrast of two pixels of a boundary from which on those between them are evaluated: finer than that of a block, for light
/// that is taken for linear here is so in the picture.
const FINE_CONTRAST: f32 = 0.02;

/// How far the middle of two pixels of a boundary may lie from their mean, relative to its luminance as shown, for light
/// between them to be linear.
const LINEAR: f32 = 0.02;

/// How far a simple block's pixel may lie from what its element says, relative to its luminance as shown (Guo's 1 %).
const TOLERANCE: f32 = 0.01;

/// What is to be done about a block.
pub(crate) enum Step {
    /// To evaluate some pixels.
    Evaluate(Vec<[u32; 2]>),
    /// To take it for something else.
    Is(Kind),
    /// To part it into such blocks.
    Part(Kind),
    /// Nothing: every pixel is evaluated.
    Done,
}

impl CoherenceMap {
    /// The next step of a block.
    pub(crate) fn step(&self, leaf: &Leaf) -> Step {
        let block = &leaf.block;
        if block.is_pixel() {
            let missing = self.missing(block.corners().into_iter());
            return if missing.is_empty() { Step::Done } else { Step::Evaluate(missing) };
        }
        match leaf.kind {
            Kind::Smooth => self.parted(block, Kind::Smooth),
            Kind::Edge if block.sides().into_iter().max() <= Some(2) => self.parted(block, Kind::Smooth),
            Kind::Edge => self.test(block),
            Kind::Simple { direction, grid } => self.verify(block, direction, grid),
            Kind::Complex { .. } => self.parted(block, Kind::Edge),
        }
    }

    /// Parts a block once the corners of its parts are evaluated.
    fn parted(&self, block: &Block, kind: Kind) -> Step {
        let missing = self.missing(block.parts().flat_map(|part| part.corners()));
        if missing.is_empty() { Step::Part(kind) } else { Step::Evaluate(missing) }
    }

    fn missing(&self, pixels: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
        pixels.filter(|&pixel| !self.image.has(pixel)).collect()
    }

    /// Evaluates an edge block's boundary, and tells whether it is simple.
    fn test(&self, block: &Block) -> Step {
        let count = block.perimeter();
        let around = |step: u32| block.on_boundary(step % count);
        let mut missing = Vec::new();
        let ([left, top], [right, bottom]) = (block.low, block.high);
        for y in [top, bottom] {
            self.bisect(&|x| [x, y], left..right, true, &mut missing);
        }
        for x in [left, right] {
            self.bisect(&|y| [x, y], top..bottom, true, &mut missing);
        }
        if !missing.is_empty() {
            return Step::Evaluate(missing);
        }
        let boundary = Boundary::of(block, &self.image);
        let mut object = 0;
        let values: Vec<(f32, u32)> = (0..count)
            .zip(boundary.values())
            .map(|(step, radiance)| {
                object = self.image.get(around(step)).map_or(object, |pixel| pixel.object);
                (self.shown(*radiance), object)
            })
            .collect();
        let is_even = contrast(values.iter().map(|value| value.0)) <= CONTRAST;
        match simplicity(block, &values, is_even, &|pixel| self.look(pixel)) {
            Simplicity::Wants(pixels) => Step::Evaluate(pixels),
            Simplicity::Simple => Step::Is(Kind::Simple { direction: self.direction(&boundary), grid: ELEMENTARY }),
            Simplicity::Complex => Step::Is(Kind::Complex { direction: self.direction(&boundary) }),
        }
    }

    /// What is missing between two evaluated pixels of a side: the middle, if it `is_wanted`, and once that is known the
    /// middles of the halves, if there is more in them than a line.
    fn bisect(&self, at: &dyn Fn(u32) -> [u32; 2], side: Range<u32>, is_wanted: bool, missing: &mut Vec<[u32; 2]>) {
        let length = side.end - side.start;
        if length < 2 || !is_wanted {
            return;
        }
        let middle = side.start + length.div_ceil(2).next_power_of_two();
        let [first, half, last] = [side.start, middle, side.end].map(|place| self.look(at(place)));
        let Some(half) = half else { return missing.push(at(middle)) };
        let (first, last) = (first.unwrap_or_default(), last.unwrap_or_default());
        let part = (middle - side.start) as f32 / length as f32;
        let said = first.0 + (last.0 - first.0) * part;
        let is_bent = (half.0 - said).abs() > LINEAR * (half.0 + DARK);
        for (ends, part) in [([first, half], side.start..middle), ([half, last], middle..side.end)] {
            let differs = contrast(ends.iter().map(|end| end.0)) > FINE_CONTRAST;
            let block = Block { low: at(part.start), high: at(part.end) };
            let is_wanted = ends[0].1 != ends[1].1 || (is_bent && differs) || self.lines.crosses(&block);
            self.bisect(at, part, is_wanted, missing);
        }
    }

    fn direction(&self, boundary: &Boundary) -> u8 {
        boundary.least_discrepancy(|radiance| self.options.compared(radiance))
    }

    /// Looks at a simple block on the next finer grid: it stays simple while its element says what is there.
    fn verify(&self, block: &Block, direction: u8, grid: u32) -> Step {
        let finer = grid / 2;
        if finer == 0 {
            return Step::Done;
        }
        let inside = |block: &Block| {
            let ([left, top], [right, bottom]) = (block.low, block.high);
            (top..=bottom).flat_map(move |y| (left..=right).map(move |x| [x, y]))
        };
        let missing = self.missing(inside(block).filter(|pixel| is_on_grid(block, *pixel, finer)));
        if !missing.is_empty() {
            return Step::Evaluate(missing);
        }
        let boundary = Boundary::of(block, &self.image);
        let is_as_said = |pixel: [u32; 2]| {
            let said = self.shown(boundary.along(unit_vector(direction), place(block, pixel)));
            let is = self.look(pixel).map_or(said, |seen| seen.0);
            (said - is).abs() <= TOLERANCE * is.max(DARK)
        };
        let is_inner =
            |[x, y]: &[u32; 2]| block.low[0] < *x && *x < block.high[0] && block.low[1] < *y && *y < block.high[1];
        let mut inner = inside(block).filter(|pixel| is_inner(pixel) && is_on_grid(block, *pixel, finer));
        if inner.all(is_as_said) {
            Step::Is(Kind::Simple { direction, grid: finer })
        } else {
            self.parted(block, Kind::Edge)
        }
    }
}

/// Where a pixel lies in a block, steps from its upper left corner.
pub(crate) fn place(block: &Block, [x, y]: [u32; 2]) -> Vec2 {
    Vec2::new((x - block.low[0]) as f32, (y - block.low[1]) as f32)
}

/// Whether a pixel lies on a grid over a block of so many steps, or on the grid's end.
fn is_on_grid(block: &Block, pixel: [u32; 2], grid: u32) -> bool {
    (0..2).all(|axis| (pixel[axis] - block.low[axis]).is_multiple_of(grid) || pixel[axis] == block.high[axis])
}
