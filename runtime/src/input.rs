//! Opening files that are read to their end. A FIFO or a socket that nobody writes to, or a device, would never
//! come to one: they are refused by their kind, before anything waits for them.
//!
//! A glTF file is a folder here: what it has within can be opened by paths that lead into it.

use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::Path;

use crate::gltf;

/// Standard input by its name as a file, and what a shell puts for `<(command)`: whoever names one of these means
/// to wait for it.
const STREAMS: [&str; 2] = ["/dev/stdin", "/dev/fd"];

/// Opens the file at `path` for reading.
///
/// # Errors
/// If it cannot be opened, or is neither a file nor standard input.
pub fn open(path: &Path) -> io::Result<File> {
    if let Some((file, member)) = gltf::inside(path) {
        let mut copy = tempfile::tempfile()?;
        copy.write_all(&gltf::member(file, member, &read)?)?;
        copy.rewind()?;
        return Ok(copy);
    }
    let kind = std::fs::metadata(path)?.file_type();
    let is_stream = STREAMS.iter().any(|stream| path.starts_with(stream));
    // Reading a folder fails with an error of its own.
    if !kind.is_file() && !kind.is_dir() && !is_stream {
        return Err(io::Error::other(refusal(&kind)));
    }
    File::open(path)
}

/// The contents of the file at `path`.
///
/// # Errors
/// As [`open`], or if it cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    if let Some((file, member)) = gltf::inside(path) {
        return gltf::member(file, member, &read);
    }
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
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

/// The file on disk that holds what `path` names: that itself, or the glTF file that it leads into.
pub fn on_disk(path: &Path) -> &Path {
    gltf::inside(path).map_or(path, |(file, _)| file)
}

/// Where the scene is that `path` names: a scene file, or the scene in a glTF file.
pub fn scene(path: &Path) -> std::path::PathBuf {
    let extension = path.extension().and_then(|e| e.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    if gltf::EXTENSIONS.contains(&extension.as_str()) {
        path.join(gltf::SCENE)
    } else {
        path.to_owned()
    }
}

/// May the same work on another try, or on another machine? A disk that is full may be emptied and a server may come
/// back; what is missing, forbidden or a folder stays so.
pub fn is_transient(error: &io::Error) -> bool {
    use io::ErrorKind::*;
    !matches!(
        error.kind(),
        NotFound
            | PermissionDenied
            | IsADirectory
            | NotADirectory
            | AlreadyExists
            | InvalidInput
            | InvalidFilename
            | Unsupported
            | FileTooLarge
            | ReadOnlyFilesystem
    )
}

/// An I/O error in a few words, without the operating system's number where the kind is clear.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file or folder".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        io::ErrorKind::IsADirectory => "it is a folder".into(),
        io::ErrorKind::NotADirectory => "a part of the path is not a folder".into(),
        io::ErrorKind::StorageFull => "no space left on the device".into(),
        io::ErrorKind::QuotaExceeded => "the quota of the disk is used up".into(),
        io::ErrorKind::FileTooLarge => "files may not become so large (`ulimit -f`)".into(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only".into(),
        _ => error.to_string(),
    }
}

#[cfg(unix)]
fn refusal(kind: &std::fs::FileType) -> String {
    use std::os::unix::fs::FileTypeExt;
    let name = if kind.is_fifo() {
        "a FIFO"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    };
    format!("it is {name}, which may never end; write it to a file first")
}

#[cfg(not(unix))]
fn refusal(_: &std::fs::FileType) -> String {
    "it is no file".into()
}
