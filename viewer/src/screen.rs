//! The window's inside: drawn by a graphics adapter, or where there is none by the CPU.

use std::sync::Arc;

use winit::{
    dpi::PhysicalSize,
    event_loop::{ActiveEventLoop, EventLoopProxy},
    window::Window,
};

use crate::{
    Frame, Gpu, ViewerError, cpu_screen::CpuScreen, gpu::ResidentBake, gpu_screen::GpuScreen, loader::Event,
    painting::Painting, walk::Shown,
};

/// What draws into the window.
#[expect(clippy::large_enum_variant, reason = "one exists in a window")]
pub(crate) enum Screen {
    Gpu(GpuScreen),
    Cpu(CpuScreen),
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Presented {
    /// It is seen.
    Shown,
    /// It is seen, and the next one will be finer.
    Coarse,
    /// The window system had no picture to draw into, and should be asked again.
    Late,
    /// The window is not seen, and the system says when it is again.
    Hidden,
}

impl Screen {
    /// Opens what draws best into a window: an adapter of the system's own interface, else one of OpenGL, else the CPU; and says
    /// what was tried in vain. `serial` is the number of a device, should one be opened.
    pub fn open(
        window: &Arc<Window>,
        event_loop: &ActiveEventLoop,
        events: &EventLoopProxy<Event>,
        serial: u64,
    ) -> Result<(Self, Vec<String>), ViewerError> {
        let chosen = wgpu::Backends::from_env().map(|backends| vec![backends]);
        let mut in_vain = Vec::new();
        for backends in chosen.unwrap_or_else(|| vec![wgpu::Backends::PRIMARY, wgpu::Backends::SECONDARY]) {
            match GpuScreen::open(window.clone(), event_loop, backends, (events.clone(), serial)) {
                Ok(screen) => return Ok((Self::Gpu(screen), in_vain)),
                Err(error) => in_vain.push(error.to_string()),
            }
        }
        in_vain.push("the CPU draws".to_owned());
        Ok((Self::on_cpu(window, event_loop)?, in_vain))
    }

    /// A window that the CPU draws into.
    pub fn on_cpu(window: &Arc<Window>, event_loop: &ActiveEventLoop) -> Result<Self, ViewerError> {
        CpuScreen::open(window.clone(), event_loop).map(Self::Cpu)
    }

    /// The adapter, if there is one.
    pub fn gpu(&self) -> Option<&Arc<Gpu>> {
        match self {
            Self::Gpu(screen) => Some(&screen.gpu),
            Self::Cpu(_) => None,
        }
    }

    /// The longest side of a texture, texels.
    pub fn largest_texture(&self) -> usize {
        self.gpu().map_or(usize::MAX, |gpu| gpu.device.limits().max_texture_dimension_2d as usize)
    }

    /// What draws, for the user.
    pub fn name(&self) -> String {
        self.gpu().map_or_else(|| "CPU".to_owned(), |gpu| gpu.adapter_name())
    }

    /// Milliseconds of the passes of a frame, where they are told.
    pub fn parts(&self) -> &[(&'static str, f64)] {
        match self {
            Self::Gpu(screen) => &screen.parts,
            Self::Cpu(screen) => &screen.parts,
        }
    }

    /// Draws this bake from now on. It is brought into the adapter's memory here, unless it is there already.
    pub fn show(&mut self, shown: &Arc<Shown>, resident: Option<ResidentBake>) -> Result<(), ViewerError> {
        match self {
            Self::Gpu(screen) => {
                let resident = resident.map_or_else(|| ResidentBake::upload(&screen.gpu, &shown.twin.records), Ok)?;
                screen.show(resident);
            }
            Self::Cpu(screen) => screen.show(shown.clone()),
        }
        Ok(())
    }

    /// Follows the window's size.
    pub fn resize(&mut self, size: PhysicalSize<u32>) -> Result<(), ViewerError> {
        match self {
            Self::Gpu(screen) => screen.resize(size),
            Self::Cpu(screen) => screen.resize(size),
        }
    }

    /// Draws a frame, if there is anything to see, and the panels over it; `still` where the next one will be like it.
    pub fn present(
        &mut self,
        frame: Option<&Frame>,
        painting: Painting,
        still: bool,
    ) -> Result<Presented, ViewerError> {
        match self {
            Self::Gpu(screen) => screen.present(frame, painting, still),
            Self::Cpu(screen) => screen.present(frame, painting, still),
        }
    }
}
