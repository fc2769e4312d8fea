//! A hierarchy over emitters: those that are far away, faint or turned away are told from the
//! others together (Walter et al., "Lightcuts: A Scalable Approach to Illumination", 2005).
//!
//! A hall has lamps by the thousand, of which a point sees a dozen well. What decides which is a bound, not a guess: no point of
//! an element has more light from a group than that.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use scene::Plane;

/// One less the cosine of the angle below which lights look the same way. A group that does is bounded by where it looks.
const SAME_WAY: f64 = 1e-9;

/// A light, by what bounds what it sends.
#[derive(Clone, Debug)]
pub struct Light {
    /// Corners of the box around it, metres.
    pub low: DVec3,
    pub high: DVec3,
    /// The way that all of it looks, if it is one.
    pub axis: Option<DVec3>,
    /// Its surfaces, each with its power, luminance, W.
    pub surfaces: Vec<(u32, f64)>,
}

impl Light {
    /// A polygon with one front.
    pub fn of_outline(outline: &[DVec3], axis: DVec3, surface: u32, power: f64) -> Self {
        let (low, high) = bounds(outline);
        Self { low, high, axis: Some(axis), surfaces: vec![(surface, power)] }
    }
}

/// Lights in a binary tree.
pub struct LightTree {
    nodes: Vec<Group>,
    /// Surfaces in the order of the tree, each with the power of all up to and with it.
    surfaces: Vec<(u32, f64)>,
}

/// Some lights.
struct Group {
    low: DVec3,
    high: DVec3,
    axis: Option<DVec3>,
    /// The range of their surfaces.
    first: u32,
    end: u32,
    parts: Parts,
}

enum Parts {
    /// Number of the light.
    Light(u32),
    Groups([u32; 2]),
}

/// What bounds the light on an element: the plane that it is received above, and how far from its normal the cosine may be taken
/// to, radians ([`scene::Scene::shading_tilt`]).
pub struct Horizon {
    pub plane: Plane,
    pub tilt: f64,
}

/// The lights as an element sees them.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct LightCut {
    /// Numbers of lights that are to be looked at one by one, ascending.
    pub single: Vec<u32>,
    /// Groups that are faint.
    pub groups: Vec<u32>,
}

impl LightTree {
    /// Builds a tree over lights, which are named by their place.
    pub fn new(lights: &[Light]) -> Self {
        let mut tree = Self { nodes: Vec::new(), surfaces: Vec::new() };
        let mut placed: Vec<(DVec3, u32)> =
            (0..).zip(lights).map(|(number, light)| ((light.low + light.high) / 2.0, number)).collect();
        if !placed.is_empty() {
            tree.grow(lights, &mut placed);
        }
        tree
    }

    /// Adds the group of some lights, halved across its longest side; its index.
    fn grow(&mut self, lights: &[Light], placed: &mut [(DVec3, u32)]) -> u32 {
        let first = self.surfaces.len() as u32;
        let index = self.nodes.len() as u32;
        if let [(_, number)] = *placed {
            let Light { low, high, axis, ref surfaces } = lights[number as usize];
            let mut sum = self.power_until(first);
            self.surfaces.extend(surfaces.iter().map(|&(surface, power)| {
                sum += power;
                (surface, sum)
            }));
            let end = self.surfaces.len() as u32;
            self.nodes.push(Group { low, high, axis, first, end, parts: Parts::Light(number) });
            return index;
        }
        let (low, high) = bounds(placed.iter().map(|place| &place.0));
        let longest = (high - low).max_position();
        placed.sort_by(|a, b| a.0[longest].total_cmp(&b.0[longest]).then(a.1.cmp(&b.1)));
        // Its parts come after it, and it is known only when they are.
        self.nodes.push(Group { low, high, axis: None, first, end: first, parts: Parts::Light(0) });
        let (left, right) = placed.split_at_mut(placed.len() / 2);
        let parts = [self.grow(lights, left), self.grow(lights, right)];
        let [a, b] = parts.map(|part| &self.nodes[part as usize]);
        let axis = a.axis.zip(b.axis).filter(|(a, b)| a.dot(*b) >= 1.0 - SAME_WAY).map(|(a, _)| a);
        let (low, high, end) = (a.low.min(b.low), a.high.max(b.high), b.end);
        self.nodes[index as usize] = Group { low, high, axis, first, end, parts: Parts::Groups(parts) };
        index
    }

    /// What an element, given by its outline and horizon, sees of the lights. A group is faint if it sends no more than
    /// `faint`, luminance, W·m⁻², to any point of the element; what is behind the element, or looks away, is in neither list.
    pub fn cut(&self, outline: &[DVec3], horizon: &Horizon, faint: f64) -> LightCut {
        let mut cut = LightCut::default();
        let mut open: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(index) = open.pop() {
            let most = self.most(index, outline, horizon);
            match self.nodes[index as usize].parts {
                _ if most == 0.0 => {}
                _ if most <= faint => cut.groups.push(index),
                Parts::Groups(parts) => open.extend(parts),
                Parts::Light(number) => cut.single.push(number),
            }
        }
        cut.single.sort_unstable();
        cut
    }

    /// The most light, luminance, W·m⁻², that any point of an element has from a group, whatever stands between.
    fn most(&self, index: u32, outline: &[DVec3], Horizon { plane, tilt }: &Horizon) -> f64 {
        let group = &self.nodes[index as usize];
        let height = plane.distance(DVec3::select(plane.normal.cmpgt(DVec3::ZERO), group.high, group.low));
        let reach = group.axis.map_or(f64::INFINITY, |axis| {
            let nearest = axis.dot(DVec3::select(axis.cmpgt(DVec3::ZERO), group.low, group.high));
            outline.iter().map(|corner| axis.dot(*corner)).fold(f64::NEG_INFINITY, f64::max) - nearest
        });
        if height <= 0.0 || reach <= 0.0 {
            return 0.0;
        }
        let (low, high) = bounds(outline);
        let square = (group.low - high).max(low - group.high).max(DVec3::ZERO).length_squared();
        let mut cosine = (height / square.sqrt()).min(1.0);
        if *tilt > 0.0 {
            cosine = (cosine.asin() + tilt).min(FRAC_PI_2).sin();
        }
        let cosines = cosine * (reach / square.sqrt()).min(1.0);
        self.power(index) * cosines / (PI * square)
    }

    /// Power of a group, luminance, W.
    pub fn power(&self, group: u32) -> f64 {
        let group = &self.nodes[group as usize];
        self.power_until(group.end) - self.power_until(group.first)
    }

    /// One surface of a group: `place` in 0..1 goes through all, each as often as its power says.
    pub fn pick(&self, group: u32, place: f64) -> u32 {
        let Group { first, end, .. } = self.nodes[group as usize];
        let surfaces = &self.surfaces[first as usize..end as usize];
        let wanted = self.power_until(first) + place * self.power(group);
        surfaces[surfaces.partition_point(|&(_, power)| power <= wanted).min(surfaces.len() - 1)].0
    }

    fn power_until(&self, place: u32) -> f64 {
        place.checked_sub(1).map_or(0.0, |last| self.surfaces[last as usize].1)
    }
}

/// Corners of the box around points.
fn bounds<'a>(points: impl IntoIterator<Item = &'a DVec3>) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.into_iter().fold(none, |(low, high), &point| (low.min(point), high.max(point)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::form_factor_at;

    fn square(x: f64, y: f64, z: f64, side: f64) -> [DVec3; 4] {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| DVec3::new(x + side * u, y + side * v, z))
    }

    fn flat(outline: &[DVec3]) -> Horizon {
        Horizon { plane: Plane::through(outline), tilt: 0.0 }
    }

    /// A hundred lamps under a ceiling at height 3, facing down, of unit radiosity.
    fn hall() -> (Vec<[DVec3; 4]>, LightTree) {
        let outlines: Vec<_> =
            (0..100).map(|i| square(f64::from(i % 10) * 4.0, f64::from(i / 10) * 4.0, 3.0, 0.5)).collect();
        let light = |(i, outline): (u32, &[DVec3; 4])| Light::of_outline(outline, -DVec3::Z, i, 0.25);
        let lights: Vec<Light> = (0..).zip(&outlines).map(light).collect();
        (outlines, LightTree::new(&lights))
    }

    #[test]
    fn nothing_has_no_cut() {
        let outline = square(0.0, 0.0, 0.0, 1.0);
        assert_eq!(LightTree::new(&[]).cut(&outline, &flat(&outline), 1.0), LightCut::default());
    }

    #[test]
    fn every_lamp_is_in_one_list_and_groups_keep_the_bound() {
        let (outlines, tree) = hall();
        let floor = square(17.0, 9.0, 0.0, 1.0);
        let horizon = flat(&floor);
        let mut singles = Vec::new();
        for faint in [0.0, 5e-4, 5e-3] {
            let cut = tree.cut(&floor, &horizon, faint);
            let mut all = cut.single.clone();
            for &group in &cut.groups {
                let Group { first, end, .. } = tree.nodes[group as usize];
                let lamps: Vec<u32> = (first..end).map(|place| tree.surfaces[place as usize].0).collect();
                for corner in floor {
                    // The lamps face down: seen from below their outlines run clockwise.
                    let light = |&lamp: &u32| form_factor_at(corner, DVec3::Z, &outlines[lamp as usize]).abs();
                    assert!(lamps.iter().map(light).sum::<f64>() <= faint);
                }
                all.extend(lamps);
            }
            all.sort_unstable();
            assert_eq!(all, (0..100).collect::<Vec<u32>>());
            singles.push(cut.single.len());
        }
        assert!(singles[0] == 100 && singles[1] > singles[2] && singles[2] > 0, "{singles:?}");
    }

    /// A wall sees lamps at a grazing angle: turned towards them by a shading normal it has more light.
    #[test]
    fn the_bound_holds_for_shading_normals() {
        let (outlines, tree) = hall();
        let wall = [(9.0, 0.0), (10.0, 0.0), (10.0, 1.0), (9.0, 1.0)].map(|(y, z)| DVec3::new(19.9, y, z));
        let tilt = 0.5_f64;
        let horizon = Horizon { plane: Plane::through(&wall), tilt };
        let normal = horizon.plane.normal * tilt.cos() + DVec3::Z * tilt.sin();
        let mut beyond_its_own = 0;
        for index in 0..tree.nodes.len() as u32 {
            let Parts::Light(lamp) = tree.nodes[index as usize].parts else { continue };
            let outline = &outlines[lamp as usize];
            if outline.iter().any(|corner| horizon.plane.distance(*corner) < 0.0) {
                continue;
            }
            let lit = wall.map(|corner| form_factor_at(corner, normal, outline)).into_iter().fold(0.0, f64::max);
            assert!(lit <= tree.most(index, &wall, &horizon) + 1e-15);
            beyond_its_own += usize::from(lit > tree.most(index, &wall, &flat(&wall)));
        }
        assert!(beyond_its_own > 0);
    }

    #[test]
    fn what_looks_away_or_is_behind_is_in_no_list() {
        let (_, tree) = hall();
        let mut faces_down = square(17.0, 9.0, 0.0, 1.0);
        faces_down.reverse();
        let above = square(17.0, 9.0, 3.5, 1.0);
        for outline in [faces_down, above] {
            assert_eq!(tree.cut(&outline, &flat(&outline), 0.0), LightCut::default());
        }
    }

    #[test]
    fn picks_are_as_frequent_as_powers() {
        let (_, tree) = hall();
        let mut count = [0; 100];
        (0..1000).for_each(|i| count[tree.pick(0, (f64::from(i) + 0.5) / 1000.0) as usize] += 1);
        assert_eq!(count, [10; 100]);
    }
}
