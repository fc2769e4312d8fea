//! An OBJ file with an MTL file behind a zero byte: a valid scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("scene.obj");
    let mut parts = bytes.splitn(2, |&byte| byte == 0);
    std::fs::write(&path, parts.next().unwrap_or_default()).expect("the folder is writable");
    std::fs::write(folder.path().join("a"), parts.next().unwrap_or_default()).expect("the folder is writable");
    if let Ok(imported) = formats::read_scene(&path) {
        imported.scene.validate().expect("what is imported is valid");
    }
});
