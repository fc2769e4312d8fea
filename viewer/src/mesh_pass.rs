//! What passes that draw triangles have in common: the nearest is kept, and only what is in view is drawn.

use std::ops::Range;

use wgpu::util::DeviceExt;

/// Reversed infinite depth: nearer is more.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Triangles in the adapter's memory.
pub(crate) struct Mesh {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
}

impl Mesh {
    /// Copies vertices, and three indices by triangle.
    pub fn upload(device: &wgpu::Device, label: &str, vertices: &[impl bytemuck::Pod], indices: &[[u32; 3]]) -> Self {
        let buffer = |contents, usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        Self {
            vertices: buffer(bytemuck::cast_slice(vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(indices), wgpu::BufferUsages::INDEX),
        }
    }
}

/// A pass that draws triangles: its shader has the entry points `corner` and `pixel`, and reads the frame's uniform.
pub(crate) struct MeshPass {
    label: &'static str,
    pipeline: wgpu::RenderPipeline,
}

impl MeshPass {
    pub fn new(
        device: &wgpu::Device,
        label: &'static str,
        shader: &str,
        vertices: wgpu::VertexBufferLayout<'_>,
        target: wgpu::TextureFormat,
    ) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(shader.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[Some(vertices)],
            },
            // Nothing is culled: back sides block.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
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
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { label, pipeline }
    }

    /// The layout of what the shader reads besides the mesh.
    pub fn layout(&self) -> wgpu::BindGroupLayout {
        self.pipeline.get_bind_group_layout(0)
    }

    /// Draws the triangles of some ranges on nothing: 0 where none is seen.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        [colour, depth]: [&wgpu::TextureView; 2],
        inputs: &wgpu::BindGroup,
        mesh: &Mesh,
        triangles: &[Range<u32>],
        times: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(self.label),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: colour,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            timestamp_writes: times,
            ..Default::default()
        });
        if triangles.is_empty() {
            return; // An empty mesh has no buffers to set.
        }
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, inputs, &[]);
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        for range in triangles {
            pass.draw_indexed(3 * range.start..3 * range.end, 0, 0..1);
        }
    }
}
