//! Passes (c) and (d) on the host's threads, as in the paper: the light of every pixel, and what a display shows of it
//! (Hardt & Teller 1996, sections 2.6 and 2.7).
//!
//! For adapters that are a CPU themselves. Their shaders fetch a triangle for every pixel, number by number; here
//! neighbours that see the same triangle share what they need of it ([`crate::spans`]).

use std::cell::{Ref, RefCell};

use glam::Vec3;
use rayon::prelude::*;
use scene::ToneCurve;

use crate::{
    Gpu, ViewerError,
    frame::{Drawing, encode_visibility, texture},
    gpu::{ResidentLight, guarded},
    read_back::{ReadBack, Rows},
    spans::Spans,
    timing::{FrameTimes, Stopwatch},
    tone_table::ToneTable,
};

/// Rows that a thread takes at least: enough that handing them out costs nothing beside them.
const ROWS: usize = 8;

/// The pass, and its picture.
pub(crate) struct HostPass {
    ids: ReadBack,
    /// For light by tone curve, and for colours that are shown as they are.
    of_light: [ToneTable; ToneCurve::ALL.len()],
    of_colour: ToneTable,
    /// What is shown where nothing is seen.
    background: [u8; 4],
    pixels: RefCell<Vec<[u8; 4]>>,
    /// Where the picture is on its way to a window.
    shown: Option<wgpu::Texture>,
}

impl HostPass {
    /// The pass for a visibility buffer.
    pub fn new(gpu: &Gpu, visibility: &wgpu::Texture) -> Result<Self, ViewerError> {
        let is_window = gpu.passes.is_window;
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let size = [visibility.width(), visibility.height()];
        let shown = || texture(gpu, "shown", size, wgpu::TextureFormat::Rgba8Unorm, usage);
        Ok(Self {
            ids: ReadBack::new(gpu, visibility)?,
            of_light: ToneCurve::ALL.map(|curve| ToneTable::new(|light| curve.apply(light))),
            of_colour: ToneTable::new(|colour| colour),
            background: [0, 0, 0, if is_window { 255 } else { 0 }],
            pixels: RefCell::default(),
            shown: guarded(&gpu.device, || is_window.then(shown))?,
        })
    }

    /// Draws what is seen, and evaluates it.
    pub fn evaluate(&self, drawing: &Drawing<'_>) -> Result<FrameTimes, ViewerError> {
        let &Drawing { gpu, frame, times, .. } = drawing;
        let mut watch = Stopwatch::start();
        let mut pixels = self.pixels.borrow_mut();
        pixels.resize(frame.pixels(), self.background);
        let table = if frame.mode.is_light() { &self.of_light[frame.curve as usize] } else { &self.of_colour };
        let background = self.background;
        let [seen, evaluated] = self.see(drawing, |spans, ids| {
            let seen = watch.lap();
            let rows = pixels.par_chunks_mut(frame.width as usize).enumerate().with_min_len(ROWS);
            rows.for_each(|(y, shown)| spans.show(y, ids.row(y), table, background, shown));
            [seen, watch.lap()]
        })?;
        let frame_ms = watch.total();
        let mut parts_ms = match times {
            Some(times) => {
                let visibility = times.milliseconds(gpu, 1)?[0];
                vec![("visibility", visibility), ("read_back", seen - visibility)]
            }
            None => vec![("visibility+read_back", seen)],
        };
        parts_ms.push(("interpolant+tone_map", evaluated));
        Ok(FrameTimes { frame_ms, parts_ms })
    }

    /// The picture that was evaluated last, row by row; alpha is 0 where nothing was seen, but for a window's.
    pub fn pixels(&self) -> Ref<'_, Vec<[u8; 4]>> {
        self.pixels.borrow()
    }

    /// Draws what is seen, and finds the radiance or display-linear colour of every pixel.
    pub fn radiance(&self, drawing: &Drawing<'_>) -> Result<Vec<Vec3>, ViewerError> {
        self.see(drawing, |spans, ids| {
            (0..drawing.frame.height as usize).into_par_iter().flat_map_iter(|y| spans.colours(y, ids.row(y))).collect()
        })
    }

    /// Brings the picture that was evaluated last to a window.
    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, output: &wgpu::TextureView) {
        let Some(shown) = &self.shown else { return };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * shown.width()),
            rows_per_image: Some(shown.height()),
        };
        gpu.queue.write_texture(shown.as_image_copy(), self.pixels().as_flattened(), layout, shown.size());
        let view = shown.create_view(&wgpu::TextureViewDescriptor::default());
        gpu.passes.blitter().copy(&gpu.device, encoder, &view, output);
    }

    /// Has the adapter draw which triangle is seen at every pixel, and the host look at it.
    fn see<T>(&self, drawing: &Drawing<'_>, look: impl FnOnce(&Spans<'_>, Rows<'_>) -> T) -> Result<T, ViewerError> {
        let &Drawing { gpu, bake, targets, frame, exposure, times } = drawing;
        let ResidentLight::Host(records) = &bake.light else {
            return Err(ViewerError::Driver("the bake is in the adapter's memory, not in the host's".into()));
        };
        guarded(&gpu.device, || {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encode_visibility(drawing, &mut encoder);
            self.ids.copy(&mut encoder, &targets.visibility);
            if let Some(times) = times {
                times.resolve(&mut encoder, 1);
            }
            gpu.queue.submit([encoder.finish()]);
        })?;
        let spans = Spans::new(records, frame, exposure);
        self.ids.map(gpu, |ids| look(&spans, ids))
    }
}
