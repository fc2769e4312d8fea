//! How long frames take, and what of them.

use std::time::{Duration, Instant};

/// Frames that the numbers are medians of: half a second of a smooth walk.
const KEPT: usize = 31;

/// What a frame's time goes into, in order.
pub(crate) const PARTS: [&str; 3] = ["move, meter", "panels", "draw"];

/// Seconds of the last frames.
#[derive(Default)]
pub(crate) struct Pace {
    frames: Vec<[f64; PARTS.len()]>,
    next: usize,
}

/// The clock of one frame.
pub(crate) struct FrameClock {
    last: Instant,
    parts: [f64; PARTS.len()],
    part: usize,
}

impl FrameClock {
    pub fn start() -> Self {
        Self { last: Instant::now(), parts: [0.0; PARTS.len()], part: 0 }
    }

    /// Ends a part.
    pub fn lap(&mut self) {
        let now = Instant::now();
        if let Some(part) = self.parts.get_mut(self.part) {
            *part = (now - self.last).as_secs_f64();
        }
        (self.last, self.part) = (now, self.part + 1);
    }
}

impl Pace {
    /// Takes note of a frame.
    pub fn add(&mut self, clock: FrameClock) {
        if self.frames.len() < KEPT {
            self.frames.push(clock.parts);
        } else {
            self.frames[self.next % KEPT] = clock.parts;
        }
        self.next += 1;
    }

    /// Median time of a frame, and of its parts; none before there was one.
    pub fn medians(&self) -> Option<(Duration, [Duration; PARTS.len()])> {
        let median = |of: &dyn Fn(&[f64; PARTS.len()]) -> f64| {
            let mut seconds: Vec<f64> = self.frames.iter().map(of).collect();
            seconds.sort_unstable_by(f64::total_cmp);
            Duration::from_secs_f64(seconds.get(seconds.len() / 2).copied().unwrap_or_default())
        };
        let parts = std::array::from_fn(|part| median(&|frame| frame[part]));
        (!self.frames.is_empty()).then(|| (median(&|frame| frame.iter().sum()), parts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_of_the_last_frames() {
        let mut pace = Pace::default();
        assert_eq!(pace.medians(), None);
        let mut add = |seconds| pace.add(FrameClock { parts: [0.0, 0.0, seconds], ..FrameClock::start() });
        (0..100).for_each(|_| add(9.0));
        (0..KEPT).for_each(|i| add(if i % 10 == 0 { 5.0 } else { 0.25 }));
        let quarter = Duration::from_millis(250);
        assert_eq!(pace.medians(), Some((quarter, [Duration::ZERO, Duration::ZERO, quarter])));
    }
}
