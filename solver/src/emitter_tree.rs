//! A hierarchy over emitters: those that are far away, faint or turned away are told from the others together.
//!
//! A hall has lamps by the thousand, of which a point sees a dozen well. All others together send it little, and are looked at as
//! groups, of which a ray tries one emitter (Walter et al., "Lightcuts: A Scalable Approach to Illumination", 2005). What decides
//! is a bound, not a guess: no point of an element has more light from a group than that.

use std::f64::consts::PI;

use glam::DVec3;
use scene::{Plane, Scene, luminance};

use crate::emitter::Emitter;

/// One less the cosine of the angle below which emitters look the same way. A group that does is bounded by where it looks.
const SAME_WAY: f64 = 1e-9;

/// Emitters in a binary tree.
pub struct EmitterTree {
    nodes: Vec<Group>,
    /// Polygons in the order of the tree, each with the power, luminance, W, of all up to and with it.
    polygons: Vec<(u32, f64)>,
}

/// Some emitters.
struct Group {
    low: DVec3,
    high: DVec3,
    /// The way that all look, if it is one.
    axis: Option<DVec3>,
    /// The range of their polygons.
    first: u32,
    end: u32,
    parts: Parts,
}

enum Parts {
    /// Index into the emitters that the tree was built of.
    Emitter(u32),
    Groups([u32; 2]),
}

/// The emitters as an element sees them.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct LampCut {
    /// Emitters to be looked at one by one, ascending.
    pub single: Vec<u32>,
    /// Groups that are faint.
    pub groups: Vec<u32>,
}

impl EmitterTree {
    /// Builds a tree over the emitters of a scene.
    pub fn new(scene: &Scene, emitters: &[Emitter]) -> Self {
        let mut tree = Self { nodes: Vec::new(), polygons: Vec::new() };
        let middle = |emitter: &Emitter| {
            let corners = || emitter.polygons.iter().flat_map(|&polygon| scene.outline(polygon));
            corners().sum::<DVec3>() / corners().count().max(1) as f64
        };
        let mut placed: Vec<(DVec3, u32)> = (0..).zip(emitters).map(|(id, emitter)| (middle(emitter), id)).collect();
        if !placed.is_empty() {
            tree.grow(scene, emitters, &mut placed);
        }
        tree
    }

    /// Adds the group of some emitters, halved across its longest side; its index.
    fn grow(&mut self, scene: &Scene, emitters: &[Emitter], placed: &mut [(DVec3, u32)]) -> u32 {
        let first = self.polygons.len() as u32;
        let index = self.nodes.len() as u32;
        if let [(_, id)] = *placed {
            let (mut low, mut high, mut sum) = (DVec3::INFINITY, DVec3::NEG_INFINITY, self.power_until(first));
            for &polygon in &emitters[id as usize].polygons {
                let outline = scene.outline(polygon);
                low = outline.iter().copied().fold(low, DVec3::min);
                high = outline.iter().copied().fold(high, DVec3::max);
                sum += luminance(scene.material(polygon).exitance()) * scene.area(polygon);
                self.polygons.push((polygon, sum));
            }
            let axis =
                emitters[id as usize].body.is_empty().then(|| scene.plane(emitters[id as usize].polygons[0]).normal);
            let end = self.polygons.len() as u32;
            self.nodes.push(Group { low, high, axis, first, end, parts: Parts::Emitter(id) });
            return index;
        }
        let low = placed.iter().map(|place| place.0).fold(DVec3::INFINITY, DVec3::min);
        let high = placed.iter().map(|place| place.0).fold(DVec3::NEG_INFINITY, DVec3::max);
        let axis = (high - low).max_position();
        placed.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
        // Its parts come after it, and it is known only when they are.
        self.nodes.push(Group { low, high, axis: None, first, end: first, parts: Parts::Emitter(0) });
        let (left, right) = placed.split_at_mut(placed.len() / 2);
        let parts = [self.grow(scene, emitters, left), self.grow(scene, emitters, right)];
        let [a, b] = parts.map(|part| &self.nodes[part as usize]);
        let axis = a.axis.zip(b.axis).filter(|(a, b)| a.dot(*b) >= 1.0 - SAME_WAY).map(|(a, _)| a);
        let (low, high, end) = (a.low.min(b.low), a.high.max(b.high), b.end);
        self.nodes[index as usize] = Group { low, high, axis, first, end, parts: Parts::Groups(parts) };
        index
    }

    /// What an element, given by its outline and plane, sees of the emitters. A group is faint if it sends no more than
    /// `faint`, luminance, W·m⁻², to any point of the element; what is behind the element, or looks away, is in neither list.
    pub fn cut(&self, outline: &[DVec3], plane: &Plane, faint: f64) -> LampCut {
        let mut cut = LampCut::default();
        let mut open: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(index) = open.pop() {
            let most = self.most(index, outline, plane);
            match self.nodes[index as usize].parts {
                _ if most == 0.0 => {}
                _ if most <= faint => cut.groups.push(index),
                Parts::Groups(parts) => open.extend(parts),
                Parts::Emitter(id) => cut.single.push(id),
            }
        }
        cut.single.sort_unstable();
        cut
    }

    /// The most light, luminance, W·m⁻², that any point of an element has from a group, whatever stands between.
    fn most(&self, index: u32, outline: &[DVec3], plane: &Plane) -> f64 {
        let group = &self.nodes[index as usize];
        let height = plane.distance(DVec3::select(plane.normal.cmpgt(DVec3::ZERO), group.high, group.low));
        let reach = group.axis.map_or(f64::INFINITY, |axis| {
            let nearest = axis.dot(DVec3::select(axis.cmpgt(DVec3::ZERO), group.low, group.high));
            outline.iter().map(|corner| axis.dot(*corner)).fold(f64::NEG_INFINITY, f64::max) - nearest
        });
        if height <= 0.0 || reach <= 0.0 {
            return 0.0;
        }
        let low = outline.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = outline.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let square = (group.low - high).max(low - group.high).max(DVec3::ZERO).length_squared();
        let cosines = (height / square.sqrt()).min(1.0) * (reach / square.sqrt()).min(1.0);
        self.power(index) * cosines / (PI * square)
    }

    /// Power of a group, luminance, W.
    pub fn power(&self, group: u32) -> f64 {
        let group = &self.nodes[group as usize];
        self.power_until(group.end) - self.power_until(group.first)
    }

    /// One polygon of a group: `place` in 0..1 goes through all, each as often as its power says.
    pub fn pick(&self, group: u32, place: f64) -> u32 {
        let Group { first, end, .. } = self.nodes[group as usize];
        let polygons = &self.polygons[first as usize..end as usize];
        let wanted = self.power_until(first) + place * self.power(group);
        polygons[polygons.partition_point(|&(_, power)| power <= wanted).min(polygons.len() - 1)].0
    }

    fn power_until(&self, place: u32) -> f64 {
        place.checked_sub(1).map_or(0.0, |last| self.polygons[last as usize].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::emitters;
    use crate::form_factor::form_factor_at;
    use crate::testing::Builder;

    /// A hundred lamps under a ceiling at height 3, facing down.
    fn hall() -> Scene {
        let down = [false, false, false, false, true, false];
        (0..100)
            .fold(Builder::default().material(0.0, 1.0), |hall, i| {
                let low = DVec3::new(f64::from(i % 10) * 4.0, f64::from(i / 10) * 4.0, 3.0);
                hall.sides(low, low + DVec3::new(0.5, 0.5, 0.1), false, down)
            })
            .build()
    }

    fn floor(x: f64, y: f64) -> [DVec3; 4] {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| DVec3::new(x + u, y + v, 0.0))
    }

    #[test]
    fn nothing_has_no_cut() {
        let tree = EmitterTree::new(&Scene::default(), &[]);
        assert_eq!(tree.cut(&floor(0.0, 0.0), &Plane::through(&floor(0.0, 0.0)), 1.0), LampCut::default());
    }

    #[test]
    fn every_lamp_is_in_one_list_and_groups_keep_the_bound() {
        let scene = hall();
        let emitters = emitters(&scene);
        assert_eq!(emitters.len(), 100, "facing down");
        let tree = EmitterTree::new(&scene, &emitters);
        let outline = floor(17.0, 9.0);
        let plane = Plane::through(&outline);
        let mut singles = Vec::new();
        for faint in [0.0, 1e-3, 1e-2] {
            let cut = tree.cut(&outline, &plane, faint);
            let mut all: Vec<u32> = cut.single.iter().map(|&id| emitters[id as usize].polygons[0]).collect();
            for &group in &cut.groups {
                let Group { first, end, .. } = tree.nodes[group as usize];
                let polygons: Vec<u32> = (first..end).map(|place| tree.polygons[place as usize].0).collect();
                for corner in outline {
                    let light = |&polygon: &u32| {
                        let form_factor = form_factor_at(corner, DVec3::Z, &scene.outline(polygon));
                        luminance(form_factor * scene.material(polygon).exitance())
                    };
                    assert!(polygons.iter().map(light).sum::<f64>() <= faint);
                }
                all.extend(polygons);
            }
            all.sort_unstable();
            assert_eq!(all, emitters.iter().map(|emitter| emitter.polygons[0]).collect::<Vec<u32>>());
            singles.push(cut.single.len());
        }
        assert!(singles[0] == 100 && singles[1] > singles[2] && singles[2] > 0, "{singles:?}");
    }

    #[test]
    fn what_looks_away_or_is_behind_is_in_no_list() {
        let scene = hall();
        let tree = EmitterTree::new(&scene, &emitters(&scene));
        let mut outline = floor(17.0, 9.0);
        outline.reverse();
        assert_eq!(tree.cut(&outline, &Plane::through(&outline), 0.0), LampCut::default(), "it faces down");
        let above = floor(17.0, 9.0).map(|corner| corner + DVec3::Z * 3.5);
        assert_eq!(tree.cut(&above, &Plane::through(&above), 0.0), LampCut::default());
    }

    #[test]
    fn picks_are_as_frequent_as_powers() {
        let scene = hall();
        let tree = EmitterTree::new(&scene, &emitters(&scene));
        let mut count = vec![0; scene.polygons.len()];
        (0..1000).for_each(|i| count[tree.pick(0, (f64::from(i) + 0.5) / 1000.0) as usize] += 1);
        assert!(scene.emitters().all(|polygon| count[polygon as usize] == 10), "{count:?}");
    }
}
