//! Adaptive progressive refinement in the image plane (J. Painter and K. Sloan, "Antialiased Ray Tracing by Adaptive Progressive
//! Refinement", SIGGRAPH 1989, section 3.1): where the next samples go, and when there are enough.
//!
//! One k-D tree covers the whole image plane. Above the pixel level the cell is parted whose area times external variance is
//! largest: so everything is looked at, borders first. Within a pixel that cell is parted which adds most to the variance of
//! the pixel's mean, and the pixel is closed off once that mean is known with the confidence asked for. A cell's sample stays
//! in its half when the cell is parted, and a new one is drawn from the other half: a hierarchy of jittered samples.
//!
//! What we do differently:
//! - Samples come in batches: not one walk after another from the root to the largest priority, but one walk over all that is
//!   not closed, and of what it finds the largest priorities at once. A batch can be evaluated in parallel, and what is in it
//!   depends on nothing but the seed.
//! - A pixel with several samples has the variance of its mean for a priority. By the external one, which its own samples do
//!   not lessen, every border would be finished before anything else is begun.
//! - A pixel that is known well enough waits until the cells around it are pixels, too, before it is closed.
//! - Beside the paper's rule for the variance of a mean there is one that keeps what it says ([`Rule`]).

use glam::{DVec2, Vec3};
use scene::Display;

use crate::cell::{Cell, Halves, MOST_PIXELS, pixels};
use crate::confidence::{Confidence, Interval};
use crate::evaluation::{Evaluation, Evaluator};
use crate::film::Tile;
use crate::kd_tree::{KdTree, MOST_SAMPLES, Sample, Slot, Visit};
use crate::sequence::scatter;
use crate::survey::{Part, Rule, Survey};

/// Samples of the first batches: work for all threads, and few enough that a small picture is not spent on them.
const FIRST_BATCH: usize = 512;

/// Part of all samples so far that a batch adds: more is decided at once on what was known before, less walks over the whole tree
/// for few.
const GROWTH: usize = 2;

/// One in so many cells of a batch is called urgent; a cell is in the same batch if its priority is at least such a fraction of the
/// least urgent one's. Where priorities differ much batches are smaller for it, and samples lie where they are needed most: an
/// unfinished picture has half the error. One in eight and 0.25 leave a third, at four fifths of the speed.
const URGENT: usize = 3;
const WORTHY: f32 = 0.3;

/// External variance that the most even cell is taken to have: something that no sample met may be in it. Without it, borders
/// that are known of are all refined before a lamp that is not, and an unfinished picture may be worse than one of even
/// samples; ten times as much leaves borders a fifth more error.
const EVEN: f32 = 1e-4;

/// Area, pixels, of the cells that are walked over at once. Less is more to put together, more keeps fewer threads busy.
const AT_ONCE: f32 = 4096.0;

/// What an adaptive picture is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveOptions {
    /// Pictures with different seeds have other samples; the same seed has the same.
    pub seed: u64,
    /// How the variance of a mean is told.
    pub rule: Rule,
    /// Probability with which a pixel's mean is to be within the interval, above 0 and below 1.
    pub level: f64,
    /// How far from the truth a pixel's mean may be.
    pub interval: Interval,
    /// Samples are compared as it shows them.
    pub display: Display,
}

impl AdaptiveOptions {
    /// For a display: 99 % and a step of 255, as in the paper's figures, by the calibrated rule.
    pub fn of(display: Display) -> Self {
        Self { seed: 1, rule: Rule::Calibrated, level: 0.99, interval: Interval::Linear(1.0 / 255.0), display }
    }
}

/// Samples of a picture, and where the next ones go.
///
/// Asked for a batch of points ([`AdaptiveSampler::next_batch`]) and told what is seen there ([`AdaptiveSampler::take`]), until
/// there are none: then every pixel is known with the confidence asked for.
pub struct AdaptiveSampler {
    size: [u32; 2],
    seed: u64,
    rule: Rule,
    confidence: Confidence,
    tree: KdTree,
    batch: Vec<Parting>,
    closed: u64,
    excluded: u64,
}

/// A cell that is to be parted: its sample stays in one half, the new one lies in the other.
struct Parting {
    slot: Slot,
    /// The half of the new sample, the first or the second.
    side: usize,
    half: Cell,
    place: [u32; 2],
    /// Radiance of the whole so far.
    before: Vec3,
}

/// What a walk finds.
#[derive(Default)]
struct Found {
    /// Cells that may be parted, with their priorities, in the order of the tree.
    open: Vec<(f32, Slot, Cell)>,
    /// Pixels to be closed.
    known: Vec<Slot>,
}

impl AdaptiveSampler {
    /// Begins a picture of so many pixels, at most [`MOST_PIXELS`] to a side, with one sample. None without pixels.
    pub fn new(width: u32, height: u32, options: &AdaptiveOptions, evaluate: &Evaluator<'_>) -> Option<Self> {
        let size = [width, height];
        if !size.iter().all(|side| (1..=MOST_PIXELS).contains(side)) {
            return None;
        }
        let whole = Cell::around(size);
        let place = whole.jittered(size, options.seed);
        let radiance = evaluate(pixels(place)).radiance;
        let is_number = radiance.is_finite();
        let first = if is_number { radiance } else { Vec3::ZERO };
        Some(Self {
            size,
            seed: options.seed,
            rule: options.rule,
            confidence: Confidence::new(options.level, options.interval),
            tree: KdTree::new(size, options.display, place, first),
            batch: Vec::new(),
            closed: 0,
            excluded: u64::from(!is_number),
        })
    }

    /// The points to be looked at next, at most so many; none when all pixels are closed.
    pub fn next_batch(&mut self, most: usize) -> Vec<DVec2> {
        let count = self.samples();
        let most = most.min((count / GROWTH).max(FIRST_BATCH)).min(MOST_SAMPLES - count);
        let root = self.tree.root();
        let mut found = if root.link().is_closed() { Found::default() } else { self.walk(&root) };
        for &slot in &found.known {
            self.tree.close(slot);
        }
        self.closed += found.known.len() as u64;
        keep_worthy(&mut found.open, most);
        keep_largest(&mut found.open, most, self.seed);
        let partings = found.open.iter().filter_map(|&(_, slot, cell)| self.parting(slot, &cell));
        self.batch = partings.collect();
        self.batch.iter().map(|parting| pixels(parting.place)).collect()
    }

    /// Takes what is seen at the points of the last batch, or at the first of them. What changed: the cells with another
    /// radiance than before.
    ///
    /// Radiance that is no finite number is excluded: the cell keeps what it had before.
    pub fn take(&mut self, seen: &[Evaluation]) -> Vec<Tile> {
        let (mut nodes, mut changes) = (Vec::with_capacity(seen.len()), Vec::with_capacity(seen.len()));
        for (parting, evaluation) in self.batch.drain(..).zip(seen) {
            let before = parting.before;
            let is_number = evaluation.radiance.is_finite();
            self.excluded += u64::from(!is_number);
            let radiance = if is_number { evaluation.radiance } else { before };
            let node = self.tree.part(parting.slot, parting.side, parting.place, radiance);
            nodes.push((parting.half.level() + 1, node));
            changes.push(Tile { bounds: parting.half.bounds(self.size), radiance, before });
        }
        self.tree.update(&nodes);
        changes
    }

    /// Samples so far.
    pub fn samples(&self) -> usize {
        self.tree.samples().len()
    }

    /// Samples whose radiance was no finite number.
    pub fn excluded(&self) -> u64 {
        self.excluded
    }

    /// Share of the pixels that are closed, 0..=1.
    pub fn closed_share(&self) -> f64 {
        self.closed as f64 / (f64::from(self.size[0]) * f64::from(self.size[1]))
    }

    /// Memory that samples and tree hold, bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// All samples: points, pixels, and radiance, W·sr⁻¹·m⁻², in the order in which they were taken.
    pub fn points(&self) -> impl Iterator<Item = (DVec2, Vec3)> {
        self.tree.samples().iter().map(|sample| (pixels(sample.place), sample.radiance))
    }

    /// The cells of all samples, in the order of the tree: they fill the picture.
    pub fn tiles(&self) -> Vec<Tile> {
        let mut tiles = Vec::with_capacity(self.samples());
        self.tree.leaves(&mut |cell, sample| {
            tiles.push(Tile { bounds: cell.bounds(self.size), radiance: sample.radiance, before: Vec3::ZERO });
        });
        tiles
    }

    /// How many samples lie in each pixel, row by row.
    pub fn samples_per_pixel(&self) -> Vec<u32> {
        let width = self.size[0] as usize;
        let mut counts = vec![0; width * self.size[1] as usize];
        for sample in self.tree.samples() {
            let [x, y] = sample.place.map(|unit| (unit >> crate::cell::PIXEL) as usize);
            counts[y * width + x] += 1;
        }
        counts
    }

    /// Looks at all below a cell that is not closed.
    fn walk(&self, visit: &Visit) -> Found {
        match self.tree.halves(visit) {
            [Some(first), Some(second)] if !visit.link().is_leaf() && visit.cell.area(self.size) > AT_ONCE => {
                let part = |half: &Visit| if half.link().is_closed() { Found::default() } else { self.walk(half) };
                let (mut found, mut other) = rayon::join(|| part(&first), || part(&second));
                found.open.append(&mut other.open);
                found.known.append(&mut other.known);
                found
            }
            _ => {
                let mut found = Found::default();
                self.sweep(visit, &mut Survey::new(self.rule), &mut found);
                found
            }
        }
    }

    fn sweep(&self, visit: &Visit, survey: &mut Survey, found: &mut Found) {
        let tree = &self.tree;
        if visit.cell.is_pixel() {
            return self.look_at_pixel(visit, survey, found);
        }
        if visit.link().is_leaf() && matches!(visit.cell.halves(self.size), Halves::Both(..)) {
            let priority = visit.cell.area(self.size) * (tree.spread(visit).external() + EVEN);
            return found.open.push((priority, visit.slot, visit.cell));
        }
        for half in tree.halves(visit).iter().flatten().filter(|half| !half.link().is_closed()) {
            self.sweep(half, survey, found);
        }
    }

    fn look_at_pixel(&self, pixel: &Visit, survey: &mut Survey, found: &mut Found) {
        // What is around it is looked at first: what a large cell's only sample says of its part next to a pixel is little.
        if !self.tree.is_surrounded(pixel) {
            return;
        }
        survey.look(&self.tree, pixel);
        let excess = self.confidence.excess(self.tree.mean(pixel.link()), survey.variance, survey.degrees);
        if excess <= 1.0 {
            return found.known.push(pixel.slot);
        }
        let parts = &mut survey.parts;
        let count = parts.len();
        let priority = if count == 1 { survey.external } else { survey.variance };
        let wanted = ((count as f32 * (excess.cbrt() - 1.0)).ceil() as usize).clamp(1, count);
        if wanted < count {
            let tie = |part: &Part| scatter(self.seed, part.cell.number());
            let order = |a: &Part, b: &Part| b.weight.total_cmp(&a.weight).then_with(|| tie(a).cmp(&tie(b)));
            parts.select_nth_unstable_by(wanted, order);
            parts.truncate(wanted);
        }
        // Of an even share of the variance, those that have less than half are not worth a sample yet.
        let least = 0.5 * survey.total / count as f32;
        if parts.iter().any(|part| part.weight >= least) {
            parts.retain(|part| part.weight >= least);
        }
        found.open.extend(parts.iter().map(|part| (priority + EVEN, part.slot, part.cell)));
    }

    /// How a leaf is parted; not at all if it is one unit.
    fn parting(&self, slot: Slot, cell: &Cell) -> Option<Parting> {
        let Halves::Both(_, halves) = cell.halves(self.size) else { return None };
        let Sample { place, radiance } = *self.tree.sample(self.tree.link_at(slot));
        let side = usize::from(halves[0].contains(place));
        let half = halves[side];
        Some(Parting { slot, side, half, place: half.jittered(self.size, self.seed), before: radiance })
    }
}

/// Keeps the cells that are worth a sample before others are looked at again.
fn keep_worthy(open: &mut Vec<(f32, Slot, Cell)>, most: usize) {
    let urgent = open.len().min(most) / URGENT;
    if urgent < FIRST_BATCH / (2 * URGENT) {
        return;
    }
    let mut priorities: Vec<f32> = open.iter().map(|cell| cell.0).collect();
    let (_, &mut of_urgent, _) = priorities.select_nth_unstable_by(urgent, |a, b| b.total_cmp(a));
    open.retain(|cell| cell.0 >= WORTHY * of_urgent);
}

/// Keeps so many of the largest priorities, in their order. Which of equal ones is chance.
fn keep_largest(open: &mut Vec<(f32, Slot, Cell)>, most: usize, seed: u64) {
    if open.len() <= most {
        return;
    }
    let order = |a: &(f32, u32), b: &(f32, u32)| {
        let tie = |place: u32| scatter(seed, place.into());
        b.0.total_cmp(&a.0).then_with(|| tie(a.1).cmp(&tie(b.1)))
    };
    let mut ranked: Vec<(f32, u32)> = open.iter().map(|cell| cell.0).zip(0..).collect();
    let (_, &mut first_left_out, _) = ranked.select_nth_unstable_by(most, order);
    let mut place = 0..;
    open.retain(|cell| place.next().is_some_and(|place| order(&(cell.0, place), &first_left_out).is_lt()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_pictures::{disk, display, holes};
    use crate::{Film, Filter};

    fn usual() -> AdaptiveOptions {
        AdaptiveOptions::of(display())
    }

    /// Samples until nothing is left to do or there are so many.
    fn refined(size: (u32, u32), options: &AdaptiveOptions, most: usize, evaluate: &Evaluator<'_>) -> AdaptiveSampler {
        let mut sampler = AdaptiveSampler::new(size.0, size.1, options, evaluate).expect("the size is one");
        loop {
            let batch = sampler.next_batch(most - sampler.samples());
            if batch.is_empty() {
                return sampler;
            }
            let seen: Vec<Evaluation> = batch.into_iter().map(evaluate).collect();
            sampler.take(&seen);
        }
    }

    /// The mean of what is shown of the disk over a pixel, by 64 × 64 points, which is good to 1e-3.
    fn truth(pixel: usize, width: u32) -> Vec3 {
        let corner = DVec2::new((pixel % width as usize) as f64, (pixel / width as usize) as f64);
        let place = |i: u32| corner + (DVec2::new(f64::from(i % 64), f64::from(i / 64)) + 0.5) / 64.0;
        (0..4096).map(|i| display().light(disk(place(i)).radiance)).sum::<Vec3>() / 4096.0
    }

    #[test]
    fn a_picture_without_pixels_or_with_too_many_is_none() {
        for (width, height) in [(0, 0), (0, 9), (9, 0), (MOST_PIXELS + 1, 1), (u32::MAX, u32::MAX)] {
            assert!(AdaptiveSampler::new(width, height, &usual(), &disk).is_none());
        }
    }

    #[test]
    fn one_pixel_is_a_picture() {
        let sampler = refined((1, 1), &usual(), 100, &|_| Evaluation { radiance: Vec3::ONE, object: 1, cost: 1 });
        assert_eq!((sampler.samples(), sampler.closed_share()), (1, 1.0));
        assert_eq!(
            sampler.tiles(),
            [Tile { bounds: [DVec2::ZERO, DVec2::ONE], radiance: Vec3::ONE, before: Vec3::ZERO }]
        );
    }

    #[test]
    fn of_what_is_even_every_pixel_gets_one_sample() {
        for size in [(64, 64), (37, 11), (1, 90), (5, 3)] {
            for rule in [Rule::Paper, Rule::Calibrated] {
                let even = |_: DVec2| Evaluation { radiance: Vec3::splat(0.3), object: 1, cost: 1 };
                let sampler = refined(size, &AdaptiveOptions { rule, ..usual() }, usize::MAX, &even);
                assert_eq!(sampler.closed_share(), 1.0);
                assert!(sampler.samples_per_pixel().iter().all(|&count| count == 1), "{size:?}");
            }
        }
    }

    #[test]
    fn samples_gather_at_the_border_and_means_are_right() {
        let sampler = refined((48, 32), &usual(), usize::MAX, &disk);
        assert_eq!(sampler.closed_share(), 1.0);
        let mut film = Film::new(48, 32, Filter::Box, Some(display()));
        film.add(&sampler.tiles());
        let (counts, picture) = (sampler.samples_per_pixel(), film.picture());
        let mut off = 0;
        for pixel in 0..48 * 32 {
            let centre = DVec2::new((pixel % 48) as f64 + 0.5, (pixel / 48) as f64 + 0.5);
            let from_border = (centre.distance(DVec2::new(20.0, 15.0)) - 13.5).abs();
            assert!(from_border < 2.5 || counts[pixel] == 1, "{} samples {from_border} from the border", counts[pixel]);
            off += u32::from((picture[pixel] - truth(pixel, 48)).abs().max_element() > 1.0 / 255.0);
        }
        assert!(off <= 15, "{off} of 1536 pixels are off by more than the interval");
        assert_eq!(counts.iter().sum::<u32>() as usize, sampler.samples());
        assert!(sampler.bytes() <= 64 * sampler.samples());
    }

    #[test]
    fn a_better_confidence_takes_more_samples_and_is_nearer() {
        let cost_and_error = |level: f64, interval: f64, rule: Rule| {
            let options = AdaptiveOptions { level, interval: Interval::Linear(interval), rule, ..usual() };
            let sampler = refined((48, 32), &options, usize::MAX, &disk);
            let mut film = Film::new(48, 32, Filter::Box, Some(display()));
            film.add(&sampler.tiles());
            let square = |(pixel, value): (usize, Vec3)| (value - truth(pixel, 48)).length_squared();
            let squares: f32 = film.picture().into_iter().enumerate().map(square).sum();
            (sampler.samples(), (squares / (3.0 * 48.0 * 32.0)).sqrt())
        };
        let base = cost_and_error(0.99, 0.02, Rule::Calibrated);
        let finer = cost_and_error(0.99, 0.005, Rule::Calibrated);
        let surer = cost_and_error(0.9999, 0.02, Rule::Calibrated);
        assert!(finer.0 > base.0 && finer.1 < base.1 / 2.0, "{base:?} {finer:?}");
        assert!(surer.0 > base.0 && surer.1 < base.1, "{base:?} {surer:?}");
        let papers = cost_and_error(0.99, 0.02, Rule::Paper);
        assert!(papers.0 < base.0 && papers.1 > base.1, "{base:?} {papers:?}");
    }

    #[test]
    fn the_same_seed_has_the_same_samples_on_any_number_of_threads() {
        let points = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let options = AdaptiveOptions { seed, ..usual() };
            pool.install(|| refined((200, 150), &options, 40_000, &disk).points().collect::<Vec<_>>())
        };
        let one = points(1, 7);
        assert!(one == points(3, 7) && one != points(1, 8));
        assert_eq!(one.len(), 40_000);
    }

    #[test]
    fn changes_add_up_to_the_whole() {
        let evaluate = |point: DVec2| {
            let lamp = point.distance(DVec2::new(11.0, 9.0)) < 3.0;
            Evaluation { radiance: Vec3::splat(if lamp { 1000.0 } else { disk(point).radiance.x }), ..disk(point) }
        };
        for filter in [Filter::Lanczos, Filter::Mitchell] {
            let mut sampler = AdaptiveSampler::new(48, 32, &usual(), &evaluate).expect("the size is one");
            let (mut running, mut whole) = (Film::new(48, 32, filter, None), Film::new(48, 32, filter, None));
            running.add(&sampler.tiles());
            loop {
                let batch = sampler.next_batch(usize::MAX);
                if batch.is_empty() {
                    break;
                }
                let seen: Vec<Evaluation> = batch.into_iter().map(evaluate).collect();
                running.add(&sampler.take(&seen));
            }
            whole.add(&sampler.tiles());
            for (a, b) in running.picture().into_iter().zip(whole.picture()) {
                assert!((a - b).abs().max_element() <= 1e-5, "{a} {b}");
            }
        }
    }

    #[test]
    fn what_is_no_number_is_excluded() {
        let sampler = refined((32, 32), &usual(), usize::MAX, &holes);
        let share = sampler.excluded() as f64 / sampler.samples() as f64;
        assert!((share - 0.1).abs() < 0.03 && sampler.closed_share() == 1.0, "{share}");
        assert!(sampler.points().all(|(_, radiance)| radiance.is_finite()));
        let nothing =
            refined((8, 8), &usual(), usize::MAX, &|_| Evaluation { radiance: Vec3::NAN, ..holes(DVec2::ONE) });
        assert_eq!((nothing.excluded(), nothing.samples()), (64, 64));
        assert!(nothing.tiles().iter().all(|tile| tile.radiance == Vec3::ZERO));
    }

    /// A lamp far brighter than white takes no more samples for it.
    #[test]
    fn beyond_white_nothing_is_told_apart() {
        let lamp = |bright: f32| {
            let evaluate = move |point: DVec2| Evaluation {
                radiance: if disk(point).object == 2 { Vec3::splat(bright) } else { Vec3::ZERO },
                ..disk(point)
            };
            refined((48, 32), &usual(), usize::MAX, &evaluate).samples()
        };
        assert_eq!(lamp(1e3), lamp(1e9));
    }

    /// Interrupted in the middle of a batch: what was seen counts, and it goes on.
    #[test]
    fn a_part_of_a_batch_may_be_taken() {
        let mut sampler = AdaptiveSampler::new(48, 32, &usual(), &disk).expect("the size is one");
        let mut look = |most: usize| {
            let batch = sampler.next_batch(usize::MAX);
            let seen: Vec<Evaluation> = batch.iter().map(|&point| disk(point)).take(most).collect();
            (sampler.take(&seen).len(), sampler.samples())
        };
        assert_eq!([look(99), look(99), look(99), look(99)], [(1, 2), (2, 4), (4, 8), (8, 16)]);
        assert_eq!(look(10), (10, 26));
        let seen = [disk(DVec2::ONE)];
        assert!(sampler.take(&seen).is_empty(), "the rest is forgotten");
        assert!(!sampler.next_batch(usize::MAX).is_empty());
    }
}
