//! Scenes that nobody drew for radiosity: what is repaired in each, by count. They are not part of the repository; where
//! the folder beside it is missing, the tests say so and pass.

use std::path::{Path, PathBuf};
use std::time::Instant;

use formats::{ImportReport, Imported, Sides};
use glam::DVec3;
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

/// The reflectance of a material by its name.
fn reflectance(scene: &Scene, name: &str) -> DVec3 {
    scene.materials.iter().find(|material| material.name == name).unwrap().reflectance
}

/// The counts alone.
fn counts(report: &ImportReport) -> ImportReport {
    ImportReport { warnings: Vec::new(), ..report.clone() }
}

#[test]
fn the_cornell_boxes() {
    for name in ["Empty-CO", "Empty-RG", "Mirror", "Original"] {
        let Some(Imported { scene, report }) = read(&format!("cornell-box/CornellBox-{name}.obj"), Sides::AsWound)
        else {
            return;
        };
        assert!(scene.emitters().count() > 0, "{name}");
        let (low, high) = scene.bounds();
        assert!((high - low - DVec3::splat(2.0)).abs().max_element() < 0.1, "{name}: {low} {high}");
        if name == "Mirror" {
            assert!((reflectance(&scene, "tallBox") - DVec3::splat(0.96)).length() < 1e-9);
            assert_eq!(report.mirror_materials, 1);
        }
    }
}

#[test]
fn the_office_of_radiance() {
    let Some(Imported { scene, report }) = read("radiance-office/radiance-office.obj", Sides::AsWound) else { return };
    let expected = ImportReport {
        polygons_read: 22_406,
        welded_vertices: 932,
        merged_faces: 2_690,
        junctions: 4,
        transparent_faces: 2,
        ..ImportReport::default()
    };
    assert_eq!(counts(&report), expected);
    assert!((scene.surface_area() - 137.48).abs() < 0.01, "{}", scene.surface_area());
}

#[test]
fn the_staircase_with_its_2432_triangles_without_area() {
    let Some(Imported { scene, report }) = read("staircase2/staircase2.obj", Sides::AsWound) else { return };
    let expected = ImportReport {
        polygons_read: 31_037,
        welded_vertices: 48,
        degenerate_faces: 2_432,
        merged_faces: 10_200,
        junctions: 43,
        open_junctions: 6,
        one_sided_surfaces: 1,
        clamped_materials: 1,
        mirror_materials: 2,
        transparent_faces: 36,
        ..ImportReport::default()
    };
    assert_eq!(counts(&report), expected);
    assert!(report.warnings.iter().any(|warning| warning.starts_with("2432 faces (the first in line 53348)")));
    // Its lamps and its camera see fronts.
    assert!(!report.warnings.iter().any(|warning| warning.contains("the wrong way round")), "{:?}", report.warnings);
    assert!((scene.surface_area() - 1133.44).abs() < 0.01, "{}", scene.surface_area());
}

#[test]
fn the_staircase_has_its_textures() {
    let Some(Imported { scene, .. }) = read("staircase2/staircase2.obj", Sides::AsWound) else { return };
    assert_eq!((scene.textures.len(), scene.texture_coordinates.len()), (3, scene.corners.len()));
    for name in ["WoodBSDF", "FloorTilesBSDF", "WallpaperBSDF"] {
        let material = scene.materials.iter().position(|material| material.name == name).unwrap();
        let texture = scene.materials[material].texture.unwrap();
        // The file's Kd is the mean of the texture, for readers that know none; it must not count twice.
        assert_eq!(scene.materials[material].reflectance, DVec3::splat(0.999), "{name}");
        let polygons: Vec<u32> =
            scene.polygon_ids().filter(|&p| scene.polygons[p as usize].material == material as u32).collect();
        let area: f64 = polygons.iter().map(|&p| scene.area(p)).sum();
        let mean = polygons.iter().map(|&p| scene.reflectance(p) * scene.area(p)).sum::<DVec3>() / area;
        assert!((mean - scene.textures[texture as usize].mean()).abs().max_element() < 0.03, "{name}: {mean}");
    }
    assert!((reflectance(&scene, "ChromeBSDF") - DVec3::splat(0.8)).length() < 1e-9);
}

#[test]
fn the_living_room_has_its_camera_and_no_glass() {
    let Some(Imported { scene, report }) = read("living-room/living-room.glb", Sides::AsWound) else { return };
    assert_eq!(report.polygons_read, 143_163);
    assert_eq!((scene.cameras.len(), scene.cameras[0].name.as_str()), (1, "main"));
    assert!((scene.cameras[0].camera.eye - DVec3::new(5.10518, 0.731065, -2.31789)).length() < 1e-5);
    assert!((scene.cameras[0].camera.vertical_fov.to_degrees() - 58.716).abs() < 1e-2);
    let (low, high) = scene.bounds();
    assert!((low - DVec3::new(-0.513, -0.003, -3.635)).abs().max_element() < 2e-3, "{low}");
    assert!((high - DVec3::new(5.123, 2.879, 0.593)).abs().max_element() < 2e-3, "{high}");
    assert!(report.mirror_materials == 3 && report.transparent_faces > 0);
    assert!(scene.polygon_ids().all(|polygon| scene.material(polygon).name != "Glass"));
    assert_eq!(scene.shading_normals.len(), scene.corners.len());
    // All of its materials are double-sided: both sides are there, once, but for the insides of solids; and a reader in doubt
    // adds nothing.
    assert_eq!((report.other_sides, scene.polygons.len() - report.other_sides), (49_639, 113_638));
    let both = read("living-room/living-room.glb", Sides::Both).unwrap();
    assert_eq!(both.scene, scene);
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
