//! A `.hlf` file: an error, or a bake, interrupted or not, that comes back from its own bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("bake.hlf");
    std::fs::write(&path, bytes).expect("the folder is writable");
    if let Ok((baked, unfinished)) = formats::read_unfinished(&path) {
        match &unfinished {
            Some(unfinished) => formats::write_unfinished(&path, &baked, unfinished),
            None => formats::write_baked(&path, &baked),
        }
        .expect("what was read can be written");
        assert_eq!(formats::read_unfinished(&path).expect("what was written can be read"), (baked, unfinished));
    }
});
