//! A bake's costly questions, in the order in which they are asked: answered, or remembered from a bake that was interrupted.
//!
//! Between any two answers the bake may be stopped. From then on nothing is answered or remembered any more, and whoever asks
//! goes without: the answers are those to the first of all questions, whenever the bake was stopped.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use rayon::prelude::*;
use scene::{Answers, Seen};
use solver::{DirectIrradiance, Solution, Visibility};

use crate::forecast::{Forecast, Kind};
use crate::memory::{TYPICAL_ROW, emitted, row};
use crate::residual::ResidualPoint;
use crate::{Control, SampleQuery};

/// Groups of questions whose answers threads hold before they are kept. More hold what is kept twice, fewer make threads wait for each
/// other.
const AT_A_TIME: usize = 8192;

/// What is known, and what was asked so far of it.
pub(crate) struct Inquiry<'a> {
    control: Control<'a>,
    forecast: Forecast<'a>,
    answers: Answers,
    /// Whether the part of the sky is told from that of emitters.
    has_sky: bool,
    /// How many questions were asked, and how many answers of each kind were given.
    asked: usize,
    emitted: usize,
    rows: usize,
    residuals: usize,
    /// Bytes that may be held; that are held beside the answers, in answers that were given, and were at most.
    most_bytes: usize,
    held: usize,
    given: usize,
    row_bytes: usize,
    peak: usize,
    stopped: Option<Stop>,
}

/// Why a bake is stopped in its midst.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stop {
    Interrupted,
    Memory,
}

impl<'a> Inquiry<'a> {
    /// An inquiry that remembers `answers`, of a bake that may hold so many bytes.
    pub fn new(control: Control<'a>, solution: &Solution, answers: Answers, most_bytes: usize) -> Self {
        let has_sky = !solution.sky.cells.is_empty();
        // Only a forged file has others.
        let of_sky = if has_sky { answers.emitted.len() } else { 0 };
        let answers = if answers.sky.len() == of_sky { answers } else { Answers::default() };
        Self {
            control,
            forecast: Forecast::new(control, solution.visibility == Visibility::Rays, solution.reflects()),
            answers,
            has_sky,
            asked: 0,
            emitted: 0,
            rows: 0,
            residuals: 0,
            most_bytes,
            held: 0,
            given: 0,
            row_bytes: 0,
            peak: 0,
            stopped: None,
        }
    }

    /// A first look at the scene, which nobody remembers: it takes moments. `look` tells which part of it is done, 0..=1, and is told
    /// whether to go on.
    pub fn first_look<A>(&mut self, look: impl FnOnce(&(dyn Fn(f64) -> bool + Sync)) -> Option<A>) -> Option<A> {
        let stretch = self.forecast.stretch(Kind::FirstLook, 1.0);
        let found = look(&|part| {
            stretch.advance(part);
            !(self.control.interrupted)()
        });
        let seconds = stretch.seconds();
        self.forecast.end(Kind::FirstLook, seconds, 1.0);
        found
    }

    /// Takes note that leaves are as many times too coarse, in their error, as `excess` says.
    pub fn expect_division(&mut self, excess: f64) {
        self.forecast.expect_division(excess);
    }

    /// Takes note of the bytes that are held beside the answers.
    pub fn hold(&mut self, bytes: usize) {
        self.held = bytes;
        self.peak = self.peak.max(self.held + self.given);
    }

    /// Whether so many bytes may be held beside the answers; if not, the bake is stopped.
    pub fn has_room(&mut self, bytes: usize) -> bool {
        if self.stopped.is_none() && bytes + self.given > self.most_bytes {
            self.stopped = Some(Stop::Memory);
        }
        self.stopped.is_none()
    }

    /// The most bytes that were held.
    pub fn peak(&self) -> usize {
        self.peak
    }

    /// Whether the bake was stopped, so that some questions went without an answer.
    pub fn stopped(&self) -> bool {
        self.stopped.is_some()
    }

    /// If the bake was interrupted, the answers, those that were remembered and not yet asked for among them.
    pub fn into_answers(self) -> Option<Answers> {
        (self.stopped == Some(Stop::Interrupted)).then_some(self.answers)
    }

    /// The light of emitters and of the sky by its number.
    pub fn light(&self, number: u32) -> Vec3 {
        self.answers.emitted[number as usize]
    }

    /// Its part from the sky.
    pub fn light_of_sky(&self, number: u32) -> Vec3 {
        self.answers.sky.get(number as usize).copied().unwrap_or_default()
    }

    /// Whether there is such a part.
    pub fn has_sky(&self) -> bool {
        self.has_sky
    }

    /// A row by its number.
    pub fn row(&self, number: u32) -> &[Seen] {
        self.answers.rows.row(number as usize)
    }

    /// The light of emitters and of the sky at the first of the queries: all, unless the bake is stopped. `answer` finds it for
    /// queries of one element.
    pub fn emitted(
        &mut self,
        queries: &[&SampleQuery],
        answer: impl Fn(&[&SampleQuery]) -> Vec<DirectIrradiance> + Sync,
    ) -> Range<u32> {
        let (first, bytes) = (self.emitted, emitted(self.has_sky));
        if self.ask((0u8, queries.iter().map(|query| query.key())), queries.len() * bytes) {
            let known = queries.len().min(self.answers.emitted.len() - first);
            let has_sky = self.has_sky;
            self.find(Kind::Emitted, &by_element(&queries[known..]), answer, |answers, light| {
                if has_sky {
                    answers.sky.push(light.sky.as_vec3());
                }
                answers.emitted.push(light.total().as_vec3());
            });
            self.emitted = self.answers.emitted.len().min(first + queries.len());
            self.given += (self.emitted - first) * bytes;
        }
        first as u32..self.emitted as u32
    }

    /// The rows of the first of the queries: all, unless the bake is stopped. Rows name nodes below `nodes`.
    pub fn rows(
        &mut self,
        queries: &[&SampleQuery],
        nodes: usize,
        answer: impl Fn(&[&SampleQuery]) -> Vec<Box<[Seen]>> + Sync,
    ) -> Range<u32> {
        let first = self.rows;
        let expected = self.row_bytes.checked_div(first).unwrap_or(TYPICAL_ROW);
        if self.ask((1u8, queries.iter().map(|query| query.key())), queries.len() * expected) {
            let mut known = queries.len().min(self.answers.rows.len() - first);
            let is_strange = |row: &[Seen]| row.iter().any(|seen| seen.node as usize >= nodes);
            // Only a forged file has such.
            if let Some(strange) = (0..known).find(|row| is_strange(self.answers.rows.row(first + row))) {
                known = strange;
                self.rows = first + known;
                self.forget();
            }
            self.find(Kind::Rows, &by_element(&queries[known..]), answer, |answers, row| answers.rows.push(&row));
            self.rows = self.answers.rows.len().min(first + queries.len());
            let bytes = (first..self.rows).map(|number| row(self.answers.rows.row(number).len())).sum::<usize>();
            self.given += bytes;
            self.row_bytes += bytes;
        }
        first as u32..self.rows as u32
    }

    /// What is measured at the first of the points, triangles with barycentrics: at all, unless the bake is stopped.
    pub fn residuals(
        &mut self,
        points: &[(usize, f64, f64)],
        measure: impl Fn(usize, (usize, f64, f64)) -> ResidualPoint + Sync,
    ) -> Vec<ResidualPoint> {
        let first = self.residuals;
        let key = |&(triangle, s, t): &(usize, f64, f64)| (triangle, s.to_bits(), t.to_bits());
        if self.ask((2u8, points.iter().map(key)), 0) {
            let known = points.len().min(self.answers.residuals.len() - first);
            let unknown: Vec<usize> = (known..points.len()).collect();
            let answer = |numbers: &[usize]| {
                numbers.iter().map(|&number| measure(number, points[number]).numbers()).collect::<Vec<_>>()
            };
            self.find(Kind::Residuals, &unknown.chunks(1).collect::<Vec<_>>(), answer, |answers, point| {
                answers.residuals.push(point);
            });
            self.residuals = self.answers.residuals.len().min(first + points.len());
        }
        let known = self.answers.residuals[first..self.residuals].iter().zip(points);
        known.map(|(&numbers, point)| ResidualPoint::of(point.0 as u32, numbers)).collect()
    }

    /// Begins a question whose answers are expected to take so many bytes; not where the bake has been stopped, or is by them. If it
    /// is another one than was remembered in its place, nothing that was remembered from there on is taken for an answer.
    fn ask<K: Hash>(&mut self, (kind, keys): (u8, impl ExactSizeIterator<Item = K>), bytes: usize) -> bool {
        if !self.has_room(self.held + bytes) {
            return false;
        }
        self.peak = self.peak.max(self.held + self.given + bytes);
        let mut checksum = DefaultHasher::new();
        (kind, keys.len()).hash(&mut checksum);
        keys.for_each(|key| key.hash(&mut checksum));
        let checksum = checksum.finish();
        if self.answers.questions.get(self.asked) != Some(&checksum) {
            self.forget();
            self.answers.questions.truncate(self.asked);
            self.answers.questions.push(checksum);
        }
        self.asked += 1;
        true
    }

    /// Forgets the answers that have not been given yet.
    fn forget(&mut self) {
        self.answers.emitted.truncate(self.emitted);
        self.answers.sky.truncate(self.emitted);
        self.answers.rows.truncate(self.rows);
        self.answers.residuals.truncate(self.residuals);
    }

    /// Keeps the answers to the first of the questions, which are answered a group at a time: to all, unless the bake is stopped.
    /// Threads take groups one after another, so that hardly an answer is lost when they stop.
    fn find<Q: Sync, A: Send>(
        &mut self,
        kind: Kind,
        groups: &[&[Q]],
        answer: impl Fn(&[Q]) -> Vec<A> + Sync,
        keep: impl Fn(&mut Answers, A),
    ) {
        let done = AtomicUsize::new(0);
        let all = groups.iter().map(|group| group.len()).sum::<usize>() as f64;
        let stretch = self.forecast.stretch(kind, all);
        for groups in groups.chunks(AT_A_TIME) {
            let mut found: Vec<(usize, Vec<A>)> = groups
                .iter()
                .enumerate()
                .par_bridge()
                .filter_map(|(number, group)| {
                    let answer = (!(self.control.interrupted)()).then(|| (number, answer(group)));
                    stretch.advance((done.fetch_add(group.len(), Ordering::Relaxed) + group.len()) as f64 / all);
                    answer
                })
                .collect();
            found.sort_unstable_by_key(|answer| answer.0);
            let is_whole = found.len() == groups.len();
            let first = (0..).zip(found).take_while(|(place, (number, _))| place == number);
            first.flat_map(|(_, (_, answers))| answers).for_each(|answer| keep(&mut self.answers, answer));
            if !is_whole {
                self.stopped = Some(Stop::Interrupted);
                break;
            }
        }
        let seconds = stretch.seconds();
        self.forecast.end(kind, seconds, all);
    }
}

/// Queries of one element that stand together.
fn by_element<'a, 'q>(queries: &'a [&'q SampleQuery]) -> Vec<&'a [&'q SampleQuery]> {
    queries.chunk_by(|a, b| a.element == b.element).collect()
}
