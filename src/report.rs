//! What `--json` prints: one object on stdout.

use std::io::Write;

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints one object and a line break.
pub fn print_json(object: &impl Serialize) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    serde_json::to_writer_pretty(&mut stdout, object).context("cannot write to stdout")?;
    writeln!(stdout).context("cannot write to stdout")
}

/// The largest part of memory that this process has held so far, bytes; none where the system does not tell.
pub fn peak_memory() -> Option<u64> {
    peak_of(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The high-water mark in the text of Linux's `/proc/PID/status`, which counts in units of 1024 bytes.
fn peak_of(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_high_water_mark_is_read_or_missing() {
        assert_eq!(peak_of(""), None);
        assert_eq!(peak_of("VmHWM:\t lots kB\n"), None);
        assert_eq!(peak_of("VmPeak:\t 9 kB\nVmHWM:\t    2048 kB\nVmRSS:\t 7 kB\n"), Some(2 << 20));
        assert_eq!(peak_memory().is_some(), cfg!(target_os = "linux"));
    }
}
