//! What elements have around them, as far as a first look tells: few rays from one point of each.
//!
//! How bright it is around an element says what an error counts there: in a room that is a tenth as bright as the others a tenth as
//! much is seen. How much what it sees differs by direction says how many rays its points need.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use scene::{Rgb, luminance};
use serde::{Deserialize, Serialize};

use crate::lattice::Fan;
use crate::{Cosine, Gather, NodeId, Shafts, Solution, Surroundings};

/// Rays of a first look from an element that is large enough. More cost as much as they save.
const RAYS: u32 = 64;

/// The source error of a first look: most emitters are then told by a ray or a few, which scatters, as what many elements are
/// averaged over may.
const SOURCE_ERROR: f64 = 0.5;

/// Times that light is sent on: what is left is a hundredth in a room that reflects half.
const BOUNCES: u32 = 8;

/// Times that each element takes the mean of those that it sees for what surrounds it. Fewer leave a slit behind a shelf as dark as it is,
/// and it is nothing that an eye adapts to; more mix rooms through their doors.
const STEPS: u32 = 6;

/// The least brightness that is told apart: below, light is found as if the surroundings were as bright as that. Slits of furnished rooms
/// are darker, and would cost as much as all else.
const LEAST_BRIGHTNESS: f64 = 0.05;

/// The part of an element's contrast, as a square, that is that of the elements it sees: few rays miss a bright door as often as not.
const SHARED: f64 = 0.5;

/// What an element has around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outlook {
    /// Mean irradiance of what surrounds it, as a part of that of all surfaces, at most 1.
    pub brightness: f32,
    /// Standard deviation, by direction, of the light that arrives over reflectors, as a part of the element's own irradiance, or of
    /// that of its surroundings if that is more.
    pub contrast: f32,
}

impl Outlook {
    /// That of an element of which nothing is known.
    pub const UNKNOWN: Self = Self { brightness: 1.0, contrast: 0.25 };
}

/// What a first look tells of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstLook {
    /// Of every node; unknown but for leaves.
    pub outlooks: Vec<Outlook>,
    /// Mean irradiance of all surfaces, W·m⁻².
    pub mean_irradiance: Rgb,
    /// The part of the light on all surfaces that they reflect, 0..=1.
    pub reflectance: f64,
}

/// What one leaf sees.
struct Look {
    emitted: Vec3,
    /// Other leaves by their place among all, and their form factors.
    seen: Vec<(u32, f32)>,
}

impl Look {
    fn received(&self, sent: &[Vec3]) -> Vec3 {
        self.seen.iter().map(|&(place, form_factor)| sent[place as usize] * form_factor).sum()
    }

    /// The same of one number, raised to a power.
    fn moment(&self, of: &[f32], power: i32) -> f32 {
        self.seen.iter().map(|&(place, form_factor)| of[place as usize].powi(power) * form_factor).sum()
    }

    /// The mean of what is seen; what is known already where nothing is.
    fn mean(&self, of: &[f32], known: f32) -> f32 {
        let all: f32 = self.seen.iter().map(|seen| seen.1).sum();
        if all > 0.0 { self.moment(of, 1) / all } else { known }
    }
}

/// Looks from one point of every leaf of a solution without links. `go_on` is told which part of all looks has begun, 0..=1; None
/// if it says no.
pub fn first_look(
    surroundings: &Surroundings<'_>,
    solution: &Solution,
    go_on: &(dyn Fn(f64) -> bool + Sync),
) -> Option<FirstLook> {
    let (scene, elements) = (surroundings.scene, &solution.elements);
    let leaves: Vec<NodeId> = scene.polygon_ids().flat_map(|polygon| solution.leaves_of(polygon)).collect();
    let looks = looks(surroundings, solution, &leaves, go_on)?;
    let surface = |&leaf: &NodeId| {
        let reflectance = elements.polygon_of(leaf).map_or(Rgb::ZERO, |polygon| scene.reflectance(polygon));
        (reflectance.as_vec3(), elements.nodes[leaf as usize].area)
    };
    let (reflectances, areas): (Vec<Vec3>, Vec<f64>) = leaves.iter().map(surface).unzip();

    let mut light: Vec<Vec3> = looks.iter().map(|look| look.emitted).collect();
    let mut sent = Vec::new();
    for _ in 0..BOUNCES {
        sent = light.iter().zip(&reflectances).map(|(light, reflectance)| light * reflectance).collect();
        light = looks.par_iter().map(|look| look.emitted + look.received(&sent)).collect();
    }
    let total = |of: &dyn Fn(usize) -> Vec3| (0..leaves.len()).map(|i| of(i).as_dvec3() * areas[i]).sum::<Rgb>();
    let arrives = total(&|i| light[i]);
    let mean_irradiance = arrives / areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut outlooks = vec![Outlook::UNKNOWN; elements.nodes.len()];
    let scale = luminance(mean_irradiance) as f32;
    if scale > 0.0 {
        let relative = |light: &Vec3| luminance(light.as_dvec3()) as f32 / scale;
        let (own, sent): (Vec<f32>, Vec<f32>) =
            (light.iter().map(relative).collect(), sent.iter().map(relative).collect());
        let around = around(&looks, &own);
        let squares = squared_contrasts(&looks, &own, &sent, &around);
        for (i, look) in looks.iter().enumerate() {
            let square = squares[i] + SHARED as f32 * (look.mean(&squares, squares[i]) - squares[i]);
            outlooks[leaves[i] as usize] = Outlook { brightness: around[i], contrast: square.sqrt() };
        }
    }
    let reflected = luminance(total(&|i| light[i] * reflectances[i]));
    let reflectance = if solution.reflects() && scale > 0.0 { reflected / luminance(arrives) } else { 0.0 };
    Some(FirstLook { outlooks, mean_irradiance, reflectance })
}

fn looks(
    surroundings: &Surroundings<'_>,
    solution: &Solution,
    leaves: &[NodeId],
    go_on: &(dyn Fn(f64) -> bool + Sync),
) -> Option<Vec<Look>> {
    let elements = &solution.elements;
    let mut places = vec![0; elements.nodes.len()];
    leaves.iter().zip(0..).for_each(|(&leaf, place)| places[leaf as usize] = place);
    let lamps = Gather::with_source_error(surroundings, solution, SOURCE_ERROR);
    let reflectors = Gather::with_leaves(surroundings, solution, RAYS);
    let begun = AtomicUsize::new(0);
    let look = |&leaf: &NodeId| {
        if !go_on((begun.fetch_add(1, Ordering::Relaxed) + 1) as f64 / leaves.len() as f64) {
            return None;
        }
        let position = Fan::new(elements.outline(leaf)).place(DVec2::ZERO, leaf);
        let direct = lamps.over_emitters(leaf, &mut Shafts::default()).emitted(position, DVec3::ZERO, Cosine::Own);
        let mut seen = Vec::new();
        if solution.reflects() {
            reflectors.over_reflectors(leaf).seen_nodes(position, DVec3::ZERO, Cosine::Own, &mut seen);
        }
        let seen = seen.iter().map(|seen| (places[seen.node as usize], seen.form_factor as f32)).collect();
        Some(Look { emitted: direct.total().as_vec3(), seen })
    };
    leaves.par_iter().map(look).collect()
}

/// How bright it is around each leaf whose own irradiance is given, relative to the mean of all.
fn around(looks: &[Look], own: &[f32]) -> Vec<f32> {
    let mut around = own.to_vec();
    for _ in 0..STEPS {
        around = looks.par_iter().zip(&around).map(|(look, known)| look.mean(&around, *known)).collect();
    }
    let bounded = |(brightness, look): (f32, &Look)| match look.seen[..] {
        // Where nothing is seen nothing is asked for.
        [] => 1.0,
        _ => brightness.clamp(LEAST_BRIGHTNESS as f32, 1.0),
    };
    around.into_iter().zip(looks).map(bounded).collect()
}

/// The squares of contrasts, by what each leaf receives and sends, relative to the mean irradiance.
fn squared_contrasts(looks: &[Look], own: &[f32], sent: &[f32], around: &[f32]) -> Vec<f32> {
    let square = |(i, look): (usize, &Look)| {
        (look.moment(sent, 2) - look.moment(sent, 1).powi(2)).max(0.0) / own[i].max(around[i]).powi(2)
    };
    looks.par_iter().enumerate().map(square).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Builder;
    use crate::{SolveOptions, solve};

    const TILES: u32 = 12;

    /// Two rooms of many tiles without a door, each with a lamp.
    fn two_rooms(radiances: [f64; 2]) -> scene::Scene {
        let mut builder = Builder::default();
        for (room, radiance) in radiances.into_iter().enumerate() {
            let x = 10.0 * room as f64;
            let [low, high] = [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 3.0, 2.0)];
            builder = builder.material(0.5, 0.0).sides(low, high, true, [true, true, true, true, false, true]);
            let side = 1.0 / f64::from(TILES);
            for i in 0..TILES * TILES + 60 {
                let (u, v) = (f64::from(i % TILES) * side, f64::from(i / TILES % TILES) * side);
                let tile = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)];
                let z = if i < TILES * TILES { 0.0 } else { -1.0 };
                let corner = |(a, b): (f64, f64)| DVec3::new(x + 4.0 * (u + a), 3.0 * (v + b), z);
                builder = builder.polygon(&tile.map(corner));
            }
            builder = builder
                .material(0.0, radiance)
                .polygon(&[(1.5, 1.0), (1.5, 2.0), (2.5, 2.0), (2.5, 1.0)].map(|(u, v)| DVec3::new(x + u, v, 1.9)));
        }
        builder.build()
    }

    fn looked(scene: &scene::Scene) -> (Solution, FirstLook) {
        let solution = solve(scene, &SolveOptions::default(), &|_| ());
        let look = first_look(&Surroundings::new(scene, &solution), &solution, &|_| true).expect("nobody interrupts");
        (solution, look)
    }

    #[test]
    fn a_dim_room_is_dim_and_what_sees_nothing_is_not() {
        let scene = two_rooms([10.0, 1.0]);
        let (solution, look) = looked(&scene);
        let polygons = scene.polygons.len() as u32;
        let outlook = |polygon: u32| {
            let leaves = solution.leaves_of(polygon);
            look.outlooks[leaves[leaves.len() / 2] as usize]
        };
        let [bright, dim] = [0, polygons / 2].map(outlook);
        assert!(bright.brightness == 1.0 && (0.15..0.22).contains(&dim.brightness), "{bright:?} {dim:?}");
        let times = bright.contrast / dim.contrast;
        assert!((0.4..2.5).contains(&times), "{bright:?} {dim:?}: each beside its own room");
        // Tiles below the floor, under nothing.
        assert_eq!(outlook(5 + TILES * TILES + 3).brightness, 1.0);
    }

    /// A closed room of which every part emits M: everything is M / (1 − ρ), from wherever one looks.
    #[test]
    fn a_furnace_has_no_contrast() {
        let mut furnace = two_rooms([1.0, 1.0]);
        furnace.materials.iter_mut().for_each(|material| {
            (material.reflectance, material.radiance) = (Rgb::splat(0.5), Rgb::ONE);
        });
        let (solution, look) = looked(&furnace);
        let wall = look.outlooks[solution.leaves_of(0)[0] as usize];
        assert!(wall.contrast < 0.1, "{wall:?}");
        assert!((look.reflectance - 0.5).abs() < 1e-6);
    }

    #[test]
    fn darkness_is_unknown_and_an_interrupted_look_is_none() {
        let scene = two_rooms([0.0, 0.0]);
        let (solution, look) = looked(&scene);
        assert_eq!((look.mean_irradiance, look.reflectance), (Rgb::ZERO, 0.0));
        assert!(look.outlooks.iter().all(|outlook| *outlook == Outlook::UNKNOWN));
        assert_eq!(first_look(&Surroundings::new(&scene, &solution), &solution, &|part| part < 0.5), None);
    }
}
