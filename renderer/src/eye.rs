//! What an eye sees along its rays: points of surfaces, with the texture that lies there.

use glam::{DVec2, DVec3};
use scene::{Bvh, Camera, Hit, Ray, Rgb, Scene, TextureMap};

use crate::evaluation::Evaluation;
use crate::surface::{Receiver, SurfacePoint, Surfaces};

/// Set in the number of an object whose back is seen.
const BACK: u32 = 1 << 31;

/// A camera before a scene.
pub struct Eye<'a> {
    pub(crate) surfaces: Surfaces<'a>,
    /// By polygon, its texture and how it lies there.
    textures: Vec<Option<(u32, TextureMap)>>,
    camera: Camera,
    size: [u32; 2],
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// Nothing.
    Background,
    /// The back of a surface, which is black; the number of the object, as of [`Evaluation`].
    Back(u32),
    /// The front of a surface.
    Front(SeenPoint),
}

/// A point of a surface that is seen from its front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPoint {
    /// Where it is.
    pub point: SurfacePoint,
    /// What the texture multiplies reflectance by there; 1 without one.
    pub texture: Rgb,
    /// The number of the object, as of [`Evaluation`].
    pub object: u32,
}

impl<'a> Eye<'a> {
    /// A valid camera whose picture has so many pixels, before a valid scene; `bvh` is [`Bvh::of_scene`] of it.
    pub fn new(scene: &'a Scene, bvh: &'a Bvh, camera: Camera, width: u32, height: u32) -> Self {
        let textures = scene.polygon_ids().map(|polygon| scene.texture_map(polygon)).collect();
        Self { surfaces: Surfaces::new(scene, bvh), textures, camera, size: [width, height] }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.surfaces.scene
    }

    /// Columns and rows of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The ray through a point of the image plane.
    pub fn ray(&self, point: DVec2) -> Ray {
        self.camera.ray(point, self.size[0], self.size[1])
    }

    /// Radiance where a ray meets nothing, W·sr⁻¹·m⁻².
    pub(crate) fn background(&self, direction: DVec3) -> Rgb {
        self.scene().environment.as_ref().map_or(Rgb::ZERO, |environment| environment.seen(direction))
    }

    /// How far before the eye a position is, along its line of sight, metres; negative behind it.
    pub(crate) fn depth(&self, position: DVec3) -> f64 {
        self.camera.basis().2.dot(position - self.camera.eye)
    }

    /// The point of the image plane, pixels, where a position before the eye is seen.
    pub(crate) fn project(&self, position: DVec3) -> DVec2 {
        let (right, up, _) = self.camera.basis();
        let way = position - self.camera.eye;
        let size = self.far_corner();
        let scale = size.y / (2.0 * (self.camera.vertical_fov / 2.0).tan() * self.depth(position));
        0.5 * size + DVec2::new(right.dot(way), -up.dot(way)) * scale
    }

    /// How far the nearest surface along a ray is.
    pub(crate) fn nearest(&self, ray: &Ray) -> Option<f64> {
        self.surfaces.bvh.closest_hit(ray, 0.0).map(|hit| hit.distance)
    }

    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The lower right corner of the picture, pixels.
    pub(crate) fn far_corner(&self) -> DVec2 {
        DVec2::new(self.size[0].into(), self.size[1].into())
    }

    /// What a ray meets.
    pub fn look(&self, ray: &Ray) -> Sight {
        let hit = self.surfaces.bvh.closest_hit(ray, 0.0);
        hit.map_or(Sight::Background, |hit| self.sight(ray, hit.id, hit.distance))
    }

    /// What is seen from a point of a surface.
    pub(crate) fn look_from(&self, receiver: &Receiver, direction: DVec3) -> Sight {
        let ray = Ray { origin: receiver.position, direction };
        let hit = self.hit_from(receiver, &ray);
        hit.map_or(Sight::Background, |hit| self.sight(&ray, hit.id, hit.distance))
    }

    /// How far from a point of a surface the nearest other one in a direction is.
    pub(crate) fn nearest_from(&self, receiver: &Receiver, direction: DVec3) -> Option<f64> {
        self.hit_from(receiver, &Ray { origin: receiver.position, direction }).map(|hit| hit.distance)
    }

    fn hit_from(&self, receiver: &Receiver, ray: &Ray) -> Option<Hit> {
        self.surfaces.bvh.closest_hit_among(ray, |id| !self.surfaces.is_on(receiver, id))
    }

    fn sight(&self, ray: &Ray, hit: u32, distance: f64) -> Sight {
        let Some(polygon) = self.surfaces.facing(hit, ray.direction) else {
            return Sight::Back(BACK | self.object(hit));
        };
        let plane = self.surfaces.plane(polygon);
        let position = ray.at(distance);
        let position = position - plane.normal * plane.distance(position);
        let texture = self.textures[polygon as usize].map_or(Rgb::ONE, |(texture, map)| {
            self.scene().textures[texture as usize].sample(map.at(position).as_vec2()).as_dvec3()
        });
        let point = SurfacePoint { position, normal: plane.normal, polygon };
        Sight::Front(SeenPoint { point, texture, object: self.object(polygon) })
    }

    /// Faces of one object that are smoothed into each other are one; every other polygon is one of its own.
    pub(crate) fn object(&self, polygon: u32) -> u32 {
        let scene = self.scene();
        match scene.has_shading_normals(polygon) {
            true => 1 + scene.polygons.len() as u32 + scene.polygons[polygon as usize].object,
            false => 1 + polygon,
        }
    }

    /// What is seen at a point of the image plane where surfaces reflect diffusely: L = ρE/π + Ke, and past them the scene's
    /// environment. The irradiance E, W·m⁻², of a point of a surface comes with the number of rays that it took.
    pub fn diffuse(&self, point: DVec2, irradiance: impl FnOnce(&SurfacePoint) -> (Rgb, u32)) -> Evaluation {
        let ray = self.ray(point);
        match self.look(&ray) {
            Sight::Background => Evaluation { radiance: self.background(ray.direction).as_vec3(), object: 0, cost: 1 },
            Sight::Back(object) => Evaluation { object, cost: 1, ..Evaluation::default() },
            Sight::Front(SeenPoint { point, texture, object }) => {
                let material = self.scene().material(point.polygon);
                let reflectance = material.reflectance * texture;
                let (irradiance, rays) = if reflectance == Rgb::ZERO { (Rgb::ZERO, 0) } else { irradiance(&point) };
                let radiance = reflectance * irradiance / std::f64::consts::PI + material.radiance;
                Evaluation { radiance: radiance.as_vec3(), object, cost: 1 + rays }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use scene::{Environment, LatLongMap, Sky, Texture, UpAxis};

    use super::*;
    use crate::path_trace::test_scenes::{grey, scene_of};

    fn square(z: f64) -> Vec<DVec3> {
        [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, z)).to_vec()
    }

    fn from_above(z: f64) -> Camera {
        Camera { eye: DVec3::new(0.5, 0.5, z), target: DVec3::new(0.5, 0.5, 0.0), up: DVec3::Y, vertical_fov: 0.8 }
    }

    #[test]
    fn fronts_backs_and_nothing() {
        let scene = scene_of(&[(square(0.0), grey(0.5, 3.0))]);
        let bvh = Bvh::of_scene(&scene);
        let seen = |z: f64, x: f64| {
            let eye = Eye::new(&scene, &bvh, from_above(z), 40, 20);
            eye.diffuse(DVec2::new(x, 10.0), |_| (Rgb::splat(2.0), 7))
        };
        let front = seen(1.0, 20.0);
        let expected = (0.5 * 2.0 + 3.0) / std::f64::consts::PI;
        assert!((front.radiance - Vec3::splat(expected as f32)).length() < 1e-6);
        assert_eq!((front.object, front.cost), (1, 8));
        let back = seen(-1.0, 20.0);
        assert_eq!((back.radiance, back.object, back.cost), (Vec3::ZERO, BACK | 1, 1));
        assert_eq!(seen(1.0, 0.0), Evaluation { radiance: Vec3::ZERO, object: 0, cost: 1 });
    }

    #[test]
    fn past_all_surfaces_the_environment_is_seen() {
        let mut scene = scene_of(&[(square(0.0), grey(0.5, 0.0))]);
        let map = LatLongMap { width: 2, height: 1, texels: vec![Vec3::X, Vec3::Y] };
        scene.environment = Some(Environment { sky: Sky::Map(map), up: UpAxis::Z, rotation: 0.0, scale: 3.0 });
        let bvh = Bvh::of_scene(&scene);
        let eye = Eye::new(&scene, &bvh, from_above(1.0), 40, 20);
        let seen = |x: f64| eye.diffuse(DVec2::new(x, 10.0), |_| (Rgb::ZERO, 0));
        // West is left in the picture and in the map.
        for (x, radiance) in [(0.5, Vec3::X * 3.0), (39.5, Vec3::Y * 3.0)] {
            assert_eq!(seen(x), Evaluation { radiance, object: 0, cost: 1 });
        }
        assert_eq!(seen(20.0).radiance, Vec3::ZERO);
    }

    #[test]
    fn black_surfaces_are_not_asked_for_their_light() {
        let scene = scene_of(&[(square(0.0), grey(0.0, 3.0))]);
        let bvh = Bvh::of_scene(&scene);
        let eye = Eye::new(&scene, &bvh, from_above(1.0), 40, 20);
        assert_eq!(eye.diffuse(DVec2::new(20.0, 10.0), |_| unreachable!("it reflects nothing")).cost, 1);
    }

    #[test]
    fn a_texture_is_seen_texel_by_texel_and_round_bodies_are_one_object() {
        let mut scene = scene_of(&[(square(0.0), grey(0.5, 0.0))]);
        scene.materials[0].texture = Some(0);
        scene.textures = vec![Texture { name: "halves".into(), width: 2, height: 1, texels: vec![[255; 3], [0; 3]] }];
        scene.texture_coordinates =
            [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(u, v)| glam::Vec2::new(u, v)).to_vec();
        scene.tints = scene.mean_texture_colours();
        scene.shading_normals = vec![Vec3::Z; 4];
        let bvh = Bvh::of_scene(&scene);
        let eye = Eye::new(&scene, &bvh, from_above(1.0), 40, 40);
        let at = |x: f64| match eye.look(&Ray { origin: DVec3::new(x, 0.5, 1.0), direction: -DVec3::Z }) {
            Sight::Front(seen) => seen,
            other => unreachable!("{other:?}"),
        };
        assert_eq!((at(0.25).texture, at(0.75).texture), (Rgb::ONE, Rgb::ZERO));
        assert_eq!(at(0.25).object, 2);
    }
}
