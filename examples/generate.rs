//! Writes a generated scene: `cargo run --release --example generate -- hall 24000 OUT.obj`, or `-- rooms 8 OUT.obj`.
//!
//! The number is that of polygons of the hall, of rooms, of faces around a round shape, of dominoes, of leaves or of bars. An MTL file
//! of the same name is written beside it.

#[path = "../benches/common/generated/mod.rs"]
mod generated;

use std::path::Path;

use anyhow::{Context, Result, bail};

/// Largest size: a hall of that many polygons takes some 10 GB of memory to write.
const LARGEST: u32 = 20_000_000;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [family, size, output] = arguments.as_slice() else {
        bail!(
            "give a family (hall, rooms, shapes, dominoes, plant, looking-glass or tori), a size and an .obj file to write"
        );
    };
    let size: u32 = size.parse().with_context(|| format!("{size:?} is not a size; write a whole number"))?;
    if size > LARGEST {
        bail!("a size of {size} is too much; give at most {LARGEST}");
    }
    let scene = match family.as_str() {
        "hall" => generated::hall(size),
        "rooms" => generated::rooms(size),
        "shapes" => generated::shapes(size),
        "dominoes" => generated::dominoes(size),
        "plant" => generated::plant(size),
        "looking-glass" => generated::looking_glass(size),
        "tori" => generated::tori(size),
        _ => {
            bail!("{family:?} is no family of scenes; give hall, rooms, shapes, dominoes, plant, looking-glass or tori")
        }
    };
    scene.validate().with_context(|| format!("a scene of that size is none; give less than {size}"))?;
    let obj = Path::new(output);
    let mtl = obj.with_extension("mtl");
    let library = mtl.file_name().context("the output is no file")?.to_string_lossy();
    let write = |path: &Path, text: String| {
        std::fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
    };
    write(&mtl, generated::mtl(&scene))?;
    write(obj, generated::obj(&scene, &library))
}
