//! A gather to the points of one leaf (Hardt & Teller 1996, section 5): its sources with their blockers, the fragments
//! that a point sees of them, and the nodes that these fragments are parts of.
//!
//! What a point sees of reflectors does not depend on how bright they are. It is told as a list of [`SeenNode`]s, so that
//! light can be sent over it again and again, until it no longer changes, for one search for what is visible.
//!
//! A room of a hundred polygons has a dozen that matter at any one point. The others are told from them by their form factor
//! as if nothing hid them; for these the links' visibility is good enough.

use std::cell::OnceCell;
use std::collections::HashMap;

use glam::DVec3;
use scene::{Plane, Rgb, luminance};

use crate::backprojection::{BlockerCone, Fragments, Viewpoint};
use crate::blocker::Blocker;
use crate::emitter::outline_of;
use crate::lamp_rays::FaintGroups;
use crate::sky_view::SkyView;
use crate::{Cosine, Gather, NodeId, SeenNode};

/// The part of a source's form factor from which on nothing is taken to hide it: above the rounding of its clipping.
const WHOLE: f64 = 1.0 - 1e-9;

/// A gather for the points of one leaf element: sources and blockers that its links name.
pub struct LeafGather<'a> {
    pub(crate) gather: &'a Gather<'a>,
    pub(crate) polygon: u32,
    /// Centre of the element, metres.
    pub(crate) centre: DVec3,
    pub(crate) sources: Vec<Source>,
    pub(crate) faint: FaintGroups,
    /// Rays that each of its points looks at reflectors with, in a scene without links.
    pub(crate) rays: u32,
    /// Irradiance, luminance, W·m⁻², that one of many sources may misplace at its points.
    pub(crate) budget: f64,
    /// What its points may see of the sky.
    pub(crate) sky: SkyView,
    /// All blockers of all sources, ascending.
    pub(crate) blockers: Vec<u32>,
}

/// A source polygon before a leaf, or one patch of it.
#[derive(Clone)]
pub(crate) struct Source {
    pub polygon: u32,
    /// The emitter that it is, if it is a convex body.
    pub body: Option<u32>,
    /// Root nodes of the patches that it stands for, each with its visible fraction, 0..=1, as the links know it.
    pub roots: Vec<(NodeId, f64)>,
    /// The root, if it stands for one patch of several alone.
    pub part: Option<NodeId>,
    /// Polygons that may hide it, ascending; none if rays tell what is seen of it.
    pub blockers: Option<Vec<u32>>,
    /// The same as they are before the source: found out when a point needs them first, since most sources are too dim for
    /// that.
    pub before: OnceCell<Vec<Obstacle>>,
}

/// What may hide a source: a polygon, or several that are faces of one convex solid.
#[derive(Clone)]
pub(crate) struct Obstacle {
    solid: Option<u32>,
    /// Each with its number among the leaf's blockers.
    faces: Vec<(usize, Blocker)>,
}

impl Source {
    /// Corners, metres.
    pub fn outline<'a>(&self, gather: &'a Gather<'_>) -> &'a [DVec3] {
        match self.part {
            Some(root) => gather.solution.elements.outline(root),
            None => gather.geometry.outline(self.polygon),
        }
    }

    fn blockers(&self) -> &[u32] {
        self.blockers.as_deref().unwrap_or_default()
    }
}

/// What obstacles hide from one point, as far as it has been asked: no cone where one hides nothing, or a solid has none.
pub(crate) struct Cones {
    of_solids: HashMap<u32, Option<BlockerCone>>,
    /// By number among the leaf's blockers.
    of_faces: Vec<Option<Option<BlockerCone>>>,
}

/// Irradiance straight from what shines by itself, W·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DirectIrradiance {
    /// From surfaces that emit.
    pub emitters: Rgb,
    /// From the scene's environment.
    pub sky: Rgb,
}

impl DirectIrradiance {
    /// From both.
    pub fn total(&self) -> Rgb {
        self.emitters + self.sky
    }
}

/// Which of its sources' light a point is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Light {
    Emitted,
    Reflected,
    Both,
}

impl LeafGather<'_> {
    /// Irradiance at a position of the leaf, by the shading normal if it has one, W·m⁻². `inward` is a direction in the leaf's
    /// plane: where other polygons touch the position, the limit is taken from that side; elsewhere it has no influence.
    pub fn irradiance(&self, position: DVec3, inward: DVec3) -> Rgb {
        let mut seen = Vec::new();
        let emitted = match self.gather.rays() {
            None => self.look(position, inward, (Light::Both, Cosine::Shading), &mut seen),
            Some(_) => {
                self.seen_nodes(position, inward, Cosine::Shading, &mut seen);
                self.emitted(position, inward, Cosine::Shading)
            }
        };
        emitted.total() + self.gather.irradiance_from(&seen)
    }

    /// The part of the irradiance that comes straight from emitters and from the sky: exact but where rays tell what is seen.
    pub fn emitted(&self, position: DVec3, inward: DVec3, cosine: Cosine) -> DirectIrradiance {
        self.look(position, inward, (Light::Emitted, cosine), &mut Vec::new())
    }

    /// Appends the nodes of reflectors that a position sees. Nodes are opened as far as the light of the solution asks for.
    pub fn seen_nodes(&self, position: DVec3, inward: DVec3, cosine: Cosine, seen: &mut Vec<SeenNode>) {
        match self.gather.rays() {
            None => {
                self.look(position, inward, (Light::Reflected, cosine), seen);
            }
            Some(rays) => {
                let from = self.gather.viewpoint(self.polygon, position, inward, cosine);
                rays.seen_nodes(self.gather.solution, (self.polygon, self.rays, self.budget), &from, seen);
            }
        }
    }

    /// What may hide a source in a plane, its front towards the element: blockers before it, gathered to solids where all of a
    /// solid is.
    pub(crate) fn before(&self, plane: &Plane, blockers: &[u32]) -> Vec<Obstacle> {
        let Gather { scene, geometry, solids, .. } = self.gather;
        let mut obstacles: Vec<Obstacle> = Vec::new();
        for &polygon in blockers {
            let number = self.blockers.partition_point(|&other| other < polygon);
            let Some(blocker) = Blocker::before(geometry, plane, polygon) else { continue };
            let known = |solid: u32| obstacles.iter().position(|obstacle| obstacle.solid == Some(solid));
            let solid = solids.of_polygon(polygon);
            if let Some(place) = solid.and_then(known) {
                obstacles[place].faces.push((number, blocker));
                continue;
            }
            let whole = |&solid: &u32| solids.is_before(scene, solid, plane, geometry.contact_tolerance);
            obstacles.push(Obstacle { solid: solid.filter(whole), faces: vec![(number, blocker)] });
        }
        obstacles
    }

    /// The plane that a source lies in, its front towards the element. For a body it is the one through the middle: what is
    /// beyond it hides nothing.
    fn plane(&self, source: &Source) -> Plane {
        let Some(body) = source.body else { return self.gather.geometry.plane(source.polygon) };
        let corners = &self.gather.emitters[body as usize].body;
        let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let normal = (self.centre - middle).normalize_or_zero();
        Plane { normal, offset: normal.dot(middle) }
    }

    /// Irradiance of unit exitance from a body, as far as it is seen. From so near that it has no outline its faces count one
    /// by one, and nothing is taken to stand between.
    fn body_form_factor(
        &self,
        source: &Source,
        body: u32,
        from: &Viewpoint,
        cones: &mut Cones,
        fragments: &mut Fragments,
    ) -> f64 {
        let Gather { geometry, emitters, .. } = self.gather;
        let emitter = &emitters[body as usize];
        let Some(cone) = outline_of(&emitter.body, from.position) else {
            let faces = emitter.polygons.iter().filter(|&&face| geometry.plane(face).distance(from.position) > 0.0);
            return faces.map(|&face| from.form_factor(geometry.outline(face))).sum();
        };
        fragments.start(cone.corners(), from);
        let obstacles = source.before.get_or_init(|| self.before(&self.plane(source), source.blockers()));
        let unoccluded = fragments.measure(from.normal);
        let irradiance = luminance(unoccluded * self.gather.scene.material(source.polygon).exitance());
        if self.is_seen_by_rays(source, obstacles.len(), irradiance) {
            let distance = emitter.body[0].distance(from.position);
            let outline: Vec<DVec3> = cone.corners().iter().map(|corner| from.position + corner * distance).collect();
            let passes = |polygon: u32| emitter.polygons.binary_search(&polygon).is_ok();
            return unoccluded * self.seen_share(&outline, irradiance, from, passes);
        }
        for obstacle in obstacles {
            if fragments.is_empty() {
                return 0.0;
            }
            self.subtract(obstacle, from, cones, fragments);
        }
        fragments.measure(from.normal)
    }

    /// Cuts away what an obstacle hides from a point. `cones` are those that the point has needed so far, by number.
    pub(crate) fn subtract(&self, obstacle: &Obstacle, from: &Viewpoint, cones: &mut Cones, fragments: &mut Fragments) {
        let Gather { scene, geometry, solids, .. } = self.gather;
        if let Some(solid) = obstacle.solid {
            let cone = cones.of_solids.entry(solid).or_insert_with(|| solids.cone(scene, geometry, solid, from));
            if let Some(cone) = cone {
                return fragments.subtract(cone);
            }
        }
        for (number, blocker) in &obstacle.faces {
            let (shape, normal) = blocker.shape(geometry);
            let project = || BlockerCone::of_polygon(shape, normal, from, geometry.contact_tolerance);
            match blocker {
                // A whole polygon looks the same before every source: projected once for the point.
                Blocker::Whole { .. } => {
                    if let Some(cone) = cones.of_faces[*number].get_or_insert_with(project) {
                        fragments.subtract(cone);
                    }
                }
                Blocker::Part { .. } => {
                    if let Some(cone) = project() {
                        fragments.subtract(&cone);
                    }
                }
            }
        }
    }

    /// Direct irradiance, and the nodes of reflectors that are seen.
    fn look(
        &self,
        position: DVec3,
        inward: DVec3,
        (wanted, cosine): (Light, Cosine),
        seen: &mut Vec<SeenNode>,
    ) -> DirectIrradiance {
        let gather = self.gather;
        let mut from = gather.viewpoint(self.polygon, position, inward, cosine);
        from.inward = inward.reject_from_normalized(from.up).normalize_or_zero();
        let mut cones = Cones { of_solids: HashMap::new(), of_faces: vec![None; self.blockers.len()] };
        let mut fragments = Fragments::new(gather.geometry.size);
        let mut total = Rgb::ZERO;
        for source in &self.sources {
            let material = gather.scene.material(source.polygon);
            let emits = wanted != Light::Reflected && material.emits();
            let reflects = wanted != Light::Emitted
                && gather.solution.reflects()
                && gather.scene.reflectance(source.polygon) != Rgb::ZERO;
            if !emits && !reflects {
                continue;
            }
            if let Some(body) = source.body {
                total += self.body_form_factor(source, body, &from, &mut cones, &mut fragments) * material.exitance();
                continue;
            }
            let outline = source.outline(gather);
            let plane = gather.geometry.planes[source.polygon as usize];
            let depth = plane.distance(position);
            let touches = depth.abs() <= gather.geometry.contact_tolerance;
            let unoccluded = if reflects && depth > 0.0 && !touches { from.form_factor(outline) } else { 0.0 };
            if !emits && !touches && gather.is_dim(source.polygon, unoccluded) {
                self.see_dim(source, unoccluded, seen);
                continue;
            }
            if touches {
                if plane.normal.dot(from.inward) <= 0.0 {
                    continue;
                }
                fragments.start(&from.tangent_cone(outline, plane.normal, gather.geometry.contact_tolerance), &from);
            } else if depth > 0.0 {
                let corners: Vec<DVec3> = outline.iter().map(|corner| corner - position).collect();
                fragments.start(&corners, &from);
            } else {
                continue;
            }
            let obstacles = source.before.get_or_init(|| self.before(&self.plane(source), source.blockers()));
            let is_open = source.blockers.is_some() && obstacles.is_empty();
            if !is_open && !touches && gather.emitter_tree().is_some() {
                let unoccluded = fragments.measure(from.normal);
                let irradiance = luminance(unoccluded * material.exitance());
                if self.is_seen_by_rays(source, obstacles.len(), irradiance) {
                    let share = self.seen_share(outline, irradiance, &from, |polygon| polygon == source.polygon);
                    total += share * unoccluded * material.exitance();
                    continue;
                }
            }
            for obstacle in obstacles {
                if fragments.is_empty() {
                    break;
                }
                self.subtract(obstacle, &from, &mut cones, &mut fragments);
            }
            let form_factor = fragments.measure(from.normal);
            if emits {
                total += form_factor * material.exitance();
            }
            if reflects && form_factor > 0.0 {
                if touches {
                    self.see_contact(source.polygon, form_factor, &from, seen);
                } else if form_factor >= unoccluded * WHOLE {
                    self.see_whole(source, &from, seen);
                } else {
                    self.see_fragments(source, &fragments, &from, seen);
                }
            }
        }
        if wanted == Light::Reflected {
            return DirectIrradiance::default();
        }
        let sky = self.light_of_sky(&from, &mut cones, &mut fragments);
        DirectIrradiance { emitters: total + self.light_of_faint_groups(&from), sky }
    }
}
