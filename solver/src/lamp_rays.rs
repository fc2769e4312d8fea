//! Light from emitters by rays: for those that are too faint at a point, or hidden by too much, to be projected.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use scene::{Rgb, luminance};

use crate::backprojection::Viewpoint;
use crate::lattice::{Fan, STEP, shift};
use crate::leaf_gather::LeafGather;
use crate::ray_gather::ASIDE;

/// What rays to one emitter may scatter by, as a part of the budget, where half of it is hidden. Less takes more rays.
const SCATTER: f64 = 0.2;

/// Rays to one emitter at most.
const MOST_RAYS: f64 = 25.0;

impl LeafGather<'_> {
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
        // What rays that are spread evenly are off by falls with their number to the power of −3/4.
        let relative = unoccluded / gather.budget().max(f64::MIN_POSITIVE);
        let rays = (relative / (2.0 * SCATTER)).powf(4.0 / 3.0).ceil().clamp(1.0, MOST_RAYS) as u32;
        let passes = |polygon| passes(polygon) || !origin.may_meet(gather.geometry.outline(polygon));
        let is_blocked = |place| gather.tree.is_blocked(self.polygon, origin.position, place, passes);
        Fan::new(outline).arriving(&origin, (shift(from.position, 0), rays), is_blocked).share
    }

    /// Light from the groups of emitters that are faint at the leaf, W·m⁻²: one place of each is tried.
    pub(crate) fn light_of_faint_groups(&self, from: &Viewpoint) -> Rgb {
        let gather = self.gather;
        let Some(tree) = gather.emitter_tree().filter(|_| !self.groups.is_empty()) else { return Rgb::ZERO };
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
        self.groups.iter().enumerate().map(from_group).sum()
    }
}
