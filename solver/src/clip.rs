//! Cutting convex outlines by half spaces (Sutherland & Hodgman 1974).

use glam::DVec3;

/// Appends to `out` the part of a convex outline where `distance` is not negative. Corners with a distance within
/// ±`tolerance` count as on the border: they are kept and create no new corner. Appends nothing where no more than
/// the border is left.
pub fn clip_convex(outline: &[DVec3], tolerance: f64, distance: impl Fn(DVec3) -> f64, out: &mut Vec<DVec3>) {
    let first = out.len();
    let Some(&last) = outline.last() else { return };
    let mut inside = false;
    let (mut previous, mut before) = (last, distance(last));
    for &point in outline {
        let here = distance(point);
        let crosses = (before > tolerance && here < -tolerance) || (before < -tolerance && here > tolerance);
        if crosses {
            // Always from the lesser corner, so that the two sides of a cut get the same point to the bit.
            let swap = point.to_array() < previous.to_array();
            let (from, to, d_from, d_to) =
                if swap { (point, previous, here, before) } else { (previous, point, before, here) };
            out.push(from + (to - from) * (d_from / (d_from - d_to)));
        }
        if here >= -tolerance {
            out.push(point);
        }
        inside |= here > tolerance;
        (previous, before) = (point, here);
    }
    if !inside || out.len() - first < 3 {
        out.truncate(first);
    }
}

/// Where a point lies in a convex outline, all within `tolerance` metres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Farther than the tolerance from the outline.
    Outside,
    /// At a corner, by index.
    Corner(usize),
    /// On the edge that starts at the corner of this index.
    Edge(usize),
    /// Inside.
    Interior,
}

/// Locates a point, which lies in the plane of the outline with unit normal `normal`.
pub fn locate(outline: &[DVec3], normal: DVec3, point: DVec3, tolerance: f64) -> Position {
    if let Some(corner) = outline.iter().position(|corner| corner.distance_squared(point) <= tolerance * tolerance) {
        return Position::Corner(corner);
    }
    let mut position = Position::Interior;
    for (i, &from) in outline.iter().enumerate() {
        let edge = outline[(i + 1) % outline.len()] - from;
        let Some(inward) = normal.cross(edge).try_normalize() else { continue };
        let distance = inward.dot(point - from);
        if distance < -tolerance {
            return Position::Outside;
        }
        if distance <= tolerance {
            position = Position::Edge(i);
        }
    }
    position
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> [DVec3; 4] {
        [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0))
    }

    fn clipped(distance: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
        let mut out = Vec::new();
        clip_convex(&square(), 1e-12, distance, &mut out);
        out
    }

    #[test]
    fn touching_the_border_leaves_nothing_or_everything() {
        assert!(clipped(|p| -p.x).is_empty());
        assert_eq!(clipped(|p| p.x), square());
        assert!(clipped(|_| 0.0).is_empty());
        let mut out = vec![DVec3::ONE];
        clip_convex(&[], 0.0, |p| p.x, &mut out);
        assert_eq!(out.len(), 1);
    }

    #[test]
    fn halves_share_their_cut_to_the_bit() {
        let (low, high) = (clipped(|p| 0.3 * p.x + p.y - 0.7), clipped(|p| 0.7 - 0.3 * p.x - p.y));
        assert_eq!(low.iter().filter(|p| high.contains(p)).count(), 2);
        let area = |o: &[DVec3]| scene::area_vector(o).z;
        assert!((area(&low) + area(&high) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn positions() {
        let at = |x, y| locate(&square(), DVec3::Z, DVec3::new(x, y, 0.0), 1e-9);
        assert_eq!(at(1.0, 1.0), Position::Corner(2));
        assert_eq!(at(1.0, 0.5), Position::Edge(1));
        assert_eq!(at(0.5, 0.5), Position::Interior);
        assert_eq!(at(1.1, 0.5), Position::Outside);
        assert_eq!(at(2.0, 0.0), Position::Outside);
    }
}
