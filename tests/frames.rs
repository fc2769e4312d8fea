//! Many frames at once: pictures along a path, and how long frames take.

use serde_json::Value;

use crate::fixture::{cornell_box, fails, folder, run, text};

const WALK: &str = "[[camera]]\neye = [0.3, 0.3, -0.5]\ntarget = [0.3, 0.3, 0.5]\nup = [0, 1, 0]\nfov = 50\n\
                    [[camera]]\neye = [0.4, 0.2, -0.6]\ntarget = [0.2, 0.3, 0.5]\nup = [0, 1, 0]\nfov = 60\n";

#[test]
fn a_path_that_is_none_is_refused_with_its_line() {
    let folder = folder();
    let (path, picture) = (folder.path().join("walk.toml"), folder.path().join("a.png"));
    let shot = ["shot", text(cornell_box()), "--path", text(&path), "-o", text(&picture)];
    assert!(fails(1, &[&shot[..], &["--frames", "2"]].concat()).contains("walk.toml: cannot be read"));
    std::fs::write(&path, format!("{WALK}fov = 1\n")).unwrap();
    assert!(fails(1, &[&shot[..], &["--frames", "2"]].concat()).contains("walk.toml, line 11: "));
    std::fs::write(&path, WALK.replace("0.3, 0.3, 0.5", "0.3, 0.3, -0.5")).unwrap();
    assert!(fails(1, &[&shot[..], &["--frames", "2"]].concat()).contains("walk.toml, line 1: camera 1"));
    assert!(fails(2, &shot).contains("--frames"));
    assert!(fails(2, &[&shot[..], &["--frames", "0"]].concat()).contains("--frames"));
    assert!(fails(2, &[&shot[..], &["--frames", "2", "--camera", "camera"]].concat()).contains("--camera"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The first and the last picture of a path are those of its first and last camera.
#[test]
fn a_path_is_pictures_with_numbers() {
    let folder = folder();
    let path = folder.path().join("walk.toml");
    std::fs::write(&path, WALK).unwrap();
    let picture = |name: &str| folder.path().join(name);
    let common = ["shot", text(cornell_box()), "--size", "40x30", "--backend", "cpu", "--exposure", "1"];
    let walk = picture("walk.png");
    let shot = run(&[&common[..], &["-o", text(&walk), "--path", text(&path), "--frames", "3", "--json"]].concat());
    let report: Value = serde_json::from_slice(&shot.stdout).unwrap();
    assert_eq!((&report["pictures"], &report["exposure"]), (&3.into(), &1.0.into()));
    let read = |name: &str| std::fs::read(picture(name)).unwrap();
    let [first, middle, last] = [1, 2, 3].map(|number| read(&format!("walk.{number:04}.png")));
    assert!(!walk.exists() && !picture("walk.0004.png").exists());
    for (pixels, eye, target, fov) in
        [(&first, "0.3,0.3,-0.5", "0.3,0.3,0.5", "50"), (&last, "0.4,0.2,-0.6", "0.2,0.3,0.5", "60")]
    {
        let camera = ["--eye", eye, "--target", target, "--up", "0,1,0", "--fov", fov];
        run(&[&common[..], &camera, &["-o", text(&picture("one.png"))]].concat());
        assert_eq!(*pixels, read("one.png"), "{eye}");
    }
    assert!(middle != first && middle != last);
}

#[test]
fn times_are_told_with_their_parts() {
    let folder = folder();
    let picture = folder.path().join("a.png");
    let common = ["shot", text(cornell_box()), "--size", "40x30", "--backend", "cpu", "--timing", "--frames", "3"];
    let shot = run(&[&common[..], &["--json", "-o", text(&picture)]].concat());
    let report: Value = serde_json::from_slice(&shot.stdout).unwrap();
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{report}"));
    assert_eq!((&report["adapter"], &report["frames"], &report["mode"]), (&"cpu".into(), &3.into(), &"shaded".into()));
    assert!(number(&report["triangles"]) > 1000.0 && number(&report["frame_ms"]) > 0.0, "{report}");
    for part in ["visibility", "interpolant", "tone_map"] {
        assert!(number(&report["parts_ms"][part]) > 0.0, "{report}");
    }
    let start: f64 = ["read", "set_up", "draw"].map(|part| number(&report["start_ms"][part])).iter().sum();
    assert!((number(&report["first_frame_ms"]) - start).abs() < 1e-6, "{report}");
    assert!(picture.exists(), "-o draws the picture, too");
    let table = String::from_utf8(run(&common).stdout).unwrap();
    assert!(table.contains("frames/s, medians of 3 frames") && table.contains("visibility"), "{table}");
    for arguments in [&["shot", "a.hlf"][..], &["shot", "a.hlf", "-o", "a.png", "--frames", "3"]] {
        assert!(fails(2, arguments).contains("--"), "{arguments:?}");
    }
}
