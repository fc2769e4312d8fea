//! Headless pictures: a frame drawn by the adapter and read back.

use glam::Vec3;
use scene::{Baked, Camera, Exposure, ToneCurve};

use crate::{
    Frame, Gpu, Mode, Picture, ViewerError,
    frame::{Targets, encode_frame},
    gpu::{ResidentBake, guarded},
    records::Records,
    twin::Twin,
};

/// Draws a picture of a bake on a graphics adapter; for more than one, see [`Capture`].
///
/// # Errors
/// Any [`ViewerError`] but those of a window: an empty or too large picture, an invalid camera, a bake too large for the
/// adapter, a driver that fails.
pub fn draw_on_gpu(gpu: &Gpu, baked: &Baked, frame: &Frame) -> Result<Picture, ViewerError> {
    if !frame.camera.is_valid() {
        return Err(ViewerError::InvalidCamera);
    }
    let capture = Capture::new(gpu, baked, frame.width, frame.height)?;
    let exposure = frame.exposure.unwrap_or_else(|| Twin::new(baked).meter(&frame.camera, frame.width, frame.height));
    capture.draw(&frame.camera, frame.mode, exposure, frame.curve)
}

/// A bake in an adapter's memory, and everything that pictures of one size need: for drawing many.
pub struct Capture<'a> {
    gpu: &'a Gpu,
    bake: ResidentBake,
    targets: Targets,
    output: wgpu::Texture,
    picture: ReadBack,
    shown: ReadBack,
}

impl<'a> Capture<'a> {
    /// Brings a bake that validates into the adapter's memory, to draw pictures of a size in pixels.
    ///
    /// # Errors
    /// As [`draw_on_gpu`].
    pub fn new(gpu: &'a Gpu, baked: &Baked, width: u32, height: u32) -> Result<Self, ViewerError> {
        let targets = Targets::new(gpu, width, height)?;
        let bake = ResidentBake::upload(gpu, &Records::of(baked))?;
        let output = guarded(&gpu.device, || {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("output"),
                size: targets.picture.size(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        })?;
        let picture = ReadBack::new(gpu, &targets.picture)?;
        let shown = ReadBack::new(gpu, &output)?;
        Ok(Self { gpu, bake, targets, output, picture, shown })
    }

    /// Draws a picture and reads it back.
    ///
    /// # Errors
    /// [`ViewerError::InvalidCamera`], and [`ViewerError::Driver`] when the driver fails.
    pub fn draw(
        &self,
        camera: &Camera,
        mode: Mode,
        exposure: Exposure,
        curve: ToneCurve,
    ) -> Result<Picture, ViewerError> {
        if !camera.is_valid() {
            return Err(ViewerError::InvalidCamera);
        }
        let (width, height) = (self.targets.width, self.targets.height);
        let frame = Frame { camera: *camera, width, height, mode, exposure: Some(exposure), curve };
        guarded(&self.gpu.device, || {
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let view = self.output.create_view(&wgpu::TextureViewDescriptor::default());
            encode_frame(self.gpu, &mut encoder, &self.bake, &self.targets, &frame, exposure, &view);
            self.picture.copy(&mut encoder, &self.targets.picture);
            self.shown.copy(&mut encoder, &self.output);
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        let texels: Vec<[f32; 4]> = self.picture.read(self.gpu)?;
        let bytes: Vec<[u8; 4]> = self.shown.read(self.gpu)?;
        Ok(Picture {
            width,
            height,
            radiance: texels.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect(),
            rgb: bytes.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
            background: texels.iter().filter(|texel| texel[3] == 0.0).count() as u64,
            exposure,
        })
    }
}

/// A buffer that a texture is copied to and the host reads.
struct ReadBack {
    buffer: wgpu::Buffer,
    /// Bytes of a row's pixels, and of a row with its padding.
    row: u32,
    padded_row: u32,
    height: u32,
}

impl ReadBack {
    /// A buffer for the pixels of a texture.
    fn new(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Self, ViewerError> {
        let limits = gpu.device.limits();
        let (width, height) = (texture.width(), texture.height());
        let row = width * texture.format().block_copy_size(None).unwrap_or(0);
        let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(padded_row) * u64::from(height);
        if size > limits.max_buffer_size {
            return Err(ViewerError::PictureTooLarge { width, height, limit: limits.max_texture_dimension_2d });
        }
        let buffer = guarded(&gpu.device, || {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read-back"),
                size,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        Ok(Self { buffer, row, padded_row, height })
    }

    fn copy(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.padded_row),
            rows_per_image: Some(self.height),
        };
        let target = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    }

    /// Waits for the copy and takes the pixels without the padding.
    fn read<Pixel: bytemuck::Pod>(&self, gpu: &Gpu) -> Result<Vec<Pixel>, ViewerError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits below; if it is gone, nobody wants the answer.
            let _ = sender.send(result);
        });
        let failed = |cause: &dyn std::fmt::Display| ViewerError::Driver(cause.to_string());
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|cause| failed(&cause))?;
        receiver.recv().map_err(|cause| failed(&cause))?.map_err(|cause| failed(&cause))?;
        let mut pixels = Vec::with_capacity(self.row as usize / size_of::<Pixel>() * self.height as usize);
        let bytes = self.buffer.get_mapped_range(..).map_err(|cause| failed(&cause))?;
        for row in bytes.chunks_exact(self.padded_row as usize) {
            pixels.extend(
                row[..self.row as usize].chunks_exact(size_of::<Pixel>()).map(bytemuck::pod_read_unaligned::<Pixel>),
            );
        }
        drop(bytes);
        self.buffer.unmap();
        Ok(pixels)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::print_stderr)]

    use glam::DVec3;

    use super::*;
    use crate::{
        draw_on_cpu,
        test_room::{camera, room, textured_room},
    };

    /// An adapter; none, loudly, where there is none and HALFLIGHT_REQUIRE_GPU does not ask for one.
    fn gpu() -> Option<Gpu> {
        match Gpu::headless() {
            Ok(gpu) => Some(gpu),
            Err(error @ ViewerError::NoAdapter(_)) if std::env::var("HALFLIGHT_REQUIRE_GPU").as_deref() != Ok("1") => {
                eprintln!("SKIPPED, nothing was tested: {error}");
                None
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn frame(mode: Mode) -> Frame {
        Frame { camera: camera(), width: 321, height: 203, mode, exposure: None, curve: ToneCurve::default() }
    }

    #[test]
    fn what_cannot_be_drawn_is_an_error() {
        let Some(gpu) = gpu() else { return };
        let draw = |frame| draw_on_gpu(&gpu, &room(), &frame).unwrap_err();
        for (width, height) in [(0, 0), (0, 9), (9, 0)] {
            let error = draw(Frame { width, height, ..frame(Mode::Shaded) });
            assert!(matches!(error, ViewerError::EmptyPicture { .. }), "{error}");
        }
        let error = draw(Frame { width: u32::MAX, height: 1, ..frame(Mode::Shaded) });
        assert!(matches!(error, ViewerError::PictureTooLarge { width: u32::MAX, .. }), "{error}");
        let error = draw(Frame { camera: Camera { vertical_fov: f64::NAN, ..camera() }, ..frame(Mode::Shaded) });
        assert!(matches!(error, ViewerError::InvalidCamera), "{error}");
    }

    #[test]
    fn an_empty_bake_is_background() {
        let Some(gpu) = gpu() else { return };
        for mode in Mode::ALL {
            let picture = draw_on_gpu(&gpu, &Baked::default(), &frame(mode)).unwrap();
            assert_eq!(picture.background, 321 * 203);
            assert_eq!(picture, draw_on_cpu(&Baked::default(), &frame(mode)));
        }
    }

    /// The passes against their twin, on views that see lamp, corners, back sides and background.
    #[test]
    fn gpu_and_cpu_draw_the_same_picture_in_every_mode() {
        let Some(gpu) = gpu() else { return };
        let outside = Camera { eye: DVec3::new(-1.5, -2.0, 5.0), ..camera() };
        let inside_a_wall = Camera { eye: DVec3::new(0.0, 1.0, 1.0), ..camera() };
        for (mode, room) in Mode::ALL.into_iter().flat_map(|mode| [(mode, room()), (mode, textured_room())]) {
            for camera in [camera(), outside, inside_a_wall] {
                let frame = Frame { camera, ..frame(mode) };
                let ours = draw_on_gpu(&gpu, &room, &frame).unwrap();
                let twin = draw_on_cpu(&room, &frame);
                let off = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
                let differing = ours.rgb.iter().zip(&twin.rgb).filter(|&pair| off(pair)).count();
                assert!(differing <= frame.pixels() / 1000, "{mode} from {}: {differing} pixels differ", camera.eye);
                let error: f32 = ours.radiance.iter().zip(&twin.radiance).map(|(a, b)| (*a - *b).length()).sum();
                let total: f32 = twin.radiance.iter().map(|radiance| radiance.length()).sum();
                assert!(error <= 1e-3 * total, "{mode} from {}: mean error {error} of {total}", camera.eye);
                assert_eq!(ours.exposure, twin.exposure);
                assert!(ours.background.abs_diff(twin.background) <= frame.pixels() as u64 / 1000);
            }
        }
    }

    #[test]
    fn gpu_and_cpu_have_the_same_tone_curves() {
        let Some(gpu) = gpu() else { return };
        let pictures = ToneCurve::ALL.map(|curve| {
            let frame = Frame { curve, ..frame(Mode::Shaded) };
            let (ours, twin) = (draw_on_gpu(&gpu, &room(), &frame).unwrap(), draw_on_cpu(&room(), &frame));
            let off = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
            let differing = ours.rgb.iter().zip(&twin.rgb).filter(|&pair| off(pair)).count();
            assert!(differing <= frame.pixels() / 1000, "{curve:?}: {differing} pixels differ");
            ours.rgb
        });
        assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2] && pictures[2] != pictures[0]);
    }

    #[test]
    fn no_pixel_of_a_closed_room_is_background() {
        let Some(gpu) = gpu() else { return };
        let room = room();
        for i in 0..12 {
            let angle = f64::from(i) * std::f64::consts::FRAC_PI_6;
            let eye = DVec3::new(1.9, 1.4, 1.2);
            let target = eye + DVec3::new(angle.cos(), angle.sin(), 0.3 * f64::from(i % 3) - 0.3);
            let camera = Camera { eye, target, ..camera() };
            let frame = Frame { camera, width: 640, height: 480, ..frame(Mode::Shaded) };
            assert_eq!(draw_on_gpu(&gpu, &room, &frame).unwrap().background, 0);
        }
    }
}
