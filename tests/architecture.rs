//! The house's arrows: which crate may know which, over what cargo knows and not over text.

use std::collections::BTreeSet;

use cargo_metadata::{Metadata, MetadataCommand, Package};

/// Each crate, and those of ours that it may name. `halflight` and its tests may name all.
const MAY_NAME: [(&str, &[&str]); 6] = [
    ("scene", &[]),
    ("formats", &["scene"]),
    ("solver", &["scene"]),
    ("mesher", &["scene", "solver"]),
    ("renderer", &["scene"]),
    ("viewer", &["scene"]),
];

/// Crates of others, and those of ours that alone know them: one, but for the triangulation of surfaces and of the image plane.
const HOMES: [(&str, &[&str]); 12] = [
    ("obvhs", &["scene"]),
    ("tobj", &["formats"]),
    ("image", &["formats"]),
    ("bincode", &["formats"]),
    ("csv", &["formats"]),
    ("spade", &["mesher", "renderer"]),
    ("wgpu", &["viewer"]),
    ("naga", &["viewer"]),
    ("winit", &["viewer"]),
    ("egui", &["viewer"]),
    ("softbuffer", &["viewer"]),
    ("clap", &["halflight"]),
];

fn workspace() -> Metadata {
    MetadataCommand::new().manifest_path(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).no_deps().exec().unwrap()
}

/// What a package depends on to build, to run and to be tested, renamed or not.
fn dependencies(package: &Package) -> BTreeSet<&str> {
    package.dependencies.iter().map(|dependency| dependency.name.as_str()).collect()
}

#[test]
fn the_arrows_point_one_way() {
    let metadata = workspace();
    let ours: BTreeSet<&str> = metadata.packages.iter().map(|package| package.name.as_str()).collect();
    let expected = MAY_NAME.iter().map(|(name, _)| *name).chain(["halflight"]).collect();
    assert_eq!(ours, expected, "a crate came or went: say in ARCHITECTURE.md where it stands");
    for (name, may_name) in MAY_NAME {
        let package = metadata.packages.iter().find(|package| package.name == name).unwrap();
        let named: Vec<&str> = dependencies(package).intersection(&ours).copied().collect();
        assert!(named.iter().all(|other| may_name.contains(other)), "{name} names {named:?}, it may name {may_name:?}");
    }
}

#[test]
fn a_library_has_one_home() {
    let metadata = workspace();
    for (library, homes) in HOMES {
        let users = metadata.packages.iter().filter(|package| dependencies(package).contains(library));
        let users: Vec<&str> = users.map(|package| package.name.as_str()).collect();
        assert_eq!(users, homes, "{library}");
    }
}

#[test]
fn every_crate_takes_the_lints_and_the_licence_of_the_workspace() {
    for package in workspace().packages {
        assert_eq!(package.license.as_deref(), Some("MIT OR Apache-2.0"), "{}", package.name);
        let manifest = std::fs::read_to_string(&package.manifest_path).unwrap();
        assert!(manifest.contains("[lints]\nworkspace = true"), "{}", package.name);
    }
}

#[test]
fn the_page_names_every_crate() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/ARCHITECTURE.md")).unwrap();
    for (name, _) in MAY_NAME {
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
}
