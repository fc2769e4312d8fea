#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;
use scene::{
    Answers, BakedElement, BakedTriangle, Camera, DiscontinuityLine, EdgeKind, Gloss, LineKind, Polygon, Rgb, Rows,
    Seen, UpAxis,
};

use super::*;

fn texture(width: u32, height: u32) -> Texture {
    let texels = (0..width * height).map(|i| [i as u8, width as u8, 200]).collect();
    Texture { name: format!("{width} wide"), width, height, texels }
}

/// A bake of one square with every kind of record in it.
fn bake() -> Baked {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    let triangle =
        |vertices, edges| BakedTriangle { vertices, samples: [0, 1, 2, 3, 4, 5], polygon: 0, element: 0, edges };
    Baked {
        scene: Scene {
            vertices: corners.to_vec(),
            corners: vec![0, 1, 2, 3],
            texture_coordinates: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            shading_normals: vec![Vec3::Z, Vec3::ZERO, Vec3::Z, Vec3::Z],
            polygons: vec![Polygon { first_corner: 0, corner_count: 4, material: 0, object: 0 }],
            tints: vec![DVec3::new(0.1, 0.2, 0.3)],
            materials: vec![Material {
                texture: Some(1),
                gloss: Some(Gloss { diffuse: Rgb::X, specular: Rgb::splat(0.25), exponent: 30.0, is_mirror: true }),
                ..Material::grey("wall")
            }],
            textures: [1, 2].map(|width| texture(width, 3)).to_vec(),
            objects: vec!["room".into()],
            cameras: vec![NamedCamera {
                name: "camera".into(),
                camera: Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 1.0 },
            }],
            lights: vec![
                Light::Point { position: DVec3::ONE, intensity: Rgb::Y },
                Light::Directional { direction: DVec3::Z, irradiance: Rgb::ONE },
            ],
            environment: Some(Environment {
                sky: Sky::Map(LatLongMap { width: 2, height: 1, texels: vec![Vec3::ONE, Vec3::X] }),
                up: UpAxis::Y,
                rotation: 0.5,
                scale: 2.0,
            }),
        },
        vertices: corners.map(|corner| corner.as_vec3()).to_vec(),
        samples: (0..6).map(|i| Vec3::splat(i as f32 * 0.1)).collect(),
        sky: (0..6).map(|i| Vec3::splat(i as f32 * 0.05)).collect(),
        triangles: vec![
            triangle([0, 1, 2], [EdgeKind::Leaf, EdgeKind::Cut, EdgeKind::Discontinuity(1)]),
            triangle([0, 2, 3], [EdgeKind::Discontinuity(1), EdgeKind::Interior, EdgeKind::Discontinuity(0)]),
        ],
        triangle_errors: vec![0.01, 0.02],
        elements: vec![BakedElement { polygon: 0, irradiance: Vec3::new(1.0, 2.0, 3.0) }],
        lines: [LineKind::Horizon, LineKind::VertexEdge]
            .map(|kind| DiscontinuityLine {
                kind,
                receiver: 0,
                source: 0,
                blocker: 0,
                weight: 1.5,
                ends: [Vec3::X, Vec3::Y],
            })
            .to_vec(),
        error: BakedError { rms: 0.003, p99: 0.02, max: 0.1, points: 12, holds: true },
        provenance: Provenance {
            program: "halflight 0.1.0".into(),
            options: vec![("tolerance".into(), "0.01".into())],
            statistics: vec![("elements".into(), 1.0)],
        },
    }
}

/// What an interrupted bake has found out, with an answer of every kind.
fn found_out() -> Unfinished {
    let seen = |node| Seen { node, form_factor: 0x1234, offset: [1, -2] };
    Unfinished {
        build: "halflight 0.1.0".into(),
        options: "tolerance 0.01".into(),
        answers: Answers {
            questions: vec![1, u64::MAX, 3],
            emitted: vec![Vec3::new(1.0, 0.5, 1.0 / 3.0), Vec3::ZERO],
            sky: vec![Vec3::new(0.5, 0.0, 0.25), Vec3::ZERO],
            rows: Rows::new(vec![seen(1), seen(7), seen(3)], &[2, 0, 1]).unwrap(),
            residuals: vec![[0.1, 0.2, 0.3, -0.1, -0.2, -0.3, 7.0]],
        },
    }
}

fn interrupted(unfinished: &Unfinished) -> Vec<u8> {
    let file = File::new(&[]);
    write_unfinished(&file.path, &bake(), unfinished).unwrap();
    fs::read(&file.path).unwrap()
}

fn read_interrupted(bytes: &[u8]) -> Result<(Baked, Option<Unfinished>), FormatError> {
    read_unfinished(&File::new(bytes).path)
}

fn written(baked: &Baked) -> Vec<u8> {
    let file = File::new(&[]);
    write_baked(&file.path, baked).unwrap();
    fs::read(&file.path).unwrap()
}

/// A file in a folder of its own, which goes with it.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl File {
    fn new(bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.hlf");
        fs::write(&path, bytes).unwrap();
        Self { path, _folder: folder }
    }
}

fn read(bytes: &[u8]) -> Result<Baked, FormatError> {
    read_baked(&File::new(bytes).path)
}

#[test]
fn an_empty_bake_and_a_full_one_come_back_and_the_bytes_are_the_same_each_time() {
    for baked in [Baked::default(), bake()] {
        let bytes = written(&baked);
        assert_eq!(read(&bytes).unwrap(), baked);
        assert_eq!(written(&baked), bytes);
    }
}

#[test]
fn an_interrupted_bake_comes_back_with_what_it_found_out_and_is_a_bake_to_all_others() {
    for unfinished in [Unfinished::default(), found_out()] {
        let bytes = interrupted(&unfinished);
        assert_eq!(read_interrupted(&bytes).unwrap(), (bake(), Some(unfinished)));
        assert_eq!(read(&bytes).unwrap(), bake());
    }
    let good = written(&bake());
    assert_eq!(read_interrupted(&good).unwrap(), (bake(), None));
    let mut bad = found_out();
    bad.answers.residuals[0][6] = f64::NAN;
    assert!(matches!(read_interrupted(&interrupted(&bad)).unwrap_err(), FormatError::Invalid { .. }));
    bad = found_out();
    bad.answers.sky.pop();
    assert!(matches!(read_interrupted(&interrupted(&bad)).unwrap_err(), FormatError::Invalid { .. }));
}

#[test]
fn each_kind_of_damage_has_its_own_error() {
    let good = written(&bake());
    assert!(matches!(read(b"").unwrap_err(), FormatError::NotBaked { .. }));
    assert!(matches!(read(b"v 0 0 0\n").unwrap_err(), FormatError::NotBaked { .. }));
    assert!(matches!(read(&good[..5]).unwrap_err(), FormatError::Truncated { .. }));
    let cut = read(&good[..good.len() - 1]).unwrap_err();
    assert!(matches!(&cut, FormatError::Truncated { part, .. } if part == "lines"), "{cut}");
    let mut newer = good.clone();
    newer[8] = VERSION as u8 + 1;
    let newer = read(&newer).unwrap_err();
    assert!(matches!(newer, FormatError::Newer { found, supported: VERSION, .. } if found == VERSION + 1));
    let mut altered = good.clone();
    *altered.last_mut().unwrap() ^= 1;
    let altered = read(&altered).unwrap_err();
    assert!(matches!(&altered, FormatError::Altered { part, .. } if part == "lines"), "{altered}");
    let longer = read(&[good.as_slice(), b"x"].concat()).unwrap_err();
    assert!(matches!(&longer, FormatError::Altered { part, .. } if part == "end"), "{longer}");
    assert!(matches!(read_baked(Path::new("missing.hlf")).unwrap_err(), FormatError::Read { .. }));
}

#[test]
fn a_bake_that_is_not_valid_is_neither_written_nor_read() {
    let mut baked = bake();
    baked.triangles[0].vertices[2] = 4;
    let file = File::new(b"old");
    assert!(matches!(write_baked(&file.path, &baked).unwrap_err(), FormatError::Invalid { .. }));
    assert_eq!(fs::read(&file.path).unwrap(), b"old");
    // The same in a file whose checksums are right.
    let good = written(&bake());
    let rows = to_bytes(&bake().triangles);
    let at = good.windows(rows.len()).position(|window| window == rows).unwrap();
    let forged = forge(&good, |body, header_end| body[at - header_end + 8] = 4);
    assert!(matches!(read(&forged).unwrap_err(), FormatError::Invalid { .. }));
}

#[test]
fn a_forged_table_of_sections_is_refused() {
    let good = written(&bake());
    let with = |change: &dyn Fn(&mut Vec<Section>)| {
        let length = u32::from_le_bytes(*good[12..16].as_array().unwrap()) as usize;
        let (mut header, _): (Header, usize) =
            bincode::serde::decode_from_slice(&good[PREAMBLE..PREAMBLE + length], encoding()).unwrap();
        change(&mut header.sections);
        assemble(&header, &good[PREAMBLE + length..])
    };
    assert_eq!(read(&with(&|_| ())).unwrap(), bake());
    for (change, word) in [
        (&(|s: &mut Vec<Section>| s[1].offset -= 1) as &dyn Fn(&mut Vec<Section>), "overlap"),
        (&|s| s[12].length = u64::MAX, "overflow"),
        (&|s| s[12].length += 1 << 40, "cut off"),
        (&|s| s[0].name = "other".into(), "missing"),
        (&|s| drop(s.pop()), "behind the last section"),
        (&|s| s.clear(), "behind the last section"),
    ] {
        let message = read(&with(change)).unwrap_err().to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
    // A header that claims to be longer than the file, and one whose strings do.
    let mut long = good.clone();
    long[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(read(&long).unwrap_err(), FormatError::Truncated { .. }));
    let mut claim = MAGIC.to_vec();
    VERSION.put(&mut claim);
    9u32.put(&mut claim);
    let header = [253, 255, 255, 255, 255, 255, 255, 255, 255];
    checksum(&claim, &header).put(&mut claim);
    claim.extend(header);
    assert!(read(&claim).unwrap_err().to_string().contains("cannot be decoded"));
}

#[test]
fn a_bake_is_known_by_its_bytes_or_its_name() {
    let file = File::new(&written(&bake()));
    let renamed = file.path.with_file_name("room.bin");
    fs::copy(&file.path, &renamed).unwrap();
    assert!(is_baked(&renamed) && is_baked(Path::new("missing.HLF")));
    fs::write(&renamed, b"\x89HL").unwrap();
    assert!(!is_baked(&renamed) && !is_baked(Path::new("room.obj")));
}

fn assemble(header: &Header, body: &[u8]) -> Vec<u8> {
    let header = bincode::serde::encode_to_vec(header, encoding()).unwrap();
    let mut bytes = MAGIC.to_vec();
    VERSION.put(&mut bytes);
    (header.len() as u32).put(&mut bytes);
    checksum(&bytes, &header).put(&mut bytes);
    [bytes.as_slice(), &header, body].concat()
}

/// Changes bytes of the sections and makes all checksums right again.
fn forge(good: &[u8], change: impl Fn(&mut [u8], usize)) -> Vec<u8> {
    let end = PREAMBLE + u32::from_le_bytes(*good[12..16].as_array().unwrap()) as usize;
    let (mut header, _): (Header, usize) = bincode::serde::decode_from_slice(&good[PREAMBLE..end], encoding()).unwrap();
    let mut body = good[end..].to_vec();
    change(&mut body, end);
    for section in &mut header.sections {
        section.checksum = crc32fast::hash(&body[section.offset as usize..][..section.length as usize]);
    }
    assemble(&header, &body)
}

proptest! {
    #[test]
    fn random_bytes_are_refused(bytes: Vec<u8>, with_magic: bool) {
        let magic: &[u8] = if with_magic { b"\x89HLF\r\n\x1a\n\x01\0\0\0" } else { b"" };
        prop_assert!(read(&[magic, &bytes].concat()).is_err());
    }

    #[test]
    fn any_flipped_bit_and_any_cut_is_noticed(place in any::<prop::sample::Index>(), bit in 0..8u32) {
        let good = interrupted(&found_out());
        let at = place.index(good.len());
        prop_assert!(read(&good[..at]).is_err());
        let mut flipped = good;
        flipped[at] ^= 1 << bit;
        prop_assert!(read(&flipped).is_err());
    }

    /// Past the checksums nothing but the checks of rows and [`Baked::validate`] stands.
    #[test]
    fn forged_sections_are_a_valid_bake_or_an_error(place in any::<prop::sample::Index>(), value: u8) {
        let forged = forge(&interrupted(&found_out()), |body, _| body[place.index(body.len())] = value);
        if let Ok((baked, unfinished)) = read_interrupted(&forged) {
            prop_assert!(baked.validate().is_ok());
            prop_assert!(unfinished.is_none_or(|unfinished| unfinished.answers.validate().is_ok()));
        }
    }
}
