//! Light straight from the emitters: one sample of the irradiance they give a point (next-event estimation).

use glam::DVec3;
use scene::Rgb;

use crate::{
    spherical_triangle::SphericalTriangle,
    surface::{Receiver, Surfaces},
};

/// The emitting triangles of a scene.
pub(crate) struct Emitters {
    triangles: Vec<EmitterTriangle>,
}

struct EmitterTriangle {
    polygon: u32,
    corners: [DVec3; 3],
    radiance: Rgb,
}

/// What a point sees of every emitter before occlusion; room that is used again from point to point.
#[derive(Default)]
pub(crate) struct SeenEmitters {
    seen: Vec<Seen>,
    total: f64,
}

struct Seen {
    /// Index of the emitting triangle.
    triangle: u32,
    shape: SphericalTriangle,
    /// Radiance of the emitter, summed over colours, times solid angle.
    weight: f64,
}

impl SeenEmitters {
    /// An emitter chosen by weight, and the place of `u` within the emitter's share, which is uniform in 0..1 again.
    fn choose(&self, u: f64) -> Option<(&Seen, f64)> {
        let mut rest = u * self.total;
        for emitter in &self.seen {
            if rest < emitter.weight {
                return Some((emitter, rest / emitter.weight));
            }
            rest -= emitter.weight;
        }
        None
    }
}

impl Emitters {
    pub fn new(surfaces: &Surfaces<'_>) -> Self {
        let scene = surfaces.scene;
        let mut triangles = Vec::new();
        for polygon in scene.emitters() {
            let outline = scene.outline(polygon);
            let radiance = scene.material(polygon).radiance;
            let corners = outline[1..].windows(2).map(|pair| [outline[0], pair[0], pair[1]]);
            triangles.extend(corners.map(|corners| EmitterTriangle { polygon, corners, radiance }));
        }
        Self { triangles }
    }

    /// Lists the emitters whose front a receiver may see, with the weights by which one is chosen: radiance × solid
    /// angle, so that no sample is larger than the sum of the weights. This is linear in the number of emitters.
    pub fn seen_from(&self, surfaces: &Surfaces<'_>, receiver: &Receiver, into: &mut SeenEmitters) {
        into.seen.clear();
        into.total = 0.0;
        for (index, triangle) in (0..).zip(&self.triangles) {
            let in_front = surfaces.plane(triangle.polygon).distance(receiver.position) > surfaces.rounding;
            let rises = |normal: DVec3| triangle.corners.iter().any(|&c| normal.dot(c - receiver.position) > 0.0);
            let above = rises(receiver.normal) && rises(receiver.cosine);
            if !in_front || !above || surfaces.is_on(receiver, triangle.polygon) {
                continue;
            }
            let shape = SphericalTriangle::seen_from(receiver.position, triangle.corners);
            let weight = triangle.radiance.element_sum() * shape.solid_angle;
            if weight > 0.0 {
                into.total += weight;
                into.seen.push(Seen { triangle: index, shape, weight });
            }
        }
    }

    /// One sample of the direct irradiance at a receiver, W·m⁻², from two uniform numbers in 0..1: an emitter chosen
    /// by weight, a direction into it chosen evenly, and whether anything stands between.
    pub fn irradiance(&self, surfaces: &Surfaces<'_>, receiver: &Receiver, seen: &SeenEmitters, uv: [f64; 2]) -> Rgb {
        let Some((emitter, place)) = seen.choose(uv[0]) else { return Rgb::ZERO };
        let Some(direction) = emitter.shape.sample(place, uv[1]) else { return Rgb::ZERO };
        let triangle = &self.triangles[emitter.triangle as usize];
        let plane = surfaces.plane(triangle.polygon);
        let cosine = receiver.cosine_to(direction);
        let distance = -plane.distance(receiver.position) / plane.normal.dot(direction);
        if cosine <= 0.0 || !distance.is_finite() || distance <= 0.0 {
            return Rgb::ZERO;
        }
        let target = receiver.position + direction * distance;
        if surfaces.is_blocked(receiver, target, triangle.polygon) {
            return Rgb::ZERO;
        }
        let probability = emitter.weight / seen.total;
        triangle.radiance * (cosine * emitter.shape.solid_angle / probability)
    }
}
