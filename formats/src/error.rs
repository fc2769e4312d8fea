//! What can go wrong between bytes and types. Every message names the file, the place, the cause and the cure.

use std::io;
use std::path::{Path, PathBuf};

use scene::SceneError;

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The operating system refused to give the file's bytes.
    #[error("{}: cannot be read: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The operating system refused to take the bytes; nothing of them is left behind.
    #[error("{}: cannot be written: {source}; check that the folder exists, is writable and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The stream that irradiance is written to broke.
    #[error("the irradiance table cannot be written: {0}; check where the output goes")]
    Stream(#[from] io::Error),
    /// A line of a text file does not say what it should.
    #[error("{}, line {line}: {cause}; {cure}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong.
        cause: String,
        /// What to do about it.
        cure: &'static str,
    },
    /// A file as a whole is not what it should be.
    #[error("{}: {cause}; {cure}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: String,
        /// What to do about it.
        cure: &'static str,
    },
    /// The file does not start with the magic bytes of a bake.
    #[error("{}: is not a .hlf file (its first bytes say so); give a file that `halflight bake` wrote", path.display())]
    NotBaked {
        /// The file.
        path: PathBuf,
    },
    /// The bake was written by a later version of the program.
    #[error(
        "{}: has .hlf version {found}, this program reads version {supported}; update halflight or bake the scene again",
        path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Version in the file.
        found: u32,
        /// Version that this program writes and reads.
        supported: u32,
    },
    /// The file ends before its content does.
    #[error("{}: is cut off at byte {length} inside its {part}; copy it again or bake the scene again", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Bytes in the file.
        length: u64,
        /// The part that is incomplete.
        part: String,
    },
    /// The bytes are not the ones that were written.
    #[error("{}: was altered in its {part} ({cause}); copy it again or bake the scene again", path.display())]
    Altered {
        /// The file.
        path: PathBuf,
        /// The part that is wrong.
        part: String,
        /// How that was noticed.
        cause: &'static str,
    },
    /// The data are readable, but no valid scene or bake.
    #[error("{}: {source}; repair the scene and bake it again", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Which index or number is wrong.
        source: SceneError,
    },
    /// An image codec refused.
    #[error("{}: {source}; give a readable {format} image", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// The format that was asked for.
        format: &'static str,
        /// What the codec said.
        source: image::ImageError,
    },
}

impl FormatError {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_owned(), source }
    }

    pub(crate) fn line(path: &Path, line: usize, cause: impl Into<String>, cure: &'static str) -> Self {
        Self::Line { path: path.to_owned(), line, cause: cause.into(), cure }
    }

    pub(crate) fn content(path: &Path, cause: impl Into<String>, cure: &'static str) -> Self {
        Self::Content { path: path.to_owned(), cause: cause.into(), cure }
    }
}
