//! What a corner of a face has beside its place: a texture coordinate and a shading normal.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use scene::{TextureMap, area_vector};

use crate::face::{Corner, outline};

/// Cosine of the angle (1°) within which shading normals are the face's own: no eye sees the difference, and faces of a
/// flat wall whose normals a file repeats with rounding merge.
const FLAT: f64 = 0.99985;

/// Distance of texture coordinates from one affine map, as a fraction of the span that they have on the face: a texel of a
/// texture that is stretched over it once, which is what the six digits of a text file keep.
const SAME_MAP: f64 = 1e-3;

/// Largest change between shading normals and their affine interpolation: as [`FLAT`], an angle of 1°.
const SAME_NORMAL: f64 = 0.02;

/// What a corner has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Attributes {
    /// Texture coordinates as [`scene::Texture`] has them; none where the face has no texture.
    pub uv: Option<Vec2>,
    /// Unit shading normal; none where the face's own stands.
    pub normal: Option<Vec3>,
    /// Whether it belongs to the back of a two-sided face: backs merge with backs.
    pub is_back: bool,
}

/// The attributes of a model; a [`Corner::seam`] is an index into it, and 0 is none.
#[derive(Clone, Debug)]
pub(crate) struct AttributeTable {
    list: Vec<Attributes>,
    known: HashMap<[u32; 7], u32>,
}

impl Default for AttributeTable {
    fn default() -> Self {
        let mut table = Self { list: Vec::new(), known: HashMap::new() };
        table.intern(Attributes::default());
        table
    }
}

impl AttributeTable {
    /// The attributes that a seam stands for.
    pub fn get(&self, seam: u32) -> Attributes {
        self.list.get(seam as usize).copied().unwrap_or_default()
    }

    /// The seams of a face's corners. What is not finite counts as not there, and so do normals that say what the outline
    /// does.
    pub fn seams(&mut self, outline: &[DVec3], attributes: &mut [Attributes]) -> Vec<u32> {
        let normal = area_vector(outline).normalize_or_zero();
        for corner in attributes.iter_mut() {
            corner.uv = corner.uv.filter(|uv| uv.is_finite());
            corner.normal = corner.normal.map(Vec3::normalize_or_zero).filter(|n| *n != Vec3::ZERO);
        }
        let flat = |corner: &Attributes| corner.normal.is_none_or(|n| n.as_dvec3().dot(normal) > FLAT);
        if attributes.iter().all(flat) {
            attributes.iter_mut().for_each(|corner| corner.normal = None);
        }
        attributes.iter().map(|corner| self.intern(*corner)).collect()
    }

    /// The seam of attributes: the same for the same ones.
    pub fn intern(&mut self, attributes: Attributes) -> u32 {
        let uv = attributes.uv.map_or([0, 0, 0], |uv| [1, uv.x.to_bits(), uv.y.to_bits()]);
        let normal = attributes.normal.unwrap_or_default().to_array().map(f32::to_bits);
        let key = [uv[0], uv[1], uv[2], normal[0], normal[1], normal[2], attributes.is_back.into()];
        *self.known.entry(key).or_insert_with(|| {
            self.list.push(attributes);
            self.list.len() as u32 - 1
        })
    }

    /// Appends another model's table, its normals turned; what each of its seams is here.
    pub fn append(&mut self, other: &Self, turn: impl Fn(Vec3) -> Vec3) -> Vec<u32> {
        let turned = |attributes: &Attributes| Attributes { normal: attributes.normal.map(&turn), ..*attributes };
        other.list.iter().map(|attributes| self.intern(turned(attributes))).collect()
    }

    /// Whether texture coordinates and normals are affine over an outline: of what differs the corners alone cannot tell
    /// what is between them.
    pub fn are_affine(&self, corners: &[Corner], vertices: &[DVec3]) -> bool {
        if corners.iter().all(|corner| corner.seam == 0) {
            return true;
        }
        let points = outline(corners, vertices);
        let attributes: Vec<Attributes> = corners.iter().map(|corner| self.get(corner.seam)).collect();
        let with_uv = attributes.iter().filter(|corner| corner.uv.is_some()).count();
        let with_normal = attributes.iter().filter(|corner| corner.normal.is_some()).count();
        if ![0, corners.len()].contains(&with_uv) || ![0, corners.len()].contains(&with_normal) {
            return false;
        }
        let uv: Vec<Vec2> = attributes.iter().filter_map(|corner| corner.uv).collect();
        let normals: Vec<Vec3> = attributes.iter().filter_map(|corner| corner.normal).collect();
        let span = |of: &[Vec2]| {
            let low = of.iter().copied().reduce(Vec2::min).unwrap_or_default();
            let high = of.iter().copied().reduce(Vec2::max).unwrap_or_default();
            f64::from((high - low).max_element())
        };
        let affine = |values: &[Vec2], reach: f64| {
            let map = TextureMap::through(&points, values);
            points.iter().zip(values).all(|(&point, value)| (map.at(point) - value.as_dvec2()).length() <= reach)
        };
        let (xy, yz): (Vec<Vec2>, Vec<Vec2>) =
            normals.iter().map(|n| (Vec2::new(n.x, n.y), Vec2::new(n.y, n.z))).unzip();
        affine(&uv, SAME_MAP * span(&uv)) && affine(&xy, SAME_NORMAL) && affine(&yz, SAME_NORMAL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_or_says_what_the_outline_does_is_left_out() {
        let mut table = AttributeTable::default();
        let outline = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let seams = |table: &mut AttributeTable, normal: Vec3, uv: Option<Vec2>| {
            table.seams(&outline, &mut [Attributes { uv, normal: Some(normal), is_back: false }; 3])
        };
        for normal in [Vec3::Z * 7.0, Vec3::ZERO, Vec3::NAN, Vec3::new(0.005, 0.0, 1.0)] {
            assert_eq!(seams(&mut table, normal, None), [0; 3]);
            assert_eq!(seams(&mut table, normal, Some(Vec2::splat(f32::INFINITY))), [0; 3]);
        }
        assert_eq!(seams(&mut table, Vec3::X * 3.0, Some(Vec2::Y)), [1; 3]);
        assert_eq!(table.get(1), Attributes { uv: Some(Vec2::Y), normal: Some(Vec3::X), is_back: false });
        assert_eq!(table.get(9), Attributes::default());
    }

    #[test]
    fn a_quad_is_affine_where_its_fourth_corner_agrees() {
        let mut table = AttributeTable::default();
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let mut affine = |uv: [(f32, f32); 4]| {
            let corners: Vec<Corner> = (0..4)
                .map(|i| {
                    let uv = Some(Vec2::from(uv[i]));
                    Corner { vertex: i as u32, seam: table.intern(Attributes { uv, ..Attributes::default() }) }
                })
                .collect();
            table.are_affine(&corners, &vertices)
        };
        assert!(affine([(0., 0.), (5., 0.), (5., 2.), (0., 2.)]));
        assert!(affine([(0., 0.), (5., 0.), (5.001, 2.), (0., 2.)]));
        assert!(!affine([(0., 0.), (5., 0.), (4., 2.), (0., 2.)]));
        assert!(affine([(1., 1.); 4]));
    }
}
