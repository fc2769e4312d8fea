//! The light of a pixel of the work image by hierarchical integration (Kajiya, "The Rendering Equation", SIGGRAPH 1986),
//! until an interval of confidence says that it is known (Painter & Sloan 1989): the confidence relocation of Guo 1998,
//! sections 5 and 6.2. A coherence map that is handed such pixels spends on few what a full picture spends on all.
//!
//! What we do differently: all cells of a pixel are halved at once, so its samples are a power of two. Halving the worst cell
//! first, as Kajiya has it, gains where a pixel is half noise; the pixels of a work image are too small for that.

use glam::{DVec2, Vec3, Vec3A};

use crate::cell::{Cell, Halves, pixels};
use crate::coherence_map::CoherenceOptions;
use crate::confidence::{Confidence, Interval};
use crate::evaluation::{Evaluation, Evaluator};
use crate::sequence::scatter;

/// Samples before the interval is asked: one in each quarter. With two, a pixel in four that a border parts in halves is
/// taken for known by two samples on one side of it.
const FEWEST: usize = 4;

/// Samples from which on a pixel is left as it is, so that light which scatters without end does not take all the time. More
/// make dark corners that paths hardly reach finer, where nobody looks.
const MOST: usize = 1024;

/// How many pixels a pixel's cells are the cells of.
const ONE: [u32; 2] = [1, 1];

/// How the pixels of a work image are integrated.
pub struct PixelIntegral {
    options: CoherenceOptions,
    confidence: Confidence,
    seed: u64,
}

/// What is seen at a place in a cell of the pixel.
struct Sample {
    cell: Cell,
    place: [u32; 2],
    seen: Evaluation,
}

impl PixelIntegral {
    /// Of the pixels of a coherence map, until with a probability `level`, between 0 and 1, each is within an interval, of
    /// the light that is compared there.
    pub fn new(options: &CoherenceOptions, level: f64, interval: Interval, seed: u64) -> Self {
        Self { options: *options, confidence: Confidence::new(level, interval), seed }
    }

    /// The mean of what is seen in the pixel about a point of the picture, and the object that most of it shows. The cost is
    /// that of all samples, of which there are 4 to 1024.
    ///
    /// A sample whose radiance is no finite number ends the pixel, and makes its radiance none. The same point always has the
    /// same samples.
    pub fn mean(&self, centre: DVec2, evaluate: &Evaluator<'_>) -> Evaluation {
        let seed = scatter(scatter(self.seed, centre.x.to_bits()), centre.y.to_bits());
        let look = |cell: Cell| {
            let place = cell.jittered(ONE, seed);
            let offset = (pixels(place) - 0.5) / f64::from(self.options.supersample);
            Sample { cell, place, seen: evaluate(centre + offset) }
        };
        let mut samples = vec![look(Cell::around(ONE))];
        while samples.len() < MOST && !self.is_known(&samples) {
            samples = halved(samples, look);
        }
        mean(&samples)
    }

    /// Whether the samples of equal cells tell enough of their mean. Both halves of a cell stand side by side: the difference
    /// of each two is one degree of freedom of its variance.
    fn is_known(&self, samples: &[Sample]) -> bool {
        if samples.iter().any(|sample| !sample.seen.radiance.is_finite()) {
            return true;
        }
        if samples.len() < FEWEST {
            return false;
        }
        let compared = |sample: &Sample| Vec3A::from(self.options.compared(sample.seen.radiance));
        let (mut sum, mut squares) = (Vec3A::ZERO, Vec3A::ZERO);
        for halves in samples.chunks_exact(2) {
            let [first, second] = [&halves[0], &halves[1]].map(compared);
            sum += first + second;
            squares += (first - second) * (first - second);
        }
        let count = samples.len() as f32;
        self.confidence.excess(sum / count, squares.max_element() / (count * count), count / 2.0) <= 1.0
    }
}

/// The halves of every sample's cell, side by side: its own, and the other with a new sample.
fn halved(samples: Vec<Sample>, look: impl Fn(Cell) -> Sample) -> Vec<Sample> {
    let halves = samples.into_iter().filter_map(|sample| match sample.cell.halves(ONE) {
        Halves::Both(_, [first, second]) => {
            let (own, other) = if first.contains(sample.place) { (first, second) } else { (second, first) };
            Some([Sample { cell: own, ..sample }, look(other)])
        }
        // Not before a pixel is halved 36 times.
        Halves::First(..) | Halves::None => None,
    });
    halves.flatten().collect()
}

fn mean(samples: &[Sample]) -> Evaluation {
    let mut objects: Vec<u32> = samples.iter().map(|sample| sample.seen.object).collect();
    objects.sort_unstable();
    let most = objects.chunk_by(|a, b| a == b).rev().max_by_key(|same| same.len());
    let sum: Vec3 = samples.iter().map(|sample| sample.seen.radiance).sum();
    Evaluation {
        radiance: sum / samples.len() as f32,
        object: most.map_or(0, |same| same[0]),
        cost: samples.iter().map(|sample| sample.seen.cost).sum(),
    }
}

#[cfg(test)]
mod tests {
    use scene::Exposure;

    use super::*;
    use crate::test_pictures::holes;

    fn integral(interval: f64, seed: u64) -> PixelIntegral {
        let options = CoherenceOptions { supersample: 2, exposure: Exposure { ev: 0.0 }, curve: None };
        PixelIntegral::new(&options, 0.99, Interval::Linear(interval), seed)
    }

    fn grey(light: f64, object: u32) -> Evaluation {
        Evaluation { radiance: Vec3::splat(light as f32), object, cost: 3 }
    }

    /// Light at a point, even between nothing and white, and no two points alike.
    fn noise(point: DVec2) -> Evaluation {
        grey(scatter(point.x.to_bits(), point.y.to_bits()) as f64 / u64::MAX as f64, 1)
    }

    #[test]
    fn even_light_is_known_from_each_quarter_and_what_is_no_number_ends_the_pixel() {
        let seen = integral(1e-9, 1).mean(DVec2::splat(3.25), &|_| grey(0.5, 9));
        assert_eq!((seen.radiance, seen.object, seen.cost), (Vec3::splat(0.5), 9, 4 * 3));
        let seen = integral(1e-9, 1).mean(DVec2::splat(3.25), &|_| grey(f64::NAN, 9));
        assert!(!seen.radiance.is_finite() && seen.cost == 3);
        assert!((0..20).any(|x| !integral(0.1, 1).mean(DVec2::new(f64::from(x), 0.5), &holes).radiance.is_finite()));
    }

    /// Samples stay in the pixel, each in a cell of its own.
    #[test]
    fn samples_are_one_in_each_cell() {
        let seen = std::sync::Mutex::new(Vec::new());
        let look = |point: DVec2| {
            seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(point);
            noise(point)
        };
        let centre = DVec2::new(7.25, 2.75);
        assert_eq!(integral(1e-9, 1).mean(centre, &look).cost, 3 * MOST as u32);
        let mut cells: Vec<[u32; 2]> = (seen.into_inner().unwrap_or_default().iter())
            .map(|point| ((point - centre) * 2.0 + 0.5) * 32.0)
            .map(|place| [place.x.floor() as u32, place.y.floor() as u32])
            .collect();
        cells.sort_unstable();
        assert_eq!(cells, (0..32).flat_map(|x| (0..32).map(move |y| [x, y])).collect::<Vec<_>>());
    }

    #[test]
    fn a_border_through_the_pixel_is_its_area_and_its_object_has_most_of_it() {
        for (place, bright) in [(0.3, 1), (0.7, 2)] {
            let border = |point: DVec2| if point.x < 4.0 + 0.5 * place { grey(1.0, 2) } else { grey(0.0, 1) };
            let seen = integral(0.02, 1).mean(DVec2::new(4.25, 0.25), &border);
            assert!((f64::from(seen.radiance.x) - place).abs() < 0.02, "{}", seen.radiance.x);
            assert_eq!(seen.object, bright);
        }
    }

    /// Noise: the mean is within the interval as often as was asked for, and half of the interval takes four times the samples.
    #[test]
    fn the_interval_is_kept_and_narrow_ones_take_more() {
        let pixels = 1000;
        let samples = [0.1, 0.05].map(|interval| {
            let means: Vec<Evaluation> = (0..pixels)
                .map(|i| integral(interval, 7).mean(DVec2::new(0.25, 0.25 + f64::from(i)), &noise))
                .collect();
            let within = means.iter().filter(|seen| (f64::from(seen.radiance.x) - 0.5).abs() <= interval).count();
            assert!(within >= 970, "{within} of {pixels} within {interval}");
            means.iter().map(|seen| seen.cost).sum::<u32>() / (3 * pixels)
        });
        assert!((3.0..5.0).contains(&(f64::from(samples[1]) / f64::from(samples[0]))), "{samples:?}");
    }

    #[test]
    fn seeds_differ_and_the_same_one_does_not() {
        let mean = |seed: u64| integral(0.1, seed).mean(DVec2::splat(0.25), &noise);
        assert_eq!(mean(1), mean(1));
        assert_ne!(mean(1).radiance, mean(2).radiance);
    }
}
