//! What a sample of a picture sees: the evaluators that samplers are handed, each over another stage of the program.

use std::sync::Arc;

use anyhow::{Result, bail, ensure};
use glam::DVec3;
use renderer::{
    Evaluator, Eye, PathLight, PathOptions, SurfacePoint, VisibleLine, Whitted, object_edges, reflected_lines,
    visible_lines,
};
use scene::{Baked, Bvh, Camera, DiscontinuityLine, Provenance, Scene};
use solver::{Gather, Solution, Surroundings};

use crate::args::{LightFlags, RadianceChoice, RadianceFlags, RenderFlags};
use crate::baked_points::BakedPoints;
use crate::failure::Usage;
use crate::input::{Input, require_light};
use crate::light_sources::LightSources;
use crate::output::Outputs;
use crate::pipeline;
use crate::point_gather::PointGather;
use crate::probe::as_baked;
use crate::shot::camera;

/// Paths for one sample where nothing else is said: about as many as take the time of the rest of a sample's work ten times, so
/// that this is not what is waited for.
const PATHS: u32 = 16;

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

/// A point of view, and what is to be seen from there.
pub struct View {
    /// Where from.
    pub camera: Camera,
    /// Columns and rows of the picture.
    pub size: (u32, u32),
    /// What a sample sees.
    pub radiance: RadianceFlags,
    /// Seed of paths.
    pub seed: u64,
}

impl View {
    fn of(flags: &RenderFlags, scene: &Scene) -> Result<Self> {
        let camera = camera(&flags.camera.viewpoint()?, scene)?;
        Ok(Self { camera, size: flags.size, radiance: flags.radiance, seed: flags.seed })
    }

    fn eye<'a>(&self, scene: &'a Scene, bvh: &'a Bvh) -> Eye<'a> {
        Eye::new(scene, bvh, self.camera, self.size.0, self.size.1)
    }
}

/// Lines of a view that may be edges of its picture.
pub struct Lines<'a> {
    view: &'a View,
    scene: &'a Scene,
    /// Of the bake, where there is one: edges of shadows.
    discontinuities: &'a [DiscontinuityLine],
}

impl Lines<'_> {
    /// Those that are visible; also in planar mirrors, where samples see what these show.
    pub fn visible(&self) -> Vec<VisibleLine> {
        let bvh = Bvh::of_scene(self.scene);
        let eye = self.view.eye(self.scene, &bvh);
        let discontinuities: Vec<[DVec3; 2]> =
            self.discontinuities.iter().map(|line| line.ends.map(|end| end.as_dvec3())).collect();
        let mut lines = visible_lines(&eye, &[&object_edges(&eye)[..], &discontinuities].concat());
        if self.view.radiance.radiance == RadianceChoice::Whitted {
            lines.extend(reflected_lines(&eye, &discontinuities));
        }
        lines
    }
}

/// Makes an evaluator of the view that flags ask for, and has `work` use it, with the lines that are seen.
pub fn with_evaluator<T>(
    input: Input,
    flags: &RenderFlags,
    outputs: &Outputs,
    work: impl FnOnce(&Evaluator<'_>, &Lines<'_>) -> Result<T>,
) -> Result<T> {
    let asked = LightFlags { bounces: flags.radiance.bounces, ..LightFlags::default() };
    if flags.radiance.radiance == RadianceChoice::Interpolant {
        if let Input::Baked(baked) = &input {
            check_bounces(flags, &baked.provenance)?;
        }
        let baked = input.into_baked(&flags.input, &asked, outputs)?;
        let view = View::of(flags, &baked.scene)?;
        let lines = Lines { view: &view, scene: &baked.scene, discontinuities: &baked.lines };
        return by_interpolants(&baked, &view, |evaluate| work(evaluate, &lines));
    }
    let (scene, discontinuities, made) = match input {
        Input::Scene(scene) => (scene, Vec::new(), None),
        Input::Baked(baked) => (baked.scene, baked.lines, Some(baked.provenance)),
    };
    let view = View::of(flags, &scene)?;
    let lines = Lines { view: &view, scene: &scene, discontinuities: &discontinuities };
    let work = |evaluate: &Evaluator<'_>| work(evaluate, &lines);
    if flags.radiance.radiance == RadianceChoice::Whitted {
        ensure!(
            scene.emitters().next().is_some() || !scene.lights.is_empty() || scene.environment.is_some(),
            "{}: there is no light; give a material an emitted radiance (W/(sr m²)), such as the line `Ke 10 10 10` in the MTL \
             file, or add a [[light]] or an [environment] in a scene file",
            flags.input.display()
        );
        return by_whitted(&scene, &view, work);
    }
    require_light(&flags.input, &scene)?;
    if flags.radiance.radiance == RadianceChoice::Path {
        return by_paths(&scene, &view, work);
    }
    // From the bake: its reflectors send what the bake says that they do.
    let light = made.map_or(asked, |made| as_baked(&made, &asked));
    by_gather(&scene, &pipeline::bake(&scene, &light, None).solution, &view, work)
}

/// Makes an evaluator of a view of a bake, and has `work` use it. A gather is from what the bake says that its elements reflect.
pub fn with_evaluator_of<T>(
    baked: &Arc<Baked>,
    sources: &LightSources,
    view: &View,
    work: impl FnOnce(&Evaluator<'_>) -> T,
) -> T {
    match view.radiance.radiance {
        RadianceChoice::Interpolant => by_interpolants(baked, view, work),
        RadianceChoice::Gather => by_gather(&baked.scene, &sources.solution(baked), view, work),
        RadianceChoice::Path => by_paths(&baked.scene, view, work),
        RadianceChoice::Whitted => by_whitted(&baked.scene, view, work),
    }
}

fn by_interpolants<T>(baked: &Baked, view: &View, work: impl FnOnce(&Evaluator<'_>) -> T) -> T {
    let points = BakedPoints::new(baked);
    let bvh = Bvh::of_scene(&baked.scene);
    let eye = view.eye(&baked.scene, &bvh);
    work(&|point| eye.diffuse(point, |seen| (points.irradiance(seen), 0)))
}

fn by_gather<T>(scene: &Scene, solution: &Solution, view: &View, work: impl FnOnce(&Evaluator<'_>) -> T) -> T {
    let surroundings = Surroundings::new(scene, solution);
    let gather = Gather::new(&surroundings, solution);
    let points = PointGather::new(scene, solution, &gather);
    let bvh = Bvh::of_scene(scene);
    let eye = view.eye(scene, &bvh);
    work(&|point| eye.diffuse(point, |seen| (points.irradiance(seen), 0)))
}

fn by_paths<T>(scene: &Scene, view: &View, work: impl FnOnce(&Evaluator<'_>) -> T) -> T {
    let samples = view.radiance.paths.unwrap_or(PATHS);
    let options = PathOptions { samples, bounces: view.radiance.bounces, seed: view.seed };
    let bvh = Bvh::of_scene(scene);
    let light = PathLight::new(scene, &bvh, options);
    let eye = view.eye(scene, &bvh);
    work(&|point| eye.diffuse(point, |seen| (light.irradiance(seen), samples)))
}

/// Direct light of surfaces, and of nothing else, is what a gather without reflectors says.
fn by_whitted<T>(scene: &Scene, view: &View, work: impl FnOnce(&Evaluator<'_>) -> T) -> T {
    let surfaces = Scene { environment: None, ..scene.clone() };
    let (solution, _) = pipeline::solve(&surfaces, &LightFlags { bounces: Some(0), ..LightFlags::default() }, None);
    let surroundings = Surroundings::new(&surfaces, &solution);
    let gather = Gather::new(&surroundings, &solution);
    let points = PointGather::new(&surfaces, &solution, &gather);
    let direct = |point: &SurfacePoint| points.irradiance(point);
    let bvh = Bvh::of_scene(scene);
    let whitted = Whitted::new(view.eye(scene, &bvh), &direct);
    work(&|point| whitted.evaluate(point))
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
        let surroundings = Surroundings::new(&scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        let points = renderer::spread_by_area(&scene, 200, 1e-3, 1, |_| true);
        let kept = PointGather::new(&scene, &solution, &gather);
        for point in points.iter().chain(points.iter().rev()) {
            let inward = centroid(&scene.outline(point.polygon)) - point.position;
            let anew = gather.irradiance_at(point.polygon, point.position, inward);
            assert!((kept.irradiance(point) - anew).length() <= 1e-9 * (1.0 + anew.length()));
        }
    }
}
