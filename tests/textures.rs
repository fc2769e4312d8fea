//! Textures from the scene file to the picture: their mean in the light, themselves in the pixels.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use scene::Camera;
use serde_json::{Value, json};
use viewer::{Frame, Mode, draw_on_cpu};

use crate::fixture::{box_faces, folder, probe, run, text, write_points};

/// A room of 4 × 3 × 2.5 m with a lamp below its ceiling; the floor, z = 0, is of the material given.
pub fn room(folder: &Path, floor: &str) -> PathBuf {
    let materials = format!("newmtl wall\nKd 0.6 0.5 0.4\nnewmtl lamp\nKd 0\nKe 20 20 20\nnewmtl floor\n{floor}\n");
    std::fs::write(folder.join("room.mtl"), materials).unwrap();
    let size = DVec3::new(4.0, 3.0, 2.5);
    let lamp = box_faces(DVec3::new(1.5, 1.0, 0.0), DVec3::new(2.5, 2.0, 2.4), true, &[1]);
    let walls = box_faces(DVec3::ZERO, size, true, &[0, 1, 2, 3, 4, 5]);
    let mut obj = String::from("mtllib room.mtl\n");
    for (i, corners) in walls.iter().chain(&lamp).enumerate() {
        for corner in corners {
            writeln!(obj, "v {} {} {}\nvt {} {}", corner.x, corner.y, corner.z, corner.x / 4.0, corner.y / 3.0)
                .unwrap();
        }
        let material = if i == 0 { "floor" } else { ["wall", "lamp"][usize::from(i == 6)] };
        writeln!(obj, "usemtl {material}\nf -4/-4 -3/-3 -2/-2 -1/-1").unwrap();
    }
    let path = folder.join("room.obj");
    std::fs::write(&path, obj).unwrap();
    path
}

#[test]
fn light_is_that_of_the_mean_and_pictures_show_the_texture() {
    // White left, black right: a mean of a half.
    let (textured, plain) = (folder(), folder());
    formats::write_png(&textured.path().join("halves.png"), 2, 1, &[[255; 3], [0; 3]]).unwrap();
    let scenes = [room(textured.path(), "Kd 0.8 0.8 0.8\nmap_Kd halves.png"), room(plain.path(), "Kd 0.4 0.4 0.4")];
    let bakes = scenes.each_ref().map(|scene| {
        let bake = scene.with_extension("hlf");
        run(&["bake", text(scene), "-o", text(&bake), "--tolerance", "0.03"]);
        bake
    });
    let places = [(0.5, 0.5), (1.0, 2.5), (3.2, 0.4), (2.0, 1.5)];
    let points = places.map(|(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z)).into_iter();
    let points = write_points(textured.path(), points.chain([(DVec3::new(0.0, 1.0, 0.7), DVec3::X)]));
    let [ours, exact] = [0, 1].map(|i| probe(&bakes[i], &points, &[]));
    for (ours, exact) in ours.iter().zip(&exact) {
        assert!((*ours - *exact).length() <= 1e-6 * exact.length(), "{ours} {exact}");
    }

    let info: Value = serde_json::from_slice(&run(&["info", text(&bakes[0]), "--json"]).stdout).unwrap();
    let texture = &info["scene"]["textures"][0];
    assert_eq!((&texture["size"], &texture["materials"]), (&json!([2, 1]), &json!(["floor"])));
    let said = String::from_utf8(run(&["info", text(&scenes[0])]).stdout).unwrap();
    assert!(said.contains("2x1, mean 0.5000 0.5000 0.5000, on floor"), "{said}");

    let baked = formats::read_baked(&bakes[0]).unwrap();
    let camera =
        Camera { eye: DVec3::new(2.0, 1.5, 2.0), target: DVec3::new(2.0, 1.5, 0.0), up: DVec3::Y, vertical_fov: 1.0 };
    let frame =
        Frame { camera, width: 40, height: 20, mode: Mode::Shaded, exposure: None, curve: scene::ToneCurve::default() };
    let picture = draw_on_cpu(&baked, &frame);
    let grey = draw_on_cpu(&formats::read_baked(&bakes[1]).unwrap(), &frame);
    // Texels are bilinear: white in the middle of the left half, black in that of the right one, and the half between.
    let ratio = |x: usize| (picture.radiance[10 * 40 + x] / grey.radiance[10 * 40 + x]).x;
    let [edge, left, middle, right] = [4, 10, 19, 29].map(ratio);
    assert!(left > 1.9 && (middle - 1.0).abs() < 0.1 && right < 0.1, "{left} {middle} {right}");
    // Towards the wall the texture repeats: what is left of its first texel is its last.
    assert!(edge > 1.2 && edge < 1.4, "{edge}");
    assert!(picture.radiance.iter().all(|radiance| radiance.cmpge(Vec3::ZERO).all()));
}
