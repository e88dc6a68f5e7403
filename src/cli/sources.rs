//! The files that arguments name: themselves, or what is below them if they are folders.

use std::fs;
use std::path::{Path, PathBuf};

use impasto::files::{self, STDIN};

/// How deep folders are searched.
const MAX_DEPTH: usize = 64;

/// The files that an argument names: itself, or those below it that are `wanted` if it is a folder.
pub(super) fn named(path: &str, wanted: impl Fn(&Path) -> bool) -> Result<Vec<String>, String> {
    if path == STDIN || !Path::new(path).is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut found = Vec::new();
    walk(Path::new(path), 0, &wanted, &mut found)?;
    found.sort();
    Ok(found)
}

/// Collects the files below `folder`. Hidden folders and links to folders are passed by.
fn walk(
    folder: &Path,
    depth: usize,
    wanted: &impl Fn(&Path) -> bool,
    found: &mut Vec<String>,
) -> Result<(), String> {
    let cannot = |error: &std::io::Error| {
        format!(
            "cannot read `{}`: {}",
            folder.display(),
            files::reason(error)
        )
    };
    if depth > MAX_DEPTH {
        return Err(format!("`{}` lies too deep", folder.display()));
    }
    for entry in fs::read_dir(folder).map_err(|e| cannot(&e))? {
        let entry = entry.map_err(|e| cannot(&e))?;
        let kind = entry.file_type().map_err(|e| cannot(&e))?;
        let path = entry.path();
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if kind.is_dir() && !hidden {
            walk(&path, depth + 1, wanted, found)?;
        } else if !kind.is_dir() && path.is_file() && wanted(&path) {
            found.push(shown(&path));
        }
    }
    Ok(())
}

/// A path as people write it: without a leading `./`.
fn shown(path: &Path) -> String {
    let path: PathBuf = path.strip_prefix(".").unwrap_or(path).into();
    path.display().to_string()
}
