//! Rays as Whitted followed them ("An Improved Illumination Model for Shaded Display", CACM 1980): direct light, highlights and
//! mirrors, and nothing that is left to chance.
//!
//! A ray that leaves the scene sees its environment, whose light on surfaces is none of theirs.
//!
//! Direct light of surfaces is handed in, as exact as its maker has it. Their highlights are the lobe of Phong's exponent about
//! the mirrored ray over the whole lamp, in closed form ([`crate::lobe`]), less what of the lamps' light is hidden there in all.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use scene::{Gloss, Light, Rgb, luminance};

use crate::evaluation::Evaluation;
use crate::eye::{Eye, SeenPoint, Sight};
use crate::lobe::{in_front_of, moment, odd};
use crate::sequence::scatter;
use crate::surface::{Receiver, SurfacePoint};

/// Mirrors that one ray meets at most. Between two that face each other more would be seen, ever darker.
const MOST_MIRRORS: u32 = 8;

/// What is left of a ray's light in the brightest channel, below which it ends: less than a step of a display.
const LEAST_LIGHT: f64 = 1e-3;

/// Irradiance from surfaces that emit at a point of a surface, by its shading normal, W·m⁻².
pub type DirectLight<'a> = dyn Fn(&SurfacePoint) -> Rgb + Sync + 'a;

/// Whitted's rays before a scene.
pub struct Whitted<'a> {
    eye: Eye<'a>,
    direct: &'a DirectLight<'a>,
    /// Outlines of the lamps, and their radiance.
    lamps: Vec<(u32, Vec<DVec3>, Rgb)>,
}

impl<'a> Whitted<'a> {
    /// Rays of an eye; `direct` says what light the scene's surfaces send straight to a point.
    pub fn new(eye: Eye<'a>, direct: &'a DirectLight<'a>) -> Self {
        let scene = eye.scene();
        let lamp = |polygon| (polygon, scene.outline(polygon), scene.material(polygon).radiance);
        Self { lamps: scene.emitters().map(lamp).collect(), eye, direct }
    }

    /// What is seen at a point of the image plane. An object in a mirror is another one than itself.
    pub fn evaluate(&self, point: DVec2) -> Evaluation {
        let ray = self.eye.ray(point);
        let mut seen = Evaluation { cost: 1, ..Evaluation::default() };
        let (mut sight, mut direction) = (self.eye.look(&ray), ray.direction);
        let (mut radiance, mut left) = (Rgb::ZERO, Rgb::ONE);
        for mirrors in 0.. {
            let object = match &sight {
                Sight::Background => 0,
                Sight::Back(object) => *object,
                Sight::Front(front) => front.object,
            };
            seen.object = if mirrors == 0 { object } else { scatter(seen.object.into(), object.into()) as u32 };
            let front = match sight {
                Sight::Front(front) => front,
                Sight::Back(_) => break,
                Sight::Background => {
                    radiance += left * self.eye.background(direction);
                    break;
                }
            };
            radiance += left * self.local(&front, direction, &mut seen.cost);
            let gloss = self.eye.scene().material(front.point.polygon).gloss;
            let Some(mirror) = gloss.filter(|gloss| gloss.is_mirror && mirrors < MOST_MIRRORS) else { break };
            left *= mirror.specular;
            if left.max_element() < LEAST_LIGHT {
                break;
            }
            let receiver = self.eye.surfaces.looked_at(&front.point);
            direction = mirrored(direction, &receiver);
            sight = self.eye.look_from(&receiver, direction);
            seen.cost += 1;
        }
        seen.radiance = radiance.as_vec3();
        seen
    }

    /// What a point sends back along a ray by itself: emitted and diffuse light, and highlights.
    fn local(&self, seen: &SeenPoint, direction: DVec3, rays: &mut u32) -> Rgb {
        let scene = self.eye.scene();
        let material = scene.material(seen.point.polygon);
        let diffuse = material.gloss.map_or(material.reflectance, |gloss| gloss.diffuse) * seen.texture;
        let highlights = material.gloss.filter(|gloss| !gloss.is_mirror);
        if diffuse == Rgb::ZERO && highlights.is_none() {
            return material.radiance;
        }
        let receiver = self.eye.surfaces.looked_at(&seen.point);
        let direct = if self.lamps.is_empty() { Rgb::ZERO } else { (self.direct)(&seen.point) };
        let mut radiance = material.radiance + diffuse * direct / PI;
        let mirrored = mirrored(direction, &receiver);
        for light in &scene.lights {
            let Some((towards, irradiance)) = self.arriving(light, &receiver, rays) else { continue };
            radiance += diffuse * irradiance * receiver.cosine.dot(towards) / PI;
            if let Some(gloss) = highlights {
                let exponent = f64::from(odd(gloss.exponent));
                let cosine = mirrored.dot(towards).max(0.0);
                radiance += gloss.specular * irradiance * cosine.powf(exponent) * (exponent + 1.0) / TAU;
            }
        }
        match highlights {
            Some(gloss) if direct != Rgb::ZERO => radiance + self.highlights(&gloss, &receiver, mirrored, direct),
            _ => radiance,
        }
    }

    /// The direction of a light without a surface, and what it sends to a surface that faces it, W·m⁻²; none if the light is
    /// hidden.
    fn arriving(&self, light: &Light, receiver: &Receiver, rays: &mut u32) -> Option<(DVec3, Rgb)> {
        let (way, irradiance) = match *light {
            Light::Point { position, intensity } => {
                let way = position - receiver.position;
                (way, intensity / way.length_squared())
            }
            // As far away as everything is before.
            Light::Directional { direction, irradiance } => (direction * 2.0 * self.eye.surfaces.size, irradiance),
        };
        let towards = way.try_normalize()?;
        if receiver.cosine_to(towards) <= 0.0 {
            return None;
        }
        *rays += 1;
        let stands = |id| !self.eye.surfaces.is_on(receiver, id);
        let is_hidden = self.eye.surfaces.bvh.is_blocked_among(receiver.position, receiver.position + way, stands);
        (!is_hidden).then_some((towards, irradiance))
    }

    /// The highlights of the lamps about the mirrored ray, W·sr⁻¹·m⁻².
    fn highlights(&self, gloss: &Gloss, receiver: &Receiver, mirrored: DVec3, direct: Rgb) -> Rgb {
        let exponent = odd(gloss.exponent);
        let (mut lobe, mut unhidden) = (Rgb::ZERO, Rgb::ZERO);
        for (polygon, outline, radiance) in &self.lamps {
            if self.eye.surfaces.plane(*polygon).distance(receiver.position) <= self.eye.surfaces.rounding {
                continue;
            }
            let corners: Vec<DVec3> = outline.iter().map(|corner| corner - receiver.position).collect();
            let above = in_front_of(receiver.normal, &corners);
            lobe += radiance * moment(&in_front_of(mirrored, &above), mirrored, exponent);
            unhidden += radiance * moment(&in_front_of(receiver.cosine, &above), receiver.cosine, 1);
        }
        let (direct, unhidden) = (luminance(direct), luminance(unhidden));
        let share = if unhidden > 0.0 { (direct / unhidden).min(1.0) } else { 0.0 };
        gloss.specular * lobe * (share * f64::from(exponent + 1) / TAU)
    }
}

/// The direction in which a point mirrors a ray, by its shading normal; by its own where that would be through the surface.
fn mirrored(direction: DVec3, receiver: &Receiver) -> DVec3 {
    let by = |normal: DVec3| direction - 2.0 * direction.dot(normal) * normal;
    let shaded = by(receiver.cosine);
    if receiver.normal.dot(shaded) > 0.0 { shaded } else { by(receiver.normal) }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use scene::{Bvh, Camera, Environment, LatLongMap, Scene, Sky, UpAxis};

    use super::*;
    use crate::path_trace::test_scenes::{grey, scene_of};

    fn square(z: f64, half: f64) -> Vec<DVec3> {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| DVec3::new(x * half, y * half, z)).to_vec()
    }

    /// What is seen at the middle of a picture, looking along a direction from a place.
    fn seen(scene: &Scene, eye: DVec3, direction: DVec3, direct: &DirectLight<'_>) -> Evaluation {
        let bvh = Bvh::of_scene(scene);
        let up = direction.any_orthogonal_vector();
        let camera = Camera { eye, target: eye + direction, up, vertical_fov: 0.5 };
        Whitted::new(Eye::new(scene, &bvh, camera, 10, 10), direct).evaluate(DVec2::splat(5.0))
    }

    fn dark(_: &SurfacePoint) -> Rgb {
        Rgb::ZERO
    }

    fn is_near(seen: Vec3, expected: f64) -> bool {
        (seen - Vec3::splat(expected as f32)).abs().max_element() < 1e-6 * (1.0 + expected as f32)
    }

    #[test]
    fn lights_without_a_surface_light_what_faces_them() {
        let mut scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0)), (square(1.0, 0.1), grey(0.0, 0.0))]);
        let from = DVec3::new(0.5, 0.0, 0.5);
        let look = |scene: &Scene| seen(scene, from, -DVec3::Z, &dark);
        assert_eq!((look(&scene).radiance, look(&scene).object, look(&scene).cost), (Vec3::ZERO, 1, 1));
        scene.lights = vec![Light::Point { position: DVec3::new(0.5, 0.0, 2.0), intensity: Rgb::splat(8.0) }];
        assert!(is_near(look(&scene).radiance, 0.5 / PI * 8.0 / 4.0));
        assert_eq!(look(&scene).cost, 2);
        let direction = DVec3::new(0.0, 0.6, 0.8);
        scene.lights = vec![Light::Directional { direction, irradiance: Rgb::splat(3.0) }];
        assert!(is_near(look(&scene).radiance, 0.5 / PI * 3.0 * 0.8));
        // Hidden by the small square, whose back it is; and below the horizon.
        scene.lights = vec![Light::Point { position: DVec3::new(-0.5, 0.0, 2.0), intensity: Rgb::splat(8.0) }];
        assert_eq!((look(&scene).radiance, look(&scene).cost), (Vec3::ZERO, 2));
        scene.lights = vec![Light::Directional { direction: -direction, irradiance: Rgb::splat(3.0) }];
        assert_eq!((look(&scene).radiance, look(&scene).cost), (Vec3::ZERO, 1));
    }

    #[test]
    fn direct_light_of_surfaces_is_taken_as_it_is_told() {
        let scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0)), (square(3.0, 1.0), grey(0.0, 1.0))]);
        let direct = |point: &SurfacePoint| Rgb::splat(2.0 + point.position.x);
        let found = seen(&scene, DVec3::new(0.5, 0.0, 0.5), -DVec3::Z, &direct);
        assert!(is_near(found.radiance, 0.5 / PI * 2.5) && found.cost == 1);
    }

    #[test]
    fn a_mirror_shows_what_is_before_it_and_two_come_to_an_end() {
        let mirror = |specular: f64| Gloss {
            diffuse: Rgb::ZERO,
            specular: Rgb::splat(specular),
            exponent: 0.0,
            is_mirror: true,
        };
        let mut scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0)), (square(1.0, 1.0), grey(0.5, 6.0))]);
        scene.corners[4..].reverse();
        scene.materials[0].gloss = Some(mirror(0.25));
        let found = seen(&scene, DVec3::new(0.1, 0.0, 0.5), -DVec3::Z, &dark);
        assert!(is_near(found.radiance, 0.25 * 6.0 / PI) && found.cost == 2);
        let itself = seen(&scene, DVec3::new(0.1, 0.0, 0.5), DVec3::Z, &dark);
        assert!(itself.object == 2 && found.object != 2 && found.object != 1);
        scene.materials[1].gloss = Some(mirror(1.0));
        scene.materials[0].gloss = Some(mirror(1.0));
        let found = seen(&scene, DVec3::new(0.1, 0.0, 0.5), -DVec3::Z, &dark);
        assert!(is_near(found.radiance, 4.0 * 6.0 / PI) && found.cost == 1 + MOST_MIRRORS);
    }

    #[test]
    fn a_mirror_shows_the_environment() {
        let mut scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0))]);
        let gloss = Gloss { diffuse: Rgb::ZERO, specular: Rgb::splat(0.25), exponent: 0.0, is_mirror: true };
        scene.materials[0].gloss = Some(gloss);
        let map = LatLongMap { width: 1, height: 2, texels: vec![Vec3::splat(8.0), Vec3::splat(5.0)] };
        scene.environment = Some(Environment { sky: Sky::Map(map), up: UpAxis::Z, rotation: 0.0, scale: 1.0 });
        let look = |z: f64, direction: DVec3| seen(&scene, DVec3::new(0.1, 0.0, z), direction, &dark);
        assert!(is_near(look(0.5, -DVec3::Z).radiance, 0.25 * 8.0));
        assert!(is_near(look(0.5, DVec3::Z).radiance, 8.0) && look(0.5, DVec3::Z).object == 0);
        assert!(is_near(look(-0.5, -DVec3::Z).radiance, 5.0));
        assert!(is_near(look(-0.5, DVec3::Z).radiance, 0.0), "a back is black");
    }

    /// The sharper the highlight, the more it is a mirror's picture of the lamp; at any exponent it is less than that.
    #[test]
    fn highlights_of_a_lamp_tend_to_its_mirror_image() {
        let mut scene = scene_of(&[(square(0.0, 1.0), grey(0.0, 0.0)), (square(1.0, 1.0), grey(0.0, PI))]);
        scene.corners[4..].reverse();
        let unhidden = |_: &SurfacePoint| Rgb::splat(PI * 0.554_5);
        let highlight = |scene: &mut Scene, exponent: f64, direct: &DirectLight<'_>| {
            let gloss = Gloss { diffuse: Rgb::ZERO, specular: Rgb::splat(0.5), exponent, is_mirror: false };
            scene.materials[0].gloss = Some(gloss);
            f64::from(seen(scene, DVec3::new(0.0, 0.0, 0.5), -DVec3::Z, direct).radiance.x)
        };
        let [wide, narrow, sharp] = [5.0, 15.0, 1001.0].map(|exponent| highlight(&mut scene, exponent, &unhidden));
        assert!(0.0 < wide && wide < narrow && narrow < sharp && sharp <= 0.5, "{wide} {narrow} {sharp}");
        assert!(sharp > 0.499);
        let half = highlight(&mut scene, 15.0, &|_| Rgb::splat(PI * 0.554_5 / 2.0));
        assert!((half / narrow - 0.5).abs() < 1e-3, "half of the lamps' light is hidden");
        scene.lights = vec![Light::Point { position: DVec3::Z * 0.75, intensity: Rgb::ONE }];
        scene.materials[1].radiance = Rgb::ZERO;
        let point = highlight(&mut scene, 51.0, &dark);
        assert!((point - 0.5 * 52.0 / TAU / 0.5625).abs() < 1e-5, "{point}");
    }
}
