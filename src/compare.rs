//! How far a picture is from a reference: one number each for radiance and for what a display shows.

use glam::Vec3;

/// Relative RMSE of radiance: every difference counts relative to max(own, mean), where own is the reference pixel
/// averaged over its colours and mean the whole reference's average. Infinite where either picture is not finite.
pub fn radiance_error(picture: &[Vec3], reference: &[Vec3]) -> f64 {
    let average = |pixel: &Vec3| f64::from(pixel.element_sum()) / 3.0;
    let mean = reference.iter().map(average).sum::<f64>() / reference.len() as f64;
    let squares = picture.iter().zip(reference).map(|(pixel, truth)| {
        let difference = (pixel.as_dvec3() - truth.as_dvec3()).length_squared();
        let scale = average(truth).max(mean);
        // A black reference: equal is equal, anything else infinitely far.
        if difference == 0.0 { 0.0 } else { difference / (3.0 * scale * scale) }
    });
    let error = (squares.sum::<f64>() / reference.len() as f64).sqrt();
    if error.is_nan() { f64::INFINITY } else { error }
}

/// L1 and L2 norms of a picture's difference from a full one, relative to the full one's (Guo 1998, section 6.1).
pub fn relative_norms(picture: &[Vec3], full: &[Vec3]) -> [f64; 2] {
    let norms = |of: &dyn Fn(usize) -> Vec3| {
        let channels = (0..full.len()).flat_map(|i| of(i).to_array()).map(f64::from);
        channels.fold([0.0, 0.0], |[l1, l2], channel| [l1 + channel.abs(), l2 + channel * channel])
    };
    let (apart, whole) = (norms(&|i| picture[i] - full[i]), norms(&|i| full[i]));
    // Of a black picture nothing is equal, and anything else infinitely far.
    let ratio = |i: usize| if apart[i] == 0.0 { 0.0 } else { apart[i] / whole[i] };
    [ratio(0), ratio(1).sqrt()]
}

/// Share of pixels, 0..=1, of which any channel is off by more than 1/255.
pub fn share_off(picture: &[[u8; 3]], reference: &[[u8; 3]]) -> f64 {
    let off = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1);
    picture.iter().zip(reference).filter(off).count() as f64 / reference.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_infinitely_far() {
        assert_eq!(radiance_error(&[Vec3::NAN], &[Vec3::ONE]), f64::INFINITY);
        assert_eq!(radiance_error(&[Vec3::ONE], &[Vec3::NAN]), f64::INFINITY);
        assert_eq!(radiance_error(&[Vec3::ONE], &[Vec3::ZERO]), f64::INFINITY);
        assert_eq!(radiance_error(&[Vec3::ZERO], &[Vec3::ZERO]), 0.0);
    }

    #[test]
    fn radiance_is_off_by_what_it_is_off() {
        let reference = [Vec3::ONE, Vec3::splat(3.0)];
        assert_eq!(radiance_error(&reference, &reference), 0.0);
        // The first pixel counts relative to the mean of 2, the second relative to its own 3.
        let error = radiance_error(&[Vec3::splat(1.2), Vec3::splat(3.6)], &reference);
        let expected = ((0.1f64.powi(2) + 0.2f64.powi(2)) / 2.0).sqrt();
        assert!((error - expected).abs() < 1e-6, "{error} {expected}");
    }

    #[test]
    fn norms_are_relative_to_the_full_pictures() {
        let full = [Vec3::splat(3.0), Vec3::splat(1.0)];
        assert_eq!(relative_norms(&full, &full), [0.0, 0.0]);
        let [l1, l2] = relative_norms(&[Vec3::splat(3.0), Vec3::splat(2.0)], &full);
        assert!((l1 - 0.25).abs() < 1e-12 && (l2 - 0.1f64.sqrt()).abs() < 1e-12);
        assert_eq!(relative_norms(&[Vec3::ONE], &[Vec3::ZERO])[0], f64::INFINITY);
        assert_eq!(relative_norms(&[Vec3::ZERO], &[Vec3::ZERO]), [0.0, 0.0]);
    }

    #[test]
    fn a_pixel_is_off_by_its_worst_channel() {
        let reference = [[10, 10, 10]; 4];
        let picture = [[10, 10, 10], [11, 9, 10], [10, 12, 10], [0, 0, 0]];
        assert_eq!(share_off(&picture, &reference), 0.5);
    }
}
