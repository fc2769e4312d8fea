//! Scenes whose light has a closed form. The form factors' own are beside the solver.

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::Value;

use crate::fixture::{box_faces, data, folder, probe, run, text, write_points, write_scene};
use crate::reference::Table;

/// A light, a floor and a blocker between them: the visible part of the light is a polygon.
#[test]
fn a_polygon_light_with_a_polygon_blocker() {
    let folder = folder();
    let (truth, points) = (data("reference/blocker_plane.csv"), folder.path().join("points.csv"));
    std::fs::copy(&truth, &points).unwrap();
    let found = probe(&data("scenes/blocker_plane.obj"), &points, &["--method", "gather"]);
    let truth: Option<Vec<_>> = Table::read(&truth).colours("E_").into_iter().collect();
    let truth = truth.unwrap();
    assert_eq!(truth.len(), found.len());
    let mean = truth.iter().map(|e| e[0]).sum::<f64>() / truth.len() as f64;
    for (i, (truth, found)) in truth.into_iter().map(DVec3::from).zip(found).enumerate() {
        // The table has twelve digits; a point in deep penumbra is measured against a thousandth of the mean.
        let error = (found - truth).abs().max_element() / truth.x.max(1e-3 * mean);
        assert!(error <= 1e-6, "point {i}: {found} for {truth}");
    }
}

/// A closed room whose walls all emit and reflect alike: E = B = M/(1−ρ) everywhere, here 1/(1−½).
#[test]
fn a_uniform_room_is_uniform() {
    let folder = folder();
    let (low, high) = (DVec3::ZERO, DVec3::new(3.0, 2.0, 1.5));
    let quads: Vec<_> =
        box_faces(low, high, true, &[0, 1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")).collect();
    let radiance = 1.0 / PI;
    let scene = write_scene(
        folder.path(),
        &format!("newmtl wall\nKd 0.5 0.5 0.5\nKe {radiance} {radiance} {radiance}\n"),
        &quads,
    );
    let on_faces = quads.iter().flat_map(|(corners, _)| {
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
        let at = move |(s, t): (f64, f64)| corners[0] + (corners[1] - corners[0]) * s + (corners[3] - corners[0]) * t;
        [(0.5, 0.5), (0.013, 0.9), (0.31, 0.27), (0.98, 0.99)].map(|place| (at(place), normal))
    });
    let points = write_points(folder.path(), on_faces);
    let bake = folder.path().join("room.hlf");
    run(&["bake", text(&scene), "-o", text(&bake), "--link-error", "1e-4"]);
    for method in ["interpolant", "gather"] {
        for (i, found) in probe(&bake, &points, &["--method", method]).into_iter().enumerate() {
            assert!((found - 2.0).abs().max_element() <= 2e-3, "{method}, point {i}: {found}");
        }
    }
}

/// A dark box with walls of zero thickness, standing on the floor of a lit room and sharing its polygon.
#[test]
fn no_light_leaks_under_a_wall() {
    let folder = folder();
    let mut quads: Vec<_> = box_faces(DVec3::ZERO, DVec3::new(4.0, 4.0, 3.0), true, &[0, 2, 3, 4, 5])
        .into_iter()
        .map(|corners| (corners, "wall"))
        .collect();
    quads.push((box_faces(DVec3::ZERO, DVec3::new(4.0, 4.0, 3.0), true, &[1])[0], "lamp"));
    let (low, high) = (DVec3::new(1.3, 1.1, 0.0), DVec3::new(2.2, 2.5, 0.8));
    quads.extend(box_faces(low, high, false, &[1, 2, 3, 4, 5]).into_iter().map(|corners| (corners, "wall")));
    let materials = "newmtl wall\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";
    let scene = write_scene(folder.path(), materials, &quads);
    let inside = |i: u32, j: u32| {
        let at = |i: u32, low: f64, high: f64| low + (high - low) * (f64::from(i) + 0.03) / 20.0;
        (DVec3::new(at(i, low.x, high.x), at(j, low.y, high.y), 0.0), DVec3::Z)
    };
    let points = write_points(folder.path(), (0..20).flat_map(|i| (0..20).map(move |j| inside(i, j))));
    for method in ["interpolant", "gather"] {
        for (i, found) in probe(&scene, &points, &["--method", method]).into_iter().enumerate() {
            assert_eq!(found, DVec3::ZERO, "{method}, point {i}");
        }
    }
    // And a step outside there is light.
    let outside = [DVec3::new(1.29, 1.8, 0.0), DVec3::new(2.21, 1.8, 0.0), DVec3::new(1.7, 1.09, 0.0)];
    let points = write_points(folder.path(), outside.into_iter().map(|point| (point, DVec3::Z)));
    assert!(probe(&scene, &points, &[]).into_iter().all(|found| found.min_element() > 0.1));
}

/// A closed room that reflects 90 % and is lit by its ceiling's middle absorbs what is emitted: mean E = Φ/(S(1−ρ)), CIE
/// 171:2006, 5.8. A link carries the mean of its source, and where some receivers link to the parts of a source and others
/// to the whole, links lose light; a bake must not.
#[test]
fn light_is_kept_where_links_start_from_parts_and_from_the_whole() {
    let folder = folder();
    let (side, flux, reflectance) = (4.0, 10_000.0, 0.9);
    let walls = box_faces(DVec3::ZERO, DVec3::splat(side), true, &[0, 2, 3, 4, 5]);
    let mut quads: Vec<_> = walls.into_iter().map(|corners| (corners, "wall")).collect();
    let down = |x: [f64; 2], y: [f64; 2]| {
        [(x[0], y[0]), (x[0], y[1]), (x[1], y[1]), (x[1], y[0])].map(|(x, y)| DVec3::new(x, y, side))
    };
    quads.push((down([0.0, side], [0.0, 1.5]), "wall"));
    quads.push((down([0.0, side], [2.5, side]), "wall"));
    quads.push((down([0.0, 1.5], [1.5, 2.5]), "wall"));
    quads.push((down([2.5, side], [1.5, 2.5]), "wall"));
    quads.push((down([1.5, 2.5], [1.5, 2.5]), "lamp"));
    let radiance = flux / PI;
    let grey = format!("Kd {reflectance} {reflectance} {reflectance}");
    let materials = format!("newmtl wall\n{grey}\nnewmtl lamp\n{grey}\nKe {radiance} {radiance} {radiance}\n");
    let scene = write_scene(folder.path(), &materials, &quads);
    let bake = folder.path().join("cube.hlf");
    run(&["bake", text(&scene), "-o", text(&bake), "--link-error", "50"]);
    let info: Value = serde_json::from_slice(&run(&["info", text(&bake), "--json"]).stdout).unwrap();
    let mean = info["bake"]["mean_irradiance"][0].as_f64().unwrap();
    let lost = 1.0 - mean / (flux / (6.0 * side * side * (1.0 - reflectance)));
    assert!(lost.abs() <= 0.01, "{:.1} % of the light is lost", 100.0 * lost);
}
