//! Opening files that are read to their end. A FIFO or a socket that nobody writes to, or a device, would never
//! come to one: they are refused by their kind, before anything waits for them.
//!
//! glTF and USD files are folders here: what they have within can be opened by paths that lead into them. A MaterialX
//! document is a source to those who ask for one.

use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use impasto_compiler::source::Origin;

mod file;
mod folder;
pub mod gltf;
pub mod mtlx;
mod names;
mod shown;
mod stamp;
pub mod usd;

use folder::SCENE;

pub use file::{is_transient, reason};
pub(crate) use folder::inside;

/// Opens the file at `path` for reading.
///
/// # Errors
/// If it cannot be opened, or is neither a file nor standard input.
pub fn open(path: &Path) -> io::Result<File> {
    let Some(bytes) = member(path) else {
        return file::open(path);
    };
    let mut copy = tempfile::tempfile()?;
    copy.write_all(&bytes?)?;
    copy.rewind()?;
    Ok(copy)
}

/// The contents of the file at `path`.
///
/// # Errors
/// As [`open`], or if it cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    member(path).unwrap_or_else(|| file::read(path))
}

/// The text of the file at `path`.
///
/// # Errors
/// As [`read`], or if it is not UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// A source that was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Its text, if it is one.
    pub bytes: Vec<u8>,
    /// What it was made from, if it was.
    pub origin: Option<Arc<Origin>>,
}

impl From<Vec<u8>> for Source {
    fn from(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            origin: None,
        }
    }
}

/// The text of the source at `path`, as [`at_most`] reads it, or of what the MaterialX document there becomes.
///
/// # Errors
/// As [`open`], or if it cannot be read or imported.
pub fn source(path: &Path, most: usize) -> io::Result<Source> {
    if mtlx::is_document(path) {
        return mtlx::source(path, &mut mtlx::Disk);
    }
    Ok(at_most(open(path)?, most)?.into())
}

/// What can be read, but for what is more than one byte beyond `most`: so one sees that it is too long.
///
/// # Errors
/// It cannot be read.
pub fn at_most(from: impl Read, most: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(most as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The file on disk that holds what `path` names: that itself, or the glTF or USD file that it leads into.
pub fn on_disk(path: &Path) -> &Path {
    inside(path, is_folder).map_or(path, |(file, _)| file)
}

/// Where the scene is that `path` names: a scene file, or the scene in a glTF or USD file.
pub fn scene(path: &Path) -> PathBuf {
    if gltf::is_folder(path) || usd::is_named_so(path) {
        path.join(SCENE)
    } else {
        path.to_owned()
    }
}

/// Does the extension say that the file is a folder here?
pub fn is_folder(path: &Path) -> bool {
    gltf::is_named_so(path) || usd::is_named_so(path)
}

/// What `path` names within a file that is a folder; none if it leads into none.
fn member(path: &Path) -> Option<io::Result<Vec<u8>>> {
    let (file, name) = inside(path, is_folder)?;
    Some(if gltf::is_named_so(file) {
        gltf::member(file, name)
    } else {
        usd::member(file, name)
    })
}
