//! Reads the OBJ scenes of this project as they are: one polygon a face, in the file's order. A reference must not
//! share the importer with what it judges, and its `face` column counts the faces of the file.

use std::{collections::BTreeMap, error::Error, path::Path, str::FromStr};

use glam::DVec3;
use scene::{Material, Polygon, Rgb, Scene};

/// Reads `v`, `f` (absolute indices of positions), `usemtl` and `mtllib`, and of materials `Kd` and `Ke`.
pub fn read(path: &Path) -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene { objects: vec!["all".into()], ..Scene::default() };
    let mut known = BTreeMap::new();
    let mut material = 0;
    for line in std::fs::read_to_string(path)?.lines() {
        let (key, rest) = line.split_once(' ').unwrap_or((line, ""));
        match key {
            "mtllib" => read_materials(&path.with_file_name(rest), &mut scene.materials, &mut known)?,
            "usemtl" => material = *known.get(rest).ok_or("a material that the library does not define")?,
            "v" => scene.vertices.push(vector(rest)?),
            "f" => {
                let corners: Vec<u32> = numbers(rest)?;
                scene.polygons.push(Polygon {
                    first_corner: scene.corners.len() as u32,
                    corner_count: corners.len() as u32,
                    material,
                    object: 0,
                });
                scene.corners.extend(corners.iter().map(|corner| corner.wrapping_sub(1)));
            }
            _ => {}
        }
    }
    scene.validate()?;
    Ok(scene)
}

fn read_materials(
    path: &Path,
    materials: &mut Vec<Material>,
    known: &mut BTreeMap<String, u32>,
) -> Result<(), Box<dyn Error>> {
    for line in std::fs::read_to_string(path)?.lines() {
        match (line.split_once(' '), materials.last_mut()) {
            (Some(("newmtl", name)), _) => {
                known.insert(name.into(), materials.len() as u32);
                materials.push(Material { reflectance: Rgb::ZERO, ..Material::grey(name) });
            }
            (Some(("Kd", rest)), Some(material)) => material.reflectance = vector(rest)?,
            (Some(("Ke", rest)), Some(material)) => material.radiance = vector(rest)?,
            _ => {}
        }
    }
    Ok(())
}

fn vector(text: &str) -> Result<DVec3, Box<dyn Error>> {
    let [x, y, z] = numbers(text)?.try_into().map_err(|_| "not three numbers")?;
    Ok(DVec3::new(x, y, z))
}

fn numbers<T: FromStr<Err: Error + 'static>>(text: &str) -> Result<Vec<T>, Box<dyn Error>> {
    Ok(text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?)
}
