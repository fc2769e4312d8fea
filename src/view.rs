//! `halflight view`: a walk through a bake.

use anyhow::{Context, Result};
use viewer::Mode;

use crate::args::ViewFlags;
use crate::failure::Outcome;
use crate::input::Input;
use crate::output::Outputs;
use crate::shot::camera;

/// Opens a window; returns when it is closed.
pub fn run(flags: &ViewFlags, outputs: &Outputs) -> Result<Outcome> {
    let viewpoint = flags.camera.viewpoint()?;
    let input = Input::read(&flags.input, flags.reading)?;
    let baked = input.into_baked(&flags.input, &Default::default(), outputs)?;
    let camera = camera(&viewpoint, &baked.scene)?;
    viewer::open_window(&baked, camera, Mode::Shaded, None)
        .context("no window (`halflight shot` draws a picture without one)")?;
    Ok(Outcome::Done)
}
