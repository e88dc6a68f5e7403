//! Files that a command makes: all of them or none, and never over somebody else's.

use std::path::{Path, PathBuf};

use impasto::files::{reason, write_whole};
use impasto::runtime::input;

use super::{Failure, Outcome};

/// What stands for the number of a tile in the name of a picture.
const TILES: [&str; 2] = ["<UDIM>", "<UVTILE>"];

/// Files with their contents.
#[derive(Default)]
pub(super) struct Made(Vec<(PathBuf, Vec<u8>)>);

impl Made {
    pub(super) fn add(&mut self, path: PathBuf, bytes: Vec<u8>) {
        self.0.push((path, bytes));
    }

    /// Copies a picture, or the tiles of one, to `written`. Is there any?
    pub(super) fn copy(&mut self, found: &str, written: &Path) -> bool {
        let is_tiled = TILES.iter().any(|tile| found.contains(tile));
        let copies: Vec<(PathBuf, PathBuf)> = if is_tiled {
            tiles_of(Path::new(found), written)
        } else {
            vec![(found.into(), written.into())]
        };
        let before = self.0.len();
        for (found, written) in copies {
            if let Ok(bytes) = input::read(&found) {
                self.add(written, bytes);
            }
        }
        self.0.len() > before
    }

    /// Writes all, unless something else is there already.
    pub(super) fn write(&mut self) -> Outcome {
        self.0.sort();
        self.0.dedup();
        for (path, bytes) in &self.0 {
            let is_other = std::fs::read(path).is_ok_and(|own| own != *bytes);
            if is_other {
                let path = path.display();
                return Err(Failure::Error(format!(
                    "`{path}` is there already, and is another file; nothing was written\n  \
                     hint: name another place by `--out`, or remove it"
                )));
            }
        }
        for (path, bytes) in &self.0 {
            let folder = path.parent().unwrap_or(Path::new(""));
            std::fs::create_dir_all(folder).map_err(|e| {
                let (folder, why) = (folder.display(), reason(&e));
                Failure::Error(format!("cannot make the folder `{folder}`: {why}"))
            })?;
            write_whole(path, bytes)?;
        }
        Ok(())
    }

    /// The paths of all.
    pub(super) fn paths(&self) -> Vec<String> {
        let paths = self.0.iter();
        paths.map(|(path, _)| path.display().to_string()).collect()
    }

    /// `1 file`, `2 files`.
    pub(super) fn count(&self) -> String {
        super::count(self.0.len(), "file")
    }
}

/// The tiles of a picture that are there, and where copies of them go.
fn tiles_of(found: &Path, written: &Path) -> Vec<(PathBuf, PathBuf)> {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let (pattern, copy) = (name(found), name(written));
    let split = |name: &str| {
        let parts = TILES.iter().find_map(|tile| name.split_once(tile));
        parts.map(|(before, after)| (before.to_owned(), after.to_owned()))
    };
    let (Some((before, after)), Some((first, last))) = (split(&pattern), split(&copy)) else {
        return Vec::new();
    };
    let folder = found.parent().unwrap_or(Path::new(""));
    let Ok(entries) = std::fs::read_dir(Path::new(".").join(folder)) else {
        return Vec::new();
    };
    let into = written.parent().unwrap_or(Path::new(""));
    let names = entries
        .flatten()
        .filter_map(|e| e.file_name().into_string().ok());
    let tile = |name: String| {
        let middle = name.strip_prefix(&before)?.strip_suffix(&after)?;
        let is_tile = |n: &str| n.bytes().all(|b| b.is_ascii_digit() || b"uv_".contains(&b));
        let copy = format!("{first}{middle}{last}");
        (!middle.is_empty() && is_tile(middle)).then(|| (folder.join(&name), into.join(copy)))
    };
    names.filter_map(tile).collect()
}
