//! A file of a camera's path, as TOML.
//!
//! ```toml
//! [[camera]]              # one or more, in the order of their times
//! time = 0.0              # seconds; of all cameras or of none, which are then a second apart
//! eye = [2.2, 1.5, 1.6]   # metres
//! target = [2.4, 4.3, 0.8]
//! up = [0, 0, 1]          # (0, 0, 1)
//! fov = 60                # degrees, the full vertical angle (60)
//! ```
//!
//! A key that is not listed here is an error.

use std::path::Path;

use glam::DVec3;
use scene::{Camera, CameraKey, CameraPath, CameraPathError};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::scene_file::DEFAULT_FOV;
use crate::toml_text::TomlText;
use crate::{FormatError, write_atomically};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    #[serde(default)]
    camera: Vec<Spanned<KeyEntry>>,
}

#[derive(Serialize)]
struct WrittenPath {
    camera: Vec<KeyEntry>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct KeyEntry {
    time: Option<f64>,
    eye: [f64; 3],
    target: [f64; 3],
    #[serde(default = "z")]
    up: [f64; 3],
    #[serde(default = "default_fov")]
    fov: f64,
}

fn z() -> [f64; 3] {
    DVec3::Z.to_array()
}

fn default_fov() -> f64 {
    DEFAULT_FOV
}

/// Reads the path of a camera.
///
/// # Errors
/// A file that cannot be read, or the line of a key that is not known, of a camera that is not valid, or of a time that is not after
/// the one before.
pub fn read_camera_path(path: &Path) -> Result<CameraPath, FormatError> {
    let text = TomlText::read(path, "give a path of cameras in TOML")?;
    let file: PathFile = text.parse("give [[camera]] with eye, target and, if needed, time, up and fov")?;
    let wrong = |place, cause, cure| text.wrong(place, cause, cure);
    let place = |number: usize| file.camera.get(number).map_or(0, |entry| entry.span().start);
    let is_timed = file.camera.first().is_some_and(|entry| entry.get_ref().time.is_some());
    if let Some(number) = file.camera.iter().position(|entry| entry.get_ref().time.is_some() != is_timed) {
        let cause = "some cameras have a time and some have none".to_owned();
        return Err(wrong(place(number), cause, "give a time to all of them, or to none"));
    }
    let keys = (0u32..).zip(&file.camera).map(|(number, entry)| key(number, entry.get_ref())).collect();
    CameraPath::new(keys).map_err(|error| match error {
        CameraPathError::Empty => wrong(0, error.to_string(), "add [[camera]] with an eye and a target"),
        CameraPathError::Camera(number) => {
            let cure =
                "give an eye apart from the target, an up that is not along the view, and a fov between 0 and 180";
            wrong(place(number), error.to_string(), cure)
        }
        CameraPathError::Time(number) => {
            wrong(place(number), error.to_string(), "write the cameras in the order of their times, in seconds")
        }
    })
}

/// Writes the path of a camera, for [`read_camera_path`].
///
/// # Errors
/// Whatever the file system has against it.
pub fn write_camera_path(path: &Path, cameras: &CameraPath) -> Result<(), FormatError> {
    let file = WrittenPath { camera: cameras.keys().iter().map(entry).collect() };
    let text = toml::to_string(&file).map_err(|error| {
        FormatError::content(path, format!("cannot be written: {error}"), "give numbers that are finite")
    })?;
    write_atomically(path, |to| to.write_all(text.as_bytes()).map_err(|error| FormatError::write(path, error)))
}

fn key(number: u32, entry: &KeyEntry) -> CameraKey {
    let [eye, target, up] = [entry.eye, entry.target, entry.up].map(DVec3::from);
    let camera = Camera { eye, target, up, vertical_fov: entry.fov.to_radians() };
    CameraKey { time: entry.time.unwrap_or(f64::from(number)), camera }
}

fn entry(key: &CameraKey) -> KeyEntry {
    let [eye, target, up] = [key.camera.eye, key.camera.target, key.camera.up].map(|vector| vector.to_array());
    KeyEntry { time: Some(key.time), eye, target, up, fov: key.camera.vertical_fov.to_degrees() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;

    fn read(text: &str) -> Result<CameraPath, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.toml");
        fs::write(&path, text).unwrap();
        read_camera_path(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    const KEY: &str = "[[camera]]\neye = [1, 2, 3]\ntarget = [2, 2, 3]\n";

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, line, cause) in [
            (String::new(), 1, "a path without cameras"),
            ("camera = 3\n".into(), 1, "invalid type"),
            ("[[camera]\n".into(), 1, ""),
            (format!("{KEY}name = \"door\"\n"), 4, "unknown field `name`"),
            ("[[camera]]\neye = [1, 2]\ntarget = [2, 2, 3]\n".into(), 2, ""),
            ("[[camera]]\neye = [1, 2, 3]\n".into(), 1, "missing field `target`"),
            (format!("{KEY}{KEY}up = [1, 0, 0]\n"), 4, "camera 2 of the path sees nothing"),
            (format!("{KEY}fov = 180\n"), 1, "camera 1 of the path sees nothing"),
            (format!("{KEY}eye = [inf, 0, 0]\n").replacen("eye = [1, 2, 3]\n", "", 1), 1, "sees nothing"),
            (format!("{KEY}time = 1\n{KEY}"), 5, "some have none"),
            (format!("{KEY}time = 1\n{KEY}time = 1.0\n"), 5, "the time of camera 2"),
            (format!("{KEY}time = nan\n"), 1, "the time of camera 1"),
        ] {
            let message = read(&text).unwrap_err();
            assert!(message.starts_with(&format!("walk.toml, line {line}: ")), "{text:?}: {message}");
            assert!(message.contains(cause), "{text:?}: {message}");
        }
        let gone = read_camera_path(Path::new("gone.toml")).unwrap_err().to_string();
        assert!(gone.starts_with("gone.toml: cannot be read"), "{gone}");
    }

    #[test]
    fn what_is_not_said_has_its_default() {
        let path = read(&format!("{KEY}{KEY}up = [0, 1, 0]\nfov = 90\n")).unwrap();
        let [first, second] = path.keys() else { panic!("two cameras") };
        assert_eq!((first.time, second.time), (0.0, 1.0));
        assert_eq!((first.camera.up, second.camera.up), (DVec3::Z, DVec3::Y));
        let angles = [first, second].map(|key| key.camera.vertical_fov.to_degrees().round());
        assert_eq!(angles, [60.0, 90.0]);
    }

    #[test]
    fn a_written_path_is_read_back() {
        let path = read(&format!("{KEY}time = -0.1\n{KEY}time = 1e-3\nfov = 33.3\nup = [0.1, 0.2, 0.3]\n")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("again.toml");
        write_camera_path(&file, &path).unwrap();
        let again = read_camera_path(&file).unwrap();
        for (a, b) in path.keys().iter().zip(again.keys()) {
            let same = (a.time, a.camera.eye, a.camera.target, a.camera.up);
            assert_eq!(same, (b.time, b.camera.eye, b.camera.target, b.camera.up));
            assert!((a.camera.vertical_fov - b.camera.vertical_fov).abs() < 1e-15);
        }
        assert_eq!(path.keys().len(), again.keys().len());
    }
}
