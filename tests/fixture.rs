//! What the tests share: the program, the data, a folder to write to, and bakes that are made once.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use assert_cmd::Command;
use tempfile::TempDir;

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
