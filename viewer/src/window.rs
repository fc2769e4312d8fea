//! The window: an event loop around the frame. The only file that names winit.

use std::{sync::Arc, time::Instant};

use glam::{DVec2, DVec3};
use scene::{Baked, Camera, Exposure};
use winit::{
    application::ApplicationHandler,
    dpi::{LogicalSize, PhysicalSize},
    event::{ElementState, KeyEvent, MouseScrollDelta, WindowEvent},
    event_loop::{ActiveEventLoop, EventLoop},
    keyboard::{KeyCode, PhysicalKey},
    window::{Window, WindowId},
};

use crate::{
    Frame, Gpu, Mode, ViewerError,
    controls::{Flight, Steering},
    frame::{Targets, encode_frame},
    gpu::{ResidentBake, guarded, surface_format},
    records::Records,
    twin::Twin,
};

/// Size that the window opens with, logical pixels.
const SIZE: LogicalSize<f64> = LogicalSize::new(1280.0, 720.0);

/// Longest time that a step of the flight takes, seconds: after a hiccup the eye must not be behind a wall.
const LONGEST_STEP: f64 = 0.1;

/// Seconds in which automatic exposure comes nearer to a new view's by a factor e, as an eye adapts.
const ADAPTATION: f64 = 0.25;

/// Exposure values below which nobody sees that the exposure still moves.
const ADAPTED: f32 = 0.01;

/// Pixels of a touchpad that count as one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 40.0;

/// Keys of the modes, in the order of [`Mode::ALL`].
const MODE_KEYS: [KeyCode; Mode::ALL.len()] = [
    KeyCode::F1,
    KeyCode::F2,
    KeyCode::F3,
    KeyCode::F4,
    KeyCode::F5,
    KeyCode::F6,
    KeyCode::F7,
    KeyCode::F8,
    KeyCode::F9,
];

/// Keys of the scene's stored cameras, in order.
const CAMERA_KEYS: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

/// Opens a window on a bake that validates and returns when it is closed. Must be called on the main thread, and, as
/// window systems have it, once in a process.
///
/// W, A, S, D move, E and Q rise and sink, Shift hurries and Ctrl tarries; the mouse looks around while a button is held,
/// its wheel sets the speed. 1–9 go to the scene's cameras, F1–F9 choose the mode and M the next one; Esc closes.
/// Without an exposure the view is metered, and adapts as an eye does.
///
/// # Errors
/// [`ViewerError::NoDisplay`] without a window system, [`ViewerError::NoAdapter`] without a driver that can present to
/// it, and whatever goes wrong with the bake or the driver, as [`crate::draw_on_gpu`] has it.
pub fn open_window(baked: &Baked, camera: Camera, mode: Mode, exposure: Option<Exposure>) -> Result<(), ViewerError> {
    if !camera.is_valid() {
        return Err(ViewerError::InvalidCamera);
    }
    let event_loop = EventLoop::new().map_err(|cause| no_display(&cause))?;
    let mut walk = Walk {
        baked,
        twin: Twin::new(baked),
        flight: Flight::new(camera, baked.scene.size()),
        mode,
        exposure,
        adapted: None,
        hands: Hands::default(),
        last_step: None,
        stage: None,
        failure: None,
    };
    event_loop.run_app(&mut walk).map_err(|cause| no_display(&cause))?;
    walk.failure.map_or(Ok(()), Err)
}

fn no_display(cause: &dyn std::fmt::Display) -> ViewerError {
    let cause = cause.to_string();
    // winit begins with the line of its source that noticed, which says nothing to a user.
    let told =
        cause.strip_prefix("os error at ").and_then(|rest| rest.split_once(": ")).map(|(_, told)| told.to_owned());
    ViewerError::NoDisplay(told.unwrap_or(cause))
}

/// A walk through a bake.
struct Walk<'a> {
    baked: &'a Baked,
    twin: Twin,
    flight: Flight,
    mode: Mode,
    /// The exposure asked for; none is automatic.
    exposure: Option<Exposure>,
    /// Where automatic exposure has come to.
    adapted: Option<Exposure>,
    hands: Hands,
    /// When the flight last moved; none while it rests.
    last_step: Option<Instant>,
    stage: Option<Stage>,
    failure: Option<ViewerError>,
}

impl Walk<'_> {
    /// Ends the walk when something failed.
    fn check<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T, ViewerError>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(failure) => {
                self.failure.get_or_insert(failure);
                event_loop.exit();
                None
            }
        }
    }

    /// Moves, meters and draws; true while there is more to come without a new event.
    fn draw(&mut self) -> Result<bool, ViewerError> {
        let Some(stage) = &mut self.stage else { return Ok(false) };
        let Some(targets) = &stage.targets else { return Ok(false) };
        let now = Instant::now();
        let seconds = self.last_step.map_or(0.0, |last| (now - last).as_secs_f64().min(LONGEST_STEP));
        self.flight = self.flight.step(&self.hands.take_steering(), seconds);
        let (width, height) = (targets.width, targets.height);
        let frame = Frame { camera: self.flight.camera, width, height, mode: self.mode, exposure: None };
        let metered = self.exposure.unwrap_or_else(|| self.twin.meter(&frame));
        let exposure = adapt(self.adapted.unwrap_or(metered), metered, seconds);
        self.adapted = Some(exposure);
        let frame = Frame { exposure: Some(exposure), ..frame };
        let drawn = stage.present(&frame, exposure)?;
        let moving = self.hands.is_moving() || exposure != metered || !drawn;
        self.last_step = moving.then_some(now);
        Ok(moving)
    }

    /// Answers a key that is not held to move. False closes the window.
    fn press(&mut self, key: KeyCode) -> bool {
        if key == KeyCode::Escape {
            return false;
        }
        let chosen = MODE_KEYS.iter().position(|&other| other == key).map(|number| Mode::ALL[number]);
        if let Some(mode) = chosen.or((key == KeyCode::KeyM).then(|| self.mode.next())) {
            self.mode = mode;
            if let Some(stage) = &self.stage {
                stage.window.set_title(&title(mode));
            }
        }
        let number = CAMERA_KEYS.iter().position(|&other| other == key);
        if let Some(stored) = number.and_then(|number| self.baked.scene.cameras.get(number)) {
            self.flight.camera = stored.camera;
            self.adapted = None;
        }
        true
    }
}

impl ApplicationHandler for Walk<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.stage.is_none() {
            let stage = Stage::open(event_loop, self.baked, self.mode);
            self.stage = self.check(event_loop, stage);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let mut redraw = self.hands.follow(&event);
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Some(stage) = &mut self.stage {
                    let resized = stage.resize(size);
                    self.check(event_loop, resized);
                }
                redraw = true;
            }
            WindowEvent::Occluded(false) => redraw = true,
            WindowEvent::KeyboardInput {
                event:
                    KeyEvent { physical_key: PhysicalKey::Code(key), state: ElementState::Pressed, repeat: false, .. },
                ..
            } => {
                if !self.press(key) {
                    event_loop.exit();
                }
                redraw = true;
            }
            WindowEvent::RedrawRequested => {
                let drawn = self.draw();
                redraw = self.check(event_loop, drawn).unwrap_or(false);
            }
            _ => {}
        }
        if let (true, Some(stage)) = (redraw, &self.stage) {
            stage.window.request_redraw();
        }
    }
}

/// Automatic exposure `seconds` later on its way from one value to another.
fn adapt(from: Exposure, to: Exposure, seconds: f64) -> Exposure {
    let rest = (from.ev - to.ev) * (-seconds / ADAPTATION).exp() as f32;
    if rest.abs() < ADAPTED { to } else { Exposure { ev: to.ev + rest } }
}

fn title(mode: Mode) -> String {
    format!("Halflight – {mode}")
}

/// What the hands hold and have done since the last step.
#[derive(Default)]
struct Hands {
    keys: Vec<KeyCode>,
    buttons: u32,
    cursor: Option<DVec2>,
    look: DVec2,
    wheel: f64,
}

impl Hands {
    /// Notes an event; true when it moves the flight.
    fn follow(&mut self, event: &WindowEvent) -> bool {
        match event {
            &WindowEvent::KeyboardInput {
                event: KeyEvent { physical_key: PhysicalKey::Code(key), state, .. }, ..
            } => {
                self.keys.retain(|&held| held != key);
                if state.is_pressed() {
                    self.keys.push(key);
                }
            }
            WindowEvent::MouseInput { state, .. } => {
                self.buttons = if state.is_pressed() { self.buttons + 1 } else { self.buttons.saturating_sub(1) };
            }
            WindowEvent::CursorMoved { position, .. } => {
                let cursor = DVec2::new(position.x, position.y);
                let last = self.cursor.replace(cursor).unwrap_or(cursor);
                if self.buttons > 0 {
                    self.look += cursor - last;
                }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                self.wheel += match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
                };
            }
            // What is let go elsewhere is never reported.
            WindowEvent::Focused(false) => (self.keys, self.buttons) = (Vec::new(), 0),
            _ => {}
        }
        !self.steering().is_idle()
    }

    fn steering(&self) -> Steering {
        let held = |keys: &[KeyCode]| keys.iter().any(|key| self.keys.contains(key));
        let axis = |plus: &[KeyCode], minus: &[KeyCode]| f64::from(held(plus)) - f64::from(held(minus));
        Steering {
            motion: DVec3::new(
                axis(&[KeyCode::KeyD, KeyCode::ArrowRight], &[KeyCode::KeyA, KeyCode::ArrowLeft]),
                axis(&[KeyCode::KeyE, KeyCode::PageUp], &[KeyCode::KeyQ, KeyCode::PageDown]),
                axis(&[KeyCode::KeyW, KeyCode::ArrowUp], &[KeyCode::KeyS, KeyCode::ArrowDown]),
            ),
            look: self.look,
            wheel: self.wheel,
            fast: held(&[KeyCode::ShiftLeft, KeyCode::ShiftRight]),
            slow: held(&[KeyCode::ControlLeft, KeyCode::ControlRight]),
        }
    }

    /// The steering since the last call; keys stay held.
    fn take_steering(&mut self) -> Steering {
        let steering = self.steering();
        (self.look, self.wheel) = (DVec2::ZERO, 0.0);
        steering
    }

    fn is_moving(&self) -> bool {
        !self.steering().is_idle()
    }
}

/// The window with everything that draws into it.
struct Stage {
    instance: wgpu::Instance,
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    gpu: Gpu,
    bake: ResidentBake,
    /// None while the window has no pixels.
    targets: Option<Targets>,
}

impl Stage {
    fn open(event_loop: &ActiveEventLoop, baked: &Baked, mode: Mode) -> Result<Self, ViewerError> {
        let attributes = Window::default_attributes().with_title(title(mode)).with_inner_size(SIZE);
        let window = Arc::new(event_loop.create_window(attributes).map_err(|cause| no_display(&cause))?);
        let display = Box::new(event_loop.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle(display).with_env());
        let surface = instance.create_surface(window.clone());
        let surface = surface.map_err(|cause| ViewerError::NoAdapter(cause.to_string()))?;
        let gpu = Gpu::open(&instance, Some(&surface))?;
        let bake = ResidentBake::upload(&gpu, &Arc::new(Records::of(baked)))?;
        let format = surface_format(&surface, &gpu.adapter)?;
        let configuration = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width: 0,
            height: 0,
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: vec![format.remove_srgb_suffix()],
        };
        let size = window.inner_size();
        let mut stage = Self { instance, window, surface, configuration, gpu, bake, targets: None };
        stage.resize(size)?;
        Ok(stage)
    }

    /// Makes everything that depends on the window's size anew; nothing while it has no pixels.
    fn resize(&mut self, size: PhysicalSize<u32>) -> Result<(), ViewerError> {
        (self.configuration.width, self.configuration.height) = (size.width, size.height);
        self.targets = None;
        if size.width > 0 && size.height > 0 {
            self.targets = Some(Targets::new(&self.gpu, size.width, size.height)?);
            self.configure()?;
        }
        Ok(())
    }

    fn configure(&self) -> Result<(), ViewerError> {
        guarded(&self.gpu.device, || self.surface.configure(&self.gpu.device, &self.configuration))
    }

    /// Draws a frame into the window; false when the window system had no picture to draw into and should be asked
    /// again.
    fn present(&mut self, frame: &Frame, exposure: Exposure) -> Result<bool, ViewerError> {
        let Some(targets) = &self.targets else { return Ok(true) };
        let (texture, outdated) = match guarded(&self.gpu.device, || self.surface.get_current_texture())? {
            wgpu::CurrentSurfaceTexture::Success(texture) => (texture, false),
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => (texture, true),
            // The window system says when it is seen again.
            wgpu::CurrentSurfaceTexture::Occluded => return Ok(true),
            wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Validation => return Ok(false),
            wgpu::CurrentSurfaceTexture::Outdated => return self.configure().map(|()| false),
            wgpu::CurrentSurfaceTexture::Lost => {
                let surface = self.instance.create_surface(self.window.clone());
                self.surface = surface.map_err(|cause| no_display(&cause))?;
                return self.configure().map(|()| false);
            }
        };
        guarded(&self.gpu.device, || -> Result<(), ViewerError> {
            let output = texture.texture.create_view(&wgpu::TextureViewDescriptor {
                format: self.configuration.view_formats.first().copied(),
                ..Default::default()
            });
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encode_frame(&self.gpu, &mut encoder, &self.bake, targets, frame, exposure, &output)?;
            self.gpu.queue.submit([encoder.finish()]);
            self.window.pre_present_notify();
            self.gpu.queue.present(texture);
            Ok(())
        })??;
        if outdated {
            self.configure()?;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_adapts_at_any_frame_rate_and_arrives() {
        let (dark, bright) = (Exposure { ev: 4.0 }, Exposure { ev: -1.0 });
        let once = adapt(dark, bright, 0.2);
        let often = (0..20).fold(dark, |exposure, _| adapt(exposure, bright, 0.01));
        assert!((once.ev - often.ev).abs() < 1e-4 && once.ev < dark.ev);
        assert_eq!(adapt(dark, bright, 10.0), bright);
        assert_eq!(adapt(dark, dark, 0.0), dark);
    }

    #[test]
    fn the_reason_for_no_display_names_no_source_line() {
        let error = no_display(&"os error at /crates/winit/mod.rs:765: neither X nor Y is set.");
        assert_eq!(error.to_string(), "no window can be opened here: neither X nor Y is set.");
        assert_eq!(no_display(&"exit: 3").to_string(), "no window can be opened here: exit: 3");
    }
}
