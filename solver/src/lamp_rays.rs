//! Light from emitters by rays: for those that are too faint at a point, or hidden by too much, to be projected.

use glam::{DVec2, DVec3};
use scene::{Rgb, luminance};

use crate::backprojection::Viewpoint;
use crate::leaf_gather::LeafGather;
use crate::ray_gather::{ASIDE, STEP, shift, spread_over};

/// What rays to one emitter may scatter by, as a part of the budget, where half of it is hidden. Less takes more rays.
const SCATTER: f64 = 0.2;

/// Rays to one emitter at most.
const MOST_RAYS: f64 = 25.0;

impl LeafGather<'_> {
    /// The share of what an outline sends to a point that arrives there, by rays to points spread evenly over it; `unoccluded`
    /// is all that it sends, luminance, W·m⁻², and decides how many. To stop early where the first few agree would take what is
    /// mostly seen for seen wholly.
    pub(crate) fn seen_share(
        &self,
        outline: &[DVec3],
        unoccluded: f64,
        from: &Viewpoint,
        passes: impl Fn(u32) -> bool,
    ) -> f64 {
        let gather = self.gather;
        let origin = from.position + from.inward * (ASIDE * gather.geometry.size);
        let normal = scene::area_vector(outline).normalize_or_zero();
        let areas: Vec<f64> =
            outline[1..].windows(2).map(|edge| (edge[0] - outline[0]).cross(edge[1] - outline[0]).length()).collect();
        let total: f64 = areas.iter().sum();
        let shift = shift(from.position, 0);
        // What rays that are spread evenly are off by falls with their number to the power of −3/4.
        let relative = unoccluded / gather.budget().max(f64::MIN_POSITIVE);
        let rays = (relative / (2.0 * SCATTER)).powf(4.0 / 3.0).ceil().clamp(1.0, MOST_RAYS) as u32;
        let (mut seen, mut all) = (0.0, 0.0);
        for i in 0..rays {
            let place = spread_over(outline, &areas, total, shift, i);
            let way = place - origin;
            let square = way.length_squared();
            let weight = from.up.dot(way).max(0.0) * normal.dot(way).abs() / (square * square).max(f64::MIN_POSITIVE);
            if weight > 0.0 {
                all += weight;
                if !gather.tree.is_blocked(self.polygon, origin, place, &passes) {
                    seen += weight;
                }
            }
        }
        if all > 0.0 { seen / all } else { 0.0 }
    }

    /// Light from the groups of emitters that are faint at the leaf, W·m⁻²: one place of each is tried.
    pub(crate) fn light_of_faint_groups(&self, from: &Viewpoint) -> Rgb {
        let gather = self.gather;
        let Some(tree) = gather.emitter_tree().filter(|_| !self.groups.is_empty()) else { return Rgb::ZERO };
        let origin = from.position + from.inward * (ASIDE * gather.geometry.size);
        let shift = shift(from.position, 0);
        let from_group = |(number, &group): (usize, &u32)| {
            let shift = shift + DVec2::new(number as f64 * STEP[0], number as f64 * STEP[1]);
            let polygon = tree.pick(group, shift.x.fract());
            let outline = gather.geometry.outline(polygon);
            let areas: Vec<f64> = outline[1..]
                .windows(2)
                .map(|edge| (edge[0] - outline[0]).cross(edge[1] - outline[0]).length())
                .collect();
            let place = spread_over(outline, &areas, areas.iter().sum(), DVec2::new(shift.y, shift.x + shift.y), 0);
            let way = place - origin;
            let normal = gather.geometry.plane(polygon).normal;
            let square = way.length_squared().max(f64::MIN_POSITIVE);
            let per_area =
                from.up.dot(way).max(0.0) * normal.dot(-way).max(0.0) / (std::f64::consts::PI * square * square);
            if per_area == 0.0 || gather.tree.is_blocked(self.polygon, origin, place, |other| other == polygon) {
                return Rgb::ZERO;
            }
            let exitance = gather.scene.material(polygon).exitance();
            exitance / luminance(exitance) * (tree.power(group) * per_area)
        };
        self.groups.iter().enumerate().map(from_group).sum()
    }
}
