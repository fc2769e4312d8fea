//! The numbers of a glTF file: container, buffers and accessors → rows. Every length is held against the bytes that are
//! there before anything is allocated.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use ::gltf::accessor::{DataType, sparse::IndexType};
use ::gltf::{Accessor, Document, buffer};

use crate::FormatError;

/// Rows that an accessor without bytes of its own (all zero, but for sparse ones) may have beyond one a byte of the file:
/// such rows cost nothing in the file, and memory here.
const FREE_ROWS: usize = 1 << 16;

/// The JSON of a file and, in a GLB, the binary chunk behind it.
pub(crate) fn split_container<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), FormatError> {
    const CURE: &str = "copy or export the file again";
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let wrong = |cause: String| FormatError::content(path, cause, CURE);
    let word = |at: usize| bytes.get(at..at + 4).and_then(|word| word.as_array().copied()).map(u32::from_le_bytes);
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(wrong(format!("is a GLB of version {version}, not 2"))),
        None => return Err(wrong("is cut off inside its header".to_owned())),
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let start = at + 8;
        let chunk = start.checked_add(length as usize).and_then(|end| bytes.get(start..end));
        let Some(chunk) = chunk else {
            return Err(wrong(format!("is cut off: the chunk at byte {at} has {length} bytes, the file ends before")));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = start + chunk.len();
    }
    json.map(|json| (json, binary)).ok_or_else(|| wrong("has no JSON chunk".to_owned()))
}

/// The buffers of a document.
pub(crate) struct Buffers<'a> {
    path: &'a Path,
    buffers: Vec<Cow<'a, [u8]>>,
    /// Most rows of an accessor without bytes.
    most_rows: usize,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers: the binary chunk, files beside the document, and base64 inside it.
    pub fn read(path: &'a Path, document: &Document, binary: Option<&'a [u8]>) -> Result<Self, FormatError> {
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let place = format!("buffer {}", buffer.index());
            let bytes = match buffer.source() {
                buffer::Source::Bin => binary.map(Cow::Borrowed).ok_or_else(|| {
                    FormatError::content(
                        path,
                        format!("{place} is not there: no binary chunk"),
                        "export the file again",
                    )
                })?,
                buffer::Source::Uri(uri) => Cow::Owned(read_uri(path, uri, &place)?),
            };
            if bytes.len() < buffer.length() {
                return Err(FormatError::content(
                    path,
                    format!("{place} has {} bytes, its description says {}", bytes.len(), buffer.length()),
                    "copy or export its file again",
                ));
            }
            buffers.push(bytes);
        }
        let most_rows = buffers.iter().map(|bytes| bytes.len()).sum::<usize>() + FREE_ROWS;
        Ok(Self { path, buffers, most_rows })
    }

    /// The bytes of a view.
    pub fn view(&self, view: &buffer::View<'_>) -> Result<&[u8], FormatError> {
        let buffer: &[u8] = self.buffers.get(view.buffer().index()).map_or(&[], |bytes| bytes);
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| buffer.get(view.offset()..end)).ok_or_else(|| {
            let cause = format!(
                "buffer view {} takes {} bytes from byte {} of buffer {}, which has {}",
                view.index(),
                view.length(),
                view.offset(),
                view.buffer().index(),
                buffer.len()
            );
            FormatError::content(self.path, cause, "export the file again")
        })
    }

    /// The rows of an accessor of N numbers each, as f64; normalised integers as fractions.
    pub fn rows<const N: usize>(&self, accessor: &Accessor<'_>, what: &str) -> Result<Vec<[f64; N]>, FormatError> {
        let place = || format!("accessor {} ({what})", accessor.index());
        let wrong = |cause: String| FormatError::content(self.path, cause, "export the file again");
        if accessor.dimensions().multiplicity() != N {
            return Err(wrong(format!("{} has {:?}, not {N} numbers a row", place(), accessor.dimensions())));
        }
        let (kind, count) = (accessor.data_type(), accessor.count());
        let fraction = |value: f64| if accessor.normalized() { normalised(value, kind) } else { value };
        let row = |bytes: &[u8]| std::array::from_fn(|i| fraction(number(kind, &bytes[i * kind.size()..])));
        let row_size = N * kind.size();
        let mut rows = match accessor.view() {
            Some(view) => {
                let bytes = self.view(&view)?.get(accessor.offset()..).unwrap_or(&[]);
                let stride = view.stride().unwrap_or(row_size);
                if stride < row_size {
                    return Err(wrong(format!("{} has rows of {row_size} bytes every {stride} bytes", place())));
                }
                // The last row need not be followed by what lies between rows.
                let fits = bytes.len().checked_sub(row_size).map_or(0, |rest| rest / stride + 1);
                if count > fits {
                    return Err(wrong(format!("{} says {count} rows, its bytes hold {fits}", place())));
                }
                (0..count).map(|i| row(&bytes[i * stride..][..row_size])).collect()
            }
            None if count > self.most_rows => {
                return Err(wrong(format!("{} says {count} rows and has no bytes", place())));
            }
            None => vec![[0.0; N]; count],
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let index_kind = match indices.index_type() {
                IndexType::U8 => DataType::U8,
                IndexType::U16 => DataType::U16,
                IndexType::U32 => DataType::U32,
            };
            let places = self.view(&indices.view())?.get(indices.offset()..).unwrap_or(&[]);
            let replaced = self.view(&values.view())?.get(values.offset()..).unwrap_or(&[]);
            let fits = (places.len() / index_kind.size()).min(replaced.len() / row_size);
            if sparse.count() > fits {
                return Err(wrong(format!("{} says {} sparse rows, its bytes hold {fits}", place(), sparse.count())));
            }
            for i in 0..sparse.count() {
                let index = number(index_kind, &places[i * index_kind.size()..]) as usize;
                let Some(target) = rows.get_mut(index) else {
                    return Err(wrong(format!("{} has a sparse row {index} of {count}", place())));
                };
                *target = row(&replaced[i * row_size..]);
            }
        }
        Ok(rows)
    }

    /// The indices of an accessor, each below `count`.
    pub fn indices(&self, accessor: &Accessor<'_>, count: usize) -> Result<Vec<u32>, FormatError> {
        if !matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32) {
            let cause = format!("accessor {} holds indices of type {:?}", accessor.index(), accessor.data_type());
            return Err(FormatError::content(self.path, cause, "export the file again"));
        }
        let rows = self.rows::<1>(accessor, "indices")?;
        match rows.iter().find(|[index]| *index >= count as f64) {
            None => Ok(rows.iter().map(|[index]| *index as u32).collect()),
            Some([index]) => Err(FormatError::content(
                self.path,
                format!("accessor {} has the index {index} of {count} vertices", accessor.index()),
                "export the file again",
            )),
        }
    }
}

/// The bytes of a `data:` URI or of a file beside the document.
pub(crate) fn read_uri(path: &Path, uri: &str, place: &str) -> Result<Vec<u8>, FormatError> {
    let wrong = |cause: String| FormatError::content(path, format!("{place} {cause}"), "export the file as GLB");
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(wrong("is inside the document, but not as base64".to_owned()));
        };
        return decode_base64(text).ok_or_else(|| wrong("is inside the document as damaged base64".to_owned()));
    }
    let name = decode_percent(uri);
    if name.contains("://") || Path::new(&name).is_absolute() {
        return Err(wrong(format!("names {name:?}, which is no file beside the document")));
    }
    let file: PathBuf = path.parent().unwrap_or(Path::new("")).join(name);
    fs::read(&file).map_err(|error| FormatError::read(&file, error))
}

/// The number at the start of some bytes, of which there are enough.
fn number(kind: DataType, bytes: &[u8]) -> f64 {
    fn take<const N: usize>(bytes: &[u8]) -> [u8; N] {
        bytes.first_chunk().copied().unwrap_or([0; N])
    }
    match kind {
        DataType::I8 => i8::from_le_bytes(take(bytes)).into(),
        DataType::U8 => take::<1>(bytes)[0].into(),
        DataType::I16 => i16::from_le_bytes(take(bytes)).into(),
        DataType::U16 => u16::from_le_bytes(take(bytes)).into(),
        DataType::U32 => u32::from_le_bytes(take(bytes)).into(),
        DataType::F32 => f32::from_le_bytes(take(bytes)).into(),
    }
}

/// A normalised integer as the fraction that it means.
fn normalised(value: f64, kind: DataType) -> f64 {
    match kind {
        DataType::I8 => (value / 127.0).max(-1.0),
        DataType::U8 => value / 255.0,
        DataType::I16 => (value / 32767.0).max(-1.0),
        DataType::U16 => value / 65535.0,
        DataType::U32 | DataType::F32 => value,
    }
}

/// Base64 (RFC 4648), padding and white space optional; none where a character has no meaning.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for character in text.trim_end_matches('=').bytes().filter(|byte| !byte.is_ascii_whitespace()) {
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}

/// A URI with its `%20`s as the characters that they mean.
fn decode_percent(uri: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), uri.as_bytes());
    while let Some((&first, behind)) = rest.split_first() {
        let digits = behind.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let decoded = digits.filter(|_| first == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(decoded.unwrap_or(first));
        rest = if decoded.is_some() { &behind[2..] } else { behind };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn containers_that_are_cut_off_or_of_another_kind() {
        let path = Path::new("room.glb");
        let said = |bytes: &[u8]| split_container(path, bytes).unwrap_err().to_string();
        assert!(said(b"glTF").contains("cut off inside its header"));
        assert!(said(b"glTF\x01\0\0\0\0\0\0\0").contains("version 1"));
        assert!(said(b"glTF\x02\0\0\0\0\0\0\0").contains("no JSON"));
        assert!(said(b"glTF\x02\0\0\0\x20\0\0\0\xff\xff\xff\xffJSON{}").contains("cut off: the chunk at byte 12"));
        assert_eq!(split_container(path, b"{}").unwrap(), (&b"{}"[..], None));
        let whole = b"glTF\x02\0\0\0\x1e\0\0\0\x02\0\0\0JSON{}\x01\0\0\0BIN\0\x07";
        assert_eq!(split_container(path, whole).unwrap(), (&b"{}"[..], Some(&[7u8][..])));
    }

    #[test]
    fn base64_and_percents() {
        for (text, bytes) in [("", &b""[..]), ("Zg==", b"f"), ("Zm9v\nYmFy", b"foobar"), ("Zm8", b"fo")] {
            assert_eq!(decode_base64(text).unwrap(), bytes);
        }
        assert_eq!(decode_base64("Zm9*"), None);
        assert_eq!(decode_percent("a%20room%2.bin%"), "a room%2.bin%");
    }
}
