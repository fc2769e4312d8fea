//! The GPU and its twin on the CPU draw the same picture.

use std::path::Path;

use scene::Baked;
use viewer::{Capture, Evaluator, Frame, Gpu, Mode, Picture, Twin, draw_on_cpu, draw_on_gpu};

use crate::fixture::{cornell_box, office};

/// The adapter. Without one the test skips loudly, and fails where HALFLIGHT_REQUIRE_GPU=1.
#[expect(clippy::print_stderr, reason = "a test that skips says so")]
fn gpu() -> Option<Gpu> {
    let required = std::env::var("HALFLIGHT_REQUIRE_GPU").is_ok_and(|value| value == "1");
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) if required => panic!("HALFLIGHT_REQUIRE_GPU=1, and yet: {error}"),
        Err(error) => {
            eprintln!("SKIPPED, the GPU was not compared with the CPU: {error}");
            None
        }
    }
}

fn frame(baked: &Baked, mode: Mode) -> Frame {
    Frame {
        camera: baked.scene.cameras[0].camera,
        width: 640,
        height: 480,
        mode,
        exposure: None,
        curve: scene::ToneCurve::default(),
    }
}

/// The adapter by either evaluator, with and without radiance: at most 1/255 apart from the CPU on 99.9 % of the pixels,
/// and as many pixels of background.
fn the_same_picture(bake: &Path, modes: &[Mode]) {
    let Some(gpu) = gpu() else { return };
    let baked = formats::read_baked(bake).unwrap();
    let twin = Twin::new(&baked);
    let compare = |gpu: &Gpu, how: Evaluator| {
        let capture = Capture::new(gpu, &baked, &twin, 640, 480).unwrap();
        for &mode in modes {
            let cpu = twin.draw(&frame(&baked, mode));
            let frame = Frame { exposure: Some(cpu.exposure), ..frame(&baked, mode) };
            for gpu in [capture.draw(&frame).unwrap(), capture.display(&frame).unwrap()] {
                is_the_same(&gpu, &cpu, &format!("{mode}, evaluated by {how:?}"));
            }
        }
    };
    let host = gpu.with_evaluator(Evaluator::Host);
    compare(&host, Evaluator::Host);
    compare(&host.with_evaluator(Evaluator::Adapter), Evaluator::Adapter);
}

fn is_the_same(gpu: &Picture, cpu: &Picture, what: &str) {
    let near = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).all(|(a, b)| a.abs_diff(*b) <= 1);
    let agree = gpu.rgb.iter().zip(&cpu.rgb).filter(near).count();
    assert!(agree * 1000 >= cpu.rgb.len() * 999, "{what}: {agree} of {} pixels agree", cpu.rgb.len());
    assert!(gpu.background.abs_diff(cpu.background) * 1000 <= cpu.rgb.len() as u64, "{what}");
}

#[test]
fn the_office_in_every_mode() {
    the_same_picture(office(), &Mode::ALL);
}

#[test]
fn the_cornell_box() {
    the_same_picture(cornell_box(), &[Mode::Shaded]);
}

/// The room is closed: a pixel that shows the background is a hole in the mesh.
#[test]
fn the_office_has_no_pinholes() {
    let baked = formats::read_baked(office()).unwrap();
    let frame = frame(&baked, Mode::Shaded);
    assert_eq!(draw_on_cpu(&baked, &frame).background, 0, "on the CPU");
    let Some(gpu) = gpu() else { return };
    assert_eq!(draw_on_gpu(&gpu, &baked, &frame).unwrap().background, 0, "on the GPU");
}
