//! From a bake and a camera to pixels: the interactive half of Hardt & Teller 1996 (sections 2.3–2.8).
//!
//! A frame has the paper's passes. (a)+(b): every triangle is rasterised into a *visibility buffer* that holds, per
//! pixel, the triangle's id and the perspective-correct barycentrics of the point seen. (c): every pixel evaluates
//! its triangle's quadratic interpolant, L = ρE/π + Ke. (d): exposure, tone curve, display. [`draw_on_gpu`] runs the
//! passes on a graphics adapter, [`draw_on_cpu`] is their twin on the host, where rays fill the visibility buffer;
//! the two agree to 1/255. On an adapter that is a CPU itself the host does (c) and (d), as in the paper ([`Evaluator`]).
//! [`WindowSystem`] opens a window that walks through a bake while it is made, and explains its light. [`web_page`] is a page
//! that walks through a bake in a browser, by the same shaders.

mod capture;
mod chunks;
mod command;
mod controls;
mod cpu_screen;
mod digits;
mod error;
mod false_color;
mod frame;
mod gouraud_mesh;
mod gouraud_pass;
mod gpu;
mod gpu_screen;
mod hands;
mod host_pass;
mod id_mesh;
mod interpolant_pass;
mod legend;
mod loader;
mod marks;
mod mesh_pass;
mod mode;
mod overlay;
mod overlay_pass;
mod overlay_twin;
mod pace;
mod painting;
mod panels;
mod passes;
mod picture;
mod read_back;
mod reading;
mod recording;
mod records;
mod refinement;
mod screen;
mod sky_records;
mod spans;
#[cfg(test)]
mod test_room;
mod texture_records;
mod timestamps;
mod timing;
mod tone_map_pass;
mod tone_table;
mod twin;
mod update;
mod visibility_pass;
mod walk;
mod web;
mod window;

pub use capture::{Capture, draw_on_gpu};
pub use error::ViewerError;
pub use false_color::{FalseColorScale, Isoline};
pub use gpu::{Evaluator, Gpu};
pub use mode::{Mode, UnknownMode};
pub use picture::{Frame, Picture};
pub use timing::FrameTimes;
pub use twin::{Twin, draw_on_cpu};
pub use update::{
    Explain, LightSource, PictureKind, Refine, Refined, Save, SavePath, SurfacePoint, Update, Walkthrough,
};
pub use web::{BAKE_FILE, HEAD_FILE, PageFile, web_page};
pub use window::WindowSystem;
