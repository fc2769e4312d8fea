//! Materials: what the MTL files beside an OBJ say of reflection and emission.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use scene::{Gloss, Material, Rgb, Texture};

use crate::FormatError;
use crate::obj_text::{Named, number, whole_lines};
use crate::report::{ImportReport, counted};
use crate::texture_file::decode_texture;

/// Largest reflectance that a scene is given. Nothing real reflects more (Spectralon 0.99), and a closed room that
/// loses no light has no solution; at this value it still has one, after some thousand bounces.
pub(crate) const LARGEST_REFLECTANCE: f64 = 0.999;

/// Opacity below which a surface is left out: what is seen through for the most part lets more light pass than it stops.
pub(crate) const LEAST_OPACITY: f64 = 0.5;

/// Illumination models of MTL that reflect as a mirror does.
const MIRROR_MODELS: [u32; 3] = [3, 5, 8];

/// Illumination models of MTL without highlights: colour alone, and diffuse reflection.
const DULL_MODELS: [u32; 2] = [0, 1];

/// Relative difference of Kd from a texture's mean within which it is that mean: rounding, and the loss of an image that
/// was compressed again.
const SAME_MEAN: f64 = 0.1;

/// The materials of a scene, in the order of the files, and the index of each name.
#[derive(Debug, Default)]
pub(crate) struct Materials {
    pub list: Vec<Material>,
    pub index: HashMap<String, usize>,
    pub textures: Vec<Texture>,
    /// Places in the list whose faces are left out, because they are seen through.
    pub left_out: BTreeSet<usize>,
    /// Texture files that were read, or not.
    texture_files: HashMap<PathBuf, Option<u32>>,
}

impl Materials {
    /// Adds a material; of two with one name the first counts.
    fn add(&mut self, material: Material) {
        self.index.entry(material.name.clone()).or_insert(self.list.len());
        self.list.push(material);
    }

    /// The index of the texture in a file that a library names; none where it cannot be read.
    fn texture(&mut self, library: &Path, file: &str, report: &mut ImportReport) -> Option<u32> {
        // Files from Windows have backslashes in their paths.
        let path = library.parent().unwrap_or(Path::new("")).join(file.replace('\\', "/"));
        if let Some(known) = self.texture_files.get(&path) {
            return *known;
        }
        let bytes = fs::read(&path).map_err(|error| error.to_string());
        let texture = match bytes.and_then(|bytes| decode_texture(file, &bytes)) {
            Ok(decoded) => {
                self.textures.push(decoded.texture);
                Some(self.textures.len() as u32 - 1)
            }
            Err(cause) => {
                report
                    .warn(format!("{}: the texture cannot be read: {cause}; give a PNG or JPEG file", path.display()));
                None
            }
        };
        self.texture_files.insert(path, texture);
        texture
    }
}

/// Reads the libraries that an OBJ names. A library that cannot be read, and a material that none defines, are
/// counted and replaced by a grey; a library with a wrong line is an error.
///
/// `Kd` is the reflectance, `Ke` the emitted radiance; a material without `Kd` gets the grey's reflectance, one
/// without `Ke` emits nothing. What is no diffuse reflection is taken as follows, and counted:
///
/// - A mirror (`illum` 3, 5 or 8) and a metal (`Kd` black and `Ks` not) reflect diffusely what they reflect in all,
///   `Kd` + `Ks`, limited to 0.999. What they are is kept beside that ([`Gloss`]), and so are highlights: `Ks` with an
///   exponent (`Ns`), unless `illum` is 0 or 1.
/// - What is seen through for the most part (`d` below 0.5, or `Tr` above) is left out, if it does not emit; other `d` are
///   passed over.
/// - `map_Kd` is the texture, its options are passed over. `Kd` multiplies it, unless it is black or the mean colour
///   of the texture: programs write those for readers that know no textures.
///
/// Everything else in the file is passed over.
pub(crate) fn read_materials(
    obj: &Path,
    libraries: &[Named],
    used: &[Named],
    report: &mut ImportReport,
) -> Result<Materials, FormatError> {
    let mut materials = Materials::default();
    for (path, line) in library_files(obj, libraries) {
        match fs::read(&path) {
            Ok(bytes) => read_library(&path, &String::from_utf8_lossy(&bytes), &mut materials, report)?,
            Err(error) => report.warn(format!(
                "{} (line {line} of {}) cannot be read: {error}; put the file beside the OBJ, until then its materials \
                 are grey and emit nothing",
                path.display(),
                obj.display(),
            )),
        }
    }
    let missing: Vec<&Named> = used.iter().filter(|(_, name)| !materials.index.contains_key(name)).collect();
    if let Some((line, name)) = missing.first() {
        report.missing_materials = missing.len();
        report.warn(format!(
            "{} undefined, the first is {name:?} in line {line}; each became a grey of reflectance 0.5 that emits \
             nothing: define it with newmtl in the MTL file, or name that file with mtllib",
            counted(missing.len(), "material is", "materials are"),
        ));
    }
    for (_, name) in missing {
        materials.add(Material::grey(name));
    }
    Ok(materials)
}

/// The files that `mtllib` lines name, each once, and the line. A name may hold spaces, and a line may hold several
/// names: it is one name if there is such a file, or if it has no spaces.
fn library_files(obj: &Path, libraries: &[Named]) -> Vec<(PathBuf, usize)> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut files: Vec<(PathBuf, usize)> = Vec::new();
    for (line, names) in libraries {
        // Files from Windows have backslashes in their paths.
        let names = names.replace('\\', "/");
        let several = names.split_whitespace().map(|name| folder.join(name));
        let several: Vec<PathBuf> =
            if folder.join(&names).exists() { vec![folder.join(&names)] } else { several.collect() };
        for path in several {
            if !files.iter().any(|(known, _)| *known == path) {
                files.push((path, *line));
            }
        }
    }
    files
}

fn read_library(
    path: &Path,
    text: &str,
    materials: &mut Materials,
    report: &mut ImportReport,
) -> Result<(), FormatError> {
    let clean = check(path, text)?;
    let (library, _) = tobj::load_mtl_buf(&mut clean.text.as_bytes())
        .map_err(|error| FormatError::content(path, format!("is no MTL file ({error})"), "export the file again"))?;
    let grey = Material::grey("").reflectance;
    let (mut without_kd, mut too_bright, mut mirrors) = (Vec::new(), Vec::new(), Vec::new());
    let mut unread = clean.textured.clone();
    for material in library {
        let mut reflectance = material.diffuse.map_or(grey, Rgb::from_array);
        if material.diffuse.is_none() {
            without_kd.push(material.name.clone());
        }
        let radiance = material.emissive.map_or(Rgb::ZERO, Rgb::from_array);
        let other = clean.other.get(&material.name).cloned().unwrap_or_default();
        let is_metal = material.diffuse.is_some() && reflectance == Rgb::ZERO && radiance == Rgb::ZERO;
        let is_left_out = other.opacity.is_some_and(|opacity| opacity < LEAST_OPACITY) && radiance == Rgb::ZERO;
        let (diffuse, specular) = (reflectance, other.specular.min(Rgb::ONE));
        let mut texture = None;
        if let Some(file) = &other.texture {
            texture = materials.texture(path, file, report);
            match texture.and_then(|texture| materials.textures.get(texture as usize)) {
                Some(read) => reflectance = multiplier(reflectance, read.mean()),
                None => {
                    unread.push(material.name.clone());
                    if reflectance == Rgb::ZERO {
                        reflectance = grey;
                    }
                }
            }
        } else if other.is_mirror() || is_metal && other.specular != Rgb::ZERO {
            reflectance += other.specular;
            if !is_left_out {
                mirrors.push(material.name.clone());
            }
            reflectance = reflectance.min(Rgb::splat(LARGEST_REFLECTANCE));
        }
        if reflectance.max_element() > LARGEST_REFLECTANCE {
            // What multiplies a texture is often white.
            if texture.is_none() || reflectance.max_element() > 1.0 {
                too_bright.push(material.name.clone());
            }
            reflectance = reflectance.min(Rgb::splat(LARGEST_REFLECTANCE));
        }
        if is_left_out {
            materials.left_out.insert(materials.list.len());
        }
        let gloss = (specular != Rgb::ZERO && (other.is_mirror() || other.has_highlights())).then(|| Gloss {
            diffuse: if texture.is_some() { reflectance } else { diffuse.min(reflectance) },
            specular,
            exponent: other.exponent,
            is_mirror: other.is_mirror(),
        });
        materials.add(Material { name: material.name, reflectance, texture, radiance, gloss });
    }
    report.clamped_materials += too_bright.len();
    report.textured_materials += unread.len();
    report.mirror_materials += mirrors.len();
    let mut warn = |names: &[String], what: &str| {
        if let Some(first) = names.first() {
            let count = counted(names.len(), "material", "materials");
            report.warn(format!("{}: {count}, the first is {first:?}, {what}", path.display()));
        }
    };
    warn(&without_kd, "have no Kd and got a reflectance of 0.5; write `Kd 0 0 0` for black");
    warn(
        &too_bright,
        "reflect more than any surface does and were limited to 0.999; write Kd as a reflectance between 0 and 1",
    );
    warn(&unread, "have a texture that is not read; Kd and Ke stand for it: set them to its mean colour");
    warn(&mirrors, "are mirrors or metals and were made diffuse, of reflectance Kd + Ks: nothing else can be baked");
    Ok(())
}

/// A checked library.
struct MtlText {
    /// Names, Kd and Ke alone, in the form that tobj reads right.
    text: String,
    /// Materials whose reflectance or emission is textured.
    textured: Vec<String>,
    /// What else matters of a material, by its name.
    other: HashMap<String, OtherValues>,
}

/// What tobj is not asked for.
#[derive(Clone, Default)]
struct OtherValues {
    specular: Rgb,
    /// Of highlights; 0 is none.
    exponent: f64,
    opacity: Option<f64>,
    illumination: Option<u32>,
    /// The file of map_Kd.
    texture: Option<String>,
}

impl OtherValues {
    fn is_mirror(&self) -> bool {
        self.illumination.is_some_and(|model| MIRROR_MODELS.contains(&model))
    }

    fn has_highlights(&self) -> bool {
        self.exponent > 0.0 && !self.illumination.is_some_and(|model| DULL_MODELS.contains(&model))
    }
}

/// Checks an MTL text: tobj panics on a colour of fewer than three numbers, and refuses a whole library for a wrong
/// shininess that nothing here looks at.
fn check(path: &Path, text: &str) -> Result<MtlText, FormatError> {
    let mut checked = MtlText { text: String::new(), textured: Vec::new(), other: HashMap::new() };
    let mut current: Option<String> = None;
    for (line_number, line) in whole_lines(text) {
        let wrong = |(cause, cure)| FormatError::line(path, line_number, cause, cure);
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let written = match (keyword, &current) {
            ("newmtl", _) => {
                let name = if rest.is_empty() { "unnamed" } else { rest };
                current = Some(name.to_owned());
                writeln!(checked.text, "newmtl {name}")
            }
            ("Kd" | "Ke", Some(_)) => {
                let [r, g, b] = colour(rest).map_err(wrong)?;
                writeln!(checked.text, "{keyword} {r:?} {g:?} {b:?}")
            }
            ("Ks", Some(name)) => {
                // What is no colour here is passed over, as is what is wrong with other values that are not baked.
                checked.other(name).specular = colour(rest).map_or(Rgb::ZERO, Rgb::from_array);
                Ok(())
            }
            ("d" | "Tr", Some(name)) => {
                if let Some(value) = rest.split_whitespace().last().and_then(|word| word.parse::<f64>().ok()) {
                    checked.other(name).opacity = Some(if keyword == "d" { value } else { 1.0 - value });
                }
                Ok(())
            }
            ("illum", Some(name)) => {
                checked.other(name).illumination = rest.parse().ok();
                Ok(())
            }
            ("Ns", Some(name)) => {
                let exponent = rest.parse::<f64>().ok().filter(|exponent| exponent.is_finite() && *exponent > 0.0);
                checked.other(name).exponent = exponent.unwrap_or(0.0);
                Ok(())
            }
            ("map_Kd", Some(name)) => {
                checked.other(name).texture = Some(without_options(rest).to_owned());
                Ok(())
            }
            ("map_Ke", Some(name)) => {
                if checked.textured.last() != Some(name) {
                    checked.textured.push(name.clone());
                }
                Ok(())
            }
            ("Kd" | "Ke", None) => {
                return Err(wrong((format!("{keyword} before any newmtl"), "name the material first")));
            }
            _ => Ok(()),
        };
        written.expect("writing to a string does not fail");
    }
    Ok(checked)
}

impl MtlText {
    fn other(&mut self, name: &str) -> &mut OtherValues {
        self.other.entry(name.to_owned()).or_default()
    }
}

/// The file that a map names, behind its options (`-s 2 2 1`, `-clamp on`).
fn without_options(rest: &str) -> &str {
    let mut rest = rest;
    while let Some((option, behind)) = rest.split_once(char::is_whitespace).filter(|(word, _)| word.starts_with('-')) {
        rest = behind.trim_start();
        let most = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for value in 0..most {
            let Some((word, behind)) = rest.split_once(char::is_whitespace) else { break };
            // One to three numbers may stand behind an option that takes numbers.
            if most > 1 && value > 0 && word.parse::<f64>().is_err() {
                break;
            }
            rest = behind.trim_start();
        }
    }
    rest
}

/// What multiplies a texture of a mean colour where the file says Kd beside it.
fn multiplier(kd: Rgb, mean: Rgb) -> Rgb {
    let is_mean = (kd - mean).abs().max_element() <= SAME_MEAN * mean.max_element();
    if kd == Rgb::ZERO || is_mean { Rgb::ONE } else { kd }
}

/// Three numbers that are not negative, or one that stands for all.
fn colour(rest: &str) -> Result<[f64; 3], (String, &'static str)> {
    let rest = rest.split('#').next().unwrap_or_default();
    let channels = rest.split_whitespace().map(number).collect::<Result<Vec<f64>, _>>()?;
    let channels = match channels.as_slice() {
        &[grey] => [grey; 3],
        &[r, g, b] => [r, g, b],
        other => return Err((format!("a colour of {} numbers", other.len()), "write red, green and blue")),
    };
    match channels.iter().find(|channel| **channel < 0.0) {
        Some(negative) => Err((format!("the colour {negative} is negative"), "write numbers from 0 up")),
        None => Ok(channels),
    }
}
