//! Rows of dominoes on a floor, like those of Ben-Artzi et al. 2004: many separate bodies that shade each other.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use scene::Scene;

use super::modeller::{Modeller, STANDING};

/// Sides of a domino, metres: across, along the row and up.
const SIDES: [f64; 3] = [0.5, 0.12, 1.0];

/// So many dominoes along three rings.
pub fn dominoes(size: u32) -> Scene {
    let mut m = Modeller::default();
    let floor = m.material("floor", [0.55, 0.5, 0.45], [0.0; 3]);
    let piece = m.material("domino", [0.75, 0.7, 0.62], [0.0; 3]);
    m.object("floor".into());
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0) * 15.0;
    m.face(floor, &[corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)]);
    let radii = [1.2, 2.2, 3.2];
    let length: f64 = radii.iter().sum();
    for (ring, radius) in radii.into_iter().enumerate() {
        let count = ((f64::from(size) * radius / length) as u32).max(3);
        for i in 0..count {
            m.object(format!("domino {ring} {i}"));
            let (sin, cos) = (f64::from(i) / f64::from(count) * TAU).sin_cos();
            let (outward, along) = (DVec2::new(cos, sin), DVec2::new(-sin, cos));
            let place = |across: f64, ahead: f64| {
                let place = outward * (radius + across * SIDES[0] / 2.0) + along * (ahead * SIDES[1] / 2.0);
                (place.x, place.y)
            };
            m.prism(
                piece,
                [place(-1., -1.), place(1., -1.), place(1., 1.), place(-1., 1.)],
                (0.0, SIDES[2]),
                &STANDING,
            );
        }
    }
    let eye = DVec3::new(0.0, -7.5, 5.0);
    m.camera(eye, DVec3::new(0.0, -0.2, 0.2) - eye, 45.0);
    m.scene()
}
