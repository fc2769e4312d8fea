//! Scenes whose light has a closed form. The form factors' own are beside the solver.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::fixture::{data, folder, run, text};
use crate::reference::Table;

/// The irradiance that `probe` finds; all points meet a surface.
fn probe(scene: &Path, points: &Path, options: &[&str]) -> Vec<DVec3> {
    let output = points.with_extension("out.csv");
    run(&[&["probe", text(scene), "--points", text(points), "-o", text(&output)], options].concat());
    let found: Option<Vec<_>> = Table::read(&output).colours("e").into_iter().collect();
    found.expect("every point meets a surface").into_iter().map(DVec3::from).collect()
}

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

/// The faces of a box, seen from inside when `inward`.
pub fn box_faces(low: DVec3, high: DVec3, inward: bool, faces: &[usize]) -> Vec<[DVec3; 4]> {
    let corner = |i: usize| {
        let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        DVec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    };
    // Counter-clockwise from inside: floor, ceiling, front, back, left, right.
    const FACES: [[usize; 4]; 6] = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    faces
        .iter()
        .map(|&face| {
            let mut corners = FACES[face].map(corner);
            if !inward {
                corners.reverse();
            }
            corners
        })
        .collect()
}

/// Writes an OBJ of quads, each with the name of its material.
pub fn write_scene(folder: &Path, materials: &str, quads: &[([DVec3; 4], &str)]) -> PathBuf {
    std::fs::write(folder.join("scene.mtl"), materials).unwrap();
    let mut obj = String::from("mtllib scene.mtl\n");
    for (corners, material) in quads {
        for corner in corners {
            writeln!(obj, "v {} {} {}", corner.x, corner.y, corner.z).unwrap();
        }
        writeln!(obj, "usemtl {material}\nf -4 -3 -2 -1").unwrap();
    }
    let path = folder.join("scene.obj");
    std::fs::write(&path, obj).unwrap();
    path
}

fn write_points(folder: &Path, points: impl Iterator<Item = (DVec3, DVec3)>) -> PathBuf {
    let mut csv = String::from("x,y,z,nx,ny,nz\n");
    for (p, n) in points {
        writeln!(csv, "{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
    }
    let path = folder.join("points.csv");
    std::fs::write(&path, csv).unwrap();
    path
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
