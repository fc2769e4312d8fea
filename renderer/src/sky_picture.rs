//! Pictures of scenes under a sky: direct light of many lights that are far away, reflected diffusely, and what a bake knows of
//! other light.
//!
//! A picture is made in blocks of 64 × 64 pixels that know nothing of each other, so that what is kept of visibility fits in a
//! cache: one bit a light and pixel. A block looks at the first row and column of the next ones too, which costs 3 % of the
//! pixels twice and no more rays than others; the paper traces them in full.

use std::f64::consts::PI;
use std::time::Instant;

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use scene::{Environment, Rgb};

use crate::coherent_visibility::{BlockVisibility, Place, Visibility, block_visibility};
use crate::environment_lights::EnvironmentLights;
use crate::eye::{Eye, SeenPoint, Sight};
use crate::light_set::{members, words};
use crate::surface::SurfacePoint;

/// Side of a block, pixels: the paper's. Larger ones look at fewer pixels twice, and keep fewer threads busy.
const BLOCK: u32 = 64;

/// A picture and what it took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkyPicture {
    /// Radiance, row by row, W·sr⁻¹·m⁻².
    pub radiance: Vec<Vec3>,
    /// Shadow rays traced, by pixel.
    pub traced: Vec<u32>,
    /// The words of a set of lights for each pixel, row by row: bit i of word j is set where light 64·j + i is seen. Empty if
    /// they were not asked for.
    pub seen: Vec<u64>,
    /// Pairs of a pixel and a light above its horizon: the shadow rays of full tracing.
    pub pairs: u64,
    /// Shadow rays traced, those at the borders of blocks with them.
    pub rays: u64,
    /// What the stages took.
    pub seconds: SkySeconds,
}

/// What the stages of a picture took, seconds of all threads together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SkySeconds {
    /// Rays from the eye.
    pub primary: f64,
    /// Which lights are seen.
    pub visibility: f64,
    /// The light that is reflected.
    pub shading: f64,
}

/// The part of a picture that one block makes.
struct Block {
    /// Column and row of the first pixel, and how many of both.
    corner: [u32; 2],
    size: [u32; 2],
    made: SkyPicture,
}

/// What lights a picture.
#[derive(Clone, Copy)]
pub struct SkyIllumination<'a> {
    /// What is seen past all surfaces.
    pub environment: &'a Environment,
    /// The lights that stand for it on surfaces.
    pub lights: &'a EnvironmentLights,
    /// Irradiance at a point of a surface that the environment does not send straight there, W·m⁻²: of a bake.
    pub elsewhere: &'a (dyn Fn(&SurfacePoint) -> Rgb + Sync),
}

impl<'a> SkyIllumination<'a> {
    /// Light of the environment alone.
    pub fn direct(environment: &'a Environment, lights: &'a EnvironmentLights) -> Self {
        Self { environment, lights, elsewhere: &|_| Rgb::ZERO }
    }
}

/// Makes a picture of what an eye sees under an environment. `keeps_seen` asks for the
/// visibility of every light at every pixel, one bit each. The bytes do not depend on the number of threads.
pub fn sky_picture(
    eye: &Eye<'_>,
    illumination: SkyIllumination<'_>,
    visibility: Visibility,
    keeps_seen: bool,
) -> SkyPicture {
    let [width, height] = eye.size();
    let across = width.div_ceil(BLOCK);
    let block = |i: u32| {
        let corner = [i % across * BLOCK, i / across * BLOCK];
        block(eye, illumination, corner, visibility, keeps_seen)
    };
    let blocks: Vec<Block> = (0..across * height.div_ceil(BLOCK)).into_par_iter().map(block).collect();
    let pixels = width as usize * height as usize;
    let words = if keeps_seen { words(illumination.lights.directions.len()) } else { 0 };
    let mut picture = SkyPicture {
        radiance: vec![Vec3::ZERO; pixels],
        traced: vec![0; pixels],
        seen: vec![0; pixels * words],
        ..SkyPicture::default()
    };
    for Block { corner: [left, top], size: [columns, rows], made } in blocks {
        for row in 0..rows {
            let from = (row * columns) as usize..((row + 1) * columns) as usize;
            let to = (top + row) as usize * width as usize + left as usize;
            let to = to..to + columns as usize;
            picture.radiance[to.clone()].copy_from_slice(&made.radiance[from.clone()]);
            picture.traced[to.clone()].copy_from_slice(&made.traced[from.clone()]);
            let of_words = |range: std::ops::Range<usize>| range.start * words..range.end * words;
            picture.seen[of_words(to)].copy_from_slice(&made.seen[of_words(from)]);
        }
        picture.pairs += made.pairs;
        picture.rays += made.rays;
        picture.seconds.primary += made.seconds.primary;
        picture.seconds.visibility += made.seconds.visibility;
        picture.seconds.shading += made.seconds.shading;
    }
    picture
}

fn block(
    eye: &Eye<'_>,
    SkyIllumination { environment, lights, elsewhere }: SkyIllumination<'_>,
    [left, top]: [u32; 2],
    visibility: Visibility,
    keeps_seen: bool,
) -> Block {
    let [width, height] = eye.size();
    let size = [(width - left).min(BLOCK), (height - top).min(BLOCK)];
    // With the first column and row of the next blocks.
    let (columns, rows) = ((width - left).min(BLOCK + 1) as usize, (height - top).min(BLOCK + 1) as usize);
    let mut seconds = SkySeconds::default();

    let start = Instant::now();
    let ray = |i: usize| {
        let at = |first: u32, i: usize| f64::from(first) + i as f64 + 0.5;
        eye.ray(DVec2::new(at(left, i % columns), at(top, i / columns)))
    };
    let sights: Vec<Sight> = (0..columns * rows).map(|i| eye.look(&ray(i))).collect();
    let place = |sight: &Sight| match sight {
        Sight::Front(seen) if reflectance(eye, seen) != Rgb::ZERO => {
            Some(Place { receiver: eye.surfaces.looked_at(&seen.point), object: seen.object })
        }
        _ => None,
    };
    let places: Vec<Option<Place>> = sights.iter().map(place).collect();
    seconds.primary = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let found = block_visibility(&eye.surfaces, lights, (columns, rows), &places, visibility);
    seconds.visibility = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut made = SkyPicture { rays: found.traced.iter().map(|&rays| u64::from(rays)).sum(), ..SkyPicture::default() };
    let BlockVisibility { seen, traced, above } = found;
    let words = words(lights.directions.len());
    for i in (0..size[1] as usize).flat_map(|row| row * columns..row * columns + size[0] as usize) {
        let seen = &seen[i * words..][..words];
        let radiance = match (&sights[i], places[i]) {
            (Sight::Background, _) => environment.seen(ray(i).direction),
            (Sight::Back(_), _) => Rgb::ZERO,
            (Sight::Front(front), None) => eye.scene().material(front.point.polygon).radiance,
            (Sight::Front(front), Some(place)) => {
                let light = |light: u32| {
                    let light = light as usize;
                    lights.irradiance[light] * place.receiver.cosine.dot(lights.directions[light])
                };
                let irradiance = members(seen).map(light).sum::<Rgb>() + elsewhere(&front.point);
                reflectance(eye, front) * irradiance / PI + eye.scene().material(front.point.polygon).radiance
            }
        };
        made.radiance.push(radiance.as_vec3());
        made.traced.push(traced[i]);
        made.pairs += u64::from(above[i]);
        if keeps_seen {
            made.seen.extend_from_slice(seen);
        }
    }
    seconds.shading = start.elapsed().as_secs_f64();
    made.seconds = seconds;
    Block { corner: [left, top], size, made }
}

fn reflectance(eye: &Eye<'_>, seen: &SeenPoint) -> Rgb {
    eye.scene().material(seen.point.polygon).reflectance * seen.texture
}
