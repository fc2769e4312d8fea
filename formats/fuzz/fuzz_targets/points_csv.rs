//! A table of points: an error, or points that come back from what is written of them.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("points.csv");
    std::fs::write(&path, bytes).expect("the folder is writable");
    if let Ok(queries) = formats::read_points(&path) {
        let mut text = Vec::new();
        formats::write_irradiance(&mut text, &queries, &vec![None; queries.len()], None).expect("memory takes it");
        std::fs::write(&path, text).expect("the folder is writable");
        assert_eq!(formats::read_points(&path).expect("what was written can be read"), queries);
    }
});
