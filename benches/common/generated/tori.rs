//! Rings of mirrors close together on the tiles of a room, like the scene of figure 13 of Guo 1998: curved surfaces that
//! mirror each other.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use scene::{Light, Rgb, Scene};

use super::modeller::{Dice, Modeller};

/// Rings along either side of the floor.
const ROW: u32 = 5;

/// Radii of a ring and of its tube, and the distance of two rings, metres: they nearly touch.
const RADII: [f64; 2] = [0.42, 0.15];
const SPACING: f64 = 0.86;

/// Tiles of half a metre along a side of the floor, and height of the walls, metres.
const TILES: i32 = 20;
const HEIGHT: f64 = 7.0;

/// 25 tori, each turned as it likes; `size` is the number of faces around one. Two lights without a surface, which an OBJ
/// does not hold.
pub fn tori(size: u32) -> Scene {
    let around = size.max(8);
    let mut m = Modeller::default();
    let tiles = [m.material("pale", [0.7, 0.68, 0.62], [0.0; 3]), m.material("dark", [0.16, 0.2, 0.24], [0.0; 3])];
    let walls =
        [("rose", [0.6, 0.42, 0.4]), ("blue", [0.35, 0.45, 0.6]), ("white", [0.7; 3]), ("green", [0.4, 0.55, 0.4])]
            .map(|(name, colour)| m.material(name, colour, [0.0; 3]));
    let metals = [("silver", [0.8; 3]), ("gold", [0.85, 0.66, 0.3]), ("copper", [0.8, 0.45, 0.32])]
        .map(|(name, colour)| m.mirror(name, [0.06; 3], colour));
    m.object("floor".into());
    let corner = |x: i32, y: i32| DVec3::new(f64::from(x), f64::from(y), 0.0) * 0.5;
    for (x, y) in (-TILES / 2..TILES / 2).flat_map(|x| (-TILES / 2..TILES / 2).map(move |y| (x, y))) {
        let tile = tiles[(x + y).rem_euclid(2) as usize];
        m.face(tile, &[corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
    }
    m.object("walls".into());
    let high = DVec3::new(0.0, 0.0, HEIGHT);
    let around_floor = [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(x, y)| corner(x * TILES / 2, y * TILES / 2));
    for (side, wall) in walls.into_iter().enumerate() {
        let [left, right] = [side + 1, side].map(|i| around_floor[i % 4]);
        m.face(wall, &[left, right, right + high, left + high]);
    }
    m.face(tiles[0], &[3, 2, 1, 0].map(|i| around_floor[i] + high));
    let mut dice = Dice(13);
    for (row, column) in (0..ROW).flat_map(|row| (0..ROW).map(move |column| (row, column))) {
        m.object(format!("ring {row} {column}"));
        let place = |step: u32| SPACING * (f64::from(step) - f64::from(ROW - 1) / 2.0);
        let turn = DQuat::from_euler(glam::EulerRot::ZXZ, dice.between(0.0, TAU), dice.between(0.2, 1.3), 0.0);
        let middle = DVec3::new(place(column), place(row), RADII[0] + RADII[1] + 0.02);
        m.surface(dice.pick(&metals), [around, around / 2], |u, v| {
            let ((sin_u, cos_u), (sin_v, cos_v)) = ((u * TAU).sin_cos(), (v * TAU).sin_cos());
            let flat = RADII[0] + RADII[1] * cos_v;
            middle + turn * DVec3::new(flat * cos_u, flat * sin_u, RADII[1] * sin_v)
        });
    }
    let eye = DVec3::new(0.8, -4.6, 3.4);
    m.camera(eye, DVec3::new(0.0, -0.2, 0.4) - eye, 42.0);
    let mut scene = m.smoothed(|object| object.starts_with("ring"));
    scene.lights = vec![
        Light::Point { position: DVec3::new(-3.0, -3.6, 4.5), intensity: Rgb::new(80.0, 76.0, 70.0) },
        Light::Point { position: DVec3::new(4.0, 2.0, 3.5), intensity: Rgb::new(30.0, 34.0, 42.0) },
    ];
    scene
}
