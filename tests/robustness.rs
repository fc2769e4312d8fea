//! Bytes that nobody meant: an error that names the file, no panic, and nothing half-written.

use std::fmt::Write;
use std::path::Path;

use crate::fixture::{cornell_box, data, fails, folder, halflight, text};

/// Bytes that look like noise and are the same in every run (xorshift).
fn noise(seed: u64, length: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let step = |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    (0..length).map(step).collect()
}

/// `info` of a file fails and names it.
fn refused(path: &Path, bytes: &[u8]) -> String {
    std::fs::write(path, bytes).unwrap();
    let said = fails(1, &["info", text(path)]);
    assert!(said.contains(path.file_name().unwrap().to_str().unwrap()), "{said}");
    said
}

#[test]
fn noise_is_neither_a_scene_nor_a_bake_nor_points() {
    let folder = folder();
    for (seed, length) in [(1, 0), (2, 1), (3, 8), (4, 21), (5, 1000), (6, 100_000)] {
        let bytes = noise(seed, length);
        refused(&folder.path().join("noise.hlf"), &bytes);
        for scene in ["noise.obj", "noise.glb", "noise.gltf", "noise.toml"] {
            refused(&folder.path().join(scene), &bytes);
        }
        let points = folder.path().join("noise.csv");
        std::fs::write(&points, &bytes).unwrap();
        let said = fails(1, &["probe", text(cornell_box()), "--points", text(&points)]);
        assert!(said.contains("noise.csv"), "{said}");
    }
}

#[test]
fn a_truncated_bake_is_refused_wherever_it_ends() {
    let folder = folder();
    let (path, whole) = (folder.path().join("cut.hlf"), std::fs::read(cornell_box()).unwrap());
    for length in [0, 1, 7, 8, 11, 12, 16, 19, 20, 21, 100, whole.len() / 3, whole.len() / 2, whole.len() - 1] {
        refused(&path, &whole[..length]);
    }
    let said = refused(&path, &whole[..whole.len() / 2]);
    assert!(said.contains("cut off") && said.contains("bake the scene again"), "{said}");
}

#[test]
fn an_altered_bake_is_refused_wherever_it_was_altered() {
    let folder = folder();
    let (path, whole) = (folder.path().join("altered.hlf"), std::fs::read(cornell_box()).unwrap());
    for i in 0..40 {
        let mut bytes = whole.clone();
        let place = i * (whole.len() - 1) / 39;
        bytes[place] ^= 1 << (i % 8);
        refused(&path, &bytes);
    }
    let appended = [whole.as_slice(), b"more"].concat();
    refused(&path, &appended);
}

#[test]
fn a_bake_of_a_later_version_says_so() {
    let folder = folder();
    let mut bytes = std::fs::read(cornell_box()).unwrap();
    let version = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
    bytes[8..12].copy_from_slice(&(version + 1).to_le_bytes());
    let said = refused(&folder.path().join("newer.hlf"), &bytes);
    assert!(said.contains(&format!("version {}", version + 1)) && said.contains("update"), "{said}");
}

/// Scenes that no modeller meant, around a floor and a lamp that make them bakeable.
#[test]
fn degenerate_scenes_are_baked_or_refused_but_never_break() {
    let folder = folder();
    std::fs::copy(data("scenes/blocker_plane.mtl"), folder.path().join("blocker_plane.mtl")).unwrap();
    let lit = std::fs::read_to_string(data("scenes/blocker_plane.obj")).unwrap();
    let mut repeated = lit.clone();
    for _ in 0..3 {
        repeated += "f 1 2 3 4\nf 9 10 11 12\n";
    }
    let mut needle = lit.clone();
    write!(
        needle,
        "v 0 0 0\nv 1 0 0\nv 1 1e-9 0\nv 0 1e-12 0\nf -4 -3 -2 -1\nv 0 0 0.2\nv 1 0 0.2\nv 0.5 1e-7 0.2\nf -3 -2 -1\n"
    )
    .unwrap();
    let scenes = [
        ("repeated", repeated),
        ("needles", needle),
        (
            "the blocker touches the floor",
            lit.replace(" 0.5\nv 0.25", " 0\nv 0.25").replace("-0.25 0.25 0.5", "-0.25 0.25 0"),
        ),
        ("the blocker lies in the floor", lit.replace("0.25 0.5\n", "0.25 0\n")),
        ("the lamp lies in the floor", lit.replace("0.5 1\n", "0.5 0\n")),
        ("the lamp shows its back", lit.replace("f 5 6 7 8", "f 8 7 6 5")),
        ("a two-sided floor", lit.clone() + "usemtl floor\nf 4 3 2 1\n"),
        ("one face, the lamp", lit.replace("f 1 2 3 4", "").replace("f 9 10 11 12", "")),
        ("crossing polygons", lit.clone() + "v -1 0 -1\nv 1 0.1 -1\nv 1 -0.1 2\nusemtl floor\nf -3 -2 -1\n"),
        ("tiny", lit.lines().map(|line| scaled(line, 1e-6)).collect()),
        ("huge", lit.lines().map(|line| scaled(line, 1e4)).collect()),
        ("far away", lit.lines().map(|line| moved(line, 9e4)).collect()),
    ];
    for (name, text_of_scene) in scenes {
        let (scene, output) = (folder.path().join("scene.obj"), folder.path().join("out.hlf"));
        std::fs::write(&scene, text_of_scene).unwrap();
        let mut command = halflight();
        command.args(["bake", text(&scene), "-o", text(&output)]).timeout(std::time::Duration::from_secs(120));
        let found = command.output().unwrap();
        let said = String::from_utf8_lossy(&found.stderr);
        assert!(matches!(found.status.code(), Some(0 | 1)) && !said.contains("panicked"), "{name}: {said}");
        assert_eq!(found.status.success(), output.exists(), "{name}: {said}");
        if found.status.success() {
            formats::read_baked(&output).unwrap();
            std::fs::remove_file(&output).unwrap();
        }
    }
}

/// A line of an OBJ with its vertex changed.
fn vertex(line: &str, change: impl Fn(f64) -> f64) -> String {
    match line.strip_prefix("v ") {
        Some(numbers) => {
            let numbers = numbers.split(' ').map(|number| change(number.parse().unwrap()).to_string());
            format!("v {}\n", numbers.collect::<Vec<_>>().join(" "))
        }
        None => format!("{line}\n"),
    }
}

fn scaled(line: &str, factor: f64) -> String {
    vertex(line, |value| value * factor)
}

fn moved(line: &str, by: f64) -> String {
    vertex(line, |value| value + by)
}
