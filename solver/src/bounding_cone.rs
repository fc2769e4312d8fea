//! Circular cones around directions: a cheap proof that two things do not overlap as seen from a point.

use glam::DVec3;

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub struct BoundingCone {
    axis: DVec3,
    cos: f64,
    sin: f64,
}

/// Cosine of the half angle of a cone that is not worth testing: near-touching polygons span almost half the sphere.
const WIDE: f64 = 0.05;

impl BoundingCone {
    /// The cone around the mean of some directions of any length.
    pub fn around(directions: &[DVec3]) -> Self {
        let axis = directions.iter().map(|d| d.normalize_or_zero()).sum::<DVec3>().normalize_or_zero();
        let cosine = |d: &DVec3| axis.dot(*d) / d.length();
        // A hair wider, for the roundings of the cosine.
        let cos = directions.iter().map(cosine).fold(1.0, f64::min) - 1e-12;
        if axis == DVec3::ZERO || cos < WIDE {
            return Self { axis, cos: WIDE, sin: 1.0 };
        }
        Self { axis, cos, sin: (1.0 - cos * cos).sqrt() }
    }

    /// Whether two cones provably have no direction in common.
    pub fn misses(&self, other: &Self) -> bool {
        // Both half angles are less than a right angle, so their sum's cosine orders as the angles do.
        let touching = self.cos * other.cos - self.sin * other.sin;
        self.sin < 1.0 && other.sin < 1.0 && self.axis.dot(other.axis) < touching
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn degenerate_cones_prove_nothing() {
        let narrow = BoundingCone::around(&[DVec3::X, DVec3::new(1.0, 0.1, 0.0)]);
        for wide in [vec![], vec![DVec3::ZERO], vec![DVec3::X, -DVec3::X], vec![DVec3::X, DVec3::NAN]] {
            assert!(!BoundingCone::around(&wide).misses(&narrow), "{wide:?}");
        }
        assert!(BoundingCone::around(&[DVec3::Y]).misses(&narrow));
        assert!(!narrow.misses(&narrow));
    }

    proptest! {
        /// Cones that miss each other have no common direction among the mixtures of their corners.
        #[test]
        fn a_miss_is_a_miss(v in proptest::array::uniform32(-1.0..1.0f64)) {
            let at = |i: usize| DVec3::new(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
            let (a, b) = ([at(0), at(1), at(2)], [at(3), at(4), at(5)]);
            if BoundingCone::around(&a).misses(&BoundingCone::around(&b)) {
                let mix = |c: [DVec3; 3]| (c[0] * v[20].abs() + c[1] * v[21].abs() + c[2] * v[22].abs()).normalize_or_zero();
                prop_assert!(mix(a).distance(mix(b)) > 0.0);
                for p in a { for q in b { prop_assert!(p.normalize().distance(q.normalize()) > 1e-9); } }
            }
        }
    }
}
