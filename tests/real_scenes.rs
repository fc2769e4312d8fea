//! Scenes that nobody drew for radiosity: what is repaired in each, by count. They are not part of the repository; where
//! the folder beside it is missing, the tests say so and pass.

use std::path::{Path, PathBuf};
use std::time::Instant;

use formats::{ImportReport, Imported, Sides};
use scene::Scene;

use crate::fixture::data;

/// A scene of the shared folder, read; none where it is absent.
#[expect(clippy::print_stderr, reason = "a test that does not look says so")]
fn read(name: &str, sides: Sides) -> Option<Imported> {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes").join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is not there", path.display());
        return None;
    }
    let start = Instant::now();
    let imported = formats::read_scene_as(&path, sides).unwrap();
    // Far more than it takes, far less than a quadratic search would.
    assert!(start.elapsed().as_secs() < 10, "{name} took {:?}", start.elapsed());
    assert_eq!(imported.scene.validate(), Ok(()));
    Some(imported)
}

/// Area of all fronts, m², as a file has them.
fn area(scene: &Scene) -> f64 {
    scene.polygon_ids().map(|polygon| scene.area(polygon)).sum()
}

/// The counts alone.
fn counts(report: &ImportReport) -> ImportReport {
    ImportReport { warnings: Vec::new(), ..report.clone() }
}

#[test]
fn the_office_of_radiance() {
    let Some(Imported { scene, report }) = read("radiance-office/radiance-office.obj", Sides::AsWound) else { return };
    let expected = ImportReport {
        polygons_read: 22_406,
        welded_vertices: 932,
        merged_faces: 2_711,
        junctions: 4,
        ..ImportReport::default()
    };
    assert_eq!(report, expected);
    assert!((area(&scene) - 142.12).abs() < 0.01, "{}", area(&scene));
}

#[test]
fn the_staircase_with_its_2432_triangles_without_area() {
    let Some(Imported { scene, report }) = read("staircase2/staircase2.obj", Sides::AsWound) else { return };
    let expected = ImportReport {
        polygons_read: 31_037,
        welded_vertices: 48,
        degenerate_faces: 2_432,
        merged_faces: 10_589,
        junctions: 43,
        open_junctions: 6,
        one_sided_surfaces: 1,
        clamped_materials: 1,
        textured_materials: 3,
        ..ImportReport::default()
    };
    assert_eq!(counts(&report), expected);
    assert!(report.warnings.iter().any(|warning| warning.starts_with("2432 faces (the first in line 53348)")));
    // Its lamps and its camera see fronts.
    assert!(!report.warnings.iter().any(|warning| warning.contains("the wrong way round")), "{:?}", report.warnings);
    assert!((area(&scene) - 1191.89).abs() < 0.01, "{}", area(&scene));
}

#[test]
fn the_gazebo() {
    let Some(Imported { report, .. }) = read("gazebo/gazebo.obj", Sides::AsWound) else { return };
    let expected = ImportReport {
        polygons_read: 730,
        welded_vertices: 1_088,
        merged_faces: 311,
        missing_materials: 1,
        ..ImportReport::default()
    };
    assert_eq!(counts(&report), expected);
}

#[test]
fn the_hall_needs_no_repair() {
    let Some(Imported { scene, report }) = read("own/hall.obj", Sides::AsWound) else { return };
    assert_eq!(report, ImportReport { polygons_read: 12_102, welded_vertices: 136, ..ImportReport::default() });
    assert_eq!(scene.polygons.len(), 12_102);
}

#[test]
fn scenes_that_are_right_stay_as_they_are() {
    for name in ["office", "cornell_box", "blocker_plane"] {
        let path = data(&format!("scenes/{name}.obj"));
        let Imported { scene, report } = formats::read_scene(&path).unwrap();
        let expected = ImportReport {
            polygons_read: scene.polygons.len(),
            welded_vertices: report.welded_vertices,
            ..ImportReport::default()
        };
        assert_eq!(report, expected, "{name}");
        let corners: usize = std::fs::read_to_string(&path)
            .unwrap()
            .lines()
            .filter(|l| l.starts_with("f "))
            .map(|l| l.split_whitespace().count() - 1)
            .sum();
        assert_eq!(scene.corners.len(), corners, "{name}");
    }
}

/// Closed rooms, solids and bulbs are trusted where all is right; sheets and lamps get their other sides.
#[test]
fn two_sided_readings_double_what_is_open() {
    let Imported { scene, report } = formats::read_scene_as(&data("scenes/blocker_plane.obj"), Sides::Both).unwrap();
    assert_eq!((scene.polygons.len(), report.other_sides), (6, 3));
    assert!(report.warnings.iter().any(|warning| warning.contains("emits on both sides")), "{:?}", report.warnings);
    if let Some(Imported { scene, report }) = read("own/hall.obj", Sides::Both) {
        assert_eq!((scene.polygons.len(), report.other_sides), (12_102, 0));
    }
}
