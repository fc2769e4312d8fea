//! Emitters as sources: single polygons, and convex bodies that emit the same all over. From outside such a body looks like its
//! outline, evenly bright; so a bulb of hundreds of triangles is one source.

use glam::{DVec2, DVec3};
use scene::{HalfEdges, NO_TWIN, Plane, Scene, luminance};

use crate::backprojection::BlockerCone;
use crate::light_tree::{Light, LightTree};

/// How far a corner may rise over the plane of a face, as a fraction of the body's diagonal: the digits that files keep bend
/// round bodies by about as much. Larger takes dents for convex.
const BENT: f64 = 1e-3;

/// Something that emits.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Its polygons, ascending.
    pub polygons: Vec<u32>,
    /// Corners, metres, if it is a body.
    pub body: Vec<DVec3>,
}

/// What emits in a scene, by the first polygon of each.
pub fn emitters(scene: &Scene) -> Vec<Emitter> {
    let half_edges = HalfEdges::new(scene);
    let mut visited = vec![false; scene.polygons.len()];
    let mut emitters = Vec::new();
    for first in scene.emitters() {
        if visited[first as usize] {
            continue;
        }
        let exitance = scene.material(first).exitance();
        let (mut polygons, mut open) = (Vec::new(), vec![first]);
        while let Some(polygon) = open.pop() {
            let like = scene.material(polygon).exitance() == exitance;
            if !like || std::mem::replace(&mut visited[polygon as usize], true) {
                continue;
            }
            polygons.push(polygon);
            let edges = scene.polygons[polygon as usize].corner_range();
            open.extend(edges.filter_map(|edge| half_edges.neighbour(edge as u32)));
        }
        polygons.sort_unstable();
        match body(scene, &half_edges, &polygons) {
            Some(body) => emitters.push(Emitter { polygons, body }),
            None => {
                let single = |polygon| Emitter { polygons: vec![polygon], body: Vec::new() };
                emitters.extend(polygons.into_iter().map(single));
            }
        }
    }
    emitters.sort_by_key(|emitter| emitter.polygons[0]);
    emitters
}

/// The hierarchy over emitters, whose lights are numbered as these and whose surfaces are polygons.
pub fn emitter_tree(scene: &Scene, emitters: &[Emitter]) -> LightTree {
    let power = |polygon: u32| luminance(scene.material(polygon).exitance()) * scene.area(polygon);
    let light = |emitter: &Emitter| {
        if emitter.body.is_empty() {
            let polygon = emitter.polygons[0];
            return Light::of_outline(&scene.outline(polygon), scene.plane(polygon).normal, polygon, power(polygon));
        }
        let low = emitter.body.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = emitter.body.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let surfaces = emitter.polygons.iter().map(|&polygon| (polygon, power(polygon))).collect();
        Light { low, high, axis: None, surfaces }
    };
    LightTree::new(&emitters.iter().map(light).collect::<Vec<Light>>())
}

/// The corners of the convex body that polygons close; none if they do not.
fn body(scene: &Scene, half_edges: &HalfEdges, polygons: &[u32]) -> Option<Vec<DVec3>> {
    if polygons.len() < 4 {
        return None;
    }
    let edges = || polygons.iter().flat_map(|&polygon| scene.polygons[polygon as usize].corner_range());
    let inside = |edge: usize| {
        half_edges.twin[edge] != NO_TWIN
            && polygons.binary_search(&half_edges.polygon[half_edges.twin[edge] as usize]).is_ok()
    };
    if !edges().all(inside) {
        return None;
    }
    let mut ids: Vec<u32> = edges().map(|edge| scene.corners[edge]).collect();
    ids.sort_unstable();
    ids.dedup();
    let corners: Vec<DVec3> = ids.into_iter().map(|id| scene.vertices[id as usize]).collect();
    let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let bent = BENT * (high - low).length();
    let holds = |plane: Plane| corners.iter().all(|&corner| plane.distance(corner) <= bent);
    polygons.iter().all(|&polygon| holds(scene.plane(polygon))).then_some(corners)
}

/// The outline of a convex body as seen from a point outside: the hull of the directions to its corners. None from so near
/// that they do not lie in one half space, or inside.
pub fn outline_of(body: &[DVec3], position: DVec3) -> Option<BlockerCone> {
    let middle = body.iter().sum::<DVec3>() / body.len().max(1) as f64;
    let axis = (middle - position).try_normalize()?;
    let (x, y) = axis.any_orthonormal_pair();
    let mut points: Vec<(DVec2, DVec3)> = Vec::with_capacity(body.len());
    for corner in body {
        let way = corner - position;
        let depth = axis.dot(way);
        if depth <= 0.0 {
            return None;
        }
        points.push((DVec2::new(x.dot(way), y.dot(way)) / depth, way));
    }
    points.sort_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    // The monotone chain (Andrew 1979).
    let mut hull: Vec<(DVec2, DVec3)> = Vec::new();
    for half in [&mut points.iter() as &mut dyn Iterator<Item = &(DVec2, DVec3)>, &mut points.iter().rev()] {
        let start = hull.len();
        for &point in half {
            while let [.., (a, _), (b, _)] = hull[start..]
                && (b - a).perp_dot(point.0 - a) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
    }
    BlockerCone::new(hull.into_iter().map(|(_, way)| way).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::form_factor_at;
    use crate::testing::Builder;

    #[test]
    fn lamps_that_are_no_bodies_are_their_polygons() {
        assert_eq!(emitters(&Scene::default()), []);
        let open = Builder::default().material(0.0, 1.0).sides(
            DVec3::ZERO,
            DVec3::ONE,
            false,
            [true, true, true, true, false, true],
        );
        assert_eq!(emitters(&open.build()).len(), 5);
        // A room that emits is no body seen from outside.
        let room = Builder::default().material(0.0, 1.0).cuboid([0.0; 3], [1.0, 2.0, 3.0], true).build();
        assert_eq!(emitters(&room).len(), 6);
    }

    #[test]
    fn a_box_that_emits_is_one_and_sends_what_its_faces_do() {
        let scene = Builder::default().material(0.0, 1.0).cuboid([0.0; 3], [1.0, 2.0, 3.0], false).build();
        let emitters = emitters(&scene);
        assert_eq!((emitters.len(), emitters[0].body.len()), (1, 8));
        let (position, up) = (DVec3::new(-1.5, 3.2, -0.4), DVec3::new(0.6, -0.64, 0.48));
        let faces = scene.polygon_ids().filter(|&face| scene.plane(face).distance(position) > 0.0);
        let sum: f64 = faces.map(|face| form_factor_at(position, up, &scene.outline(face))).sum();
        let outline = outline_of(&emitters[0].body, position).expect("the point is outside");
        let places: Vec<DVec3> = outline.corners().iter().map(|way| position + way).collect();
        assert!((form_factor_at(position, up, &places) - sum).abs() < 1e-12 && sum > 0.05);
        assert!(outline_of(&emitters[0].body, DVec3::new(0.5, 0.9, 1.0)).is_none());
    }
}
