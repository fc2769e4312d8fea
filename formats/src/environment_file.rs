//! Pictures of all directions: Radiance's `.hdr` and `.exr`, as light that surrounds a scene.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{ImageFormat, ImageReader};
use scene::LatLongMap;

use crate::FormatError;

/// A map that was read, and what is odd about it.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// The map; radiance as the file has it.
    pub map: LatLongMap,
    /// Texels with a channel that was not a number or negative, and is 0 now, or infinite, and is now the largest finite one of
    /// the file.
    pub clamped: u64,
    /// In words, what to tell the user.
    pub warnings: Vec<String>,
}

/// Reads a picture whose columns are azimuths and whose rows are heights, the zenith on top, by the end of its name.
///
/// # Errors
/// A file that cannot be read, is neither `.hdr` nor `.exr`, or is black all over.
pub fn read_environment(path: &Path) -> Result<EnvironmentMap, FormatError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
    let (kind, format) = match extension.as_str() {
        "hdr" => (ImageFormat::Hdr, "HDR"),
        "exr" => (ImageFormat::OpenExr, "EXR"),
        _ => {
            let cause = "is no picture of an environment by its name";
            return Err(FormatError::content(path, cause, "give a .hdr or .exr file, or cie:1 to cie:16"));
        }
    };
    let bytes = std::fs::read(path).map_err(|error| FormatError::read(path, error))?;
    // The reader's default limits keep a small file from claiming all memory.
    let picture = ImageReader::with_format(Cursor::new(bytes), kind).decode();
    let picture = picture.map_err(|source| FormatError::Image { path: path.to_owned(), format, source })?.into_rgb32f();
    let (width, height) = picture.dimensions();
    let mut texels: Vec<Vec3> = picture.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    let clamped = clamp(&mut texels);
    if texels.iter().all(|texel| *texel == Vec3::ZERO) {
        let cause = format!("its {width} × {height} texels are all black");
        return Err(FormatError::content(path, cause, "give a picture with light in it"));
    }
    let mut warnings = Vec::new();
    if clamped > 0 {
        warnings.push(format!(
            "{}: {clamped} of {} texels were negative or no finite numbers, and are clamped",
            path.display(),
            texels.len()
        ));
    }
    if u64::from(width) != 2 * u64::from(height) {
        warnings.push(format!(
            "{}: has {width} × {height} texels, and is taken for a picture of all directions, which is twice as wide as high; light \
             is stretched if it is none",
            path.display()
        ));
    }
    Ok(EnvironmentMap { map: LatLongMap { width, height, texels }, clamped, warnings })
}

/// Makes every channel a finite number of at least 0; how many texels that changed.
fn clamp(texels: &mut [Vec3]) -> u64 {
    let finite = texels.iter().flat_map(|texel| texel.to_array()).filter(|channel| channel.is_finite());
    let largest = finite.fold(0.0, f32::max);
    let mut clamped = 0;
    for texel in texels {
        // The maximum with 0 is 0 for what is no number.
        let sound = texel.map(|channel| channel.max(0.0).min(largest));
        clamped += u64::from(sound != *texel);
        *texel = sound;
    }
    clamped
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::write_exr;

    fn written(width: u32, height: u32, texels: &[Vec3]) -> Result<EnvironmentMap, FormatError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.EXR");
        write_exr(&path, width, height, texels).unwrap();
        read_environment(&path)
    }

    #[test]
    fn what_is_no_light_is_clamped_and_counted() {
        let mut texels = vec![Vec3::new(1.0, 2.0, 3.0); 8];
        texels[1].x = f32::NAN;
        texels[2].y = f32::INFINITY;
        texels[3].z = f32::NEG_INFINITY;
        texels[4].x = -1.0;
        let read = written(4, 2, &texels).unwrap();
        assert_eq!(read.clamped, 4);
        assert!(read.warnings.len() == 1 && read.warnings[0].contains("4 of 8 texels"), "{:?}", read.warnings);
        let found = &read.map.texels;
        assert_eq!(found[0], Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(
            found[1..5],
            [Vec3::new(0., 2., 3.), Vec3::new(1., 3., 3.), Vec3::new(1., 2., 0.), Vec3::new(0., 2., 3.)]
        );
    }

    #[test]
    fn a_picture_of_the_wrong_shape_is_read_and_said() {
        for (width, height) in [(1, 1), (3, 2), (2, 2)] {
            let read = written(width, height, &vec![Vec3::ONE; (width * height) as usize]).unwrap();
            assert_eq!((read.map.width, read.map.height, read.clamped), (width, height, 0));
            assert!(read.warnings[0].contains(&format!("{width} × {height} texels")), "{:?}", read.warnings);
        }
        assert_eq!(written(2, 1, &[Vec3::ONE; 2]).unwrap().warnings, Vec::<String>::new());
    }

    #[test]
    fn black_and_unreadable_pictures_are_refused() {
        for black in [0.0, -3.0, f32::NAN, f32::NEG_INFINITY, f32::INFINITY] {
            let said = written(2, 1, &[Vec3::splat(black); 2]).unwrap_err().to_string();
            assert!(said.contains("2 × 1 texels are all black"), "{said}");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert!(matches!(read_environment(&path("none.hdr")), Err(FormatError::Read { .. })));
        std::fs::write(path("sky.png"), "").unwrap();
        assert!(read_environment(&path("sky.png")).unwrap_err().to_string().contains(".hdr or .exr"));
        for bytes in [&b""[..], b"#?RADIANCE\n", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 9\nabc"] {
            std::fs::write(path("sky.hdr"), bytes).unwrap();
            assert!(read_environment(&path("sky.hdr")).unwrap_err().to_string().contains("readable HDR image"));
        }
    }

    #[test]
    fn a_picture_of_radiance_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.hdr");
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
        std::fs::write(&path, [&header[..], &[128, 64, 0, 129, 128, 128, 128, 128]].concat()).unwrap();
        let read = read_environment(&path).unwrap();
        assert_eq!((read.map.width, read.map.height), (2, 1));
        assert!((read.map.texels[0] - Vec3::new(1.0, 0.5, 0.0)).length() < 1e-2, "{:?}", read.map.texels);
    }
}
