#![allow(clippy::unwrap_used)]

use glam::DQuat;
use proptest::prelude::*;
use scene::{Material, Polygon};

use super::*;

const KINDS: [LineKind; 2] = [LineKind::VertexEdge, LineKind::EdgeVertex];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A scene of polygons given by their corners; equal positions are one vertex.
pub(crate) fn welded(outlines: &[Vec<DVec3>]) -> Scene {
    let mut scene = Scene { materials: vec![Material::grey("grey")], objects: vec!["all".into()], ..Scene::default() };
    for outline in outlines {
        let (first_corner, corner_count) = (scene.corners.len() as u32, outline.len() as u32);
        for &corner in outline {
            let known = scene.vertices.iter().position(|&vertex| vertex == corner);
            let vertex = known.unwrap_or_else(|| {
                scene.vertices.push(corner);
                scene.vertices.len() - 1
            });
            scene.corners.push(vertex as u32);
        }
        scene.polygons.push(Polygon { first_corner, corner_count, material: 0, object: 0 });
    }
    scene.validate().unwrap();
    scene
}

/// A rectangle across z, facing up, or down if `down`.
pub(crate) fn rectangle(low: (f64, f64), high: (f64, f64), z: f64, down: bool) -> Vec<DVec3> {
    let mut outline = vec![v(low.0, low.1, z), v(high.0, low.1, z), v(high.0, high.1, z), v(low.0, high.1, z)];
    if down {
        outline.reverse();
    }
    outline
}

/// The six faces of a box, looking outwards: bottom, top, front, right, back, left.
fn cuboid(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
    let corner = |i: usize| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 0 { low[axis] } else { high[axis] };
        v(pick(0, 0), pick(1, 1), pick(2, 2))
    };
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
        .map(|face| face.map(corner).to_vec())
        .to_vec()
}

/// The discontinuities on polygon 0 of light from polygon 1 past all others, of radiosity 1 and any weight.
fn search(outlines: &[Vec<DVec3>]) -> Vec<Discontinuity> {
    search_above(outlines, Weight::Ratio, 0.0)
}

fn search_above(outlines: &[Vec<DVec3>], measure: Weight, min_weight: f64) -> Vec<Discontinuity> {
    let scene = welded(outlines);
    let blockers = (2..outlines.len() as u32).collect();
    let interactions = [Interaction { source: 1, far_outline: None, radiosity: 1.0, blockers }];
    discontinuities(&scene, &HalfEdges::new(&scene), 0, &interactions, measure, min_weight)
}

fn of_kind(lines: &[Discontinuity], kind: LineKind) -> Vec<[DVec3; 2]> {
    lines.iter().filter(|line| line.kind == kind).map(|line| line.ends).collect()
}

/// Asserts that two lists hold the same segments, in any order and direction, to 1e-9.
#[track_caller]
fn assert_same(found: &[[DVec3; 2]], expected: &[[DVec3; 2]]) {
    let near = |a: &[DVec3; 2], b: &[DVec3; 2]| (a[0].distance(b[0]) < 1e-9) && (a[1].distance(b[1]) < 1e-9);
    let is_in =
        |list: &[[DVec3; 2]], ends: &[DVec3; 2]| list.iter().any(|e| near(e, ends) || near(e, &[ends[1], ends[0]]));
    for ends in expected {
        assert!(is_in(found, ends), "missing {ends:?} in {found:?}");
    }
    for ends in found {
        assert!(is_in(expected, ends), "not expected: {ends:?}");
    }
    assert_eq!(found.len(), expected.len());
}

fn floor() -> Vec<DVec3> {
    rectangle((-4.0, -4.0), (4.0, 4.0), 0.0, false)
}

#[test]
fn degenerate_input_has_no_discontinuities() {
    let light = rectangle((-1.0, -1.0), (1.0, 1.0), 2.0, true);
    let scene = welded(&[floor(), light.clone(), rectangle((-0.5, -0.5), (0.5, 0.5), 1.0, false)]);
    let half_edges = HalfEdges::new(&scene);
    let interaction = |source, blockers: &[u32]| Interaction {
        source,
        far_outline: None,
        radiosity: 1.0,
        blockers: blockers.to_vec(),
    };
    let count = |receiver, interaction| {
        discontinuities(&scene, &half_edges, receiver, &[interaction], Weight::Ratio, 0.0).len()
    };
    assert!(discontinuities(&scene, &half_edges, 0, &[], Weight::Ratio, 0.0).is_empty());
    assert_eq!(count(0, interaction(1, &[])), 0);
    assert_eq!(count(0, interaction(7, &[2])), 0);
    assert_eq!(count(7, interaction(1, &[2])), 0);
    assert_eq!(count(0, interaction(1, &[7])), 0);
    assert_eq!(count(0, interaction(0, &[2])), 0);
    assert_eq!(count(0, interaction(1, &[0, 1])), 0);
    assert_eq!(count(0, interaction(1, &[2])), 32);

    let empty = Scene::default();
    assert!(
        discontinuities(&empty, &HalfEdges::new(&empty), 0, &[interaction(1, &[2])], Weight::Ratio, 0.0).is_empty()
    );
    let mut collapsed = scene.clone();
    collapsed.vertices = vec![DVec3::ZERO; scene.vertices.len()];
    assert!(discontinuities(&collapsed, &half_edges, 0, &[interaction(1, &[2])], Weight::Ratio, 0.0).is_empty());
    // A light that shines away, and one below the floor.
    let mut away = light;
    away.reverse();
    assert!(search(&[floor(), away, rectangle((-0.5, -0.5), (0.5, 0.5), 1.0, false)]).is_empty());
    assert!(search(&[floor(), rectangle((-1.0, -1.0), (1.0, 1.0), -2.0, true)]).is_empty());
}

/// The published arrangement: a square light 1 m above the floor, a square blocker half-way.
fn blocker_plane() -> Vec<Vec<DVec3>> {
    vec![
        rectangle((-2.0, -2.0), (2.0, 2.0), 0.0, false),
        rectangle((-0.5, -0.5), (0.5, 0.5), 1.0, true),
        rectangle((-0.25, -0.25), (0.25, 0.25), 0.5, false),
    ]
}

#[test]
fn square_light_and_square_blocker_by_hand() {
    let outlines = blocker_plane();
    let sides = |outline: &[DVec3]| edges(outline).collect::<Vec<_>>();
    // Half-way up, the blocker's point b throws the light's point s to 2 b − s.
    let vertex_edge: Vec<[DVec3; 2]> = outlines[1]
        .iter()
        .flat_map(|&s| sides(&outlines[2]).into_iter().map(move |edge| edge.map(|b| 2.0 * b - s)))
        .collect();
    let edge_vertex: Vec<[DVec3; 2]> = outlines[2]
        .iter()
        .flat_map(|&b| sides(&outlines[1]).into_iter().map(move |edge| edge.map(|s| 2.0 * b - s)))
        .collect();
    let found = search(&outlines);
    assert_same(&of_kind(&found, LineKind::VertexEdge), &vertex_edge);
    assert_same(&of_kind(&found, LineKind::EdgeVertex), &edge_vertex);
    assert_eq!(found.len(), 32);
    for line in &found {
        assert_eq!((line.receiver, line.source, line.blocker), (0, 1, 2));
        assert!((line.weight - 1.0).abs() < 1e-12, "the blocker is half-way on every ray");
    }
    let events: Vec<u32> = found.iter().map(|line| line.event).collect();
    assert_eq!(events, (0..32).collect::<Vec<_>>());
    assert!(search_above(&outlines, Weight::Ratio, 1.0 + 1e-9).is_empty());

    // The same with a back for the blocker.
    let mut two_sided = outlines.clone();
    two_sided.push(rectangle((-0.25, -0.25), (0.25, 0.25), 0.5, true));
    let again = search(&two_sided);
    assert_same(&of_kind(&again, LineKind::VertexEdge), &vertex_edge);
    assert_same(&of_kind(&again, LineKind::EdgeVertex), &edge_vertex);
}

#[test]
fn corners_that_do_not_turn_make_no_lines() {
    let mut outlines = blocker_plane();
    for (outline, t) in outlines[1..].iter_mut().zip([0.5, 0.3]) {
        outline.insert(1, outline[0].lerp(outline[1], t));
    }
    let found = search(&outlines);
    let plain = search(&blocker_plane());
    assert_same(&of_kind(&found, LineKind::EdgeVertex), &of_kind(&plain, LineKind::EdgeVertex));
    // The blocker's side is two edges now, and each is an event.
    assert_eq!(of_kind(&found, LineKind::VertexEdge).len(), 4 * 5);
}

#[test]
fn only_the_silhouette_of_a_cube_casts_lines() {
    let light = rectangle((2.0, -0.2), (2.3, 0.2), 3.0, true);
    let mut outlines = vec![floor(), light.clone()];
    outlines.extend(cuboid(v(-0.5, -0.5, 0.0), v(0.5, 0.5, 1.0)));
    let found = search(&outlines);
    let cube: Vec<DVec3> = outlines[2..].concat();
    // From every corner of the light the top front, left and back edges and two upright ones: the shadow's outline.
    assert_eq!(of_kind(&found, LineKind::VertexEdge).len(), 4 * 5);
    for line in found.iter().filter(|line| line.kind == LineKind::VertexEdge) {
        let apex = line.rays[0].source;
        assert!(light.contains(&apex) && line.rays[1].source == apex);
        let across = (line.ends[1] - line.ends[0]).cross(DVec3::Z).normalize();
        let sides = cube.iter().map(|&corner| {
            let shadow = apex + (corner - apex) * (apex.z / (apex.z - corner.z));
            across.dot(shadow - line.ends[0])
        });
        let (low, high) = sides.fold((0.0, 0.0), |(low, high): (f64, f64), side| (low.min(side), high.max(side)));
        assert!(low > -1e-9 || high < 1e-9, "{line:?} is inside the shadow");
    }
    // Upright edges stand on the floor: their lines start there.
    let contacts = [v(0.5, -0.5, 0.0), v(0.5, 0.5, 0.0)];
    for contact in contacts {
        let starts = |line: &&Discontinuity| line.ends.iter().any(|end| end.distance(contact) < 1e-9);
        let at_contact: Vec<_> = found.iter().filter(starts).collect();
        assert_eq!(at_contact.len(), 4);
        assert!(at_contact.iter().all(|line| line.weight > 10.0));
    }
    // Of the top corners, the one towards the light is inside the outline, except for none: it is on its front side.
    for line in found.iter().filter(|line| line.kind == LineKind::EdgeVertex) {
        assert!((line.rays[0].blocker.z - 1.0).abs() < 1e-12);
    }
}

#[test]
fn horizon_of_a_tilted_source() {
    // The source's plane is z = x + 1 (seen from below right); it meets the floor in x = −1.
    let source = vec![v(0.0, -0.5, 1.0), v(0.0, 0.5, 1.0), v(1.0, 0.5, 2.0), v(1.0, -0.5, 2.0)];
    let line = [v(-1.0, -4.0, 0.0), v(-1.0, 4.0, 0.0)];
    let found = search(&[floor(), source.clone()]);
    assert_same(&of_kind(&found, LineKind::Horizon), &[line]);
    assert_eq!((found.len(), found[0].blocker), (1, 1));
    // A wall along the plane of symmetry hides nothing: either half of the floor sees its half of the source.
    let screen = vec![v(-0.5, 0.0, 0.0), v(-0.4, 0.0, 0.0), v(-0.4, 0.0, 3.0), v(-0.5, 0.0, 3.0)];
    assert_same(&of_kind(&search(&[floor(), source.clone(), screen]), LineKind::Horizon), &[line]);
    // A wall across, half-way between source and line in plan, hides all of the source where its shadows from all
    // corners overlap: the far corners decide, (1, ½) past (−½, 1) to (−1, 7/6), and mirrored.
    let across = vec![v(-0.5, -1.0, 0.0), v(-0.5, 1.0, 0.0), v(-0.5, 1.0, 3.0), v(-0.5, -1.0, 3.0)];
    let hidden = [v(-1.0, -7.0 / 6.0, 0.0), v(-1.0, 7.0 / 6.0, 0.0)];
    assert_same(
        &of_kind(&search(&[floor(), source, across]), LineKind::Horizon),
        &[[line[0], hidden[0]], [hidden[1], line[1]]],
    );
}

#[test]
fn no_horizon_along_the_border_nor_in_the_contact() {
    let wall = |from: DVec3, to: DVec3| vec![from, to, to + DVec3::Z, from + DVec3::Z];
    assert!(search(&[floor(), wall(v(-4.0, 4.0, 0.0), v(4.0, 4.0, 0.0))]).is_empty());
    // A wall in the middle of the floor, half as long as the floor: the line goes on beyond its ends.
    let found = search(&[floor(), wall(v(-2.0, 0.0, 0.0), v(2.0, 0.0, 0.0))]);
    let expected = [[v(-4.0, 0.0, 0.0), v(-2.0, 0.0, 0.0)], [v(2.0, 0.0, 0.0), v(4.0, 0.0, 0.0)]];
    assert_same(&of_kind(&found, LineKind::Horizon), &expected);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].event, found[1].event);
}

#[test]
fn what_stands_in_a_swath_casts_a_gap() {
    // A plate between the blocker and the floor: rays of height 1 → 0 cross it at height ¼.
    let mut outlines = blocker_plane();
    outlines.push(rectangle((-0.2, -1.0), (0.1, 1.0), 0.25, false));
    let found = search(&outlines);
    let (s, b) = (v(0.5, 0.5, 1.0), [v(-0.25, -0.25, 0.5), v(0.25, -0.25, 0.5)]);
    // In the swath of s and b, a floor point with x = X is reached across x = ¾ X + ¼ s.x at height ¼: a gap from
    // (−0.2 − 0.125) / ¾ to (0.1 − 0.125) / ¾; and y = 2 b.y − s.y = −1 is reached across −0.625: inside the plate.
    let line = b.map(|b| 2.0 * b - s);
    let gap = [-0.325 / 0.75, -0.025 / 0.75];
    let pieces = [[line[0], v(gap[0], -1.0, 0.0)], [v(gap[1], -1.0, 0.0), line[1]]];
    let is_swath = |line: &&Discontinuity| {
        line.blocker == 2 && line.rays.iter().all(|ray| ray.source == s && b[0].y == ray.blocker.y)
    };
    let of_swath: Vec<_> = found.iter().filter(is_swath).collect();
    assert_same(&of_swath.iter().map(|line| line.ends).collect::<Vec<_>>(), &pieces);
    assert!(of_swath.iter().all(|line| line.event == of_swath[0].event && line.weight == of_swath[0].weight));

    // The same plate above the blocker, at height ¾: x = ¼ X + ¾ s.x in the swath, and y = −1 is reached across 0.125.
    let mut outlines = blocker_plane();
    outlines.push(rectangle((0.2, -1.0), (0.3, 1.0), 0.75, false));
    let found = search(&outlines);
    let gap = [(0.2 - 0.375) * 4.0, (0.3 - 0.375) * 4.0];
    let pieces = [[line[0], v(gap[0], -1.0, 0.0)], [v(gap[1], -1.0, 0.0), line[1]]];
    assert_same(&found.iter().filter(is_swath).map(|line| line.ends).collect::<Vec<_>>(), &pieces);
}

#[test]
fn a_plate_that_covers_all_leaves_its_own_lines_only() {
    let mut outlines = blocker_plane();
    outlines.push(rectangle((-1.5, -1.5), (1.5, 1.5), 0.25, false));
    assert!(search(&outlines).iter().all(|line| line.blocker == 3));
    // Nothing behind the light or under the floor blocks.
    let mut outlines = blocker_plane();
    outlines.truncate(2);
    outlines.push(rectangle((-0.3, -0.3), (0.3, 0.3), 1.5, false));
    outlines.push(rectangle((-0.3, -0.3), (0.3, 0.3), -0.5, false));
    outlines.push(rectangle((-0.3, -0.3), (0.3, 0.3), 1.0, false));
    outlines.push(rectangle((-0.3, -0.3), (0.3, 0.3), 0.0, false));
    assert!(search(&outlines).is_empty());
}

#[test]
fn a_plate_that_comes_from_behind_the_light_hides_nothing_there() {
    let mut outlines = blocker_plane();
    outlines.push(vec![v(0.0, -2.0, 1.5), v(1.5, -2.0, 0.9), v(1.5, 2.0, 0.9), v(0.0, 2.0, 1.5)]);
    let found: Vec<Discontinuity> = search(&outlines).into_iter().filter(|line| line.blocker == 2).collect();
    let plain = search(&blocker_plane());
    for kind in KINDS {
        assert_same(&of_kind(&found, kind), &of_kind(&plain, kind));
    }
}

#[test]
fn swaths_to_infinity_end_at_the_receivers_border() {
    // A mast higher than the light: its upright edges' lines go from the foot to the border.
    let light = rectangle((1.0, -0.1), (1.2, 0.1), 1.0, true);
    let mast = vec![v(0.0, -0.1, 0.0), v(0.0, 0.1, 0.0), v(0.0, 0.1, 3.0), v(0.0, -0.1, 3.0)];
    let found = search(&[floor(), light.clone(), mast]);
    let expected: Vec<[DVec3; 2]> = light
        .iter()
        .flat_map(|s| [-0.1, 0.1].map(|y| [v(0.0, y, 0.0), v(-4.0, y + (y - s.y) * 4.0 / s.x, 0.0)]))
        .collect();
    assert_same(&of_kind(&found, LineKind::VertexEdge), &expected);
    assert!(of_kind(&found, LineKind::EdgeVertex).is_empty());
}

#[test]
fn a_line_along_the_border_divides_nothing() {
    // The border, the light's corners and the post's edge are in one plane.
    let light = rectangle((2.0, 3.8), (2.5, 4.0), 3.0, true);
    let post = vec![v(0.0, 4.0, 0.0), v(0.0, 3.9, 0.0), v(0.0, 3.9, 1.0), v(0.0, 4.0, 1.0)];
    let found = search(&[floor(), light, post]);
    assert!(!found.is_empty());
    assert!(found.iter().all(|line| line.ends.iter().any(|end| end.y < 3.999)), "{found:?}");
}

#[test]
fn an_edge_counts_when_only_one_of_its_faces_is_listed() {
    let ridge = [v(0.0, -0.3, 0.6), v(0.0, 0.3, 0.6)];
    let slope = |x: f64| vec![ridge[0], ridge[1], v(x, 0.3, 0.4), v(x, -0.3, 0.4)];
    let mut right = slope(0.3);
    right.reverse();
    let scene = welded(&[floor(), rectangle((1.0, -0.2), (1.2, 0.2), 0.8, true), slope(-0.3), right]);
    let half_edges = HalfEdges::new(&scene);
    let on_ridge = |blockers: Vec<u32>| {
        let interactions = [Interaction { source: 1, far_outline: None, radiosity: 1.0, blockers }];
        let found = discontinuities(&scene, &half_edges, 0, &interactions, Weight::Ratio, 0.0);
        let grazes = |line: &&Discontinuity| line.rays.iter().all(|ray| ray.blocker.x == 0.0 && ray.blocker.z == 0.6);
        let is_swath = |line: &&Discontinuity| line.kind == LineKind::VertexEdge && grazes(line);
        found.iter().filter(is_swath).count()
    };
    // Seen from the light one slope shows its front and the other its back.
    assert_eq!([on_ridge(vec![2, 3]), on_ridge(vec![2]), on_ridge(vec![3])], [4, 4, 4]);
}

#[test]
fn a_foot_on_a_table_is_no_corner() {
    // Seen from the wall, the foot of a box on a table is hidden by the table from a light above, whether the box has
    // a bottom or not; and a table's leg by the table's top.
    let wall = vec![v(-4.0, 4.0, -30.0), v(4.0, 4.0, -30.0), v(4.0, 4.0, 4.0), v(-4.0, 4.0, 4.0)];
    let light = rectangle((-0.5, -0.5), (0.5, 0.5), 3.0, true);
    let mut outlines = vec![wall, light, rectangle((-1.0, -1.0), (1.0, 1.0), 1.0, false)];
    assert!(search(&outlines).iter().any(|line| line.blocker == 2));
    for hull in [cuboid(v(-0.2, -0.3, 1.0), v(0.3, 0.2, 1.5)), cuboid(v(-0.2, -0.3, 0.2), v(0.3, 0.2, 1.0))] {
        for faces in [&hull[..], &hull[1..]] {
            outlines.truncate(3);
            outlines.extend_from_slice(faces);
            for line in search(&outlines).iter().filter(|line| KINDS.contains(&line.kind)) {
                let grazed = line.rays.map(|ray| ray.blocker);
                let foot = |p: &DVec3| p.x.abs() < 0.9 && p.y.abs() < 0.9 && p.z <= 1.0 + 1e-9;
                assert!(!grazed.iter().all(foot), "{line:?}");
            }
        }
    }
}

#[test]
fn a_source_corner_under_another_polygon_is_hidden_behind_it() {
    // The light stands on a plate, which hides its lower corners from everything below the plate.
    let light = vec![v(0.0, -0.5, 2.0), v(0.0, 0.5, 2.0), v(0.0, 0.5, 3.0), v(0.0, -0.5, 3.0)];
    let plate = rectangle((-3.0, -3.0), (3.0, 3.0), 2.0, false);
    let blocker = rectangle((10.0, -0.2), (10.2, 0.2), 0.5, false);
    let wide = rectangle((-40.0, -40.0), (40.0, 40.0), 0.0, false);
    let found = search(&[wide, light, plate, blocker]);
    let of_blocker: Vec<_> = found.iter().filter(|line| line.blocker == 3).collect();
    assert!(!of_blocker.is_empty());
    assert!(of_blocker.iter().all(|line| line.rays.iter().any(|ray| ray.source.z > 2.1)), "{of_blocker:?}");
}

#[test]
fn a_larger_least_weight_gives_a_subset() {
    let mut outlines = blocker_plane();
    outlines.extend(cuboid(v(0.6, -0.4, 0.0), v(0.9, 0.1, 0.4)));
    for measure in [Weight::Ratio, Weight::Change] {
        let all = search_above(&outlines, measure, 0.0);
        for min_weight in [0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 10.0, 1e3] {
            let unnumbered = |line: &Discontinuity| Discontinuity { event: 0, ..*line };
            let some: Vec<Discontinuity> =
                search_above(&outlines, measure, min_weight).iter().map(unnumbered).collect();
            let expected: Vec<Discontinuity> =
                all.iter().filter(|line| line.weight >= min_weight).map(unnumbered).collect();
            assert_eq!(some, expected, "{measure:?} {min_weight}");
        }
    }
}

/// Whether a polygon stops a segment, by more than `margin` on every count, away from `grazed`.
fn stops(outline: &[DVec3], [from, to]: [DVec3; 2], grazed: DVec3, margin: f64) -> bool {
    let plane = Plane::through(outline);
    let (before, after) = (plane.distance(from), plane.distance(to));
    if before * after >= 0.0 || before.abs().min(after.abs()) < margin {
        return false;
    }
    let point = from.lerp(to, before / (before - after));
    let inside = |[a, b]: [DVec3; 2]| plane.normal.cross(b - a).normalize().dot(point - a) > margin;
    edges(outline).all(inside) && point.distance(grazed) > 10.0 * margin
}

/// Whether a segment enters a convex body whose faces are moved outwards by `by`.
fn enters(body: &[Vec<DVec3>], [from, to]: [DVec3; 2], by: f64) -> bool {
    let mut part = [0.0, 1.0];
    body.iter().all(|face| {
        let plane = Plane::through(face);
        clip(&mut part, by - plane.distance(from), by - plane.distance(to))
    })
}

/// A floor, a tilted light above it, and boxes: some stand on the floor, some hang tilted, some reach through it.
fn clutter() -> impl Strategy<Value = Vec<Vec<DVec3>>> {
    let unit = || prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from);
    let tilt = |scale: f64| unit().prop_map(move |axis| DQuat::from_scaled_axis(axis * scale));
    let boxes = prop::collection::vec((unit(), prop::array::uniform3(0.1..1.0f64), tilt(3.0), any::<bool>()), 1..4);
    (tilt(1.0), unit(), prop::array::uniform2(0.2..1.5f64), boxes).prop_map(|(tilt, shift, [a, b], boxes)| {
        let light = rectangle((-a, -b), (a, b), 0.0, true);
        let light = light.into_iter().map(|corner| tilt * corner + v(0.0, 0.0, 5.0) + shift).collect();
        let mut outlines = vec![floor(), light];
        for (place, size, tilt, stands) in boxes {
            let half = DVec3::from(size) / 2.0;
            let turn = |corner: DVec3| if stands { corner } else { tilt * corner };
            let centre = if stands { v(place.x, place.y, half.z) } else { place + v(0.0, 0.0, 1.0) };
            let faces = cuboid(-half, half);
            // Every corner is computed once, so that the faces weld.
            outlines.extend(faces.into_iter().map(|face| face.into_iter().map(|p| turn(p) + centre).collect()));
        }
        outlines
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_ray_to_a_line_is_free_but_for_the_grazed_point(outlines in clutter()) {
        let light_plane = Plane::through(&outlines[1]);
        for line in search(&outlines).iter().filter(|line| KINDS.contains(&line.kind)) {
            for (end, ray) in line.ends.iter().zip(&line.rays) {
                prop_assert!(end.z.abs() < 1e-9 && end.abs().max_element() < 4.0 + 1e-9);
                prop_assert!((ray.blocker - ray.source).cross(end - ray.source).length() < 1e-8);
            }
            for t in [0.1, 0.5, 0.9] {
                let point = line.ends[0].lerp(line.ends[1], t);
                let ray = crate::weight::ray_between(line, t);
                let (there, here) = (ray.blocker - ray.source, point - ray.source);
                prop_assert!(there.cross(here).length() < 1e-8 && there.length() < here.length() + 1e-9);
                prop_assert!(there.dot(here) > 0.0);
                prop_assert!(light_plane.distance(point) > 0.0 && light_plane.distance(ray.source).abs() < 1e-9);
                for outline in &outlines[2..] {
                    prop_assert!(!stops(outline, [ray.source, point], ray.blocker, 1e-7), "{line:?} at {t}");
                }
            }
        }
    }

    #[test]
    fn every_free_grazing_ray_ends_on_a_line(outlines in clutter(), u in 0.0..1.0f64) {
        let found = search(&outlines);
        let light_plane = Plane::through(&outlines[1]);
        let is_on = |kind: LineKind, point: DVec3| found.iter().filter(|line| line.kind == kind).any(|line| {
            let [a, b] = line.ends;
            let t = ((point - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
            a.lerp(b, t).distance(point) < 1e-7
        });
        let bodies: Vec<&[Vec<DVec3>]> = outlines[2..].chunks(6).collect();
        for (i, body) in bodies.iter().enumerate() {
            let mut rays: Vec<(LineKind, DVec3, DVec3)> = Vec::new();
            for edge in body.iter().flat_map(|face| edges(face)) {
                rays.extend(outlines[1].iter().map(|&s| (LineKind::VertexEdge, s, edge[0].lerp(edge[1], u))));
                rays.extend(edges(&outlines[1]).map(|[a, b]| (LineKind::EdgeVertex, a.lerp(b, u), edge[0])));
            }
            for (kind, source, blocker) in rays {
                let along = blocker - source;
                if along.z > -0.05 || blocker.z < 0.05 {
                    continue;
                }
                let point = source + along * (source.z / -along.z);
                let lands = point.abs().max_element() < 3.999 && light_plane.distance(point) > 1e-3;
                let is_free = (0..bodies.len()).all(|other| other == i || !enters(bodies[other], [source, point], 1e-4));
                if lands && is_free && !enters(body, [source, point], -1e-9) {
                    prop_assert!(is_on(kind, point), "{:?} {:?} {:?} {:?}", kind, source, blocker, point);
                }
            }
        }
    }
}
