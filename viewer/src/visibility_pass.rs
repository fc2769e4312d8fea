//! Passes (a) and (b): triangle ids and barycentrics (Hardt & Teller 1996, sections 2.4 and 2.5).
//!
//! The paper needed two renderings, a colour per triangle and a texture of coordinates. Here both are one 8-byte
//! pixel: the id in 31 bits with one for the side, and s and t in 16 bits each. A step of 2⁻¹⁶ of a triangle's edge moves
//! the light of a picture by less than 1/255, and twice the bytes would cost more than they show.

use crate::{frame::Targets, gpu::ResidentBake, gpu::bind_group};

/// Source of the shader.
pub(crate) const SHADER: &str =
    concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/visibility_pass.wgsl"));

/// The pipeline of the pass.
pub(crate) struct VisibilityPass {
    pipeline: wgpu::RenderPipeline,
}

impl VisibilityPass {
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
    pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    pub fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("visibility"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("visibility"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<[f32; 3]>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3],
                })],
            },
            // Nothing is culled: back sides block.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Self::DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("pixel"),
                compilation_options: Default::default(),
                targets: &[Some(Self::FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline }
    }

    /// What the pass reads besides the bake.
    pub fn inputs(&self, device: &wgpu::Device, uniform: &wgpu::Buffer) -> wgpu::BindGroup {
        bind_group(device, &self.pipeline.get_bind_group_layout(0), &[uniform.as_entire_binding()])
    }

    /// Fills the visibility buffer; 0 where nothing is seen.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets, bake: &ResidentBake) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("visibility"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.visibility,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &targets.visibility_inputs, &[]);
        pass.set_vertex_buffer(0, bake.corners.slice(..));
        pass.draw(0..bake.triangles * 3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid() {
        crate::test_room::validate_shader(super::SHADER);
    }
}
