//! `halflight view`: a walk through a bake, or through a scene while it is baked.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use anyhow::{Context, Result};
use rayon::ThreadPoolBuilder;
use scene::{Baked, CameraPath, Scene};
use viewer::{Frame, Mode, PictureKind, Update, Walkthrough, WindowSystem};

use crate::args::{Backend, LightFlags, SceneFlags, ViewFlags, Viewpoint};
use crate::artist::Studio;
use crate::bake::missed;
use crate::failure::{Outcome, Usage, sentence};
use crate::input::{Input, bake_once, read_scene, require_light};
use crate::light_sources::LightSources;
use crate::output::{Output, Outputs};
use crate::pipeline::Onlooker;
use crate::progress::say;
use crate::radiance;
use crate::refine::refine;
use crate::shot;
use crate::watch::Watch;

/// What is said where no window can be opened, and the cure.
const NO_WINDOW: &str = "no window (`halflight shot` draws a picture without one)";

/// Opens a window; returns when it is closed.
pub fn run(flags: &ViewFlags, outputs: &Outputs) -> Result<Outcome> {
    let viewpoint = flags.camera.viewpoint()?;
    radiance::check(&flags.radiance)?;
    let path = flags.input.clone();
    let watch = Watch::over(&path);
    // What is not there, and what is no bake, is said without a window.
    let is_at_hand = formats::is_baked(&path) || !path.exists();
    let input = if is_at_hand { Some(Input::read(&path, &flags.reading)?) } else { None };
    let mut system = WindowSystem::connect().context(NO_WINDOW)?;
    let (updates, received) = channel();
    let mut work = None;
    if let Some(input) = input {
        let baked = input.into_baked(&path, &LightFlags::default(), outputs)?;
        begin(&baked.scene, &viewpoint, &updates)?;
        tell(&updates, Update::Bake(Arc::new(baked)));
        std::thread::spawn(move || watch.keep(|path| reload(path, &updates)));
    } else {
        work = Some(bake_behind(path, flags.reading.clone(), viewpoint, outputs.clone(), updates));
    }
    let seen = system.open(walkthrough(flags, received, outputs.clone()));
    // A bake that is not finished ends with the program, but not in the midst of a file.
    std::mem::forget(outputs.hold());
    seen.context(NO_WINDOW)?;
    match work.filter(JoinHandle::is_finished).map(JoinHandle::join) {
        Some(Ok(result)) => result.map(|()| Outcome::Done),
        // What a thread says when it panics stands on stderr already.
        Some(Err(_)) => anyhow::bail!("{}: the bake failed", flags.input.display()),
        None => Ok(Outcome::Done),
    }
}

/// What the window of a file shows, and whom it asks.
fn walkthrough(flags: &ViewFlags, updates: Receiver<Update>, outputs: Outputs) -> Walkthrough {
    let name = flags.input.file_name().unwrap_or(flags.input.as_os_str()).to_string_lossy();
    let (sources, input, radiance) = (Arc::new(LightSources::default()), flags.input.clone(), flags.radiance);
    let sources_of_pictures = sources.clone();
    let paths = (input.clone(), outputs.clone());
    Walkthrough {
        name: format!("{name} – Halflight"),
        updates,
        explain: Arc::new(move |baked, point| sources.at(baked, point)),
        save: Arc::new(move |baked, frame, kind| {
            save(baked, frame, kind, &input, &outputs).map_err(|error| sentence(&error))
        }),
        refine: Arc::new(move |baked, frame, wanted, show| {
            refine(baked, &sources_of_pictures, frame, radiance, wanted, show).map_err(|error| sentence(&error))
        }),
        save_path: Arc::new(move |path| save_path(path, &paths.0, &paths.1).map_err(|error| sentence(&error))),
        tell: Box::new(|what| say(what)),
    }
}

/// Tells the window something; nobody's loss if it is closed.
fn tell(updates: &Sender<Update>, update: Update) {
    _ = updates.send(update);
}

/// Says where the walk begins, if the flags do. Without cameras it begins where all of the scene is seen.
fn begin(scene: &Scene, viewpoint: &Viewpoint, updates: &Sender<Update>) -> Result<()> {
    if !matches!(viewpoint, Viewpoint::Default) {
        tell(updates, Update::Camera(shot::camera(viewpoint, scene)?));
    }
    Ok(())
}

/// Shows a bake that has changed on disk. A bad one is told, and the last one stays. False if the window is closed.
fn reload(path: &Path, updates: &Sender<Update>) -> bool {
    let update = match formats::read_baked(path) {
        Ok(baked) => Update::Bake(Arc::new(baked)),
        Err(error) => Update::Notice(format!("{error}; what was read before is shown on")),
    };
    updates.send(update).is_ok()
}

/// Reads and bakes a scene on threads of its own, and shows it as it grows. One processor is left to the frames.
fn bake_behind(
    path: PathBuf,
    reading: SceneFlags,
    viewpoint: Viewpoint,
    outputs: Outputs,
    updates: Sender<Update>,
) -> JoinHandle<Result<()>> {
    std::thread::spawn(move || {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = ThreadPoolBuilder::new().num_threads((processors - 1).max(1)).build()?;
        let baked = threads.install(|| bake_before(&path, &reading, &viewpoint, &outputs, &updates));
        match &baked {
            Err(error) if error.is::<Usage>() => tell(&updates, Update::Close),
            Err(error) => tell(&updates, Update::Notice(sentence(error))),
            Ok(()) => {}
        }
        tell(&updates, Update::Rest);
        baked
    })
}

fn bake_before(
    path: &Path,
    reading: &SceneFlags,
    viewpoint: &Viewpoint,
    outputs: &Outputs,
    updates: &Sender<Update>,
) -> Result<()> {
    tell(updates, Update::Work("import", 0.0));
    let imported = read_scene(path, reading)?.0;
    if let [first, others @ ..] = imported.report.warnings.as_slice() {
        let more = if others.is_empty() { String::new() } else { format!(" (and {} more warnings)", others.len()) };
        tell(updates, Update::Notice(format!("{first}{more}")));
    }
    let scene = imported.scene;
    require_light(path, &scene)?;
    begin(&scene, viewpoint, updates)?;
    let (flags, told) = (LightFlags::default(), AtomicU32::new(0));
    let baked = bake_once(
        &scene,
        &flags,
        outputs,
        Some(Onlooker {
            // The bar has no more steps than that.
            work: &|stage, part| {
                let percent = (100.0 * part) as u32;
                if told.swap(percent, Ordering::Relaxed) != percent {
                    tell(updates, Update::Work(stage, part));
                }
            },
            bake: &|baked| tell(updates, Update::Bake(Arc::new(baked))),
        }),
    );
    if !baked.error.holds {
        tell(updates, Update::Notice(missed(&baked, flags.tolerance)));
    }
    tell(updates, Update::Bake(Arc::new(baked)));
    Ok(())
}

/// Claims a file of the input's name where the program was started, under the first number that is free.
fn claim_next(input: &Path, kind: &str, end: &str, outputs: &Outputs) -> Result<Output> {
    let stem = input.file_stem().unwrap_or(input.as_os_str()).to_string_lossy();
    let names = (1..=u32::MAX).map(|number| PathBuf::from(format!("{stem}{kind}-{number}.{end}")));
    outputs.claim(&names.into_iter().find(|path| !path.exists()).context("every name is taken")?)
}

/// Writes a path for `shot --path`; says where.
fn save_path(path: &CameraPath, input: &Path, outputs: &Outputs) -> Result<String> {
    let output = claim_next(input, "-path", "toml", outputs)?;
    output.write(|file| formats::write_camera_path(file, path))?;
    let ((first, last), cameras) = (path.times(), path.keys().len());
    Ok(format!("{} is written: {cameras} cameras, {:.1} s", output.path().display(), last - first))
}

/// Draws a frame as `shot` does, and writes it; says where.
fn save(baked: &Baked, frame: &Frame, kind: PictureKind, input: &Path, outputs: &Outputs) -> Result<String> {
    let end = if kind == PictureKind::Exr { "exr" } else { "png" };
    let output = claim_next(input, "", end, outputs)?;
    let studio = Studio::open(baked, Backend::Auto)?;
    let mut picture = studio.artist((frame.width, frame.height))?.draw(frame, kind == PictureKind::Exr)?;
    if frame.mode == Mode::FalseColor {
        picture.add_legend();
    }
    shot::write(&picture, &output)?;
    Ok(format!("{} is written, EV {:.3}", output.path().display(), picture.exposure.ev))
}
