//! What a person watches on stderr: a bar per stage on a terminal, a line per stage elsewhere.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressFinish, ProgressStyle};

/// Steps of a bar: finer than a terminal is wide.
const STEPS: u64 = 1000;

/// Seconds between lines of a stage where stderr is not a terminal.
const LINE_SECONDS: f64 = 10.0;

/// The seconds for which a stage is watched, and the fraction of it that is done, before it is said what is left.
const WATCHED: (f64, f64) = (1.0, 0.02);

/// A line on stderr, with the program's name before it. A closed stderr is nobody's loss.
pub fn say(what: impl Display) {
    _ = writeln!(std::io::stderr().lock(), "halflight: {what}");
}

/// A stage of the work, timed from its start.
pub struct Stage {
    name: &'static str,
    start: Instant,
    bar: ProgressBar,
    /// The furthest that the bar was: it does not go back where more turns out to be left.
    steps: AtomicU64,
    /// Lines that were due so far, where there is no bar.
    lines: AtomicU64,
}

impl Stage {
    /// Starts the stage `name`.
    pub fn start(name: &'static str) -> Self {
        let style = ProgressStyle::with_template("{msg:>8} {wide_bar} {percent:>3} %  {elapsed} {prefix}")
            .expect("the template is a constant, and a test draws it");
        // Hidden by itself where stderr is not a terminal.
        let bar = ProgressBar::new(STEPS).with_style(style).with_message(name).with_finish(ProgressFinish::AndClear);
        bar.enable_steady_tick(Duration::from_millis(100));
        Self { name, start: Instant::now(), bar, steps: AtomicU64::new(0), lines: AtomicU64::new(0) }
    }

    /// Says how far the stage is, 0..=1; less than before if more is left than was foreseen.
    pub fn advance(&self, fraction: f64) {
        let step = (fraction.clamp(0.0, 1.0) * STEPS as f64) as u64;
        let furthest = self.steps.fetch_max(step, Ordering::Relaxed).max(step);
        self.bar.set_position(furthest);
        let seconds = self.start.elapsed().as_secs_f64();
        let left = remaining(seconds, fraction);
        if !self.bar.is_hidden() {
            self.bar.set_prefix(left.map_or_else(String::new, |left| format!("about {left} left")));
        } else if let Some(left) = left {
            // One thread says it; the others go on.
            let line = (seconds / LINE_SECONDS) as u64;
            if self.lines.fetch_max(line, Ordering::Relaxed) < line {
                say(format_args!("{} {:.0} %, about {left} left", self.name, 100.0 * furthest as f64 / STEPS as f64));
            }
        }
    }

    /// Ends the stage; its seconds.
    pub fn end(self) -> f64 {
        let seconds = self.start.elapsed().as_secs_f64();
        self.bar.finish_and_clear();
        if !std::io::stderr().is_terminal() {
            say(format_args!("{} took {seconds:.2} s", self.name));
        }
        seconds
    }
}

/// What is left of a stage that has taken so many seconds for a fraction; nothing where that would be a guess.
fn remaining(seconds: f64, fraction: f64) -> Option<HumanDuration> {
    let left = seconds * (1.0 - fraction) / fraction;
    let known = seconds >= WATCHED.0 && fraction >= WATCHED.1;
    Duration::try_from_secs_f64(left).ok().filter(|_| known).map(HumanDuration)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_takes_any_fraction() {
        let stage = Stage::start("test");
        for fraction in [-1.0, 0.0, 0.5, 1.0, 2.0, f64::NAN] {
            stage.advance(fraction);
        }
        assert!(stage.end() >= 0.0);
    }

    #[test]
    fn what_is_left_is_said_when_it_is_known() {
        let said = |seconds, fraction| remaining(seconds, fraction).map(|left| left.to_string());
        assert_eq!(said(30.0, 0.25), Some("2 minutes".into()));
        assert_eq!(said(0.1, 0.25), None);
        for fraction in [0.0, 0.01, -1.0, 2.0, f64::NAN] {
            assert_eq!(said(30.0, fraction), None, "{fraction}");
        }
    }
}
