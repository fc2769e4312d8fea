//! The fine mesh: all leaves with the discontinuities that they follow, and the light of emitters at its samples.
//!
//! Light straight from emitters has all of the sharp edges and costs little to find exactly; so this mesh is as fine as that
//! light asks for, and light over reflectors is only carried over to it (`reflected_light`).

use glam::DVec3;
use rayon::prelude::*;
use scene::{DiscontinuityLine, Rgb, Scene};
use solver::{Gather, NodeId, Solution};

use crate::probe::{colour_mean, probe_point};
use crate::{
    Discontinuity, Leaf, LeafSegment, Mesh, RankedLine, SampleQuery, SampleTable, Weight, edge_table, evaluate_samples,
    leaf_meshes, rank, sample_table,
};

/// A mesh of all leaves, and what emitters send to its samples.
pub(crate) struct FineMesh {
    pub leaves: Vec<Leaf>,
    /// The discontinuities that some leaf follows.
    pub lines: Vec<DiscontinuityLine>,
    pub mesh: Mesh,
    pub table: SampleTable,
    /// Irradiance from emitters at each sample of the table, W·m⁻².
    pub emitted: Vec<Rgb>,
}

impl FineMesh {
    /// Meshes the solution's leaves with the `count` strongest discontinuities of each.
    pub fn new(scene: &Scene, solution: &Solution, found: &[Vec<Discontinuity>], weight: Weight, count: usize) -> Self {
        let (leaves, lines) = divided_leaves(scene, solution, found, weight, count);
        let mesh = leaf_meshes(&edge_table(scene, &solution.cuts, &leaves));
        let gather = Gather::new(scene, solution);
        let table = sample_table(scene, &leaves, &mesh, &|polygon, position| gather.contact(polygon, position));
        let emitted = evaluate_samples(&table.queries, &emitted(&gather), &|_| ());
        Self { leaves, lines, mesh, table, emitted }
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Corner positions of a triangle, metres.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.mesh.triangles[triangle].vertices.map(|vertex| self.mesh.vertices[vertex as usize])
    }

    /// What the interpolation of emitters' light gets wrong at one point of every triangle that it was not fitted to,
    /// W·m⁻² averaged over the colours as a root mean square; and the exact light there, averaged over the colours.
    pub fn probe_emitted(&self, scene: &Scene, solution: &Solution) -> Vec<(f64, f64)> {
        let queries: Vec<SampleQuery> = (0..self.triangles()).map(|triangle| self.probe_query(triangle)).collect();
        let gather = Gather::new(scene, solution);
        let exact = evaluate_samples(&queries, &emitted(&gather), &|_| ());
        (0..self.triangles())
            .map(|triangle| {
                let samples = self.table.triangles[triangle].map(|sample| self.emitted[sample as usize]);
                let (s, t) = probe_point(triangle);
                let difference = scene::Interpolant::through(samples).evaluate(s, t) - exact[triangle];
                (colour_mean(difference * difference).sqrt(), colour_mean(exact[triangle]))
            })
            .collect()
    }

    fn probe_query(&self, triangle: usize) -> SampleQuery {
        let [a, b, c] = self.corners(triangle);
        let Leaf { polygon, element, .. } = self.leaves[self.mesh.triangles[triangle].leaf as usize];
        let (s, t) = probe_point(triangle);
        let position = a * (1.0 - s - t) + b * s + c * t;
        SampleQuery { position, polygon, element, inward: DVec3::ZERO }
    }
}

/// Evaluates light from emitters.
fn emitted<'a>(gather: &'a Gather<'a>) -> impl Fn(&[SampleQuery]) -> Vec<Rgb> + Sync + 'a {
    |queries: &[SampleQuery]| {
        let Some(first) = queries.first() else { return Vec::new() };
        let leaf = gather.over_emitters(first.element);
        queries.iter().map(|query| leaf.emitted(query.position, query.inward)).collect()
    }
}

/// All leaves with the `count` strongest discontinuities of each, and the lines that these are parts of.
fn divided_leaves(
    scene: &Scene,
    solution: &Solution,
    found: &[Vec<Discontinuity>],
    weight: Weight,
    count: usize,
) -> (Vec<Leaf>, Vec<DiscontinuityLine>) {
    let elements = &solution.elements;
    let mut leaves: Vec<Leaf> = scene
        .polygon_ids()
        .flat_map(|polygon| solution.leaves_of(polygon).into_iter().map(move |element| (polygon, element)))
        .collect::<Vec<(u32, NodeId)>>()
        .into_par_iter()
        .map(|(polygon, element)| {
            let outline = elements.outline(element);
            let ranked = rank(scene, outline, &found[polygon as usize], weight, count);
            let segment = |line: RankedLine| LeafSegment { ends: line.ends, line: line.discontinuity };
            let segments = ranked.into_iter().map(segment).collect();
            Leaf { element, polygon, outline: outline.to_vec(), segments }
        })
        .collect();

    // Until here a segment names its line by its place on the polygon; now the lines that are kept are numbered.
    let mut kept: Vec<(u32, u32)> =
        leaves.iter().flat_map(|leaf| leaf.segments.iter().map(|segment| (leaf.polygon, segment.line))).collect();
    kept.sort_unstable();
    kept.dedup();
    for leaf in &mut leaves {
        for segment in &mut leaf.segments {
            segment.line = kept.partition_point(|&line| line < (leaf.polygon, segment.line)) as u32;
        }
    }
    let stored = |&(polygon, line): &(u32, u32)| {
        let line = &found[polygon as usize][line as usize];
        DiscontinuityLine {
            kind: line.kind,
            receiver: line.receiver,
            source: line.source,
            blocker: line.blocker,
            weight: line.weight as f32,
            ends: line.ends.map(|end| end.as_vec3()),
        }
    };
    (leaves, kept.iter().map(stored).collect())
}
