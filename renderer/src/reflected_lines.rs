//! Lines of a scene that are visible in its planar mirrors (Guo 1998, section 4.2, which has them from Pighin et al. 1997):
//! edges as an eye sees them through a mirror's outline, one reflection deep.
//!
//! What we do differently: nothing is clipped to the outline itself, but to the rectangle about it. A line is looked along
//! with rays, and one that meets anything but the mirror sees no part of the line, whatever shape the outline has.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::{HalfEdges, Plane, Ray};

use crate::eye::{Eye, Sight};
use crate::visible_lines::{NEAR, NEARER, VisibleLine, distance_along, edges_from, part_before, pieces};

/// A flat mirror whose front an eye is before.
struct Mirror {
    polygon: u32,
    plane: Plane,
    /// Upper left and lower right corner of its picture, or of more; pixels.
    bounds: [DVec2; 2],
}

/// What an eye sees, in the planar mirrors of a scene, of the edges of its polygons and of other segments, metres.
pub fn reflected_lines(eye: &Eye<'_>, segments: &[[DVec3; 2]]) -> Vec<VisibleLine> {
    let half_edges = HalfEdges::new(eye.scene());
    let in_mirror = |mirror: &Mirror| -> Vec<VisibleLine> {
        let image = mirror.image(eye.camera().eye);
        let mut seen = edges_from(eye, &half_edges, image);
        seen.extend(segments);
        seen.par_iter().flat_map_iter(|segment| mirror.pieces(eye, segment)).collect()
    };
    mirrors(eye).iter().flat_map(in_mirror).collect()
}

/// The flat mirrors before an eye. Those with shading normals stand for curved ones.
fn mirrors(eye: &Eye<'_>) -> Vec<Mirror> {
    let scene = eye.scene();
    let is_mirror = |&polygon: &u32| {
        let is_bright = scene.material(polygon).gloss.is_some_and(|gloss| gloss.is_mirror);
        is_bright && !scene.has_shading_normals(polygon) && scene.plane(polygon).distance(eye.camera().eye) > 0.0
    };
    let mirror =
        |polygon| Mirror { polygon, plane: scene.plane(polygon), bounds: bounds(eye, &scene.outline(polygon)) };
    scene.polygon_ids().filter(is_mirror).map(mirror).collect()
}

/// A rectangle of the picture about an outline: the whole picture if part of the outline is not before the eye.
fn bounds(eye: &Eye<'_>, outline: &[DVec3]) -> [DVec2; 2] {
    let picture = [DVec2::ZERO, eye.far_corner()];
    if outline.iter().any(|corner| eye.depth(*corner) < NEAR * eye.scene().size()) {
        return picture;
    }
    let corners = outline.iter().map(|corner| eye.project(*corner).clamp(picture[0], picture[1]));
    corners.fold([picture[1], picture[0]], |[low, high], corner| [low.min(corner), high.max(corner)])
}

impl Mirror {
    /// Where a place is seen to be.
    fn image(&self, place: DVec3) -> DVec3 {
        place - 2.0 * self.plane.distance(place) * self.plane.normal
    }

    /// The pieces of a segment that are seen in the mirror.
    fn pieces(&self, eye: &Eye<'_>, segment: &[DVec3; 2]) -> Vec<VisibleLine> {
        let away = segment.map(|end| self.plane.distance(end) - NEAR * eye.scene().size());
        let Some(segment) = part_before(segment, away) else { return Vec::new() };
        let is_visible = |ray: &Ray| {
            let Sight::Front(seen) = eye.look(ray) else { return false };
            let receiver = eye.surfaces.looked_at(&seen.point);
            let mirrored = Ray { origin: receiver.position, direction: ray.direction.reflect(self.plane.normal) };
            let distance = distance_along(&mirrored, &segment);
            let is_hidden =
                || eye.nearest_from(&receiver, mirrored.direction).is_some_and(|hit| hit < distance * (1.0 - NEARER));
            seen.point.polygon == self.polygon && !is_hidden()
        };
        pieces(eye, &segment.map(|end| self.image(end)), self.bounds, is_visible)
    }
}

#[cfg(test)]
mod tests {
    use scene::{Bvh, Camera, Gloss, Rgb, Scene};

    use super::*;
    use crate::path_trace::test_scenes::{grey, scene_of};
    use crate::visible_lines::tests::{length, square};

    /// A mirror on the ground that is seen from above, aslant: the place (x, y, z) before it is seen at (x, y, −z).
    fn seen(scene: &Scene, segments: &[[DVec3; 2]]) -> Vec<VisibleLine> {
        let bvh = Bvh::of_scene(scene);
        let camera = Camera { eye: DVec3::new(0.0, -2.0, 2.0), target: DVec3::ZERO, up: DVec3::Z, vertical_fov: 1.0 };
        reflected_lines(&Eye::new(scene, &bvh, camera, 100, 100), segments)
    }

    fn with_mirror(half: f64, others: &[(Vec<DVec3>, scene::Material)]) -> Scene {
        let mut scene = scene_of(&[&[(square(0.0, half), grey(0.5, 0.0))], others].concat());
        scene.materials[0].gloss =
            Some(Gloss { diffuse: Rgb::ZERO, specular: Rgb::ONE, exponent: 0.0, is_mirror: true });
        scene
    }

    const POST: [DVec3; 2] = [DVec3::new(0.0, 0.0, 0.2), DVec3::new(0.0, 0.0, 0.6)];

    #[test]
    fn without_a_mirror_or_before_its_back_nothing_is_reflected() {
        let plain = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0))]);
        assert!(seen(&plain, &[POST]).is_empty());
        let mut back = with_mirror(1.0, &[]);
        back.corners.reverse();
        assert!(seen(&back, &[POST]).is_empty());
    }

    #[test]
    fn a_post_is_seen_upside_down_as_far_as_the_mirror_reaches() {
        let scene = with_mirror(1.0, &[]);
        let lines = seen(&scene, &[POST]);
        let bvh = Bvh::of_scene(&scene);
        let camera = Camera { eye: DVec3::new(0.0, -2.0, 2.0), target: DVec3::ZERO, up: DVec3::Z, vertical_fov: 1.0 };
        let eye = Eye::new(&scene, &bvh, camera, 100, 100);
        let image = POST.map(|end| eye.project(end * DVec3::new(1.0, 1.0, -1.0)));
        assert!(lines.len() == 1 && (0..2).all(|end| lines[0][end].distance(image[end]) < 1e-9), "{lines:?}");
        // Towards its image the eye looks through the ground at (0, −z) and nearer.
        let small = length(&seen(&with_mirror(0.3, &[]), &[POST]));
        assert!(0.0 < small && small < 0.9 * length(&lines), "{small}");
        let below = POST.map(|end| -end);
        assert!(seen(&scene, &[below]).is_empty());
    }

    #[test]
    fn what_stands_before_the_mirror_or_its_picture_hides_lines() {
        // A plate that hides the post from the mirror, and is seen there itself.
        let plate = square(0.1, 0.4);
        let lines = seen(&with_mirror(1.0, &[(plate, grey(0.5, 0.0))]), &[POST]);
        let image = |[from, to]: &VisibleLine| (from.x - 50.0).abs() < 1e-6 && (to.x - 50.0).abs() < 1e-6;
        assert!(!lines.iter().any(image) && length(&lines) > 20.0, "{lines:?}");
    }
}
