//! Bakes that are interrupted: what is written is valid, and what is resumed ends as if nothing had happened.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use mesher::{Bake, BakeOptions, Control};
use scene::{Answers, Rows, Scene, Seen};
use solver::{SolveOptions, Visibility, solve};

use crate::fixture::{cornell_box, data, fails, folder, halflight, run, text};
use crate::generated::{hall, mtl, obj};

/// Bakes, and stops when it was asked for the `most`th time whether to. How often it was asked, and the bake.
fn bake(scene: &Scene, tolerance: f64, answers: Answers, most: usize) -> (usize, Bake) {
    let solution = solve(scene, &SolveOptions::default(), &|_| ());
    let asked = AtomicUsize::new(0);
    let control = Control {
        progress: &|_| (),
        stop: &|| false,
        interrupted: &|| asked.fetch_add(1, Ordering::Relaxed) >= most,
        watch: None,
    };
    let bake = mesher::resume(scene, solution, &BakeOptions { tolerance, ..BakeOptions::default() }, control, answers);
    (asked.into_inner(), bake)
}

/// Interrupts bakes at several points, some of them twice, and resumes them.
fn ends_the_same_when_resumed(scene: &Scene, tolerance: f64, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let (count, whole) = bake(scene, tolerance, Answers::default(), usize::MAX);
        assert_eq!(whole.answers, None);
        let mean = whole.baked.mean_irradiance().element_sum();
        for part in [0.0, 0.02, 0.3, 0.6, 0.95] {
            let (_, first) = bake(scene, tolerance, Answers::default(), (part * count as f64) as usize);
            first.baked.validate().unwrap();
            assert!(!first.baked.error.holds);
            if part > 0.0 {
                let found = first.baked.mean_irradiance().element_sum();
                assert!((0.5..2.0).contains(&(found / mean)), "{found} is no guess at {mean}, after {part}");
            }
            let (_, second) = bake(scene, tolerance, first.answers.unwrap(), count / 50);
            let answers = second.answers.unwrap_or_default();
            let (_, third) = bake(scene, tolerance, answers, usize::MAX);
            assert!(third == whole, "another bake after an interruption at {part} of the work");
        }
    });
}

fn cornell() -> Scene {
    formats::read_baked(cornell_box()).unwrap().scene
}

#[test]
fn a_scene_with_links_ends_the_same_when_resumed() {
    let scene = cornell();
    // The finer one takes several rounds.
    for (tolerance, threads) in [(0.05, 1), (0.005, 2)] {
        ends_the_same_when_resumed(&scene, tolerance, threads);
    }
}

/// Of light from the sky, what comes straight from there is told apart.
#[test]
fn a_scene_under_a_sky_ends_the_same_when_resumed() {
    let path = data("scenes/window.obj");
    let sky = scene::Sky::Cie(scene::CieSky::new(12, [1.5, 0.5], 0.0).unwrap());
    let environment = scene::Environment { sky, up: scene::UpAxis::Z, rotation: 0.0, scale: 1.0 };
    let scene = Scene { environment: Some(environment), ..formats::read_scene(&path).unwrap().scene };
    ends_the_same_when_resumed(&scene, 0.1, 2);
}

#[test]
fn a_scene_without_links_ends_the_same_when_resumed() {
    let scene = hall(500);
    assert_eq!(solve(&scene, &SolveOptions::default(), &|_| ()).visibility, Visibility::Rays);
    for threads in [1, 2] {
        ends_the_same_when_resumed(&scene, 0.2, threads);
    }
}

/// Answers that are none, as only a forged file has them, are looked for anew.
#[test]
fn forged_answers_are_not_taken() {
    let scene = cornell();
    let (count, whole) = bake(&scene, 0.02, Answers::default(), usize::MAX);
    let answers = bake(&scene, 0.02, Answers::default(), count - 1).1.answers.unwrap();
    let forge = |change: &dyn Fn(&mut Answers)| {
        let mut forged = answers.clone();
        change(&mut forged);
        assert!(bake(&scene, 0.02, forged, usize::MAX).1 == whole);
    };
    forge(&|_| ());
    forge(&|forged| {
        let strange = [Seen { node: u32::MAX, ..Seen::default() }];
        let mut rows = Rows::default();
        forged.rows.iter().enumerate().for_each(|(i, row)| rows.push(if i == 7 { &strange } else { row }));
        forged.rows = rows;
    });
    forge(&|forged| forged.questions[1] ^= 1);
    forge(&|forged| forged.questions.truncate(1));
    forge(&|forged| forged.emitted.truncate(5));
    forge(&|forged| forged.rows.truncate(0));
}

/// What a limit of memory keeps is the same at any number of threads.
#[test]
fn memory_is_counted_and_kept_within_its_limit() {
    let scene = hall(500);
    let bake = |max_bytes, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = BakeOptions { tolerance: 0.05, max_bytes, ..BakeOptions::default() };
        let control = Control { progress: &|_| (), stop: &|| false, interrupted: &|| false, watch: None };
        pool.install(|| mesher::bake(&scene, solve(&scene, &SolveOptions::default(), &|_| ()), &options, control))
    };
    let whole = bake(usize::MAX, 2);
    let most = whole.statistics.bytes;
    assert!(whole.baked.error.holds && most > 1_000_000, "{most}");
    for limit in [0, most / 2] {
        let [one, two] = [1, 2].map(|threads| bake(limit, threads));
        assert!(one == two && one.answers.is_none(), "{limit}");
        one.baked.validate().unwrap();
        assert!(!one.baked.error.holds);
        // The first mesh is counted once it is there, finer ones are foreseen.
        assert!(limit == 0 || one.statistics.bytes <= limit * 5 / 4, "{} of {limit}", one.statistics.bytes);
    }
    assert!(bake(most, 2) == whole);
}

#[test]
fn a_scene_that_needs_more_memory_than_it_may_take_is_refused() {
    let folder = folder();
    let (scene, output) = (hall_file(folder.path()), folder.path().join("out.hlf"));
    let bake = |memory| vec!["bake", text(&scene), "-o", text(&output), "--max-memory", memory];
    let said = fails(1, &bake("10MB"));
    assert!(said.contains("1014 polygons need 18.8MB") && said.contains("--max-memory allows 10.0MB"), "{said}");
    assert!(!said.contains("solve took"), "{said}");
    // By the faces of its file alone.
    assert!(!fails(1, &bake("1MB")).contains("import took"));
    assert!(!output.exists());
    // Enough to begin, and too little for the tolerance.
    let less = halflight().args(bake("20MB")).args(["--tolerance", "0.03"]).output().unwrap();
    let said = String::from_utf8(less.stderr).unwrap();
    assert_eq!(less.status.code(), Some(3), "{said}");
    assert!(said.contains("does not keep --tolerance 0.03") && said.contains("memory"), "{said}");
    formats::read_baked(&output).unwrap();
    for memory in ["0", "much", "-1GB"] {
        let said = fails(2, &[&bake("1GB")[..4], &[&format!("--max-memory={memory}")]].concat());
        assert!(said.contains("--max-memory"), "{said}");
    }
}

/// A hall of about 1,000 polygons as an OBJ.
fn hall_file(folder: &Path) -> std::path::PathBuf {
    let (scene, path) = (hall(1_000), folder.join("hall.obj"));
    std::fs::write(folder.join("hall.mtl"), mtl(&scene)).unwrap();
    std::fs::write(&path, obj(&scene, "hall.mtl")).unwrap();
    path
}

/// Starts a bake and interrupts it once it meshes. Whether that was in time.
#[cfg(unix)]
fn interrupted(scene: &Path, output: &Path) -> bool {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};

    let mut bake = Command::new(env!("CARGO_BIN_EXE_halflight"))
        .args(["bake", text(scene), "-o", text(output), "--tolerance", "0.05"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(bake.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("solve took") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it ended before it meshed");
    }
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(Command::new("kill").args(["-INT", &bake.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    let code = bake.wait().unwrap().code();
    match code {
        Some(130) if output.exists() => assert!(rest.contains("--resume goes on"), "{rest}"),
        // It had not begun to mesh, or was done already.
        _ => assert!(matches!(code, Some(130 | 0)), "{code:?}: {rest}"),
    }
    code == Some(130) && output.exists()
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_a_bake_that_is_resumed_and_only_by_its_own_scene_and_options() {
    let folder = folder();
    let (scene, output) = (hall_file(folder.path()), folder.path().join("out.hlf"));
    let whole = folder.path().join("whole.hlf");
    let bake = ["bake", text(&scene), "--tolerance", "0.05", "-o"];
    run(&[&bake[..], &[text(&whole)]].concat());
    // Whoever is late on a busy machine tries again.
    let in_time = (0..20).any(|_| {
        _ = std::fs::remove_file(&output);
        interrupted(&scene, &output)
    });
    assert!(in_time);

    let info = String::from_utf8(run(&["info", text(&output)]).stdout).unwrap();
    assert!(info.contains("was interrupted"), "{info}");
    run(&["shot", text(&output), "-o", text(&folder.path().join("a.png")), "--size", "16x16", "--backend", "cpu"]);

    let resume = |arguments: &[&str]| fails(1, &[&["bake", "--resume", "-o", text(&output)], arguments].concat());
    let said = resume(&[text(&scene), "--tolerance", "0.06"]);
    assert!(said.contains("with --tolerance 0.05 ") && said.contains("with --tolerance 0.06 "), "{said}");
    let said = resume(&[text(&data("scenes/cornell_box.obj")), "--tolerance", "0.05"]);
    assert!(said.contains("another scene than") && said.contains("cornell_box.obj"), "{said}");

    run(&[&bake[..], &[text(&output), "--resume"]].concat());
    assert!(std::fs::read(&output).unwrap() == std::fs::read(&whole).unwrap());

    // Now it is whole, and there is nothing to resume; nor where nothing is.
    let said = resume(&[text(&scene), "--tolerance", "0.05"]);
    assert!(said.contains("was not interrupted") && said.contains("leave --resume out"), "{said}");
    std::fs::remove_file(&output).unwrap();
    assert!(resume(&[text(&scene)]).contains("is not there"));

    // Of another build.
    let (baked, answers) = (formats::read_baked(&whole).unwrap(), scene::Unfinished::default());
    formats::write_unfinished(&output, &baked, &answers).unwrap();
    assert!(resume(&[text(&scene)]).contains("another build"));
    // Damaged.
    std::fs::write(&output, &std::fs::read(&whole).unwrap()[..1000]).unwrap();
    assert!(resume(&[text(&scene)]).contains("cut off"));
}
