//! The exported page in a real browser: by both of its APIs the pictures of the CPU's twin, and a walk by keys and
//! mouse.

use std::path::Path;

use glam::DVec3;
use scene::{Camera, Exposure, ToneCurve};
use serde_json::Value;
use viewer::{Frame, Mode, Picture, Twin};

use crate::browser::Browser;
use crate::fixture::{data, fails, folder, office, run, text};

/// Width and height of the pictures, pixels; `web/test.html` says the same.
const SIZE: (u32, u32) = (320, 240);

fn export(bake: &Path, output: &Path) -> Value {
    let output = run(&["export", text(bake), "--web", text(output), "--json"]);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn what_cannot_be_exported_is_refused_and_nothing_is_lost() {
    let folder = folder();
    let out = folder.path().join("out");
    let missing = folder.path().join("missing.hlf");
    assert!(fails(1, &["export", text(&missing), "--web", text(&out)]).contains("missing.hlf"));
    assert!(fails(2, &["export", text(&missing)]).contains("--web"));
    let scene = data("scenes/office.obj");
    let nowhere = folder.path().join("missing/out");
    let said = fails(1, &["export", text(&scene), "--web", text(&nowhere)]);
    assert!(said.contains("missing") && !said.contains("took"), "refused before the work: {said}");
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("index.html"), "somebody else's").unwrap();
    let said = fails(1, &["export", text(&scene), "--web", text(&out)]);
    assert!(said.contains("index.html") && said.contains("empty") && !said.contains("took"), "{said}");
    assert_eq!(std::fs::read_to_string(out.join("index.html")).unwrap(), "somebody else's");
}

#[test]
fn an_export_holds_what_it_says_and_replaces_the_one_before() {
    let folder = folder();
    let out = folder.path().join("out");
    let first = export(office(), &out);
    assert_eq!(first, export(office(), &out));
    let head: Value = serde_json::from_slice(&std::fs::read(out.join("bake.json")).unwrap()).unwrap();
    let files = head["files"].as_array().unwrap();
    let bytes: u64 = files.iter().map(|file| out.join(file.as_str().unwrap()).metadata().unwrap().len()).sum();
    assert_eq!((first["files"].as_u64(), first["bytes"].as_u64()), (Some(files.len() as u64), Some(bytes)));
    let baked = formats::read_baked(&out.join("bake.hlf")).unwrap();
    assert_eq!(first["triangles"], baked.triangles.len());
    assert_eq!(head["name"], "office");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The office in every mode, a room with a texture and without cameras, which is baked by `export`, and a floor under a sky.
#[test]
fn a_browser_draws_what_the_cpu_draws_and_walks() {
    let (folder, scene) = (folder(), folder());
    let texels = [[255, 255, 255], [200, 30, 0], [0, 90, 10], [0, 0, 0], [9, 60, 250], [120, 120, 0]];
    formats::write_png(&scene.path().join("six.png"), 3, 2, &texels).unwrap();
    let textured = crate::textures::room(scene.path(), "Kd 0.8 0.8 0.8\nmap_Kd six.png");
    let open = crate::daylight::lit_floor_under(scene.path(), "sky = 12\nscale = 0.1\nsun = [80, 20]");
    for (input, name) in [(office(), "office"), (textured.as_path(), "textured"), (open.as_path(), "open")] {
        export(input, &folder.path().join(name));
    }
    let Some(browser) = Browser::open(folder.path(), include_str!("web/test.html")) else { return };
    for (name, modes) in [
        ("office", Mode::ALL.as_slice()),
        ("textured", &[Mode::Shaded]),
        ("open", &[Mode::Shaded, Mode::Gouraud, Mode::Ids]),
    ] {
        draws_what_the_cpu_draws(&browser, &folder.path().join(name), name, modes);
    }
    let report = browser.report();
    assert_eq!(report.name, "addresses");
    let size = formats::read_baked(office()).unwrap().scene.size();
    walks(&serde_json::from_slice::<Vec<String>>(&report.body).unwrap(), size);
    let report = browser.report();
    let status = String::from_utf8(report.body).unwrap();
    assert!(report.name == "status" && status.contains("WebGL2 draws"), "a lost context is opened again: {status}");
}

/// The reports of an export's pictures, from its first camera.
fn draws_what_the_cpu_draws(browser: &Browser, export: &Path, name: &str, modes: &[Mode]) {
    let twin = Twin::new(&formats::read_baked(&export.join("bake.hlf")).unwrap());
    let head: Value = serde_json::from_slice(&std::fs::read(export.join("bake.json")).unwrap()).unwrap();
    let view = head["cameras"].get(0).unwrap_or(&head["overview"]);
    let vector = |key: &str| serde_json::from_value::<DVec3>(view[key].clone()).unwrap();
    let number = |key: &str| view[key].as_f64().unwrap();
    let vertical_fov = number("fov").to_radians();
    let camera = Camera { eye: vector("eye"), target: vector("target"), up: vector("up"), vertical_fov };
    let exposure = Some(Exposure { ev: number("ev") as f32 });
    let (width, height) = SIZE;
    for api in ["WebGL2", "WebGPU"] {
        for &mode in modes {
            let cpu = twin.draw(&Frame { camera, width, height, mode, exposure, curve: ToneCurve::default() });
            let report = browser.report();
            assert_eq!(report.name, format!("{name}/{api}/{mode}"));
            // A rasteriser may put corners on sixteenths of a pixel: which of two neighbours a pixel shows differs
            // then. Where light is shown, which goes on from one to the other, that makes no difference; where
            // triangles are, it does.
            let share = if mode.is_light() { 0.001 } else { 0.015 };
            is_the_same(&report.body, &cpu, share, &report.name);
        }
    }
}

/// At most 1/255 apart but for a share of the pixels. What the browser drew stands in the folder of temporary files.
fn is_the_same(pixels: &[u8], cpu: &Picture, share: f64, what: &str) {
    let pixels: Vec<[u8; 3]> = pixels.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("web-{}.png", what.replace('/', "-")));
    formats::write_png(&kept, cpu.width, cpu.height, &pixels).unwrap();
    let near = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).all(|(a, b)| a.abs_diff(*b) <= 1);
    let off = cpu.rgb.len() - pixels.iter().zip(&cpu.rgb).filter(near).count();
    assert!(
        off as f64 <= share * cpu.rgb.len() as f64,
        "{what}: {off} of {} pixels are off; see {}",
        cpu.rgb.len(),
        kept.display()
    );
}

/// The addresses at the start, after a key that walks forward was held, after the mouse was dragged right by 100
/// pixels, then with the right button from the middle of the picture, and after two fingers walked forward.
fn walks(addresses: &[String], size: f64) {
    let vector = |address: &String, name: &str| {
        let value = address.split(['#', '&']).find_map(|part| part.strip_prefix(&format!("{name}="))).unwrap();
        let numbers: Vec<f64> = value.split([',']).map(|number| number.parse().unwrap()).collect();
        DVec3::from_slice(&numbers)
    };
    let [start, walked, turned, around, fingers] = addresses else { panic!("{addresses:?}") };
    let view = |address| vector(address, "target") - vector(address, "eye");
    let way = vector(walked, "eye") - vector(start, "eye");
    // Half a second at an eighth of the scene a second, or what a busy machine made of it.
    assert!(way.length() > size / 100.0 && way.length() < size, "{addresses:?}");
    assert!(way.angle_between(view(start)) < 0.01, "{addresses:?}");
    assert!((vector(turned, "eye") - vector(walked, "eye")).length() < 1e-3, "{addresses:?}");
    let heading = |address| DVec3::new(view(address).x, view(address).y, 0.0);
    let angle = heading(walked).angle_between(heading(turned));
    assert!((angle - 0.1 * std::f64::consts::PI).abs() < 1e-3, "{addresses:?}: {angle}");
    assert!(heading(walked).cross(heading(turned)).z < 0.0, "to the right: {addresses:?}");
    // Both views are of one point, as far away as before.
    let [before, after] = [turned, around].map(|address| (vector(address, "eye"), view(address).normalize()));
    let away = (before.0 - after.0).length() / (before.1 - after.1).length();
    assert!((before.0 - after.0).length() > size / 100.0 && away > size / 10.0, "{addresses:?}");
    assert!((before.0 + before.1 * away - after.0 - after.1 * away).length() < 0.01 * size, "{addresses:?}");
    let way = vector(fingers, "eye") - vector(around, "eye");
    assert!(way.length() > size / 100.0 && way.angle_between(view(around)) < 0.01, "{addresses:?}");
}
