//! Shading normals: how a tessellated surface is told to be round.
//!
//! At a point of a polygon with shading normals, light is looked at by the normal n_s that is interpolated there between the
//! corners (after Phong, "Illumination for Computer Generated Pictures", 1975): the irradiance is the integral of
//! L·max(0, ω·n_s) over the directions ω above the polygon's own plane. Light that the polygon passes on goes by the polygon's
//! own normal: no more is reflected than arrives.

use glam::{DVec3, Vec3};

use crate::{Scene, area_vector};

/// Cosine between a shading normal and the polygon's own, below which the polygon's own stands. A normal that lies in the
/// plane, or beyond, is a fault of the file: light from in front of the polygon would hardly count. Round bodies of as few as
/// six sides have 0.86.
const LEAST_COSINE: f64 = 0.1;

/// Corners that the widest triangle is sought at: those with more are no wider by much, and their number grows with the square.
const MOST_TRIED: usize = 9;

impl Scene {
    /// Whether a polygon has shading normals.
    pub fn has_shading_normals(&self, polygon: u32) -> bool {
        let normals = self.shading_normals.get(self.polygons[polygon as usize].corner_range());
        normals.is_some_and(|normals| normals.iter().any(|normal| *normal != Vec3::ZERO))
    }

    /// The unit shading normal at a position on a polygon; none where the polygon's own normal stands.
    ///
    /// It is affine over the polygon, then normalized; a corner without one has the polygon's own. The cosine to the polygon's
    /// own normal is at least 0.1, and no less than at one of the corners.
    pub fn shading_normal(&self, polygon: u32, position: DVec3) -> Option<DVec3> {
        if !self.has_shading_normals(polygon) {
            return None;
        }
        let range = self.polygons[polygon as usize].corner_range();
        let outline = self.outline(polygon);
        let own = area_vector(&outline).normalize_or_zero();
        let normals = self.corner_normals(range, own);
        let origin = outline[0];
        // The widest triangle at the first corner: an importer has seen to it that the other corners agree with it.
        let mut widest = (0.0, [1, 2], DVec3::ZERO);
        for i in 1..(outline.len() - 1).min(MOST_TRIED) {
            for j in i + 1..outline.len() {
                let across = (outline[i] - origin).cross(outline[j] - origin);
                if across.length_squared() > widest.0 {
                    widest = (across.length_squared(), [i, j], across);
                }
            }
        }
        let (square, [i, j], across) = widest;
        let way = position - origin;
        let s = way.cross(outline[j] - origin).dot(across) / square;
        let t = (outline[i] - origin).cross(way).dot(across) / square;
        let normal = (normals[0] * (1.0 - s - t) + normals[i] * s + normals[j] * t).normalize_or_zero();
        (normal.dot(own) >= LEAST_COSINE).then_some(normal)
    }

    /// The largest angle, radians, between the shading normals on a polygon and the polygon's own; 0 where it has none.
    pub fn shading_tilt(&self, polygon: u32) -> f64 {
        if !self.has_shading_normals(polygon) {
            return 0.0;
        }
        let own = self.plane(polygon).normal;
        let normals = self.corner_normals(self.polygons[polygon as usize].corner_range(), own);
        // Between the corners the normals are within the cone about the own one that those of the corners are in.
        normals.iter().map(|normal| normal.dot(own)).fold(1.0, f64::min).max(LEAST_COSINE).acos()
    }

    /// The normals at the corners of a polygon, `own` where they have none.
    fn corner_normals(&self, corners: std::ops::Range<usize>, own: DVec3) -> Vec<DVec3> {
        let normal = |normal: &Vec3| if *normal == Vec3::ZERO { own } else { normal.as_dvec3() };
        self.shading_normals[corners].iter().map(normal).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Polygon};

    /// A square of 2 m in the plane z = 1 with the given normals.
    fn square(normals: [Vec3; 4]) -> Scene {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let scene = Scene {
            vertices: corners.map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec(),
            corners: (0..4).collect(),
            shading_normals: normals.to_vec(),
            polygons: vec![Polygon { first_corner: 0, corner_count: 4, material: 0, object: 0 }],
            materials: vec![Material::grey("grey")],
            objects: vec!["square".into()],
            ..Scene::default()
        };
        assert_eq!(scene.validate(), Ok(()));
        scene
    }

    const MIDDLE: DVec3 = DVec3::new(1.0, 1.0, 1.0);

    #[test]
    fn what_has_none_or_bad_ones_has_its_own() {
        let mut none = square([Vec3::ZERO; 4]);
        assert_eq!((none.has_shading_normals(0), none.shading_normal(0, MIDDLE)), (false, None));
        none.shading_normals.clear();
        assert_eq!((none.has_shading_normals(0), none.shading_normal(0, MIDDLE)), (false, None));
        assert_eq!(none.shading_tilt(0), 0.0);
        for bad in [-Vec3::Z, Vec3::X, Vec3::new(1.0, 0.0, 0.09).normalize(), Vec3::new(0.6, 0.0, -0.8)] {
            let scene = square([bad; 4]);
            assert_eq!(scene.shading_normal(0, MIDDLE), None, "{bad}");
            assert!((scene.shading_tilt(0) - LEAST_COSINE.acos()).abs() < 1e-12);
        }
        // They cancel in the middle.
        assert_eq!(square([Vec3::X, Vec3::X, -Vec3::X, -Vec3::X]).shading_normal(0, MIDDLE), None);
    }

    #[test]
    fn between_corners_it_is_affine_and_of_unit_length() {
        let (left, right) = (Vec3::new(-0.6, 0.0, 0.8), Vec3::new(0.6, 0.0, 0.8));
        let scene = square([left, right, right, left]);
        for (x, y, dx) in [(0.0, 0.3, -0.6), (2.0, 1.9, 0.6), (1.0, 1.0, 0.0), (0.5, 1.2, -0.3), (1.5, 0.0, 0.3)] {
            let exact = DVec3::new(dx, 0.0, 0.8).normalize();
            let normal = scene.shading_normal(0, DVec3::new(x, y, 1.0)).expect("it has normals");
            assert!((normal - exact).length() < 1e-7, "{normal} at {x}, {y}");
        }
        assert!((scene.shading_tilt(0) - 0.8_f64.acos()).abs() < 1e-7);
    }

    #[test]
    fn a_corner_without_one_has_the_polygons_own() {
        let slanted = Vec3::new(0.6, 0.0, 0.8);
        let scene = square([Vec3::ZERO, slanted, slanted, Vec3::ZERO]);
        assert!(scene.shading_normal(0, DVec3::new(0.0, 1.0, 1.0)).is_some_and(|n| (n - DVec3::Z).length() < 1e-12));
        let halfway = DVec3::new(0.3, 0.0, 0.9).normalize();
        assert!(scene.shading_normal(0, MIDDLE).is_some_and(|n| (n - halfway).length() < 1e-7));
    }
}
