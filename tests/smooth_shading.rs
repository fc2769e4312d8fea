//! Round bodies of flat faces: light by shading normals, beside paths, closed forms, and the eye's wish for no facets.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use mesher::{BakeOptions, Control};
use rayon::prelude::*;
use renderer::spread_by_area;
use scene::{Baked, Bvh, Material, Polygon, Rgb, Scene, centroid};
use solver::{Gather, SolveOptions, Surroundings, Visibility};

use crate::fixture::{box_faces, fails, folder, halflight, text};

/// Which normals a file gives to its round bodies.
#[derive(Clone, Copy)]
enum Normals {
    None,
    Round,
    /// Those, each replaced by something that is none.
    Bad(&'static str),
}

const MATERIALS: &str =
    "newmtl white\nKd 0.7 0.7 0.7\nnewmtl red\nKd 0.6 0.1 0.1\nnewmtl lamp\nKd 0 0 0\nKe 10 10 10\n";

/// An OBJ: a room of 3 m with a lamp, a ball of so many meridians and half as many circles of latitude, and an upright
/// cylinder.
fn round_bodies(folder: &Path, meridians: usize, normals: Normals) -> PathBuf {
    let mut obj = String::from("mtllib scene.mtl\n");
    let walls = box_faces(DVec3::ZERO, DVec3::splat(3.0), true, &[0, 1, 2, 3, 4, 5]);
    let lamp = [(1.0, 1.0), (1.0, 2.0), (2.0, 2.0), (2.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 2.9));
    for (i, corners) in walls.into_iter().chain([lamp]).enumerate() {
        corners.iter().for_each(|c| writeln!(obj, "v {} {} {}", c.x, c.y, c.z).unwrap());
        writeln!(obj, "usemtl {}\nf -4 -3 -2 -1", ["white", "white", "white", "white", "red", "white", "lamp"][i])
            .unwrap();
    }
    obj += "usemtl white\n";
    let mut known = 28;
    let mut vertex = |obj: &mut String, position: DVec3, normal: DVec3| {
        known += 1;
        writeln!(obj, "v {} {} {}", position.x, position.y, position.z).unwrap();
        match normals {
            Normals::Bad(text) => writeln!(obj, "vn {text}").unwrap(),
            _ => writeln!(obj, "vn {} {} {}", normal.x, normal.y, normal.z).unwrap(),
        }
        (known, known - 28)
    };
    let circles = meridians / 2;
    let around = |j: usize| {
        DVec3::new((TAU * j as f64 / meridians as f64).cos(), (TAU * j as f64 / meridians as f64).sin(), 0.0)
    };
    let ball: Vec<Vec<(usize, usize)>> = (0..=circles)
        .map(|i| {
            let (sin, cos) = (PI * i as f64 / circles as f64).sin_cos();
            let count = if i == 0 || i == circles { 1 } else { meridians };
            let place = |j: usize| around(j) * sin + DVec3::Z * cos;
            (0..count).map(|j| vertex(&mut obj, DVec3::new(1.0, 1.7, 0.9) + place(j) * 0.6, place(j))).collect()
        })
        .collect();
    let cylinder: Vec<Vec<(usize, usize)>> = [0.0, 1.5]
        .map(|z| {
            (0..meridians).map(|j| vertex(&mut obj, DVec3::new(2.1, 1.0, z) + around(j) * 0.4, around(j))).collect()
        })
        .into();
    let mut face = |corners: &[(usize, usize)], smooth: bool| {
        obj.push('f');
        for (vertex, normal) in corners {
            let _ = if smooth { write!(obj, " {vertex}//{normal}") } else { write!(obj, " {vertex}") };
        }
        obj.push('\n');
    };
    let smooth = !matches!(normals, Normals::None);
    for i in 0..circles {
        for j in 0..meridians {
            let at = |i: usize, j: usize| ball[i][j % ball[i].len()];
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i + 1 < circles {
                face(&[a, b, c], smooth);
            }
            if i > 0 {
                face(&[a, c, d], smooth);
            }
        }
    }
    for j in 0..meridians {
        let next = (j + 1) % meridians;
        face(&[cylinder[0][j], cylinder[0][next], cylinder[1][next], cylinder[1][j]], smooth);
    }
    face(&cylinder[1], false);
    std::fs::write(folder.join("scene.mtl"), MATERIALS).unwrap();
    let path = folder.join("scene.obj");
    std::fs::write(&path, obj).unwrap();
    path
}

fn imported(meridians: usize, normals: Normals) -> Scene {
    let folder = folder();
    formats::read_scene(&round_bodies(folder.path(), meridians, normals)).unwrap().scene
}

fn bake(scene: &Scene, tolerance: f64) -> mesher::Bake {
    let solution = solver::solve(scene, &SolveOptions::default(), &|_| ());
    let control = Control { progress: &|_| (), stop: &|| false, interrupted: &|| false, watch: None };
    mesher::bake(scene, solution, &BakeOptions { tolerance, ..BakeOptions::default() }, control)
}

/// Gathered light minus path-traced light at points of the round bodies, in standard deviations of both: that of the paths,
/// and `own` of the mean.
fn scores(scene: &Scene, bake: &mesher::Bake, truth_of: &Scene, own: f64) -> Vec<f64> {
    let points = spread_by_area(scene, 150, 1e-5, 7, |polygon| scene.has_shading_normals(polygon));
    let samples = vec![1 << 13; points.len()];
    let truth = renderer::irradiance_on(truth_of, &Bvh::of_scene(truth_of), &points, &samples, (None, 5), &|| ());
    let surroundings = Surroundings::new(scene, &bake.solution);
    let gather = Gather::new(&surroundings, &bake.solution);
    let found: Vec<Rgb> = points
        .par_iter()
        .map(|p| gather.irradiance_at(p.polygon, p.position, centroid(&scene.outline(p.polygon)) - p.position))
        .collect();
    let mean = truth.iter().map(|truth| truth.mean.x).sum::<f64>() / truth.len() as f64;
    let score = |(found, truth): (&Rgb, &renderer::Estimate)| {
        (found.x - truth.mean.x) / (truth.variance.x + (own * truth.mean.x.max(mean)).powi(2)).sqrt()
    };
    found.iter().zip(&truth).map(score).collect()
}

/// What is gathered is what paths find; and paths that do not know of the normals find something else.
fn agrees_with_paths(meridians: usize, visibility: Visibility, own: f64) {
    let scene = imported(meridians, Normals::Round);
    let bake = bake(&scene, 0.02);
    assert_eq!(bake.solution.visibility, visibility);
    let rms = |scores: Vec<f64>| (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt();
    let with = scores(&scene, &bake, &scene, own);
    let bias = with.iter().sum::<f64>() / with.len() as f64;
    let worst = with.iter().fold(0.0, |worst: f64, z| worst.max(z.abs()));
    let with = rms(with);
    assert!(with < 1.2 && bias.abs() < 1.0 && worst < 5.0, "rms {with}, bias {bias}, worst {worst}");
    let flat = Scene { shading_normals: Vec::new(), ..scene.clone() };
    let without = rms(scores(&scene, &bake, &flat, own));
    assert!(without > 2.0 * with, "{without} and {with}");
}

#[test]
fn gathered_light_is_that_of_paths_with_links() {
    agrees_with_paths(14, Visibility::Links, 0.01);
}

#[test]
fn gathered_light_is_that_of_paths_with_rays() {
    agrees_with_paths(28, Visibility::Rays, 0.01);
}

/// Mean jump of irradiance between neighbouring faces of the cylinder, relative to the mean on it.
fn jump(scene: &Scene, baked: &Baked, meridians: usize) -> f64 {
    let bvh = baked.bvh();
    let (mut jumps, mut sum) = (0.0, 0.0);
    for j in 0..meridians {
        for z in [0.3, 0.75, 1.2] {
            let beside = [-1e-3, 1e-3].map(|aside: f64| {
                let angle = |j: f64| TAU * j / meridians as f64;
                let (middle, edge) = (angle(j as f64 + 0.5 * aside.signum()), angle(j as f64));
                let normal = DVec3::new(middle.cos(), middle.sin(), 0.0);
                let along = DVec3::new(-middle.sin(), middle.cos(), 0.0) * aside;
                let place = DVec3::new(2.1 + 0.4 * edge.cos(), 1.0 + 0.4 * edge.sin(), z) + along;
                let (triangle, s, t) = baked.locate(&bvh, place, normal, 1e-5 * scene.size()).unwrap();
                baked.irradiance(triangle, s, t).x
            });
            jumps += (beside[0] - beside[1]).abs();
            sum += (beside[0] + beside[1]) / 2.0;
        }
    }
    jumps / sum
}

#[test]
fn neighbouring_faces_agree_where_the_file_has_normals() {
    let baked = |meridians, normals| {
        let scene = imported(meridians, normals);
        let baked = bake(&scene, 0.03).baked;
        (jump(&scene, &baked, meridians), baked.triangles.len())
    };
    let [flat, smooth] = [Normals::None, Normals::Round].map(|normals| baked(14, normals));
    assert!(8.0 * smooth.0 < flat.0, "{} and {}", smooth.0, flat.0);
    assert!(smooth.1 < 2 * flat.1, "triangles: {} and {}", smooth.1, flat.1);
    // With rays: each face of the ball is one quadrilateral.
    let (jump, triangles) = baked(28, Normals::Round);
    assert!(jump < 0.01 && triangles < 8000, "{jump}, {triangles}");
}

/// A closed room of B = M/(1−ρ) whose walls, n × n squares each, all have a normal turned by θ: all are lit by
/// B (1 + cos θ)/2, and pass on as much as if none were.
#[test]
fn the_furnace_with_turned_normals() {
    let (reflectance, exitance, angle) = (0.5, 1.0, 0.7_f64);
    for n in [1, 9] {
        let mut scene = Scene { objects: vec!["room".into()], ..Scene::default() };
        scene.materials.push(Material {
            reflectance: Rgb::splat(reflectance),
            radiance: Rgb::splat(exitance / PI),
            ..Material::grey("wall")
        });
        let at = |i: usize| f64::from(i as u32) / f64::from(n as u32);
        for wall in box_faces(DVec3::ZERO, DVec3::new(3.0, 2.0, 1.5), true, &[0, 1, 2, 3, 4, 5]) {
            let (u, v) = (wall[1] - wall[0], wall[3] - wall[0]);
            let normal = u.cross(v).normalize() * angle.cos() + u.normalize() * angle.sin();
            for i in 0..n * n {
                let (x, y) = (i % n, i / n);
                let first_corner = scene.corners.len() as u32;
                scene.polygons.push(Polygon { first_corner, corner_count: 4, material: 0, object: 0 });
                for (x, y) in [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)] {
                    let position = wall[0] + u * at(x) + v * at(y);
                    let known = scene.vertices.iter().position(|vertex| vertex.distance(position) < 1e-9);
                    scene.corners.push(known.unwrap_or(scene.vertices.len()) as u32);
                    if known.is_none() {
                        scene.vertices.push(position);
                    }
                    scene.shading_normals.push(normal.as_vec3());
                }
            }
        }
        assert_eq!(scene.validate(), Ok(()));
        let bake = bake(&scene, 0.05);
        assert_eq!(bake.solution.visibility == Visibility::Rays, n > 1);
        let exact = exitance / (1.0 - reflectance) * (1.0 + angle.cos()) / 2.0;
        let errors = bake.baked.samples.iter().map(|sample| f64::from(sample.x) / exact - 1.0);
        let (sum, square) = errors.fold((0.0, 0.0), |(sum, square), e| (sum + e, square + e * e));
        let count = bake.baked.samples.len() as f64;
        assert!((sum / count).abs() < 0.01 && (square / count).sqrt() < 0.03, "{} {}", sum / count, square / count);
    }
}

#[test]
fn normals_that_are_none_are_as_none() {
    let flat = imported(10, Normals::None);
    // Zero has no direction, and is left out on the way in; so is what is no number.
    assert_eq!(imported(10, Normals::Bad("0 0 0")).shading_normals, []);
    for bad in ["nan 0 1", "1e999 0 0"] {
        let folder = folder();
        let path = round_bodies(folder.path(), 10, Normals::Bad(bad));
        match formats::read_scene(&path) {
            Ok(imported) => assert_eq!(imported.scene.shading_normals, [], "{bad}"),
            Err(_) => assert!(fails(1, &["info", text(&path)]).contains("scene.obj")),
        }
    }
    // Against the faces: those keep their own.
    let mut against = flat.clone();
    let turned = |polygon: u32| {
        vec![-flat.plane(polygon).normal.as_vec3(); flat.polygons[polygon as usize].corner_count as usize]
    };
    against.shading_normals = flat.polygon_ids().flat_map(turned).collect::<Vec<Vec3>>();
    assert_eq!(against.validate(), Ok(()));
    let [a, b] = [&flat, &against].map(|scene| bake(scene, 0.1).baked);
    assert!(a.samples.len() == b.samples.len() && a.triangles == b.triangles);
    assert!(a.samples.iter().zip(&b.samples).all(|(a, b)| (*a - *b).abs().max_element() <= 1e-5 * a.max_element()));
}

#[test]
fn a_bake_with_shading_normals_is_verified() {
    for meridians in ["14", "28"] {
        let folder = folder();
        let scene = round_bodies(folder.path(), meridians.parse().unwrap(), Normals::Round);
        let baked = folder.path().join("scene.hlf");
        halflight().args(["bake", text(&scene), "-o", text(&baked), "--tolerance", "0.03"]).assert().success();
        halflight().args(["verify", text(&baked), "--points", "800"]).assert().success();
    }
}
