//! Stand-ins: where light over reflectors is looked at in place of the samples of a mesh, and how much of each look a sample is.

use glam::DVec3;
use scene::{Rgb, Scene};
use solver::{Cosine, SMALL_LEAF, Solution, Visibility, principal_axes};

use crate::{Leaf, Mesh, SampleQuery, SampleTable};

/// How far from a contact its stand-ins lie, as parts of the way to the middle of the element. Nearer ones feel more of what
/// is special to the contact, farther ones miss more of what curves.
const ASIDE: f64 = 0.07;

/// What is looked at for the samples of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StandIns {
    /// Where light is looked at. Those of one element stand together.
    pub queries: Vec<SampleQuery>,
    /// By sample the first of its shares, and their number at the end.
    first: Vec<usize>,
    /// Number of a query, and how many times its light counts.
    shares: Vec<(u32, f64)>,
    /// Samples without shares, each with the two that it is the mean of.
    between: Vec<(u32, [u32; 2])>,
}

/// Light over a small leaf as a plane: through what it is at two places or four, about the middle along the leaf's principal
/// axes. The two along an axis are those of Gauss' rule of two points over a rectangle, and lie within any convex outline.
struct LeafPlane {
    /// The first of its queries; those of an axis follow each other.
    first: u32,
    centre: DVec3,
    /// One axis, or two: from the middle to the first place.
    axes: Vec<DVec3>,
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
        let planes: Vec<Option<LeafPlane>> = leaves
            .iter()
            .map(|leaf| {
                let is_small = solution.elements.nodes[leaf.element as usize].area < small;
                is_small.then(|| stand_ins.look_within(solution, leaf)).flatten()
            })
            .collect();
        let leaves_of = leaves_of_samples(mesh, table);
        let around = |sample: usize| -> Option<Vec<&LeafPlane>> {
            leaves_of[sample].iter().map(|&leaf| planes[leaf as usize].as_ref()).collect()
        };
        stand_ins.between = between_corners(table, looked_at, |sample| around(sample as usize).is_some());
        for (sample, query) in table.queries.iter().enumerate() {
            stand_ins.first.push(stand_ins.shares.len());
            if stand_ins.between.binary_search_by_key(&(sample as u32), |(sample, _)| *sample).is_ok() {
                continue;
            }
            match around(sample) {
                Some(around) if !around.is_empty() => {
                    let part = 1.0 / around.len() as f64;
                    around.into_iter().for_each(|plane| plane.share(query.position, part, &mut stand_ins.shares));
                }
                _ => stand_ins.look_at(solution, query),
            }
        }
        stand_ins.first.push(stand_ins.shares.len());
        stand_ins
    }

    /// The samples' light, from that at the queries; never negative.
    pub fn of_samples(&self, looked: &[Rgb]) -> Vec<Rgb> {
        let sample = |range: &[usize]| {
            let shares = self.shares[range[0]..range[1]].iter();
            shares.map(|&(query, part)| looked[query as usize] * part).sum::<Rgb>().max(Rgb::ZERO)
        };
        let mut samples: Vec<Rgb> = self.first.windows(2).map(sample).collect();
        for &(sample, [from, to]) in &self.between {
            samples[sample as usize] = (samples[from as usize] + samples[to as usize]) / 2.0;
        }
        samples
    }

    /// Looks at a sample: at its own place, or at a contact at two places aside.
    ///
    /// At a contact the slope of the light over reflectors is infinite (it goes with d ln d at the distance d), and an
    /// interpolant through the limit is off over all of the leaf. One through what the light is a little aside, continued in a
    /// straight line, is off in a strip.
    fn look_at(&mut self, solution: &Solution, query: &SampleQuery) {
        let number = self.queries.len() as u32;
        if query.inward == DVec3::ZERO {
            self.queries.push(*query);
            self.shares.push((number, 1.0));
            return;
        }
        let centre = solution.elements.nodes[query.element as usize].centre;
        let aside =
            |part: f64| SampleQuery { position: query.position.lerp(centre, part), inward: DVec3::ZERO, ..*query };
        self.queries.extend([aside(ASIDE), aside(2.0 * ASIDE)]);
        self.shares.extend([(number, 2.0), (number + 1, -1.0)]);
    }

    /// Looks at places within a leaf. None if it has no extent.
    fn look_within(&mut self, solution: &Solution, leaf: &Leaf) -> Option<LeafPlane> {
        let patch = solution.elements.patch_of(leaf.element)?;
        let (centre, axes) = principal_axes(&leaf.outline, &solution.elements.patches[patch as usize])?;
        let first = self.queries.len() as u32;
        let Leaf { polygon, element, .. } = *leaf;
        let query = |position| SampleQuery { position, polygon, element, inward: DVec3::ZERO, cosine: Cosine::Own };
        self.queries.extend(axes.iter().flat_map(|&axis| [query(centre + axis), query(centre - axis)]));
        Some(LeafPlane { first, centre, axes })
    }
}

impl LeafPlane {
    /// Adds what the plane is at a position, times `part`.
    fn share(&self, position: DVec3, part: f64, shares: &mut Vec<(u32, f64)>) {
        let even = part / (2 * self.axes.len()) as f64;
        for (query, axis) in (self.first..).step_by(2).zip(&self.axes) {
            let slope = part * axis.dot(position - self.centre) / (2.0 * axis.length_squared());
            shares.extend([(query, even + slope), (query + 1, even - slope)]);
        }
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

/// By sample, the leaves whose triangles use it, ascending.
fn leaves_of_samples(mesh: &Mesh, table: &SampleTable) -> Vec<Vec<u32>> {
    let mut leaves: Vec<Vec<u32>> = vec![Vec::new(); table.queries.len()];
    for (triangle, samples) in mesh.triangles.iter().zip(&table.triangles) {
        for &sample in samples {
            let leaves = &mut leaves[sample as usize];
            if leaves.last() != Some(&triangle.leaf) {
                leaves.push(triangle.leaf);
            }
        }
    }
    leaves
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;
    use solver::{Patch, SolveOptions, solve};

    use super::*;
    use crate::testing::scene_of;
    use crate::{edge_table, leaf_meshes, sample_table};

    fn patch() -> Patch {
        Patch { polygon: 0, root: 0, origin: DVec3::ZERO, u: DVec3::X, v: DVec3::Y }
    }

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
        let looked: Vec<Rgb> = stand_ins.queries.iter().map(|query| light(query.position)).collect();
        let samples = stand_ins.of_samples(&looked);
        for (sample, query) in samples.iter().zip(&table.queries) {
            assert!((*sample - light(query.position)).abs().max_element() < 1e-12);
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
        let stand_ins = StandIns {
            first: vec![0, 1, 2, 2],
            shares: vec![(0, 1.0), (1, 1.0)],
            between: vec![(2, [0, 1])],
            ..StandIns::default()
        };
        assert_eq!(stand_ins.of_samples(&[Rgb::ONE, Rgb::splat(3.0)]), [1.0, 3.0, 2.0].map(Rgb::splat));
    }

    /// Angles at which corners lie on a circle.
    fn angles() -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(0.0..std::f64::consts::TAU, 3..9)
    }

    proptest! {
        #[test]
        fn looks_lie_within_convex_outlines(mut angles in angles(), squeeze in 0.05..1.0f64) {
            angles.sort_by(f64::total_cmp);
            let outline: Vec<DVec3> =
                angles.iter().map(|angle| DVec3::new(angle.cos(), angle.sin() * squeeze, 2.0)).collect();
            let Some((centre, axes)) = principal_axes(&outline, &patch()) else { return Ok(()) };
            for place in axes.iter().flat_map(|&axis| [centre + axis, centre - axis]) {
                for (i, &corner) in outline.iter().enumerate() {
                    let edge = outline[(i + 1) % outline.len()] - corner;
                    prop_assert!(edge.cross(place - corner).z > -1e-9);
                }
            }
        }
    }
}
