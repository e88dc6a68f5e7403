//! MaterialX documents as sources: whoever reads a source may read a document, and has what an artist would have written
//! in its place. Pictures stay where they are, and diagnostics tell the document's lines.

use std::io;
use std::path::Path;
use std::sync::Arc;

use impasto_import::Options;
pub use impasto_import::{Files, ImportError};

use super::{Source, reason};

/// Does the extension say that it is a MaterialX document?
pub fn is_document(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("mtlx"))
}

/// The source that the document at `path` becomes. It is not compiled: whoever asked for it does that.
///
/// # Errors
/// All that keeps it from being imported whole.
pub fn imported(path: &Path, files: &mut dyn Files) -> Result<Source, Vec<ImportError>> {
    let options = Options {
        unchecked: true,
        in_place: true,
        ..Options::default()
    };
    let imported = impasto_import::import(&path.to_string_lossy(), files, &options)?;
    Ok(Source {
        bytes: imported.in_place().into_bytes(),
        origin: Some(Arc::new(imported.origin)),
    })
}

/// The same, for those who tell the document's name themselves.
///
/// # Errors
/// What keeps it from being imported whole, in words for people.
pub fn source(path: &Path, files: &mut dyn Files) -> io::Result<Source> {
    imported(path, files).map_err(|errors| {
        let own = format!("{}:", path.to_string_lossy());
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
