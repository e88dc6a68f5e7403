//! Opening files that are read to their end. A FIFO or a socket that nobody writes to, or a device, would never
//! come to one: they are refused by their kind, before anything waits for them.
//!
//! A glTF file is a folder here: what it has within can be opened by paths that lead into it. A MaterialX document is a
//! source to those who ask for one.

use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

mod file;
pub mod gltf;
pub mod mtlx;

pub use file::{is_transient, reason};

/// Opens the file at `path` for reading.
///
/// # Errors
/// If it cannot be opened, or is neither a file nor standard input.
pub fn open(path: &Path) -> io::Result<File> {
    let Some((file, member)) = gltf::inside(path) else {
        return file::open(path);
    };
    let mut copy = tempfile::tempfile()?;
    copy.write_all(&gltf::member(file, member)?)?;
    copy.rewind()?;
    Ok(copy)
}

/// The contents of the file at `path`.
///
/// # Errors
/// As [`open`], or if it cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    match gltf::inside(path) {
        Some((file, member)) => gltf::member(file, member),
        None => file::read(path),
    }
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

/// The text of the source at `path`, as [`at_most`] reads it, or of what the MaterialX document there becomes.
///
/// # Errors
/// As [`open`], or if it cannot be read or imported.
pub fn source(path: &Path, most: usize) -> io::Result<Vec<u8>> {
    if mtlx::is_document(path) {
        return mtlx::source(path).map(String::into_bytes);
    }
    at_most(open(path)?, most)
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

/// The file on disk that holds what `path` names: that itself, or the glTF file that it leads into.
pub fn on_disk(path: &Path) -> &Path {
    gltf::inside(path).map_or(path, |(file, _)| file)
}

/// Where the scene is that `path` names: a scene file, or the scene in a glTF file.
pub fn scene(path: &Path) -> PathBuf {
    if gltf::is_folder(path) {
        path.join(gltf::SCENE)
    } else {
        path.to_owned()
    }
}
