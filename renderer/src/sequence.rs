//! Random numbers: one independent stream a point, and point sets that fill the unit cube more evenly than it does.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// A stream of random numbers. Streams of one seed are independent, whatever order they are drawn in: ChaCha with
/// eight rounds is a counter through a cipher, and costs next to nothing beside a ray.
pub(crate) struct Stream(ChaCha8Rng);

impl Stream {
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self(generator)
    }

    /// Uniform in 0..1, never 1: the 53 bits that an f64 holds.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (0.5 / (1u64 << 52) as f64)
    }
}

/// A number of 64 random bits for each of many numbers, other ones for each seed: two rounds of the finalizer of SplitMix64
/// (Steele, Lea and Flood 2014). For places that are drawn in any order, where a stream each would cost more than what it
/// draws.
pub(crate) fn scatter(seed: u64, number: u64) -> u64 {
    let mix = |word: u64| {
        let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        word ^ word >> 31
    };
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
    mix(mix(seed.wrapping_add(STEP)).wrapping_add(number.wrapping_mul(STEP)))
}

/// A Kronecker sequence with a random shift: x_i = frac(shift + i·α), α_k = φ^-k, where φ solves φ^(D+1) = φ + 1.
///
/// Every x_i is uniform over the cube by itself, since the shift is (Cranley and Patterson 1976), so that a mean over
/// the sequence is unbiased; together they are spread evenly, which makes its variance fall faster than 1/n. For the
/// choice of α see Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018; D = 1 is the golden ratio.
pub(crate) struct Kronecker<const D: usize> {
    next: [f64; D],
    step: [f64; D],
}

impl<const D: usize> Kronecker<D> {
    pub fn shifted_by(stream: &mut Stream) -> Self {
        // The fixed point of φ = (1 + φ)^(1/(D+1)): a contraction by at least 2, so 60 rounds exhaust an f64.
        let phi = (0..60).fold(1.0_f64, |phi, _| (1.0 + phi).powf(1.0 / (D as f64 + 1.0)));
        let step = std::array::from_fn(|k| phi.powi(-(k as i32) - 1));
        Self { next: std::array::from_fn(|_| stream.uniform()), step }
    }

    /// The next point of the cube.
    pub fn point(&mut self) -> [f64; D] {
        let point = self.next;
        for (x, step) in self.next.iter_mut().zip(self.step) {
            *x += step;
            *x -= x.floor();
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_and_repeat() {
        let draw = |seed, stream| Stream::new(seed, stream).uniform();
        assert_eq!(draw(1, 2).to_bits(), draw(1, 2).to_bits());
        let distinct = [draw(1, 2), draw(1, 3), draw(2, 2), draw(2, 3)].map(f64::to_bits);
        assert_eq!(std::collections::BTreeSet::from(distinct).len(), 4);
        let mut stream = Stream::new(7, 0);
        let mean = (0..10_000).map(|_| stream.uniform()).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 5.0 * (1.0 / 12e4_f64).sqrt());
    }

    #[test]
    fn scattered_numbers_are_uniform_and_differ_by_seed() {
        let unit = |seed, number| (scatter(seed, number) as u32) as f64 / 2f64.powi(32);
        let halves = |shift: u64| (0..10_000).map(|i| unit(5, i << shift)).sum::<f64>() / 1e4;
        for shift in [0, 18, 32, 50] {
            assert!((halves(shift) - 0.5).abs() < 5.0 * (1.0 / 12e4_f64).sqrt(), "{shift}");
        }
        let product = (0..10_000).map(|i| (unit(5, i) - 0.5) * (unit(6, i) - 0.5)).sum::<f64>() / 1e4;
        assert!(product.abs() < 5.0 / 12.0 / 100.0);
    }

    /// Of n points of the sequence every box holds its share to within far less than the √n of random points.
    #[test]
    fn every_box_gets_its_share() {
        let mut sequence = Kronecker::<2>::shifted_by(&mut Stream::new(3, 1));
        let points: Vec<_> = (0..4096).map(|_| sequence.point()).collect();
        assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
        for (u, v) in [(0.5, 0.5), (0.25, 0.8), (0.9, 0.1), (1.0, 0.37)] {
            let inside = points.iter().filter(|[x, y]| *x < u && *y < v).count() as f64;
            assert!((inside - 4096.0 * u * v).abs() < 12.0, "{inside} points for {}", 4096.0 * u * v);
        }
    }
}
