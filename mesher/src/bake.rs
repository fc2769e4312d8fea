//! Solution → Baked: the stages of this crate, one after another.

use glam::Vec3;
use rayon::prelude::*;
use scene::{Baked, BakedElement, BakedTriangle, DiscontinuityLine, HalfEdges, Provenance, Scene};
use solver::{Gather, Solution};

use crate::{
    Discontinuity, Leaf, LeafSegment, Mesh, MeshStatistics, Progress, RankedLine, SampleQuery, Weight, discontinuities,
    edge_table, evaluate_samples, leaf_meshes, probe, rank, sample_table,
};

/// What a bake is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Discontinuities that a leaf follows at most (k of Hardt & Teller 1996, section 4.2).
    pub discontinuities: u32,
    /// How discontinuities are weighed.
    pub weight: Weight,
    /// Weight below which a discontinuity is not followed, in the weight's unit (w_min). None takes
    /// [`Weight::default_minimum`].
    pub min_weight: Option<f64>,
}

impl Default for BakeOptions {
    /// The paper's k.
    fn default() -> Self {
        Self { discontinuities: 10, weight: Weight::default(), min_weight: None }
    }
}

/// Counts of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BakeStatistics {
    /// The least weight that was used, in the weight's unit.
    pub min_weight: f64,
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

/// The share of the work that the progress gives to all that comes before the samples. With interreflection it is less,
/// with direct light alone more.
const MESH_SHARE: f64 = 0.05;

/// Bakes a solved scene. The provenance is left empty.
pub fn bake(
    scene: &Scene,
    solution: &Solution,
    options: &BakeOptions,
    progress: Progress<'_>,
) -> (Baked, BakeStatistics) {
    progress(0.0);
    let weight = options.weight;
    let min_weight = options.min_weight.unwrap_or_else(|| weight.default_minimum(scene, solution));
    let found = all_discontinuities(scene, solution, weight, min_weight);
    let (leaves, lines) = divided_leaves(scene, solution, &found, weight, options.discontinuities as usize);
    let mesh = leaf_meshes(&edge_table(scene, &solution.cuts, &leaves));

    let gather = Gather::new(scene, solution);
    let evaluate = |queries: &[SampleQuery]| {
        let Some(first) = queries.first() else { return Vec::new() };
        let leaf = gather.over(first.element);
        queries.iter().map(|query| leaf.irradiance(query.position, query.inward)).collect()
    };
    let table = sample_table(scene, &leaves, &mesh, &|polygon, position| gather.contact(polygon, position));
    let (to_sample, to_probe) = (table.queries.len() as f64, mesh.triangles.len() as f64);
    let sampling = (1.0 - MESH_SHARE) * to_sample / (to_sample + to_probe).max(1.0);
    let stage = |from: f64, to: f64| move |part: f64| progress(from + (to - from) * part);
    let values = evaluate_samples(&table.queries, &evaluate, &stage(MESH_SHARE, MESH_SHARE + sampling));
    let samples: Vec<Vec3> = values.iter().map(|value| value.as_vec3()).collect();
    let probes = probe(&leaves, &mesh, &table, &samples, &evaluate, &stage(MESH_SHARE + sampling, 1.0));
    progress(1.0);

    let (vertices, triangles) = stored_triangles(&leaves, &mesh, &table.triangles);
    let statistics = BakeStatistics {
        min_weight,
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
fn all_discontinuities(scene: &Scene, solution: &Solution, weight: Weight, min_weight: f64) -> Vec<Vec<Discontinuity>> {
    let half_edges = HalfEdges::new(scene);
    scene
        .polygon_ids()
        .into_par_iter()
        .map(|receiver| {
            let interactions = solution.interactions(scene, receiver);
            discontinuities(scene, &half_edges, receiver, &interactions, weight, min_weight)
        })
        .collect()
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
        .collect::<Vec<_>>()
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::DVec3;
    use scene::Rgb;
    use solver::{SolveOptions, solve};

    use super::*;
    use crate::testing::scene_of;

    /// A rectangle across z around a middle, facing up or down.
    fn rectangle(middle: [f64; 3], half: f64, up: bool) -> Vec<DVec3> {
        let mut corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)]
            .map(|(x, y)| DVec3::from(middle) + DVec3::new(x, y, 0.0) * half)
            .to_vec();
        if !up {
            corners.reverse();
        }
        corners
    }

    /// A floor under a lamp, half hidden from it by a plate.
    fn floor_lamp_and_plate() -> Scene {
        let outlines = [
            rectangle([0.0, 0.0, 0.0], 2.0, true),
            rectangle([0.0, 0.0, 2.0], 0.2, false),
            rectangle([0.31, 0.17, 1.0], 0.4, true),
        ];
        let mut scene = scene_of(&outlines);
        let lamp = scene::Material { name: "lamp".into(), radiance: Rgb::splat(100.0), ..scene.materials[0].clone() };
        scene.materials.push(lamp);
        scene.polygons[1].material = 1;
        scene
    }

    fn baked(scene: &Scene, options: &BakeOptions) -> (Baked, BakeStatistics) {
        let direct = SolveOptions { link_error: None, bounces: Some(0) };
        bake(scene, &solve(scene, &direct, &|_| ()), options, &|fraction| assert!((0.0..=1.0).contains(&fraction)))
    }

    #[test]
    fn an_empty_scene_bakes_to_nothing() {
        let (baked, statistics) = baked(&Scene::default(), &BakeOptions::default());
        assert_eq!((baked, statistics), (Baked::default(), BakeStatistics::default()));
    }

    #[test]
    fn triangles_fill_every_polygon_and_all_is_in_range() {
        let scene = floor_lamp_and_plate();
        let (baked, statistics) = baked(&scene, &BakeOptions { min_weight: Some(1.0), ..BakeOptions::default() });
        baked.validate().unwrap();
        assert_eq!(statistics.mesh, MeshStatistics::default());
        assert_eq!(statistics.discontinuities_kept, baked.lines.len());
        assert_eq!(baked.error.points, baked.triangles.len() as u64);
        for polygon in scene.polygon_ids() {
            let of_polygon = (0..baked.triangles.len() as u32)
                .filter(|&triangle| baked.triangles[triangle as usize].polygon == polygon);
            let area: f64 = of_polygon.map(|triangle| scene::area_vector(&baked.corners(triangle)).length()).sum();
            assert!((area / scene.area(polygon) - 1.0).abs() < 1e-6, "the rounding to f32");
        }
    }

    #[test]
    fn following_discontinuities_lowers_the_error() {
        let scene = floor_lamp_and_plate();
        let error = |discontinuities| {
            baked(&scene, &BakeOptions { discontinuities, weight: Weight::Ratio, min_weight: Some(1.0) }).0.error.rms
        };
        let (none, all) = (error(0), error(20));
        assert!(all < 0.5 * none, "{all} of {none}");
    }

    #[test]
    fn any_number_of_threads_bakes_the_same() {
        let scene = floor_lamp_and_plate();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| baked(&scene, &BakeOptions::default()))
        };
        assert!(run(1) == run(3));
    }
}
