//! The bake as it is in the midst of its rounds: what is stored at the end, and what may be watched until then.

use glam::Vec3;
use scene::{Baked, BakedElement, BakedError, BakedTriangle, Provenance, Rgb, Scene};
use solver::{NodeId, Solution, Visibility};

use crate::Mesh;
use crate::bake::UNMEASURED;
use crate::edge_table::MeshedLeaf;
use crate::fine_mesh::FineMesh;
use crate::rounds::Rounds;

impl Rounds<'_> {
    /// The bake of a mesh, with irradiance at its samples, W·m⁻², and its error.
    pub fn baked(&self, fine: &FineMesh, samples: &[Vec3], error: BakedError) -> Baked {
        let samples: Vec<Vec3> = samples.iter().map(|value| value.max(Vec3::ZERO)).collect();
        let (vertices, triangles) = stored_triangles(&fine.leaves, &fine.mesh, &fine.table.triangles);
        let solution = &self.solution;
        let light = |node: NodeId| match solution.reflects() {
            true => solution.light[node as usize].irradiance,
            false => solution.irradiance_over_links(node),
        };
        let element =
            |leaf: &MeshedLeaf| BakedElement { polygon: leaf.polygon, irradiance: light(leaf.element).as_vec3() };
        Baked {
            scene: self.surroundings.scene.clone(),
            vertices,
            triangle_errors: self.triangle_errors(fine, &samples),
            samples,
            sky: fine.shown_sky.iter().map(|value| value.max(Vec3::ZERO)).collect(),
            triangles,
            elements: fine.leaves.iter().map(element).collect(),
            lines: fine.lines.clone(),
            error,
            provenance: Provenance::default(),
        }
    }

    /// Shows a mesh with what is known of its light to who watches.
    pub fn show(&self, fine: &FineMesh) {
        if let Some(watch) = self.watch {
            watch(self.baked(fine, &self.samples(fine), UNMEASURED));
        }
    }
}

/// What is known once a scene is solved: on each element the constant light that its links carry, W·m⁻². Without links it is
/// the mean that is expected of all surfaces.
pub fn flat_bake(scene: &Scene, solution: &Solution) -> Baked {
    let elements = &solution.elements;
    let mut baked = Baked { scene: scene.clone(), error: UNMEASURED, ..Baked::default() };
    for polygon in scene.polygon_ids() {
        for leaf in solution.leaves_of(polygon) {
            let irradiance = match solution.visibility {
                Visibility::Links => solution.irradiance_over_links(leaf),
                Visibility::Rays => solution.mean_irradiance,
            };
            let irradiance = irradiance.max(Rgb::ZERO).as_vec3();
            let outline = elements.outline(leaf);
            let (vertex, sample, element) =
                (baked.vertices.len() as u32, baked.samples.len() as u32, baked.elements.len() as u32);
            baked.vertices.extend(outline.iter().map(|corner| corner.as_vec3()));
            baked.samples.push(irradiance);
            baked.elements.push(BakedElement { polygon, irradiance });
            baked.triangles.extend((1..outline.len() as u32 - 1).map(|corner| BakedTriangle {
                vertices: [vertex, vertex + corner, vertex + corner + 1],
                samples: [sample; 6],
                polygon,
                element,
                ..BakedTriangle::default()
            }));
        }
    }
    baked.triangle_errors = vec![0.0; baked.triangles.len()];
    baked
}

/// The mesh as it is stored: without the vertices that no triangle uses.
fn stored_triangles(leaves: &[MeshedLeaf], mesh: &Mesh, samples: &[[u32; 6]]) -> (Vec<Vec3>, Vec<BakedTriangle>) {
    const UNUSED: u32 = u32::MAX;
    let mut stored = vec![UNUSED; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .zip(samples)
        .map(|(triangle, &samples)| BakedTriangle {
            vertices: triangle.vertices.map(|vertex| {
                let id = &mut stored[vertex as usize];
                if *id == UNUSED {
                    *id = vertices.len() as u32;
                    vertices.push(mesh.vertices[vertex as usize].as_vec3());
                }
                *id
            }),
            samples,
            polygon: leaves[triangle.leaf as usize].polygon,
            element: triangle.leaf,
            edges: triangle.edges,
        })
        .collect();
    (vertices, triangles)
}
