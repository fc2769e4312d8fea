//! The passes of an adapter, each made when it is first needed: a driver takes tens of milliseconds to compile one.

use std::sync::OnceLock;

use wgpu::util::TextureBlitter;

use crate::{
    gouraud_pass::gouraud_pass, interpolant_pass::InterpolantPass, mesh_pass::MeshPass, tone_map_pass::ToneMapPass,
    visibility_pass::visibility_pass,
};

/// The passes, for one format of the output.
pub(crate) struct Passes {
    device: wgpu::Device,
    output: wgpu::TextureFormat,
    /// Whether the output is a window's, which nothing must shine through.
    pub is_window: bool,
    /// Whether triangles may share vertices ([`crate::id_mesh`]).
    pub shares_vertices: bool,
    visibility: OnceLock<MeshPass>,
    interpolant: OnceLock<InterpolantPass>,
    tone_map: OnceLock<ToneMapPass>,
    blitter: OnceLock<TextureBlitter>,
    gouraud: OnceLock<MeshPass>,
}

impl Passes {
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat, is_window: bool, shares_vertices: bool) -> Self {
        Self {
            device: device.clone(),
            output,
            is_window,
            shares_vertices,
            visibility: OnceLock::new(),
            interpolant: OnceLock::new(),
            tone_map: OnceLock::new(),
            blitter: OnceLock::new(),
            gouraud: OnceLock::new(),
        }
    }

    pub fn visibility(&self) -> &MeshPass {
        self.visibility.get_or_init(|| visibility_pass(&self.device, self.shares_vertices))
    }

    pub fn interpolant(&self) -> &InterpolantPass {
        self.interpolant.get_or_init(|| InterpolantPass::new(&self.device))
    }

    pub fn tone_map(&self) -> &ToneMapPass {
        self.tone_map.get_or_init(|| ToneMapPass::new(&self.device, self.output, self.is_window))
    }

    /// What brings a picture that the host has made to the output.
    pub fn blitter(&self) -> &TextureBlitter {
        self.blitter.get_or_init(|| TextureBlitter::new(&self.device, self.output))
    }

    pub fn gouraud(&self) -> &MeshPass {
        self.gouraud.get_or_init(|| gouraud_pass(&self.device, self.output))
    }
}
