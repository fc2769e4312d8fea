//! A page that walks through a bake in a browser: files that any server of files can serve, and nothing to build.
//!
//! The page is plain JavaScript; what it draws with are the shaders of the native passes ([`forward_pass`]), and what
//! it draws are the same records, uploaded as they come.

mod forward_pass;
mod head;

use bytemuck::cast_slice;
use scene::Baked;

use crate::{Mode, twin::Twin};
use forward_pass::Translator;
use head::{Array, Head};

/// The file of a page that says what the page holds: one JSON object, whose `files` are the names of all of them.
pub const HEAD_FILE: &str = "bake.json";

/// The file under which the page offers the bake itself; whoever writes the page adds it.
pub const BAKE_FILE: &str = "bake.hlf";

/// The records of the bake, arrays of little-endian numbers one after another.
const RECORDS_FILE: &str = "bake.bin";

/// What is the same in every page.
const PAGE: [(&str, &str); 9] = [
    ("index.html", include_str!("web/page/index.html")),
    ("bake.js", include_str!("web/page/bake.js")),
    ("camera.js", include_str!("web/page/camera.js")),
    ("flight.js", include_str!("web/page/flight.js")),
    ("hands.js", include_str!("web/page/hands.js")),
    ("pick.js", include_str!("web/page/pick.js")),
    ("walk.js", include_str!("web/page/walk.js")),
    ("webgl2.js", include_str!("web/page/webgl2.js")),
    ("webgpu.js", include_str!("web/page/webgpu.js")),
];

/// A file of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageFile {
    /// Its name in the page's folder; slashes are between folders.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// The files of a page that walks through a bake that validates, which is called `name`; all but [`BAKE_FILE`].
///
/// The same bake gives the same bytes.
pub fn web_page(baked: &Baked, name: &str) -> Vec<PageFile> {
    let twin = Twin::new(baked);
    let mut head = Head::new(baked, &twin, name);
    let mut files = Vec::new();
    let mut add = |name: &str, bytes: Vec<u8>| files.push(PageFile { name: name.to_owned(), bytes });
    for (name, text) in PAGE {
        add(name, text.into());
    }
    add("shaders/forward.wgsl", forward_pass::WEBGPU.into());
    let translator = Translator::new(head.textured);
    add("shaders/corner.vert", translator.vertex().into());
    for mode in Mode::ALL {
        add(&format!("shaders/{mode}.frag"), translator.fragment(mode).into());
    }
    let records = &twin.records;
    let arrays: [(&str, &[u32]); 4] = [
        ("triangles", cast_slice(&records.triangles)),
        ("elements", cast_slice(&records.elements)),
        ("corners", cast_slice(&records.corners)),
        ("textures", cast_slice(&records.textures)),
    ];
    let mut bytes = Vec::new();
    for (name, array) in arrays {
        head.arrays.push(Array { name, offset: bytes.len(), bytes: size_of_val(array) });
        bytes.extend(array.iter().flat_map(|word| word.to_le_bytes()));
    }
    add(RECORDS_FILE, bytes);
    let names = files.iter().map(|file| file.name.as_str()).chain([BAKE_FILE, HEAD_FILE]);
    head.files = names.map(str::to_owned).collect();
    let head = serde_json::to_vec_pretty(&head).expect("a head is a plain structure");
    files.push(PageFile { name: HEAD_FILE.to_owned(), bytes: head });
    files
}

#[cfg(test)]
mod tests;
