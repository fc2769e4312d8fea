//! A sky that turns, frame by frame, and how far predicted visibility strays from full tracing: whether pixels pop.
//!
//! `cargo bench --bench turning_sky` prints a page for data/record/.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common;
#[allow(unused_imports, reason = "scenes under the sky alone")]
#[path = "common/generated/mod.rs"]
mod generated;

use std::f64::consts::TAU;

use glam::Vec3;
use renderer::{EnvironmentLights, Eye, SkyIllumination, SkySampling, Visibility, sky_picture};
use scene::{Bvh, CieSky, Display, Environment, Exposure, LatLongMap, Scene, Sky, ToneCurve, UpAxis, encode_srgb};

/// Side of a picture, pixels.
const SIDE: u32 = 513;

/// Frames of one turn.
const FRAMES: u32 = 60;

/// Columns and rows of the sky's map.
const MAP: (u32, u32) = (512, 256);

/// Steps of a display up to which a pixel is not off.
const STEPS: u8 = 2;

fn main() {
    println!("# A sky that turns\n");
    println!("{}", common::machine());
    println!("Command: `cargo bench --bench turning_sky`, {}.\n", env!("CARGO_PKG_VERSION"));
    println!(
        "{FRAMES} frames of {SIDE} × {SIDE} pixels under a clear sky without a sun (CIE 12, as a map) that turns once, by `gnu`. A pixel is"
    );
    println!("off where it is more than {STEPS} steps of 255 from full tracing with the same lights.\n");
    println!("| scene | lights | rays traced | pixels off, mean | pixels off, worst frame |");
    println!("|---|---|---|---|---|");
    for (name, scene) in [("shapes", generated::shapes(64)), ("plant", generated::plant(60))] {
        for lights in [100, 200] {
            row(name, &scene, lights);
        }
    }
}

/// Prints what the frames of a scene are off by.
fn row(name: &str, scene: &Scene, count: u32) {
    let (_, gnu) = Visibility::NAMED.into_iter().find(|(known, _)| *known == "gnu").unwrap();
    let bvh = Bvh::of_scene(scene);
    let eye = Eye::new(scene, &bvh, scene.cameras[0].camera, SIDE, SIDE);
    let sky = Sky::Cie(CieSky::new(12, [2.2, 0.7], 0.0).unwrap());
    let mut environment = Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
    environment.sky = Sky::Map(map(&environment));
    let (mut worst, mut sum, mut rays, mut pairs) = (0, 0, 0, 0);
    for frame in 0..FRAMES {
        environment.rotation = f64::from(frame) / f64::from(FRAMES) * TAU;
        let lights = EnvironmentLights::new(&environment, count, SkySampling::Structured).unwrap();
        let light = SkyIllumination::direct(&environment, &lights);
        let made = sky_picture(&eye, light, gnu, false);
        let truth = shown(&sky_picture(&eye, light, Visibility::Full, false).radiance);
        let is_off = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > STEPS);
        let off = shown(&made.radiance).iter().zip(&truth).filter(|&pair| is_off(pair)).count();
        worst = worst.max(off);
        sum += off;
        rays += made.rays;
        pairs += made.pairs;
    }
    let share = |count: f64| 100.0 * count / f64::from(SIDE * SIDE);
    println!(
        "| {name} | {count} | {:.1} % | {:.3} % | {:.3} % |",
        100.0 * rays as f64 / pairs as f64,
        share(sum as f64 / f64::from(FRAMES)),
        share(worst as f64)
    );
}

/// A sky as a map.
fn map(environment: &Environment) -> LatLongMap {
    let (width, height) = MAP;
    let place = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
    let texel = |i: u32| environment.radiance_at(place(i % width, width), place(i / width, height)).as_vec3();
    LatLongMap { width, height, texels: (0..width * height).map(texel).collect() }
}

/// As a display has it, with zenith and floor in its middle range.
fn shown(radiance: &[Vec3]) -> Vec<[u8; 3]> {
    let display = Display::new(Exposure { ev: -1.0 }, ToneCurve::Linear);
    let byte = |light: f32| (encode_srgb(light) * 255.0 + 0.5) as u8;
    radiance.iter().map(|&radiance| display.light(radiance).to_array().map(byte)).collect()
}
