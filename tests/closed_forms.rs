//! What `halflight validate` prints: every case within its bound, none of them lost, and the README's table of them true.

use std::sync::OnceLock;

use serde_json::Value;

use crate::fixture::run;

/// Groups in the order in which they are printed, with the number of cases in each.
const GROUPS: [(&str, usize); 24] = [
    ("opposed rectangles", 6),
    ("parallel rectangles", 3),
    ("perpendicular rectangles", 6),
    ("rows of closed rooms", 3),
    ("element to parallel rectangle", 5),
    ("element to perpendicular rectangle", 5),
    ("coaxial disks", 3),
    ("order of the polygons", 3),
    ("blocked light, W/m²", 6),
    ("blocked light, W on the floor, baked", 1),
    ("light behind a tilted triangle, W/m²", 3),
    ("furnace, elements", 3),
    ("furnace, points", 3),
    ("furnace, baked", 3),
    ("furnished furnace, points", 3),
    ("energy balance, elements, W", 3),
    ("energy balance, baked, W", 3),
    ("5.3 Lambertian square, lux", 14),
    ("5.3 Lambertian square, lux, baked", 14),
    ("5.4 conservation of flux, lm", 1),
    ("5.6 diffuse reflector, %", 9),
    ("5.7 obstruction, %", 11),
    ("5.8 mean indirect, lux", 11),
    ("5.8 mean of all light, lux, baked", 11),
];

/// The cases, computed once.
fn cases() -> &'static [Value] {
    static CASES: OnceLock<Vec<Value>> = OnceLock::new();
    CASES.get_or_init(|| {
        let report: Value = serde_json::from_slice(&run(&["validate", "--json"]).stdout).unwrap();
        assert_eq!(report["holds"], true);
        report["cases"].as_array().unwrap().clone()
    })
}

#[test]
fn every_case_is_within_its_bound() {
    for case in cases() {
        let number = |name: &str| case[name].as_f64().unwrap_or_else(|| panic!("{name} in {case}"));
        let difference = (number("ours") - number("exact")).abs();
        let relative = if number("exact") == 0.0 { difference } else { difference / number("exact").abs() };
        assert!(relative <= number("bound") && case["holds"] == true, "{case}");
        assert!((relative - number("error")).abs() <= 1e-12, "{case}");
        // What is published was rounded, or measured by somebody: it says that the formula is the right one.
        if let Some(published) = case["published"].as_f64() {
            assert!((published - number("exact")).abs() <= 5e-3 * number("exact"), "{case}");
        }
    }
}

#[test]
fn no_case_is_lost() {
    let mut found: Vec<(&str, usize)> = Vec::new();
    for case in cases() {
        let group = case["group"].as_str().unwrap();
        match found.last_mut() {
            Some((last, count)) if *last == group => *count += 1,
            _ => found.push((group, 1)),
        }
    }
    assert_eq!(found, GROUPS);
}

/// What needs no interpolation is held to 1e-6, and nothing to more than five per cent.
#[test]
fn bounds_are_those_of_the_design() {
    let exact = ["rectangle", "disks", "closed rooms", "blocked light, W/m²", "tilted", "5.3", "5.4", "5.6", "5.7"];
    for case in cases() {
        let (group, bound) = (case["group"].as_str().unwrap(), case["bound"].as_f64().unwrap());
        assert!(bound <= 0.05, "{case}");
        if exact.iter().any(|part| group.contains(part)) && !group.contains("baked") {
            assert!(bound <= 1e-6, "{case}");
        }
    }
}

#[test]
fn the_table_has_every_case() {
    let text = String::from_utf8(run(&["validate"]).stdout).unwrap();
    for case in cases() {
        for part in ["group", "source", "name"] {
            assert!(text.contains(case[part].as_str().unwrap()), "{part} of {case} is missing");
        }
    }
    assert!(
        text.ends_with(&format!("{0} of {0} cases agree with the closed form, each within its bound\n", cases().len()))
    );
}

/// The README's table of CIE 171:2006, row for row: the published, the exact and our values of some cases of a group.
#[test]
fn the_readme_has_these_values() {
    let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let rows = [
        ("5.3 wall, lux", "5.3 Lambertian square, lux", 0..6, 2),
        ("5.3 floor, lux", "5.3 Lambertian square, lux", 6..10, 2),
        ("5.6 wall, %", "5.6 diffuse reflector, %", 0..5, 3),
        ("5.6 ceiling, %", "5.6 diffuse reflector, %", 5..9, 2),
        ("5.7 wall, %", "5.7 obstruction, %", 0..6, 2),
        ("5.7 floor, %", "5.7 obstruction, %", 6..11, 2),
    ];
    for (label, group, range, decimals) in rows {
        let of_group: Vec<&Value> = cases().iter().filter(|case| case["group"] == group).collect();
        let column = |name: &str, text: &dyn Fn(f64) -> String| -> String {
            of_group[range.clone()].iter().map(|case| text(case[name].as_f64().unwrap())).collect::<Vec<_>>().join(" ")
        };
        let rounded = |value: f64| format!("{value:.decimals$}");
        let published = column("published", &|value| value.to_string());
        let row = format!("| {label} | {published} | {} | {} |", column("exact", &rounded), column("ours", &rounded));
        assert!(readme.contains(&row), "the README has no row\n{row}");
    }
}
