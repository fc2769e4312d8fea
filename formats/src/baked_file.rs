//! The `.hlf` file: a bake as bytes.
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | magic: 0x89 `HLF` CR LF 0x1a LF; a transfer as text breaks it, as it does a PNG's |
//! | 8..12 | version, u32 |
//! | 12..16 | length of the header, u32 |
//! | 16..20 | CRC-32 of bytes 0..16 and the header, u32 |
//! | 20.. | header: what made the bake, its error, materials, textures' names and sizes, objects, cameras, lights, environment and the table of sections, in bincode |
//! | then | the sections, one after another without gaps |
//!
//! Everything is little-endian. A section is an array of fixed-size rows: positions in metres, irradiance in W·m⁻²,
//! indices u32. Nothing in the file depends on when, where or on how many threads it was made, unless the bake was
//! interrupted: then more sections follow (`unfinished`).

use std::fs;
use std::io::Read;
use std::path::Path;

use glam::Vec3;
use scene::{
    Baked, BakedError, Environment, LatLongMap, Light, Material, NamedCamera, Provenance, Scene, Sky, Texture,
    Unfinished,
};
use serde::{Deserialize, Serialize};

use crate::record::{Record, from_bytes, to_bytes};
use crate::unfinished::{self, UNFINISHED};
use crate::{FormatError, write_atomically};

const MAGIC: [u8; 8] = *b"\x89HLF\r\n\x1a\n";

/// Raised with every change that an older program would misread.
const VERSION: u32 = 6;

/// Bytes before the header.
const PREAMBLE: usize = 20;

/// Most bytes that decoding a header may claim: a million of objects with their names, and far from what would hurt.
const HEADER_LIMIT: usize = 1 << 28;

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Header {
    provenance: Provenance,
    error: BakedError,
    materials: Vec<Material>,
    /// Name, width and height of each; the texels are a section, one texture after another.
    textures: Vec<(String, u32, u32)>,
    objects: Vec<String>,
    cameras: Vec<NamedCamera>,
    lights: Vec<Light>,
    /// Without the texels of a map, which are a section.
    environment: Option<Environment>,
    sections: Vec<Section>,
}

/// Where an array lies.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Section {
    name: String,
    /// First byte, from the end of the header.
    offset: u64,
    /// Bytes.
    length: u64,
    /// CRC-32 of the bytes.
    checksum: u32,
}

/// Whether a file is a bake: by its first bytes, or by its extension `.hlf` if it cannot be read that far.
pub fn is_baked(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    let magic = fs::File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok_and(|()| start == MAGIC);
    magic || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hlf"))
}

/// Writes a bake. The same bake gives the same bytes.
///
/// # Errors
/// A bake that does not pass [`Baked::validate`], or a path that cannot be written; then nothing is left behind.
pub fn write_baked(path: &Path, baked: &Baked) -> Result<(), FormatError> {
    write(path, baked, None)
}

/// Writes an interrupted bake with what it has found out.
///
/// # Errors
/// Those of [`write_baked`].
pub fn write_unfinished(path: &Path, baked: &Baked, unfinished: &Unfinished) -> Result<(), FormatError> {
    write(path, baked, Some(unfinished))
}

fn write(path: &Path, baked: &Baked, unfinished: Option<&Unfinished>) -> Result<(), FormatError> {
    baked.validate().map_err(|source| FormatError::Invalid { path: path.to_owned(), source })?;
    let scene = &baked.scene;
    let mut arrays = vec![
        ("scene vertices", to_bytes(&scene.vertices)),
        ("scene corners", to_bytes(&scene.corners)),
        ("texture coordinates", to_bytes(&scene.texture_coordinates)),
        ("shading normals", to_bytes(&scene.shading_normals)),
        ("scene polygons", to_bytes(&scene.polygons)),
        ("tints", to_bytes(&scene.tints)),
        ("texels", scene.textures.iter().flat_map(|texture| texture.texels.as_flattened()).copied().collect()),
        ("environment", to_bytes(map_of(scene.environment.as_ref()))),
        ("vertices", to_bytes(&baked.vertices)),
        ("samples", to_bytes(&baked.samples)),
        ("sky", to_bytes(&baked.sky)),
        ("triangles", to_bytes(&baked.triangles)),
        ("triangle errors", to_bytes(&baked.triangle_errors)),
        ("elements", to_bytes(&baked.elements)),
        ("lines", to_bytes(&baked.lines)),
    ];
    arrays.extend(unfinished.into_iter().flat_map(unfinished::sections));
    let mut offset = 0;
    let sections = arrays.iter().map(|(name, bytes)| {
        let length = bytes.len() as u64;
        let section = Section { name: (*name).to_owned(), offset, length, checksum: crc32fast::hash(bytes) };
        offset += length;
        section
    });
    let header = Header {
        provenance: baked.provenance.clone(),
        error: baked.error,
        materials: scene.materials.clone(),
        textures: scene.textures.iter().map(|t| (t.name.clone(), t.width, t.height)).collect(),
        objects: scene.objects.clone(),
        cameras: scene.cameras.clone(),
        lights: scene.lights.clone(),
        environment: scene.environment.as_ref().map(|environment| with_texels(environment, Vec::new())),
        sections: sections.collect(),
    };
    let too_large = || FormatError::content(path, "the bake's names and options fill a gigabyte", "shorten the names");
    let header = bincode::serde::encode_to_vec(&header, encoding()).map_err(|_| too_large())?;
    if header.len() > HEADER_LIMIT {
        return Err(too_large());
    }
    let mut start = MAGIC.to_vec();
    VERSION.put(&mut start);
    (header.len() as u32).put(&mut start);
    checksum(&start, &header).put(&mut start);
    write_atomically(path, |to| {
        let parts = [&start, &header].into_iter().chain(arrays.iter().map(|(_, bytes)| bytes));
        parts.into_iter().try_for_each(|part| to.write_all(part)).map_err(|error| FormatError::write(path, error))
    })
}

/// Reads a bake and checks all of it: magic, version, lengths, checksums, and every index and number.
///
/// # Errors
/// Distinct ones for a file that is none, is cut off, was altered, comes from a later version, or holds a bake that
/// does not pass [`Baked::validate`].
pub fn read_baked(path: &Path) -> Result<Baked, FormatError> {
    Ok(read_unfinished(path)?.0)
}

/// Reads a bake as [`read_baked`] does, and if it was interrupted, what it had found out.
///
/// # Errors
/// Those of [`read_baked`], of what it had found out, too.
pub fn read_unfinished(path: &Path) -> Result<(Baked, Option<Unfinished>), FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::read(path, error))?;
    let truncated = |part: &str| FormatError::Truncated {
        path: path.to_owned(),
        length: bytes.len() as u64,
        part: part.to_owned(),
    };
    let altered = |part: &str, cause| FormatError::Altered { path: path.to_owned(), part: part.to_owned(), cause };

    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if magic.is_empty() || !MAGIC.starts_with(magic) {
        return Err(FormatError::NotBaked { path: path.to_owned() });
    }
    let Some((start, rest)) = bytes.split_at_checked(PREAMBLE) else { return Err(truncated("preamble")) };
    let word = |at: usize| u32::from_le_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]);
    let (version, header_length, header_checksum) = (word(8), word(12) as usize, word(16));
    if version > VERSION {
        return Err(FormatError::Newer { path: path.to_owned(), found: version, supported: VERSION });
    }
    if version < VERSION {
        return Err(altered("version", "there is no such version"));
    }
    let Some((header, body)) = rest.split_at_checked(header_length) else { return Err(truncated("header")) };
    if checksum(&start[..16], header) != header_checksum {
        return Err(altered("header", "its checksum differs"));
    }
    let header: Header = match bincode::serde::decode_from_slice(header, encoding()) {
        Ok((decoded, length)) if length == header.len() => decoded,
        _ => return Err(altered("header", "its fields cannot be decoded")),
    };

    let mut end = 0u64;
    for section in &header.sections {
        if section.offset != end {
            return Err(altered("table of sections", "sections overlap or leave gaps"));
        }
        end = end.checked_add(section.length).ok_or_else(|| altered("table of sections", "a length overflows"))?;
        if end > body.len() as u64 {
            return Err(truncated(&section.name));
        }
        if crc32fast::hash(slice(body, section)) != section.checksum {
            return Err(altered(&section.name, "its checksum differs"));
        }
    }
    if end != body.len() as u64 {
        return Err(altered("end", "there are bytes behind the last section"));
    }

    let sections = Sections { table: &header.sections, body, altered: &altered };
    let textures = textures(header.textures, &sections.rows("texels")?)
        .ok_or_else(|| altered("texels", "their number differs"))?;
    let baked = Baked {
        scene: Scene {
            vertices: sections.rows("scene vertices")?,
            corners: sections.rows("scene corners")?,
            texture_coordinates: sections.rows("texture coordinates")?,
            shading_normals: sections.rows("shading normals")?,
            polygons: sections.rows("scene polygons")?,
            tints: sections.rows("tints")?,
            materials: header.materials,
            textures,
            objects: header.objects,
            cameras: header.cameras,
            lights: header.lights,
            environment: match &header.environment {
                Some(environment) => Some(with_texels(environment, sections.rows("environment")?)),
                None => None,
            },
        },
        vertices: sections.rows("vertices")?,
        samples: sections.rows("samples")?,
        sky: sections.rows("sky")?,
        triangles: sections.rows("triangles")?,
        triangle_errors: sections.rows("triangle errors")?,
        elements: sections.rows("elements")?,
        lines: sections.rows("lines")?,
        error: header.error,
        provenance: header.provenance,
    };
    let invalid = |source| FormatError::Invalid { path: path.to_owned(), source };
    baked.validate().map_err(invalid)?;
    if sections.bytes(UNFINISHED).is_none() {
        return Ok((baked, None));
    }
    let unfinished = unfinished::unfinished(|name| sections.bytes(name))
        .map_err(|part| altered(part, "it is missing or has no meaning"))?;
    unfinished.answers.validate().map_err(invalid)?;
    Ok((baked, Some(unfinished)))
}

/// Textures of the given names and sizes, which take all of the texels; none where they do not.
fn textures(sizes: Vec<(String, u32, u32)>, mut texels: &[[u8; 3]]) -> Option<Vec<Texture>> {
    let mut textures = Vec::new();
    for (name, width, height) in sizes {
        let count = usize::try_from(u64::from(width) * u64::from(height)).ok()?;
        textures.push(Texture { name, width, height, texels: texels.split_off(..count)?.to_vec() });
    }
    texels.is_empty().then_some(textures)
}

/// The texels of an environment's map; none where it has no map.
fn map_of(environment: Option<&Environment>) -> &[Vec3] {
    match environment.map(|environment| &environment.sky) {
        Some(Sky::Map(map)) => &map.texels,
        _ => &[],
    }
}

/// The same environment with other texels, where it has a map.
fn with_texels(environment: &Environment, texels: Vec<Vec3>) -> Environment {
    let sky = match environment.sky {
        Sky::Map(LatLongMap { width, height, .. }) => Sky::Map(LatLongMap { width, height, texels }),
        Sky::Cie(sky) => Sky::Cie(sky),
    };
    Environment { sky, ..*environment }
}

/// The checked sections of a file.
struct Sections<'a, F> {
    table: &'a [Section],
    body: &'a [u8],
    altered: &'a F,
}

impl<F: Fn(&str, &'static str) -> FormatError> Sections<'_, F> {
    fn rows<T: Record>(&self, name: &str) -> Result<Vec<T>, FormatError> {
        let bytes = self.bytes(name).ok_or_else(|| (self.altered)(name, "the section is missing"))?;
        from_bytes(bytes).ok_or_else(|| (self.altered)(name, "a row has no meaning"))
    }

    fn bytes(&self, name: &str) -> Option<&[u8]> {
        self.table.iter().find(|section| section.name == name).map(|section| slice(self.body, section))
    }
}

/// A section's bytes; the table was checked against the body's length.
fn slice<'a>(body: &'a [u8], section: &Section) -> &'a [u8] {
    &body[section.offset as usize..(section.offset + section.length) as usize]
}

fn checksum(start: &[u8], header: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(start);
    hasher.update(header);
    hasher.finalize()
}

/// bincode's standard encoding; a length in the bytes cannot make it claim more than the limit.
fn encoding() -> bincode::config::Configuration<
    bincode::config::LittleEndian,
    bincode::config::Varint,
    bincode::config::Limit<HEADER_LIMIT>,
> {
    bincode::config::standard().with_limit::<HEADER_LIMIT>()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::PathBuf;

    use glam::{DVec3, Vec2};
    use proptest::prelude::*;
    use scene::{
        Answers, BakedElement, BakedTriangle, Camera, DiscontinuityLine, EdgeKind, Gloss, LineKind, Polygon, Rgb, Seen,
        UpAxis,
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
        let seen = |node| Seen { node, form_factor: 0.25, offset: [1.0, -2.0] };
        Unfinished {
            build: "halflight 0.1.0".into(),
            options: "tolerance 0.01".into(),
            answers: Answers {
                questions: vec![1, u64::MAX, 3],
                emitted: vec![Rgb::new(1.0, 0.5, 1.0 / 3.0), Rgb::ZERO],
                sky: vec![Rgb::new(0.5, 0.0, 0.25), Rgb::ZERO],
                rows: vec![[seen(1), seen(7)].into(), [].into(), [seen(3)].into()],
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
        bad.answers.rows[0][1].form_factor = f32::INFINITY;
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
        let (mut header, _): (Header, usize) =
            bincode::serde::decode_from_slice(&good[PREAMBLE..end], encoding()).unwrap();
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
}
