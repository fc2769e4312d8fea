//! Solution → Baked: rounds of meshing, exchange of light and measurement until the bake keeps its tolerance.
//!
//! After each round (`rounds`) the whole is measured (`residual`, `claimed_error`). Where it misses the tolerance, the next
//! round asks for less. Rounds are global: what is divided depends on the light alone, never on threads.

use glam::Vec3;
use scene::{Answers, Baked, BakedError, Scene};
use solver::{Solution, Surroundings, Visibility};

use crate::claimed_error::{P99, mean_reflectance, measured};
use crate::fine_mesh::{EmittedLight, FineMesh};
use crate::inquiry::Inquiry;
use crate::lines::Lines;
use crate::probe::colour_mean;
use crate::reflected_light::ReflectedLight;
use crate::residual::residual;
use crate::rounds::Rounds;
use crate::{MeshStatistics, Progress, Weight};

/// What a bake is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Relative root mean square error of irradiance that is accepted, and a fifth of the error that is accepted at 99 % of
    /// the area; 0..1.
    pub tolerance: f64,
    /// Discontinuities that a leaf follows at most (k of Hardt & Teller 1996, section 4.2); without links no more than three.
    pub discontinuities: u32,
    /// How discontinuities are weighed.
    pub weight: Weight,
    /// Weight below which a discontinuity is not followed, in the weight's unit (w_min). None takes
    /// [`Weight::default_minimum`], in proportion to the tolerance.
    pub min_weight: Option<f64>,
    /// With more triangles than this a bake is not refined further; the last one with fewer is kept if there is one.
    pub max_triangles: usize,
    /// Bytes that a bake may hold, by the lengths of its tables. Where the next answers would take more, it is stopped with the best
    /// bake so far; the first mesh is counted once it is there, finer ones are foreseen by their leaves.
    pub max_bytes: usize,
}

/// The share of the tolerance that the interpolation of emitters' light, and as much again that of reflectors' light, may use
/// up in the first round, as probes see it. Probes miss what lies between them, and the sum of bounces what each is off by:
/// with more a first round seldom does, with less it takes leaves that nobody asked for.
const FIRST_SHARE: f64 = 0.36;

/// The same in a scene whose reflected light is found by rays: what these scatter by comes on top, and probes of a furnished room
/// miss more.
const FIRST_SHARE_BY_RAYS: f64 = 0.33;

/// What the error is aimed at where a round has missed the tolerance, as a part of the tolerance; and by how much a share
/// shrinks for it at most and at least. Less divides too much, more asks for one round more.
const NEXT_AIM: f64 = 0.85;
const NEXT_SHARE: [f64; 2] = [0.5, 0.9];

/// Rounds at most: by then a share is a small part of the tolerance, and the fault lies elsewhere.
const ROUNDS: u32 = 6;

/// Length of the elements that light over reflectors is found on first, as a fraction of the scene's size. Longer ones miss
/// what lies between their probes, shorter ones cost more than a room needs.
const FRONT_LENGTH: f64 = 0.1;

/// The part of [`BakeOptions::tolerance`] that a row may misplace on account of each reflector, in the first round. What is
/// misplaced has one sign, since a point sees most of what is near and light is mostly brightest in the middle: many
/// reflectors, and many bounces, add up. More is faster where they are few.
const FIRST_SOURCE_SHARE: f64 = 0.12;

/// What that part shrinks by from round to round where the bake as a whole is too dark or too bright by more than `BIAS` of
/// the tolerance.
const NEXT_SOURCE_SHARE: f64 = 0.3;
const BIAS: f64 = 0.25;

/// The error of a bake that was stopped before it was measured.
pub(crate) const UNMEASURED: BakedError =
    BakedError { rms: f64::INFINITY, p99: f64::INFINITY, max: f64::INFINITY, points: 0, holds: false };

impl Default for BakeOptions {
    /// One percent, and the paper's k.
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            discontinuities: 10,
            weight: Weight::default(),
            min_weight: None,
            max_triangles: usize::MAX,
            max_bytes: usize::MAX,
        }
    }
}

/// What is told of a bake while it is made, and asked.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Is told the fraction that is done.
    pub progress: Progress<'a>,
    /// Whether to stop with the best bake so far: asked between rounds.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Whether to stop at once with the best that is known: asked all the time, from any thread.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Is shown the bake as it grows, each time that its mesh or its light has changed: coarse to fine, and with an error once it
    /// is measured. What is shown is a copy: nothing depends on whether anybody looks.
    pub watch: Option<&'a (dyn Fn(Baked) + Sync)>,
}

/// A bake, the solution as it was refined for it, and counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Bake {
    /// The bake; its provenance is left empty.
    pub baked: Baked,
    /// The solution with the elements and the light of the bake.
    pub solution: Solution,
    /// Counts.
    pub statistics: BakeStatistics,
    /// If the bake was interrupted, what it has found out so far, for [`resume`].
    pub answers: Option<Answers>,
}

/// Counts of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BakeStatistics {
    /// Rounds of meshing and measurement.
    pub rounds: u32,
    /// The least weight that was used, in the weight's unit; none where every leaf has its own.
    pub min_weight: Option<f64>,
    /// Discontinuities of at least the least weight that were found, on all polygons or in all leaves that were looked at.
    pub discontinuities_found: usize,
    /// Discontinuities that at least one leaf follows.
    pub discontinuities_kept: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Samples, each evaluated once.
    pub samples: usize,
    /// Points at which reflectors were looked at.
    pub rows: usize,
    /// The most bytes that were held, by the lengths of tables.
    pub bytes: usize,
    /// What the triangulation could not do as planned.
    pub mesh: MeshStatistics,
}

/// Bakes a solved scene.
///
/// A bake that was interrupted, or held too much, is the best one that was measured. If none was, it is the first mesh: with the
/// light that is known, the best guess where none is (`guess`), and an error without a limit.
pub fn bake(scene: &Scene, solution: Solution, options: &BakeOptions, control: Control<'_>) -> Bake {
    resume(scene, solution, options, control, Answers::default())
}

/// Bakes a solved scene of which an interrupted bake has found out something. What comes of it is the same to the bit.
pub fn resume(
    scene: &Scene,
    solution: Solution,
    options: &BakeOptions,
    control: Control<'_>,
    answers: Answers,
) -> Bake {
    let relative = options.tolerance / BakeOptions::default().tolerance;
    let has_links = solution.visibility == Visibility::Links;
    let default_minimum = || relative * options.weight.default_minimum(scene, &solution);
    let min_weight = options.min_weight.or_else(|| has_links.then(default_minimum));
    (control.progress)(0.0);
    let lines = Lines::of_links(scene, &solution, options.weight, min_weight);
    let reflectance = mean_reflectance(scene, &solution);
    // Without links elements are as small as they need to be at first.
    let front = if has_links { FRONT_LENGTH * scene.size() } else { 0.0 };
    let surroundings = Surroundings::new(scene, &solution);
    let mut rounds = Rounds {
        surroundings: &surroundings,
        options,
        watch: control.watch,
        inquiry: Inquiry::new(control, &solution, answers, options.max_bytes),
        emitted: EmittedLight::default(),
        reflected: ReflectedLight::new(&solution, front),
        mean: colour_mean(solution.mean_irradiance),
        lines,
        share: if has_links { FIRST_SHARE } else { FIRST_SHARE_BY_RAYS },
        source_share: FIRST_SOURCE_SHARE,
        reflectance,
        reflected_errors: Vec::new(),
        solution,
    };
    let mut statistics = BakeStatistics { min_weight, ..BakeStatistics::default() };
    let mut without_gain = 0;
    let mut best: Option<(FineMesh, Vec<Vec3>, BakedError)> = None;
    let (fine, samples, error) = loop {
        let fine = rounds.mesh();
        let samples = rounds.samples(&fine);
        let reflecting = &rounds.reflected.reflecting;
        let inquiry = &mut rounds.inquiry;
        let points = residual(&surroundings, &rounds.solution, &fine, &samples, reflecting, options.tolerance, inquiry);
        if inquiry.stopped() {
            break best.unwrap_or((fine, samples, UNMEASURED));
        }
        let (error, bias) = measured(&points, options.tolerance, rounds.reflectance);
        statistics.rounds += 1;
        if let Some(watch) = control.watch {
            watch(rounds.baked(&fine, &samples, error));
        }
        let too_many = fine.triangles() > options.max_triangles;
        let missed = |error: &BakedError| (error.rms / options.tolerance).max(error.p99 / (P99 * options.tolerance));
        let (last, stop) = (missed(&error), error.holds || too_many || statistics.rounds == ROUNDS || (control.stop)());
        if best.as_ref().is_none_or(|(.., least)| last < missed(least) && !too_many) {
            best = Some((fine, samples, error));
            without_gain = 0;
        } else {
            without_gain += 1;
        }
        // What finer leaves do not mend twice is not theirs to mend; once it may have been a few points.
        if (stop || without_gain == 2)
            && let Some(best) = best
        {
            break best;
        }
        if bias > BIAS * options.tolerance {
            rounds.source_share *= NEXT_SOURCE_SHARE;
        } else {
            rounds.share *= (NEXT_AIM / last).clamp(NEXT_SHARE[0], NEXT_SHARE[1]);
        }
    };
    (control.progress)(1.0);
    let statistics = BakeStatistics {
        discontinuities_found: rounds.lines.all().len(),
        discontinuities_kept: fine.lines.len(),
        triangles: fine.triangles(),
        samples: samples.len(),
        rows: rounds.reflected.rows(),
        bytes: rounds.inquiry.peak(),
        mesh: fine.mesh.statistics,
        ..statistics
    };
    let baked = rounds.baked(&fine, &samples, error);
    let statistics = BakeStatistics { vertices: baked.vertices.len(), ..statistics };
    Bake { baked, solution: rounds.solution, statistics, answers: rounds.inquiry.into_answers() }
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

    /// The direct light of a scene.
    fn baked(scene: &Scene, options: &BakeOptions) -> (Baked, BakeStatistics) {
        baked_with(scene, options, Some(0))
    }

    fn baked_with(scene: &Scene, options: &BakeOptions, bounces: Option<u32>) -> (Baked, BakeStatistics) {
        let solution = solve(scene, &SolveOptions { bounces, ..SolveOptions::default() }, &|_| ());
        let progress = |fraction| assert!((0.0..=1.0).contains(&fraction));
        let bake = bake(
            scene,
            solution,
            options,
            Control { progress: &progress, stop: &|| false, interrupted: &|| false, watch: None },
        );
        (bake.baked, bake.statistics)
    }

    #[test]
    fn an_empty_scene_bakes_to_nothing() {
        let (baked, statistics) = baked(&Scene::default(), &BakeOptions::default());
        let error = BakedError { holds: true, ..BakedError::default() };
        assert_eq!(baked, Baked { error, ..Baked::default() });
        assert_eq!((statistics.triangles, statistics.samples, statistics.rounds), (0, 0, 1));
    }

    #[test]
    fn triangles_fill_every_polygon_and_all_is_in_range() {
        let scene = floor_lamp_and_plate();
        let (baked, statistics) = baked(&scene, &BakeOptions { min_weight: Some(1.0), ..BakeOptions::default() });
        baked.validate().unwrap();
        assert_eq!(statistics.mesh, MeshStatistics::default());
        assert_eq!(statistics.discontinuities_kept, baked.lines.len());
        assert!(baked.error.holds && baked.error.points > 0);
        for polygon in scene.polygon_ids() {
            let of_polygon = (0..baked.triangles.len() as u32)
                .filter(|&triangle| baked.triangles[triangle as usize].polygon == polygon);
            let area: f64 = of_polygon.map(|triangle| scene::area_vector(&baked.corners(triangle)).length()).sum();
            assert!((area / scene.area(polygon) - 1.0).abs() < 1e-6, "the rounding to f32");
        }
    }

    /// What is watched is a bake at any time, finer and finer, in the end the measured one; and it changes nothing.
    #[test]
    fn a_bake_may_be_watched() {
        let scene = floor_lamp_and_plate();
        let (alone, _) = baked_with(&scene, &BakeOptions::default(), None);
        let solution = solve(&scene, &SolveOptions::default(), &|_| ());
        let flat = crate::flat_bake(&scene, &solution);
        let shown = std::sync::Mutex::new(vec![flat]);
        let watch = |baked| shown.lock().unwrap().push(baked);
        let control = Control { progress: &|_| (), stop: &|| false, interrupted: &|| false, watch: Some(&watch) };
        assert_eq!(bake(&scene, solution, &BakeOptions::default(), control).baked, alone);
        let shown = shown.into_inner().unwrap();
        for baked in &shown {
            baked.validate().unwrap();
            let ids = 0..baked.triangles.len() as u32;
            let area: f64 = ids.map(|triangle| scene::area_vector(&baked.corners(triangle)).length()).sum();
            assert!((area / scene.surface_area() - 1.0).abs() < 1e-6);
            assert!(baked.mean_irradiance().min_element() > 0.5 * alone.mean_irradiance().min_element());
        }
        assert!(shown.len() > 2, "{} bakes were shown", shown.len());
        assert!(shown.windows(2).all(|pair| pair[0].triangles.len() <= pair[1].triangles.len()));
        assert_eq!(shown.last(), Some(&alone));
        let nothing = solve(&Scene::default(), &SolveOptions::default(), &|_| ());
        assert!(crate::flat_bake(&Scene::default(), &nothing).triangles.is_empty());
    }

    /// Tiles far below, which see nothing, make it too many polygons to be linked. Every leaf has a least weight of its own.
    #[test]
    fn without_links_leaves_that_are_wanting_follow_discontinuities() {
        let small = floor_lamp_and_plate();
        let mut outlines: Vec<Vec<DVec3>> = small.polygon_ids().map(|polygon| small.outline(polygon)).collect();
        // A lamp so small that its shadow's edge is narrower than the leaves.
        outlines[1] = rectangle([0.0, 0.0, 2.0], 0.02, false);
        outlines
            .extend((0..400).map(|i| rectangle([f64::from(i % 20) * 0.2, f64::from(i / 20) * 0.2, -3.0], 0.05, false)));
        let mut scene = scene_of(&outlines);
        scene.materials = small.materials;
        scene.polygons[1].material = 1;
        let (with, statistics) = baked(&scene, &BakeOptions { tolerance: 0.02, ..BakeOptions::default() });
        assert!(statistics.discontinuities_kept > 0 && statistics.min_weight.is_none(), "{statistics:?}");
        assert!(with.lines.iter().all(|line| (line.receiver, line.source, line.blocker) == (0, 1, 2)));
        let none = BakeOptions { tolerance: 0.02, discontinuities: 0, ..BakeOptions::default() };
        let (without, statistics) = baked(&scene, &none);
        assert_eq!(statistics.discontinuities_kept, 0);
        assert!(with.error.p99 < without.error.p99, "{:?} {:?}", with.error, without.error);
    }

    #[test]
    fn following_discontinuities_saves_triangles() {
        let scene = floor_lamp_and_plate();
        let triangles = |discontinuities| {
            let options = BakeOptions {
                tolerance: 1e-3,
                discontinuities,
                weight: Weight::Ratio,
                min_weight: Some(1.0),
                ..BakeOptions::default()
            };
            let (baked, statistics) = baked(&scene, &options);
            assert!(baked.error.holds);
            statistics.triangles
        };
        let (none, all) = (triangles(0), triangles(20));
        assert!(all * 2 < none, "{all} of {none}");
    }

    #[test]
    fn the_error_falls_with_the_tolerance() {
        let scene = floor_lamp_and_plate();
        let error = |tolerance| baked(&scene, &BakeOptions { tolerance, ..BakeOptions::default() }).0.error.rms;
        let errors = [0.03, 0.003, 3e-4].map(error);
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
        assert!(errors[2] <= 3e-4);
    }

    #[test]
    fn too_few_triangles_are_said_to_miss() {
        let scene = floor_lamp_and_plate();
        let options = BakeOptions { tolerance: 1e-3, max_triangles: 100, ..BakeOptions::default() };
        let (baked, _) = baked(&scene, &options);
        assert!(!baked.error.holds && baked.error.rms > 1e-3);
        baked.validate().unwrap();
    }

    #[test]
    fn any_number_of_threads_bakes_the_same() {
        let scene = floor_lamp_and_plate();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| baked_with(&scene, &BakeOptions { tolerance: 0.05, ..BakeOptions::default() }, None))
        };
        assert!(run(1) == run(3));
    }
}
