//! A plant with lobed leaves in a pot, like that of Ben-Artzi et al. 2004: shadows that are as intricate as can be.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use scene::Scene;

use super::modeller::{Dice, Modeller};

/// Cells of a leaf, along and across each half.
const LEAF: [u32; 2] = [18, 2];

/// So many leaves.
pub fn plant(size: u32) -> Scene {
    let mut m = Modeller::default();
    let floor = m.material("floor", [0.6, 0.58, 0.55], [0.0; 3]);
    let clay = m.material("clay", [0.55, 0.3, 0.2], [0.0; 3]);
    let green = m.material("leaf", [0.25, 0.45, 0.15], [0.0; 3]);
    m.object("floor".into());
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0) * 12.0;
    m.face(floor, &[corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)]);
    m.object("round pot".into());
    let ring = |u: f64, radius: f64, z: f64| DVec3::new((u * TAU).cos() * radius, (u * TAU).sin() * radius, z);
    m.surface(clay, [32, 4], |u, v| ring(u, 0.45 + 0.2 * v, 0.8 * v));
    m.object("earth".into());
    m.face(clay, &(0..32).map(|i| ring(f64::from(i) / 32.0, 0.62, 0.75)).collect::<Vec<_>>());
    let mut dice = Dice(7);
    for i in 0..size {
        let turn = f64::from(i) * 2.399_963 + dice.between(-0.3, 0.3);
        let height = 0.8 + 1.9 * (f64::from(i) + 0.5) / f64::from(size) + dice.between(-0.1, 0.1);
        let (length, rise, droop) = (dice.between(0.9, 1.5), dice.between(0.1, 0.8), dice.between(0.5, 1.1));
        let length = length * (1.25 - 0.3 * height);
        let outward = DVec3::new(turn.cos(), turn.sin(), 0.0);
        let sideways = DVec3::new(-turn.sin(), turn.cos(), 0.0);
        let spine = |along: f64| {
            let out = length * along;
            outward * (0.12 + out) + DVec3::Z * (height + out * rise - droop * out * out * 0.6)
        };
        for half in [-1.0, 1.0] {
            m.object(format!("round leaf {i} {half}"));
            let at = |along: f64, across: f64| {
                // Seven lobes, narrower towards the tip.
                let lobes = 0.55 + 0.45 * (along * 7.0 * TAU).cos();
                let width = 0.28 * length * (along * PI).sin().max(0.0).powf(0.7) * (0.25 + 0.75 * lobes);
                spine(along) + sideways * (half * width * across) + DVec3::Z * (0.25 * width * across)
            };
            for (a, b) in (0..LEAF[1]).flat_map(|b| (0..LEAF[0]).map(move |a| (a, b))) {
                let at = |a: u32, b: u32| at(f64::from(a) / f64::from(LEAF[0]), f64::from(b) / f64::from(LEAF[1]));
                let [p, q, r, s] = [at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)];
                for outline in [[p, q, r], [p, r, s]] {
                    if (outline[1] - outline[0]).cross(outline[2] - outline[0]).length() > 1e-6 {
                        m.sheet(green, &outline);
                    }
                }
            }
        }
    }
    let eye = DVec3::new(0.4, -6.0, 3.3);
    m.camera(eye, DVec3::new(0.0, 0.0, 1.3) - eye, 42.0);
    m.smoothed(|object| object.starts_with("round"))
}
