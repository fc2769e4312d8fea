//! How much of a bake is done: a forecast of its time, by what its questions have taken so far.
//!
//! Nothing but the bar that a person watches depends on it. What is to come is not known before it is there (how many leaves will
//! be divided, and whether a round will do), so it is guessed by what it was in offices and halls, in units of what is known.

use std::time::Instant;

use crate::Control;
use crate::residual::POINTS;

/// A kind of question.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    FirstLook,
    Emitted,
    Rows,
    Residuals,
}

/// Time of all else in that of a first look from one point of every leaf, before anything else is known. Halls take 12 to 65,
/// the larger the less, an office 36, a row of rooms 125.
const ALL_BY_FIRST_LOOK: f64 = 20.0;

/// Time of the first rows of all samples, in that of the rows of probes alone before; and in that of all looks at emitters
/// so far, before either is known. The office and halls take 6 to 17, and 1 to 36.
const FROM_SAMPLES: f64 = 8.0;
const FROM_SAMPLES_BY_EMITTED: f64 = 4.0;

/// Time of all later looks of a round in that of the first one, before an error is known; with links, and by rays, which divide
/// few leaves.
const LATER_LOOKS: [f64; 2] = [1.3, 0.15];

/// The power of an error that the number of leaves grows with until they keep what is allowed: the error of a quadratic falls
/// with the cube of their length.
const LEAVES_BY_ERROR: f64 = 2.0 / 3.0;

/// Time of one point of the residual, in that of a row; with links, and by rays.
const POINT_BY_ROW: [f64; 2] = [6.0, 2.0];

/// Time of later rounds, in that of all before: while it is not known whether there will be one, and once it is.
const MAYBE_ROUND: f64 = 0.15;
const NEXT_ROUND: f64 = 0.5;

/// What meshing and the exchange of light take with each second of questions, at first, and at most.
const BESIDE: f64 = 1.25;
const MOST_BESIDE: f64 = 3.0;

/// The time that a bake has taken and is expected to take, seconds.
pub(crate) struct Forecast<'a> {
    control: Control<'a>,
    start: Instant,
    by_rays: bool,
    reflects: bool,
    /// Of all questions, and of all looks.
    asked: f64,
    looked: f64,
    looks: u32,
    /// Expected of this round's further looks.
    left: f64,
    /// Of a residual: measured, or expected from what a row takes.
    residual: f64,
}

/// The forecast for one question.
pub(crate) struct Stretch<'f, 'a> {
    forecast: &'f Forecast<'a>,
    kind: Kind,
    count: f64,
    start: Instant,
}

impl<'a> Forecast<'a> {
    /// A bake that begins now.
    pub fn new(control: Control<'a>, by_rays: bool, reflects: bool) -> Self {
        let start = Instant::now();
        Self { control, start, by_rays, reflects, asked: 0.0, looked: 0.0, looks: 0, left: 0.0, residual: 0.0 }
    }

    /// A question of so many parts that begins now.
    pub fn stretch(&self, kind: Kind, count: f64) -> Stretch<'_, 'a> {
        Stretch { forecast: self, kind, count, start: Instant::now() }
    }

    /// Takes note of the error that the light over reflectors has, in parts of what is allowed: 1 needs no more looks.
    pub fn expect_division(&mut self, excess: f64) {
        if excess <= 1.0 {
            self.left = 0.0;
        } else if !self.by_rays {
            self.left = self.looked * (excess.powf(LEAVES_BY_ERROR) - 1.0);
        }
    }

    /// Takes note of what a question has taken. One that was remembered tells nothing.
    pub fn end(&mut self, kind: Kind, seconds: f64, count: f64) {
        if count == 0.0 {
            return;
        }
        (self.left, self.residual) = self.after(kind, seconds, count);
        self.asked += seconds;
        match kind {
            Kind::Rows => {
                self.looked += seconds;
                self.looks += 1;
            }
            Kind::Residuals => {
                self.left = NEXT_ROUND * self.asked;
                self.residual = seconds;
            }
            Kind::FirstLook | Kind::Emitted => (),
        }
    }

    /// Expected of further looks and of the residual, after a question that takes so many seconds for so many parts.
    fn after(&self, kind: Kind, seconds: f64, count: f64) -> (f64, f64) {
        let by_kind = usize::from(self.by_rays);
        let later = LATER_LOOKS[by_kind];
        let residual = POINTS as f64 * POINT_BY_ROW[by_kind] * seconds / count;
        match (kind, self.looks) {
            (Kind::FirstLook, _) => (ALL_BY_FIRST_LOOK * seconds, 0.0),
            (Kind::Residuals, _) => (0.0, 0.0),
            (Kind::Emitted, _) if !self.reflects => (seconds, 0.0),
            (Kind::Emitted, 0) => (FROM_SAMPLES_BY_EMITTED * (self.asked + seconds) * (1.0 + later), self.residual),
            (Kind::Rows, 0) => (FROM_SAMPLES * seconds * (1.0 + later), residual),
            (Kind::Rows, 1) => (later * seconds, residual),
            _ => ((self.left - seconds).max(0.0), self.residual),
        }
    }
}

impl Stretch<'_, '_> {
    /// Tells how far the bake is, with a part of the question done.
    pub fn advance(&self, part: f64) {
        let forecast = self.forecast;
        let (so_far, here) = (forecast.start.elapsed().as_secs_f64(), self.seconds());
        let whole = here / part.max(f64::MIN_POSITIVE);
        let (looks, residual) = forecast.after(self.kind, whole, self.count);
        let asked = forecast.asked + here;
        let beside = if forecast.asked > 0.0 { (so_far / asked).clamp(1.0, MOST_BESIDE) } else { BESIDE };
        let round = whole - here + looks + residual;
        let to_come = beside * (round + MAYBE_ROUND * (asked + round));
        (forecast.control.progress)((so_far / (so_far + to_come).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0));
    }

    /// Seconds since the question began.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
