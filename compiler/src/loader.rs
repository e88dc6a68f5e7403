//! How the compiler gets at files: through a [`Loader`] that its caller gives, and the library's out
//! of the program.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::diag;
use crate::source::Origin;

/// Reads files for the compiler.
pub trait Loader {
    /// The bytes of the file at `path`, a name from a request or an import.
    ///
    /// # Errors
    /// Why the file cannot be read, in words for people.
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String>;

    /// What the text that [`Loader::load`] gave of `path` was made from; nothing for what was written as it is.
    fn origin(&mut self, path: &str) -> Option<Arc<Origin>> {
        let _ = path;
        None
    }

    /// Paths of the sources in the folder of `path`, in the order of their names: for hints at what
    /// a missing file may be. None where that is not known.
    fn beside(&mut self, path: &str) -> Vec<String> {
        let _ = path;
        Vec::new()
    }
}

/// The text of a module of the standard library by its path, such as `std::surface::open_pbr`;
/// nothing if the path is that of a file. Materials are named by either.
///
/// # Errors
/// There is no such module; in words for people.
pub fn library_text(path: &str) -> Option<Result<&'static str, String>> {
    let path = path.strip_prefix("std::")?;
    let found = path
        .split_once("::")
        .and_then(|(folder, name)| impasto_stdlib::file(folder, name));
    Some(found.map(|f| f.text).ok_or_else(|| {
        let hint = library_hint(path);
        format!("no such module of the library; {hint}")
    }))
}

/// What a path that names no module of the library may mean, or what there is instead. Folder and name are compared
/// each for itself: of a whole path the folder, which is right, would make any name near.
fn library_hint(path: &str) -> String {
    let files = impasto_stdlib::files;
    let mut folders: Vec<&str> = files().iter().map(|f| f.folder).collect();
    folders.dedup();
    let Some((folder, name)) = path.split_once("::") else {
        return match (
            folders.contains(&path),
            files().iter().find(|f| f.name == path),
        ) {
            (true, _) => there_is(path),
            (false, Some(file)) => format!("did you mean `std::{}::{path}`?", file.folder),
            (false, None) => "write `std::folder::name`".into(),
        };
    };
    if let Some(folder) = diag::nearest(folder, folders.iter().copied()) {
        let names = files().iter().filter(|f| f.folder == folder);
        if let Some(near) = diag::nearest(name, names.map(|f| f.name)) {
            return format!("did you mean `std::{folder}::{near}`?");
        }
    }
    if let Some(file) = files().iter().find(|f| f.name == name) {
        return format!("did you mean `std::{}::{name}`?", file.folder);
    }
    if folders.contains(&folder) {
        there_is(folder)
    } else {
        format!("there are the folders `{}`", folders.join("`, `"))
    }
}

/// Which modules a folder of the library has.
fn there_is(folder: &str) -> String {
    /// Names beyond these are only counted.
    const SHOWN: usize = 12;
    let files = impasto_stdlib::files();
    let names: Vec<&str> = files
        .iter()
        .filter(|f| f.folder == folder)
        .map(|f| f.name)
        .collect();
    let shown = names[..names.len().min(SHOWN)].join("`, `");
    let more = match names.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("`std::{folder}` has `{shown}`{more}")
}

/// Files kept in memory, for tests and tools.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader {
    files: BTreeMap<String, Vec<u8>>,
}

impl MemoryLoader {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<String>, text: impl Into<Vec<u8>>) {
        self.files.insert(path.into(), text.into());
    }
}

impl Loader for MemoryLoader {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        self.files
            .get(path)
            .cloned()
            .ok_or_else(|| "no such file".into())
    }

    fn beside(&mut self, path: &str) -> Vec<String> {
        let folder = |p: &str| p.rfind('/').map_or(0, |slash| slash + 1);
        let here = |p: &&String| p[..folder(p)] == path[..folder(path)];
        self.files.keys().filter(here).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_that_is_not_there_is_answered_with_a_near_one_or_with_all() {
        for (path, said) in [
            ("std::bsdf::difuse", "did you mean `std::bsdf::diffuse`?"),
            ("std::bsdff::diffuse", "did you mean `std::bsdf::diffuse`?"),
            ("std::edf::diffuse", "did you mean `std::bsdf::diffuse`?"),
            ("std::diffuse", "did you mean `std::bsdf::diffuse`?"),
            (
                "std::surface::nothing",
                "; `std::surface` has `absorption`, `clear_glass`,",
            ),
            ("std::bsdf::zzzzzzz", " more"),
            ("std::surface", "; `std::surface` has `absorption`,"),
            ("std::nowhere::nothing", "there are the folders `bsdf`, "),
            ("std::nothing", "write `std::folder::name`"),
        ] {
            let message = library_text(path).expect("of the library");
            let message = message.expect_err("there is none");
            assert!(message.contains(said), "{path}: {message}");
            assert_eq!(message.matches("; ").count(), 1, "{message}");
        }
    }
}
