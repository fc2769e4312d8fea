//! The text of a TOML file, and the lines of what is wrong in it.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::FormatError;

/// A file's text.
pub(crate) struct TomlText<'a> {
    path: &'a Path,
    text: String,
}

impl<'a> TomlText<'a> {
    /// Reads a file; `cure` is what is said of one that is no text.
    pub fn read(path: &'a Path, cure: &'static str) -> Result<Self, FormatError> {
        let bytes = fs::read(path).map_err(|error| FormatError::read(path, error))?;
        let text = String::from_utf8(bytes).map_err(|_| FormatError::content(path, "is no text in UTF-8", cure))?;
        Ok(Self { path, text })
    }

    /// What the text says; `cure` is what is said of one that does not.
    pub fn parse<T: DeserializeOwned>(&self, cure: &'static str) -> Result<T, FormatError> {
        toml::from_str(&self.text).map_err(|error| {
            let place = error.span().map_or(0, |span| span.start);
            self.wrong(place, error.message().trim().replace('\n', ", "), cure)
        })
    }

    /// What is wrong at a place, bytes from the beginning, with its line.
    pub fn wrong(&self, place: usize, cause: String, cure: &'static str) -> FormatError {
        let line = self.text.bytes().take(place).filter(|byte| *byte == b'\n').count() + 1;
        FormatError::line(self.path, line, cause, cure)
    }
}
