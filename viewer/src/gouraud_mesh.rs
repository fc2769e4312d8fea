//! The mesh as polygon hardware wants it: a colour at every corner, shared where neighbours share it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use scene::{Baked, other_sides};

/// A corner and its light.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct GouraudVertex {
    /// Metres.
    pub position: [f32; 3],
    /// W·sr⁻¹·m⁻².
    pub radiance: [f32; 3],
    /// 1 on a polygon whose back is the other side of the same surface, else 0.
    pub is_sheet: f32,
}

/// The vertices, and three of them by triangle, in the order of the bake.
#[derive(Default)]
pub(crate) struct GouraudMesh {
    pub vertices: Vec<GouraudVertex>,
    pub indices: Vec<[u32; 3]>,
}

impl GouraudMesh {
    /// The mesh of a bake that validates; a texture counts with its mean.
    pub fn of(baked: &Baked) -> Self {
        let mut mesh = Self::default();
        let other_sides = other_sides(&baked.scene);
        // By sample, the last vertex with its light, and the corner and polygon that it is of.
        let mut known = vec![None; baked.samples.len()];
        for (id, triangle) in (0..).zip(&baked.triangles) {
            let vertex = |i: usize| {
                let (corner, sample) = (triangle.vertices[i], triangle.samples[2 * i] as usize);
                match known[sample] {
                    Some((vertex, of)) if of == (corner, triangle.polygon) => vertex,
                    _ => {
                        let (s, t) = scene::SAMPLE_BARYCENTRICS[2 * i];
                        let position = baked.vertices[corner as usize].to_array();
                        let radiance = baked.radiance(id, s, t).as_vec3().max(Vec3::ZERO).to_array();
                        let is_sheet = f32::from(u8::from(other_sides[triangle.polygon as usize].is_some()));
                        mesh.vertices.push(GouraudVertex { position, radiance, is_sheet });
                        let vertex = mesh.vertices.len() as u32 - 1;
                        known[sample] = Some((vertex, (corner, triangle.polygon)));
                        vertex
                    }
                }
            };
            let corners = [0, 1, 2].map(vertex);
            mesh.indices.push(corners);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::room;

    #[test]
    fn corners_have_the_light_of_the_bake_and_are_shared() {
        assert!(GouraudMesh::of(&Baked::default()).vertices.is_empty());
        let baked = room();
        let mesh = GouraudMesh::of(&baked);
        for (id, indices) in (0..).zip(&mesh.indices) {
            for (i, (s, t)) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
                let vertex = mesh.vertices[indices[i] as usize];
                assert_eq!(vertex.position, baked.corners(id)[i].as_vec3().to_array());
                let exact = baked.radiance(id, s, t).as_vec3();
                assert!((Vec3::from(vertex.radiance) - exact).length() <= 1e-5 * (1.0 + exact.length()));
            }
        }
        let mut copied = baked.clone();
        copied.triangles.extend(baked.triangles.clone());
        assert_eq!(GouraudMesh::of(&copied).vertices.len(), mesh.vertices.len());
        // Another material, and the light is not the same.
        let polygon = (copied.triangles[0].polygon + 1) % copied.scene.polygons.len() as u32;
        copied.triangles.iter_mut().skip(baked.triangles.len()).for_each(|triangle| triangle.polygon = polygon);
        assert!(GouraudMesh::of(&copied).vertices.len() > mesh.vertices.len());
    }
}
