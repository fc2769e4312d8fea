//! Rows of the visibility buffer, span by span: what neighbouring pixels that see the same triangle share.
//!
//! Where the ray through a pixel meets the plane of a triangle is, in barycentrics, a quotient of numbers that are linear
//! along a row (Möller and Trumbore 1997): six dot products a span, and a division a pixel.

use glam::{DVec3, Vec2, Vec3};
use scene::Exposure;

use crate::{
    Frame, Mode,
    frame::FrameUniform,
    records::{Corners, Records, TriangleRecord},
    texture_records::TexturePlace,
    tone_table::ToneTable,
    twin::Seen,
    visibility_pass::BACK,
};

/// Pixels that are evaluated at a time: as many as a processor has numbers in a register everywhere. More waste what a short
/// span leaves over.
const LANES: usize = 4;

/// The least denominator: that of a triangle seen from its edge, which no pixel's centre meets.
const LEAST: f32 = 1e-30;

/// A frame, and the records that it shows.
pub(crate) struct Spans<'a> {
    records: &'a Records,
    mode: Mode,
    uniform: FrameUniform,
    eye: DVec3,
}

/// Barycentrics along a row, s·w and t·w and w: at the first pixel, and their change from pixel to pixel.
#[derive(Clone, Copy)]
struct Span {
    first: [f32; 3],
    change: [f32; 3],
}

impl Span {
    /// The barycentrics s and t so many pixels after the first.
    #[inline(always)]
    fn at(&self, pixels: f32) -> [f32; 2] {
        let [s, t, w] = [0, 1, 2].map(|i| self.first[i] + self.change[i] * pixels);
        let scale = 1.0 / w.max(LEAST);
        [(s * scale).clamp(0.0, 1.0), (t * scale).clamp(0.0, 1.0)]
    }
}

impl<'a> Spans<'a> {
    /// The rows of a frame whose camera is valid.
    pub fn new(records: &'a Records, frame: &Frame, exposure: Exposure) -> Self {
        Self { records, mode: frame.mode, uniform: FrameUniform::of(frame, exposure), eye: frame.camera.eye }
    }

    /// What a display shows of a row; where nothing is seen, `background`, or the environment with its fourth number.
    pub fn show(&self, y: usize, ids: &[u32], table: &ToneTable, background: [u8; 4], shown: &mut [[u8; 4]]) {
        let mut x = 0;
        for ids in ids.chunk_by(|a, b| a == b) {
            let shown = &mut shown[x..x + ids.len()];
            match ids[0] {
                0 if self.records.sky != 0 => self.show_sky([x, y], table, background[3], shown),
                0 => shown.fill(background),
                id if id & BACK != 0 => shown.fill([0, 0, 0, 255]),
                id => self.show_span(id - 1, [x, y], table, shown),
            }
            x += ids.len();
        }
    }

    /// The radiance or display-linear colour of every pixel of a row.
    pub fn colours(&self, y: usize, ids: &[u32]) -> impl Iterator<Item = Vec3> {
        ids.iter().enumerate().map(move |(x, &id)| {
            if id == 0 || id & BACK != 0 {
                return self.colour(Seen { id, ..Seen::default() }, [x, y]);
            }
            let [s, t] = self.span(&self.records.corners[id as usize - 1], [x, y]).at(0.0);
            self.colour(Seen { id, s, t }, [x, y])
        })
    }

    fn show_sky(&self, [x, y]: [usize; 2], table: &ToneTable, alpha: u8, shown: &mut [[u8; 4]]) {
        for (i, shown) in shown.iter_mut().enumerate() {
            let colour = self.colour(Seen::default(), [x + i, y]) * self.uniform.exposure;
            *shown = [table.shown(colour.x), table.shown(colour.y), table.shown(colour.z), alpha];
        }
    }

    fn show_span(&self, triangle: u32, [x, y]: [usize; 2], table: &ToneTable, shown: &mut [[u8; 4]]) {
        let record = &self.records.triangles[triangle as usize];
        let span = self.span(&self.records.corners[triangle as usize], [x, y]);
        if self.mode == Mode::Shaded && record.texture() == TexturePlace::default() {
            return show_light(record, span, self.uniform.exposure, table, shown);
        }
        let scale = if self.mode.is_light() { self.uniform.exposure } else { 1.0 };
        for (i, shown) in shown.iter_mut().enumerate() {
            let [s, t] = span.at(i as f32);
            let colour = self.colour(Seen { id: triangle + 1, s, t }, [x + i, y]) * scale;
            *shown = [table.shown(colour.x), table.shown(colour.y), table.shown(colour.z), 255];
        }
    }

    fn colour(&self, seen: Seen, [x, y]: [usize; 2]) -> Vec3 {
        let place = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        self.records.colour(&self.uniform, self.mode, seen, place)
    }

    /// The span that begins at a pixel and sees the front of a triangle.
    fn span(&self, corners: &Corners, [x, y]: [usize; 2]) -> Span {
        let [a, b, c] = corners.map(Vec3::from);
        let (ab, ac) = (b - a, c - a);
        // In f64: far from the origin f32 would move the eye against the triangle.
        let eye = (self.eye - a.as_dvec3()).as_vec3();
        let normals = [ac.cross(eye), eye.cross(ab), ac.cross(ab)];
        let FrameUniform { right, up, forward, focal, size: [width, height], .. } = self.uniform;
        let [right, up, forward] = [right, up, forward].map(Vec3::from);
        let (x, y) = (x as f32 + 0.5 - 0.5 * width, 0.5 * height - y as f32 - 0.5);
        let ray = right * x + up * y + forward * focal;
        Span { first: normals.map(|normal| normal.dot(ray)), change: normals.map(|normal| normal.dot(right)) }
    }
}

/// What a display shows of the light along a span: [`crate::twin::interpolant`], several pixels at a time, in loops that the
/// compiler turns into such of several numbers at once.
fn show_light(record: &TriangleRecord, span: Span, exposure: f32, table: &ToneTable, shown: &mut [[u8; 4]]) {
    for (chunk, shown) in shown.chunks_mut(LANES).enumerate() {
        let (mut s, mut t) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            [s[lane], t[lane]] = span.at((chunk * LANES + lane) as f32);
        }
        let mut places = [[0; LANES]; 3];
        for (k, places) in places.iter_mut().enumerate() {
            let [a, b2, c2, d] = [record.a[k], record.b2[k], record.c2[k], record.d[k]];
            let [e2, f, reflectance, emitted] = [record.e2[k], record.f[k], record.reflectance[k], record.emitted[k]];
            for (place, (s, t)) in places.iter_mut().zip(s.into_iter().zip(t)) {
                let light = (a * s + b2 * t + c2) * s + (d * t + e2) * t + f;
                *place = ToneTable::place((light.max(0.0) * reflectance + emitted) * exposure);
            }
        }
        for (lane, shown) in shown.iter_mut().enumerate() {
            *shown = [table.at(places[0][lane]), table.at(places[1][lane]), table.at(places[2][lane]), 255];
        }
    }
}

#[cfg(test)]
mod tests {
    use scene::ToneCurve;

    use super::*;
    use crate::{
        Picture,
        test_room::{camera, room, room_under_sky, textured_room},
        twin::Twin,
    };

    const SIZE: [usize; 2] = [61, 43];

    fn frame(mode: Mode) -> Frame {
        let [width, height] = SIZE.map(|side| side as u32);
        Frame { camera: camera(), width, height, mode, exposure: Some(Exposure { ev: -1.0 }), curve: ToneCurve::Filmic }
    }

    /// What the rays of the twin see, row by row.
    fn ids(twin: &Twin, frame: &Frame) -> Vec<Vec<u32>> {
        let place = |x, y| Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let id = |x, y| twin.visibility(&frame.camera, place(x, y), frame.width, frame.height).id;
        (0..SIZE[1]).map(|y| (0..SIZE[0]).map(|x| id(x, y)).collect()).collect()
    }

    fn shown(spans: &Spans<'_>, ids: &[Vec<u32>], table: &ToneTable) -> Vec<[u8; 4]> {
        let mut rows = vec![vec![[9; 4]; SIZE[0]]; SIZE[1]];
        for (y, row) in rows.iter_mut().enumerate() {
            spans.show(y, &ids[y], table, [1, 2, 3, 4], row);
        }
        rows.concat()
    }

    #[test]
    fn nothing_and_back_sides_need_no_triangles() {
        let records = Records::of(&scene::Baked::default());
        let spans = Spans::new(&records, &frame(Mode::Shaded), Exposure { ev: 0.0 });
        let table = ToneTable::new(|light| light);
        spans.show(0, &[], &table, [0; 4], &mut []);
        let mut shown = [[9; 4]; 3];
        spans.show(0, &[0, BACK | 7, 0], &table, [1, 2, 3, 4], &mut shown);
        assert_eq!(shown, [[1, 2, 3, 4], [0, 0, 0, 255], [1, 2, 3, 4]]);
        assert_eq!(spans.colours(0, &[0, BACK | 7]).collect::<Vec<_>>(), [Vec3::ZERO; 2]);
    }

    /// Pixel by pixel and several at a time, with texture and without: the twin's own light.
    #[test]
    fn every_mode_is_the_twins() {
        for room in [room(), textured_room()] {
            let twin = Twin::new(&room);
            for mode in Mode::ALL {
                let frame = frame(mode);
                let ids = ids(&twin, &frame);
                let spans = Spans::new(&twin.records, &frame, Exposure { ev: -1.0 });
                let Picture { radiance, rgb, .. } = twin.draw(&frame);
                let colours: Vec<Vec3> = (0..SIZE[1]).flat_map(|y| spans.colours(y, &ids[y])).collect();
                let error: f32 = colours.iter().zip(&radiance).map(|(ours, theirs)| (*ours - *theirs).length()).sum();
                assert!(error <= 1e-3 * radiance.iter().map(|colour| colour.length()).sum::<f32>(), "{mode}: {error}");
                let curve = |light| if mode.is_light() { frame.curve.apply(light) } else { light };
                let table = ToneTable::new(curve);
                let shown = shown(&spans, &ids, &table);
                let near = |(ours, theirs): (&[u8; 4], &[u8; 3])| (0..3).all(|i| ours[i].abs_diff(theirs[i]) <= 1);
                let agree = shown.iter().zip(&rgb).filter(|&pair| near(pair)).count();
                assert!(agree * 1000 >= rgb.len() * 999, "{mode}: {agree} of {} pixels", rgb.len());
            }
        }
    }

    /// By a row from outside, where nothing is seen.
    #[test]
    fn past_all_triangles_a_row_shows_the_environment() {
        let twin = Twin::new(&room_under_sky());
        for mode in [Mode::Shaded, Mode::Light, Mode::Ids] {
            let frame = frame(mode);
            let spans = Spans::new(&twin.records, &frame, Exposure { ev: -1.0 });
            let uniform = FrameUniform::of(&frame, Exposure { ev: -1.0 });
            let table = ToneTable::new(|light| light);
            let mut row = [[9; 4]; 61];
            spans.show(7, &[0; 61], &table, [1, 2, 3, 4], &mut row);
            for (x, (shown, colour)) in row.iter().zip(spans.colours(7, &[0; 61])).enumerate() {
                let sky = twin.records.background(&uniform, Vec2::new(x as f32 + 0.5, 7.5));
                assert_eq!((colour, sky != Vec3::ZERO), (sky, mode.is_light()));
                assert_eq!(*shown, [table.shown(sky.x / 2.0), table.shown(sky.y / 2.0), table.shown(sky.z / 2.0), 4]);
            }
        }
    }

    /// A small triangle far from the eye, and both far from the origin: against intersection in f64.
    #[test]
    fn barycentrics_survive_distance() {
        let far = DVec3::new(4096.0, -2048.0, 512.0);
        let camera = scene::Camera { eye: far, target: far + DVec3::X, up: DVec3::Z, vertical_fov: 0.002 };
        let frame = Frame { camera, ..frame(Mode::Barycentrics) };
        let corners = [[50.0, 0.04, -0.04], [50.0, -0.04, -0.04], [50.0, 0.0, 0.04]].map(|p| far + DVec3::from(p));
        let [a, b, c] = corners.map(|corner| corner.as_vec3().as_dvec3());
        let records = Records::of(&scene::Baked::default());
        let spans = Spans::new(&records, &frame, Exposure { ev: 0.0 });
        let span = spans.span(&corners.map(|corner| corner.as_vec3().to_array()), [20, 25]);
        for i in 0..20 {
            let ray = camera.ray(glam::DVec2::new(f64::from(i) + 20.5, 25.5), frame.width, frame.height);
            let normal = (b - a).cross(c - a);
            let point = ray.origin + ray.direction * ((a - ray.origin).dot(normal) / ray.direction.dot(normal));
            let part = |from: DVec3, to: DVec3| (from - point).cross(to - point).dot(normal) / normal.length_squared();
            let [s, t] = span.at(i as f32);
            let exact = [part(c, a), part(a, b)].map(|part| part.clamp(0.0, 1.0));
            assert!(
                (f64::from(s) - exact[0]).abs() < 1e-3 && (f64::from(t) - exact[1]).abs() < 1e-3,
                "{s} {t} {exact:?}"
            );
        }
    }
}
