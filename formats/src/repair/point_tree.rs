//! A k-D tree over points: which of them lie near a segment.
//!
//! The bounding volume hierarchy of `scene` is built by joining nearest neighbours, which takes time that grows with the
//! square of the number of points where they stand in a regular row, as those along a finely cut edge do. Medians do
//! not mind.

use glam::DVec3;

/// Points and their order in an implicit, balanced tree: the middle of every range splits it.
pub(super) struct PointTree {
    /// The points with their ids, in the order of the tree.
    points: Vec<(DVec3, u32)>,
    /// The axis that the point at the same place splits its range along.
    axes: Vec<u8>,
}

impl PointTree {
    /// A tree over points with ids of the caller's.
    pub fn new(mut points: Vec<(DVec3, u32)>) -> Self {
        let mut axes = vec![0; points.len()];
        split(&mut points, &mut axes);
        Self { points, axes }
    }

    /// Calls `visit` with the id of every point at most `reach` from a segment, and of some that are a little farther.
    pub fn near_segment(&self, from: DVec3, to: DVec3, reach: f64, visit: &mut impl FnMut(u32)) {
        self.visit((0, self.points.len()), (from, to), reach, visit);
    }

    fn visit(&self, (low, high): (usize, usize), (from, to): (DVec3, DVec3), reach: f64, visit: &mut impl FnMut(u32)) {
        if low >= high {
            return;
        }
        let middle = low.midpoint(high);
        let ((point, id), axis) = (self.points[middle], self.axes[middle] as usize);
        if (point.cmpge(from.min(to) - reach) & point.cmple(from.max(to) + reach)).all() {
            visit(id);
        }
        if let Some(part) = below((from, to), axis, point[axis] + reach, 1.0) {
            self.visit((low, middle), part, reach, visit);
        }
        if let Some(part) = below((from, to), axis, point[axis] - reach, -1.0) {
            self.visit((middle + 1, high), part, reach, visit);
        }
    }
}

/// The part of a segment on one side of a plane across an axis: below it for a sign of 1, above it for −1.
fn below((from, to): (DVec3, DVec3), axis: usize, plane: f64, sign: f64) -> Option<(DVec3, DVec3)> {
    let [a, b] = [from, to].map(|end| (end[axis] - plane) * sign);
    let crossing = || {
        let mut point = from + (to - from) * (a / (a - b));
        point[axis] = plane;
        point
    };
    match (a <= 0.0, b <= 0.0) {
        (true, true) => Some((from, to)),
        (true, false) => Some((from, crossing())),
        (false, true) => Some((crossing(), to)),
        (false, false) => None,
    }
}

/// Puts points into the order of the tree.
fn split(points: &mut [(DVec3, u32)], axes: &mut [u8]) {
    if points.len() < 2 {
        return;
    }
    let (low, high) = points.iter().fold((points[0].0, points[0].0), |(low, high), p| (low.min(p.0), high.max(p.0)));
    let axis = (high - low).max_position();
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    axes[middle] = axis as u8;
    let ((left, right), (left_axes, right_axes)) = (points.split_at_mut(middle), axes.split_at_mut(middle));
    split(left, left_axes);
    split(&mut right[1..], &mut right_axes[1..]);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn near(points: &[DVec3], from: DVec3, to: DVec3, reach: f64) -> Vec<u32> {
        let tree = PointTree::new(points.iter().copied().zip(0..).collect());
        let mut found = Vec::new();
        tree.near_segment(from, to, reach, &mut |id| found.push(id));
        found.sort_unstable();
        found
    }

    #[test]
    fn no_points_equal_points_and_no_segment() {
        assert_eq!(near(&[], DVec3::ZERO, DVec3::X, 1.0), Vec::<u32>::new());
        assert_eq!(near(&[DVec3::ONE; 5], DVec3::ONE, DVec3::ONE, 0.0), [0, 1, 2, 3, 4]);
        assert_eq!(near(&[DVec3::ONE; 5], DVec3::ZERO, DVec3::ZERO, 0.5), Vec::<u32>::new());
    }

    proptest! {
        #[test]
        fn every_point_that_trying_all_finds_is_found(
            points in proptest::collection::vec((0..9i32, 0..9i32, 0..9i32), 0..60),
            ends in ((0..9i32, 0..9i32, 0..9i32), (0..9i32, 0..9i32, 0..9i32)),
            reach in 0.0..2.0,
        ) {
            let at = |(x, y, z): (i32, i32, i32)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) / 7.0;
            let points: Vec<DVec3> = points.into_iter().map(at).collect();
            let (from, to) = (at(ends.0), at(ends.1));
            let found = near(&points, from, to, reach);
            for (point, id) in points.iter().zip(0..) {
                let along = to - from;
                let place = ((*point - from).dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
                // Points at the very border may fall either way.
                if (from + along * place).distance(*point) < reach - 1e-9 {
                    prop_assert!(found.contains(&id), "{point} is missing");
                }
            }
        }
    }
}
