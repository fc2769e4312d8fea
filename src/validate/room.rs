//! Scenes of the cases, and their light as the program finds it: a solve and a gather at points, or a whole bake.

use glam::DVec3;
use mesher::{Bake, BakeOptions, Control};
use scene::{Baked, Bvh, Material, Polygon, Rgb, SAMPLE_BARYCENTRICS, Scene, centroid};
use solver::{Gather, Solution, SolveOptions, Surroundings};

/// How far from its surface a point may lie, metres: a bake's vertices are rounded to f32.
const REACH: f64 = 1e-5;

/// The side of a box at the lower bound of y, as [`cuboid`] lists them.
pub const LOW_Y: usize = 2;
/// The side at the upper bound of y.
pub const HIGH_Y: usize = 3;
/// The side at the lower bound of z.
pub const FLOOR: usize = 4;
/// The side at the upper bound of z.
pub const CEILING: usize = 5;

/// The six sides of an axis-aligned box, −x +x −y +y −z +z, facing inwards.
pub fn cuboid(low: DVec3, high: DVec3) -> [[DVec3; 4]; 6] {
    let corner = |bits: usize| {
        let pick = |axis: usize| if bits >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]].map(|side| side.map(corner))
}

/// The same outline, seen from its other side.
pub fn reversed<const N: usize>(mut outline: [DVec3; N]) -> [DVec3; N] {
    outline.reverse();
    outline
}

/// The rectangle of given bounds in x and y at a height z, facing down.
pub fn facing_down(x: [f64; 2], y: [f64; 2], z: f64) -> [DVec3; 4] {
    cuboid(DVec3::new(x[0], y[0], z - 1.0), DVec3::new(x[1], y[1], z))[CEILING]
}

/// Collects polygons.
#[derive(Default)]
pub struct Room(Scene);

impl Room {
    /// A material that reflects `reflectance` and emits the exitance `exitance`, W·m⁻²; polygons that follow are made of it.
    pub fn material(mut self, reflectance: Rgb, exitance: Rgb) -> Self {
        let name = format!("material {}", self.0.materials.len());
        self.0.materials.push(Material {
            name,
            reflectance,
            texture: None,
            radiance: exitance / std::f64::consts::PI,
            gloss: None,
        });
        self
    }

    /// A polygon, counter-clockwise from its front. Corners at the very same place are one vertex.
    pub fn polygon(mut self, outline: &[DVec3]) -> Self {
        let scene = &mut self.0;
        scene.polygons.push(Polygon {
            first_corner: scene.corners.len() as u32,
            corner_count: outline.len() as u32,
            material: scene.materials.len() as u32 - 1,
            object: 0,
        });
        for &corner in outline {
            let known = scene.vertices.iter().position(|&vertex| vertex == corner);
            scene.corners.push(known.unwrap_or(scene.vertices.len()) as u32);
            if known.is_none() {
                scene.vertices.push(corner);
            }
        }
        self
    }

    /// Several polygons.
    pub fn polygons<'a>(self, outlines: impl IntoIterator<Item = &'a [DVec3; 4]>) -> Self {
        outlines.into_iter().fold(self, |room, outline| room.polygon(outline))
    }

    /// A ceiling of given bounds in x and y at a height z, all but a rectangle in it: four rectangles around that one.
    pub fn ceiling_around(self, x: [f64; 2], y: [f64; 2], z: f64, hole_x: [f64; 2], hole_y: [f64; 2]) -> Self {
        self.polygons(&[
            facing_down(x, [y[0], hole_y[0]], z),
            facing_down(x, [hole_y[1], y[1]], z),
            facing_down([x[0], hole_x[0]], hole_y, z),
            facing_down([hole_x[1], x[1]], hole_y, z),
        ])
    }

    /// The scene.
    pub fn scene(mut self) -> Scene {
        self.0.objects.push("all".into());
        self.0
    }
}

/// A scene with its solution, made as `halflight bake` and `halflight probe` make it.
pub struct Lit {
    /// The scene.
    pub scene: Scene,
    /// Its light as the solver leaves it.
    pub solution: Solution,
    /// The bake, with the solution that has the bake's light.
    bake: Bake,
    bvh: Bvh,
}

impl Lit {
    /// Solves a scene's light with the program's default options.
    pub fn solve(scene: Scene) -> Self {
        Self::solve_with(scene, &SolveOptions::default(), BakeOptions::default().tolerance)
    }

    /// Solves a scene's light, and bakes it to a tolerance.
    pub fn solve_with(scene: Scene, options: &SolveOptions, tolerance: f64) -> Self {
        let solution = solver::solve(&scene, options, &|_| ());
        let control = Control { progress: &|_| (), stop: &|| false, interrupted: &|| false, watch: None };
        let bake =
            mesher::bake(&scene, solution.clone(), &BakeOptions { tolerance, ..BakeOptions::default() }, control);
        let bvh = Bvh::of_scene(&scene);
        Self { scene, solution, bake, bvh }
    }

    /// Irradiance at points with normals, W·m⁻², gathered at each as `probe --method gather` does. Not a number where there
    /// is no surface.
    pub fn gather(&self, points: impl IntoIterator<Item = (DVec3, DVec3)>) -> Vec<Rgb> {
        let surroundings = Surroundings::new(&self.scene, &self.bake.solution);
        let gather = Gather::new(&surroundings, &self.bake.solution);
        let at = |(position, normal): (DVec3, DVec3)| {
            let Some(hit) = self.bvh.nearest_surface(position, normal, REACH) else { return Rgb::NAN };
            gather.irradiance_at(hit.id, position, centroid(&self.scene.outline(hit.id)) - position)
        };
        points.into_iter().map(at).collect()
    }

    /// The bake with the default options.
    pub fn bake(&self) -> &Baked {
        &self.bake.baked
    }
}

/// Irradiance at points with normals, W·m⁻², from a bake's interpolants as `probe` finds it. Not a number where there is no
/// surface.
pub fn interpolated(baked: &Baked, points: impl IntoIterator<Item = (DVec3, DVec3)>) -> Vec<Rgb> {
    let bvh = baked.bvh();
    let at = |(position, normal)| match baked.locate(&bvh, position, normal, REACH) {
        Some((triangle, s, t)) => baked.irradiance(triangle, s, t),
        None => Rgb::NAN,
    };
    points.into_iter().map(at).collect()
}

/// The integral of `weight` × irradiance over a bake, W, the weight given by polygon.
pub fn integrated(baked: &Baked, weight: impl Fn(u32) -> Rgb) -> Rgb {
    let of_triangle = |triangle: u32| {
        let [a, b, c] = baked.corners(triangle);
        let area = (b - a).cross(c - a).length() / 2.0;
        // The integral of a quadratic over a triangle is the mean of its edge midpoints.
        let middles = SAMPLE_BARYCENTRICS.iter().skip(1).step_by(2);
        let sum: Rgb = middles.map(|&(s, t)| baked.irradiance(triangle, s, t)).sum();
        sum * (area / 3.0) * weight(baked.triangles[triangle as usize].polygon)
    };
    (0..baked.triangles.len() as u32).map(of_triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_faces_inwards_and_is_closed() {
        let (low, high) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 3.0, 4.0));
        let sides = cuboid(low, high);
        for (i, side) in sides.iter().enumerate() {
            let normal = scene::area_vector(side).normalize();
            let mut inwards = DVec3::ZERO;
            inwards[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
            assert_eq!(normal, inwards, "side {i}");
        }
        let scene = Room::default().material(Rgb::ZERO, Rgb::ONE).polygons(&sides).scene();
        assert_eq!((scene.vertices.len(), scene.validate()), (8, Ok(())));
    }

    #[test]
    fn a_point_beside_every_surface_is_no_number() {
        let lit = Lit::solve(Room::default().scene());
        assert!(lit.gather([(DVec3::ZERO, DVec3::Z)])[0].is_nan());
        assert!(interpolated(lit.bake(), [(DVec3::ZERO, DVec3::Z)])[0].is_nan());
    }
}
