//! A scene's environment: it comes from a scene file or from flags, every command that reads scenes takes it, and paths see it.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use serde_json::Value;

use crate::fixture::{data, fails, folder, office, probe, run, text, write_points, write_scene};

/// A black floor of a square metre, z up, that emits nothing.
fn floor(folder: &Path) -> PathBuf {
    let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0));
    write_scene(folder, "newmtl dark\nKd 0 0 0\n", &[(corners, "dark")])
}

/// A scene file of the same floor, with an environment.
fn floor_under(folder: &Path, environment: &str) -> PathBuf {
    floor(folder);
    let path = folder.join("floor.toml");
    let model = "up = \"z\"\n[[model]]\nfile = \"scene.obj\"\n";
    std::fs::write(&path, format!("{model}[environment]\n{environment}\n")).unwrap();
    path
}

/// A grey floor with a lamp over it, and an environment, before a camera that sees both and the sky.
pub fn lit_floor_under(folder: &Path, environment: &str) -> PathBuf {
    let square = |z: f64, half: f64| {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| DVec3::new(x * half, y * half, z))
    };
    let mut lamp = square(0.6, 0.2);
    lamp.reverse();
    write_scene(
        folder,
        "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n",
        &[(square(0.0, 1.0), "grey"), (lamp, "lamp")],
    );
    let path = folder.join("floor.toml");
    let model = "up = \"z\"\n[[model]]\nfile = \"scene.obj\"\n";
    let camera = "[[camera]]\nname = \"aside\"\neye = [-3, -2, 1]\ntarget = [0, 0, 0.6]\n";
    std::fs::write(&path, format!("{model}{camera}[environment]\n{environment}\n")).unwrap();
    path
}

fn info(scene: &Path, options: &[&str]) -> Value {
    let printed = run(&[&["info", text(scene), "--json"], options].concat());
    serde_json::from_slice(&printed.stdout).unwrap()
}

/// A bake has its own light; `render` alone makes a picture of it under another.
#[test]
fn a_bake_takes_no_environment() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (picture, page, points) = (path("a.png"), path("page"), path("points.csv"));
    let bake = text(office());
    for arguments in [
        &["info", bake][..],
        &["verify", bake],
        &["view", bake],
        &["shot", bake, "-o", text(&picture)],
        &["export", bake, "--web", text(&page)],
        &["probe", bake, "--points", text(&data("reference/office.csv")), "-o", text(&points)],
    ] {
        let said = fails(2, &[arguments, &["--environment", "cie:5"]].concat());
        assert!(said.contains("--environment says how a scene is read") && said.contains("office.hlf"), "{said}");
    }
    assert!(!picture.exists() && !page.exists() && !points.exists());
    let free = ["--size", "40x30", "--environment", "cie:5", "--lights", "20"];
    run(&[&["render", bake, "-o", text(&picture)][..], &free].concat());
    assert!(picture.exists());
}

#[test]
fn what_cannot_be_is_refused_wherever_it_is_given() {
    let folder = folder();
    let scene = floor(folder.path());
    for options in [
        &["--environment", "cie:17"][..],
        &["--environment", "cie:5", "--sky-scale", "0"],
        &["--environment", "cie:5", "--sun", "0,-1"],
        &["--environment", "cie:5", "--sky-rotation", "nan"],
        &["--environment", "sky.exr", "--sun", "100,20"],
        &["--sky-up", "y"],
        &["--sun-irradiance", "3"],
    ] {
        let said = fails(2, &[&["info", text(&scene)], options].concat());
        assert!(said.contains(options[options.len() - 2]), "{options:?}: {said}");
    }
    assert!(fails(1, &["info", text(&scene), "--environment", "none.hdr"]).contains("none.hdr: cannot be read"));
    let dark = fails(1, &["probe", text(&scene), "--points", text(&data("reference/office.csv"))]);
    assert!(dark.contains("nothing emits light") && dark.contains("--environment cie:12"), "{dark}");
}

#[test]
fn a_file_says_what_environment_it_has() {
    let folder = folder();
    let scene = floor_under(folder.path(), "sky = 12\nsun = [90, 30]\nsun_irradiance = 4\nscale = 0.5");
    let found = &info(&scene, &[])["scene"]["environment"];
    assert_eq!(
        (found["sky"].as_str(), found["up"].as_str(), found["size"].as_array()),
        (Some("cie:12"), Some("z"), None)
    );
    assert_eq!((found["scale"].as_f64(), found["sun_irradiance"].as_f64()), (Some(0.5), Some(4.0)));
    assert!((found["sun"][0].as_f64().unwrap() - 90.0).abs() < 1e-9);
    let said = String::from_utf8(run(&["info", text(&scene)]).stdout).unwrap();
    assert!(said.contains("cie:12, sun of 4.0000 W/m² at 90.0°, 30.0°; z is up"), "{said}");
    assert_eq!(info(&floor(folder.path()), &[])["scene"]["environment"], Value::Null);

    // An odd map, by either way, in place of the file's sky.
    let map = folder.path().join("sky.exr");
    formats::write_exr(&map, 3, 1, &[Vec3::ONE, Vec3::NEG_ONE, Vec3::ONE]).unwrap();
    let flags = ["--environment", text(&map), "--sky-up", "x", "--sky-rotation", "-30"];
    let found = &info(&scene, &flags)["scene"]["environment"];
    assert_eq!(
        (found["sky"].as_str(), found["up"].as_str(), found["size"][0].as_u64()),
        (Some("map"), Some("x"), Some(3))
    );
    assert!((found["rotation"].as_f64().unwrap() + 30.0).abs() < 1e-9 && found["sun"].is_null());
    let by_file = floor_under(folder.path(), "map = \"sky.exr\"");
    for arguments in [&["info", text(&scene), "--environment", text(&map)][..], &["info", text(&by_file)]] {
        let said = String::from_utf8(run(arguments).stderr).unwrap();
        assert!(
            said.contains("warning: ") && said.contains("1 of 3 texels") && said.contains("3 × 1 texels"),
            "{said}"
        );
    }
}

/// π·L on an open floor, by a file and by flags, which stand above it; and E·sin γ of the sun.
#[test]
fn paths_see_the_environment() {
    let folder = folder();
    let map = folder.path().join("even.exr");
    formats::write_exr(&map, 2, 1, &[Vec3::ONE; 2]).unwrap();
    let points = write_points(folder.path(), [(DVec3::new(0.5, 0.5, 0.0), DVec3::Z)].into_iter());
    let scene = floor_under(folder.path(), "map = \"even.exr\"\nscale = 3");
    for (options, expected) in [
        (&[][..], 3.0 * PI),
        (&["--environment", text(&map)], PI),
        (&["--environment", "cie:5", "--sky-scale", "2"], 2.0 * PI),
        (&["--environment", "cie:5", "--sun", "200,30", "--sun-irradiance", "40"], PI + 20.0),
        // On its side: half of what is over the floor is sky, and the other half black.
        (&["--environment", "cie:5", "--sky-up", "x"], PI / 2.0),
    ] {
        let by_paths = ["--method", "path", "--samples", "65536"];
        let found = probe(&scene, &points, &[&by_paths, options].concat())[0];
        assert!(
            (found / expected - DVec3::ONE).abs().max_element() < 5e-3,
            "{options:?}: {found}, expected {expected}"
        );
    }
}

/// Where a pixel sees no surface: by every sampler, by paths and by Whitted's rays, and by the lights of `render
/// --environment`.
#[test]
fn pictures_show_the_environment_past_all_surfaces() {
    let folder = folder();
    let picture = folder.path().join("seen.exr");
    formats::write_exr(&folder.path().join("sides.exr"), 2, 1, &[Vec3::X, Vec3::Y]).unwrap();
    let scene = floor_under(folder.path(), "map = \"sides.exr\"\nscale = 2");
    let sky = text(&folder.path().join("sides.exr")).to_owned();
    // From above, north up: west is left.
    let view = ["--eye", "0.5,0.5,1", "--target", "0.5,0.5,0", "--up", "0,1,0", "--fov", "100", "--size", "60x60"];
    for (options, scale) in [
        (&["--radiance", "path", "--sampler", "full", "--filter", "box"][..], 2.0),
        (&["--radiance", "path", "--paths", "1", "--filter", "box"], 2.0),
        (&["--radiance", "whitted", "--filter", "box"], 2.0),
        (&["--radiance", "whitted", "--sampler", "coherence-map", "--budget", "100%", "--filter", "box"], 2.0),
        (&["--environment", &sky], 1.0),
    ] {
        run(&[&["render", text(&scene), "-o", text(&picture)][..], &view, options].concat());
        let (_, _, pixels) = formats::read_exr(&picture).unwrap();
        let [left, middle, right] = [30 * 60 + 2, 30 * 60 + 30, 30 * 60 + 57].map(|i| pixels[i]);
        for (seen, expected) in [(left, Vec3::X * scale), (middle, Vec3::ZERO), (right, Vec3::Y * scale)] {
            assert!((seen - expected).abs().max_element() < 2e-3, "{options:?}: {seen}, expected {expected}");
        }
    }
}

/// `shot` shows it as `render` does, by whatever draws, and meters on surfaces alone.
#[test]
fn shots_show_the_environment_past_all_surfaces() {
    let folder = folder();
    let map = folder.path().join("even.exr");
    formats::write_exr(&map, 2, 1, &[Vec3::new(0.5, 1.0, 0.25); 2]).unwrap();
    let (bake, picture) = (folder.path().join("floor.hlf"), folder.path().join("shot.exr"));
    let scene = lit_floor_under(folder.path(), "map = \"even.exr\"\nscale = 8");
    run(&["bake", text(&scene), "-o", text(&bake)]);
    for backend in ["cpu", "auto"] {
        run(&["shot", text(&bake), "-o", text(&picture), "--size", "60x40", "--backend", backend]);
        let (_, _, pixels) = formats::read_exr(&picture).unwrap();
        assert!((pixels[0] - Vec3::new(4.0, 8.0, 2.0)).abs().max_element() < 0.02, "{backend}: {}", pixels[0]);
        let shown = pixels.iter().filter(|pixel| (**pixel - pixels[0]).abs().max_element() < 0.02).count();
        assert!((2000..2380).contains(&shown), "{backend}: {shown} of 2400 pixels see the sky");
    }
}
