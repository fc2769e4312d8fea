//! A window that a graphics adapter draws into.

use std::sync::Arc;

use winit::{
    dpi::PhysicalSize,
    event_loop::{ActiveEventLoop, EventLoopProxy},
    window::Window,
};

use crate::{
    Frame, Gpu, ViewerError,
    frame::{Drawing, PASSES, Targets, encode_frame},
    gpu::{ResidentBake, guarded, surface_format},
    loader::Event,
    overlay_pass::OverlayPass,
    painting::Painting,
    screen::Presented,
    timestamps::Timestamps,
};

/// Times in a row that a surface may be made anew before its adapter is taken to have failed.
const MOST_ANEW: u32 = 20;

/// A surface, its adapter, and everything that pictures of the window's size need.
pub(crate) struct GpuScreen {
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    pub gpu: Arc<Gpu>,
    /// Tells this device from those that were lost before it.
    pub serial: u64,
    overlay: OverlayPass,
    bake: Option<ResidentBake>,
    /// None while the window has no pixels.
    targets: Option<Targets>,
    timestamps: Option<Timestamps>,
    /// Milliseconds of the passes, of the last frame that told them.
    pub parts: Vec<(&'static str, f64)>,
    /// How often in a row the surface had to be made anew.
    anew: u32,
}

impl GpuScreen {
    /// Opens the best adapter of some backends that can present to the window.
    pub fn open(
        window: Arc<Window>,
        event_loop: &ActiveEventLoop,
        backends: wgpu::Backends,
        (events, serial): (EventLoopProxy<Event>, u64),
    ) -> Result<Self, ViewerError> {
        let display = Box::new(event_loop.owned_display_handle());
        let mut descriptor = wgpu::InstanceDescriptor::new_with_display_handle(display).with_env();
        descriptor.backends = backends;
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance.create_surface(window.clone());
        let surface = surface.map_err(|cause| ViewerError::NoAdapter(cause.to_string()))?;
        let gpu = Gpu::open(&instance, Some(&surface))?;
        gpu.device.set_device_lost_callback(move |_, said| {
            // A closed window has no use for it.
            let _ = events.send_event(Event::DeviceLost(serial, said));
        });
        let format = surface_format(&surface, &gpu.adapter)?;
        let shown_format = format.remove_srgb_suffix();
        let configuration = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width: 0,
            height: 0,
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: vec![shown_format],
        };
        let overlay = guarded(&gpu.device, || OverlayPass::new(&gpu.device, shown_format))?;
        let timestamps = Timestamps::new(&gpu, PASSES.len() as u32)?;
        let size = window.inner_size();
        let gpu = Arc::new(gpu);
        let mut screen = Self {
            window,
            instance,
            surface,
            configuration,
            gpu,
            serial,
            overlay,
            bake: None,
            targets: None,
            timestamps,
            parts: Vec::new(),
            anew: 0,
        };
        screen.resize(size)?;
        Ok(screen)
    }

    /// Makes everything that depends on the window's size anew; nothing while it has no pixels.
    pub fn resize(&mut self, size: PhysicalSize<u32>) -> Result<(), ViewerError> {
        (self.configuration.width, self.configuration.height) = (size.width, size.height);
        self.targets = None;
        if size.width > 0 && size.height > 0 {
            self.targets = Some(Targets::new(&self.gpu, size.width, size.height)?);
            self.configure()?;
        }
        Ok(())
    }

    /// Draws this bake from now on.
    pub fn show(&mut self, bake: ResidentBake) {
        self.bake = Some(bake);
    }

    fn configure(&self) -> Result<(), ViewerError> {
        guarded(&self.gpu.device, || self.surface.configure(&self.gpu.device, &self.configuration))
    }

    /// Configures the surface anew, or makes another one.
    fn make_anew(&mut self, is_lost: bool) -> Result<Presented, ViewerError> {
        self.anew += 1;
        if self.anew > MOST_ANEW {
            return Err(ViewerError::Driver("it gives no picture to draw the window into".into()));
        }
        if is_lost {
            let surface = self.instance.create_surface(self.window.clone());
            self.surface = surface.map_err(|cause| ViewerError::NoDisplay(cause.to_string()))?;
        }
        self.configure().map(|()| Presented::Late)
    }

    /// Draws a frame, and the panels over it. Where the adapter tells what its passes took, one that is `still` waits for it.
    pub fn present(
        &mut self,
        frame: Option<&Frame>,
        painting: Painting,
        still: bool,
    ) -> Result<Presented, ViewerError> {
        let gpu = self.gpu.clone();
        // That a device is lost is only said to who asks.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        // Textures are told once: whether or not there is a picture to draw into.
        guarded(&gpu.device, || self.overlay.take_textures(&gpu, &painting))?;
        let Some(targets) = &self.targets else { return Ok(Presented::Hidden) };
        let (texture, outdated) = match guarded(&gpu.device, || self.surface.get_current_texture())? {
            wgpu::CurrentSurfaceTexture::Success(texture) => (texture, false),
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => (texture, true),
            // The window system says when it is seen again.
            wgpu::CurrentSurfaceTexture::Occluded => return Ok(Presented::Hidden),
            wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Validation => {
                return Ok(Presented::Late);
            }
            wgpu::CurrentSurfaceTexture::Outdated => return self.make_anew(false),
            wgpu::CurrentSurfaceTexture::Lost => return self.make_anew(true),
        };
        self.anew = 0;
        let timestamps = self.timestamps.as_ref().filter(|_| still);
        let took = guarded(&gpu.device, || {
            let output = texture.texture.create_view(&wgpu::TextureViewDescriptor {
                format: self.configuration.view_formats.first().copied(),
                ..Default::default()
            });
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let exposed = frame.and_then(|frame| Some((frame, frame.exposure?)));
            let mut took = None;
            let drawn = match (exposed, &self.bake) {
                (Some((frame, exposure)), Some(bake)) => {
                    // The window may have another size already than the one that is told next.
                    let frame = Frame { width: targets.width, height: targets.height, ..*frame };
                    let drawing = Drawing { gpu: &gpu, bake, targets, frame: &frame, exposure, times: timestamps };
                    took = encode_frame(&drawing, &mut encoder, &output)?;
                    true
                }
                _ => false,
            };
            let size = [targets.width, targets.height];
            self.overlay.encode(&gpu, encoder, &painting, size, &output, !drawn);
            self.window.pre_present_notify();
            gpu.queue.present(texture);
            Ok::<_, ViewerError>((drawn, took))
        })??;
        match (took, timestamps) {
            ((_, Some(took)), _) => self.parts = took.parts_ms,
            ((true, None), Some(times)) => {
                self.parts = PASSES.into_iter().zip(times.milliseconds(&gpu, PASSES.len())?).collect();
            }
            _ => {}
        }
        if outdated {
            self.configure()?;
        }
        Ok(Presented::Shown)
    }
}
