//! `bake --resume`: what an interrupted bake has found out is taken only by the bake that would find out the same.

use anyhow::{Context, Result, bail};
use scene::{Answers, Scene, Unfinished};

use crate::args::{BakeFlags, LightFlags, WeightChoice};
use crate::pipeline;

/// An interrupted bake's answers, and the scene that they hold for.
pub struct Resumed {
    scene: Scene,
    answers: Answers,
}

impl Resumed {
    /// Reads what the output path holds; an error if it is no interrupted bake of this build with these options.
    pub fn read(flags: &BakeFlags) -> Result<Self> {
        let path = flags.output.display();
        if !flags.output.exists() {
            bail!("{path}: is not there, so there is nothing to resume; leave --resume out to begin");
        }
        let (baked, unfinished) = formats::read_unfinished(&flags.output)?;
        let Some(Unfinished { build, options, answers }) = unfinished else {
            bail!(
                "{path}: is a bake that was not interrupted, so there is nothing to resume; leave --resume out to bake anew"
            );
        };
        if build != this_build()? {
            bail!(
                "{path}: was begun by another build of halflight, which may find other light; go on with that one, or leave --resume out to bake anew"
            );
        }
        let given = options_of(flags);
        if options != given {
            bail!(
                "{path}: was begun with {options}, not with {given}; give the same options, or leave --resume out to bake anew"
            );
        }
        Ok(Self { scene: baked.scene, answers })
    }

    /// The answers, if they are about this scene.
    pub fn answers_about(self, scene: &Scene, flags: &BakeFlags) -> Result<Answers> {
        if self.scene != *scene {
            bail!(
                "{}: was begun for another scene than {} holds now; give that scene, or leave --resume out to bake anew",
                flags.output.display(),
                flags.scene.display()
            );
        }
        Ok(self.answers)
    }
}

/// What is kept of an interrupted bake, so that it can be resumed.
pub fn unfinished(answers: Answers, flags: &BakeFlags) -> Result<Unfinished> {
    Ok(Unfinished { build: this_build()?, options: options_of(flags), answers })
}

/// The program as it was built: a changed solver finds other light under the same version.
fn this_build() -> Result<String> {
    let program = std::env::current_exe().and_then(std::fs::read).context("cannot read the program's own file")?;
    Ok(format!("{} {}", pipeline::PROGRAM, blake3::hash(&program).to_hex()))
}

/// The options that a bake's questions depend on, as they are given. What only ends a bake is not among them.
fn options_of(flags: &BakeFlags) -> String {
    let LightFlags { tolerance, bounces, discontinuities, weight, min_weight, link_error } = flags.light;
    let mut options =
        format!("--tolerance {tolerance} --weight {}", if weight == WeightChoice::Ratio { "ratio" } else { "change" });
    let mut add = |name: &str, value: Option<String>| {
        options.extend(value.map(|value| format!(" --{name} {value}")));
    };
    add("bounces", bounces.map(|value| value.to_string()));
    add("discontinuities", discontinuities.map(|value| value.to_string()));
    add("min-weight", min_weight.map(|value| value.to_string()));
    add("link-error", link_error.map(|value| value.to_string()));
    add("max-triangles", flags.limits.max_triangles.map(|value| value.to_string()));
    options
}
