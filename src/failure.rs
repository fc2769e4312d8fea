//! How a run ends: its exit code, and the one line that says why.

use std::process::ExitCode;

use thiserror::Error;

/// A run that did what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done.
    Done,
    /// Everything was done, and a comparison did not hold.
    Differs,
}

/// The flags are wrong, which showed only after all of them, or the scene, had been read.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// The exit code of an interrupted run, as shells count it: 128 + SIGINT.
pub const INTERRUPTED: i32 = 130;

/// The exit code that a run ends with.
pub fn exit_code(result: &anyhow::Result<Outcome>) -> ExitCode {
    ExitCode::from(match result {
        Ok(Outcome::Done) => 0,
        Err(error) if error.is::<Usage>() => 2,
        Err(_) => 1,
        Ok(Outcome::Differs) => 3,
    })
}
