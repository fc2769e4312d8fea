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
mod tests;
