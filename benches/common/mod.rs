//! What the benches share: the program, run on a file, and the machine that it ran on.

#![allow(dead_code, clippy::unwrap_used, reason = "each bench uses its part")]

pub mod irradiance_error;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A file of this repository.
pub fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A file that a bench may write.
pub fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Runs the program, which must do what it is asked, even if a bake says that it misses its tolerance.
pub fn halflight(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_halflight")).args(arguments).output().unwrap();
    assert!(
        matches!(output.status.code(), Some(0 | 3)),
        "halflight {arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Bakes a scene of data/scenes/ into a file; what `--json` printed.
pub fn bake(scene: &str, options: &[&str], output: &Path) -> Value {
    let scene = file(&format!("data/scenes/{scene}.obj"));
    let arguments = ["bake", scene.to_str().unwrap(), "--json", "-o", output.to_str().unwrap()];
    serde_json::from_slice(&halflight(&[&arguments, options].concat()).stdout).unwrap()
}

/// User and system seconds of all programs that this one has run to their end; none where the system does not tell.
pub fn seconds_of_programs() -> Option<f64> {
    seconds_of(false)
}

/// User and system seconds of all threads of this program; none where the system does not tell.
pub fn seconds_of_threads() -> Option<f64> {
    seconds_of(true)
}

#[cfg(unix)]
fn seconds_of(this_one: bool) -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let usage = getrusage(if this_one { UsageWho::RUSAGE_SELF } else { UsageWho::RUSAGE_CHILDREN }).ok()?;
    Some((usage.user_time() + usage.system_time()).num_microseconds() as f64 * 1e-6)
}

#[cfg(not(unix))]
fn seconds_of(_: bool) -> Option<f64> {
    None
}

/// User and system seconds of this program so far; those of a clock where the system does not tell.
pub fn seconds_of_this_program() -> f64 {
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        use nix::sys::time::TimeValLike;
        let usage = getrusage(UsageWho::RUSAGE_SELF).unwrap();
        (usage.user_time() + usage.system_time()).num_microseconds() as f64 * 1e-6
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
        START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
    }
}

/// The line of a record that names the machine.
pub fn machine() -> String {
    format!("Machine: {}, {} threads.", processor(), std::thread::available_parallelism().unwrap())
}

/// The processor's name, where the system tells.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| "unknown processor".to_owned(), |(_, name)| name.to_owned())
}

/// The middle one, or the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { values[half] } else { (values[half - 1] + values[half]) / 2.0 }
}
