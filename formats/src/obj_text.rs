//! The lines of an OBJ file, checked one by one before tobj reads them.
//!
//! tobj keeps polygons and resolves relative indices, but its errors carry no line, NaN and infinity pass it, some
//! wrong indices make it panic, and polylines come out of it as faces. So every line that matters is checked here,
//! where its number is known, and written to a clean text that holds nothing tobj could misread.

use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;

use scene::{Camera, LARGEST_COORDINATE};

use crate::FormatError;
use crate::camera::camera_comment;

/// Corners of one face beyond which a file is not a model but an accident; splitting takes time that grows with their
/// square.
const MOST_CORNERS: usize = 100_000;

/// Something a file names, and the line (from 1) where it does.
pub(crate) type Named = (usize, String);

/// What a checked OBJ file says.
#[derive(Debug, Default)]
pub(crate) struct ObjText {
    /// Vertices, faces, groups and material names in the order of the file, in the form that tobj reads right.
    pub clean: String,
    /// Every face, in order.
    pub faces: Vec<FaceLine>,
    /// Material libraries.
    pub libraries: Vec<Named>,
    /// Materials by the faces' use, each name once.
    pub materials: Vec<Named>,
    /// Cameras from comments.
    pub cameras: Vec<Camera>,
    /// Lines with a camera comment that says no valid camera.
    pub bad_cameras: Vec<usize>,
    /// Lines with free-form curves and surfaces.
    pub free_form: Vec<usize>,
}

/// A face, and what all of its corners name beside positions: for what is missing tobj takes that of another corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FaceLine {
    /// Its line, from 1.
    pub line: usize,
    pub has_texture_coordinates: bool,
    pub has_normals: bool,
}

/// Checks an OBJ text. Errors name the first line that is wrong.
pub(crate) fn check(path: &Path, text: &str) -> Result<ObjText, FormatError> {
    let mut checked = ObjText::default();
    // How many positions, texture coordinates and normals precede a line.
    let mut counts = [0usize; 3];
    let mut known = HashSet::new();
    for (number, line) in whole_lines(text) {
        let wrong = |(cause, cure): Wrong| FormatError::line(path, number, cause, cure);
        if let Some(comment) = line.trim_start().strip_prefix('#') {
            match camera_comment(comment) {
                Some(Ok(camera)) => checked.cameras.push(camera),
                Some(Err(())) => checked.bad_cameras.push(number),
                None => {}
            }
            continue;
        }
        // A comment may also end a line.
        let line = line.split(" #").next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let clean = &mut checked.clean;
        let written = match keyword {
            "v" => {
                counts[0] += 1;
                let [x, y, z] = position(rest).map_err(wrong)?;
                writeln!(clean, "v {x:?} {y:?} {z:?}")
            }
            "vt" => {
                counts[1] += 1;
                let [u, v] = numbers(rest, 1).map_err(wrong)?;
                writeln!(clean, "vt {u:?} {v:?}")
            }
            "vn" => {
                counts[2] += 1;
                let [x, y, z] = numbers(rest, 3).map_err(wrong)?;
                writeln!(clean, "vn {x:?} {y:?} {z:?}")
            }
            "f" | "fo" => {
                let [has_texture_coordinates, has_normals] = check_face(rest, counts).map_err(wrong)?;
                checked.faces.push(FaceLine { line: number, has_texture_coordinates, has_normals });
                writeln!(clean, "f {rest}")
            }
            "g" | "o" => writeln!(clean, "g {rest}"),
            "usemtl" => {
                let name = if rest.is_empty() { "unnamed" } else { rest };
                if known.insert(name.to_owned()) {
                    checked.materials.push((number, name.to_owned()));
                }
                writeln!(clean, "usemtl {name}")
            }
            "mtllib" => {
                checked.libraries.push((number, rest.to_owned()));
                Ok(())
            }
            "curv" | "curv2" | "surf" => {
                checked.free_form.push(number);
                Ok(())
            }
            _ => Ok(()),
        };
        written.expect("writing to a string does not fail");
    }
    Ok(checked)
}

/// Cause and cure.
type Wrong = (String, &'static str);

/// The lines of a text with the number of each (from 1); a backslash at the end of a line continues it on the next.
pub(crate) fn whole_lines(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = (1..).zip(text.trim_start_matches('\u{feff}').lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut whole = first.to_owned();
        while whole.ends_with('\\') {
            whole.pop();
            whole.push(' ');
            whole.push_str(lines.next().map_or("", |(_, line)| line));
        }
        Some((number, whole))
    })
}

/// A finite number.
pub(crate) fn number(word: &str) -> Result<f64, Wrong> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err((format!("the number {} is not finite", shown(word)), "export the file again without it")),
        Err(_) => Err((format!("{} is not a number", shown(word)), "write a decimal number with a point, like 0.25")),
    }
}

/// The first N numbers of a line, of which `needed` must be there and the others are 0.
fn numbers<const N: usize>(rest: &str, needed: usize) -> Result<[f64; N], Wrong> {
    let mut values = [0.0; N];
    let mut words = rest.split_whitespace();
    for (i, value) in values.iter_mut().enumerate() {
        *value = match words.next() {
            Some(word) => number(word)?,
            None if i >= needed => 0.0,
            None => return Err((format!("{i} of {needed} numbers are here"), "export the file again")),
        };
    }
    Ok(values)
}

/// A position; a weight or a colour behind it means nothing to a polygon.
fn position(rest: &str) -> Result<[f64; 3], Wrong> {
    let values = numbers(rest, 3)?;
    match values.iter().find(|value| value.abs() > LARGEST_COORDINATE) {
        None => Ok(values),
        Some(value) => Err((
            format!("the coordinate {value} is beyond ±{LARGEST_COORDINATE} m"),
            "scale the model to metres, near the origin",
        )),
    }
}

/// Checks the corners of a face, `v`, `v/vt`, `v//vn` or `v/vt/vn` with indices from 1 or from −1 backwards, against
/// the numbers of positions, texture coordinates and normals so far. Whether all corners have texture coordinates, and normals.
fn check_face(rest: &str, counts: [usize; 3]) -> Result<[bool; 2], Wrong> {
    const KINDS: [&str; 3] = ["vertices", "texture coordinates", "normals"];
    let mut all_have = [true; 2];
    for (i, word) in rest.split_whitespace().enumerate() {
        if i >= MOST_CORNERS {
            return Err((format!("a face of more than {MOST_CORNERS} corners"), "split it in a modeller"));
        }
        let fields: Vec<&str> = word.split('/').collect();
        if fields.len() > 3 || fields[0].is_empty() {
            return Err((format!("{} is not a corner of a face", shown(word)), "write v, v/vt, v//vn or v/vt/vn"));
        }
        for (i, has) in all_have.iter_mut().enumerate() {
            *has &= fields.get(i + 1).is_some_and(|field| !field.is_empty());
        }
        for ((field, count), kind) in
            fields.into_iter().zip(counts).zip(KINDS).filter(|((field, _), _)| !field.is_empty())
        {
            let Ok(index) = field.parse::<i64>() else {
                return Err((format!("{} is not an index", shown(field)), "write whole numbers"));
            };
            if index == 0 || index.unsigned_abs() > count as u64 {
                return Err((
                    format!("index {index} is out of range: {count} {kind} precede it, counted from 1 or back from -1"),
                    "export the file again, or define what the face uses before the face",
                ));
            }
        }
    }
    Ok(all_have)
}

/// A piece of a file as a message shows it: short, and without control characters.
fn shown(word: &str) -> String {
    let mut short: String = word.chars().take(40).collect();
    if short.len() < word.len() {
        short.push('…');
    }
    format!("{short:?}")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn checked(text: &str) -> Result<ObjText, String> {
        check(Path::new("room.obj"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn every_wrong_line_is_named_with_its_cause() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for (lines, line, cause) in [
            ("v 1 2", 4, "2 of 3 numbers"),
            ("v 1 2 x", 4, "\"x\" is not a number"),
            ("\n\nv nan 0 0", 6, "not finite"),
            ("v 0 -inf 0", 4, "not finite"),
            ("v 0 1e999 0", 4, "not finite"),
            ("v 0 0 100001", 4, "scale the model to metres"),
            ("vn 1 0", 4, "2 of 3 numbers"),
            ("vt", 4, "0 of 1 numbers"),
            ("f 1 2 4", 4, "index 4 is out of range: 3 vertices"),
            ("f 1 2 0", 4, "index 0 is out of range"),
            ("f 1 2 -4", 4, "index -4 is out of range"),
            ("f 1/1 2/1 3/1", 4, "0 texture coordinates"),
            ("vn 0 0 1\nf 1//2 2//1 3//1", 5, "1 normals"),
            ("f 1 2 3.5", 4, "\"3.5\" is not an index"),
            ("f 1 2 99999999999999999999", 4, "not an index"),
            ("f 1 2 3/1/1/1", 4, "not a corner"),
            ("f 1 2 /1", 4, "not a corner"),
            ("f 1 2 \\\n x", 4, "\"x\" is not an index"),
        ] {
            let message = checked(&format!("{triangle}{lines}\n")).unwrap_err();
            assert!(message.starts_with(&format!("room.obj, line {line}: ")), "{lines:?}: {message}");
            assert!(message.contains(cause), "{lines:?}: {message}");
        }
    }

    #[test]
    fn what_tobj_would_misread_is_left_out_or_rewritten() {
        let text = "\u{feff}# a comment\n  v 0 0 0 1 0.5 0.5\nv 1 0 0 0\nv 0 1 0\nvt 0.5\nl 1 2 3\np 1\n\
                    g\twith a tab\nusemtl\tred\nf 1/1 2/1 \\\n3/1 # here\ncurv 0 1 1 2\n";
        let text = checked(text).unwrap();
        assert_eq!(
            text.clean,
            "v 0.0 0.0 0.0\nv 1.0 0.0 0.0\nv 0.0 1.0 0.0\nvt 0.5 0.0\ng with a tab\nusemtl red\nf 1/1 2/1  3/1\n"
        );
        assert_eq!((text.faces[0].line, text.faces.len(), text.free_form), (10, 1, vec![12]));
        assert_eq!(text.materials, [(9, "red".to_owned())]);
    }

    #[test]
    fn messages_do_not_repeat_a_whole_file() {
        assert!(checked(&format!("v {}", "\u{7}x".repeat(1000))).unwrap_err().len() < 300);
    }
}
