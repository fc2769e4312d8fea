//! A planar convex polygon and the plane it lies in.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// One polygon of a scene: a run of the scene's corner list, and what it is made of.
///
/// Convex and planar (the importer splits what is not); corners run counter-clockwise seen from the
/// front. Collinear corners are allowed: they keep T-junctions closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Polygon {
    /// Index of the first corner in [`crate::Scene::corners`].
    pub first_corner: u32,
    /// Number of corners, at least 3.
    pub corner_count: u32,
    /// Index into [`crate::Scene::materials`].
    pub material: u32,
    /// Index into [`crate::Scene::objects`].
    pub object: u32,
}

impl Polygon {
    /// The polygon's run of the corner list.
    pub fn corner_range(&self) -> std::ops::Range<usize> {
        let first = self.first_corner as usize;
        first..first + self.corner_count as usize
    }
}

/// An oriented plane: points p with normal·p = offset; the front is where normal·p > offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along the normal, metres.
    pub offset: f64,
}

impl Plane {
    /// The best plane through a closed outline: Newell's normal through the centroid of its corners.
    /// The normal is zero for an outline without area.
    pub fn through(outline: &[DVec3]) -> Self {
        let normal = area_vector(outline).normalize_or_zero();
        let middle = outline.iter().sum::<DVec3>() / outline.len().max(1) as f64;
        Self { normal, offset: normal.dot(middle) }
    }

    /// Signed distance of a point, positive in front, metres.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Half the sum of the cross products around an outline: its length is the area in m², its direction the normal.
pub fn area_vector(outline: &[DVec3]) -> DVec3 {
    let Some(&origin) = outline.first() else { return DVec3::ZERO };
    outline.windows(2).map(|edge| (edge[0] - origin).cross(edge[1] - origin)).sum::<DVec3>() / 2.0
}

/// Area centroid of a planar outline; the mean of its corners when it has no area.
pub fn centroid(outline: &[DVec3]) -> DVec3 {
    let Some(&origin) = outline.first() else { return DVec3::ZERO };
    let normal = area_vector(outline).normalize_or_zero();
    let (mut weighted, mut total) = (DVec3::ZERO, 0.0);
    for edge in outline.windows(2) {
        let area = (edge[0] - origin).cross(edge[1] - origin).dot(normal);
        weighted += (edge[0] + edge[1] - 2.0 * origin) * area;
        total += area;
    }
    if total > 0.0 { origin + weighted / (3.0 * total) } else { outline.iter().sum::<DVec3>() / outline.len() as f64 }
}

/// Whether an outline turns one way only, seen along `normal`. Collinear corners are allowed;
/// `tolerance` is the largest reflex turn accepted, as the sine of the turning angle.
pub fn is_convex(outline: &[DVec3], normal: DVec3, tolerance: f64) -> bool {
    let count = outline.len();
    (0..count).all(|i| {
        let before = (outline[(i + 1) % count] - outline[i]).normalize_or_zero();
        let after = (outline[(i + 2) % count] - outline[(i + 1) % count]).normalize_or_zero();
        before.cross(after).dot(normal) >= -tolerance
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn l_shape() -> Vec<DVec3> {
        [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)].map(|(x, y)| DVec3::new(x, y, 3.0)).to_vec()
    }

    #[test]
    fn degenerate_outlines_have_no_area_and_no_nan() {
        for outline in [vec![], vec![DVec3::X], vec![DVec3::X; 4], vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X]] {
            assert_eq!(area_vector(&outline), DVec3::ZERO);
            assert!(centroid(&outline).is_finite());
            assert_eq!(Plane::through(&outline).normal, DVec3::ZERO);
        }
    }

    #[test]
    fn l_shape_by_hand() {
        let outline = l_shape();
        assert!((area_vector(&outline) - DVec3::Z * 3.0).length() < 1e-15);
        assert!((centroid(&outline) - DVec3::new(2.5 / 3.0, 2.5 / 3.0, 3.0)).length() < 1e-15);
        assert!(!is_convex(&outline, DVec3::Z, 1e-9));
        assert!(is_convex(&outline[..3], DVec3::Z, 1e-9));
        let plane = Plane::through(&outline);
        assert_eq!((plane.normal, plane.offset), (DVec3::Z, 3.0));
    }
}
