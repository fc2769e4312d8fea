//! Where a picture is off: the error of each pixel beside a full picture (Guo 1998, figure 11), in the colours of the error
//! on the scene.

use glam::Vec3;
use scene::luminance;

use crate::error_picture::signed_colour;

/// Error from which on the colour no longer changes, as a part of the pixel's own luminance or of the picture's mean,
/// whichever is more: ten times what an eye sees side by side, so that what is seen of a good picture is where its errors
/// are.
const SATURATED: f64 = 0.1;

/// The map of a picture beside a full one of as many pixels: grey where they are equal, blue where it is too dark, red where
/// it is too bright, full from a tenth on.
pub fn error_map(picture: &[Vec3], full: &[Vec3]) -> Vec<[u8; 3]> {
    let light = |pixel: &Vec3| luminance(pixel.as_dvec3());
    let mean = full.iter().map(light).sum::<f64>() / full.len() as f64;
    let colour = |(pixel, truth): (&Vec3, &Vec3)| {
        let difference = light(pixel) - light(truth);
        // Of a black picture anything but black is infinitely far.
        let part = if difference == 0.0 { 0.0 } else { difference / (SATURATED * light(truth).max(mean)) };
        signed_colour(part).map(|channel| channel.round() as u8)
    };
    picture.iter().zip(full).map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_pictures_and_those_without_pixels_have_a_map() {
        assert!(error_map(&[], &[]).is_empty());
        let [equal, off] = [Vec3::ZERO, Vec3::ONE].map(|light| error_map(&[light], &[Vec3::ZERO])[0]);
        assert_eq!(equal, [200; 3]);
        assert!(off[0] > 200 && off[2] < 50);
    }

    #[test]
    fn too_dark_is_blue_too_bright_red_and_a_tenth_is_full() {
        let full = [Vec3::ONE; 4];
        let map = error_map(&[Vec3::splat(0.9), Vec3::splat(0.5), Vec3::splat(1.05), Vec3::splat(2.0)], &full);
        assert_eq!(map[0], map[1]);
        assert!(map[0][2] > map[0][0] && map[2][0] > map[2][2]);
        assert!(map[2][1] > map[3][1] && map[3][0] > map[2][0], "half of a tenth is paler: {map:?}");
    }
}
