//! What the parts of the bench share: pictures of coherence maps, and how far they are from others.

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use renderer::{CoherenceMap, CoherenceOptions, Evaluation, Evaluator, Eye, VisibleLine, object_edges, visible_lines};
use scene::{Exposure, ToneCurve};

/// Pixels of the work image along a side of the picture's.
pub const SUPERSAMPLE: u32 = 3;

/// How light is compared.
pub struct Compared {
    pub exposure: Exposure,
    pub curve: Option<ToneCurve>,
}

pub struct Made {
    pub map: CoherenceMap,
    /// Seconds of all but evaluation, visible lines included.
    pub of_map: f64,
}

pub fn picture(eye: &Eye<'_>, side: u32, most: usize, compared: Compared, evaluate: &Evaluator<'_>) -> Made {
    let (lines, looking) = timed(|| visible_lines(eye, &object_edges(eye)));
    let mut made = refined(&lines, side, most, compared, evaluate);
    made.of_map += looking;
    made
}

/// A map of so many pixels at most, by lines that are visible.
pub fn refined(lines: &[VisibleLine], side: u32, most: usize, compared: Compared, evaluate: &Evaluator<'_>) -> Made {
    let Compared { exposure, curve } = compared;
    let options = CoherenceOptions { supersample: SUPERSAMPLE, exposure, curve };
    let (mut map, mut of_map) = timed(|| CoherenceMap::new(side, side, &options, lines).unwrap());
    loop {
        let (batch, placing) = timed(|| map.next_batch(most - map.evaluated()));
        if batch.is_empty() {
            return Made { map, of_map };
        }
        let seen = seen_at(&batch, evaluate);
        let ((), taking) = timed(|| map.take(&seen));
        of_map += placing + taking;
    }
}

pub fn seen_at(points: &[DVec2], evaluate: &Evaluator<'_>) -> Vec<Evaluation> {
    points.par_iter().map(|&point| evaluate(point)).collect()
}

/// L1 and L2 norms of the difference, relative to the full picture's.
pub fn errors(picture: &[Vec3], full: &[Vec3]) -> [f64; 2] {
    let sum =
        |of: &dyn Fn(Vec3, Vec3) -> f32| picture.iter().zip(full).map(|(a, b)| f64::from(of(*a, *b))).sum::<f64>();
    let l1 = sum(&|a, b| (a - b).abs().element_sum()) / sum(&|_, b| b.element_sum());
    [l1, (sum(&|a, b| (a - b).length_squared()) / sum(&|_, b| b.length_squared())).sqrt()]
}

/// The root mean square of the difference of what is shown.
pub fn rmse(picture: &[Vec3], truth: &[Vec3]) -> f64 {
    let squares = picture.iter().zip(truth).map(|(a, b)| f64::from((*a - *b).length_squared()) / 3.0);
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

/// Runs work; the seconds that it takes.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = std::time::Instant::now();
    let done = work();
    (done, start.elapsed().as_secs_f64())
}

/// Columns of a table: L1 and L2 of each picture.
pub fn columns(errors: &[[f64; 2]]) -> String {
    errors.iter().map(|[l1, l2]| format!("{l1:.4} | {l2:.4}")).collect::<Vec<String>>().join(" | ")
}
