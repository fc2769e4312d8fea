//! Coherent visibility: the tables of Ben-Artzi, Ramamoorthi and Agrawala 2004 again, with what is predicted wrong.
//!
//! `cargo bench --bench visibility` prints a page for data/record/; `-- 200` makes it of that many lights alone. The detailed
//! mesh is not in this repository: `HALFLIGHT_MESH=FILE.obj` says where it is, without it its rows are left out.

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::unwrap_used)]

mod common;
#[allow(unused_imports, reason = "scenes under the sky alone")]
#[path = "common/generated/mod.rs"]
mod generated;

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use renderer::{EnvironmentLights, Eye, SkyIllumination, SkyPicture, SkySampling, Visibility, sky_picture};
use scene::{Bvh, Camera, CieSky, Environment, NamedCamera, Polygon, Scene, Sky, UpAxis};

/// The paper's side of a picture, pixels.
const SIDE: u32 = 513;

/// The paper's numbers of lights.
const LIGHTS: [u32; 4] = [50, 100, 200, 400];

/// The lights of the paper's tables of times.
const TIMED: [u32; 2] = [200, 400];

/// What is compared.
const COMPARED: [&str; 11] =
    ["swb", "gwb", "gnb", "gwu", "gnu", "gnu-restricted", "gnu-unflooded", "opt", "gnu-borders", "opt-borders", "full"];

fn main() {
    let wanted: Vec<u32> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    println!("# Coherent visibility\n");
    println!("{}", common::machine());
    println!("Command: `HALFLIGHT_MESH=spot.obj cargo bench --bench visibility`, {}.", env!("CARGO_PKG_VERSION"));
    println!(
        "\nPictures of {SIDE} × {SIDE} pixels in blocks of 64 × 64, under skies of the CIE with structured lights. Shares are of the shadow"
    );
    println!(
        "rays of full tracing, those at the borders of blocks counted on top; seconds are of all threads together."
    );
    for (name, scene, sky) in views() {
        let sky = Sky::Cie(CieSky::new(sky, [2.2, 0.7], 0.0).unwrap());
        let environment = Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
        println!("\n## {name}: {} polygons\n", scene.polygons.len());
        println!(
            "| lights | way | rays traced | predicted wrong | primary, s | visibility, s | shading, s | whole picture, full ÷ this | µs a ray |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for lights in LIGHTS.into_iter().filter(|lights| wanted.is_empty() || wanted.contains(lights)) {
            rows(&scene, &environment, lights);
        }
    }
}

/// Prints the rows of a scene with so many lights.
fn rows(scene: &Scene, environment: &Environment, count: u32) {
    let lights = EnvironmentLights::new(environment, count, SkySampling::Structured).unwrap();
    let bvh = Bvh::of_scene(scene);
    let eye = Eye::new(scene, &bvh, scene.cameras[0].camera, SIDE, SIDE);
    let made = |name: &str| {
        let (_, visibility) = Visibility::NAMED.into_iter().find(|(known, _)| *known == name).unwrap();
        sky_picture(&eye, SkyIllumination::direct(environment, &lights), visibility, true)
    };
    let whole = |picture: &SkyPicture| picture.seconds.primary + picture.seconds.visibility + picture.seconds.shading;
    let truth = made("full");
    for name in COMPARED {
        let picture = if name == "full" { truth.clone() } else { made(name) };
        let share = |count: u64| 100.0 * count as f64 / picture.pairs as f64;
        let wrong: u64 = picture.seen.iter().zip(&truth.seen).map(|(a, b)| u64::from((a ^ b).count_ones())).sum();
        let times = if TIMED.contains(&count) {
            let seconds = picture.seconds;
            format!(
                "{:.2} | {:.2} | {:.2} | {:.1} | {:.2}",
                seconds.primary,
                seconds.visibility,
                seconds.shading,
                whole(&truth) / whole(&picture),
                1e6 * seconds.visibility / picture.rays as f64
            )
        } else {
            "| | | |".to_owned()
        };
        println!("| {count} | {name} | {:.2} % | {:.4} % | {times} |", share(picture.rays), share(wrong));
    }
}

/// The four scenes, each with the number of a sky.
fn views() -> Vec<(&'static str, Scene, u8)> {
    let mut views = vec![("shapes", generated::shapes(64), 12)];
    match std::env::var_os("HALFLIGHT_MESH").map(PathBuf::from) {
        Some(path) => views.push(("mesh", mesh(path), 13)),
        None => eprintln!("SKIPPED, the mesh: set HALFLIGHT_MESH to its OBJ file"),
    }
    views.push(("dominoes", generated::dominoes(36), 7));
    views.push(("plant", generated::plant(60), 5));
    views
}

/// A mesh with y up, smooth, on a floor.
fn mesh(path: PathBuf) -> Scene {
    let folder = common::scratch("mesh");
    std::fs::create_dir_all(&folder).unwrap();
    let file = path.canonicalize().unwrap();
    let model = format!("up = \"y\"\n[[model]]\nfile = {:?}\n", file.to_str().unwrap());
    std::fs::write(folder.join("mesh.toml"), model).unwrap();
    let mut scene = formats::read_scene(&folder.join("mesh.toml")).unwrap().scene;
    let mut normals = vec![DVec3::ZERO; scene.vertices.len()];
    for polygon in scene.polygon_ids() {
        let normal = scene.plane(polygon).normal * scene.area(polygon);
        let corners = &scene.corners[scene.polygons[polygon as usize].corner_range()];
        corners.iter().for_each(|&vertex| normals[vertex as usize] += normal);
        scene.polygons[polygon as usize].object = 0;
    }
    scene.shading_normals = scene.corners.iter().map(|&v| normals[v as usize].normalize_or_zero().as_vec3()).collect();
    let (low, high) = scene.bounds();
    let (first_vertex, first_corner, reach) = (scene.vertices.len() as u32, scene.corners.len() as u32, 4.0);
    for (x, y) in [(-reach, -reach), (reach, -reach), (reach, reach), (-reach, reach)] {
        scene.vertices.push(DVec3::new(x, y, low.z));
        scene.shading_normals.push(Vec3::ZERO);
    }
    scene.corners.extend(first_vertex..first_vertex + 4);
    scene.texture_coordinates.clear();
    scene.polygons.push(Polygon { first_corner, corner_count: 4, material: 0, object: 0 });
    let target = (low + high) / 2.0;
    let eye = target + DVec3::new(2.2, -3.2, 1.5);
    scene.cameras =
        vec![NamedCamera { name: "camera".into(), camera: Camera { eye, target, up: DVec3::Z, vertical_fov: 0.7 } }];
    assert_eq!(scene.validate(), Ok(()));
    scene
}
