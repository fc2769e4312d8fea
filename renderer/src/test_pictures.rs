//! What samplers are shown in tests, and what shows it.

use glam::{DVec2, Vec3};
use scene::{Display, Exposure, ToneCurve};

use crate::Evaluation;

/// A display that leaves what is dark as it is.
pub(crate) fn display() -> Display {
    Display::new(Exposure { ev: 0.0 }, ToneCurve::Shoulder)
}

/// A bright disk of 13.5 pixels about (20, 15) on a ground whose brightness rises to the right.
pub(crate) fn disk(point: DVec2) -> Evaluation {
    let inside = point.distance(DVec2::new(20.0, 15.0)) < 13.5;
    let radiance = if inside { Vec3::new(0.9, 0.5, 0.1) } else { Vec3::splat(0.1 + 0.002 * point.x as f32) };
    Evaluation { radiance, object: 1 + u32::from(inside), cost: 1 }
}

/// Even grey, of which a tenth of all points see no finite radiance.
pub(crate) fn holes(point: DVec2) -> Evaluation {
    let bad = match (point.x * 7.3 + point.y * 11.7).fract() {
        x if x < 0.05 => f32::NAN,
        x if x < 0.1 => f32::INFINITY,
        _ => 0.3,
    };
    Evaluation { radiance: Vec3::new(0.3, bad, 0.3), object: 1, cost: 1 }
}
