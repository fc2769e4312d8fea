//! Pictures as they were when a person last looked at them.
//!
//! A golden picture that is missing is a failure. HALFLIGHT_ACCEPT_GOLDEN=1 writes the picture of now; look at it before
//! it is committed.

use std::path::{Path, PathBuf};

use crate::fixture::{cornell_box, folder, office, run, text};

/// Largest golden file, bytes: they stay in the history for ever.
const LARGEST: u64 = 200 * 1024;

/// Difference of a channel that no eye sees, and that a last digit in another library may make.
const UNSEEN: u8 = 3;

/// Share of pixels that may differ by more: those on edges.
const SHARE: f64 = 2e-3;

fn looks_as_it_did(name: &str, bake: &Path, options: &[&str]) {
    let folder = folder();
    let now = folder.path().join("now.png");
    run(&[&["shot", text(bake), "-o", text(&now), "--size", "320x240", "--backend", "cpu"], options].concat());
    let golden: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "tests", "golden", name].iter().collect::<PathBuf>().with_extension("png");
    if std::env::var("HALFLIGHT_ACCEPT_GOLDEN").is_ok_and(|value| value == "1") {
        std::fs::create_dir_all(golden.parent().unwrap()).unwrap();
        std::fs::copy(&now, &golden).unwrap();
    }
    assert!(golden.exists(), "{name} has no golden picture: HALFLIGHT_ACCEPT_GOLDEN=1 makes one to look at");
    assert!(std::fs::metadata(&golden).unwrap().len() <= LARGEST, "{name} is too large");
    let (width, height, then) = formats::read_png(&golden).unwrap();
    let (w, h, now) = formats::read_png(&now).unwrap();
    assert_eq!((width, height), (w, h));
    let off = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > UNSEEN);
    let share = then.iter().zip(&now).filter(off).count() as f64 / then.len() as f64;
    assert!(share <= SHARE, "{name}: {share} of the pixels differ; if that is meant, HALFLIGHT_ACCEPT_GOLDEN=1");
}

#[test]
fn the_office_shaded() {
    looks_as_it_did("office_shaded", office(), &[]);
}

#[test]
fn the_office_gouraud() {
    looks_as_it_did("office_gouraud", office(), &["--mode", "gouraud"]);
}

#[test]
fn the_office_mesh() {
    looks_as_it_did("office_mesh", office(), &["--mode", "mesh"]);
}

#[test]
fn the_office_discontinuities() {
    looks_as_it_did("office_discontinuities", office(), &["--mode", "discontinuities"]);
}

#[test]
fn the_cornell_box_shaded() {
    looks_as_it_did("cornell_box_shaded", cornell_box(), &[]);
}
