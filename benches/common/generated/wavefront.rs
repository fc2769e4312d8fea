//! A scene as Wavefront OBJ and MTL, which read back to the same scene.

use std::fmt::Write;

use scene::{Rgb, Scene};

/// The OBJ text; `library` is the name of the MTL file beside it.
pub fn obj(scene: &Scene, library: &str) -> String {
    let mut text = format!("# {} polygons, metres, z up\n", scene.polygons.len());
    for named in &scene.cameras {
        let camera = &named.camera;
        let [eye, direction, up] =
            [camera.eye, camera.target - camera.eye, camera.up].map(|v| v.to_array().map(|c| c.to_string()).join(" "));
        let fov = camera.vertical_fov.to_degrees();
        let _ = writeln!(text, "# camera eye {eye} dir {direction} up {up} fov_deg {fov}");
    }
    let _ = writeln!(text, "mtllib {library}");
    for v in &scene.vertices {
        let _ = writeln!(text, "v {} {} {}", v.x, v.y, v.z);
    }
    let (mut object, mut material, mut normals) = (None, None, 0);
    for (id, polygon) in (0..).zip(&scene.polygons) {
        if object.replace(polygon.object) != Some(polygon.object) {
            let _ = writeln!(text, "o {}", scene.objects[polygon.object as usize]);
        }
        if material.replace(polygon.material) != Some(polygon.material) {
            let _ = writeln!(text, "usemtl {}", scene.materials[polygon.material as usize].name);
        }
        let is_smooth = scene.has_shading_normals(id);
        for n in scene.shading_normals.get(polygon.corner_range()).into_iter().flatten().filter(|_| is_smooth) {
            let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
        }
        text.push('f');
        for corner in &scene.corners[polygon.corner_range()] {
            normals += u32::from(is_smooth);
            let _ = match is_smooth {
                true => write!(text, " {}//{normals}", corner + 1),
                false => write!(text, " {}", corner + 1),
            };
        }
        text.push('\n');
    }
    text
}

/// The MTL text.
pub fn mtl(scene: &Scene) -> String {
    let mut text =
        String::from("# Kd: linear RGB reflectance; Ks: mirrors; Ke: emitted radiance, W/(m^2 sr), front side only\n");
    let numbers = |colour: Rgb| colour.to_array().map(|channel| channel.to_string()).join(" ");
    for material in &scene.materials {
        let (name, radiance) = (&material.name, numbers(material.radiance));
        let diffuse = numbers(material.gloss.map_or(material.reflectance, |gloss| gloss.diffuse));
        let _ = writeln!(text, "\nnewmtl {name}\nKd {diffuse}\nKe {radiance}");
        if let Some(gloss) = material.gloss.filter(|gloss| gloss.is_mirror) {
            let _ = writeln!(text, "Ks {}\nillum 3", numbers(gloss.specular));
        }
    }
    text
}
