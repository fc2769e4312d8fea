//! The frame as one readable function: visibility, interpolant, tone map.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use scene::{Camera, Exposure};

use crate::{
    Frame, Gpu, ViewerError,
    gpu::{ResidentBake, guarded},
    interpolant_pass::InterpolantPass,
    tone_map_pass::ToneMapPass,
    visibility_pass::VisibilityPass,
};

/// Distance of the near plane, metres. Reversed infinite depth loses no precision by a near plane this close, and an
/// eye is never nearer to a wall; anything above 0 would do.
pub(crate) const NEAR: f64 = 1e-4;

/// What all passes know of a frame; `shaders/frame.wgsl` has the same layout.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct FrameUniform {
    pub clip_from_eye: [f32; 16],
    pub eye: [f32; 3],
    pub focal: f32,
    pub right: [f32; 3],
    pub exposure: f32,
    pub up: [f32; 3],
    pub is_light: u32,
    pub forward: [f32; 3],
    pub curve: u32,
    pub size: [f32; 2],
    pub padding_size: [f32; 2],
}

impl FrameUniform {
    /// The numbers of a frame whose camera is valid.
    pub fn of(frame: &Frame, exposure: Exposure) -> Self {
        let camera = frame.camera;
        let (right, up, forward) = camera.basis();
        // Seen from the eye: the shader subtracts it before it multiplies, so that no precision is lost far from the
        // origin.
        let at_origin = Camera { eye: DVec3::ZERO, target: camera.target - camera.eye, ..camera };
        let focal = f64::from(frame.height) / (2.0 * (camera.vertical_fov / 2.0).tan());
        Self {
            clip_from_eye: at_origin.clip_from_world(frame.width, frame.height, NEAR).to_cols_array(),
            eye: camera.eye.as_vec3().to_array(),
            focal: focal as f32,
            right: right.as_vec3().to_array(),
            exposure: exposure.factor(),
            up: up.as_vec3().to_array(),
            is_light: frame.mode.is_light().into(),
            forward: forward.as_vec3().to_array(),
            curve: frame.curve as u32,
            size: [frame.width as f32, frame.height as f32],
            padding_size: [0.0; 2],
        }
    }
}

/// The passes' pipelines, for one format of the output.
pub(crate) struct Passes {
    pub visibility: VisibilityPass,
    pub interpolant: InterpolantPass,
    pub tone_map: ToneMapPass,
}

impl Passes {
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat) -> Self {
        Self {
            visibility: VisibilityPass::new(device),
            interpolant: InterpolantPass::new(device),
            tone_map: ToneMapPass::new(device, output),
        }
    }
}

/// The pictures between the passes, and how each pass sees them; made anew when the size changes.
pub(crate) struct Targets {
    pub width: u32,
    pub height: u32,
    /// Radiance or display-linear colour; the fourth number is 1 where something was hit.
    pub picture: wgpu::Texture,
    pub visibility: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    uniform: wgpu::Buffer,
    pub visibility_inputs: wgpu::BindGroup,
    pub interpolant_inputs: wgpu::BindGroup,
    pub tone_map_inputs: wgpu::BindGroup,
}

impl Targets {
    /// The pictures for a size.
    ///
    /// # Errors
    /// [`ViewerError::EmptyPicture`], [`ViewerError::PictureTooLarge`], and [`ViewerError::Driver`] when memory is full.
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self, ViewerError> {
        if width == 0 || height == 0 {
            return Err(ViewerError::EmptyPicture { width, height });
        }
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width.max(height) > limit {
            return Err(ViewerError::PictureTooLarge { width, height, limit });
        }
        guarded(&gpu.device, || {
            let texture = |label, format, usage| {
                gpu.device.create_texture(&wgpu::TextureDescriptor {
                    label: Some(label),
                    size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                    view_formats: &[],
                })
            };
            let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
            let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
            let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
            let visibility = view(&texture("visibility", VisibilityPass::FORMAT, attachment));
            let depth = view(&texture("depth", VisibilityPass::DEPTH_FORMAT, attachment));
            let picture = texture("picture", InterpolantPass::FORMAT, written);
            let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: size_of::<FrameUniform>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let passes = &gpu.passes;
            Self {
                visibility_inputs: passes.visibility.inputs(&gpu.device, &uniform),
                interpolant_inputs: passes.interpolant.inputs(&gpu.device, &uniform, &visibility, &view(&picture)),
                tone_map_inputs: passes.tone_map.inputs(&gpu.device, &uniform, &view(&picture)),
                width,
                height,
                picture,
                visibility,
                depth,
                uniform,
            }
        })
    }
}

/// Draws a frame whose camera is valid: what is seen, how bright it is, and what a display makes of it.
pub(crate) fn encode_frame(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    bake: &ResidentBake,
    targets: &Targets,
    frame: &Frame,
    exposure: Exposure,
    output: &wgpu::TextureView,
) {
    let uniform = FrameUniform::of(frame, exposure);
    gpu.queue.write_buffer(&targets.uniform, 0, bytemuck::bytes_of(&uniform));
    gpu.passes.visibility.encode(encoder, targets, bake);
    gpu.passes.interpolant.encode(encoder, targets, bake, frame.mode);
    gpu.passes.tone_map.encode(encoder, targets, output);
}
