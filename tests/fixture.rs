//! What the tests share: the program, the data, a folder to write to, and bakes that are made once.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use assert_cmd::Command;
use glam::DVec3;
use tempfile::TempDir;

use crate::reference::Table;

/// A file below data/.
pub fn data(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(path)
}

/// A folder of a test's own, which goes with the value.
pub fn folder() -> TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap()
}

/// The program, away from the user's own cache.
pub fn halflight() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command
}

/// Runs the program, which must succeed.
pub fn run(arguments: &[&str]) -> Output {
    let output = halflight().args(arguments).output().unwrap();
    assert!(output.status.success(), "halflight {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs the program, which must fail with a code and without a panic; what it said.
pub fn fails(code: i32, arguments: &[&str]) -> String {
    let output = halflight().args(arguments).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "halflight {arguments:?}: {said}");
    assert!(output.stdout.is_empty(), "halflight {arguments:?} failed and yet printed");
    assert!(said.contains("halflight: error: ") && !said.contains("panicked"), "halflight {arguments:?}: {said}");
    said
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The bake of data/scenes/office.obj with default options.
pub fn office() -> &'static Path {
    static OFFICE: OnceLock<PathBuf> = OnceLock::new();
    OFFICE.get_or_init(|| bake("office", "office", &[]))
}

/// The bake of data/scenes/cornell_box.obj with default options.
pub fn cornell_box() -> &'static Path {
    static CORNELL_BOX: OnceLock<PathBuf> = OnceLock::new();
    CORNELL_BOX.get_or_init(|| bake("cornell_box", "cornell_box", &[]))
}

/// The direct light alone of data/scenes/office.obj.
pub fn office_direct() -> &'static Path {
    static OFFICE: OnceLock<PathBuf> = OnceLock::new();
    OFFICE.get_or_init(|| bake("office", "office_direct", &["--bounces", "0"]))
}

/// The direct light alone of data/scenes/cornell_box.obj.
pub fn cornell_box_direct() -> &'static Path {
    static CORNELL_BOX: OnceLock<PathBuf> = OnceLock::new();
    CORNELL_BOX.get_or_init(|| bake("cornell_box", "cornell_box_direct", &["--bounces", "0"]))
}

fn bake(scene: &str, name: &str, options: &[&str]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).with_extension("hlf");
    let scene = data(&format!("scenes/{scene}.obj"));
    run(&[&["bake", text(&scene), "-o", text(&path)], options].concat());
    path
}

/// The irradiance that `probe` finds; all points meet a surface.
pub fn probe(scene: &Path, points: &Path, options: &[&str]) -> Vec<DVec3> {
    let output = points.with_extension("out.csv");
    run(&[&["probe", text(scene), "--points", text(points), "-o", text(&output)], options].concat());
    let found: Option<Vec<_>> = Table::read(&output).colours("e").into_iter().collect();
    found.expect("every point meets a surface").into_iter().map(DVec3::from).collect()
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

/// Writes a table of points and normals.
pub fn write_points(folder: &Path, points: impl Iterator<Item = (DVec3, DVec3)>) -> PathBuf {
    let mut csv = String::from("x,y,z,nx,ny,nz\n");
    for (p, n) in points {
        writeln!(csv, "{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
    }
    let path = folder.join("points.csv");
    std::fs::write(&path, csv).unwrap();
    path
}
