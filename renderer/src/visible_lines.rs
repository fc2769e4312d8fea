//! Lines of a scene that are visible (Guo 1998, section 4.2): what an eye sees of segments, such as the edges of polygons. A
//! block that one of them crosses is an edge block, however alike its corners are.
//!
//! What we do differently: a line is visible where a ray finds nothing before it, at points a few pixels apart; the paper has a
//! Z-buffer, and a polygon offset that keeps it from stitching.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::{HalfEdges, Ray};

use crate::eye::Eye;

/// Pixels between two points of a line that are looked at: what is hidden for less may be taken for visible.
const STEP: f64 = 2.0;

/// How much nearer than a point something must be to hide it, as a fraction of the distance: more shows edges behind thin
/// plates, less hides those at contacts.
pub(crate) const NEARER: f64 = 1e-3;

/// The nearest that a point may be to the eye, as a fraction of the scene's size.
pub(crate) const NEAR: f64 = 1e-4;

/// A straight line of the image plane, from point to point, pixels of the picture.
pub type VisibleLine = [DVec2; 2];

/// Edges of a scene's polygons that an eye may see: where one object ends, or turns away from the eye.
pub fn object_edges(eye: &Eye<'_>) -> Vec<[DVec3; 2]> {
    edges_from(eye, &HalfEdges::new(eye.scene()), eye.camera().eye)
}

/// Such edges as they are seen from a place.
pub(crate) fn edges_from(eye: &Eye<'_>, half_edges: &HalfEdges, place: DVec3) -> Vec<[DVec3; 2]> {
    let scene = eye.scene();
    let looks = |polygon: u32| (eye.object(polygon), scene.plane(polygon).distance(place) > 0.0);
    let is_edge = |half_edge: usize| match half_edges.neighbour(half_edge as u32) {
        None => true,
        // Once for both.
        Some(neighbour) => {
            let own = half_edges.polygon[half_edge];
            own < neighbour && looks(own) != looks(neighbour)
        }
    };
    let at = |corner: usize| scene.vertices[scene.corners[corner] as usize];
    let ends = |corner: usize| [at(corner), at(half_edges.next[corner] as usize)];
    (0..scene.corners.len()).filter(|&corner| is_edge(corner)).map(ends).collect()
}

/// What an eye sees of segments, metres.
pub fn visible_lines(eye: &Eye<'_>, segments: &[[DVec3; 2]]) -> Vec<VisibleLine> {
    segments.par_iter().flat_map_iter(|segment| seen_pieces(eye, segment)).collect()
}

/// The visible pieces of a segment.
fn seen_pieces(eye: &Eye<'_>, segment: &[DVec3; 2]) -> Vec<VisibleLine> {
    let is_visible = |ray: &Ray| {
        let distance = distance_along(ray, segment);
        eye.nearest(ray).is_none_or(|hit| hit >= distance * (1.0 - NEARER))
    };
    pieces(eye, segment, [DVec2::ZERO, eye.far_corner()], is_visible)
}

/// The pieces of a segment's picture, within a rectangle, that are visible along rays through them.
pub(crate) fn pieces(
    eye: &Eye<'_>,
    segment: &[DVec3; 2],
    [low, high]: [DVec2; 2],
    is_visible: impl Fn(&Ray) -> bool,
) -> Vec<VisibleLine> {
    let near = NEAR * eye.scene().size();
    let Some(before) = part_before(segment, segment.map(|end| eye.depth(end) - near)) else { return Vec::new() };
    let [from, to] = before.map(|end| eye.project(end));
    let inside = within([0.0, 1.0], from.x - low.x, to.x - low.x)
        .and_then(|part| within(part, high.x - from.x, high.x - to.x))
        .and_then(|part| within(part, from.y - low.y, to.y - low.y))
        .and_then(|part| within(part, high.y - from.y, high.y - to.y));
    let Some([start, end]) = inside.map(|part| part.map(|place| from.lerp(to, place))) else { return Vec::new() };
    let count = (start.distance(end) / STEP).ceil().max(1.0) as u32;
    let at = |place: f64| start.lerp(end, place / f64::from(count));
    // Looked at in their middles: the ends lie on other edges.
    let is_visible = |piece: u32| is_visible(&eye.ray(at(f64::from(piece) + 0.5)));
    let mut lines = Vec::new();
    let mut open = None;
    for piece in 0..=count {
        match (piece < count && is_visible(piece), open) {
            (true, None) => open = Some(piece),
            (false, Some(first)) => {
                lines.push([at(first.into()), at(piece.into())]);
                open = None;
            }
            _ => {}
        }
    }
    lines
}

/// The part of a segment before something that its ends are so far from.
pub(crate) fn part_before(segment: &[DVec3; 2], [first, last]: [f64; 2]) -> Option<[DVec3; 2]> {
    within([0.0, 1.0], first, last).map(|part| part.map(|place| segment[0].lerp(segment[1], place)))
}

/// The part of a range in which a linear function that has these values at 0 and at 1 is not negative.
fn within([enter, leave]: [f64; 2], first: f64, last: f64) -> Option<[f64; 2]> {
    let root = first / (first - last);
    let (enter, leave) = match (first >= 0.0, last >= 0.0) {
        (true, true) => (enter, leave),
        (true, false) => (enter, leave.min(root)),
        (false, true) => (enter.max(root), leave),
        (false, false) => return None,
    };
    (enter < leave).then_some([enter, leave])
}

/// How far along a ray the point is that is nearest to a segment's line.
pub(crate) fn distance_along(ray: &Ray, [from, to]: &[DVec3; 2]) -> f64 {
    let (along, offset) = ((to - from).normalize_or_zero(), from - ray.origin);
    let cosine = ray.direction.dot(along);
    let sine = 1.0 - cosine * cosine;
    // A line that points at the eye is one point of the picture: its nearest end.
    if sine < 1e-12 { ray.direction.dot(offset) } else { (ray.direction - along * cosine).dot(offset) / sine }
}

#[cfg(test)]
pub(crate) mod tests {
    use scene::{Bvh, Camera};

    use super::*;
    use crate::path_trace::test_scenes::{grey, scene_of};

    pub fn square(z: f64, half: f64) -> Vec<DVec3> {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| DVec3::new(x * half, y * half, z)).to_vec()
    }

    pub fn length(lines: &[VisibleLine]) -> f64 {
        lines.iter().map(|[from, to]| from.distance(*to)).sum()
    }

    #[test]
    fn what_is_behind_the_eye_beside_the_picture_or_of_no_length_is_not_seen() {
        let scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0))]);
        let bvh = Bvh::of_scene(&scene);
        let camera = Camera { eye: DVec3::Z * 2.0, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 0.5 };
        let eye = Eye::new(&scene, &bvh, camera, 100, 100);
        let seen = |from: [f64; 3], to: [f64; 3]| length(&visible_lines(&eye, &[[from.into(), to.into()]]));
        assert_eq!(seen([0., 0., 3.], [1., 0., 3.]), 0.0);
        assert_eq!(seen([9., 0., 0.], [9., 1., 0.]), 0.0);
        assert_eq!(seen([0.1, 0., 0.], [0.1, 0., 0.]), 0.0);
        assert_eq!(seen([-0.1, 0., -1.], [0.1, 0., -1.]), 0.0, "hidden by the square");
        assert!(seen([-0.1, 0., 1.], [0.1, 0., 1.]) > 10.0);
        assert!(seen([0.1, 0., 3.], [0.1, 0., 0.]) > 1.0, "the part before the eye");
    }

    #[test]
    fn a_squares_outline_is_seen_where_nothing_hides_it() {
        // A small square before a large one, whose edges run out of the picture.
        let scene = scene_of(&[(square(0.0, 1.0), grey(0.5, 0.0)), (square(0.5, 0.1), grey(0.5, 0.0))]);
        let bvh = Bvh::of_scene(&scene);
        let vertical_fov = 2.0 * 0.25f64.atan();
        let camera = Camera { eye: DVec3::Z * 2.0, target: DVec3::ZERO, up: DVec3::Y, vertical_fov };
        let eye = Eye::new(&scene, &bvh, camera, 150, 150);
        // At a distance of 1.5 the picture is 0.75 wide.
        let lines = visible_lines(&eye, &object_edges(&eye));
        assert!((length(&lines) - 4.0 * 0.2 * 200.0).abs() < 1e-6, "{lines:?}");
        let behind = Camera { target: DVec3::new(0.0, 1.0, 0.0), ..camera };
        let eye = Eye::new(&scene, &bvh, behind, 150, 150);
        assert!(length(&visible_lines(&eye, &object_edges(&eye))) > 100.0);
    }
}
