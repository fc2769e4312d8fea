//! From a bake and a camera to pixels: the interactive half of Hardt & Teller 1996 (sections 2.3–2.8).
//!
//! A frame has the paper's passes. (a)+(b): every triangle is rasterised into a *visibility buffer* that holds, per
//! pixel, the triangle's id and the perspective-correct barycentrics of the point seen. (c): every pixel evaluates
//! its triangle's quadratic interpolant, L = ρE/π + Ke. (d): exposure, tone curve, display. [`draw_on_gpu`] runs the
//! passes on a graphics adapter, [`draw_on_cpu`] is their twin on the host, where rays fill the visibility buffer;
//! the two agree to 1/255. [`WindowSystem`] opens a window that walks through a bake
//! while it is made, and explains its light.

mod capture;
mod command;
mod controls;
mod cpu_screen;
mod digits;
mod error;
mod frame;
mod gpu;
mod gpu_screen;
mod hands;
mod interpolant_pass;
mod loader;
mod marks;
mod mode;
mod overlay;
mod overlay_pass;
mod overlay_twin;
mod pace;
mod painting;
mod panels;
mod picture;
mod reading;
mod records;
mod screen;
#[cfg(test)]
mod test_room;
mod texture_records;
mod tone_map_pass;
mod twin;
mod update;
mod visibility_pass;
mod walk;
mod window;

pub use capture::{Capture, draw_on_gpu};
pub use error::ViewerError;
pub use gpu::Gpu;
pub use mode::{Mode, UnknownMode};
pub use picture::{Frame, Picture};
pub use twin::draw_on_cpu;
pub use update::{Explain, LightSource, PictureKind, Save, SurfacePoint, Update, Walkthrough};
pub use window::WindowSystem;
