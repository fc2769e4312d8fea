//! Scenes that nobody drew for radiosity, in a folder beside the project; without it these tests skip loudly.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use std::path::Path;
use std::time::Instant;

use formats::{Imported, read_scene};
use glam::DVec3;

fn read(name: &str) -> Option<Imported> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes").join(name);
    if !path.exists() {
        eprintln!("SKIPPED, nothing was tested: there is no {}", path.display());
        return None;
    }
    let start = Instant::now();
    let imported = read_scene(&path).unwrap();
    eprintln!("{name}: {} polygons in {:.2} s", imported.scene.polygons.len(), start.elapsed().as_secs_f64());
    for warning in &imported.report.warnings {
        eprintln!("  {warning}");
    }
    imported.scene.validate().unwrap();
    Some(imported)
}

/// The reflectance of a material by its name.
fn reflectance(imported: &Imported, name: &str) -> DVec3 {
    imported.scene.materials.iter().find(|material| material.name == name).unwrap().reflectance
}

#[test]
fn the_cornell_boxes() {
    for name in ["Empty-CO", "Empty-RG", "Mirror", "Original"] {
        let Some(imported) = read(&format!("cornell-box/CornellBox-{name}.obj")) else { return };
        assert!(imported.scene.emitters().count() > 0, "{name}");
        let (low, high) = imported.scene.bounds();
        assert!((high - low - DVec3::splat(2.0)).abs().max_element() < 0.1, "{name}: {low} {high}");
        if name == "Mirror" {
            assert!((reflectance(&imported, "tallBox") - DVec3::splat(0.96)).length() < 1e-9);
            assert_eq!(imported.report.mirror_materials, 1);
        }
    }
}

#[test]
fn gazebo_has_no_materials() {
    let Some(imported) = read("gazebo/gazebo.obj") else { return };
    assert!(imported.scene.polygons.len() > 300 && imported.report.missing_materials == 1);
}

#[test]
fn the_radiance_office() {
    let Some(imported) = read("radiance-office/radiance-office.obj") else { return };
    assert!(imported.scene.emitters().count() > 0);
}

#[test]
fn the_living_room_has_its_camera_and_no_glass() {
    let Some(imported) = read("living-room/living-room.glb") else { return };
    let (scene, report) = (&imported.scene, &imported.report);
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
}

#[test]
fn the_staircase_has_its_textures() {
    let Some(imported) = read("staircase2/staircase2.obj") else { return };
    let scene = &imported.scene;
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
    assert_eq!(imported.report.mirror_materials, 2);
    assert!(imported.report.transparent_faces > 0);
    assert!((reflectance(&imported, "ChromeBSDF") - DVec3::splat(0.8)).length() < 1e-9);
}
