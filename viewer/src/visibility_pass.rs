//! Passes (a) and (b): which triangle is seen at a pixel, and where on it (Hardt & Teller 1996, sections 2.4 and 2.5).
//!
//! The paper needed two renderings, a colour per triangle and a texture of coordinates. Here the rasteriser tells the
//! triangle alone, 4 bytes a pixel, and whoever evaluates the pixel finds the barycentrics where its ray meets the
//! triangle's plane (Burns and Hunt 2013, "The visibility buffer"): a software rasteriser interpolates, and a memory
//! carries, for more than that.

use crate::{id_mesh::IdVertex, mesh_pass::MeshPass};

/// Source of the shader.
pub(crate) const SHADER: &str =
    concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/visibility_pass.wgsl"));

/// A pixel: the triangle's id plus one with [`BACK`] where its back is seen, 0 for nothing.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Set in a pixel whose triangle is seen from the back.
pub(crate) const BACK: u32 = 1 << 31;

/// The pass; `shared` where vertices are, which needs a driver that hands a triangle's id on from its first corner.
pub(crate) fn visibility_pass(device: &wgpu::Device, shared: bool) -> MeshPass {
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<IdVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32],
    };
    let shader = if shared { SHADER.to_owned() } else { SHADER.replace("(flat)", "(flat, either)") };
    MeshPass::new(device, "visibility", &shader, vertices, FORMAT)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid_with_vertices_shared_or_not() {
        crate::test_room::validate_shader(super::SHADER);
        assert_eq!(super::SHADER.matches("(flat)").count(), 1);
        crate::test_room::validate_shader(&super::SHADER.replace("(flat)", "(flat, either)"));
    }
}
