//! Light from the sky: what an element, and a point of it, sees of its cells.
//!
//! Cells are so far away that what one sends does not depend on the place. Those that nothing stands before are added up for an
//! element, once for all its points; those that something hides wholly are left out. Only of the others does a point ask how
//! much it sees: what stands in the shaft to them is projected, or where that is too much, rays tell.
//!
//! A cell that is hidden is mostly hidden by one large polygon, which a single ray finds: then its parts need not be looked at.

use std::cell::OnceCell;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use scene::{Plane, Rgb, Scene, area_vector, luminance};

use crate::Gather;
use crate::backprojection::{Fragments, SLIVER, Viewpoint};
use crate::clip::clip_convex;
use crate::form_factor::point_form_factor;
use crate::lattice::{Fan, hemisphere, shift, spread};
use crate::leaf_gather::{Cones, LeafGather, Obstacle};
use crate::light_tree::Horizon;
use crate::openings::{BEYOND, SeenCell};
use crate::polygon_tree::{PolygonTree, Stands};
use crate::ray_gather::ASIDE;
use crate::visibility::{Occlusion, Shaft};
use crate::{Interaction, NodeId, SkyCell, Solution};

/// How far away the sky is taken to be where a shaft leads to it, in sizes of the scene: what a parallax of a millionth may
/// hide is less than what welding moves.
const FAR: f64 = 1e6;

/// The same where a cell is a source of lines: these are drawn, and need not be proved.
const FAR_SOURCE: f64 = 1e4;

/// Angle, radians, up to which a cell is small: its shadows have borders narrower than that part of the way to what casts them.
const SMALL: f64 = 0.03;

/// Polygons before a cell with parts, at most, for which all of it is looked at at once: what is seen of it is then cut along its
/// parts. More has every point project what hides nothing of most parts, less has it look at more cells.
const FEW: usize = 12;

/// Polygons before a cell that has parts, at most, for the parts to be told which. More are looked for anew by every part.
const MOST_INHERITED: usize = 48;

/// Length of patches, as a part of the scene's size, that have no shafts to the sky in a scene of very many polygons: there are
/// too many of them, and each is looked at once.
const SHORT: f64 = 0.01;

/// Their points have this part of the rays: there are many, and what each is off by is lost among them.
const SHORT_PART: u32 = 2;

/// What is taken to be unsure at least of a cell that all or no places see. Less lets rays miss what they were not told of.
const UNSURE: f64 = 0.15;

/// Rays that tell how much light comes in where nothing is known.
const GUESSING_RAYS: u32 = 4096;

/// What the points of an element may see of the sky.
#[derive(Clone, Default)]
pub(crate) struct SkyView {
    /// For each colour, what a normal is multiplied by for the irradiance from cells that all points see all of.
    clear: [DVec3; 3],
    /// Cells that points may see some of.
    cells: Vec<DoubtfulCell>,
    /// Cells without parts that rays tell of.
    by_rays: Vec<SeenCell>,
    /// Whether the element is short and has no shafts.
    is_short: bool,
}

/// A cell that something may stand before, or that the horizon cuts.
#[derive(Clone)]
struct DoubtfulCell {
    cell: u32,
    /// Polygons that may stand before it, ascending.
    blockers: Vec<u32>,
    /// The same as obstacles, once a point asks.
    before: OnceCell<Vec<Obstacle>>,
}

impl SkyView {
    /// Polygons that may stand before some cell.
    pub fn blockers(&self) -> impl Iterator<Item = &u32> {
        self.cells.iter().flat_map(|cell| &cell.blockers)
    }
}

/// An element that looks at the sky.
struct Look<'a> {
    gather: &'a Gather<'a>,
    polygon: u32,
    outline: &'a [DVec3],
    centre: DVec3,
    horizon: &'a Horizon,
    /// The cells that are seen from about there, ascending, where that is known.
    seen: Option<&'a [SeenCell]>,
}

impl Gather<'_> {
    /// What the points of an element may see of the sky.
    pub(crate) fn over_sky(&self, element: NodeId, horizon: &Horizon) -> SkyView {
        let Solution { elements, sky, openings, .. } = self.solution;
        let centre = elements.nodes[element as usize].centre;
        let seen = openings.as_ref().and_then(|openings| openings.from(centre));
        let mut view = SkyView::default();
        if let Some(seen) = seen
            && elements.cell_length(element) < SHORT * self.geometry.size
        {
            let up = horizon.plane.normal;
            let rises = |seen: &&SeenCell| sky.cells[seen.cell as usize].corners.iter().any(|way| up.dot(*way) > 0.0);
            view.by_rays = seen.iter().filter(rises).copied().collect();
            view.is_short = true;
            return view;
        }
        let polygon = elements.polygon_of(element).unwrap_or_default();
        let look = Look { gather: self, polygon, outline: elements.outline(element), centre, horizon, seen };
        for cell in 0..sky.roots {
            look.at(cell, None, &mut view);
        }
        view
    }
}

impl Look<'_> {
    /// Looks at a cell, before which no other polygons stand than those that may be given, ascending.
    fn at(&self, cell: u32, known: Option<&[u32]>, view: &mut SkyView) {
        let Gather { solution, geometry, tree, .. } = self.gather;
        let SkyCell { corners, light, parts, .. } = &solution.sky.cells[cell as usize];
        let up = self.horizon.plane.normal;
        let far: Vec<DVec3> = corners.iter().map(|way| self.centre + *way * (FAR * geometry.size)).collect();
        let mut above = Vec::with_capacity(far.len() + 1);
        clip_convex(&far, geometry.contact_tolerance, |corner| self.horizon.plane.distance(corner), &mut above);
        if above.is_empty() {
            return;
        }
        let shaft = Shaft::between_far(self.outline, &above, geometry.size);
        let stands = match known {
            Some(polygons) => PolygonTree::narrowed(geometry, &shaft, polygons.to_vec()),
            None => {
                let middle = above.iter().map(|corner| corner - self.centre).sum::<DVec3>();
                let met = tree.first_met(self.polygon, self.centre, middle);
                if met.is_some_and(|met| shaft.classify(geometry.outline(met)) == Occlusion::Total) {
                    return;
                }
                tree.few_in_shaft(geometry, &shaft, MOST_INHERITED)
            }
        };
        let mut polygons = match stands {
            Stands::All => return,
            Stands::Many if parts.is_empty() => return view.by_rays.extend(self.seen(cell)),
            Stands::Many => return parts.clone().for_each(|part| self.at(part, None, view)),
            Stands::Some(polygons) => polygons,
        };
        polygons.retain(|&polygon| polygon != self.polygon);
        let rises = |way: &DVec3| up.dot(*way) >= self.horizon.tilt.sin() * way.length();
        if polygons.is_empty() && corners.iter().all(rises) {
            (0..3).for_each(|colour| view.clear[colour] += light[colour]);
        } else if parts.is_empty() || polygons.len() <= FEW {
            view.cells.push(DoubtfulCell { cell, blockers: polygons, before: OnceCell::new() });
        } else {
            parts.clone().for_each(|part| self.at(part, Some(&polygons), view));
        }
    }

    /// A cell that rays are to tell of; none where it is known that nothing is seen of it.
    fn seen(&self, cell: u32) -> Option<SeenCell> {
        let Some(seen) = self.seen else { return Some(SeenCell { cell, share: 0.5 }) };
        seen.binary_search_by_key(&cell, |seen| seen.cell).ok().map(|place| seen[place])
    }
}

impl LeafGather<'_> {
    /// Irradiance from the sky at a point, W·m⁻². `cones` are those that the point has needed so far.
    pub(crate) fn light_of_sky(&self, from: &Viewpoint, cones: &mut Cones, fragments: &mut Fragments) -> Rgb {
        let mut total = Rgb::from_array(self.sky.clear.map(|light| light.dot(from.normal)));
        for doubtful in &self.sky.cells {
            total += self.light_of_cell(doubtful, from, cones, fragments);
        }
        total + self.light_by_rays(from)
    }

    /// The cells that something stands before and that are small enough to cast sharp shadows, if they send at least so much to a
    /// surface with a normal, luminance, W·m⁻².
    pub(crate) fn small_cells(&self, normal: DVec3, least: f64) -> Vec<Interaction> {
        let Gather { geometry, solution, .. } = self.gather;
        let interaction = |doubtful: &DoubtfulCell| {
            let SkyCell { corners, exitance, light, parts } = &solution.sky.cells[doubtful.cell as usize];
            let irradiance = luminance(Rgb::from_array(light.map(|light| light.dot(normal))));
            let wide = corners.iter().map(|corner| corner.angle_between(corners[0])).fold(0.0, f64::max);
            let casts = parts.is_empty() && wide <= SMALL && irradiance >= least && !doubtful.blockers.is_empty();
            let far = |way: &DVec3| self.centre + *way * (FAR_SOURCE * geometry.size);
            casts.then(|| Interaction {
                source: u32::MAX - doubtful.cell,
                far_outline: Some(corners.iter().map(far).collect()),
                radiosity: luminance(*exitance),
                blockers: doubtful.blockers.clone(),
            })
        };
        self.sky.cells.iter().filter_map(interaction).collect()
    }

    /// Irradiance from what a point sees of a cell, W·m⁻².
    fn light_of_cell(
        &self,
        doubtful: &DoubtfulCell,
        from: &Viewpoint,
        cones: &mut Cones,
        fragments: &mut Fragments,
    ) -> Rgb {
        let cell = &self.gather.solution.sky.cells[doubtful.cell as usize];
        fragments.start(&cell.corners, from);
        if fragments.is_empty() {
            return Rgb::ZERO;
        }
        let obstacles = doubtful.before.get_or_init(|| {
            let axis = cell.corners.iter().sum::<DVec3>().normalize_or_zero();
            let reach = BEYOND * self.gather.geometry.size;
            self.before(&Plane { normal: -axis, offset: -axis.dot(self.centre) - reach }, &doubtful.blockers)
        });
        for obstacle in obstacles {
            if fragments.is_empty() {
                return Rgb::ZERO;
            }
            self.subtract(obstacle, from, cones, fragments);
        }
        fragments.measure(from.normal);
        fragments.iter().map(|(fragment, factor)| self.light_of_fragment(doubtful.cell, fragment, factor, from)).sum()
    }

    /// Irradiance from a part of a cell, W·m⁻², given by its form factor; cut along the cell's parts.
    fn light_of_fragment(&self, cell: u32, fragment: &[DVec3], form_factor: f64, from: &Viewpoint) -> Rgb {
        let sky = &self.gather.solution.sky;
        let SkyCell { exitance, parts, .. } = &sky.cells[cell as usize];
        if form_factor <= SLIVER {
            return Rgb::ZERO;
        }
        if parts.is_empty() {
            return *exitance * form_factor;
        }
        let light_of_part = |part: u32| {
            let corners = &sky.cells[part as usize].corners;
            let mut rest = fragment.to_vec();
            for (i, &corner) in corners.iter().enumerate() {
                let inward = corners[(i + 1) % corners.len()].cross(corner);
                if rest.iter().all(|way| inward.dot(*way) >= 0.0) {
                    continue;
                }
                let mut kept = Vec::with_capacity(rest.len() + 1);
                clip_convex(&rest, 0.0, |way| inward.dot(way), &mut kept);
                if kept.is_empty() {
                    return Rgb::ZERO;
                }
                rest = kept;
            }
            self.light_of_fragment(part, &rest, point_form_factor(&rest, from.normal), from)
        };
        parts.clone().map(light_of_part).sum()
    }

    /// Irradiance from the cells that rays tell of, W·m⁻²: each ray goes to a cell as often as that is in doubt, and counts for as
    /// much as it stands for.
    fn light_by_rays(&self, from: &Viewpoint) -> Rgb {
        let gather = self.gather;
        let doubt = |seen: &SeenCell| {
            let cell = &gather.solution.sky.cells[seen.cell as usize];
            let most = Rgb::from_array(cell.light.map(|light| light.dot(from.normal).max(0.0)));
            let share = f64::from(seen.share);
            luminance(most) * (share * (1.0 - share)).sqrt().max(UNSURE)
        };
        let mut sum = 0.0;
        let sums: Vec<f64> = self
            .sky
            .by_rays
            .iter()
            .map(|seen| {
                sum += doubt(seen);
                sum
            })
            .collect();
        if sum <= 0.0 {
            return Rgb::ZERO;
        }
        let (rays, turn) = gather.sampling;
        let rays = if self.sky.is_short { rays.div_ceil(SHORT_PART) } else { rays };
        let origin = from.aside(ASIDE * gather.geometry.size);
        let first = shift(from.position, turn);
        let passes = |polygon: u32| !origin.may_meet(gather.geometry.outline(polygon));
        let reach = BEYOND * gather.geometry.size;
        let light = |ray: u32| {
            let wanted = (f64::from(ray) + first.x) / f64::from(rays) * sum;
            let place = sums.partition_point(|&sum| sum <= wanted).min(sums.len() - 1);
            let chance = (sums[place] - place.checked_sub(1).map_or(0.0, |before| sums[before])) / sum;
            let cell = &gather.solution.sky.cells[self.sky.by_rays[place].cell as usize];
            let way = Fan::new(&cell.corners).place(first, ray);
            let height = origin.height(way);
            if chance <= 0.0
                || height == 0.0
                || gather.tree.is_blocked(self.polygon, origin.position, origin.position + way * reach, passes)
            {
                return Rgb::ZERO;
            }
            // A part of the cell's plane, seen from a distance of 1 to it, for the part of the directions.
            let square = way.length_squared();
            let area = area_vector(&cell.corners);
            cell.exitance * (height * area.dot(way).abs() / (PI * square * square * chance))
        };
        (0..rays).map(light).sum::<Rgb>() / f64::from(rays)
    }
}

/// Mean irradiance of all surfaces that comes straight from the sky, W·m⁻²: by rays from all over them.
pub(crate) fn mean_irradiance_from_sky(scene: &Scene, tree: &PolygonTree) -> Rgb {
    let (Some(environment), area) = (&scene.environment, scene.surface_area()) else { return Rgb::ZERO };
    let reach = BEYOND * scene.size();
    let (mut sum, mut before, mut polygons) = (Rgb::ZERO, 0.0, scene.polygon_ids());
    let mut next = polygons.next();
    for ray in 0..GUESSING_RAYS {
        // The surfaces one after another, each as often as its area says.
        let place = (f64::from(ray) + 0.5) / f64::from(GUESSING_RAYS) * area;
        while let Some(polygon) = next
            && before + scene.area(polygon) < place
        {
            before += scene.area(polygon);
            next = polygons.next();
        }
        let Some(polygon) = next else { break };
        let outline = scene.outline(polygon);
        let normal = scene.plane(polygon).normal;
        let shift = spread(DVec2::ZERO, ray);
        let origin = Fan::new(&outline).place(shift, 0);
        let is_free = |direction: DVec3| !tree.is_blocked(polygon, origin, origin + direction * reach, |_| false);
        if let Some(direction) = hemisphere(normal, 1, DVec2::new(shift.y, shift.x)).next()
            && is_free(direction)
        {
            sum += environment.radiance(direction) * PI;
        }
        if let Some((direction, irradiance)) = environment.sun()
            && normal.dot(direction) > 0.0
            && is_free(direction)
        {
            sum += irradiance * normal.dot(direction);
        }
    }
    sum / f64::from(GUESSING_RAYS)
}

#[cfg(test)]
mod tests;
