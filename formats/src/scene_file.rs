//! A scene file: models put together, with their units, materials and cameras, as TOML.
//!
//! ```toml
//! units = "cm"                # of all lengths here and in the models: m, cm, mm, in, ft, or metres a unit (1)
//! up = "z"                    # the axis that points up: y or z ("y")
//!
//! [[model]]                   # at least one
//! file = "room.obj"           # .obj, .gltf or .glb, beside this file
//! units = "m"                 # of this model alone
//! up = "y"                    # the model's own; it is turned to the scene's
//! scale = 1.0                 # a factor, or one for each axis
//! rotate = [0, 0, 90]         # degrees about x, then y, then z
//! translate = [100, 0, 0]     # last
//!
//! [material.wall]             # every material of that name
//! reflectance = [0.7, 0.7, 0.6]   # a number or red, green, blue; in place of a texture
//! radiance = 0                # W/(sr m²)
//! specular = 0.2              # of highlights or of a mirror, for pictures along rays; a bake knows the reflectance alone
//! exponent = 50               # of highlights (the larger, the smaller they are)
//! mirror = false
//! two_sided = false           # whether the backs of its faces are there, too, whatever its model or --two-sided says; of closed
//!                             # solids nobody sees them, and they are not
//!
//! [[camera]]                  # the first is the one that pictures are taken with
//! name = "door"
//! eye = [100, 50, 160]
//! target = [300, 400, 100]
//! up = [0, 0, 1]              # the scene's
//! fov = 60                    # degrees, the full vertical angle (60)
//!
//! [[light]]                   # without a surface, for pictures along rays; no bake knows it
//! position = [200, 200, 250]  # with an intensity, a number or red, green, blue
//! intensity = 40              # W/sr
//!
//! [[light]]
//! towards = [0, 0.5, 1]       # the direction of a light that is far away
//! irradiance = [3, 3, 2.5]    # W/m² on a surface that faces it
//!
//! [environment]               # light from all around
//! map = "sky.hdr"             # .hdr or .exr, a picture of all directions beside this file, or
//! # sky = 12                  # a general sky of the CIE, 1 to 16, of 1 W/(sr m²) at the zenith
//! up = "z"                    # what points up under it: x, y or z (the scene's)
//! rotation = 90               # degrees clockwise, seen from above; north is y where z is up, and -z where y is
//! scale = 2                   # a factor
//! # sun = [135, 45]           # of a sky: where the sun stands, degrees clockwise from north and over the horizon
//! # sun_irradiance = 800      # W/m² on a surface that faces it (0)
//! ```
//!
//! A key that is not listed here is an error.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use glam::{DMat3, DMat4, DVec3};
use scene::{Camera, Gloss, Light, NamedCamera, Rgb, UpAxis};
use serde::Deserialize;
use toml::Spanned;

use crate::FormatError;
use crate::environment_entry::{EnvironmentEntry, environment_of};
use crate::gltf::{read_gltf, unique_names};
use crate::material_library::LARGEST_REFLECTANCE;
use crate::model::Model;
use crate::obj::read_obj;
use crate::report::ImportReport;
use crate::toml_text::TomlText;

/// Vertical opening angle of a camera that names none, degrees: wide enough for a room, not yet distorting.
pub(crate) const DEFAULT_FOV: f64 = 60.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    units: Option<Units>,
    up: Option<Axis>,
    model: Vec<Spanned<ModelEntry>>,
    #[serde(default)]
    material: BTreeMap<String, Spanned<MaterialEntry>>,
    #[serde(default)]
    camera: Vec<Spanned<CameraEntry>>,
    #[serde(default)]
    light: Vec<Spanned<LightEntry>>,
    environment: Option<Spanned<EnvironmentEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelEntry {
    file: String,
    units: Option<Units>,
    up: Option<Axis>,
    scale: Option<OneOrThree>,
    #[serde(default)]
    rotate: [f64; 3],
    #[serde(default)]
    translate: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    reflectance: Option<OneOrThree>,
    radiance: Option<OneOrThree>,
    specular: Option<OneOrThree>,
    exponent: Option<f64>,
    mirror: Option<bool>,
    two_sided: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraEntry {
    name: String,
    eye: [f64; 3],
    target: [f64; 3],
    up: Option<[f64; 3]>,
    fov: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightEntry {
    position: Option<[f64; 3]>,
    intensity: Option<OneOrThree>,
    towards: Option<[f64; 3]>,
    irradiance: Option<OneOrThree>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "expected a number or a list of three")]
enum OneOrThree {
    One(f64),
    Three([f64; 3]),
}

impl OneOrThree {
    fn vector(self) -> DVec3 {
        match self {
            Self::One(value) => DVec3::splat(value),
            Self::Three(values) => values.into(),
        }
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "expected \"m\", \"cm\", \"mm\", \"in\", \"ft\" or the metres of a unit")]
enum Units {
    Metres(f64),
    Name(UnitName),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum UnitName {
    M,
    Cm,
    Mm,
    In,
    Ft,
}

impl Units {
    fn metres(self) -> f64 {
        match self {
            Self::Metres(metres) => metres,
            Self::Name(UnitName::M) => 1.0,
            Self::Name(UnitName::Cm) => 0.01,
            Self::Name(UnitName::Mm) => 0.001,
            Self::Name(UnitName::In) => 0.0254,
            Self::Name(UnitName::Ft) => 0.3048,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Axis {
    Y,
    Z,
}

/// Cause and cure.
pub(crate) type Wrong = (String, &'static str);

/// Reads a scene file and the models that it names.
pub(crate) fn read_scene_file(path: &Path, report: &mut ImportReport) -> Result<Model, FormatError> {
    let text = &TomlText::read(path, "give a scene file in TOML")?;
    let wrong = |place: usize| move |(cause, cure): Wrong| text.wrong(place, cause, cure);
    let file: SceneFile = text.parse("see the scene file of the README for what may stand here")?;
    let up = file.up.unwrap_or(Axis::Y);
    let unit = metres(file.units).map_err(wrong(0))?;
    if file.model.is_empty() {
        return Err(wrong(0)(("names no model".to_owned(), "add [[model]] with the file of one")));
    }

    let is_single = file.model.len() == 1;
    let mut scene = Model { up: Some(if up == Axis::Y { DVec3::Y } else { DVec3::Z }), ..Model::default() };
    for entry in &file.model {
        let transform = transform(entry.get_ref(), up, unit).map_err(wrong(entry.span().start))?;
        let mut its_report = ImportReport::default();
        let model = read_model(&path.with_file_name(&entry.get_ref().file), &mut its_report)
            .map_err(wrong(entry.span().start))??;
        report.add(its_report);
        scene.append(model, transform);
    }
    if !is_single {
        scene.number_faces();
    }
    for (name, entry) in &file.material {
        change(&mut scene, name, entry.get_ref()).map_err(wrong(entry.span().start))?;
    }
    let mut cameras = Vec::new();
    for entry in &file.camera {
        cameras.push(camera(entry.get_ref(), scene.up.unwrap_or(DVec3::Y), unit).map_err(wrong(entry.span().start))?);
    }
    for entry in &file.light {
        scene.lights.push(light(entry.get_ref(), unit).map_err(wrong(entry.span().start))?);
    }
    if let Some(entry) = &file.environment {
        let own_up = if up == Axis::Y { UpAxis::Y } else { UpAxis::Z };
        let environment =
            environment_of(entry.get_ref(), path, own_up, report).map_err(wrong(entry.span().start))??;
        scene.environment = Some(environment);
    }
    cameras.append(&mut scene.cameras);
    unique_names(&mut cameras);
    scene.cameras = cameras;
    Ok(scene)
}

/// Reads a model by its extension; the outer error is one of the scene file.
fn read_model(path: &Path, report: &mut ImportReport) -> Result<Result<Model, FormatError>, Wrong> {
    match path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("obj") => Ok(read_obj(path, report)),
        Some("gltf" | "glb") => Ok(read_gltf(path, report)),
        _ => Err((
            format!("{:?} is no model that can be read", path.display().to_string()),
            "name an .obj, .gltf or .glb file",
        )),
    }
}

fn metres(units: Option<Units>) -> Result<f64, Wrong> {
    let metres = units.map_or(1.0, Units::metres);
    let possible = metres.is_finite() && metres > 0.0;
    possible
        .then_some(metres)
        .ok_or_else(|| (format!("a unit of {metres} metres"), "write a positive number or \"cm\""))
}

/// From a model's numbers to metres of the scene.
fn transform(entry: &ModelEntry, up: Axis, unit: f64) -> Result<DMat4, Wrong> {
    let own_unit = if entry.units.is_some() { metres(entry.units)? } else { unit };
    let turn = match (entry.up.unwrap_or(up), up) {
        (Axis::Y, Axis::Z) => DMat3::from_rotation_x(FRAC_PI_2),
        (Axis::Z, Axis::Y) => DMat3::from_rotation_x(-FRAC_PI_2),
        _ => DMat3::IDENTITY,
    };
    let [x, y, z] = entry.rotate.map(f64::to_radians);
    let rotation = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    let scale = entry.scale.map_or(DVec3::ONE, OneOrThree::vector);
    let linear = rotation * DMat3::from_diagonal(scale * own_unit) * turn;
    let translation = DVec3::from(entry.translate) * unit;
    if !linear.is_finite() || !translation.is_finite() || scale.x * scale.y * scale.z == 0.0 {
        let cause = "scale, rotate and translate are no transform of a body".to_owned();
        return Err((cause, "write finite numbers, and no scale of 0"));
    }
    Ok(DMat4::from_mat3_translation(linear, translation))
}

/// Changes all materials of a name.
fn change(scene: &mut Model, name: &str, entry: &MaterialEntry) -> Result<(), Wrong> {
    let ids: Vec<u32> =
        (0..).zip(&scene.materials).filter(|(_, material)| material.name == name).map(|(i, _)| i).collect();
    if ids.is_empty() {
        let mut names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).take(30).collect();
        names.sort_unstable();
        let cause = format!("no model has a material {name:?}; there are {}", names.join(", "));
        return Err((cause, "name one of them, with quotes where it has spaces or points: [material.\"a name\"]"));
    }
    let colour = |values: Option<OneOrThree>, what: &str, largest: f64| match values.map(OneOrThree::vector) {
        Some(colour) if !colour.is_finite() || colour.min_element() < 0.0 || colour.max_element() > largest => {
            Err((format!("a {what} of {colour}"), "write numbers from 0 up, a reflectance up to 1"))
        }
        colour => Ok(colour),
    };
    let reflectance = colour(entry.reflectance, "reflectance", 1.0)?;
    let radiance = colour(entry.radiance, "radiance", f64::MAX)?;
    let specular = colour(entry.specular, "specular reflectance", 1.0)?;
    if entry.exponent.is_some_and(|exponent| !exponent.is_finite() || exponent < 0.0) {
        return Err(("an exponent of highlights below 0".to_owned(), "write a number from 0 up, such as 50"));
    }
    for &id in &ids {
        let material = &mut scene.materials[id as usize];
        if let Some(reflectance) = reflectance {
            material.reflectance = reflectance.min(Rgb::splat(LARGEST_REFLECTANCE));
            material.texture = None;
        }
        material.radiance = radiance.unwrap_or(material.radiance);
        let diffuse = reflectance.or(material.gloss.map(|gloss| gloss.diffuse)).unwrap_or(material.reflectance);
        let dull = Gloss { diffuse, specular: Rgb::ZERO, exponent: 0.0, is_mirror: false };
        let mut gloss = Gloss { diffuse, ..material.gloss.unwrap_or(dull) };
        gloss.specular = specular.unwrap_or(gloss.specular);
        gloss.exponent = entry.exponent.unwrap_or(gloss.exponent);
        gloss.is_mirror = entry.mirror.unwrap_or(gloss.is_mirror);
        let shines = gloss.specular != Rgb::ZERO && (gloss.is_mirror || gloss.exponent > 0.0);
        material.gloss = shines.then_some(gloss);
        if shines && gloss.is_mirror {
            // As with other mirrors: a bake takes all that it reflects for diffuse.
            material.reflectance = (diffuse + gloss.specular).min(Rgb::splat(LARGEST_REFLECTANCE));
        }
    }
    if let Some(two_sided) = entry.two_sided {
        scene.two_sided.extend(ids.iter().map(|&id| (id, two_sided)));
    }
    Ok(())
}

fn light(entry: &LightEntry, unit: f64) -> Result<Light, Wrong> {
    let colour = |values: Option<OneOrThree>| values.map(OneOrThree::vector);
    let light = match (entry.position, colour(entry.intensity), entry.towards, colour(entry.irradiance)) {
        (Some(position), Some(intensity), None, None) => {
            Some(Light::Point { position: DVec3::from(position) * unit, intensity })
        }
        (None, None, Some(towards), Some(irradiance)) => {
            Some(Light::Directional { direction: DVec3::from(towards).normalize_or_zero(), irradiance })
        }
        _ => None,
    };
    light.filter(Light::is_valid).ok_or_else(|| {
        let cause =
            "no light: it has neither a position and an intensity, nor a direction and an irradiance".to_owned();
        (cause, "give position and intensity, or towards and irradiance, in finite numbers, light from 0 up")
    })
}

fn camera(entry: &CameraEntry, up: DVec3, unit: f64) -> Result<NamedCamera, Wrong> {
    let camera = Camera {
        eye: DVec3::from(entry.eye) * unit,
        target: DVec3::from(entry.target) * unit,
        up: entry.up.map_or(up, DVec3::from),
        vertical_fov: entry.fov.unwrap_or(DEFAULT_FOV).to_radians(),
    };
    let wrong = || {
        let cause = format!("{:?} is no camera that sees anything", entry.name);
        (cause, "give an eye apart from the target, an up that is not along the view, and a fov between 0 and 180")
    };
    camera.is_valid().then(|| NamedCamera { name: entry.name.clone(), camera }).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;
    use crate::{Imported, read_scene};

    const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nusemtl paint\nf 1 2 3 4\nusemtl lamp\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 7 6 5\n";
    const MTL: &str = "newmtl paint\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0\nKe 1 2 3\n";

    fn read(text: &str) -> Result<Imported, String> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), OBJ).unwrap();
        fs::write(folder.path().join("a.mtl"), MTL).unwrap();
        let path = folder.path().join("room.toml");
        fs::write(&path, text).unwrap();
        read_scene(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    const MODEL: &str = "[[model]]\nfile = \"a.obj\"\n";

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, line, cause) in [
            ("", 1, "model"),
            ("model = []\n", 1, "names no model"),
            ("units = \"parsec\"\n", 1, "expected \"m\", \"cm\""),
            ("units = -1\n[[model]]\nfile = \"a.obj\"\n", 1, "a unit of -1 metres"),
            ("up = \"x\"\n", 1, "x"),
            ("\n[[model]]\nfile = \"a.obj\"\ncolour = 1\n", 4, "unknown field `colour`"),
            ("[[model]]\nfile = \"a.fbx\"\n", 1, "no model that can be read"),
            ("[[model]]\nfile = \"a.toml\"\n", 1, "no model that can be read"),
            ("[[model]]\nfile = \"a.obj\"\nscale = 0\n", 1, "no transform"),
            ("[[model]]\nfile = \"a.obj\"\nscale = [1, 2]\n", 3, "a number or a list of three"),
            ("[[model]]\nfile = \"a.obj\"\nrotate = [nan, 0, 0]\n", 1, "no transform"),
            (
                "[[model]]\nfile = \"a.obj\"\n[material.gold]\nradiance = 1\n",
                3,
                "no model has a material \"gold\"; there are lamp, paint",
            ),
            ("[[model]]\nfile = \"a.obj\"\n[material.lamp]\nradiance = -1\n", 3, "a radiance of"),
            ("[[model]]\nfile = \"a.obj\"\n[material.lamp]\nreflectance = 1.5\n", 3, "a reflectance of"),
            (
                "[[model]]\nfile = \"a.obj\"\n[[camera]]\nname = \"c\"\neye = [0, 0, 0]\ntarget = [0, 0, 0]\n",
                3,
                "no camera",
            ),
            ("[[model]]\nfile = \"a.obj\"\n[[camera]]\nname = \"c\"\neye = [0, 0]\n", 5, ""),
            ("[[model]\n", 1, ""),
            ("[[model]]\nfile = \"a.obj\"\n[material.paint]\nspecular = 2\n", 3, "a specular reflectance of"),
            ("[[model]]\nfile = \"a.obj\"\n[material.paint]\nexponent = -1\n", 3, "an exponent"),
            ("[[model]]\nfile = \"a.obj\"\n[[light]]\nposition = [0, 0, 1]\n", 3, "no light"),
            ("[[model]]\nfile = \"a.obj\"\n[[light]]\nposition = [0, 0, 1]\nirradiance = 1\n", 3, "no light"),
            ("[[model]]\nfile = \"a.obj\"\n[[light]]\ntowards = [0, 0, 0]\nirradiance = 1\n", 3, "no light"),
            ("[[model]]\nfile = \"a.obj\"\n[[light]]\ntowards = [0, 0, 1]\nirradiance = -1\n", 3, "no light"),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.starts_with(&format!("room.toml, line {line}: ")), "{text:?}: {message}");
            assert!(message.contains(cause), "{text:?}: {message}");
        }
        assert!(read("[[model]]\nfile = \"gone.obj\"\n").unwrap_err().starts_with("gone.obj: cannot be read"));
    }

    #[test]
    fn units_axes_and_transforms_place_a_model() {
        let bounds = |text: &str| read(text).unwrap().scene.bounds();
        let near = |(low, high): (DVec3, DVec3), expected: [[f64; 3]; 2]| {
            let [a, b] = expected.map(DVec3::from);
            assert!((low - a).length() < 1e-9 && (high - b).length() < 1e-9, "{low} {high}");
        };
        near(bounds(MODEL), [[0., 0., 0.], [1., 2., 1.]]);
        near(bounds(&format!("units = \"cm\"\n{MODEL}translate = [100, 0, 0]\n")), [[1., 0., 0.], [1.01, 0.02, 0.01]]);
        near(
            bounds(&format!("units = \"cm\"\n{MODEL}units = 1\ntranslate = [100, 0, 0]")),
            [[1., 0., 0.], [2., 2., 1.]],
        );
        near(bounds(&format!("up = \"z\"\n{MODEL}up = \"y\"\n")), [[0., -1., 0.], [1., 0., 2.]]);
        near(bounds(&format!("{MODEL}up = \"z\"\n")), [[0., 0., -2.], [1., 1., 0.]]);
        near(bounds(&format!("{MODEL}scale = [1, 2, 3]\nrotate = [0, 0, 90]\n")), [[-4., 0., 0.], [0., 1., 3.]]);
    }

    #[test]
    fn mirrored_models_keep_their_fronts_and_several_are_one_scene() {
        let scene = read(&format!("{MODEL}scale = [-1, 1, 1]\n{MODEL}translate = [5, 0, 0]\n")).unwrap().scene;
        assert_eq!(scene.polygons.len(), 4);
        let planes: Vec<DVec3> = scene.polygon_ids().map(|polygon| scene.plane(polygon).normal).collect();
        assert!(planes.iter().all(|normal| normal.z.abs() > 0.999));
        assert_eq!(planes.iter().filter(|normal| normal.z > 0.0).count(), 2);
        assert_eq!(scene.power().x, scene.power().x.abs());
        assert_eq!(scene.emitters().count(), 2);
    }

    #[test]
    fn materials_are_changed_by_name() {
        let scene = |text: &str| read(&format!("{MODEL}{text}")).unwrap().scene;
        let changed = scene("[material.paint]\nreflectance = [0.1, 0.2, 1]\nradiance = 4\n");
        assert_eq!(changed.material(0).reflectance, DVec3::new(0.1, 0.2, 0.999));
        assert_eq!(changed.material(0).radiance, DVec3::splat(4.0));
        assert_eq!(changed.material(1).radiance, DVec3::new(1., 2., 3.));
        let two = scene("[material.lamp]\ntwo_sided = true\n");
        assert_eq!(two.polygons.len(), 3);
        assert_eq!(scene::other_sides(&two), [None, Some(2), Some(1)]);
        assert_eq!(scene("[material.lamp]\ntwo_sided = false\n").polygons.len(), 2);
    }

    #[test]
    fn mirrors_highlights_and_lights_stand_beside_what_is_diffuse() {
        let scene = |text: &str| read(&format!("units = \"cm\"\n{MODEL}{text}")).unwrap().scene;
        let glossy = scene("[material.paint]\nspecular = 0.2\nexponent = 50\n");
        let gloss = Gloss { diffuse: Rgb::splat(0.5), specular: Rgb::splat(0.2), exponent: 50.0, is_mirror: false };
        assert_eq!((glossy.material(0).gloss, glossy.material(0).reflectance), (Some(gloss), Rgb::splat(0.5)));
        let mirror = scene("[material.paint]\nreflectance = 0.1\nspecular = 0.8\nmirror = true\n").materials.remove(0);
        assert!(mirror.gloss.is_some_and(|gloss| gloss.is_mirror && gloss.diffuse == Rgb::splat(0.1)));
        assert!((mirror.reflectance - Rgb::splat(0.9)).length() < 1e-12);
        // Neither a mirror nor an exponent: nothing is seen of it.
        assert_eq!(scene("[material.paint]\nspecular = 0.2\n").material(0).gloss, None);
        let lights = "[[light]]\nposition = [100, 0, 0]\nintensity = 40\n\
                      [[light]]\ntowards = [0, 0, 4]\nirradiance = [1, 2, 3]\n";
        assert_eq!(
            scene(lights).lights,
            [
                Light::Point { position: DVec3::X, intensity: Rgb::splat(40.0) },
                Light::Directional { direction: DVec3::Z, irradiance: Rgb::new(1.0, 2.0, 3.0) },
            ]
        );
    }

    #[test]
    fn cameras_come_first_with_the_defaults_of_the_scene() {
        let text = format!(
            "units = \"cm\"\nup = \"z\"\n{MODEL}[[camera]]\nname = \"door\"\neye = [100, 0, 0]\ntarget = [0, 50, 0]\n"
        );
        let scene = read(&text).unwrap().scene;
        let NamedCamera { name, camera } = &scene.cameras[0];
        assert_eq!((name.as_str(), camera.eye, camera.up), ("door", DVec3::X, DVec3::Z));
        assert_eq!(camera.target, DVec3::Y * 0.5);
        assert!((camera.vertical_fov.to_degrees() - 60.0).abs() < 1e-9);
    }

    #[test]
    fn the_example_of_this_documentation_is_one() {
        let example: String = include_str!("scene_file.rs")
            .lines()
            .skip_while(|line| !line.contains("```toml"))
            .skip(1)
            .map_while(|line| line.strip_prefix("//!"))
            .take_while(|line| !line.contains("```"))
            .map(|line| format!("{line}\n"))
            .collect();
        let text = example.replace("room.obj", "a.obj").replace("material.wall", "material.paint");
        let text = text.replace("map =", "# map =").replace("# sky", "sky").replace("# sun", "sun");
        assert_eq!(read(&text).unwrap().scene.cameras[0].name, "door");
    }
}
