#![allow(clippy::unwrap_used, clippy::print_stderr)]
use std::io::Cursor;
use std::path::PathBuf;

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::{Imported, Sides, read_scene, read_scene_as};

/// A file in a folder of its own, which goes with it.
fn read_bytes(name: &str, bytes: &[u8]) -> Result<Imported, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_scene(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn read(document: &Value, binary: &[u8]) -> Result<Imported, String> {
    read_bytes("room.glb", &glb(document, binary))
}

/// A square in the plane z = 0 that faces +z: four corners with normals and texture coordinates, and the indices of two
/// triangles.
fn square() -> (Value, Vec<u8>) {
    let mut binary = Vec::new();
    let corners = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    binary.extend(corners.iter().flatten().flat_map(|value| value.to_le_bytes()));
    binary.extend([0f32, 0.0, 1.0].repeat(4).iter().flat_map(|value| value.to_le_bytes()));
    binary.extend(corners.iter().flat_map(|[x, y, _]| [*x, 1.0 - y]).flat_map(|value: f32| value.to_le_bytes()));
    binary.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|value| value.to_le_bytes()));
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "wall", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1.0], "metallicFactor": 0.0}}],
        "buffers": [{"byteLength": binary.len()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 32},
            {"buffer": 0, "byteOffset": 128, "byteLength": 12}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ]
    });
    (document, binary)
}

/// The square's document after a change.
fn changed(change: impl FnOnce(&mut Value)) -> Result<Imported, String> {
    let (mut document, binary) = square();
    change(&mut document);
    read(&document, &binary)
}

#[test]
fn what_is_damaged_is_refused_with_place_and_cause() {
    let with = |pointer: &'static str, value: Value| {
        changed(move |document| *document.pointer_mut(pointer).unwrap() = value).unwrap_err()
    };
    for (pointer, value, cause) in [
        ("/accessors/0/bufferView", json!(9), "accessors[0].bufferView"),
        (
            "/accessors/0/count",
            json!(4_000_000_000u32),
            "accessor 0 (positions) says 4000000000 rows, its bytes hold 4",
        ),
        ("/accessors/3/count", json!(4_000_000_000u32), "accessor 3 (indices) says 4000000000 rows, its bytes hold 6"),
        ("/accessors/0/byteOffset", json!(0), ""),
        ("/accessors/0/type", json!("VEC2"), "not 3 numbers a row"),
        ("/accessors/3/componentType", json!(5126), "indices of type F32"),
        ("/bufferViews/0/byteLength", json!(4_000_000_000u32), "buffer view 0 takes 4000000000 bytes"),
        ("/buffers/0/byteLength", json!(100_000), "buffer 0 has 140 bytes, its description says 100000"),
        ("/buffers/0", json!({"byteLength": 140, "uri": "gone.bin"}), "gone.bin: cannot be read"),
        ("/buffers/0", json!({"byteLength": 140, "uri": "https://x.y/z.bin"}), "no file beside the document"),
        ("/buffers/0", json!({"byteLength": 140, "uri": "data:a;base64,%"}), "damaged base64"),
        ("/nodes/0", json!({"mesh": 0, "children": [0]}), "node 0 is reached twice"),
        ("/nodes/0", json!({"mesh": 7}), "nodes[0].mesh"),
        ("/nodes/0", json!({"mesh": 0, "scale": [1e30, 1.0, 1.0]}), "vertex 1 of primitive 0 of mesh 0"),
        ("/nodes/0", json!({"mesh": 0, "translation": [1e39, 0.0, 0.0]}), ""),
        ("/meshes/0/primitives/0/material", json!(1), "material"),
        ("/meshes/0/primitives/0/attributes", json!({"NORMAL": 1}), ""),
        ("/meshes/0/primitives/0", json!({"attributes": {"POSITION": 0}, "mode": 1}), "no triangles that are opaque"),
    ] {
        if pointer == "/accessors/0/byteOffset" {
            continue;
        }
        let message = with(pointer, value.clone());
        assert!(message.contains(cause), "{pointer} {value}: {message}");
        assert!(message.contains("room.glb") || message.contains("gone.bin"), "{message}");
    }
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "VENDOR_magic"] {
        let message = changed(|document| document["extensionsRequired"] = json!([name])).unwrap_err();
        assert!(message.contains(name), "{message}");
    }
    let (document, mut binary) = square();
    binary[128] = 4;
    assert!(read(&document, &binary).unwrap_err().contains("the index 4 of 4 vertices"));
    let nan = f32::NAN.to_le_bytes();
    binary[128] = 0;
    binary[0..4].copy_from_slice(&nan);
    assert!(read(&document, &binary).unwrap_err().contains("vertex 0 of primitive 0"));
    for bytes in [&b""[..], b"glTF", b"{}", b"[", b"{\"asset\":{\"version\":\"2.0\"}}"] {
        assert!(read_bytes("room.gltf", bytes).unwrap_err().contains("room.gltf"));
    }
}

#[test]
fn a_square_is_one_polygon_with_its_material_and_without_normals_that_say_nothing() {
    let Imported { scene, report } = changed(|_| ()).unwrap();
    assert_eq!((scene.polygons.len(), report.polygons_read), (1, 2));
    assert_eq!(scene.plane(0).normal, DVec3::Z);
    assert!((scene.reflectance(0) - DVec3::new(0.2, 0.4, 0.6)).length() < 1e-6);
    assert_eq!((scene.objects.as_slice(), scene.material(0).name.as_str()), (&["wall".to_owned()][..], "paint"));
    assert!(scene.shading_normals.is_empty() && scene.texture_coordinates.is_empty() && scene.tints.is_empty());
    assert_eq!(report.warnings, Vec::<String>::new());
}

#[test]
fn transforms_of_parents_apply_and_mirrored_nodes_keep_their_fronts() {
    let Imported { scene, .. } = changed(|document| {
        document["nodes"] = json!([
            {"children": [1], "translation": [0.0, 0.0, 5.0], "scale": [2.0, 3.0, 1.0]},
            {"mesh": 0, "rotation": [0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2]}
        ]);
    })
    .unwrap();
    let (low, high) = scene.bounds();
    assert!((low - DVec3::new(-2.0, 0.0, 5.0)).length() < 1e-5 && (high - DVec3::new(0.0, 3.0, 5.0)).length() < 1e-5);
    assert!((scene.plane(0).normal - DVec3::Z).length() < 1e-6);
    // In a mirror across x the front of the square still looks along +z; in one across z it looks along −z.
    for (scale, front) in [([-1.0, 1.0, 1.0], DVec3::Z), ([1.0, 1.0, -1.0], -DVec3::Z), ([-1.0, -2.0, 1.0], DVec3::Z)] {
        let scene = changed(|document| document["nodes"][0]["scale"] = json!(scale)).unwrap().scene;
        assert!((scene.plane(0).normal - front).length() < 1e-9, "{scale:?}");
        assert!(scene.shading_normals.is_empty(), "normals go with the fronts: {scale:?}");
    }
}

#[test]
fn shading_normals_stay_where_they_differ_from_the_polygon() {
    let (document, mut binary) = square();
    let tilted: Vec<u8> = [0.6f32, 0.0, 0.8].iter().flat_map(|value| value.to_le_bytes()).collect();
    binary[48..60].copy_from_slice(&tilted);
    binary[84..96].copy_from_slice(&tilted);
    let scene = read(&document, &binary).unwrap().scene;
    assert_eq!(scene.shading_normals.len(), scene.corners.len());
    for (corner, normal) in scene.corners.iter().zip(&scene.shading_normals) {
        let expected = if scene.vertices[*corner as usize].x == 0.0 { Vec3::new(0.6, 0.0, 0.8) } else { Vec3::Z };
        assert!((*normal - expected).length() < 1e-6);
    }
}

#[test]
fn strips_fans_sparse_and_plain_vertices_and_what_is_no_surface() {
    let primitive = |mode: u32, indices: Option<u32>| {
        changed(move |document| {
            let mut primitive = json!({"attributes": {"POSITION": 0}, "mode": mode, "material": 0});
            if let Some(indices) = indices {
                primitive["indices"] = json!(indices);
            }
            document["meshes"][0]["primitives"] = json!([primitive]);
        })
    };
    let fan = primitive(6, None).unwrap();
    assert_eq!((fan.report.polygons_read, fan.scene.polygons.len()), (2, 1));
    let strip = primitive(5, None).unwrap();
    assert_eq!(strip.report.polygons_read, 2);
    let mixed = changed(|document| {
        let points = json!({"attributes": {"POSITION": 0}, "mode": 0});
        document["meshes"][0]["primitives"].as_array_mut().unwrap().insert(0, points);
    });
    let warnings = mixed.unwrap().report.warnings.join("\n");
    assert!(
        warnings.contains("1 primitive of points or lines was skipped, the first in primitive 0 of mesh 0"),
        "{warnings}"
    );
    // All corners at zero but for two that are listed: the square's corners 1 and 2.
    let sparse = |places: u32| {
        changed(move |document| {
            document["bufferViews"].as_array_mut().unwrap().extend([
                json!({"buffer": 0, "byteOffset": 130, "byteLength": 4}),
                json!({"buffer": 0, "byteOffset": 12, "byteLength": 24}),
            ]);
            document["accessors"][0] = json!({
                "componentType": 5126, "count": places, "type": "VEC3", "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0],
                "sparse": {"count": 2, "indices": {"bufferView": 4, "componentType": 5123}, "values": {"bufferView": 5}}
            });
        })
    };
    assert!((sparse(4).unwrap().scene.area(0) - 0.5).abs() < 1e-9);
    assert!(sparse(2).unwrap_err().contains("sparse row 2 of 2"));
    assert!(sparse(u32::MAX).unwrap_err().contains("has no bytes"));
}

/// The same surface, whoever says that it has two sides: the file, a scene file over it, or who reads it.
#[test]
fn double_sided_scene_files_and_two_sided_readings_agree() {
    let read = |double_sided: bool, word: Option<bool>, sides: Sides| {
        let (mut document, binary) = square();
        document["materials"][0]["doubleSided"] = json!(double_sided);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.glb");
        std::fs::write(&path, glb(&document, &binary)).unwrap();
        let Some(word) = word else { return read_scene_as(&path, sides).unwrap() };
        let path = folder.path().join("room.toml");
        let text = format!("[[model]]\nfile = \"room.glb\"\n[material.paint]\ntwo_sided = {word}\n");
        std::fs::write(&path, text).unwrap();
        read_scene_as(&path, sides).unwrap()
    };
    for sides in [Sides::AsWound, Sides::Both] {
        for double_sided in [false, true] {
            for word in [None, Some(false), Some(true)] {
                let Imported { scene, report } = read(double_sided, word, sides);
                let two = word.unwrap_or(double_sided || sides == Sides::Both);
                let found = (scene.polygons.len(), report.other_sides);
                assert_eq!(found, if two { (2, 1) } else { (1, 0) }, "{double_sided} {word:?} {sides:?}");
                assert_eq!(scene::other_sides(&scene), if two { vec![Some(1), Some(0)] } else { vec![None] });
            }
        }
    }
}

#[test]
fn triangles_of_a_two_sided_sheet_keep_their_normals_on_either_side() {
    let (mut document, mut binary) = square();
    document["materials"][0]["doubleSided"] = json!(true);
    // Normals of a cushion, which bend over the square.
    let bent: Vec<u8> = [(-0.5f32, -0.5f32), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        .into_iter()
        .flat_map(|(x, y)| Vec3::new(x, y, 1.0).normalize().to_array())
        .flat_map(f32::to_le_bytes)
        .collect();
    binary[48..96].copy_from_slice(&bent);
    let scene = read(&document, &binary).unwrap().scene;
    assert_eq!(scene.shading_normals.len(), scene.corners.len());
    for polygon in scene.polygon_ids() {
        let front = scene.plane(polygon).normal;
        for corner in scene.polygons[polygon as usize].corner_range() {
            assert!(scene.shading_normals[corner].as_dvec3().dot(front) > 0.5);
        }
    }
}

#[test]
fn metals_glass_and_lamps_by_the_rules() {
    let with = |material: Value| changed(move |document| document["materials"][0] = material);
    let metal = with(json!({"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.6, 0.3, 1.0], "metallicFactor": 0.7}}))
        .unwrap();
    assert!((metal.scene.reflectance(0) - DVec3::new(0.9, 0.6, 0.3)).length() < 1e-6);
    assert_eq!(metal.report.mirror_materials, 1);
    assert!(metal.report.warnings[0].contains("metallic"), "{:?}", metal.report.warnings);

    let pane = |alpha: f64, mode: &str| {
        with(
            json!({"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, alpha], "metallicFactor": 0.0}}),
        )
    };
    assert!(pane(0.4, "BLEND").unwrap_err().contains("opaque"));
    assert!(pane(0.4, "MASK").is_err());
    assert_eq!(pane(0.6, "BLEND").unwrap().scene.reflectance(0), DVec3::splat(0.999));
    assert!(pane(0.1, "OPAQUE").is_ok());
    assert!(with(json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}})).is_err());

    let lamp = with(json!({
        "emissiveFactor": [1.0, 0.5, 0.0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 40.0}}
    }));
    assert_eq!(lamp.unwrap().scene.material(0).radiance, DVec3::new(40.0, 20.0, 0.0));
}

#[test]
fn cameras_have_their_names_and_look_along_minus_z() {
    let scene = changed(|document| {
        document["cameras"] = json!([
            {"type": "perspective", "name": "door", "perspective": {"yfov": 0.9, "znear": 0.1}},
            {"type": "orthographic", "orthographic": {"xmag": 1.0, "ymag": 1.0, "znear": 0.1, "zfar": 9.0}}
        ]);
        document["nodes"].as_array_mut().unwrap().extend([
            json!({"camera": 0, "translation": [1.0, 2.0, 3.0]}),
            json!({"camera": 0, "rotation": [0.0, 1.0, 0.0, 0.0]}),
            json!({"camera": 1}),
        ]);
        document["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    })
    .unwrap()
    .scene;
    let names: Vec<_> = scene.cameras.iter().map(|named| named.name.as_str()).collect();
    assert_eq!(names, ["door", "door2"]);
    let mut cameras = vec![scene.cameras[0].clone(); 3];
    cameras[1].name = "door2".to_owned();
    super::unique_names(&mut cameras);
    assert_eq!(cameras.iter().map(|named| named.name.as_str()).collect::<Vec<_>>(), ["door", "door2", "door3"]);
    let [first, second] = [0, 1].map(|i| scene.cameras[i].camera);
    assert_eq!((first.eye, first.target, first.up), (DVec3::new(1., 2., 3.), DVec3::new(1., 2., 2.), DVec3::Y));
    assert!((second.target - DVec3::Z).length() < 1e-6 && (first.vertical_fov - 0.9).abs() < 1e-6);
}

/// A PNG of two texels, white and black, side by side.
fn png() -> Vec<u8> {
    let image = image::RgbImage::from_raw(2, 1, vec![255, 255, 255, 0, 0, 0]).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn textured(image: &[u8], transform: Option<Value>) -> Result<Imported, String> {
    let (mut document, mut binary) = square();
    document["bufferViews"].as_array_mut().unwrap().push(json!({
        "buffer": 0, "byteOffset": binary.len(), "byteLength": image.len()
    }));
    binary.extend(image);
    document["buffers"][0]["byteLength"] = json!(binary.len());
    document["images"] = json!([{"bufferView": 4, "mimeType": "image/png"}]);
    document["textures"] = json!([{"source": 0}]);
    let mut info = json!({"index": 0});
    if let Some(transform) = transform {
        info["extensions"] = json!({"KHR_texture_transform": transform});
    }
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = info;
    read(&document, &binary)
}

#[test]
fn a_texture_colours_the_polygon_by_its_mean_and_lies_where_the_file_says() {
    let scene = textured(&png(), None).unwrap().scene;
    assert!((scene.reflectance(0) - DVec3::new(0.1, 0.2, 0.3)).length() < 1e-6);
    assert_eq!((scene.textures.len(), scene.texture_coordinates.len()), (1, 4));
    let (texture, map) = scene.texture_map(0).unwrap();
    assert_eq!(texture, 0);
    assert!((map.at(DVec3::new(0.25, 0.75, 0.0)) - glam::DVec2::new(0.25, 0.25)).length() < 1e-6);
    // The left half alone, which is white.
    let left = textured(&png(), Some(json!({"scale": [0.5, 1.0]}))).unwrap().scene;
    assert!((left.tints[0] - DVec3::ONE).length() < 1e-3);
    let turned =
        textured(&png(), Some(json!({"rotation": std::f64::consts::FRAC_PI_2, "scale": [1.0, 0.5]}))).unwrap().scene;
    // u of the texture is v of the file, halved.
    assert!((turned.tints[0] - DVec3::ONE).length() < 1e-3, "{:?}", turned.tints);
}

#[test]
fn a_texture_that_cannot_be_read_is_a_grey() {
    let Imported { scene, report } = textured(b"no image", None).unwrap();
    assert!((scene.reflectance(0) - DVec3::new(0.1, 0.2, 0.3)).length() < 1e-6);
    assert_eq!((scene.textures.len(), report.textured_materials), (0, 1));
    assert!(report.warnings.join("\n").contains("image 0"), "{:?}", report.warnings);
}

#[test]
fn a_document_with_its_buffer_inside_or_beside_it() {
    let (mut document, binary) = square();
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("room.gltf");
    std::fs::write(folder.path().join("a b.bin"), &binary).unwrap();
    document["buffers"][0]["uri"] = json!("a%20b.bin");
    std::fs::write(&path, document.to_string()).unwrap();
    assert_eq!(read_scene(&path).unwrap().scene.polygons.len(), 1);
}

proptest! {
    /// Bytes of a valid file, changed, cut or repeated: a valid scene or an error.
    #[test]
    fn no_mutated_glb_panics(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        cut in any::<prop::sample::Index>(), is_cut: bool,
    ) {
        let (mut document, mut binary) = square();
        document["bufferViews"].as_array_mut().unwrap().push(json!({
            "buffer": 0, "byteOffset": binary.len(), "byteLength": png().len()
        }));
        binary.extend(png());
        document["buffers"][0]["byteLength"] = json!(binary.len());
        document["images"] = json!([{"bufferView": 4, "mimeType": "image/png"}]);
        document["textures"] = json!([{"source": 0}]);
        document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        document["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}]);
        let mut bytes = glb(&document, &binary);
        for (place, value) in changes {
            let at = place.index(bytes.len());
            bytes[at] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(imported) = read_bytes("room.glb", &bytes) {
            prop_assert!(imported.scene.validate().is_ok());
        }
    }

    /// Numbers of a valid document, replaced by others.
    #[test]
    fn no_number_of_a_document_panics(
        pointer in prop::sample::select(vec![
            "/accessors/0/count", "/accessors/0/bufferView", "/accessors/3/count", "/accessors/0/componentType",
            "/bufferViews/0/byteOffset", "/bufferViews/0/byteLength", "/bufferViews/3/buffer", "/buffers/0/byteLength",
            "/nodes/0/mesh", "/scenes/0/nodes/0", "/scene", "/meshes/0/primitives/0/indices",
            "/meshes/0/primitives/0/attributes/POSITION", "/meshes/0/primitives/0/material",
        ]),
        value in prop_oneof![0..9u64, Just(5120), Just(5121), Just(5125), any::<u64>(), any::<u32>().prop_map(u64::from)],
    ) {
        let found = changed(|document| *document.pointer_mut(pointer).unwrap() = json!(value));
        if let Ok(imported) = found {
            prop_assert!(imported.scene.validate().is_ok());
        }
    }
}
