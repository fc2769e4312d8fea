#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;

use glam::Vec3;
use scene::{CieSky, Environment, LatLongMap, Sky, UpAxis};

use super::*;
use crate::form_factor::form_factor_at;
use crate::testing::Builder;
use crate::{SkyCells, Solution, SolveOptions, Surroundings, solve};

fn map(width: u32, height: u32, texels: Vec<Vec3>) -> Environment {
    Environment { sky: Sky::Map(LatLongMap { width, height, texels }), up: UpAxis::Z, rotation: 0.0, scale: 1.0 }
}

fn uniform() -> Environment {
    map(1, 1, vec![Vec3::ONE])
}

fn cie(kind: u8, sun_irradiance: f64) -> Environment {
    let sky = Sky::Cie(CieSky::new(kind, [2.0, 0.7], sun_irradiance).unwrap());
    Environment { sky, ..uniform() }
}

/// The direct light of a scene of black surfaces under a sky.
fn lit(builder: Builder, environment: Environment) -> (Scene, Solution) {
    let scene = Scene { environment: Some(environment), ..builder.build() };
    let solution = solve(&scene, &SolveOptions { bounces: Some(0), ..SolveOptions::default() }, &|_| ());
    (scene, solution)
}

/// A square of side 2 about the origin, that faces along a normal.
fn plate(normal: DVec3) -> Builder {
    let (x, y) = normal.any_orthonormal_pair();
    let corners = [-x - y, x - y, x + y, y - x];
    Builder::default().material(0.0, 0.0).polygon(&corners)
}

fn at(scene: &Scene, solution: &Solution, polygon: u32, position: DVec3) -> Rgb {
    Gather::new(&Surroundings::new(scene, solution), solution).irradiance_at(polygon, position, DVec3::ZERO)
}

#[test]
fn no_sky_and_a_black_sky_send_nothing() {
    assert_eq!(SkyCells::new(None), SkyCells::default());
    assert!(SkyCells::default().is_dark());
    let black = map(2, 1, vec![Vec3::ZERO; 2]);
    assert!(SkyCells::new(Some(&black)).is_dark());
    let (scene, solution) = lit(plate(DVec3::Z), black);
    assert_eq!(at(&scene, &solution, 0, DVec3::ZERO), Rgb::ZERO);
    let empty = Scene { environment: Some(uniform()), ..Scene::default() };
    assert_eq!(solve(&empty, &SolveOptions::default(), &|_| ()).mean_irradiance, Rgb::ZERO);
}

#[test]
fn under_an_even_sky_all_normals_have_the_same_light() {
    for normal in [DVec3::Z, -DVec3::X, DVec3::new(0.3, -0.5, 0.2), DVec3::new(1.0, 1.0, 1.0), -DVec3::ONE] {
        let (scene, solution) = lit(plate(normal.normalize()), uniform());
        for place in [DVec3::ZERO, scene.outline(0)[0] * 0.9] {
            let irradiance = at(&scene, &solution, 0, place);
            assert!((irradiance / PI - 1.0).abs().max_element() < 1e-9, "{normal}: {irradiance}");
        }
        assert!((solution.mean_irradiance / PI - 1.0).abs().max_element() < 1e-9, "the guess is exact here");
    }
}

/// Against quadrature over the sphere, for every sky of the standard and a map of noise, which no few cells follow.
#[test]
fn unobstructed_irradiance_is_that_of_the_sky() {
    let noise = (0..128u32).map(|i| Vec3::splat((i * 37 % 101) as f32)).collect();
    let skies = (1..=16).map(|kind| (cie(kind, 0.0), 2e-3)).chain([(map(16, 8, noise), 5e-3)]);
    for (i, (environment, bound)) in skies.enumerate() {
        let mut brightest = 0.0;
        for normal in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.8, -0.36)] {
            let (scene, solution) = lit(plate(normal), environment.clone());
            let found = at(&scene, &solution, 0, DVec3::ZERO);
            let rows = 180;
            let exact: Rgb = (0..rows * 2 * rows)
                .map(|k| {
                    let (x, y) = (k % (2 * rows), k / (2 * rows));
                    let (u, v) = ((f64::from(x) + 0.5) / f64::from(2 * rows), (f64::from(y) + 0.5) / f64::from(rows));
                    let cosine = normal.dot(environment.direction(u, v)).max(0.0);
                    environment.radiance_at(u, v) * (cosine * scene::texel_solid_angle(2 * rows, rows, y))
                })
                .sum();
            brightest = exact.max_element().max(brightest);
            let off = (found - exact).abs().max_element();
            assert!(off < bound * brightest, "sky {i}, {normal}: {found} for {exact}");
        }
    }
}

/// The sun alone, and its penumbra under a long edge: half of it is seen where the edge halves its disc.
#[test]
fn the_sun_is_a_small_disc() {
    let dark_but_for_the_sun = |irradiance: f64| {
        let sky = Sky::Cie(CieSky::new(5, [0.0, FRAC_PI_2], irradiance).unwrap());
        Environment { sky, scale: 1.0, ..uniform() }
    };
    let roof = [(0.0, -50.0), (50.0, -50.0), (50.0, 50.0), (0.0, 50.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
    let light = |x: f64| {
        let of = |irradiance| {
            let (scene, solution) = lit(plate(DVec3::Z).polygon(&roof), dark_but_for_the_sun(irradiance));
            at(&scene, &solution, 0, DVec3::new(x, 0.1, 0.0)).x
        };
        of(2.0) - of(0.0)
    };
    let radius = (0.533f64 / 2.0).to_radians();
    assert!((light(-2.0 * radius) / 2.0 - 1.0).abs() < 1e-4);
    assert!((light(0.0) / 1.0 - 1.0).abs() < 1e-3);
    assert!(light(2.0 * radius).abs() < 1e-9);
    // Past a chord at half the radius.
    let part = (0.5f64.acos() - 0.5 * 0.75f64.sqrt()) / PI;
    assert!((light(0.5 * radius) / (2.0 * part) - 1.0).abs() < 0.03);
}

#[test]
fn a_wall_hides_its_form_factor() {
    let wall = [(-0.5, 0.0), (0.7, 0.0), (0.7, 1.3), (-0.5, 1.3)].map(|(y, z)| DVec3::new(0.4, y, z));
    let (scene, solution) = lit(plate(DVec3::Z).polygon(&wall), uniform());
    for place in [DVec3::new(0.0, 0.1, 0.0), DVec3::new(-0.9, -0.9, 0.0), DVec3::new(0.399, 0.0, 0.0)] {
        let expected = PI * (1.0 - form_factor_at(place, DVec3::Z, &wall));
        let found = at(&scene, &solution, 0, place).x;
        assert!((found / expected - 1.0).abs() < 1e-9, "{place}: {found} for {expected}");
    }
}

/// A room is lit through its window alone, and past a post in it.
#[test]
fn a_room_sees_the_sky_through_its_window() {
    let (low, high) = (DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5));
    let frame = |y: [f64; 2], z: [f64; 2]| {
        [(y[0], z[0]), (y[0], z[1]), (y[1], z[1]), (y[1], z[0])].map(|(y, z)| DVec3::new(4.0, y, z))
    };
    let room = Builder::default()
        .material(0.0, 0.0)
        .sides(low, high, true, [true, false, true, true, true, true])
        .polygon(&frame([0.0, 3.0], [0.0, 1.0]))
        .polygon(&frame([0.0, 3.0], [2.0, 2.5]))
        .polygon(&frame([0.0, 1.0], [1.0, 2.0]))
        .polygon(&frame([2.2, 3.0], [1.0, 2.0]));
    let (scene, solution) = lit(room, uniform());
    let window = frame([1.0, 2.2], [1.0, 2.0]);
    for polygon in scene.polygon_ids().take(5) {
        let outline = scene.outline(polygon);
        let middle = scene::centroid(&outline);
        for place in outline.iter().map(|corner| middle.lerp(*corner, 0.83)).chain([middle]) {
            let expected = PI * form_factor_at(place, scene.plane(polygon).normal, &window);
            let found = at(&scene, &solution, polygon, place).x;
            assert!((found - expected).abs() < 1e-9, "{polygon} {place}: {found} for {expected}");
        }
    }
}

/// Of a hundred slats rays tell what is seen.
#[test]
fn behind_too_many_obstacles_rays_tell() {
    let mut builder = plate(DVec3::Z);
    for i in 0..100 {
        let x = 0.04 * f64::from(i) - 2.0;
        let slat = [(x, -2.0), (x + 0.02, -2.0), (x + 0.02, 2.0), (x, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.5));
        builder = builder.polygon(&slat);
    }
    let (scene, solution) = lit(builder, uniform());
    let off = |place: DVec3| {
        let slats = scene.polygon_ids().skip(1).map(|slat| form_factor_at(place, DVec3::Z, &scene.outline(slat)));
        let expected = PI * (1.0 - slats.sum::<f64>());
        at(&scene, &solution, 0, place).x / expected - 1.0
    };
    let offs: Vec<f64> = (0..40).map(|i| off(DVec3::new(f64::from(i) * 0.02 - 0.4, 0.1, 0.0))).collect();
    let mean = offs.iter().sum::<f64>() / 40.0;
    let rms = (offs.iter().map(|off| off * off).sum::<f64>() / 40.0).sqrt();
    assert!(mean.abs() < 0.01 && rms < 0.04, "{mean} {rms}");
}

/// Short patches in a room send their rays to what is seen through its window from about there.
#[test]
fn through_openings_short_patches_see_the_window() {
    let window = [(1.0, 1.0), (1.0, 2.0), (2.2, 2.0), (2.2, 1.0)].map(|(y, z)| DVec3::new(4.0, y, z));
    let frame = |y: [f64; 2], z: [f64; 2]| {
        [(y[0], z[0]), (y[0], z[1]), (y[1], z[1]), (y[1], z[0])].map(|(y, z)| DVec3::new(4.0, y, z))
    };
    let walls = [true, false, true, true, true, true];
    let mut builder = Builder::default()
        .material(0.0, 0.0)
        .sides(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5), true, walls)
        .polygon(&frame([0.0, 3.0], [0.0, 1.0]))
        .polygon(&frame([0.0, 3.0], [2.0, 2.5]))
        .polygon(&frame([0.0, 1.0], [1.0, 2.0]))
        .polygon(&frame([2.2, 3.0], [1.0, 2.0]));
    for i in 0..80 {
        let (x, y) = (1.0 + 0.2 * f64::from(i % 10), 0.8 + 0.2 * f64::from(i / 10));
        let tile = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.03), (0.0, 0.03)];
        builder = builder.polygon(&tile.map(|(u, v)| DVec3::new(x + u, y + v, 0.2)));
    }
    let (scene, mut solution) = lit(builder, uniform());
    let tree = PolygonTree::new(&scene);
    solution.openings = Some(crate::Openings::new(&scene, &tree, &solution.elements, &solution.sky));
    let surroundings = Surroundings::new(&scene, &solution);
    let gather = Gather::new(&surroundings, &solution);
    let off = |tile: u32| {
        let place = scene::centroid(&scene.outline(tile));
        let expected = PI * form_factor_at(place, DVec3::Z, &window);
        gather.irradiance_at(tile, place, DVec3::ZERO).x / expected - 1.0
    };
    let offs: Vec<f64> = scene.polygon_ids().skip(9).map(off).collect();
    let mean = offs.iter().sum::<f64>() / 80.0;
    let rms = (offs.iter().map(|off| off * off).sum::<f64>() / 80.0).sqrt();
    assert!(offs.len() == 80 && mean.abs() < 0.02 && rms < 0.15, "{mean} {rms}");
}
