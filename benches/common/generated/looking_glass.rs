//! A room with a mirror on its far wall, in which fine things are seen that the eye does not see otherwise.

use glam::DVec3;
use scene::Scene;

use super::modeller::{ALL_SIDES, Modeller, STANDING, Side, UPRIGHT};

/// A room with a mirror, and behind the eye a rack of so many bars, at least one.
pub fn looking_glass(bars: u32) -> Scene {
    let bars = bars.max(1);
    let mut m = Modeller::default();
    let dark = [0.0; 3];
    let [floor, wall, ceiling] = [("floor", [0.4, 0.33, 0.26]), ("wall", [0.72, 0.7, 0.66]), ("ceiling", [0.8; 3])]
        .map(|(name, colour)| m.material(name, colour, dark));
    let [wood, steel] = [("wood", [0.45, 0.3, 0.18]), ("steel", [0.2, 0.21, 0.23])]
        .map(|(name, colour)| m.material(name, colour, dark));
    let glass = m.mirror("glass", dark, [0.9; 3]);
    let light = m.material("light", dark, [24.0, 23.0, 20.0]);
    m.object("room".into());
    let (low, high) = (DVec3::new(-2.0, -2.5, 0.0), DVec3::new(2.0, 2.5, 2.6));
    for side in ALL_SIDES {
        let material = match side {
            Side::Bottom => floor,
            Side::Top => ceiling,
            _ => wall,
        };
        m.inside(material, low, high, side);
    }
    m.object("lamp".into());
    // Its picture is above the mirror: beside it all else would be dark.
    let (low, high) = (DVec3::new(-0.6, -2.0, 2.5), DVec3::new(0.6, -1.4, 2.55));
    m.cuboid(light, low, high, &[Side::Bottom]);
    m.cuboid(wood, low, high, &STANDING);
    m.object("mirror".into());
    let (left, right) = (DVec3::new(-1.3, 2.46, 0.5), DVec3::new(1.3, 2.5, 1.8));
    m.cuboid(wood, left, right, &[Side::Left, Side::Right, Side::Bottom, Side::Top]);
    m.cuboid(glass, left, right, &[Side::Front]);
    m.object("rack".into());
    let width = 2.4 / f64::from(bars);
    for bar in 0..bars {
        let x = -1.2 + width * (f64::from(bar) + 0.5);
        let thin = DVec3::new(0.006, 0.006, 0.0);
        m.cuboid(steel, DVec3::new(x, -2.2, 0.5) - thin, DVec3::new(x, -2.2, 1.9) + thin, &UPRIGHT);
    }
    for z in [0.46, 1.9] {
        m.cuboid(wood, DVec3::new(-1.3, -2.22, z), DVec3::new(1.3, -2.18, z + 0.04), &ALL_SIDES);
    }
    m.object("table".into());
    m.cuboid(wood, DVec3::new(-0.9, 1.0, 0.7), DVec3::new(0.1, 1.6, 0.74), &ALL_SIDES);
    for (x, y) in [(-0.85, 1.05), (0.0, 1.05), (-0.85, 1.5), (0.0, 1.5)] {
        m.cuboid(steel, DVec3::new(x, y, 0.0), DVec3::new(x + 0.05, y + 0.05, 0.7), &UPRIGHT);
    }
    let eye = DVec3::new(0.9, -1.6, 1.5);
    m.camera(eye, DVec3::new(-0.1, 2.5, 1.2) - eye, 46.0);
    m.scene()
}
