//! `halflight export`: a bake as a page to walk through in a browser.

use anyhow::Result;
use serde::Serialize;
use viewer::{BAKE_FILE, web_page};

use crate::args::ExportFlags;
use crate::failure::Outcome;
use crate::input::Input;
use crate::output::Outputs;
use crate::output_folder::{OutputFolder, write_file};
use crate::report::print_json;

/// Writes the folder of the page.
pub fn run(flags: &ExportFlags, outputs: &Outputs) -> Result<Outcome> {
    let output = OutputFolder::claim(&flags.web, outputs)?;
    let input = Input::read(&flags.input, &flags.reading)?;
    let baked = input.into_baked(&flags.input, &Default::default(), outputs)?;
    let name = flags.input.file_stem().unwrap_or(flags.input.as_os_str()).to_string_lossy();
    let page = web_page(&baked, &name);
    let mut bytes = page.iter().map(|file| file.bytes.len() as u64).sum();
    output.write(|folder| {
        for file in &page {
            write_file(&folder.join(&file.name), &file.bytes)?;
        }
        let bake = folder.join(BAKE_FILE);
        formats::write_baked(&bake, &baked)?;
        bytes += bake.metadata()?.len();
        Ok(())
    })?;
    if flags.json {
        print_json(&ExportJson { files: page.len() + 1, bytes, triangles: baked.triangles.len() })?;
    }
    Ok(Outcome::Done)
}

/// What `export --json` prints.
#[derive(Serialize)]
struct ExportJson {
    /// Files of the page, the bake among them.
    files: usize,
    /// Bytes of all of them.
    bytes: u64,
    triangles: usize,
}
