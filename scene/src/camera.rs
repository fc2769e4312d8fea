//! A pinhole camera.

use glam::{DVec2, DVec3, Mat4, Vec4};
use serde::{Deserialize, Serialize};

use crate::Ray;

/// A pinhole camera. The picture's x axis points right, y down, pixel (0, 0) is the upper left one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Position of the eye, metres.
    pub eye: DVec3,
    /// A point in the middle of the picture, metres.
    pub target: DVec3,
    /// A direction that points up in the picture; need not be perpendicular to the view.
    pub up: DVec3,
    /// Full vertical opening angle, radians, in 0..π.
    pub vertical_fov: f64,
}

/// A camera with the name a user calls it by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedCamera {
    /// Name, unique within its scene.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

impl Camera {
    /// Whether all numbers are finite, the view has a direction that `up` is not parallel to, and the opening
    /// angle lies in 0..π.
    pub fn is_valid(&self) -> bool {
        let forward = (self.target - self.eye).normalize_or_zero();
        self.eye.is_finite()
            && self.target.is_finite()
            && forward.cross(self.up.normalize_or_zero()).length() > 1e-6
            && self.vertical_fov > 0.0
            && self.vertical_fov < std::f64::consts::PI
    }

    /// Unit vectors to the right, up and forward.
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        (right, right.cross(forward), forward)
    }

    /// The ray through a point of the picture, in pixels from its upper left corner; a pixel's centre is at
    /// (i + ½, j + ½). The direction has unit length.
    pub fn ray(&self, pixel: DVec2, width: u32, height: u32) -> Ray {
        let (right, up, forward) = self.basis();
        let half = (self.vertical_fov / 2.0).tan();
        let (w, h) = (f64::from(width), f64::from(height));
        let x = (2.0 * pixel.x - w) / h * half;
        let y = (1.0 - 2.0 * pixel.y / h) * half;
        Ray { origin: self.eye, direction: (forward + right * x + up * y).normalize() }
    }

    /// World to clip space with reversed, infinite depth: z/w is 1 at the distance `near` (metres) and 0 at
    /// infinity, which spends f32 precision evenly over distances.
    pub fn clip_from_world(&self, width: u32, height: u32, near: f64) -> Mat4 {
        let (right, up, forward) = self.basis();
        let half = (self.vertical_fov / 2.0).tan();
        let aspect = f64::from(width) / f64::from(height);
        let row = |axis: DVec3, scale: f64| (axis * scale).extend(-axis.dot(self.eye) * scale).as_vec4();
        let rows = [row(right, 1.0 / (half * aspect)), row(up, 1.0 / half), Vec4::W * near as f32, row(forward, 1.0)];
        Mat4::from_cols_array_2d(&rows.map(|r| r.to_array())).transpose()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn rays_and_clip_space_agree() {
        let camera = Camera {
            eye: DVec3::new(3.7, 0.35, 1.65),
            target: DVec3::new(1.0, 4.0, 1.0),
            up: DVec3::Z,
            vertical_fov: 1.1,
        };
        let clip = camera.clip_from_world(320, 200, 0.01);
        for (x, y) in [(0.0, 0.0), (319.5, 12.25), (160.0, 100.0), (7.0, 200.0)] {
            let ray = camera.ray(DVec2::new(x, y), 320, 200);
            let point: Vec3 = (ray.origin + ray.direction * 2.5).as_vec3();
            let c = clip * point.extend(1.0);
            assert!((f64::from(c.x / c.w) * 160.0 + 160.0 - x).abs() < 1e-3);
            assert!((100.0 - f64::from(c.y / c.w) * 100.0 - y).abs() < 1e-3);
            assert!(c.z > 0.0 && c.z < c.w);
        }
    }
}
