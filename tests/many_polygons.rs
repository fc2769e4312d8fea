//! Scenes of too many polygons for links: the same bytes at any number of threads, an error that a reference confirms, no leak.

use std::path::{Path, PathBuf};

use glam::DVec3;
use scene::{Polygon, Scene};

use crate::fixture::{folder, halflight, text};
use crate::generated::{mtl, obj, rooms};

/// A furnished room of 832 polygons, and in it a closed box of walls without thickness, which are two-sided and stand on the floor:
/// nothing shines into it.
fn room_with_a_dark_box() -> Scene {
    let mut scene = rooms(1);
    scene.objects.push("dark box".into());
    let grey = (0..scene.materials.len()).find(|&id| !scene.materials[id].emits()).unwrap() as u32;
    let (low, high) = (DVec3::new(0.4, 0.4, 0.0), DVec3::new(0.6, 0.7, 0.3));
    let corner = |x: bool, y: bool, z: bool| {
        DVec3::new(if x { high.x } else { low.x }, if y { high.y } else { low.y }, if z { high.z } else { low.z })
    };
    let walls = [
        [(false, false, false), (true, false, false), (true, false, true), (false, false, true)],
        [(true, false, false), (true, true, false), (true, true, true), (true, false, true)],
        [(true, true, false), (false, true, false), (false, true, true), (true, true, true)],
        [(false, true, false), (false, false, false), (false, false, true), (false, true, true)],
        [(false, false, true), (true, false, true), (true, true, true), (false, true, true)],
    ];
    let first = scene.vertices.len() as u32;
    let places: Vec<DVec3> = (0..8).map(|i| corner(i & 1 != 0, i & 2 != 0, i & 4 != 0)).collect();
    scene.vertices.extend(places);
    let id = |(x, y, z): (bool, bool, bool)| first + u32::from(x) + 2 * u32::from(y) + 4 * u32::from(z);
    for wall in walls {
        let outside = wall.map(id);
        let inside = [outside[3], outside[2], outside[1], outside[0]];
        for corners in [outside, inside] {
            scene.polygons.push(Polygon {
                first_corner: scene.corners.len() as u32,
                corner_count: 4,
                material: grey,
                object: scene.objects.len() as u32 - 1,
            });
            scene.corners.extend(corners);
        }
    }
    scene
}

fn baked(folder: &Path, scene: &Path, threads: &str) -> PathBuf {
    let output = folder.join(threads).with_extension("hlf");
    let mut command = halflight();
    command.args(["bake", text(scene), "-o", text(&output), "--tolerance", "0.1"]).env("RAYON_NUM_THREADS", threads);
    command.assert().success();
    output
}

#[test]
fn a_furnished_room_with_a_dark_box() {
    let folder = folder();
    let scene = room_with_a_dark_box();
    let path = folder.path().join("room.obj");
    std::fs::write(folder.path().join("room.mtl"), mtl(&scene)).unwrap();
    std::fs::write(&path, obj(&scene, "room.mtl")).unwrap();
    let [one, three] = ["1", "3"].map(|threads| baked(folder.path(), &path, threads));
    assert!(std::fs::read(&one).unwrap() == std::fs::read(&three).unwrap(), "three threads make another file");

    halflight().args(["verify", text(&one)]).assert().success();

    let baked = formats::read_baked(&one).unwrap();
    let inside = |p: DVec3| p.x > 0.4001 && p.x < 0.5999 && p.y > 0.4001 && p.y < 0.6999 && p.z < 0.2999;
    let (mut dark, mut lit) = (0, 0);
    for triangle in 0..baked.triangles.len() as u32 {
        let corners = baked.corners(triangle);
        let record = baked.triangles[triangle as usize];
        let middle = corners.iter().sum::<DVec3>() / 3.0 + baked.scene.plane(record.polygon).normal * 1e-3;
        let light = record.samples.map(|sample| baked.samples[sample as usize].max_element());
        if inside(middle) {
            assert_eq!(light, [0.0; 6], "triangle {triangle} at {middle}");
            dark += 1;
        } else {
            lit += usize::from(light.iter().all(|&light| light > 0.0));
        }
    }
    assert!(dark >= 10 && lit > 1000, "{dark} {lit}");
}
