//! Materials: what the MTL files beside an OBJ say of reflection and emission.

use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use scene::{Material, Rgb};

use crate::FormatError;
use crate::obj_text::{Named, number, whole_lines};
use crate::report::{ImportReport, counted};

/// Largest reflectance that a scene is given. Nothing real reflects more (Spectralon 0.99), and a closed room that
/// loses no light has no solution; at this value it still has one, after some thousand bounces.
const LARGEST_REFLECTANCE: f64 = 0.999;

/// The materials of a scene, in the order of the files, and the index of each name.
#[derive(Debug, Default)]
pub(crate) struct Materials {
    pub list: Vec<Material>,
    pub index: HashMap<String, usize>,
}

impl Materials {
    /// Adds a material; of two with one name the first counts.
    fn add(&mut self, material: Material) {
        self.index.entry(material.name.clone()).or_insert(self.list.len());
        self.list.push(material);
    }
}

/// Reads the libraries that an OBJ names. A library that cannot be read, and a material that none defines, are
/// counted and replaced by a grey; a library with a wrong line is an error.
///
/// `Kd` is the reflectance, `Ke` the emitted radiance; a material without `Kd` gets the grey's reflectance, one
/// without `Ke` emits nothing. Everything else in the file is passed over.
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
    let (mut without_kd, mut too_bright) = (Vec::new(), Vec::new());
    for material in library {
        let mut reflectance = material.diffuse.map_or(grey, Rgb::from_array);
        if material.diffuse.is_none() {
            without_kd.push(material.name.clone());
        }
        if reflectance.max_element() > LARGEST_REFLECTANCE {
            reflectance = reflectance.min(Rgb::splat(LARGEST_REFLECTANCE));
            too_bright.push(material.name.clone());
        }
        let radiance = material.emissive.map_or(Rgb::ZERO, Rgb::from_array);
        materials.add(Material { name: material.name, reflectance, radiance });
    }
    report.clamped_materials += too_bright.len();
    report.textured_materials += clean.textured.len();
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
    warn(&clean.textured, "have a texture, which is not read; set Kd to the mean colour of it");
    Ok(())
}

/// A checked library.
struct MtlText {
    /// Names, Kd and Ke alone, in the form that tobj reads right.
    text: String,
    /// Materials whose reflectance or emission is textured.
    textured: Vec<String>,
}

/// Checks an MTL text: tobj panics on a colour of fewer than three numbers, and refuses a whole library for a wrong
/// shininess that nothing here looks at.
fn check(path: &Path, text: &str) -> Result<MtlText, FormatError> {
    let mut checked = MtlText { text: String::new(), textured: Vec::new() };
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
            ("map_Kd" | "map_Ke", Some(name)) => {
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
