//! A scene: polygons over shared vertices, their materials, and the cameras stored with them.

use std::collections::BTreeMap;

use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::{Environment, Gloss, Light, Material, NamedCamera, Plane, Polygon, Rgb, Texture, area_vector};

/// Largest coordinate accepted, metres. Beyond it f32 positions in a viewer would be off by more than a
/// centimetre, and nobody models a room there on purpose: the units are wrong.
pub const LARGEST_COORDINATE: f64 = 1e5;

/// Polygons, materials and cameras; flat arrays that refer to each other by index.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Welded positions, metres.
    pub vertices: Vec<DVec3>,
    /// Vertex ids of all polygons' corners, one polygon after another.
    pub corners: Vec<u32>,
    /// Texture coordinates (u, v) of the corners, beside [`Scene::corners`]; empty where no polygon has a texture.
    pub texture_coordinates: Vec<Vec2>,
    /// Shading normals of the corners, beside [`Scene::corners`]: unit vectors, or zero where the polygon's own normal
    /// stands; empty where it stands everywhere. See [`Scene::shading_normal`].
    pub shading_normals: Vec<Vec3>,
    /// The polygons.
    pub polygons: Vec<Polygon>,
    /// By polygon, the mean linear colour of its texture over its area, each channel in 0..=1; empty where no polygon
    /// has a texture. See [`Scene::mean_texture_colours`].
    pub tints: Vec<Rgb>,
    /// What the polygons are made of.
    pub materials: Vec<Material>,
    /// What materials multiply their reflectance by.
    pub textures: Vec<Texture>,
    /// Names of the objects (groups) that polygons belong to.
    pub objects: Vec<String>,
    /// Cameras stored with the scene; the first is the default one.
    pub cameras: Vec<NamedCamera>,
    /// Lights that are no surfaces; bakes know none of them.
    pub lights: Vec<Light>,
    /// The light that comes from far away where nothing stands, if any does.
    pub environment: Option<Environment>,
}

/// What is wrong with a scene as data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneError {
    /// An index points past the end of its array; the text says which.
    Index(String),
    /// A number is not finite or out of its range; the text says which.
    Number(String),
    /// A polygon has fewer than three corners or no area.
    Degenerate {
        /// The polygon.
        polygon: u32,
    },
}

impl std::fmt::Display for SceneError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Index(what) => write!(f, "{what} points outside its table"),
            Self::Number(what) => write!(f, "{what} is not finite or out of range"),
            Self::Degenerate { polygon } => write!(f, "polygon {polygon} has no area"),
        }
    }
}

impl std::error::Error for SceneError {}

impl Scene {
    /// Corner positions of a polygon, counter-clockwise seen from its front.
    pub fn outline(&self, polygon: u32) -> Vec<DVec3> {
        self.corners[self.polygons[polygon as usize].corner_range()]
            .iter()
            .map(|&vertex| self.vertices[vertex as usize])
            .collect()
    }

    /// The plane of a polygon; its normal points to the front.
    pub fn plane(&self, polygon: u32) -> Plane {
        Plane::through(&self.outline(polygon))
    }

    /// Area of a polygon, m².
    pub fn area(&self, polygon: u32) -> f64 {
        area_vector(&self.outline(polygon)).length()
    }

    /// Area of all polygons, m².
    pub fn surface_area(&self) -> f64 {
        self.polygon_ids().map(|polygon| self.area(polygon)).sum()
    }

    /// The material of a polygon.
    pub fn material(&self, polygon: u32) -> &Material {
        &self.materials[self.polygons[polygon as usize].material as usize]
    }

    /// The reflectance of a polygon, each channel in 0..=1: its material's times the mean colour of its texture. This is
    /// what light is computed with; within the polygon a picture shows the texture.
    pub fn reflectance(&self, polygon: u32) -> Rgb {
        let tint = self.tints.get(polygon as usize).copied().unwrap_or(Rgb::ONE);
        self.material(polygon).reflectance * tint
    }

    /// Ids of all polygons.
    pub fn polygon_ids(&self) -> std::ops::Range<u32> {
        0..self.polygons.len() as u32
    }

    /// Ids of the polygons that emit, in order.
    pub fn emitters(&self) -> impl Iterator<Item = u32> {
        self.polygon_ids().filter(|&polygon| self.material(polygon).emits())
    }

    /// Total emitted power, W.
    pub fn power(&self) -> Rgb {
        self.emitters().map(|polygon| self.material(polygon).exitance() * self.area(polygon)).sum()
    }

    /// Corners of the axis-aligned box around all polygons; both zero for an empty scene.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let used = || self.corners.iter().map(|&vertex| self.vertices[vertex as usize]);
        match used().next() {
            None => (DVec3::ZERO, DVec3::ZERO),
            Some(first) => used().fold((first, first), |(low, high), p| (low.min(p), high.max(p))),
        }
    }

    /// Length of the diagonal of [`Scene::bounds`], metres: the length that tolerances are fractions of.
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).length()
    }

    /// Checks every index and number. Anything read from a file passes through here before it is used.
    pub fn validate(&self) -> Result<(), SceneError> {
        for (i, vertex) in self.vertices.iter().enumerate() {
            if !vertex.is_finite() || vertex.abs().max_element() > LARGEST_COORDINATE {
                return Err(SceneError::Number(format!("vertex {i}")));
            }
        }
        if let Some(i) = self.corners.iter().position(|&vertex| vertex as usize >= self.vertices.len()) {
            return Err(SceneError::Index(format!("corner {i}")));
        }
        for (i, material) in self.materials.iter().enumerate() {
            let reflects = material.reflectance.is_finite()
                && material.reflectance.min_element() >= 0.0
                && material.reflectance.max_element() <= 1.0;
            let shines = material.gloss.as_ref().is_none_or(Gloss::is_valid);
            if !reflects || !shines || !material.radiance.is_finite() || material.radiance.min_element() < 0.0 {
                return Err(SceneError::Number(format!("material {i} ({})", material.name)));
            }
        }
        self.validate_textures()?;
        for (polygon, record) in (0..).zip(&self.polygons) {
            let end = u64::from(record.first_corner) + u64::from(record.corner_count);
            if end > self.corners.len() as u64
                || record.material as usize >= self.materials.len()
                || record.object as usize >= self.objects.len()
            {
                return Err(SceneError::Index(format!("polygon {polygon}")));
            }
            if record.corner_count < 3 || self.area(polygon) <= 0.0 {
                return Err(SceneError::Degenerate { polygon });
            }
        }
        for named in &self.cameras {
            if !named.camera.is_valid() {
                return Err(SceneError::Number(format!("camera {}", named.name)));
            }
        }
        if self.environment.as_ref().is_some_and(|environment| !environment.is_valid()) {
            return Err(SceneError::Number("the environment".into()));
        }
        match self.lights.iter().position(|light| !light.is_valid()) {
            Some(i) => Err(SceneError::Number(format!("light {i}"))),
            None => Ok(()),
        }
    }

    fn validate_textures(&self) -> Result<(), SceneError> {
        if let Some(i) = self.textures.iter().position(|texture| !texture.is_valid()) {
            return Err(SceneError::Index(format!("the size of texture {i}")));
        }
        let textures = self.textures.len();
        let textured = |material: &Material| material.texture.is_some();
        if let Some(i) = self.materials.iter().position(|m| m.texture.is_some_and(|id| id as usize >= textures)) {
            return Err(SceneError::Index(format!("the texture of material {i}")));
        }
        let used =
            self.polygons.iter().filter_map(|polygon| self.materials.get(polygon.material as usize)).any(textured);
        for (what, length, wanted) in [
            ("texture coordinates", self.texture_coordinates.len(), self.corners.len()),
            ("shading normals", self.shading_normals.len(), self.corners.len()),
            ("tints", self.tints.len(), self.polygons.len()),
        ] {
            let needed = used && what != "shading normals";
            if length != wanted && (length > 0 || needed) {
                return Err(SceneError::Index(format!("the list of {what}")));
            }
        }
        if let Some(i) = self.texture_coordinates.iter().position(|uv| !uv.is_finite()) {
            return Err(SceneError::Number(format!("texture coordinate {i}")));
        }
        if let Some(i) = self.shading_normals.iter().position(|n| !n.is_finite() || n.length() > 1.001) {
            return Err(SceneError::Number(format!("shading normal {i}")));
        }
        let within = |tint: &Rgb| tint.is_finite() && tint.min_element() >= 0.0 && tint.max_element() <= 1.0;
        match self.tints.iter().position(|tint| !within(tint)) {
            Some(i) => Err(SceneError::Number(format!("tint {i}"))),
            None => Ok(()),
        }
    }
}

/// By polygon, the one that has the same corners and the opposite front, if any: the other side of a two-sided surface.
pub fn other_sides(scene: &Scene) -> Vec<Option<u32>> {
    let planes: Vec<Plane> = scene.polygon_ids().map(|polygon| scene.plane(polygon)).collect();
    let mut by_corners: BTreeMap<Vec<u32>, Vec<u32>> = BTreeMap::new();
    for polygon in scene.polygon_ids() {
        let mut corners = scene.corners[scene.polygons[polygon as usize].corner_range()].to_vec();
        corners.sort_unstable();
        by_corners.entry(corners).or_default().push(polygon);
    }
    let mut other_sides = vec![None; scene.polygons.len()];
    for same in by_corners.values() {
        for &polygon in same {
            let opposite = |&other: &u32| planes[other as usize].normal.dot(planes[polygon as usize].normal) < 0.0;
            other_sides[polygon as usize] = same.iter().copied().find(opposite);
        }
    }
    other_sides
}
