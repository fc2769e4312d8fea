//! A GLB file: a valid scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("scene.glb");
    std::fs::write(&path, bytes).expect("the folder is writable");
    if let Ok(imported) = formats::read_scene(&path) {
        imported.scene.validate().expect("what is imported is valid");
    }
});
