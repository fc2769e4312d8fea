//! The solution: elements, links with their blockers, and the light on every node.

use scene::Rgb;
use serde::{Deserialize, Serialize};

use crate::{Elements, NodeId};

/// What a solve is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveOptions {
    /// Irradiance that one link may misplace on its receiver, W·m⁻² (B·ΔF; Hanrahan et al. 1991). None derives it from
    /// the scene's mean irradiance.
    pub link_error: Option<f64>,
    /// Interreflections followed; 0 is direct light alone, none is all until the residual is reached.
    pub bounces: Option<u32>,
}

/// Where the light of a link comes from. Sky parts will stand beside nodes here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LinkSource {
    /// Another node of the hierarchy.
    Node(NodeId),
}

/// One receiver–source interaction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Where the light comes from.
    pub source: LinkSource,
    /// Unoccluded form factor, receiver to source: the irradiance at the receiver is this × visibility × B.
    pub form_factor: f64,
    /// Visible fraction, 0..=1, of the form factor at the receiver's sample points.
    pub visibility: f64,
    /// What may block it, a list in [`BlockerLists`].
    pub blockers: u32,
}

/// Interned lists of blocking polygons; list 0 is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BlockerLists {
    /// First index and length of each list in `polygons`.
    pub lists: Vec<(u32, u32)>,
    /// Polygon ids, ascending within a list.
    pub polygons: Vec<u32>,
}

impl BlockerLists {
    /// The polygons of a list, ascending.
    pub fn get(&self, list: u32) -> &[u32] {
        let (first, length) = self.lists[list as usize];
        &self.polygons[first as usize..(first + length) as usize]
    }
}

/// Everything that is known of one source's light on one receiving polygon, over all their links.
#[derive(Clone, Debug, PartialEq)]
pub struct Interaction {
    /// Source polygon.
    pub source: u32,
    /// Largest luminance of the source's radiosity over its linked elements, W·m⁻².
    pub radiosity: f64,
    /// Polygons that may stand between some point of the receiver and some point of the source, ascending.
    pub blockers: Vec<u32>,
}

/// A contact or intersection line on a polygon: the segment where another polygon meets it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Ends, metres.
    pub ends: [glam::DVec3; 2],
    /// The polygon that meets it there.
    pub other: u32,
}

/// The solved scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// The hierarchy.
    pub elements: Elements,
    /// Contact and intersection lines, per polygon of the scene.
    pub cuts: Vec<Vec<Cut>>,
}

impl Solution {
    /// The light that reaches a polygon, by source, ascending in the source's id.
    pub fn interactions(&self, _receiver: u32) -> Vec<Interaction> {
        unimplemented!()
    }
}
