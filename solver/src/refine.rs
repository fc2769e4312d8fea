//! Refinement: from pairs of patches to links that the oracle accepts.
//!
//! Hierarchical radiosity (Hanrahan, Salzman & Aupperle 1991) with blocker lists that are found by a shaft query
//! at the pair of patches and handed down (Teller & Hanrahan 1993). Links are refined in rounds: all open pairs of
//! a round are judged in parallel, nodes are divided in order of the pairs between rounds, so that the result does not
//! depend on the number of threads. A pair is dropped only where a single blocker provably covers its whole shaft.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::Scene;

use crate::backprojection::{BlockerCone, Fragments, Viewpoint};
use crate::blocker::Blocker;
use crate::form_factor::{form_factor, form_factor_at};
use crate::geometry::Geometry;
use crate::linear_fit::slope;
use crate::oracle::{Ends, Estimate, Refinement, decide};
use crate::visibility::{BlockerInterner, Occlusion, Shaft, facing_parts};
use crate::{Elements, Link, LinkSource, NodeId, Patch};

/// Smallest side of an element, as a fraction of the scene's size: where a corner would be refined for ever.
const SMALLEST_CELL: f64 = 1.0 / 400.0;

/// A receiver's sample points lie at this fraction of the way from its centre to its corners: for a parallelogram the
/// four points of Gauss–Legendre quadrature.
const SAMPLE_REACH: f64 = 0.577_350_269_189_625_8;

/// An ordered pair of nodes that light may pass between.
#[derive(Clone, Copy, Debug)]
struct Pair {
    receiver: NodeId,
    source: NodeId,
    blockers: u32,
}

/// Elements and the links between them while they are refined.
pub struct Network {
    geometry: Geometry,
    /// The hierarchy; nodes are only added.
    pub elements: Elements,
    interner: BlockerInterner,
    links: Vec<(Link, Estimate)>,
}

/// The radiosity that refinement goes by: luminance, and how far the leaves below stray from it, per node, W·m⁻².
/// Nodes that are newer than the tables are looked up at their parents.
pub struct SourceLight {
    /// Luminance of the radiosity.
    pub radiosity: Vec<f64>,
    /// Largest difference of a leaf below from it.
    pub deviation: Vec<f64>,
}

/// What the blockers of a pair leave of it.
enum Filtered {
    Invisible,
    Same,
    Fewer(Vec<u32>),
}

impl Network {
    /// Links every pair of patches that face each other, unless they provably see nothing of each other. With
    /// `emitters_only` no other sources are linked.
    pub fn of_patches(scene: &Scene, elements: Elements, first_patch: &[u32], emitters_only: bool) -> Self {
        let geometry = Geometry::new(scene);
        let polygons: Vec<u32> = scene.polygon_ids().collect();
        let emits: Vec<bool> = polygons.iter().map(|&polygon| scene.material(polygon).emits()).collect();
        let found: Vec<Vec<(NodeId, NodeId, Vec<u32>)>> = polygons
            .par_iter()
            .map(|&a| {
                let partners = polygons[a as usize + 1..].iter().copied();
                partners
                    .filter(|&b| !emitters_only || emits[a as usize] || emits[b as usize])
                    .flat_map(|b| patch_pairs(&geometry, &elements, first_patch, a, b))
                    .collect()
            })
            .collect();
        let mut network = Self { geometry, elements, interner: BlockerInterner::default(), links: Vec::new() };
        let mut open = Vec::new();
        for (a, b, list) in found.into_iter().flatten() {
            let blockers = network.interner.intern(&list);
            for (receiver, source) in [(a, b), (b, a)] {
                let emitter = network.elements.polygon_of(source).is_some_and(|polygon| emits[polygon as usize]);
                if emitter || !emitters_only {
                    open.push(Pair { receiver, source, blockers });
                }
            }
        }
        let made = open.par_iter().map(|pair| network.make_link(pair, &network.estimate(pair))).collect::<Vec<_>>();
        network.links = made;
        network
    }

    /// Refines all links until the oracle keeps every one. Returns whether any was refined.
    pub fn refine(&mut self, light: &SourceLight, link_error: f64) -> bool {
        let before = self.links.len();
        let links = std::mem::take(&mut self.links);
        let mut judged = Vec::new();
        for (link, estimate) in links {
            let LinkSource::Node(source) = link.source;
            let pair = Pair { receiver: link.receiver, source, blockers: link.blockers };
            match decide(&estimate, &self.ends(&pair, light), link_error) {
                Refinement::Keep => self.links.push((link, estimate)),
                refinement => judged.push((pair, refinement)),
            }
        }
        let refined = self.links.len() < before;
        while !judged.is_empty() {
            let open = self.divide(&judged);
            let decided: Vec<_> = open
                .par_iter()
                .with_min_len(16)
                .map(|pair| {
                    let estimate = self.estimate(pair);
                    match decide(&estimate, &self.ends(pair, light), link_error) {
                        Refinement::Keep => Ok(self.make_link(pair, &estimate)),
                        refinement => Err((*pair, refinement)),
                    }
                })
                .collect();
            judged.clear();
            for outcome in decided {
                match outcome {
                    Ok(link) => self.links.push(link),
                    Err(pair) => judged.push(pair),
                }
            }
        }
        refined
    }

    /// The pairs of children that take the place of judged pairs, with their blockers.
    fn divide(&mut self, judged: &[(Pair, Refinement)]) -> Vec<Pair> {
        for (pair, refinement) in judged {
            if *refinement == Refinement::DivideReceiver {
                self.elements.subdivide(pair.receiver);
            }
        }
        let children: Vec<Vec<(Pair, Filtered)>> = judged
            .par_iter()
            .with_min_len(16)
            .map(|(pair, refinement)| {
                let divided = if *refinement == Refinement::DivideSource { pair.source } else { pair.receiver };
                let children = self.elements.children(divided).map(|child| match refinement {
                    Refinement::DivideSource => Pair { source: child, ..*pair },
                    _ => Pair { receiver: child, ..*pair },
                });
                let list = self.interner.get(pair.blockers);
                children.filter_map(|child| Some((child, self.filter(&child, list)?))).collect()
            })
            .collect();
        let mut open = Vec::new();
        for (pair, filtered) in children.into_iter().flatten() {
            match filtered {
                Filtered::Invisible => {}
                Filtered::Same => open.push(pair),
                Filtered::Fewer(list) => open.push(Pair { blockers: self.interner.intern(&list), ..pair }),
            }
        }
        open
    }

    /// The blockers of a parent that matter to a pair; none if its ends do not face each other.
    fn filter(&self, pair: &Pair, blockers: &[u32]) -> Option<Filtered> {
        let (receiver, source) = (self.elements.outline(pair.receiver), self.elements.outline(pair.source));
        let planes = [pair.receiver, pair.source].map(|node| self.plane(node));
        let facing = facing_parts(receiver, &planes[0], source, &planes[1], self.geometry.contact_tolerance)?;
        Some(filter_blockers(&self.geometry, &facing, blockers))
    }

    fn frame(&self, node: NodeId) -> &Patch {
        &self.elements.patches[self.elements.patch_of(node).unwrap_or_default() as usize]
    }

    fn plane(&self, node: NodeId) -> scene::Plane {
        self.geometry.plane(self.elements.polygon_of(node).unwrap_or_default())
    }

    fn ends(&self, pair: &Pair, light: &SourceLight) -> Ends {
        let mut known = pair.source;
        while known as usize >= light.radiosity.len() {
            known = self.elements.nodes[known as usize].parent;
        }
        let smallest = self.geometry.size * SMALLEST_CELL;
        let divided = |node: NodeId| self.elements.nodes[node as usize].child_count > 0;
        Ends {
            radiosity: light.radiosity[known as usize],
            deviation: light.deviation[known as usize],
            receiver_divides: divided(pair.receiver) || self.elements.cell_length(pair.receiver) > 2.0 * smallest,
            source_divided: divided(pair.source),
        }
    }

    /// Form factors from the receiver's sample points to the source, unoccluded and visible.
    fn estimate(&self, pair: &Pair) -> Estimate {
        let (receiver, source) = (self.plane(pair.receiver), self.plane(pair.source));
        let outline = self.elements.outline(pair.source);
        let list = self.interner.get(pair.blockers);
        let blockers: Vec<_> =
            list.iter().filter_map(|&polygon| Blocker::before(&self.geometry, &source, polygon)).collect();
        let mut fragments = Fragments::new(self.geometry.size);
        let centre = self.elements.nodes[pair.receiver as usize].centre;
        let corners = self.elements.outline(pair.receiver);
        let frame = self.frame(pair.receiver);
        let mut samples: Vec<(DVec2, f64)> = Vec::with_capacity(corners.len() + 3);
        let mut estimate = Estimate::default();
        // The corners' samples are the quadrature and carry the plane. The others only tell how far the light is from it:
        // the centre sees what is curved, and two edges what the corners and the centre miss by symmetry, as of a
        // source whose own corner lies at a corner of the receiver.
        let edges = corners.windows(2).take(2).map(|edge| (edge[0] + edge[1]) / 2.0);
        for corner in corners.iter().copied().chain([centre]).chain(edges) {
            let position = centre + (corner - centre) * SAMPLE_REACH;
            let (unoccluded, visible) = if source.distance(position) > self.geometry.contact_tolerance {
                let unoccluded = form_factor_at(position, receiver.normal, outline);
                (unoccluded, self.visible(position, receiver.normal, outline, &blockers, &mut fragments, unoccluded))
            } else {
                (0.0, 0.0)
            };
            if samples.len() < corners.len() {
                estimate.form_factor += unoccluded / corners.len() as f64;
                estimate.visible += visible / corners.len() as f64;
            }
            let offset = position - centre;
            samples.push((DVec2::new(frame.u.dot(offset), frame.v.dot(offset)), visible));
        }
        let [gradient] =
            slope(samples[..corners.len()].iter().map(|&(at, visible)| (at, [visible - estimate.visible], 1.0)));
        estimate.gradient = gradient;
        let strays = |&(at, visible): &(DVec2, f64)| (visible - estimate.visible - gradient.dot(at)).abs();
        estimate.deviation = samples.iter().map(strays).fold(0.0, f64::max) / SAMPLE_REACH.powi(2);
        estimate
    }

    fn visible(
        &self,
        position: DVec3,
        up: DVec3,
        outline: &[DVec3],
        blockers: &[Blocker],
        fragments: &mut Fragments,
        unoccluded: f64,
    ) -> f64 {
        if blockers.is_empty() || unoccluded == 0.0 {
            return unoccluded;
        }
        let from = Viewpoint::flat(position, up, DVec3::ZERO);
        let corners: Vec<DVec3> = outline.iter().map(|corner| corner - position).collect();
        fragments.start(&corners, &from);
        for blocker in blockers {
            if fragments.is_empty() {
                return 0.0;
            }
            let (shape, normal) = blocker.shape(&self.geometry);
            if let Some(cone) = BlockerCone::of_polygon(shape, normal, &from, self.geometry.contact_tolerance) {
                fragments.subtract(&cone);
            }
        }
        fragments.measure(up)
    }

    fn make_link(&self, pair: &Pair, estimate: &Estimate) -> (Link, Estimate) {
        let visibility = if self.interner.get(pair.blockers).is_empty() {
            1.0
        } else if estimate.form_factor > 0.0 {
            (estimate.visible / estimate.form_factor).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let link = Link {
            receiver: pair.receiver,
            source: LinkSource::Node(pair.source),
            form_factor: form_factor(self.elements.outline(pair.receiver), self.elements.outline(pair.source)),
            visibility,
            gradient: estimate.gradient,
            blockers: pair.blockers,
        };
        (link, *estimate)
    }

    /// The links by receiver, and the first of each node. Links of one receiver keep the order they were made in.
    pub fn sorted_links(&self) -> (Vec<Link>, Vec<u32>) {
        let mut links: Vec<Link> = self.links.iter().map(|(link, _)| *link).collect();
        links.sort_by_key(|link| link.receiver);
        let first = (0..=self.elements.nodes.len() as u32)
            .map(|node| links.partition_point(|link| link.receiver < node) as u32)
            .collect();
        (links, first)
    }

    /// The elements and the blocker lists, when all is refined.
    pub fn finish(self) -> (Elements, crate::BlockerLists) {
        (self.elements, self.interner.into_lists())
    }
}

/// Which of some polygons stand in the shaft between two outlines that face each other.
fn filter_blockers(geometry: &Geometry, [a, b]: &[Vec<DVec3>; 2], polygons: &[u32]) -> Filtered {
    if polygons.is_empty() {
        return Filtered::Same;
    }
    let shaft = Shaft::between(a, b);
    let mut kept = Vec::new();
    for &polygon in polygons {
        match shaft.classify(geometry.outline(polygon)) {
            Occlusion::Clear => {}
            Occlusion::Partial => kept.push(polygon),
            Occlusion::Total => return Filtered::Invisible,
        }
    }
    if kept.len() == polygons.len() { Filtered::Same } else { Filtered::Fewer(kept) }
}

/// The pairs of patches of two polygons that face each other, with their blockers.
fn patch_pairs(
    geometry: &Geometry,
    elements: &Elements,
    first_patch: &[u32],
    a: u32,
    b: u32,
) -> Vec<(NodeId, NodeId, Vec<u32>)> {
    let planes = [a, b].map(|polygon| geometry.plane(polygon));
    let facing =
        |front: &[DVec3], back: &[DVec3]| facing_parts(front, &planes[0], back, &planes[1], geometry.contact_tolerance);
    let Some(parts) = facing(geometry.outline(a), geometry.outline(b)) else { return Vec::new() };
    let others: Vec<u32> =
        (0..geometry.outlines.len() as u32).filter(|&polygon| polygon != a && polygon != b).collect();
    let list = match filter_blockers(geometry, &parts, &others) {
        Filtered::Invisible => return Vec::new(),
        Filtered::Same => others,
        Filtered::Fewer(list) => list,
    };
    let roots = |polygon: u32| {
        let range = first_patch[polygon as usize]..first_patch[polygon as usize + 1];
        range.map(|patch| elements.patches[patch as usize].root)
    };
    let mut pairs = Vec::new();
    for node_a in roots(a) {
        for node_b in roots(b) {
            let Some(parts) = facing(elements.outline(node_a), elements.outline(node_b)) else { continue };
            match filter_blockers(geometry, &parts, &list) {
                Filtered::Invisible => {}
                Filtered::Same => pairs.push((node_a, node_b, list.clone())),
                Filtered::Fewer(fewer) => pairs.push((node_a, node_b, fewer)),
            }
        }
    }
    pairs
}
