//! What a mesh gets wrong on a leaf, by probes: what is beyond what rays scatter by.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use scene::Rgb;
use solver::{Cosine, Fan, NodeId, Solution, Surroundings, Visibility};

use crate::probe::colour_mean;
use crate::{SampleQuery, SampleTable};

/// Probes of a leaf at most, where rays find the light: one for as much area as all leaves have on average, and as many in all as twice
/// the leaves at most. More on leaves that are larger than others miss less of what lies in them, which makes up most of
/// the error where they are wrong: a ceiling right over small lamps.
const MOST_PROBES: f64 = 16.0;

/// Where the probe of an element lies in a scene with links, by parts of its centre and two corners: off all lines of symmetry, on
/// which an interpolant may be right by chance.
const BETWEEN: [f64; 3] = [0.6, 0.3, 0.1];

/// How far from a contact one more probe lies, as a part of the way to the middle of the leaf. Nearer ones see a crevice that no
/// division mends, farther ones miss what is special to the contact.
const BESIDE: f64 = 0.15;

/// Probes below what stands over a leaf, at most. One finds a lamp under a ceiling, whose leaves are larger than what it darkens;
/// where more stands over a leaf its parts have one each.
const FEET: usize = 1;

/// How many times the square of what is expected rays are believed to scatter by at most: more, and it is not scatter that all
/// leaves are off by.
const MOST_SCATTER: f64 = 6.0;

/// Standard deviations of what rays scatter by beyond which a difference is an error. Less divides leaves for nothing, again
/// and again.
const BEYOND_CHANCE: f64 = 2.5;

/// What the coarse mesh gets wrong on one leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeafError {
    /// The element.
    pub element: NodeId,
    /// Root mean square over the colours, at points that nothing was fitted to, W·m⁻².
    pub error: f64,
    /// The mean of the exact light over reflectors there, averaged over the colours, W·m⁻².
    pub irradiance: f64,
}

/// What the probes of a leaf found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProbedLeaf {
    element: NodeId,
    /// Their number, and the mean of the exact light over reflectors at them, averaged over the colours, W·m⁻².
    count: f64,
    irradiance: f64,
    /// Mean square of what the mesh is off by, and what is expected of it for what rays scatter by alone.
    square: f64,
    scatter: f64,
}

impl ProbedLeaf {
    /// From what the mesh says at each probe, and what is exact, W·m⁻². `scatter` is what rays at a point are taken to be off
    /// by, relative to the light over reflectors.
    pub fn new(element: NodeId, probes: &[[Rgb; 2]], scatter: f64) -> Self {
        let count = probes.len() as f64;
        let irradiance = probes.iter().map(|[_, exact]| colour_mean(*exact)).sum::<f64>() / count;
        let square = |[baked, exact]: &[Rgb; 2]| colour_mean((baked - exact) * (baked - exact));
        Self {
            element,
            count,
            irradiance,
            square: probes.iter().map(square).sum::<f64>() / count,
            // A probe scatters, and so do the samples about it.
            scatter: 2.0 * (scatter * irradiance).powi(2),
        }
    }
}

/// The errors of leaves that have been probed.
pub(crate) fn leaf_errors(leaves: &[ProbedLeaf]) -> Vec<LeafError> {
    let more = more_scatter(leaves);
    let error = |leaf: &ProbedLeaf| {
        let chance = 1.0 + (BEYOND_CHANCE.powi(2) - 1.0) / leaf.count.sqrt();
        let error = (leaf.square - chance * more * leaf.scatter).max(0.0).sqrt();
        LeafError { element: leaf.element, error, irradiance: leaf.irradiance }
    };
    leaves.iter().map(error).collect()
}

/// How many times as much as expected rays scatter, as a square, by half of all leaves: few are wanting, all scatter. What
/// rays scatter by no division mends.
fn more_scatter(leaves: &[ProbedLeaf]) -> f64 {
    /// The median of the square of a normal deviate.
    const MEDIAN: f64 = 0.455;
    let mut times: Vec<f64> =
        leaves.iter().filter(|leaf| leaf.scatter > 0.0).map(|leaf| leaf.square / leaf.scatter / MEDIAN).collect();
    let middle = times.len() / 2;
    if times.is_empty() {
        return 1.0;
    }
    times.select_nth_unstable_by(middle, f64::total_cmp).1.clamp(1.0, MOST_SCATTER)
}

/// The points at which elements are probed, in their order: one each, and in a scene whose light is found by rays more on
/// large ones and one more beside a contact, where most of what is wrong is. `table` has the samples of a mesh of the
/// elements.
pub(crate) fn leaf_probes(
    surroundings: &Surroundings<'_>,
    solution: &Solution,
    elements: &[NodeId],
    table: &SampleTable,
) -> Vec<SampleQuery> {
    let area = surroundings.scene.surface_area() / elements.len() as f64;
    let nodes = &solution.elements.nodes;
    let count = |element: NodeId| match solution.visibility {
        Visibility::Links => 1,
        Visibility::Rays => (nodes[element as usize].area / area).ceil().clamp(1.0, MOST_PROBES) as u32,
    };
    let mut contacts: HashMap<NodeId, Vec<DVec3>> = HashMap::new();
    if solution.visibility == Visibility::Rays {
        for query in table.queries.iter().filter(|query| query.inward != Vec3::ZERO) {
            contacts.entry(query.element).or_default().push(query.position);
        }
    }
    let beside = |element: NodeId| {
        let positions = contacts.get(&element)?;
        let position = positions[element as usize % positions.len()].lerp(nodes[element as usize].centre, BESIDE);
        Some(SampleQuery { position, ..probe(solution, element, 0) })
    };

    let below = |element: NodeId| {
        let feet = match solution.visibility {
            Visibility::Links => Vec::new(),
            Visibility::Rays => surroundings.feet(solution, element, FEET),
        };
        feet.into_iter().map(move |position| SampleQuery { position, ..probe(solution, element, 0) })
    };
    let of = |&element: &NodeId| {
        let anywhere = (0..count(element)).map(|i| probe(solution, element, i));
        anywhere.chain(beside(element)).chain(below(element)).collect::<Vec<_>>()
    };
    elements.par_iter().flat_map_iter(of).collect()
}

/// The point number `i` at which an element is probed. It depends on the element alone: a finer neighbour changes the
/// triangles, and what the point sees is known already.
pub(crate) fn probe(solution: &Solution, element: NodeId, i: u32) -> SampleQuery {
    let elements = &solution.elements;
    let outline = elements.outline(element);
    let position = match solution.visibility {
        // It lies towards another edge of each element, so that what all miss is not the same.
        Visibility::Links => {
            let corner = |i: usize| outline[(element as usize + i) % outline.len()];
            let [of_centre, of_corner, of_next] = BETWEEN;
            elements.nodes[element as usize].centre * of_centre + corner(0) * of_corner + corner(1) * of_next
        }
        // There are no lines of discontinuity, and light over small leaves is taken for linear: anywhere may be worst.
        Visibility::Rays => Fan::new(outline).place(DVec2::ZERO, element.wrapping_add(i)),
    };
    let polygon = elements.polygon_of(element).unwrap_or_default();
    SampleQuery { position, polygon, element, inward: Vec3::ZERO, cosine: Cosine::Own }
}

#[cfg(test)]
mod tests {
    use solver::{SolveOptions, solve};

    use super::*;
    use crate::testing::scene_of;

    fn probed(element: NodeId, off: f64) -> ProbedLeaf {
        ProbedLeaf::new(element, &[[Rgb::splat(1.0 + off), Rgb::ONE]], 0.01)
    }

    #[test]
    fn no_leaves_have_no_errors() {
        assert_eq!(leaf_errors(&[]), []);
    }

    #[test]
    fn what_is_exact_is_no_error_and_what_all_are_off_by_is_scatter() {
        // Twice what is expected, of either sign, on most leaves; one is wanting.
        let leaves: Vec<ProbedLeaf> =
            (0..101).map(|i| probed(i, if i == 50 { 0.5 } else { 0.02 * f64::from(i % 3) - 0.02 })).collect();
        let errors = leaf_errors(&leaves);
        assert!(errors.iter().all(|error| (error.error > 0.0) == (error.element == 50)));
        assert!((errors[50].error - 0.5).abs() < 0.02 && errors[50].irradiance == 1.0);
    }

    #[test]
    fn what_all_are_off_by_far_is_error() {
        let errors = leaf_errors(&(0..9).map(|i| probed(i, 0.3)).collect::<Vec<_>>());
        assert!(errors.iter().all(|error| error.error > 0.25), "{errors:?}");
    }

    #[test]
    fn without_scatter_the_error_is_the_root_mean_square() {
        let probes = [[Rgb::splat(1.3), Rgb::ONE], [Rgb::splat(0.6), Rgb::ONE]];
        let error = leaf_errors(&[ProbedLeaf::new(4, &probes, 0.0)])[0];
        assert!((error.error - 0.125f64.sqrt()).abs() < 1e-12);
    }

    /// A large square, and 400 strips of it that something stands on at one end.
    #[test]
    fn large_elements_have_more_probes_and_those_with_contacts_one_beside_them() {
        let rectangle = |x: f64, y: f64, width: f64| {
            [(0.0, 0.0), (width, 0.0), (width, 1.0), (0.0, 1.0)].map(|(u, v)| DVec3::new(x + u, y + v, 0.0)).to_vec()
        };
        let strips = (0..400).map(|i| rectangle(f64::from(i) * 1e-3, 0.0, 1e-3));
        let scene = scene_of(&strips.chain([rectangle(1.0, 1.0, 1.0)]).collect::<Vec<_>>());
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        assert_eq!(solution.visibility, Visibility::Rays);
        let (strip, large) = (solution.leaves_of(7)[0], solution.leaves_of(400)[0]);
        let leaves: Vec<NodeId> = scene.polygon_ids().flat_map(|polygon| solution.leaves_of(polygon)).collect();
        let contact =
            SampleQuery { position: DVec3::new(7e-3, 0.0, 0.0), inward: Vec3::Y, ..probe(&solution, strip, 0) };
        let table = SampleTable { queries: vec![contact], triangles: Vec::new() };
        let count = |table: &SampleTable| {
            let probes = leaf_probes(&Surroundings::new(&scene, &solution), &solution, &leaves, table);
            assert!(probes.len() <= 2 * leaves.len() + table.queries.len());
            assert!(probes.iter().all(|probe| probe.inward == Vec3::ZERO));
            [strip, large].map(|element| probes.iter().filter(|probe| probe.element == element).count())
        };
        let [alone, many] = count(&SampleTable::default());
        assert!(alone < many && many <= MOST_PROBES as usize, "{alone} {many}");
        assert_eq!(count(&table), [alone + 1, many]);
        let probes = leaf_probes(&Surroundings::new(&scene, &solution), &solution, &leaves, &table);
        let of_strip: Vec<&SampleQuery> = probes.iter().filter(|probe| probe.element == strip).collect();
        let beside = of_strip[alone].position;
        assert!(beside.distance(contact.position.lerp(solution.elements.nodes[strip as usize].centre, BESIDE)) < 1e-9);
    }
}
