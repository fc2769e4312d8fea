//! The environment of a scene file: a map beside it, or a sky by the standard.

use std::path::Path;

use scene::{CIE_SKIES, CieSky, Environment, Sky, UpAxis};
use serde::Deserialize;

use crate::environment_file::read_environment;
use crate::report::ImportReport;
use crate::{FormatError, scene_file::Wrong};

/// `[environment]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnvironmentEntry {
    map: Option<String>,
    sky: Option<u8>,
    up: Option<String>,
    #[serde(default)]
    rotation: f64,
    scale: Option<f64>,
    sun: Option<[f64; 2]>,
    sun_irradiance: Option<f64>,
}

/// The environment of an entry in the scene file at `path`, in a scene whose own axis `up` is; the outer error is one of the
/// scene file. A map keeps as many texels as a scene's may have.
pub(crate) fn environment_of(
    entry: &EnvironmentEntry,
    path: &Path,
    up: UpAxis,
    report: &mut ImportReport,
) -> Result<Result<Environment, FormatError>, Wrong> {
    let named = |name: &String| UpAxis::ALL.into_iter().find(|axis| axis.name() == name);
    let up = match &entry.up {
        None => up,
        Some(name) => named(name).ok_or_else(|| (format!("an up of {name:?}"), "write \"x\", \"y\" or \"z\""))?,
    };
    let (rotation, scale) = (entry.rotation.to_radians(), entry.scale.unwrap_or(1.0));
    if !rotation.is_finite() || !scale.is_finite() || scale <= 0.0 {
        let cause = format!("a rotation of {} and a scale of {scale}", entry.rotation);
        return Err((cause, "write finite numbers, and a scale of more than 0"));
    }
    let sky = match (&entry.map, entry.sky) {
        (Some(map), None) => {
            if entry.sun.is_some() || entry.sun_irradiance.is_some() {
                let cause = "a sun beside a map, which has its own".to_owned();
                return Err((cause, "leave sun and sun_irradiance out, or give a sky in place of the map"));
            }
            let read = match read_environment(&path.with_file_name(map)) {
                Ok(read) => read,
                Err(error) => return Ok(Err(error)),
            };
            report.warnings.extend(read.warnings);
            Sky::Map(read.map.bounded())
        }
        (None, Some(kind)) => Sky::Cie(cie_sky(kind, entry)?),
        _ => {
            let cause = "no environment: it has neither a map nor a sky, or both".to_owned();
            return Err((cause, "give map, a .hdr or .exr file beside this one, or sky, a number from 1 to 16"));
        }
    };
    Ok(Ok(Environment { sky, up, rotation, scale }))
}

fn cie_sky(kind: u8, entry: &EnvironmentEntry) -> Result<CieSky, Wrong> {
    if !(1..=CIE_SKIES).contains(&kind) {
        return Err((format!("a sky {kind}"), "write a number from 1 to 16, of the general skies of the CIE"));
    }
    let sun = entry.sun.map_or(CieSky::DEFAULT_SUN, |angles| angles.map(f64::to_radians));
    CieSky::new(kind, sun, entry.sun_irradiance.unwrap_or(0.0)).ok_or_else(|| {
        let cause = "a sun that is nowhere, or that sends no amount of light".to_owned();
        (cause, "write azimuth and altitude in degrees, the altitude from 0 to 90, and an irradiance from 0 up")
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    use std::fs;

    use glam::Vec3;

    use super::*;
    use crate::{Imported, read_scene, write_exr};

    /// What reading says of a scene file whose model has y or z up, with an environment of a text.
    fn read(up: &str, text: &str) -> Result<Imported, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        write_exr(&path("sky.exr"), 3, 1, &[Vec3::ONE, Vec3::NEG_ONE, Vec3::X]).unwrap();
        write_exr(&path("black.exr"), 2, 1, &[Vec3::ZERO; 2]).unwrap();
        write_exr(&path("large.exr"), 4096, 2, &[Vec3::ONE; 8192]).unwrap();
        let scene = format!("up = \"{up}\"\n[[model]]\nfile = \"a.obj\"\n[environment]\n{text}");
        fs::write(path("room.toml"), scene).unwrap();
        read_scene(&path("room.toml")).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, line, cause) in [
            ("", 4, "neither a map nor a sky"),
            ("map = \"sky.exr\"\nsky = 5", 4, "neither a map nor a sky, or both"),
            ("sky = 0", 4, "a sky 0"),
            ("sky = 17", 4, "from 1 to 16"),
            ("sky = 5\nup = \"w\"", 4, "an up of \"w\""),
            ("sky = 5\nscale = 0", 4, "a scale of 0"),
            ("sky = 5\nrotation = nan", 4, "a rotation of NaN"),
            ("sky = 5\nsun = [0, 91]", 4, "a sun that is nowhere"),
            ("sky = 5\nsun_irradiance = -1", 4, "an irradiance from 0 up"),
            ("sky = 5\nsun = [1]", 6, "an array of length 2"),
            ("sky = 5\nturn = 4", 6, "unknown field `turn`"),
            ("map = \"sky.exr\"\nsun = [10, 20]", 4, "a sun beside a map"),
        ] {
            let said = read("z", text).unwrap_err();
            assert!(said.contains(&format!("line {line}:")) && said.contains(cause), "{text}: {said}");
        }
        for (map, cause) in [("none.hdr", "cannot be read"), ("a.obj", ".hdr or .exr"), ("black.exr", "all black")] {
            let said = read("z", &format!("map = \"{map}\"")).unwrap_err();
            assert!(said.contains(map) && said.contains(cause), "{said}");
        }
    }

    #[test]
    fn a_sky_has_the_defaults_of_its_scene() {
        let environment = |up: &str, text: &str| read(up, text).unwrap().scene.environment.unwrap();
        let sky = |sun, irradiance| Sky::Cie(CieSky::new(12, sun, irradiance).unwrap());
        let plain = environment("y", "sky = 12");
        let sun = [3.0 * FRAC_PI_4, FRAC_PI_4];
        assert_eq!(plain, Environment { sky: sky(sun, 0.0), up: UpAxis::Y, rotation: 0.0, scale: 1.0 });
        let all = "sky = 12\nup = \"x\"\nrotation = 90\nscale = 2.5\nsun = [45, 45]\nsun_irradiance = 3";
        let all = environment("z", all);
        let sky = sky([FRAC_PI_4, FRAC_PI_4], 3.0);
        assert_eq!(all, Environment { sky, up: UpAxis::X, rotation: FRAC_PI_2, scale: 2.5 });
    }

    #[test]
    fn a_map_is_read_and_what_is_odd_about_it_is_told() {
        let Imported { scene, report } = read("z", "map = \"sky.exr\"").unwrap();
        let Some(Environment { sky: Sky::Map(map), up: UpAxis::Z, .. }) = scene.environment else {
            unreachable!("a map, z up")
        };
        assert_eq!((map.width, map.height, map.texels), (3, 1, vec![Vec3::ONE, Vec3::ZERO, Vec3::X]));
        let told = report.warnings.join("\n");
        assert!(told.contains("1 of 3 texels") && told.contains("3 × 1 texels"), "{told}");
        let Some(Environment { sky: Sky::Map(large), .. }) =
            read("z", "map = \"large.exr\"").unwrap().scene.environment
        else {
            unreachable!("a map")
        };
        assert_eq!((large.width, large.height), (2048, 2));
    }
}
