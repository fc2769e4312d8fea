//! Path-traced reference irradiance for an OBJ scene, as CSV on stdout.
//!
//! ```text
//! reference SCENE.obj COUNT ERROR         COUNT points, spread by area over the polygons that do not emit
//! reference SCENE.obj POINTS.csv ERROR    the points of another reference (its x, y, z and face)
//! ```
//!
//! ERROR is the standard error at every point and colour as a fraction of the scene's mean; direct light alone is
//! brought down to 0.4 of that fraction of its own mean.

#![allow(clippy::print_stdout, clippy::print_stderr)]

#[path = "../tests/obj_scene/mod.rs"]
mod obj_scene;

use std::{error::Error, path::Path, process::ExitCode};

use glam::DVec3;
use renderer::{Reference, ReferenceOptions, SurfacePoint, reference, spread_by_area};
use scene::{Bvh, Rgb, Scene};

/// Seed of points and paths. Another gives another reference that is as good.
const SEED: u64 = 1996;

/// Distance that points keep from the edges of their polygon, metres: far above rounding, far below any mesh.
const BORDER: f64 = 1e-6;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [scene, points, error] = arguments.as_slice() else {
        eprintln!("usage: reference SCENE.obj COUNT|POINTS.csv ERROR");
        return ExitCode::from(2);
    };
    match run(Path::new(scene), points, error) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("reference: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(path: &Path, points: &str, error: &str) -> Result<(), Box<dyn Error>> {
    let scene = obj_scene::read(path)?;
    let points = match points.parse() {
        Ok(count) => spread_by_area(&scene, count, BORDER, SEED, |polygon| !scene.material(polygon).emits()),
        Err(_) => read_points(Path::new(points), &scene)?,
    };
    let total_error: f64 = error.parse()?;
    let options = ReferenceOptions { total_error, direct_error: 0.4 * total_error, seed: SEED };
    let result = reference(&scene, &Bvh::of_scene(&scene), &points, &options);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    print(&name, &points, &result, &options);
    Ok(())
}

/// The points of a reference, put back into the planes of their faces.
fn read_points(path: &Path, scene: &Scene) -> Result<Vec<SurfacePoint>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let rows = text.lines().filter(|line| line.starts_with(|first: char| first.is_ascii_digit() || first == '-'));
    let point = |row: &str| -> Result<SurfacePoint, Box<dyn Error>> {
        let fields: Vec<_> = row.split(',').collect();
        let [x, y, z, _, _, _, face, ..] = fields[..] else { return Err("a row with less than seven fields".into()) };
        let polygon: u32 = face.parse()?;
        if !scene.polygon_ids().contains(&polygon) {
            return Err(format!("the scene has no face {polygon}").into());
        }
        let plane = scene.plane(polygon);
        let position = DVec3::new(x.parse()?, y.parse()?, z.parse()?);
        let position = position - plane.normal * plane.distance(position);
        Ok(SurfacePoint { position, normal: plane.normal, polygon })
    };
    rows.map(point).collect()
}

fn print(name: &str, points: &[SurfacePoint], result: &Reference, options: &ReferenceOptions) {
    let percent = |errors: &[renderer::Estimate]| {
        let largest = errors.iter().map(|estimate| estimate.standard_error().max_element()).fold(0.0, f64::max);
        100.0 * largest / result.mean
    };
    println!(
        "# {name}: irradiance W/m^2 (E = int L cos dw; Ke in W/m^2/sr); Ed direct only, E total; sed,se standard errors; \
         scene mean E {:.6}; largest se {:.3}% of it, largest sed {:.3}%; {} paths, error {}, seed {}; made by \
         halflight {} renderer/examples/reference.rs",
        result.mean,
        percent(&result.total),
        percent(&result.direct),
        result.samples,
        options.total_error,
        options.seed,
        env!("CARGO_PKG_VERSION"),
    );
    println!("x,y,z,nx,ny,nz,face,Ed_r,Ed_g,Ed_b,E_r,E_g,E_b,sed_r,sed_g,sed_b,se_r,se_g,se_b");
    for ((point, direct), total) in points.iter().zip(&result.direct).zip(&result.total) {
        // Positions with all their digits, so that they stay in the plane; estimates with more than are known.
        let exact = |v: DVec3| format!("{},{},{}", v.x + 0.0, v.y + 0.0, v.z + 0.0);
        let known = |v: Rgb| format!("{:.6e},{:.6e},{:.6e}", v.x, v.y, v.z);
        let error = |v: Rgb| format!("{:.2e},{:.2e},{:.2e}", v.x, v.y, v.z);
        println!(
            "{},{},{},{},{},{},{}",
            exact(point.position),
            exact(point.normal),
            point.polygon,
            known(direct.mean),
            known(total.mean),
            error(direct.standard_error()),
            error(total.standard_error()),
        );
    }
}
