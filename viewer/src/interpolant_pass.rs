//! Pass (c): the light at every pixel (Hardt & Teller 1996, section 2.6), one compute invocation a pixel.

use std::sync::OnceLock;

use crate::{Mode, gpu::bind_group};

/// Source of the shader.
pub(crate) const SHADER: &str = concat!(
    include_str!("shaders/frame.wgsl"),
    include_str!("shaders/record_buffers.wgsl"),
    include_str!("shaders/evaluation.wgsl"),
    include_str!("shaders/interpolant_pass.wgsl")
);

/// Side of the square of pixels that a workgroup takes; the shader says the same.
const WORKGROUP: u32 = 8;

/// The pass. Every mode has a pipeline of its own, and each another one for bakes with textures: a software adapter runs
/// both sides of every branch that it cannot fold. They are made when they are first drawn with.
pub(crate) struct InterpolantPass {
    device: wgpu::Device,
    module: wgpu::ShaderModule,
    pipeline_layout: wgpu::PipelineLayout,
    frame_layout: wgpu::BindGroupLayout,
    /// Layout of what the pass reads of a bake: triangles, elements, corners, textures.
    pub bake_layout: wgpu::BindGroupLayout,
    pipelines: [[OnceLock<wgpu::ComputePipeline>; 2]; Mode::ALL.len()],
}

impl InterpolantPass {
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

    pub fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("interpolant"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        // Explicit, because a layout made from one mode's shader would lack what the others read.
        let layout = |label, types: &[wgpu::BindingType]| {
            let entry = |(binding, &ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty,
                count: None,
            };
            let entries: Vec<_> = (0..).zip(types).map(entry).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let frame_layout = layout(
            "frame",
            &[
                buffer(wgpu::BufferBindingType::Uniform),
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Uint,
                    view_dimension,
                    multisampled: false,
                },
                wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: Self::FORMAT,
                    view_dimension,
                },
            ],
        );
        let bake_layout = layout("bake", &[buffer(wgpu::BufferBindingType::Storage { read_only: true }); 4]);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("interpolant"),
            bind_group_layouts: &[Some(&frame_layout), Some(&bake_layout)],
            immediate_size: 0,
        });
        Self {
            device: device.clone(),
            module,
            pipeline_layout,
            frame_layout,
            bake_layout,
            pipelines: Default::default(),
        }
    }

    /// What the pass reads and writes besides the bake.
    pub fn inputs(
        &self,
        device: &wgpu::Device,
        uniform: &wgpu::Buffer,
        visibility: &wgpu::TextureView,
        picture: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let texture = wgpu::BindingResource::TextureView;
        let resources = [uniform.as_entire_binding(), texture(visibility), texture(picture)];
        bind_group(device, &self.frame_layout, &resources)
    }

    /// Evaluates every pixel of a visibility buffer of a width and height.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: [&wgpu::BindGroup; 2],
        (mode, is_textured): (Mode, bool),
        [width, height]: [u32; 2],
        times: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) {
        let mut pass = encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("interpolant"), timestamp_writes: times });
        pass.set_pipeline(self.pipeline(mode, is_textured));
        (0..).zip(inputs).for_each(|(group, inputs)| pass.set_bind_group(group, inputs, &[]));
        pass.dispatch_workgroups(width.div_ceil(WORKGROUP), height.div_ceil(WORKGROUP), 1);
    }

    fn pipeline(&self, mode: Mode, is_textured: bool) -> &wgpu::ComputePipeline {
        self.pipelines[mode as usize][usize::from(is_textured)].get_or_init(|| {
            let constants = [("MODE", f64::from(mode as u8)), ("TEXTURED", f64::from(u8::from(is_textured)))];
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(mode.name()),
                layout: Some(&self.pipeline_layout),
                module: &self.module,
                entry_point: Some("interpolate"),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
                cache: None,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid() {
        crate::test_room::validate_shader(super::SHADER);
    }
}
