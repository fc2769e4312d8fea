//! Light over reflectors, at the nodes of a coarse mesh.
//!
//! It is smooth where light from emitters is sharp, and costly to find: a point sees all surfaces of a room. So it has a
//! mesh of its own, of few large leaves, and what each of its samples sees of the reflectors is found once and kept as a row
//! of [`SeenNode`]s. Light is then sent over all rows until it no longer changes: a Nyström solution of the radiosity
//! equation (Atkinson 1997, chapter 4), which no longer depends on the links' form factors but for the choice of what is
//! near enough to be opened.
//!
//! Which leaves are divided is decided by what the coarse mesh gets wrong at points that it was not fitted to, not by what
//! single links carry (Hardt & Teller 1996, section 7.2).

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use scene::{Rgb, Seen, luminance};
use solver::{Gather, NodeId, SeenNode, Solution, Surroundings, Visibility};

use crate::SampleQuery;
use crate::coarse_mesh::{CoarseMesh, Light, Place};
use crate::fine_mesh::FineMesh;
use crate::inquiry::Inquiry;
use crate::leaf_error::{LeafError, ProbedLeaf, leaf_errors, leaf_probes, probe};
use crate::projection::Projection;
use crate::radiosity::{Radiosity, Row};
use crate::samples::ByQuery;
use crate::stand_ins::StandIns;

/// Light over reflectors on all surfaces.
pub(crate) struct ReflectedLight {
    /// The leaves of the coarse mesh, elements of the solution.
    front: Vec<NodeId>,
    /// Which answer is what a sample sees, by what it is asked: kept from mesh to mesh.
    rows: ByQuery<u32>,
    /// The source error that the rows were found with.
    source_error: f64,
    coarse: CoarseMesh,
    /// What is reflected, at each sample of the fine mesh: the irradiance one bounce earlier.
    pub reflecting: Vec<Vec3>,
}

impl ReflectedLight {
    /// No light yet, and a front of elements that are no longer than `length`, metres, where the solution has such. Elements
    /// that the solver has divided for the sake of emitters' shadows are not followed.
    pub fn new(solution: &Solution, length: f64) -> Self {
        let elements = &solution.elements;
        let mut front = Vec::new();
        let mut open: Vec<NodeId> = elements.patches.iter().rev().map(|patch| patch.root).collect();
        while let Some(node) = open.pop() {
            if elements.is_leaf(node) || elements.cell_length(node) <= length {
                front.push(node);
            } else {
                open.extend(elements.children(node).rev());
            }
        }
        Self {
            front,
            rows: ByQuery::default(),
            source_error: 0.0,
            coarse: CoarseMesh::default(),
            reflecting: Vec::new(),
        }
    }

    /// Finds the light: meshes the front, finds what new samples see, and sends light to and fro. If the bake is stopped meanwhile,
    /// the light stays as it is.
    pub fn solve(
        &mut self,
        surroundings: &Surroundings<'_>,
        solution: &mut Solution,
        fine: &FineMesh,
        options: &Exchange,
        inquiry: &mut Inquiry<'_>,
    ) {
        let scene = surroundings.scene;
        let projection = Projection::new(fine, solution);
        let is_first = self.coarse.leaves.is_empty();
        if is_first {
            self.solve_roughly(surroundings, solution, fine, &projection, options, inquiry);
        }
        // The last mesh is asked for light until the next one knows it, and never again where.
        self.coarse.table.queries = Vec::new();
        let (coarse, leaves) = CoarseMesh::new(surroundings, solution, &self.front);
        let stand_ins = StandIns::new(scene, solution, &leaves, &coarse.mesh, (&coarse.table, &coarse.looked_at));
        drop(leaves);
        self.look(surroundings, solution, &stand_ins.queries, options, STALE, inquiry);
        if inquiry.stopped() {
            self.front = self.coarse.leaves.iter().map(|leaf| leaf.element).collect();
            return;
        }
        self.coarse = coarse;
        let places = self.places(solution, fine);
        let rows: Vec<&Row> = stand_ins.queries.iter().map(|query| self.row(query, inquiry)).collect();
        let table = &self.coarse.table;
        let receive =
            |solution: &Solution| stand_ins.of_samples(table, &Radiosity::of(scene, solution).received(&rows), |_| 0.0);
        let samples = self.coarse.table.queries.len();
        // From darkness, so that what is dark stays exactly dark; later on from the light that is known, where all bounces count.
        let mut values =
            if is_first || solution.bounces.is_some() { vec![Vec3::ZERO; samples] } else { receive(solution) };
        let passed_over = match solution.visibility {
            Visibility::Links => 0,
            Visibility::Rays => samples / TRAPPED,
        };
        for _ in 0..solution.bounces.unwrap_or(MOST_ITERATIONS) {
            self.coarse.values = values;
            self.reflecting = total(&self.coarse, Light::PassedOn, &fine.emitted, &places);
            solution.set_light(projection.planes(&self.reflecting));
            values = receive(solution);
            let moved = largest_move(&self.coarse.values, &values, passed_over);
            if solution.bounces.is_none() && moved <= options.residual {
                break;
            }
        }
        if solution.visibility == Visibility::Rays {
            // What was sent is averaged over many leaves, what is shown is not.
            let radiosity = Radiosity::of(scene, solution);
            let looked = radiosity.received(&rows);
            let gather = Gather::with_source_error(surroundings, solution, options.source_error);
            let scatter = |query: u32| {
                let spread = radiosity.spread(rows[query as usize]) * luminance(looked[query as usize].as_dvec3());
                TRUE_SCATTER * gather.scatter(stand_ins.queries[query as usize].element) * spread
            };
            values = stand_ins.of_samples(table, &looked, scatter);
        }
        self.coarse.values = values;
    }

    /// Light as it is at one point of every leaf, on top of the links' slopes. What reflectors send decides what is opened:
    /// were it known by the links alone, most of what is seen would have to be looked at again.
    fn solve_roughly(
        &mut self,
        surroundings: &Surroundings<'_>,
        solution: &mut Solution,
        fine: &FineMesh,
        projection: &Projection,
        options: &Exchange,
        inquiry: &mut Inquiry<'_>,
    ) {
        let over_links = |solution: &Solution, element, position| {
            solution.reflected_over_links(element, offset(solution, element, position))
        };
        let probes: Vec<SampleQuery> = self.front.iter().map(|&leaf| probe(solution, leaf, 0)).collect();
        let leaf_of = leaf_numbers(solution, &self.front);
        let mut correction = vec![Rgb::ZERO; self.front.len()];
        let light = |solution: &Solution, correction: &[Rgb]| -> Vec<Vec3> {
            let light = |(query, &emitted): (&SampleQuery, &Vec3)| {
                let correction =
                    leaf_above(solution, &leaf_of, query.element).map_or(Rgb::ZERO, |leaf| correction[leaf]);
                emitted + (over_links(solution, query.element, query.position) + correction).max(Rgb::ZERO).as_vec3()
            };
            fine.table.queries.iter().zip(&fine.emitted).map(light).collect()
        };
        self.reflecting = light(solution, &correction);
        solution.set_light(projection.planes(&self.reflecting));
        self.look(surroundings, solution, &probes, options, STALE, inquiry);
        if inquiry.stopped() {
            return;
        }
        let rows: Vec<&Row> = probes.iter().map(|query| self.row(query, inquiry)).collect();
        for _ in 0..ROUGH_ITERATIONS {
            let values = Radiosity::of(surroundings.scene, solution).received(&rows);
            for ((correction, value), query) in correction.iter_mut().zip(values).zip(&probes) {
                *correction = value.as_dvec3() - over_links(solution, query.element, query.position);
            }
            self.reflecting = light(solution, &correction);
            solution.set_light(projection.planes(&self.reflecting));
        }
    }

    /// The irradiance from everywhere that is looked at, at the samples of a fine mesh, W·m⁻².
    pub fn irradiance(&self, solution: &Solution, fine: &FineMesh) -> Vec<Vec3> {
        total(&self.coarse, Light::LookedAt, fine.shown(), &self.places(solution, fine))
    }

    /// The errors of all leaves of the front, by what their probes see. None if the bake is stopped.
    pub fn leaf_errors(
        &mut self,
        surroundings: &Surroundings<'_>,
        solution: &Solution,
        options: &Exchange,
        inquiry: &mut Inquiry<'_>,
    ) -> Option<Vec<LeafError>> {
        let scene = surroundings.scene;
        let queries: Vec<SampleQuery> = leaf_probes(surroundings, solution, &self.front, &self.coarse.table)
            .into_iter()
            .map(|query| query.looked_at(scene))
            .collect();
        self.look(surroundings, solution, &queries, options, STALE_PROBE, inquiry);
        if inquiry.stopped() {
            return None;
        }
        let rows: Vec<&Row> = queries.iter().map(|query| self.row(query, inquiry)).collect();
        let radiosity = Radiosity::of(scene, solution);
        let spreads: Vec<f64> = rows.par_iter().map(|row| radiosity.spread(row)).collect();
        let looked: Vec<(SampleQuery, Rgb, f64)> = queries
            .into_iter()
            .zip(radiosity.received(&rows))
            .zip(spreads)
            .map(|((query, exact), spread)| (query, exact.as_dvec3(), spread))
            .collect();
        let gather = Gather::with_source_error(surroundings, solution, options.source_error);
        let of_leaves: Vec<&[(SampleQuery, Rgb, f64)]> = looked.chunk_by(|a, b| a.0.element == b.0.element).collect();
        let probed = of_leaves.par_iter().enumerate().map(|(leaf, probes)| {
            let baked = |query: &SampleQuery| {
                self.coarse
                    .place(solution, leaf, query)
                    .map_or(Rgb::ZERO, |place| self.coarse.at(place, Light::LookedAt))
            };
            let both: Vec<[Rgb; 2]> = probes.iter().map(|(query, exact, _)| [baked(query), *exact]).collect();
            let element = probes[0].0.element;
            let spread = probes.iter().map(|probe| probe.2).sum::<f64>() / probes.len() as f64;
            ProbedLeaf::new(element, &both, spread * gather.scatter(element))
        });
        Some(leaf_errors(&probed.collect::<Vec<_>>()))
    }

    /// Number of points at which reflectors were looked at.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Divides leaves of the front, given ascending. Returns whether the solution's elements were divided, too, for want of
    /// parts.
    pub fn divide(&mut self, solution: &mut Solution, leaves: &[NodeId]) -> bool {
        let whole: Vec<NodeId> = leaves.iter().copied().filter(|&leaf| solution.elements.is_leaf(leaf)).collect();
        whole.iter().for_each(|&leaf| solution.subdivide(leaf));
        let is_divided = |node: NodeId| leaves.binary_search(&node).is_ok();
        let parts = |node: NodeId| if is_divided(node) { solution.elements.children(node) } else { node..node + 1 };
        self.front = self.front.iter().flat_map(|&node| parts(node)).collect();
        !whole.is_empty()
    }

    /// Finds out what queries see that are not known yet, or were looked at when reflectors were coarser.
    fn look(
        &mut self,
        surroundings: &Surroundings<'_>,
        solution: &Solution,
        queries: &[SampleQuery],
        options: &Exchange,
        stale: f64,
        inquiry: &mut Inquiry<'_>,
    ) {
        let gather = Gather::with_source_error(surroundings, solution, options.source_error);
        // Rays are told by the source error how many they are, and by nothing else.
        if solution.visibility == Visibility::Rays && self.source_error != options.source_error {
            self.rows.clear();
            self.source_error = options.source_error;
        }
        let may_be_stale = solution.visibility == Visibility::Links;
        let allowed = stale * gather.budget();
        let inquiry_so_far = &*inquiry;
        let is_unknown = |query: &&SampleQuery| {
            let known = self.rows.get(&query.key());
            known.is_none_or(|&row| may_be_stale && is_stale(&gather, inquiry_so_far.row(row), allowed))
        };
        let mut unknown: Vec<&SampleQuery> = queries.par_iter().filter(is_unknown).collect();
        unknown.par_sort_by_key(|query| query.element);
        unknown.dedup_by_key(|query| query.key());
        let found = inquiry.rows(&unknown, solution.elements.nodes.len(), |group| {
            let element = gather.over_reflectors(group[0].element);
            let mut seen = Vec::new();
            let row = |query: &&SampleQuery| {
                seen.clear();
                element.seen_nodes(query.position, query.inward.as_dvec3(), query.cosine, &mut seen);
                seen.iter().map(|seen| in_few_digits(solution, seen)).collect()
            };
            group.iter().map(row).collect()
        });
        self.rows.extend(unknown.iter().map(|query| query.key()).zip(found));
    }

    /// What a query sees, which has been found out.
    fn row<'a>(&self, query: &SampleQuery, inquiry: &'a Inquiry<'_>) -> &'a Row {
        inquiry.row(self.rows[&query.key()])
    }

    /// Whether there is any light yet.
    pub fn is_known(&self) -> bool {
        !self.coarse.leaves.is_empty()
    }

    /// Where the samples of a fine mesh lie on the coarse one; nowhere if that has no triangles there.
    fn places(&self, solution: &Solution, fine: &FineMesh) -> Vec<Option<Place>> {
        let leaf_of = leaf_numbers(solution, &self.front);
        let place =
            |query: &SampleQuery| self.coarse.place(solution, leaf_above(solution, &leaf_of, query.element)?, query);
        fine.table.queries.par_iter().map(place).collect()
    }
}

/// By node of the solution, which leaf of a front it is.
fn leaf_numbers(solution: &Solution, front: &[NodeId]) -> Vec<Option<usize>> {
    let mut numbers = vec![None; solution.elements.nodes.len()];
    for (number, &leaf) in front.iter().enumerate() {
        numbers[leaf as usize] = Some(number);
    }
    numbers
}

/// The leaf of a front that an element is, or is a part of.
fn leaf_above(solution: &Solution, leaf_of: &[Option<usize>], element: NodeId) -> Option<usize> {
    solution.elements.ancestors(element).find_map(|node| leaf_of[node as usize])
}

/// How light is sent over rows.
#[derive(Clone, Copy)]
pub(crate) struct Exchange {
    /// Light that a reflector's elements may misplace at a point before finer ones are opened, as a fraction of the scene's
    /// mean irradiance.
    pub source_error: f64,
    /// The largest change of a sample with which the iteration ends, W·m⁻².
    pub residual: f64,
}

/// What looks by rays scatter by in furnished rooms, in what [`Gather::scatter`] takes for granted: where slopes are told from chance.
/// Less takes chance for slopes, half as much again finds no more.
const TRUE_SCATTER: f64 = 3.0;

/// What a row may misplace before it is looked at anew, in what one reflector may misplace at a point: a row names a hundred
/// nodes. Less finds most rows wanting after every division.
const STALE: f64 = 3.0;

/// The same for probes, which only tell errors.
const STALE_PROBE: f64 = 10.0;

/// Times that light is sent between the probe points of the leaves: what is left of its change is a hundredth in a room that
/// reflects half.
const ROUGH_ITERATIONS: u32 = 6;

/// Times that light is sent over the rows at most: at reflectance 0.99 about 1,600 are needed.
const MOST_ITERATIONS: u32 = 5000;

/// One sample of so many may still change where rays tell what is seen: between sheets of a white cushion light goes to and fro a
/// thousand times, and nobody sees it. Fewer wait for no more than that.
const TRAPPED: usize = 500;

/// A [`SeenNode`] in a quarter of the memory.
fn in_few_digits(solution: &Solution, seen: &SeenNode) -> Seen {
    Seen::new(seen.node, seen.form_factor, seen.offset / solution.elements.cell_length(seen.node))
}

/// Whether a row refers to nodes that have been divided since and whose light has turned out not to be linear, so that it
/// misplaces more than `allowed`, W·m⁻². What single nodes misplace is of either sign: squares add up.
fn is_stale(gather: &Gather<'_>, row: &Row, allowed: f64) -> bool {
    let excess = |seen: &Seen| (gather.misplaced(seen.node, f64::from(seen.form_factor())) - gather.budget()).max(0.0);
    row.iter().map(|seen| excess(seen).powi(2)).sum::<f64>() > allowed * allowed
}

fn total(coarse: &CoarseMesh, light: Light, emitted: &[Vec3], places: &[Option<Place>]) -> Vec<Vec3> {
    let reflected = |place: &Option<Place>| place.map_or(Vec3::ZERO, |place| coarse.at(place, light).as_vec3());
    emitted.par_iter().zip(places).with_min_len(256).map(|(&emitted, place)| emitted + reflected(place)).collect()
}

/// The largest change but for as many that are larger.
fn largest_move(from: &[Vec3], to: &[Vec3], passed_over: usize) -> f64 {
    let mut moves: Vec<f32> = from.iter().zip(to).map(|(a, b)| (a - b).abs().max_element()).collect();
    if moves.is_empty() {
        return 0.0;
    }
    f64::from(*moves.select_nth_unstable_by(passed_over, |a, b| b.total_cmp(a)).1)
}

/// Where a position lies, from the middle of an element along its patch's u and v, metres.
pub(crate) fn offset(solution: &Solution, element: NodeId, position: DVec3) -> DVec2 {
    let elements = &solution.elements;
    let Some(patch) = elements.patch_of(element) else { return DVec2::ZERO };
    elements.patches[patch as usize].along(position - elements.nodes[element as usize].centre)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_moves_may_be_passed_over() {
        assert_eq!(largest_move(&[], &[], 0), 0.0);
        let (from, to) = ([Vec3::ZERO; 4], [Vec3::X, Vec3::Y * -3.0, Vec3::Z * 2.0, Vec3::ZERO]);
        let moves: Vec<f64> = (0..4).map(|passed_over| largest_move(&from, &to, passed_over)).collect();
        assert_eq!(moves, [3.0, 2.0, 1.0, 0.0]);
    }
}
