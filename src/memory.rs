//! Scenes that are too large for the machine, or for `--max-memory`: refused before the work.

use std::path::Path;

use anyhow::{Result, bail};
use bytesize::ByteSize;

use crate::args::BakeFlags;

/// Bytes that a polygon takes at least, in direct light alone and in all light: the slope of peak memory between generated halls
/// of 3,786 and 12,480 polygons at the largest tolerance, 0.5. A tolerance of 0.03 takes four times as much.
const DIRECT: u64 = 8_300;
const REFLECTED: u64 = 18_500;

/// Faces of a file that become one polygon, at most: modellers cut quads in two, and few cut them finer. More lets larger files be
/// read to the end before they are refused.
const MERGED: u64 = 4;

/// Refuses a scene by the faces of its file, where these are quickly counted, before it is read.
pub fn check_file(flags: &BakeFlags) -> Result<()> {
    match formats::count_faces(&flags.scene) {
        Some(faces) => check(flags, faces / MERGED, &format!("{faces} faces")),
        None => Ok(()),
    }
}

/// Refuses a scene by its polygons.
pub fn check_scene(flags: &BakeFlags, polygons: usize) -> Result<()> {
    check(flags, polygons as u64, &format!("{polygons} polygons"))
}

fn check(flags: &BakeFlags, polygons: u64, size: &str) -> Result<()> {
    let needed = polygons.saturating_mul(if flags.light.bounces == Some(0) { DIRECT } else { REFLECTED });
    let (path, needs) = (flags.scene.display(), bytes(needed));
    match (flags.limits.max_memory, available()) {
        (Some(most), _) if needed > most => bail!(
            "{path}: its {size} need {needs} of memory at least, and --max-memory allows {}; allow more, or bake a part of the scene",
            bytes(most)
        ),
        (None, Some(available)) if needed > available => bail!(
            "{path}: its {size} need {needs} of memory at least, and {} are available; bake a part of the scene or on a larger \
             machine, or try all the same with --max-memory {needs}",
            bytes(available)
        ),
        _ => Ok(()),
    }
}

/// A size as a person reads it, and as `--max-memory` does.
fn bytes(count: u64) -> String {
    ByteSize(count).display().si().to_string().replace(' ', "")
}

/// Memory that the machine can still give, bytes; none where the system does not tell.
fn available() -> Option<u64> {
    available_in(&std::fs::read_to_string(Path::new("/proc/meminfo")).ok()?)
}

/// The same in the text of Linux's `/proc/meminfo`, which counts in units of 1024 bytes.
fn available_in(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_available_is_read_or_missing() {
        assert_eq!(available_in(""), None);
        assert_eq!(available_in("MemAvailable: all of it\n"), None);
        assert_eq!(available_in("MemTotal:  9 kB\nMemAvailable:    2048 kB\n"), Some(2 << 20));
        assert_eq!(available().is_some(), cfg!(target_os = "linux"));
    }

    #[test]
    fn a_size_is_said_as_it_is_given() {
        let said = bytes(185_000_000_000);
        assert_eq!(said, "185.0GB");
        assert_eq!(said.parse::<ByteSize>(), Ok(ByteSize(185_000_000_000)));
    }
}
