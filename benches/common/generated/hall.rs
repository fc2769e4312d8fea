//! A hall of boxes: density, sizes, lamps and colours stay, the hall grows.

use glam::DVec3;
use scene::Scene;

use super::modeller::{ALL_SIDES, Dice, Modeller, STANDING, Side};

/// Floor that one lamp lights, metres, and the height of the hall.
const BAY: [f64; 2] = [10.0, 6.25];
const HEIGHT: f64 = 8.0;

/// Boxes along and across a bay: one on 2.6 m² of floor.
const BOXES: [u32; 2] = [6, 4];

/// Polygons of a bay: five sides of each box, six of the lamp.
const POLYGONS_OF_BAY: u32 = 5 * BOXES[0] * BOXES[1] + 6;

/// Shortest and longest side of a box, metres; the longest diagonal still fits its part of the floor.
const SIDES: (f64, f64) = (0.3, 1.0);
const HEIGHTS: (f64, f64) = (0.25, 0.95);

/// Reflectances of boxes.
const COLOURS: [[f64; 3]; 8] = [
    [0.394, 0.291, 0.591],
    [0.243, 0.522, 0.419],
    [0.235, 0.504, 0.222],
    [0.46, 0.242, 0.254],
    [0.455, 0.696, 0.274],
    [0.334, 0.576, 0.769],
    [0.546, 0.438, 0.786],
    [0.228, 0.715, 0.374],
];

/// A hall of about `polygons` polygons, at least one bay of 132: quads all, so twice as many triangles.
///
/// A lamp of 1.6 × 1 m hangs over each 62.5 m² of floor, 24 boxes of 0.3 to 1 m stand below it.
pub fn hall(polygons: u32) -> Scene {
    let bays = (f64::from(polygons.saturating_sub(6)) / f64::from(POLYGONS_OF_BAY)).max(1.0);
    let [columns, rows] = [bays.sqrt().floor(), bays.sqrt().ceil()]
        .map(|columns| [columns, (bays / columns).round()])
        .into_iter()
        .min_by(|a, b| (a[0] * a[1] - bays).abs().total_cmp(&(b[0] * b[1] - bays).abs()))
        .unwrap_or([1.0; 2])
        .map(|count| count as u32);

    let mut hall = Modeller::default();
    let floor = hall.material("floor", [0.45, 0.42, 0.4], [0.0; 3]);
    let wall = hall.material("wall", [0.65, 0.65, 0.62], [0.0; 3]);
    let ceiling = hall.material("ceiling", [0.75; 3], [0.0; 3]);
    let light = hall.material("light", [0.0; 3], [40.0, 38.0, 34.0]);
    let case = hall.material("case", [0.4; 3], [0.0; 3]);
    let mut colours = Vec::new();
    for (i, &colour) in COLOURS.iter().enumerate() {
        colours.push(hall.material(&format!("box{i}"), colour, [0.0; 3]));
    }

    hall.object("hall".to_owned());
    let far = DVec3::new(BAY[0] * f64::from(columns), BAY[1] * f64::from(rows), HEIGHT);
    inside_out(&mut hall, far, [wall, floor, ceiling]);
    hall.object("lamps".to_owned());
    for_each_place([columns, rows], |column, row| {
        let middle = DVec3::new((column + 0.5) * BAY[0], (row + 0.5) * BAY[1], 7.75);
        let (low, high) = (middle - DVec3::new(0.8, 0.5, 0.0), middle + DVec3::new(0.8, 0.5, 0.05));
        hall.lamp(case, light, low, high);
    });
    let mut dice = Dice(1);
    let (width, depth) = (BAY[0] / f64::from(BOXES[0]), BAY[1] / f64::from(BOXES[1]));
    for_each_place([columns * BOXES[0], rows * BOXES[1]], |column, row| {
        hall.object(format!("box{column}_{row}"));
        let (a, b) = (dice.between(SIDES.0, SIDES.1) / 2.0, dice.between(SIDES.0, SIDES.1) / 2.0);
        let (sin, cos) = dice.between(0.0, std::f64::consts::FRAC_PI_2).sin_cos();
        // Half of what the turned box takes of its place along either axis.
        let (x, y) = (a * cos + b * sin, a * sin + b * cos);
        let middle = (
            column * width + dice.between(x + 0.02, width - x - 0.02),
            row * depth + dice.between(y + 0.02, depth - y - 0.02),
        );
        let base = [(-a, -b), (a, -b), (a, b), (-a, b)]
            .map(|(u, v)| (middle.0 + u * cos - v * sin, middle.1 + u * sin + v * cos));
        let top = dice.between(HEIGHTS.0, HEIGHTS.1);
        hall.prism(dice.pick(&colours), base, (0.0, top), &STANDING);
    });
    hall.camera(DVec3::new(0.5, 0.5, 4.0), DVec3::new(1.0, 0.6, -0.4), 70.0);
    hall.scene()
}

/// A box from the origin, seen from the inside: walls, floor and ceiling.
fn inside_out(hall: &mut Modeller, far: DVec3, [wall, floor, ceiling]: [u32; 3]) {
    for side in ALL_SIDES {
        let material = match side {
            Side::Bottom => floor,
            Side::Top => ceiling,
            _ => wall,
        };
        hall.inside(material, DVec3::ZERO, far, side);
    }
}

fn for_each_place([columns, rows]: [u32; 2], mut visit: impl FnMut(f64, f64)) {
    for row in 0..rows {
        for column in 0..columns {
            visit(f64::from(column), f64::from(row));
        }
    }
}
