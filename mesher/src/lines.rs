//! The discontinuities that leaves may follow: those of whole polygons where links tell them, and those that are looked for in a
//! leaf once its light is found wanting.
//!
//! In a scene without links nothing is known of what stands between a polygon and a lamp before a leaf has asked. Then few
//! things do, and of those leaves that are wanting each looks for its own lines. What is on its border its neighbour need not
//! know: the edge table gives both the same vertices.

use std::collections::HashMap;
use std::ops::Range;

use rayon::prelude::*;
use scene::{HalfEdges, Scene};
use solver::{Gather, NodeId, Shafts, Solution};

use crate::critical_surface::diameter;
use crate::discontinuity::{Discontinuity, discontinuities, discontinuities_within};
use crate::weight::Weight;

/// All lines that are known.
pub(crate) struct Lines {
    half_edges: HalfEdges,
    all: Vec<Discontinuity>,
    /// By polygon, which of them are its own.
    of_polygons: Vec<Range<u32>>,
    /// By element, which were found in it, and the emitters whose lines were looked for.
    of_elements: HashMap<NodeId, (Range<u32>, Vec<u32>)>,
    /// Events so far that were found in elements.
    events: u32,
}

impl Lines {
    /// The lines on every polygon that its links ask for, from a least weight on: without one none are known yet.
    pub fn of_links(scene: &Scene, solution: &Solution, weight: Weight, min_weight: Option<f64>) -> Self {
        let half_edges = HalfEdges::new(scene);
        let on = |receiver: u32| {
            let Some(min_weight) = min_weight else { return Vec::new() };
            let interactions = solution.interactions(scene, receiver);
            discontinuities(scene, &half_edges, receiver, &interactions, weight, min_weight)
        };
        let found: Vec<Vec<Discontinuity>> = scene.polygon_ids().into_par_iter().map(on).collect();
        let mut all = Vec::new();
        let of_polygons = found.into_iter().map(|lines| appended(&mut all, lines)).collect();
        Self { half_edges, all, of_polygons, of_elements: HashMap::new(), events: 0 }
    }

    /// All lines, in the order in which they were found.
    pub fn all(&self) -> &[Discontinuity] {
        &self.all
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        size_of_val(self.all.as_slice())
    }

    /// Indices of the lines that may cross an element of a polygon.
    pub fn on(&self, solution: &Solution, polygon: u32, element: NodeId) -> impl Iterator<Item = u32> {
        let within = solution.elements.ancestors(element).filter_map(|node| self.of_elements.get(&node));
        self.of_polygons[polygon as usize].clone().chain(within.flat_map(|(lines, _)| lines.clone()))
    }

    /// Looks for the lines of light from emitters in leaves, given ascending with their shafts, as far as that was not done
    /// before. The least weight depends on the leaf, and on its diameter, metres.
    pub fn search(
        &mut self,
        scene: &Scene,
        (solution, gather): (&Solution, &Gather<'_>),
        leaves: &mut [(NodeId, Shafts)],
        weight: Weight,
        min_weight: impl Fn(NodeId, f64) -> f64 + Sync,
    ) {
        let elements = &solution.elements;
        let found: Vec<(Vec<Discontinuity>, Vec<u32>)> = leaves
            .par_iter_mut()
            .map(|(leaf, shafts)| {
                let (Some(polygon), outline) = (elements.polygon_of(*leaf), elements.outline(*leaf)) else {
                    return (Vec::new(), Vec::new());
                };
                let is_known = |source: &u32| {
                    let mut above = elements.ancestors(*leaf).filter_map(|node| self.of_elements.get(&node));
                    above.any(|(_, sources)| sources.contains(source))
                };
                let mut interactions = gather.strong_emitters(*leaf, shafts);
                interactions.retain(|interaction| !is_known(&interaction.source));
                let (receiver, min_weight) = ((polygon, outline), min_weight(*leaf, diameter(outline)));
                let lines =
                    discontinuities_within(scene, &self.half_edges, receiver, &interactions, weight, min_weight);
                (lines, interactions.iter().map(|interaction| interaction.source).collect())
            })
            .collect();
        for ((leaf, _), (mut lines, sources)) in leaves.iter().zip(found) {
            // Events are told apart within a leaf, whose lines were found in more than one search.
            let events = lines.iter().map(|line| line.event + 1).max().unwrap_or(0);
            lines.iter_mut().for_each(|line| line.event += self.events);
            self.events += events;
            let range = appended(&mut self.all, lines);
            if !sources.is_empty() {
                self.of_elements.insert(*leaf, (range, sources));
            }
        }
    }
}

/// Appends lines; their indices.
fn appended(all: &mut Vec<Discontinuity>, lines: Vec<Discontinuity>) -> Range<u32> {
    let first = all.len() as u32;
    all.extend(lines);
    first..all.len() as u32
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use scene::{Material, Rgb};
    use solver::{SolveOptions, Surroundings, solve};

    use super::*;
    use crate::testing::scene_of;
    use crate::{RankedLine, rank};

    fn square(x: f64, y: f64, z: f64, half: f64) -> Vec<DVec3> {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(u, v)| DVec3::new(x + u * half, y + v * half, z)).to_vec()
    }

    /// A plate between a floor and a lamp; and tiles far below that see none of the three, but are too many to be linked.
    fn plate_over_floor() -> Scene {
        let mut outlines = vec![square(0.0, 0.0, 0.0, 2.0), square(0.1, 0.0, 2.0, 0.3), square(0.3, 0.2, 1.0, 0.4)];
        outlines[1].reverse();
        outlines.extend((0..400).map(|i| square(f64::from(i % 20) * 0.2, f64::from(i / 20) * 0.2, -3.0, 0.05)));
        let mut scene = scene_of(&outlines);
        scene.materials.push(Material { radiance: Rgb::splat(100.0), ..scene.materials[0].clone() });
        scene.polygons[1].material = 1;
        scene
    }

    #[test]
    fn without_links_nothing_is_known_until_leaves_look_for_it() {
        let scene = plate_over_floor();
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let mut lines = Lines::of_links(&scene, &solution, Weight::Ratio, Some(0.0));
        assert!(lines.all().is_empty());
        lines.search(
            &scene,
            (&solution, &Gather::new(&Surroundings::new(&scene, &solution), &solution)),
            &mut [],
            Weight::Ratio,
            |_, _| 0.0,
        );
        assert!(lines.all().is_empty());
        assert!(scene.polygon_ids().all(|polygon| {
            solution.leaves_of(polygon).into_iter().all(|leaf| lines.on(&solution, polygon, leaf).next().is_none())
        }));
    }

    /// What a leaf finds is what a search over the whole floor has in it; its parts have it too, and do not look again.
    #[test]
    fn a_leaf_finds_its_part_of_its_polygons_lines() {
        let scene = plate_over_floor();
        let mut solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let half_edges = HalfEdges::new(&scene);
        let interaction = solver::Interaction {
            source: 1,
            far_outline: None,
            radiosity: 100.0 * std::f64::consts::PI,
            blockers: vec![2],
        };
        let whole = discontinuities(&scene, &half_edges, 0, &[interaction], Weight::Ratio, 0.0);
        let ranked = |outline: &[DVec3], all: &[Discontinuity], candidates: Vec<u32>| {
            rank(&scene, outline, all, candidates, Weight::Ratio, usize::MAX)
        };
        let mut lines = Lines::of_links(&scene, &solution, Weight::Ratio, Some(0.0));
        let leaves = solution.leaves_of(0);
        let mut crossed = Vec::new();
        for &leaf in &leaves {
            let known = lines.all().len();
            let surroundings = Surroundings::new(&scene, &solution);
            let gather = Gather::with_source_error(&surroundings, &solution, 1e-3);
            let mut asked = [(leaf, Shafts::default())];
            lines.search(&scene, (&solution, &gather), &mut asked, Weight::Ratio, |_, _| 0.0);
            let outline = solution.elements.outline(leaf);
            let found = ranked(outline, lines.all(), lines.on(&solution, 0, leaf).collect());
            let expected = ranked(outline, &whole, (0..whole.len() as u32).collect());
            assert_eq!(found.len(), expected.len(), "{outline:?}");
            for line in found {
                let is_same = |other: &RankedLine| {
                    let [from, to] = other.ends;
                    [[from, to], [to, from]].iter().any(|ends| (0..2).all(|i| ends[i].distance(line.ends[i]) < 1e-9))
                };
                assert!(expected.iter().any(is_same), "{line:?} {expected:?}");
            }
            if lines.all().len() > known {
                crossed.push(leaf);
            }
        }
        assert!(crossed.len() > 4 && crossed.len() < leaves.len());
        let (leaf, known) = (crossed[0], lines.all().len());
        solution.subdivide(leaf);
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::with_source_error(&surroundings, &solution, 1e-3);
        let mut parts: Vec<(NodeId, Shafts)> =
            solution.elements.children(leaf).map(|part| (part, Shafts::default())).collect();
        lines.search(&scene, (&solution, &gather), &mut parts, Weight::Ratio, |_, _| 0.0);
        assert_eq!(lines.all().len(), known);
        assert!(parts.iter().all(|(part, _)| lines.on(&solution, 0, *part).eq(lines.on(&solution, 0, leaf))));
    }

    /// A plate under the sun casts lines where the rim of its disc passes the plate's border, and no others.
    #[test]
    fn a_sun_casts_lines() {
        let sky = scene::CieSky::new(5, [0.0, std::f64::consts::FRAC_PI_2], 100.0).expect("a sun at the zenith");
        let environment =
            scene::Environment { sky: scene::Sky::Cie(sky), up: scene::UpAxis::Z, rotation: 0.0, scale: 1.0 };
        let outlines = [square(0.0, 0.0, 0.0, 2.0), square(0.3, 0.2, 1.0, 0.4)];
        let scene = Scene { environment: Some(environment), ..scene_of(&outlines) };
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::with_source_error(&surroundings, &solution, 1e-3);
        let mut lines = Lines::of_links(&scene, &solution, Weight::Change, None);
        let mut leaves: Vec<(NodeId, Shafts)> =
            solution.leaves_of(0).into_iter().map(|leaf| (leaf, Shafts::default())).collect();
        lines.search(&scene, (&solution, &gather), &mut leaves, Weight::Change, |_, _| 0.0);
        // How far outside of the plate's picture on the floor a place is.
        let outside = |place: DVec3| ((place.x - 0.3).abs().max((place.y - 0.2).abs())) - 0.4;
        let penumbra = 1.01 * scene::SUN_RADIUS;
        let ends = || lines.all().iter().flat_map(|line| line.ends);
        assert!(lines.all().len() > 8 && lines.all().iter().all(|line| line.source as usize >= scene.polygons.len()));
        assert!(ends().all(|end| outside(end).abs() < penumbra));
        for half in [-penumbra..0.0, 0.0..penumbra] {
            assert!(ends().any(|end| half.contains(&outside(end))), "both borders of the penumbra");
        }
    }
}
