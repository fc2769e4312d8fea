//! The solution: elements, links with their blockers, and the light on every node.

use glam::{DVec2, DVec3};
use scene::{Rgb, Scene, luminance};
use serde::{Deserialize, Serialize};

use crate::linear_fit::fit_inner_nodes;
use crate::{Elements, NodeId, Openings, Outlook, SkyCells};

/// What a solve is asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SolveOptions {
    /// Irradiance that one link may misplace on its receiver, W·m⁻² (B·ΔF; Hanrahan et al. 1991). None takes
    /// a fraction of the scene's mean irradiance.
    pub link_error: Option<f64>,
    /// Interreflections followed; 0 is direct light alone, none is all until the residual is reached.
    pub bounces: Option<u32>,
}

/// How points of a solution find what they see.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Visibility {
    /// By links, which name the sources and what may hide them.
    #[default]
    Links,
    /// Emitters by shafts and reflectors by rays through a hierarchy over all polygons, which are too many to be linked.
    Rays,
}

/// Where the light of a link comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LinkSource {
    /// Another node of the hierarchy.
    Node(NodeId),
}

/// One receiver–source interaction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// The node that receives.
    pub receiver: NodeId,
    /// Where the light comes from.
    pub source: LinkSource,
    /// Unoccluded form factor, receiver to source: the irradiance at the receiver is this × visibility × B.
    pub form_factor: f64,
    /// Visible fraction, 0..=1, of the form factor at the receiver's sample points.
    pub visibility: f64,
    /// Change of the visible form factor per metre along the receiver's u and v.
    pub gradient: DVec2,
    /// What may block it, a list in [`BlockerLists`].
    pub blockers: u32,
}

/// Interned lists of blocking polygons; list 0 is empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockerLists {
    /// First index and length of each list in `polygons`.
    pub lists: Vec<(u32, u32)>,
    /// Polygon ids, ascending within a list.
    pub polygons: Vec<u32>,
}

impl Default for BlockerLists {
    fn default() -> Self {
        Self { lists: vec![(0, 0)], polygons: Vec::new() }
    }
}

impl BlockerLists {
    /// The polygons of a list, ascending.
    pub fn get(&self, list: u32) -> &[u32] {
        let (first, length) = self.lists[list as usize];
        &self.polygons[first as usize..(first + length) as usize]
    }

    /// Memory that the lists take, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.lists.as_slice()) + size_of_val(self.polygons.as_slice())
    }
}

/// A contact or intersection line on a polygon: the segment where another polygon meets it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Ends, metres.
    pub ends: [DVec3; 2],
    /// The polygon that meets it there.
    pub other: u32,
}

/// Everything that is known of one source's light on one receiving polygon, over all their links.
#[derive(Clone, Debug, PartialEq)]
pub struct Interaction {
    /// Source polygon; of a source that is none a number beyond those of all polygons, the same for the same source.
    pub source: u32,
    /// Corners of a source that is no polygon, metres, counter-clockwise from its front: so far away that the way to it is the same
    /// from all of the receiver.
    pub far_outline: Option<Vec<DVec3>>,
    /// Largest luminance of the source's radiosity over its linked elements, W·m⁻².
    pub radiosity: f64,
    /// Polygons that may stand between some point of the receiver and some point of the source, ascending.
    pub blockers: Vec<u32>,
}

/// The irradiance on a node, linear over the node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ElementLight {
    /// At the node's centre, W·m⁻²; also the mean over the node.
    pub irradiance: Rgb,
    /// Change per metre along the patch's u, W·m⁻³.
    pub gradient_u: Rgb,
    /// Change per metre along the patch's v, W·m⁻³.
    pub gradient_v: Rgb,
    /// How far the light of the leaves below strays from this plane, root mean square of the luminance, W·m⁻²; 0 for a leaf.
    pub deviation: f64,
}

impl ElementLight {
    /// The irradiance at an offset from the node's centre along its patch's u and v, metres; never negative.
    pub fn at(&self, offset: DVec2) -> Rgb {
        self.linear(offset).max(Rgb::ZERO)
    }

    /// The same where the plane falls below zero, too.
    pub fn linear(&self, offset: DVec2) -> Rgb {
        self.irradiance + self.gradient_u * offset.x + self.gradient_v * offset.y
    }
}

/// How the iteration of the transport ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    /// Gathers over all links.
    pub iterations: u32,
    /// Power that the last gather still moved, as a fraction of the power that leaves all surfaces.
    pub residual: f64,
    /// Whether the residual asked for, or the number of bounces asked for, was reached.
    pub reached: bool,
}

/// The solved scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// The hierarchy.
    pub elements: Elements,
    /// Contact and intersection lines, per polygon of the scene.
    pub cuts: Vec<Vec<Cut>>,
    /// First patch of each polygon, and the number of patches at the end.
    pub first_patch: Vec<u32>,
    /// All links, by receiver.
    pub links: Vec<Link>,
    /// First link of each node, and the number of links at the end.
    pub first_link: Vec<u32>,
    /// The links' blockers.
    pub blockers: BlockerLists,
    /// Irradiance of each node, W·m⁻²; empty where there are no links.
    pub irradiance: Vec<ElementLight>,
    /// The part of it that comes straight from emitters; as long.
    pub direct: Vec<ElementLight>,
    /// The irradiance that each node reflects: one bounce less than [`Solution::irradiance`].
    pub light: Vec<ElementLight>,
    /// Area-weighted mean irradiance of all surfaces, W·m⁻².
    pub mean_irradiance: Rgb,
    /// How the iteration ended.
    pub convergence: Convergence,
    /// The link error that was used, W·m⁻².
    pub link_error: f64,
    /// Interreflections followed, none for all.
    pub bounces: Option<u32>,
    /// How points find what they see.
    pub visibility: Visibility,
    /// The sky, if the scene has one.
    pub sky: SkyCells,
    /// Which of its cells are seen from where, in scenes of very many polygons.
    pub openings: Option<Openings>,
    /// What each node has around it; empty until somebody has looked, and with links.
    pub outlooks: Vec<Outlook>,
}

impl Solution {
    /// The links through which a node receives.
    pub fn links_of(&self, node: NodeId) -> &[Link] {
        &self.links[self.first_link[node as usize] as usize..self.first_link[node as usize + 1] as usize]
    }

    /// The patches of a polygon.
    pub fn patches_of(&self, polygon: u32) -> std::ops::Range<u32> {
        self.first_patch[polygon as usize]..self.first_patch[polygon as usize + 1]
    }

    /// Root nodes of a polygon's patches, in order.
    pub fn patch_roots(&self, polygon: u32) -> impl Iterator<Item = NodeId> {
        self.patches_of(polygon).map(|patch| self.elements.patches[patch as usize].root)
    }

    /// Leaf elements of a polygon, patch by patch.
    pub fn leaves_of(&self, polygon: u32) -> Vec<NodeId> {
        let mut leaves = Vec::new();
        for root in self.patch_roots(polygon) {
            self.leaves_below(root, &mut leaves);
        }
        leaves
    }

    fn leaves_below(&self, node: NodeId, leaves: &mut Vec<NodeId>) {
        if self.elements.is_leaf(node) {
            leaves.push(node);
        }
        for child in self.elements.children(node) {
            self.leaves_below(child, leaves);
        }
    }

    /// Whether light is reflected at all: not when direct light alone was asked for.
    pub fn reflects(&self) -> bool {
        self.bounces != Some(0)
    }

    /// Divides a leaf element after the solve, for light that is known better than by links. The children have no links of
    /// their own: what reaches them comes over their ancestors', and what they reflect is the parent's plane.
    pub fn subdivide(&mut self, leaf: NodeId) {
        let parent = self.elements.nodes[leaf as usize];
        let Some(patch) = self.elements.patch_of(leaf) else { return };
        self.elements.subdivide(leaf);
        for child in &self.elements.nodes[self.light.len()..] {
            let offset = self.elements.patches[patch as usize].along(child.centre - parent.centre);
            let known = [&mut self.irradiance, &mut self.direct, &mut self.light].into_iter();
            for light in known.filter(|light| !light.is_empty()) {
                let plane = light[leaf as usize];
                light.push(ElementLight { irradiance: plane.at(offset), ..plane });
            }
            self.first_link.push(self.links.len() as u32);
            if let Some(&outlook) = self.outlooks.get(leaf as usize) {
                self.outlooks.push(outlook);
            }
        }
    }

    /// What a node has around it, as far as is known.
    pub fn outlook(&self, node: NodeId) -> Outlook {
        self.outlooks.get(node as usize).copied().unwrap_or(Outlook::UNKNOWN)
    }

    /// How bright it is around a node: mean irradiance, as a part of that of all surfaces, at most 1.
    pub fn brightness(&self, node: NodeId) -> f64 {
        f64::from(self.outlook(node).brightness)
    }

    /// Replaces the light that leaf elements reflect by what is known better; inner nodes follow.
    pub fn set_light(&mut self, leaves: impl IntoIterator<Item = (NodeId, ElementLight)>) {
        for (leaf, light) in leaves {
            self.light[leaf as usize] = light;
        }
        fit_inner_nodes(&self.elements, &mut self.light);
    }

    /// The irradiance on a node that comes over reflectors, as far as the links know it, at an offset from the node's
    /// centre along its patch's u and v, metres; W·m⁻².
    pub fn reflected_over_links(&self, node: NodeId, offset: DVec2) -> Rgb {
        if !self.reflects() || self.visibility == Visibility::Rays {
            return Rgb::ZERO;
        }
        let (all, direct) = (&self.irradiance[node as usize], &self.direct[node as usize]);
        (all.linear(offset) - direct.linear(offset)).max(Rgb::ZERO)
    }

    /// The mean irradiance on a node as far as the links know it, W·m⁻².
    pub fn irradiance_over_links(&self, node: NodeId) -> Rgb {
        self.irradiance.get(node as usize).map_or(Rgb::ZERO, |light| light.irradiance)
    }

    /// The mean irradiance straight from emitters on a node as far as the links know it, W·m⁻².
    pub fn emitted_over_links(&self, node: NodeId) -> Rgb {
        self.direct.get(node as usize).map_or(Rgb::ZERO, |light| light.irradiance)
    }

    /// Radiosity ρE + π·Ke of a surface node as a source, W·m⁻².
    pub fn radiosity(&self, scene: &Scene, node: NodeId) -> Rgb {
        let Some(polygon) = self.elements.polygon_of(node) else { return Rgb::ZERO };
        let material = scene.material(polygon);
        let reflected =
            if self.reflects() { scene.reflectance(polygon) * self.light[node as usize].irradiance } else { Rgb::ZERO };
        reflected + material.exitance()
    }

    /// The light that reaches a polygon, one entry for each source polygon, ascending.
    pub fn interactions(&self, scene: &Scene, receiver: u32) -> Vec<Interaction> {
        let mut pairs: Vec<(u32, u32)> = Vec::new(); // (source, blocker)
        let mut brightest: Vec<(u32, f64)> = Vec::new();
        let mut open: Vec<NodeId> = self.patch_roots(receiver).collect();
        while let Some(node) = open.pop() {
            open.extend(self.elements.children(node));
            for link in self.links_of(node) {
                let LinkSource::Node(source) = link.source;
                let Some(polygon) = self.elements.polygon_of(source) else { continue };
                brightest.push((polygon, luminance(self.radiosity(scene, source))));
                pairs.extend(self.blockers.get(link.blockers).iter().map(|&blocker| (polygon, blocker)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        brightest.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        brightest.dedup_by_key(|entry| entry.0);
        brightest
            .into_iter()
            .map(|(source, radiosity)| {
                let first = pairs.partition_point(|pair| pair.0 < source);
                let end = pairs.partition_point(|pair| pair.0 <= source);
                Interaction {
                    source,
                    far_outline: None,
                    radiosity,
                    blockers: pairs[first..end].iter().map(|pair| pair.1).collect(),
                }
            })
            .collect()
    }
}
