//! `halflight info`: what a file holds.

use std::io::Write;

use anyhow::{Context, Result};
use scene::{Baked, Scene};
use serde::Serialize;

use crate::args::InfoFlags;
use crate::failure::Outcome;
use crate::input::Input;
use crate::pipeline::ErrorReport;
use crate::report::print_json;

/// Describes a scene or a bake.
pub fn run(flags: &InfoFlags) -> Result<Outcome> {
    let info = match Input::read(&flags.input)? {
        Input::Scene(scene) => Info { scene: SceneInfo::of(&scene), bake: None },
        Input::Baked(baked) => Info { scene: SceneInfo::of(&baked.scene), bake: Some(BakeInfo::of(&baked)) },
    };
    if flags.json {
        print_json(&info)?;
    } else {
        std::io::stdout().lock().write_all(info.text().as_bytes()).context("cannot write to stdout")?;
    }
    Ok(Outcome::Done)
}

#[derive(Serialize)]
struct Info {
    scene: SceneInfo,
    /// Null for a scene.
    bake: Option<BakeInfo>,
}

#[derive(Serialize)]
struct SceneInfo {
    polygons: usize,
    vertices: usize,
    materials: usize,
    objects: usize,
    emitters: usize,
    /// Emitted power by colour, W.
    power: [f64; 3],
    /// Corners of the box around it, metres.
    bounds: [[f64; 3]; 2],
    cameras: Vec<String>,
}

#[derive(Serialize)]
struct BakeInfo {
    program: String,
    options: Vec<(String, String)>,
    statistics: Vec<(String, f64)>,
    triangles: usize,
    samples: usize,
    elements: usize,
    discontinuities: usize,
    /// Area-weighted mean irradiance, W·m⁻².
    mean_irradiance: [f64; 3],
    error: ErrorReport,
}

impl SceneInfo {
    fn of(scene: &Scene) -> Self {
        let (low, high) = scene.bounds();
        Self {
            polygons: scene.polygons.len(),
            vertices: scene.vertices.len(),
            materials: scene.materials.len(),
            objects: scene.objects.len(),
            emitters: scene.emitters().count(),
            power: scene.power().to_array(),
            bounds: [low.to_array(), high.to_array()],
            cameras: scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
        }
    }
}

impl BakeInfo {
    fn of(baked: &Baked) -> Self {
        Self {
            program: baked.provenance.program.clone(),
            options: baked.provenance.options.clone(),
            statistics: baked.provenance.statistics.clone(),
            triangles: baked.triangles.len(),
            samples: baked.samples.len(),
            elements: baked.elements.len(),
            discontinuities: baked.lines.len(),
            mean_irradiance: baked.mean_irradiance().to_array(),
            error: baked.error.into(),
        }
    }
}

impl Info {
    fn text(&self) -> String {
        let SceneInfo { polygons, vertices, materials, objects, emitters, power, bounds: [low, high], cameras } =
            &self.scene;
        let cameras = if cameras.is_empty() { "none".to_owned() } else { cameras.join(", ") };
        let mut text = format!(
            "scene            {polygons} polygons, {vertices} vertices, {materials} materials, {objects} objects\n\
             box              {} to {} m\n\
             light            {emitters} emitters, {} W\n\
             cameras          {cameras}\n",
            triple(low),
            triple(high),
            triple(power)
        );
        if let Some(bake) = &self.bake {
            text += &format!(
                "bake             {} triangles, {} samples, {} elements, {} discontinuities\n\
                 mean irradiance  {} W/m²\n\
                 measured error   {:.3} % rms, {:.3} % at 99 %, {:.3} % at most, over {} points: the tolerance is {}\n\
                 made by          {}\n",
                bake.triangles,
                bake.samples,
                bake.elements,
                bake.discontinuities,
                triple(&bake.mean_irradiance),
                100.0 * bake.error.rms,
                100.0 * bake.error.p99,
                100.0 * bake.error.max,
                bake.error.points,
                if bake.error.holds { "kept" } else { "not kept" },
                bake.program
            );
            for (name, value) in &bake.options {
                text += &format!("  {name:<20} {value}\n");
            }
            for (name, value) in &bake.statistics {
                text += &format!("  {name:<20} {value}\n");
            }
        }
        text
    }
}

fn triple(values: &[f64; 3]) -> String {
    values.map(|value| format!("{value:.4}")).join(" ")
}
