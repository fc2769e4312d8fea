//! Import: a scene file becomes a scene that every later stage can rely on (stage 1 of the pipeline).
//!
//! Polygons stay as the file has them, except that triangles which a modeller cut a polygon into are merged again,
//! that what is not convex or not planar is split, and that repeated vertices are welded: silhouettes are edges
//! between neighbours, and without shared vertices every edge of a mesh would cast a shadow line of its own.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use glam::{DVec3, Vec3};
use scene::{Polygon, Scene};

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
use crate::weld::weld;

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
/// (`illum` 3, 5, 8) or a metal (`Kd` black, `Ks` not) reflects `Kd` + `Ks` diffusely; `d` below 0.5 is left out.
///
/// Of a glTF file, the base colour is the reflectance (of metals, too), the emissive factor times its strength the emitted
/// radiance, nits per channel taken as W·sr⁻¹·m⁻²; double-sided materials make two polygons, and what is translucent with a
/// mean alpha below 0.5, or transmits half of the light, is left out. Cameras keep their names.
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
    let (vertices, stands_for) = weld(&model.positions, tolerance);
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
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    /// Reads a scene from the text of an OBJ file, with an MTL file beside it.
    fn read(obj: &[u8], mtl: &[u8]) -> Result<Imported, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.obj");
        std::fs::write(&path, obj).unwrap();
        std::fs::write(folder.path().join("room.mtl"), mtl).unwrap();
        // Without the folder, whose name is another each time.
        let folder = format!("{}/", folder.path().display());
        read_scene(&path).map_err(|error| error.to_string().replace(&folder, ""))
    }

    fn data(name: &str) -> Imported {
        read_scene(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/scenes").join(name)).unwrap()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn what_is_no_scene_is_refused_with_the_cause() {
        for (text, cause) in [
            ("", "has no faces"),
            ("# nothing\n", "has no faces"),
            (SQUARE, "has no faces"),
            ("v 0 0 0\nf 1 1 1\nf 1 1\nf 1\nf\n", "no face with an area"),
            ("v 0 0 0\nv 1 0 0\nv 0 1e6 0\nf 1 2 3\n", "room.obj, line 3: "),
        ] {
            let message = read(text.as_bytes(), b"").unwrap_err();
            assert!(message.contains("room.obj") && message.contains(cause), "{message}");
        }
        let missing = read_scene(Path::new("missing.obj")).unwrap_err().to_string();
        assert!(missing.starts_with("missing.obj: cannot be read"), "{missing}");
        assert!(read_scene(Path::new("scene.fbx")).unwrap_err().to_string().contains("give an .obj file"));
    }

    #[test]
    fn degenerate_faces_are_skipped_and_counted_with_the_first_line() {
        let text = format!("{SQUARE}f 1 2 3 4\nf 1 2 2\nf 1 2\nf 3 2 3\nf 1 1 2 3\n");
        let Imported { scene, report } = read(text.as_bytes(), b"").unwrap();
        assert_eq!((report.polygons_read, report.degenerate_faces), (5, 3));
        assert_eq!(scene.polygons.len(), 2);
        assert!(
            report.warnings.iter().any(|w| w.starts_with("3 faces (the first in line 6)")),
            "{:?}",
            report.warnings
        );
    }

    #[test]
    fn an_outline_loses_its_repeated_corners_and_spikes() {
        let tidy = |vertices: &[u32]| {
            let corners: Vec<_> = vertices.iter().map(|&vertex| Corner { vertex, seam: 0 }).collect();
            without_spikes(&corners).iter().map(|corner| corner.vertex).collect::<Vec<_>>()
        };
        assert_eq!(tidy(&[]), Vec::<u32>::new());
        assert_eq!(tidy(&[1, 1]).len(), 1);
        assert!(tidy(&[1, 2, 1]).len() < 3);
        assert_eq!(tidy(&[1, 1, 2, 3, 3]), [1, 2, 3]);
        assert_eq!(tidy(&[1, 2, 9, 8, 9, 2, 3]), [1, 2, 3]);
        assert_eq!(tidy(&[9, 8, 9, 1, 2, 3]), [9, 1, 2, 3]);
        assert_eq!(tidy(&[8, 9, 1, 2, 3, 9]), [1, 2, 3, 9]);
        assert_eq!(tidy(&[9, 1, 2, 3, 9, 8]), [9, 1, 2, 3]);
        // A hole joined to the outline by a seam is no spike.
        assert_eq!(tidy(&[1, 2, 3, 1, 4, 5, 6, 4]), [1, 2, 3, 1, 4, 5, 6, 4]);
    }

    #[test]
    fn two_sided_sheets_stay_and_doubles_go() {
        let text = format!("{SQUARE}f 1 2 3 4\nf 4 3 2 1\nf 3 4 1 2\nf 2 1 4 3\n");
        let Imported { scene, report } = read(text.as_bytes(), b"").unwrap();
        assert_eq!((scene.polygons.len(), report.repeated_faces), (2, 2));
        assert_eq!(scene.plane(0).normal, -scene.plane(1).normal);
    }

    #[test]
    fn quads_stay_triangulated_quads_are_merged_bent_and_concave_ones_are_split() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0.1\nv .2 .2 0\n\
                    o a\nf 1 2 3 4\no b\nf -7 -6 -5\nf 1 3 4\no c\nf 2 5 6 3\no d\nf 1 2 7 4\n";
        let Imported { scene, report } = read(text.as_bytes(), b"").unwrap();
        assert_eq!((report.merged_faces, report.non_planar_faces, report.concave_faces), (1, 1, 1));
        assert_eq!(scene.objects, ["a", "b", "c", "d"]);
        let corners: Vec<_> = scene.polygons.iter().map(|p| (p.object, p.corner_count)).collect();
        // The merged square of b repeats the one of a, which the file has as a quad; both stay.
        assert_eq!(corners, [(0, 4), (1, 4), (2, 3), (2, 3), (3, 3), (3, 3)]);
        assert!((scene.area(1) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn repeated_positions_are_welded_also_across_objects() {
        let text = format!("{SQUARE}v 1 0 0\nv 2 0 0\nv 2 1 0\nv 1.00000004 1 0\no a\nf 1 2 3 4\no b\nf 5 6 7 8\n");
        let Imported { scene, report } = read(text.as_bytes(), b"").unwrap();
        assert_eq!((scene.vertices.len(), report.welded_vertices), (6, 2));
        assert_eq!(scene::HalfEdges::new(&scene).twin.iter().filter(|&&twin| twin != scene::NO_TWIN).count(), 2);
    }

    #[test]
    fn triangles_with_different_texture_coordinates_or_normals_at_their_edge_stay_apart() {
        let merged = |text: &str| read(format!("{SQUARE}{text}").as_bytes(), b"").unwrap().report.merged_faces;
        let normals = "vn 0 0 1\nvn 0 0.6 0.8\n";
        assert_eq!(merged(&format!("{normals}f 1//2 2//2 3//1\nf 1//2 3//1 4//1\n")), 1);
        assert_eq!(merged(&format!("{normals}f 1//1 2//2 3//1\nf 1//1 3//1 4//2\n")), 0, "a saddle");
        assert_eq!(merged(&format!("{normals}f 1//1 2//1 3//1\nf 1//2 3//2 4//2\n")), 0);
        // Without a texture its coordinates mean nothing.
        assert_eq!(merged("vt 0 0\nvt 1 0\nf 1/1 2/2 3/1\nf 1/1 3/2 4/2\n"), 1);
        let png = image::RgbImage::from_pixel(1, 1, image::Rgb([90; 3]));
        let folder = tempfile::tempdir().unwrap();
        png.save(folder.path().join("a.png")).unwrap();
        std::fs::write(folder.path().join("room.mtl"), "newmtl a\nmap_Kd -s 1 1 a.png\n").unwrap();
        let textured = |text: &str| {
            let path = folder.path().join("room.obj");
            std::fs::write(&path, format!("mtllib room.mtl\nusemtl a\n{SQUARE}{text}")).unwrap();
            let imported = read_scene(&path).unwrap();
            assert_eq!(imported.scene.texture_coordinates.len(), imported.scene.corners.len());
            imported.report.merged_faces
        };
        let corners = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
        assert_eq!(textured(&format!("{corners}f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")), 1);
        assert_eq!(textured(&format!("{corners}f 1/1 2/2 3/3\nf 1/1 3/3 4/3\n")), 0, "another map");
        assert_eq!(textured(&format!("{corners}f 1/1 2/2 3/3\nf 1/2 3/3 4/4\n")), 0, "other corners");
        // A quad over which the map is not affine is two triangles over which it is.
        assert_eq!(textured(&format!("{corners}f 1/1 2/2 3/3 4/3\n")), 0);
    }

    #[test]
    fn materials_are_read_and_what_is_wrong_with_them_is_said() {
        let text = format!(
            "mtllib room.mtl\nmtllib gone.mtl\n{SQUARE}f 1 2 3\nusemtl lamp\nf 1 2 4\nusemtl white\nf 2 3 4\nusemtl lost\nf 1 3 4\n"
        );
        let mtl = "newmtl lamp\nKd 0\nKe 17 12 4\nnewmtl white\nKd 1 0.5 3\nmap_Kd wood.png\nNs what\nnewmtl bare\n";
        let Imported { scene, report } = read(text.as_bytes(), mtl.as_bytes()).unwrap();
        let material = |polygon| scene.material(polygon);
        assert_eq!((material(0).name.as_str(), material(0).reflectance), ("unassigned", DVec3::splat(0.5)));
        assert_eq!((material(1).reflectance, material(1).radiance), (DVec3::ZERO, DVec3::new(17., 12., 4.)));
        assert_eq!(material(2).reflectance, DVec3::new(0.999, 0.5, 0.999));
        assert_eq!((material(3).name.as_str(), material(3).reflectance), ("lost", DVec3::splat(0.5)));
        assert_eq!((report.missing_materials, report.clamped_materials, report.textured_materials), (2, 1, 1));
        let warnings = report.warnings.join("\n");
        for part in [
            "gone.mtl (line 2 of ",
            "\"lost\" in line 12",
            "\"bare\", have no Kd",
            "\"white\", reflect",
            "texture",
            "before the first usemtl",
        ] {
            assert!(warnings.contains(part), "{part} in {warnings}");
        }
    }

    #[test]
    fn a_wrong_line_of_the_materials_is_an_error_in_that_file() {
        let obj = format!("mtllib room.mtl\n{SQUARE}f 1 2 3\n");
        for (mtl, line, cause) in [
            ("newmtl a\nKd 0.5 0.5", 2, "a colour of 2 numbers"),
            ("newmtl a\nKd\n", 2, "a colour of 0 numbers"),
            ("newmtl a\n\nKe nan 0 0", 3, "not finite"),
            ("newmtl a\nKd -0.1 0 0", 2, "negative"),
            ("newmtl a\nKd spectral white.rfl", 2, "\"spectral\" is not a number"),
            ("Kd 1 1 1", 1, "before any newmtl"),
        ] {
            let message = read(obj.as_bytes(), mtl.as_bytes()).unwrap_err();
            assert!(message.contains(&format!("room.mtl, line {line}: ")) && message.contains(cause), "{message}");
        }
    }

    #[test]
    fn the_office_has_its_109_polygons_and_camera() {
        let Imported { scene, report } = data("office.obj");
        assert_eq!((scene.polygons.len(), scene.cameras.len()), (109, 1));
        assert_eq!(report.warnings, Vec::<String>::new());
        assert_eq!((report.merged_faces, report.degenerate_faces, report.concave_faces), (0, 0, 0));
        assert_eq!(scene.cameras[0].name, "camera");
        assert!((scene.cameras[0].camera.vertical_fov.to_degrees() - 68.0).abs() < 1e-12);
        assert!(scene.emitters().count() >= 2);
    }

    #[test]
    fn a_scene_file_over_the_office() {
        let Imported { scene, report } = data("office_evening.toml");
        let office = data("office.obj").scene;
        assert_eq!((&scene.vertices, &scene.corners), (&office.vertices, &office.corners));
        assert_eq!(report.warnings, Vec::<String>::new());
        let material = |name: &str| scene.materials.iter().find(|material| material.name == name).unwrap();
        assert_eq!(material("panel").radiance, DVec3::new(7.0, 5.5, 3.5));
        assert_eq!(material("wall").reflectance, DVec3::new(0.62, 0.5, 0.42));
        let names: Vec<_> = scene.cameras.iter().map(|named| named.name.as_str()).collect();
        assert_eq!(names, ["desk", "camera"]);
    }

    /// The left wall is a warped quad in the published measurements (its lower corners lie at 0.5528 and 0.5496 m, its
    /// upper ones at 0.556 m): the file has it as two triangles that are not coplanar, and they stay two.
    #[test]
    fn the_cornell_box_has_20_polygons() {
        let Imported { scene, report } = data("cornell_box.obj");
        assert_eq!(scene.polygons.len(), 20);
        assert_eq!(report.warnings, Vec::<String>::new());
        let left: Vec<_> = scene.polygon_ids().filter(|&p| scene.material(p).name == "red").collect();
        assert_eq!(left.len(), 2);
        assert!(scene.plane(left[0]).normal.dot(scene.plane(left[1]).normal) < 1.0 - 1e-5);
        assert_eq!(
            scene.emitters().map(|p| scene.material(p).radiance).collect::<Vec<_>>(),
            [DVec3::new(17., 12., 4.)]
        );
    }

    #[test]
    fn the_blocker_plane_has_its_three_squares() {
        let Imported { scene, report } = data("blocker_plane.obj");
        assert_eq!((scene.polygons.len(), scene.cameras[0].name.as_str()), (3, "default"));
        assert_eq!((scene.area(0), scene.area(1), scene.area(2)), (16.0, 1.0, 0.25));
        assert_eq!(report.warnings, Vec::<String>::new());
    }

    #[test]
    fn a_lamp_drawn_on_the_ceiling_is_the_one_that_stays() {
        let mtl = b"newmtl lamp\nKd 0\nKe 1\nnewmtl ceiling\nKd 0.8\n";
        let faces = ["usemtl ceiling\nf 1 2 3 4\n", "usemtl lamp\nf 2 3 4 1\n"];
        for text in [faces.concat(), [faces[1], faces[0]].concat()] {
            let obj = format!("mtllib room.mtl\n{SQUARE}{text}");
            let Imported { scene, report } = read(obj.as_bytes(), mtl).unwrap();
            assert_eq!((scene.polygons.len(), scene.emitters().count(), report.repeated_faces), (1, 1, 1));
        }
    }

    /// Whatever comes out is a scene of convex, planar polygons.
    fn check(imported: &Imported) {
        let scene = &imported.scene;
        scene.validate().unwrap();
        assert!(!scene.cameras.is_empty());
        for polygon in scene.polygon_ids() {
            let (outline, plane) = (scene.outline(polygon), scene.plane(polygon));
            assert!(scene::is_convex(&outline, plane.normal, 2e-6), "{outline:?}");
            assert!(outline.iter().all(|&p| plane.distance(p).abs() <= 2e-5 * size(&outline)), "{outline:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn raw_bytes_do_not_panic(obj in proptest::collection::vec(any::<u8>(), 0..400), mtl: Vec<u8>) {
            if let Ok(imported) = read(&obj, &mtl) {
                check(&imported);
            }
        }

        #[test]
        fn lines_that_look_like_a_scene_do_not_panic(
            lines in proptest::collection::vec("(v|f|vt|vn|g|o|usemtl|mtllib|l|#|\\\\|# camera eye)( [-0-9./ae]{1,6}){0,5}", 0..40),
            mtl in proptest::collection::vec("(newmtl|Kd|Ke|map_Kd|illum|bump)( [-0-9.a]{1,4}){0,4}", 0..10),
        ) {
            let obj = format!("mtllib room.mtl\n{SQUARE}f 1 2 3\n{}", lines.join("\n"));
            if let Ok(imported) = read(obj.as_bytes(), mtl.join("\n").as_bytes()) {
                check(&imported);
            }
        }

        #[test]
        fn any_faces_over_few_vertices_become_convex_polygons(
            vertices in proptest::collection::vec((-3..4i32, -3..4i32, 0..2i32), 3..20),
            faces in proptest::collection::vec(proptest::collection::vec(0..1000usize, 0..7), 1..30),
        ) {
            let mut text = String::new();
            for (x, y, z) in &vertices {
                text += &format!("v {x} {y} {z}\n");
            }
            for face in &faces {
                let corners: Vec<_> = face.iter().map(|i| format!("{}", i % vertices.len() + 1)).collect();
                text += &format!("f {}\n", corners.join(" "));
            }
            let first = read(text.as_bytes(), b"");
            if let Ok(imported) = &first {
                check(imported);
            }
            prop_assert_eq!(first, read(text.as_bytes(), b""));
        }
    }
}
