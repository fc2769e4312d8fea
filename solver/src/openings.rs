//! Through which openings the sky is seen, and from where: in scenes of many polygons, by rays from places all over them.
//!
//! A room sees little of the sky, and of that little the same from one place as from beside it. So space is parted into small
//! boxes, and for each with a surface in it is found out which cells of the sky are seen from there. Points then send their rays
//! to these alone, most to those that are seen from some places and from others not.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use scene::{Scene, luminance};
use serde::{Deserialize, Serialize};

use crate::lattice::{Fan, shift};
use crate::polygon_tree::PolygonTree;
use crate::{Elements, NodeId, SkyCells};

/// Side of a box, as a part of the scene's size. Smaller knows better what is seen, and takes more boxes.
const BOX: f64 = 1.0 / 40.0;

/// Places at most in a box that are looked from: less misses what is seen through slits.
const PLACES: usize = 6;

/// A cell that sends this part of all light at least is asked for everywhere: a sun shines through slits.
const BRIGHT: f64 = 0.02;

/// How far rays to the sky go, in sizes of the scene: nothing stands beyond.
pub(crate) const BEYOND: f64 = 2.0;

/// A cell of the sky as it is seen from a box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenCell {
    /// The cell, which has no parts.
    pub cell: u32,
    /// The part of all places that see it, 0..=1; of a cell with 0 a neighbour is seen.
    pub share: f32,
}

/// Which cells of the sky are seen from where.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Openings {
    /// Lower corner of the box with the number 0, and the side of all, metres.
    low: DVec3,
    side: f64,
    /// Numbers of the boxes with a surface in them, ascending, and where in `seen` the cells of each end.
    boxes: Vec<(BoxKey, u32)>,
    seen: Vec<SeenCell>,
}

/// Number of a box along z, y and x.
type BoxKey = [u32; 3];

impl Openings {
    /// Looks from the elements of a scene.
    pub fn new(scene: &Scene, tree: &PolygonTree, elements: &Elements, sky: &SkyCells) -> Self {
        let ((low, _), size) = (scene.bounds(), scene.size());
        let (mut openings, reach) = (Self { low, side: BOX * size, ..Self::default() }, BEYOND * size);
        let mut places: Vec<(BoxKey, NodeId)> =
            elements.leaves().map(|leaf| (openings.key(elements.nodes[leaf as usize].centre), leaf)).collect();
        places.sort_unstable();
        let groups: Vec<&[(BoxKey, NodeId)]> = places.chunk_by(|a, b| a.0 == b.0).collect();
        let leaves: Vec<u32> =
            (0..sky.cells.len() as u32).filter(|&cell| sky.cells[cell as usize].parts.is_empty()).collect();
        let looks: Vec<Vec<Count>> = groups
            .par_iter()
            .map(|group| {
                let mut counts = vec![Count::default(); leaves.len()];
                for &(_, element) in group.iter().step_by(group.len().div_ceil(PLACES)) {
                    look(scene, tree, elements, element, (sky, &leaves, reach), &mut counts);
                }
                counts
            })
            .collect();
        let neighbours = neighbours(sky, &leaves);
        let total: f64 = leaves.iter().map(|&cell| brightness(sky, cell)).sum();
        let is_bright: Vec<bool> = leaves.iter().map(|&cell| brightness(sky, cell) >= BRIGHT * total).collect();
        let number = |key: BoxKey| groups.binary_search_by_key(&key, |group| group[0].0).ok();
        let around = |group: &&[(BoxKey, NodeId)]| {
            let mut counts = vec![Count::default(); leaves.len()];
            for near in beside(group[0].0).into_iter().filter_map(number) {
                counts.iter_mut().zip(&looks[near]).for_each(|(sum, count)| *sum = sum.and(*count));
            }
            let is_asked = |&i: &usize| {
                is_bright[i] || counts[i].free > 0 || neighbours[i].iter().any(|&other| counts[other as usize].free > 0)
            };
            let cell = |i: usize| SeenCell { cell: leaves[i], share: counts[i].share() };
            (0..leaves.len()).filter(is_asked).map(cell).collect::<Vec<SeenCell>>()
        };
        for (group, seen) in groups.iter().zip(groups.par_iter().map(around).collect::<Vec<_>>()) {
            openings.seen.extend(seen);
            openings.boxes.push((group[0].0, openings.seen.len() as u32));
        }
        openings
    }

    /// The cells that may be seen from the box around a place; none if nothing is known there.
    pub fn from(&self, place: DVec3) -> Option<&[SeenCell]> {
        let number = self.boxes.binary_search_by_key(&self.key(place), |(key, _)| *key).ok()?;
        let first = number.checked_sub(1).map_or(0, |before| self.boxes[before].1);
        Some(&self.seen[first as usize..self.boxes[number].1 as usize])
    }

    fn key(&self, place: DVec3) -> BoxKey {
        let at = ((place - self.low) / self.side.max(f64::MIN_POSITIVE)).max(DVec3::ZERO).as_uvec3();
        [at.z, at.y, at.x]
    }
}

/// Looks at all cells from the middle of an element.
fn look(
    scene: &Scene,
    tree: &PolygonTree,
    elements: &Elements,
    element: NodeId,
    (sky, leaves, reach): (&SkyCells, &[u32], f64),
    counts: &mut [Count],
) {
    let Some(polygon) = elements.polygon_of(element) else { return };
    let (origin, up) = (elements.nodes[element as usize].centre, scene.plane(polygon).normal);
    let shift = shift(origin, 0);
    for (i, (count, &cell)) in counts.iter_mut().zip(leaves).enumerate() {
        let way = Fan::new(&sky.cells[cell as usize].corners).place(shift, i as u32);
        if up.dot(way) > 0.0 {
            let end = origin + way * reach;
            count.all += 1;
            count.free += u32::from(!tree.is_blocked(polygon, origin, end, |_| false));
        }
    }
}

/// Places that see a cell, of those that it is above.
#[derive(Clone, Copy, Default)]
struct Count {
    free: u32,
    all: u32,
}

impl Count {
    fn and(self, other: Self) -> Self {
        Self { free: self.free + other.free, all: self.all + other.all }
    }

    fn share(self) -> f32 {
        self.free as f32 / self.all.max(1) as f32
    }
}

/// What a cell sends to a surface that faces it, luminance, W·m⁻².
fn brightness(sky: &SkyCells, cell: u32) -> f64 {
    let [r, g, b] = sky.cells[cell as usize].light.map(DVec3::length);
    luminance(DVec3::new(r, g, b))
}

/// By place in the list of cells, the places of those that touch it or nearly do.
fn neighbours(sky: &SkyCells, leaves: &[u32]) -> Vec<Vec<u32>> {
    let cones: Vec<(DVec3, f64)> = leaves
        .iter()
        .map(|&cell| {
            let corners: Vec<DVec3> =
                sky.cells[cell as usize].corners.iter().map(|corner| corner.normalize_or_zero()).collect();
            let middle = corners.iter().sum::<DVec3>().normalize_or_zero();
            (middle, corners.iter().map(|corner| middle.dot(*corner).clamp(-1.0, 1.0).acos()).fold(0.0, f64::max))
        })
        .collect();
    let touch = |(a, wide): (DVec3, f64), (b, other): (DVec3, f64)| a.dot(b) > (wide + other).min(PI).cos();
    let of =
        |&cone: &(DVec3, f64)| (0..).zip(&cones).filter(|(_, other)| touch(cone, **other)).map(|(i, _)| i).collect();
    cones.par_iter().map(of).collect()
}

/// A box and those that share a side with it.
fn beside(key: BoxKey) -> Vec<BoxKey> {
    let mut all = vec![key];
    for axis in 0..3 {
        for step in [key[axis].checked_sub(1), key[axis].checked_add(1)].into_iter().flatten() {
            let mut other = key;
            other[axis] = step;
            all.push(other);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use scene::{Environment, LatLongMap, Sky, UpAxis};

    use super::*;
    use crate::cut::cut_polygon;
    use crate::testing::Builder;

    /// A room with one wall open, under an even sky.
    fn open_room() -> (Scene, Elements, SkyCells) {
        let walls = [true, false, true, true, true, true];
        let room = Builder::default().material(0.5, 0.0).sides(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5), true, walls);
        let map = LatLongMap { width: 1, height: 1, texels: vec![glam::Vec3::ONE] };
        let sky = Environment { sky: Sky::Map(map), up: UpAxis::Z, rotation: 0.0, scale: 1.0 };
        let scene = Scene { environment: Some(sky), ..room.build() };
        let pieces: Vec<_> = scene.polygon_ids().map(|polygon| cut_polygon(&scene.outline(polygon), &[])).collect();
        let mut elements = Elements::new(&pieces);
        elements.divide_larger(0.1); // So that each box on a wall holds one.
        let cells = SkyCells::new(scene.environment.as_ref());
        (scene, elements, cells)
    }

    #[test]
    fn nothing_is_known_where_nothing_is() {
        let (scene, elements, cells) = open_room();
        let openings = Openings::new(&scene, &PolygonTree::new(&scene), &elements, &cells);
        assert_eq!(openings.from(DVec3::new(2.0, 1.5, 1.2)), None, "in the middle of the room there is no surface");
        assert_eq!(Openings::default().from(DVec3::ZERO), None);
        let empty = Scene { environment: scene.environment, ..Scene::default() };
        let openings = Openings::new(&empty, &PolygonTree::new(&empty), &Elements::new(&[]), &cells);
        assert_eq!(openings.from(DVec3::ZERO), None);
    }

    /// From the back of the room the cells are known that are seen through its open side, and few others.
    #[test]
    fn what_is_seen_through_the_open_side_is_known() {
        let (scene, elements, cells) = open_room();
        let tree = PolygonTree::new(&scene);
        let openings = Openings::new(&scene, &tree, &elements, &cells);
        let wall = 0; // At x = 0, across from the open side.
        let leaves = (0..cells.cells.len() as u32).filter(|&cell| cells.cells[cell as usize].parts.is_empty());
        let leaves: Vec<u32> = leaves.collect();
        let mut known = 0;
        for i in 0..60 {
            let place = DVec3::new(0.0, 0.05 + 0.0483 * f64::from(i), 0.1 + f64::from(i * 7 % 24) * 0.1);
            let seen = openings.from(place).unwrap();
            for &cell in &leaves {
                let middle: DVec3 = cells.cells[cell as usize].corners.iter().sum();
                let is_free = middle.x > 0.0 && !tree.is_blocked(wall, place, place + middle * 100.0, |_| false);
                let is_known = seen.binary_search_by_key(&cell, |seen| seen.cell).is_ok();
                assert!(is_known || !is_free, "{cell} is seen from {place}");
                known += u32::from(is_known);
            }
        }
        assert!(known < 60 * leaves.len() as u32 / 2, "{known} of {}", 60 * leaves.len());
    }
}
