//! The sources and scenes of the folders that a client works in.

use std::path::{Path, PathBuf};

/// Most files that are looked at.
const MOST: usize = 5000;
/// How deep folders nest.
const DEEPEST: usize = 16;

/// The files below some folders whose name ends in one of the `extensions`, in the order of their paths. Hidden folders
/// and those that programs write are left out.
pub fn below(roots: &[PathBuf], extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for root in roots {
        walk(root, extensions, DEEPEST, &mut found);
    }
    found.sort();
    found.dedup();
    found
}

fn walk(folder: &Path, extensions: &[&str], depth: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        if found.len() >= MOST {
            return;
        }
        let name = entry.file_name();
        let name = name.to_string_lossy();
        // Of links nobody knows where they lead.
        let Ok(kind) = entry.file_type() else {
            continue;
        };
        let is_left_out = name.starts_with('.') || ["target", "node_modules"].contains(&&*name);
        if kind.is_dir() && !is_left_out && depth > 0 {
            walk(&entry.path(), extensions, depth - 1, found);
        } else if kind.is_file() && extensions.iter().any(|e| name.ends_with(&format!(".{e}"))) {
            found.push(entry.path());
        }
    }
}
