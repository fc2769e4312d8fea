//! Pass (d): exposure, tone curve and sRGB (Hardt & Teller 1996, section 2.7, copied pixels as they were).
//! [`scene::Exposure`], [`scene::ToneCurve`] and [`scene::encode_srgb`] say the same on the CPU.

use crate::gpu::bind_group;

/// Source of the shader.
pub(crate) const SHADER: &str = concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/tone_map_pass.wgsl"));

/// The pipeline of the pass, for one format of the output.
pub(crate) struct ToneMapPass {
    pipeline: wgpu::RenderPipeline,
}

impl ToneMapPass {
    /// The pass. In a window nothing shines through; in a picture alpha is 0 where nothing was hit.
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat, is_window: bool) -> Self {
        let write_mask = if is_window { wgpu::ColorWrites::COLOR } else { wgpu::ColorWrites::ALL };
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("tone map"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("tone map"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("pixel"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState { format: output, blend: None, write_mask })],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline }
    }

    /// What the pass reads.
    pub fn inputs(
        &self,
        device: &wgpu::Device,
        uniform: &wgpu::Buffer,
        picture: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let resources = [uniform.as_entire_binding(), wgpu::BindingResource::TextureView(picture)];
        bind_group(device, &self.pipeline.get_bind_group_layout(0), &resources)
    }

    /// Writes the picture to an output of the same size.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &wgpu::BindGroup,
        output: &wgpu::TextureView,
        times: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: output,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            timestamp_writes: times,
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, inputs, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid() {
        crate::test_room::validate_shader(super::SHADER);
    }
}
