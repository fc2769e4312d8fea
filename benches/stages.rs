//! The stages of a bake one by one, each over sizes or tolerances: how their cost grows says more than a single figure.
//!
//! `cargo bench --bench stages` prints a table; `cargo bench --bench stages -- fit` one part of it.

#![allow(clippy::unwrap_used)]

mod common;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::DVec3;
use mesher::{Leaf, LeafSegment, edge_table, leaf_meshes};
use scene::{Interpolant, Material, Polygon, Rgb, SAMPLE_BARYCENTRICS, Scene, centroid};
use solver::{Gather, SolveOptions, Surroundings, form_factor, form_factor_at, solve};

fn main() {
    divan::main();
}

/// Rooms of growing size: their names, and how many copies of each stand side by side.
const ROOMS: [(&str, u32); 3] = [("cornell_box", 1), ("office", 1), ("office", 4)];

fn room((name, copies): (&str, u32)) -> Scene {
    let one = formats::read_scene(&common::file(&format!("data/scenes/{name}.obj"))).unwrap().scene;
    let (low, high) = one.bounds();
    // Walls are thin: the rooms stand a metre apart.
    let step = DVec3::X * (high.x - low.x + 1.0);
    let mut all = one.clone();
    for copy in 1..copies {
        let (first_vertex, first_corner) = (all.vertices.len() as u32, all.corners.len() as u32);
        all.vertices.extend(one.vertices.iter().map(|&vertex| vertex + step * f64::from(copy)));
        all.corners.extend(one.corners.iter().map(|corner| first_vertex + corner));
        all.polygons.extend(
            one.polygons
                .iter()
                .map(|polygon| Polygon { first_corner: first_corner + polygon.first_corner, ..*polygon }),
        );
    }
    all
}

/// Exact irradiance at the middle of leaves, per point; the gather's own preparation for its leaf is part of it.
mod point_irradiance {
    use super::*;

    /// Leaves that are looked at, spread over all.
    const LEAVES: usize = 64;

    #[divan::bench(args = ROOMS, sample_count = 20)]
    fn direct_light(bencher: Bencher<'_, '_>, name: (&str, u32)) {
        gather(bencher, name, Some(0));
    }

    #[divan::bench(args = ROOMS, sample_count = 20)]
    fn all_light(bencher: Bencher<'_, '_>, name: (&str, u32)) {
        gather(bencher, name, None);
    }

    fn gather(bencher: Bencher<'_, '_>, name: (&str, u32), bounces: Option<u32>) {
        let scene = room(name);
        let solution = solve(&scene, &SolveOptions { bounces, ..SolveOptions::default() }, &|_| ());
        let all: Vec<_> = scene.polygon_ids().flat_map(|polygon| solution.leaves_of(polygon)).collect();
        let leaves: Vec<_> = (0..LEAVES).map(|i| all[i * all.len() / LEAVES]).collect();
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        bencher.counter(ItemsCount::new(LEAVES)).bench(|| {
            let irradiance =
                |&leaf: &u32| gather.over(leaf).irradiance(centroid(solution.elements.outline(leaf)), DVec3::X);
            leaves.iter().map(irradiance).sum::<Rgb>()
        });
    }
}

/// Cuts, links and transport of direct and reflected light, by the error of a link as a multiple of the default.
mod link_refinement {
    use super::*;

    #[divan::bench(args = [8.0, 2.0, 0.5], sample_count = 5)]
    fn cornell_box(bencher: Bencher<'_, '_>, coarseness: f64) {
        refine(bencher, ("cornell_box", 1), coarseness);
    }

    #[divan::bench(args = [8.0, 2.0, 0.5], sample_count = 3)]
    fn office(bencher: Bencher<'_, '_>, coarseness: f64) {
        refine(bencher, ("office", 1), coarseness);
    }

    #[divan::bench(args = [8.0, 2.0], sample_count = 2)]
    fn four_offices(bencher: Bencher<'_, '_>, coarseness: f64) {
        refine(bencher, ("office", 4), coarseness);
    }

    fn refine(bencher: Bencher<'_, '_>, name: (&str, u32), coarseness: f64) {
        let scene = room(name);
        let default = solve(&scene, &SolveOptions::default(), &|_| ()).link_error;
        let options = SolveOptions { link_error: Some(coarseness * default), ..SolveOptions::default() };
        bencher.bench(|| solve(&scene, &options, &|_| ()));
    }
}

/// Edge table and triangulation of a square metre of leaves, per leaf, by the discontinuities that cross each.
mod leaf_meshing {
    use super::*;

    /// Leaves along each side of the square.
    const SIDE: u32 = 16;

    #[divan::bench(args = [0, 3, 10, 20], sample_count = 10)]
    fn edges(bencher: Bencher<'_, '_>, lines: u32) {
        let (scene, leaves) = (square(), leaves(lines));
        bencher.counter(ItemsCount::new(leaves.len())).bench(|| edge_table(&scene, &[], &leaves));
    }

    #[divan::bench(args = [0, 3, 10, 20], sample_count = 10)]
    fn triangles(bencher: Bencher<'_, '_>, lines: u32) {
        let table = edge_table(&square(), &[], &leaves(lines));
        bencher.counter(ItemsCount::new(SIDE * SIDE)).bench(|| leaf_meshes(&table));
    }

    fn square() -> Scene {
        Scene {
            vertices: outline(DVec3::ZERO, 1.0),
            corners: (0..4).collect(),
            polygons: vec![Polygon { first_corner: 0, corner_count: 4, material: 0, object: 0 }],
            materials: vec![Material::grey("floor")],
            objects: vec!["floor".to_owned()],
            ..Scene::default()
        }
    }

    fn outline(corner: DVec3, side: f64) -> Vec<DVec3> {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner + side * DVec3::new(x, y, 0.0)).to_vec()
    }

    /// Leaves crossed by chords from one side of theirs to the opposite one, so that many chords cross each other.
    fn leaves(lines: u32) -> Vec<Leaf> {
        let side = 1.0 / f64::from(SIDE);
        let leaf = |element: u32| {
            let corner = side * DVec3::new(f64::from(element % SIDE), f64::from(element / SIDE), 0.0);
            let segments = (0..lines).map(|i| {
                let line = element * lines + i;
                // Multiples of irrational numbers: spread evenly, and the same in every run.
                let [a, b] = [0.618_033_988_75, 0.414_213_562_37].map(|step| (f64::from(line + 1) * step).fract());
                let ends = if i % 2 == 0 { [(a, 0.0), (b, 1.0)] } else { [(0.0, a), (1.0, b)] };
                LeafSegment { ends: ends.map(|(x, y)| corner + side * DVec3::new(x, y, 0.0)), line }
            });
            Leaf { element, polygon: 0, outline: outline(corner, side), segments: segments.collect() }
        };
        (0..SIDE * SIDE).map(leaf).collect()
    }
}

/// Quadratics through their samples and their values, per triangle, from what a cache holds to what it does not.
mod fit {
    use super::*;

    fn triangles(count: usize) -> Vec<[Rgb; 6]> {
        let value = |i: usize| Rgb::splat((i as f64 * 0.618_033_988_75).fract());
        (0..count).map(|triangle| [0, 1, 2, 3, 4, 5].map(|sample| value(6 * triangle + sample))).collect()
    }

    #[divan::bench(args = [1_000, 100_000])]
    fn through(bencher: Bencher<'_, '_>, count: usize) {
        let samples = triangles(count);
        bencher
            .counter(ItemsCount::new(count))
            .bench(|| samples.iter().map(|&samples| Interpolant::through(samples)).collect::<Vec<_>>());
    }

    #[divan::bench(args = [1_000, 100_000])]
    fn evaluate(bencher: Bencher<'_, '_>, count: usize) {
        let fitted: Vec<Interpolant> = triangles(count).into_iter().map(Interpolant::through).collect();
        let places = SAMPLE_BARYCENTRICS.iter().cycle();
        bencher
            .counter(ItemsCount::new(count))
            .bench(|| fitted.iter().zip(places.clone()).map(|(fitted, &(s, t))| fitted.evaluate(s, t)).sum::<Rgb>());
    }
}

/// Form factors of two unit squares that face each other at a right angle, by their distance, metres: 0 is an edge that
/// both have.
mod form_factors {
    use super::*;

    const DISTANCES: [f64; 5] = [0.0, 0.01, 0.1, 1.0, 10.0];

    fn floor() -> [DVec3; 4] {
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]
    }

    fn wall(distance: f64) -> [DVec3; 4] {
        [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(y, z)| DVec3::new(-distance, y, z))
    }

    #[divan::bench(args = DISTANCES)]
    fn between_polygons(bencher: Bencher<'_, '_>, distance: f64) {
        let (floor, wall) = (floor(), wall(distance));
        bencher.bench(|| form_factor(black_box(&floor), black_box(&wall)));
    }

    #[divan::bench(args = DISTANCES)]
    fn at_a_point(bencher: Bencher<'_, '_>, distance: f64) {
        let (position, wall) = (DVec3::new(0.01, 0.4, 0.0), wall(distance));
        bencher.bench(|| form_factor_at(black_box(position), DVec3::Z, black_box(&wall)));
    }
}
