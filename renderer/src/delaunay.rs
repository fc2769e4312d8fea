//! The Delaunay triangulation of samples, one by one (Painter & Sloan 1989, section 3.3.3). The only file here that names spade.

use glam::{DVec2, Vec3};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A sample as a vertex.
struct Vertex {
    place: Point2<f64>,
    value: Vec3,
}

impl HasPosition for Vertex {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.place
    }
}

/// Samples, triangulated.
#[derive(Default)]
pub(crate) struct Delaunay(DelaunayTriangulation<Vertex>);

/// The neighbour of a triangle beyond an edge of the whole.
pub(crate) const NONE: u32 = u32::MAX;

/// Triangles over values at points.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    /// Pixels.
    pub places: Vec<DVec2>,
    pub values: Vec<Vec3>,
    /// Vertices, in the order of a turn from the x to the y axis.
    pub triangles: Vec<[u32; 3]>,
    /// The triangles beyond the edges 0→1, 1→2 and 2→0.
    pub neighbours: Vec<[u32; 3]>,
}

impl Delaunay {
    /// Adds a value at a point; of two at one point the later one counts. Points that are no numbers are passed over.
    pub fn insert(&mut self, place: DVec2, value: Vec3) {
        _ = self.0.insert(Vertex { place: Point2::new(place.x, place.y), value });
    }

    /// What the triangulation is now.
    pub fn mesh(&self) -> Mesh {
        let (mut triangles, mut neighbours) = (Vec::new(), Vec::new());
        // Faces are numbered from the outer one on.
        let number = |index: usize| index as u32 - 1;
        for face in self.0.inner_faces() {
            triangles.push(face.vertices().map(|vertex| vertex.index() as u32));
            let across = |face: Option<usize>| face.map_or(NONE, number);
            neighbours.push(
                face.adjacent_edges()
                    .map(|edge| across(edge.rev().face().as_inner().map(|neighbour| neighbour.index()))),
            );
        }
        Mesh {
            places: self.0.vertices().map(|vertex| DVec2::new(vertex.position().x, vertex.position().y)).collect(),
            values: self.0.vertices().map(|vertex| vertex.data().value).collect(),
            triangles,
            neighbours,
        }
    }
}

impl Mesh {
    /// The corners of a triangle, pixels.
    pub fn corners(&self, triangle: usize) -> [DVec2; 3] {
        self.triangles[triangle].map(|vertex| self.places[vertex as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_than_three_points_or_a_line_have_no_triangles() {
        let mut delaunay = Delaunay::default();
        assert!(delaunay.mesh().triangles.is_empty());
        for x in [0.0, 1.0, 2.0, 2.0] {
            delaunay.insert(DVec2::new(x, 1.0), Vec3::ONE);
        }
        delaunay.insert(DVec2::NAN, Vec3::ONE);
        let mesh = delaunay.mesh();
        assert_eq!((mesh.places.len(), mesh.triangles.len()), (3, 0));
    }

    #[test]
    fn triangles_turn_alike_and_neighbours_share_an_edge() {
        let mut delaunay = Delaunay::default();
        for i in 0..200 {
            let place = DVec2::new(f64::from(i * 37 % 101), f64::from(i * 59 % 97) * 0.73);
            delaunay.insert(place, Vec3::splat(i as f32));
        }
        let mesh = delaunay.mesh();
        assert!(mesh.triangles.len() > 300);
        for (number, (triangle, neighbours)) in mesh.triangles.iter().zip(&mesh.neighbours).enumerate() {
            let [a, b, c] = mesh.corners(number);
            assert!((b - a).perp_dot(c - a) > 0.0);
            for (edge, &neighbour) in neighbours.iter().enumerate() {
                let Some(other) = mesh.triangles.get(neighbour as usize) else { continue };
                assert!([edge, (edge + 1) % 3].iter().all(|&end| other.contains(&triangle[end])));
                assert!(mesh.neighbours[neighbour as usize].contains(&(number as u32)));
            }
        }
        assert!(mesh.neighbours.iter().flatten().any(|&neighbour| neighbour == NONE));
    }
}
