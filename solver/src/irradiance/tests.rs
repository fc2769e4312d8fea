//! Light by shading normals, beside closed forms: with links, and in a scene of too many polygons for them.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use scene::{Rgb, Scene};

use super::*;
use crate::form_factor::form_factor_at;
use crate::testing::Builder;
use crate::{SolveOptions, solve};

/// A normal that is turned from +z by an angle, towards a direction in the plane.
fn turned(angle: f64, towards: f64) -> DVec3 {
    DVec3::new(angle.sin() * towards.cos(), angle.sin() * towards.sin(), angle.cos())
}

/// Gives all corners of a polygon one shading normal.
fn shade(scene: &mut Scene, polygon: u32, normal: DVec3) {
    scene.shading_normals.resize(scene.corners.len(), Vec3::ZERO);
    scene.shading_normals[scene.polygons[polygon as usize].corner_range()].fill(normal.as_vec3());
    assert_eq!(scene.validate(), Ok(()));
}

/// A horizontal rectangle about a middle, its front up or down.
fn rectangle(middle: DVec3, half: f64, up: bool) -> Vec<DVec3> {
    let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| middle + DVec3::new(x * half, y * half, 0.0))
        .to_vec();
    if !up {
        corners.reverse();
    }
    corners
}

/// The scene as it is, and with more black polygons than are linked, all far below.
fn linked_and_not(build: impl Fn() -> Builder) -> [Scene; 2] {
    let mut many = build().material(0.0, 0.0);
    for i in 0..450 {
        let middle = DVec3::new(f64::from(i % 25) * 0.1, f64::from(i / 25) * 0.1, -9.0);
        many = many.polygon(&rectangle(middle, 0.04, false));
    }
    [build().build(), many.build()]
}

/// A square floor about the origin, polygon 0, and a lamp; with links and without.
fn floor_and_lamp(half: f64, lamp: &[DVec3]) -> [Scene; 2] {
    let floor = rectangle(DVec3::ZERO, half, true);
    linked_and_not(|| Builder::default().material(0.5, 0.0).polygon(&floor).material(0.0, 1.0).polygon(lamp))
}

/// The direct light at a position of polygon 0 with a shading normal.
fn direct(scene: &Scene, position: DVec3, normal: DVec3) -> f64 {
    let mut scene = scene.clone();
    shade(&mut scene, 0, normal);
    let solution = solve(&scene, &SolveOptions { bounces: Some(0), ..SolveOptions::default() }, &|_| ());
    Gather::new(&Surroundings::new(&scene, &solution), &solution).irradiance_at(0, position, DVec3::ZERO).x
}

#[track_caller]
fn assert_close(value: f64, exact: f64, relative: f64) {
    assert!((value - exact).abs() <= relative * exact, "{value} is not {exact}");
}

#[test]
fn a_normal_that_is_none_changes_nothing() {
    let lamp = rectangle(DVec3::new(0.5, 0.2, 2.0), 0.6, false);
    for scene in floor_and_lamp(1.0, &lamp) {
        let position = DVec3::new(0.1, 0.2, 0.0);
        let flat = direct(&scene, position, DVec3::ZERO);
        assert_close(flat, PI * form_factor_at(position, DVec3::Z, &lamp), 1e-12);
        for bad in [-DVec3::Z, DVec3::X, turned(1.8, 0.3)] {
            assert_eq!(direct(&scene, position, bad).to_bits(), flat.to_bits(), "{bad}");
        }
    }
}

/// Lambert's formula with the shading normal, and with the part of the lamp that is above its horizon.
#[test]
fn a_lamp_gives_what_lambert_says_for_the_shading_normal() {
    let lamp = rectangle(DVec3::new(0.5, 0.2, 2.0), 0.6, false);
    for scene in floor_and_lamp(1.0, &lamp) {
        let position = DVec3::new(0.1, 0.2, 0.0);
        let mut cut = 0;
        for (angle, towards) in [(0.1, 0.0), (0.5, 1.0), (1.0, 4.0), (1.4, 3.1), (1.4, 3.6), (1.2, 0.1)] {
            // As the scene keeps it, in f32.
            let normal = turned(angle, towards).as_vec3().as_dvec3().normalize();
            let exact = PI * form_factor_at(position, normal, &lamp);
            assert_close(direct(&scene, position, normal), exact, 1e-6);
            cut += usize::from(lamp.iter().any(|corner| normal.dot(corner - position) < 0.0) && exact > 1e-3);
        }
        assert!(cut >= 2, "the horizon cuts the lamp {cut} times");
    }
}

/// A lamp that stands beside the receiver and reaches below its plane: that part gives nothing, though the shading normal looks
/// at it.
#[test]
fn below_the_polygons_own_plane_nothing_counts() {
    let wall = |low: f64| {
        [(-1.0, low), (1.0, low), (1.0, 1.5), (-1.0, 1.5)]
            .map(|(y, z)| DVec3::new(2.0, y, z))
            .into_iter()
            .rev()
            .collect()
    };
    let (lamp, above): (Vec<DVec3>, Vec<DVec3>) = (wall(-1.0), wall(0.0));
    for scene in floor_and_lamp(0.1, &lamp) {
        for angle in [0.2, 0.8, 1.3] {
            let normal = turned(angle, 0.0).as_vec3().as_dvec3().normalize();
            let exact = PI * form_factor_at(DVec3::ZERO, normal, &above);
            assert_close(direct(&scene, DVec3::ZERO, normal), exact, 1e-6);
            assert!(exact < 0.99 * PI * form_factor_at(DVec3::ZERO, normal, &lamp));
        }
    }
}

/// A room of radiance L all around. What counts is above two planes, so two half circles bound it, and by Lambert's formula
/// ∫ ω dω = π/2 (n_g + n_s): E = π L (1 + cos θ)/2.
#[test]
fn a_uniform_hemisphere_gives_half_of_one_and_the_cosine() {
    let walls = [true, true, true, true, false, true];
    let room = || {
        let floor = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        Builder::default().material(0.0, 0.0).polygon(&floor).material(0.0, 1.0).sides(
            DVec3::ZERO,
            DVec3::new(4.0, 3.0, 2.5),
            true,
            walls,
        )
    };
    for scene in linked_and_not(room) {
        for (angle, towards) in [(0.0_f64, 0.0), (0.3, 0.4), (0.8, 2.0), (1.2, 5.0), (1.4, 3.0)] {
            let exact = PI * (1.0 + angle.cos()) / 2.0;
            for (x, y) in [(1.0, 1.2), (3.7, 0.1)] {
                assert_close(direct(&scene, DVec3::new(x, y, 0.0), turned(angle, towards)), exact, 1e-6);
            }
        }
    }
}

/// The furnace: what surfaces pass on is as if no normal were turned, so E = M/(1−ρ) · (1 + cos θ)/2.
#[test]
fn the_light_that_a_room_keeps_does_not_depend_on_shading_normals() {
    let (reflectance, angle) = (0.5, 0.9_f64);
    let mut room = Builder::default().material(reflectance, 0.2).cuboid([0.0; 3], [2.0, 3.0, 1.0], true).build();
    shade(&mut room, 4, turned(angle, 1.0));
    let solution = solve(&room, &SolveOptions { link_error: Some(1e-4), bounces: None }, &|_| ());
    let kept = PI * 0.2 / (1.0 - reflectance);
    let surroundings = Surroundings::new(&room, &solution);
    let gather = Gather::new(&surroundings, &solution);
    for (x, y) in [(0.4, 1.3), (1.9, 0.2), (1.0, 2.9)] {
        let found = gather.irradiance_at(4, DVec3::new(x, y, 0.0), DVec3::ZERO);
        assert!((found / kept - Rgb::splat((1.0 + angle.cos()) / 2.0)).abs().max_element() < 1e-3, "{found}");
    }
}
