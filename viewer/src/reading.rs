//! What a bake says of a point that was clicked.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use scene::{Baked, Camera, LUMINOUS_EFFICACY, Rgb, luminance};

use crate::{
    LightSource, SurfacePoint,
    digits::{Number, colour, place},
    twin::Twin,
};

/// How far the same place of another bake may lie away, as a part of the scene's size: meshes round their vertices.
const REACH: f64 = 1e-4;

/// Sources that are named in a sentence.
const NAMED: usize = 5;

/// The light at a point, and what it is a point of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reading {
    pub point: SurfacePoint,
    /// Metres.
    pub position: DVec3,
    /// Corners of the triangle, metres.
    corners: [DVec3; 3],
    pub material: String,
    pub object: String,
    pub polygon: u32,
    /// The leaf, a number among the bake's elements.
    pub leaf: u32,
    /// W·m⁻².
    pub irradiance: Rgb,
    /// Reflectance at the point, its texture's texel included, 0..=1.
    pub reflectance: Rgb,
    /// Emitted radiance, W·sr⁻¹·m⁻².
    pub emitted: Rgb,
    /// The error measured on the triangle, relative to max(own, mean) irradiance; none in a bake that was not measured.
    pub error: Option<f32>,
}

impl Reading {
    /// Reads what is seen at a place of a picture, pixels; nothing on back sides and background.
    pub fn at(baked: &Baked, twin: &Twin, camera: &Camera, place: DVec2, (width, height): (u32, u32)) -> Option<Self> {
        let ray = camera.ray(place, width, height);
        let hit = twin.bvh.closest_hit(&ray, 0.0).filter(|hit| hit.normal.dot(ray.direction) < 0.0)?;
        let point = SurfacePoint { triangle: hit.id, s: hit.s, t: hit.t };
        Some(Self::of(baked, point, ray.at(hit.distance)))
    }

    /// Reads the same place of another bake of the scene; nothing where it has no such surface.
    pub fn again(&self, baked: &Baked, twin: &Twin) -> Option<Self> {
        let [a, b, c] = self.corners;
        let (normal, reach) = ((b - a).cross(c - a).normalize_or_zero(), REACH * baked.scene.size());
        let (triangle, s, t) = baked.locate(&twin.bvh, self.position, normal, reach)?;
        Some(Self::of(baked, SurfacePoint { triangle, s, t }, self.position))
    }

    fn of(baked: &Baked, point: SurfacePoint, position: DVec3) -> Self {
        let scene = &baked.scene;
        let SurfacePoint { triangle, s, t } = point;
        let polygon = baked.triangles[triangle as usize].polygon;
        let material = scene.material(polygon);
        let texture = scene.texture_map(polygon).map_or(Rgb::ONE, |(texture, map)| {
            scene.textures[texture as usize].sample(map.at(position).as_vec2()).as_dvec3()
        });
        Self {
            point,
            position,
            corners: baked.corners(triangle),
            material: material.name.clone(),
            object: scene.objects[scene.polygons[polygon as usize].object as usize].clone(),
            polygon,
            leaf: baked.triangles[triangle as usize].element,
            irradiance: baked.irradiance(triangle, s, t),
            reflectance: material.reflectance * texture,
            emitted: material.radiance,
            error: (baked.error.points > 0).then(|| baked.triangle_errors[triangle as usize]),
        }
    }

    /// What leaves the surface, ρE + π·Ke, W·m⁻².
    pub fn radiosity(&self) -> Rgb {
        self.reflectance * self.irradiance + self.emitted * PI
    }

    /// Illuminance, lx.
    pub fn illuminance(&self) -> f64 {
        LUMINOUS_EFFICACY * luminance(self.irradiance)
    }

    /// Photometric luminance, cd·m⁻².
    pub fn luminance(&self) -> f64 {
        LUMINOUS_EFFICACY * luminance(self.radiosity()) / PI
    }

    /// The reading in a line.
    pub fn sentence(&self) -> String {
        format!(
            "{:.5} lx at {}: {}, irradiance {} W/m², luminance {:.4} cd/m²",
            Number(self.illuminance()),
            place(self.position, 5, ","),
            self.material,
            colour(self.irradiance),
            Number(self.luminance())
        )
    }
}

/// The strongest of the sources of a light, which are in order, in a line.
pub(crate) fn sources_sentence(sources: &[LightSource]) -> String {
    let total: f64 = sources.iter().map(|source| luminance(source.irradiance)).sum();
    let share = |source: &LightSource| 100.0 * luminance(source.irradiance) / total.max(f64::MIN_POSITIVE);
    let named = sources.iter().take(NAMED).map(|source| format!("{:.1} % {}", share(source), source.name));
    format!("{} sources: {}", sources.len(), named.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{
        Frame, Mode, draw_on_cpu,
        test_room::{camera, room, textured_room},
    };

    #[test]
    fn nothing_is_read_where_nothing_is_seen() {
        let empty = Baked::default();
        assert_eq!(Reading::at(&empty, &Twin::new(&empty), &camera(), DVec2::splat(10.0), (64, 48)), None);
        let room = room();
        let outside = Camera { eye: DVec3::new(-9.0, 1.6, 1.3), ..camera() };
        assert_eq!(Reading::at(&room, &Twin::new(&room), &outside, DVec2::new(32.0, 24.0), (64, 48)), None);
    }

    #[test]
    fn sources_are_named_with_their_shares() {
        let source = |name: &str, light: f64| LightSource {
            name: name.into(),
            emits: true,
            irradiance: Rgb::splat(light),
            middle: None,
            blockers: Vec::new(),
        };
        assert_eq!(sources_sentence(&[]), "0 sources: ");
        let sources = [source("lamp", 3.0), source("wall", 1.0)];
        assert_eq!(sources_sentence(&sources), "2 sources: 75.0 % lamp, 25.0 % wall");
    }

    /// The luminance that is read is that of the picture.
    #[test]
    fn what_is_read_is_what_is_seen() {
        for room in [room(), textured_room()] {
            let twin = Twin::new(&room);
            let frame = Frame {
                camera: camera(),
                width: 64,
                height: 48,
                mode: Mode::Shaded,
                exposure: None,
                curve: Default::default(),
            };
            let picture = draw_on_cpu(&room, &frame);
            for (x, y) in [(3u32, 4u32), (32, 24), (60, 40), (10, 45)] {
                let place = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let reading = Reading::at(&room, &twin, &camera(), place, (64, 48)).unwrap();
                let seen = picture.radiance[(y * 64 + x) as usize].as_dvec3();
                let read = reading.radiosity() / PI;
                assert!((seen - read).length() < 1e-3 * (0.1 + read.length()), "{seen} {read}");
                assert!((reading.luminance() - 179.0 * luminance(seen)).abs() < 0.5, "{}", reading.luminance());
                assert_eq!(reading.error, None, "the room was not measured");
                assert!(reading.sentence().contains(" lx at "), "{}", reading.sentence());
            }
        }
    }
}
