//! Two-sided surfaces: polygons whose winding says nothing get the other side that the file leaves out.

use std::collections::BTreeMap;

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
    /// Those that emit, and now do so on both sides, though no file says so.
    pub doubtful_lamps: usize,
}

/// Adds the other side of polygons that have none, reversed in all that their corners have.
///
/// `said` is what files say of materials, and decides where they do: two sides or one. If no winding is `doubted`, that is
/// all. If it is, all other polygons get one that are not part of a closed, consistently wound shell with its fronts where
/// they are seen from: a solid with its fronts outwards, or a room around a lamp or a camera, with its fronts inwards. The
/// inside of such a solid gets none, whatever is said: no light enters, and nobody looks. Modellers call all they make two-sided.
pub(crate) fn add_other_sides(scene: &mut Scene, doubted: bool, said: &BTreeMap<u32, bool>) -> OtherSides {
    let mut counts = OtherSides::default();
    if !doubted && !said.values().any(|&two_sided| two_sided) {
        return counts;
    }
    let known = other_sides(scene);
    let wound = wound(scene);
    for polygon in scene.polygon_ids() {
        let wound = wound[polygon as usize];
        let word = said.get(&scene.polygons[polygon as usize].material).copied();
        let lacks = word.unwrap_or(doubted && wound == Wound::Anyhow) && wound != Wound::AroundSolid;
        if !lacks || known[polygon as usize].is_some() {
            continue;
        }
        add_other_side(scene, polygon);
        counts.added += 1;
        counts.doubtful_lamps += usize::from(word.is_none() && scene.material(polygon).emits());
    }
    counts
}

fn add_other_side(scene: &mut Scene, polygon: u32) {
    let record = scene.polygons[polygon as usize];
    let (range, first_corner) = (record.corner_range(), scene.corners.len());
    scene.corners.extend_from_within(range.clone());
    scene.corners[first_corner..].reverse();
    // Lists that say nothing are empty.
    if !scene.texture_coordinates.is_empty() {
        scene.texture_coordinates.extend_from_within(range.clone());
        scene.texture_coordinates[first_corner..].reverse();
    }
    if !scene.shading_normals.is_empty() {
        scene.shading_normals.extend_from_within(range);
        scene.shading_normals[first_corner..].reverse();
        scene.shading_normals[first_corner..].iter_mut().for_each(|normal| *normal = -*normal);
    }
    if let Some(&tint) = scene.tints.get(polygon as usize) {
        scene.tints.push(tint);
    }
    scene.polygons.push(Polygon { first_corner: first_corner as u32, ..record });
}

/// What is known of a polygon's winding.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wound {
    /// Nothing.
    Anyhow,
    /// It is part of a closed solid, its front to the outside.
    AroundSolid,
    /// It is part of a closed room around a lamp or a camera, its front to the inside.
    AroundRoom,
}

fn wound(scene: &Scene) -> Vec<Wound> {
    let shells = Shells::of(scene);
    let within = shells.around(scene, &places(scene));
    let of_shell = |shell: usize| match (shells.closed[shell], shells.volumes[shell] > 0.0, within[shell]) {
        (true, true, false) => Wound::AroundSolid,
        (true, false, true) => Wound::AroundRoom,
        _ => Wound::Anyhow,
    };
    shells.of_polygon.iter().map(|&shell| of_shell(shell as usize)).collect()
}

/// Where cameras stand, and lamps, with the polygon that is the lamp.
fn places(scene: &Scene) -> Vec<(DVec3, Option<u32>)> {
    let emitters: Vec<u32> = scene.emitters().collect();
    let step = emitters.len().div_ceil(MOST_LAMPS).max(1);
    let lamps =
        emitters.into_iter().step_by(step).map(|polygon| (scene::centroid(&scene.outline(polygon)), Some(polygon)));
    scene.cameras.iter().map(|named| (named.camera.eye, None)).chain(lamps).collect()
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
    use glam::{Vec2, Vec3};
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

    fn doubted(scene: &mut Scene) -> OtherSides {
        add_other_sides(scene, true, &BTreeMap::new())
    }

    const ALL: &[usize] = &[0, 1, 2, 3, 4, 5];

    #[test]
    fn nothing_stays_nothing() {
        assert_eq!(doubted(&mut Scene::default()), OtherSides::default());
    }

    #[test]
    fn sheets_get_their_other_side_once() {
        let mut scene = cubes(&[(1.0, true, &[0, 1, 2], 0)]);
        assert_eq!(doubted(&mut scene), OtherSides { added: 3, doubtful_lamps: 0 });
        assert_eq!(scene.validate(), Ok(()));
        for polygon in 0..3 {
            assert_eq!(scene.plane(polygon).normal, -scene.plane(polygon + 3).normal);
        }
        assert_eq!(doubted(&mut scene), OtherSides::default());
    }

    #[test]
    fn a_bulb_is_a_solid_though_it_is_a_lamp() {
        assert_eq!(doubted(&mut cubes(&[(1.0, true, ALL, 1)])), OtherSides::default());
    }

    #[test]
    fn solids_and_rooms_stay_and_what_is_inside_out_does_not() {
        // A solid; the same inside out; a room around a lamp; the same inside out.
        for (shell, added) in [(true, 0), (false, 6)] {
            assert_eq!(doubted(&mut cubes(&[(1.0, shell, ALL, 0)])).added, added);
            let mut room = cubes(&[(1.0, !shell, ALL, 0), (0.2, true, &[0], 1)]);
            assert_eq!(doubted(&mut room), OtherSides { added: added + 1, doubtful_lamps: 1 });
        }
    }
    /// Sheets and a solid of paint, and a lamp outside of it: the file's word on a material stands above all doubt, but for
    /// the inside of the solid.
    #[test]
    fn what_the_file_says_of_a_material_decides() {
        let scene = || cubes(&[(1.0, true, &[0, 1], 0), (0.2, true, ALL, 0), (0.4, true, &[0], 1)]);
        let added = |doubted: bool, said: &[(u32, bool)]| {
            add_other_sides(&mut scene(), doubted, &said.iter().copied().collect())
        };
        let sides = |added, doubtful_lamps| OtherSides { added, doubtful_lamps };
        assert_eq!(added(false, &[]), sides(0, 0));
        assert_eq!(added(false, &[(0, false)]), sides(0, 0));
        assert_eq!(added(false, &[(1, true)]), sides(1, 0));
        assert_eq!(added(false, &[(0, true), (1, false)]), sides(2, 0));
        assert_eq!(added(true, &[]), sides(3, 1));
        assert_eq!(added(true, &[(1, false)]), sides(2, 0));
        assert_eq!(added(true, &[(0, true)]), sides(3, 1));
        assert_eq!(added(true, &[(0, false), (1, true)]), sides(1, 0));
    }

    #[test]
    fn an_other_side_has_the_same_texture_and_the_opposite_normals() {
        let mut scene = cubes(&[(1.0, true, &[0, 1], 0)]);
        scene.texture_coordinates = (0..8).map(|i| Vec2::splat(i as f32)).collect();
        scene.shading_normals = (0..8).map(|i| if i == 5 { Vec3::ZERO } else { Vec3::Z }).collect();
        scene.tints = vec![DVec3::splat(0.25), DVec3::splat(0.5)];
        let said = BTreeMap::from([(0, true)]);
        assert_eq!(add_other_sides(&mut scene, false, &said), OtherSides { added: 2, doubtful_lamps: 0 });
        assert_eq!(scene.validate(), Ok(()));
        for (front, back) in [(0..4, 8..12), (4..8, 12..16)] {
            for (front, back) in front.zip(back.rev()) {
                assert_eq!(scene.corners[front], scene.corners[back]);
                assert_eq!(scene.texture_coordinates[front], scene.texture_coordinates[back]);
                assert_eq!(scene.shading_normals[front], -scene.shading_normals[back]);
            }
        }
        assert_eq!(scene.tints[2..], [DVec3::splat(0.25), DVec3::splat(0.5)]);
        assert_eq!(add_other_sides(&mut scene, false, &said), OtherSides::default());
    }
}
