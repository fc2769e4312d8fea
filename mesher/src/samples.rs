//! Samples (Hardt & Teller 1996, section 2.2): irradiance at the vertices and edge midpoints of all triangles.
//!
//! Triangles that share an edge share its three samples, so interpolants are continuous by structure and nothing is
//! computed twice. Where other polygons touch the position, irradiance has one value for each side of the line of
//! contact, or one for each direction at a corner; there triangles share what is theirs to share.

use std::collections::HashMap;
use std::hash::BuildHasher;

use foldhash::{fast, quality};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use scene::Scene;
use solver::{Contact, Cosine};

use crate::{Leaf, Mesh, MeshTriangle};

/// A question for irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleQuery {
    /// Where, metres.
    pub position: DVec3,
    /// On which polygon.
    pub polygon: u32,
    /// An element (the solver's node) whose closure contains the position.
    pub element: u32,
    /// Where the value depends on the direction of approach, the unit direction in the polygon's plane that the limit is
    /// taken from: across a line of contact, to the middle of the triangle that asks at a corner of contact. Zero elsewhere. It only
    /// says on which side.
    pub inward: Vec3,
    /// By which normal: the polygon's own, of light that it passes on, or the shading normal, of light that is looked at. Only on
    /// polygons with shading normals are these two questions.
    pub cosine: Cosine,
}

/// What the answer to a query depends on, its position and direction of approach to the bit, on its polygon, by a normal: as a checksum
/// of 96 bits, which no two queries of a bake have in common. In full it would be four times as long.
pub(crate) type QueryKey = [u32; 3];

/// Something about queries. Their keys are spread evenly already, there are millions of them, and nobody attacks a bake: what the
/// standard library's hash takes for that is a few percent of its time.
pub(crate) type ByQuery<T> = HashMap<QueryKey, T, fast::FixedState>;

impl SampleQuery {
    pub(crate) fn key(&self) -> QueryKey {
        let [x, y, z] = self.position.to_array().map(f64::to_bits);
        let inward = self.inward.to_array().map(f32::to_bits);
        let question = (self.polygon, [x, y, z], inward, self.cosine);
        let [first, second] = [0, 1].map(|seed| quality::FixedState::with_seed(seed).hash_one(question));
        [first as u32, (first >> 32) as u32, second as u32]
    }

    /// The same question about the light that is looked at.
    pub(crate) fn looked_at(self, scene: &Scene) -> Self {
        let cosine = if scene.has_shading_normals(self.polygon) { Cosine::Shading } else { Cosine::Own };
        Self { cosine, ..self }
    }
}

/// Is told the fraction that is done as far as is foreseen, 0..=1; from any thread, and a smaller one than before where more
/// is to do than was foreseen.
pub type Progress<'a> = &'a (dyn Fn(f64) + Sync);

/// Every sample once, and which of them each triangle uses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleTable {
    /// What to evaluate, in the order in which triangles ask; so queries of one element are consecutive.
    pub queries: Vec<SampleQuery>,
    /// By triangle, indices of r0 … r5 in the order of [`scene::SAMPLE_BARYCENTRICS`].
    pub triangles: Vec<[u32; 6]>,
}

impl SampleTable {
    /// The samples on polygons with shading normals, and the question of each about the light that is looked at.
    pub(crate) fn shaded(&self, scene: &Scene) -> (Vec<usize>, Vec<SampleQuery>) {
        let looked_at = self.queries.iter().map(|query| query.looked_at(scene)).enumerate();
        looked_at.filter(|(_, query)| query.cosine == Cosine::Shading).unzip()
    }
}

/// Polygons whose samples are told apart at a time: more hold the samples of a large scene twice, fewer make threads wait for each
/// other.
const AT_A_TIME: usize = 4096;

/// A vertex, given twice, or the midpoint between two vertices, the smaller first.
type Station = [u32; 2];

/// What tells samples at one station of a polygon apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Side {
    /// All triangles agree.
    Any,
    /// Those to the left of the line of contact agree.
    Left,
    /// Those to the right do.
    Right,
    /// The value is one triangle's own.
    Of(u32),
}

/// Finds the samples of a mesh, all by polygons' own normals; the leaves of a polygon stand together. `contact` says how other
/// polygons touch a point of a polygon; it is asked only on borders of leaves, which is where contact can be.
pub fn sample_table(
    scene: &Scene,
    leaves: &[Leaf],
    mesh: &Mesh,
    contact: &(dyn Fn(u32, DVec3) -> Contact + Sync),
) -> SampleTable {
    let leaf_of = |triangle: &MeshTriangle| &leaves[triangle.leaf as usize];
    // Polygons have no samples in common.
    let of_polygons: Vec<&[MeshTriangle]> =
        mesh.triangles.chunk_by(|a, b| leaf_of(a).polygon == leaf_of(b).polygon).collect();
    let of_polygon = |triangles: &&[MeshTriangle]| {
        let polygon = leaf_of(&triangles[0]).polygon;
        samples_on(polygon, leaves, (mesh, triangles), scene.plane(polygon).normal, |position| {
            contact(polygon, position)
        })
    };
    let mut all = SampleTable { queries: Vec::new(), triangles: Vec::with_capacity(mesh.triangles.len()) };
    for some in of_polygons.chunks(AT_A_TIME) {
        for table in some.par_iter().map(of_polygon).collect::<Vec<SampleTable>>() {
            let first = all.queries.len() as u32;
            all.queries.extend(table.queries);
            all.triangles.extend(table.triangles.into_iter().map(|samples| samples.map(|sample| first + sample)));
        }
    }
    all.queries.shrink_to_fit();
    all
}

/// The samples of the triangles on one polygon.
fn samples_on(
    polygon: u32,
    leaves: &[Leaf],
    (mesh, triangles): (&Mesh, &[MeshTriangle]),
    normal: DVec3,
    contact: impl Fn(DVec3) -> Contact + Sync,
) -> SampleTable {
    let position = |[a, b]: Station| (mesh.vertices[a as usize] + mesh.vertices[b as usize]) / 2.0;
    let mut on_borders: Vec<Station> = triangles
        .iter()
        .flat_map(|triangle| stations(triangle.vertices))
        .filter(|station| station[1] < mesh.border_vertices)
        .collect();
    on_borders.sort_unstable();
    on_borders.dedup();
    let touched = |&station: &Station| {
        let contact = contact(position(station));
        (contact != Contact::None).then_some((station, contact))
    };
    let contacts: HashMap<Station, Contact, fast::FixedState> = on_borders.par_iter().filter_map(touched).collect();

    let mut known: HashMap<(Station, Side), u32, fast::FixedState> = HashMap::default();
    let mut table = SampleTable { queries: Vec::new(), triangles: Vec::with_capacity(triangles.len()) };
    for (id, triangle) in (0..).zip(triangles) {
        let element = leaves[triangle.leaf as usize].element;
        let middle = triangle.vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).sum::<DVec3>() / 3.0;
        let samples = stations(triangle.vertices).map(|station| {
            let position = position(station);
            let inward = (middle - position).normalize_or_zero();
            let (side, inward) = match contacts.get(&station) {
                None | Some(Contact::None) => (Side::Any, DVec3::ZERO),
                Some(Contact::Line { direction }) => {
                    let to_left = normal.cross(*direction);
                    if inward.dot(to_left) >= 0.0 { (Side::Left, to_left) } else { (Side::Right, -to_left) }
                }
                Some(Contact::Corner) => (Side::Of(id), inward),
            };
            *known.entry((station, side)).or_insert_with(|| {
                let inward = inward.as_vec3();
                table.queries.push(SampleQuery { position, polygon, element, inward, cosine: Cosine::Own });
                table.queries.len() as u32 - 1
            })
        });
        table.triangles.push(samples);
    }
    table
}

/// The stations of a triangle's samples r0 … r5.
fn stations([a, b, c]: [u32; 3]) -> [Station; 6] {
    let middle = |a: u32, b: u32| [a.min(b), a.max(b)];
    [[a, a], middle(a, b), [b, b], middle(b, c), [c, c], middle(c, a)]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;
    use scene::{Interpolant, Rgb, SAMPLE_BARYCENTRICS};

    use super::*;
    use crate::testing::{Room, room, scene_of};
    use crate::{LeafSegment, edge_table, leaf_meshes};

    fn no_contact(_: u32, _: DVec3) -> Contact {
        Contact::None
    }

    /// A quadratic of the position, positive over the rooms of the tests.
    fn quadratic(p: DVec3) -> Rgb {
        let q = DVec3::new(p.x * p.x - p.y * p.z, p.y * p.y + p.x * p.z, p.z * p.x + 0.5 * p.y * p.x);
        q + p + 100.0 * (1.0 + p.length_squared())
    }

    /// A square floor of two leaves along y = 1/2, with a line through both.
    fn floor() -> (Scene, Vec<Leaf>, Mesh) {
        let point = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let half = |element: u32, y: f64| Leaf {
            element,
            polygon: 0,
            outline: vec![point(0.0, y), point(1.0, y), point(1.0, y + 0.5), point(0.0, y + 0.5)],
            segments: vec![LeafSegment { ends: [point(0.5, y), point(0.5, y + 0.5)], line: 0 }],
        };
        let scene = scene_of(&[vec![point(0., 0.), point(1., 0.), point(1., 1.), point(0., 1.)]]);
        let leaves = vec![half(7, 0.0), half(8, 0.5)];
        let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
        (scene, leaves, mesh)
    }

    #[test]
    fn no_triangles_have_no_samples() {
        let table = sample_table(&Scene::default(), &[], &Mesh::default(), &no_contact);
        assert_eq!(table, SampleTable::default());
    }

    #[test]
    fn a_line_of_contact_has_two_values_and_a_corner_one_for_each_triangle() {
        let (scene, leaves, mesh) = floor();
        let count = |contact: &(dyn Fn(u32, DVec3) -> Contact + Sync)| {
            sample_table(&scene, &leaves, &mesh, contact).queries.len()
        };
        // 9 vertices and 16 edges.
        assert_eq!((mesh.triangles.len(), count(&no_contact)), (8, 25));
        let wall = |_, position: DVec3| {
            if position.y == 0.5 { Contact::Line { direction: DVec3::X } } else { Contact::None }
        };
        assert_eq!(count(&wall), 30);
        let post = |_, position: DVec3| {
            if position.distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-9 { Contact::Corner } else { Contact::None }
        };
        let middle = mesh.vertices.iter().position(|vertex| vertex.distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-9).unwrap();
        let around = mesh.triangles.iter().filter(|triangle| triangle.vertices.contains(&(middle as u32))).count();
        assert_eq!(count(&post), 24 + around);

        let table = sample_table(&scene, &leaves, &mesh, &wall);
        for (triangle, samples) in mesh.triangles.iter().zip(&table.triangles) {
            for query in samples.map(|sample| table.queries[sample as usize]) {
                if query.position.y != 0.5 {
                    assert_eq!(query.inward, Vec3::ZERO);
                } else {
                    // The limit is taken from the triangle's own side, and asked of a leaf on that side.
                    assert_eq!(query.inward.y > 0.0, triangle.leaf == 1);
                    assert_eq!(query.element, leaves[triangle.leaf as usize].element);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn quadratics_are_reproduced_from_samples_evaluated_once(Room { scene, leaves } in room()) {
            let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
            let table = sample_table(&scene, &leaves, &mesh, &no_contact);
            let scale = scene.size();
            let asked = table.queries.iter().map(|query| (query.polygon, query.position.to_array().map(f64::to_bits)));
            let mut asked: Vec<_> = asked.collect();
            let values: Vec<Rgb> = table.queries.iter().map(|query| quadratic(query.position / scale)).collect();

            // One evaluation for every vertex and edge of each polygon, none at one place twice.
            asked.sort_unstable();
            let all = asked.len();
            asked.dedup();
            prop_assert_eq!((asked.len(), values.len()), (all, all));

            for (triangle, samples) in mesh.triangles.iter().zip(&table.triangles) {
                let interpolant = Interpolant::through(samples.map(|sample| values[sample as usize]));
                let [a, b, c] = triangle.vertices.map(|vertex| mesh.vertices[vertex as usize]);
                for (s, t) in SAMPLE_BARYCENTRICS.into_iter().chain([(0.2, 0.3), (0.1, 0.85), (1.0 / 3.0, 1.0 / 3.0)]) {
                    let exact = quadratic((a * (1.0 - s - t) + b * s + c * t) / scale);
                    let error = (interpolant.evaluate(s, t) - exact).abs().max_element();
                    prop_assert!(error <= 1e-12 * exact.max_element(), "{error} of {exact}");
                }
            }
        }

        #[test]
        fn any_number_of_threads_gives_the_same(Room { scene, leaves } in room()) {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mesh = leaf_meshes(&edge_table(&scene, &[], &leaves));
                    let table = sample_table(&scene, &leaves, &mesh, &no_contact);
                    let values: Vec<Rgb> = table.queries.iter().map(|query| quadratic(query.position)).collect();
                    (mesh, table, values)
                })
            };
            prop_assert!(run(1) == run(4));
        }
    }
}
