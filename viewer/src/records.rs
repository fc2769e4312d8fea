//! What the passes read: flat arrays of f32, made from a bake when it is loaded, the same for GPU and CPU.

use bytemuck::{Pod, Zeroable};
use scene::{Baked, EdgeKind, Interpolant, LineKind, Rgb, other_sides};

use crate::{
    id_mesh::IdMesh,
    sky_records::sky_words,
    texture_records::{TexturePlace, texture_words},
};

/// One triangle as pass (c) reads it. The coefficients (A, 2B, 2C, D, 2E, F) of its interpolant are divided by π, so that the
/// quadratic is the radiance of a white surface. Laid out as WGSL does: a vec3 takes 16 bytes, whose last 4 hold a u32.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct TriangleRecord {
    pub a: [f32; 3],
    /// Index into [`Records::elements`].
    pub element: u32,
    pub b2: [f32; 3],
    /// An [`edge_code`] for each of the edges 0→1, 1→2, 2→0, ten bits each from the lowest up.
    pub edges: u32,
    pub c2: [f32; 3],
    /// [`TexturePlace::texels`]; 0 for no texture.
    pub texels: u32,
    pub d: [f32; 3],
    /// [`TexturePlace::size`].
    pub texture_size: u32,
    pub e2: [f32; 3],
    /// [`TexturePlace::corners`].
    pub texture_corners: u32,
    pub f: [f32; 3],
    /// 1 where its back is the other side of the same surface, and never seen.
    pub is_sheet: u32,
    /// ρ of the material, which its texture multiplies at the pixel; of the polygon where there is none.
    pub reflectance: [f32; 3],
    pub padding_reflectance: u32,
    /// Emitted radiance Ke, W·sr⁻¹·m⁻².
    pub emitted: [f32; 3],
    pub padding_emitted: u32,
}

/// Corner positions of a triangle, metres.
pub(crate) type Corners = [[f32; 3]; 3];

/// The arrays.
pub(crate) struct Records {
    /// Pass (c)'s triangles.
    pub triangles: Vec<TriangleRecord>,
    /// Corners of pass (c)'s triangles.
    pub corners: Vec<Corners>,
    /// Passes (a) and (b)'s triangles.
    pub mesh: IdMesh,
    /// Radiance of each leaf element by the solver's constant irradiance, W·sr⁻¹·m⁻²; the fourth number is padding.
    pub elements: Vec<[f32; 4]>,
    /// Textures, as [`texture_words`] has them, and after them the environment, as [`sky_words`] has it; empty where there are
    /// neither.
    pub textures: Vec<u32>,
    /// Whether any triangle has a texture.
    pub is_textured: bool,
    /// The place of the environment's first word among the textures; 0 for none.
    pub sky: u32,
}

impl Records {
    /// The arrays of a bake that validates.
    pub fn of(baked: &Baked) -> Self {
        let weights = WeightRange::of(baked);
        let (mut textures, places) = texture_words(baked);
        let other_sides = other_sides(&baked.scene);
        let is_sheet = |id: u32| other_sides[baked.triangles[id as usize].polygon as usize].is_some();
        let (is_textured, sky) = (!textures.is_empty(), append_sky(&mut textures, sky_words(baked)));
        let triangle = |id: u32| {
            let triangle = &baked.triangles[id as usize];
            let material = baked.scene.material(triangle.polygon);
            let place = places.get(id as usize).copied().unwrap_or_default();
            let has_texture = place != TexturePlace::default();
            let reflectance =
                if has_texture { material.reflectance } else { baked.scene.reflectance(triangle.polygon) };
            let Interpolant(coefficients) = baked.interpolant(id);
            let [a, b2, c2, d, e2, f] = coefficients.map(|c| (c / std::f64::consts::PI).as_vec3().to_array());
            let [e0, e1, e2_] = triangle.edges.map(|edge| edge_code(baked, edge, weights));
            TriangleRecord {
                a,
                b2,
                c2,
                d,
                e2,
                f,
                is_sheet: is_sheet(id).into(),
                element: triangle.element,
                texels: place.texels,
                texture_size: place.size,
                texture_corners: place.corners,
                edges: e0 | e1 << 10 | e2_ << 20,
                reflectance: reflectance.as_vec3().to_array(),
                emitted: material.radiance.as_vec3().to_array(),
                ..TriangleRecord::zeroed()
            }
        };
        let ids = 0..baked.triangles.len() as u32;
        let element = |element: &scene::BakedElement| {
            let material = baked.scene.material(element.polygon);
            let irradiance = element.irradiance.as_dvec3().max(Rgb::ZERO);
            let radiance =
                irradiance * baked.scene.reflectance(element.polygon) / std::f64::consts::PI + material.radiance;
            radiance.as_vec3().extend(0.0).to_array()
        };
        Self {
            triangles: ids.clone().map(triangle).collect(),
            corners: ids.map(|id| baked.corners(id).map(|corner| corner.as_vec3().to_array())).collect(),
            mesh: IdMesh::of(baked, is_sheet),
            elements: baked.elements.iter().map(element).collect(),
            textures,
            is_textured,
            sky,
        }
    }
}

/// Puts the environment after the textures; its place, which is none where it is empty or beyond what u32 counts.
fn append_sky(textures: &mut Vec<u32>, sky: Vec<u32>) -> u32 {
    // A word that nobody reads, since no place is 0.
    let unread = usize::from(textures.is_empty());
    let place = u32::try_from(textures.len() + unread + sky.len()).map_or(0, |end| end - sky.len() as u32);
    if sky.is_empty() || place == 0 {
        return 0;
    }
    textures.extend(std::iter::repeat_n(0, unread).chain(sky));
    place
}

impl TriangleRecord {
    /// Where the triangle's texture lies in [`Records::textures`].
    pub fn texture(&self) -> TexturePlace {
        TexturePlace { texels: self.texels, size: self.texture_size, corners: self.texture_corners }
    }
}

/// Classes of edges in an edge code; the shader names the same numbers.
const LEAF: u32 = 1;
const CUT: u32 = 2;
const HORIZON: u32 = 3;
const EDGE_VERTEX: u32 = 4;
const VERTEX_EDGE: u32 = 5;

/// The class of an edge in the lower three bits, 0 for an interior one, and how heavy a discontinuity it is in the
/// upper seven, 0..=127.
fn edge_code(baked: &Baked, edge: EdgeKind, weights: WeightRange) -> u32 {
    match edge {
        EdgeKind::Interior => 0,
        EdgeKind::Leaf => LEAF,
        EdgeKind::Cut => CUT,
        EdgeKind::Discontinuity(line) => {
            let line = &baked.lines[line as usize];
            let class = match line.kind {
                LineKind::Horizon => HORIZON,
                LineKind::EdgeVertex => EDGE_VERTEX,
                LineKind::VertexEdge => VERTEX_EDGE,
            };
            class | weights.strength(line.weight) << 3
        }
    }
}

/// The rank weights between which discontinuities are told apart by brightness. Weights span decades, so the scale
/// is logarithmic.
#[derive(Clone, Copy)]
struct WeightRange {
    lightest: f32,
    heaviest: f32,
}

impl WeightRange {
    fn of(baked: &Baked) -> Self {
        let weights = baked.lines.iter().map(|line| line.weight).filter(|&weight| weight > 0.0);
        Self { lightest: weights.clone().fold(f32::INFINITY, f32::min), heaviest: weights.fold(0.0, f32::max) }
    }

    /// 0 for the lightest line, 127 for the heaviest, and for the only one.
    fn strength(self, weight: f32) -> u32 {
        let decades = (self.heaviest / self.lightest).ln();
        let place = if decades > 0.0 { (weight.max(self.lightest) / self.lightest).ln() / decades } else { 1.0 };
        (place.clamp(0.0, 1.0) * 127.0).round() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::room;

    #[test]
    fn an_empty_bake_has_no_records() {
        let records = Records::of(&Baked::default());
        assert!(records.triangles.is_empty() && records.corners.is_empty() && records.elements.is_empty());
    }

    /// The record against the bake's own evaluation.
    #[test]
    fn the_record_gives_the_radiance_of_the_bake() {
        let baked = room();
        for (id, record) in (0..).zip(&Records::of(&baked).triangles) {
            for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.25, 0.5)] {
                let ours = crate::twin::interpolant(record, glam::Vec3::ONE, s, t);
                let exact = baked.radiance(id, f64::from(s), f64::from(t));
                assert!((ours.as_dvec3() - exact).length() <= 2e-6 * (1.0 + exact.length()), "{ours} {exact}");
            }
        }
    }

    #[test]
    fn strength_spans_the_weights_on_a_logarithmic_scale() {
        let range = WeightRange { lightest: 1.0, heaviest: 10_000.0 };
        assert_eq!([0.0, 1.0, 100.0, 10_000.0, 1e9].map(|weight| range.strength(weight)), [0, 0, 64, 127, 127]);
        assert_eq!(WeightRange { lightest: 3.0, heaviest: 3.0 }.strength(3.0), 127);
        assert_eq!(WeightRange { lightest: f32::INFINITY, heaviest: 0.0 }.strength(0.0), 127);
    }
}
