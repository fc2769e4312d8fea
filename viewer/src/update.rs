//! What a window is given from outside: bakes as they grow, and answers about their light.

use std::sync::{Arc, mpsc::Receiver};

use glam::DVec3;
use scene::{Baked, Camera, CameraPath, Rgb};

use crate::Frame;

/// Something that a window is told while it is open.
#[derive(Clone, Debug)]
pub enum Update {
    /// Where the walk begins. Without it, and later, it is where the user is: the scene's first camera to begin with.
    Camera(Camera),
    /// A bake that validates, to be shown instead of the last one.
    Bake(Arc<Baked>),
    /// What is being done: a stage, and the part of it that is done, 0..=1.
    Work(&'static str, f64),
    /// Nothing is being done any more.
    Rest,
    /// A sentence for the user: something went wrong, or was done.
    Notice(String),
    /// There is nothing to be seen: the window closes.
    Close,
}

/// A place on a bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The triangle.
    pub triangle: u32,
    /// Barycentrics on it.
    pub s: f64,
    /// The second of them.
    pub t: f64,
}

/// One source of the light at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSource {
    /// What the user calls it.
    pub name: String,
    /// Whether it sends light of its own; else it reflects.
    pub emits: bool,
    /// Irradiance that it sends to the point, W·m⁻².
    pub irradiance: Rgb,
    /// Its middle, metres; none for sources that are taken together.
    pub middle: Option<DVec3>,
    /// Outlines of what may hide some of it around the point, metres.
    pub blockers: Vec<Vec<DVec3>>,
}

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureKind {
    /// What the display shows.
    Png,
    /// Radiance.
    Exr,
}

/// Finds the sources of the light at a place, the strongest first; or says why it cannot. Called on a thread of its own, for one
/// place at a time.
pub type Explain = dyn Fn(&Arc<Baked>, SurfacePoint) -> Result<Vec<LightSource>, String> + Send + Sync;

/// Writes a picture of a bake, and says where, or why not. Called on a thread of its own.
pub type Save = dyn Fn(&Baked, &Frame, PictureKind) -> Result<String, String> + Send + Sync;

/// A picture of a view, finer than the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// As displayed, sRGB, row by row.
    pub pixels: Vec<[u8; 3]>,
    /// Share of the pixels that are known, 0..=1.
    pub known: f64,
    /// Samples so far, as a mean over the pixels.
    pub samples_a_pixel: f64,
}

/// Refines the picture of a bake: shows finer and finer ones, until there is no finer one or none is wanted. Called on a thread
/// of its own.
pub type Refine =
    dyn Fn(&Arc<Baked>, &Frame, &(dyn Fn() -> bool + Sync), &dyn Fn(Refined)) -> Result<(), String> + Send + Sync;

/// Writes the path that a camera went, and says where, or why not. Called on a thread of its own.
pub type SavePath = dyn Fn(&CameraPath) -> Result<String, String> + Send + Sync;

/// What a window shows, and whom it asks.
pub struct Walkthrough {
    /// What is shown, for the title.
    pub name: String,
    /// What it is told while it is open.
    pub updates: Receiver<Update>,
    /// Answers clicks.
    pub explain: Arc<Explain>,
    /// Writes pictures.
    pub save: Arc<Save>,
    /// Refines pictures.
    pub refine: Arc<Refine>,
    /// Writes paths.
    pub save_path: Arc<SavePath>,
    /// Is told every notice, where windows and what they show are soon gone.
    pub tell: Box<dyn Fn(&str)>,
}
