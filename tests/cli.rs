//! The program as a user meets it: exit codes, and messages that name the file or the flag, the cause and the cure.

use std::path::{Path, PathBuf};

use predicates::prelude::*;
use serde_json::Value;

use crate::fixture::{cornell_box, data, fails, folder, halflight, office, run, text};

/// A lit room in a folder, with the text of its OBJ changed by `change`.
fn scene(folder: &Path, change: impl Fn(String) -> String) -> PathBuf {
    let obj = std::fs::read_to_string(data("scenes/blocker_plane.obj")).unwrap();
    std::fs::copy(data("scenes/blocker_plane.mtl"), folder.join("blocker_plane.mtl")).unwrap();
    let path = folder.join("scene.obj");
    std::fs::write(&path, change(obj)).unwrap();
    path
}

/// The names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// `bake` of a scene fails with a message that holds all of `parts`, and leaves nothing.
fn bake_fails(change: impl Fn(String) -> String, parts: &[&str]) {
    let folder = folder();
    let (scene, output) = (scene(folder.path(), change), folder.path().join("out.hlf"));
    let said = fails(1, &["bake", text(&scene), "-o", text(&output)]);
    for part in parts {
        assert!(said.contains(part), "{part:?} is missing in {said:?}");
    }
    assert_eq!(names(folder.path()), ["blocker_plane.mtl", "scene.obj"]);
}

/// `bake` of a scene succeeds with a warning that holds all of `parts`.
fn bake_warns(change: impl Fn(String) -> String, parts: &[&str]) {
    let folder = folder();
    let (scene, output) = (scene(folder.path(), change), folder.path().join("out.hlf"));
    let said = String::from_utf8(run(&["bake", text(&scene), "-o", text(&output)]).stderr).unwrap();
    for part in parts.iter().chain(&["halflight: warning: "]) {
        assert!(said.contains(part), "{part:?} is missing in {said:?}");
    }
    assert!(output.exists());
}

#[test]
fn a_missing_file() {
    let folder = folder();
    let (scene, output) = (folder.path().join("missing.obj"), folder.path().join("out.hlf"));
    let said = fails(1, &["bake", text(&scene), "-o", text(&output)]);
    assert!(said.contains("missing.obj") && said.contains("check the path"), "{said}");
    assert!(names(folder.path()).is_empty());
    let bake = folder.path().join("missing.hlf");
    for arguments in [
        vec!["info"],
        vec!["view"],
        vec!["shot", "-o", "a.png"],
        vec!["verify"],
        vec!["probe", "--points", text(&scene)],
    ] {
        let said = fails(1, &[arguments.as_slice(), &[text(&bake)]].concat());
        assert!(said.contains("missing."), "{said}");
    }
}

#[test]
fn a_missing_material_library_is_grey_and_dark() {
    let dark = |obj: String| obj.replace("mtllib blocker_plane.mtl", "mtllib other.mtl");
    bake_fails(dark, &["other.mtl", "grey", "nothing emits light", "Ke"]);
}

#[test]
fn coordinates_that_are_no_numbers_or_absurd() {
    for value in ["nan", "inf", "-inf", "1e300", "1e9", "five"] {
        bake_fails(|obj| obj.replacen("v -2 -2 0", &format!("v -2 {value} 0"), 1), &["scene.obj", "line 3"]);
    }
}

#[test]
fn indices_out_of_range() {
    for face in ["f 1 2 3 99", "f -99 -2 -1", "f 0 1 2", "f 1 2 99999999999999999999"] {
        bake_fails(|obj| obj.replacen("f 1 2 3 4", face, 1), &["scene.obj", "line 17"]);
    }
}

#[test]
fn faces_without_area_are_counted_and_skipped() {
    bake_warns(|obj| obj + "f 1 2\nf 1 1 2\nf 1 2 2 1\n", &["3 faces", "line 24", "skipped"]);
}

#[test]
fn bent_faces_are_counted_and_split() {
    bake_warns(|obj| obj.replace("v 2 2 0", "v 2 2 0.3"), &["1 face", "line 17", "split"]);
}

#[test]
fn a_scene_that_does_not_emit() {
    let folder = folder();
    let (scene, output) = (scene(folder.path(), |obj| obj), folder.path().join("out"));
    std::fs::write(folder.path().join("blocker_plane.mtl"), "newmtl floor\nnewmtl blocker\nnewmtl light\n").unwrap();
    for arguments in [["bake", "hlf"], ["shot", "png"], ["verify", "csv"]] {
        let output = output.with_extension(arguments[1]);
        let said = fails(1, &[arguments[0], text(&scene), "-o", text(&output)]);
        assert!(said.contains("scene.obj") && said.contains("Ke 10 10 10"), "{said}");
        assert!(!output.exists());
    }
    run(&["info", text(&scene)]);
}

#[test]
fn an_empty_scene_or_another_kind_of_file() {
    bake_fails(|_| String::new(), &["scene.obj", "no face"]);
    let folder = folder();
    let (scene, output) = (folder.path().join("scene.xyz"), folder.path().join("out.hlf"));
    std::fs::write(&scene, "hello").unwrap();
    let said = fails(1, &["bake", text(&scene), "-o", text(&output)]);
    assert!(said.contains("scene.xyz") && said.contains(".obj"), "{said}");
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_work() {
    let (folder, scene) = (folder(), data("scenes/office.obj"));
    std::fs::write(folder.path().join("file"), "").unwrap();
    for output in ["missing/out.hlf", "file/out.hlf", "."] {
        let output = folder.path().join(output);
        let said = fails(1, &["bake", text(&scene), "-o", text(&output)]);
        assert!(said.contains(text(&output)) && !said.contains("took"), "{said}");
    }
    let output = folder.path().join("missing/out.png");
    assert!(fails(1, &["shot", text(&scene), "-o", text(&output)]).contains("out.png"));
    let output = folder.path().join("missing/out.csv");
    let points = data("reference/blocker_plane.csv");
    assert!(fails(1, &["probe", text(&scene), "--points", text(&points), "-o", text(&output)]).contains("out.csv"));
}

#[test]
fn wrong_flags_are_wrong_usage() {
    for (arguments, part) in [
        ("bake a.obj -o a.hlf --min-weight -1", "--min-weight"),
        ("bake a.obj -o a.hlf --link-error nan", "--link-error"),
        ("bake a.obj -o a.hlf --link-error 0", "more than 0"),
        ("bake a.obj -o a.hlf --bounces -1", "--bounces"),
        ("bake a.obj -o a.hlf --discontinuities many", "--discontinuities"),
        ("bake a.obj", "--output"),
        ("bake", "<SCENE>"),
        ("shot a.hlf -o a.png --size 0x0", "--size"),
        ("shot a.hlf -o a.png --size 640", "640x480"),
        ("shot a.hlf -o a.png --eye 0,0,0 --target 1,0,0 --fov 0", "--fov"),
        ("shot a.hlf -o a.png --eye 0,0,0 --target 1,0,0 --fov 180", "--fov"),
        ("shot a.hlf -o a.png --eye 1,2,3 --target 1,2,3", "--eye and --target"),
        ("shot a.hlf -o a.png --eye 0,0,0 --target 0,0,1", "--up"),
        ("shot a.hlf -o a.png --eye 0,nan,0 --target 0,0,1", "--eye"),
        ("shot a.hlf -o a.png --camera a --eye 0,0,0 --target 0,0,1", "--camera"),
        ("shot a.hlf -o a.jpg", ".png or .exr"),
        ("shot a.hlf -o a.png --mode pretty", "shaded"),
        ("shot a.hlf -o a.png --backend tpu", "cpu"),
        ("shot a.hlf -o a.png --exposure nan", "--exposure"),
        ("shot a.hlf -o a.png --compare b.png --max-error -1", "--max-error"),
        ("probe a.hlf", "--points"),
        ("probe a.hlf --points a.csv --method guess", "gather"),
        ("probe a.hlf --points a.csv --samples 64", "--method path"),
        ("verify a.hlf --tolerance 0", "between 0 and 1"),
        ("verify a.hlf --tolerance 1", "--tolerance"),
        ("verify a.hlf --tolerance -0.01", "--tolerance"),
        ("verify a.hlf --points 10", "--points"),
        ("verify a.hlf --samples 0", "--samples"),
        ("verify a.hlf --picture a.exr", ".png"),
        ("verify a.hlf --eye 0,0,0", "--target"),
        ("verify", "<SCENE|OUT.hlf>"),
        ("polish a.hlf", "polish"),
        ("info a.hlf --no-such-flag", "--no-such-flag"),
        ("validate a.hlf", "a.hlf"),
    ] {
        let said = fails(2, &arguments.split(' ').collect::<Vec<_>>());
        assert!(said.contains(part), "{arguments}: {part:?} is missing in {said:?}");
    }
    let said = fails(2, &["shot", text(office()), "-o", "a.png", "--camera", "nobody"]);
    assert!(said.contains("--camera nobody") && said.contains("its cameras are camera"), "{said}");
    let said =
        fails(2, &["verify", text(cornell_box()), "--tolerance", "0.1", "--picture", "a.png", "--camera", "nobody"]);
    assert!(said.contains("--camera nobody"), "{said}");
    let points = data("reference/cornell_box.csv");
    let said = fails(2, &["probe", text(cornell_box()), "--points", text(&points), "--bounces", "1"]);
    assert!(said.contains("--method gather"), "{said}");
}

#[test]
fn help_and_version_are_no_errors() {
    for arguments in [&["--help"][..], &["--version"], &["help", "shot"], &["bake", "--help"]] {
        halflight().args(arguments).assert().success().stderr("").stdout(predicate::str::is_empty().not());
    }
    let version = format!("halflight {}\n", env!("CARGO_PKG_VERSION"));
    halflight().arg("--version").assert().stdout(version);
}

#[test]
fn bake_prints_one_object() {
    let folder = folder();
    let output = folder.path().join("out.hlf");
    let found = run(&["bake", text(&data("scenes/blocker_plane.obj")), "-o", text(&output), "--json"]);
    let report: Value = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!(report["polygons"], 3);
    for name in ["elements", "links", "link_bytes", "blockers", "blocker_bytes", "triangles", "samples"] {
        assert!(report[name].as_u64().unwrap() > 0, "{name} in {report}");
    }
    assert!(report["discontinuities_found"].as_u64() >= report["discontinuities_kept"].as_u64(), "{report}");
    for name in ["import", "solve", "mesh", "write"] {
        assert!(report["seconds"][name].as_f64().unwrap() >= 0.0, "{name} in {report}");
    }
    assert!(report["error"]["rms"].as_f64().unwrap() <= report["error"]["max"].as_f64().unwrap(), "{report}");
    assert!(report["error"]["points"].as_u64().unwrap() > 0, "{report}");
    assert_eq!(report["peak_memory_bytes"].is_u64(), cfg!(target_os = "linux"));
    assert_eq!(names(folder.path()), ["out.hlf"]);

    let info: Value = serde_json::from_slice(&run(&["info", text(&output), "--json"]).stdout).unwrap();
    assert_eq!(info["bake"]["triangles"], report["triangles"]);
    assert_eq!(info["scene"]["polygons"], 3);
    let plain = String::from_utf8(run(&["info", text(&output)]).stdout).unwrap();
    assert!(plain.contains("3 polygons") && plain.contains("link-error"), "{plain}");
}

#[test]
fn a_picture_compared_with_itself_and_with_another() {
    let folder = folder();
    for kind in ["png", "exr"] {
        let path = |name: &str| folder.path().join(name).with_extension(kind);
        let (first, second) = (path("first"), path("second"));
        let shot = |output: &Path| {
            let mut command = halflight();
            command.args(["shot", text(cornell_box()), "--size", "64x64", "--backend", "cpu", "-o", text(output)]);
            command
        };
        shot(&first).assert().success();
        shot(&second).args(["--compare", text(&first), "--max-error", "0"]).assert().success();
        let mut other = shot(&second);
        other.args(["--eye", "0.3,0.3,0.1", "--target", "0.3,0.3,0.5", "--up", "0,1,0", "--json"]);
        let found = other.args(["--compare", text(&first), "--max-error", "0.01"]).output().unwrap();
        assert_eq!(found.status.code(), Some(3));
        assert!(String::from_utf8(found.stderr).unwrap().contains("--max-error 0.01"));
        let report: Value = serde_json::from_slice(&found.stdout).unwrap();
        assert!(report["error"].as_f64().unwrap() > 0.01, "{report}");
        assert_eq!(report["drawn_by"], "cpu");
        // Another size is wrong usage, a reference that is none a failure.
        let (first, second) = (text(&first), text(&second));
        let compare = ["shot", text(cornell_box()), "-o", second, "--max-error", "0", "--compare"];
        assert!(fails(2, &[&compare[..], &[first, "--size", "65x64"]].concat()).contains("--size 64x64"));
        let broken = path("broken");
        std::fs::write(&broken, "no picture").unwrap();
        assert!(fails(1, &[&compare[..], &[text(&broken)]].concat()).contains("broken"));
    }
}

#[test]
fn a_point_that_meets_nothing_has_empty_fields_and_is_counted() {
    let folder = folder();
    let points = folder.path().join("points.csv");
    std::fs::write(&points, "x,y,z,nx,ny,nz\n1,1,0,0,0,1\n1,1,0.5,0,0,1\n1,1,0,0,0,-1\n").unwrap();
    for method in ["interpolant", "gather", "path"] {
        let scene = data("scenes/blocker_plane.obj");
        let found = run(&["probe", text(&scene), "--points", text(&points), "--method", method]);
        let table = String::from_utf8(found.stdout).unwrap();
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[0].starts_with("x,y,z,nx,ny,nz,er,eg,eb"), "{table}");
        assert_eq!(lines[0].ends_with("eb,sr,sg,sb"), method == "path");
        assert!(!lines[1].ends_with(",,,"), "{table}");
        assert!(lines[2].ends_with(",,,") && lines[3].ends_with(",,,"), "{table}");
        assert!(String::from_utf8(found.stderr).unwrap().contains("2 of 3 points"));
    }
    std::fs::write(&points, "x,y,z,nx,ny,nz\n1,1,0,0,0,1\n1,1,here,0,0,1\n").unwrap();
    let said = fails(1, &["probe", text(cornell_box()), "--points", text(&points)]);
    assert!(said.contains("points.csv") && said.contains("line 3"), "{said}");
}

#[test]
fn a_scene_is_baked_once_for_its_content() {
    let (cache, folder) = (folder(), folder());
    let (obj, picture) = (scene(folder.path(), |obj| obj), folder.path().join("a.png"));
    let shot = |scene: &Path| {
        let mut command = halflight();
        command.env("XDG_CACHE_HOME", cache.path()).args(["shot", text(scene), "-o", text(&picture), "--size", "8x8"]);
        let found = command.output().unwrap();
        assert!(found.status.success());
        String::from_utf8(found.stderr).unwrap().contains("mesh took")
    };
    assert!(shot(&obj), "the first shot bakes");
    assert!(!shot(&obj), "the second finds the bake");
    let kept = cache.path().join("halflight");
    assert_eq!(names(&kept).len(), 1);
    // Damage is noticed, and repaired.
    let bake = kept.join(&names(&kept)[0]);
    std::fs::write(&bake, "damaged").unwrap();
    assert!(shot(&obj));
    // Another light is another scene, although the OBJ is the same.
    let mtl = folder.path().join("blocker_plane.mtl");
    let text = std::fs::read_to_string(&mtl).unwrap();
    std::fs::write(&mtl, text.replace("Ke 10 10 10", "Ke 10 10 11")).unwrap();
    assert!(shot(&obj));
    assert_eq!(names(&kept).len(), 2);
}

/// Interrupted in the midst of its work, a bake leaves nothing behind.
#[cfg(unix)]
#[test]
fn an_interrupted_bake_leaves_nothing() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let folder = folder();
    let mut bake = Command::new(env!("CARGO_BIN_EXE_halflight"))
        .args(["bake", text(&data("scenes/office.obj")), "-o", text(&folder.path().join("out.hlf"))])
        .args(["--link-error", "1e-6"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Its first words are those of the import: it listens to signals by then, and has minutes of work before it.
    let mut said = BufReader::new(bake.stderr.take().unwrap());
    said.read_line(&mut String::new()).unwrap();
    assert!(Command::new("kill").args(["-INT", &bake.id().to_string()]).status().unwrap().success());
    assert_eq!(bake.wait().unwrap().code(), Some(130));
    assert!(names(folder.path()).is_empty());
}

/// A bake that may not take what its tolerance needs is written all the same, marked, and the exit code says so.
#[test]
fn a_tolerance_that_is_out_of_reach() {
    let folder = folder();
    let (scene, output) = (data("scenes/cornell_box.obj"), folder.path().join("out.hlf"));
    for limit in [["--max-triangles", "100"], ["--max-seconds", "0.001"]] {
        let arguments = [&["bake", text(&scene), "-o", text(&output), "--tolerance", "0.001"], &limit[..]].concat();
        let run = halflight().args(&arguments).output().unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(3), "{said}");
        assert!(said.contains("does not keep --tolerance 0.001"), "{said}");
        let info = String::from_utf8(crate::fixture::run(&["info", text(&output)]).stdout).unwrap();
        assert!(info.contains("the tolerance is not kept"), "{info}");
        std::fs::remove_file(&output).unwrap();
    }
    for limit in [["--max-triangles", "0"], ["--max-seconds", "0"], ["--max-seconds", "nan"]] {
        let arguments = [&["bake", text(&scene), "-o", text(&output)], &limit[..]].concat();
        assert!(fails(2, &arguments).contains(limit[0]));
    }
}

/// A room whose walls are inside out: `info` says so and names the cure, and with it they are lit.
#[test]
fn what_is_inside_out_is_said_and_two_sided_cures_it() {
    let folder = folder();
    let turned = |obj: String| {
        let turn = |line: &str| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}", corners.split_whitespace().rev().collect::<Vec<_>>().join(" ")),
            None => line.to_owned(),
        };
        obj.lines().map(turn).collect::<Vec<_>>().join("\n")
    };
    let obj = std::fs::read_to_string(data("scenes/cornell_box.obj")).unwrap();
    std::fs::copy(data("scenes/cornell_box.mtl"), folder.path().join("cornell_box.mtl")).unwrap();
    let path = folder.path().join("turned.obj");
    std::fs::write(&path, turned(obj)).unwrap();
    let doubts =
        |said: &std::process::Output| String::from_utf8_lossy(&said.stderr).matches("the wrong way round").count();
    let as_wound = run(&["info", text(&path), "--json"]);
    assert!(doubts(&as_wound) >= 1, "{}", String::from_utf8_lossy(&as_wound.stderr));
    let info: Value = serde_json::from_slice(&as_wound.stdout).unwrap();
    assert_eq!((&info["import"]["polygons_read"], &info["import"]["other_sides"]), (&20.into(), &0.into()));
    assert!(info["import"]["warnings"][0].as_str().unwrap().contains("--two-sided"));
    let both = run(&["info", text(&path), "--two-sided"]);
    assert_eq!(doubts(&both), 0, "{}", String::from_utf8_lossy(&both.stderr));
    assert!(String::from_utf8(both.stdout).unwrap().contains("other sides added"));
    // A scene file over it is read as it would be itself, but for what it says of a material.
    let file = folder.path().join("turned.toml");
    let added = |text_of_file: &str| {
        std::fs::write(&file, text_of_file).unwrap();
        let info: Value = serde_json::from_slice(&run(&["info", text(&file), "--two-sided", "--json"]).stdout).unwrap();
        info["import"]["other_sides"].as_u64().unwrap()
    };
    let [all, but_red] = ["", "[material.red]\ntwo_sided = false\n"]
        .map(|materials| added(&format!("[[model]]\nfile = \"turned.obj\"\n{materials}")));
    assert!(all > 2 && but_red == all - 2, "{all} {but_red}");
}

#[test]
fn two_sided_is_for_scenes() {
    let said = fails(2, &["info", "--two-sided", text(cornell_box())]);
    assert!(said.contains("--two-sided") && said.contains("is a bake"), "{said}");
}
