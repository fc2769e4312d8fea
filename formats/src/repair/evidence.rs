//! Evidence of surfaces that face the wrong way: what the lamps shine on, and what the file's cameras see.

use glam::{DVec2, DVec3};
use scene::{Bvh, Ray, Scene, luminance, other_sides};

use crate::report::ImportReport;

/// Rays along each side of a camera's square picture; 400 rays tell a share of a fifth to within 2 %.
const PICTURE: u32 = 20;

/// Most cameras that are asked.
const MOST_CAMERAS: usize = 16;

/// Most lamps that are asked, and rays from either side of each: a second of nobody's time.
const MOST_LAMPS: usize = 256;
const RAYS: u32 = 64;

/// Share of what cameras see that may be backs: whole scenes are at half a per cent, scenes with single sheets turned at
/// some per cent, scenes wound at random at half.
const BACKS_SEEN: f64 = 0.2;

/// Share of the lamps' light that must meet fronts, where lamps see anything but the sky.
const LIGHT_USED: f64 = 0.5;

/// What rays met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Met {
    fronts: f64,
    backs: f64,
    nothing: f64,
}

impl Met {
    fn add(&mut self, met: Self, weight: f64) {
        self.fronts += met.fronts * weight;
        self.backs += met.backs * weight;
        self.nothing += met.nothing * weight;
    }

    fn all(&self) -> f64 {
        self.fronts + self.backs + self.nothing
    }
}

/// Warns where rays from the first `cameras` of the scene's cameras, or from its lamps, say that faces are the wrong way
/// round.
pub(crate) fn warn_of_winding(scene: &Scene, cameras: usize, report: &mut ImportReport) {
    let witness = Witness { scene, bvh: Bvh::of_scene(scene), other_sides: other_sides(scene) };
    let seen = witness.cameras(cameras);
    let solid = seen.fronts + seen.backs;
    if seen.backs > BACKS_SEEN * solid {
        report.warn(format!(
            "{:.0} % of what the cameras see are backs, which are black: the faces are wound the wrong way round; give \
             --two-sided, or turn them in the modeller",
            100.0 * seen.backs / solid
        ));
    }
    let [before, behind] = witness.lamps();
    let used = before.fronts / before.all();
    let wasted = before.backs > before.fronts || behind.fronts > before.fronts;
    if before.all() > 0.0 && used < LIGHT_USED && wasted {
        report.warn(format!(
            "{:.0} % of the light that lamps send meets the backs of faces or nothing at all: lamps or faces are wound the \
             wrong way round; give --two-sided, or turn them in the modeller",
            100.0 * (1.0 - used)
        ));
    }
}

struct Witness<'a> {
    scene: &'a Scene,
    bvh: Bvh,
    other_sides: Vec<Option<u32>>,
}

impl Witness<'_> {
    fn cameras(&self, count: usize) -> Met {
        let mut seen = Met::default();
        for named in self.scene.cameras.iter().take(count.min(MOST_CAMERAS)) {
            for (x, y) in (0..PICTURE).flat_map(|x| (0..PICTURE).map(move |y| (x, y))) {
                let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                seen.add(self.meets(&named.camera.ray(pixel, PICTURE, PICTURE), None), 1.0);
            }
        }
        seen
    }

    /// What the light of lamps meets that they send from their fronts, and what it would meet from their backs, W.
    fn lamps(&self) -> [Met; 2] {
        let emitters: Vec<u32> = self.scene.emitters().collect();
        let mut met = [Met::default(); 2];
        for &polygon in emitters.iter().step_by(emitters.len().div_ceil(MOST_LAMPS).max(1)) {
            let outline = self.scene.outline(polygon);
            let normal = self.scene.plane(polygon).normal;
            let (u, v) = normal.any_orthonormal_pair();
            let power = self.scene.area(polygon) * luminance(self.scene.material(polygon).exitance());
            for ray in 0..RAYS {
                let origin = point_of(&outline, ray);
                // Directions spread by their cosine.
                let [a, b] = spread(ray);
                let (sin, cos) = (std::f64::consts::TAU * a).sin_cos();
                let flat = (u * cos + v * sin) * b.sqrt();
                for (met, side) in met.iter_mut().zip([normal, -normal]) {
                    let direction = flat + side * (1.0 - b).sqrt();
                    met.add(self.meets(&Ray { origin, direction }, Some(polygon)), power / f64::from(RAYS));
                }
            }
        }
        met
    }

    /// A polygon that has its other side in the scene has no back.
    fn meets(&self, ray: &Ray, from: Option<u32>) -> Met {
        let behind = from.and_then(|polygon| self.other_sides[polygon as usize]);
        match self.bvh.closest_hit_among(ray, |id| Some(id) != from && Some(id) != behind) {
            None => Met { nothing: 1.0, ..Met::default() },
            Some(hit) if hit.normal.dot(ray.direction) < 0.0 || self.other_sides[hit.id as usize].is_some() => {
                Met { fronts: 1.0, ..Met::default() }
            }
            Some(_) => Met { backs: 1.0, ..Met::default() },
        }
    }
}

/// The i-th of a sequence that fills the unit square evenly (Roberts, "The unreasonable effectiveness of quasirandom
/// sequences", 2018).
fn spread(i: u32) -> [f64; 2] {
    [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| (0.5 + step * f64::from(i)).fract())
}

/// The i-th of points all over a convex outline; their density does not matter here.
fn point_of(outline: &[DVec3], i: u32) -> DVec3 {
    let fan = i as usize % (outline.len() - 2);
    let [mut s, mut t] = spread(i.wrapping_mul(7).wrapping_add(3));
    if s + t > 1.0 {
        (s, t) = (1.0 - s, 1.0 - t);
    }
    outline[0] * (1.0 - s - t) + outline[fan + 1] * s + outline[fan + 2] * t
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use scene::{Camera, Material, NamedCamera, Polygon};

    use super::*;
    use crate::repair::add_other_sides;

    /// A room of 4 × 4 × 3 m with a lamp below its ceiling; either may be the wrong way round.
    fn room(room_turned: bool, lamp_turned: bool) -> Scene {
        let mut scene = Scene {
            materials: vec![Material::grey("grey"), Material { radiance: DVec3::ONE, ..Material::grey("lamp") }],
            objects: vec![String::new()],
            ..Scene::default()
        };
        for z in [0.0, 3.0] {
            scene.vertices.extend([(0., 0.), (4., 0.), (4., 4.), (0., 4.)].map(|(x, y)| DVec3::new(x, y, z)));
        }
        scene.vertices.extend([(1., 1.), (1., 3.), (3., 3.), (3., 1.)].map(|(x, y)| DVec3::new(x, y, 2.9)));
        let walls = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
            .map(|w| (w, 0, room_turned));
        for (mut corners, material, turned) in walls.into_iter().chain([([8, 9, 10, 11], 1, lamp_turned)]) {
            if turned {
                corners.reverse();
            }
            let first_corner = scene.corners.len() as u32;
            scene.polygons.push(Polygon { first_corner, corner_count: 4, material, object: 0 });
            scene.corners.extend(corners);
        }
        scene.cameras.push(NamedCamera {
            name: "camera".to_owned(),
            camera: Camera { eye: DVec3::ONE, target: DVec3::splat(1.5), up: DVec3::Z, vertical_fov: 1.0 },
        });
        scene
    }

    fn warnings(scene: &Scene, cameras: usize) -> Vec<String> {
        let mut report = ImportReport::default();
        warn_of_winding(scene, cameras, &mut report);
        report.warnings
    }

    #[test]
    fn nothing_and_what_is_right_raise_no_doubt() {
        assert!(warnings(&Scene::default(), 0).is_empty());
        assert_eq!(warnings(&room(false, false), 1), Vec::<String>::new());
    }

    #[test]
    fn lamps_and_cameras_tell_of_what_is_turned_and_the_cure_cures() {
        for (turned, cameras, count) in [((true, false), 1, 2), ((true, false), 0, 1), ((true, true), 0, 1)] {
            let mut scene = room(turned.0, turned.1);
            let said = warnings(&scene, cameras);
            assert!(said.len() == count && said.iter().all(|w| w.contains("--two-sided")), "{turned:?}: {said:?}");
            scene.cameras.truncate(cameras);
            add_other_sides(&mut scene, true, &BTreeMap::new());
            assert_eq!(warnings(&scene, cameras), Vec::<String>::new());
        }
    }

    /// A lamp in the open, which lights the sky and nothing else, is a lamp in the open.
    #[test]
    fn an_open_scene_raises_no_doubt() {
        let mut scene = room(false, false);
        scene.polygons.drain(..6);
        assert_eq!(warnings(&scene, 0), Vec::<String>::new());
    }
}
