//! What files that are folders have in common: how paths lead into them, and what their members are called.

use std::path::Path;

use crate::error::SceneError;

/// The scene in a file.
pub(super) const SCENE: &str = "scene.toml";

/// Does the path have one of these extensions?
pub(super) fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| extensions.contains(&e.to_ascii_lowercase().as_str()))
}

/// The file that `path` leads into, which is named so, and the name of the member there; none if it leads into no such
/// file.
pub(crate) fn inside(path: &Path, is_named_so: fn(&Path) -> bool) -> Option<(&Path, &Path)> {
    let mut parents = path.ancestors().skip(1).filter(|file| is_named_so(file));
    let file = parents.find(|file| file.is_file())?;
    Some((file, path.strip_prefix(file).ok()?))
}

/// The number of a member of that folder in the file: 3 of `meshes/3.gltf`, where members end with `.gltf`.
pub(super) fn numbered(name: &Path, folder: &str, end: &str) -> Option<usize> {
    let within = name.strip_prefix(folder).ok()?.to_str()?;
    within.strip_suffix(end)?.parse().ok()
}

/// What is wrong with a file, for whoever tells its name.
pub(super) fn said(error: SceneError) -> String {
    let line = error.line.map(|line| format!("line {line}: "));
    let hint = error.hint.map(|hint| format!("\n  hint: {hint}"));
    format!(
        "{}{}{}",
        line.unwrap_or_default(),
        error.message,
        hint.unwrap_or_default()
    )
}
