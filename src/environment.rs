//! The environment that flags name: as part of a scene that is read, or for a picture of its own.

use std::path::Path;

use anyhow::{Context, Result, bail};
use scene::{CieSky, Environment, Sky, UpAxis};

use crate::args::{EnvironmentFlags, SkySource};
use crate::failure::Usage;

/// The axis that points up in a scene's file: as its format has it.
pub fn up_axis(scene: &Path) -> UpAxis {
    let is_gltf =
        scene.extension().is_some_and(|name| ["gltf", "glb"].iter().any(|gltf| name.eq_ignore_ascii_case(gltf)));
    if is_gltf { UpAxis::Y } else { UpAxis::Z }
}

/// The environment of a source, and in words what is odd about it; a map has all texels of its file. `up` is the scene's axis that
/// points up, where flags say nothing of it.
pub fn environment(flags: &EnvironmentFlags, source: &SkySource, up: UpAxis) -> Result<(Environment, Vec<String>)> {
    let (sky, warnings) = match source {
        SkySource::Cie(kind) => {
            let sun = flags.sun.unwrap_or(CieSky::DEFAULT_SUN);
            let sky = CieSky::new(*kind, sun, flags.sun_irradiance.unwrap_or(0.0));
            (Sky::Cie(sky.context("the sun is nowhere")?), Vec::new())
        }
        SkySource::Map(path) => {
            if flags.sun.is_some() || flags.sun_irradiance.is_some() {
                bail!(Usage(
                    "--sun: a map has its own; leave --sun and --sun-irradiance out, or give cie:1 to cie:16".into()
                ));
            }
            let read = formats::read_environment(path)?;
            (Sky::Map(read.map), read.warnings)
        }
    };
    let (up, rotation, scale) = (flags.sky_up.unwrap_or(up), flags.sky_rotation.to_radians(), flags.sky_scale);
    Ok((Environment { sky, up, rotation, scale }, warnings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gltf_has_y_up() {
        let up = ["a.glb", "b/a.GLTF", "a.obj", "glb", ""].map(|name| up_axis(Path::new(name)));
        assert_eq!(up, [UpAxis::Y, UpAxis::Y, UpAxis::Z, UpAxis::Z, UpAxis::Z]);
    }
}
