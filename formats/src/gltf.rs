//! glTF 2.0 and GLB: nodes, meshes and cameras → a model. Materials are in `gltf_materials`, numbers in `gltf_buffers`.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use ::gltf::mesh::Mode;
use ::gltf::{Document, Node, Primitive, Semantic};
use glam::{DMat3, DMat4, DVec3, Vec2};
use scene::{Camera, NamedCamera};

use crate::FormatError;
use crate::attributes::Attributes;
use crate::face::{Corner, Face};
use crate::gltf_buffers::{Buffers, split_container};
use crate::gltf_materials::{GltfMaterials, read_materials};
use crate::model::Model;
use crate::report::{ImportReport, counted};

/// Most triangles that a file may make. Nodes may show one mesh many times, so the file's length is no bound.
const MOST_TRIANGLES: usize = 20_000_000;

/// Extensions that a file may require. Those of materials are passed over where `gltf_materials` does not name them.
const KNOWN_EXTENSIONS: [&str; 3] = ["KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_punctual"];

/// Reads a glTF file, binary or with its buffers beside it.
///
/// The file's axes stay as they are: metres, y up. Cameras with perspective are read with their names. Strips and fans
/// become triangles, points and lines are skipped with a warning; animations, skins, morph targets and lights without a
/// surface are passed over.
pub(crate) fn read_gltf(path: &Path, report: &mut ImportReport) -> Result<Model, FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::read(path, error))?;
    let (json, binary) = split_container(path, &bytes)?;
    let document = parse(path, json)?;
    let buffers = Buffers::read(path, &document, binary)?;
    let mut model = Model { up: Some(DVec3::Y), places: "triangle", ..Model::default() };
    let materials = read_materials(path, &document, &buffers, &mut model, report)?;
    let mut reader =
        Reader { path, document: &document, buffers, materials, model, triangles: 0, polygons: 0, skipped: Vec::new() };
    reader.read_nodes()?;
    let Reader { mut model, triangles, skipped, materials, .. } = reader;
    report.polygons_read = triangles;
    if let Some(first) = skipped.first() {
        report.warn(format!(
            "{} skipped, the first in {first}: surfaces are made of triangles",
            counted(skipped.len(), "primitive of points or lines was", "primitives of points or lines were"),
        ));
    }
    warn_of_lights(&document, report);
    materials.warn(report);
    if model.faces.is_empty() {
        return Err(FormatError::content(path, "has no triangles that are opaque", "export the scene as meshes"));
    }
    unique_names(&mut model.cameras);
    Ok(model)
}

/// The document, with every index in it checked.
fn parse(path: &Path, json: &[u8]) -> Result<Document, FormatError> {
    let wrong = |cause: String, cure| FormatError::content(path, cause, cure);
    let mut root: ::gltf::json::Root = ::gltf::json::deserialize::from_slice(json)
        .map_err(|error| wrong(format!("is no glTF document ({error})"), "give a glTF 2.0 or GLB file"))?;
    for name in &root.extensions_required {
        if matches!(name.as_str(), "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression")
        {
            return Err(wrong(
                format!("is compressed with {name}, which is not read"),
                "export it without mesh compression, or decompress it (`gltf-transform cp IN OUT` or `gltfpack`)",
            ));
        }
        if !KNOWN_EXTENSIONS.contains(&name.as_str()) && !name.starts_with("KHR_materials_") {
            return Err(wrong(format!("requires the extension {name}, which is not read"), "export it without"));
        }
    }
    // What the crate knows is fewer.
    root.extensions_required.clear();
    complete(&mut root).map_err(|cause| wrong(cause, "export the file again"))?;
    Document::from_json(root).map_err(|error| {
        let cause = match error {
            ::gltf::Error::Validation(errors) => match errors.first() {
                Some((place, error)) => format!("is no valid glTF document: {place}: {error}"),
                None => "is no valid glTF document".to_owned(),
            },
            error => format!("is no valid glTF document ({error})"),
        };
        wrong(cause, "export the file again")
    })
}

/// Makes a document one that the crate's checks pass or refuse: they rely on positions that are there, and refuse ones
/// without the bounds that nothing here looks at.
fn complete(root: &mut ::gltf::json::Root) -> Result<(), String> {
    let positions = ::gltf::json::validation::Checked::Valid(Semantic::Positions);
    for (i, mesh) in root.meshes.iter().enumerate() {
        for accessor in mesh.primitives.iter().filter_map(|primitive| primitive.attributes.get(&positions)) {
            let Some(accessor) = root.accessors.get_mut(accessor.value()) else {
                return Err(format!("mesh {i} has its positions in accessor {}, which is not there", accessor.value()));
            };
            for bound in [&mut accessor.min, &mut accessor.max] {
                *bound = Some(::gltf::json::Value::from(vec![0.0; 3]));
            }
        }
    }
    Ok(())
}

struct Reader<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: Buffers<'a>,
    materials: GltfMaterials,
    model: Model,
    triangles: usize,
    /// Triangles that are kept, those of two sides twice.
    polygons: usize,
    /// Primitives that are no surfaces.
    skipped: Vec<String>,
}

impl Reader<'_> {
    fn wrong(&self, cause: String, cure: &'static str) -> FormatError {
        FormatError::content(self.path, cause, cure)
    }

    /// Walks the nodes of the scene that is shown, or of all if none is named; each node once, as the format demands.
    fn read_nodes(&mut self) -> Result<(), FormatError> {
        let document = self.document;
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let mut known = vec![false; document.nodes().len()];
        let mut open: Vec<(Node<'_>, DMat4)> = match &scene {
            Some(scene) => scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
            None => document.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
        };
        if scene.is_none() {
            let mut is_child = vec![false; known.len()];
            document.nodes().for_each(|node| node.children().for_each(|child| is_child[child.index()] = true));
            open.retain(|(node, _)| !is_child[node.index()]);
        }
        open.reverse();
        while let Some((node, above)) = open.pop() {
            if std::mem::replace(&mut known[node.index()], true) {
                let cause = format!("{} is reached twice, from two parents or in a circle", name_of(&node));
                return Err(self.wrong(cause, "export the file again"));
            }
            let own = DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)));
            let world = above * own;
            if !world.is_finite() {
                let cause = format!("{} has a transform that is not finite", name_of(&node));
                return Err(self.wrong(cause, "set its transform anew in a modeller"));
            }
            if let Some(camera) = node.camera() {
                self.read_camera(&node, &camera, world);
            }
            if let Some(mesh) = node.mesh() {
                let object =
                    node.name().or(mesh.name()).map_or_else(|| format!("node {}", node.index()), str::to_owned);
                self.model.objects.push(object);
                for primitive in mesh.primitives() {
                    let place = format!("primitive {} of mesh {}", primitive.index(), mesh.index());
                    self.read_primitive(&primitive, &place, world)?;
                }
            }
            let mut children: Vec<_> = node.children().map(|child| (child, world)).collect();
            children.reverse();
            open.extend(children);
        }
        Ok(())
    }

    /// A camera looks along −z of its node, y up.
    fn read_camera(&mut self, node: &Node<'_>, camera: &::gltf::Camera<'_>, world: DMat4) {
        // Asked of the document itself: the crate's camera relies on the kind that it names.
        let json = self.document.as_json().cameras.get(camera.index());
        let Some(perspective) = json.and_then(|camera| camera.perspective.as_ref()) else { return };
        let name = camera.name().or(node.name()).unwrap_or("camera").to_owned();
        let camera = Camera {
            eye: world.w_axis.truncate(),
            target: world.w_axis.truncate() - world.z_axis.truncate().normalize_or_zero(),
            up: world.y_axis.truncate().normalize_or_zero(),
            vertical_fov: perspective.yfov.into(),
        };
        if camera.is_valid() {
            self.model.cameras.push(NamedCamera { name, camera });
        }
    }

    fn read_primitive(&mut self, primitive: &Primitive<'_>, place: &str, world: DMat4) -> Result<(), FormatError> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.skipped.push(place.to_owned());
            return Ok(());
        }
        let material = self.materials.of(&primitive.material());
        let Some(accessor) = primitive.get(&Semantic::Positions) else {
            return Err(self.wrong(format!("{place} has no positions"), "export the file again"));
        };
        let positions = self.buffers.rows::<3>(&accessor, "positions")?;
        let count = positions.len();
        let indices = match primitive.indices() {
            Some(accessor) => self.buffers.indices(&accessor, count)?,
            None => (0..count as u32).collect(),
        };
        let triangles = triangles(&indices, mode);
        self.triangles += triangles.len();
        if material.is_left_out {
            self.materials.transparent_triangles += triangles.len();
            return Ok(());
        }
        let sides = if self.model.two_sided.contains_key(&material.material) { 2 } else { 1 };
        self.polygons += sides * triangles.len();
        let vertices = self.model.positions.len() + count;
        if self.polygons > MOST_TRIANGLES || vertices > 3 * MOST_TRIANGLES {
            return Err(self.wrong(format!("{place} is beyond {MOST_TRIANGLES} triangles"), "split the scene"));
        }
        let normals = match primitive.get(&Semantic::Normals) {
            Some(accessor) => self.buffers.rows::<3>(&accessor, "normals")?,
            None => Vec::new(),
        };
        let uvs = match material.uv_set.and_then(|set| primitive.get(&Semantic::TexCoords(set))) {
            Some(accessor) => self.buffers.rows::<2>(&accessor, "texture coordinates")?,
            None => Vec::new(),
        };

        let first_vertex = self.model.positions.len() as u32;
        for (i, position) in positions.into_iter().enumerate() {
            let point = world.transform_point3(DVec3::from_array(position));
            if !point.is_finite() || point.abs().max_element() > scene::LARGEST_COORDINATE {
                let limit = scene::LARGEST_COORDINATE;
                let cause = format!("vertex {i} of {place} is not finite, or beyond ±{limit} m");
                return Err(self.wrong(cause, "repair the mesh; scale the model to metres, near the origin"));
            }
            self.model.positions.push(point);
        }
        let linear = DMat3::from_mat4(world);
        // A mirrored node turns its triangles inside out; what was counter-clockwise is to stay so.
        let is_mirrored = linear.determinant() < 0.0;
        // Normals are transformed by the cofactors, which exist where an inverse does not.
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let flip = if is_mirrored { -1.0 } else { 1.0 };
        let attributes = |vertex: u32| Attributes {
            uv: uvs.get(vertex as usize).map(|&[u, v]| material.place(Vec2::new(u as f32, v as f32))),
            normal: normals
                .get(vertex as usize)
                .map(|&normal| (cofactors * DVec3::from_array(normal) * flip).normalize_or_zero().as_vec3()),
        };
        let object = self.model.objects.len() as u32 - 1;
        for mut triangle in triangles {
            if is_mirrored {
                triangle.swap(1, 2);
            }
            let outline = triangle.map(|vertex| self.model.positions[(first_vertex + vertex) as usize]);
            let mut own = triangle.map(attributes);
            let seams = self.model.attributes.seams(&outline, &mut own);
            let corners =
                triangle.iter().zip(seams).map(|(&vertex, seam)| Corner { vertex: first_vertex + vertex, seam });
            let line = self.model.faces.len() + 1;
            self.model.faces.push(Face { corners: corners.collect(), material: material.material, object, line });
        }
        Ok(())
    }
}

/// The triangles of a list, a strip or a fan, all counter-clockwise from the same side.
fn triangles(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
            indices.windows(3).enumerate().map(turned).collect()
        }
        Mode::TriangleFan => match indices.split_first() {
            Some((&apex, rest)) => rest.windows(2).map(|w| [apex, w[0], w[1]]).collect(),
            None => Vec::new(),
        },
        _ => indices.as_chunks().0.to_vec(),
    }
}

fn name_of(node: &Node<'_>) -> String {
    match node.name() {
        Some(name) => format!("node {} ({name:.40})", node.index()),
        None => format!("node {}", node.index()),
    }
}

/// Cameras are called by name: of two with one name the later gets a number.
pub(crate) fn unique_names(cameras: &mut [NamedCamera]) {
    let mut known: HashMap<String, u32> = HashMap::new();
    for camera in cameras {
        let wanted = camera.name.clone();
        while known.contains_key(&camera.name) {
            let number = known.entry(wanted.clone()).and_modify(|number| *number += 1).or_insert(1);
            camera.name = format!("{wanted}{number}");
        }
        known.insert(camera.name.clone(), 1);
    }
}

/// Lights without a surface (KHR_lights_punctual) are not baked.
fn warn_of_lights(document: &Document, report: &mut ImportReport) {
    let lights = document.nodes().filter(|node| node.extension_value("KHR_lights_punctual").is_some()).count();
    if lights > 0 {
        report.warn(format!(
            "{} passed over: only surfaces emit; give a lamp's material an emissive factor",
            counted(lights, "light without a surface was", "lights without surfaces were"),
        ));
    }
}

#[cfg(test)]
mod tests;
