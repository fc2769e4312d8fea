//! A model: a file as it is written, on its way to a scene.

use std::collections::{BTreeMap, HashMap};

use glam::{DMat3, DMat4, DVec3};
use scene::{Environment, Light, Material, NamedCamera, Texture, area_vector};

use crate::attributes::AttributeTable;
use crate::face::{Corner, Face};

/// Nothing welded, split or merged yet.
#[derive(Debug, Default)]
pub(crate) struct Model {
    /// Positions, metres; each object has its own, and equal ones may repeat.
    pub positions: Vec<DVec3>,
    /// Faces in the order of the file.
    pub faces: Vec<Face>,
    /// What corners have beside positions; [`Corner::seam`] is an index into it.
    pub attributes: AttributeTable,
    pub materials: Vec<Material>,
    /// By material, whether its faces have both sides, where a file says so; elsewhere they have the front.
    pub two_sided: BTreeMap<u32, bool>,
    pub textures: Vec<Texture>,
    pub objects: Vec<String>,
    pub cameras: Vec<NamedCamera>,
    /// Lights that are no surfaces.
    pub lights: Vec<Light>,
    pub environment: Option<Environment>,
    /// The direction that the file says is up.
    pub up: Option<DVec3>,
    /// What [`Face::line`] counts, for messages; empty is lines.
    pub places: &'static str,
}

impl Model {
    /// Adds another model, placed by a transform to metres whose determinant is not 0; fronts stay fronts in a mirror.
    pub fn append(&mut self, other: Self, transform: DMat4) {
        let linear = DMat3::from_mat4(transform);
        let is_mirrored = linear.determinant() < 0.0;
        let normals = linear.inverse().transpose();
        let [positions, materials, textures, objects] =
            [self.positions.len(), self.materials.len(), self.textures.len(), self.objects.len()].map(|n| n as u32);
        self.positions.extend(other.positions.iter().map(|&position| transform.transform_point3(position)));
        let seams = self
            .attributes
            .append(&other.attributes, |normal| (normals * normal.as_dvec3()).normalize_or_zero().as_vec3());
        for mut face in other.faces {
            for corner in &mut face.corners {
                let seam = seams.get(corner.seam as usize).copied().unwrap_or(0);
                *corner = Corner { vertex: corner.vertex + positions, seam };
            }
            if is_mirrored {
                face.corners.reverse();
            }
            face.material += materials;
            face.object += objects;
            self.faces.push(face);
        }
        self.materials.extend(other.materials.into_iter().map(|mut material| {
            material.texture = material.texture.map(|texture| texture + textures);
            material
        }));
        self.two_sided.extend(other.two_sided.into_iter().map(|(material, word)| (material + materials, word)));
        self.textures.extend(other.textures);
        self.objects.extend(other.objects);
        let unit = |direction: DVec3| transform.transform_vector3(direction);
        self.cameras.extend(other.cameras.into_iter().map(|NamedCamera { name, mut camera }| {
            let forward = unit(camera.target - camera.eye);
            camera.eye = transform.transform_point3(camera.eye);
            camera.target = camera.eye + forward;
            camera.up = unit(camera.up).normalize_or_zero();
            NamedCamera { name, camera }
        }));
        self.cameras.retain(|named| named.camera.is_valid());
        self.places = other.places;
    }

    /// Counts the faces anew: their lines are of several files.
    pub fn number_faces(&mut self) {
        (1..).zip(&mut self.faces).for_each(|(number, face)| face.line = number);
        self.places = "face";
    }

    /// What [`Face::line`] counts.
    pub fn place(&self) -> &'static str {
        if self.places.is_empty() { "line" } else { self.places }
    }

    /// Gives faces with a texture and without texture coordinates a material without the texture, of its mean colour.
    pub fn separate_untextured(&mut self) {
        let mut plain: HashMap<u32, u32> = HashMap::new();
        for face in &mut self.faces {
            let Some(material) = self.materials.get(face.material as usize) else { continue };
            let has_uv = |corner: &Corner| self.attributes.get(corner.seam).uv.is_some();
            let Some(texture) = material.texture.filter(|_| !face.corners.iter().all(has_uv)) else { continue };
            face.material = *plain.entry(face.material).or_insert_with(|| {
                let mean = self.textures[texture as usize].mean();
                let mut material = self.materials[face.material as usize].clone();
                material.texture = None;
                material.reflectance *= mean;
                material.gloss.iter_mut().for_each(|gloss| gloss.diffuse *= mean);
                self.materials.push(material);
                let id = self.materials.len() as u32 - 1;
                if let Some(&word) = self.two_sided.get(&face.material) {
                    self.two_sided.insert(id, word);
                }
                id
            });
        }
    }

    /// Cuts convex faces over which texture coordinates or normals are not affine into triangles, where they are.
    pub fn split_where_not_affine(&mut self) {
        let faces = std::mem::take(&mut self.faces);
        for face in faces {
            if face.corners.len() == 3 || self.attributes.are_affine(&face.corners, &self.positions) {
                self.faces.push(face);
                continue;
            }
            match fan(&face.corners, &self.positions) {
                Some(triangles) => {
                    let part = |corners: [Corner; 3]| Face { corners: corners.to_vec(), ..face };
                    self.faces.extend(triangles.into_iter().map(part));
                }
                None => self.faces.push(face),
            }
        }
    }
}

/// The triangles around one corner of an outline; none where no corner sees all others, as in most outlines that are not
/// convex.
fn fan(corners: &[Corner], positions: &[DVec3]) -> Option<Vec<[Corner; 3]>> {
    let at = |corner: Corner| positions[corner.vertex as usize];
    let outline: Vec<DVec3> = corners.iter().map(|&corner| at(corner)).collect();
    let normal = area_vector(&outline);
    // Less than this part of the outline's area is no triangle, but a straight corner.
    let least = 1e-9 * normal.length_squared();
    (0..corners.len()).find_map(|apex| {
        let place = |i: usize| corners[(apex + i) % corners.len()];
        let triangles: Vec<_> = (1..corners.len() - 1).map(|i| [place(0), place(i), place(i + 1)]).collect();
        let whole = |triangle: &[Corner; 3]| area_vector(&triangle.map(at)).dot(normal) > least;
        triangles.iter().all(whole).then_some(triangles)
    })
}
