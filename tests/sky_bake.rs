//! Bakes under an environment: closed forms, and the verdict of paths.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use crate::fixture::{box_faces, folder, probe, run, text, write_points, write_scene};

const GREY: &str = "newmtl grey\nKd 0.5 0.5 0.5\n";

/// An open floor of two metres by two, z up.
fn floor(folder: &Path) -> PathBuf {
    let corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0));
    write_scene(folder, GREY, &[(corners, "grey")])
}

/// A room of 4 × 3 × 2.5 m with a window of 1.6 × 1.2 m in its south wall, above a sill.
fn room_with_a_window(folder: &Path) -> PathBuf {
    let faces = box_faces(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5), true, &[0, 1, 3, 4, 5]);
    let wall = |x: [f64; 2], z: [f64; 2]| {
        [(x[0], z[0]), (x[0], z[1]), (x[1], z[1]), (x[1], z[0])].map(|(x, z)| DVec3::new(x, 0.0, z))
    };
    let around = [
        wall([0.0, 4.0], [0.0, 0.9]),
        wall([0.0, 4.0], [2.1, 2.5]),
        wall([0.0, 1.2], [0.9, 2.1]),
        wall([2.8, 4.0], [0.9, 2.1]),
    ];
    write_scene(folder, GREY, &faces.into_iter().chain(around).map(|face| (face, "grey")).collect::<Vec<_>>())
}

/// π·L all over an open plane, whatever the method; a plane is lit by nothing that it reflects itself.
#[test]
fn an_open_plane_has_the_light_of_its_sky() {
    let folder = folder();
    let (scene, bake, map) = (floor(folder.path()), folder.path().join("floor.hlf"), folder.path().join("even.exr"));
    formats::write_exr(&map, 2, 1, &[Vec3::ONE; 2]).unwrap();
    let places = [(0.0, 0.0), (0.9, -0.9), (-0.3, 0.7), (0.999, 0.2)];
    let points = write_points(folder.path(), places.iter().map(|&(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z)));
    run(&["bake", text(&scene), "-o", text(&bake), "--environment", text(&map)]);
    for method in ["interpolant", "gather", "path"] {
        for found in probe(&bake, &points, &["--method", method]) {
            assert!((found / PI - DVec3::ONE).abs().max_element() < 0.02, "{method}: {found}");
        }
    }
    run(&["verify", text(&bake)]);
}

/// Under skies with light and shade, and on its side, the ground has what paths say.
#[test]
fn an_open_plane_has_the_light_of_a_clear_sky() {
    let folder = folder();
    let scene = floor(folder.path());
    for (name, sky) in [
        ("clear", &["--environment", "cie:12", "--sun", "200,35", "--sun-irradiance", "4"][..]),
        ("side", &["--environment", "cie:16", "--sky-up", "y", "--sky-rotation", "30"]),
    ] {
        let bake = folder.path().join(name).with_extension("hlf");
        run(&[&["bake", text(&scene), "-o", text(&bake)], sky].concat());
        run(&["verify", text(&bake)]);
    }
}

#[test]
fn a_room_with_a_window_holds() {
    let folder = folder();
    let (scene, bake) = (room_with_a_window(folder.path()), folder.path().join("room.hlf"));
    run(&["bake", text(&scene), "-o", text(&bake), "--environment", "cie:12", "--tolerance", "0.03"]);
    run(&["verify", text(&bake)]);

    // A picture by lights that stand for the sky has the bake's reflected light besides.
    let mean = |input: &Path, flags: &[&str]| {
        let picture = folder.path().join("picture.exr");
        let view = ["--eye", "2,2.8,1.3", "--target", "2,0,1.0", "--fov", "70", "--size", "48x36"];
        let said = run(&[&["render", text(input), "-o", text(&picture)], &view[..], flags].concat());
        // The floor alone: the window's edges are pixels wide.
        let pixels = formats::read_exr(&picture).unwrap().2.split_off(48 * 28);
        let sum = pixels.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>();
        (sum / pixels.len() as f64, String::from_utf8(said.stderr).unwrap())
    };
    let sky = ["--environment", "cie:12", "--lights", "1000", "--visibility", "full"];
    let (whole, said) = mean(&bake, &sky);
    assert!(!said.contains("warning"), "{said}");
    let (paths, _) = mean(&bake, &["--radiance", "path", "--paths", "256", "--sampler", "full", "--budget", "1rpp"]);
    let (direct, _) = mean(&scene, &sky);
    assert!((whole / paths - DVec3::ONE).abs().max_element() < 0.02, "{whole} in place of {paths}");
    assert!(direct.max_element() < 0.9 * whole.max_element(), "{direct} of {whole} is direct");
    let (_, said) = mean(&bake, &["--environment", "cie:1"]);
    assert!(said.contains("was baked under another sky"), "{said}");
}

/// Under an open sky a flat floor reflects nothing to itself: a bake adds nothing to its picture.
#[test]
fn what_comes_straight_from_the_sky_is_not_counted_twice() {
    let folder = folder();
    let (scene, bake) = (floor(folder.path()), folder.path().join("floor.hlf"));
    run(&["bake", text(&scene), "-o", text(&bake), "--environment", "cie:5", "--tolerance", "0.05"]);
    let pictures = [&scene, &bake].map(|input| {
        let picture = folder.path().join("picture.exr");
        let view = ["--eye", "0,0,1", "--target", "0,0.01,0", "--size", "16x16"];
        run(&[&["render", text(input), "-o", text(&picture), "--environment", "cie:5"], &view[..]].concat());
        formats::read_exr(&picture).unwrap().2
    });
    assert_eq!(pictures[0], pictures[1]);
}
