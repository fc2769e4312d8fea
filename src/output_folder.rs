//! A folder that the program writes: checked before the work, there whole or not at all, and never over what somebody
//! else put there.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use viewer::HEAD_FILE;

use crate::output::Outputs;

/// A place for a page's folder that could be written to when it was claimed.
pub struct OutputFolder {
    path: PathBuf,
    outputs: Outputs,
}

impl OutputFolder {
    /// Checks that a folder can be made at `path`, without making it. What may be there already is an empty folder, or
    /// a page of ours, whose head names every file in it.
    pub fn claim(path: &Path, outputs: &Outputs) -> Result<Self> {
        // A link stays, and what it leads to is written.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let shown = path.display();
        if path.file_name().is_none() {
            bail!("{shown}: names no folder to write; give one");
        }
        if path.exists() {
            if !path.is_dir() {
                bail!("{shown}: is a file, and a folder is to be written; name another");
            }
            let foreign =
                foreign_files(&path).with_context(|| format!("{shown}: cannot be read; check its permissions"))?;
            if let Some(foreign) = foreign.first() {
                bail!(
                    "{shown}: holds {foreign}, which is no part of an exported page, and nothing of it shall be lost; \
                     name a new folder or an empty one"
                );
            }
        }
        let parent = parent_of(&path);
        tempfile::tempfile_in(parent).with_context(|| {
            format!("{shown}: cannot be written; check that {} is a folder and writable", parent.display())
        })?;
        Ok(Self { path, outputs: outputs.clone() })
    }

    /// Writes the folder under a temporary name, and then puts it in its place. `fill` makes the files.
    pub fn write(&self, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let _held = self.outputs.hold();
        let parent = parent_of(&self.path);
        let failed = || format!("{}: cannot be written; check that {} has room", self.path.display(), parent.display());
        let mut builder = tempfile::Builder::new();
        builder.prefix(".halflight-").suffix(".tmp");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // A server that is another user reads the page. The default is private.
            builder.permissions(fs::Permissions::from_mode(0o777));
        }
        let made = builder.tempdir_in(parent).with_context(failed)?;
        fill(made.path())?;
        // The folder before goes with the value, once the new one is in its place.
        let before =
            tempfile::Builder::new().prefix(".halflight-").suffix(".tmp").tempdir_in(parent).with_context(failed)?;
        let aside = before.path().join("before");
        if self.path.exists() {
            fs::rename(&self.path, &aside).with_context(failed)?;
        }
        if let Err(error) = fs::rename(made.path(), &self.path) {
            if aside.exists() {
                fs::rename(&aside, &self.path).with_context(failed)?;
            }
            return Err(error).with_context(failed);
        }
        Ok(())
    }
}

/// Writes a file of the folder, and waits until the disk has it.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || {
        fs::create_dir_all(parent_of(path))?;
        let mut file = fs::File::create(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    };
    write().with_context(|| format!("{}: cannot be written; check that its disk has room", path.display()))
}

fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Files below a folder that no page of ours has put there, by their names in it.
fn foreign_files(folder: &Path) -> std::io::Result<Vec<String>> {
    let ours = names_in_head(&folder.join(HEAD_FILE)).unwrap_or_default();
    let mut foreign = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(inner) = folders.pop() {
        for entry in fs::read_dir(inner)? {
            let path = entry?.path();
            // A link to a folder is a file here: what it leads to is not ours.
            if path.is_dir() && !path.is_symlink() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            if !ours.contains(&name) {
                foreign.push(name);
            }
        }
    }
    foreign.sort_unstable();
    Ok(foreign)
}

/// The files that the head of a page names; none where it is no such head.
fn names_in_head(head: &Path) -> Option<BTreeSet<String>> {
    let head: serde_json::Value = serde_json::from_slice(&fs::read(head).ok()?).ok()?;
    head["files"].as_array()?.iter().map(|name| name.as_str().map(str::to_owned)).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn refused(path: &Path) -> String {
        format!("{:#}", OutputFolder::claim(path, &Outputs::default()).err().expect("refused"))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// A page of a head and one more file.
    fn page(path: &Path, content: &str) -> Result<()> {
        OutputFolder::claim(path, &Outputs::default())?.write(|folder| {
            write_file(&folder.join("inner/page"), content.as_bytes())?;
            write_file(&folder.join(HEAD_FILE), br#"{"files": ["inner/page", "bake.json"]}"#)
        })
    }

    #[test]
    fn what_cannot_be_written_is_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        assert!(refused(Path::new("")).contains("names no folder"));
        assert!(refused(&folder.path().join("missing/out")).contains("missing is a folder and writable"));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(refused(&folder.path().join("file")).contains("is a file"));
        assert!(refused(&folder.path().join("file/out")).contains("cannot be written"));
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn what_is_not_ours_is_never_lost() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        page(&out, "one").unwrap();
        fs::write(out.join("inner/thesis.txt"), "all of it").unwrap();
        assert!(refused(&out).contains("holds inner/thesis.txt"), "{}", refused(&out));
        fs::remove_file(out.join("inner/thesis.txt")).unwrap();
        fs::write(out.join(HEAD_FILE), "{}").unwrap();
        assert!(refused(&out).contains("holds bake.json"), "a head that names nothing makes no page");
    }

    #[test]
    fn a_page_is_written_whole_and_replaced_by_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        fs::create_dir(&out).unwrap();
        for content in ["one", "two"] {
            page(&out, content).unwrap();
            assert_eq!(fs::read_to_string(out.join("inner/page")).unwrap(), content);
            assert_eq!(names(folder.path()), ["out"]);
        }
        let claimed = OutputFolder::claim(&out, &Outputs::default()).unwrap();
        claimed.write(|_| bail!("half-way")).unwrap_err();
        assert_eq!(fs::read_to_string(out.join("inner/page")).unwrap(), "two");
        assert_eq!(names(folder.path()), ["out"]);
    }
}
