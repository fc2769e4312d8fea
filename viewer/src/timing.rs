//! What a frame takes, and what of it its passes take.

use std::time::Instant;

/// Milliseconds that a frame took.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTimes {
    /// From the camera to the picture in the host's memory.
    pub frame_ms: f64,
    /// What of it each pass took, in their order; passes that are one have one name with a plus. By the adapter's clock where
    /// it tells, by the host's else. `read_back` is what the picture's way to the host took.
    pub parts_ms: Vec<(&'static str, f64)>,
}

impl FrameTimes {
    /// The median of every number; none without frames. All frames have the same parts.
    pub fn medians(frames: &[Self]) -> Option<Self> {
        let first = frames.first()?;
        let median = |of: &dyn Fn(&Self) -> f64| {
            let mut times: Vec<f64> = frames.iter().map(of).collect();
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        let part = |(i, &(name, _)): (usize, &(&'static str, f64))| {
            (name, median(&|frame| frame.parts_ms.get(i).map_or(0.0, |part| part.1)))
        };
        let parts_ms = first.parts_ms.iter().enumerate().map(part).collect();
        Some(Self { frame_ms: median(&|frame| frame.frame_ms), parts_ms })
    }
}

/// A clock of the host.
pub(crate) struct Stopwatch {
    start: Instant,
    last: Instant,
}

impl Stopwatch {
    pub fn start() -> Self {
        let now = Instant::now();
        Self { start: now, last: now }
    }

    /// Milliseconds since the last call, or the start.
    pub fn lap(&mut self) -> f64 {
        let last = std::mem::replace(&mut self.last, Instant::now());
        (self.last - last).as_secs_f64() * 1e3
    }

    /// Milliseconds since the start.
    pub fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_number_by_number() {
        assert_eq!(FrameTimes::medians(&[]), None);
        let frame = |frame_ms, a, b| FrameTimes { frame_ms, parts_ms: vec![("a", a), ("b", b)] };
        let frames = [frame(9.0, 1.0, 5.0), frame(2.0, 3.0, 4.0), frame(3.0, 2.0, 6.0)];
        assert_eq!(FrameTimes::medians(&frames), Some(frame(3.0, 2.0, 5.0)));
        assert_eq!(FrameTimes::medians(&frames[..1]), Some(frames[0].clone()));
    }
}
