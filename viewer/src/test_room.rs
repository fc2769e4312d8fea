//! What tests share: a synthetic bake, a closed room with a lamp whose light is made up but continuous; and the
//! shader validator.

use glam::{DVec3, Vec2, Vec3};
use scene::{
    Baked, BakedElement, BakedTriangle, Camera, DiscontinuityLine, EdgeKind, Environment, LatLongMap, LineKind,
    Material, Polygon, SAMPLE_BARYCENTRICS, Scene, Sky, Texture, UpAxis,
};

/// Elements along each side of a wall.
const DIVISIONS: u32 = 4;

/// The room's size, metres: odd numbers, so that nothing falls on pixel borders.
const SIZE: DVec3 = DVec3::new(4.1, 3.3, 2.7);

/// A closed box seen from inside, four by four elements of two triangles on each side, a lamp in the ceiling's middle
/// four, and edges of every kind. Irradiance is a smooth function of position, one sample per place and wall.
pub(crate) fn room() -> Baked {
    let grey = |name: &str, r, g, b| Material { reflectance: DVec3::new(r, g, b), ..Material::grey(name) };
    let lamp = Material { radiance: DVec3::new(9.0, 8.0, 7.0), ..grey("lamp", 0.1, 0.1, 0.1) };
    let materials = vec![grey("wall", 0.7, 0.6, 0.5), grey("floor", 0.3, 0.5, 0.8), lamp];
    let mut baked =
        Baked { scene: Scene { materials, objects: vec!["room".into()], ..Scene::default() }, ..Baked::default() };
    for axis in 0..3 {
        for far in [false, true] {
            add_side(&mut baked, axis, far);
        }
    }
    for (kind, weight) in [(LineKind::Horizon, 1.0), (LineKind::EdgeVertex, 30.0), (LineKind::VertexEdge, 1000.0)] {
        let ends = [Vec3::ZERO, Vec3::ONE];
        baked.lines.push(DiscontinuityLine { kind, receiver: 0, source: 1, blocker: 1, weight, ends });
    }
    baked.triangle_errors = vec![0.0; baked.triangles.len()];
    baked.validate().expect("the room is a valid bake");
    baked
}

/// The room with a texture of every colour on its floor, turned, and repeated a few times.
pub(crate) fn textured_room() -> Baked {
    let mut baked = room();
    let scene = &mut baked.scene;
    let (width, height) = (13, 7);
    let texel = |i: u32| [(i * 37 % 256) as u8, (i * 91 % 256) as u8, (255 - i * 2 % 256) as u8];
    let texels = (0..width * height).map(texel).collect();
    scene.textures = vec![Texture { name: "confetti".into(), width, height, texels }];
    scene.materials[1].texture = Some(0);
    let corners = scene.corners.iter().map(|&corner| scene.vertices[corner as usize].as_vec3());
    scene.texture_coordinates =
        corners.map(|p| Vec2::new(0.9 * p.x + 0.4 * p.y - 7.0, 0.3 * p.y - 0.7 * p.x)).collect();
    scene.tints = scene.mean_texture_colours();
    baked.validate().expect("the room is a valid bake");
    baked
}

/// The room under a sky of many colours, which is seen from outside alone.
pub(crate) fn room_under_sky() -> Baked {
    let mut baked = room();
    let (width, height) = (16, 8);
    let texel = |i: u32| Vec3::new((i % 5) as f32, (i % 7) as f32, (i % 3) as f32);
    let sky = Sky::Map(LatLongMap { width, height, texels: (0..width * height).map(texel).collect() });
    baked.scene.environment = Some(Environment { sky, up: UpAxis::Y, rotation: 0.5, scale: 2.0 });
    baked.validate().expect("the room is a valid bake");
    baked
}

/// The room with the other side of every wall, in triangles of its own: nowhere is a back side to be seen.
pub(crate) fn room_of_sheets() -> Baked {
    let mut baked = room();
    let (polygons, triangles) = (baked.scene.polygons.len() as u32, baked.triangles.len());
    for polygon in 0..polygons {
        let record = baked.scene.polygons[polygon as usize];
        let first_corner = baked.scene.corners.len() as u32;
        // From another corner on, so that the diagonal of its triangles is the other one.
        let reversed: Vec<u32> = [0, 3, 2, 1].map(|i| baked.scene.corners[(record.first_corner + i) as usize]).to_vec();
        baked.scene.corners.extend(reversed);
        baked.scene.polygons.push(Polygon { first_corner, ..record });
    }
    for pair in 0..triangles / 2 {
        let [first, second] = [2 * pair, 2 * pair + 1].map(|id| baked.triangles[id]);
        let ([a, b, c], d) = (first.vertices, second.vertices[2]);
        let polygon = first.polygon + polygons;
        let other = |vertices, triangle| BakedTriangle { vertices, polygon, ..triangle };
        baked.triangles.extend([other([b, a, d], first), other([b, d, c], second)]);
    }
    baked.triangle_errors = vec![0.0; baked.triangles.len()];
    baked.validate().expect("the room is a valid bake");
    baked
}

/// A camera inside the room that sees its lamp.
pub(crate) fn camera() -> Camera {
    Camera { eye: DVec3::new(0.31, 0.47, 1.13), target: DVec3::new(2.9, 2.4, 1.4), up: DVec3::Z, vertical_fov: 1.2 }
}

fn add_side(baked: &mut Baked, axis: usize, far: bool) {
    let cell = SIZE / f64::from(DIVISIONS);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let place = |i: f64, j: f64| {
        let mut p = DVec3::ZERO;
        p[axis] = if far { SIZE[axis] } else { 0.0 };
        p[u] = i * cell[u];
        p[v] = j * cell[v];
        p
    };
    for j in 0..DIVISIONS {
        for i in 0..DIVISIONS {
            let middle = [i, j].iter().all(|&index| index == 1 || index == 2);
            let material = match (axis, far) {
                (2, true) if middle => 2,
                (2, false) => 1,
                _ => 0,
            };
            let (i, j) = (f64::from(i), f64::from(j));
            let mut outline = [place(i, j), place(i + 1.0, j), place(i + 1.0, j + 1.0), place(i, j + 1.0)];
            if far {
                outline.reverse();
            }
            add_element(baked, outline, material);
        }
    }
}

fn add_element(baked: &mut Baked, outline: [DVec3; 4], material: u32) {
    let scene = &mut baked.scene;
    let polygon = scene.polygons.len() as u32;
    let first_corner = scene.corners.len() as u32;
    scene.polygons.push(Polygon { first_corner, corner_count: 4, material, object: 0 });
    for corner in outline {
        scene.corners.push(scene.vertices.len() as u32);
        scene.vertices.push(corner);
    }
    let element = baked.elements.len() as u32;
    let middle = outline.iter().sum::<DVec3>() / 4.0;
    baked.elements.push(BakedElement { polygon, irradiance: light(middle) });
    let first_vertex = baked.vertices.len() as u32;
    baked.vertices.extend(outline.map(|corner| corner.as_vec3()));
    let kinds = [EdgeKind::Leaf, EdgeKind::Cut, EdgeKind::Discontinuity(element % 7 % 3)];
    for (corners, side) in [([0usize, 1, 2], 0), ([0, 2, 3], 1)] {
        let [a, b, c] = corners.map(|corner| outline[corner]);
        let first_sample = baked.samples.len() as u32;
        baked.samples.extend(SAMPLE_BARYCENTRICS.map(|(s, t)| light(a + (b - a) * s + (c - a) * t)));
        let border = kinds[(element % 3) as usize];
        baked.triangles.push(BakedTriangle {
            vertices: corners.map(|corner| first_vertex + corner as u32),
            samples: std::array::from_fn(|sample| first_sample + sample as u32),
            polygon,
            element,
            edges: if side == 0 { [border, border, EdgeKind::Interior] } else { [EdgeKind::Interior, border, border] },
        });
    }
}

/// Made-up irradiance, W·m⁻²: smooth, coloured, and dark enough in one corner to undershoot between samples.
fn light(p: DVec3) -> Vec3 {
    let wave = (1.7 * p.x + 0.3).sin() * (1.3 * p.y).cos() + (0.9 * p.z).sin();
    let bright = (-(p - SIZE * 0.6).length_squared()).exp();
    (DVec3::new(4.0, 3.5, 3.0) * (1.0 + 0.5 * wave).max(0.0) + DVec3::new(20.0, 25.0, 30.0) * bright).as_vec3()
}

/// Panics with the reason where a shader is not valid WGSL.
pub(crate) fn validate_shader(source: &str) {
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
}
