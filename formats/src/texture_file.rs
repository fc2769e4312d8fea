//! Texture images: the bytes of a PNG or JPEG → texels.

use std::io::Cursor;

use image::ImageReader;
use scene::{Texture, decode_srgb, encode_srgb};

/// Largest side of a texture, texels; a larger one is halved until it fits. Twice that of a picture's width, so that a
/// texture seen from near is still sharp, at 12 MB of a bake.
const LARGEST_SIDE: u32 = 2048;

/// A decoded image.
pub(crate) struct DecodedTexture {
    pub texture: Texture,
    /// Mean opacity, 0..=1.
    pub mean_alpha: f64,
}

/// Decodes the bytes of a PNG or a JPEG, known by its first bytes. The error is the codec's word.
pub(crate) fn decode_texture(name: &str, bytes: &[u8]) -> Result<DecodedTexture, String> {
    // The reader's default limits keep a small file from claiming all memory.
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let image = reader.decode().map_err(|error| error.to_string())?.into_rgba8();
    let (mut width, mut height) = image.dimensions();
    let alpha: u64 = image.pixels().map(|pixel| u64::from(pixel.0[3])).sum();
    let mean_alpha = alpha as f64 / 255.0 / (f64::from(width) * f64::from(height)).max(1.0);
    let mut texels: Vec<[u8; 3]> = image.pixels().map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]).collect();
    while width.max(height) > LARGEST_SIDE {
        (width, height, texels) = halved(width, height, &texels);
    }
    let texture = Texture { name: name.to_owned(), width, height, texels };
    if texture.is_valid() { Ok(DecodedTexture { texture, mean_alpha }) } else { Err("it has no pixels".to_owned()) }
}

/// Every two by two texels as their mean in linear light; an odd last row or column counts twice.
fn halved(width: u32, height: u32, texels: &[[u8; 3]]) -> (u32, u32, Vec<[u8; 3]>) {
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let texel = |x: u32, y: u32| texels[y.min(height - 1) as usize * width as usize + x.min(width - 1) as usize];
    let mean = |i: u64| {
        let (x, y) = ((i % u64::from(half_width)) as u32 * 2, (i / u64::from(half_width)) as u32 * 2);
        let four = [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)];
        std::array::from_fn(|channel| {
            let linear = four.iter().map(|texel| decode_srgb(texel[channel])).sum::<f32>() / 4.0;
            (encode_srgb(linear) * 255.0).round() as u8
        })
    };
    let count = u64::from(half_width) * u64::from(half_height);
    (half_width, half_height, (0..count).map(mean).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_is_no_image_is_an_error() {
        for bytes in [&b""[..], b"GIF89a", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0"] {
            assert!(decode_texture("a", bytes).is_err());
        }
    }

    #[test]
    fn a_large_texture_is_halved_in_linear_light() {
        let (width, height, texels) = halved(3, 1, &[[0, 10, 255], [255, 10, 255], [77, 0, 1]]);
        assert_eq!((width, height), (2, 1));
        // Half the light of white is 188 of 255.
        assert_eq!(texels, [[188, 10, 255], [77, 0, 1]]);
    }

    #[test]
    fn alpha_is_its_mean() {
        let image = image::RgbaImage::from_raw(2, 1, vec![1, 2, 3, 255, 4, 5, 6, 0]).unwrap();
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let decoded = decode_texture("half", bytes.get_ref()).unwrap();
        assert_eq!(decoded.texture.texels, [[1, 2, 3], [4, 5, 6]]);
        assert!((decoded.mean_alpha - 0.5).abs() < 1e-12);
    }
}
