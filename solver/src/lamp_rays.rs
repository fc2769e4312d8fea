//! Light from emitters by rays: for those that are too faint at a point, or hidden by too much, to be projected.

use std::cell::OnceCell;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use scene::{Rgb, luminance};

use crate::backprojection::Viewpoint;
use crate::lattice::{Fan, STEP, shift};
use crate::leaf_gather::{LeafGather, Source};
use crate::principal_axes::{LinearLight, PrincipalAxes};
use crate::ray_gather::ASIDE;
use crate::{Cosine, NodeId};

/// What rays to one emitter may scatter by, as a part of the budget, where half of it is hidden. Less takes more rays.
const SCATTER: f64 = 0.2;

/// Rays to one emitter at most.
const MOST_RAYS: f64 = 25.0;

/// Obstacles before an emitter that are projected one by one in any case; more are where it would take as many rays. Less leaves to
/// rays penumbrae that exact ones would be had for.
const OBSTACLES: f64 = 24.0;

/// Groups of emitters that are faint at an element, in a scene without links.
#[derive(Clone, Default)]
pub(crate) struct FaintGroups {
    /// Their numbers in the tree of emitters.
    groups: Vec<u32>,
    element: NodeId,
    /// Their light over a small element: found out when a point needs it first.
    plane: OnceCell<Option<LightPlane>>,
}

impl FaintGroups {
    pub fn new(groups: Vec<u32>, element: NodeId) -> Self {
        Self { groups, element, plane: OnceCell::new() }
    }
}

/// Irradiance that is taken for linear over an element.
#[derive(Clone)]
struct LightPlane {
    axes: PrincipalAxes,
    light: LinearLight,
}

impl LightPlane {
    fn at(&self, position: DVec3) -> Rgb {
        self.axes.at(&self.light, position).max(Rgb::ZERO)
    }
}

impl LeafGather<'_> {
    /// Whether rays tell what is seen of an emitter that sends so much to a point if nothing hides it, luminance, W·m⁻²: where that
    /// is not worth a look at so many obstacles, or they are not known.
    pub(crate) fn is_seen_by_rays(&self, emitter: &Source, obstacles: usize, unoccluded: f64) -> bool {
        let is_too_much = obstacles as f64 > self.rays_wanted(unoccluded).max(OBSTACLES);
        emitter.blockers.is_none() || is_too_much || (obstacles > 0 && unoccluded <= self.budget)
    }

    /// How many rays it takes to tell what arrives of so much light, luminance, W·m⁻².
    fn rays_wanted(&self, unoccluded: f64) -> f64 {
        // What rays that are spread evenly are off by falls with their number to the power of −3/4.
        let relative = unoccluded / self.budget.max(f64::MIN_POSITIVE);
        (relative / (2.0 * SCATTER)).powf(4.0 / 3.0)
    }

    /// The share of what an outline sends to a point that arrives there, by rays to points spread evenly over it; `unoccluded`
    /// is all that it sends, luminance, W·m⁻², and decides how many.
    pub(crate) fn seen_share(
        &self,
        outline: &[DVec3],
        unoccluded: f64,
        from: &Viewpoint,
        passes: impl Fn(u32) -> bool,
    ) -> f64 {
        let gather = self.gather;
        let origin = from.aside(ASIDE * gather.geometry.size);
        let rays = self.rays_wanted(unoccluded).ceil().clamp(1.0, MOST_RAYS) as u32;
        let passes = |polygon| passes(polygon) || !origin.may_meet(gather.geometry.outline(polygon));
        let is_blocked = |place| gather.tree.is_blocked(self.polygon, origin.position, place, passes);
        Fan::new(outline).arriving_share(&origin, (shift(from.position, 0), rays), is_blocked)
    }

    /// Light from the groups of emitters that are faint at the leaf, W·m⁻². Over a small leaf it is linear, but where it is looked at by
    /// shading normals or a bake is checked.
    pub(crate) fn light_of_faint_groups(&self, from: &Viewpoint) -> Rgb {
        if self.faint.groups.is_empty() {
            return Rgb::ZERO;
        }
        let (_, turn) = self.gather.sampling;
        if turn != 0 || from.normal != from.up {
            return self.look_at_faint_groups(from);
        }
        let plane = self.faint.plane.get_or_init(|| self.plane_of_faint_groups());
        plane.as_ref().map_or_else(|| self.look_at_faint_groups(from), |plane| plane.at(from.position))
    }

    /// The plane through that light at a few places of a small leaf.
    fn plane_of_faint_groups(&self) -> Option<LightPlane> {
        let gather = self.gather;
        let elements = &gather.solution.elements;
        let element = self.faint.element;
        if elements.nodes[element as usize].area >= gather.small {
            return None;
        }
        let patch = &elements.patches[elements.patch_of(element)? as usize];
        let axes = PrincipalAxes::new(elements.outline(element), patch)?;
        let light = |place| self.look_at_faint_groups(&gather.viewpoint(self.polygon, place, DVec3::ZERO, Cosine::Own));
        let looked: Vec<Rgb> = axes.places().map(light).collect();
        let light = axes.linear_light(|place| looked[place as usize], 0.0);
        Some(LightPlane { axes, light })
    }

    /// The same at a point: one place of each group is tried.
    fn look_at_faint_groups(&self, from: &Viewpoint) -> Rgb {
        let gather = self.gather;
        let Some(tree) = gather.emitter_tree() else { return Rgb::ZERO };
        let origin = from.aside(ASIDE * gather.geometry.size);
        let shift = shift(from.position, 0);
        let from_group = |(number, &group): (usize, &u32)| {
            let shift = shift + STEP * number as f64;
            let polygon = tree.pick(group, shift.x.fract());
            let place = Fan::new(gather.geometry.outline(polygon)).place(DVec2::new(shift.y, shift.x + shift.y), 0);
            let way = place - origin.position;
            let normal = gather.geometry.plane(polygon).normal;
            let square = way.length_squared().max(f64::MIN_POSITIVE);
            let per_area = origin.height(way) * normal.dot(-way).max(0.0) / (PI * square * square);
            if per_area == 0.0
                || gather.tree.is_blocked(self.polygon, origin.position, place, |other| {
                    other == polygon || !origin.may_meet(gather.geometry.outline(other))
                })
            {
                return Rgb::ZERO;
            }
            let exitance = gather.scene.material(polygon).exitance();
            exitance / luminance(exitance) * (tree.power(group) * per_area)
        };
        self.faint.groups.iter().enumerate().map(from_group).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::testing::Builder;
    use crate::{Gather, Shafts, SolveOptions, Surroundings, form_factor_at, solve};

    /// A square from a corner, its front up or down.
    fn square(corner: DVec3, side: f64, up: bool) -> Vec<DVec3> {
        let mut outline = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| corner + DVec3::new(x, y, 0.0) * side);
        if !up {
            outline.reverse();
        }
        outline.to_vec()
    }

    /// A small tile under 441 lamps, far above a large floor.
    #[test]
    fn light_of_faint_lamps_is_linear_over_a_small_element_and_not_where_it_is_checked() {
        let lamps: Vec<_> = (0..441).map(|i| DVec3::new(f64::from(i % 21), f64::from(i / 21), 4.0)).collect();
        let lamps: Vec<_> = lamps.into_iter().map(|corner| square(corner, 0.5, false)).collect();
        let dark = Builder::default().material(0.0, 0.0).polygon(&square(DVec3::new(10.0, 10.0, 0.0), 0.5, true));
        let dark = dark.polygon(&square(DVec3::new(-20.0, -20.0, -10.0), 60.0, true));
        let scene = lamps.iter().fold(dark.material(0.0, 1.0), |scene, lamp| scene.polygon(lamp)).build();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let tile = solution.leaves_of(0)[0];
        let light = |gather: &Gather<'_>, x: f64| {
            let leaf = gather.over_emitters(tile, &mut Shafts::default());
            assert!(leaf.sources.is_empty(), "all are faint");
            let place = DVec3::new(10.0 + x, 10.2, 0.0);
            leaf.light_of_faint_groups(&gather.viewpoint(0, place, DVec3::ZERO, Cosine::Own)).x
        };
        let surroundings = Surroundings::new(&scene, &solution);
        let bakes = Gather::with_source_error(&surroundings, &solution, 0.5);
        let [from, middle, to] = [0.0, 0.25, 0.5].map(|x| light(&bakes, x));
        assert!((from + to - 2.0 * middle).abs() < 1e-12 * middle);
        let checks = Gather::with_turned_rays(&surroundings, &solution, 2.0, 1);
        let [from, between, to] = [0.0, 0.25, 0.5].map(|x| light(&checks, x));
        assert!((from + to - 2.0 * between).abs() > 1e-6 * between);
        let lamp = |lamp: &Vec<DVec3>| form_factor_at(DVec3::new(10.25, 10.2, 0.0), DVec3::Z, lamp).abs() * PI;
        let exact: f64 = lamps.iter().map(lamp).sum();
        for found in [middle, between] {
            assert!((found / exact - 1.0).abs() < 0.15, "{found} in place of {exact}");
        }
    }

    /// 49 plates before a lamp, side by side, of 449 polygons: where the lamp is worth as many rays, what is left of it is exact.
    #[test]
    fn what_many_obstacles_hide_of_a_strong_lamp_is_exact() {
        let grid = |count: i32, step: f64, z: f64| {
            (0..count * count).map(move |i| DVec3::new(f64::from(i % count) * step, f64::from(i / count) * step, z))
        };
        let plates: Vec<_> = grid(7, 0.1, 2.0).map(|corner| square(corner + DVec3::splat(0.01), 0.05, true)).collect();
        let lamp = square(DVec3::new(-0.1, -0.1, 2.1), 0.9, false);
        let floor = square(DVec3::new(-1.0, -1.0, 0.0), 3.0, true);
        let apart = grid(20, 0.5, -9.0).map(|corner| square(corner, 0.4, true));
        let dark = Builder::default().material(0.0, 0.0).polygon(&floor);
        let dark = plates.iter().cloned().chain(apart).fold(dark, |scene, outline| scene.polygon(&outline));
        let scene = dark.material(0.0, 1.0).polygon(&lamp).build();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::with_source_error(&surroundings, &solution, 1e-3);
        let place = DVec3::new(0.3, 0.2, 0.0);
        let seen = |outline: &Vec<DVec3>| form_factor_at(place, DVec3::Z, outline).abs() * PI;
        let exact = seen(&lamp) - plates.iter().map(seen).sum::<f64>();
        let light = gather.irradiance_at(0, place, DVec3::ZERO).x;
        assert!((light / exact - 1.0).abs() < 1e-9, "{light} in place of {exact}");
    }
}
