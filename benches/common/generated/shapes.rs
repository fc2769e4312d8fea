//! Simple shapes on a floor, like the first scene of Ben-Artzi et al. 2004: round ones and a box, which shade each other.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use scene::Scene;

use super::modeller::{Modeller, STANDING};

/// Sphere, torus, cone, cylinder and box; `size` is the number of faces around a body.
pub fn shapes(size: u32) -> Scene {
    let around = size.max(8);
    let mut m = Modeller::default();
    let floor = m.material("floor", [0.6, 0.58, 0.55], [0.0; 3]);
    let warm = m.material("warm", [0.7, 0.4, 0.25], [0.0; 3]);
    let cool = m.material("cool", [0.3, 0.45, 0.65], [0.0; 3]);
    m.object("floor".into());
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0) * 12.0;
    m.face(floor, &[corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)]);
    let ring = |u: f64, radius: f64, z: f64| DVec3::new((u * TAU).cos() * radius, (u * TAU).sin() * radius, z);
    m.object("round sphere".into());
    m.surface(cool, [around, around / 2], |u, v| {
        ring(u, (v * PI).sin(), 1.0 - (v * PI).cos()) + DVec3::new(-1.6, 0.6, 0.0)
    });
    m.object("round torus".into());
    m.surface(warm, [around, around / 2], |u, v| {
        let (sin, cos) = (v * TAU).sin_cos();
        let flat = ring(u, 0.9 + 0.3 * cos, 0.3 * sin);
        // Leans on the sphere's side.
        DVec3::new(flat.x, flat.y * 0.8 - flat.z * 0.6, flat.y * 0.6 + flat.z * 0.8 + 0.9) + DVec3::new(0.8, -0.7, 0.0)
    });
    m.object("round cone".into());
    m.surface(cool, [around, 8], |u, v| ring(u, 0.8 * (1.0 - v), 1.9 * v) + DVec3::new(2.3, 1.5, 0.0));
    m.object("round cylinder".into());
    m.surface(warm, [around, 1], |u, v| ring(u, 0.5, 1.2 * v) + DVec3::new(-0.4, 2.4, 0.0));
    m.object("lid".into());
    let lid: Vec<DVec3> =
        (0..around).map(|i| ring(f64::from(i) / f64::from(around), 0.5, 1.2) + DVec3::new(-0.4, 2.4, 0.0)).collect();
    m.face(warm, &lid);
    m.object("box".into());
    m.prism(floor, [(-2.2, -1.9), (-1.2, -1.6), (-1.5, -0.6), (-2.5, -0.9)], (0.0, 0.8), &STANDING);
    let eye = DVec3::new(0.6, -7.2, 4.4);
    m.camera(eye, DVec3::new(0.1, 0.3, 0.6) - eye, 42.0);
    m.smoothed(|object| object.starts_with("round"))
}
