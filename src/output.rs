//! Files that the program writes: checked before the work, written whole or not at all.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result, ensure};
use formats::FormatError;

/// The files being written. Whoever ends the program early takes [`Outputs::hold`] first, and so leaves no temporary
/// file behind: files are made under a temporary name and renamed, in one go, while the lock is held.
#[derive(Clone, Default)]
pub struct Outputs(Arc<Mutex<()>>);

/// A path that could be written to when it was claimed.
pub struct Output {
    path: PathBuf,
    outputs: Outputs,
}

impl Outputs {
    /// Checks that `path` can be written to, without writing.
    pub fn claim(&self, path: &Path) -> Result<Output> {
        ensure!(!path.is_dir(), "{}: is a folder and cannot be written; name a file in it", path.display());
        ensure!(path.file_name().is_some(), "{}: names no file to write; give one", path.display());
        // A link is written through; a device is written to and makes no file.
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if !target.exists() || target.is_file() {
            let folder = match target.parent() {
                Some(folder) if folder != Path::new("") => folder,
                _ => Path::new("."),
            };
            // Nameless where the system can, so that not even a crash leaves it.
            tempfile::tempfile_in(folder).with_context(|| {
                format!("{}: cannot be written; check that its folder exists and is writable", path.display())
            })?;
        }
        Ok(Output { path: path.to_owned(), outputs: self.clone() })
    }

    /// Waits for the file being written, and holds off the next one.
    pub fn hold(&self) -> MutexGuard<'_, ()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Output {
    /// The path claimed.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Has `write` make the file.
    pub fn write(&self, write: impl FnOnce(&Path) -> Result<(), FormatError>) -> Result<(), FormatError> {
        let _held = self.outputs.hold();
        write(&self.path)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_cannot_be_written_is_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let outputs = Outputs::default();
        let refused = |path: &Path| format!("{:#}", outputs.claim(path).err().expect("refused"));
        assert!(refused(folder.path()).contains("is a folder"));
        assert!(refused(&folder.path().join("missing/a.hlf")).contains("check that its folder exists"));
        std::fs::write(folder.path().join("file"), "").unwrap();
        assert!(refused(&folder.path().join("file/a.hlf")).contains("cannot be written"));
        assert!(refused(Path::new("")).contains("names no file"));
        assert!(refused(Path::new("..")).contains("is a folder"));
    }

    #[test]
    fn claiming_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let output = Outputs::default().claim(&folder.path().join("a.hlf")).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        output.write(|path| Ok(std::fs::write(path, "whole")?)).unwrap();
        assert_eq!(std::fs::read(output.path()).unwrap(), b"whole");
    }
}
