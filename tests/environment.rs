//! Light from the sky: what is asked for comes as a picture or a clear word, and pictures are as bright as their sky.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use renderer::{Coherence, EnvironmentLights, Eye, SkyIllumination, SkyPicture, SkySampling, Visibility, sky_picture};
use scene::{Bvh, Display, Environment, Exposure, LatLongMap, Scene, Sky, ToneCurve, UpAxis, encode_srgb};
use serde_json::Value;

use crate::fixture::{box_faces, data, fails, folder, run, text, write_scene};
use crate::generated::{dominoes, plant, shapes};

/// Draws a picture; what `--json` printed.
fn render(scene: &Path, output: &Path, options: &[&str]) -> Value {
    let made = run(&[&["render", text(scene), "-o", text(output), "--json"], options].concat());
    serde_json::from_slice(&made.stdout).unwrap()
}

/// A box that reflects half, alone in the world.
fn half_box(folder: &Path) -> PathBuf {
    let faces = box_faces(DVec3::splat(-1.0), DVec3::ONE, false, &[0, 1, 2, 3, 4, 5]);
    let quads: Vec<_> = faces.into_iter().map(|face| (face, "half")).collect();
    write_scene(folder, "newmtl half\nKd 0.5 0.5 0.5\n", &quads)
}

fn named(name: &str) -> Visibility {
    Visibility::NAMED.into_iter().find(|(known, _)| *known == name).unwrap().1
}

/// A map of the shared folder beside the repository; none where it is absent.
#[expect(clippy::print_stderr, reason = "a test that does not look says so")]
fn shared_map(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/hdr").join(name).with_extension("hdr");
    if !path.exists() {
        eprintln!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn what_cannot_be_is_refused_by_the_name_of_its_flag() {
    let folder = folder();
    let (scene, picture) = (data("scenes/office.obj"), folder.path().join("out.png"));
    let said =
        |code: i32, options: &[&str]| fails(code, &[&["render", text(&scene), "-o", text(&picture)], options].concat());
    for options in [
        &["--environment", "cie:17"][..],
        &["--environment", "cie:0"],
        &["--environment", "cie:12", "--lights", "0"],
        &["--environment", "cie:12", "--visibility", "best"],
        &["--environment", "cie:12", "--sun", "100,91"],
        &["--environment", "cie:12", "--sky-scale", "0"],
        &["--environment", "cie:12", "--guessed", "1"],
        &["--environment", "cie:12", "--sampler", "full"],
        &["--environment", "cie:12", "--radiance", "path"],
        &["--environment", "sky.exr", "--sun", "100,20"],
        &["--lights", "100"],
    ] {
        assert!(said(2, options).contains(options[options.len() - 2]), "{options:?}");
    }
    assert!(said(2, &["--environment", "cie:5", "--visibility", "full", "--brightest", "9"]).contains("--brightest"));
    assert!(said(1, &["--environment", "nothing.exr"]).contains("nothing.exr: cannot be read"));
    assert!(said(1, &["--environment", "sky.jpg"]).contains("cie:1 to cie:16"));
    let black = folder.path().join("black.exr");
    formats::write_exr(&black, 2, 1, &[Vec3::ZERO; 2]).unwrap();
    assert!(said(1, &["--environment", text(&black)]).contains("all black"));
    assert!(!picture.exists());
}

/// Odd maps are used, and what is odd is said.
#[test]
fn odd_maps_are_told_of() {
    let folder = folder();
    let (scene, picture, map) = (half_box(folder.path()), folder.path().join("out.png"), folder.path().join("sky.exr"));
    let mut texels = vec![Vec3::ZERO; 300 * 100];
    texels[40 * 300 + 20] = Vec3::ONE;
    texels[20 * 300 + 200] = Vec3::new(1.0, f32::NAN, f32::INFINITY);
    texels[60 * 300 + 100] = Vec3::splat(-1.0);
    formats::write_exr(&map, 300, 100, &texels).unwrap();
    let free = ["--eye", "4,-5,3", "--target", "0,0,0", "--size", "20x20"];
    let arguments = ["render", text(&scene), "-o", text(&picture), "--environment", text(&map)];
    let made = run(&[&arguments[..], &free].concat());
    let said = String::from_utf8(made.stderr).unwrap();
    for word in ["2 of 30000 texels", "300 × 100", "--lights 200: only"] {
        assert!(said.contains(word), "{said}");
    }
}

/// A box that reflects half of a sky of 1 sends 0.5 on every side, to 0.1 %. (Of a white one the importer makes a reflectance
/// of 0.999.)
#[test]
fn a_white_furnace_is_white() {
    let folder = folder();
    let (scene, picture, map) = (half_box(folder.path()), folder.path().join("out.exr"), folder.path().join("sky.exr"));
    formats::write_exr(&map, 1, 1, &[Vec3::ONE]).unwrap();
    for eye in ["4,-5,3", "-3,5,-4"] {
        for sampling in ["structured", "equal"] {
            let options = [
                "--environment",
                text(&map),
                "--lights",
                "1000",
                "--sky-sampling",
                sampling,
                "--eye",
                eye,
                "--target",
                "0,0,0",
            ];
            render(&scene, &picture, &[&options[..], &["--size", "60x60", "--sky-up", "y"]].concat());
            let (_, _, pixels) = formats::read_exr(&picture).unwrap();
            let is_sky = |pixel: &&Vec3| **pixel == Vec3::ONE;
            let off = |pixel: &Vec3| (*pixel / 0.5 - Vec3::ONE).abs().max_element();
            let sky = pixels.iter().filter(is_sky).count();
            assert!((300..3300).contains(&sky), "{sky} pixels see the sky");
            let off = pixels.iter().filter(|pixel| !is_sky(pixel)).map(off).fold(0.0, f32::max);
            assert!(off < 1e-3, "{eye}, {sampling}: {off}");
        }
    }
}

#[test]
fn what_was_done_is_told() {
    let folder = folder();
    let (scene, picture) = (data("scenes/lamp.obj"), folder.path().join("out.png"));
    let (rays, sky) = (folder.path().join("rays.png"), folder.path().join("sky.png"));
    let common = ["--environment", "cie:12", "--sun", "120,40", "--sun-irradiance", "3", "--size", "100x81", "--check"];
    let options =
        |way| [&common[..], &["--visibility", way, "--ray-map", text(&rays), "--sky-picture", text(&sky)]].concat();
    let full = render(&scene, &picture, &options("full"));
    assert_eq!(
        (full["shadow_rays"].as_u64() > full["full_shadow_rays"].as_u64(), full["lights"].as_u64()),
        (true, Some(200))
    );
    assert_eq!(full["mispredicted_share"].as_f64(), Some(0.0));
    for way in ["gnu", "opt", "swb", "gwu"] {
        let made = render(&scene, &picture, &options(way));
        let share = made["shadow_rays_share"].as_f64().unwrap();
        assert!((0.01..0.9).contains(&share), "{way}: {share}");
        assert!(made["mispredicted_share"].as_f64().unwrap() < 0.01, "{way}: {made}");
        for stage in ["primary", "visibility", "shading"] {
            assert!(made["seconds"][stage].as_f64().unwrap() > 0.0);
        }
    }
    assert_eq!(formats::read_png(&rays).unwrap().2.len(), 8100);
    assert_eq!(formats::read_png(&sky).unwrap().2.len(), 1024 * 512);
}

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let scene = shapes(24);
    let (bvh, environment) = (Bvh::of_scene(&scene), cie(12));
    let picture = |threads: usize, visibility: Visibility| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let lights = EnvironmentLights::new(&environment, 60, SkySampling::Structured).unwrap();
            let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, 150, 131);
            let made = sky_picture(&eye, SkyIllumination::direct(&environment, &lights), visibility, true);
            (made.radiance, made.traced, made.seen, made.rays, made.pairs)
        })
    };
    for name in ["full", "opt", "gwu", "swb"] {
        assert!(picture(1, named(name)) == picture(3, named(name)), "{name}");
    }
}

fn cie(kind: u8) -> Environment {
    let sky = Sky::Cie(scene::CieSky::new(kind, [2.2, 0.7], 0.0).unwrap());
    Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 }
}

/// What the grid's variants predict wrong, at an eighth of the paper's pixels.
#[test]
fn predictions_are_seldom_wrong() {
    for (scene, most_rays, most_wrong) in [(shapes(48), 0.35, 1e-3), (dominoes(36), 0.5, 2e-3), (plant(30), 0.5, 3e-3)]
    {
        let (bvh, environment) = (Bvh::of_scene(&scene), cie(12));
        let lights = EnvironmentLights::new(&environment, 64, SkySampling::Structured).unwrap();
        let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, 181, 181);
        let made = |name: &str| sky_picture(&eye, SkyIllumination::direct(&environment, &lights), named(name), true);
        let truth = made("full");
        for name in ["gwb", "gnb", "gwu", "gnu", "gnu-restricted", "gnu-unflooded", "opt", "gnu-borders", "opt-borders"]
        {
            let picture = made(name);
            let wrong: u64 = picture.seen.iter().zip(&truth.seen).map(|(a, b)| u64::from((a ^ b).count_ones())).sum();
            let share = |count: u64| count as f64 / truth.pairs as f64;
            assert!(name.ends_with('b') || share(picture.rays) < most_rays, "{name}: {}", share(picture.rays));
            assert!(share(wrong) < if name.ends_with('b') { 1e-2 } else { most_wrong }, "{name}: {}", share(wrong));
        }
    }
}

/// More rays for the brightest lights, and fewer where light may be guessed, which strays no further than was allowed.
#[test]
fn rays_go_where_they_are_wanted() {
    let scene = shapes(48);
    let (bvh, environment) = (Bvh::of_scene(&scene), cie(12));
    let lights = EnvironmentLights::new(&environment, 100, SkySampling::Structured).unwrap();
    let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, 129, 129);
    let Visibility::Coherent(opt) = named("opt") else { unreachable!("it predicts") };
    let made = |coherence| {
        sky_picture(&eye, SkyIllumination::direct(&environment, &lights), Visibility::Coherent(coherence), true)
    };
    let (plain, bright) = (made(opt), made(Coherence { brightest: 16, ..opt }));
    assert!(bright.rays > plain.rays);
    let truth = sky_picture(&eye, SkyIllumination::direct(&environment, &lights), Visibility::Full, true);
    let off = |picture: &SkyPicture| {
        let pairs = picture.radiance.iter().zip(&truth.radiance);
        pairs.map(|(a, b)| f64::from((*a - *b).abs().element_sum())).sum::<f64>()
    };
    let all: f64 = truth.radiance.iter().map(|pixel| f64::from(pixel.element_sum())).sum();
    for error in [0.005, 0.02] {
        let guessed = made(Coherence { error, ..opt });
        assert!(guessed.rays < plain.rays);
        assert!(off(&guessed) < off(&plain) + 1.5 * error * all, "{error}: {} of {all}", off(&guessed));
    }
}

/// A sky that turns, frame by frame: nowhere do pixels pop.
#[test]
fn a_sky_that_turns_does_not_flicker() {
    let scene = shapes(48);
    let bvh = Bvh::of_scene(&scene);
    let (width, height, frames) = (256, 128, 60);
    let place = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
    let texel = |i: u32| cie(12).radiance_at(place(i % width, width), place(i / width, height)).as_vec3();
    let map = LatLongMap { width, height, texels: (0..width * height).map(texel).collect() };
    let mut environment = Environment { sky: Sky::Map(map), ..cie(12) };
    for frame in 0..frames {
        environment.rotation = f64::from(frame) / f64::from(frames) * std::f64::consts::TAU;
        let lights = EnvironmentLights::new(&environment, 200, SkySampling::Structured).unwrap();
        let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, 129, 129);
        let [made, truth] = ["gnu", "full"].map(|name| {
            shown(&sky_picture(&eye, SkyIllumination::direct(&environment, &lights), named(name), false).radiance)
        });
        let off = made.iter().zip(&truth).filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2)).count();
        assert!(off * 1000 <= made.len(), "frame {frame}: {off} of {} pixels", made.len());
    }
}

/// As a display has it, with zenith and floor in its middle range.
fn shown(radiance: &[Vec3]) -> Vec<[u8; 3]> {
    let display = Display::new(Exposure { ev: -1.0 }, ToneCurve::Linear);
    let byte = |light: f32| (encode_srgb(light) * 255.0 + 0.5) as u8;
    radiance.iter().map(|&radiance| display.light(radiance).to_array().map(byte)).collect()
}

/// Photographed skies: what 200 lights send to unobstructed surfaces of all normals is what the map sends.
#[test]
fn photographed_skies_are_as_bright_as_their_maps() {
    for name in ["park", "apartment", "venice"] {
        let Some(path) = shared_map(name) else { return };
        let read = formats::read_environment(&path).unwrap();
        assert_eq!((read.clamped, read.warnings.len()), (0, 0), "{name}");
        let environment = Environment { sky: Sky::Map(read.map), up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
        for sampling in [SkySampling::Structured, SkySampling::EqualLight] {
            let lights = EnvironmentLights::new(&environment, 200, sampling).unwrap();
            let (error, largest) = errors(&environment, &lights);
            assert!(error < 5e-3 * largest, "{name}, {sampling:?}: {error} of {largest}");
        }
    }
}

/// The largest error of irradiance over some normals, and the largest irradiance, W/m², texel by texel.
fn errors(environment: &Environment, lights: &EnvironmentLights) -> (f64, f64) {
    let Sky::Map(map) = &environment.sky else { unreachable!("it is a map") };
    let texels = (0..map.width * map.height).map(|i| {
        let (u, v) = (
            (f64::from(i % map.width) + 0.5) / f64::from(map.width),
            (f64::from(i / map.width) + 0.5) / f64::from(map.height),
        );
        let angle = scene::texel_solid_angle(map.width, map.height, i / map.width);
        (environment.direction(u, v), environment.radiance_at(u, v) * angle)
    });
    let texels: Vec<(DVec3, scene::Rgb)> = texels.collect();
    let (mut error, mut largest) = (0.0f64, 0.0f64);
    for i in 0..60 {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 60.0;
        let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
        let normal = DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
        let truth: scene::Rgb = texels.iter().map(|(direction, light)| light * direction.dot(normal).max(0.0)).sum();
        error = error.max((lights.unobstructed(normal) - truth).abs().max_element());
        largest = largest.max(truth.max_element());
    }
    (error, largest)
}

/// Shadows of a picture are those of its lights, one by one.
#[test]
fn full_tracing_is_what_rays_say() {
    let scene: Scene = shapes(24);
    let (bvh, environment) = (Bvh::of_scene(&scene), cie(5));
    let lights = EnvironmentLights::new(&environment, 70, SkySampling::EqualLight).unwrap();
    let eye = Eye::new(&scene, &bvh, scene.cameras[0].camera, 40, 30);
    let made = sky_picture(&eye, SkyIllumination::direct(&environment, &lights), Visibility::Full, true);
    let mut pairs = 0;
    for (pixel, seen) in made.seen.chunks(2).enumerate() {
        let place = glam::DVec2::new((pixel % 40) as f64 + 0.5, (pixel / 40) as f64 + 0.5);
        let renderer::Sight::Front(front) = eye.look(&eye.ray(place)) else { continue };
        if scene.has_shading_normals(front.point.polygon) {
            continue;
        }
        for (light, direction) in lights.directions.iter().enumerate() {
            let is_above = front.point.normal.dot(*direction) > 0.0;
            let from = front.point.position;
            let ray = scene::Ray { origin: from, direction: *direction };
            let is_hidden = bvh.closest_hit_among(&ray, |id| id != front.point.polygon).is_some();
            assert_eq!(
                seen[light / 64] >> (light % 64) & 1 == 1,
                is_above && !is_hidden,
                "pixel {pixel}, light {light}"
            );
            pairs += 1;
        }
    }
    assert!(pairs > 10_000);
}
