//! The licences that deny.toml allows are the ones that the dependencies have: what cargo-deny holds, without a minute
//! of building it.

use std::collections::BTreeSet;

use cargo_metadata::MetadataCommand;
use spdx::{Expression, ParseMode};

fn allowed() -> BTreeSet<String> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/deny.toml")).unwrap();
    let table: toml::Table = text.parse().unwrap();
    table["licenses"]["allow"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    let allowed = allowed();
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    let packages = MetadataCommand::new().manifest_path(manifest).exec().unwrap().packages;
    assert!(packages.len() > 100, "{} packages are not the whole tree", packages.len());
    for package in packages {
        let licence = package.license.as_deref().unwrap_or_default();
        let expression = Expression::parse_mode(licence, ParseMode::LAX);
        let expression = expression.unwrap_or_else(|error| panic!("{}: {licence:?}: {error}", package.name));
        let held = expression.evaluate(|requirement| allowed.contains(&requirement.to_string()));
        assert!(held, "{} is under {licence}, which deny.toml does not allow", package.name);
    }
}
