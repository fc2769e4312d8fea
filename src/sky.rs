//! `halflight render --environment`: a scene under a sky, whose light is that of a few hundred directions.

use anyhow::{Context, Result, bail};
use glam::Vec3;
use renderer::{
    Coherence, EnvironmentLights, Eye, SkyIllumination, SkyPicture, SkySeconds, SurfacePoint, Visibility, sky_picture,
};
use scene::{Baked, Bvh, Display, Environment, Exposure, Rgb, Scene, Sky, luminance};
use serde::Serialize;

use crate::args::{ExposureChoice, ImageKind, RenderFlags, SceneFlags, SkyFlags, SkySource};
use crate::baked_points::BakedPoints;
use crate::environment::{environment, up_axis};
use crate::failure::{Outcome, Usage};
use crate::input::Input;
use crate::output::{Output, Outputs};
use crate::picture::encoded;
use crate::progress::{Stage, say};
use crate::report::print_json;
use crate::shot::camera;

/// Columns and rows of the picture of a sky.
const SKY_PICTURE: [u32; 2] = [1024, 512];

/// The colour of cells and lights in it, as a multiple of the light that is just white.
const CELLS: Vec3 = Vec3::new(1.5, 0.1, 0.0);

/// Makes a picture under the environment that flags name.
pub fn run(flags: &RenderFlags, source: &SkySource, outputs: &Outputs) -> Result<Outcome> {
    let viewpoint = flags.camera.viewpoint()?;
    let sky = &flags.sky;
    let visibility = visibility(sky)?;
    let output = outputs.claim(&flags.output)?;
    let claim = |path: &Option<std::path::PathBuf>| path.as_deref().map(|path| outputs.claim(path)).transpose();
    let (ray_map, cells) = (claim(&sky.ray_map)?, claim(&sky.sky_picture)?);
    // The environment is the picture's: that of a scene or a bake stays as it is.
    let reading = SceneFlags { two_sided: flags.reading.two_sided, ..SceneFlags::default() };
    let input = Input::read(&flags.input, &reading)?;
    let up = match &input {
        Input::Baked(Baked { scene: Scene { environment: Some(own), .. }, .. }) => own.up,
        _ => up_axis(&flags.input),
    };
    let (environment, warnings) = environment(&flags.reading.sky, source, up)?;
    for warning in &warnings {
        say(format_args!("warning: {warning}"));
    }
    let (scene, bounce) = match &input {
        Input::Scene(scene) => (scene, None),
        Input::Baked(baked) => {
            warn_of_another_sky(flags, baked, &environment);
            (&baked.scene, Some(BakedPoints::new(baked)))
        }
    };
    let elsewhere =
        |point: &SurfacePoint| bounce.as_ref().map_or(Rgb::ZERO, |points| points.irradiance_from_surfaces(point));
    let camera = camera(&viewpoint, scene)?;
    let stage = Stage::start("lights");
    let lights = EnvironmentLights::new(&environment, sky.lights, sky.sky_sampling.into());
    let lights = lights.with_context(|| format!("{source}: the sky is black; give one with light in it"))?;
    stage.end();
    if lights.count() < sky.lights {
        let (found, asked) = (lights.count(), sky.lights);
        say(format_args!(
            "warning: --lights {asked}: only {found} places of the sky have light, so there are {found} lights"
        ));
    }
    let bvh = Bvh::of_scene(scene);
    let (width, height) = flags.size;
    let eye = Eye::new(scene, &bvh, camera, width, height);
    let stage = Stage::start("render");
    let light = SkyIllumination { environment: &environment, lights: &lights, elsewhere: &elsewhere };
    let picture = sky_picture(&eye, light, visibility, sky.check);
    stage.end();
    let wrong = sky.check.then(|| {
        let stage = Stage::start("check");
        let truth = sky_picture(&eye, light, Visibility::Full, true);
        stage.end();
        wrong_by_pixel(&picture, &truth)
    });
    let exposure = match flags.exposure {
        ExposureChoice::Fixed(exposure) => exposure,
        ExposureChoice::Auto => {
            let luminances = picture.radiance.iter().map(|radiance| luminance(radiance.as_dvec3()));
            Exposure::metered(luminances.filter(|luminance| luminance.is_finite() && *luminance > 0.0))
        }
    };
    let display = Display::new(exposure, flags.tone_curve);
    write(&output, flags.size, &picture.radiance, display)?;
    if let Some(map) = ray_map {
        let pixels = map_of_rays(&picture, lights.count(), wrong.as_deref());
        map.write(|path| formats::write_png(path, width, height, &pixels))?;
    }
    if let Some(cells) = cells {
        let [width, height] = SKY_PICTURE;
        let sky = lights.picture(&environment, width, height, CELLS / exposure.factor());
        write(&cells, (width, height), &sky, display)?;
    }
    report(&picture, flags, lights.count(), wrong.as_deref(), exposure)
}

/// Says so where what a bake's surfaces reflect is not the light of the picture's sky.
fn warn_of_another_sky(flags: &RenderFlags, baked: &Baked, environment: &Environment) {
    let baked_under = baked.scene.environment.as_ref();
    let kept = match &environment.sky {
        // A bake keeps a map in few texels.
        Sky::Map(map) => Environment { sky: Sky::Map(map.clone().bounded()), ..*environment },
        Sky::Cie(_) => environment.clone(),
    };
    if baked_under != Some(&kept) {
        let sky = if baked_under.is_some() { "another sky" } else { "no sky" };
        say(format_args!(
            "warning: {} was baked under {sky}: what its surfaces reflect is not the light of this one; bake it with the same \
             --environment",
            flags.input.display()
        ));
    }
}

/// The way that flags describe by which it is found what is seen.
fn visibility(flags: &SkyFlags) -> Result<Visibility> {
    let (brightest, error) = (flags.brightest, flags.guessed);
    match flags.visibility.visibility {
        Visibility::Coherent(coherence) => Ok(Visibility::Coherent(Coherence { brightest, error, ..coherence })),
        Visibility::Full if brightest == 0 && error == 0.0 => Ok(Visibility::Full),
        Visibility::Full => {
            bail!(Usage("--visibility full predicts nothing; leave --brightest and --guessed out".into()))
        }
    }
}

fn write(output: &Output, (width, height): (u32, u32), radiance: &[Vec3], display: Display) -> Result<()> {
    Ok(output.write(|path| match ImageKind::of(path) {
        Some(ImageKind::Exr) => formats::write_exr(path, width, height, radiance),
        _ => {
            let light: Vec<Vec3> = radiance.iter().map(|&radiance| display.light(radiance)).collect();
            formats::write_png(path, width, height, &encoded(&light))
        }
    })?)
}

/// By pixel, how many lights are not as they are seen in truth.
fn wrong_by_pixel(picture: &SkyPicture, truth: &SkyPicture) -> Vec<u32> {
    let words = picture.seen.len() / picture.radiance.len();
    let pixels = picture.seen.chunks(words).zip(truth.seen.chunks(words));
    pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum()).collect()
}

/// From black, no ray, to white, one to each light; red where something is wrong.
fn map_of_rays(picture: &SkyPicture, lights: u32, wrong: Option<&[u32]>) -> Vec<[u8; 3]> {
    let share = |rays: u32| Vec3::splat(rays as f32 / lights as f32);
    let mut map = encoded(&picture.traced.iter().map(|&rays| share(rays)).collect::<Vec<Vec3>>());
    let wrong = wrong.into_iter().flatten();
    map.iter_mut().zip(wrong).filter(|(_, wrong)| **wrong > 0).for_each(|(pixel, _)| *pixel = [255, 0, 0]);
    map
}

/// Says what was done.
fn report(
    picture: &SkyPicture,
    flags: &RenderFlags,
    lights: u32,
    wrong: Option<&[u32]>,
    exposure: Exposure,
) -> Result<Outcome> {
    let share = |count: u64| count as f64 / picture.pairs.max(1) as f64;
    let wrong = wrong.map(|wrong| wrong.iter().map(|&wrong| u64::from(wrong)).sum::<u64>());
    let SkySeconds { primary, visibility, shading } = picture.seconds;
    let report = SkyJson {
        width: flags.size.0,
        height: flags.size.1,
        lights,
        visibility: flags.sky.visibility.name,
        shadow_rays: picture.rays,
        full_shadow_rays: picture.pairs,
        shadow_rays_share: share(picture.rays),
        mispredicted_share: wrong.map(share),
        exposure: exposure.ev,
        seconds: SecondsJson { primary, visibility, shading },
    };
    if flags.json {
        print_json(&report)?;
    } else {
        let found =
            wrong.map_or_else(String::new, |wrong| format!(", {:.4} % of all predicted wrong", 100.0 * share(wrong)));
        say(format_args!(
            "{lights} lights, {:.2} % of the shadow rays traced{found}; {primary:.2} s of threads to look, {visibility:.2} s for shadows, \
             {shading:.2} s for the light",
            100.0 * report.shadow_rays_share
        ));
    }
    Ok(Outcome::Done)
}

/// What `render --environment --json` prints.
#[derive(Serialize)]
struct SkyJson {
    width: u32,
    height: u32,
    /// Lights that stand for the sky.
    lights: u32,
    visibility: &'static str,
    /// Shadow rays traced, and those of full tracing: to lights above the horizon.
    shadow_rays: u64,
    full_shadow_rays: u64,
    /// The one as a share of the other.
    shadow_rays_share: f64,
    /// Lights that are predicted otherwise than they are, as a share of the same; with --check.
    #[serde(skip_serializing_if = "Option::is_none")]
    mispredicted_share: Option<f64>,
    /// Exposure value.
    exposure: f32,
    /// Of all threads together.
    seconds: SecondsJson,
}

#[derive(Serialize)]
struct SecondsJson {
    primary: f64,
    visibility: f64,
    shading: f64,
}
