//! `halflight info`: what a file holds.

use std::io::Write;

use anyhow::{Context, Result};
use formats::{ImportReport, Imported};
use scene::{Baked, CieSky, Environment, Scene, Sky, Texture};
use serde::Serialize;

use crate::args::InfoFlags;
use crate::failure::Outcome;
use crate::input::{no_bake, read_scene};
use crate::pipeline::ErrorReport;
use crate::report::{peak_memory, print_json};

/// Describes a scene or a bake.
pub fn run(flags: &InfoFlags) -> Result<Outcome> {
    let info = if formats::is_baked(&flags.input) {
        no_bake(&flags.input, &flags.reading)?;
        let (baked, unfinished) = formats::read_unfinished(&flags.input)?;
        let bake = BakeInfo::of(&baked, unfinished.is_some());
        Info { scene: SceneInfo::of(&baked.scene), import: None, bake: Some(bake) }
    } else {
        let (Imported { scene, report }, seconds) = read_scene(&flags.input, &flags.reading)?;
        let import = ImportInfo { report, seconds, peak_memory_bytes: peak_memory() };
        Info { scene: SceneInfo::of(&scene), import: Some(import), bake: None }
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
    /// Null for a bake.
    import: Option<ImportInfo>,
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
    textures: Vec<TextureInfo>,
    /// Null without one.
    environment: Option<EnvironmentInfo>,
}

#[derive(Serialize)]
struct EnvironmentInfo {
    /// "map", or the number of a sky of the CIE as "cie:12".
    sky: String,
    /// Texels of a map as the scene has it; null for a sky of the CIE.
    size: Option<[u32; 2]>,
    /// Azimuth and altitude of the sun of a sky of the CIE, degrees; null for a map.
    sun: Option<[f64; 2]>,
    /// What that sun itself sends to a surface that faces it, W·m⁻², before the scale.
    sun_irradiance: Option<f64>,
    up: &'static str,
    /// Degrees clockwise.
    rotation: f64,
    scale: f64,
}

#[derive(Serialize)]
struct TextureInfo {
    name: String,
    /// Texels; an image that was larger than a texture may be is here as it was reduced.
    size: [u32; 2],
    /// Mean linear colour.
    mean: [f64; 3],
    /// Materials that use it.
    materials: Vec<String>,
}

/// What was found and repaired, and what reading took.
#[derive(Serialize)]
struct ImportInfo {
    #[serde(flatten)]
    report: ImportReport,
    seconds: f64,
    /// Null where the system does not tell.
    peak_memory_bytes: Option<u64>,
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
    interrupted: bool,
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
            textures: (0..).zip(&scene.textures).map(|(id, texture)| TextureInfo::of(scene, id, texture)).collect(),
            environment: scene.environment.as_ref().map(EnvironmentInfo::of),
        }
    }
}

impl EnvironmentInfo {
    fn of(environment: &Environment) -> Self {
        let (sky, size, cie) = match &environment.sky {
            Sky::Map(map) => ("map".to_owned(), Some([map.width, map.height]), None),
            Sky::Cie(sky) => (format!("cie:{}", sky.kind()), None, Some(sky)),
        };
        Self {
            sky,
            size,
            sun: cie.map(|sky| sky.sun().map(f64::to_degrees)),
            sun_irradiance: cie.map(CieSky::sun_irradiance),
            up: environment.up.name(),
            rotation: environment.rotation.to_degrees(),
            scale: environment.scale,
        }
    }

    fn text(&self) -> String {
        let Self { sky, size, sun, sun_irradiance, up, rotation, scale } = self;
        let size = size.map_or_else(String::new, |[width, height]| format!(" of {width}x{height}"));
        let sun = sun.zip(*sun_irradiance).map_or_else(String::new, |([azimuth, altitude], irradiance)| {
            format!(", sun of {irradiance:.4} W/m² at {azimuth:.1}°, {altitude:.1}°")
        });
        format!("environment      {sky}{size}{sun}; {up} is up, turned by {rotation:.1}°, times {scale:.4}\n")
    }
}

impl TextureInfo {
    fn of(scene: &Scene, id: u32, texture: &Texture) -> Self {
        let users = scene.materials.iter().filter(|material| material.texture == Some(id));
        Self {
            name: texture.name.clone(),
            size: [texture.width, texture.height],
            mean: texture.mean().to_array(),
            materials: users.map(|material| material.name.clone()).collect(),
        }
    }
}

impl BakeInfo {
    fn of(baked: &Baked, interrupted: bool) -> Self {
        Self {
            interrupted,
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
        let SceneInfo {
            polygons,
            vertices,
            materials,
            objects,
            emitters,
            power,
            bounds: [low, high],
            cameras,
            textures,
            environment,
        } = &self.scene;
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
        text.extend(environment.as_ref().map(EnvironmentInfo::text));
        if !textures.is_empty() {
            text += &format!("textures         {}\n", textures.len());
        }
        for TextureInfo { name, size: [width, height], mean, materials } in textures {
            let materials = if materials.is_empty() { "no material".to_owned() } else { materials.join(", ") };
            text += &format!("  {name:<20} {width}x{height}, mean {}, on {materials}\n", triple(mean));
        }
        if let Some(import) = &self.import {
            text += &import.text();
        }
        if let Some(bake) = &self.bake {
            text += &format!(
                "bake             {} triangles, {} samples, {} elements, {} discontinuities\n\
                 mean irradiance  {} W/m²\n\
                 measured error   {}\n\
                 made by          {}\n",
                bake.triangles,
                bake.samples,
                bake.elements,
                bake.discontinuities,
                triple(&bake.mean_irradiance),
                bake.error.text(),
                bake.program
            );
            if bake.interrupted {
                text += "  was interrupted; the command that began it goes on with --resume\n";
            }
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

impl ImportInfo {
    /// A line for what was read, and one for each repair that something needed.
    fn text(&self) -> String {
        let report = &self.report;
        let repairs = [
            (report.welded_vertices, "repeated positions welded"),
            (report.degenerate_faces, "faces without area skipped"),
            (report.crossing_faces, "faces that cross themselves skipped"),
            (report.repeated_faces, "repeated faces skipped"),
            (report.non_planar_faces, "faces that are not planar split"),
            (report.concave_faces, "concave faces split"),
            (report.merged_faces, "faces merged into others"),
            (report.junctions, "T-junctions closed"),
            (report.open_junctions, "T-junctions left open"),
            (report.turned_faces, "faces turned to agree with their surface"),
            (report.one_sided_surfaces, "surfaces that no turning makes consistent"),
            (report.other_sides, "other sides added"),
            (report.missing_materials, "materials missing, grey instead"),
            (report.clamped_materials, "reflectances limited"),
            (report.textured_materials, "textures not read"),
            (report.mirror_materials, "mirrors and metals made diffuse"),
            (report.transparent_faces, "faces left out, seen through for the most part"),
        ];
        let mut text = format!("import           {} faces in the file\n", report.polygons_read);
        for (count, what) in repairs.iter().filter(|(count, _)| *count > 0) {
            text += &format!("  {count:<15}{what}\n");
        }
        text
    }
}

fn triple(values: &[f64; 3]) -> String {
    values.map(|value| format!("{value:.4}")).join(" ")
}
