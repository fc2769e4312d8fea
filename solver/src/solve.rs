//! The solve: cut → link → refine and transport in turns.

use glam::DVec3;
use scene::{Rgb, Scene, luminance};

use crate::cut::{contact_lines, cut_polygon};
use crate::polygon_tree::PolygonTree;
use crate::refine::{Network, SourceLight};
use crate::sky_view::mean_irradiance_from_sky;
use crate::transport::{Transport, transport};
use crate::{
    BlockerLists, Convergence, Cut, ElementLight, Elements, Openings, SkyCells, Solution, SolveOptions, Visibility,
};

/// Link error as a fraction of the scene's mean irradiance where none is asked for. Half of it costs the
/// office half as many elements again.
const RELATIVE_LINK_ERROR: f64 = 0.2;

/// Largest side of an element, as a fraction of the scene's size. Links ask for no elements on a dark surface, but an eye
/// that has adapted to it sees what one quadratic over all of it leaves out.
const LARGEST_CELL: f64 = 0.1;

/// Side of a square element that is as large as one may be without links, where nothing is known of its light before it is
/// looked at: as a part of the area of all surfaces. Larger misses what lies between its probes.
const LARGEST_SHARE: f64 = 1.0 / 1500.0;

/// The same in mean areas of the scene's polygons: the larger a hall is, the more lamps hang under a 1,500th of its surfaces. One mean
/// area divides for nothing, ten find the dark places over lamps too late: in a hall either takes longer.
const LARGEST_IN_POLYGONS: f64 = 3.0;

/// The part of its light that a room is taken to absorb at least, where its light is guessed.
const LEAST_ABSORBED: f64 = 0.05;

/// Times that links are refined by the light of the transport before. The first has seen patches only, the second
/// elements; later ones hardly change a link.
const REFINEMENTS: u32 = 3;

/// Polygons of a scene at most whose pairs are linked. Finding a pair's blockers among all others takes time with the cube of
/// their number: a few seconds here.
const MOST_LINKED: usize = 400;

/// Polygons of a scene at most where all elements have shafts to the sky. Of more most are short, and seen by few rays each.
const MOST_WITH_SHAFTS: usize = 2000;

/// Solves diffuse global illumination for a scene. `progress` is told the fraction that is done, 0..=1.
///
/// A scene without emitters solves to darkness.
pub fn solve(scene: &Scene, options: &SolveOptions, progress: &(dyn Fn(f64) + Sync)) -> Solution {
    let cuts = contact_lines(scene);
    let pieces: Vec<_> =
        scene.polygon_ids().map(|polygon| cut_polygon(&scene.outline(polygon), &cuts[polygon as usize])).collect();
    let mut first_patch = vec![0];
    for pieces in &pieces {
        first_patch.push(first_patch.last().unwrap_or(&0) + pieces.len() as u32);
    }
    if scene.polygons.len() > MOST_LINKED || scene.environment.is_some() {
        progress(1.0);
        return unlinked(scene, &pieces, cuts, first_patch, options);
    }
    let mut network = Network::of_patches(scene, Elements::new(&pieces), &first_patch, options.bounces == Some(0));
    progress(0.1);
    let transported = |network: &Network| {
        let (links, first_link) = network.sorted_links();
        let carried = transport(scene, &network.elements, &links, &first_link, options.bounces);
        (links, first_link, carried)
    };
    let (.., mut carried) = transported(&network);
    let mean = mean_irradiance(&network.elements, &carried);
    let link_error = options.link_error.unwrap_or(RELATIVE_LINK_ERROR * luminance(mean));
    for pass in 0..REFINEMENTS {
        let light = source_light(scene, &network.elements, &carried);
        let refined = network.refine(&light, link_error);
        progress(0.1 + 0.9 * f64::from(pass + 1) / f64::from(REFINEMENTS));
        if !refined {
            break;
        }
        (.., carried) = transported(&network);
    }
    network.elements.divide_larger(scene.size() * LARGEST_CELL);
    let (links, first_link, carried) = transported(&network);
    let (elements, blockers) = network.finish();
    let mean_irradiance = mean_irradiance(&elements, &carried);
    progress(1.0);
    Solution {
        elements,
        cuts,
        first_patch,
        links,
        first_link,
        blockers,
        irradiance: carried.irradiance,
        direct: carried.direct,
        light: carried.reflected,
        mean_irradiance,
        convergence: carried.convergence,
        link_error,
        bounces: options.bounces,
        visibility: Visibility::Links,
        sky: SkyCells::default(),
        openings: None,
        outlooks: Vec::new(),
    }
}

/// The elements of a scene that is too large to be linked, in darkness: its light is found point by point.
fn unlinked(
    scene: &Scene,
    pieces: &[Vec<Vec<DVec3>>],
    cuts: Vec<Vec<Cut>>,
    first_patch: Vec<u32>,
    options: &SolveOptions,
) -> Solution {
    let mut elements = Elements::new(pieces);
    let largest = LARGEST_SHARE.min(LARGEST_IN_POLYGONS / scene.polygons.len() as f64);
    elements.divide_larger((scene.surface_area() * largest).sqrt().min(scene.size() * LARGEST_CELL));
    let tree = PolygonTree::new(scene);
    let sky = SkyCells::new(scene.environment.as_ref());
    let has_openings = !sky.is_dark() && scene.polygons.len() > MOST_WITH_SHAFTS;
    let openings = has_openings.then(|| Openings::new(scene, &tree, &elements, &sky));
    Solution {
        first_link: vec![0; elements.nodes.len() + 1],
        light: vec![ElementLight::default(); elements.nodes.len()],
        elements,
        cuts,
        first_patch,
        links: Vec::new(),
        blockers: BlockerLists::default(),
        irradiance: Vec::new(),
        direct: Vec::new(),
        mean_irradiance: guessed_irradiance(scene, &tree),
        convergence: Convergence { reached: true, ..Convergence::default() },
        link_error: 0.0,
        bounces: options.bounces,
        visibility: Visibility::Rays,
        sky,
        openings,
        outlooks: Vec::new(),
    }
}

/// Mean irradiance of a closed room with the scene's lamps and walls, and as much light from the sky as arrives, W·m⁻²: light
/// that escapes, and lamps that shine where few surfaces are, make it less.
fn guessed_irradiance(scene: &Scene, tree: &PolygonTree) -> Rgb {
    let sum =
        |of: &dyn Fn(u32) -> Rgb| scene.polygon_ids().map(|polygon| of(polygon) * scene.area(polygon)).sum::<Rgb>();
    let area = sum(&|_| Rgb::ONE);
    let emitted = sum(&|polygon| scene.material(polygon).exitance());
    let from_sky = mean_irradiance_from_sky(scene, tree) * area;
    let absorbed = sum(&|polygon| Rgb::ONE - scene.reflectance(polygon));
    if area.x > 0.0 { (emitted + from_sky) / absorbed.max(area * LEAST_ABSORBED) } else { Rgb::ZERO }
}

/// What refinement goes by: radiosity as a source, and how far it varies below each node.
fn source_light(scene: &Scene, elements: &Elements, transport: &Transport) -> SourceLight {
    let (radiosity, deviation) = (0..elements.nodes.len() as u32)
        .map(|node| {
            let Some(polygon) = elements.polygon_of(node) else { return (0.0, 0.0) };
            let (reflectance, light) = (scene.reflectance(polygon), &transport.reflected[node as usize]);
            let radiosity = reflectance * light.irradiance + scene.material(polygon).exitance();
            // A source's own slope counts as variation, too: a link carries its mean.
            let size = elements.nodes[node as usize].cell_max - elements.nodes[node as usize].cell_min;
            let slope = luminance(light.gradient_u.abs() * size.x + light.gradient_v.abs() * size.y) / 2.0;
            (luminance(radiosity), (light.deviation + slope) * luminance(reflectance))
        })
        .unzip();
    SourceLight { radiosity, deviation }
}

/// Area-weighted mean irradiance over all leaves, W·m⁻².
fn mean_irradiance(elements: &Elements, transport: &Transport) -> Rgb {
    let area = |leaf: u32| elements.nodes[leaf as usize].area;
    let total: f64 = elements.leaves().map(area).sum();
    let sum: Rgb = elements.leaves().map(|leaf| transport.irradiance[leaf as usize].irradiance * area(leaf)).sum();
    if total > 0.0 { sum / total } else { Rgb::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Builder;
    use crate::{Gather, Surroundings};

    fn solved(scene: &Scene, link_error: f64, bounces: Option<u32>) -> Solution {
        solve(scene, &SolveOptions { link_error: Some(link_error), bounces }, &|_| ())
    }

    fn furnished(reflectance: f64, radiance: f64) -> Scene {
        Builder::default()
            .material(reflectance, radiance)
            .cuboid([0.0, 0.0, 0.0], [4.0, 3.0, 2.5], true)
            .cuboid([0.7, 0.5, 0.05], [1.5, 1.4, 0.8], false)
            .cuboid([2.2, 1.3, 0.9], [3.5, 2.2, 1.0], false)
            .build()
    }

    #[test]
    fn nothing_and_darkness() {
        let empty = solve(&Scene::default(), &SolveOptions::default(), &|_| ());
        assert_eq!(empty.elements.nodes.len(), 1);
        let dark = furnished(0.5, 0.0);
        let solution = solve(&dark, &SolveOptions::default(), &|_| ());
        assert_eq!(solution.mean_irradiance, Rgb::ZERO);
        assert!(solution.convergence.reached);
        let surroundings = Surroundings::new(&dark, &solution);
        let gather = Gather::new(&surroundings, &solution);
        assert_eq!(gather.irradiance_at(4, DVec3::new(2.0, 2.0, 0.0), DVec3::ZERO), Rgb::ZERO);
    }

    /// Closed enclosure of uniform exitance M and reflectance ρ: B = M/(1−ρ) everywhere.
    #[test]
    fn a_furnace_is_uniform() {
        for (reflectance, radiance) in [(0.5, 0.2), (0.9, 0.04)] {
            let room =
                Builder::default().material(reflectance, radiance).cuboid([0.0; 3], [2.0, 3.0, 1.0], true).build();
            let solution = solved(&room, 1e-4, None);
            let expected = std::f64::consts::PI * radiance / (1.0 - reflectance);
            for leaf in solution.elements.leaves() {
                let exitance = std::f64::consts::PI * radiance;
                for light in [&solution.irradiance[leaf as usize], &solution.light[leaf as usize]] {
                    let radiosity = reflectance * light.irradiance + exitance;
                    assert!((radiosity / expected - 1.0).abs().max_element() < 1e-3, "{radiosity} {expected}");
                }
            }
            let laws = solution.validate(&room);
            assert!(laws.closure < 1e-6 && laws.reciprocity < 1e-9 && laws.energy < 1e-6, "{laws:?}");
            assert_eq!((laws.doubled_links, laws.bad_numbers, laws.open_patches), (0, 0, 0));
        }
    }

    #[test]
    fn a_furnished_furnace_obeys_the_laws() {
        let room = furnished(0.6, 1.0);
        let solution = solved(&room, 0.02, None);
        let laws = solution.validate(&room);
        assert!(laws.closure < 1e-3 && laws.energy < 1e-3, "{laws:?}");
        assert!(laws.reciprocity < 1e-2, "{laws:?}");
        assert_eq!((laws.doubled_links, laws.bad_numbers), (0, 0));
    }

    /// What a point sees adds up to the hemisphere, to rounding, under the table and beside the box.
    #[test]
    fn visible_fragments_close_the_hemisphere() {
        let room = furnished(0.0, 1.0);
        let solution = solved(&room, 0.5, Some(0));
        let surroundings = Surroundings::new(&room, &solution);
        let gather = Gather::new(&surroundings, &solution);
        for (x, y) in [(2.8, 1.7), (0.65, 0.9), (0.7, 0.5), (1.51, 1.0), (1.1, 1.1), (3.9, 0.1), (4.0, 0.0)] {
            let position = DVec3::new(x, y, 0.0);
            let irradiance = gather.irradiance_at(4, position, DVec3::new(2.0, 1.5, 0.0) - position);
            assert!((irradiance.x / std::f64::consts::PI - 1.0).abs() < 1e-9, "{position}: {irradiance}");
        }
    }

    /// A dark box of walls without thickness, standing on the floor of a lit room and sharing its polygon: nothing at
    /// all gets in, and outside nothing is lost.
    #[test]
    fn no_light_leaks_under_a_wall() {
        let (low, high) = (DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.2, 1.0));
        let walls = [true, true, true, true, false, true];
        let room = Builder::default()
            .material(0.7, 0.5)
            .cuboid([0.0, 0.0, 0.0], [4.0, 3.0, 2.5], true)
            .material(0.5, 0.0)
            .sides(low, high, false, walls)
            .sides(low, high, true, walls)
            .build();
        // The floor emits inside the box, too: it must not for this test.
        let mut room = room;
        room.materials.push(scene::Material { radiance: Rgb::ZERO, ..room.materials[0].clone() });
        room.polygons[4].material = 2;
        let solution = solved(&room, 0.05, None);
        let surroundings = Surroundings::new(&room, &solution);
        let gather = Gather::new(&surroundings, &solution);
        let inside = |x: f64, y: f64| (1.0..=2.0).contains(&x) && (1.0..=2.2).contains(&y);
        let centre = DVec3::new(1.5, 1.6, 0.0);
        for i in 0..=40 {
            for j in 0..=30 {
                let point = DVec3::new(f64::from(i) * 0.1, f64::from(j) * 0.1, 0.0);
                if inside(point.x, point.y) {
                    // On the border too: the limit from inside.
                    assert_eq!(gather.irradiance_at(4, point, centre - point), Rgb::ZERO, "{point}");
                }
            }
        }
        for point in [DVec3::new(0.999_999, 1.5, 0.0), DVec3::new(1.5, 2.200_001, 0.0)] {
            assert!(gather.irradiance_at(4, point, DVec3::ZERO).x > 0.1);
        }
        for leaf in solution.elements.leaves() {
            let polygon = solution.elements.polygon_of(leaf).expect("a leaf is a surface");
            let middle = solution.elements.nodes[leaf as usize].centre;
            if polygon >= 11 || (polygon == 4 && inside(middle.x, middle.y)) {
                assert_eq!(solution.irradiance[leaf as usize].irradiance, Rgb::ZERO, "polygon {polygon} {middle}");
            }
        }
    }

    #[test]
    fn bounces_add_up() {
        let room = furnished(0.5, 0.3);
        let at = |bounces| {
            let solution = solved(&room, 0.01, Some(bounces));
            Gather::new(&Surroundings::new(&room, &solution), &solution)
                .irradiance_at(4, DVec3::new(3.0, 0.5, 0.0), DVec3::ZERO)
                .x
        };
        let exitance = 0.3 * std::f64::consts::PI;
        // With M everywhere every bounce multiplies by ρ: 1, 1 + ρ, 1 + ρ + ρ², …
        for (bounces, factor) in [(0, 1.0), (1, 1.5), (2, 1.75)] {
            assert!((at(bounces) / (exitance * factor) - 1.0).abs() < 2e-3, "{bounces}: {}", at(bounces) / exitance);
        }
    }

    #[test]
    fn the_same_solution_at_any_thread_count() {
        let room = furnished(0.5, 0.3);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
            pool.install(|| solved(&room, 0.05, None))
        };
        assert_eq!(on(1), on(3));
    }

    #[test]
    fn the_error_falls_with_the_link_error() {
        let room = Builder::default()
            .material(0.7, 0.0)
            .sides([0.0; 3].into(), [4.0, 3.0, 2.5].into(), true, [true, true, true, true, true, false])
            .material(0.2, 4.0)
            .sides([0.0; 3].into(), [4.0, 3.0, 2.5].into(), true, [false, false, false, false, false, true])
            .build();
        let at = |link_error: f64| {
            let solution = solved(&room, link_error, None);
            Gather::new(&Surroundings::new(&room, &solution), &solution)
                .irradiance_at(4, DVec3::new(0.3, 0.2, 0.0), DVec3::ZERO)
                .x
        };
        let best = at(0.005);
        let errors: Vec<f64> = [1.0, 0.1].map(|link_error| (at(link_error) / best - 1.0).abs()).to_vec();
        assert!(errors[1] < 0.5 * errors[0] + 1e-4 && errors[1] < 3e-3, "{errors:?}");
    }
}
