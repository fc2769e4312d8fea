//! Walls without thickness, and things that stand on each other: what is dark is exactly 0, and right beside it there
//! is light. Light leaks where an element, a triangle or a sample lies on both sides of a contact line.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::fixture::{box_faces, folder, probe, run, text, write_points, write_scene};

const MATERIALS: &str = "newmtl wall\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";

/// Corners of the room of most tests, metres; its long side runs along x.
const LOW: DVec3 = DVec3::ZERO;
const HIGH: DVec3 = DVec3::new(4.0, 3.0, 2.5);

type Quads = Vec<([DVec3; 4], &'static str)>;

/// A rectangle across x at `x`, y and z as given; its front looks along +x, or −x when `back`.
fn across(x: f64, y: [f64; 2], z: [f64; 2], back: bool) -> [DVec3; 4] {
    let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| DVec3::new(x, y[i], z[j]));
    if back {
        corners.reverse();
    }
    corners
}

/// A rectangle at the height `z` that looks up, or down when `back`.
fn level(z: f64, x: [f64; 2], y: [f64; 2], back: bool) -> [DVec3; 4] {
    let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| DVec3::new(x[i], y[j], z));
    if back {
        corners.reverse();
    }
    corners
}

/// Both sides of a rectangle.
fn both(side: impl Fn(bool) -> [DVec3; 4]) -> Quads {
    vec![(side(false), "wall"), (side(true), "wall")]
}

/// The closed room, and a lamp under its ceiling from x = 0.5 to x = 1.5.
fn lit_room() -> Quads {
    let mut quads: Quads =
        box_faces(LOW, HIGH, true, &[0, 1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")).collect();
    quads.push((level(2.4, [0.5, 1.5], [1.0, 2.0], true), "lamp"));
    quads
}

/// Points of a rectangle in the plane z that looks up: a grid that stays `margin` metres off its border, so that the
/// outermost ones lie as near to the contact as they can.
fn grid_up(z: f64, x: [f64; 2], y: [f64; 2], margin: f64) -> Vec<(DVec3, DVec3)> {
    const STEPS: u32 = 12;
    let at =
        |i: u32, [low, high]: [f64; 2]| low + margin + (high - low - 2.0 * margin) * f64::from(i) / f64::from(STEPS);
    (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (DVec3::new(at(i, x), at(j, y), z), DVec3::Z))).collect()
}

/// The same points upside down.
fn down(points: Vec<(DVec3, DVec3)>) -> Vec<(DVec3, DVec3)> {
    points.into_iter().map(|(point, normal)| (point, -normal)).collect()
}

/// A scene on disk with its bake.
struct Room {
    folder: tempfile::TempDir,
    bake: PathBuf,
}

impl Room {
    fn new(quads: &Quads) -> Self {
        let folder = folder();
        let scene = write_scene(folder.path(), MATERIALS, quads);
        let bake = folder.path().join("room.hlf");
        run(&["bake", text(&scene), "-o", text(&bake)]);
        Self { folder, bake }
    }

    fn bake(&self) -> &Path {
        &self.bake
    }

    /// Irradiance by interpolants and by gather.
    fn probe(&self, points: &[(DVec3, DVec3)]) -> [Vec<DVec3>; 2] {
        let table = write_points(self.folder.path(), points.iter().copied());
        ["interpolant", "gather"].map(|method| probe(self.bake(), &table, &["--method", method]))
    }

    #[track_caller]
    fn dark(&self, what: &str, points: &[(DVec3, DVec3)]) {
        for (method, found) in ["interpolant", "gather"].into_iter().zip(self.probe(points)) {
            for ((point, _), found) in points.iter().zip(found) {
                assert_eq!(found, DVec3::ZERO, "{what}, by {method} at {point}");
            }
        }
    }

    /// More than `least` W/m² everywhere, by both methods; a leak of darkness is one, too.
    #[track_caller]
    fn lit(&self, what: &str, least: f64, points: &[(DVec3, DVec3)]) {
        for (method, found) in ["interpolant", "gather"].into_iter().zip(self.probe(points)) {
            for ((point, _), found) in points.iter().zip(found) {
                assert!(found.min_element() > least, "{what}, by {method} at {point}: {found}");
            }
        }
    }
}

/// Points on both long walls, the ceiling and the floor between two x.
fn around(x: [f64; 2]) -> Vec<(DVec3, DVec3)> {
    let mut points = grid_up(0.0, x, [LOW.y, HIGH.y], 1e-3);
    points.extend(down(grid_up(HIGH.z, x, [LOW.y, HIGH.y], 1e-3)));
    points.extend(
        grid_up(0.0, x, [LOW.z, HIGH.z], 1e-3).into_iter().map(|(p, _)| (DVec3::new(p.x, LOW.y, p.y), DVec3::Y)),
    );
    points.extend(
        grid_up(0.0, x, [LOW.z, HIGH.z], 1e-3).into_iter().map(|(p, _)| (DVec3::new(p.x, HIGH.y, p.y), -DVec3::Y)),
    );
    points
}

/// Points of a rectangle across x whose front looks along the sign of `towards`.
fn on_partition(x: f64, y: [f64; 2], z: [f64; 2], towards: f64) -> Vec<(DVec3, DVec3)> {
    grid_up(0.0, y, z, 1e-3).into_iter().map(|(p, _)| (DVec3::new(x, p.x, p.y), DVec3::X * towards)).collect()
}

#[test]
fn a_partition_without_thickness_keeps_half_a_room_dark() {
    let mut quads = lit_room();
    let (y, z) = ([LOW.y, HIGH.y], [LOW.z, HIGH.z]);
    quads.extend(both(|back| across(2.3, y, z, back)));
    let room = Room::new(&quads);
    room.dark("behind the partition", &around([2.3, HIGH.x]));
    room.dark("the partition's dark side", &on_partition(2.3, y, z, 1.0));
    room.dark("the far wall", &on_partition(HIGH.x, y, z, -1.0));
    room.lit("before the partition", 0.1, &grid_up(0.0, [LOW.x, 2.3], y, 1e-3));
    room.lit("the partition's lit side", 0.1, &on_partition(2.3, y, z, -1.0));
}

/// A single polygon, whose black back is all that keeps the light in.
#[test]
fn a_one_sided_partition_keeps_half_a_room_dark() {
    let mut quads = lit_room();
    quads.push((across(2.3, [LOW.y, HIGH.y], [LOW.z, HIGH.z], true), "wall"));
    let room = Room::new(&quads);
    room.dark("behind the partition", &around([2.3, HIGH.x]));
    room.lit("before the partition", 0.1, &grid_up(0.0, [LOW.x, 2.3], [LOW.y, HIGH.y], 1e-3));
}

/// Turned out of the axes, so that no coordinate of the contact lines is a round number.
#[test]
fn a_slanted_partition_keeps_its_side_dark() {
    let mut quads = lit_room();
    let wall = |back: bool| {
        let mut corners =
            [(2.0, 0.0, 0.0), (2.7, 3.0, 0.0), (2.7, 3.0, 2.5), (2.0, 0.0, 2.5)].map(|(x, y, z)| DVec3::new(x, y, z));
        if back {
            corners.reverse();
        }
        corners
    };
    quads.extend(both(wall));
    let room = Room::new(&quads);
    let beside = |offset: f64| -> Vec<(DVec3, DVec3)> {
        (1..60)
            .map(|i| f64::from(i) / 60.0)
            .map(|t| (DVec3::new(2.0 + 0.7 * t + offset, 3.0 * t, 0.0), DVec3::Z))
            .collect()
    };
    for offset in [1e-3, 1e-2, 0.1, 0.6] {
        room.dark("behind the slanted partition", &beside(offset));
        room.lit("before it", 0.1, &beside(-offset));
    }
}

#[test]
fn two_rooms_that_share_a_wall() {
    let half = |x: [f64; 2], faces: &[usize]| -> Quads {
        let (low, high) = (DVec3::new(x[0], LOW.y, LOW.z), DVec3::new(x[1], HIGH.y, HIGH.z));
        box_faces(low, high, true, faces).into_iter().map(|corners| (corners, "wall")).collect()
    };
    // Floor, ceiling, front, back, left and right: each room has its own, the shared wall two sides of the same corners.
    let mut quads = half([0.0, 2.0], &[0, 1, 2, 3, 4, 5]);
    quads.extend(half([2.0, 4.0], &[0, 1, 2, 3, 4, 5]));
    quads.push((level(2.4, [0.5, 1.5], [1.0, 2.0], true), "lamp"));
    let room = Room::new(&quads);
    let (y, z) = ([LOW.y, HIGH.y], [LOW.z, HIGH.z]);
    room.dark("the other room", &around([2.0, 4.0]));
    room.dark("the shared wall's dark side", &on_partition(2.0, y, z, 1.0));
    room.lit("the room with the lamp", 0.1, &grid_up(0.0, [0.0, 2.0], y, 1e-3));
    room.lit("the shared wall's lit side", 0.1, &on_partition(2.0, y, z, -1.0));
}

/// The floor below a closed box is dark to its very edge; the floor outside is lit to the same edge.
#[test]
fn a_closed_box_on_the_floor() {
    let mut quads = lit_room();
    let (low, high) = (DVec3::new(1.7, 1.1, 0.0), DVec3::new(2.6, 1.9, 0.7));
    quads.extend(box_faces(low, high, false, &[1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")));
    let room = Room::new(&quads);
    room.dark("below the box", &grid_up(0.0, [low.x, high.x], [low.y, high.y], 1e-3));
    // The side towards the lamp, a step outside the contact: the light there is that of an open floor.
    let beside = |offset: f64| -> Vec<(DVec3, DVec3)> {
        (1..30).map(|i| (DVec3::new(low.x - offset, 1.1 + 0.8 * f64::from(i) / 30.0, 0.0), DVec3::Z)).collect()
    };
    let [interpolated, gathered] = room.probe(&beside(1e-3));
    for (interpolated, gathered) in interpolated.into_iter().zip(gathered) {
        assert!(gathered.min_element() > 0.3, "{gathered}");
        let error = (interpolated - gathered).abs().max_element() / gathered.x;
        assert!(error < 0.05, "the contact is smeared: {interpolated} for {gathered}");
    }
}

/// A box with a bottom of its own that lies in the floor's plane.
#[test]
fn a_box_with_a_bottom_on_the_floor() {
    let mut quads = lit_room();
    let (low, high) = (DVec3::new(1.7, 1.1, 0.0), DVec3::new(2.6, 1.9, 0.7));
    quads.extend(box_faces(low, high, false, &[0, 1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")));
    let room = Room::new(&quads);
    room.dark("below the box", &grid_up(0.0, [low.x, high.x], [low.y, high.y], 1e-3));
    room.dark("the box's bottom", &down(grid_up(0.0, [low.x, high.x], [low.y, high.y], 1e-3)));
    room.lit("the box's top", 0.3, &grid_up(0.7, [low.x, high.x], [low.y, high.y], 1e-3));
}

/// A table top that a wall cuts through: each half sees its own room only.
#[test]
fn a_wall_through_a_table() {
    let mut quads = lit_room();
    let (y, z) = ([LOW.y, HIGH.y], [LOW.z, HIGH.z]);
    quads.extend(both(|back| across(2.3, y, z, back)));
    let (x, table_y) = ([1.8, 3.0], [0.9, 2.1]);
    quads.extend(both(|back| level(0.75, x, table_y, back)));
    let room = Room::new(&quads);
    room.dark("the table's dark part", &grid_up(0.75, [2.3, 3.0], table_y, 1e-3));
    room.dark("its underside", &down(grid_up(0.75, [2.3, 3.0], table_y, 1e-3)));
    room.dark("the dark room", &around([2.3, HIGH.x]));
    room.dark("the wall's dark side", &on_partition(2.3, y, z, 1.0));
    room.lit("the table's lit part", 0.3, &grid_up(0.75, [1.8, 2.3], table_y, 1e-3));
    room.lit("its underside", 0.01, &down(grid_up(0.75, [1.8, 2.3], table_y, 1e-3)));
}

/// A closet in a corner of the room: its walls end in the middle of the floor, of the ceiling and of two walls.
#[test]
fn partitions_that_end_in_the_middle_of_a_floor() {
    let mut quads = lit_room();
    let z = [LOW.z, HIGH.z];
    quads.extend(both(|back| across(2.5, [1.4, HIGH.y], z, back)));
    let front = |back: bool| {
        let mut corners = [(2.5, 0.0), (4.0, 0.0), (4.0, 2.5), (2.5, 2.5)].map(|(x, z)| DVec3::new(x, 1.4, z));
        if back {
            corners.reverse();
        }
        corners
    };
    quads.extend(both(front));
    let room = Room::new(&quads);
    let closet = ([2.5, HIGH.x], [1.4, HIGH.y]);
    room.dark("the closet's floor", &grid_up(0.0, closet.0, closet.1, 1e-3));
    room.dark("its ceiling", &down(grid_up(HIGH.z, closet.0, closet.1, 1e-3)));
    room.dark("its wall", &on_partition(2.5, [1.4, HIGH.y], z, 1.0));
    room.dark("the room's wall in it", &on_partition(HIGH.x, [1.4, HIGH.y], z, -1.0));
    room.lit("the floor beside it", 0.05, &grid_up(0.0, [LOW.x, 2.5], [1.4, HIGH.y], 1e-3));
    room.lit("the floor before it", 0.02, &grid_up(0.0, [2.5, HIGH.x], [LOW.y, 1.4], 1e-3));
}

/// A partition that ends in free air: light goes round it, the floor is lit on both sides, and jumps across its foot.
#[test]
fn a_partition_that_lets_light_round_its_end() {
    let mut quads = lit_room();
    quads.extend(both(|back| across(2.0, [0.0, 1.6], [LOW.z, HIGH.z], back)));
    let room = Room::new(&quads);
    let foot = |x: f64| -> Vec<(DVec3, DVec3)> {
        (1..30).map(|i| (DVec3::new(x, 1.55 * f64::from(i) / 30.0, 0.0), DVec3::Z)).collect()
    };
    let ([lit, lit_gathered], [shaded, shaded_gathered]) = (room.probe(&foot(1.999)), room.probe(&foot(2.001)));
    for (i, ((lit, lit_gathered), (shaded, shaded_gathered))) in
        lit.into_iter().zip(lit_gathered).zip(shaded.into_iter().zip(shaded_gathered)).enumerate()
    {
        assert!(
            lit_gathered.x > 1.5 * shaded_gathered.x && shaded_gathered.x > 1e-3,
            "{i}: {lit_gathered} {shaded_gathered}"
        );
        assert!((lit - lit_gathered).abs().max_element() < 0.05 * lit_gathered.x, "{i}: {lit} for {lit_gathered}");
        // Relative to the larger side: a smeared jump would be half of it off.
        let error = (shaded - shaded_gathered).abs().max_element() / lit_gathered.x;
        assert!(error < 0.05, "{i}: {shaded} for {shaded_gathered} beside {lit_gathered}");
    }
}

/// A box half over the edge of a table: the table below it is dark, the part of its bottom that hangs over is not.
#[test]
fn a_box_on_the_edge_of_a_table() {
    let mut quads = lit_room();
    // A top with thickness: without one its underside and the box's bottom would be one place with one normal.
    let slab = box_faces(DVec3::new(1.6, 0.8, 0.65), DVec3::new(2.6, 2.2, 0.7), false, &[0, 1, 2, 3, 4, 5]);
    quads.extend(slab.into_iter().map(|corners| (corners, "wall")));
    let (low, high) = (DVec3::new(2.2, 1.2, 0.7), DVec3::new(3.0, 1.7, 1.0));
    quads.extend(box_faces(low, high, false, &[0, 1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")));
    let room = Room::new(&quads);
    let box_y = [low.y, high.y];
    room.dark("the table below the box", &grid_up(0.7, [2.2, 2.6], box_y, 1e-3));
    room.dark("the bottom on the table", &down(grid_up(0.7, [2.2, 2.6], box_y, 1e-3)));
    room.lit("the bottom beyond the edge", 0.01, &down(grid_up(0.7, [2.6, 3.0], box_y, 1e-3)));
    room.lit("the table beside the box", 0.1, &grid_up(0.7, [1.6, 2.2], box_y, 1e-3));
    room.lit("the floor below", 0.01, &grid_up(0.0, [1.7, 2.9], box_y, 1e-3));
}
