//! Import: a scene file becomes a scene that every later stage can rely on (stage 1 of the pipeline).
//!
//! Polygons stay as the file has them, except that triangles which a modeller cut a polygon into are merged again,
//! that what is not convex or not planar is split, and that repeated vertices are welded: silhouettes are edges
//! between neighbours, and without shared vertices every edge of a mesh would cast a shadow line of its own.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use glam::{DVec3, Vec3};
use scene::{Polygon, Scene, Welder};

use crate::FormatError;
use crate::camera::default_camera;
use crate::convex::{Shape, shape_of};
use crate::face::{Corner, Face, size};
use crate::gltf::read_gltf;
use crate::merge::{drop_straight_corners, merge_triangles};
use crate::model::Model;
use crate::obj::read_obj;
use crate::repair::{add_other_sides, close_junctions, orient, warn_of_winding};
use crate::report::{ImportReport, counted};
use crate::scene_file::read_scene_file;

/// Distance within which positions are one vertex, as a fraction of the scene's size: a few roundings of f32, in
/// which most modellers keep coordinates. Wider would close gaps that were meant.
const WELD_DISTANCE: f64 = 1e-7;

/// Distance of a merged polygon's corners from its plane, as a fraction of its size: triangles that are coplanar but
/// for the six digits of a text file, and no bend that could be seen.
const COPLANARITY: f64 = 1e-6;

/// A scene, and what was done to it on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The repaired scene; it passes [`Scene::validate`] and has at least one polygon and one camera.
    pub scene: Scene,
    /// What was found and repaired.
    pub report: ImportReport,
}

/// Which sides of a file's faces are surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// Fronts, where corners run counter-clockwise, and backs where the file says that a material has them.
    #[default]
    AsWound,
    /// Both, where a file's winding is not to be trusted: every polygon gets its other side, of the same material, unless the
    /// file has it, or says of the material that it has none, or the polygon is part of a closed solid or of a closed room
    /// around a lamp or camera, wound consistently and with its fronts where they are seen from. A lamp then shines on both
    /// sides.
    Both,
}

/// Reads a scene file, its faces as they are wound: [`read_scene_as`].
///
/// # Errors
/// Those of [`read_scene_as`].
pub fn read_scene(path: &Path) -> Result<Imported, FormatError> {
    read_scene_as(path, Sides::AsWound)
}

/// Reads a scene file, by its extension: Wavefront OBJ with MTL, glTF 2.0 (`.gltf`, `.glb`), or a scene file
/// (`.toml`) that puts such models together.
///
/// Lengths are taken as metres, axes as the file has them; fronts are where corners run counter-clockwise. All surfaces are
/// diffuse and opaque: what a file says of mirrors, metals and glass is taken by stated rules, which count in the report.
///
/// Of an OBJ, `Kd` is the reflectance, `Ke` the emitted radiance in W·sr⁻¹·m⁻², `map_Kd` a texture of the reflectance. A mirror
/// (`illum` 3, 5, 8) or a metal (`Kd` black, `Ks` not) reflects `Kd` + `Ks` diffusely, and [`scene::Gloss`] keeps what it is; `d`
/// below 0.5 is left out.
///
/// Of a glTF file, the base colour is the reflectance (of metals, too), the emissive factor times its strength the emitted
/// radiance, nits per channel taken as W·sr⁻¹·m⁻²; double-sided materials make two polygons, and what is translucent with a
/// mean alpha below 0.5, or transmits half of the light, is left out. Cameras keep their names.
///
/// A scene file's environment keeps at most 2048 × 1024 texels of its map.
///
/// Light is computed with the mean colour of a texture over each polygon ([`Scene::reflectance`]).
///
/// Cameras of an OBJ stand in comments `# camera eye X Y Z dir X Y Z up X Y Z fov_deg D` (the full vertical
/// angle) and are named camera, camera2 …; a file without one gets a camera named default that shows the whole scene.
///
/// # Errors
/// A file that cannot be read, is of another kind, has a line that is wrong (the error names it) or holds no polygon.
pub fn read_scene_as(path: &Path, sides: Sides) -> Result<Imported, FormatError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let mut report = ImportReport::default();
    let model = match extension.as_deref() {
        Some("obj") => read_obj(path, &mut report)?,
        Some("gltf" | "glb") => read_gltf(path, &mut report)?,
        Some("toml") => read_scene_file(path, &mut report)?,
        _ => {
            return Err(FormatError::content(
                path,
                "is no scene file that can be read",
                "give an .obj file, a .gltf or .glb one, or a scene file (.toml)",
            ));
        }
    };
    // A camera that shows all of a scene stands outside of it, among backs: it says nothing of the winding.
    let cameras = model.cameras.len();
    let scene = repair(path, model, sides, &mut report)?;
    warn_of_winding(&scene, cameras, &mut report);
    Ok(Imported { scene, report })
}

/// Welds, splits and merges until every face is a polygon of a scene.
fn repair(path: &Path, mut model: Model, sides: Sides, report: &mut ImportReport) -> Result<Scene, FormatError> {
    model.separate_untextured();
    model.split_where_not_affine();
    let tolerance = WELD_DISTANCE * size(&model.positions);
    let mut welder = Welder::new(tolerance);
    let stands_for: Vec<u32> = model.positions.iter().map(|&position| welder.vertex(position)).collect();
    let vertices = welder.into_vertices();
    report.welded_vertices = model.positions.len() - vertices.len();

    let mut faces = std::mem::take(&mut model.faces);
    for face in &mut faces {
        face.corners.iter_mut().for_each(|corner| corner.vertex = stands_for[corner.vertex as usize]);
        face.corners = without_spikes(&face.corners);
    }
    // Of faces at one place a lamp is the one that was meant, wherever it stands in the file.
    faces.sort_by_key(|face| !model.materials[face.material as usize].emits());
    let mut sorted = Sorted::default();
    for face in faces {
        let shape = shape_of(&face.outline(&vertices), tolerance);
        sorted.take(face, shape);
    }
    sorted.faces.sort_by_key(|face| face.line);
    sorted.report(model.place(), report);
    let count = sorted.faces.len();
    let (mut faces, united) = merge_triangles(sorted.faces, &vertices, COPLANARITY, &|corners| {
        model.attributes.are_affine(corners, &vertices)
    });
    drop_straight_corners(&mut faces, &united, &vertices);
    report.merged_faces = count - faces.len();
    repair_edges(&mut faces, &vertices, &mut model, report);
    if faces.is_empty() {
        return Err(FormatError::content(path, "has no face with an area", "check the scene in a modeller"));
    }

    let mut scene = Scene {
        materials: model.materials,
        textures: model.textures,
        objects: model.objects,
        cameras: model.cameras,
        lights: model.lights,
        environment: model.environment,
        ..Scene::default()
    };
    // Vertices that no polygon uses any more are left out; the others are numbered as polygons come to them.
    let mut new_ids = vec![None; vertices.len()];
    for face in faces {
        scene.polygons.push(Polygon {
            first_corner: scene.corners.len() as u32,
            corner_count: face.corners.len() as u32,
            material: face.material,
            object: face.object,
        });
        for corner in face.corners {
            let id = *new_ids[corner.vertex as usize].get_or_insert_with(|| {
                scene.vertices.push(vertices[corner.vertex as usize]);
                scene.vertices.len() as u32 - 1
            });
            scene.corners.push(id);
            let attributes = model.attributes.get(corner.seam);
            scene.texture_coordinates.push(attributes.uv.unwrap_or_default());
            scene.shading_normals.push(attributes.normal.unwrap_or_default());
        }
    }
    drop_if_unused(&mut scene);
    scene.tints = scene.mean_texture_colours();
    add_sides(&mut scene, sides, &model.two_sided, report);
    if scene.cameras.is_empty() {
        scene.cameras.push(default_camera(&scene, model.up));
    }
    scene.validate().map_err(|source| FormatError::Invalid { path: path.to_owned(), source })?;
    Ok(scene)
}

/// Gives polygons the other sides that their materials or `sides` ask for.
fn add_sides(scene: &mut Scene, sides: Sides, said: &BTreeMap<u32, bool>, report: &mut ImportReport) {
    let added = add_other_sides(scene, sides == Sides::Both, said);
    report.other_sides = added.added;
    if added.doubtful_lamps > 0 {
        report.warn(format!(
            "{} on both sides now, with twice the power; if that is not meant, close the lamps' cases in the modeller, or write \
             two_sided = false for their material in a scene file",
            counted(added.doubtful_lamps, "polygon emits", "polygons emit")
        ));
    }
}

/// Leaves out lists of texture coordinates and normals that say nothing.
fn drop_if_unused(scene: &mut Scene) {
    if !scene.polygon_ids().any(|polygon| scene.material(polygon).texture.is_some()) {
        scene.texture_coordinates.clear();
    }
    if scene.shading_normals.iter().all(|normal| *normal == Vec3::ZERO) {
        scene.shading_normals.clear();
    }
}

/// Closes T-junctions and turns faces that disagree with their neighbours.
fn repair_edges(faces: &mut [Face], vertices: &[DVec3], model: &mut Model, report: &mut ImportReport) {
    let junctions = close_junctions(faces, vertices, &mut model.attributes);
    report.junctions = junctions.closed;
    report.open_junctions = junctions.left;
    if junctions.left > 0 {
        report.warn(format!(
            "{} almost on a neighbour's edge and stay open: weld the edges in the modeller",
            counted(junctions.left, "corner lies", "corners lie")
        ));
    }
    // Of what has both sides either may be the front.
    let stays = |face: &Face| {
        model.materials[face.material as usize].emits() || model.two_sided.get(&face.material) == Some(&true)
    };
    let winding = orient(faces, vertices, stays);
    report.turned_faces = winding.turned.len();
    report.one_sided_surfaces = winding.one_sided;
    for &face in &winding.turned {
        model.attributes.turn_to_front(&mut faces[face as usize].corners, vertices);
    }
    if let Some(first) = winding.turned.iter().map(|&face| faces[face as usize].line).min() {
        report.warn(format!(
            "{} (the first in {} {first}) wound against the larger part of the surface around, turned: recalculate the \
             normals in the modeller",
            counted(winding.turned.len(), "face was", "faces were"),
            model.place()
        ));
    }
    if winding.one_sided > 0 {
        report.warn(format!(
            "{} wound in no consistent way, because one side leads to the other, and stay: give --two-sided if they look black",
            counted(winding.one_sided, "surface is", "surfaces are")
        ));
    }
}

/// Faces that are polygons of a scene, and the lines of those that are not.
#[derive(Default)]
struct Sorted {
    faces: Vec<Face>,
    /// Outlines so far, each from its smallest vertex.
    known: HashSet<Vec<u32>>,
    degenerate: Vec<usize>,
    crossing: Vec<usize>,
    repeated: Vec<usize>,
    bent: Vec<usize>,
    concave: usize,
}

impl Sorted {
    /// Takes a face with welded corners as it is, in pieces, or not at all.
    fn take(&mut self, face: Face, shape: Shape) {
        let pieces = match shape {
            Shape::Degenerate => return self.degenerate.push(face.line),
            Shape::Crossing => return self.crossing.push(face.line),
            _ if !self.known.insert(canonical(&face.corners)) => return self.repeated.push(face.line),
            Shape::Convex => return self.faces.push(face),
            Shape::Bent(pieces) => {
                self.bent.push(face.line);
                pieces
            }
            Shape::Concave(pieces) => {
                self.concave += 1;
                pieces
            }
        };
        for places in pieces {
            let corners = places.into_iter().map(|place| face.corners[place as usize]).collect();
            self.faces.push(Face { corners, ..face });
        }
    }

    fn report(&self, place: &str, report: &mut ImportReport) {
        report.degenerate_faces = self.degenerate.len();
        report.crossing_faces = self.crossing.len();
        report.repeated_faces = self.repeated.len();
        report.non_planar_faces = self.bent.len();
        report.concave_faces = self.concave;
        for (lines, what) in [
            (&self.degenerate, "fewer than three distinct corners or no area, skipped: delete them in the modeller"),
            (&self.crossing, "an outline that crosses itself, skipped: model them as simple polygons"),
            (&self.repeated, "the same corners and front as an earlier face, skipped: delete doubles in the modeller"),
            (
                &self.bent,
                "corners that are not in one plane, split into planar pieces: triangulate them in the modeller",
            ),
        ] {
            if let Some(first) = lines.first() {
                let count = counted(lines.len(), "face", "faces");
                report.warn(format!("{count} (the first in {place} {first}) with {what}"));
            }
        }
    }
}

/// An outline without corners that repeat the one before, and without ways out to a corner and straight back.
fn without_spikes(corners: &[Corner]) -> Vec<Corner> {
    let mut kept: Vec<Corner> = Vec::with_capacity(corners.len());
    for &corner in corners {
        kept.push(corner);
        while let [.., before, last] = kept[..]
            && (before.vertex == last.vertex || kept.len() > 2 && kept[kept.len() - 3].vertex == last.vertex)
        {
            kept.truncate(kept.len() - if before.vertex == last.vertex { 1 } else { 2 });
        }
    }
    // The same where the end meets the start.
    let mut closed = kept.as_slice();
    while let [first, middle @ .., last] = closed {
        closed = match middle {
            _ if first.vertex == last.vertex => &closed[1..],
            [second, ..] if second.vertex == last.vertex => &closed[2..],
            [.., second] if first.vertex == second.vertex => &closed[..closed.len() - 2],
            _ => break,
        };
    }
    closed.to_vec()
}

/// The vertices of an outline from the smallest on: equal for outlines that differ in where they start alone.
fn canonical(corners: &[Corner]) -> Vec<u32> {
    let mut vertices: Vec<u32> = corners.iter().map(|corner| corner.vertex).collect();
    let smallest = (0..vertices.len()).min_by_key(|&i| vertices[i]).unwrap_or(0);
    vertices.rotate_left(smallest);
    vertices
}

#[cfg(test)]
mod tests;
