//! Puts a scene together from faces, boxes and lamps.

use std::collections::HashMap;

use glam::DVec3;
use scene::{Camera, Gloss, Material, NamedCamera, Polygon, Rgb, Scene};

/// Places are rounded to this many a metre: coordinates of four decimals, which a text file holds in few digits.
const GRID: f64 = 1e4;

/// Six sides of an axis-aligned or turned box.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Left,
    Right,
    Front,
    Back,
    Bottom,
    Top,
}

pub const ALL_SIDES: [Side; 6] = [Side::Left, Side::Right, Side::Front, Side::Back, Side::Bottom, Side::Top];

/// What stands on something: its bottom is hidden.
pub const STANDING: [Side; 5] = [Side::Left, Side::Right, Side::Front, Side::Back, Side::Top];

/// What stands between two things.
pub const UPRIGHT: [Side; 4] = [Side::Left, Side::Right, Side::Front, Side::Back];

/// A scene in the making; equal places become one vertex.
#[derive(Default)]
pub struct Modeller {
    scene: Scene,
    vertices: HashMap<[i64; 3], u32>,
    object: u32,
}

impl Modeller {
    /// A material, W·sr⁻¹·m⁻² for its radiance; its index.
    pub fn material(&mut self, name: &str, reflectance: [f64; 3], radiance: [f64; 3]) -> u32 {
        let mut material = Material::grey(name);
        (material.reflectance, material.radiance) = (Rgb::from_array(reflectance), Rgb::from_array(radiance));
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// A mirror, and what is diffuse beside it; its index.
    pub fn mirror(&mut self, name: &str, diffuse: [f64; 3], specular: [f64; 3]) -> u32 {
        let [diffuse, specular] = [diffuse, specular].map(Rgb::from_array);
        let index = self.material(name, (diffuse + specular).to_array(), [0.0; 3]);
        let gloss = Gloss { diffuse, specular, exponent: 0.0, is_mirror: true };
        self.scene.materials[index as usize].gloss = Some(gloss);
        index
    }

    /// The faces that follow belong to this object.
    pub fn object(&mut self, name: String) {
        self.object = self.scene.objects.len() as u32;
        self.scene.objects.push(name);
    }

    /// A convex face, counter-clockwise seen from its front, metres.
    pub fn face(&mut self, material: u32, outline: &[DVec3]) {
        let first_corner = self.scene.corners.len() as u32;
        self.scene.polygons.push(Polygon {
            first_corner,
            corner_count: outline.len() as u32,
            material,
            object: self.object,
        });
        for &place in outline {
            let cell = (place * GRID).round().as_i64vec3().to_array();
            let id = *self.vertices.entry(cell).or_insert_with(|| {
                self.scene.vertices.push(DVec3::from_array(cell.map(|c| c as f64 / GRID)));
                self.scene.vertices.len() as u32 - 1
            });
            self.scene.corners.push(id);
        }
    }

    /// The stated sides of an axis-aligned box, fronts outwards.
    pub fn cuboid(&mut self, material: u32, low: DVec3, high: DVec3, sides: &[Side]) {
        let base = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
        self.prism(material, base, (low.z, high.z), sides);
    }

    /// One side of an axis-aligned box that is seen from the inside.
    pub fn inside(&mut self, material: u32, low: DVec3, high: DVec3, side: Side) {
        // A box with its depth turned round has every face wound the other way; front and back trade places.
        let side = match side {
            Side::Front => Side::Back,
            Side::Back => Side::Front,
            other => other,
        };
        let (low, high) = (DVec3::new(low.x, high.y, low.z), DVec3::new(high.x, low.y, high.z));
        self.cuboid(material, low, high, &[side]);
    }

    /// The stated sides of a box on a rectangle of any direction, given counter-clockwise seen from above.
    pub fn prism(&mut self, material: u32, base: [(f64, f64); 4], (low, high): (f64, f64), sides: &[Side]) {
        let at = |i: usize, z: f64| DVec3::new(base[i % 4].0, base[i % 4].1, z);
        let wall = |i: usize| [at(i, low), at(i + 1, low), at(i + 1, high), at(i, high)];
        for side in sides {
            let outline = match side {
                Side::Front => wall(0),
                Side::Right => wall(1),
                Side::Back => wall(2),
                Side::Left => wall(3),
                Side::Bottom => [3, 2, 1, 0].map(|i| at(i, low)),
                Side::Top => [0, 1, 2, 3].map(|i| at(i, high)),
            };
            self.face(material, &outline);
        }
    }

    /// A flat case whose underside is the lamp.
    pub fn lamp(&mut self, case: u32, light: u32, low: DVec3, high: DVec3) {
        self.cuboid(case, low, high, &STANDING);
        self.cuboid(light, low, high, &[Side::Bottom]);
    }

    /// A camera that looks along a direction, z upwards; `fov` in degrees.
    pub fn camera(&mut self, eye: DVec3, direction: DVec3, fov: f64) {
        let count = self.scene.cameras.len();
        self.scene.cameras.push(NamedCamera {
            // As the reader of OBJ files names them.
            name: if count == 0 { "camera".to_owned() } else { format!("camera{}", count + 1) },
            camera: Camera { eye, target: eye + direction, up: DVec3::Z, vertical_fov: fov.to_radians() },
        });
    }

    /// Two faces of opposite fronts.
    pub fn sheet(&mut self, material: u32, outline: &[DVec3]) {
        self.face(material, outline);
        self.face(material, &outline.iter().rev().copied().collect::<Vec<_>>());
    }

    /// The surface over a grid of so many cells, two triangles each, counter-clockwise where u goes right and v up; u and v
    /// from 0 to 1.
    pub fn surface(&mut self, material: u32, [columns, rows]: [u32; 2], at: impl Fn(f64, f64) -> DVec3) {
        let at = |i: u32, j: u32| at(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // At a pole one side has no length.
            let rounding = 1.0 / GRID;
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                if (b - a).cross(c - a).length() > rounding * rounding {
                    self.face(material, &[a, b, c]);
                }
            }
        }
    }

    /// The scene, with normals at the corners of the objects of which `is_smooth` says so.
    pub fn smoothed(self, is_smooth: impl Fn(&str) -> bool) -> Scene {
        let mut scene = self.scene;
        let smooth: Vec<bool> = scene.objects.iter().map(|name| is_smooth(name)).collect();
        // A two-sided sheet has a normal on either side.
        let mut sums: HashMap<(u32, u32, bool), DVec3> = HashMap::new();
        let side = |normal: DVec3| normal.dot(DVec3::new(0.31, 0.17, 0.93)) > 0.0;
        let is_sheet: Vec<bool> = scene::other_sides(&scene).iter().map(Option::is_some).collect();
        let key = |scene: &Scene, polygon: u32, vertex: u32| {
            let front = is_sheet[polygon as usize] && side(scene.plane(polygon).normal);
            (scene.polygons[polygon as usize].object, vertex, front)
        };
        for polygon in scene.polygon_ids() {
            let normal = scene.plane(polygon).normal * scene.area(polygon);
            for &vertex in &scene.corners[scene.polygons[polygon as usize].corner_range()] {
                *sums.entry(key(&scene, polygon, vertex)).or_default() += normal;
            }
        }
        let mut normals = Vec::with_capacity(scene.corners.len());
        for polygon in scene.polygon_ids() {
            for &vertex in &scene.corners[scene.polygons[polygon as usize].corner_range()] {
                let is_smooth = smooth[scene.polygons[polygon as usize].object as usize];
                let normal = sums[&key(&scene, polygon, vertex)].normalize_or_zero().as_vec3();
                normals.push(if is_smooth { normal } else { glam::Vec3::ZERO });
            }
        }
        scene.shading_normals = normals;
        scene
    }

    pub fn scene(self) -> Scene {
        self.scene
    }
}

/// Numbers that look random and are the same in every run (Steele, Lea and Flood, "Fast splittable pseudorandom
/// number generators", 2014: the finaliser of SplitMix64).
pub struct Dice(pub u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in `low..high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// One of a list.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.next() % list.len() as u64) as usize]
    }
}
