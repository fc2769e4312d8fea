//! What the page reads first: what the bake is called and holds, where its records lie, and where one may look from.

use scene::{Baked, Camera, ToneCurve};
use serde::Serialize;

use crate::{
    Frame, Mode,
    controls::{ASKEW, overview},
    twin::Twin,
};

/// Width and height of the picture that exposures are metered for, pixels: any of this shape would do.
const METERED: (u32, u32) = (640, 480);

/// The head of a bake's page, as JSON.
#[derive(Serialize)]
pub(crate) struct Head {
    /// What the bake is called.
    name: String,
    /// The program that baked it.
    made_by: String,
    /// Names of all files of the page, by which a later one knows what it may replace.
    pub files: Vec<String>,
    triangles: usize,
    /// Largest root mean square and 99th percentile of the relative error of irradiance, as the bake has them.
    error: [f64; 2],
    /// Length of the scene's diagonal, metres.
    size: f64,
    /// Whether any triangle has a texture.
    pub textured: bool,
    /// Place of the environment's first word among the textures; 0 for none.
    sky: u32,
    /// Arrays of the records, by name: the first byte, and how many.
    pub arrays: Vec<Array>,
    /// All modes, by their numbers.
    modes: [ModeHead; Mode::ALL.len()],
    /// Names of all tone curves, by their numbers.
    curves: [&'static str; ToneCurve::ALL.len()],
    cameras: Vec<View>,
    /// Where all of the scene is seen from.
    overview: View,
}

/// An array of the records.
#[derive(Serialize)]
pub(crate) struct Array {
    pub name: &'static str,
    /// Bytes before it.
    pub offset: usize,
    pub bytes: usize,
}

#[derive(Serialize)]
struct ModeHead {
    name: &'static str,
    /// Whether the tone map exposes the picture ([`Mode::is_light`]).
    light: bool,
}

/// A camera, and the exposure that its picture asks for.
#[derive(Serialize)]
struct View {
    name: String,
    /// Metres.
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    /// Full vertical opening angle, degrees.
    fov: f64,
    /// Exposure value.
    ev: f32,
}

impl Head {
    /// The head of a bake that validates; files and arrays are left to whoever makes them.
    pub fn new(baked: &Baked, twin: &Twin, name: &str) -> Self {
        let (width, height) = METERED;
        let view = |name: &str, camera: Camera| {
            let (mode, curve) = (Mode::default(), ToneCurve::default());
            let exposure = twin.meter(&Frame { camera, width, height, mode, exposure: None, curve });
            let Camera { eye, target, up, vertical_fov } = camera;
            let [eye, target, up] = [eye, target, up].map(|v| v.to_array());
            View { name: name.to_owned(), eye, target, up, fov: vertical_fov.to_degrees(), ev: exposure.ev }
        };
        let named = baked.scene.cameras.iter().filter(|named| named.camera.is_valid());
        let aspect = f64::from(width) / f64::from(height);
        let overview = overview(baked, &twin.bvh, named.clone().next().map_or(&ASKEW, |named| &named.camera), aspect);
        Self {
            name: name.to_owned(),
            made_by: baked.provenance.program.clone(),
            files: Vec::new(),
            triangles: baked.triangles.len(),
            error: [baked.error.rms, baked.error.p99],
            size: baked.scene.size(),
            textured: twin.records.is_textured,
            sky: twin.records.sky,
            arrays: Vec::new(),
            modes: Mode::ALL.map(|mode| ModeHead { name: mode.name(), light: mode.is_light() }),
            curves: ToneCurve::ALL.map(ToneCurve::name),
            cameras: named.map(|named| view(&named.name, named.camera)).collect(),
            overview: view("all of it", overview),
        }
    }
}
