//! MaterialX documents as sources: whoever reads a source may read a document, and has what an artist would have written
//! in its place. Pictures stay where they are.

use std::io;
use std::path::Path;

use impasto_import::{Files, ImportError, Options};

use super::reason;

/// Does the extension say that it is a MaterialX document?
pub fn is_document(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("mtlx"))
}

/// The source that the document at `path` becomes.
///
/// # Errors
/// What keeps it from being imported whole.
pub(super) fn source(path: &Path) -> io::Result<String> {
    let path = path.to_string_lossy();
    let imported = impasto_import::import(&path, &mut Disk, &Options::default());
    imported
        .map(|imported| imported.in_place(&path))
        .map_err(|errors| {
            // Whoever reads it tells its name.
            let own = format!("{path}:");
            let said = |error: &ImportError| {
                let text = error.to_string();
                match text.strip_prefix(&own) {
                    Some(rest) if error.line.is_some() => format!("line {rest}"),
                    Some(rest) => rest.trim_start().to_owned(),
                    None => text,
                }
            };
            let all: Vec<String> = errors.iter().map(said).collect();
            io::Error::other(all.join("\n"))
        })
}

/// Files of the disk, for importers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Files for Disk {
    fn read(&mut self, path: &str, most: usize) -> Result<Vec<u8>, String> {
        let read = super::open(Path::new(path)).and_then(|file| super::at_most(file, most));
        read.map_err(|e| reason(&e))
    }

    fn exists(&mut self, path: &str) -> bool {
        Path::new(path).is_file()
    }
}
