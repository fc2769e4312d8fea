//! `halflight shot`: a picture of a bake, and its comparison with a reference.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use formats::FormatError;
use glam::Vec3;
use scene::{Baked, Camera, Scene};
use serde::Serialize;
use viewer::{Frame, Gpu, Picture};

use crate::args::{Backend, ExposureChoice, ImageKind, ShotFlags, Viewpoint};
use crate::compare::{radiance_error, share_off};
use crate::failure::{Outcome, Usage};
use crate::input::Input;
use crate::output::{Output, Outputs};
use crate::progress::{Stage, say};
use crate::report::print_json;

/// Draws a picture, and compares it where a reference is given.
pub fn run(flags: &ShotFlags, outputs: &Outputs) -> Result<Outcome> {
    let viewpoint = flags.camera.viewpoint()?;
    let output = outputs.claim(&flags.output)?;
    let (width, height) = flags.size;
    let reference = flags.compare.as_deref().map(Reference::read).transpose()?;
    if let Some(reference) = &reference
        && (reference.width, reference.height) != (width, height)
    {
        let (w, h) = (reference.width, reference.height);
        bail!(Usage(format!("--size {width}x{height}: the reference has {w}x{h} pixels; give --size {w}x{h}")));
    }
    let input = Input::read(&flags.input, flags.reading)?;
    let baked = input.into_baked(&flags.input, &Default::default(), outputs)?;
    let exposure = match flags.exposure {
        ExposureChoice::Auto => None,
        ExposureChoice::Fixed(exposure) => Some(exposure),
    };
    let camera = camera(&viewpoint, &baked.scene)?;
    let frame = Frame { camera, width, height, mode: flags.mode, exposure, curve: flags.tone_curve };

    let stage = Stage::start("draw");
    let start = Instant::now();
    let (picture, drawn_by) = draw(&baked, &frame, flags.backend)?;
    let seconds = start.elapsed().as_secs_f64();
    stage.end();
    write(&picture, &output)?;

    let error = reference.map(|reference| reference.error(&picture));
    if flags.json {
        print_json(&ShotJson {
            width,
            height,
            mode: flags.mode.name(),
            drawn_by,
            exposure: picture.exposure.ev,
            background: picture.background,
            seconds,
            error,
        })?;
    }
    match (error, flags.max_error) {
        (Some(error), Some(largest)) if error > largest => {
            say(format_args!(
                "error: {} differs from the reference by {error:.6}, more than --max-error {largest}",
                output.path().display()
            ));
            Ok(Outcome::Differs)
        }
        _ => Ok(Outcome::Done),
    }
}

/// What `shot --json` prints.
#[derive(Serialize)]
struct ShotJson {
    width: u32,
    height: u32,
    mode: &'static str,
    /// "cpu", or the name of the graphics adapter.
    drawn_by: String,
    /// Exposure value.
    exposure: f32,
    /// Pixels where nothing was hit.
    background: u64,
    /// Seconds of drawing, set-up of the adapter included.
    seconds: f64,
    /// Difference from the reference; null without one.
    error: Option<f64>,
}

/// The camera that a viewpoint means in a scene.
pub fn camera(viewpoint: &Viewpoint, scene: &Scene) -> Result<Camera> {
    match viewpoint {
        Viewpoint::Free(camera) => Ok(*camera),
        Viewpoint::Named(name) => {
            let Some(named) = scene.cameras.iter().find(|named| named.name == *name) else {
                let names: Vec<_> = scene.cameras.iter().map(|named| named.name.as_str()).collect();
                bail!(Usage(format!("--camera {name}: no camera of the scene; its cameras are {}", names.join(", "))))
            };
            Ok(named.camera)
        }
        Viewpoint::Default => match scene.cameras.first() {
            Some(named) => Ok(named.camera),
            None => bail!(Usage("the bake has no camera: give --eye and --target".into())),
        },
    }
}

/// The picture, and what drew it.
pub fn draw(baked: &Baked, frame: &Frame, backend: Backend) -> Result<(Picture, String)> {
    let on_cpu = || Ok((viewer::draw_on_cpu(baked, frame), "cpu".to_owned()));
    let on_gpu = || -> Result<_, viewer::ViewerError> {
        let gpu = Gpu::headless()?;
        Ok((viewer::draw_on_gpu(&gpu, baked, frame)?, gpu.adapter_name()))
    };
    match backend {
        Backend::Cpu => on_cpu(),
        Backend::Gpu => on_gpu().context("--backend gpu (--backend cpu draws the same picture)"),
        Backend::Auto => on_gpu().or_else(|error| {
            say(format_args!("drawing on the CPU: {error}"));
            on_cpu()
        }),
    }
}

/// Writes a picture as the kind of file that its name says.
pub fn write(picture: &Picture, output: &Output) -> Result<(), FormatError> {
    output.write(|path| match ImageKind::of(path) {
        Some(ImageKind::Exr) => formats::write_exr(path, picture.width, picture.height, &picture.radiance),
        _ => formats::write_png(path, picture.width, picture.height, &picture.rgb),
    })
}

/// A picture to compare with.
struct Reference {
    width: u32,
    height: u32,
    pixels: Pixels,
}

enum Pixels {
    Radiance(Vec<Vec3>),
    Display(Vec<[u8; 3]>),
}

impl Reference {
    fn read(path: &Path) -> Result<Self> {
        let (width, height, pixels) = match ImageKind::of(path) {
            Some(ImageKind::Exr) => {
                let (width, height, pixels) = formats::read_exr(path)?;
                (width, height, Pixels::Radiance(pixels))
            }
            _ => {
                let (width, height, pixels) = formats::read_png(path)?;
                (width, height, Pixels::Display(pixels))
            }
        };
        Ok(Self { width, height, pixels })
    }

    /// How far a picture is from this one.
    fn error(&self, picture: &Picture) -> f64 {
        match &self.pixels {
            Pixels::Radiance(pixels) => radiance_error(&picture.radiance, pixels),
            Pixels::Display(pixels) => share_off(&picture.rgb, pixels),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use glam::DVec3;
    use scene::NamedCamera;

    use super::*;

    #[test]
    fn a_camera_is_found_by_name_or_the_names_are_told() {
        let here = Camera { eye: DVec3::ZERO, target: DVec3::X, up: DVec3::Z, vertical_fov: 1.0 };
        let named = NamedCamera { name: "door".into(), camera: here };
        let scene = Scene { cameras: vec![named], ..Scene::default() };
        assert_eq!(camera(&Viewpoint::Named("door".into()), &scene).unwrap(), here);
        assert_eq!(camera(&Viewpoint::Default, &scene).unwrap(), here);
        let error = camera(&Viewpoint::Named("window".into()), &scene).unwrap_err();
        assert!(error.is::<Usage>() && error.to_string().contains("door"), "{error}");
        let error = camera(&Viewpoint::Default, &Scene::default()).unwrap_err();
        assert!(error.to_string().contains("--eye"), "{error}");
    }
}
