//! How long frames take: `shot --timing`.

use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::{Serialize, Serializer, ser::SerializeMap};
use viewer::{Frame, FrameTimes};

use crate::artist::Artist;

/// When the program began, and what it had done before the first frame.
pub struct Start {
    /// The beginning.
    pub begin: Instant,
    /// Until the bake was read.
    pub read: Duration,
    /// Until the adapter had it.
    pub ready: Duration,
}

/// What `shot --timing --json` prints; milliseconds, and medians where there are many.
#[derive(Serialize)]
pub struct Timing {
    /// From the camera to what a display shows, in the host's memory.
    frame_ms: f64,
    /// The frame's passes, and the way back to the host.
    #[serde(serialize_with = "as_map")]
    parts_ms: Vec<(&'static str, f64)>,
    /// Triangles of the bake.
    triangles: usize,
    /// "cpu", or the name of the graphics adapter.
    adapter: String,
    width: u32,
    height: u32,
    mode: &'static str,
    /// Frames that were timed, after the first.
    frames: u32,
    /// From the start of the program to the end of the first frame.
    first_frame_ms: f64,
    /// What that went into.
    #[serde(serialize_with = "as_map")]
    start_ms: Vec<(&'static str, f64)>,
}

/// Draws so many frames, one after the other and from the first again, and times them.
pub fn measure(
    artist: &mut Artist<'_>,
    frames: &[Frame],
    count: u32,
    triangles: usize,
    start: Start,
) -> Result<Timing> {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    artist.time(&frames[0])?;
    let first = start.begin.elapsed();
    let times = frames.iter().cycle().take(count as usize).map(|frame| artist.time(frame));
    let times: Vec<FrameTimes> = times.collect::<Result<_>>()?;
    let FrameTimes { frame_ms, parts_ms } = FrameTimes::medians(&times).context("no frame was drawn")?;
    let Frame { width, height, mode, .. } = frames[0];
    Ok(Timing {
        frame_ms,
        parts_ms,
        triangles,
        adapter: artist.name(),
        width,
        height,
        mode: mode.name(),
        frames: count,
        first_frame_ms: milliseconds(first),
        start_ms: vec![
            ("read", milliseconds(start.read)),
            ("set_up", milliseconds(start.ready - start.read)),
            ("draw", milliseconds(first - start.ready)),
        ],
    })
}

impl Timing {
    /// Prints a table.
    pub fn print(&self) -> Result<()> {
        let Self { triangles, width, height, mode, adapter, frames, .. } = self;
        let rate = 1000.0 / self.frame_ms;
        let part = |&(name, ms): &(&str, f64)| format!("  {name:<22}{ms:>9.2} ms\n");
        let parts = |parts: &[(&str, f64)]| parts.iter().map(part).collect::<String>();
        let table = format!(
            "{triangles} triangles, {width}x{height}, {mode}, drawn by {adapter}\n\
             {:<24}{:>9.2} ms, {rate:.1} frames/s, medians of {frames} frames\n{}\
             {:<24}{:>9.2} ms after the start\n{}",
            "frame",
            self.frame_ms,
            parts(&self.parts_ms),
            "first frame",
            self.first_frame_ms,
            parts(&self.start_ms),
        );
        std::io::stdout().lock().write_all(table.as_bytes()).context("cannot write to stdout")
    }
}

/// Names and numbers as an object, in their order.
fn as_map<S: Serializer>(parts: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(parts.len()))?;
    for (name, value) in parts {
        map.serialize_entry(name, value)?;
    }
    map.end()
}
