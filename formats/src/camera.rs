//! Cameras of a scene file: those in its comments, or else one that shows the whole scene.

use glam::DVec3;
use scene::{Bvh, Camera, NamedCamera, Ray, Scene, area_vector, luminance};

/// Vertical opening angle of the default camera, radians (60°): wide enough for a room, not yet distorting.
const DEFAULT_FOV: f64 = std::f64::consts::PI / 3.0;

/// How far from a room's corner towards its middle the default camera stands, as a fraction of the way: clear of what
/// stands in the corner, with most of the room before it.
const FROM_CORNER: f64 = 0.2;

/// Height of the default camera in a room, as a fraction of the room's: the eyes of someone who stands.
const EYE_HEIGHT: f64 = 0.6;

/// The camera in a comment `camera eye X Y Z dir X Y Z up X Y Z fov_deg D` (metres; D is the full vertical angle in
/// degrees), whatever follows it. None where the comment is about something else, an error where it should be a camera
/// and is no valid one.
pub(crate) fn camera_comment(comment: &str) -> Option<Result<Camera, ()>> {
    let words: Vec<&str> = comment.split_whitespace().collect();
    let ["camera", "eye", numbers @ ..] = words.as_slice() else { return None };
    Some(parse(numbers).filter(Camera::is_valid).ok_or(()))
}

fn parse(words: &[&str]) -> Option<Camera> {
    let &[ex, ey, ez, "dir", dx, dy, dz, "up", ux, uy, uz, "fov_deg", fov, ..] = words else { return None };
    let vector = |x: &str, y: &str, z: &str| Some(DVec3::new(x.parse().ok()?, y.parse().ok()?, z.parse().ok()?));
    let (eye, direction) = (vector(ex, ey, ez)?, vector(dx, dy, dz)?);
    let vertical_fov = fov.parse::<f64>().ok()?.to_radians();
    Some(Camera { eye, target: eye + direction, up: vector(ux, uy, uz)?, vertical_fov })
}

/// A camera that frames a scene without one: in a closed room from near the corner with the freest view of the
/// middle, else from outside, where most fronts are seen, with the whole scene in the picture.
/// `up` is what the file says of it.
pub(crate) fn default_camera(scene: &Scene, up: Option<DVec3>) -> NamedCamera {
    let (low, high) = scene.bounds();
    let centre = (low + high) / 2.0;
    let up = up.unwrap_or_else(|| up_of(scene));
    let bvh = Bvh::of_scene(scene);
    let eye = if is_room(&bvh, centre) {
        // Fractions of the box's extent: along `up` the height, across it one of the four corners.
        let corner = |i: u32| {
            let side = |bit: u32| if i & bit == 0 { FROM_CORNER / 2.0 } else { 1.0 - FROM_CORNER / 2.0 };
            let across =
                if up == DVec3::Z { DVec3::new(side(1), side(2), 0.0) } else { DVec3::new(side(1), 0.0, side(2)) };
            low + (across + up * EYE_HEIGHT) * (high - low)
        };
        let free = |eye: DVec3| {
            let ray = Ray { origin: eye, direction: centre - eye };
            bvh.closest_hit(&ray, 0.0).map_or(f64::INFINITY, |hit| hit.distance)
        };
        // `max_by` takes the last of equals; reversed, the first.
        (0..4).rev().map(corner).max_by(|&a, &b| free(a).total_cmp(&free(b))).unwrap_or(centre)
    } else {
        // Fronts face this way on the whole: out of the open side of a box, up from a table.
        let facing: DVec3 = scene.polygon_ids().map(|polygon| area_vector(&scene.outline(polygon))).sum();
        let oblique = DVec3::new(0.6, 0.4, 0.8);
        let direction = 2.0 * facing.normalize_or_zero() + oblique;
        centre + direction.normalize() * (scene.size() / 2.0 / (DEFAULT_FOV / 2.0).sin())
    };
    NamedCamera { name: "default".to_owned(), camera: Camera { eye, target: centre, up, vertical_fov: DEFAULT_FOV } }
}

/// Whether every way out of the middle ends at the front of a surface.
fn is_room(bvh: &Bvh, centre: DVec3) -> bool {
    [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]).all(|direction| {
        let ray = Ray { origin: centre, direction };
        let outermost =
            std::iter::successors(bvh.closest_hit(&ray, 0.0), |hit| bvh.closest_hit(&ray, hit.distance)).last();
        outermost.is_some_and(|hit| hit.normal.dot(direction) < 0.0)
    })
}

/// OBJ files do not say which way is up: y, as most modellers have it, unless the lamps shine more along z. (Down or up:
/// many a lamp is wound the wrong way.)
fn up_of(scene: &Scene) -> DVec3 {
    let shine: DVec3 = scene
        .emitters()
        .map(|polygon| area_vector(&scene.outline(polygon)) * luminance(scene.material(polygon).radiance))
        .sum();
    if shine.z.abs() > shine.y.abs() { DVec3::Z } else { DVec3::Y }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use scene::{Material, Polygon, Rgb};

    use super::*;

    /// A box from the origin to (4, 5, 3), its faces inwards or outwards, with a light in the middle of its top.
    fn box_scene(inwards: bool, left_out: Option<usize>) -> Scene {
        let vertices = (0..8u32)
            .map(|i| DVec3::new(f64::from(i & 1) * 4.0, f64::from(i >> 1 & 1) * 5.0, f64::from(i >> 2) * 3.0))
            .chain([(1.0, 1.0), (1.0, 2.0), (2.0, 2.0), (2.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 2.9)))
            .collect();
        let faces =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3], [8, 9, 10, 11]];
        let mut scene = Scene {
            vertices,
            materials: vec![Material::grey("wall"), Material { radiance: Rgb::ONE, ..Material::grey("light") }],
            objects: vec!["box".into()],
            ..Scene::default()
        };
        for (i, mut face) in faces.into_iter().enumerate().filter(|(i, _)| Some(*i) != left_out) {
            if !inwards && i < 6 {
                face.reverse();
            }
            let first_corner = scene.corners.len() as u32;
            scene.polygons.push(Polygon { first_corner, corner_count: 4, material: u32::from(i == 6), object: 0 });
            scene.corners.extend(face);
        }
        scene
    }

    #[test]
    fn comments_that_are_cameras_and_some_that_are_not() {
        let camera = camera_comment(" camera eye 1 2 3 dir 0 0 -1 up 0 1 0 fov_deg 90 (square)").unwrap().unwrap();
        assert_eq!((camera.eye, camera.target), (DVec3::new(1., 2., 3.), DVec3::new(1., 2., 2.)));
        assert!((camera.vertical_fov - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!(camera_comment(" made with a camera").is_none());
        assert!(camera_comment("").is_none());
        for wrong in [
            "1 2",
            "1 2 3 dir 0 0 0 up 0 1 0 fov_deg 90",
            "1 2 3 dir 0 1 0 up 0 1 0 fov_deg 90",
            "1 2 3 dir 0 0 1 up 0 1 0 fov_deg 180",
            "nan 2 3 dir 0 0 1 up 0 1 0 fov_deg 60",
        ] {
            assert_eq!(camera_comment(&format!("camera eye {wrong}")), Some(Err(())), "{wrong}");
        }
    }

    #[test]
    fn a_room_is_seen_from_inside_standing() {
        let scene = box_scene(true, None);
        let camera = default_camera(&scene, None).camera;
        assert!(camera.is_valid());
        assert_eq!(camera.up, DVec3::Z);
        let (low, high) = scene.bounds();
        assert!(camera.eye.cmpgt(low).all() && camera.eye.cmplt(high).all());
        assert!((camera.eye.z - 1.8).abs() < 1e-12);
    }

    #[test]
    fn a_block_and_an_open_box_are_seen_from_outside_in_full() {
        for (inwards, left_out) in [(false, None), (true, Some(5))] {
            let scene = box_scene(inwards, left_out);
            let camera = default_camera(&scene, None).camera;
            let (low, high) = scene.bounds();
            assert!(!(camera.eye.cmpge(low).all() && camera.eye.cmple(high).all()));
            let (right, up, forward) = camera.basis();
            for vertex in &scene.vertices {
                let seen = *vertex - camera.eye;
                let reach = seen.dot(forward) * (camera.vertical_fov / 2.0).tan();
                assert!(seen.dot(right).abs() <= reach && seen.dot(up).abs() <= reach);
            }
            // The open side of the box is towards the camera.
            assert!(left_out.is_none() || camera.eye.x > 4.0);
        }
    }
}
