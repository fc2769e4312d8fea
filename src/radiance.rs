//! What a sample of a picture sees: the evaluators that samplers are handed, each over another stage of the program.

use anyhow::{Result, bail, ensure};
use renderer::{Evaluator, Eye, PathLight, PathOptions, SurfacePoint, Whitted};
use scene::{Bvh, Provenance, Rgb, Scene};
use solver::Gather;

use crate::args::{LightFlags, RadianceChoice, RadianceFlags, RenderFlags};
use crate::failure::Usage;
use crate::input::{Input, require_light};
use crate::output::Outputs;
use crate::pipeline;
use crate::point_gather::PointGather;
use crate::probe::as_baked;
use crate::shot::camera;

/// Paths for one sample where nothing else is said: about as many as take the time of the rest of a sample's work ten times, so that
/// this is not what is waited for.
const PATHS: u32 = 16;

/// How far a point of a surface may lie from the triangle of the mesh that stands for it, as a fraction of the scene's size: the
/// mesh has positions in f32.
const REACH: f64 = 1e-6;

/// Refuses flags that say nothing of the radiance that was chosen.
pub fn check(flags: &RadianceFlags) -> Result<()> {
    let name = flags.radiance.name();
    if flags.paths.is_some() && flags.radiance != RadianceChoice::Path {
        bail!(Usage(format!("--paths: --radiance {name} follows none; leave it out, or give --radiance path")));
    }
    if flags.bounces.is_some() && flags.radiance == RadianceChoice::Whitted {
        bail!(Usage("--bounces: --radiance whitted knows direct light alone; leave it out".into()));
    }
    Ok(())
}

/// Makes an evaluator of a view of a scene or a bake, and has `work` use it.
pub fn with_evaluator<T>(
    input: Input,
    flags: &RenderFlags,
    outputs: &Outputs,
    work: impl FnOnce(&Evaluator<'_>) -> Result<T>,
) -> Result<T> {
    let asked = LightFlags { bounces: flags.radiance.bounces, ..LightFlags::default() };
    if flags.radiance.radiance == RadianceChoice::Interpolant {
        if let Input::Baked(baked) = &input {
            check_bounces(flags, &baked.provenance)?;
        }
        let baked = input.into_baked(&flags.input, &asked, outputs)?;
        let (mesh, reach) = (baked.bvh(), REACH * baked.scene.size());
        let irradiance = |point: &SurfacePoint| {
            let found = baked.locate(&mesh, point.position, point.normal, reach);
            found.map_or(Rgb::ZERO, |(triangle, s, t)| baked.irradiance(triangle, s, t))
        };
        return view(&baked.scene, flags, |eye| work(&|point| eye.diffuse(point, |seen| (irradiance(seen), 0))));
    }
    let (scene, made) = match input {
        Input::Scene(scene) => (scene, None),
        Input::Baked(baked) => (baked.scene, Some(baked.provenance)),
    };
    match flags.radiance.radiance {
        RadianceChoice::Whitted => whitted(&scene, flags, work),
        RadianceChoice::Gather => {
            require_light(&flags.input, &scene)?;
            // From the bake: its reflectors send what the bake says that they do.
            let light = made.map_or(asked, |made| as_baked(&made, &asked));
            let solution = pipeline::bake(&scene, &light, None).solution;
            let gather = Gather::new(&scene, &solution);
            let points = PointGather::new(&scene, &solution, &gather);
            view(&scene, flags, |eye| work(&|point| eye.diffuse(point, |seen| (points.irradiance(seen), 0))))
        }
        RadianceChoice::Path | RadianceChoice::Interpolant => {
            require_light(&flags.input, &scene)?;
            let samples = flags.radiance.paths.unwrap_or(PATHS);
            let options = PathOptions { samples, bounces: flags.radiance.bounces, seed: flags.seed };
            let bvh = Bvh::of_scene(&scene);
            let light = PathLight::new(&scene, &bvh, options);
            view(&scene, flags, |eye| work(&|point| eye.diffuse(point, |seen| (light.irradiance(seen), samples))))
        }
    }
}

/// Whitted's rays: direct light of surfaces is what a gather without reflectors says.
fn whitted<T>(scene: &Scene, flags: &RenderFlags, work: impl FnOnce(&Evaluator<'_>) -> Result<T>) -> Result<T> {
    ensure!(
        scene.emitters().next().is_some() || !scene.lights.is_empty(),
        "{}: there is no light; give a material an emitted radiance (W/(sr m²)), such as the line `Ke 10 10 10` in the MTL \
         file, or add a [[light]] in a scene file",
        flags.input.display()
    );
    let (solution, _) = pipeline::solve(scene, &LightFlags { bounces: Some(0), ..LightFlags::default() }, None);
    let gather = Gather::new(scene, &solution);
    let points = PointGather::new(scene, &solution, &gather);
    let direct = |point: &SurfacePoint| points.irradiance(point);
    view(scene, flags, |eye| {
        let whitted = Whitted::new(eye, &direct);
        work(&|point| whitted.evaluate(point))
    })
}

/// Has `work` look at a scene from the point of view of the flags.
fn view<T>(scene: &Scene, flags: &RenderFlags, work: impl FnOnce(Eye<'_>) -> Result<T>) -> Result<T> {
    let camera = camera(&flags.camera.viewpoint()?, scene)?;
    let bvh = Bvh::of_scene(scene);
    work(Eye::new(scene, &bvh, camera, flags.size.0, flags.size.1))
}

/// Refuses bounces that are not those of a bake, whose interpolants hold its own.
fn check_bounces(flags: &RenderFlags, provenance: &Provenance) -> Result<()> {
    let made = pipeline::light_flags(provenance).bounces;
    if flags.radiance.bounces.is_some() && flags.radiance.bounces != made {
        bail!(Usage(format!(
            "--bounces: {} holds the light of {} bounces; give the scene, or --radiance gather",
            flags.input.display(),
            made.map_or_else(|| "all".to_owned(), |bounces| bounces.to_string())
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use scene::centroid;

    use super::*;

    /// Points of all surfaces, one after another on the same leaves and in turn on others.
    #[test]
    fn a_gather_that_keeps_its_leaves_says_what_one_that_does_not_says() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes/cornell_box.obj");
        let scene = formats::read_scene(&path).unwrap().scene;
        let solution = solver::solve(&scene, &solver::SolveOptions { link_error: None, bounces: Some(0) }, &|_| {});
        let gather = Gather::new(&scene, &solution);
        let points = renderer::spread_by_area(&scene, 200, 1e-3, 1, |_| true);
        let kept = PointGather::new(&scene, &solution, &gather);
        for point in points.iter().chain(points.iter().rev()) {
            let inward = centroid(&scene.outline(point.polygon)) - point.position;
            let anew = gather.irradiance_at(point.polygon, point.position, inward);
            assert!((kept.irradiance(point) - anew).length() <= 1e-9 * (1.0 + anew.length()));
        }
    }
}
