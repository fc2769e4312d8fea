//! The frame as one readable function: visibility, interpolant, tone map.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use scene::{Camera, Exposure, ToneCurve};

use crate::{
    Evaluator, Frame, Gpu, ViewerError,
    gpu::{ResidentBake, ResidentLight, bind_group, guarded},
    host_pass::HostPass,
    interpolant_pass::InterpolantPass,
    mesh_pass::DEPTH_FORMAT,
    timestamps::Timestamps,
    timing::FrameTimes,
    visibility_pass,
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
    /// Place of the environment's first word among the textures; 0 for none.
    pub sky: u32,
    /// Known to the browser's pass alone.
    pub triangles: u32,
}

impl FrameUniform {
    /// The numbers of a frame whose camera is valid; whoever has the records adds where the environment is.
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
            sky: 0,
            triangles: 0,
        }
    }

    /// The frame's tone curve.
    pub fn tone_curve(&self) -> ToneCurve {
        ToneCurve::ALL[self.curve as usize]
    }
}

/// The pictures between the passes, and how each pass sees them; made anew when the size changes.
pub(crate) struct Targets {
    pub width: u32,
    pub height: u32,
    /// Which triangle is seen at every pixel.
    pub visibility: wgpu::Texture,
    visibility_view: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    pub uniform: wgpu::Buffer,
    visibility_inputs: wgpu::BindGroup,
    pub evaluation: Evaluation,
}

/// Where pass (c) writes to, and pass (d) reads from.
pub(crate) enum Evaluation {
    /// On the adapter.
    Adapter {
        /// Radiance or display-linear colour; the fourth number is 1 where something was hit.
        picture: wgpu::Texture,
        interpolant_inputs: wgpu::BindGroup,
        tone_map_inputs: wgpu::BindGroup,
    },
    /// In the host's memory.
    Host(HostPass),
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
        let size = [width, height];
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let (visibility, depth, uniform) = guarded(&gpu.device, || {
            let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: size_of::<FrameUniform>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let visibility = texture(gpu, "visibility", size, visibility_pass::FORMAT, attachment | read);
            (visibility, texture(gpu, "depth", size, DEPTH_FORMAT, attachment), uniform)
        })?;
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let visibility_view = view(&visibility);
        let evaluation = match gpu.evaluator {
            Evaluator::Host => Evaluation::Host(HostPass::new(gpu, &visibility)?),
            Evaluator::Adapter => guarded(&gpu.device, || {
                let written = wgpu::TextureUsages::STORAGE_BINDING | read;
                let picture = texture(gpu, "picture", size, InterpolantPass::FORMAT, written);
                let passes = &gpu.passes;
                Evaluation::Adapter {
                    interpolant_inputs: passes.interpolant().inputs(
                        &gpu.device,
                        &uniform,
                        &visibility_view,
                        &view(&picture),
                    ),
                    tone_map_inputs: passes.tone_map().inputs(&gpu.device, &uniform, &view(&picture)),
                    picture,
                }
            })?,
        };
        guarded(&gpu.device, || Self {
            width,
            height,
            visibility_inputs: bind_group(
                &gpu.device,
                &gpu.passes.visibility().layout(),
                &[uniform.as_entire_binding()],
            ),
            visibility,
            visibility_view,
            depth: view(&depth),
            uniform,
            evaluation,
        })
    }

    /// Tells the passes of a frame whose camera is valid, and of the place of the environment.
    pub fn write_uniform(&self, gpu: &Gpu, frame: &Frame, exposure: Exposure, sky: u32) {
        let uniform = FrameUniform { sky, ..FrameUniform::of(frame, exposure) };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }
}

/// A picture of one sample a pixel in the adapter's memory.
pub(crate) fn texture(
    gpu: &Gpu,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// A frame whose camera is valid, what it shows, and what it is drawn with.
#[derive(Clone, Copy)]
pub(crate) struct Drawing<'a> {
    pub gpu: &'a Gpu,
    pub bake: &'a ResidentBake,
    pub targets: &'a Targets,
    pub frame: &'a Frame,
    pub exposure: Exposure,
    /// Tells what the passes took, where somebody asks.
    pub times: Option<&'a Timestamps>,
}

/// Draws a frame: what is seen, how bright it is, and what a display makes of it.
///
/// Where the host evaluates, what is seen has been drawn and evaluated when this returns, with what it took; the encoder then
/// brings it to the output. An adapter tells its times later.
///
/// # Errors
/// [`ViewerError::Driver`] where the host waits for a driver that fails.
pub(crate) fn encode_frame(
    drawing: &Drawing<'_>,
    encoder: &mut wgpu::CommandEncoder,
    output: &wgpu::TextureView,
) -> Result<Option<FrameTimes>, ViewerError> {
    match &drawing.targets.evaluation {
        Evaluation::Host(pass) => {
            let took = pass.evaluate(drawing)?;
            pass.encode(drawing.gpu, encoder, output);
            Ok(Some(took))
        }
        Evaluation::Adapter { .. } => {
            encode_passes(drawing, encoder, output);
            if let Some(times) = drawing.times {
                times.resolve(encoder, PASSES.len() as u32);
            }
            Ok(None)
        }
    }
}

/// Passes that [`encode_passes`] may tell the times of, in their order.
pub(crate) const PASSES: [&str; 3] = ["visibility", "interpolant", "tone_map"];

/// Draws a frame that the adapter evaluates.
pub(crate) fn encode_passes(drawing: &Drawing<'_>, encoder: &mut wgpu::CommandEncoder, output: &wgpu::TextureView) {
    encode_visibility(drawing, encoder);
    let Drawing { gpu, bake, targets, frame, times, .. } = drawing;
    // A bake and the pictures that it is drawn on are for the same adapter, which has one evaluator.
    if let (
        ResidentLight::Adapter { inputs, is_textured },
        Evaluation::Adapter { interpolant_inputs, tone_map_inputs, .. },
    ) = (&bake.light, &targets.evaluation)
    {
        gpu.passes.interpolant().encode(
            encoder,
            [interpolant_inputs, inputs],
            (frame.mode, *is_textured),
            [targets.width, targets.height],
            times.map(|times| times.of_compute(1)),
        );
        gpu.passes.tone_map().encode(encoder, tone_map_inputs, output, times.map(|times| times.of_render(2)));
    }
}

/// Passes (a) and (b), where somebody else does the rest.
pub(crate) fn encode_visibility(drawing: &Drawing<'_>, encoder: &mut wgpu::CommandEncoder) {
    let &Drawing { gpu, bake, targets, frame, exposure, times } = drawing;
    targets.write_uniform(gpu, frame, exposure, bake.sky);
    gpu.passes.visibility().encode(
        encoder,
        [&targets.visibility_view, &targets.depth],
        &targets.visibility_inputs,
        &bake.mesh,
        &bake.chunks.in_view(&frame.camera, targets.width, targets.height),
        times.map(|times| times.of_render(0)),
    );
}
