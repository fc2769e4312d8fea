//! A bake: the interpolated mesh, what was measured of it, and its evaluation on the CPU.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::{Bvh, Interpolant, Ray, Rgb, SAMPLE_BARYCENTRICS, Scene, SceneError};

/// The result of a bake: everything that a viewer needs.
///
/// Triangles partition every polygon of the scene. Two triangles that share an edge refer to the same samples on
/// it, so irradiance is continuous by structure, except across cuts and at contact corners.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Baked {
    /// The scene that was baked, as the importer repaired it.
    pub scene: Scene,
    /// Positions of the mesh's vertices, metres; shared across polygons, so that no crack can open.
    pub vertices: Vec<Vec3>,
    /// Irradiance samples, W·m⁻², by shading normals where the scene has them ([`Scene::shading_normal`]).
    pub samples: Vec<Vec3>,
    /// The part of each sample that comes straight from the scene's environment, W·m⁻²; empty where nothing does.
    pub sky: Vec<Vec3>,
    /// The triangles.
    pub triangles: Vec<BakedTriangle>,
    /// Per triangle, the largest error over its probe points, relative to max(own, mean) irradiance.
    pub triangle_errors: Vec<f32>,
    /// The solver's leaf elements, which the flat mode and the element mode show.
    pub elements: Vec<BakedElement>,
    /// The discontinuities that the mesh follows.
    pub lines: Vec<DiscontinuityLine>,
    /// Errors over the whole bake, measured at probe points.
    pub error: BakedError,
    /// What made this bake.
    pub provenance: Provenance,
}

/// One triangle and the six samples of its interpolant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BakedTriangle {
    /// Vertex ids, counter-clockwise seen from the front of the polygon.
    pub vertices: [u32; 3],
    /// Sample ids r0 … r5, in the order of [`SAMPLE_BARYCENTRICS`].
    pub samples: [u32; 6],
    /// The polygon of the scene that the triangle is a part of.
    pub polygon: u32,
    /// The element whose leaf the triangle is a part of.
    pub element: u32,
    /// What the edges 0→1, 1→2 and 2→0 are.
    pub edges: [EdgeKind; 3],
}

/// Why a triangle ends at an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum EdgeKind {
    /// The triangulation put it there.
    #[default]
    Interior,
    /// The border of a leaf.
    Leaf,
    /// A contact or intersection line; irradiance may jump here.
    Cut,
    /// A discontinuity, an index into [`Baked::lines`].
    Discontinuity(u32),
}

/// A leaf of the solver's quadtree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakedElement {
    /// The polygon it lies on.
    pub polygon: u32,
    /// The solver's constant irradiance, W·m⁻².
    pub irradiance: Vec3,
}

/// The geometric event that makes a discontinuity (Hardt & Teller 1996, section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum LineKind {
    /// The source's plane meets the receiver: the source rises over the receiver's horizon.
    Horizon,
    /// An edge of the source passes behind a vertex of the blocker.
    EdgeVertex,
    /// A vertex of the source passes behind an edge of the blocker.
    VertexEdge,
}

/// In place of a line's source polygon: a small bright part of the sky.
pub const SKY: u32 = u32::MAX;

/// A discontinuity that was kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiscontinuityLine {
    /// The event that makes it.
    pub kind: LineKind,
    /// Receiving polygon.
    pub receiver: u32,
    /// Source polygon, or [`SKY`].
    pub source: u32,
    /// Blocking polygon; the source itself for a horizon line.
    pub blocker: u32,
    /// Rank weight, W·m⁻² (Hardt & Teller 1996, section 4.2) or W·m⁻³ (7.1), as the options of the bake say.
    pub weight: f32,
    /// Ends on the receiver, metres.
    pub ends: [Vec3; 2],
}

/// Errors of a bake as it was measured when it was made, each relative to max(own, mean) irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakedError {
    /// Root of the area-weighted mean square: the upper limit of the measurement at 99 % confidence.
    pub rms: f64,
    /// 99th percentile by area.
    pub p99: f64,
    /// Largest.
    pub max: f64,
    /// Number of points compared.
    pub points: u64,
    /// Whether the tolerance that was asked for is kept.
    pub holds: bool,
}

/// What made a bake. No times, no paths, no thread counts: the same input gives the same bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Program and version.
    pub program: String,
    /// The options that matter for the result, as name and value.
    pub options: Vec<(String, String)>,
    /// Counts that the stages reported, as name and value.
    pub statistics: Vec<(String, f64)>,
}

impl Baked {
    /// Corner positions of a triangle, metres.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].vertices.map(|vertex| self.vertices[vertex as usize].as_dvec3())
    }

    /// The quadratic of a triangle.
    pub fn interpolant(&self, triangle: u32) -> Interpolant {
        let samples = self.triangles[triangle as usize].samples;
        Interpolant::through(samples.map(|sample| self.samples[sample as usize].as_dvec3()))
    }

    /// Irradiance at barycentrics (s, t) of a triangle, W·m⁻², never negative.
    pub fn irradiance(&self, triangle: u32, s: f64, t: f64) -> Rgb {
        self.interpolant(triangle).evaluate(s, t)
    }

    /// The part of the irradiance at (s, t) of a triangle that does not come straight from the scene's environment, W·m⁻²: from
    /// surfaces that emit, and reflected.
    pub fn irradiance_from_surfaces(&self, triangle: u32, s: f64, t: f64) -> Rgb {
        let sky = |sample: u32| self.sky.get(sample as usize).copied().unwrap_or_default();
        let values = self.triangles[triangle as usize]
            .samples
            .map(|sample| self.samples[sample as usize].as_dvec3() - sky(sample).as_dvec3());
        Interpolant::through(values).evaluate(s, t)
    }

    /// Radiance that leaves a triangle at (s, t): ρE/π + Ke, W·sr⁻¹·m⁻², where ρ is the polygon's: a texture counts with its
    /// mean.
    pub fn radiance(&self, triangle: u32, s: f64, t: f64) -> Rgb {
        let polygon = self.triangles[triangle as usize].polygon;
        self.irradiance(triangle, s, t) * self.scene.reflectance(polygon) / std::f64::consts::PI
            + self.scene.material(polygon).radiance
    }

    /// The hierarchy over the triangles; a hit's id is the triangle.
    pub fn bvh(&self) -> Bvh {
        Bvh::of_triangles((0..self.triangles.len() as u32).map(|triangle| self.corners(triangle)).collect())
    }

    /// The triangle under a point, with the point's barycentrics: the nearest within `reach` metres whose normal
    /// agrees with `normal`. `bvh` is [`Baked::bvh`].
    pub fn locate(&self, bvh: &Bvh, point: DVec3, normal: DVec3, reach: f64) -> Option<(u32, f64, f64)> {
        bvh.nearest_surface(point, normal, reach).map(|hit| (hit.id, hit.s, hit.t))
    }

    /// Checks every index and number; anything read from a file passes through here before it is used.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.scene.validate()?;
        let index = |what: &str, i: usize| Err(SceneError::Index(format!("{what} {i}")));
        let number = |what: &str, i: usize| Err(SceneError::Number(format!("{what} {i}")));
        let (vertices, samples) = (self.vertices.len() as u32, self.samples.len() as u32);
        let (polygons, elements) = (self.scene.polygons.len() as u32, self.elements.len() as u32);
        let lines = self.lines.len() as u32;
        if let Some(i) = self.vertices.iter().position(|vertex| !vertex.is_finite()) {
            return number("mesh vertex", i);
        }
        if let Some(i) = self.samples.iter().position(|sample| !sample.is_finite() || sample.min_element() < 0.0) {
            return number("sample", i);
        }
        if !self.sky.is_empty() && self.sky.len() != self.samples.len() {
            return index("sample from the sky", self.sky.len());
        }
        if let Some(i) = self.sky.iter().position(|sample| !sample.is_finite() || sample.min_element() < 0.0) {
            return number("sample from the sky", i);
        }
        for (i, triangle) in self.triangles.iter().enumerate() {
            let edges =
                triangle.edges.iter().all(|edge| !matches!(edge, EdgeKind::Discontinuity(line) if *line >= lines));
            if triangle.vertices.iter().any(|&vertex| vertex >= vertices)
                || triangle.samples.iter().any(|&sample| sample >= samples)
                || triangle.polygon >= polygons
                || triangle.element >= elements
                || !edges
            {
                return index("triangle", i);
            }
        }
        if self.triangle_errors.len() != self.triangles.len() {
            return index("triangle error", self.triangle_errors.len());
        }
        if let Some(i) = self.triangle_errors.iter().position(|error| !error.is_finite()) {
            return number("triangle error", i);
        }
        for (i, element) in self.elements.iter().enumerate() {
            if element.polygon >= polygons {
                return index("element", i);
            }
            if !element.irradiance.is_finite() {
                return number("element", i);
            }
        }
        for (i, line) in self.lines.iter().enumerate() {
            let is_source = line.source < polygons || line.source == SKY;
            if line.receiver.max(line.blocker) >= polygons || !is_source {
                return index("discontinuity", i);
            }
            if !line.weight.is_finite() || !line.ends.iter().all(|end| end.is_finite()) {
                return number("discontinuity", i);
            }
        }
        Ok(())
    }

    /// Area-weighted mean irradiance over the mesh, W·m⁻², by the exact integral of each unclamped quadratic.
    pub fn mean_irradiance(&self) -> Rgb {
        let (mut sum, mut total) = (Rgb::ZERO, 0.0);
        for triangle in 0..self.triangles.len() as u32 {
            let [a, b, c] = self.corners(triangle);
            let area = (b - a).cross(c - a).length() / 2.0;
            // The integral of a quadratic over a triangle is the mean of its edge midpoints.
            let middle = SAMPLE_BARYCENTRICS.iter().skip(1).step_by(2);
            sum += middle.map(|&(s, t)| self.irradiance(triangle, s, t)).sum::<Rgb>() * (area / 3.0);
            total += area;
        }
        if total > 0.0 { sum / total } else { Rgb::ZERO }
    }

    /// The radiance that a ray meets, or none where it leaves the scene; back sides are black.
    pub fn radiance_along(&self, bvh: &Bvh, ray: &Ray) -> Option<Rgb> {
        let hit = bvh.closest_hit(ray, 0.0)?;
        let front = hit.normal.dot(ray.direction) < 0.0;
        Some(if front { self.radiance(hit.id, hit.s, hit.t) } else { Rgb::ZERO })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle with irradiance from the sky, or with what it has in all alone.
    fn triangle(sky: Vec<Vec3>) -> Baked {
        let samples = (0..6).map(|i| Vec3::splat(2.0 + i as f32)).collect();
        let triangles = vec![BakedTriangle { samples: [0, 1, 2, 3, 4, 5], ..BakedTriangle::default() }];
        Baked { samples, sky, triangles, ..Baked::default() }
    }

    #[test]
    fn what_comes_straight_from_the_sky_is_told_apart() {
        let of_sky = triangle((0..6).map(|i| Vec3::splat(1.0 + i as f32)).collect());
        for (s, t) in SAMPLE_BARYCENTRICS {
            assert!((of_sky.irradiance_from_surfaces(0, s, t) - Rgb::ONE).length() < 1e-12);
            let without = triangle(Vec::new());
            assert_eq!(without.irradiance_from_surfaces(0, s, t), without.irradiance(0, s, t));
        }
    }
}
