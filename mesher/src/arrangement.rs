//! The arrangement of a leaf's discontinuities: segments that meet only at their ends.
//!
//! The triangulation must never see two constraints cross, or a vertex on a constraint. So every segment is split at
//! its crossings with the others and at every point that it passes closely, and is bent to go through them.

use glam::DVec2;

/// Bending a segment can make it cross another, so splitting is repeated; two rounds settle nearly all input, and what
/// still crosses after the last is left to the triangulation, which refuses it.
const ROUNDS: usize = 6;

/// A segment between two points of the arrangement, and the discontinuity line that it is a part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Segment {
    pub(crate) ends: [u32; 2],
    pub(crate) line: u32,
}

/// Points and the segments between them.
pub(crate) struct Arrangement {
    /// The given points first, then ends and crossings inside.
    pub(crate) points: Vec<DVec2>,
    /// No two cross, none is twice there, none lies along the border.
    pub(crate) segments: Vec<Segment>,
    /// Segments along the border, which the border replaces.
    pub(crate) along_border: Vec<Segment>,
}

/// Where a segment ends: at one of the given points, or inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    Point(u32),
    Inside(DVec2),
}

/// Arranges segments among `border` points. Points nearer to each other, or to a segment, than `reach` are not told
/// apart, unless both are of the border. `same_side` says whether two border points lie on one side of the outline.
pub(crate) fn arrange(
    border: Vec<DVec2>,
    segments: &[([End; 2], u32)],
    reach: f64,
    same_side: impl Fn(u32, u32) -> bool,
) -> Arrangement {
    let border_count = border.len() as u32;
    let mut points = border;
    let mut resolve = |end: End| match end {
        End::Point(point) => point,
        End::Inside(position) => point_at(&mut points, position, reach),
    };
    let mut pieces: Vec<Segment> =
        segments.iter().map(|&(ends, line)| Segment { ends: ends.map(&mut resolve), line }).collect();
    let mut along_border = Vec::new();
    for round in 0.. {
        pieces.retain(|piece| {
            let [a, b] = piece.ends;
            let along = a.max(b) < border_count && same_side(a, b);
            if along && a != b {
                along_border.push(*piece);
            }
            a != b && !along
        });
        remove_repeats(&mut pieces);
        let splits = splits(&pieces, &mut points, reach);
        if round == ROUNDS || splits.iter().all(Vec::is_empty) {
            break;
        }
        pieces = pieces.iter().zip(splits).flat_map(|(piece, at)| split(piece, at)).collect();
    }
    remove_unused(&mut points, border_count as usize, &mut pieces);
    Arrangement { points, segments: pieces, along_border }
}

/// Takes out the points after the first `keep` that no segment uses: ends of segments that have collapsed.
fn remove_unused(points: &mut Vec<DVec2>, keep: usize, segments: &mut [Segment]) {
    let mut used: Vec<u32> =
        segments.iter().flat_map(|segment| segment.ends).filter(|&end| end as usize >= keep).collect();
    used.sort_unstable();
    used.dedup();
    for end in segments.iter_mut().flat_map(|segment| &mut segment.ends) {
        if let Ok(place) = used.binary_search(end) {
            *end = (keep + place) as u32;
        }
    }
    let kept: Vec<DVec2> = used.iter().map(|&end| points[end as usize]).collect();
    points.truncate(keep);
    points.extend(kept);
}

/// The nearest point within `reach` of a position, or a new one there.
fn point_at(points: &mut Vec<DVec2>, position: DVec2, reach: f64) -> u32 {
    let nearest = (0..points.len())
        .min_by(|&i, &j| points[i].distance_squared(position).total_cmp(&points[j].distance_squared(position)));
    match nearest {
        Some(i) if points[i].distance(position) <= reach => i as u32,
        _ => {
            points.push(position);
            points.len() as u32 - 1
        }
    }
}

/// Of pieces between the same points keeps that of the first line.
fn remove_repeats(pieces: &mut Vec<Segment>) {
    for piece in pieces.iter_mut() {
        piece.ends.sort_unstable();
    }
    pieces.sort_unstable();
    pieces.dedup_by_key(|piece| piece.ends);
}

/// For every piece the points that split it, with their parameters along it.
fn splits(pieces: &[Segment], points: &mut Vec<DVec2>, reach: f64) -> Vec<Vec<(f64, u32)>> {
    let mut splits = vec![Vec::new(); pieces.len()];
    let at = |points: &[DVec2], piece: &Segment| piece.ends.map(|end| points[end as usize]);
    // Crossings first: they make points that other pieces may pass.
    for (i, first) in pieces.iter().enumerate() {
        for second in &pieces[..i] {
            if first.ends.iter().any(|end| second.ends.contains(end)) {
                continue;
            }
            if let Some(crossing) = crossing(at(points, first), at(points, second)) {
                point_at(points, crossing, reach);
            }
        }
    }
    for (piece, splits) in pieces.iter().zip(&mut splits) {
        let [a, b] = at(points, piece);
        let (along, length) = (b - a, a.distance(b));
        for (id, &point) in (0..).zip(points.iter()) {
            let t = (point - a).dot(along) / (length * length);
            let offset = along.perp_dot(point - a).abs() / length;
            if t > 0.0 && t < 1.0 && offset <= reach && !piece.ends.contains(&id) {
                splits.push((t, id));
            }
        }
        splits.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    }
    splits
}

fn split(piece: &Segment, at: Vec<(f64, u32)>) -> Vec<Segment> {
    let [first, last] = piece.ends;
    let stations: Vec<u32> =
        std::iter::once(first).chain(at.into_iter().map(|(_, id)| id)).chain(std::iter::once(last)).collect();
    stations.windows(2).map(|pair| Segment { ends: [pair[0], pair[1]], line: piece.line }).collect()
}

/// Where two segments cross; none for parallel ones, whose overlap shows as ends that lie on the other.
fn crossing([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Option<DVec2> {
    let (ab, cd) = (b - a, d - c);
    let determinant = ab.perp_dot(cd);
    let t = (c - a).perp_dot(cd) / determinant;
    let u = (c - a).perp_dot(ab) / determinant;
    ((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&u)).then(|| on_grid(a + ab * t))
}

/// Rounds coordinates of order 1 to multiples of 2⁻⁴⁰: no rounding error of the predicates underflows there, and what
/// is lost is a millionth of the welding distance.
pub(crate) fn on_grid(point: DVec2) -> DVec2 {
    const CELLS: f64 = (1u64 << 40) as f64;
    (point * CELLS).round() / CELLS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inside(ax: f64, ay: f64, bx: f64, by: f64) -> [End; 2] {
        [End::Inside(DVec2::new(ax, ay)), End::Inside(DVec2::new(bx, by))]
    }

    fn arranged(segments: &[[End; 2]]) -> Arrangement {
        let segments: Vec<_> = segments.iter().copied().zip(0..).collect();
        arrange(Vec::new(), &segments, 1e-3, |_, _| false)
    }

    #[test]
    fn segments_without_length_leave_no_point() {
        let arrangement =
            arranged(&[inside(0.5, 0.5, 0.5, 0.5), inside(0.1, 0.1, 0.1005, 0.1), inside(0., 0., 0., 1.)]);
        assert_eq!(arrangement.points.len(), 2);
        assert_eq!(arrangement.segments, [Segment { ends: [0, 1], line: 2 }]);
    }

    #[test]
    fn crossing_touching_and_overlapping_segments_are_split() {
        let cross = arranged(&[inside(0., 0., 1., 1.), inside(0., 1., 1., 0.)]);
        assert_eq!((cross.points.len(), cross.segments.len()), (5, 4));
        assert!(cross.points.contains(&DVec2::splat(0.5)));

        let touch = arranged(&[inside(0., 0., 1., 0.), inside(0.5, 0.0009, 0.5, 1.0)]);
        assert_eq!((touch.points.len(), touch.segments.len()), (4, 3));

        let overlap = arranged(&[inside(0., 0., 0.75, 0.), inside(0.25, 0., 1., 0.)]);
        let lines: Vec<u32> = overlap.segments.iter().map(|segment| segment.line).collect();
        assert_eq!((overlap.points.len(), lines), (4, vec![0, 0, 1]));
    }

    #[test]
    fn bending_one_segment_across_another_is_settled() {
        // The flat one is bent to the end of the second, and thereby across the third.
        let arrangement =
            arranged(&[inside(0., 0., 1., 0.), inside(0.5, 0.0009, 0.5, 1.0), inside(0.49, 0.0005, 0.48, 1.0)]);
        for (i, first) in arrangement.segments.iter().enumerate() {
            for second in &arrangement.segments[..i] {
                let ends = [first, second].map(|segment| segment.ends.map(|end| arrangement.points[end as usize]));
                assert!(first.ends.iter().any(|end| second.ends.contains(end)) || crossing(ends[0], ends[1]).is_none());
            }
        }
        assert!(arrangement.along_border.is_empty());
    }
}
