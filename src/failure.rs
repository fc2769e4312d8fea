//! How a run ends: its exit code, and the one line that says why.

use std::process::ExitCode;

use thiserror::Error;

/// A run that did what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done.
    Done,
    /// Everything was done, and a comparison or verification did not hold.
    Differs,
    /// The work was interrupted, and what was done of it is kept.
    Interrupted,
}

/// The flags are wrong, which showed only after all of them, or the scene, had been read.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// The exit code of an interrupted run, as shells count it: 128 + SIGINT.
pub const INTERRUPTED: u8 = 130;

/// The exit code that a run ends with.
pub fn exit_code(result: &anyhow::Result<Outcome>) -> ExitCode {
    ExitCode::from(match result {
        Ok(Outcome::Done) => 0,
        Err(error) if error.is::<Usage>() => 2,
        Err(_) => 1,
        Ok(Outcome::Differs) => 3,
        Ok(Outcome::Interrupted) => INTERRUPTED,
    })
}

/// The whole chain of causes in one line. Some errors say their cause themselves; it is not said twice.
pub fn sentence(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |said, cause| match said.as_str() {
        "" => cause,
        _ if said.contains(&cause) => said,
        _ => format!("{said}: {cause}"),
    })
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn every_end_has_its_code() {
        let code = |result: anyhow::Result<Outcome>| format!("{:?}", exit_code(&result));
        let expected = |code: u8| format!("{:?}", ExitCode::from(code));
        assert_eq!(code(Ok(Outcome::Done)), expected(0));
        assert_eq!(code(Err(anyhow!("no room"))), expected(1));
        assert_eq!(code(Err(Usage("--eye".into()).into())), expected(2));
        assert_eq!(code(Ok(Outcome::Differs)), expected(3));
        assert_eq!(code(Ok(Outcome::Interrupted)), expected(130));
    }

    #[test]
    fn a_cause_is_said_once() {
        let cause = anyhow!("no room");
        assert_eq!(
            sentence(&cause.context("a.hlf: no room; make some").context("bake")),
            "bake: a.hlf: no room; make some"
        );
        assert_eq!(sentence(&anyhow!("no room").context("a.hlf")), "a.hlf: no room");
    }
}
