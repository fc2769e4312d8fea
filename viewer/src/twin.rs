//! The frame on the host: every pass's twin, function for function, so that a picture needs no graphics driver.
//!
//! Rays through the bake's hierarchy fill the visibility buffer instead of a rasteriser; from there on the arithmetic is
//! that of the shaders, in f32, on the same records.

use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use scene::{Baked, Bvh, Camera, Exposure, encode_srgb, luminance};

use crate::{
    Frame, Mode, Picture,
    false_color::false_color,
    frame::{FrameUniform, NEAR},
    records::{Corners, Records, TriangleRecord},
    sky_records::sky_along,
    texture_records::texture_colour,
    timing::{FrameTimes, Stopwatch},
    visibility_pass::BACK,
};

/// Rows and columns of the grid that the light of a picture is metered on: enough that a lamp or a dark doorway moves
/// the exposure smoothly, few enough to be traced between two frames.
const METER_GRID: u32 = 32;

/// Draws a picture of a bake on the CPU, on all of rayon's threads; the result does not depend on their number.
///
/// Agrees with [`crate::draw_on_gpu`] to 1/255, but for single pixels on silhouettes. A size of 0 gives an empty picture,
/// and a camera that is not valid sees background alone.
pub fn draw_on_cpu(baked: &Baked, frame: &Frame) -> Picture {
    Twin::new(baked).draw(frame)
}

/// A bake as the host sees it: for drawing many pictures without an adapter.
pub struct Twin {
    pub(crate) records: Arc<Records>,
    pub(crate) bvh: Bvh,
}

/// One pixel of the visibility buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// The triangle's id plus one with [`BACK`] where its back is seen, 0 for nothing.
    pub id: u32,
    /// Barycentrics.
    pub s: f32,
    pub t: f32,
}

impl Twin {
    /// A bake that validates.
    pub fn new(baked: &Baked) -> Self {
        let (records, bvh) = rayon::join(|| Records::of(baked), || baked.bvh());
        Self { records: Arc::new(records), bvh }
    }

    /// Draws a picture, as [`draw_on_cpu`] does.
    pub fn draw(&self, frame: &Frame) -> Picture {
        self.draw_timed(frame).0
    }

    /// Draws a picture, and says what its passes took.
    pub fn draw_timed(&self, frame: &Frame) -> (Picture, FrameTimes) {
        let exposure = frame.exposure.unwrap_or_else(|| self.meter(frame));
        let mut watch = Stopwatch::start();
        let mut seen = vec![Seen::default(); frame.pixels()];
        let mut radiance = vec![Vec3::ZERO; frame.pixels()];
        let mut rgb = vec![[0; 3]; frame.pixels()];
        let mut parts_ms = Vec::new();
        if frame.pixels() > 0 && frame.camera.is_valid() {
            let uniform = FrameUniform::of(frame, exposure);
            let width = frame.width as usize;
            let place = |i: usize| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            seen.par_iter_mut()
                .enumerate()
                .for_each(|(i, seen)| *seen = self.visibility(&frame.camera, place(i), frame.width, frame.height));
            parts_ms.push(("visibility", watch.lap()));
            let colour = |(i, seen): (usize, &Seen)| self.records.colour(&uniform, frame.mode, *seen, place(i));
            seen.par_iter().enumerate().map(colour).collect_into_vec(&mut radiance);
            parts_ms.push(("interpolant", watch.lap()));
            radiance.par_iter().map(|&colour| tone_map(colour, frame, exposure)).collect_into_vec(&mut rgb);
            parts_ms.push(("tone_map", watch.lap()));
        }
        let background = seen.iter().filter(|seen| seen.id == 0).count() as u64;
        let times = FrameTimes { frame_ms: watch.total(), parts_ms };
        (Picture { width: frame.width, height: frame.height, radiance, rgb, background, exposure }, times)
    }

    /// The exposure of a view: metered on a grid over the surfaces that reflect light, because a lamp in the picture
    /// must not darken the room; on the lamps where nothing else is seen.
    pub fn meter(&self, &Frame { camera, width, height, mode, .. }: &Frame) -> Exposure {
        if !camera.is_valid() || width == 0 || height == 0 {
            return Exposure { ev: 0.0 };
        }
        let place = |i: u32, pixels: u32| (i as f32 + 0.5) * pixels as f32 / METER_GRID as f32;
        let seen: Vec<(bool, f64)> = (0..METER_GRID * METER_GRID)
            .into_par_iter()
            .filter_map(|i| {
                let place = Vec2::new(place(i % METER_GRID, width), place(i / METER_GRID, height));
                let Seen { id, s, t } = self.visibility(&camera, place, width, height);
                let front = id != 0 && id & BACK == 0;
                front.then(|| {
                    let record = &self.records.triangles[(id - 1) as usize];
                    let emits = record.emitted.iter().any(|&channel| channel > 0.0);
                    let radiance = match mode.is_of_white() {
                        true => light(record, s, t),
                        false => interpolant(record, self.records.texture(record, s, t), s, t),
                    };
                    (emits, luminance(radiance.as_dvec3()))
                })
            })
            .collect();
        let any_reflects = seen.iter().any(|&(emits, _)| !emits);
        Exposure::metered(seen.iter().filter(|(emits, _)| !any_reflects || !emits).map(|&(_, luminance)| luminance))
    }

    /// Passes (a) and (b): what a ray through a point of the picture meets beyond the near plane.
    pub(crate) fn visibility(&self, camera: &Camera, place: Vec2, width: u32, height: u32) -> Seen {
        let ray = camera.ray(DVec2::new(place.x.into(), place.y.into()), width, height);
        let (.., forward) = camera.basis();
        // Of a sheet its other side is seen from behind.
        let is_seen = |id: u32| {
            self.records.triangles[id as usize].is_sheet == 0 || {
                let [a, b, c] = self.records.corners[id as usize].map(|corner| Vec3::from(corner).as_dvec3());
                (b - a).cross(c - a).dot(ray.direction) < 0.0
            }
        };
        match self.bvh.closest_hit_beyond(&ray, NEAR / ray.direction.dot(forward), is_seen) {
            None => Seen::default(),
            Some(hit) => {
                let back = if hit.normal.dot(ray.direction) < 0.0 { 0 } else { BACK };
                Seen { id: (hit.id + 1) | back, s: hit.s as f32, t: hit.t as f32 }
            }
        }
    }
}

impl Records {
    /// The colour of a triangle's texture, 1 without one.
    fn texture(&self, record: &TriangleRecord, s: f32, t: f32) -> Vec3 {
        texture_colour(&self.textures, record.texture(), s, t)
    }

    /// What is seen past all triangles: the environment in pictures of light, and nothing in others.
    pub fn background(&self, frame: &FrameUniform, place: Vec2) -> Vec3 {
        if self.sky == 0 || frame.is_light == 0 {
            return Vec3::ZERO;
        }
        sky_along(&self.textures[self.sky as usize..], ray_through(frame, place))
    }

    /// Pass (c): the radiance or display-linear colour of a pixel.
    pub fn colour(&self, frame: &FrameUniform, mode: Mode, Seen { id, s, t }: Seen, place: Vec2) -> Vec3 {
        if id == 0 {
            return self.background(frame, place);
        }
        if id & BACK != 0 {
            return Vec3::ZERO;
        }
        let id = id - 1;
        let record = &self.triangles[id as usize];
        let texture = self.texture(record, s, t);
        let curve = frame.tone_curve();
        let exposed = |radiance: Vec3| (radiance * frame.exposure).map(|channel| curve.apply(channel));
        let overlay = |colour| overlay(colour, frame, mode, record, &self.corners[id as usize], place);
        match mode {
            Mode::Shaded => interpolant(record, texture, s, t),
            Mode::Gouraud => gouraud(record, texture, s, t),
            Mode::Ids => id_colour(id),
            Mode::Barycentrics => Vec3::new(s, t, 0.0),
            Mode::Elements => {
                let [r, g, b, _] = self.elements[record.element as usize];
                overlay(exposed(Vec3::new(r, g, b)))
            }
            Mode::Mesh => overlay(exposed(interpolant(record, texture, s, t))),
            Mode::Discontinuities => overlay(0.35 * exposed(interpolant(record, texture, s, t))),
            Mode::FalseColor => false_color(frame, record, &self.corners[id as usize], [s, t], place),
            Mode::Light => light(record, s, t) + Vec3::from(record.emitted),
            Mode::Split if place.x < 0.5 * frame.size[0] => gouraud(record, texture, s, t),
            Mode::Split => interpolant(record, texture, s, t),
        }
    }
}

/// The radiance of a white surface: the quadratic, clamped at 0, W·sr⁻¹·m⁻².
pub(crate) fn light(record: &TriangleRecord, s: f32, t: f32) -> Vec3 {
    let [a, b2, c2, d, e2, f] = [record.a, record.b2, record.c2, record.d, record.e2, record.f].map(Vec3::from);
    ((a * s + b2 * t + c2) * s + (d * t + e2) * t + f).max(Vec3::ZERO)
}

/// What the surface makes of the light, with the texture's colour, and what it emits, W·sr⁻¹·m⁻².
pub(crate) fn interpolant(record: &TriangleRecord, texture: Vec3, s: f32, t: f32) -> Vec3 {
    light(record, s, t) * Vec3::from(record.reflectance) * texture + Vec3::from(record.emitted)
}

/// Linear between the values at the corners: F, A + 2C + F and D + 2E + F.
fn gouraud(record: &TriangleRecord, texture: Vec3, s: f32, t: f32) -> Vec3 {
    let [a, c2, d, e2, f] = [record.a, record.c2, record.d, record.e2, record.f].map(Vec3::from);
    let light = ((a + c2) * s + (d + e2) * t + f).max(Vec3::ZERO);
    light * Vec3::from(record.reflectance) * texture + Vec3::from(record.emitted)
}

/// Where the ray through a place in the picture meets the plane of a triangle that faces the eye (Möller and Trumbore 1997).
pub(crate) fn barycentrics(frame: &FrameUniform, corners: &Corners, place: Vec2) -> [f32; 2] {
    let [a, b, c] = corners.map(Vec3::from);
    let (ab, ac, eye) = (b - a, c - a, Vec3::from(frame.eye) - a);
    let ray = ray_through(frame, place);
    [ac.cross(eye), eye.cross(ab)].map(|normal| normal.dot(ray) / ac.cross(ab).dot(ray).max(1e-30))
}

/// The direction, of any length, from the eye through a place in the picture.
fn ray_through(frame: &FrameUniform, place: Vec2) -> Vec3 {
    let [right, up, forward] = [frame.right, frame.up, frame.forward].map(Vec3::from);
    let [width, height] = frame.size;
    right * (place.x - 0.5 * width) + up * (0.5 * height - place.y) + forward * frame.focal
}

/// A colour that neighbouring ids do not share: the id hashed (Jarzynski and Olano 2020, "pcg").
fn id_colour(id: u32) -> Vec3 {
    let state = id.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    let hash = (word >> 22) ^ word;
    let channel = |shift: u32| 0.04 + 0.96 * ((hash >> shift) & 255) as f32 / 255.0;
    Vec3::new(channel(0), channel(8), channel(16))
}

/// Draws the edges of the pixel's triangle over a colour, anti-aliased.
fn overlay(
    colour: Vec3,
    frame: &FrameUniform,
    mode: Mode,
    record: &TriangleRecord,
    corners: &Corners,
    place: Vec2,
) -> Vec3 {
    let distances = edge_distances(frame, corners, place);
    (0..3).fold(colour, |drawn, edge| {
        let line = line_style(mode, (record.edges >> (10 * edge)) & 0x3ff);
        let coverage = (line.half_width + 0.5 - distances[edge as usize]).clamp(0.0, 1.0);
        drawn.lerp(line.colour, coverage * line.opacity)
    })
}

/// How an edge is drawn.
struct Line {
    colour: Vec3,
    opacity: f32,
    /// Pixels, on one side of the edge; the triangle on the other side draws the other half.
    half_width: f32,
}

fn line_style(mode: Mode, code: u32) -> Line {
    let line = |colour: [f32; 3], opacity, half_width| Line { colour: colour.into(), opacity, half_width };
    // The classes of `records.rs`.
    let class = code & 7;
    match mode {
        // Every edge; those inside a leaf thinner, so that the quadtree stands out.
        Mode::Mesh if class == 0 => line([0.0; 3], 0.6, 0.3),
        Mode::Mesh => line([0.0; 3], 0.9, 0.7),
        Mode::Elements => line([0.0; 3], if class == 1 || class == 2 { 0.7 } else { 0.0 }, 0.5),
        _ => {
            let strength = 0.3 + 0.7 * (code >> 3) as f32 / 127.0;
            match class {
                1 => line([0.5; 3], 0.35, 0.3),
                2 => line([1.0; 3], 0.9, 0.6),
                3 => line([1.0, 0.7, 0.05], strength, 0.9),
                4 => line([1.0, 0.1, 0.6], strength, 0.9),
                5 => line([0.05, 0.8, 1.0], strength, 0.9),
                _ => line([0.0; 3], 0.0, 0.0),
            }
        }
    }
}

/// Distances of a pixel from the lines that the triangle's edges 0→1, 1→2 and 2→0 make in the picture, in pixels.
/// The plane through the eye and an edge meets the picture plane in that line; no corner is divided by its depth, so
/// corners behind the eye do no harm.
fn edge_distances(frame: &FrameUniform, corners: &Corners, place: Vec2) -> [f32; 3] {
    let [width, height] = frame.size;
    let place = Vec3::new(place.x - 0.5 * width, 0.5 * height - place.y, frame.focal);
    let [eye, right, up, forward] = [frame.eye, frame.right, frame.up, frame.forward].map(Vec3::from);
    let [a, b, c] = corners.map(|corner| {
        let p = Vec3::from(corner) - eye;
        Vec3::new(p.dot(right), p.dot(up), p.dot(forward))
    });
    let distance = |from: Vec3, to: Vec3| {
        let normal = from.cross(to);
        normal.dot(place).abs() / normal.truncate().length().max(1e-30)
    };
    [distance(a, b), distance(b, c), distance(c, a)]
}

/// Pass (d): what a display shows.
fn tone_map(colour: Vec3, frame: &Frame, exposure: Exposure) -> [u8; 3] {
    let exposed = |channel: f32| frame.curve.apply(channel * exposure.factor());
    let shown = if frame.mode.is_light() { colour.map(exposed) } else { colour };
    shown.to_array().map(|channel| (encode_srgb(channel) * 255.0 + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::DVec3;
    use scene::ToneCurve;

    use super::*;
    use crate::test_room::{camera, room, room_of_sheets, room_under_sky};

    fn frame(mode: Mode) -> Frame {
        Frame { camera: camera(), width: 96, height: 64, mode, exposure: None, curve: ToneCurve::default() }
    }

    #[test]
    fn no_pixels_no_triangles_or_no_view_is_no_panic() {
        let empty = Baked::default();
        let picture = draw_on_cpu(&empty, &frame(Mode::Shaded));
        assert_eq!((picture.background, picture.exposure.ev), (96 * 64, 0.0));
        assert!(picture.rgb.iter().all(|&rgb| rgb == [0; 3]));
        let room = room();
        for (width, height) in [(0, 0), (0, 9), (9, 0)] {
            let picture = draw_on_cpu(&room, &Frame { width, height, ..frame(Mode::Mesh) });
            assert!(picture.rgb.is_empty() && picture.radiance.is_empty() && picture.background == 0);
        }
        let nowhere = Camera { target: camera().eye, ..camera() };
        assert_eq!(draw_on_cpu(&room, &Frame { camera: nowhere, ..frame(Mode::Shaded) }).background, 96 * 64);
    }

    #[test]
    fn a_closed_room_has_no_background_and_its_radiance_is_that_of_the_bake() {
        let room = room();
        let picture = draw_on_cpu(&room, &frame(Mode::Shaded));
        assert_eq!(picture.background, 0);
        let bvh = room.bvh();
        for (x, y) in [(0u32, 0u32), (47, 31), (95, 63), (10, 50)] {
            let ray = camera().ray(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5), 96, 64);
            let exact = room.radiance_along(&bvh, &ray).unwrap();
            let ours = picture.radiance[(y * 96 + x) as usize].as_dvec3();
            assert!((ours - exact).length() < 1e-4 * exact.length(), "{ours} {exact}");
        }
    }

    #[test]
    fn from_outside_the_back_sides_block_and_are_black() {
        let outside = Camera { eye: DVec3::new(-9.0, 1.6, 1.3), target: DVec3::new(2.0, 1.6, 1.3), ..camera() };
        for mode in Mode::ALL {
            let picture = draw_on_cpu(&room(), &Frame { camera: outside, ..frame(mode) });
            assert!(picture.background > 0 && picture.background < 96 * 64);
            assert!(picture.rgb.iter().all(|&rgb| rgb == [0; 3]));
        }
    }

    #[test]
    fn of_sheets_no_back_side_is_seen() {
        let twin = Twin::new(&room_of_sheets());
        for eye in [camera().eye, DVec3::new(-3.0, 1.6, 4.0)] {
            let camera = Camera { eye, ..camera() };
            let place = |i: usize| Vec2::new((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5);
            let seen: Vec<u32> = (0..96 * 64).map(|i| twin.visibility(&camera, place(i), 96, 64).id).collect();
            assert!(seen.iter().any(|&id| id != 0) && seen.iter().all(|&id| id & BACK == 0));
        }
    }

    /// In pictures of light, and at the exposure of the surfaces, or at none.
    #[test]
    fn past_all_triangles_the_environment_is_seen() {
        let outside = Camera { eye: DVec3::new(-1.5, -2.0, 5.0), ..camera() };
        let (room, dark) = (room_under_sky(), room());
        for mode in Mode::ALL {
            let frame = Frame { camera: outside, ..frame(mode) };
            let (picture, without) = (draw_on_cpu(&room, &frame), draw_on_cpu(&dark, &frame));
            assert_eq!((picture.background, picture.exposure), (without.background, without.exposure));
            assert!(picture.background > 0);
            let changed = picture.radiance.iter().zip(&without.radiance).filter(|(a, b)| a != b).count() as u64;
            assert_eq!(changed, if mode.is_light() { picture.background } else { 0 }, "{mode}");
        }
        let alone = Baked {
            scene: scene::Scene { environment: room.scene.environment, ..Default::default() },
            ..Baked::default()
        };
        let picture = draw_on_cpu(&alone, &frame(Mode::Shaded));
        let ray = camera().ray(DVec2::new(40.5, 20.5), 96, 64);
        let exact = alone.scene.environment.unwrap().seen(ray.direction);
        let ours = picture.radiance[20 * 96 + 40].as_dvec3();
        assert!((ours - exact).length() < 5e-3 * exact.length(), "{ours} {exact}");
        assert_eq!(picture.background, 96 * 64);
    }

    #[test]
    fn a_lamp_in_view_does_not_darken_the_room() {
        let mut room = room();
        let dim = Twin::new(&room).meter(&frame(Mode::Shaded));
        room.scene.materials[2].radiance *= 100.0;
        assert_eq!(Twin::new(&room).meter(&frame(Mode::Shaded)), dim);
        // Nothing but the lamp in view: then it is metered itself.
        let up =
            Camera { eye: DVec3::new(2.05, 1.65, 2.6), target: DVec3::new(2.05, 1.65, 2.7), up: DVec3::X, ..camera() };
        assert!(Twin::new(&room).meter(&Frame { camera: up, ..frame(Mode::Shaded) }).ev < -8.0);
    }

    /// Against the projection of the corners, which needs a division that the pass avoids.
    #[test]
    fn edge_distances_are_pixels() {
        let frame = frame(Mode::Mesh);
        let uniform = FrameUniform::of(&frame, Exposure { ev: 0.0 });
        let (right, up, forward) = frame.camera.basis();
        // Three points in the picture, pixels, at different depths.
        let pixels = [Vec2::new(20.0, 10.0), Vec2::new(80.0, 10.0), Vec2::new(20.0, 55.0)];
        let corners = std::array::from_fn(|i| {
            let depth = 1.0 + i as f64;
            let (x, y) = (f64::from(pixels[i].x) - 48.0, 32.0 - f64::from(pixels[i].y));
            let direction = (right * x + up * y) / f64::from(uniform.focal) + forward;
            (frame.camera.eye + direction * depth).as_vec3().to_array()
        });
        let [top, hypotenuse, left] = edge_distances(&uniform, &corners, Vec2::new(23.0, 14.0));
        assert!((top - 4.0).abs() < 1e-3 && (left - 3.0).abs() < 1e-3, "{top} {left}");
        let normal = Vec2::new(45.0, 60.0).normalize();
        assert!((hypotenuse - (pixels[1] - Vec2::new(23.0, 14.0)).dot(normal)).abs() < 1e-3);
    }
}
