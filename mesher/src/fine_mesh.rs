//! The fine mesh: all leaves with the discontinuities that they follow, and the light of emitters at its samples.
//!
//! Light straight from emitters has all of the sharp edges and costs little to find exactly; so this mesh is as fine as that
//! light asks for, and light over reflectors is only carried over to it (`reflected_light`).

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use scene::{DiscontinuityLine, SKY, Scene};
use solver::{Cosine, Gather, NodeId, Shafts, Solution, Surroundings};

use crate::edge_table::MeshedLeaf;
use crate::guess::guessed_emitted;
use crate::inquiry::Inquiry;
use crate::lines::Lines;
use crate::probe::{colour_mean, probe_point};
use crate::samples::ByQuery;
use crate::{
    Leaf, LeafSegment, Mesh, RankedLine, SampleQuery, SampleTable, Weight, edge_table, leaf_meshes, rank, sample_table,
};

/// A mesh of all leaves, and what emitters send to its samples.
#[derive(Default)]
pub(crate) struct FineMesh {
    pub leaves: Vec<MeshedLeaf>,
    /// The discontinuities that some leaf follows.
    pub lines: Vec<DiscontinuityLine>,
    pub mesh: Mesh,
    pub table: SampleTable,
    /// Irradiance from emitters at each sample of the table, W·m⁻², by polygons' own normals: what surfaces pass on.
    pub emitted: Vec<Vec3>,
    /// The same by shading normals: what is looked at. None where no polygon has such.
    by_shading: Option<Vec<Vec3>>,
    /// The part of it that is the sky's; empty where there is none.
    pub shown_sky: Vec<Vec3>,
    /// The same at each triangle's probe point.
    probed: Vec<Vec3>,
}

/// Which answer is the irradiance from emitters, at every point that was asked for so far: from mesh to mesh most stay.
#[derive(Default)]
pub(crate) struct EmittedLight {
    light: ByQuery<u32>,
    /// What stands between each leaf and the emitters.
    shafts: HashMap<NodeId, Shafts>,
}

impl FineMesh {
    /// Meshes the solution's leaves with the `count` strongest discontinuities of each. An emitter that sends less than `dim` of
    /// the scene's mean irradiance to a point need not be seen exactly.
    pub fn new(
        surroundings: &Surroundings<'_>,
        solution: &Solution,
        (known_lines, weight, count): (&Lines, Weight, usize),
        dim: f64,
        known: &mut EmittedLight,
        inquiry: &mut Inquiry<'_>,
    ) -> Self {
        let scene = surroundings.scene;
        let (leaves, lines) = divided_leaves(scene, solution, known_lines, weight, count);
        let mesh = leaf_meshes(&edge_table(scene, &solution.cuts, &leaves));
        let gather = Gather::with_source_error(surroundings, solution, dim);
        let table = sample_table(scene, &leaves, &mesh, &|polygon, position| gather.contact(polygon, position));
        let leaves = leaves.iter().map(MeshedLeaf::from).collect();
        let mut fine = Self { leaves, lines, mesh, table, ..Self::default() };
        let probes: Vec<SampleQuery> = (0..fine.triangles())
            .into_par_iter()
            .with_min_len(256)
            .map(|triangle| fine.probe_query(triangle).looked_at(scene))
            .collect();
        let (samples, shaded) = fine.table.shaded(scene);
        known.find(&gather, fine.table.queries.iter().chain(&shaded).chain(&probes), inquiry);
        known.shafts.retain(|&element, _| solution.elements.is_leaf(element));
        let shown = |mut own: Vec<Vec3>, by_shading: Vec<Vec3>| {
            samples.iter().zip(by_shading).for_each(|(&sample, light)| own[sample] = light);
            own
        };
        fine.emitted = known.at(solution, &fine.table.queries, inquiry);
        if !shaded.is_empty() {
            fine.by_shading = Some(shown(fine.emitted.clone(), known.at(solution, &shaded, inquiry)));
        }
        if inquiry.has_sky() {
            fine.shown_sky = shown(known.sky_at(&fine.table.queries, inquiry), known.sky_at(&shaded, inquiry));
        }
        fine.probed = known.at(solution, &probes, inquiry);
        fine
    }

    /// Irradiance from emitters at each sample of the table that is looked at, W·m⁻².
    pub fn shown(&self) -> &[Vec3] {
        self.by_shading.as_ref().unwrap_or(&self.emitted)
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
    pub fn probe_emitted(&self) -> Vec<(f64, f64)> {
        (0..self.triangles())
            .into_par_iter()
            .with_min_len(256)
            .map(|triangle| {
                let samples = self.table.triangles[triangle].map(|sample| self.shown()[sample as usize].as_dvec3());
                let (s, t) = probe_point(self.probe_number(triangle));
                let probed = self.probed[triangle].as_dvec3();
                let difference = scene::Interpolant::through(samples).evaluate(s, t) - probed;
                (colour_mean(difference * difference).sqrt(), colour_mean(probed))
            })
            .collect()
    }

    /// Which point of a triangle is its probe: the same as long as its leaf stays as it is.
    fn probe_number(&self, triangle: usize) -> u32 {
        let leaf = self.mesh.triangles[triangle].leaf;
        let first = self.mesh.triangles.partition_point(|other| other.leaf < leaf);
        self.leaves[leaf as usize].element + (triangle - first) as u32
    }

    fn probe_query(&self, triangle: usize) -> SampleQuery {
        let [a, b, c] = self.corners(triangle);
        let MeshedLeaf { polygon, element } = self.leaves[self.mesh.triangles[triangle].leaf as usize];
        let (s, t) = probe_point(self.probe_number(triangle));
        let position = a * (1.0 - s - t) + b * s + c * t;
        SampleQuery { position, polygon, element, inward: Vec3::ZERO, cosine: Cosine::Own }
    }
}

impl EmittedLight {
    /// Evaluates what is not known yet, each leaf's points together.
    fn find<'a>(
        &mut self,
        gather: &Gather<'_>,
        queries: impl Iterator<Item = &'a SampleQuery>,
        inquiry: &mut Inquiry<'_>,
    ) {
        let queries: Vec<&SampleQuery> = queries.collect();
        let mut unknown: Vec<&SampleQuery> =
            queries.into_par_iter().filter(|query| !self.light.contains_key(&query.key())).collect();
        unknown.par_sort_by_key(|query| query.element);
        unknown.dedup_by_key(|query| query.key());
        // What stands in a shaft is the same whoever looks first.
        let shafts = Mutex::new(std::mem::take(&mut self.shafts));
        let locked = || shafts.lock().unwrap_or_else(PoisonError::into_inner);
        let found = inquiry.emitted(&unknown, |group| {
            let element = group[0].element;
            let mut own = locked().remove(&element).unwrap_or_default();
            let leaf = gather.over_emitters(element, &mut own);
            let light =
                group.iter().map(|query| leaf.emitted(query.position, query.inward.as_dvec3(), query.cosine)).collect();
            locked().insert(element, own);
            light
        });
        self.shafts = shafts.into_inner().unwrap_or_else(PoisonError::into_inner);
        self.light.extend(unknown.iter().map(|query| query.key()).zip(found));
    }

    /// Forgets what stands between leaves and emitters: it can be found out again.
    pub fn forget_shafts(&mut self) {
        self.shafts = HashMap::new();
    }

    /// Lends what stands between some leaves and the emitters, to look further.
    pub fn with_shafts<T>(&mut self, leaves: &[NodeId], look: impl FnOnce(&mut [(NodeId, Shafts)]) -> T) -> T {
        let mut lent: Vec<(NodeId, Shafts)> =
            leaves.iter().map(|&leaf| (leaf, self.shafts.remove(&leaf).unwrap_or_default())).collect();
        let seen = look(&mut lent);
        self.shafts.extend(lent);
        seen
    }

    fn at(&self, solution: &Solution, queries: &[SampleQuery], inquiry: &Inquiry<'_>) -> Vec<Vec3> {
        let known = |query: &SampleQuery| self.light.get(&query.key()).map(|&number| inquiry.light(number));
        if inquiry.stopped() {
            return guessed_emitted(solution, queries, &queries.iter().map(known).collect::<Vec<_>>());
        }
        queries.par_iter().map(|query| known(query).unwrap_or_default()).collect()
    }

    /// The part that is the sky's, as far as it is known.
    fn sky_at(&self, queries: &[SampleQuery], inquiry: &Inquiry<'_>) -> Vec<Vec3> {
        let known = |query: &SampleQuery| self.light.get(&query.key()).map(|&number| inquiry.light_of_sky(number));
        queries.par_iter().map(|query| known(query).unwrap_or_default()).collect()
    }
}

/// All leaves with the `count` strongest discontinuities of each, and the lines that these are parts of.
fn divided_leaves(
    scene: &Scene,
    solution: &Solution,
    known: &Lines,
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
            let candidates = known.on(solution, polygon, element);
            let ranked = rank(scene, outline, known.all(), candidates, weight, count);
            let segment = |line: RankedLine| LeafSegment { ends: line.ends, line: line.discontinuity };
            let segments = ranked.into_iter().map(segment).collect();
            Leaf { element, polygon, outline: outline.to_vec(), segments }
        })
        .collect();

    // Until here a segment names its line among all that are known; now those that are kept are numbered.
    let mut kept: Vec<u32> = leaves.iter().flat_map(|leaf| leaf.segments.iter().map(|segment| segment.line)).collect();
    kept.sort_unstable();
    kept.dedup();
    for segment in leaves.iter_mut().flat_map(|leaf| &mut leaf.segments) {
        segment.line = kept.partition_point(|&line| line < segment.line) as u32;
    }
    let stored = |&line: &u32| {
        let line = &known.all()[line as usize];
        DiscontinuityLine {
            kind: line.kind,
            receiver: line.receiver,
            source: if (line.source as usize) < scene.polygons.len() { line.source } else { SKY },
            blocker: line.blocker,
            weight: line.weight as f32,
            ends: line.ends.map(|end| end.as_vec3()),
        }
    };
    (leaves, kept.iter().map(stored).collect())
}
