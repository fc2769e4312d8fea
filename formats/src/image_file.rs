//! Pictures: PNG for eyes (8-bit sRGB), EXR for numbers (32-bit linear radiance). Rows run from the top.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{DynamicImage, ImageFormat, ImageReader, Rgb32FImage, RgbImage};

use crate::{FormatError, write_atomically};

/// Writes an 8-bit picture; the values are sRGB-encoded already.
///
/// # Errors
/// A list that is not `width` × `height` long, an empty picture, or a path that cannot be written.
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[[u8; 3]]) -> Result<(), FormatError> {
    check_size(path, width, height, rgb.len())?;
    let picture = RgbImage::from_raw(width, height, rgb.as_flattened().to_vec());
    write(path, picture.map(DynamicImage::ImageRgb8), ImageFormat::Png, "PNG")
}

/// Reads a PNG as width, height and 8-bit pixels; transparency is dropped, 16 bits are rounded.
pub fn read_png(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>), FormatError> {
    let picture = read(path, ImageFormat::Png, "PNG")?.into_rgb8();
    Ok((picture.width(), picture.height(), picture.pixels().map(|pixel| pixel.0).collect()))
}

/// Writes linear radiance, W·sr⁻¹·m⁻², as 32-bit floats.
///
/// # Errors
/// A list that is not `width` × `height` long, an empty picture, or a path that cannot be written.
pub fn write_exr(path: &Path, width: u32, height: u32, radiance: &[Vec3]) -> Result<(), FormatError> {
    check_size(path, width, height, radiance.len())?;
    let picture = Rgb32FImage::from_raw(width, height, radiance.iter().flat_map(|pixel| pixel.to_array()).collect());
    write(path, picture.map(DynamicImage::ImageRgb32F), ImageFormat::OpenExr, "EXR")
}

/// Reads an EXR as width, height and linear radiance, W·sr⁻¹·m⁻².
pub fn read_exr(path: &Path) -> Result<(u32, u32, Vec<Vec3>), FormatError> {
    let picture = read(path, ImageFormat::OpenExr, "EXR")?.into_rgb32f();
    Ok((picture.width(), picture.height(), picture.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect()))
}

fn check_size(path: &Path, width: u32, height: u32, pixels: usize) -> Result<(), FormatError> {
    if pixels > 0 && u64::from(width) * u64::from(height) == pixels as u64 {
        return Ok(());
    }
    let cause = format!("{pixels} pixels are no picture of {width} × {height}");
    Err(FormatError::content(path, cause, "give width × height pixels, at least one"))
}

/// Encodes in memory (EXR seeks back in what it writes), then writes the file at once.
fn write(
    path: &Path,
    picture: Option<DynamicImage>,
    kind: ImageFormat,
    format: &'static str,
) -> Result<(), FormatError> {
    let mut encoded = Cursor::new(Vec::new());
    picture
        .expect("the number of values was checked")
        .write_to(&mut encoded, kind)
        .map_err(|source| FormatError::Image { path: path.to_owned(), format, source })?;
    write_atomically(path, |to| to.write_all(encoded.get_ref()).map_err(|error| FormatError::write(path, error)))
}

fn read(path: &Path, kind: ImageFormat, format: &'static str) -> Result<DynamicImage, FormatError> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::read(path, error))?;
    // The reader's default limits keep a small file from claiming all memory.
    ImageReader::with_format(Cursor::new(bytes), kind).decode().map_err(|source| FormatError::Image {
        path: path.to_owned(),
        format,
        source,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_picture_of_the_wrong_size_or_of_nothing_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture");
        for (width, height, pixels) in [(2, 2, 3), (0, 0, 0), (0, 5, 0), (u32::MAX, u32::MAX, 1)] {
            let message = write_png(&path, width, height, &vec![[0; 3]; pixels]).unwrap_err().to_string();
            assert!(message.contains(&format!("{pixels} pixels")), "{message}");
            assert!(write_exr(&path, width, height, &vec![Vec3::ZERO; pixels]).is_err());
        }
        assert!(!path.exists());
    }

    #[test]
    fn what_is_no_image_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        assert!(matches!(read_png(&path), Err(FormatError::Read { .. })));
        for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01\x02\0\0\0", b"P6 1 1 255 abc"] {
            std::fs::write(&path, bytes).unwrap();
            assert!(read_png(&path).unwrap_err().to_string().contains("picture.png: "));
            assert!(read_exr(&path).unwrap_err().to_string().contains("picture.png: "));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn pictures_come_back_as_they_were(
            width in 1..40u32, values in proptest::collection::vec((any::<[u8; 3]>(), -1e9..1e9f32), 1..200),
        ) {
            let height = values.len() as u32 / width + 1;
            let count = (width * height) as usize;
            let pixels: Vec<[u8; 3]> = values.iter().map(|v| v.0).cycle().take(count).collect();
            let radiance: Vec<Vec3> = values.iter().map(|v| Vec3::new(v.1, -v.1, f32::from(v.0[0]))).cycle().take(count).collect();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("picture");
            write_png(&path, width, height, &pixels).unwrap();
            prop_assert_eq!(read_png(&path).unwrap(), (width, height, pixels));
            write_exr(&path, width, height, &radiance).unwrap();
            prop_assert_eq!(read_exr(&path).unwrap(), (width, height, radiance.clone()));
            let bytes = std::fs::read(&path).unwrap();
            write_exr(&path, width, height, &radiance).unwrap();
            prop_assert_eq!(std::fs::read(&path).unwrap(), bytes);
        }
    }
}
