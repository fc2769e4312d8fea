//! Stand-ins: where light over reflectors is looked at in place of the samples of a mesh, and how much of each look a sample is.

use glam::Vec3;
use rayon::prelude::*;
use scene::{Rgb, Scene};
use solver::{Cosine, LinearLight, PrincipalAxes, SMALL_LEAF, Solution, Visibility};

use crate::{Leaf, Mesh, MeshTriangle, SampleQuery, SampleTable};

/// How far from a contact its stand-ins lie, as parts of the way to the middle of the element. Nearer ones feel more of what
/// is special to the contact, farther ones miss more of what curves.
const ASIDE: f64 = 0.07;

/// What is looked at for the samples of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StandIns {
    /// Where light is looked at. Those of one element stand together.
    pub queries: Vec<SampleQuery>,
    /// By sample, what its light is told from.
    told: Vec<Told>,
    /// Light over small leaves.
    planes: Vec<LeafPlane>,
    /// Numbers of planes; those around one sample follow each other.
    around: Vec<u32>,
}

/// What the light of a sample is told from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    /// A look at its own place: the query's number.
    Look(u32),
    /// Two looks aside of a contact, the nearer first: what the light is there, continued in a straight line.
    Aside(u32),
    /// The mean of the planes of the leaves around: the first of them, and their end, in `around`.
    Planes([u32; 2]),
    /// The mean of two other samples.
    Between([u32; 2]),
}

/// Light over a small leaf as a plane: through what it is at places on the leaf's principal axes.
#[derive(Clone, Debug, PartialEq)]
struct LeafPlane {
    /// The query at the first of the places; the others follow it.
    first: u32,
    axes: PrincipalAxes,
}

impl StandIns {
    /// Where to look for the samples of a mesh of leaves. `looked_at` names for each sample the one of the same place that is
    /// looked at: itself, but for polygons with shading normals.
    pub fn new(
        scene: &Scene,
        solution: &Solution,
        leaves: &[Leaf],
        mesh: &Mesh,
        (table, looked_at): (&SampleTable, &[u32]),
    ) -> Self {
        let small = match solution.visibility {
            Visibility::Rays => SMALL_LEAF * scene.surface_area(),
            Visibility::Links => 0.0,
        };
        let mut stand_ins = Self::default();
        let plane_of: Vec<Option<u32>> = leaves
            .iter()
            .map(|leaf| {
                let is_small = solution.elements.nodes[leaf.element as usize].area < small;
                is_small.then(|| stand_ins.look_within(solution, leaf)).flatten()
            })
            .collect();
        let leaves_of = leaves_of_samples(mesh, table);
        let mut is_over_planes = vec![true; table.queries.len()];
        for &(sample, leaf) in &leaves_of {
            is_over_planes[sample as usize] &= plane_of[leaf as usize].is_some();
        }
        let between = between_corners(table, looked_at, |sample| is_over_planes[sample as usize]);
        let mut rest = leaves_of.as_slice();
        for (sample, query) in (0..).zip(&table.queries) {
            let own = rest.split_off(..rest.partition_point(|pair| pair.0 == sample)).unwrap_or_default();
            let told = if let Ok(place) = between.binary_search_by_key(&sample, |(sample, _)| *sample) {
                Told::Between(between[place].1)
            } else if is_over_planes[sample as usize] && !own.is_empty() {
                let first = stand_ins.around.len() as u32;
                stand_ins.around.extend(own.iter().filter_map(|&(_, leaf)| plane_of[leaf as usize]));
                Told::Planes([first, stand_ins.around.len() as u32])
            } else {
                stand_ins.look_at(solution, query)
            };
            stand_ins.told.push(told);
        }
        stand_ins
    }

    /// The light of the samples of the same table, from that at the queries; never negative. `scatter` is what a query is off by for
    /// chance, root mean square, luminance, W·m⁻².
    pub fn of_samples(&self, table: &SampleTable, looked: &[Vec3], scatter: impl Fn(u32) -> f64 + Sync) -> Vec<Vec3> {
        let look = |query: u32| looked[query as usize].as_dvec3();
        let over_leaf = |LeafPlane { first, axes }: &LeafPlane| {
            let queries = *first..*first + axes.places().count() as u32;
            let chance = queries.clone().map(|query| scatter(query).powi(2)).sum::<f64>() / queries.len() as f64;
            axes.linear_light(|place| look(first + place), chance.sqrt())
        };
        let over_leaves: Vec<LinearLight> = self.planes.par_iter().with_min_len(256).map(over_leaf).collect();
        let sample = |(told, query): (&Told, &SampleQuery)| match *told {
            Told::Look(number) => look(number),
            Told::Aside(nearer) => look(nearer) * 2.0 - look(nearer + 1),
            Told::Planes([first, end]) => {
                let around = &self.around[first as usize..end as usize];
                let light =
                    |&plane: &u32| self.planes[plane as usize].axes.at(&over_leaves[plane as usize], query.position);
                around.iter().map(light).sum::<Rgb>() / around.len() as f64
            }
            Told::Between(_) => Rgb::ZERO,
        };
        let pairs = self.told.par_iter().zip(&table.queries).with_min_len(256);
        let mut samples: Vec<Vec3> = pairs.map(|pair| sample(pair).max(Rgb::ZERO).as_vec3()).collect();
        for (sample, told) in self.told.iter().enumerate() {
            if let Told::Between([from, to]) = *told {
                samples[sample] = (samples[from as usize] + samples[to as usize]) / 2.0;
            }
        }
        samples
    }

    /// Looks at a sample: at its own place, or at a contact at two places aside.
    ///
    /// At a contact the slope of the light over reflectors is infinite (it goes with d ln d at the distance d), and an
    /// interpolant through the limit is off over all of the leaf. One through what the light is a little aside, continued in a
    /// straight line, is off in a strip.
    fn look_at(&mut self, solution: &Solution, query: &SampleQuery) -> Told {
        let number = self.queries.len() as u32;
        if query.inward == Vec3::ZERO {
            self.queries.push(*query);
            return Told::Look(number);
        }
        let centre = solution.elements.nodes[query.element as usize].centre;
        let aside =
            |part: f64| SampleQuery { position: query.position.lerp(centre, part), inward: Vec3::ZERO, ..*query };
        self.queries.extend([aside(ASIDE), aside(2.0 * ASIDE)]);
        Told::Aside(number)
    }

    /// Looks at places within a leaf; the number of its plane. None if it has no extent.
    fn look_within(&mut self, solution: &Solution, leaf: &Leaf) -> Option<u32> {
        let patch = solution.elements.patch_of(leaf.element)?;
        let axes = PrincipalAxes::new(&leaf.outline, &solution.elements.patches[patch as usize])?;
        let first = self.queries.len() as u32;
        let Leaf { polygon, element, .. } = *leaf;
        let query = |position| SampleQuery { position, polygon, element, inward: Vec3::ZERO, cosine: Cosine::Own };
        self.queries.extend(axes.places().map(query));
        self.planes.push(LeafPlane { first, axes });
        Some(self.planes.len() as u32 - 1)
    }
}

/// The samples in the middle of edges that are looked at by shading normals, each with those at the edge's ends; ascending, each once.
/// What is so looked at is no leaf's to pass on: neighbours that are to look like one agree on it at the corners of small
/// leaves, and take for linear what is between.
fn between_corners(
    table: &SampleTable,
    looked_at: &[u32],
    is_of_small_leaves: impl Fn(u32) -> bool,
) -> Vec<(u32, [u32; 2])> {
    let mut between = Vec::new();
    for samples in &table.triangles {
        for [from, middle, to] in [[0, 1, 2], [2, 3, 4], [4, 5, 0]].map(|side| side.map(|i: usize| samples[i])) {
            let shaded = looked_at[middle as usize];
            if shaded != middle && is_of_small_leaves(middle) {
                between.push((shaded, [from, to].map(|end| looked_at[end as usize])));
            }
        }
    }
    between.sort_unstable();
    between.dedup_by_key(|(sample, _)| *sample);
    between
}

/// Samples with the leaves whose triangles use them, ascending, each pair once.
fn leaves_of_samples(mesh: &Mesh, table: &SampleTable) -> Vec<(u32, u32)> {
    let of_triangle = |(triangle, samples): (&MeshTriangle, &[u32; 6])| samples.map(|sample| (sample, triangle.leaf));
    let mut pairs: Vec<(u32, u32)> = mesh.triangles.iter().zip(&table.triangles).flat_map(of_triangle).collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    pairs
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::DVec3;
    use solver::{SolveOptions, solve};

    use super::*;
    use crate::testing::scene_of;
    use crate::{edge_table, leaf_meshes, sample_table};

    fn square(corner: DVec3, side: f64) -> Vec<DVec3> {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner + DVec3::new(x, y, 0.0) * side).to_vec()
    }

    /// 420 small squares beside a large one, so that light is found by rays: over the small ones what is linear is reproduced
    /// at every sample, by looks within them; the large one is looked at where it is asked.
    #[test]
    fn small_leaves_reproduce_what_is_linear_and_large_ones_are_asked_themselves() {
        let small = (0..420).map(|i| square(DVec3::new(f64::from(i % 21), f64::from(i / 21), 0.0) * 0.01, 0.01));
        let scene = scene_of(&small.chain([square(DVec3::new(0.0, 0.0, -5.0), 10.0)]).collect::<Vec<_>>());
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        assert_eq!(solution.visibility, Visibility::Rays);
        let leaf = |polygon, element| Leaf {
            element,
            polygon,
            outline: solution.elements.outline(element).to_vec(),
            segments: Vec::new(),
        };
        let of_polygon = |polygon| solution.leaves_of(polygon).into_iter().map(move |element| leaf(polygon, element));
        let leaves: Vec<Leaf> = scene.polygon_ids().flat_map(of_polygon).collect();
        let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
        let table = sample_table(&scene, &leaves, &mesh, &|_, _| solver::Contact::None);
        let looked_at: Vec<u32> = (0..table.queries.len() as u32).collect();
        let stand_ins = StandIns::new(&scene, &solution, &leaves, &mesh, (&table, &looked_at));
        let light = |position: DVec3| Rgb::new(1.0, 2.0, 3.0) * (1.0 + position.x + 2.0 * position.y);
        let looked: Vec<Vec3> = stand_ins.queries.iter().map(|query| light(query.position).as_vec3()).collect();
        let samples = stand_ins.of_samples(&table, &looked, |_| 0.0);
        for (sample, query) in samples.iter().zip(&table.queries) {
            // Looks are rounded to f32, and a plane goes on a little past them.
            let exact = light(query.position);
            let rounding = 8.0 * f64::from(f32::EPSILON) * exact.max_element();
            assert!((sample.as_dvec3() - exact).abs().max_element() < rounding);
        }
        let asked = |polygon: u32| stand_ins.queries.iter().filter(|query| query.polygon == polygon).count();
        assert_eq!(asked(7), 4);
        assert_eq!(asked(420), table.queries.iter().filter(|query| query.polygon == 420).count());
    }

    /// Two triangles with a common edge, samples 0 to 8; all but sample 8, on a large leaf too, are looked at by another.
    #[test]
    fn what_is_looked_at_between_corners_is_the_mean_of_both() {
        let triangles = vec![[0, 1, 2, 3, 4, 5], [4, 3, 2, 6, 7, 8]];
        let table = SampleTable { queries: Vec::new(), triangles };
        let looked_at: Vec<u32> = (10..19).collect();
        let between = between_corners(&table, &looked_at, |sample| sample != 8);
        let [own, common, other] = [(11, [10, 12]), (13, [12, 14]), (15, [14, 10])];
        assert_eq!(between, [own, common, other, (16, [12, 17])]);
        assert_eq!(between_corners(&table, &(0..9).collect::<Vec<u32>>(), |_| true), []);
        let stand_ins =
            StandIns { told: vec![Told::Look(0), Told::Aside(0), Told::Between([0, 1])], ..StandIns::default() };
        let query =
            SampleQuery { position: DVec3::ZERO, polygon: 0, element: 0, inward: Vec3::ZERO, cosine: Cosine::Own };
        let table = SampleTable { queries: vec![query; 3], triangles: Vec::new() };
        let samples = stand_ins.of_samples(&table, &[Vec3::splat(3.0), Vec3::ONE], |_| 0.0);
        assert_eq!(samples, [3.0, 5.0, 4.0].map(Vec3::splat));
    }
}
