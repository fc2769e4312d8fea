//! The panels, painted over the picture by the adapter. `overlay_twin.rs` paints them on the CPU.

use crate::{Gpu, painting::Painting};

/// egui's own pass.
pub(crate) struct OverlayPass {
    renderer: egui_wgpu::Renderer,
}

impl OverlayPass {
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat) -> Self {
        // Without dithering the pixels are those of the twin.
        let options = egui_wgpu::RendererOptions { dithering: false, ..Default::default() };
        Self { renderer: egui_wgpu::Renderer::new(device, output, options) }
    }

    /// Takes over the textures that a painting brings.
    pub fn take_textures(&mut self, gpu: &Gpu, painting: &Painting) {
        for (id, delta) in painting.textures.set.iter().flat_map(|(id, deltas)| deltas.iter().map(move |d| (id, d))) {
            self.renderer.update_texture(&gpu.device, &gpu.queue, *id, delta);
        }
    }

    /// Paints over an output of a size in pixels, or over darkness, submits all, and frees what the painting no longer needs.
    pub fn encode(
        &mut self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        painting: &Painting,
        size_in_pixels: [u32; 2],
        output: &wgpu::TextureView,
        over_darkness: bool,
    ) {
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels, pixels_per_point: painting.pixels_per_point };
        let jobs = &painting.primitives;
        let first = self.renderer.update_buffers(&gpu.device, &gpu.queue, &mut encoder, jobs, &screen);
        {
            let load = if over_darkness { wgpu::LoadOp::Clear(wgpu::Color::BLACK) } else { wgpu::LoadOp::Load };
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("overlay"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: output,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
                })],
                ..Default::default()
            });
            self.renderer.render(&mut pass.forget_lifetime(), jobs, &screen);
        }
        gpu.queue.submit(first.into_iter().chain([encoder.finish()]));
        for id in &painting.textures.free {
            self.renderer.free_texture(id);
        }
    }
}
