//! Pictures from samples: what the samplers are handed agrees with each other, adaptive ones are nearer to the truth than even
//! ones, and whatever is asked, a picture or a clear word comes of it.

use std::path::{Path, PathBuf};

use glam::Vec3;
use serde_json::Value;

use crate::fixture::{cornell_box, cornell_box_direct, data, fails, folder, halflight, office, run, text};

/// Draws a picture; what `--json` printed.
fn render(scene: &Path, output: &Path, options: &[&str]) -> Value {
    let made = run(&[&["render", text(scene), "-o", text(output), "--json"], options].concat());
    serde_json::from_slice(&made.stdout).unwrap()
}

/// The radiance of a picture.
fn radiance(scene: &Path, folder: &Path, options: &[&str]) -> Vec<Vec3> {
    let output = folder.join("picture.exr");
    render(scene, &output, options);
    formats::read_exr(&output).unwrap().2
}

/// The root mean square of a picture's difference from another, relative to the other's mean.
fn apart(picture: &[Vec3], truth: &[Vec3]) -> f64 {
    assert_eq!(picture.len(), truth.len());
    let mean = truth.iter().map(|pixel| f64::from(pixel.element_sum())).sum::<f64>() / truth.len() as f64;
    let squares = picture.iter().zip(truth).map(|(a, b)| f64::from((*a - *b).length_squared()));
    (3.0 * squares.sum::<f64>() / truth.len() as f64).sqrt() / mean
}

#[test]
fn what_cannot_be_is_refused_by_the_name_of_its_flag() {
    let folder = folder();
    let (scene, picture) = (data("scenes/cornell_box.obj"), folder.path().join("out.png"));
    let said = |options: &[&str]| fails(2, &[&["render", text(&scene), "-o", text(&picture)], options].concat());
    for budget in ["0", "-1", "0rpp", "-3s", "0%", "nan", "infs", "much", "5 apples", ""] {
        assert!(said(&["--budget", budget]).contains("--budget"), "{budget}");
    }
    for interval in ["0", "-0.1", "nan", "inf"] {
        assert!(said(&["--interval", interval]).contains("--interval"));
    }
    for level in ["0", "1", "-0.5", "1.5", "nan"] {
        assert!(said(&["--level", level]).contains("--level"));
    }
    for size in ["0x0", "0x480", "-640x480", "99999x1", "640"] {
        assert!(said(&["--size", size]).contains("--size"));
    }
    assert!(said(&["--sampler", "full", "--budget", "5s"]).contains("rays per pixel"));
    assert!(said(&["--paths", "4"]).contains("--radiance path"));
    assert!(said(&["--radiance", "whitted", "--bounces", "2"]).contains("--bounces"));
    assert!(said(&["--camera", "nowhere"]).contains("--camera"));
    assert!(said(&["--eye", "0,0,0", "--target", "0,0,0"]).contains("--eye and --target"));
    assert!(fails(2, &["render", text(&scene), "-o", "a.jpg"]).contains(".png or .exr"));
    assert!(fails(2, &["render", text(cornell_box()), "-o", text(&picture), "--bounces", "3"]).contains("all bounces"));
    assert!(fails(1, &["render", text(&scene), "-o", text(&folder.path().join("no/a.png"))]).contains("folder exists"));
    assert!(!picture.exists());
}

#[test]
fn a_dark_scene_is_refused_with_the_cure() {
    let folder = folder();
    let scene = folder.path().join("dark.obj");
    std::fs::write(&scene, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap();
    let picture = folder.path().join("out.png");
    for kind in ["path", "gather", "interpolant", "whitted"] {
        let said = fails(1, &["render", text(&scene), "-o", text(&picture), "--radiance", kind]);
        assert!(said.contains("Ke 10 10 10"), "{said}");
    }
    assert!(!picture.exists());
}

/// Four ways to the same light, at the same samples.
#[test]
fn what_samples_see_agrees() {
    let folder = folder();
    let even = ["--size", "40x40", "--sampler", "full", "--budget", "4", "--filter", "box"];
    let seen = |scene: &Path, kind: &str, options: &[&str]| {
        radiance(scene, folder.path(), &[&even[..], &["--radiance", kind], options].concat())
    };
    let interpolated = seen(cornell_box(), "interpolant", &[]);
    let gathered = seen(cornell_box(), "gather", &[]);
    assert!(apart(&gathered, &interpolated) < 5e-3, "{}", apart(&gathered, &interpolated));
    let traced = seen(&data("scenes/cornell_box.obj"), "path", &["--paths", "64"]);
    assert!(apart(&traced, &interpolated) < 0.05, "{}", apart(&traced, &interpolated));
    let direct = seen(cornell_box_direct(), "interpolant", &[]);
    let whitted = seen(&data("scenes/cornell_box.obj"), "whitted", &[]);
    assert!(apart(&whitted, &direct) < 5e-3, "{}", apart(&whitted, &direct));
    assert!(apart(&direct, &interpolated) > 0.2, "direct light is less than all of it");
}

/// The light in the middle of a pixel is that of `shot`: within flat parts of the picture their pixels are the same.
#[test]
fn a_picture_is_the_one_that_shot_draws() {
    let folder = folder();
    let (ours, theirs) = (folder.path().join("ours.exr"), folder.path().join("theirs.exr"));
    let size = ["--size", "80x60"];
    run(&[&["shot", text(office()), "-o", text(&theirs), "--backend", "cpu"], &size[..]].concat());
    render(office(), &ours, &[&size[..], &["--filter", "box", "--sampler", "full", "--budget", "9"]].concat());
    let [ours, theirs] = [&ours, &theirs].map(|path| formats::read_exr(path).unwrap().2);
    let near = |(a, b): (&Vec3, &Vec3)| (*a - *b).length() < 0.05 * b.length();
    let count = ours.iter().zip(&theirs).filter(|&pair| near(pair)).count();
    assert!(count * 10 > ours.len() * 8, "{count} of {} pixels", ours.len());
}

/// The RMSE of the light that is shown against many samples a pixel: nowhere more than that of as many even samples, and at
/// most half of it once there is a sample a pixel.
#[test]
fn adaptive_pictures_are_nearer_than_even_ones() {
    let folder = folder();
    let shown = |scene: &Path, options: &[&str]| {
        let output = folder.path().join("picture.png");
        let common = ["--size", "96x96", "--radiance", "whitted", "--filter", "box", "--exposure", "1"];
        let made = render(scene, &output, &[&common[..], options].concat());
        let (_, _, pixels) = formats::read_png(&output).unwrap();
        (made, pixels.iter().map(|pixel| Vec3::from(pixel.map(scene::decode_srgb))).collect::<Vec<Vec3>>())
    };
    for scene in ["lamp.obj", "office.obj", "office_evening.toml", "cornell_box.obj"] {
        let scene = data(&format!("scenes/{scene}"));
        let (_, truth) = shown(&scene, &["--sampler", "full", "--budget", "64"]);
        for (budget, least) in [("0.25", 1.0), ("1", 2.0)] {
            let (made, ours) = shown(&scene, &["--budget", budget]);
            assert_eq!(made["rays_per_pixel"].as_f64().unwrap().to_string(), budget);
            let (_, even) = shown(&scene, &["--sampler", "full", "--budget", budget]);
            let [ours, even] = [ours, even].map(|picture| apart(&picture, &truth));
            assert!(ours * least <= even, "{}, {budget} a pixel: {ours}, and even {even}", scene.display());
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_at_any_number_of_threads() {
    let folder = folder();
    let picture = |threads: &str, options: &[&str]| {
        let output = folder.path().join("picture.png");
        let scene = data("scenes/cornell_box.obj");
        let fixed =
            ["render", text(&scene), "-o", text(&output), "--size", "90x70", "--radiance", "path", "--budget", "1.5"];
        let mut command = halflight();
        command.args(fixed).args(options).env("RAYON_NUM_THREADS", threads).assert().success();
        std::fs::read(&output).unwrap()
    };
    for options in [&[][..], &["--interpolation", "smooth"], &["--sampler", "full"]] {
        assert!(picture("1", options) == picture("3", options), "{options:?}");
    }
    assert!(picture("2", &[]) != picture("2", &["--seed", "2"]));
}

#[test]
fn what_was_done_is_told() {
    let folder = folder();
    let (map, snapshots) = (folder.path().join("map.png"), folder.path().join("deep/snapshots"));
    let output = folder.path().join("picture.png");
    let options =
        ["--size", "64x48", "--sample-map", text(&map), "--snapshots", text(&snapshots), "--radiance", "whitted"];
    let made = render(&data("scenes/office.obj"), &output, &options);
    let (samples, pixels) = (made["samples"].as_u64().unwrap(), 64 * 48);
    assert_eq!(made["closed_share"].as_f64(), Some(1.0));
    assert_eq!(made["rays_per_pixel"].as_f64().unwrap(), samples as f64 / f64::from(pixels));
    let histogram: Vec<u64> = made["histogram"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
    assert_eq!((histogram.len(), histogram[0], histogram.iter().sum()), (22, 0, u64::from(pixels as u32)));
    for stage in ["generate", "evaluate", "reconstruct"] {
        assert!(made["seconds"][stage].as_f64().unwrap() > 0.0);
    }
    let (_, _, map) = formats::read_png(&map).unwrap();
    let red = map.iter().filter(|pixel| **pixel == [255, 0, 0]).count() as u64;
    assert_eq!(red, histogram[21]);
    let mut names: Vec<PathBuf> = std::fs::read_dir(&snapshots).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    let counts: Vec<u64> =
        names.iter().map(|path| path.file_stem().unwrap().to_str().unwrap().parse().unwrap()).collect();
    assert!(counts.len() >= 3 && counts[0] >= 1024 && counts.windows(2).all(|pair| pair[0] < pair[1]), "{counts:?}");
    assert!(names.iter().all(|path| formats::read_png(path).unwrap().2.len() == 64 * 48));
    // A share of the pixels, and a budget that no picture needs.
    let few =
        render(&data("scenes/office.obj"), &output, &["--size", "64x48", "--radiance", "whitted", "--budget", "6%"]);
    assert_eq!(few["samples"].as_u64(), Some((0.06 * f64::from(pixels)).round() as u64));
    assert!(few["closed_share"].as_f64().unwrap() < 1.0);
}

/// Light that is no finite number is left out, counted and said; the picture is finite.
#[test]
fn light_that_is_no_number_is_left_out() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    let model = data("scenes/office.obj");
    let light = "[[light]]\nposition = [2, 2, 1.5]\nintensity = 1e300\n";
    std::fs::write(&scene, format!("up = \"z\"\n[[model]]\nfile = {:?}\n{light}", text(&model))).unwrap();
    let output = folder.path().join("out.exr");
    let arguments = [
        "render",
        text(&scene),
        "-o",
        text(&output),
        "--size",
        "48x36",
        "--radiance",
        "whitted",
        "--exposure",
        "0",
        "--json",
    ];
    let made = run(&arguments);
    let said = String::from_utf8(made.stderr).unwrap();
    let report: Value = serde_json::from_slice(&made.stdout).unwrap();
    let excluded = report["excluded"].as_u64().unwrap();
    assert!(
        excluded > 1000 && said.contains(&format!("{excluded} of")) && said.contains("no finite radiance"),
        "{said}"
    );
    assert!(formats::read_exr(&output).unwrap().2.iter().all(|pixel| pixel.is_finite()));
}

/// A mirror shows the lamp above it, highlights tend to that, and a bake takes neither.
#[test]
fn mirrors_and_lights_without_a_surface_are_seen() {
    let folder = folder();
    let scene = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    scene("floor.obj", "mtllib floor.mtl\nusemtl floor\nv -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n");
    scene("floor.mtl", "newmtl floor\nKd 0.4\n");
    let camera = "[[camera]]\nname = \"c\"\neye = [0, -3, 3]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\n";
    let model = "up = \"z\"\n[[model]]\nfile = \"floor.obj\"\n";
    let light = "[[light]]\ntowards = [0, 0, 1]\nirradiance = 3\n";
    let options = ["--size", "9x9", "--radiance", "whitted", "--filter", "box"];
    let lit = radiance(&scene("lit.toml", &format!("{model}{camera}{light}")), folder.path(), &options);
    // L = ρE/π, the sun overhead.
    assert!((lit[40] - Vec3::splat(0.4 * 3.0 / std::f32::consts::PI)).length() < 1e-5, "{}", lit[40]);
    let towards = light.replace("[0, 0, 1]", "[0, 1, 1]");
    let gloss = "[material.floor]\nspecular = 0.5\nexponent = 200\n";
    let shines = radiance(&scene("gloss.toml", &format!("{model}{camera}{towards}{gloss}")), folder.path(), &options);
    assert!(shines[40].x > 5.0 * lit[40].x, "the mirrored sun: {}", shines[40]);
    // A bake of it has no light, and says why.
    let said = fails(1, &["bake", text(&folder.path().join("lit.toml")), "-o", text(&folder.path().join("a.hlf"))]);
    assert!(said.contains("passed over") && said.contains("nothing emits light"), "{said}");
}

/// Ctrl-C: the picture so far is written.
#[cfg(unix)]
#[test]
fn an_interrupted_picture_is_the_one_so_far() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let folder = folder();
    let (output, snapshots) = (folder.path().join("out.png"), folder.path().join("snapshots"));
    let scene = data("scenes/cornell_box.obj");
    let arguments =
        ["render", text(&scene), "-o", text(&output), "--size", "400x400", "--radiance", "path", "--paths", "64"];
    let mut render = Command::new(env!("CARGO_BIN_EXE_halflight"))
        .args(arguments)
        .args(["--json", "--snapshots", text(&snapshots)])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !std::fs::read_dir(&snapshots).is_ok_and(|mut entries| entries.next().is_some()) {
        assert!(render.try_wait().unwrap().is_none() && start.elapsed() < Duration::from_secs(100), "no snapshot");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &render.id().to_string()]).status().unwrap().success());
    let ended = render.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("sampled so far") && !said.contains("panicked"), "{said}");
    let report: Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert!(report["interrupted"] == true && report["samples"].as_u64().unwrap() >= 1024);
    let (width, height, pixels) = formats::read_png(&output).unwrap();
    assert!((width, height) == (400, 400) && pixels.iter().filter(|pixel| **pixel != [0; 3]).count() > 100_000);
}
