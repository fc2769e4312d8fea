//! What draws pictures: a graphics adapter, or the CPU.

use anyhow::{Context, Result};
use scene::{Baked, Exposure};
use viewer::{Capture, Frame, FrameTimes, Gpu, Picture, Twin, ViewerError};

use crate::args::Backend;
use crate::progress::say;

/// A bake made ready, and the adapter that is to draw it.
pub struct Studio<'a> {
    baked: &'a Baked,
    backend: Backend,
    twin: Twin,
    gpu: Option<Gpu>,
}

/// Draws pictures of one size. What an adapter fails in, the CPU does, unless an adapter was asked for.
pub struct Artist<'a> {
    studio: &'a Studio<'a>,
    capture: Option<Capture<'a>>,
}

impl<'a> Studio<'a> {
    /// Makes a bake ready that validates.
    ///
    /// # Errors
    /// No adapter where one is asked for.
    pub fn open(baked: &'a Baked, backend: Backend) -> Result<Self> {
        let find = || (backend != Backend::Cpu).then(Gpu::headless).transpose();
        // A driver takes as long to be found as a large bake to be made ready.
        let (twin, gpu) = rayon::join(|| Twin::new(baked), find);
        Ok(Self { baked, backend, twin, gpu: unless_needed(backend, gpu)?.flatten() })
    }

    /// The exposure that frames ask for together: the mean of what each does.
    pub fn meter(&self, frames: &[Frame]) -> Exposure {
        let sum: f32 = frames.iter().map(|frame| self.twin.meter(frame).ev).sum();
        Exposure { ev: sum / frames.len().max(1) as f32 }
    }

    /// What draws pictures of a size.
    ///
    /// # Errors
    /// An adapter that cannot, where one is asked for.
    pub fn artist(&'a self, (width, height): (u32, u32)) -> Result<Artist<'a>> {
        let capture = |gpu| Capture::new(gpu, self.baked, &self.twin, width, height);
        let capture = self.gpu.as_ref().map(capture).transpose();
        Ok(Artist { studio: self, capture: unless_needed(self.backend, capture)?.flatten() })
    }
}

impl Artist<'_> {
    /// "cpu", or the name of the graphics adapter.
    pub fn name(&self) -> String {
        let gpu = self.studio.gpu.as_ref().filter(|_| self.capture.is_some());
        gpu.map_or_else(|| "cpu".to_owned(), Gpu::adapter_name)
    }

    /// Draws a picture; an adapter leaves its radiance out where it is not wanted.
    ///
    /// # Errors
    /// An adapter that fails, where one is asked for.
    pub fn draw(&mut self, frame: &Frame, radiance: bool) -> Result<Picture> {
        let by_adapter = |capture: &Capture<'_>| if radiance { capture.draw(frame) } else { capture.display(frame) };
        self.work(by_adapter, |twin| twin.draw(frame))
    }

    /// Draws a picture, and says what that took.
    ///
    /// # Errors
    /// As [`Artist::draw`].
    pub fn time(&mut self, frame: &Frame) -> Result<FrameTimes> {
        self.work(|capture| capture.time(frame), |twin| twin.draw_timed(frame).1)
    }

    fn work<T>(
        &mut self,
        by_adapter: impl FnOnce(&Capture<'_>) -> Result<T, ViewerError>,
        by_cpu: impl FnOnce(&Twin) -> T,
    ) -> Result<T> {
        let worked = self.capture.as_ref().map(by_adapter).transpose();
        match unless_needed(self.studio.backend, worked)?.flatten() {
            Some(result) => Ok(result),
            None => {
                self.capture = None;
                Ok(by_cpu(&self.studio.twin))
            }
        }
    }
}

/// What came of an adapter's work. That it failed is said, and is an error where an adapter was asked for.
fn unless_needed<T>(backend: Backend, result: Result<T, ViewerError>) -> Result<Option<T>> {
    match result {
        Ok(done) => Ok(Some(done)),
        Err(error) if backend == Backend::Auto => {
            say(format_args!("drawing on the CPU: {error}"));
            Ok(None)
        }
        Err(error) => Err(error).context("--backend gpu (--backend cpu draws the same picture)"),
    }
}
