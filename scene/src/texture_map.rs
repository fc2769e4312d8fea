//! Where a texture lies on a polygon, and how bright it is there on the mean.

use glam::{DVec2, DVec3, Vec2};

use crate::texture::TextureSums;
use crate::{Rgb, Scene, area_vector};

/// The affine map from points of a polygon's plane to texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMap {
    /// A point of the plane, metres.
    pub origin: DVec3,
    /// The texture coordinates there.
    pub base: DVec2,
    /// How u and v change along the axes, per metre.
    pub gradients: [DVec3; 2],
}

impl TextureMap {
    /// The map through the widest triangle of an outline that its first corner belongs to; constant without area.
    pub fn through(outline: &[DVec3], coordinates: &[Vec2]) -> Self {
        let corners: Vec<(DVec3, DVec2)> =
            outline.iter().zip(coordinates).map(|(&point, uv)| (point, uv.as_dvec2())).collect();
        let Some(&(origin, base)) = corners.first() else {
            return Self { origin: DVec3::ZERO, base: DVec2::ZERO, gradients: [DVec3::ZERO; 2] };
        };
        let mut widest = (0.0, Self { origin, base, gradients: [DVec3::ZERO; 2] });
        for (i, &(p, p_uv)) in corners.iter().enumerate().skip(1) {
            for &(q, q_uv) in corners.iter().skip(i + 1) {
                let (e, f) = (p - origin, q - origin);
                let normal = e.cross(f);
                let square = normal.length_squared();
                if square > widest.0 {
                    let (along_e, along_f) = (f.cross(normal) / square, normal.cross(e) / square);
                    let (de, df) = (p_uv - base, q_uv - base);
                    let gradients = [along_e * de.x + along_f * df.x, along_e * de.y + along_f * df.y];
                    widest = (square, Self { origin, base, gradients });
                }
            }
            // The triangles with more corners are no wider than these by much, and their number grows with the square.
            if i >= 8 {
                break;
            }
        }
        widest.1
    }

    /// The texture coordinates of a point.
    pub fn at(&self, point: DVec3) -> DVec2 {
        let way = point - self.origin;
        self.base + DVec2::new(way.dot(self.gradients[0]), way.dot(self.gradients[1]))
    }
}

impl Scene {
    /// The texture of a polygon and how it lies there, if it has one.
    pub fn texture_map(&self, polygon: u32) -> Option<(u32, TextureMap)> {
        let texture = self.material(polygon).texture?;
        let coordinates = self.texture_coordinates.get(self.polygons[polygon as usize].corner_range())?;
        Some((texture, TextureMap::through(&self.outline(polygon), coordinates)))
    }

    /// By polygon, the mean linear colour of its texture over its area, 1 where there is none; empty where no polygon has
    /// one. An importer makes [`Scene::tints`] of it.
    pub fn mean_texture_colours(&self) -> Vec<Rgb> {
        if self.texture_coordinates.is_empty() {
            return Vec::new();
        }
        let sums: Vec<TextureSums> = self.textures.iter().map(TextureSums::new).collect();
        self.polygon_ids().map(|polygon| self.mean_texture_colour(polygon, &sums)).collect()
    }

    fn mean_texture_colour(&self, polygon: u32, sums: &[TextureSums]) -> Rgb {
        let Some(sums) = self.material(polygon).texture.and_then(|texture| sums.get(texture as usize)) else {
            return Rgb::ONE;
        };
        let outline = self.outline(polygon);
        let uv: Vec<DVec2> = self.texture_coordinates[self.polygons[polygon as usize].corner_range()]
            .iter()
            .map(|uv| uv.as_dvec2())
            .collect();
        let (mut sum, mut total) = (Rgb::ZERO, 0.0);
        for i in 1..outline.len() - 1 {
            let area = area_vector(&[outline[0], outline[i], outline[i + 1]]).length();
            if let Some(mean) = sums.mean([uv[0], uv[i], uv[i + 1]]) {
                sum += mean * area;
                total += area;
            }
        }
        if total > 0.0 { sum / total } else { sums.mean_of_outline(&uv) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Polygon, Texture};

    /// A square of 2 m whose left half is white and whose right half is black.
    fn square() -> Scene {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let mut scene = Scene {
            vertices: corners.map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec(),
            corners: (0..4).collect(),
            texture_coordinates: corners.map(|(x, y)| DVec2::new(x, -y).as_vec2() / 2.0).to_vec(),
            polygons: vec![Polygon { first_corner: 0, corner_count: 4, material: 0, object: 0 }],
            materials: vec![Material { texture: Some(0), ..Material::grey("halves") }],
            textures: vec![Texture { name: "halves".into(), width: 2, height: 1, texels: vec![[255; 3], [0; 3]] }],
            objects: vec!["square".into()],
            ..Scene::default()
        };
        scene.tints = scene.mean_texture_colours();
        scene
    }

    #[test]
    fn a_polygon_reflects_by_the_mean_of_its_texture() {
        let scene = square();
        assert_eq!(scene.validate(), Ok(()));
        assert!((scene.reflectance(0) - Rgb::splat(0.25)).length() < 1e-4, "{}", scene.reflectance(0));
        let mut point = scene.clone();
        point.texture_coordinates = vec![Vec2::new(0.25, 0.5); 4];
        assert_eq!(point.mean_texture_colours(), [Rgb::ONE]);
        let plain = Scene { texture_coordinates: vec![], ..square() };
        assert!(plain.mean_texture_colours().is_empty());
    }

    #[test]
    fn textures_that_are_not_whole_are_not_valid() {
        let changes: [fn(&mut Scene); 8] = [
            |scene| scene.texture_coordinates.clear(),
            |scene| scene.texture_coordinates[1].x = f32::NAN,
            |scene| scene.tints.clear(),
            |scene| scene.tints[0].y = 1.5,
            |scene| scene.textures.clear(),
            |scene| scene.textures[0].texels.clear(),
            |scene| scene.textures[0].width = u32::MAX,
            |scene| scene.shading_normals = vec![glam::Vec3::Z; 3],
        ];
        for (i, change) in changes.into_iter().enumerate() {
            let mut scene = square();
            change(&mut scene);
            assert!(scene.validate().is_err(), "change {i}");
        }
    }

    #[test]
    fn a_map_through_a_quad_and_through_nothing() {
        let outline = [DVec3::ZERO, DVec3::X * 2.0, DVec3::new(2.0, 1.0, 1.0), DVec3::new(0.0, 1.0, 1.0)];
        let coordinates = [Vec2::new(5.0, 1.0), Vec2::new(6.0, 1.0), Vec2::new(6.0, 3.0), Vec2::new(5.0, 3.0)];
        let map = TextureMap::through(&outline, &coordinates);
        for (point, uv) in outline.iter().zip(coordinates) {
            assert!((map.at(*point) - uv.as_dvec2()).length() < 1e-12);
        }
        assert_eq!(TextureMap::through(&[], &[]).at(DVec3::ONE), DVec2::ZERO);
        assert_eq!(TextureMap::through(&[DVec3::ONE; 4], &coordinates).at(DVec3::ZERO), DVec2::new(5.0, 1.0));
    }
}
