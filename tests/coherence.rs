//! Pictures of directional coherence maps: near the full one from few pixels, equal to it from all, and whatever is asked, a
//! picture or a clear word.

use std::path::Path;

use serde_json::Value;

use crate::fixture::{data, fails, folder, halflight, office, run, text};

const MAP: [&str; 2] = ["--sampler", "coherence-map"];

/// Draws a picture of a coherence map; what `--json` printed.
fn render(scene: &Path, output: &Path, options: &[&str]) -> Value {
    let made = run(&[&["render", text(scene), "-o", text(output), "--json"], &MAP[..], options].concat());
    serde_json::from_slice(&made.stdout).unwrap()
}

#[test]
fn what_cannot_be_is_refused_by_the_name_of_its_flag() {
    let folder = folder();
    let (scene, picture) = (data("scenes/cornell_box.obj"), folder.path().join("out.exr"));
    let said = |options: &[&str]| fails(2, &[&["render", text(&scene), "-o", text(&picture)], options].concat());
    let whitted = [&MAP[..], &["--radiance", "whitted", "--size", "64x48"]].concat();
    for supersample in ["0", "-3", "17", "many"] {
        assert!(said(&[&MAP[..], &["--supersample", supersample]].concat()).contains("--supersample"));
    }
    for budget in ["0", "-6%", "nan"] {
        assert!(said(&[&MAP[..], &["--budget", budget]].concat()).contains("--budget"));
    }
    // 25 × 19 corners of 24 × 18 blocks.
    assert!(said(&[&whitted[..], &["--budget", "1%"]].concat()).contains("they need 475, 1.72 %"));
    assert!(said(&["--supersample", "2"]).contains("--sampler coherence-map"));
    assert!(said(&["--map", "map.png"]).contains("--sampler coherence-map"));
    assert!(said(&["--relocate"]).contains("--sampler coherence-map"));
    assert!(said(&[&MAP[..], &["--interpolation", "smooth"]].concat()).contains("--interpolation"));
    let png = folder.path().join("out.png");
    assert!(fails(2, &["render", text(&scene), "-o", text(&png), "--compare", "full.exr"]).contains(".exr"));
    assert!(said(&["--error-map", "errors.png"]).contains("--compare FULL.exr"));
    let missing = folder.path().join("missing.exr");
    assert!(fails(1, &["render", text(&scene), "-o", text(&picture), "--compare", text(&missing)]).contains("missing"));
    assert!(!picture.exists());
}

/// From a twentieth of the pixels the picture is nearly the full one, from all of them it is the same, whatever the size.
#[test]
fn few_pixels_are_near_and_all_are_equal() {
    let folder = folder();
    let [full, picture] = ["full.exr", "picture.exr"].map(|name| folder.path().join(name));
    let scene = data("scenes/gallery.obj");
    let options = ["--radiance", "whitted", "--size", "250x187"];
    let all = render(&scene, &full, &options);
    assert_eq!(all["evaluated_share"].as_f64(), Some(1.0));
    let again = [&options[..], &["--compare", text(&full)]].concat();
    let errors = folder.path().join("errors.png");
    let few = render(&scene, &picture, &[&again[..], &["--budget", "6%", "--error-map", text(&errors)]].concat());
    let (width, height, off) = formats::read_png(&errors).unwrap();
    assert_eq!((width, height), (250, 187));
    let equal = off.iter().filter(|pixel| **pixel == [200; 3]).count();
    assert!((off.len() / 10..off.len()).contains(&equal), "{equal} pixels are right");
    assert!((few["evaluated_share"].as_f64().unwrap() - 0.06).abs() < 1e-4);
    let [l1, l2] = ["l1", "l2"].map(|norm| few[norm].as_f64().unwrap());
    assert!(l1 < 0.03 && l2 < 0.08, "{l1} {l2}");
    for stage in ["evaluate", "map"] {
        assert!(few["seconds"][stage].as_f64().unwrap() > 0.0);
    }
    let more = render(&scene, &picture, &[&again[..], &["--budget", "0.2"]].concat());
    assert!(more["l1"].as_f64().unwrap() < l1 && more["l2"].as_f64().unwrap() < l2);
    let equal = render(&scene, &picture, &[&again[..], &["--budget", "100%"]].concat());
    assert_eq!((equal["l1"].as_f64(), equal["l2"].as_f64()), (Some(0.0), Some(0.0)));
    assert!(std::fs::read(&full).unwrap() == std::fs::read(&picture).unwrap());
    let other = fails(
        2,
        &[&["render", text(&scene), "-o", text(&picture), "--size", "64x48", "--compare", text(&full)], &MAP[..]]
            .concat(),
    );
    assert!(other.contains("250x187") && other.contains("64x48"));
}

#[test]
fn the_map_is_drawn_and_bytes_are_the_same_at_any_number_of_threads() {
    let folder = folder();
    let [picture, map] = ["picture.png", "map.png"].map(|name| folder.path().join(name));
    let bytes = |threads: &str| {
        let fixed =
            ["render", text(office()), "-o", text(&picture), "--map", text(&map), "--size", "90x70", "--budget", "9%"];
        halflight()
            .args(fixed)
            .args(MAP)
            .args(["--supersample", "2"])
            .env("RAYON_NUM_THREADS", threads)
            .assert()
            .success();
        [std::fs::read(&picture).unwrap(), std::fs::read(&map).unwrap()]
    };
    assert!(bytes("1") == bytes("3"));
    let (width, height, pixels) = formats::read_png(&map).unwrap();
    assert_eq!((width, height), (180, 140));
    let white = pixels.iter().filter(|pixel| **pixel == [255; 3]).count();
    assert_eq!(white, (0.09f64 * 180.0 * 140.0).round() as usize);
}

/// Direct light from single paths: the few pixels are as the whole of them is without noise, and their rays are counted.
#[test]
fn relocated_pixels_are_known_over_their_area() {
    let folder = folder();
    let [truth, picture] = ["truth.exr", "picture.exr"].map(|name| folder.path().join(name));
    let (scene, size) = (data("scenes/cornell_box.obj"), ["--size", "64x64", "--exposure", "0"]);
    render(&scene, &truth, &[&size[..], &["--radiance", "whitted", "--relocate"]].concat());
    let of_paths =
        ["--radiance", "path", "--bounces", "0", "--paths", "1", "--budget", "20%", "--compare", text(&truth)];
    let [single, relocated] = [&[][..], &["--relocate", "--interval", "0.05"]]
        .map(|options| render(&scene, &picture, &[&size[..], &of_paths, options].concat()));
    assert_eq!(single["samples"], relocated["samples"]);
    let of = |made: &Value, key: &str| made[key].as_f64().unwrap();
    for norm in ["l1", "l2"] {
        assert!(4.0 * of(&relocated, norm) < of(&single, norm), "{norm}: {relocated} {single}");
    }
    assert!(of(&relocated, "all_rays_per_pixel") > 4.0 * of(&single, "all_rays_per_pixel"));
}
