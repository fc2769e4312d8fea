//! Open bugs, each a test of what should be, marked `#[should_panic]` until it is.

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::Value;

use crate::fixture::{box_faces, folder, run, text, write_scene};

/// A closed room that reflects 90 % and is lit by its ceiling's middle absorbs what is emitted: mean E = Φ/(S(1−ρ)), CIE
/// 171:2006, 5.8. A link carries the mean of its source. Where some receivers link to the parts of a source and others to the
/// whole, those near the dark parts count them as dark and those that see the bright part well count it as the mean: light
/// is lost, more of it at moderate link errors than at coarse ones, under which nothing mixes.
#[test]
#[should_panic(expected = "of the light is lost")]
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
