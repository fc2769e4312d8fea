//! A gather at any points, in any order, from any thread: what each leaf sees is prepared once and kept.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use renderer::SurfacePoint;
use scene::{Rgb, Scene, centroid};
use solver::{Gather, LeafGather, NodeId, Solution};

/// Leaves that a thread keeps. Neighbouring samples mostly lie on few; each holds what it sees and what stands before that,
/// some kilobytes.
const MOST_KEPT: usize = 4096;

/// A gather from a solution, with what was prepared for its leaves.
pub struct PointGather<'a> {
    gather: &'a Gather<'a>,
    solution: &'a Solution,
    /// By polygon, the middle of it, metres.
    middles: Vec<DVec3>,
    /// By thread.
    prepared: Vec<Mutex<HashMap<NodeId, LeafGather<'a>>>>,
}

impl<'a> PointGather<'a> {
    /// A gather in a scene from its solution.
    pub fn new(scene: &Scene, solution: &'a Solution, gather: &'a Gather<'a>) -> Self {
        let middles = scene.polygon_ids().map(|polygon| centroid(&scene.outline(polygon))).collect();
        let prepared = (0..=rayon::current_num_threads()).map(|_| Mutex::default()).collect();
        Self { gather, solution, middles, prepared }
    }

    /// Irradiance at a point of a polygon, by its shading normal if any, W·m⁻². On a contact line the side towards the middle
    /// of the polygon counts.
    pub fn irradiance(&self, point: &SurfacePoint) -> Rgb {
        let Some(leaf) = self.leaf_under(point) else { return Rgb::ZERO };
        let inward = self.middles[point.polygon as usize] - point.position;
        // Threads beside rayon's share the last one.
        let thread = rayon::current_thread_index().unwrap_or(usize::MAX).min(self.prepared.len() - 1);
        let mut prepared = self.prepared[thread].lock().unwrap_or_else(PoisonError::into_inner);
        if prepared.len() >= MOST_KEPT {
            prepared.clear();
        }
        prepared.entry(leaf).or_insert_with(|| self.gather.over(leaf)).irradiance(point.position, inward)
    }

    /// The leaf of the patch that contains a point of its polygon, or is nearest to containing it.
    fn leaf_under(&self, point: &SurfacePoint) -> Option<NodeId> {
        let elements = &self.solution.elements;
        let patches = self.solution.patches_of(point.polygon);
        let patch = patches.map(|patch| &elements.patches[patch as usize]).max_by(|a, b| {
            let [a, b] = [a, b].map(|patch| depth(elements.outline(patch.root), point));
            a.total_cmp(&b)
        })?;
        let place = patch.coordinates(point.position);
        let mut node = patch.root;
        while !elements.is_leaf(node) {
            let outside = |node: NodeId| {
                let record = &elements.nodes[node as usize];
                (place - place.clamp(record.cell_min, record.cell_max)).length_squared()
            };
            node = elements.children(node).min_by(|&a, &b| outside(a).total_cmp(&outside(b)))?;
        }
        Some(node)
    }
}

/// How far inside a convex outline a point lies, metres; negative outside.
fn depth(outline: &[DVec3], point: &SurfacePoint) -> f64 {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let inside =
        |(&from, &to): (&DVec3, &DVec3)| point.normal.cross((to - from).normalize_or_zero()).dot(point.position - from);
    edges.map(inside).fold(f64::INFINITY, f64::min)
}
