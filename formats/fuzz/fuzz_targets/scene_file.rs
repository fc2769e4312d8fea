//! A scene file over one model, `a.obj`, with two materials, `a` and `b`: a valid scene or an error, read either way.
#![no_main]

use formats::Sides;
use libfuzzer_sys::fuzz_target;

const MTL: &str = "newmtl a\nKd 0.5 0.5 0.5\nnewmtl b\nKd 0 0 0\nKe 1 2 3\n";
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\n\
                   usemtl a\nf 1 2 3 4\nf 1 2 6 5\nusemtl b\nf 7 6 5\n# camera eye 3 3 3 dir -1 -1 -1 up 0 0 1 fov_deg 60\n";

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("the folder is writable");
        path
    };
    write("a.obj", OBJ.as_bytes());
    write("a.mtl", MTL.as_bytes());
    let path = write("scene.toml", bytes);
    for sides in [Sides::AsWound, Sides::Both] {
        if let Ok(imported) = formats::read_scene_as(&path, sides) {
            imported.scene.validate().expect("what is imported is valid");
        }
    }
});
