//! `halflight shot`: pictures of a bake, their comparison with a reference, and how long they take.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, bail};
use formats::FormatError;
use glam::Vec3;
use scene::{Camera, CameraPath, Scene};
use serde::Serialize;
use viewer::{Frame, Mode, Picture};

use crate::args::{ExposureChoice, ImageKind, ShotFlags, Viewpoint};
use crate::artist::{Artist, Studio};
use crate::compare::{radiance_error, share_off};
use crate::failure::{Outcome, Usage};
use crate::frame_timing::{self, Start};
use crate::input::Input;
use crate::output::{Output, Outputs};
use crate::progress::{Stage, say};
use crate::report::print_json;

/// Draws a picture, or many along a path, and compares it where a reference is given; says how long they take where that is
/// asked.
pub fn run(flags: &ShotFlags, outputs: &Outputs) -> Result<Outcome> {
    let begin = Instant::now();
    let viewpoint = flags.camera.viewpoint()?;
    let path = flags.path.as_deref().map(formats::read_camera_path).transpose()?;
    let files = names(flags).iter().map(|name| outputs.claim(name)).collect::<Result<Vec<_>>>()?;
    let reference = flags.compare.as_deref().map(Reference::read).transpose()?;
    let (width, height) = flags.size;
    if let Some(reference) = &reference
        && (reference.width, reference.height) != (width, height)
    {
        let (w, h) = (reference.width, reference.height);
        bail!(Usage(format!("--size {width}x{height}: the reference has {w}x{h} pixels; give --size {w}x{h}")));
    }
    let input = Input::read(&flags.input, &flags.reading)?;
    let baked = input.into_baked(&flags.input, &Default::default(), outputs)?;
    let cameras = match &path {
        Some(path) => along(path, flags.frames()),
        None => vec![camera(&viewpoint, &baked.scene)?],
    };
    let read = begin.elapsed();

    let studio = Studio::open(&baked, flags.backend)?;
    let (mode, curve) = (flags.mode, flags.tone_curve);
    let frame = |&camera: &Camera| Frame { camera, width, height, mode, exposure: None, curve };
    let mut frames: Vec<Frame> = cameras.iter().map(frame).collect();
    let exposure = match flags.exposure {
        ExposureChoice::Auto => studio.meter(&frames),
        ExposureChoice::Fixed(exposure) => exposure,
    };
    frames.iter_mut().for_each(|frame| frame.exposure = Some(exposure));
    let mut artist = studio.artist(flags.size)?;
    if flags.timing {
        let start = Start { begin, read, ready: begin.elapsed() };
        let timing = frame_timing::measure(&mut artist, &frames, flags.frames(), baked.triangles.len(), start)?;
        if flags.json { print_json(&timing)? } else { timing.print()? }
    }
    match files.is_empty() {
        true => Ok(Outcome::Done),
        false => draw(&mut artist, &frames, &files, flags, reference),
    }
}

/// Draws frames into files.
fn draw(
    artist: &mut Artist<'_>,
    frames: &[Frame],
    files: &[Output],
    flags: &ShotFlags,
    reference: Option<Reference>,
) -> Result<Outcome> {
    let radiance = flags.output.iter().chain(&flags.compare).any(|file| ImageKind::of(file) == Some(ImageKind::Exr));
    let stage = Stage::start("draw");
    let mut background = 0;
    let mut error = None;
    for (i, (frame, file)) in frames.iter().zip(files).enumerate() {
        stage.advance(i as f64 / files.len() as f64);
        let mut picture = artist.draw(frame, radiance)?;
        if flags.mode == Mode::FalseColor {
            picture.add_legend();
        }
        write(&picture, file)?;
        background += picture.background;
        error = reference.as_ref().map(|reference| reference.error(&picture));
    }
    let seconds = stage.end();
    if flags.json && !flags.timing {
        print_json(&ShotJson {
            width: flags.size.0,
            height: flags.size.1,
            mode: flags.mode.name(),
            drawn_by: artist.name(),
            exposure: frames[0].exposure.map(|exposure| exposure.ev),
            pictures: files.len(),
            background,
            seconds,
            error,
        })?;
    }
    match (error, flags.max_error) {
        (Some(error), Some(largest)) if error > largest => {
            say(format_args!(
                "error: {} differs from the reference by {error:.6}, more than --max-error {largest}",
                files[0].path().display()
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
    exposure: Option<f32>,
    /// Pictures drawn: one, or as many as a path was asked for.
    pictures: usize,
    /// Pixels of all pictures where nothing was hit.
    background: u64,
    /// Seconds of drawing and writing.
    seconds: f64,
    /// Difference from the reference; null without one.
    error: Option<f64>,
}

/// The files that pictures go to.
fn names(flags: &ShotFlags) -> Vec<PathBuf> {
    match (&flags.output, &flags.path) {
        (None, _) => Vec::new(),
        (Some(name), None) => vec![name.clone()],
        (Some(name), Some(_)) => (1..=flags.frames()).map(|number| numbered(name, number)).collect(),
    }
}

/// `a.png` with its number: `a.0001.png`.
fn numbered(name: &Path, number: u32) -> PathBuf {
    let extension = name.extension().unwrap_or_default().to_string_lossy();
    name.with_extension(format!("{number:04}.{extension}"))
}

/// So many cameras along a path, evenly in time, its ends among them.
fn along(path: &CameraPath, count: u32) -> Vec<Camera> {
    let (first, last) = path.times();
    let part = |i: u32| f64::from(i) / f64::from(count.max(2) - 1);
    (0..count).map(|i| path.at(first + part(i) * (last - first))).collect()
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
    use scene::{CameraKey, NamedCamera};

    use super::*;

    #[test]
    fn pictures_are_numbered_and_paths_have_both_ends() {
        assert_eq!(numbered(Path::new("out/a.b.png"), 7), Path::new("out/a.b.0007.png"));
        assert_eq!(numbered(Path::new("a.exr"), 12345), Path::new("a.12345.exr"));
        let camera = |x| Camera { eye: DVec3::X * x, target: DVec3::X * x + DVec3::Y, up: DVec3::Z, vertical_fov: 1.0 };
        let path = CameraPath::new([2.0, 5.0].map(|time| CameraKey { time, camera: camera(time) }).to_vec()).unwrap();
        let eyes = |count| along(&path, count).iter().map(|camera| camera.eye.x).collect::<Vec<f64>>();
        assert_eq!(eyes(1), [2.0]);
        assert!(eyes(4).iter().zip([2.0, 3.0, 4.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", eyes(4));
    }

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
