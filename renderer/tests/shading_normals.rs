//! Paths at points with shading normals, beside closed forms.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use renderer::{PathOptions, ReferenceOptions, SurfacePoint, irradiance, reference};
use scene::{Bvh, Material, Polygon, Rgb, Scene};

/// A box of walls that reflect and emit alike, their fronts to the inside; polygon 0 is the floor.
fn furnace(reflectance: f64, exitance: f64) -> Scene {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let polygon = |face: u32| Polygon { first_corner: 4 * face, corner_count: 4, material: 0, object: 0 };
    Scene {
        vertices: (0..8).map(corner).collect(),
        corners: faces.into_iter().flatten().collect(),
        polygons: (0..6).map(polygon).collect(),
        materials: vec![Material {
            reflectance: Rgb::splat(reflectance),
            radiance: Rgb::splat(exitance / PI),
            ..Material::grey("wall")
        }],
        objects: vec!["box".into()],
        ..Scene::default()
    }
}

/// Turns the floor's normal.
fn turn(scene: &mut Scene, normal: DVec3) {
    scene.shading_normals = vec![Vec3::ZERO; 24];
    scene.shading_normals[..4].fill(normal.as_vec3());
    assert_eq!(scene.validate(), Ok(()));
}

const POINT: (DVec3, DVec3) = (DVec3::new(0.3, 0.6, 0.0), DVec3::Z);

#[test]
fn a_normal_that_is_none_changes_nothing() {
    let options = PathOptions { samples: 256, bounces: None, seed: 3 };
    let scene = furnace(0.5, 2.0);
    let flat = irradiance(&scene, &Bvh::of_scene(&scene), &[POINT], &options);
    for bad in [DVec3::ZERO, -DVec3::Z, DVec3::X] {
        let mut turned = scene.clone();
        turn(&mut turned, bad);
        assert_eq!(irradiance(&turned, &Bvh::of_scene(&turned), &[POINT], &options), flat, "{bad}");
    }
}

/// E = B (1 + cos θ)/2 with B = M (1 − ρ^(n+1))/(1 − ρ) after n bounces: the normal is turned at the first vertex alone.
#[test]
fn the_furnace_about_a_turned_normal() {
    let (reflectance, exitance) = (0.6_f64, 2.0);
    for angle in [0.4_f64, 1.0, 1.4] {
        let mut scene = furnace(reflectance, exitance);
        turn(&mut scene, DVec3::new(angle.sin() * 0.6, angle.sin() * 0.8, angle.cos()));
        let bvh = Bvh::of_scene(&scene);
        for bounces in [Some(0), Some(2), None] {
            let series = bounces.map_or(0.0, |n| reflectance.powi(n as i32 + 1));
            let exact = exitance * (1.0 - series) / (1.0 - reflectance) * (1.0 + angle.cos()) / 2.0;
            let options = PathOptions { samples: 1 << 14, bounces, seed: 1 };
            let found = irradiance(&scene, &bvh, &[POINT], &options)[0];
            let (mean, error) = (found.mean.x, found.standard_error().x);
            assert!((mean - exact).abs() <= 4.5 * error + 1e-13, "{mean} ± {error} for {exact}, {bounces:?}");
            assert!(error < 0.02 * exact);
        }
    }
}

#[test]
fn a_reference_looks_by_the_shading_normal() {
    let mut scene = furnace(0.5, 2.0);
    turn(&mut scene, DVec3::new(0.8, 0.0, 0.6));
    let point = SurfacePoint { position: POINT.0, normal: POINT.1, polygon: 0 };
    let options = ReferenceOptions { total_error: 5e-3, direct_error: 2e-3, seed: 1 };
    let found = reference(&scene, &Bvh::of_scene(&scene), &[point], &options);
    for (estimate, exact) in [(found.direct[0], 2.0 * 0.8), (found.total[0], 4.0 * 0.8)] {
        assert!(
            (estimate.mean.x - exact).abs() <= 4.5 * estimate.standard_error().x,
            "{:?} for {exact}",
            estimate.mean
        );
    }
}
