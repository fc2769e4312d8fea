#![allow(clippy::unwrap_used)]
use clap::CommandFactory;
use glam::DVec3;
use scene::Exposure;

use super::*;
use crate::failure::Usage;

fn refused(arguments: &[&str]) -> String {
    let flags = Flags::try_parse_from([&["halflight"], arguments].concat());
    let error = flags.expect_err(&format!("{arguments:?} was accepted"));
    assert_eq!(error.exit_code(), 2, "{arguments:?}");
    error.to_string()
}

fn shot(arguments: &[&str]) -> ShotFlags {
    match Flags::try_parse_from([&["halflight", "shot", "a.hlf", "-o", "a.png"], arguments].concat()).unwrap().command {
        Command::Shot(flags) => flags,
        other => unreachable!("{other:?}"),
    }
}

#[test]
fn the_flags_are_consistent() {
    Flags::command().debug_assert();
}

#[test]
fn what_cannot_be_is_refused_by_the_name_of_its_flag() {
    for value in ["-1", "nan", "inf", "-inf", "1e999", "", "many"] {
        for flag in ["--min-weight", "--link-error"] {
            let message = refused(&["bake", "a.obj", "-o", "a.hlf", flag, value]);
            assert!(message.contains(flag), "{message}");
        }
        let message = refused(&["shot", "a.hlf", "-o", "a.png", "--fov", value, "--eye", "0,0,0", "--target", "1,0,0"]);
        assert!(message.contains("--fov"), "{message}");
        let message = refused(&["shot", "a.hlf", "-o", "a.png", "--compare", "b.png", "--max-error", value]);
        assert!(message.contains("--max-error"), "{message}");
    }
    assert!(refused(&["bake", "a.obj", "-o", "a.hlf", "--link-error", "0"]).contains("more than 0"));
    for value in ["0x0", "640", "640x", "x480", "640x-480", "-640x480", "0x480", "99999x2", "1e3x1e3", "640x480x1"] {
        assert!(refused(&["shot", "a.hlf", "-o", "a.png", "--size", value]).contains("640x480"));
    }
    for value in ["0", "180", "-60", "400"] {
        let message = refused(&["shot", "a.hlf", "-o", "a.png", "--eye", "0,0,0", "--target", "1,0,0", "--fov", value]);
        assert!(message.contains("between 0 and 180"), "{message}");
    }
    for value in ["1,2", "1,2,3,4", "1,2,nan", "a,b,c", ""] {
        let message = refused(&["shot", "a.hlf", "-o", "a.png", "--target", "0,0,0", "--eye", value]);
        assert!(message.contains("--eye"), "{message}");
    }
    for value in ["bright", "nan", "1e9"] {
        assert!(refused(&["shot", "a.hlf", "-o", "a.png", "--exposure", value]).contains("--exposure"));
    }
    assert!(refused(&["shot", "a.hlf", "-o", "a.jpg"]).contains(".png or .exr"));
    assert!(refused(&["shot", "a.hlf", "-o", "a.png", "--mode", "pretty"]).contains("shaded"));
    assert!(refused(&["shot", "a.hlf", "-o", "a.png", "--eye", "0,0,0"]).contains("--target"));
    assert!(refused(&["shot", "a.hlf", "-o", "a.png", "--compare", "b.png"]).contains("--max-error"));
    assert!(refused(&["bake", "a.obj", "-o", "a.hlf", "--bounces", "-1"]).contains("--bounces"));
    assert!(refused(&["bake", "a.obj", "-o", "a.hlf", "--weight", "heavy"]).contains("ratio, change"));
    assert!(refused(&["bake", "a.obj"]).contains("--output"));
    for value in ["0", "-0.01", "1", "nan", "1e-5"] {
        assert!(refused(&["bake", "a.obj", "-o", "a.hlf", "--tolerance", value]).contains("--tolerance"));
    }
}

#[test]
fn what_cannot_be_verified_is_refused_by_the_name_of_its_flag() {
    for value in ["0", "1", "-0.01", "nan", "1e999", "much"] {
        assert!(refused(&["verify", "a.hlf", "--tolerance", value]).contains("--tolerance"), "{value}");
    }
    for value in ["0", "-5", "99", "1e3", "9999999999"] {
        assert!(refused(&["verify", "a.hlf", "--points", value]).contains("--points"), "{value}");
    }
    for value in ["0", "-1", "99999999"] {
        assert!(refused(&["verify", "a.hlf", "--samples", value]).contains("--samples"), "{value}");
        assert!(refused(&["probe", "a.hlf", "--points", "a.csv", "--samples", value]).contains("--samples"));
    }
    assert!(refused(&["verify", "a.hlf", "--picture", "a.exr"]).contains(".png"));
    assert!(refused(&["verify", "a.hlf", "--seed", "-1"]).contains("'-1'"));
}

#[test]
fn a_free_camera_needs_a_direction_and_an_up_across_it() {
    let usage = |arguments: &[&str]| {
        let error = shot(arguments).camera.viewpoint().expect_err("no camera");
        error.downcast_ref::<Usage>().expect("wrong usage").to_string()
    };
    assert!(usage(&["--eye", "1,2,3", "--target", "1,2,3"]).contains("--eye and --target"));
    assert!(usage(&["--eye", "0,0,0", "--target", "0,0,5"]).contains("--up"));
    assert!(usage(&["--eye", "0,0,0", "--target", "1,0,0", "--up", "0,0,0"]).contains("--up"));
}

#[test]
fn what_is_given_is_what_is_meant() {
    let flags = shot(&["--eye", "-1,2,3", "--target", "-4, 5,6", "--fov", "90", "--size", "3X2", "--exposure", "-1.5"]);
    let Viewpoint::Free(camera) = flags.camera.viewpoint().unwrap() else { unreachable!("a free camera") };
    assert_eq!(camera.eye, DVec3::new(-1.0, 2.0, 3.0));
    assert_eq!(camera.target, DVec3::new(-4.0, 5.0, 6.0));
    assert_eq!(camera.up, DVec3::Z);
    assert!((camera.vertical_fov - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!(flags.size, (3, 2));
    assert_eq!(flags.exposure, ExposureChoice::Fixed(Exposure { ev: -1.5 }));
    assert_eq!(shot(&[]).camera.viewpoint().unwrap(), Viewpoint::Default);
    assert_eq!(shot(&["--camera", "door"]).camera.viewpoint().unwrap(), Viewpoint::Named("door".into()));
    assert_eq!(shot(&["--mode", "elements"]).mode, Mode::Elements);
}
