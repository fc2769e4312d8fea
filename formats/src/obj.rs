//! Wavefront OBJ: text → checked text → tobj → faces with their materials, objects and cameras.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};
use scene::{Material, NamedCamera};

use crate::FormatError;
use crate::attributes::Attributes;
use crate::face::{Corner, Face};
use crate::material_library::read_materials;
use crate::model::Model;
use crate::obj_text::{self, ObjText};
use crate::report::{ImportReport, counted};

/// Reads an OBJ file and the MTL files that it names.
pub(crate) fn read_obj(path: &Path, report: &mut ImportReport) -> Result<Model, FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::read(path, error))?;
    if bytes.len() > u32::MAX as usize {
        return Err(FormatError::content(path, "is larger than 4 GiB", "split the scene"));
    }
    // Names and comments may be in any encoding; the rest is ASCII.
    let text = obj_text::check(path, &String::from_utf8_lossy(&bytes))?;
    if text.faces.is_empty() {
        return Err(FormatError::content(path, "has no faces", "export the scene as polygons"));
    }
    report.polygons_read = text.faces.len();
    warn_of_text(&text, report);
    let materials = read_materials(path, &text.libraries, &text.materials, report)?;
    let names =
        materials.list.iter().map(|material| tobj::Material { name: material.name.clone(), ..Default::default() });
    let library = (names.collect::<Vec<_>>(), materials.index);
    let clean = format!("mtllib all\n{}", text.clean);
    let (meshes, _) = tobj::load_obj_buf(&mut clean.as_bytes(), &tobj::LoadOptions::default(), |_| Ok(library.clone()))
        .map_err(|error| FormatError::content(path, format!("is no OBJ file ({error})"), "export the file again"))?;

    let mut model =
        Model { materials: materials.list, textures: materials.textures, cameras: named(&text), ..Model::default() };
    let (mut objects, mut unassigned) = (HashMap::new(), None);
    let mut lines = text.faces.iter().copied();
    for tobj::Model { mesh, name } in meshes {
        // tobj leaves the list out where all faces are triangles.
        let triangles = if mesh.face_arities.is_empty() { mesh.indices.len() / 3 } else { 0 };
        let sizes: Vec<usize> =
            mesh.face_arities.iter().map(|&size| size as usize).chain(std::iter::repeat_n(3, triangles)).collect();
        if sizes.is_empty() {
            continue;
        }
        let object = *objects.entry(name.clone()).or_insert_with(|| {
            model.objects.push(name);
            model.objects.len() as u32 - 1
        });
        let material = mesh.material_id.unwrap_or_else(|| {
            *unassigned.get_or_insert_with(|| {
                model.materials.push(Material::grey("unassigned"));
                report.missing_materials += 1;
                report.warn("faces before the first usemtl became a grey of reflectance 0.5; give them a material");
                model.materials.len() - 1
            })
        }) as u32;
        let first_vertex = model.positions.len() as u32;
        model.positions.extend(mesh.positions.as_chunks().0.iter().map(|&position| DVec3::from_array(position)));
        let textured = model.materials[material as usize].texture.is_some();
        let mut first = 0;
        for (size, line) in sizes.into_iter().zip(&mut lines) {
            let places = first..first + size;
            first += size;
            if materials.left_out.contains(&(material as usize)) {
                report.transparent_faces += 1;
                continue;
            }
            let vertices: Vec<u32> = mesh.indices[places.clone()].iter().map(|index| first_vertex + index).collect();
            let outline: Vec<DVec3> = vertices.iter().map(|&vertex| model.positions[vertex as usize]).collect();
            let textured = textured && line.has_texture_coordinates;
            let mut attributes: Vec<_> =
                places.map(|corner| attributes(&mesh, corner, (textured, line.has_normals))).collect();
            let seams = model.attributes.seams(&outline, &mut attributes);
            let corners = vertices.into_iter().zip(seams).map(|(vertex, seam)| Corner { vertex, seam });
            model.faces.push(Face { corners: corners.collect(), material, object, line: line.line });
        }
    }
    if report.transparent_faces > 0 {
        report.warn(format!(
            "{} left out: their materials are seen through for the most part (d below 0.5, or Tr above); write `d 1` in \
             the MTL file to keep them",
            counted(report.transparent_faces, "face was", "faces were"),
        ));
    }
    Ok(model)
}

/// What a corner has beside its position, if its face is textured and if it has normals. An OBJ counts v upwards.
fn attributes(mesh: &tobj::Mesh, corner: usize, (textured, has_normals): (bool, bool)) -> Attributes {
    let texture = mesh.texcoord_indices.get(corner).and_then(|&i| mesh.texcoords.get(2 * i as usize..)?.first_chunk());
    let normal = mesh.normal_indices.get(corner).and_then(|&i| mesh.normals.get(3 * i as usize..)?.first_chunk());
    Attributes {
        uv: texture.filter(|_| textured).map(|&[u, v]: &[f64; 2]| DVec2::new(u, 1.0 - v).as_vec2()),
        normal: normal
            .filter(|_| has_normals)
            .map(|&normal: &[f64; 3]| DVec3::from_array(normal).normalize_or_zero().as_vec3()),
    }
}

/// The cameras by name: camera, camera2, camera3 …
fn named(text: &ObjText) -> Vec<NamedCamera> {
    let name = |i: usize| if i == 0 { "camera".to_owned() } else { format!("camera{}", i + 1) };
    text.cameras.iter().enumerate().map(|(i, &camera)| NamedCamera { name: name(i), camera }).collect()
}

fn warn_of_text(text: &ObjText, report: &mut ImportReport) {
    if let Some(line) = text.bad_cameras.first() {
        report.warn(format!(
            "{} skipped, the first in line {line}: write `# camera eye X Y Z dir X Y Z up X Y Z fov_deg D`",
            counted(
                text.bad_cameras.len(),
                "camera comment says no valid camera and was",
                "camera comments say no valid camera and were"
            ),
        ));
    }
    if let Some(line) = text.free_form.first() {
        report.warn(format!(
            "{} skipped, the first in line {line}: export the scene as polygons",
            counted(text.free_form.len(), "free-form curve or surface was", "free-form curves or surfaces were"),
        ));
    }
}
