//! The picture of polygon hardware in one pass, for comparison: colours of the corners, interpolated and shown.
//!
//! Mode [`Gouraud`](crate::Mode::Gouraud) is the same picture by the passes of all modes; this is what it takes where it
//! is all that a program does.

use crate::{gouraud_mesh::GouraudVertex, mesh_pass::MeshPass};

/// Source of the shader.
pub(crate) const SHADER: &str = concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/gouraud_pass.wgsl"));

/// The pass, for one format of the output.
pub(crate) fn gouraud_pass(device: &wgpu::Device, output: wgpu::TextureFormat) -> MeshPass {
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<GouraudVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32],
    };
    MeshPass::new(device, "gouraud", SHADER, vertices, output)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid() {
        crate::test_room::validate_shader(super::SHADER);
    }
}
