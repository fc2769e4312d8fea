//! The number of faces in a file, counted without reading it as a scene: whether it is worth that.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Faces of an OBJ file, by the lines that begin with `f`; none of a file of another kind, or one that cannot be read.
pub fn count_faces(path: &Path) -> Option<u64> {
    if !path.extension()?.eq_ignore_ascii_case("obj") {
        return None;
    }
    let mut file = BufReader::with_capacity(1 << 20, File::open(path).ok()?);
    let (mut faces, mut before) = (0, [b'\n'; 2]);
    loop {
        let bytes = file.fill_buf().ok()?;
        if bytes.is_empty() {
            return Some(faces);
        }
        for &byte in bytes {
            faces += u64::from(before == *b"\nf" && (byte == b' ' || byte == b'\t'));
            before = [before[1], byte];
        }
        let length = bytes.len();
        file.consume(length);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn faces_are_counted_and_nothing_else_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "f 1 2 3\nv 0 0 0\n# f 1\nfoo\nf\t1 2 3\r\nf 3 2 1").unwrap();
        assert_eq!(count_faces(&path), Some(3));
        std::fs::write(&path, "").unwrap();
        assert_eq!(count_faces(&path), Some(0));
        assert_eq!(count_faces(&folder.path().join("missing.obj")), None);
        assert_eq!(count_faces(Path::new("a.glb")), None);
    }
}
