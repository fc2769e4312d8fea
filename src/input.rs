//! What a command is given: a scene, or a bake, or a scene that is baked first and kept in the user's cache folder.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use anyhow::{Context, Result, bail, ensure};
use etcetera::BaseStrategy;
use formats::{Imported, Sides};
use scene::{Baked, Scene, Sky};

use crate::args::{EnvironmentFlags, LightFlags, SceneFlags};
use crate::bake::missed;
use crate::environment::{environment, up_axis};
use crate::failure::Usage;
use crate::output::Outputs;
use crate::pipeline::{self, Onlooker};
use crate::progress::{Stage, say};

/// A file that a command was given.
#[expect(clippy::large_enum_variant, reason = "one exists in a run")]
pub enum Input {
    /// A scene.
    Scene(Scene),
    /// A bake.
    Baked(Baked),
}

impl Input {
    /// Reads a scene or a bake, whichever the file is.
    pub fn read(path: &Path, flags: &SceneFlags) -> Result<Self> {
        if formats::is_baked(path) {
            no_bake(path, flags)?;
            Ok(Self::Baked(formats::read_baked(path)?))
        } else {
            Ok(Self::Scene(read_scene(path, flags)?.0.scene))
        }
    }

    /// The bake: the one read, or the scene's.
    pub fn into_baked(self, path: &Path, flags: &LightFlags, outputs: &Outputs) -> Result<Baked> {
        match self {
            Self::Baked(baked) => Ok(baked),
            Self::Scene(scene) => {
                require_light(path, &scene)?;
                Ok(bake_once(&scene, flags, outputs, None))
            }
        }
    }
}

/// Reads a scene, passing on what the importer repaired; the seconds it took stand beside it.
pub fn read_scene(path: &Path, flags: &SceneFlags) -> Result<(Imported, f64)> {
    let stage = Stage::start("import");
    let mut imported = formats::read_scene_as(path, if flags.two_sided { Sides::Both } else { Sides::AsWound })?;
    if let Some(source) = &flags.sky.environment {
        let (mut environment, warnings) = environment(&flags.sky, source, up_axis(path))?;
        if let Sky::Map(map) = environment.sky {
            environment.sky = Sky::Map(map.bounded());
        }
        imported.scene.environment = Some(environment);
        imported.report.warnings.extend(warnings);
    }
    let seconds = stage.end();
    for warning in &imported.report.warnings {
        say(format_args!("warning: {warning}"));
    }
    Ok((imported, seconds))
}

/// Refuses flags that say how a scene is read, where the file is a bake.
pub fn no_bake(path: &Path, flags: &SceneFlags) -> Result<()> {
    let given = match flags {
        SceneFlags { two_sided: true, .. } => "--two-sided",
        SceneFlags { sky: EnvironmentFlags { environment: Some(_), .. }, .. } => "--environment",
        _ => return Ok(()),
    };
    let path = path.display();
    bail!(Usage(format!("{given} says how a scene is read, and {path} is a bake; give it when the scene is baked")));
}

/// Refuses a scene without surfaces that emit and without an environment; says of other lights that they count nothing.
pub fn require_light(path: &Path, scene: &Scene) -> Result<()> {
    if !scene.lights.is_empty() {
        say(format_args!(
            "warning: {}: lights without a surface ({}) are passed over: a bake holds the light of surfaces; `halflight \
             render --radiance whitted` sees them",
            path.display(),
            scene.lights.len()
        ));
    }
    ensure!(
        scene.emitters().next().is_some() || scene.environment.as_ref().is_some_and(|sky| !sky.is_black()),
        "{}: nothing emits light; give a material that its faces use an emitted radiance (W/(sr m²)), such as the line \
         `Ke 10 10 10` in the MTL file, an emissive factor in a glTF file, or `radiance = 10` in a scene file, or give the scene \
         light from outside, such as --environment cie:12",
        path.display()
    );
    Ok(())
}

/// The scene's bake, from the cache where it is there, else made before an onlooker. A cache that cannot be used costs time,
/// nothing else.
pub fn bake_once(scene: &Scene, flags: &LightFlags, outputs: &Outputs, onlooker: Option<Onlooker<'_>>) -> Baked {
    let place = match place(scene, flags) {
        Ok(place) => place,
        Err(error) => {
            say(format_args!("warning: the bake will not be kept: {error:#}"));
            return baked_anew(scene, flags, onlooker);
        }
    };
    // A file that another version wrote, or a damaged one, is made anew.
    if let Ok(baked) = formats::read_baked(&place) {
        return baked;
    }
    let baked = baked_anew(scene, flags, onlooker);
    let kept = outputs.claim(&place).and_then(|output| Ok(output.write(|path| formats::write_baked(path, &baked))?));
    if let Err(error) = kept {
        say(format_args!("warning: the bake was not kept: {error:#}"));
    }
    baked
}

fn baked_anew(scene: &Scene, flags: &LightFlags, onlooker: Option<Onlooker<'_>>) -> Baked {
    let baked = pipeline::bake(scene, flags, onlooker).baked;
    if !baked.error.holds {
        say(format_args!("warning: {}", missed(&baked, flags.tolerance)));
    }
    baked
}

/// Where the cache keeps a bake.
fn place(scene: &Scene, flags: &LightFlags) -> Result<PathBuf> {
    let folder = etcetera::choose_base_strategy()?.cache_dir().join("halflight");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    Ok(folder.join(key(scene, flags)?).with_extension("hlf"))
}

/// The checksum of all that a bake depends on: scene, options, and this very build of the program.
fn key(scene: &Scene, flags: &LightFlags) -> Result<String> {
    let program = std::env::current_exe()?.metadata()?;
    let built = program.modified()?.duration_since(UNIX_EPOCH)?.as_nanos();
    let mut hasher = blake3::Hasher::new();
    serde_json::to_writer(&mut hasher, &(pipeline::PROGRAM, program.len(), built, flags, scene))?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use scene::Material;

    use super::*;

    #[test]
    fn a_bake_is_kept_for_its_scene_and_its_options() {
        let scene = Scene::default();
        let flags = LightFlags::default();
        let other = Scene { materials: vec![Material::grey("grey")], ..Scene::default() };
        assert_eq!(key(&scene, &flags).unwrap(), key(&scene.clone(), &flags).unwrap());
        assert_ne!(key(&scene, &flags).unwrap(), key(&other, &flags).unwrap());
        let bounced = LightFlags { bounces: Some(0), ..flags };
        assert_ne!(key(&scene, &flags).unwrap(), key(&scene, &bounced).unwrap());
    }

    #[test]
    fn darkness_is_refused_with_the_cure() {
        let error = require_light(Path::new("dark.obj"), &Scene::default()).expect_err("dark").to_string();
        assert!(error.contains("dark.obj") && error.contains("Ke"), "{error}");
    }
}
