//! A polygon light with a polygon blocker: irradiance at points where a part of the light is hidden, and what is left of its
//! flux on the floor.
//!
//! Seen from a point, the blocker takes from the light what it covers of it, and view factors from a point are additive.
//! A blocker parallel to the light covers a rectangle of it, so that what is hidden is again an element to a
//! parallel rectangle; one that lies wholly before the light, however tilted, hides its own view factor.

use std::f64::consts::PI;

use glam::DVec3;
use scene::{Rgb, Scene};

use super::closed_form::{element_to_parallel_rectangle, element_to_polygon, parallel_rectangles};
use super::room::{FLOOR, Lit, Room, cuboid, facing_down, integrated, reversed};
use super::{Case, EXACT, Group};

/// E = M (F(light) − F(light ∩ shadow of the blocker)), the shadow cast by the point: [`element_to_parallel_rectangle`] of
/// both.
const PARALLEL: Group =
    Group { name: "blocked light, W/m²", source: "Lambert, rectangle before rectangle", bound: EXACT };

/// E = M (F(light) − F(blocker)) where the blocker lies wholly before the light: [`element_to_polygon`] of the blocker.
const TILTED: Group =
    Group { name: "light behind a tilted triangle, W/m²", source: "Lambert, additive", bound: EXACT };

/// Φ = M A (F(light → floor) − F(light → blocker)), for every ray that the blocker stops was on its way to the floor:
/// [`parallel_rectangles`]. Through a bake with default options: what the interpolants lose between their samples.
const FLUX: Group = Group { name: "blocked light, W on the floor, baked", source: "Howell, by corners", bound: 2e-3 };

/// Exitance of the light, W·m⁻².
const EXITANCE: f64 = 10.0 * PI;

/// All groups of this file.
pub fn cases() -> Vec<Case> {
    [parallel(), tilted()].concat()
}

fn floor_light_and_blocker(floor: f64, light: f64, height: f64, blocker: &[DVec3]) -> Scene {
    let floor = cuboid(DVec3::new(-floor, -floor, 0.0), DVec3::new(floor, floor, 1.0))[FLOOR];
    Room::default()
        .material(Rgb::ZERO, Rgb::ZERO)
        .polygon(&floor)
        .polygon(blocker)
        .material(Rgb::ZERO, Rgb::splat(EXITANCE))
        .polygon(&facing_down([-light, light], [-light, light], height))
        .scene()
}

/// Half sides of the floor, of the light at the height 1 and of the blocker at the height ½, metres.
const FLOOR_HALF: f64 = 2.0;
const LIGHT_HALF: f64 = 0.5;
const BLOCKER_HALF: f64 = 0.25;

/// The scene of `data/scenes/blocker_plane.obj`: a square light one metre above the floor, a square blocker half-way.
fn parallel() -> Vec<Case> {
    let [floor, light, blocker] = [FLOOR_HALF, LIGHT_HALF, BLOCKER_HALF].map(|half| [[-half, half]; 2]);
    let plate = reversed(facing_down(blocker[0], blocker[1], 0.5));
    let scene = floor_light_and_blocker(FLOOR_HALF, LIGHT_HALF, 1.0, &plate);
    let lit = Lit::solve(scene);
    let places = [
        ("the one point of the umbra", 0.0, 0.0),
        ("deep in the penumbra", 0.1, 0.05),
        ("a half in view", 0.5, 0.0),
        ("a corner hidden", 0.6, 0.7),
        ("an edge hidden", 0.95, 0.1),
        ("all in view", -1.5, 1.2),
    ];
    let found = lit.gather(places.map(|(_, x, y)| (DVec3::new(x, y, 0.0), DVec3::Z)));
    let case = |((name, x, y), found): ((&'static str, f64, f64), Rgb)| {
        let about = |bounds: [f64; 2], centre: f64| bounds.map(|bound| bound - centre);
        // Twice as far away, the shadow on the light is twice the blocker, seen from the point.
        let hidden = |centre: f64| {
            let [low, high] = about(blocker[0], centre).map(|bound| 2.0 * bound);
            let [least, most] = about(light[0], centre);
            let low = low.clamp(least, most);
            [low, high.clamp(low, most)]
        };
        let exact = element_to_parallel_rectangle(about(light[0], x), about(light[1], y), 1.0)
            - element_to_parallel_rectangle(hidden(x), hidden(y), 1.0);
        PARALLEL.case(name, None, EXITANCE * exact, found.x)
    };
    let mut cases: Vec<_> = places.into_iter().zip(found).map(case).collect();
    let exact = parallel_rectangles(light, floor, 1.0) - parallel_rectangles(light, blocker, 0.5);
    // The first polygon is the floor; the light's area is 1 m².
    let on_floor = integrated(lit.bake(), |polygon| if polygon == 0 { Rgb::ONE } else { Rgb::ZERO });
    cases.push(FLUX.case("4 × 4 m under a light of 1 m²", None, EXITANCE * exact, on_floor.x));
    cases
}

/// Half the side of the light over the tilted triangle, and its height, metres.
const TILTED_LIGHT: (f64, f64) = (1.0, 2.0);

const TRIANGLE: [DVec3; 3] = [DVec3::new(-0.2, -0.1, 0.9), DVec3::new(0.25, -0.15, 1.2), DVec3::new(0.0, 0.22, 1.0)];

/// Points on the floor from which the triangle lies wholly before the light.
const BELOW_THE_TRIANGLE: [(f64, f64); 3] = [(0.0, 0.0), (0.1, 0.05), (-0.2, 0.3)];

fn tilted() -> Vec<Case> {
    let (half, height) = TILTED_LIGHT;
    let lit = Lit::solve(floor_light_and_blocker(2.0, half, height, &reversed(TRIANGLE)));
    let points = BELOW_THE_TRIANGLE.map(|(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z));
    let case = |((position, normal), found): ((DVec3, DVec3), Rgb)| {
        let [x, y] = [position.x, position.y].map(|centre| [-half - centre, half - centre]);
        let exact = element_to_parallel_rectangle(x, y, height) - element_to_polygon(position, normal, &TRIANGLE);
        TILTED.case(format!("({}, {})", position.x, position.y), None, EXITANCE * exact, found.x)
    };
    points.into_iter().zip(lit.gather(points)).map(case).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_lies_wholly_before_the_light() {
        let (half, height) = TILTED_LIGHT;
        for (x, y) in BELOW_THE_TRIANGLE {
            let point = DVec3::new(x, y, 0.0);
            for corner in TRIANGLE {
                let shadow = point + (corner - point) * (height / corner.z);
                assert!(shadow.x.abs() < half && shadow.y.abs() < half, "{point}: {shadow}");
            }
        }
    }

    #[test]
    fn every_ray_that_the_blocker_stops_was_on_its_way_to_the_floor() {
        // The widest one: from an edge of the light past the opposite edge of the blocker, which is half-way.
        let lands = -LIGHT_HALF + 2.0 * (BLOCKER_HALF + LIGHT_HALF);
        assert!(lands <= FLOOR_HALF, "{lands}");
    }
}
