//! What a point sees of the reflectors, by rays: for scenes of too many polygons to look at each.
//!
//! Rays are spread evenly over the hemisphere, by the cosine, and each meets what it meets: so nothing counts twice and nothing is lost.
//! Nothing leaks: a ray stops where it should. What it costs grows with the logarithm of the number of polygons.

use std::f64::consts::PI;

use glam::DVec3;
use scene::Ray;

use crate::backprojection::Viewpoint;
use crate::lattice::{hemisphere, shift};
use crate::patch_tree::PatchTree;
use crate::surroundings::Surroundings;
use crate::{NodeId, Outlook, Patch, SeenNode, Solution};

/// Rays from a point for a source error of `RAYS_ERROR`. What rays that are spread evenly miss falls with their number to the
/// power of −3/4.
const RAYS: f64 = 200.0;
const RAYS_ERROR: f64 = 0.0036;

/// What a single ray would be off by, in standard deviations of the light that a point sees by direction: spread evenly, rays are off
/// by less than independent ones. Of furnished rooms, which are all borders, it is a half to a third of what they are off by, but what rooms and
/// halls are baked best with. Less divides leaves for what rays scatter by, more leaves errors of that size alone.
const SCATTER: f64 = 0.75;

/// Rays from a point at least and at most. Less than the least saves next to nothing in a hall, half of whose time goes to its lamps,
/// and scatters by as much as all else is off by.
const LEAST_RAYS: f64 = 96.0;
const MOST_RAYS: f64 = 4096.0;

/// Area of elements, as a part of that of all surfaces, below which an element is small in a scene whose light is found by rays: what
/// is found by rays is looked at within it and taken for linear, until a probe says otherwise. More leaves what curves to
/// probes, less looks at all corners of leaves that nobody will tell from their neighbours.
pub const SMALL_LEAF: f64 = 1.0 / 12_000.0;

/// Rays from points of small elements, as a part of all: as the root of the area is less, down to this. There are many of them.
const FEW_RAYS: f64 = 0.25;

/// Rays from points of an element by its [`Outlook::contrast`]: as many as are asked for where that is the usual one. With a power of 0.8
/// so many rays in all would scatter least, as what one is off by falls with their number to the power of −3/4; less allows for what a
/// first look is mistaken by, and so do the bounds.
const CONTRAST_POWER: f64 = 0.6;
const BY_CONTRAST: [f64; 2] = [0.25, 2.0];

/// How far from a contact a point is taken to be, along its direction of approach, as a fraction of the scene's size: above
/// the rounding of rays, below anything that light tells apart.
pub(crate) const ASIDE: f64 = 1e-7;

/// Sends rays into a solved scene.
pub(crate) struct RayGather<'a> {
    surroundings: &'a Surroundings<'a>,
    patches: &'a PatchTree,
    /// Rays from a point of an element that is large enough; and which of all possible rays.
    rays: u32,
    turn: u32,
}

impl<'a> RayGather<'a> {
    /// Prepares so many rays a point; none where there are links, or nothing reflects. Rays of another turn are others.
    pub fn new(surroundings: &'a Surroundings<'a>, (rays, turn): (u32, u32)) -> Option<Self> {
        let patches = surroundings.patches.as_ref()?;
        Some(Self { surroundings, patches, rays, turn })
    }

    /// Rays from each point of an element, at least one.
    pub fn rays_over(&self, solution: &Solution, element: NodeId) -> u32 {
        let part = (solution.elements.nodes[element as usize].area / self.surroundings.small).sqrt();
        let [contrast, usual] =
            [solution.outlook(element), Outlook::UNKNOWN].map(|outlook| f64::from(outlook.contrast));
        let by_contrast = (contrast / usual).powf(CONTRAST_POWER).clamp(BY_CONTRAST[0], BY_CONTRAST[1]);
        ((f64::from(self.rays) * part.clamp(FEW_RAYS, 1.0) * by_contrast) as u32).max(1)
    }

    /// Appends the nodes of reflectors that a point of a polygon sees by so many rays; ascending, each once. The point is taken to be
    /// just in front of all that touches it. Nodes that misplace more than the budget, luminance, W·m⁻², are opened.
    pub fn seen_nodes(
        &self,
        solution: &Solution,
        (polygon, rays, budget): (u32, u32, f64),
        point: &Viewpoint,
        seen: &mut Vec<SeenNode>,
    ) {
        let elements = &solution.elements;
        let Surroundings { geometry, tree, .. } = self.surroundings;
        let first = seen.len();
        let share = 1.0 / f64::from(rays);
        let from = point.aside(ASIDE * geometry.size);
        let Viewpoint { position, up, normal, .. } = from;
        let shift = shift(point.position, self.turn);
        // About a shading normal some look below the polygon's plane, where nothing is seen.
        for direction in hemisphere(normal, rays, shift).filter(|way| normal == up || up.dot(*way) > 0.0) {
            let meets = |triangle: u32| {
                let Patch { polygon: met, root, .. } =
                    elements.patches[self.patches.patches[triangle as usize] as usize];
                !tree.is_own(polygon, met)
                    && from.may_meet(elements.outline(root))
                    && (!tree.has_other_side(met) || geometry.plane(met).normal.dot(direction) < 0.0)
            };
            let ray = Ray { origin: position, direction };
            let Some(hit) = self.patches.bvh.closest_hit_among(&ray, meets) else { continue };
            if hit.normal.dot(direction) >= 0.0 {
                continue; // A back, which is black.
            }
            let patch = &elements.patches[self.patches.patches[hit.id as usize] as usize];
            let place = position + direction * hit.distance;
            // By each ray something else: were all that a point sees off by as much, the sum would be as of one such part. What is
            // near fills more of the hemisphere, and all of its light is off in one direction.
            let part = 1.0 / f64::from(self.rays).sqrt();
            let per_area = -hit.normal.dot(direction) / (PI * hit.distance * hit.distance);
            let form_factor = |node: NodeId| (elements.nodes[node as usize].area * per_area).clamp(part, 1.0);
            let node = self.standing_for(solution, patch, place, |node| {
                self.misplaced(solution, node, form_factor(node)) > budget
            });
            let offset = patch.along(place - elements.nodes[node as usize].centre);
            seen.push(SeenNode { node, form_factor: share, offset });
        }
        merge(seen, first);
    }

    /// How much light, luminance, W·m⁻², is misplaced at a point where a plane stands for what it sees of a node by such a form
    /// factor.
    pub fn misplaced(&self, solution: &Solution, node: NodeId, form_factor: f64) -> f64 {
        let polygon = solution.elements.polygon_of(node).unwrap_or_default();
        self.surroundings.reflectances[polygon as usize] * solution.light[node as usize].deviation * form_factor
    }

    /// What rays are taken to be off by at a point of an element, root mean square, in standard deviations of the light that it sees
    /// by direction.
    pub fn scatter(&self, solution: &Solution, element: NodeId) -> f64 {
        scatter_of(self.rays_over(solution, element))
    }

    /// The largest node of a patch around a place that is good enough, as much as is seen of it.
    fn standing_for(
        &self,
        solution: &Solution,
        patch: &Patch,
        place: DVec3,
        is_opened: impl Fn(NodeId) -> bool,
    ) -> NodeId {
        let elements = &solution.elements;
        let place = patch.along(place - patch.origin);
        let outside = |child: NodeId| {
            let cell = &elements.nodes[child as usize];
            (cell.cell_min - place).max(place - cell.cell_max).max_element()
        };
        let mut node = patch.root;
        while is_opened(node)
            && let Some(child) = elements.children(node).min_by(|&a, &b| outside(a).total_cmp(&outside(b)))
        {
            node = child;
        }
        node
    }
}

/// Rays from a point for a source error.
pub(crate) fn rays_for(source_error: f64) -> u32 {
    (RAYS * (RAYS_ERROR / source_error).powf(4.0 / 3.0)).clamp(LEAST_RAYS, MOST_RAYS) as u32
}

fn scatter_of(rays: u32) -> f64 {
    SCATTER * f64::from(rays).powf(-0.75)
}

/// Makes one of all that is seen of each node from `first` on.
fn merge(seen: &mut Vec<SeenNode>, first: usize) {
    seen[first..].sort_unstable_by_key(|seen| seen.node);
    let mut end = first;
    for i in first..seen.len() {
        let next = seen[i];
        match seen[first..end].last_mut().filter(|last| last.node == next.node) {
            Some(last) => {
                let sum = last.form_factor + next.form_factor;
                last.offset = (last.offset * last.form_factor + next.offset * next.form_factor) / sum;
                last.form_factor = sum;
            }
            None => {
                seen[end] = next;
                end += 1;
            }
        }
    }
    seen.truncate(end);
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::testing::Builder;
    use crate::{SolveOptions, solve};

    #[test]
    fn what_is_seen_of_one_node_is_merged_and_what_was_there_stays() {
        let seen = |node, form_factor, x| SeenNode { node, form_factor, offset: DVec2::new(x, 0.0) };
        let mut all = vec![seen(9, 0.5, 0.0), seen(4, 0.1, 1.0), seen(2, 0.1, 0.0), seen(4, 0.3, 2.0)];
        merge(&mut all, 1);
        assert_eq!(all[..2], [seen(9, 0.5, 0.0), seen(2, 0.1, 0.0)]);
        assert_eq!((all.len(), all[2].node), (3, 4));
        assert!((all[2].form_factor - 0.4).abs() < 1e-15 && (all[2].offset.x - 1.75).abs() < 1e-15);
        let mut none = Vec::new();
        merge(&mut none, 0);
        assert!(none.is_empty());
    }

    /// On a floor under a box whose bottom is as near as a twentieth of a metre: what fills much of a hemisphere is opened as far as
    /// its light asks for, as what is far is.
    #[test]
    fn what_is_near_is_opened_until_little_is_misplaced() {
        let room = Builder::default()
            .material(0.6, 1.0)
            .cuboid([0.0, 0.0, 0.0], [4.0, 3.0, 2.5], true)
            .cuboid([0.7, 0.5, 0.05], [1.5, 1.4, 0.8], false)
            .build();
        let solution = solve(&room, &SolveOptions { link_error: Some(0.02), bounces: None }, &|_| ());
        let (rays, budget) = (1024, 0.05);
        let surroundings = Surroundings::new(&room, &solution);
        let patches = PatchTree::new(&solution.elements);
        let gather = RayGather { surroundings: &surroundings, patches: &patches, rays, turn: 0 };
        let mut opened = 0;
        for i in 0..40 {
            let position = DVec3::new(0.55 + 0.03 * f64::from(i), 0.6 + 0.02 * f64::from(i * 7 % 40), 0.0);
            let mut seen = Vec::new();
            gather.seen_nodes(
                &solution,
                (4, rays, budget),
                &Viewpoint::flat(position, DVec3::Z, DVec3::ZERO),
                &mut seen,
            );
            for SeenNode { node, form_factor, .. } in seen {
                let is_leaf = solution.elements.is_leaf(node);
                let is_root = solution.elements.patches.iter().any(|patch| patch.root == node);
                opened += usize::from(!is_root && form_factor > 1.0 / f64::from(rays).sqrt());
                // Rays tell a form factor to a quarter or so.
                assert!(is_leaf || gather.misplaced(&solution, node, form_factor) < 1.3 * budget);
            }
        }
        assert!(opened > 40, "{opened}");
    }

    /// In a closed, furnished room what is seen adds up to the hemisphere.
    #[test]
    fn what_is_seen_closes_the_hemisphere() {
        let room = Builder::default()
            .material(0.6, 1.0)
            .cuboid([0.0, 0.0, 0.0], [4.0, 3.0, 2.5], true)
            .cuboid([0.7, 0.5, 0.05], [1.5, 1.4, 0.8], false)
            .cuboid([2.2, 1.3, 0.9], [3.5, 2.2, 1.0], false)
            .build();
        let solution = solve(&room, &SolveOptions { link_error: Some(0.1), bounces: None }, &|_| ());
        let surroundings = Surroundings::new(&room, &solution);
        let patches = PatchTree::new(&solution.elements);
        let gather = RayGather { surroundings: &surroundings, patches: &patches, rays: 256, turn: 0 };
        let floor = solution.patch_roots(4).next().expect("the floor is a patch");
        let looks = (4, gather.rays_over(&solution, floor), 1e-3);
        let (mut sums, mut turned_sums) = (Vec::new(), Vec::new());
        for i in 0..40 {
            let position = DVec3::new(0.1 + 0.094 * f64::from(i), 0.2 + f64::from(i * 7 % 40) * 0.065, 0.0);
            let mut seen = Vec::new();
            let point = Viewpoint::flat(position, DVec3::Z, DVec3::ZERO);
            gather.seen_nodes(&solution, looks, &point, &mut seen);
            let sum: f64 = seen.iter().map(|seen| seen.form_factor).sum();
            sums.push(sum - 1.0);
            // About a shading normal the part below the plane is missing: (1 + cos θ)/2 is left.
            let (sin, cos) = (0.1 * f64::from(i % 13)).sin_cos();
            let (y, x) = f64::from(i).sin_cos();
            let turned = Viewpoint { normal: DVec3::new(sin * x, sin * y, cos), ..point };
            seen.clear();
            gather.seen_nodes(&solution, looks, &turned, &mut seen);
            let sum: f64 = seen.iter().map(|seen| seen.form_factor).sum();
            turned_sums.push(sum - (1.0 + cos) / 2.0);
        }
        for sums in [sums, turned_sums] {
            let mean = sums.iter().sum::<f64>() / 40.0;
            let square = (sums.iter().map(|x| x * x).sum::<f64>() / 40.0).sqrt();
            assert!(mean.abs() < 0.01 && square < 0.05, "{mean} {square}");
        }
    }
}
