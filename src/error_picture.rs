//! The error on the scene: a picture whose pixels have the colour of the nearest compared point.

use glam::DVec2;
use rayon::prelude::*;
use renderer::SurfacePoint;
use scene::{Bvh, Camera, Scene};

use crate::verification::Comparison;

/// Colours as a display shows them: within the tolerance, too dark, too bright, and a polygon without a point.
const NEUTRAL: [f64; 3] = [200.0, 200.0, 200.0];
const TOO_DARK: [f64; 3] = [20.0, 60.0, 230.0];
const TOO_BRIGHT: [f64; 3] = [225.0, 25.0, 15.0];
const UNKNOWN: [f64; 3] = [90.0, 90.0, 90.0];

/// Part of the tolerance within which an error is grey.
const GREY: f64 = 0.25;

/// Errors, in tolerances, from which the colour no longer changes: the limit of the 99th percentile.
const SATURATED: f64 = 5.0;

/// Brightness of a surface that is seen at a grazing angle, that of one seen from the front being 1: enough that edges
/// are seen, too little to be taken for a colour of the error.
const GRAZING: f64 = 0.6;

/// Draws the signed relative error of points on a scene's surfaces, row by row from the top left.
///
/// What noise explains at two standard errors is grey. Backs and background are black.
pub fn error_picture(
    scene: &Scene,
    (camera, width, height): (&Camera, u32, u32),
    points: &[SurfacePoint],
    comparisons: &[Comparison],
    tolerance: f64,
) -> Vec<[u8; 3]> {
    let bvh = Bvh::of_scene(scene);
    let mut on_polygon = vec![Vec::new(); scene.polygons.len()];
    for (point, comparison) in points.iter().zip(comparisons) {
        on_polygon[point.polygon as usize].push((point.position, colour(comparison, tolerance)));
    }
    let pixel = |index: usize| {
        let (x, y) = (index % width as usize, index / width as usize);
        let ray = camera.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5), width, height);
        let Some(hit) = bvh.closest_hit(&ray, 0.0) else { return [0; 3] };
        let facing = -hit.normal.dot(ray.direction);
        if facing <= 0.0 {
            return [0; 3];
        }
        let place = ray.at(hit.distance);
        let distance = |&&(position, _): &&(glam::DVec3, [f64; 3])| position.distance_squared(place);
        let near = on_polygon[hit.id as usize].iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let light = GRAZING + (1.0 - GRAZING) * facing;
        near.map_or(UNKNOWN, |(_, colour)| *colour).map(|channel| (channel * light).round() as u8)
    };
    (0..width as usize * height as usize).into_par_iter().map(pixel).collect()
}

/// The colour of one comparison.
fn colour(comparison: &Comparison, tolerance: f64) -> [f64; 3] {
    let size = if comparison.is_noise() { 0.0 } else { comparison.error() / tolerance };
    let part = ((size - GREY) / (SATURATED - GREY)).max(0.0);
    signed_colour(part.copysign(comparison.signed()))
}

/// The colour of an error, as a display shows it: grey for none, blue for −1 and less, too dark, red for 1 and more, too bright.
pub fn signed_colour(error: f64) -> [f64; 3] {
    let (part, full) = (error.abs().min(1.0), if error < 0.0 { TOO_DARK } else { TOO_BRIGHT });
    std::array::from_fn(|channel| NEUTRAL[channel] + (full[channel] - NEUTRAL[channel]) * part)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use scene::{Material, Polygon, Rgb};

    use super::*;

    fn off_by(error: f64, variance: f64) -> Comparison {
        Comparison { found: Rgb::splat(1.0 + error), truth: Rgb::ONE, variance: Rgb::splat(variance), scale: 1.0 }
    }

    #[test]
    fn too_dark_is_blue_too_bright_red_and_noise_grey() {
        assert_eq!(colour(&off_by(-0.05, 0.0), 0.01), TOO_DARK);
        assert_eq!(colour(&off_by(0.5, 0.0), 0.01), TOO_BRIGHT);
        assert_eq!(colour(&off_by(0.002, 0.0), 0.01), NEUTRAL);
        assert_eq!(colour(&off_by(-0.03, 0.001), 0.01), NEUTRAL, "all of it may be noise");
    }

    #[test]
    fn a_pixel_takes_the_nearest_point_of_its_polygon() {
        let square = [(0., 0.), (2., 0.), (2., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let polygon = Polygon { first_corner: 0, corner_count: 4, material: 0, object: 0 };
        let scene = Scene {
            vertices: square.to_vec(),
            corners: vec![0, 1, 2, 3],
            polygons: vec![polygon],
            materials: vec![Material::grey("grey")],
            objects: vec!["all".into()],
            ..Scene::default()
        };
        let point = |x: f64| SurfacePoint { position: DVec3::new(x, 0.5, 0.0), normal: DVec3::Z, polygon: 0 };
        let camera = |z: f64| Camera {
            eye: DVec3::new(1.0, 0.5, z),
            target: DVec3::new(1.0, 0.5, 0.0),
            up: DVec3::Y,
            vertical_fov: 0.9,
        };
        let draw = |z: f64, points: &[SurfacePoint], comparisons: &[Comparison]| {
            error_picture(&scene, (&camera(z), 40, 20), points, comparisons, 0.01)
        };
        let (points, comparisons) = ([point(0.5), point(1.5)], [off_by(-1.0, 0.0), off_by(1.0, 0.0)]);
        let picture = draw(1.2, &points, &comparisons);
        let (left, right) = (picture[10 * 40 + 15], picture[10 * 40 + 25]);
        assert!(left[2] > 200 && left[0] < 30 && right[0] > 200 && right[2] < 30, "{left:?} {right:?}");
        assert_eq!(picture[0], [0; 3], "background");
        assert!(draw(-1.2, &points, &comparisons).iter().all(|pixel| *pixel == [0; 3]), "the back is black");
        let empty = draw(1.2, &[], &[])[10 * 40 + 20];
        assert!(empty[0] == empty[2] && empty[0] > 60 && empty[0] < 120, "{empty:?}");
    }
}
