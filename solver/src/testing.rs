//! Scenes for the tests of this crate.

use glam::DVec3;
use scene::{Material, Polygon, Rgb, Scene};

/// Collects quads.
#[derive(Default)]
pub struct Builder {
    scene: Scene,
}

impl Builder {
    /// A material of even reflectance and emitted radiance; polygons that follow are made of it.
    pub fn material(mut self, reflectance: f64, radiance: f64) -> Self {
        self.scene.materials.push(Material {
            name: format!("m{}", self.scene.materials.len()),
            reflectance: Rgb::splat(reflectance),
            texture: None,
            radiance: Rgb::splat(radiance),
            gloss: None,
        });
        self
    }

    /// A polygon, counter-clockwise from its front.
    pub fn polygon(mut self, outline: &[DVec3]) -> Self {
        let scene = &mut self.scene;
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

    /// The sides of an axis-aligned box chosen by `sides` (−x +x −y +y −z +z), facing outwards or inwards.
    pub fn sides(mut self, low: DVec3, high: DVec3, inwards: bool, sides: [bool; 6]) -> Self {
        let corner = |x: u8, y: u8, z: u8| {
            let pick = |bit: u8, axis: usize| if bit == 0 { low[axis] } else { high[axis] };
            DVec3::new(pick(x, 0), pick(y, 1), pick(z, 2))
        };
        let quads = [
            [corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0)],
            [corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1)],
            [corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1)],
            [corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0)],
            [corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0)],
            [corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1)],
        ];
        for (mut quad, _) in quads.into_iter().zip(sides).filter(|(_, wanted)| *wanted) {
            if inwards {
                quad.reverse();
            }
            self = self.polygon(&quad);
        }
        self
    }

    /// All six sides of a box.
    pub fn cuboid(self, low: [f64; 3], high: [f64; 3], inwards: bool) -> Self {
        self.sides(low.into(), high.into(), inwards, [true; 6])
    }

    /// The scene.
    pub fn build(mut self) -> Scene {
        self.scene.objects.push(String::from("all"));
        self.scene.validate().expect("the test's scene is sound");
        self.scene
    }
}
