//! A surface over a triangulation whose slope has no jumps (Z. Cendes and S. Wong, "C¹ Quadratic Interpolation Over Arbitrary Point
//! Sets", IEEE CG&A 1987).
//!
//! Each triangle is cut into six around a point within, from which lines go to its corners and to a point on each edge: that
//! where the line to the neighbour's inner point crosses. Over each of the six is a quadratic (Powell and Sabin 1977). With
//! values and slopes at the corners all of them are determined, and neighbours meet without a fold.

use glam::{DVec2, DVec3};

use crate::delaunay::{Mesh, NONE};
use crate::raster::{Piece, barycentrics};

/// A quadratic over a triangle by its Bézier ordinates: at the corners, then in the middles of the edges 0→1, 1→2 and 2→0.
pub(crate) struct Patch {
    corners: [DVec2; 3],
    ordinates: [DVec3; 6],
}

impl Piece for Patch {
    fn corners(&self) -> [DVec2; 3] {
        self.corners
    }

    fn value(&self, point: DVec2) -> DVec3 {
        let [r, s, t] = barycentrics(self.corners, point);
        let [at_a, at_b, at_c, ab, bc, ca] = self.ordinates;
        at_a * (r * r) + at_b * (s * s) + at_c * (t * t) + 2.0 * (ab * (r * s) + bc * (s * t) + ca * (t * r))
    }
}

/// The value at a corner and how it changes along x and y.
#[derive(Clone, Copy, Default)]
struct Tangent {
    place: DVec2,
    value: DVec3,
    slope: [DVec3; 2],
}

impl Tangent {
    /// The tangent plane at the middle between the corner and a point.
    fn half_way_to(&self, point: DVec2) -> DVec3 {
        let way = (point - self.place) / 2.0;
        self.value + self.slope[0] * way.x + self.slope[1] * way.y
    }
}

/// The patches over a mesh, six a triangle.
pub(crate) fn patches(mesh: &Mesh) -> Vec<Patch> {
    let tangents = tangents(mesh);
    let centres: Vec<DVec2> = (0..mesh.triangles.len()).map(|triangle| incentre(mesh.corners(triangle))).collect();
    let mut patches = Vec::with_capacity(6 * mesh.triangles.len());
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let corners = vertices.map(|vertex| tangents[vertex as usize]);
        let centre = centres[triangle];
        let towards: [DVec3; 3] = corners.map(|corner| corner.half_way_to(centre));
        // The inner point's weights of the corners are as the lengths of the edges opposite.
        let length = |i: usize| corners[(i + 1) % 3].place.distance(corners[(i + 2) % 3].place);
        let lengths = [0, 1, 2].map(length);
        let perimeter: f64 = lengths.iter().sum();
        let at_centre = (towards[0] * lengths[0] + towards[1] * lengths[1] + towards[2] * lengths[2]) / perimeter;
        for edge in 0..3 {
            let next = (edge + 1) % 3;
            let [from, to] = [corners[edge], corners[next]];
            let share = match mesh.neighbours[triangle][edge] {
                NONE => 0.5,
                neighbour => crossing([from.place, to.place], [centre, centres[neighbour as usize]]),
            };
            let place = from.place.lerp(to.place, share);
            let [before, after] = [from.half_way_to(place), to.half_way_to(place)];
            let at_edge = before.lerp(after, share);
            let inner = towards[edge].lerp(towards[next], share);
            patches.push(Patch {
                corners: [from.place, place, centre],
                ordinates: [from.value, at_edge, at_centre, before, inner, towards[edge]],
            });
            patches.push(Patch {
                corners: [place, to.place, centre],
                ordinates: [at_edge, to.value, at_centre, after, towards[next], inner],
            });
        }
    }
    patches
}

/// Slopes at vertices: means over the triangles around, each weighted by its area over the squares of its sides there, which
/// is right on a sphere (N. Max, "Weights for Computing Vertex Normals from Facet Normals", 1999).
fn tangents(mesh: &Mesh) -> Vec<Tangent> {
    let mut tangents: Vec<Tangent> = mesh
        .places
        .iter()
        .zip(&mesh.values)
        .map(|(&place, value)| Tangent { place, value: value.as_dvec3(), ..Tangent::default() })
        .collect();
    let mut weights = vec![0.0; tangents.len()];
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let places = mesh.corners(triangle);
        let values = vertices.map(|vertex| mesh.values[vertex as usize].as_dvec3());
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (u, v) = (places[j] - places[i], places[k] - places[i]);
            let (du, dv) = (values[j] - values[i], values[k] - values[i]);
            let area = u.perp_dot(v);
            let weight = area / (u.length_squared() * v.length_squared());
            let vertex = vertices[i] as usize;
            tangents[vertex].slope[0] += (du * v.y - dv * u.y) * (weight / area);
            tangents[vertex].slope[1] += (dv * u.x - du * v.x) * (weight / area);
            weights[vertex] += weight;
        }
    }
    for (tangent, weight) in tangents.iter_mut().zip(weights) {
        if weight > 0.0 {
            tangent.slope = tangent.slope.map(|slope| slope / weight);
        }
    }
    tangents
}

/// The centre of the circle that touches all sides. The line between those of two neighbours crosses their common edge.
fn incentre([a, b, c]: [DVec2; 3]) -> DVec2 {
    let (opposite_a, opposite_b, opposite_c) = (b.distance(c), c.distance(a), a.distance(b));
    (a * opposite_a + b * opposite_b + c * opposite_c) / (opposite_a + opposite_b + opposite_c)
}

/// Where on the first line the second one crosses it, 0..=1.
fn crossing([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> f64 {
    let across = (b - a).perp_dot(q - p);
    if across == 0.0 { 0.5 } else { ((p - a).perp_dot(q - p) / across).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::delaunay::Delaunay;

    fn mesh(value: impl Fn(DVec2) -> f64) -> Mesh {
        let mut delaunay = Delaunay::default();
        for i in 0..150 {
            let place = DVec2::new(f64::from(i * 37 % 101) / 10.0, f64::from(i * 59 % 97) / 10.0);
            delaunay.insert(place, Vec3::X * value(place) as f32);
        }
        delaunay.mesh()
    }

    #[test]
    fn no_triangles_have_no_patches() {
        assert!(patches(&Mesh::default()).is_empty());
    }

    #[test]
    fn a_plane_is_itself() {
        let plane = |p: DVec2| 3.0 + 0.5 * p.x - 0.25 * p.y;
        for patch in patches(&mesh(plane)) {
            let [a, b, c] = patch.corners;
            for point in [a, b, c, (a + b + c) / 3.0, a.midpoint(b)] {
                assert!((patch.value(point).x - plane(point)).abs() < 1e-5);
            }
            assert!((b - a).perp_dot(c - a) > 0.0, "all turn alike");
        }
    }

    /// Across every edge that two patches share, value and slope are the same from both sides.
    #[test]
    fn patches_meet_without_a_fold() {
        let patches = patches(&mesh(|p| (p.x * 0.7).sin() * (p.y * 0.5).cos() + (p.x * 3.1).fract()));
        let mut met = 0;
        for (number, patch) in patches.iter().enumerate() {
            for edge in 0..3 {
                let (a, b) = (patch.corners[edge], patch.corners[(edge + 1) % 3]);
                let shares = |other: &&Patch| {
                    let near = |p: DVec2| other.corners.iter().any(|corner| corner.distance(p) < 1e-9);
                    near(a) && near(b)
                };
                let Some(other) = patches[number + 1..].iter().find(shares) else { continue };
                met += 1;
                let across = (b - a).perp().normalize();
                for share in [0.2, 0.5, 0.9] {
                    let place = a.lerp(b, share);
                    assert!((patch.value(place) - other.value(place)).length() < 1e-6);
                    let slope = |patch: &Patch| {
                        (patch.value(place + across * 1e-6) - patch.value(place - across * 1e-6)).x / 2e-6
                    };
                    let (one, two) = (slope(patch), slope(other));
                    assert!((one - two).abs() < 1e-4 * (1.0 + one.abs()), "{one} {two}");
                }
            }
        }
        assert!(met > 1000, "only {met} edges");
    }
}
