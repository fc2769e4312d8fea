//! Directional coherence maps (B. Guo, "Progressive Radiance Evaluation Using Directional Coherence Maps", SIGGRAPH 1998):
//! which pixels of a work image are evaluated next, and the picture that is made of few of them.
//!
//! The image plane is parted into blocks. A smooth one is known at its corners. An edge block's boundary is evaluated, and if it is
//! simple, crossed by one edge at most, its light goes along the direction of least discrepancy ([`crate::oriented_element`]); what
//! turns out not to be simple is parted. When every block is a pixel the picture is the full one.
//!
//! What we do differently:
//! - A block's next step is a pure function of the block and of what is evaluated, and the most urgent blocks take theirs
//!   first: the paper takes all blocks of a size through each step. So any budget is spent where most is to be gained.
//! - Even order (figure 9) goes to the middle of each side. From there on halves are evaluated only where a middle was not as
//!   its ends said: a wide penumbra takes two pixels a block, a sharp edge five, where the paper takes fourteen.
//! - A simple block is not parted while it proves simple. It is looked at on a grid that is halved each time, and keeps its
//!   element: the paper parts it and hands the element down.
//! - Blocks share the pixels of their boundaries, and blend what is evaluated there (Coons) where the paper is bilinear.

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use scene::{Display, Exposure, ToneCurve, luminance};

use crate::block::{Block, ELEMENTARY};
use crate::cell::MOST_PIXELS;
use crate::coherence_step::Step;
use crate::evaluation::Evaluation;
use crate::line_grid::LineGrid;
use crate::visible_lines::VisibleLine;
use crate::work_image::{WorkImage, WorkPixel};

/// Contrast of a block's corners from which on it is an edge block (Guo's t_c).
pub(crate) const CONTRAST: f32 = 0.05;

/// How urgent blocks are, for the range of their light: those that are known to be complex and their parts, those that seem
/// simple, and smooth ones; an elementary edge block has 1. Less for simple ones misses what is inside, more looks again at
/// what is good already.
const KNOWN: f32 = 3.0;
const SIMPLE: f32 = 0.05;
const SMOOTH: f32 = 0.1;

/// What a line is taken to hide, as a part of the light around it.
const HIDDEN: f32 = 0.5;

/// What the parts of a complex block are taken to have at least of its range.
const INHERITED: f32 = 0.5;

/// Luminance, as shown, that contrast is at least told in comparison to: a step of a display, below which nothing is seen.
pub(crate) const DARK: f32 = 1.0 / 255.0;

/// Pixels of the first batches: work for some threads. With 512 a small image is spent on what was urgent before anything was
/// known: a straight edge then has four times the error from a tenth of its pixels.
const FIRST_BATCH: usize = 32;

/// Part of all pixels so far that a batch adds: less is more often told anew what is urgent.
const GROWTH: usize = 8;

/// What a coherence map is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoherenceOptions {
    /// Pixels of the work image along a side of each of the picture's, at least 1 (Guo has 3).
    pub supersample: u32,
    /// What light is exposed with before it is compared: white is 1.
    pub exposure: Exposure,
    /// Of a picture for a display, the curve that light is compared by; without one it is compared beyond white, too.
    pub curve: Option<ToneCurve>,
}

impl CoherenceOptions {
    /// Light as it is compared: exposed, and by the curve of a display.
    pub(crate) fn compared(&self, radiance: Vec3) -> Vec3 {
        let Self { exposure, curve, .. } = *self;
        curve.map_or(radiance * exposure.factor(), |curve| Display::new(exposure, curve).light(radiance))
    }
}

/// A coherence map in the making.
///
/// Asked for a batch of points ([`CoherenceMap::next_batch`]) and told what is seen there ([`CoherenceMap::take`]), until there
/// are none: then every pixel of the work image is evaluated.
pub struct CoherenceMap {
    pub(crate) options: CoherenceOptions,
    pub(crate) image: WorkImage,
    pub(crate) lines: LineGrid,
    /// They fill the image.
    pub(crate) leaves: Vec<Leaf>,
    batch: Vec<[u32; 2]>,
    excluded: u64,
}

/// A block that is not parted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaf {
    pub block: Block,
    pub kind: Kind,
    /// Larger is looked at first; 0 where nothing is left to do.
    urgency: f32,
}

/// What a block is taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Known at its corners.
    Smooth,
    /// Crossed by something; its boundary is being evaluated.
    Edge,
    /// Crossed by one edge at most, in a direction; it was looked at on a grid of so many steps.
    Simple { direction: u8, grid: u32 },
    /// To be parted, every part with its boundary.
    Complex { direction: u8 },
}

impl CoherenceMap {
    /// Begins a map for a picture of so many pixels, in which lines are known that may be edges. None without pixels or
    /// supersamples, and of a work image with more than [`MOST_PIXELS`] to a side.
    pub fn new(width: u32, height: u32, options: &CoherenceOptions, lines: &[VisibleLine]) -> Option<Self> {
        let [width, height] = [width, height].map(|side| side.checked_mul(options.supersample).unwrap_or(0));
        if ![width, height].iter().all(|side| (1..=MOST_PIXELS).contains(side)) {
            return None;
        }
        let whole = Block { low: [0, 0], high: [width - 1, height - 1] };
        let leaves = vec![Leaf { block: whole, kind: Kind::Smooth, urgency: f32::INFINITY }];
        let lines = LineGrid::new(lines, [width, height], options.supersample);
        let image = WorkImage::new(width, height);
        Some(Self { options: *options, image, lines, leaves, batch: Vec::new(), excluded: 0 })
    }

    /// Pixels of the work image that are evaluated, at least, before its blocks are elementary: with fewer the picture is worth
    /// little.
    pub fn least(width: u32, height: u32, supersample: u32) -> u64 {
        let corners =
            |side: u32| (u64::from(side) * u64::from(supersample)).saturating_sub(1).div_ceil(ELEMENTARY.into()) + 1;
        corners(width) * corners(height)
    }

    /// The points to be looked at next, at most so many, in pixels of the picture; none when all are evaluated.
    pub fn next_batch(&mut self, most: usize) -> Vec<DVec2> {
        let most = most.min((self.image.evaluated() / GROWTH).max(FIRST_BATCH));
        self.batch.clear();
        while self.batch.is_empty() && most > 0 {
            let urgent = self.most_urgent(most);
            if urgent.is_empty() {
                break;
            }
            let steps: Vec<Step> = urgent.par_iter().map(|&leaf| self.step(&self.leaves[leaf as usize])).collect();
            for (leaf, step) in urgent.into_iter().zip(steps) {
                self.apply(leaf as usize, step);
            }
        }
        // Neighbours ask for the same pixels.
        self.batch.truncate(most);
        self.batch.sort_unstable_by_key(|&[x, y]| (y / ELEMENTARY, x / ELEMENTARY, y, x));
        self.batch.dedup();
        self.batch.iter().map(|&pixel| self.point(pixel)).collect()
    }

    /// Takes what is seen at the points of the last batch, or at the first of them.
    ///
    /// Radiance that is no finite number is excluded: the pixel has that of an evaluated one near it.
    pub fn take(&mut self, seen: &[Evaluation]) {
        let batch: Vec<_> = std::mem::take(&mut self.batch).into_iter().zip(seen).collect();
        let (numbers, others): (Vec<_>, Vec<_>) = batch.into_iter().partition(|(_, seen)| seen.radiance.is_finite());
        for (pixel, &Evaluation { radiance, object, .. }) in numbers {
            self.insert(pixel, radiance, object);
        }
        self.excluded += others.len() as u64;
        for (pixel, &Evaluation { object, .. }) in others {
            let radiance = self.radiance_near(pixel);
            self.insert(pixel, radiance, object);
        }
    }

    fn insert(&mut self, pixel: [u32; 2], radiance: Vec3, object: u32) {
        let shown = self.shown(radiance);
        self.image.insert(pixel, WorkPixel { radiance, shown, object });
    }

    /// Pixels of the work image that are evaluated.
    pub fn evaluated(&self) -> usize {
        self.image.evaluated()
    }

    /// Columns and rows of the work image.
    pub fn work_size(&self) -> [u32; 2] {
        self.image.size()
    }

    /// All of its pixels.
    pub fn pixels(&self) -> usize {
        let [width, height] = self.image.size().map(|side| side as usize);
        width * height
    }

    /// Evaluated pixels whose radiance was no finite number.
    pub fn excluded(&self) -> u64 {
        self.excluded
    }

    /// Memory of evaluated pixels and blocks, bytes.
    pub fn bytes(&self) -> usize {
        self.image.bytes() + self.leaves.capacity() * size_of::<Leaf>()
    }

    /// How many of its pixels in the work image are evaluated, for each of the picture, row by row.
    pub fn samples_per_pixel(&self) -> Vec<u32> {
        let [width, height] = self.image.size();
        let (columns, rows) = (width / self.options.supersample, height / self.options.supersample);
        let mut counts = vec![0; (columns * rows) as usize];
        for ([x, y], _) in self.image.in_rows(0..height) {
            counts[(y / self.options.supersample * columns + x / self.options.supersample) as usize] += 1;
        }
        counts
    }

    /// The point of the picture that a pixel of the work image is evaluated at: its centre.
    fn point(&self, [x, y]: [u32; 2]) -> DVec2 {
        (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(self.options.supersample)
    }

    /// The luminance that a display shows.
    pub(crate) fn shown(&self, radiance: Vec3) -> f32 {
        luminance(self.options.compared(radiance).as_dvec3()) as f32
    }

    pub(crate) fn look(&self, pixel: [u32; 2]) -> Option<(f32, u32)> {
        self.image.get(pixel).map(|pixel| (pixel.shown, pixel.object))
    }

    /// The radiance of an evaluated pixel near another, at a power of two of pixels along rows, columns and diagonals, where
    /// the corners of blocks are; black if nothing is evaluated there.
    fn radiance_near(&self, [x, y]: [u32; 2]) -> Vec3 {
        let [width, height] = self.image.size();
        let ways = [(0, -1), (-1, 0), (1, 0), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
        let near = (0..MOST_PIXELS.ilog2()).flat_map(|power| ways.map(|(right, down)| (right << power, down << power)));
        let places = near.filter_map(|(right, down)| Some([x.checked_add_signed(right)?, y.checked_add_signed(down)?]));
        let mut found = places.filter(|&[x, y]| x < width && y < height).filter_map(|place| self.image.get(place));
        found.next().map_or(Vec3::ZERO, |pixel| pixel.radiance)
    }

    /// The most urgent leaves, at most so many, the most urgent first; of equal ones the first.
    fn most_urgent(&self, most: usize) -> Vec<u32> {
        let mut open: Vec<u32> =
            (0..self.leaves.len() as u32).filter(|&leaf| self.leaves[leaf as usize].urgency > 0.0).collect();
        let urgency = |leaf: u32| self.leaves[leaf as usize].urgency;
        let order = |a: &u32, b: &u32| urgency(*b).total_cmp(&urgency(*a)).then(a.cmp(b));
        if open.len() > most {
            open.select_nth_unstable_by(most, order);
            open.truncate(most);
        }
        open.sort_unstable_by(order);
        open
    }

    fn apply(&mut self, leaf: usize, step: Step) {
        let block = self.leaves[leaf].block;
        match step {
            Step::Evaluate(pixels) => self.batch.extend(pixels),
            Step::Is(kind) => self.leaves[leaf] = self.leaf(block, kind, 0.0),
            Step::Done => self.leaves[leaf].urgency = 0.0,
            Step::Part(kind) => {
                let [low, high] = if kind == Kind::Edge { self.range(&block) } else { [0.0; 2] };
                let expected = INHERITED * (high - low);
                let mut parts =
                    block.parts().map(|part| self.leaf(part, kind, expected)).collect::<Vec<Leaf>>().into_iter();
                if let Some(first) = parts.next() {
                    self.leaves[leaf] = first;
                }
                self.leaves.extend(parts);
            }
        }
    }

    /// A block whose corners are evaluated, as far as its kind is known; a smooth one is classified.
    fn leaf(&self, block: Block, kind: Kind, expected: f32) -> Leaf {
        let corners = block.corners().map(|corner| self.look(corner).unwrap_or_default());
        let is_edge = kind == Kind::Smooth && block.is_elementary() && {
            contrast(corners.iter().map(|corner| corner.0)) > CONTRAST
                || corners.iter().any(|corner| corner.1 != corners[0].1)
                || self.lines.crosses(&block)
        };
        let kind = if is_edge { Kind::Edge } else { kind };
        Leaf { block, kind, urgency: self.urgency(&block, kind, expected) }
    }

    /// What may be gained by a look at a block: about the light that may be off there, for each pixel that the look takes.
    fn urgency(&self, block: &Block, kind: Kind, expected: f32) -> f32 {
        let side = block.sides().into_iter().max().unwrap_or(0);
        if block.is_pixel() {
            return 0.0;
        }
        if !block.is_elementary() {
            return f32::INFINITY;
        }
        let [low, high] = self.range(block);
        let of_elementary = side as f32 / ELEMENTARY as f32;
        match kind {
            Kind::Edge if side > ELEMENTARY / 2 => {
                // What a line parts may be as dark as it likes.
                let hidden = if self.lines.crosses(block) { HIDDEN * high } else { 0.0 };
                (high - low).max(hidden) + DARK
            }
            Kind::Edge | Kind::Complex { .. } => KNOWN * ((high - low).max(expected) + DARK) * of_elementary,
            Kind::Simple { grid, .. } => SIMPLE * (high - low + DARK) * (grid as f32 / ELEMENTARY as f32),
            Kind::Smooth => SMOOTH * (high - low + 0.1 * DARK) * of_elementary,
        }
    }

    /// The darkest and brightest of a block's boundary, as far as it is evaluated.
    fn range(&self, block: &Block) -> [f32; 2] {
        let seen = (0..block.perimeter()).filter_map(|step| self.look(block.on_boundary(step)));
        seen.fold([f32::MAX, 0.0], |[low, high], (light, _)| [low.min(light), high.max(light)])
    }
}

/// Contrast of luminances as shown (Mitchell 1987): (high − low) ÷ (high + low).
pub(crate) fn contrast(luminances: impl Iterator<Item = f32>) -> f32 {
    let (low, high) = luminances.fold((f32::MAX, 0f32), |(low, high), light| (low.min(light), high.max(light)));
    if low > high { 0.0 } else { (high - low) / (high + low + DARK) }
}

#[cfg(test)]
mod tests;
