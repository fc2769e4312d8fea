//! What a person watches on stderr: a bar per stage on a terminal, a line per stage elsewhere.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};

/// Steps of a bar: finer than a terminal is wide.
const STEPS: u64 = 1000;

/// A line on stderr, with the program's name before it. A closed stderr is nobody's loss.
pub fn say(what: impl Display) {
    _ = writeln!(std::io::stderr().lock(), "halflight: {what}");
}

/// A stage of the work, timed from its start.
pub struct Stage {
    name: &'static str,
    start: Instant,
    bar: ProgressBar,
}

impl Stage {
    /// Starts the stage `name`.
    pub fn start(name: &'static str) -> Self {
        let style = ProgressStyle::with_template("{msg:>8} {wide_bar} {percent:>3} %  {elapsed}")
            .expect("the template is a constant, and a test draws it");
        // Hidden by itself where stderr is not a terminal.
        let bar = ProgressBar::new(STEPS).with_style(style).with_message(name).with_finish(ProgressFinish::AndClear);
        bar.enable_steady_tick(Duration::from_millis(100));
        Self { name, start: Instant::now(), bar }
    }

    /// Says how far the stage is, 0..=1.
    pub fn advance(&self, fraction: f64) {
        self.bar.set_position((fraction.clamp(0.0, 1.0) * STEPS as f64) as u64);
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
}
