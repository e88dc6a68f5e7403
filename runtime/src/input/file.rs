//! Plain files, opened by their kind, and why they cannot be.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Standard input by its name as a file, and what a shell puts for `<(command)`: whoever names one of these means
/// to wait for it.
const STREAMS: [&str; 2] = ["/dev/stdin", "/dev/fd"];

/// Opens the file at `path` for reading.
///
/// # Errors
/// If it cannot be opened, or is neither a file nor standard input.
pub(super) fn open(path: &Path) -> io::Result<File> {
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
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
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
