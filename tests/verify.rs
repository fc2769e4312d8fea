//! `verify`: bakes that keep their tolerance are told from those that do not, the same way every time.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::DVec3;
use serde_json::Value;

use crate::fixture::{box_faces, cornell_box, data, fails, folder, halflight, run, text, write_points, write_scene};
use crate::reference::{Part, Table, relative_rmse};

/// Runs `verify --json`; the exit code and the object.
fn verify(bake: &Path, options: &[&str]) -> (i32, Value) {
    let output = halflight().args(["verify", text(bake), "--json"]).args(options).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let report = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {said}"));
    (output.status.code().unwrap(), report)
}

/// The closed form of light: a room whose walls all emit and reflect alike has E = M/(1−ρ) everywhere. Baked once.
fn furnace() -> &'static Path {
    static FURNACE: OnceLock<PathBuf> = OnceLock::new();
    FURNACE.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("furnace");
        std::fs::create_dir_all(&folder).unwrap();
        let faces = box_faces(DVec3::ZERO, DVec3::new(3.0, 2.0, 1.5), true, &[0, 1, 2, 3, 4, 5]);
        let quads: Vec<_> = faces.into_iter().map(|corners| (corners, "wall")).collect();
        let radiance = 1.0 / PI;
        let materials = format!("newmtl wall\nKd 0.5 0.5 0.5\nKe {radiance} {radiance} {radiance}\n");
        let (scene, bake) = (write_scene(&folder, &materials, &quads), folder.join("furnace.hlf"));
        run(&["bake", text(&scene), "-o", text(&bake), "--link-error", "1e-4"]);
        bake
    })
}

/// A bake whose light is `factor` times what it was.
fn scaled(bake: &Path, factor: f32, to: &Path) {
    let mut baked = formats::read_baked(bake).unwrap();
    for sample in &mut baked.samples {
        *sample *= factor;
    }
    formats::write_baked(to, &baked).unwrap();
}

#[test]
fn a_furnace_holds_and_three_percent_more_light_do_not() {
    let folder = folder();
    let (bake, wrong) = (furnace(), folder.path().join("wrong.hlf"));
    let options = ["--tolerance", "0.01", "--points", "400", "--samples", "2048"];
    let (code, report) = verify(bake, &options);
    assert_eq!((code, report["holds"].as_bool()), (0, Some(true)), "{report}");
    assert!(report["relative_rmse"].as_f64().unwrap() < 0.004, "{report}");
    scaled(bake, 1.03, &wrong);
    let (code, report) = verify(&wrong, &options);
    assert_eq!((code, report["holds"].as_bool()), (3, Some(false)), "{report}");
    for name in ["relative_rmse", "bias"] {
        assert!((report[name].as_f64().unwrap() - 0.03).abs() < 0.003, "{name} in {report}");
    }
    // Within a wide enough tolerance the same light holds.
    assert_eq!(verify(&wrong, &["--tolerance", "0.04", "--points", "400", "--samples", "256"]).0, 0);
}

/// One triangle in thirty is far off: by the mean of squares the light is still within the tolerance.
#[test]
fn a_few_points_that_are_far_off_are_found() {
    let folder = folder();
    let (bake, wrong) = (furnace(), folder.path().join("wrong.hlf"));
    let mut baked = formats::read_baked(bake).unwrap();
    // New samples, so that the neighbours keep theirs.
    for i in (0..baked.triangles.len()).step_by(30) {
        baked.triangles[i].samples = baked.triangles[i].samples.map(|sample| {
            baked.samples.push(baked.samples[sample as usize] * 1.6);
            baked.samples.len() as u32 - 1
        });
    }
    formats::write_baked(&wrong, &baked).unwrap();
    // A thirtieth of the points off by 0.6 is a relative RMSE of 0.11; but one point in a hundred may be off by 0.55.
    let (code, report) = verify(&wrong, &["--tolerance", "0.11", "--points", "1000", "--samples", "2048"]);
    assert!(!report["percentile_holds"].as_bool().unwrap() && code == 3, "{report}");
    assert!(report["rmse_holds"].as_bool().unwrap(), "{report}");
}

/// Direct light alone is not all light, and does not pass for it.
#[test]
fn missing_bounces_are_found() {
    let folder = folder();
    let (scene, bake, wrong) =
        (data("scenes/cornell_box.obj"), folder.path().join("direct.hlf"), folder.path().join("wrong.hlf"));
    run(&["bake", text(&scene), "-o", text(&bake), "--bounces", "0"]);
    let options = ["--tolerance", "0.03", "--points", "300"];
    let (code, report) = verify(&bake, &options);
    assert_eq!((code, report["bounces"].as_u64()), (0, Some(0)), "as it was asked for it is right: {report}");
    let mut baked = formats::read_baked(&bake).unwrap();
    for (name, value) in &mut baked.provenance.options {
        if name == "bounces" {
            *value = "all".to_owned();
        }
    }
    formats::write_baked(&wrong, &baked).unwrap();
    let (code, report) = verify(&wrong, &options);
    assert_eq!(code, 3, "{report}");
    assert!(report["bounces"].is_null() && report["bias"].as_f64().unwrap() < -0.2, "{report}");
}

#[test]
fn the_bakes_own_tolerance_is_held_where_none_is_given() {
    let folder = folder();
    let (without, with) = (folder.path().join("without.hlf"), folder.path().join("with.hlf"));
    let mut baked = formats::read_baked(furnace()).unwrap();
    baked.provenance.options.retain(|(name, _)| name != "tolerance");
    formats::write_baked(&without, &baked).unwrap();
    let said = fails(2, &["verify", text(&without)]);
    assert!(said.contains("without.hlf") && said.contains("--tolerance 0.01"), "{said}");
    baked.provenance.options.push(("tolerance".to_owned(), "0.025".to_owned()));
    formats::write_baked(&with, &baked).unwrap();
    let (code, report) = verify(&with, &["--points", "100", "--samples", "64"]);
    assert_eq!((code, report["tolerance"].as_f64(), report["samples"].as_u64()), (0, Some(0.025), Some(64)));
}

#[test]
fn the_same_at_any_number_of_threads_and_another_with_another_seed() {
    let folder = folder();
    let output = |threads: &str, seed: &str| {
        let (table, picture) = (folder.path().join("table.csv"), folder.path().join("picture.png"));
        let mut command = halflight();
        command.env("RAYON_NUM_THREADS", threads);
        command.args(["verify", text(cornell_box()), "--tolerance", "0.05", "--points", "100", "--samples", "64"]);
        command.args(["-o", text(&table), "--picture", text(&picture), "--size", "64x48", "--seed", seed, "--json"]);
        let printed = command.output().unwrap().stdout;
        assert!(!printed.is_empty());
        (printed, std::fs::read(table).unwrap(), std::fs::read(picture).unwrap())
    };
    let first = output("1", "7");
    assert!(output("3", "7") == first, "three threads find something else");
    let other = output("3", "8");
    assert!(other.0 != first.0 && other.1 != first.1 && other.2 != first.2);
}

#[test]
fn the_table_and_the_report_say_the_same() {
    let folder = folder();
    let table = folder.path().join("table.csv");
    let options = ["--tolerance", "0.05", "--points", "200", "--samples", "256", "-o", text(&table)];
    let (_, report) = verify(cornell_box(), &options);
    assert_eq!(report["points"], 200);
    let worst = report["worst"].as_array().unwrap();
    assert_eq!(worst.len(), 10);
    let scene = formats::read_baked(cornell_box()).unwrap().scene;
    for point in worst {
        let polygon = point["polygon"].as_u64().unwrap() as usize;
        let object = scene.polygons[polygon].object as usize;
        assert_eq!(point["object"], scene.objects[object], "{point}");
        for name in ["position", "normal", "irradiance", "reference", "standard_error"] {
            assert_eq!(point[name].as_array().unwrap().len(), 3, "{name} in {point}");
        }
    }
    for (lower, higher) in [("p50", "p95"), ("p95", "p99")] {
        assert!(report[lower].as_f64() <= report[higher].as_f64(), "{report}");
    }
    // The measure of tests/reference.rs takes its scale from the reference itself, so it agrees but for the noise.
    let table = Table::read(&table);
    let (measured, reported) = (relative_rmse(&table, &table, Part::Total), report["relative_rmse"].as_f64().unwrap());
    let error = 3.0 * report["standard_error"].as_f64().unwrap();
    assert!((measured - reported).abs() < error, "{measured} {reported} ± {error}");
}

#[test]
fn a_person_reads_a_table() {
    let output = halflight()
        .args(["verify", text(cornell_box()), "--tolerance", "0.5", "--points", "100", "--samples", "64"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    let printed = String::from_utf8(output.stdout).unwrap();
    for part in ["relative RMSE", "99 %", "bias", "verdict          holds", "polygon  object", "paths each"] {
        assert!(printed.contains(part), "{part:?} is missing in {printed}");
    }
    assert!(String::from_utf8(output.stderr).unwrap().contains("paths a point"));
}

/// `probe --method path` against the closed form, with its standard errors.
#[test]
fn probed_paths_know_their_error() {
    let folder = folder();
    let bake = furnace();
    let (center, empty) = ((DVec3::new(1.0, 1.0, 0.0), DVec3::Z), (DVec3::new(1.0, 1.0, 0.7), DVec3::Z));
    let points = write_points(folder.path(), [center, empty].into_iter());
    let probe = |threads: &str, options: &[&str]| {
        let mut command = halflight();
        command.env("RAYON_NUM_THREADS", threads);
        command.args(["probe", text(bake), "--points", text(&points), "--method", "path"]).args(options);
        let output = command.output().unwrap();
        assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("1 of 2 points"));
        String::from_utf8(output.stdout).unwrap()
    };
    let table = probe("1", &["--samples", "2048"]);
    assert_eq!(table, probe("3", &["--samples", "2048"]));
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "x,y,z,nx,ny,nz,er,eg,eb,sr,sg,sb");
    assert!(lines[2].ends_with(",,,,,,"), "{table}");
    let numbers: Vec<f64> = lines[1].split(',').map(|field| field.parse().unwrap()).collect();
    assert!((numbers[6] - 2.0).abs() < 5.0 * numbers[9] && numbers[9] < 0.05, "{table}");
    // Direct light alone: the walls' own exitance of 1, whatever was baked.
    let direct = probe("2", &["--samples", "2048", "--bounces", "0"]);
    let numbers: Vec<f64> = direct.lines().nth(1).unwrap().split(',').map(|field| field.parse().unwrap()).collect();
    assert!((numbers[6] - 1.0).abs() < 5.0 * numbers[9] + 1e-9, "{direct}");
}
