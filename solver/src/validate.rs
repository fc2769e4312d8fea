//! Invariants of a solution that hold whatever the scene: reciprocity, closure, energy, coverage.

use std::collections::HashMap;

use scene::{Bvh, Ray, Rgb, Scene};

use crate::{LinkSource, NodeId, Solution};

/// Rays from each of a dozen points of a patch that decide whether it lies in a closed room: enough to see an opening
/// of a few percent of the hemisphere.
const CLOSURE_RAYS: u32 = 64;

/// What a solution was measured to violate. All zero for a perfect one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Validation {
    /// Σ |A_i F_ij − A_j F_ji| ÷ Σ A_i F_ij over pairs of patches, visibility included: what the two directions
    /// disagree about, as a fraction of all that is exchanged.
    pub reciprocity: f64,
    /// Largest |1 − Σ F| over the closed patches, area-weighted over each: the form factors from a patch to all fronts
    /// that it sees add up to 1 where it sees nothing else.
    pub closure: f64,
    /// The same, weighted by area over all closed patches.
    pub mean_closure: f64,
    /// Patches that closure says nothing of: from them some ray leaves the scene or meets a back.
    pub open_patches: u32,
    /// |emitted − absorbed| ÷ emitted power, largest over the colours; 0 only in a closed room without bounce limit.
    pub energy: f64,
    /// Pairs of a leaf and a source point that are linked more than once: a node linked both itself and through an
    /// ancestor.
    pub doubled_links: u32,
    /// Numbers that are not finite or out of their range: form factors, visibilities, irradiances.
    pub bad_numbers: u32,
}

impl Solution {
    /// Measures how well the solution keeps the laws it must obey.
    pub fn validate(&self, scene: &Scene) -> Validation {
        let elements = &self.elements;
        // Σ over links of A_receiver · F · V, by receiving and sending patch.
        let mut exchanged: HashMap<(u32, u32), f64> = HashMap::new();
        let mut result = Validation::default();
        for link in &self.links {
            let LinkSource::Node(source) = link.source;
            let transfer = link.form_factor * link.visibility;
            if !(0.0..=1.0 + 1e-9).contains(&link.form_factor) || !(0.0..=1.0).contains(&link.visibility) {
                result.bad_numbers += 1;
            }
            if let (Some(to), Some(from)) = (elements.patch_of(link.receiver), elements.patch_of(source)) {
                *exchanged.entry((to, from)).or_default() += transfer * elements.nodes[link.receiver as usize].area;
            }
        }
        result.bad_numbers +=
            self.irradiance.iter().filter(|e| !e.irradiance.is_finite() || e.irradiance.min_element() < 0.0).count()
                as u32;
        let area = |patch: u32| elements.nodes[elements.patches[patch as usize].root as usize].area;
        let mut sums = vec![0.0; elements.patches.len()];
        let mut ordered: Vec<_> = exchanged.iter().collect();
        ordered.sort_unstable_by_key(|entry| entry.0);
        let mut disagreement = 0.0;
        for (&(to, from), &there) in ordered {
            let back = exchanged.get(&(from, to)).copied().unwrap_or(0.0);
            disagreement += (there - back).abs();
            sums[to as usize] += there;
        }
        result.reciprocity = disagreement / sums.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let (mut weighted, mut total) = (0.0, 0.0);
        let bvh = Bvh::of_scene(scene);
        for (patch, &sum) in (0..).zip(&sums) {
            if !self.is_closed(&bvh, patch) {
                result.open_patches += 1;
                continue;
            }
            let defect = (1.0 - sum / area(patch)).abs();
            result.closure = result.closure.max(defect);
            weighted += defect * area(patch);
            total += area(patch);
        }
        result.mean_closure = if total > 0.0 { weighted / total } else { 0.0 };
        result.energy = self.energy_defect(scene);
        result.doubled_links = self.doubled_links();
        result
    }

    /// Whether rays from all over a patch meet nothing but fronts.
    fn is_closed(&self, bvh: &Bvh, patch: u32) -> bool {
        let (frame, root) = (&self.elements.patches[patch as usize], self.elements.patches[patch as usize].root);
        let (up, outline) = (frame.u.cross(frame.v), self.elements.outline(root));
        let centre = self.elements.nodes[root as usize].centre;
        outline.iter().flat_map(|&corner| [0.2, 0.6, 0.97].map(|reach| centre.lerp(corner, reach))).all(|origin| {
            (0..CLOSURE_RAYS).all(|i| {
                // A spiral over the hemisphere, even in the cosine measure.
                let radius = ((f64::from(i) + 0.5) / f64::from(CLOSURE_RAYS)).sqrt();
                let angle = f64::from(i) * 2.399_963_229_728_653; // the golden angle
                let across = frame.u * (radius * angle.cos()) + frame.v * (radius * angle.sin());
                let direction = across + up * (1.0 - radius * radius).sqrt();
                let hit = bvh.closest_hit_among(&Ray { origin, direction }, |polygon| polygon != frame.polygon);
                hit.is_some_and(|hit| hit.normal.dot(direction) < 0.0)
            })
        })
    }

    fn energy_defect(&self, scene: &Scene) -> f64 {
        let (mut emitted, mut absorbed) = (Rgb::ZERO, Rgb::ZERO);
        for leaf in self.elements.leaves() {
            let Some(polygon) = self.elements.polygon_of(leaf) else { continue };
            let (material, area) = (scene.material(polygon), self.elements.nodes[leaf as usize].area);
            emitted += material.exitance() * area;
            absorbed += (Rgb::ONE - scene.reflectance(polygon)) * self.irradiance_over_links(leaf) * area;
        }
        (emitted - absorbed).abs().max_element() / emitted.max_element().max(f64::MIN_POSITIVE)
    }

    /// Links whose receiver and source both lie below, or at, those of another link.
    fn doubled_links(&self) -> u32 {
        let pair = |link: &crate::Link| {
            let LinkSource::Node(source) = link.source;
            (link.receiver, source)
        };
        let mut count: HashMap<(NodeId, NodeId), u32> = HashMap::new();
        for link in &self.links {
            *count.entry(pair(link)).or_default() += 1;
        }
        let mut doubled = 0;
        for link in &self.links {
            let (receiver, source) = pair(link);
            let elements = &self.elements;
            let above = elements
                .ancestors(receiver)
                .flat_map(|receiver| elements.ancestors(source).map(move |source| (receiver, source)))
                .map(|pair| count.get(&pair).copied().unwrap_or(0))
                .sum::<u32>();
            doubled += u32::from(above > 1);
        }
        doubled
    }
}
