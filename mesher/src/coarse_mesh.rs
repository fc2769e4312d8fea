//! The coarse mesh: large leaves without discontinuities, at whose samples light over reflectors is found.

use glam::{DVec3, Vec3};
use scene::{Interpolant, Rgb};
use solver::{Gather, NodeId, Solution, Surroundings};

use crate::edge_table::MeshedLeaf;
use crate::{Leaf, Mesh, SampleQuery, SampleTable, edge_table, leaf_meshes, sample_table};

/// A mesh of the front, without discontinuities.
#[derive(Default)]
pub(crate) struct CoarseMesh {
    pub leaves: Vec<MeshedLeaf>,
    pub mesh: Mesh,
    /// After the samples' queries come those by shading normals, where there are such.
    pub table: SampleTable,
    /// First triangle of each leaf, and their number at the end.
    first: Vec<usize>,
    /// By query, irradiance over reflectors, W·m⁻².
    pub values: Vec<Vec3>,
    /// By sample, the query for what is looked at.
    pub looked_at: Vec<u32>,
}

/// Which light is read from a coarse mesh.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Light {
    /// What surfaces reflect, by their own normals.
    PassedOn,
    /// What is stored, by shading normals where there are such.
    LookedAt,
}

/// A place on a coarse mesh.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    triangle: u32,
    s: f64,
    t: f64,
}

impl CoarseMesh {
    /// Meshes elements of a solution, all dark; and what was meshed.
    pub fn new(surroundings: &Surroundings<'_>, solution: &Solution, front: &[NodeId]) -> (Self, Vec<Leaf>) {
        let scene = surroundings.scene;
        let elements = &solution.elements;
        let leaf = |&element: &NodeId| Leaf {
            element,
            polygon: elements.polygon_of(element).unwrap_or_default(),
            outline: elements.outline(element).to_vec(),
            segments: Vec::new(),
        };
        let leaves: Vec<Leaf> = front.iter().map(leaf).collect();
        let mesh = leaf_meshes(&edge_table(scene, &solution.cuts, &leaves));
        let gather = Gather::new(surroundings, solution);
        let mut table = sample_table(scene, &leaves, &mesh, &|polygon, position| gather.contact(polygon, position));
        let mut first = vec![0; leaves.len() + 1];
        for triangle in &mesh.triangles {
            first[triangle.leaf as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut looked_at: Vec<u32> = (0..table.queries.len() as u32).collect();
        let (samples, shaded) = table.shaded(scene);
        for (number, sample) in (table.queries.len() as u32..).zip(samples) {
            looked_at[sample] = number;
        }
        table.queries.extend(shaded);
        let values = vec![Vec3::ZERO; table.queries.len()];
        let meshed = leaves.iter().map(MeshedLeaf::from).collect();
        (Self { leaves: meshed, mesh, table, first, values, looked_at }, leaves)
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.mesh.triangles[triangle].vertices.map(|vertex| self.mesh.vertices[vertex as usize])
    }

    /// The value at a place, never negative.
    pub fn at(&self, place: Place, light: Light) -> Rgb {
        let samples = self.table.triangles[place.triangle as usize].map(|sample| match light {
            Light::PassedOn => sample,
            Light::LookedAt => self.looked_at[sample as usize],
        });
        Interpolant::through(samples.map(|query| self.values[query as usize].as_dvec3())).evaluate(place.s, place.t)
    }

    /// Where a query lies within a leaf: in the triangle that it is deepest in.
    pub fn place(&self, solution: &Solution, leaf: usize, query: &SampleQuery) -> Option<Place> {
        /// Part of the way inwards by which a query on the border between two triangles is told to be on its own side.
        const INWARDS: f64 = 1e-6;
        let middle = solution.elements.nodes[self.leaves[leaf].element as usize].centre;
        let position = query.position + query.inward.as_dvec3() * (INWARDS * query.position.distance(middle));
        let place = |triangle: usize| {
            let [a, b, c] = self.corners(triangle);
            let normal = (b - a).cross(c - a);
            let part =
                |from: DVec3, to: DVec3| normal.dot((to - from).cross(position - from)) / normal.length_squared();
            let (s, t) = (part(c, a), part(a, b));
            let depth = s.min(t).min(1.0 - s - t);
            (depth, Place { triangle: triangle as u32, s, t })
        };
        let places = (self.first[leaf]..self.first[leaf + 1]).map(place);
        places.max_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, place)| place)
    }
}
