//! Triangles in chunks, of which those out of view are not drawn.

use std::ops::Range;

use glam::{DVec3, Vec3};
use scene::Camera;

use crate::records::Corners;

/// Triangles of a chunk: enough that chunks cost nothing beside them, few enough that a chunk is a corner of a room, not
/// all of it. Triangles come patch by patch, and so lie close together.
const CHUNK: usize = 256;

/// What the rounding of f32 may move a corner by in the picture, as a fraction of its distance: chunks that end so close
/// beside the picture count as in it.
const MARGIN: f64 = 1e-5;

/// The boxes of all chunks.
pub(crate) struct Chunks {
    boxes: Vec<[DVec3; 2]>,
    triangles: u32,
}

impl Chunks {
    pub fn of(corners: &[Corners]) -> Self {
        let bounds = |chunk: &[Corners]| {
            let points = chunk.as_flattened().iter().map(|&corner| Vec3::from(corner).as_dvec3());
            points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
        };
        Self { boxes: corners.chunks(CHUNK).map(bounds).collect(), triangles: corners.len() as u32 }
    }

    /// The triangles of the chunks that a camera may see something of, in order.
    pub fn in_view(&self, camera: &Camera, width: u32, height: u32) -> Vec<Range<u32>> {
        let (right, up, forward) = camera.basis();
        let half = (camera.vertical_fov / 2.0).tan();
        let wide = half * f64::from(width) / f64::from(height);
        // Normals of the pyramid's sides, inwards, and of the plane of the eye.
        let planes =
            [forward * wide + right, forward * wide - right, forward * half + up, forward * half - up, forward];
        let is_seen = |&[low, high]: &[DVec3; 2]| {
            let (middle, reach) = ((low + high) * 0.5 - camera.eye, (high - low) * 0.5);
            let margin = MARGIN * middle.length();
            planes.iter().all(|normal| normal.dot(middle) + normal.abs().dot(reach) >= -margin)
        };
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for (chunk, _) in self.boxes.iter().enumerate().filter(|(_, bounds)| is_seen(bounds)) {
            let first = (chunk * CHUNK) as u32;
            let end = (first + CHUNK as u32).min(self.triangles);
            match ranges.last_mut() {
                Some(last) if last.end == first => last.end = end,
                _ => ranges.push(first..end),
            }
        }
        ranges
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::single_range_in_vec_init, reason = "ranges are what is compared")]

    use super::*;

    /// A triangle a metre from the origin in a direction, as often as to fill so many chunks.
    fn chunks(directions: &[DVec3]) -> Chunks {
        let triangle = |&direction: &DVec3| {
            let corner = |offset: DVec3| (direction + 0.01 * offset).as_vec3().to_array();
            [corner(DVec3::X), corner(DVec3::Y), corner(DVec3::Z)]
        };
        let corners: Vec<Corners> = directions.iter().flat_map(|direction| vec![triangle(direction); CHUNK]).collect();
        Chunks::of(&corners)
    }

    fn camera(target: DVec3) -> Camera {
        Camera { eye: DVec3::ZERO, target, up: DVec3::Z, vertical_fov: 1.0 }
    }

    #[test]
    fn nothing_is_in_view_of_nothing() {
        assert!(Chunks::of(&[]).in_view(&camera(DVec3::X), 4, 3).is_empty());
    }

    #[test]
    fn what_is_beside_behind_above_or_below_is_not_drawn() {
        let around = [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y, DVec3::new(0.5, 0.0, 1.0), DVec3::new(0.5, 0.0, -1.0)];
        let chunks = chunks(&around);
        let chunk = CHUNK as u32;
        for (i, &direction) in (0..).zip(&around[..4]) {
            assert_eq!(chunks.in_view(&camera(direction), 4, 3), [i * chunk..(i + 1) * chunk], "{direction}");
        }
        // A wide picture sees two neighbours as one, and not what is behind.
        assert_eq!(chunks.in_view(&camera(DVec3::new(1.0, 1.0, 0.0)), 30, 4), [0..2 * chunk]);
    }

    #[test]
    fn a_chunk_around_the_eye_and_the_last_short_one_are_drawn() {
        let mut corners = vec![[[-9.0, -9.0, -9.0], [9.0, 9.0, 9.0], [9.0, -9.0, 9.0]]; 2 * CHUNK + 3];
        corners[2 * CHUNK] = [[1.0, 0.0, 0.0]; 3];
        assert_eq!(Chunks::of(&corners).in_view(&camera(-DVec3::Y), 4, 3), [0..2 * CHUNK as u32 + 3]);
    }
}
