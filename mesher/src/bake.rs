//! Solution → Baked: the stages of this crate, one after another.

use glam::Vec3;
use rayon::prelude::*;
use scene::{Baked, BakedElement, BakedTriangle, DiscontinuityLine, HalfEdges, Provenance, Scene};
use solver::{Gather, Solution};

use crate::{
    Discontinuity, Leaf, LeafSegment, Mesh, MeshStatistics, Progress, SampleQuery, discontinuities, edge_table,
    evaluate_samples, leaf_meshes, probe, rank, sample_table,
};

/// What a bake is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Discontinuities that a leaf follows at most (k of Hardt & Teller 1996, section 4.2).
    pub discontinuities: u32,
    /// Weight below which a discontinuity is not followed, W·m⁻² (w_min).
    pub min_weight: f64,
}

impl Default for BakeOptions {
    /// The paper's values.
    fn default() -> Self {
        Self { discontinuities: 10, min_weight: 100.0 }
    }
}

/// Counts of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BakeStatistics {
    /// Discontinuities of at least the least weight, over all polygons.
    pub discontinuities_found: usize,
    /// Discontinuities that at least one leaf follows.
    pub discontinuities_kept: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Samples, each evaluated once.
    pub samples: usize,
    /// What the triangulation could not do as planned.
    pub mesh: MeshStatistics,
}

/// The share of the work that comes before the samples, for the progress: a few per cent as measured.
const MESH_SHARE: f64 = 0.05;

/// Bakes a solved scene. The provenance is left empty.
pub fn bake(
    scene: &Scene,
    solution: &Solution,
    options: &BakeOptions,
    progress: Progress<'_>,
) -> (Baked, BakeStatistics) {
    progress(0.0);
    let found = all_discontinuities(scene, solution, options.min_weight);
    let (leaves, lines) = divided_leaves(scene, solution, &found, options.discontinuities as usize);
    let mesh = leaf_meshes(&edge_table(scene, &solution.cuts, &leaves));

    let gather = Gather::new(scene, solution);
    let evaluate = |queries: &[SampleQuery]| {
        let Some(first) = queries.first() else { return Vec::new() };
        let leaf = gather.over(first.element);
        queries.iter().map(|query| leaf.irradiance(query.position, query.inward)).collect()
    };
    let table = sample_table(scene, &leaves, &mesh, &|polygon, position| gather.contact(polygon, position));
    let (to_sample, to_probe) = (table.queries.len() as f64, 3.0 * mesh.triangles.len() as f64);
    let stage = |done: f64, share: f64| {
        let fraction = done / (to_sample + to_probe).max(1.0);
        move |part: f64| progress(MESH_SHARE + (1.0 - MESH_SHARE) * (fraction + share * part))
    };
    let sampled = to_sample / (to_sample + to_probe).max(1.0);
    let values = evaluate_samples(&table.queries, &evaluate, &stage(0.0, sampled));
    let samples: Vec<Vec3> = values.iter().map(|value| value.as_vec3()).collect();
    let probes = probe(&leaves, &mesh, &table, &samples, &evaluate, &stage(to_sample, 1.0 - sampled));
    progress(1.0);

    let (vertices, triangles) = stored_triangles(&leaves, &mesh, &table.triangles);
    let statistics = BakeStatistics {
        discontinuities_found: found.iter().map(Vec::len).sum(),
        discontinuities_kept: lines.len(),
        vertices: vertices.len(),
        triangles: triangles.len(),
        samples: samples.len(),
        mesh: mesh.statistics,
    };
    let element = |leaf: &Leaf| BakedElement {
        polygon: leaf.polygon,
        irradiance: solution.irradiance[leaf.element as usize].irradiance.as_vec3(),
    };
    let baked = Baked {
        scene: scene.clone(),
        vertices,
        samples,
        triangles,
        triangle_errors: probes.triangle_errors,
        elements: leaves.iter().map(element).collect(),
        lines,
        error: probes.error,
        provenance: Provenance::default(),
    };
    (baked, statistics)
}

/// The discontinuities on every polygon.
fn all_discontinuities(scene: &Scene, solution: &Solution, min_weight: f64) -> Vec<Vec<Discontinuity>> {
    let half_edges = HalfEdges::new(scene);
    scene
        .polygon_ids()
        .into_par_iter()
        .map(|receiver| {
            let interactions = solution.interactions(scene, receiver);
            discontinuities(scene, &half_edges, receiver, &interactions, min_weight)
        })
        .collect()
}

/// All leaves with the `count` strongest discontinuities of each, and the lines that these are parts of.
fn divided_leaves(
    scene: &Scene,
    solution: &Solution,
    found: &[Vec<Discontinuity>],
    count: usize,
) -> (Vec<Leaf>, Vec<DiscontinuityLine>) {
    let elements = &solution.elements;
    let mut leaves: Vec<Leaf> = scene
        .polygon_ids()
        .flat_map(|polygon| solution.leaves_of(polygon).into_iter().map(move |element| (polygon, element)))
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(polygon, element)| {
            let outline = elements.outline(element);
            let ranked = rank(scene, outline, &found[polygon as usize], count);
            let segment = |line: crate::RankedLine| LeafSegment { ends: line.ends, line: line.discontinuity };
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

/// The mesh as it is stored: without the vertices that no triangle uses.
fn stored_triangles(leaves: &[Leaf], mesh: &Mesh, samples: &[[u32; 6]]) -> (Vec<Vec3>, Vec<BakedTriangle>) {
    const UNUSED: u32 = u32::MAX;
    let mut stored = vec![UNUSED; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .zip(samples)
        .map(|(triangle, &samples)| BakedTriangle {
            vertices: triangle.vertices.map(|vertex| {
                let id = &mut stored[vertex as usize];
                if *id == UNUSED {
                    *id = vertices.len() as u32;
                    vertices.push(mesh.vertices[vertex as usize].as_vec3());
                }
                *id
            }),
            samples,
            polygon: leaves[triangle.leaf as usize].polygon,
            element: triangle.leaf,
            edges: triangle.edges,
        })
        .collect();
    (vertices, triangles)
}
