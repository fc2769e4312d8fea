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
use scene::{Bvh, Plane, Rgb, Scene, luminance};

use crate::Gather;
use crate::backprojection::{Fragments, Viewpoint};
use crate::clip::clip_convex;
use crate::lattice::{Fan, hemisphere, spread};
use crate::leaf_gather::{Cones, LeafGather, MOST_OBSTACLES, Obstacle};
use crate::light_tree::Horizon;
use crate::polygon_tree::{PolygonTree, Stands};
use crate::visibility::{Occlusion, Shaft};
use crate::{NodeId, SkyCell, SkyCells};

/// How far away the sky is taken to be where a shaft leads to it, in sizes of the scene: what a parallax of a millionth may
/// hide is less than what welding moves.
const FAR: f64 = 1e6;

/// How far rays to the sky go, in sizes of the scene: nothing stands beyond.
const BEYOND: f64 = 2.0;

/// Polygons that stand before a cell that has parts, at most, for the parts to be told which. More are looked for anew by every
/// part; less finds out more often what is known.
const MOST_INHERITED: usize = 24;

/// Rays that tell how much light comes in where nothing is known.
const GUESSING_RAYS: u32 = 4096;

/// What the points of an element may see of the sky.
#[derive(Clone, Default)]
pub(crate) struct SkyView {
    /// For each colour, what a normal is multiplied by for the irradiance from cells that all points see all of.
    clear: [DVec3; 3],
    /// Cells that points may see some of.
    cells: Vec<DoubtfulCell>,
}

/// A cell that something may stand before, or that the horizon cuts.
#[derive(Clone)]
struct DoubtfulCell {
    cell: u32,
    /// Polygons that may stand before it, ascending; none if rays tell.
    blockers: Option<Vec<u32>>,
    /// The same as obstacles, once a point asks.
    before: OnceCell<Vec<Obstacle>>,
}

impl SkyView {
    /// Polygons that may stand before some cell.
    pub fn blockers(&self) -> impl Iterator<Item = &u32> {
        self.cells.iter().filter_map(|cell| cell.blockers.as_ref()).flatten()
    }
}

/// An element that looks at the sky.
struct Look<'a> {
    gather: &'a Gather<'a>,
    polygon: u32,
    outline: &'a [DVec3],
    centre: DVec3,
    horizon: &'a Horizon,
}

impl Gather<'_> {
    /// What the points of an element may see of the sky.
    pub(crate) fn over_sky(&self, element: NodeId, horizon: &Horizon) -> SkyView {
        let elements = &self.solution.elements;
        let mut view = SkyView::default();
        let look = Look {
            gather: self,
            polygon: elements.polygon_of(element).unwrap_or_default(),
            outline: elements.outline(element),
            centre: elements.nodes[element as usize].centre,
            horizon,
        };
        for cell in 0..self.solution.sky.roots {
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
                if parts.is_empty() {
                    tree.in_shaft(geometry, &shaft)
                } else {
                    tree.few_in_shaft(geometry, &shaft, MOST_INHERITED)
                }
            }
        };
        let blockers = match stands {
            Stands::All => return,
            Stands::Many => None,
            Stands::Some(mut polygons) => {
                polygons.retain(|&polygon| polygon != self.polygon);
                Some(polygons)
            }
        };
        let rises = |way: &DVec3| up.dot(*way) >= self.horizon.tilt.sin() * way.length();
        if blockers.as_ref().is_some_and(Vec::is_empty) && corners.iter().all(rises) {
            (0..3).for_each(|colour| view.clear[colour] += light[colour]);
        } else if parts.is_empty() {
            view.cells.push(DoubtfulCell { cell, blockers, before: OnceCell::new() });
        } else {
            parts.clone().for_each(|part| self.at(part, blockers.as_deref(), view));
        }
    }
}

impl LeafGather<'_> {
    /// Irradiance from the sky at a point, W·m⁻². `cones` are those that the point has needed so far.
    pub(crate) fn light_of_sky(&self, from: &Viewpoint, cones: &mut Cones, fragments: &mut Fragments) -> Rgb {
        let SkyCells { cells, .. } = &self.gather.solution.sky;
        let clear = Rgb::from_array(self.sky.clear.map(|light| light.dot(from.normal)));
        let seen = |doubtful: &DoubtfulCell| {
            let cell = &cells[doubtful.cell as usize];
            cell.exitance * self.seen_of_cell(cell, doubtful, from, cones, fragments)
        };
        clear + self.sky.cells.iter().map(seen).sum::<Rgb>()
    }

    /// Form factor of what a point sees of a cell.
    fn seen_of_cell(
        &self,
        cell: &SkyCell,
        doubtful: &DoubtfulCell,
        from: &Viewpoint,
        cones: &mut Cones,
        fragments: &mut Fragments,
    ) -> f64 {
        let geometry = &self.gather.geometry;
        let reach = BEYOND * geometry.size;
        let ways: Vec<DVec3> = cell.corners.iter().map(|way| way * reach).collect();
        fragments.start(&ways, from);
        if fragments.is_empty() {
            return 0.0;
        }
        let obstacles = doubtful.before.get_or_init(|| {
            let axis = cell.corners.iter().sum::<DVec3>().normalize_or_zero();
            let plane = Plane { normal: -axis, offset: -axis.dot(self.centre) - reach };
            self.before(&plane, doubtful.blockers.as_deref().unwrap_or_default())
        });
        let by_rays = doubtful.blockers.is_none() || obstacles.len() > MOST_OBSTACLES;
        if by_rays || !obstacles.is_empty() {
            let unoccluded = fragments.measure(from.normal);
            let irradiance = unoccluded * luminance(cell.exitance);
            if by_rays || irradiance <= self.gather.budget() {
                let outline: Vec<DVec3> = ways.iter().map(|way| from.position + *way).collect();
                return unoccluded * self.seen_share(&outline, irradiance, from, |_| false);
            }
        }
        for obstacle in obstacles {
            if fragments.is_empty() {
                return 0.0;
            }
            self.subtract(obstacle, from, cones, fragments);
        }
        fragments.measure(from.normal)
    }
}

/// Mean irradiance of all surfaces that comes straight from the sky, W·m⁻²: by rays from all over them.
pub(crate) fn mean_irradiance_from_sky(scene: &Scene) -> Rgb {
    let (Some(environment), area) = (&scene.environment, scene.surface_area()) else { return Rgb::ZERO };
    let bvh = Bvh::of_scene(scene);
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
        let is_free =
            |direction: DVec3| !bvh.is_blocked_among(origin, origin + direction * reach, |other| other != polygon);
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
