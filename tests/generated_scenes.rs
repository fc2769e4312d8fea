//! Generated scenes: the same at every run, closed, and nothing in them for the importer to repair.

use glam::DVec3;
use scene::{Bvh, HalfEdges, NO_TWIN, Ray, Scene};

use crate::fixture::folder;
use crate::generated::{dominoes, hall, looking_glass, mtl, obj, plant, rooms, shapes, tori};

/// The scene as the importer reads it from its text.
fn read_back(scene: &Scene) -> formats::Imported {
    let folder = folder();
    let path = folder.path().join("scene.obj");
    std::fs::write(folder.path().join("scene.mtl"), mtl(scene)).unwrap();
    std::fs::write(&path, obj(scene, "scene.mtl")).unwrap();
    formats::read_scene(&path).unwrap()
}

/// Directions all around, evenly.
fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
    })
}

#[test]
fn sizes_from_nothing_on_are_near_what_was_asked_for() {
    for asked in [0, 1, 132] {
        assert_eq!(hall(asked).polygons.len(), 132);
    }
    for asked in [1_000, 24_000, 100_000] {
        let got = hall(asked).polygons.len() as f64;
        assert!((got / f64::from(asked) - 1.0).abs() < 0.1, "{got} for {asked}");
    }
    assert_eq!(rooms(0), rooms(1));
    assert!((5_000..10_000).contains(&rooms(8).polygons.len()));
}

#[test]
fn what_is_written_reads_back_to_the_same_scene_with_nothing_to_repair() {
    for scene in [hall(1_000), rooms(1), rooms(4)] {
        assert_eq!(scene.validate(), Ok(()));
        let imported = read_back(&scene);
        assert_eq!(imported.report.warnings, Vec::<String>::new());
        assert_eq!(imported.report.merged_faces, 0);
        assert_eq!(imported.scene.polygons.len(), scene.polygons.len());
        assert_eq!(imported.scene.power(), scene.power());
        assert!((imported.scene.surface_area() / scene.surface_area() - 1.0).abs() < 1e-12);
    }
}

/// Round bodies keep their normals, and every body stands on the floor that the camera looks at.
#[test]
fn what_stands_under_the_sky_reads_back() {
    for scene in [shapes(32), dominoes(36), plant(20)] {
        assert_eq!(scene.validate(), Ok(()));
        let imported = read_back(&scene);
        assert_eq!(imported.report.warnings, Vec::<String>::new());
        // By area: two triangles in one plane come back as one face. Normals within a degree of the face's own are not kept.
        let smooth = |scene: &Scene| -> f64 {
            scene.polygon_ids().filter(|&id| scene.has_shading_normals(id)).map(|id| scene.area(id)).sum()
        };
        assert!(smooth(&imported.scene) >= 0.8 * smooth(&scene), "{} of {}", smooth(&imported.scene), smooth(&scene));
        assert_eq!(scene.bounds().0.z, 0.0);
    }
}

/// Mirrors are still mirrors, and a warning says that no bake knows them.
#[test]
fn mirrors_read_back() {
    for scene in [looking_glass(5), tori(8)] {
        assert_eq!(scene.validate(), Ok(()));
        let imported = read_back(&scene);
        assert!(imported.report.warnings.len() == 1 && imported.report.warnings[0].contains("mirrors"));
        let glosses = |scene: &Scene| scene.materials.iter().map(|material| material.gloss).collect::<Vec<_>>();
        assert_eq!(glosses(&imported.scene), glosses(&scene));
    }
}

/// From inside, every ray ends on a front: nothing leaks, nothing is wound the wrong way.
#[test]
fn rays_from_the_cameras_meet_fronts() {
    for scene in [hall(2_000), rooms(5)] {
        let bvh = Bvh::of_scene(&scene);
        for camera in &scene.cameras {
            for direction in directions(2_000) {
                let hit = bvh.closest_hit(&Ray { origin: camera.camera.eye, direction }, 0.0).unwrap();
                assert!(hit.normal.dot(direction) < 0.0, "{direction} meets the back of {}", hit.id);
            }
        }
    }
}

/// Shells without a gap: every border edge lies where a thing stands on another one.
#[test]
fn the_shell_of_the_rooms_is_closed_edge_to_edge() {
    let scene = rooms(3);
    let edges = HalfEdges::new(&scene);
    let shell = |polygon: u32| scene.objects[scene.polygons[polygon as usize].object as usize].starts_with("room");
    let shells = (0..scene.corners.len()).filter(|&edge| shell(edges.polygon[edge]));
    assert_eq!(shells.filter(|&edge| edges.twin[edge] == NO_TWIN).count(), 0);
}

#[test]
fn every_third_room_has_lamps_of_a_hundredth() {
    let scene = rooms(3);
    let radiances: Vec<f64> = scene.emitters().map(|polygon| scene.material(polygon).radiance.x).collect();
    assert_eq!(radiances, [30.0, 30.0, 0.3, 0.3, 30.0, 30.0]);
}
