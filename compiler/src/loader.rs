//! How the compiler gets at files: through a [`Loader`] that its caller gives, and the library's out
//! of the program.

use std::collections::BTreeMap;

use crate::diag;

/// Reads files for the compiler.
pub trait Loader {
    /// The bytes of the file at `path`, a name from a request or an import.
    ///
    /// # Errors
    /// Why the file cannot be read, in words for people.
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String>;

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
        let all: Vec<String> = impasto_stdlib::files()
            .iter()
            .map(|f| format!("{}::{}", f.folder, f.name))
            .collect();
        match diag::nearest(path, all.iter().map(String::as_str)) {
            Some(near) => format!("no such module of the library; did you mean `std::{near}`?"),
            None => "no such module of the library; write `std::folder::name`".into(),
        }
    }))
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
