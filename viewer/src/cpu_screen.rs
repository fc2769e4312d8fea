//! A window that the CPU draws into: the frame's twin, coarse in motion and fine at rest.

use std::num::NonZeroU32;
use std::sync::Arc;

use winit::{
    dpi::PhysicalSize,
    event_loop::{ActiveEventLoop, OwnedDisplayHandle},
    window::Window,
};

use crate::{
    Frame, Picture, ViewerError, overlay_twin::OverlayTwin, painting::Painting, screen::Presented, walk::Shown,
};

/// Seconds that a frame in motion may take. Shorter is smoother and coarser.
const FRAME: f64 = 0.05;

/// Pixels of the window that one of the picture covers at most, each way.
const COARSEST: u32 = 8;

/// A window's pixels, and what is drawn into them.
pub(crate) struct CpuScreen {
    window: Arc<Window>,
    surface: softbuffer::Surface<OwnedDisplayHandle, Arc<Window>>,
    size: Option<(NonZeroU32, NonZeroU32)>,
    shown: Option<Arc<Shown>>,
    overlay: OverlayTwin,
    /// The last picture, what was asked for it, and how coarse it is.
    last: Option<(Frame, u32, Picture)>,
    /// Seconds that a pixel of a picture takes, as the last one did.
    seconds_by_pixel: f64,
    /// Milliseconds of its passes.
    pub parts: Vec<(&'static str, f64)>,
}

impl CpuScreen {
    /// Opens a window's pixels.
    pub fn open(window: Arc<Window>, event_loop: &ActiveEventLoop) -> Result<Self, ViewerError> {
        let failed = |cause: softbuffer::SoftBufferError| ViewerError::NoDisplay(cause.to_string());
        let context = softbuffer::Context::new(event_loop.owned_display_handle()).map_err(failed)?;
        let surface = softbuffer::Surface::new(&context, window.clone()).map_err(failed)?;
        let size = window.inner_size();
        let mut screen = Self {
            window,
            surface,
            size: None,
            shown: None,
            overlay: OverlayTwin::default(),
            last: None,
            seconds_by_pixel: 1e-6,
            parts: Vec::new(),
        };
        screen.resize(size)?;
        Ok(screen)
    }

    /// Follows the window's size.
    pub fn resize(&mut self, size: PhysicalSize<u32>) -> Result<(), ViewerError> {
        self.size = NonZeroU32::new(size.width).zip(NonZeroU32::new(size.height));
        if let Some((width, height)) = self.size {
            self.surface.resize(width, height).map_err(|cause| ViewerError::Driver(cause.to_string()))?;
        }
        Ok(())
    }

    /// Draws this bake from now on.
    pub fn show(&mut self, shown: Arc<Shown>) {
        (self.shown, self.last) = (Some(shown), None);
    }

    /// Draws a frame, and the panels over it.
    pub fn present(
        &mut self,
        frame: Option<&Frame>,
        painting: Painting,
        still: bool,
    ) -> Result<Presented, ViewerError> {
        self.overlay.take_textures(&painting);
        let Some((width, height)) = self.size else { return Ok(Presented::Hidden) };
        let (width, height) = (width.get(), height.get());
        let mut pixels = vec![[0; 3]; width as usize * height as usize];
        let mut coarseness = 1;
        if let (Some(frame), Some(shown)) = (frame, self.shown.clone()) {
            coarseness = self.coarseness(frame, still);
            if self.last.as_ref().is_none_or(|(asked, coarse, _)| (asked, *coarse) != (frame, coarseness)) {
                let coarse = Frame { width: width.div_ceil(coarseness), height: height.div_ceil(coarseness), ..*frame };
                let (picture, took) = shown.twin.draw_timed(&coarse);
                self.seconds_by_pixel = 1e-3 * took.frame_ms / coarse.pixels().max(1) as f64;
                self.parts = took.parts_ms;
                self.last = Some((*frame, coarseness, picture));
            }
            if let Some((.., picture)) = &self.last {
                enlarge(picture, coarseness, width, &mut pixels);
            }
        }
        self.overlay.paint(&painting, width, &mut pixels);
        let failed = |cause: softbuffer::SoftBufferError| ViewerError::Driver(cause.to_string());
        let mut buffer = self.surface.buffer_mut().map_err(failed)?;
        for (shown, [r, g, b]) in buffer.iter_mut().zip(pixels) {
            *shown = u32::from_be_bytes([0, r, g, b]);
        }
        self.window.pre_present_notify();
        buffer.present().map_err(failed)?;
        Ok(if coarseness == 1 { Presented::Shown } else { Presented::Coarse })
    }

    /// How coarse a frame is drawn: in motion as its time allows, at rest finer from picture to picture.
    fn coarseness(&self, frame: &Frame, still: bool) -> u32 {
        match &self.last {
            Some((asked, coarse, _)) if still && asked == frame => (coarse / 2).max(1),
            _ => {
                let seconds = self.seconds_by_pixel * frame.pixels() as f64;
                let side = (seconds / FRAME).sqrt().ceil().max(1.0) as u32;
                side.next_power_of_two().min(COARSEST)
            }
        }
    }
}

/// Every pixel of a picture as a square of so many each way.
fn enlarge(picture: &Picture, side: u32, width: u32, pixels: &mut [[u8; 3]]) {
    for (y, row) in pixels.chunks_exact_mut(width as usize).enumerate() {
        let source = &picture.rgb[y / side as usize * picture.width as usize..];
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = source[x / side as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_enlarged_picture_covers_all_pixels() {
        let rgb: Vec<[u8; 3]> = (0..6).map(|i| [i; 3]).collect();
        let exposure = scene::Exposure { ev: 0.0 };
        let picture = Picture { width: 3, height: 2, radiance: Vec::new(), rgb, background: 0, exposure };
        let mut pixels = vec![[9; 3]; 5 * 3];
        enlarge(&picture, 2, 5, &mut pixels);
        let expected = [[0, 0, 1, 1, 2], [0, 0, 1, 1, 2], [3, 3, 4, 4, 5]];
        assert_eq!(pixels, expected.concat().into_iter().map(|i| [i; 3]).collect::<Vec<_>>());
    }
}
