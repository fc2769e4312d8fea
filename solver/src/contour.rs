//! The double contour integral of ln r around two outlines, which is the form factor by Stokes' theorem twice.
//!
//! A·F = 1/2π ∮∮ ln r dx·dy (Goral et al. 1984; Schröder and Hanrahan 1993). Here parallel edges, collinear and common
//! ones among them, are integrated in closed form twice; other pairs once in closed form and once by Gauss–Legendre
//! rules on pieces that shrink towards where the edges meet. Unlike the closed form for skew edges, which needs
//! dilogarithms of nearly equal arguments, this keeps its digits in every position.

use glam::DVec3;

use crate::quadrature::{MOST_POINTS, gauss_legendre, points_needed};

/// Sine of the angle below which two edges are integrated as parallel ones; what that misplaces is as small.
const PARALLEL: f64 = 1e-13;

/// −ln of the error of the rules relative to the integrand. The terms cancel to a few percent of themselves before
/// they are too far apart for this method, so two digits more than the 1e-9 that is promised, and two in reserve.
const DIGITS: f64 = 30.0;

/// Distance from a segment's line, in its lengths, within which a piece of another lies along it: what the integral has of
/// the distance, π times it, is then lost in what rounds an outline. Less halves edges that the digits of a file have moved
/// apart a million times.
const ALONG: f64 = 1e-5;

/// Pieces of an edge next to where it meets another are halved this often. The integrand is u·ln u there, so the last
/// piece misplaces the square of its length, 1e-12 of the edges' product.
const MOST_HALVINGS: u32 = 20;

/// ∮∮ ln r dx·dy around two closed outlines, in the square of their unit. The unit should be of the order of their
/// size: its logarithm cancels from the sum, but its rounding does not.
pub(crate) fn double_contour(a: &[DVec3], b: &[DVec3]) -> f64 {
    edges(a).map(|x| edges(b).map(|y| edge_pair(x, y)).sum::<f64>()).sum()
}

/// Edges of a closed outline.
pub(crate) fn edges(outline: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> + '_ {
    let last = outline.last().copied();
    outline.iter().scan(last, |before, &corner| before.replace(corner).map(|from| [from, corner]))
}

/// ∬ ln r dx·dy along two segments.
fn edge_pair(x: [DVec3; 2], y: [DVec3; 2]) -> f64 {
    // The longer one is integrated in closed form: the shorter one needs fewer pieces.
    let (x, y) = if x[0].distance_squared(x[1]) <= y[0].distance_squared(y[1]) { (x, y) } else { (y, x) };
    let (along_x, along_y) = (x[1] - x[0], y[1] - y[0]);
    let (length_x, length_y) = (along_x.length(), along_y.length());
    let product = along_x.dot(along_y);
    let lengths = length_x * length_y;
    if product.abs() <= f64::EPSILON * lengths {
        return 0.0;
    }
    let cosine = product / lengths;
    if along_x.cross(along_y).length() <= PARALLEL * lengths {
        // Both in the direction of x: the sign of dx·dy does not depend on how the integral is run through.
        let y = if cosine > 0.0 { y } else { [y[1], y[0]] };
        cosine * parallel_pair(x[0], along_x / length_x, length_x, y[0], length_y)
    } else {
        let inner = Segment { ends: y, direction: along_y / length_y, length: length_y };
        cosine * graded(x, length_x, &inner, 0)
    }
}

/// ∬ ln r along two parallel segments of one direction, in closed form.
fn parallel_pair(x: DVec3, direction: DVec3, length_x: f64, y: DVec3, length_y: f64) -> f64 {
    let between = y - x;
    let start = between.dot(direction);
    let apart_squared = between.cross(direction).length_squared();
    let apart = apart_squared.sqrt();
    // Twice the antiderivative of ln √(u² + h²).
    let twice = |u: f64| {
        let squared = u * u + apart_squared;
        if squared == 0.0 {
            return 0.0;
        }
        0.25 * (u * u - apart_squared) * squared.ln() - 0.75 * u * u + apart * u * u.atan2(apart)
    };
    (twice(start + length_y) - twice(start + length_y - length_x)) - (twice(start) - twice(start - length_x))
}

struct Segment {
    ends: [DVec3; 2],
    direction: DVec3,
    length: f64,
}

impl Segment {
    /// How far what keeps [`Self::logarithm_from`] from being smooth is from a piece of another segment: the segment, or its ends
    /// alone where the piece lies along it.
    fn distance(&self, piece: [DVec3; 2]) -> f64 {
        let apart = |point: DVec3| (point - self.ends[0]).cross(self.direction).length();
        if piece.into_iter().all(|point| apart(point) <= ALONG * self.length) {
            return self.ends.map(|end| segment_distance(piece, [end; 2])).into_iter().fold(f64::INFINITY, f64::min);
        }
        segment_distance(piece, self.ends)
    }

    /// ∫ ln r along the segment, seen from a point, in closed form.
    fn logarithm_from(&self, point: DVec3) -> f64 {
        let [w0, w1] = self.ends.map(|end| end - point);
        let (u0, u1) = (w0.dot(self.direction), w1.dot(self.direction));
        let apart = w0.cross(self.direction).length();
        let scaled_log = |u: f64, w: DVec3| if u == 0.0 { 0.0 } else { 0.5 * u * w.length_squared().ln() };
        let angle = (apart * self.length).atan2(apart * apart + u0 * u1);
        scaled_log(u1, w1) - scaled_log(u0, w0) - self.length + apart * angle
    }
}

/// ∬ ln r along a piece of one segment and the whole of another.
fn graded(piece: [DVec3; 2], length: f64, inner: &Segment, halvings: u32) -> f64 {
    let points = points_needed(length, inner.distance(piece), DIGITS);
    if points > MOST_POINTS && halvings < MOST_HALVINGS {
        let middle = (piece[0] + piece[1]) / 2.0;
        return graded([piece[0], middle], length / 2.0, inner, halvings + 1)
            + graded([middle, piece[1]], length / 2.0, inner, halvings + 1);
    }
    gauss_legendre(points).iter().map(|&(x, w)| w * inner.logarithm_from(piece[0].lerp(piece[1], x))).sum::<f64>()
        * length
}

/// Distance between two segments (Ericson 2005, section 5.1.9).
pub(crate) fn segment_distance(p: [DVec3; 2], q: [DVec3; 2]) -> f64 {
    let (d, e, r) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (dd, ee, de) = (d.length_squared(), e.length_squared(), d.dot(e));
    let (dr, er) = (d.dot(r), e.dot(r));
    let ratio = |numerator: f64, denominator: f64| {
        if denominator > 0.0 { (numerator / denominator).clamp(0.0, 1.0) } else { 0.0 }
    };
    // Nearest to the other line, then nearest to that point within the other segment, and back.
    let s = ratio(de * er - dr * ee, dd * ee - de * de);
    let t = ratio(de * s + er, ee);
    let s = ratio(de * t - dr, dd);
    (r + d * s - e * t).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degenerate_outlines_integrate_to_zero() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        for degenerate in [&[][..], &[DVec3::Z], &[DVec3::Z; 4], &[DVec3::Z, DVec3::X, DVec3::Z], &square[..2]] {
            assert!(double_contour(degenerate, &square).abs() < 1e-15);
            assert!(double_contour(&square, degenerate).abs() < 1e-15);
        }
    }

    /// Two unit segments from one point: by scaling, the integral over the square of both is −½ and the integral over
    /// one segment, seen from the far end of the other.
    #[test]
    fn segments_that_meet_at_an_end() {
        for angle in [0.1_f64, 0.7, 1.5, 3.0] {
            let end = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let inner = Segment { ends: [DVec3::ZERO, end], direction: end, length: 1.0 };
            let exact = inner.logarithm_from(DVec3::X) - 0.5;
            let value = graded([DVec3::ZERO, DVec3::X], 1.0, &inner, 0);
            assert!((value - exact).abs() < 1e-11, "angle {angle}: {value} and {exact}");
        }
    }

    /// The two methods meet: nearly parallel edges by quadrature, parallel ones in closed form.
    #[test]
    fn parallel_edges_are_the_limit_of_skew_ones() {
        let x = [DVec3::ZERO, DVec3::X];
        for (y, z) in [(0.3, 0.0), (0.0, 0.01), (2.0, 1.0)] {
            let from = DVec3::new(0.4, y, z);
            let parallel = edge_pair(x, [from, from + 1.5 * DVec3::X]);
            let skew = edge_pair(x, [from, from + DVec3::new(1.5, 1e-11, 0.0)]);
            assert!((parallel - skew).abs() < 1e-10, "{parallel} and {skew}");
            let reversed = edge_pair(x, [from + 1.5 * DVec3::X, from]);
            assert!((parallel + reversed).abs() < 1e-15);
        }
    }

    #[test]
    fn distances_between_segments() {
        let p = [DVec3::ZERO, DVec3::X];
        for (q, distance) in [
            ([DVec3::Z, DVec3::Z + DVec3::X], 1.0),
            ([DVec3::X * 2.0, DVec3::X * 3.0], 1.0),
            ([DVec3::X, DVec3::Y], 0.0),
            ([DVec3::new(0.5, -1.0, 2.0), DVec3::new(0.5, 1.0, 2.0)], 2.0),
            ([DVec3::Y; 2], 1.0),
            ([DVec3::new(3.0, 1.0, 0.0), DVec3::new(2.0, 0.0, 0.0)], 1.0),
        ] {
            assert!((segment_distance(p, q) - distance).abs() < 1e-15);
            assert!((segment_distance(q, p) - distance).abs() < 1e-15);
            assert!((segment_distance([p[1], p[0]], q) - distance).abs() < 1e-15);
        }
        assert_eq!(segment_distance([DVec3::X; 2], [DVec3::Y; 2]), 2.0_f64.sqrt());
    }

    /// An edge that two squares at a right angle have in common, but for what the digits of a file move it by: the integral
    /// moves by as little, and the edge is halved towards its ends alone.
    #[test]
    fn edges_that_nearly_lie_along_each_other_are_integrated_as_if_they_did() {
        let floor = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let wall = |moved: f64| [DVec3::ZERO, DVec3::Z, DVec3::Z + DVec3::X, DVec3::new(1.0, 0.0, moved)];
        let exact = double_contour(&floor, &wall(0.0));
        for moved in [1e-6, -1e-6, 1e-9] {
            assert!((double_contour(&floor, &wall(moved)) - exact).abs() < 4.0 * f64::abs(moved), "{moved}");
        }
        let along = Segment { ends: [DVec3::ZERO, DVec3::X], direction: DVec3::X, length: 1.0 };
        let beside = [DVec3::new(0.4, 1e-6, 0.0), DVec3::new(0.6, 2e-6, 0.0)];
        assert!((along.distance(beside) - 0.4).abs() < 1e-5);
        let apart = [DVec3::new(0.4, 0.1, 0.0), DVec3::new(0.6, 0.2, 0.0)];
        assert!((along.distance(apart) - 0.1).abs() < 1e-12);
    }
}
