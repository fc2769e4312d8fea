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
}

/// The attributes of a model; a [`Corner::seam`] is an index into it, and 0 is none.
#[derive(Clone, Debug)]
pub(crate) struct AttributeTable {
    list: Vec<Attributes>,
    known: HashMap<[u32; 6], u32>,
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
        let key = [uv[0], uv[1], uv[2], normal[0], normal[1], normal[2]];
        *self.known.entry(key).or_insert_with(|| {
            self.list.push(attributes);
            self.list.len() as u32 - 1
        })
    }

    /// The seam of a corner between those of two seams, of which it has the fraction `along` from the first to the second;
    /// what one of them lacks it has not.
    pub fn between(&mut self, ends: [u32; 2], along: f64) -> u32 {
        if ends[0] == ends[1] {
            return ends[0];
        }
        let ([from, to], along) = (ends.map(|seam| self.get(seam)), along as f32);
        let uv = from.uv.zip(to.uv).map(|(from, to)| from.lerp(to, along));
        let normal = from.normal.zip(to.normal).map(|(from, to)| from.lerp(to, along).normalize_or_zero());
        self.intern(Attributes { uv, normal: normal.filter(|normal| *normal != Vec3::ZERO) })
    }

    /// Turns the normals of a face that was turned to its front, where they are not: the winding may have been the only thing
    /// wrong.
    pub fn turn_to_front(&mut self, corners: &mut [Corner], vertices: &[DVec3]) {
        let outline = outline(corners, vertices);
        let front = area_vector(&outline);
        let to_front = |normal: Vec3| if normal.as_dvec3().dot(front) < 0.0 { -normal } else { normal };
        let mut attributes: Vec<Attributes> = corners.iter().map(|corner| self.get(corner.seam)).collect();
        attributes.iter_mut().for_each(|corner| corner.normal = corner.normal.map(to_front));
        let seams = self.seams(&outline, &mut attributes);
        corners.iter_mut().zip(seams).for_each(|(corner, seam)| corner.seam = seam);
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
            table.seams(&outline, &mut [Attributes { uv, normal: Some(normal) }; 3])
        };
        for normal in [Vec3::Z * 7.0, Vec3::ZERO, Vec3::NAN, Vec3::new(0.005, 0.0, 1.0)] {
            assert_eq!(seams(&mut table, normal, None), [0; 3]);
            assert_eq!(seams(&mut table, normal, Some(Vec2::splat(f32::INFINITY))), [0; 3]);
        }
        assert_eq!(seams(&mut table, Vec3::X * 3.0, Some(Vec2::Y)), [1; 3]);
        assert_eq!(table.get(1), Attributes { uv: Some(Vec2::Y), normal: Some(Vec3::X) });
        assert_eq!(table.get(9), Attributes::default());
    }

    #[test]
    fn between_two_seams_is_what_both_have() {
        let mut table = AttributeTable::default();
        let seam = |table: &mut AttributeTable, u: Option<f32>, normal: Option<Vec3>| {
            table.intern(Attributes { uv: u.map(Vec2::splat), normal })
        };
        let a = seam(&mut table, Some(1.0), Some(Vec3::X));
        let b = seam(&mut table, Some(3.0), Some(Vec3::Y));
        let only_uv = seam(&mut table, Some(3.0), None);
        let opposite = seam(&mut table, None, Some(-Vec3::X));
        assert_eq!((table.between([0, 0], 0.3), table.between([a, a], 0.3), table.between([0, a], 0.3)), (0, a, 0));
        let between = table.between([a, b], 0.5);
        assert_eq!(table.get(between).uv, Some(Vec2::splat(2.0)));
        assert!(table.get(between).normal.is_some_and(|n| (n - Vec3::new(1., 1., 0.).normalize()).length() < 1e-6));
        let between = table.between([a, only_uv], 0.25);
        assert_eq!(table.get(between), Attributes { uv: Some(Vec2::splat(1.5)), normal: None });
        assert_eq!(table.between([a, opposite], 0.5), 0);
    }

    #[test]
    fn normals_of_a_turned_face_look_to_its_front() {
        let mut table = AttributeTable::default();
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let slanted = Vec3::new(0.6, 0.0, 0.8);
        let mut turned = |normals: [Vec3; 3]| {
            let mut corners = [0, 1, 2].map(|vertex| {
                let seam = table.intern(Attributes { uv: None, normal: Some(normals[vertex as usize]) });
                Corner { vertex, seam }
            });
            table.turn_to_front(&mut corners, &vertices);
            corners.map(|corner| table.get(corner.seam).normal)
        };
        assert_eq!(turned([-slanted, slanted, -Vec3::Z]), [Some(slanted), Some(slanted), Some(Vec3::Z)]);
        assert_eq!(turned([-Vec3::Z; 3]), [None; 3]);
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
