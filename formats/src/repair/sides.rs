//! Two-sided surfaces: polygons whose winding says nothing get the other side that the file leaves out.

use glam::DVec3;
use scene::{HalfEdges, NO_TWIN, Polygon, Scene, other_sides};

/// Most lamps that a closed shell is asked about: what holds a lamp or a camera is a room and no solid. A room of more
/// lamps than that has one of them near each of its ends.
const MOST_LAMPS: usize = 256;

/// How many polygons got another side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct OtherSides {
    /// All of them.
    pub added: usize,
    /// Those that emit, and now do so on both sides.
    pub emitting: usize,
}

/// Adds the other side of every polygon that has none and is not part of a closed, consistently wound shell with its
/// fronts where they are seen from: a solid with its fronts outwards, or a room around a lamp or a camera of the first
/// `cameras`, with its fronts inwards.
pub(crate) fn add_other_sides(scene: &mut Scene, cameras: usize) -> OtherSides {
    let (shells, known) = (Shells::of(scene), other_sides(scene));
    let within = shells.around(scene, &places(scene, cameras));
    let mut counts = OtherSides::default();
    for polygon in scene.polygon_ids() {
        let shell = shells.of_polygon[polygon as usize] as usize;
        let outwards = shells.volumes[shell] > 0.0;
        let trusted = shells.closed[shell] && outwards != within[shell];
        if trusted || known[polygon as usize].is_some() {
            continue;
        }
        let record = scene.polygons[polygon as usize];
        let first_corner = scene.corners.len() as u32;
        scene.corners.extend_from_within(record.corner_range());
        scene.corners[first_corner as usize..].reverse();
        scene.polygons.push(Polygon { first_corner, ..record });
        counts.added += 1;
        counts.emitting += usize::from(scene.material(polygon).emits());
    }
    counts
}

/// Where cameras stand, and lamps, with the polygon that is the lamp.
fn places(scene: &Scene, cameras: usize) -> Vec<(DVec3, Option<u32>)> {
    let emitters: Vec<u32> = scene.emitters().collect();
    let step = emitters.len().div_ceil(MOST_LAMPS).max(1);
    let lamps =
        emitters.into_iter().step_by(step).map(|polygon| (scene::centroid(&scene.outline(polygon)), Some(polygon)));
    scene.cameras.iter().take(cameras).map(|named| (named.camera.eye, None)).chain(lamps).collect()
}

/// Polygons joined edge to edge.
struct Shells {
    of_polygon: Vec<u32>,
    /// Polygons by shell.
    polygons: Vec<Vec<u32>>,
    /// Whether every edge has a neighbour that agrees.
    closed: Vec<bool>,
    /// Volume inside, m³, positive where fronts look outwards; of no meaning unless closed.
    volumes: Vec<f64>,
}

impl Shells {
    fn of(scene: &Scene) -> Self {
        let edges = HalfEdges::new(scene);
        let mut shells = Self {
            of_polygon: vec![u32::MAX; scene.polygons.len()],
            polygons: vec![],
            closed: vec![],
            volumes: vec![],
        };
        for start in scene.polygon_ids() {
            if shells.of_polygon[start as usize] != u32::MAX {
                continue;
            }
            let shell = shells.polygons.len() as u32;
            shells.of_polygon[start as usize] = shell;
            let (mut polygons, mut next, mut closed, mut volume) = (vec![start], 0, true, 0.0);
            let origin = scene.outline(start)[0];
            while let Some(&polygon) = polygons.get(next) {
                next += 1;
                let outline = scene.outline(polygon);
                volume += scene::area_vector(&outline).dot(outline[0] - origin) / 3.0;
                for half_edge in scene.polygons[polygon as usize].corner_range() {
                    let twin = edges.twin[half_edge];
                    if twin == NO_TWIN {
                        closed = false;
                        continue;
                    }
                    let other = edges.polygon[twin as usize];
                    if shells.of_polygon[other as usize] == u32::MAX {
                        shells.of_polygon[other as usize] = shell;
                        polygons.push(other);
                    }
                }
            }
            shells.polygons.push(polygons);
            shells.closed.push(closed);
            shells.volumes.push(volume);
        }
        shells
    }

    /// By shell, whether it is closed around any of the places; not around a lamp that is itself part of it.
    fn around(&self, scene: &Scene, places: &[(DVec3, Option<u32>)]) -> Vec<bool> {
        let holds = |(polygons, &closed): (&Vec<u32>, &bool)| {
            let corners = || polygons.iter().flat_map(|&polygon| scene.outline(polygon));
            let (low, high) = (corners().reduce(DVec3::min), corners().reduce(DVec3::max));
            let (Some(low), Some(high), true) = (low, high, closed) else { return false };
            places.iter().any(|&(place, lamp)| {
                let own =
                    lamp.is_some_and(|lamp| self.of_polygon[lamp as usize] == self.of_polygon[polygons[0] as usize]);
                !own && place.cmpgt(low).all() && place.cmplt(high).all() && turns_around(scene, polygons, place)
            })
        };
        self.polygons.iter().zip(&self.closed).map(holds).collect()
    }
}

/// Whether polygons fill more than half of the sphere of directions around a point (Van Oosterom and Strackee, "The
/// solid angle of a plane triangle", 1983): all of it inside a closed shell, nothing outside.
fn turns_around(scene: &Scene, polygons: &[u32], place: DVec3) -> bool {
    let solid_angle = |&polygon: &u32| {
        let outline: Vec<DVec3> = scene.outline(polygon).iter().map(|&corner| corner - place).collect();
        let fan = outline[1..].windows(2).map(|pair| {
            let (a, b, c) = (outline[0], pair[0], pair[1]);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(below)
        });
        fan.sum::<f64>()
    };
    polygons.iter().map(solid_angle).sum::<f64>().abs() > 2.0 * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use scene::Material;

    use super::*;

    const CUBE: [[u32; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

    /// The sides of cubes by size, each around (½, ½, ½) and with its fronts outwards or inwards, and of which material.
    fn cubes(cubes: &[(f64, bool, &[usize], u32)]) -> Scene {
        let mut scene = Scene {
            materials: vec![Material::grey("grey"), Material { radiance: DVec3::ONE, ..Material::grey("lamp") }],
            objects: vec![String::new()],
            ..Scene::default()
        };
        for &(size, outwards, sides, material) in cubes {
            let first = scene.vertices.len() as u32;
            for z in [-0.5, 0.5] {
                let base = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
                scene.vertices.extend(base.map(|(x, y)| DVec3::splat(0.5) + size * DVec3::new(x, y, z)));
            }
            for &side in sides {
                let mut corners = CUBE[side].map(|vertex| first + vertex);
                if !outwards {
                    corners.reverse();
                }
                let first_corner = scene.corners.len() as u32;
                scene.polygons.push(Polygon { first_corner, corner_count: 4, material, object: 0 });
                scene.corners.extend(corners);
            }
        }
        scene
    }

    const ALL: &[usize] = &[0, 1, 2, 3, 4, 5];

    #[test]
    fn nothing_stays_nothing() {
        assert_eq!(add_other_sides(&mut Scene::default(), 0), OtherSides::default());
    }

    #[test]
    fn sheets_get_their_other_side_once() {
        let mut scene = cubes(&[(1.0, true, &[0, 1, 2], 0)]);
        assert_eq!(add_other_sides(&mut scene, 0), OtherSides { added: 3, emitting: 0 });
        assert_eq!(scene.validate(), Ok(()));
        for polygon in 0..3 {
            assert_eq!(scene.plane(polygon).normal, -scene.plane(polygon + 3).normal);
        }
        assert_eq!(add_other_sides(&mut scene, 0), OtherSides::default());
    }

    #[test]
    fn a_bulb_is_a_solid_though_it_is_a_lamp() {
        assert_eq!(add_other_sides(&mut cubes(&[(1.0, true, ALL, 1)]), 0), OtherSides::default());
    }

    #[test]
    fn solids_and_rooms_stay_and_what_is_inside_out_does_not() {
        // A solid; the same inside out; a room around a lamp; the same inside out.
        for (shell, added) in [(true, 0), (false, 6)] {
            assert_eq!(add_other_sides(&mut cubes(&[(1.0, shell, ALL, 0)]), 0).added, added);
            let mut room = cubes(&[(1.0, !shell, ALL, 0), (0.2, true, &[0], 1)]);
            assert_eq!(add_other_sides(&mut room, 0), OtherSides { added: added + 1, emitting: 1 });
        }
    }
}
