//! The same input gives the same bytes, at any number of threads.

use crate::fixture::{cornell_box, data, folder, halflight, office, text};

fn same_bytes_at_any_number_of_threads(scene: &str, expected: &std::path::Path) {
    let folder = folder();
    let expected = std::fs::read(expected).unwrap();
    for threads in ["1", "4"] {
        let output = folder.path().join(threads).with_extension("hlf");
        let scene = data(&format!("scenes/{scene}.obj"));
        let mut command = halflight();
        command.args(["bake", text(&scene), "-o", text(&output)]).env("RAYON_NUM_THREADS", threads);
        command.assert().success();
        assert!(std::fs::read(&output).unwrap() == expected, "{threads} threads make another file");
    }
}

#[test]
fn the_cornell_box() {
    same_bytes_at_any_number_of_threads("cornell_box", cornell_box());
}

#[test]
fn the_office() {
    same_bytes_at_any_number_of_threads("office", office());
}
