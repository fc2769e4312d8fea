//! Light from emitters in a scene without links: which of them an element sees, and through what.
//!
//! What stands in the shaft between an element and an emitter is asked of the hierarchy over all polygons. Emitters that are
//! faint at an element are not worth a shaft: rays tell what is seen of them, and of those that far too much stands before.

use std::cell::OnceCell;

use scene::{Plane, luminance};

use crate::emitter::{Emitter, outline_of};
use crate::form_factor::form_factor_at;
use crate::lamp_rays::FaintGroups;
use crate::leaf_gather::{LeafGather, Source};
use crate::polygon_tree::Stands;
use crate::visibility::{Shaft, facing_parts};
use crate::{Gather, Interaction, NodeId};

/// Emitters that send an element at most this part of the budget, all together, are one group, of which one is tried. More
/// scatters.
const FAINT_GROUP: f64 = 0.8;

/// An emitter that sends at most this part of the budget to an element's middle is seen by rays there.
const FAINT: f64 = 0.5;

/// An emitter that sends at least this many budgets to an element's middle is strong: its shadows have edges to follow. With less
/// a hall of many lamps has lines everywhere, which next to nothing changes across.
const STRONG: f64 = 20.0;

/// What stands between an element and the emitters, as far as it was looked for: it never changes, so that a mesh that comes
/// later need not look again.
#[derive(Clone, Debug, Default)]
pub struct Shafts(Vec<(u32, Stands)>);

impl Shafts {
    fn to(&mut self, emitter: u32, look: impl FnOnce() -> Stands) -> &Stands {
        let place = self.0.binary_search_by_key(&emitter, |shaft| shaft.0).unwrap_or_else(|place| {
            self.0.insert(place, (emitter, look()));
            place
        });
        &self.0[place].1
    }
}

impl<'a> Gather<'a> {
    /// A gather to the points in the closure of one element, for light from emitters alone. `shafts` are those of the same
    /// element, and grow; they stay as they are in a scene with links.
    pub fn over_emitters(&'a self, element: NodeId, shafts: &mut Shafts) -> LeafGather<'a> {
        match self.emitter_tree() {
            Some(_) => self.over_shafts(element, shafts),
            None => self.over_sources(element, |polygon| self.scene.material(polygon).emits()),
        }
    }

    /// The emitting polygons, and small cells of the sky, that shine strongly on an element, if nothing hides them, each with what
    /// stands in the shaft between the two. Not those of bodies, which are round for the most part, nor those that too much
    /// stands before.
    pub fn strong_emitters(&self, element: NodeId, shafts: &mut Shafts) -> Vec<Interaction> {
        let leaf = self.over_shafts(element, shafts);
        let least = STRONG * leaf.budget;
        let normal = self.geometry.plane(leaf.polygon).normal;
        let strong = |source: Source| {
            let blockers = source.blockers.filter(|_| source.body.is_none())?;
            let radiosity = luminance(self.scene.material(source.polygon).exitance());
            let form_factor = form_factor_at(leaf.centre, normal, self.geometry.outline(source.polygon));
            (form_factor * radiosity >= least).then_some(Interaction {
                source: source.polygon,
                far_outline: None,
                radiosity,
                blockers,
            })
        };
        let small_cells = leaf.small_cells(normal, least);
        leaf.sources.into_iter().filter_map(strong).chain(small_cells).collect()
    }

    /// A gather whose sources are all emitters that an element faces, each with what stands in the shaft between the two.
    pub(crate) fn over_shafts(&'a self, element: NodeId, shafts: &mut Shafts) -> LeafGather<'a> {
        let elements = &self.solution.elements;
        let polygon = elements.polygon_of(element).unwrap_or_default();
        let (outline, horizon) = (elements.outline(element), self.horizon(polygon));
        let plane = horizon.plane;
        let centre = elements.nodes[element as usize].centre;
        let budget = self.budget_over(element);
        let cut = self.emitter_tree().map(|tree| tree.cut(outline, &horizon, FAINT_GROUP * budget)).unwrap_or_default();
        let mut sources = Vec::new();
        for number in cut.single {
            let emitter = &self.emitters[number as usize];
            if emitter.polygons.binary_search(&polygon).is_ok() {
                continue; // Convex: no part of it sees another.
            }
            let exitance = self.scene.material(emitter.polygons[0]).exitance();
            let form_factor = match emitter.body[..] {
                [] => form_factor_at(centre, plane.normal, self.geometry.outline(emitter.polygons[0])),
                _ => outline_of(&emitter.body, centre).map_or(1.0, |cone| {
                    let corners: Vec<_> = cone.corners().iter().map(|way| centre + *way).collect();
                    form_factor_at(centre, plane.normal, &corners)
                }),
            };
            let is_faint = luminance(form_factor * exitance) <= FAINT * budget;
            let blockers = if is_faint {
                None
            } else {
                match shafts.to(number, || self.stands_before(emitter, element, &plane)) {
                    Stands::All => continue,
                    Stands::Many => None,
                    Stands::Some(blockers) => {
                        let is_other =
                            |blocker: &&u32| **blocker != polygon && emitter.polygons.binary_search(blocker).is_err();
                        Some(blockers.iter().filter(is_other).copied().collect())
                    }
                }
            };
            let body = (!emitter.body.is_empty()).then_some(number);
            let polygon = emitter.polygons[0];
            sources.push(Source { polygon, body, roots: Vec::new(), part: None, blockers, before: OnceCell::new() });
        }
        let sky = self.over_sky(element, &horizon);
        let mut blockers: Vec<u32> = sources
            .iter()
            .filter_map(|source| source.blockers.as_ref())
            .flatten()
            .chain(sky.blockers())
            .copied()
            .collect();
        blockers.sort_unstable();
        blockers.dedup();
        let faint = FaintGroups::new(cut.groups, element);
        LeafGather { gather: self, polygon, centre, sources, faint, rays: 0, budget, sky, blockers }
    }

    /// What stands in the shaft between an emitter and an element.
    fn stands_before(&self, emitter: &Emitter, element: NodeId, plane: &Plane) -> Stands {
        let outline = self.solution.elements.outline(element);
        let tolerance = self.geometry.contact_tolerance;
        if emitter.body.is_empty() {
            let source = emitter.polygons[0];
            let (source, facing) = (self.geometry.outline(source), self.geometry.plane(source));
            match facing_parts(outline, plane, source, &facing, tolerance) {
                Some([near, far]) => self.tree.in_shaft(self.geometry, &Shaft::between(&near, &far)),
                None => Stands::All,
            }
        } else if emitter.body.iter().any(|&corner| plane.distance(corner) > tolerance) {
            self.tree.in_shaft(self.geometry, &Shaft::towards(outline, &emitter.body))
        } else {
            Stands::All
        }
    }
}
