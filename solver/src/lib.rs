//! Light arriving anywhere: hierarchical radiosity over a scene's polygons, and exact irradiance at a point.
//!
//! The pipeline is [`solve`]: cut → refine (elements, links, blockers) → transport → reconstruct. What it returns,
//! a [`Solution`], feeds [`Gather`], which answers with the irradiance at any surface point.

mod element;
mod solution;

pub use element::{Elements, Node, NodeId, NodeKind, Patch};
pub use solution::{BlockerLists, Cut, Interaction, Link, LinkSource, Solution, SolveOptions};
