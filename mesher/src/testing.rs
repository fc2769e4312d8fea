//! Rooms with random leaves, for the tests of this crate.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use scene::{Material, Polygon, Scene};

use crate::{Leaf, LeafSegment};

/// A room whose faces look inward and share edges, and the leaves of all of them.
#[derive(Clone, Debug)]
pub(crate) struct Room {
    pub(crate) scene: Scene,
    pub(crate) leaves: Vec<Leaf>,
}

/// A scene of polygons given by their corners.
pub(crate) fn scene_of(outlines: &[Vec<DVec3>]) -> Scene {
    let mut scene = Scene { materials: vec![Material::grey("grey")], objects: vec!["room".into()], ..Scene::default() };
    for outline in outlines {
        let first_corner = scene.corners.len() as u32;
        for &corner in outline {
            scene.corners.push(scene.vertices.len() as u32);
            scene.vertices.push(corner);
        }
        scene.polygons.push(Polygon { first_corner, corner_count: outline.len() as u32, material: 0, object: 0 });
    }
    scene
}

/// A rectangle: origin and two edges.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Rectangle {
    fn at(&self, point: DVec2) -> DVec3 {
        self.origin + self.u * point.x + self.v * point.y
    }

    fn outline(&self, low: DVec2, high: DVec2) -> Vec<DVec3> {
        [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)].map(|corner| self.at(corner)).to_vec()
    }
}

/// The inner faces of a box; the floor is two polygons, so that its edges meet the middle of walls' edges.
fn faces(origin: DVec3, size: DVec3) -> Vec<Rectangle> {
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let far = origin + size;
    vec![
        Rectangle { origin, u: x * 0.37, v: y },
        Rectangle { origin: origin + x * 0.37, u: x * 0.63, v: y },
        Rectangle { origin: far, u: -y, v: -x },
        Rectangle { origin, u: y, v: z },
        Rectangle { origin: far, u: -z, v: -y },
        Rectangle { origin, u: z, v: x },
        Rectangle { origin: far, u: -x, v: -z },
    ]
}

/// A random room: every face a random quadtree, crossed by random lines, of which every leaf keeps some.
pub(crate) fn room() -> impl Strategy<Value = Room> {
    let lines = prop::collection::vec((0u32..7, prop::array::uniform4(-0.2..1.2f64)), 0..20);
    let splits = prop::collection::vec(any::<bool>(), 60);
    let keeps = prop::collection::vec(prop::bool::weighted(0.7), 97);
    (splits, lines, keeps, -3..3i32, prop::array::uniform3(-1.0..1.0f64)).prop_map(
        |(splits, lines, keeps, exponent, offset)| {
            let scale = 10f64.powi(exponent);
            let size = DVec3::new(3.1, 4.7, 2.3) * scale;
            let faces = faces(DVec3::from(offset) * scale * 5.0, size);
            let scene = scene_of(&faces.iter().map(|face| face.outline(DVec2::ZERO, DVec2::ONE)).collect::<Vec<_>>());
            let mut leaves = Vec::new();
            let mut decisions = splits.iter().cycle();
            for (polygon, face) in (0..).zip(&faces) {
                let mut cells = vec![(DVec2::ZERO, DVec2::ONE, 0)];
                while let Some((low, high, depth)) = cells.pop() {
                    if depth < 3 && decisions.next().copied().unwrap_or(false) {
                        let middle = (low + high) / 2.0;
                        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                            let corner = low + (middle - low) * DVec2::new(x, y);
                            cells.push((corner, corner + (middle - low), depth + 1));
                        }
                        continue;
                    }
                    let mut leaf = Leaf {
                        element: leaves.len() as u32 + 100,
                        polygon,
                        outline: face.outline(low, high),
                        segments: Vec::new(),
                    };
                    for (line, (receiver, [ax, ay, bx, by])) in (0..).zip(&lines) {
                        let keep = keeps[(leaves.len() * 31 + line as usize * 7) % keeps.len()];
                        let segment = [DVec2::new(*ax, *ay), DVec2::new(*bx, *by)];
                        if *receiver == polygon
                            && keep
                            && let Some(ends) = clip(segment, low, high)
                        {
                            leaf.segments.push(LeafSegment { ends: ends.map(|end| face.at(end)), line });
                        }
                    }
                    leaves.push(leaf);
                }
            }
            Room { scene, leaves }
        },
    )
}

/// The part of a segment inside a rectangle (Liang and Barsky).
fn clip([a, b]: [DVec2; 2], low: DVec2, high: DVec2) -> Option<[DVec2; 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let along = b[axis] - a[axis];
        let (mut near, mut far) = ((low[axis] - a[axis]) / along, (high[axis] - a[axis]) / along);
        if near > far {
            std::mem::swap(&mut near, &mut far);
        }
        from = from.max(near);
        to = to.min(far);
    }
    (from < to).then(|| [a.lerp(b, from), a.lerp(b, to)])
}
