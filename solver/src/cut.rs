//! Cutting polygons into patches along their contact and intersection lines (Baum, Mann, Smith & Winget 1991).
//!
//! Where another polygon meets a receiver, irradiance may jump: light on one side of a wall says nothing about the
//! other. No element ever lies on both sides of such a line, which is half of what makes leaks impossible. What we do
//! differently: a line cuts only what it runs through, so that a wall does not divide the floor beyond its ends more
//! than convex pieces need.

use glam::DVec3;
use rayon::prelude::*;
use scene::{Plane, Scene, Welder, area_vector};

use crate::Cut;
use crate::clip::clip_convex;
use crate::contour::edges;
use crate::geometry::Geometry;
use crate::polygon_tree::PolygonTree;

/// Distance below which a point lies on a line or a corner while a polygon is cut, as a fraction of its diameter.
const COINCIDENT: f64 = 1e-9;

/// Distance of the points next to a corner of the polygon within which lines may be one, as a fraction of its diameter. Less
/// takes short cuts along one line, whose ends say less of it, for cuts along two; more compares more lines.
const SAME_FOOT: f64 = 1e-6;

/// Smallest piece cut off, as a fraction of the polygon's squared diameter: what is smaller is rounding.
const SMALLEST_PIECE: f64 = 1e-12;

/// Lines compared for each split. More find better splits where hundreds of polygons stand on one, at a cost that
/// grows with the product of both numbers.
const MOST_CANDIDATES: usize = 32;

/// Segments in a piece from which on it is divided evenly first: lines as they come would peel off one box of a hall after another,
/// and all others would be looked at again for each. Fewer cut up more of what stands on one floor.
const MANY_SEGMENTS: usize = 1000;

/// Contact and intersection lines on every polygon, ascending in the other polygon.
///
/// A polygon contributes the segment along which it crosses the receiver's plane, the edges with which it stands on
/// the receiver's front, and all edges if it lies in the receiver's plane, each clipped to the receiver. Lines along
/// the receiver's own border have nothing to cut and are left out, like contacts from behind, which change no light.
pub fn contact_lines(scene: &Scene) -> Vec<Vec<Cut>> {
    let geometry = Geometry::new(scene);
    let tree = PolygonTree::new(scene);
    let lines = |id| lines_on(&geometry, id, &tree.around(geometry.outline(id), geometry.contact_tolerance));
    scene.polygon_ids().into_par_iter().map(lines).collect()
}

/// The lines that other polygons draw on one.
fn lines_on(geometry: &Geometry, polygon: u32, others: &[u32]) -> Vec<Cut> {
    let (outline, plane) = (geometry.outline(polygon), geometry.plane(polygon));
    let tolerance = geometry.contact_tolerance;
    let mut cuts = Vec::new();
    if plane.normal == DVec3::ZERO {
        return cuts;
    }
    for &other in others {
        for_each_contact(&plane, geometry.outline(other), tolerance, |ends| {
            if let Some(ends) = clip_segment(outline, plane.normal, ends, tolerance) {
                cuts.push(Cut { ends, other });
            }
        });
    }
    cuts
}

/// The segments in which a polygon meets a plane, unless it touches the plane only from behind.
fn for_each_contact(plane: &Plane, outline: &[DVec3], tolerance: f64, mut visit: impl FnMut([DVec3; 2])) {
    let height = |point| plane.distance(point);
    let (mut in_front, mut behind) = (false, false);
    for &corner in outline {
        in_front |= height(corner) > tolerance;
        behind |= height(corner) < -tolerance;
    }
    if behind && !in_front {
        return;
    }
    if !behind {
        for [from, to] in edges(outline) {
            if height(from) <= tolerance && height(to) <= tolerance {
                visit([from, to]);
            }
        }
        return;
    }
    // It crosses. A convex outline passes through the plane twice, at a corner or within an edge.
    let mut ends = [None; 2];
    let mut pass = |point| {
        let free = if ends[0].is_none() { 0 } else { 1 };
        ends[free] = Some(point);
    };
    for [from, to] in edges(outline) {
        let (start, end) = (height(from), height(to));
        if start.abs() <= tolerance {
            pass(from);
        } else if end.abs() > tolerance && (start > 0.0) != (end > 0.0) {
            pass(from + (to - from) * (start / (start - end)));
        }
    }
    if let [Some(from), Some(to)] = ends {
        visit([from, to]);
    }
}

/// The part of a segment inside a convex outline, in whose plane it lies; none if that is shorter than the tolerance
/// or runs along the border.
fn clip_segment(outline: &[DVec3], normal: DVec3, ends: [DVec3; 2], tolerance: f64) -> Option<[DVec3; 2]> {
    let mut ends = ends;
    for [from, to] in edges(outline) {
        let Some(inward) = normal.cross(to - from).try_normalize() else { continue };
        let [start, end] = ends.map(|point| inward.dot(point - from));
        if start <= tolerance && end <= tolerance {
            return None;
        }
        let crossing = ends[0] + (ends[1] - ends[0]) * (start / (start - end));
        if start < -tolerance {
            ends[0] = crossing;
        } else if end < -tolerance {
            ends[1] = crossing;
        }
    }
    (ends[0].distance(ends[1]) > tolerance).then_some(ends)
}

/// Cuts a convex polygon into convex pieces such that every cut lies on their borders.
///
/// The pieces cover the polygon, keep its winding, and share corners bit by bit; a corner of one may lie within an
/// edge of another. They are the leaves of a binary space partition over the cuts' lines (Fuchs, Kedem & Naylor 1980),
/// in an order that depends on the input only. A cut is left out where it would cut off less than rounding can tell.
pub fn cut_polygon(outline: &[DVec3], cuts: &[Cut]) -> Vec<Vec<DVec3>> {
    let normal = area_vector(outline).normalize_or_zero();
    let diameter = edges(outline).map(|[from, to]| from.distance(to)).sum::<f64>() / 2.0;
    if normal == DVec3::ZERO || cuts.is_empty() {
        return vec![outline.to_vec()];
    }
    let knife = Knife { normal, tolerance: COINCIDENT * diameter, smallest: SMALLEST_PIECE * diameter * diameter };
    let mut lines = Lines::new(outline[0], knife.tolerance, diameter);
    let mut segments = Vec::new();
    for cut in cuts {
        let Some(ends) = clip_segment(outline, normal, cut.ends, knife.tolerance) else { continue };
        // Cuts along one line, of the two sides of a wall or of adjoining walls, share its first description.
        let Some(across) = normal.cross(cut.ends[1] - cut.ends[0]).try_normalize() else { continue };
        segments.push(Segment { line: lines.along(Line { across, through: cut.ends[0] }, ends), ends });
    }
    let mut pieces = Vec::new();
    knife.partition(outline.to_vec(), segments, &lines.lines, &mut pieces);
    weld(outline, &mut pieces, knife.tolerance);
    pieces
}

/// A line in the polygon's plane.
struct Line {
    /// Unit vector across it, in the plane.
    across: DVec3,
    through: DVec3,
}

impl Line {
    fn distance(&self, point: DVec3) -> f64 {
        self.across.dot(point - self.through)
    }
}

/// The lines along which one polygon is cut, each described once.
struct Lines {
    lines: Vec<Line>,
    /// By line, its point next to a corner of the polygon: lines that are one have it in common.
    feet: Welder,
    corner: DVec3,
    tolerance: f64,
}

impl Lines {
    fn new(corner: DVec3, tolerance: f64, diameter: f64) -> Self {
        Self { lines: Vec::new(), feet: Welder::new(SAME_FOOT * diameter), corner, tolerance }
    }

    /// The first line that a segment lies on, which is `line` if none does yet.
    fn along(&mut self, line: Line, ends: [DVec3; 2]) -> usize {
        let foot = self.corner - line.across * line.distance(self.corner);
        let is_on = |line: &Line| ends.iter().all(|&end| line.distance(end).abs() <= self.tolerance);
        let known = self.feet.near(foot).filter(|&line| is_on(&self.lines[line as usize])).min();
        known.map_or_else(
            || {
                self.lines.push(line);
                self.feet.push(foot) as usize
            },
            |known| known as usize,
        )
    }
}

/// What is left of a cut within a piece.
#[derive(Clone, Copy)]
struct Segment {
    line: usize,
    ends: [DVec3; 2],
}

/// What stays the same while one polygon is cut.
struct Knife {
    normal: DVec3,
    tolerance: f64,
    smallest: f64,
}

impl Knife {
    /// Cuts a piece until no segment runs through its inside.
    fn partition(&self, piece: Vec<DVec3>, segments: Vec<Segment>, lines: &[Line], pieces: &mut Vec<Vec<DVec3>>) {
        let Some(halves) = self.best_split(&piece, &segments, lines) else {
            pieces.push(piece);
            return;
        };
        for half in halves {
            let inside = |segment: &Segment| {
                let ends = clip_segment(&half, self.normal, segment.ends, self.tolerance)?;
                Some(Segment { line: segment.line, ends })
            };
            let within = segments.iter().filter_map(inside).collect();
            self.partition(half, within, lines, pieces);
        }
    }

    /// Divides a piece along one of the lines in it; none if nothing is left to divide.
    fn best_split(&self, piece: &[DVec3], segments: &[Segment], lines: &[Line]) -> Option<[Vec<DVec3>; 2]> {
        let even = (segments.len() >= MANY_SEGMENTS).then(|| self.even_split(piece, segments, lines)).flatten();
        even.or_else(|| self.clean_split(piece, segments, lines))
    }

    /// Divides a piece along that of a few lines from all over it which leaves the fewest segments in the fuller half.
    fn even_split(&self, piece: &[DVec3], segments: &[Segment], lines: &[Line]) -> Option<[Vec<DVec3>; 2]> {
        let fuller = |line: &Line| {
            let mut in_halves = [0, 0];
            for segment in segments {
                let [start, end] = segment.ends.map(|point| line.distance(point));
                in_halves[0] += usize::from(start.max(end) > self.tolerance);
                in_halves[1] += usize::from(start.min(end) < -self.tolerance);
            }
            in_halves[0].max(in_halves[1])
        };
        let candidates = segments.iter().step_by(segments.len().div_ceil(MOST_CANDIDATES));
        let mut ranked: Vec<(usize, usize)> =
            candidates.map(|segment| (fuller(&lines[segment.line]), segment.line)).collect();
        ranked.sort_unstable();
        ranked.into_iter().find_map(|(_, line)| self.split(piece, &lines[line]))
    }

    /// Divides a piece along the line that divides the fewest other segments; among those, along the one that leaves
    /// the fattest pieces, the first of equals.
    fn clean_split(&self, piece: &[DVec3], segments: &[Segment], lines: &[Line]) -> Option<[Vec<DVec3>; 2]> {
        let mut best: Option<(usize, f64, [Vec<DVec3>; 2])> = None;
        let mut tried: Vec<usize> = Vec::new();
        for segment in segments {
            if tried.contains(&segment.line) {
                continue;
            }
            if tried.len() == MOST_CANDIDATES && best.is_some() {
                break;
            }
            tried.push(segment.line);
            let line = &lines[segment.line];
            let divided = |other: &&Segment| {
                let [start, end] = other.ends.map(|point| line.distance(point));
                start.min(end) < -self.tolerance && start.max(end) > self.tolerance
            };
            let count = segments.iter().filter(divided).count();
            if best.as_ref().is_some_and(|(fewest, ..)| count > *fewest) {
                continue;
            }
            let Some(halves) = self.split(piece, line) else { continue };
            let fatness = halves.iter().map(|half| fatness(half)).fold(f64::INFINITY, f64::min);
            if best.as_ref().is_none_or(|(fewest, fattest, _)| count < *fewest || fatness > *fattest) {
                best = Some((count, fatness, halves));
            }
        }
        best.map(|(_, _, halves)| halves)
    }

    /// Both sides of a line; none if one of them is negligible.
    fn split(&self, piece: &[DVec3], line: &Line) -> Option<[Vec<DVec3>; 2]> {
        let mut halves = [Vec::new(), Vec::new()];
        clip_convex(piece, self.tolerance, |point| line.distance(point), &mut halves[0]);
        clip_convex(piece, self.tolerance, |point| -line.distance(point), &mut halves[1]);
        halves.iter().all(|half| area_vector(half).length() > self.smallest).then_some(halves)
    }
}

/// Area over squared perimeter: 1/4π for a disk, 1/16 for a square, 0 for a sliver.
fn fatness(outline: &[DVec3]) -> f64 {
    let perimeter: f64 = edges(outline).map(|[from, to]| from.distance(to)).sum();
    area_vector(outline).length() / (perimeter * perimeter)
}

/// Moves corners that are the same but for rounding on the first of them; the polygon's own come first.
fn weld(outline: &[DVec3], pieces: &mut [Vec<DVec3>], tolerance: f64) {
    let mut corners = Welder::new(tolerance);
    outline.iter().for_each(|&corner| {
        corners.push(corner);
    });
    for corner in pieces.iter_mut().flatten() {
        let id = corners.vertex(*corner);
        *corner = corners.vertices()[id as usize];
    }
    for piece in pieces {
        piece.dedup();
        while piece.len() > 1 && piece.first() == piece.last() {
            piece.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;
    use scene::{Material, Polygon, is_convex};

    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn scene(outlines: &[Vec<DVec3>]) -> Scene {
        let mut scene =
            Scene { materials: vec![Material::grey("grey")], objects: vec![String::from("all")], ..Scene::default() };
        for outline in outlines {
            scene.polygons.push(Polygon {
                first_corner: scene.corners.len() as u32,
                corner_count: outline.len() as u32,
                material: 0,
                object: 0,
            });
            for &corner in outline {
                scene.corners.push(scene.vertices.len() as u32);
                scene.vertices.push(corner);
            }
        }
        scene
    }

    fn rectangle(corner: DVec3, first: DVec3, second: DVec3) -> Vec<DVec3> {
        vec![corner, corner + first, corner + first + second, corner + second]
    }

    /// A floor of 4 × 4 m with its front up, and what else there is.
    fn on_floor(others: &[Vec<DVec3>]) -> Scene {
        let floor = rectangle(DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0);
        scene(&[&[floor], others].concat())
    }

    /// The sides of a box with its front outwards, without bottom and top.
    fn sides(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
        let ring = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
        (0..4)
            .map(|i| {
                let ((x0, y0), (x1, y1)) = (ring[i], ring[(i + 1) % 4]);
                vec![v(x0, y0, low.z), v(x1, y1, low.z), v(x1, y1, high.z), v(x0, y0, high.z)]
            })
            .collect()
    }

    fn area(outline: &[DVec3]) -> f64 {
        area_vector(outline).length()
    }

    /// Cuts a polygon of a scene and checks everything that holds for any pieces.
    #[track_caller]
    fn pieces_of(scene: &Scene, polygon: u32, cuts: &[Cut]) -> Vec<Vec<DVec3>> {
        let outline = scene.outline(polygon);
        let pieces = cut_polygon(&outline, cuts);
        let normal = scene.plane(polygon).normal;
        let size = scene.size();
        let total: f64 = pieces.iter().map(|piece| area_vector(piece).dot(normal)).sum();
        assert!((total / area(&outline) - 1.0).abs() < 1e-12, "area {total} of {}", area(&outline));
        for piece in &pieces {
            assert!(piece.len() >= 3 && is_convex(piece, normal, 1e-6));
            for cut in cuts {
                assert!(clip_segment(piece, normal, cut.ends, size * 2e-9).is_none(), "{cut:?} runs through {piece:?}");
            }
        }
        let corners: Vec<DVec3> = pieces.iter().flatten().copied().collect();
        for a in &corners {
            assert!(corners.iter().all(|b| a == b || a.distance(*b) > size * 1e-10), "two corners beside each other");
        }
        pieces
    }

    #[test]
    fn degenerate_input() {
        assert!(contact_lines(&Scene::default()).is_empty());
        let line = vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
        assert_eq!(contact_lines(&on_floor(&[line.clone(), vec![DVec3::ONE; 3]]))[1..], [vec![], vec![]]);
        let cut = Cut { ends: [v(1., 1., 0.), v(1., 1., 0.)], other: 0 };
        assert_eq!(cut_polygon(&line, &[cut]), vec![line]);
        assert!(cut_polygon(&[], &[cut]).iter().all(Vec::is_empty));
        let square = rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        let outside = Cut { ends: [v(2., 0., 0.), v(2., 1., 0.)], other: 0 };
        let not_a_number = Cut { ends: [v(f64::NAN, 0., 0.), v(2., 1., 0.)], other: 0 };
        assert_eq!(cut_polygon(&square, &[cut, outside, not_a_number]), vec![square]);
    }

    #[test]
    fn box_on_a_floor() {
        let scene = on_floor(&sides(v(1., 1.5, 0.), v(2., 2., 0.7)));
        let cuts = contact_lines(&scene);
        assert_eq!(cuts[0].iter().map(|cut| cut.other).collect::<Vec<_>>(), [1, 2, 3, 4]);
        assert!(cuts[1..].iter().all(Vec::is_empty));
        let pieces = pieces_of(&scene, 0, &cuts[0]);
        assert_eq!(pieces.len(), 5);
        let footprint = [v(1., 1.5, 0.), v(2., 1.5, 0.), v(2., 2., 0.), v(1., 2., 0.)];
        assert!(pieces.iter().any(|piece| piece.len() == 4 && footprint.iter().all(|p| piece.contains(p))));
        // With a bottom that lies on the floor, face down, the pieces are the same.
        let mut closed = sides(v(1., 1.5, 0.), v(2., 2., 0.7));
        closed.push(footprint.iter().rev().copied().collect());
        let closed = on_floor(&closed);
        let cuts = contact_lines(&closed);
        assert_eq!(cuts[0].len(), 8);
        assert_eq!(pieces_of(&closed, 0, &cuts[0]), pieces);
    }

    /// More lines than are compared one by one: divided evenly first, with hardly more pieces than each post alone makes.
    #[test]
    fn a_floor_full_of_posts() {
        let post = |i: u32| {
            let place = v(f64::from(i % 17) * 0.23 + 0.05, f64::from(i / 17) * 0.23 + 0.03 * f64::from(i % 3), 0.0);
            sides(place, place + v(0.1, 0.08, 1.0))
        };
        let scene = on_floor(&(0..260).flat_map(post).collect::<Vec<_>>());
        let cuts = contact_lines(&scene);
        assert!(cuts[0].len() > MANY_SEGMENTS);
        let pieces = pieces_of(&scene, 0, &cuts[0]);
        assert!(pieces.len() < 260 * 5, "{} pieces", pieces.len());
    }

    #[test]
    fn contacts_from_behind_and_along_borders_are_none() {
        // A cellar wall under the floor, a room's wall along the floor's border, a neighbour in the same plane, a
        // picture in front of a wall, a post that touches with one corner.
        let scene = on_floor(&[
            rectangle(v(1., 1., -1.), DVec3::X, DVec3::Z),
            rectangle(DVec3::ZERO, DVec3::X * 4.0, DVec3::Z * 2.7),
            rectangle(v(4., 1., 0.), DVec3::X, DVec3::Y),
            rectangle(v(1., 0.03, 1.), DVec3::X, DVec3::Z),
            vec![v(2., 2., 0.), v(3., 2., 1.), v(2., 3., 1.)],
        ]);
        assert!(contact_lines(&scene).iter().all(Vec::is_empty));
    }

    #[test]
    fn wall_through_a_floor() {
        let wall = rectangle(v(1., 2., -0.5), DVec3::X * 2.0, DVec3::Z * 2.0);
        let mut back = wall.clone();
        back.reverse();
        let scene = on_floor(&[wall, back]);
        let cuts = contact_lines(&scene);
        assert_eq!(cuts[0].len(), 2);
        for cut in &cuts[0] {
            let [from, to] = cut.ends;
            assert!(from.min(to).distance(v(1., 2., 0.)) < 1e-15 && from.max(to).distance(v(3., 2., 0.)) < 1e-15);
        }
        assert_eq!(pieces_of(&scene, 0, &cuts[0]).len(), 2);
        for wall in [1, 2] {
            let areas: Vec<f64> =
                pieces_of(&scene, wall, &cuts[wall as usize]).iter().map(|piece| area(piece)).collect();
            assert_eq!(areas.len(), 2);
            assert!((areas[0].min(areas[1]) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn crossing_walls_and_a_t_contact() {
        let crossing = on_floor(&[
            rectangle(v(1., 2., 0.), DVec3::X * 2.0, DVec3::Z),
            rectangle(v(2., 1., 0.), DVec3::Y * 2.0, DVec3::Z),
        ]);
        let cuts = contact_lines(&crossing);
        assert_eq!(cuts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1, 1]);
        let pieces = pieces_of(&crossing, 0, &cuts[0]);
        assert!((3..=4).contains(&pieces.len()));
        assert_eq!(pieces_of(&crossing, 1, &cuts[1]).len(), 2);
        let contact = on_floor(&[
            rectangle(v(1., 2., 0.), DVec3::X * 2.0, DVec3::Z),
            rectangle(v(2., 2., 0.), DVec3::Y * 2.0, DVec3::Z),
        ]);
        // The wall that is met shows its back: a rectangle along x and z faces −y.
        assert_eq!(contact_lines(&contact).iter().map(Vec::len).collect::<Vec<_>>(), [2, 0, 0]);
        let turned = on_floor(&[
            rectangle(v(3., 2., 0.), DVec3::X * -2.0, DVec3::Z),
            rectangle(v(2., 2., 0.), DVec3::Y * 2.0, DVec3::Z),
        ]);
        let cuts = contact_lines(&turned);
        assert_eq!(cuts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1, 0]);
        assert_eq!(pieces_of(&turned, 1, &cuts[1]).len(), 2);
    }

    #[test]
    fn overlap_in_one_plane() {
        let scene = on_floor(&[rectangle(v(3., 3., 0.), DVec3::X * 2.0, DVec3::Y * 2.0)]);
        let cuts = contact_lines(&scene);
        assert_eq!(cuts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        for polygon in [0, 1] {
            let pieces = pieces_of(&scene, polygon, &cuts[polygon as usize]);
            assert_eq!(pieces.len(), 3);
            assert!(pieces.iter().any(|piece| (area(piece) - 1.0).abs() < 1e-12));
        }
        let same = on_floor(&[rectangle(DVec3::ZERO, DVec3::Y * 4.0, DVec3::X * 4.0)]);
        assert!(contact_lines(&same).iter().all(Vec::is_empty));
    }

    /// Many posts on one floor: no piece lies on both sides of a post's border, in reasonable time.
    #[test]
    fn field_of_posts() {
        let mut posts = Vec::new();
        for i in 0..10 {
            for j in 0..10 {
                let low = v(0.1 + 0.39 * f64::from(i), 0.1 + 0.38 * f64::from(j) + 0.003 * f64::from(i), 0.0);
                posts.extend(sides(low, low + v(0.1, 0.07, 1.0)));
            }
        }
        let scene = on_floor(&posts);
        let cuts = contact_lines(&scene);
        assert_eq!(cuts[0].len(), 400);
        let pieces = pieces_of(&scene, 0, &cuts[0]);
        assert!(pieces.len() < 800, "{} pieces", pieces.len());
    }

    /// Polygons of an OBJ file, as far as this file uses the format.
    fn obj(text: &str) -> Scene {
        let mut vertices = Vec::new();
        let mut outlines = Vec::new();
        for line in text.lines() {
            let mut words = line.split_whitespace();
            let keyword = words.next();
            if keyword == Some("v") {
                let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
                vertices.push(DVec3::from_slice(&numbers));
            } else if keyword == Some("f") {
                let index = |word: &str| word.split('/').next().unwrap().parse::<usize>().unwrap() - 1;
                outlines.push(words.map(|word| vertices[index(word)]).collect());
            }
        }
        scene(&outlines)
    }

    #[test]
    fn office() {
        let scene = obj(include_str!("../../data/scenes/office.obj"));
        let cuts = contact_lines(&scene);
        assert_eq!(scene.polygons.len(), 109);
        let counts: Vec<usize> =
            scene.polygon_ids().map(|polygon| pieces_of(&scene, polygon, &cuts[polygon as usize]).len()).collect();
        assert_eq!(cuts, contact_lines(&scene));
        // The floor under 27 edges, the desk's underside over four legs, what stands on shelf, desk and walls.
        assert_eq!((counts[4], counts[16], counts[17]), (26, 20, 5));
        assert_eq!(counts.iter().sum::<usize>(), 201);
    }

    proptest! {
        /// Any cuts at all: what must hold for pieces holds.
        #[test]
        fn random_cuts(
            ends in proptest::collection::vec([0.0..4.0, 0.0..4.0, 0.0..4.0, 0.0..4.0], 0..12),
            snap in 0.0..1.0,
        ) {
            // Half of the time on a coarse grid, where cuts meet, overlap and touch each other.
            let place = |x: f64| if snap < 0.5 { x.round() } else { x };
            let cuts: Vec<Cut> = ends
                .iter()
                .map(|&[a, b, c, d]| Cut { ends: [v(place(a), place(b), 0.), v(place(c), place(d), 0.)], other: 1 })
                .collect();
            pieces_of(&on_floor(&[]), 0, &cuts);
        }
    }
}
