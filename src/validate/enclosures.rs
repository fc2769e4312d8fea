//! Closed rooms: the furnace, which is uniform, and the energy that is emitted and must be absorbed.

use glam::DVec3;
use scene::{Rgb, Scene, centroid};
use solver::SolveOptions;

use super::room::{CEILING, FLOOR, Lit, Room, cuboid, integrated, interpolated, reversed};
use super::{Case, Group};

/// A closed room of uniform exitance M and reflectance ρ: B = M/(1−ρ) everywhere. The worst of all elements' radiosities, at
/// [`FINE_LINK_ERROR`]; an element takes the light from a wall that it touches to be linear.
const FURNACE: Group = Group { name: "furnace, elements", source: "B = M/(1−ρ)", bound: 1e-2 };

/// The worst of points on all walls, gathered from the same solution: a gather needs the elements only for what they reflect.
const FURNACE_GATHERED: Group = Group { name: "furnace, points", source: "B = M/(1−ρ)", bound: 1e-4 };

/// The worst of points on all walls, from a bake with default options. Bound: five times one per cent, the
/// project's figure for the 99th percentile of a bake.
const FURNACE_BAKED: Group = Group { name: "furnace, baked", source: "B = M/(1−ρ)", bound: 1e-3 };

/// However the room is furnished, the furnace is uniform: the worst of points among the furniture, gathered with default
/// options. Bound: as for the furnace's bake; links know visibility at a few points of each
/// element, and ρ = 0.9 multiplies by ten what they miss.
const FURNISHED_FURNACE: Group = Group { name: "furnished furnace, points", source: "B = M/(1−ρ)", bound: 5e-3 };

/// Emitted power = Σ (1−ρ) E A over a closed, furnished room, by colour, over the elements with default options. Bound: of the
/// transport alone, whose links know visibility at a few points of each element.
const BALANCE: Group = Group { name: "energy balance, elements, W", source: "Σ (1−ρ) E A = Φ", bound: 2e-2 };

/// The same over the interpolants of a bake with default options. Bound: one per cent, the project's figure for a bake.
const BALANCE_BAKED: Group = Group { name: "energy balance, baked, W", source: "Σ (1−ρ) E A = Φ", bound: 1e-2 };

/// Irradiance, W·m⁻², that a link may misplace in the furnace that is solved finely: a hundredth of M. Smaller takes
/// longer and brings the elements nearer.
const FINE_LINK_ERROR: f64 = 0.02;

/// Tolerance of the bake that goes with it.
const FINE_TOLERANCE: f64 = 1e-3;

/// Exitance of the furnaces, W·m⁻².
const EXITANCE: f64 = 2.0;

/// Reflectances of the furnaces, one a colour: colours do not mix.
const REFLECTANCE: Rgb = Rgb::new(0.3, 0.6, 0.9);

const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// All groups of this file.
pub fn cases() -> Vec<Case> {
    [furnace(), furnished_furnace(), energy_balance()].concat()
}

/// Points on all polygons: the middle, and from there a little, far and nearly all of the way to each corner. On the floor of
/// the furnished room they lie beside the chest.
fn points_on(scene: &Scene) -> Vec<(DVec3, DVec3)> {
    let of_polygon = |polygon: u32| {
        let (outline, normal) = (scene.outline(polygon), scene.plane(polygon).normal);
        let middle = centroid(&outline);
        let towards = move |corner: DVec3| [0.15, 0.8, 0.98].map(|part| middle.lerp(corner, part));
        let places: Vec<DVec3> = outline.into_iter().flat_map(towards).chain([middle]).collect();
        places.into_iter().map(move |place| (place, normal))
    };
    scene.polygon_ids().flat_map(of_polygon).collect()
}

/// One case a reflectance: the radiosity ρE + M that is farthest from M/(1−ρ).
fn furnace_cases(group: &Group, irradiance: &[Rgb]) -> Vec<Case> {
    let case = |colour: usize| {
        let reflectance = REFLECTANCE[colour];
        let exact = EXITANCE / (1.0 - reflectance);
        let radiosity = |irradiance: &Rgb| reflectance * irradiance[colour] + EXITANCE;
        // A missing or broken value is the worst of all.
        let miss = |value: f64| if value.is_nan() { f64::INFINITY } else { (value - exact).abs() };
        let worst = irradiance.iter().map(radiosity).max_by(|a, b| miss(*a).total_cmp(&miss(*b)));
        group.case(format!("ρ = {reflectance}"), None, exact, worst.unwrap_or(f64::NAN))
    };
    (0..3).map(case).collect()
}

fn on_elements(lit: &Lit) -> Vec<Rgb> {
    lit.solution.elements.leaves().map(|leaf| lit.solution.irradiance[leaf as usize].irradiance).collect()
}

fn furnace() -> Vec<Case> {
    let room = Room::default().material(REFLECTANCE, Rgb::splat(EXITANCE));
    let scene = room.polygons(&cuboid(DVec3::ZERO, DVec3::new(3.0, 2.0, 1.5))).scene();
    let points = points_on(&scene);
    let default = Lit::solve(scene.clone());
    let fine = SolveOptions { link_error: Some(FINE_LINK_ERROR), ..SolveOptions::default() };
    let lit = Lit::solve_with(scene, &fine, FINE_TOLERANCE);
    [
        furnace_cases(&FURNACE, &on_elements(&lit)),
        furnace_cases(&FURNACE_GATHERED, &lit.gather(points.iter().copied())),
        furnace_cases(&FURNACE_BAKED, &interpolated(default.bake(), points)),
    ]
    .concat()
}

/// A room, the furniture of one material: a chest that stands on the floor, so that it has no bottom, and a table top.
fn furnished(walls: [Rgb; 2], ceiling: [Rgb; 2], furniture: [Rgb; 2]) -> Scene {
    let room = cuboid(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5));
    let chest = cuboid(DVec3::new(0.7, 0.5, 0.0), DVec3::new(1.5, 1.4, 0.8)).map(reversed);
    let table = cuboid(DVec3::new(2.2, 1.3, 0.9), DVec3::new(3.5, 2.2, 1.0)).map(reversed);
    Room::default()
        .material(walls[0], walls[1])
        .polygons(&room[..CEILING])
        .material(ceiling[0], ceiling[1])
        .polygon(&room[CEILING])
        .material(furniture[0], furniture[1])
        .polygons(chest.iter().enumerate().filter(|&(side, _)| side != FLOOR).map(|(_, outline)| outline))
        .polygons(&table)
        .scene()
}

fn furnished_furnace() -> Vec<Case> {
    let alike = [REFLECTANCE, Rgb::splat(EXITANCE)];
    let lit = Lit::solve(furnished(alike, alike, alike));
    furnace_cases(&FURNISHED_FURNACE, &lit.gather(points_on(&lit.scene)))
}

fn energy_balance() -> Vec<Case> {
    let walls = [Rgb::new(0.7, 0.5, 0.3), Rgb::ZERO];
    let ceiling = [Rgb::splat(0.2), Rgb::new(40.0, 30.0, 20.0)];
    let furniture = [Rgb::new(0.2, 0.4, 0.8), Rgb::ZERO];
    let lit = Lit::solve(furnished(walls, ceiling, furniture));
    let (scene, solution) = (&lit.scene, &lit.solution);
    let absorbed = |polygon: u32| Rgb::ONE - scene.reflectance(polygon);
    let of_leaf = |leaf: u32| {
        let polygon = solution.elements.polygon_of(leaf).unwrap_or_default();
        absorbed(polygon) * solution.irradiance[leaf as usize].irradiance * solution.elements.nodes[leaf as usize].area
    };
    let by_elements: Rgb = solution.elements.leaves().map(of_leaf).sum();
    let baked = lit.bake();
    let by_bake = integrated(baked, absorbed);
    let emitted = scene.power();
    let cases = |group: &Group, found: Rgb| -> Vec<Case> {
        (0..3).map(|colour| group.case(COLOURS[colour], None, emitted[colour], found[colour])).collect()
    };
    [cases(&BALANCE, by_elements), cases(&BALANCE_BAKED, by_bake)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_value_is_the_worst() {
        let exact = |colour: usize| EXITANCE / (1.0 - REFLECTANCE[colour]);
        let right = Rgb::from_array([0, 1, 2].map(exact));
        assert!(furnace_cases(&FURNACE, &[right; 4]).iter().all(Case::holds));
        assert!(furnace_cases(&FURNACE, &[right, Rgb::NAN, right]).iter().all(|case| !case.holds()));
        assert!(furnace_cases(&FURNACE, &[]).iter().all(|case| !case.holds()));
    }
}
