use serde_json::Value;

use super::*;
use crate::test_room::{room, room_under_sky, textured_room};

fn file<'a>(files: &'a [PageFile], name: &str) -> &'a [u8] {
    &files.iter().find(|file| file.name == name).expect(name).bytes
}

fn head(files: &[PageFile]) -> Value {
    serde_json::from_slice(file(files, HEAD_FILE)).expect("the head is JSON")
}

/// The words of an array, as the page finds them.
fn array(files: &[PageFile], name: &str) -> Vec<u32> {
    let head = head(files);
    let array = head["arrays"].as_array().and_then(|arrays| arrays.iter().find(|array| array["name"] == name));
    let number = |key: &str| array.and_then(|array| array[key].as_u64()).expect(name) as usize;
    let bytes = &file(files, RECORDS_FILE)[number("offset")..][..number("bytes")];
    bytes.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect()
}

#[test]
fn an_empty_bake_has_a_page() {
    let files = web_page(&Baked::default(), "");
    let head = head(&files);
    assert_eq!(head["triangles"], 0);
    assert!(head["overview"]["eye"].as_array().is_some_and(|eye| eye.iter().all(Value::is_f64)), "{head}");
    assert!(file(&files, RECORDS_FILE).is_empty());
}

#[test]
fn the_head_names_every_file_once() {
    let files = web_page(&room(), "room");
    let names = head(&files)["files"].as_array().cloned().unwrap_or_default();
    let mut named: Vec<&str> = names.iter().filter_map(Value::as_str).filter(|&name| name != BAKE_FILE).collect();
    let mut there: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    named.sort_unstable();
    there.sort_unstable();
    assert_eq!(named, there);
    there.dedup();
    assert_eq!(there.len(), files.len());
}

#[test]
fn the_arrays_are_the_records() {
    for (baked, is_textured) in [(room(), false), (textured_room(), true), (room_under_sky(), false)] {
        let files = web_page(&baked, "room");
        let records = crate::records::Records::of(&baked);
        assert_eq!(array(&files, "triangles"), cast_slice::<_, u32>(&records.triangles));
        assert_eq!(array(&files, "elements"), cast_slice::<_, u32>(&records.elements));
        assert_eq!(array(&files, "corners"), cast_slice::<_, u32>(&records.corners));
        assert_eq!(array(&files, "textures"), records.textures);
        assert_eq!((&head(&files)["textured"], &head(&files)["sky"]), (&is_textured.into(), &records.sky.into()));
        assert_eq!(records.sky != 0, baked.scene.environment.is_some());
        assert_eq!(files, web_page(&baked, "room"), "the same bake gives the same bytes");
    }
}

/// What the page's scripts import, and what the page links to, is there.
#[test]
fn the_page_refers_to_its_own_files_alone() {
    let files = web_page(&room(), "room");
    let text = |name: &str| String::from_utf8_lossy(file(&files, name)).into_owned();
    for (name, _) in PAGE {
        let text = text(name);
        for imported in text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(files.iter().any(|file| file.name == imported), "{name} imports {imported}");
        }
        assert!(!text.contains("https://"), "{name} refers to another server");
    }
    assert!(text("index.html").contains("src=\"walk.js\"") && text("index.html").contains(BAKE_FILE));
}

/// What a page loads before the bake: it must stay small.
#[test]
fn the_page_is_small() {
    let bytes: usize = PAGE.iter().map(|(_, text)| text.len()).sum();
    assert!(bytes < 48 << 10, "{bytes}");
}
