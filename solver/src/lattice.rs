//! Rays spread evenly: over a hemisphere, and over an outline, by one shifted rank-1 lattice.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::backprojection::Viewpoint;

/// The powers of the plastic number, whose multiples fill the square evenly (Roberts 2018).
pub(crate) const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);

/// A convex outline as a fan of triangles, over which places are spread evenly by area.
pub struct Fan<'a> {
    outline: &'a [DVec3],
    normal: DVec3,
    /// Twice the area of each triangle, and of all.
    areas: Vec<f64>,
    total: f64,
}

impl<'a> Fan<'a> {
    /// A fan around the first corner.
    pub fn new(outline: &'a [DVec3]) -> Self {
        let areas: Vec<f64> =
            outline[1..].windows(2).map(|edge| (edge[0] - outline[0]).cross(edge[1] - outline[0]).length()).collect();
        let total = areas.iter().sum();
        Self { outline, normal: scene::area_vector(outline).normalize_or_zero(), areas, total }
    }

    /// The place number `i` of the lattice.
    pub fn place(&self, shift: DVec2, i: u32) -> DVec3 {
        let DVec2 { x: u, y: v } = spread(shift, i);
        let mut left = u * self.total;
        let triangle = self.areas.iter().position(|&area| {
            left -= area;
            left < 0.0
        });
        let triangle = triangle.unwrap_or(self.areas.len() - 1);
        let u = (1.0 + left / self.areas[triangle]).clamp(0.0, 1.0);
        let (s, t) = (u.sqrt() * (1.0 - v), u.sqrt() * v);
        let [origin, a, b] = [0, triangle + 1, triangle + 2].map(|i| self.outline[i]);
        origin + (a - origin) * s + (b - origin) * t
    }

    /// Tries so many places: the part of all that they send to a point that is not blocked, 0..=1. To stop early where
    /// the first few agree would take what is mostly seen for seen wholly.
    pub fn arriving_share(
        &self,
        from: &Viewpoint,
        (shift, rays): (DVec2, u32),
        is_blocked: impl Fn(DVec3) -> bool,
    ) -> f64 {
        let (mut arrives, mut all) = (0.0, 0.0);
        for place in (0..rays).map(|i| self.place(shift, i)) {
            let way = place - from.position;
            let square = way.length_squared();
            let weight = from.height(way) * self.normal.dot(way).abs() / (square * square).max(f64::MIN_POSITIVE);
            if weight > 0.0 {
                all += weight;
                if !is_blocked(place) {
                    arrives += weight;
                }
            }
        }
        if all > 0.0 { arrives / all } else { 0.0 }
    }
}

/// The point number `i` of the lattice in the unit square.
pub fn spread(shift: DVec2, i: u32) -> DVec2 {
    (shift + STEP * f64::from(i)).fract()
}

/// The golden ratio's part beyond one: turned by it from ray to ray, none lie in line.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Directions about a normal with a density of the cosine over π: those over the places of a spiral that are as far apart along it as
/// across (Vogel 1979). The square's lattice wrapped around the pole lies twelve times as close by height as by azimuth near the
/// horizon, and rays by it scatter by a quarter more.
pub fn hemisphere(normal: DVec3, count: u32, shift: DVec2) -> impl Iterator<Item = DVec3> {
    let (x, y) = normal.any_orthonormal_pair();
    // It turns by the same angle from ray to ray, which costs less than to find each by its sine and cosine.
    let [mut azimuth, turn] = [shift.y, GOLDEN].map(|part| DVec2::from_angle(TAU * part));
    (0..count).map(move |i| {
        let u = (f64::from(i) + shift.x) / f64::from(count);
        let DVec2 { x: cos, y: sin } = azimuth;
        azimuth = azimuth.rotate(turn);
        (x * cos + y * sin) * u.sqrt() + normal * (1.0 - u).sqrt()
    })
}

/// A shift of the lattice that is another for every position, so that what one point misses its neighbour finds, and for
/// every turn.
pub(crate) fn shift(position: DVec3, turn: u32) -> DVec2 {
    // The finalizer of MurmurHash3 over the position's bits.
    let mix = |mut bits: u64| {
        bits = (bits ^ (bits >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        bits = (bits ^ (bits >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        bits ^ (bits >> 33)
    };
    let [x, y, z] = position.to_array().map(f64::to_bits);
    let first = mix(x ^ mix(y ^ mix(z ^ mix(u64::from(turn) + 1))));
    DVec2::new(first as f64, mix(first) as f64) / (u64::MAX as f64 + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_spread_by_the_cosine() {
        let mean =
            |f: &dyn Fn(DVec3) -> f64| hemisphere(DVec3::Y, 1000, shift(DVec3::ONE, 0)).map(f).sum::<f64>() / 1000.0;
        assert!((mean(&|d| d.y) - 2.0 / 3.0).abs() < 2e-3);
        assert!((mean(&|d| d.x * d.x) - 0.25).abs() < 2e-3 && mean(&|d| d.z).abs() < 2e-3);
        assert_eq!(hemisphere(DVec3::Z, 0, DVec2::ZERO).count(), 0);
    }

    /// Seen from above, where all parts of a disc count the same, none lie together: 1.9 would be a perfect grid of triangles.
    #[test]
    fn directions_keep_apart() {
        for count in [50, 200, 500] {
            let places: Vec<DVec3> =
                hemisphere(DVec3::Z, count, shift(DVec3::ONE, 0)).map(|way| way.with_z(0.0)).collect();
            let nearest = |(i, place): (usize, &DVec3)| {
                let others = places.iter().enumerate().filter(|other| other.0 != i);
                others.map(|other| place.distance(*other.1)).fold(f64::INFINITY, f64::min)
            };
            let least = places.iter().enumerate().map(nearest).fold(f64::INFINITY, f64::min);
            assert!(least * f64::from(count).sqrt() > 1.3, "{count}: {least}");
        }
    }

    /// A trapezium of unequal triangles: as many places in each part as its area says, and all inside.
    #[test]
    fn places_are_spread_by_area() {
        let outline = [(0.0, 0.0), (4.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let fan = Fan::new(&outline);
        let places: Vec<DVec3> = (0..1000).map(|i| fan.place(DVec2::new(0.3, 0.8), i)).collect();
        assert!(places.iter().all(|p| p.x >= 0.0 && (0.0..=1.0).contains(&p.y) && p.x + 2.0 * p.y <= 4.0 + 1e-12));
        let left = places.iter().filter(|p| p.x < 2.0).count();
        assert!((left as f64 / 1000.0 - 2.0 / 3.0).abs() < 0.01, "{left}");
    }

    #[test]
    fn what_arrives_is_what_is_not_blocked() {
        let outline = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, y)| DVec3::new(x, y, 2.0));
        let fan = Fan::new(&outline);
        let seen = |up, is_blocked: &dyn Fn(DVec3) -> bool| {
            let from = Viewpoint::flat(DVec3::ZERO, up, DVec3::ZERO);
            fan.arriving_share(&from, (shift(DVec3::ONE, 3), 400), is_blocked)
        };
        let half = seen(DVec3::Z, &|place| place.x > 0.0);
        assert!((half - 0.5).abs() < 0.02, "{half}");
        assert_eq!((seen(DVec3::Z, &|_| false), seen(DVec3::Z, &|_| true)), (1.0, 0.0));
        assert_eq!(seen(-DVec3::Z, &|_| false), 0.0, "behind");
    }
}
