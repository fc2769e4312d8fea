//! CIE 171:2006, *Test cases to assess the accuracy of lighting computer programs*: those that a diffuse program with
//! polygon lights can run.
//!
//! Room 4 × 4 × 3 m, black unless stated. Points A–F go down the middle of the wall y = 0, from z = 2.75 to 0.25 m; G–N along the
//! middle of the floor, from y = 0.25 to 3.75 m. Published values are as publicly quoted from the standard; the
//! standard's own measure is 5 % a point, ours the closed form. Cases 5.2 (a point light), 5.5 and 5.9 to 5.14 (glass and sky)
//! need what Halflight has not.

use std::f64::consts::PI;

use glam::DVec3;
use mesher::BakeOptions;
use scene::{Rgb, Scene};
use solver::SolveOptions;

use super::closed_form::{element_to_parallel_rectangle, element_to_perpendicular_rectangle};
use super::room::{CEILING, FLOOR, HIGH_Y, LOW_Y, Lit, Room, cuboid, facing_down, interpolated, reversed};
use super::{Case, EXACT, Group};

/// 5.3, a Lambertian square of 1 × 1 m in the middle of the ceiling, 1000 cd along its normal: E = π · 1000 · F, for its
/// area is 1 m². [`element_to_perpendicular_rectangle`] on the wall, [`element_to_parallel_rectangle`] on the floor.
const CEILING_SQUARE: Group = Group { name: "5.3 Lambertian square, lux", source: "CIE 171:2006, 5.3", bound: EXACT };

/// The same through a bake with default options: what quadratics leave out. Bound: one per cent, the project's
/// figure for a bake.
const CEILING_SQUARE_BAKED: Group =
    Group { name: "5.3 Lambertian square, lux, baked", source: "CIE 171:2006, 5.3", bound: 1e-2 };

/// 5.4, conservation of flux: 10,000 lm in a closed black room arrive on its surfaces. Adapted: the light is a square in the
/// ceiling instead of an isotropic point.
const CONSERVATION: Group =
    Group { name: "5.4 conservation of flux, lm", source: "CIE 171:2006, 5.4, adapted", bound: EXACT };

/// 5.6, a diffuse reflector: the floor is lit uniformly and reflects ρ; E/(ρ E_floor) = F from the point to the floor.
/// Adapted: walls and ceiling emit the exitance M and are black otherwise, so that every point of the floor sees M in every
/// direction and receives exactly M. Red is reflected by nothing; blue less red is what the floor reflects.
const REFLECTOR: Group = Group { name: "5.6 diffuse reflector, %", source: "CIE 171:2006, 5.6, adapted", bound: EXACT };

/// 5.7, an external mask: a black box of 4 × 0.2 m and 1 m height stands across the floor at y = 2.5; the wall y = 4 emits
/// uniformly: F of its visible part, above the higher of the two shadows that the edges of the box's top cast on it. The
/// standard's table 19 is wrong; its published corrections stand here.
const OBSTRUCTION: Group = Group { name: "5.7 obstruction, %", source: "CIE 171:2006, 5.7, corrected", bound: EXACT };

/// 5.8, interreflection: 10,000 lm in a closed cube of 4 m whose surfaces all reflect ρ; mean indirect E = ρΦ/(S(1−ρ)), S = 96 m².
/// Adapted: the light is a square in the ceiling that reflects ρ as well, for the mean does not depend on where the light
/// starts; the standard's single points do. Bound: a link carries the mean of its source, so where some links start from
/// a source's parts and others from its whole, a little light is lost or gained.
const INTERREFLECTION: Group =
    Group { name: "5.8 mean indirect, lux", source: "CIE 171:2006, 5.8, adapted", bound: 1e-2 };

/// The mean of all light of 5.8, E = Φ/(S(1−ρ)), over the interpolants of a bake with default options. Bound: as for 5.3.
const INTERREFLECTION_BAKED: Group =
    Group { name: "5.8 mean of all light, lux, baked", source: "CIE 171:2006, 5.8, adapted", bound: 1e-2 };

/// The room's far corner, metres; the near one is the origin.
const ROOM: DVec3 = DVec3::new(4.0, 4.0, 3.0);

/// Bounds of the room's walls across and along.
const WIDTH: [f64; 2] = [0.0, 4.0];

/// Bounds of the square in the middle of a ceiling of 4 × 4 m.
const SQUARE: [f64; 2] = [1.5, 2.5];

/// Flux of the light of 5.4 and 5.8, lm.
const FLUX: f64 = 10_000.0;

/// A point of measurement: its letter, position and normal.
type Point = (char, DVec3, DVec3);

/// A–F, down the wall y = 0.
fn wall_points() -> [Point; 6] {
    std::array::from_fn(|i| {
        let place = DVec3::new(2.0, 0.0, 2.75 - 0.5 * i as f64);
        (char::from(b'A' + i as u8), place, DVec3::Y)
    })
}

/// G–N, along the floor from the wall with A–F.
fn floor_points() -> [Point; 8] {
    std::array::from_fn(|i| {
        let place = DVec3::new(2.0, 0.25 + 0.5 * i as f64, 0.0);
        (char::from(b'G' + i as u8), place, DVec3::Z)
    })
}

/// Bounds seen from a coordinate.
fn about(bounds: [f64; 2], centre: f64) -> [f64; 2] {
    bounds.map(|bound| bound - centre)
}

/// All groups of this file.
pub fn cases() -> Vec<Case> {
    [ceiling_square(), conservation(), reflector(), obstruction(), interreflection()].concat()
}

/// A black room whose ceiling has the square of an exitance, lm·m⁻², in its middle.
fn room_with_square(far: DVec3, reflectance: Rgb, exitance: f64) -> Scene {
    Room::default()
        .material(reflectance, Rgb::ZERO)
        .polygons(&cuboid(DVec3::ZERO, far)[..CEILING])
        .ceiling_around([0.0, far.x], [0.0, far.y], far.z, SQUARE, SQUARE)
        .material(reflectance, Rgb::splat(exitance))
        .polygon(&facing_down(SQUARE, SQUARE, far.z))
        .scene()
}

fn ceiling_square() -> Vec<Case> {
    let exitance = 1000.0 * PI;
    let lit = Lit::solve(room_with_square(ROOM, Rgb::ZERO, exitance));
    let points: Vec<Point> = wall_points().into_iter().chain(floor_points()).collect();
    let published = [
        [32.68, 75.09, 81.38, 69.12, 53.41, 39.90].as_slice(),
        &[61.27, 79.18, 95.52, 105.89, 105.89, 95.52, 79.18, 61.27],
    ]
    .concat();
    let exact = |place: DVec3, normal: DVec3| {
        let (x, y) = (about(SQUARE, place.x), about(SQUARE, place.y));
        exitance
            * if normal == DVec3::Z {
                element_to_parallel_rectangle(x, y, ROOM.z)
            } else {
                element_to_perpendicular_rectangle(x, y, ROOM.z - place.z)
            }
    };
    let at = || points.iter().map(|&(_, place, normal)| (place, normal));
    let cases = |group: Group, found: Vec<Rgb>| -> Vec<Case> {
        let rows = points.iter().zip(&published).zip(found);
        rows.map(|((&(name, place, normal), &published), found)| {
            group.case(name, published, exact(place, normal), found.x)
        })
        .collect()
    };
    [cases(CEILING_SQUARE, lit.gather(at())), cases(CEILING_SQUARE_BAKED, interpolated(lit.bake(), at()))].concat()
}

fn conservation() -> Vec<Case> {
    let lit = Lit::solve(room_with_square(ROOM, Rgb::ZERO, FLUX));
    vec![CONSERVATION.case("over all surfaces", FLUX, FLUX, lit.solution.mean_irradiance.x * lit.scene.surface_area())]
}

fn reflector() -> Vec<Case> {
    let (exitance, reflectance) = (100.0, 0.8);
    let sides = cuboid(DVec3::ZERO, ROOM);
    let scene = Room::default()
        .material(Rgb::new(0.0, 0.5, reflectance), Rgb::ZERO)
        .polygon(&sides[FLOOR])
        .material(Rgb::ZERO, Rgb::splat(exitance))
        .polygons(sides.iter().enumerate().filter(|&(side, _)| side != FLOOR).map(|(_, outline)| outline))
        .scene();
    let lit = Lit::solve(scene);
    let walls = wall_points().into_iter().zip([12.967, 16.716, 21.639, 27.992, 35.901]);
    let wall = walls.map(|((name, place, normal), published)| {
        let exact = element_to_perpendicular_rectangle(about(WIDTH, place.x), WIDTH, place.z);
        (format!("wall, {name}"), place, normal, published, exact)
    });
    let ceilings = floor_points().into_iter().zip([26.80, 30.94, 33.98, 35.57]);
    let ceiling = ceilings.map(|((name, place, _), published)| {
        let exact = element_to_parallel_rectangle(about(WIDTH, place.x), about(WIDTH, place.y), ROOM.z);
        (format!("ceiling over {name}"), place.with_z(ROOM.z), -DVec3::Z, published, exact)
    });
    let rows: Vec<_> = wall.chain(ceiling).collect();
    let found = lit.gather(rows.iter().map(|&(_, place, normal, ..)| (place, normal)));
    let case = |((name, _, _, published, exact), found): ((String, DVec3, DVec3, f64, f64), Rgb)| {
        REFLECTOR.case(name, published, 100.0 * exact, 100.0 * (found.z - found.x) / (reflectance * exitance))
    };
    rows.into_iter().zip(found).map(case).collect()
}

/// The box of 5.7 across the room: where it begins and ends along y, and how high it is, metres.
const BOX: ([f64; 2], f64) = ([2.5, 2.7], 1.0);

/// Height at which the wall y = 4 comes into view over the box, from a height `z` at a distance `y` from the wall y = 0.
fn horizon(y: f64, z: f64) -> f64 {
    let (edges, height) = BOX;
    let shadow = |edge: f64| z + (height - z) * (ROOM.y - y) / (edge - y);
    shadow(edges[0]).max(shadow(edges[1])).clamp(0.0, ROOM.z)
}

fn obstruction() -> Vec<Case> {
    let exitance = 100.0;
    let (edges, height) = BOX;
    let sides = cuboid(DVec3::ZERO, ROOM);
    // Its ends lie in the walls and its bottom on the floor: they are left out.
    let block = cuboid(DVec3::new(0.0, edges[0], 0.0), DVec3::new(ROOM.x, edges[1], height)).map(reversed);
    let scene = Room::default()
        .material(Rgb::ZERO, Rgb::ZERO)
        .polygons(sides.iter().enumerate().filter(|&(side, _)| side != HIGH_Y).map(|(_, outline)| outline))
        .polygons([&block[LOW_Y], &block[HIGH_Y], &block[CEILING]])
        .material(Rgb::ZERO, Rgb::splat(exitance))
        .polygon(&sides[HIGH_Y])
        .scene();
    let lit = Lit::solve(scene);
    let points: Vec<Point> = wall_points().into_iter().chain(floor_points().into_iter().take(5)).collect();
    let published = [16.07, 16.33, 15.40, 13.33, 10.31, 7.08, 3.38, 3.63, 3.01, 0.0, 0.0];
    let found = lit.gather(points.iter().map(|&(_, place, normal)| (place, normal)));
    let rows = points.into_iter().zip(published).zip(found);
    rows.map(|(((name, place, normal), published), found)| {
        let visible = about([horizon(place.y, place.z), ROOM.z], place.z);
        let (x, distance) = (about(WIDTH, place.x), ROOM.y - place.y);
        let exact = if normal == DVec3::Z {
            element_to_perpendicular_rectangle(x, visible, distance)
        } else {
            element_to_parallel_rectangle(x, visible, distance)
        };
        OBSTRUCTION.case(name, published, 100.0 * exact, 100.0 * found.x / exitance)
    })
    .collect()
}

fn interreflection() -> Vec<Case> {
    let far = DVec3::splat(4.0);
    let published = [
        (0.05, 5.48),
        (0.1, 11.6),
        (0.2, 26.0),
        (0.3, 44.6),
        (0.4, 69.4),
        (0.5, 104.0),
        (0.6, 156.0),
        (0.7, 243.0),
        (0.8, 417.0),
        (0.9, 937.0),
        (0.95, 1979.0),
    ];
    let (mut solved, mut baked) = (Vec::new(), Vec::new());
    // Colours do not mix: each run takes three reflectances.
    for chunk in published.chunks(3) {
        let reflectance = Rgb::from_array(std::array::from_fn(|i| chunk.get(i).map_or(0.0, |row| row.0)));
        let scene = room_with_square(far, reflectance, FLUX);
        let surface = scene.surface_area();
        let direct_only = SolveOptions { bounces: Some(0), ..SolveOptions::default() };
        let direct = Lit::solve_with(scene.clone(), &direct_only, BakeOptions::default().tolerance);
        let all = Lit::solve(scene);
        let indirect = all.solution.mean_irradiance - direct.solution.mean_irradiance;
        let interpolated = all.bake().mean_irradiance();
        for (i, &(reflectance, published)) in chunk.iter().enumerate() {
            let (name, exact) = (format!("ρ = {reflectance}"), FLUX / (surface * (1.0 - reflectance)));
            solved.push(INTERREFLECTION.case(&name, published, reflectance * exact, indirect[i]));
            baked.push(INTERREFLECTION_BAKED.case(&name, None, exact, interpolated[i]));
        }
    }
    [solved, baked].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_hides_what_it_must() {
        // From the height of its top it hides what is below; from behind its edge on the floor, all.
        assert!((horizon(0.0, 1.0) - 1.0).abs() < 1e-15);
        assert_eq!(horizon(2.25, 0.0), ROOM.z);
        // From above the far edge decides, from below the near one.
        assert!((horizon(0.0, 2.0) - (2.0 - 4.0 / 2.7)).abs() < 1e-15);
        assert!((horizon(0.0, 0.5) - (0.5 + 0.5 * 4.0 / 2.5)).abs() < 1e-15);
    }

    #[test]
    fn points_are_the_standards() {
        assert_eq!(wall_points().map(|point| point.0), ['A', 'B', 'C', 'D', 'E', 'F']);
        assert_eq!(floor_points()[7], ('N', DVec3::new(2.0, 3.75, 0.0), DVec3::Z));
        assert_eq!(wall_points()[5].1, DVec3::new(2.0, 0.0, 0.25));
    }
}
