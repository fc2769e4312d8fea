//! Ctrl-C: the first one is left to work that can stop by itself, the next one ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether there was a Ctrl-C, and whether somebody looks.
#[derive(Clone, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Default)]
struct State {
    heeded: AtomicBool,
    pressed: AtomicBool,
}

impl Interrupt {
    /// Runs work that looks at [`Interrupt::pressed`] and ends by itself.
    pub fn heeded_by<T>(&self, work: impl FnOnce() -> T) -> T {
        self.0.heeded.store(true, Ordering::SeqCst);
        let done = work();
        self.0.heeded.store(false, Ordering::SeqCst);
        done
    }

    /// Whether the work is to end.
    pub fn pressed(&self) -> bool {
        self.0.pressed.load(Ordering::Relaxed)
    }

    /// Takes note of a Ctrl-C. Whether it is left to the work that runs.
    pub fn press(&self) -> bool {
        let before = self.0.pressed.swap(true, Ordering::SeqCst);
        !before && self.0.heeded.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_left_to_who_looks_and_the_second_is_not() {
        let interrupt = Interrupt::default();
        interrupt.heeded_by(|| {
            assert!(!interrupt.pressed());
            assert!(interrupt.press() && interrupt.pressed());
            assert!(!interrupt.press());
        });
        assert!(!Interrupt::default().press(), "nobody looks");
    }
}
