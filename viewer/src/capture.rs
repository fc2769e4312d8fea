//! Headless pictures: a frame drawn by the adapter and read back.

use std::cell::OnceCell;

use glam::Vec3;
use scene::{Baked, Exposure};

use crate::{
    Frame, Gpu, Mode, Picture, ViewerError,
    frame::{Drawing, Evaluation, PASSES, Targets, encode_passes, texture},
    gouraud_mesh::GouraudMesh,
    gpu::{ResidentBake, bind_group, guarded},
    mesh_pass::Mesh,
    read_back::{ReadBack, Rows},
    timestamps::Timestamps,
    timing::{FrameTimes, Stopwatch},
    twin::Twin,
};

/// Draws a picture of a bake on a graphics adapter, radiance included; for more than one, see [`Capture`].
///
/// # Errors
/// Any [`ViewerError`] but those of a window: an empty or too large picture, an invalid camera, a bake too large for the
/// adapter, a driver that fails.
pub fn draw_on_gpu(gpu: &Gpu, baked: &Baked, frame: &Frame) -> Result<Picture, ViewerError> {
    if !frame.camera.is_valid() {
        return Err(ViewerError::InvalidCamera);
    }
    Capture::new(gpu, baked, &Twin::new(baked), frame.width, frame.height)?.draw(frame)
}

/// A bake in an adapter's memory, and everything that pictures of one size need: for drawing many.
pub struct Capture<'a> {
    gpu: &'a Gpu,
    baked: &'a Baked,
    twin: &'a Twin,
    bake: ResidentBake,
    targets: Targets,
    output: wgpu::Texture,
    shown: ReadBack,
    timestamps: Option<Timestamps>,
    /// The mesh of the Gouraud pass and what it reads, once they are asked for.
    gouraud: OnceCell<(Mesh, wgpu::BindGroup)>,
}

impl<'a> Capture<'a> {
    /// Brings a bake that validates into the adapter's memory, to draw pictures of a size in pixels; `twin` is the bake's.
    ///
    /// # Errors
    /// As [`draw_on_gpu`].
    pub fn new(gpu: &'a Gpu, baked: &'a Baked, twin: &'a Twin, width: u32, height: u32) -> Result<Self, ViewerError> {
        let targets = Targets::new(gpu, width, height)?;
        let bake = ResidentBake::upload(gpu, &twin.records)?;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let output = guarded(&gpu.device, || texture(gpu, "output", [width, height], format, usage))?;
        let shown = ReadBack::new(gpu, &output)?;
        let timestamps = Timestamps::new(gpu, PASSES.len() as u32)?;
        Ok(Self { gpu, baked, twin, bake, targets, output, shown, timestamps, gouraud: OnceCell::new() })
    }

    /// Draws a picture of this size, radiance included.
    ///
    /// # Errors
    /// [`ViewerError::InvalidCamera`], and [`ViewerError::Driver`] when the driver fails.
    pub fn draw(&self, frame: &Frame) -> Result<Picture, ViewerError> {
        let (frame, exposure) = self.exposed(frame)?;
        let (mut picture, _) = self.show(&frame, exposure, |rows| self.picture(rows, exposure))?;
        picture.radiance = match &self.targets.evaluation {
            Evaluation::Host(pass) => pass.radiance(&Drawing { times: None, ..self.drawing(&frame, exposure) })?,
            Evaluation::Adapter { picture, .. } => {
                // The frame has left it there.
                let radiance = ReadBack::new(self.gpu, picture)?;
                self.submit(|encoder| radiance.copy(encoder, picture))?;
                let texels: Vec<[f32; 4]> = radiance.map(self.gpu, |rows| rows.to_vec())?;
                texels.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect()
            }
        };
        Ok(picture)
    }

    /// Draws what a display shows; the picture's radiance is left out.
    ///
    /// # Errors
    /// As [`Capture::draw`].
    pub fn display(&self, frame: &Frame) -> Result<Picture, ViewerError> {
        let (frame, exposure) = self.exposed(frame)?;
        Ok(self.show_fastest(&frame, exposure, |rows| self.picture(rows, exposure))?.0)
    }

    /// Draws what a display shows into the host's memory, and says what that took.
    ///
    /// # Errors
    /// As [`Capture::draw`].
    pub fn time(&self, frame: &Frame) -> Result<FrameTimes, ViewerError> {
        let (frame, exposure) = self.exposed(frame)?;
        Ok(self.show_fastest(&frame, exposure, |_| ())?.1)
    }

    /// The frame at this size, and its exposure.
    fn exposed(&self, frame: &Frame) -> Result<(Frame, Exposure), ViewerError> {
        if !frame.camera.is_valid() {
            return Err(ViewerError::InvalidCamera);
        }
        let frame = Frame { width: self.targets.width, height: self.targets.height, ..*frame };
        Ok((frame, frame.exposure.unwrap_or_else(|| self.twin.meter(&frame))))
    }

    /// A frame at this size, with its times.
    fn drawing<'b>(&'b self, frame: &'b Frame, exposure: Exposure) -> Drawing<'b> {
        let Self { gpu, bake, targets, timestamps, .. } = self;
        Drawing { gpu, bake, targets, frame, exposure, times: timestamps.as_ref() }
    }

    fn picture(&self, shown: Rows<'_>, exposure: Exposure) -> Picture {
        let shown: Vec<[u8; 4]> = shown.to_vec();
        Picture {
            width: self.targets.width,
            height: self.targets.height,
            radiance: Vec::new(),
            rgb: shown.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
            background: shown.iter().filter(|pixel| pixel[3] == 0).count() as u64,
            exposure,
        }
    }

    /// Draws what a display shows in the fastest way that there is, and has `take` look at it.
    fn show_fastest<T>(
        &self,
        frame: &Frame,
        exposure: Exposure,
        take: impl FnOnce(Rows<'_>) -> T,
    ) -> Result<(T, FrameTimes), ViewerError> {
        if frame.mode == Mode::Gouraud && self.twin.records.textures.is_empty() {
            self.show_by_corners(frame, exposure, take)
        } else {
            self.show(frame, exposure, take)
        }
    }

    /// Draws by the passes of all modes.
    fn show<T>(
        &self,
        frame: &Frame,
        exposure: Exposure,
        take: impl FnOnce(Rows<'_>) -> T,
    ) -> Result<(T, FrameTimes), ViewerError> {
        let drawing = self.drawing(frame, exposure);
        match &self.targets.evaluation {
            Evaluation::Host(pass) => {
                let took = pass.evaluate(&drawing)?;
                Ok((take(Rows::of(&pass.pixels(), frame.width)), took))
            }
            Evaluation::Adapter { .. } => self.read_back(&PASSES, take, |encoder, output| {
                encode_passes(&drawing, encoder, output);
            }),
        }
    }

    /// Draws as polygon hardware does.
    fn show_by_corners<T>(
        &self,
        frame: &Frame,
        exposure: Exposure,
        take: impl FnOnce(Rows<'_>) -> T,
    ) -> Result<(T, FrameTimes), ViewerError> {
        let device = &self.gpu.device;
        let pass = self.gpu.passes.gouraud();
        let (mesh, inputs) = self.gouraud.get_or_init(|| {
            let GouraudMesh { vertices, indices } = GouraudMesh::of(self.baked);
            let uniform = self.targets.uniform.as_entire_binding();
            (Mesh::upload(device, "gouraud", &vertices, &indices), bind_group(device, &pass.layout(), &[uniform]))
        });
        self.read_back(&["gouraud+tone_map"], take, |encoder, output| {
            self.targets.write_uniform(self.gpu, frame, exposure, self.bake.sky);
            let triangles = self.bake.chunks.in_view(&frame.camera, frame.width, frame.height);
            let times = self.timestamps.as_ref().map(|times| times.of_render(0));
            pass.encode(encoder, [output, &self.targets.depth], inputs, mesh, &triangles, times);
        })
    }

    /// Has passes of these names draw to the output, reads it back, and has `take` look at it.
    fn read_back<T>(
        &self,
        passes: &[&'static str],
        take: impl FnOnce(Rows<'_>) -> T,
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::TextureView),
    ) -> Result<(T, FrameTimes), ViewerError> {
        let mut watch = Stopwatch::start();
        self.submit(|encoder| {
            draw(encoder, &self.output.create_view(&wgpu::TextureViewDescriptor::default()));
            self.shown.copy(encoder, &self.output);
            if let Some(times) = &self.timestamps {
                times.resolve(encoder, passes.len() as u32);
            }
        })?;
        let (frame_ms, taken) = self.shown.map(self.gpu, |rows| (watch.lap(), take(rows)))?;
        let parts_ms = match &self.timestamps {
            Some(times) => {
                let milliseconds = times.milliseconds(self.gpu, passes.len())?;
                let rest = frame_ms - milliseconds.iter().sum::<f64>();
                passes.iter().copied().zip(milliseconds).chain([("read_back", rest)]).collect()
            }
            None => vec![("passes+read_back", frame_ms)],
        };
        Ok((taken, FrameTimes { frame_ms, parts_ms }))
    }

    fn submit(&self, encode: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<(), ViewerError> {
        guarded(&self.gpu.device, || {
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encode(&mut encoder);
            self.gpu.queue.submit([encoder.finish()]);
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::print_stderr)]

    use glam::DVec3;
    use scene::{Camera, ToneCurve};

    use super::*;
    use crate::{
        Evaluator, draw_on_cpu,
        test_room::{camera, room, room_of_sheets, room_under_sky, textured_room},
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

    /// Whoever evaluates.
    fn gpus() -> Vec<Gpu> {
        let Some(one) = gpu() else { return Vec::new() };
        let other = gpu().map(|gpu| gpu.with_evaluator(Evaluator::Adapter));
        [Some(one.with_evaluator(Evaluator::Host)), other].into_iter().flatten().collect()
    }

    /// All modes, and rooms for each.
    fn in_every_mode() -> impl Iterator<Item = (Mode, Baked)> {
        Mode::ALL
            .into_iter()
            .flat_map(|mode| [room(), textured_room(), room_under_sky(), room_of_sheets()].map(|room| (mode, room)))
    }

    /// Pixels that are off by more than 1/255.
    fn differing(ours: &Picture, twin: &Picture) -> usize {
        let off = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1);
        ours.rgb.iter().zip(&twin.rgb).filter(off).count()
    }

    #[test]
    fn an_empty_bake_is_background() {
        for gpu in gpus() {
            for mode in Mode::ALL {
                let picture = draw_on_gpu(&gpu, &Baked::default(), &frame(mode)).unwrap();
                assert_eq!(picture.background, 321 * 203);
                assert_eq!(picture, draw_on_cpu(&Baked::default(), &frame(mode)));
            }
        }
    }

    /// The passes against their twin, on views that see lamp, corners, back sides and background.
    #[test]
    fn gpu_and_cpu_draw_the_same_picture_in_every_mode() {
        let outside = Camera { eye: DVec3::new(-1.5, -2.0, 5.0), ..camera() };
        let inside_a_wall = Camera { eye: DVec3::new(0.0, 1.0, 1.0), ..camera() };
        for gpu in gpus() {
            for (mode, room) in in_every_mode() {
                for camera in [camera(), outside, inside_a_wall] {
                    let frame = Frame { camera, ..frame(mode) };
                    let ours = draw_on_gpu(&gpu, &room, &frame).unwrap();
                    let twin = draw_on_cpu(&room, &frame);
                    let what = format!("{mode} from {} by {:?}", camera.eye, gpu.evaluator);
                    let differing = differing(&ours, &twin);
                    assert!(differing <= frame.pixels() / 1000, "{what}: {differing} pixels differ");
                    let error: f32 = ours.radiance.iter().zip(&twin.radiance).map(|(a, b)| (*a - *b).length()).sum();
                    let total: f32 = twin.radiance.iter().map(|radiance| radiance.length()).sum();
                    assert!(error <= 1e-3 * total, "{what}: mean error {error} of {total}");
                    assert_eq!(ours.exposure, twin.exposure);
                    assert!(ours.background.abs_diff(twin.background) <= frame.pixels() as u64 / 1000);
                }
            }
        }
    }

    /// In whatever way is the fastest for a mode.
    #[test]
    fn what_a_display_shows_is_the_same_without_radiance() {
        let outside = Camera { eye: DVec3::new(-1.5, -2.0, 5.0), ..camera() };
        for gpu in gpus() {
            for (mode, room) in in_every_mode() {
                let twin = Twin::new(&room);
                let capture = Capture::new(&gpu, &room, &twin, 321, 203).unwrap();
                for camera in [camera(), outside] {
                    let picture = twin.draw(&Frame { camera, ..frame(mode) });
                    let ours = capture.display(&Frame { camera, ..frame(mode) }).unwrap();
                    let differing = differing(&ours, &picture);
                    assert!(differing <= 321 * 203 / 1000, "{mode} by {:?}: {differing} pixels differ", gpu.evaluator);
                    assert!(ours.background.abs_diff(picture.background) <= 321 * 203 / 1000, "{mode}");
                    assert!(ours.radiance.is_empty());
                }
            }
        }
    }

    #[test]
    fn the_parts_of_a_frame_are_no_more_than_all_of_it() {
        for gpu in gpus() {
            let room = room();
            let twin = Twin::new(&room);
            let capture = Capture::new(&gpu, &room, &twin, 321, 203).unwrap();
            for mode in [Mode::Shaded, Mode::Gouraud, Mode::Ids] {
                let times = capture.time(&frame(mode)).unwrap();
                let sum: f64 = times.parts_ms.iter().map(|part| part.1).sum();
                assert!(sum <= 1.01 * times.frame_ms, "{mode}: {times:?}");
                // Without a clock of the adapter its passes are not told apart.
                assert!(times.parts_ms.len() > 1 || capture.timestamps.is_none(), "{times:?}");
                assert!(times.parts_ms.iter().all(|part| part.1 >= 0.0), "{times:?}");
            }
        }
    }

    #[test]
    fn gpu_and_cpu_have_the_same_tone_curves() {
        for gpu in gpus() {
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
    }

    #[test]
    fn no_pixel_of_a_closed_room_is_background() {
        let room = room();
        for gpu in gpus() {
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
}
