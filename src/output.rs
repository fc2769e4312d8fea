//! Files that the program writes: checked before the work, written whole or not at all.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result, ensure};

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
    /// Checks that a file can be made at `path`, without making it.
    pub fn claim(&self, path: &Path) -> Result<Output> {
        // Renaming over a device or a pipe would replace it; a folder cannot be replaced.
        ensure!(
            !path.exists() || path.is_file(),
            "cannot write {}: it exists and is not a regular file; name another",
            path.display()
        );
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        ensure!(path.file_name().is_some(), "cannot write {}: it names no file", path.display());
        // Nameless where the system can, so that not even a crash leaves it.
        tempfile::tempfile_in(folder).with_context(|| {
            format!("cannot write {}: make the folder {}, or name another", path.display(), folder.display())
        })?;
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
    pub fn write<E>(&self, write: impl FnOnce(&Path) -> Result<(), E>) -> Result<()>
    where
        anyhow::Error: From<E>,
    {
        let _held = self.outputs.hold();
        write(&self.path).map_err(anyhow::Error::from).with_context(|| format!("cannot write {}", self.path.display()))
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
        assert!(refused(folder.path()).contains("not a regular file"));
        assert!(refused(&folder.path().join("missing/a.hlf")).contains("make the folder"));
        std::fs::write(folder.path().join("file"), "").unwrap();
        assert!(refused(&folder.path().join("file/a.hlf")).contains("cannot write"));
        assert!(refused(Path::new("")).contains("cannot write"));
        if Path::new("/dev/null").exists() {
            assert!(refused(Path::new("/dev/null")).contains("not a regular file"));
        }
    }

    #[test]
    fn claiming_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let output = Outputs::default().claim(&folder.path().join("a.hlf")).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        output.write(|path| std::fs::write(path, "whole")).unwrap();
        assert_eq!(std::fs::read(output.path()).unwrap(), b"whole");
    }
}
