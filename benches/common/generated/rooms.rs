//! A row of furnished rooms that light reaches through doorways.

use glam::DVec3;
use scene::Scene;

use super::modeller::{ALL_SIDES, Dice, Modeller, STANDING, Side, UPRIGHT};

/// A room, metres: along the row, across it, and its height.
const ROOM: DVec3 = DVec3::new(5.0, 4.0, 2.8);

/// Thickness of the wall between two rooms, metres.
const WALL: f64 = 0.2;

/// Width and height of a doorway, metres.
const DOOR: [f64; 2] = [0.9, 2.1];

/// Where the doorways stand across the row, by turns, so that one does not see through all of them.
const DOORS: [f64; 2] = [0.6, 2.3];

/// Every third room's lamps, from the second on, are this part of the others'.
const DIM: f64 = 0.01;

/// Thickness of boards and table tops, metres.
const BOARD: f64 = 0.03;

struct Materials {
    floor: u32,
    walls: [u32; 2],
    ceiling: u32,
    case: u32,
    wood: u32,
    seat: u32,
    goods: [u32; 3],
    bright: u32,
    dim: u32,
}

/// A row of rooms, at least one, each of about 840 polygons: a table, four chairs, three shelves of boxes, two lamps.
///
/// Each has a doorway to the next. The lamps of every third room are a hundredth of the others', so that most of its
/// light is a neighbour's.
pub fn rooms(count: u32) -> Scene {
    let count = count.max(1);
    let mut row = Modeller::default();
    let dark = [0.0; 3];
    let lamp = [30.0, 28.0, 24.0];
    let materials = Materials {
        floor: row.material("floor", [0.4, 0.33, 0.26], dark),
        walls: [row.material("white", [0.75, 0.74, 0.7], dark), row.material("ochre", [0.68, 0.52, 0.3], dark)],
        ceiling: row.material("ceiling", [0.8; 3], dark),
        case: row.material("case", [0.4; 3], dark),
        wood: row.material("wood", [0.5, 0.36, 0.22], dark),
        seat: row.material("seat", [0.25, 0.3, 0.45], dark),
        goods: [
            row.material("red", [0.55, 0.2, 0.15], dark),
            row.material("green", [0.25, 0.45, 0.25], dark),
            row.material("paper", [0.7, 0.68, 0.6], dark),
        ],
        bright: row.material("lamp", dark, lamp),
        dim: row.material("dim_lamp", dark, lamp.map(|radiance| radiance * DIM)),
    };
    let mut dice = Dice(2);
    for room in 0..count {
        let origin = DVec3::X * f64::from(room) * (ROOM.x + WALL);
        let door = |wall: u32| DOORS[wall as usize % 2];
        let (before, after) = ((room > 0).then(|| door(room - 1)), (room + 1 < count).then(|| door(room)));
        row.object(format!("room{room}"));
        shell(&mut row, &materials, room, origin, [before, after]);
        if let Some(door) = after {
            passage(&mut row, &materials, origin + DVec3::X * ROOM.x, door);
        }
        furnish(&mut row, &materials, room, origin, &mut dice);
        let light = if room % 3 == 1 { materials.dim } else { materials.bright };
        for x in [1.4, 3.6] {
            row.object(format!("lamp{room}_{x}"));
            let low = origin + DVec3::new(x - 0.3, 1.7, 2.7);
            row.lamp(materials.case, light, low, low + DVec3::new(0.6, 0.6, 0.04));
        }
        row.camera(origin + DVec3::new(0.4, 0.4, 1.7), DVec3::new(1.0, 0.75, -0.2), 75.0);
    }
    row.scene()
}

/// Floor, ceiling and walls of a room with doorways in the walls at its ends. Corners stand wherever a neighbour has one.
fn shell(row: &mut Modeller, materials: &Materials, room: u32, origin: DVec3, doors: [Option<f64>; 2]) {
    let at = |x: f64, y: f64, z: f64| origin + DVec3::new(x, y, z);
    let wall = materials.walls[room as usize % 2];
    // Counter-clockwise seen from above; beyond the four corners, those of the doorways' sides.
    let level = |z: f64| {
        let mut outline = vec![at(0.0, 0.0, z), at(ROOM.x, 0.0, z)];
        outline.extend(doors[1].into_iter().flat_map(|y| [at(ROOM.x, y, z), at(ROOM.x, y + DOOR[0], z)]));
        outline.extend([at(ROOM.x, ROOM.y, z), at(0.0, ROOM.y, z)]);
        outline.extend(doors[0].into_iter().flat_map(|y| [at(0.0, y + DOOR[0], z), at(0.0, y, z)]));
        outline
    };
    row.face(materials.floor, &level(0.0));
    let mut ceiling = level(ROOM.z);
    ceiling.reverse();
    row.face(materials.ceiling, &ceiling);
    row.inside(wall, origin, origin + ROOM, Side::Front);
    row.inside(wall, origin, origin + ROOM, Side::Back);
    for (x, door) in [(0.0, doors[0]), (ROOM.x, doors[1])] {
        let mut face = |mut places: Vec<(f64, f64)>| {
            // Seen from the room, its first end has y to the right, the other one y to the left.
            if x > 0.0 {
                places.reverse();
            }
            row.face(wall, &places.into_iter().map(|(y, z)| at(x, y, z)).collect::<Vec<_>>());
        };
        let Some(door) = door else {
            face(vec![(0.0, 0.0), (ROOM.y, 0.0), (ROOM.y, ROOM.z), (0.0, ROOM.z)]);
            continue;
        };
        let (left, right, top) = (door, door + DOOR[0], DOOR[1]);
        // Beside the doorway from floor to ceiling, with a corner where the lintel ends, and over it.
        face(vec![(0.0, 0.0), (left, 0.0), (left, top), (left, ROOM.z), (0.0, ROOM.z)]);
        face(vec![(right, 0.0), (ROOM.y, 0.0), (ROOM.y, ROOM.z), (right, ROOM.z), (right, top)]);
        face(vec![(left, top), (right, top), (right, ROOM.z), (left, ROOM.z)]);
    }
}

/// The inside of a doorway: its floor, jambs and lintel.
fn passage(row: &mut Modeller, materials: &Materials, origin: DVec3, door: f64) {
    let low = origin + DVec3::Y * door;
    let high = low + DVec3::new(WALL, DOOR[0], DOOR[1]);
    row.inside(materials.floor, low, high, Side::Bottom);
    for side in [Side::Front, Side::Back, Side::Top] {
        row.inside(materials.walls[0], low, high, side);
    }
}

fn furnish(row: &mut Modeller, materials: &Materials, room: u32, origin: DVec3, dice: &mut Dice) {
    let table = origin + DVec3::new(dice.between(2.0, 2.5), dice.between(1.6, 2.0), 0.0);
    row.object(format!("table{room}"));
    let (low, high) = (table - DVec3::new(0.7, 0.4, 0.0), table + DVec3::new(0.7, 0.4, 0.74));
    slab_on_legs(row, [materials.wood, materials.wood], low, high, 0.06);
    for (chair, (x, y, back)) in
        [(-0.35, -0.8, -1.0), (0.35, -0.8, -1.0), (-0.35, 0.8, 1.0), (0.35, 0.8, 1.0)].into_iter().enumerate()
    {
        row.object(format!("chair{room}_{chair}"));
        let middle = table + DVec3::new(x + dice.between(-0.05, 0.05), y + dice.between(-0.05, 0.05), 0.0);
        let (low, high) = (middle - DVec3::new(0.21, 0.21, 0.0), middle + DVec3::new(0.21, 0.21, 0.45));
        slab_on_legs(row, [materials.seat, materials.wood], low, high, 0.04);
        let behind = middle + DVec3::new(0.0, back * 0.18, 0.45);
        row.cuboid(
            materials.seat,
            behind - DVec3::new(0.19, 0.015, 0.0),
            behind + DVec3::new(0.19, 0.015, 0.4),
            &STANDING,
        );
    }
    for shelf in 0..3 {
        row.object(format!("shelf{room}_{shelf}"));
        // Along the far wall; doorways are in the other ones.
        let low = origin + DVec3::new(0.5 + 1.4 * f64::from(shelf), ROOM.y - 0.35, 0.0);
        shelf_of_boxes(row, materials, low, dice);
    }
}

/// A board on four legs, whose tops it hides.
fn slab_on_legs(row: &mut Modeller, [slab, legs]: [u32; 2], low: DVec3, high: DVec3, leg: f64) {
    let under = high.z - BOARD;
    row.cuboid(slab, DVec3::new(low.x, low.y, under), high, &ALL_SIDES);
    // A leg is set back from the border, so that no face continues another.
    let inset = 0.02;
    for x in [low.x + inset, high.x - inset - leg] {
        for y in [low.y + inset, high.y - inset - leg] {
            let foot = DVec3::new(x, y, low.z);
            row.cuboid(legs, foot, DVec3::new(x + leg, y + leg, under), &UPRIGHT);
        }
    }
}

/// Two sides, a back and five boards, the lowest four carrying eight boxes each and the top one as well.
fn shelf_of_boxes(row: &mut Modeller, materials: &Materials, low: DVec3, dice: &mut Dice) {
    let (width, depth, height) = (1.2, 0.3, 1.9);
    let high = low + DVec3::new(width, depth, height);
    for x in [low.x, high.x - BOARD] {
        row.cuboid(materials.wood, DVec3::new(x, low.y, low.z), DVec3::new(x + BOARD, high.y, high.z), &STANDING);
    }
    let (left, right) = (low.x + BOARD, high.x - BOARD);
    // The back reaches from side to side and is a centimetre thinner and lower than they are.
    let (back, behind) = (high.y - 0.03, high.y - 0.01);
    let panel = [Side::Front, Side::Back, Side::Top];
    row.cuboid(materials.wood, DVec3::new(left, back, low.z), DVec3::new(right, behind, high.z - 0.01), &panel);
    let space = 0.36;
    for board in 0..5 {
        let z = low.z + 0.08 + space * f64::from(board);
        let (from, to) = (DVec3::new(left, low.y + 0.01, z), DVec3::new(right, back, z + BOARD));
        row.cuboid(materials.wood, from, to, &[Side::Front, Side::Bottom, Side::Top]);
        let places = 8;
        let step = (right - left) / f64::from(places);
        for place in 0..places {
            let size = DVec3::new(dice.between(0.06, step - 0.01), dice.between(0.1, 0.22), dice.between(0.1, 0.26));
            let x = left + f64::from(place) * step + dice.between(0.005, step - size.x - 0.004);
            let foot = DVec3::new(x, low.y + 0.02 + dice.between(0.0, 0.02), to.z);
            row.cuboid(dice.pick(&materials.goods), foot, foot + size, &STANDING);
        }
    }
}
