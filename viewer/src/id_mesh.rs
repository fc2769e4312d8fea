//! The mesh as a rasteriser that writes ids wants it: as few vertices as can be, and one of every triangle's own.
//!
//! A rasteriser hands a flat attribute on from the first corner of a triangle. So a triangle's id needs a vertex that no
//! other triangle begins with, and the other two corners may be anybody's: a mesh of T triangles takes T vertices, not 3T.

use bytemuck::{Pod, Zeroable};
use scene::Baked;

/// A corner, and the id of the triangle that begins with it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct IdVertex {
    /// Metres.
    pub position: [f32; 3],
    /// With [`SHEET`] where that is one side of a sheet.
    pub triangle: u32,
}

/// Set in the id of a triangle whose back is the other side of the same surface: that side's own triangles are seen there.
pub(crate) const SHEET: u32 = 1 << 31;

/// The vertices, and three of them by triangle, in the order of the bake.
#[derive(Default)]
pub(crate) struct IdMesh {
    pub vertices: Vec<IdVertex>,
    pub indices: Vec<[u32; 3]>,
}

/// Of a corner of the bake that has no vertex yet.
const NONE: u32 = u32::MAX;

impl IdMesh {
    /// The mesh of a bake that validates; `is_sheet` says of which triangles the backs are never seen.
    pub fn of(baked: &Baked, is_sheet: impl Fn(u32) -> bool) -> Self {
        let mut mesh = Self::default();
        // By corner of the bake, a vertex there that a triangle begins with.
        let mut begun = vec![NONE; baked.vertices.len()];
        for (id, triangle) in (0..).zip(&baked.triangles) {
            // Turned so that it begins where no other does, if there is such a corner.
            let turn = triangle.vertices.iter().position(|&corner| begun[corner as usize] == NONE).unwrap_or(0);
            let [first, second, third] = [0, 1, 2].map(|i| triangle.vertices[(turn + i) % 3]);
            let own = mesh.add(baked, first, if is_sheet(id) { id | SHEET } else { id });
            begun[first as usize] = own;
            mesh.indices.push([own, second, third]);
        }
        for triangle in 0..mesh.indices.len() {
            for corner in 1..3 {
                let place = mesh.indices[triangle][corner] as usize;
                if begun[place] == NONE {
                    begun[place] = mesh.add(baked, place as u32, NONE);
                }
                mesh.indices[triangle][corner] = begun[place];
            }
        }
        mesh
    }

    /// The mesh with vertices of its own for every triangle, for drivers that hand on from whichever corner they like.
    pub fn unshared(&self) -> Self {
        let own = |(id, triangle): (u32, &[u32; 3])| {
            let sheet = self.vertices[triangle[0] as usize].triangle & SHEET;
            triangle.map(|vertex| IdVertex { triangle: id | sheet, ..self.vertices[vertex as usize] })
        };
        Self {
            vertices: (0..).zip(&self.indices).flat_map(own).collect(),
            indices: (0..self.indices.len() as u32).map(|id| [3 * id, 3 * id + 1, 3 * id + 2]).collect(),
        }
    }

    fn add(&mut self, baked: &Baked, corner: u32, triangle: u32) -> u32 {
        self.vertices.push(IdVertex { position: baked.vertices[corner as usize].to_array(), triangle });
        self.vertices.len() as u32 - 1
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use scene::BakedTriangle;

    use super::*;
    use crate::test_room::room;

    fn is_the_mesh_of(mesh: &IdMesh, baked: &Baked) {
        assert_eq!(mesh.indices.len(), baked.triangles.len());
        for (id, &[a, b, c]) in (0..).zip(&mesh.indices) {
            assert_eq!(mesh.vertices[a as usize].triangle & !SHEET, id);
            let ours = [a, b, c].map(|vertex| mesh.vertices[vertex as usize].position);
            let theirs = baked.corners(id).map(|corner| corner.as_vec3().to_array());
            let turned = (0..3).any(|turn| (0..3).all(|i| ours[i] == theirs[(turn + i) % 3]));
            assert!(turned, "{id}: {ours:?} {theirs:?}");
        }
    }

    #[test]
    fn no_triangles_one_and_many_around_one_corner() {
        assert!(IdMesh::of(&Baked::default(), |_| false).vertices.is_empty());
        let mut fan = Baked { vertices: (0..9).map(|i| Vec3::new(i as f32, 1.0, 0.0)).collect(), ..Baked::default() };
        for i in 1..8 {
            fan.triangles.push(BakedTriangle { vertices: [0, i, i + 1], ..BakedTriangle::default() });
            let mesh = IdMesh::of(&fan, |_| false);
            is_the_mesh_of(&mesh, &fan);
            assert_eq!(mesh.vertices.len(), i as usize + 2);
        }
    }

    #[test]
    fn a_room_takes_fewer_vertices_than_corners() {
        let baked = room();
        let mesh = IdMesh::of(&baked, |id| id % 2 == 1);
        is_the_mesh_of(&mesh, &baked);
        assert!(mesh.vertices.len() <= 2 * baked.triangles.len());
        let unshared = mesh.unshared();
        is_the_mesh_of(&unshared, &baked);
        assert_eq!(unshared.vertices.len(), 3 * baked.triangles.len());
        let is_own = |(i, vertex): (u32, &IdVertex)| vertex.triangle == (i / 3) | (i / 3 % 2 * SHEET);
        assert!((0..).zip(&unshared.vertices).all(is_own));
    }
}
