//! Materials of a glTF file as diffuse ones.

use std::collections::HashMap;
use std::path::Path;

use ::gltf::{Document, material::AlphaMode, texture};
use glam::{DVec3, Vec2};
use scene::{Material, Rgb};

use crate::FormatError;
use crate::gltf_buffers::{Buffers, read_uri};
use crate::material_library::{LARGEST_REFLECTANCE, LEAST_OPACITY};
use crate::model::Model;
use crate::report::{ImportReport, counted};
use crate::texture_file::decode_texture;

/// What a primitive needs to know of its material.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GltfMaterial {
    /// Index into the model's materials.
    pub material: u32,
    /// Seen through for the most part.
    pub is_left_out: bool,
    /// The set of texture coordinates that the texture is placed by, if there is one.
    pub uv_set: Option<u32>,
    /// KHR_texture_transform: offset, rotation (radians) and scale.
    transform: Option<(Vec2, f32, Vec2)>,
}

impl GltfMaterial {
    /// Where texture coordinates of the file lie in the texture.
    pub fn place(&self, uv: Vec2) -> Vec2 {
        let Some((offset, rotation, scale)) = self.transform else { return uv };
        let (sin, cos) = rotation.sin_cos();
        let uv = uv * scale;
        // Counter-clockwise, where v runs down.
        offset + Vec2::new(cos * uv.x + sin * uv.y, cos * uv.y - sin * uv.x)
    }
}

/// The materials of a file, and what was done to them.
#[derive(Debug, Default)]
pub(crate) struct GltfMaterials {
    /// By index in the file; the last one stands for primitives without a material.
    list: Vec<GltfMaterial>,
    /// Triangles that are left out.
    pub transparent_triangles: usize,
    metals: Vec<String>,
    clamped: Vec<String>,
    unread: Vec<String>,
    emissive_textures: Vec<String>,
}

impl GltfMaterials {
    /// What a primitive's material became.
    pub fn of(&self, material: &::gltf::Material<'_>) -> GltfMaterial {
        let last = self.list.len().saturating_sub(1);
        self.list.get(material.index().unwrap_or(last)).copied().unwrap_or_default()
    }

    /// Says what was done to materials.
    pub fn warn(&self, report: &mut ImportReport) {
        report.mirror_materials += self.metals.len();
        report.clamped_materials += self.clamped.len();
        report.textured_materials += self.unread.len();
        report.transparent_faces += self.transparent_triangles;
        for (names, what) in [
            (&self.metals, "are metallic and were made diffuse, of their base colour: nothing else can be baked"),
            (&self.clamped, "reflect more than any surface does and were limited to 0.999; darken their base colours"),
            (&self.unread, "have a texture that cannot be read and got a grey of 0.5 in its place; embed PNG or JPEG"),
            (
                &self.emissive_textures,
                "have an emissive texture and emit its mean everywhere; light varies by material",
            ),
        ] {
            if let Some(first) = names.first() {
                let count = counted(names.len(), "material", "materials");
                report.warn(format!("{count}, the first is {first:?}, {what}"));
            }
        }
        if self.transparent_triangles > 0 {
            report.warn(format!(
                "{} left out: their materials are seen through for the most part (mean alpha below 0.5, or transmission \
                 of 0.5 or more); make them opaque to keep them",
                counted(self.transparent_triangles, "triangle was", "triangles were"),
            ));
        }
    }
}

/// Reads the materials of a document into a model.
///
/// - Reflectance is the base colour, factor times texture, limited to 0.999. So a metal reflects diffusely as much as it
///   reflects in all: baseColor × (1 − metallic) for its diffuse part and baseColor × metallic for the metal. Roughness,
///   coats and sheens are passed over.
/// - Emitted radiance is the emissive factor times its strength (KHR_materials_emissive_strength), per channel: where the
///   format says nits, W·sr⁻¹·m⁻² are taken. An emissive texture counts with its mean.
/// - What emits nothing and is seen through for the most part is left out: alpha mode BLEND or MASK and a mean alpha, factor
///   times texture, below 0.5; or a transmission factor of 0.5 or more. Everything else is opaque.
/// - A double-sided material has polygons on both sides, which reflect and emit on theirs; one that is not says nothing.
/// - Textures repeat, whatever their samplers say.
pub(crate) fn read_materials(
    path: &Path,
    document: &Document,
    buffers: &Buffers<'_>,
    model: &mut Model,
    report: &mut ImportReport,
) -> Result<GltfMaterials, FormatError> {
    let mut images = Images { path, document, buffers, decoded: HashMap::new() };
    let mut materials = GltfMaterials::default();
    for material in document.materials() {
        let name = material.name().map_or_else(|| format!("material {}", material.index().unwrap_or(0)), str::to_owned);
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, mut alpha] = pbr.base_color_factor().map(f64::from);
        let mut reflectance = finite(DVec3::new(r, g, b));
        let mut found = GltfMaterial { material: model.materials.len() as u32, ..GltfMaterial::default() };
        if material.double_sided() {
            model.two_sided.insert(found.material, true);
        }
        let mut base_texture = None;
        if let Some(info) = pbr.base_color_texture() {
            match images.texture(&info.texture(), model, report)? {
                Some((texture, mean_alpha)) => {
                    base_texture = Some(texture);
                    alpha *= mean_alpha;
                    found.uv_set = Some(info.tex_coord());
                    if let Some(transform) = info.texture_transform() {
                        let (offset, scale) = (Vec2::from(transform.offset()), Vec2::from(transform.scale()));
                        found.transform = Some((offset, transform.rotation(), scale));
                        found.uv_set = transform.tex_coord().or(found.uv_set);
                    }
                }
                None => {
                    materials.unread.push(name.clone());
                    reflectance *= 0.5;
                }
            }
        }
        if pbr.metallic_factor() > 0.0 && pbr.metallic_roughness_texture().is_none() {
            materials.metals.push(name.clone());
        }
        if reflectance.max_element() > LARGEST_REFLECTANCE {
            // White is what a material is where the file says nothing: no reason to warn.
            if reflectance.max_element() > 1.0 {
                materials.clamped.push(name.clone());
            }
            reflectance = reflectance.min(Rgb::splat(LARGEST_REFLECTANCE));
        }
        let strength = material.emissive_strength().map_or(1.0, f64::from);
        let mut radiance = finite(DVec3::from_array(material.emissive_factor().map(f64::from)) * strength);
        if let Some(info) = material.emissive_texture().filter(|_| radiance != Rgb::ZERO) {
            // Its texels are looked at once; the model keeps none of them.
            let kept = model.textures.len();
            match images.texture(&info.texture(), model, report)? {
                Some((texture, _)) => {
                    radiance *= model.textures[texture as usize].mean();
                    materials.emissive_textures.push(name.clone());
                }
                None => materials.unread.push(name.clone()),
            }
            images.forget_beyond(kept, model);
        }
        let transmission = material.extension_value("KHR_materials_transmission");
        let transmission = transmission.and_then(|value| value.get("transmissionFactor")?.as_f64()).unwrap_or(0.0);
        let is_translucent = material.alpha_mode() != AlphaMode::Opaque && alpha < LEAST_OPACITY;
        found.is_left_out = radiance == Rgb::ZERO && (is_translucent || transmission >= LEAST_OPACITY);
        if found.is_left_out {
            materials.metals.retain(|metal| *metal != name);
        }
        materials.list.push(found);
        model.materials.push(Material { name, reflectance, texture: base_texture, radiance, gloss: None });
    }
    materials.list.push(GltfMaterial { material: model.materials.len() as u32, ..GltfMaterial::default() });
    model.materials.push(Material::grey("unassigned"));
    Ok(materials)
}

/// A colour without what is negative or not finite.
fn finite(colour: Rgb) -> Rgb {
    colour.map(|channel| if channel.is_finite() { channel.max(0.0) } else { 0.0 })
}

/// The images of a document, each decoded once.
struct Images<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    /// By image, its texture in the model and its mean alpha; none where it cannot be read.
    decoded: HashMap<usize, Option<(u32, f64)>>,
}

impl Images<'_> {
    fn texture(
        &mut self,
        texture: &texture::Texture<'_>,
        model: &mut Model,
        report: &mut ImportReport,
    ) -> Result<Option<(u32, f64)>, FormatError> {
        let image = texture.source();
        if let Some(known) = self.decoded.get(&image.index()) {
            return Ok(*known);
        }
        let place = format!("image {}", image.index());
        let name = image.name().map_or_else(|| place.clone(), str::to_owned);
        // Asked of the document itself: the crate's image relies on one of the two being there.
        let json = self.document.as_json().images.get(image.index());
        let view = json.and_then(|json| self.document.views().nth(json.buffer_view?.value()));
        let decoded = match (view, json.and_then(|json| json.uri.as_ref())) {
            (Some(view), _) => decode_texture(&name, self.buffers.view(&view)?),
            (None, Some(uri)) => read_uri(self.path, uri, &place)
                .map_err(|error| error.to_string())
                .and_then(|bytes| decode_texture(&name, &bytes)),
            (None, None) => Err("it names neither a file nor bytes".to_owned()),
        };
        let found = match decoded {
            Ok(decoded) => {
                model.textures.push(decoded.texture);
                Some((model.textures.len() as u32 - 1, decoded.mean_alpha))
            }
            Err(cause) => {
                report.warn(format!("{}: {place} ({name:.40}) cannot be read: {cause}", self.path.display()));
                None
            }
        };
        self.decoded.insert(image.index(), found);
        Ok(found)
    }

    /// Drops textures that were decoded after the first `kept`.
    fn forget_beyond(&mut self, kept: usize, model: &mut Model) {
        model.textures.truncate(kept);
        self.decoded.retain(|_, found| found.is_none_or(|(texture, _)| (texture as usize) < kept));
    }
}
