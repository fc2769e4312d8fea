//! What a point sees of the reflectors, by rays: for scenes of too many polygons to look at each.
//!
//! Two kinds of rays share what there is to see. Patches that send much to a point are looked at one by one: the form
//! factor is exact, and rays to points spread over them tell how much of it is hidden, none of it in most cases. All else is
//! met by rays spread evenly over the hemisphere, by the cosine. A ray that meets what is looked at one by one counts nothing:
//! what is divided is the surfaces, so that nothing counts twice and nothing is lost. Nothing leaks: a ray stops where it
//! should. What it costs grows with the logarithm of the number of polygons.

use glam::{DVec2, DVec3};
use scene::{Bvh, Ray, Scene, luminance, other_sides};

use crate::backprojection::Viewpoint;
use crate::lattice::{Arriving, Fan, STEP, hemisphere, shift};
use crate::leaf_gather::SeenNode;
use crate::light_tree::{Horizon, Light, LightTree};
use crate::{NodeId, Patch, Solution};

/// Rays from a point for a source error of `RAYS_ERROR`. What rays that are spread evenly miss falls with their number to the
/// power of −3/4.
const RAYS: f64 = 256.0;
const RAYS_ERROR: f64 = 0.0036;

/// What a single ray would be off by, relative to the light over reflectors: a guess that suits a furnished room, not a measured
/// figure. Less divides leaves for what rays scatter by, more leaves errors of that size alone.
const SCATTER: f64 = 0.6;

/// Rays from a point at least and at most.
const LEAST_RAYS: f64 = 64.0;
const MOST_RAYS: f64 = 4096.0;

/// Area of elements, as a part of that of all surfaces, below which an element is small in a scene whose light is found by rays: what
/// is found by rays is looked at within it and taken for linear, until a probe says otherwise. More leaves what curves to
/// probes, less looks at all corners of leaves that nobody will tell from their neighbours.
pub const SMALL_LEAF: f64 = 1.0 / 12_000.0;

/// Rays from points of small elements, as a part of all: as the root of the area is less, down to this. There are many of them.
const FEW_RAYS: f64 = 0.25;

/// How far from a contact a point is taken to be, along its direction of approach, as a fraction of the scene's size: above
/// the rounding of rays, below anything that light tells apart.
pub(crate) const ASIDE: f64 = 1e-7;

/// A patch is looked at where it sends more than this part of the budget to a point.
const NEGLIGIBLE: f64 = 2.0;

/// Rays that tell what is hidden of a node, at least: of a dim one and of a bright one. A large node gets as many as would meet
/// it of those over the hemisphere.
const AIMED_RAYS: [u32; 2] = [1, 2];

/// What is seen is scaled by this at most, or its inverse: where few rays meet anything their number says little.
const MOST_BALANCED: f64 = 1.25;

/// How the points of one element look at reflectors.
#[derive(Default)]
pub(crate) struct View {
    /// The element's polygon.
    polygon: u32,
    /// Rays over the hemisphere from each point.
    rays: u32,
    /// Root nodes of the patches that are looked at one by one, ascending, unless they send next to nothing to the point.
    prominent: Vec<NodeId>,
    /// What a patch sends at least to be looked at, luminance, W·m⁻².
    negligible: f64,
}

/// Where rays start: a point just in front of all that touches it.
struct Origin<'a> {
    view: &'a View,
    point: Viewpoint,
    /// Of the lattices that rays from here are spread by.
    shift: DVec2,
}

/// Sends rays into a solved scene.
pub(crate) struct RayGather {
    bvh: Bvh,
    /// Root nodes of all patches that reflect light, and the hierarchy over them.
    roots: Vec<NodeId>,
    tree: LightTree,
    /// By triangle of the hierarchy, the patch that it is a part of.
    patches: Vec<u32>,
    other_sides: Vec<Option<u32>>,
    normals: Vec<DVec3>,
    /// By polygon, luminance of its reflectance.
    reflectances: Vec<f64>,
    size: f64,
    /// Rays from a point of an element that is large enough; which area that is, m²; and which of all possible rays.
    rays: u32,
    ample: f64,
    turn: u32,
    /// Irradiance, luminance, W·m⁻², that may be misplaced on account of nodes that stand for the leaves that rays meet.
    budget: f64,
}

impl RayGather {
    /// Prepares `rays` rays a point over a solution's patches. `budget` is how much light, luminance, W·m⁻²,
    /// nodes may misplace at a point; rays of another `turn` are others.
    pub fn new(scene: &Scene, solution: &Solution, rays: u32, budget: f64, turn: u32) -> Self {
        let elements = &solution.elements;
        let (mut triangles, mut patches) = (Vec::new(), Vec::new());
        for (id, patch) in (0..).zip(&elements.patches) {
            let outline = elements.outline(patch.root);
            for edge in outline[1..].windows(2) {
                triangles.push([outline[0], edge[0], edge[1]]);
                patches.push(id);
            }
        }
        let light = |patch: &Patch| {
            let root = patch.root;
            let radiosity = luminance(scene.reflectance(patch.polygon) * solution.light[root as usize].irradiance);
            let power = radiosity * elements.nodes[root as usize].area;
            let axis = scene.plane(patch.polygon).normal;
            (power > 0.0).then(|| (root, Light::of_outline(elements.outline(root), axis, root, power)))
        };
        let (roots, lights): (Vec<NodeId>, Vec<Light>) = elements.patches.iter().filter_map(light).unzip();
        Self {
            roots,
            tree: LightTree::new(&lights),
            bvh: Bvh::of_triangles(triangles),
            patches,
            other_sides: other_sides(scene),
            normals: scene.polygon_ids().map(|polygon| scene.plane(polygon).normal).collect(),
            reflectances: scene.polygon_ids().map(|polygon| luminance(scene.reflectance(polygon))).collect(),
            size: scene.size(),
            rays,
            ample: SMALL_LEAF * scene.surface_area(),
            turn,
            budget,
        }
    }

    /// How the points of an element look at reflectors.
    pub fn over(&self, solution: &Solution, element: NodeId, horizon: &Horizon) -> View {
        let elements = &solution.elements;
        let rays = self.rays_over(solution, element);
        // What is not looked at is met by rays, which scatter the more the fewer they are.
        let negligible = NEGLIGIBLE * self.budget * scatter_of(rays) / scatter_of(self.rays);
        let cut = self.tree.cut(elements.outline(element), horizon, negligible);
        let prominent = cut.single.iter().map(|&number| self.roots[number as usize]).collect();
        View { polygon: elements.polygon_of(element).unwrap_or_default(), rays, prominent, negligible }
    }

    fn rays_over(&self, solution: &Solution, element: NodeId) -> u32 {
        let part = (solution.elements.nodes[element as usize].area / self.ample).sqrt();
        ((f64::from(self.rays) * part.clamp(FEW_RAYS, 1.0)) as u32).max(1)
    }

    /// Appends the nodes of reflectors that a point sees; ascending, each once.
    pub fn seen_nodes(&self, solution: &Solution, view: &View, point: &Viewpoint, seen: &mut Vec<SeenNode>) {
        let from = Origin { view, point: point.aside(ASIDE * self.size), shift: shift(point.position, self.turn) };
        let first = seen.len();
        let looked_at: Vec<NodeId> =
            view.prominent.iter().copied().filter(|&root| self.look_at(solution, root, &from, seen)).collect();
        let met = self.look_around(solution, &from, &looked_at, seen);
        merge(seen, first);
        balance(&mut seen[first..], met);
    }

    /// Looks at one patch, unless it sends next to nothing to the point. Returns whether it was looked at.
    fn look_at(&self, solution: &Solution, root: NodeId, from: &Origin<'_>, seen: &mut Vec<SeenNode>) -> bool {
        let elements = &solution.elements;
        let polygon = elements.polygon_of(root).unwrap_or_default();
        if self.is_own(from.view.polygon, polygon) {
            return false;
        }
        let outline = elements.outline(root);
        if self.normals[polygon as usize].dot(from.point.position - outline[0]) <= self.size * ASIDE {
            return false;
        }
        let form_factor = from.point.form_factor(outline);
        let radiosity = self.reflectances[polygon as usize] * luminance(solution.light[root as usize].irradiance);
        if form_factor * radiosity <= from.view.negligible {
            return false;
        }
        self.open(solution, root, form_factor, from, seen);
        true
    }

    /// Adds what is seen of a node of a patch that is looked at; of its parts where the node's plane is not good enough.
    fn open(&self, solution: &Solution, node: NodeId, form_factor: f64, from: &Origin<'_>, seen: &mut Vec<SeenNode>) {
        if form_factor <= 0.0 {
            return;
        }
        let elements = &solution.elements;
        let record = &elements.nodes[node as usize];
        let polygon = elements.polygon_of(node).unwrap_or_default();
        let light = &solution.light[node as usize];
        let misplaced = self.reflectances[polygon as usize] * light.deviation * form_factor;
        if record.child_count > 0 && misplaced > self.budget {
            for child in elements.children(node) {
                let part = from.point.form_factor(elements.outline(child));
                self.open(solution, child, part, from, seen);
            }
            return;
        }
        let Some(patch) = elements.patch_of(node) else { return };
        let outline = elements.outline(node);
        let is_bright = self.reflectances[polygon as usize] * luminance(light.irradiance) * form_factor > self.budget;
        let rays = AIMED_RAYS[usize::from(is_bright)].max((form_factor * f64::from(from.view.rays)) as u32);
        let is_blocked = |place: DVec3| {
            let hides = |triangle: u32| {
                let Patch { polygon: met, root, .. } = elements.patches[self.patches[triangle as usize] as usize];
                !self.is_own(from.view.polygon, met)
                    && !self.is_own(polygon, met)
                    && from.point.may_meet(elements.outline(root))
            };
            self.bvh.is_blocked_among(from.point.position, place, hides)
        };
        let shift = from.shift + DVec2::splat(f64::from(node) * STEP.x);
        let Arriving { share, middle } = Fan::new(outline).arriving(&from.point, (shift, rays), is_blocked);
        if share > 0.0 {
            let offset = elements.patches[patch as usize].along(middle - record.centre);
            seen.push(SeenNode { node, form_factor: form_factor * share, offset });
        }
    }

    /// Adds what rays over the hemisphere meet of patches that are not looked at. Returns the part of all that meets any front.
    fn look_around(
        &self,
        solution: &Solution,
        from: &Origin<'_>,
        looked_at: &[NodeId],
        seen: &mut Vec<SeenNode>,
    ) -> f64 {
        let elements = &solution.elements;
        let rays = from.view.rays;
        let share = 1.0 / f64::from(rays);
        let mut met_any = 0;
        let Viewpoint { position, up, normal, .. } = from.point;
        // About a shading normal some look below the polygon's plane, where nothing is seen.
        for direction in hemisphere(normal, rays, from.shift).filter(|way| normal == up || up.dot(*way) > 0.0) {
            let meets = |triangle: u32| {
                let Patch { polygon: met, root, .. } = elements.patches[self.patches[triangle as usize] as usize];
                !self.is_own(from.view.polygon, met)
                    && from.point.may_meet(elements.outline(root))
                    && (self.other_sides[met as usize].is_none() || self.normals[met as usize].dot(direction) < 0.0)
            };
            let ray = Ray { origin: position, direction };
            let Some(hit) = self.bvh.closest_hit_among(&ray, meets) else { continue };
            if hit.normal.dot(direction) >= 0.0 {
                continue; // A back, which is black.
            }
            met_any += 1;
            let frame = &elements.patches[self.patches[hit.id as usize] as usize];
            if looked_at.binary_search(&frame.root).is_ok() {
                continue;
            }
            let place = position + direction * hit.distance;
            let node = self.standing_for(solution, frame, place);
            let offset = frame.along(place - elements.nodes[node as usize].centre);
            seen.push(SeenNode { node, form_factor: share, offset });
        }
        f64::from(met_any) * share
    }

    /// Whether a polygon is the one that rays start from, or its other side.
    fn is_own(&self, polygon: u32, other: u32) -> bool {
        other == polygon || self.other_sides[polygon as usize] == Some(other)
    }

    /// How much light, luminance, W·m⁻², is misplaced at a point where planes that misplace as much as this node's does stand
    /// for all leaves that it sees: by each ray something else.
    pub fn misplaced(&self, solution: &Solution, node: NodeId) -> f64 {
        let polygon = solution.elements.polygon_of(node).unwrap_or_default();
        self.reflectances[polygon as usize] * solution.light[node as usize].deviation / f64::from(self.rays).sqrt()
    }

    /// What rays are taken to be off by at a point of an element, root mean square, relative to the light over reflectors there.
    pub fn scatter(&self, solution: &Solution, element: NodeId) -> f64 {
        scatter_of(self.rays_over(solution, element))
    }

    /// The largest node of a patch around a place that is good enough.
    fn standing_for(&self, solution: &Solution, patch: &Patch, place: DVec3) -> NodeId {
        let elements = &solution.elements;
        let place = patch.along(place - patch.origin);
        let outside = |child: NodeId| {
            let cell = &elements.nodes[child as usize];
            (cell.cell_min - place).max(place - cell.cell_max).max_element()
        };
        let mut node = patch.root;
        while self.misplaced(solution, node) > self.budget
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

/// Scales what is seen to the part of all rays that met something, and to no more than all there is: by rays alone white walls that
/// see each other would now and then send back more than they got, and never come to rest.
fn balance(seen: &mut [SeenNode], met: f64) {
    let sum: f64 = seen.iter().map(|seen| seen.form_factor).sum();
    if sum > 0.0 {
        let scale = (met / sum).clamp(1.0 / MOST_BALANCED, MOST_BALANCED).min(1.0 / sum);
        seen.iter_mut().for_each(|seen| seen.form_factor *= scale);
    }
}

/// Makes one of all that is seen of each node from `first` on.
fn merge(seen: &mut Vec<SeenNode>, first: usize) {
    seen[first..].sort_by_key(|seen| seen.node);
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

    #[test]
    fn what_is_seen_is_what_rays_met_and_no_more_than_all() {
        let seen = |form_factor| SeenNode { node: 0, form_factor, offset: DVec2::ZERO };
        let balanced = |form_factors: [f64; 2], met: f64| {
            let mut seen = form_factors.map(seen);
            balance(&mut seen, met);
            seen.map(|seen| seen.form_factor)
        };
        assert_eq!(balanced([0.0, 0.0], 1.0), [0.0, 0.0]);
        assert_eq!(balanced([0.25, 0.25], 0.5), [0.25, 0.25]);
        assert!((balanced([0.5, 0.625], 1.0).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!((balanced([0.6, 0.3], 1.0).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        // Little is met, or much more is seen than there is.
        assert_eq!(balanced([0.25, 0.25], 0.0), [0.2, 0.2]);
        assert!((balanced([2.0, 1.0], 1.0).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        balance(&mut [], 1.0);
    }

    /// In a closed, furnished room what is seen adds up to the hemisphere, whether it is looked at or met.
    #[test]
    fn what_is_seen_closes_the_hemisphere() {
        let room = Builder::default()
            .material(0.6, 1.0)
            .cuboid([0.0, 0.0, 0.0], [4.0, 3.0, 2.5], true)
            .cuboid([0.7, 0.5, 0.05], [1.5, 1.4, 0.8], false)
            .cuboid([2.2, 1.3, 0.9], [3.5, 2.2, 1.0], false)
            .build();
        let solution = solve(&room, &SolveOptions { link_error: Some(0.1), bounces: None }, &|_| ());
        let gather = RayGather::new(&room, &solution, 256, 1e-3, 0);
        let floor = solution.patch_roots(4).next().expect("the floor is a patch");
        let view = gather.over(&solution, floor, &Horizon { plane: room.plane(4), tilt: 0.0 });
        assert!(view.prominent.len() > 5);
        let (mut sums, mut turned_sums) = (Vec::new(), Vec::new());
        for i in 0..40 {
            let position = DVec3::new(0.1 + 0.094 * f64::from(i), 0.2 + f64::from(i * 7 % 40) * 0.065, 0.0);
            let mut seen = Vec::new();
            let point = Viewpoint::flat(position, DVec3::Z, DVec3::ZERO);
            gather.seen_nodes(&solution, &view, &point, &mut seen);
            let sum: f64 = seen.iter().map(|seen| seen.form_factor).sum();
            sums.push(sum - 1.0);
            // About a shading normal the part below the plane is missing: (1 + cos θ)/2 is left.
            let (sin, cos) = (0.1 * f64::from(i % 13)).sin_cos();
            let (y, x) = f64::from(i).sin_cos();
            let turned = Viewpoint { normal: DVec3::new(sin * x, sin * y, cos), ..point };
            seen.clear();
            gather.seen_nodes(&solution, &view, &turned, &mut seen);
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
