//! Where source texts come from: the file system, with `-` for standard input.
//!
//! The compiler does no I/O of its own; it asks a [`Loader`] for every file it meets.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use impasto_compiler::source::MAX_SOURCE_BYTES;
use impasto_compiler::{Loader, library_text};
use impasto_runtime::input;

/// The name by which standard input is asked for.
pub const STDIN: &str = "-";

/// How many entries of a folder are looked at for a hint.
const MAX_BESIDE: usize = 4096;

/// Loads sources from files; relative paths are taken from `base`, and `std::...` from the library.
///
/// A source is read once, so that all of one compilation sees one version of it.
#[derive(Debug, Default)]
pub struct FileLoader {
    base: PathBuf,
    loaded: BTreeMap<String, Result<Vec<u8>, String>>,
}

impl FileLoader {
    /// A loader for paths relative to `base`; an empty `base` is the working directory.
    pub fn new(base: impl Into<PathBuf>) -> Self {
        Self {
            base: base.into(),
            loaded: BTreeMap::new(),
        }
    }

    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        if path == STDIN {
            read_source(io::stdin().lock())
        } else {
            read_source(input::open(&self.base.join(path))?)
        }
    }
}

impl Loader for FileLoader {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if let Some(text) = library_text(path) {
            return Ok(text?.as_bytes().to_vec());
        }
        if !self.loaded.contains_key(path) {
            let bytes = self.read(path).map_err(|error| reason(&error));
            self.loaded.insert(path.to_owned(), bytes);
        }
        self.loaded[path].clone()
    }

    fn beside(&mut self, path: &str) -> Vec<String> {
        let folder = path.rfind('/').map_or("", |slash| &path[..=slash]);
        // Of the working directory, the empty path is no name.
        let here = Path::new(".").join(&self.base).join(folder);
        let Ok(entries) = std::fs::read_dir(here) else {
            return Vec::new();
        };
        let names = entries.flatten().take(MAX_BESIDE);
        let names = names.filter_map(|entry| entry.file_name().into_string().ok());
        let mut paths: Vec<String> = names
            .filter(|name| name.ends_with(".impasto"))
            .map(|name| format!("{folder}{name}"))
            .collect();
        paths.sort();
        paths
    }
}

/// Reads at most one byte more than a source may have, which is enough to see that it is too large.
fn read_source(reader: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader
        .take(MAX_SOURCE_BYTES as u64 + 1)
        .read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// An I/O error in a few words, without the operating system's number where the kind is clear.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file or folder".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        io::ErrorKind::IsADirectory => "it is a folder".into(),
        io::ErrorKind::NotADirectory => "a part of the path is not a folder".into(),
        io::ErrorKind::StorageFull => "no space left on the device".into(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only".into(),
        _ => error.to_string(),
    }
}

/// Checks that a file could be created at `path`, so that one learns it before the work and not
/// after. Nothing is left behind.
pub fn check_writable(path: &Path) -> Result<(), String> {
    let cannot = |why: String| Err(format!("cannot write `{}`: {why}", path.display()));
    if path.is_dir() {
        return cannot("it is a folder".into());
    }
    if is_device(path) {
        return Ok(());
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return cannot(format!("there is no folder `{}`", folder.display()));
    }
    match tempfile::tempfile_in(folder) {
        Ok(_) => Ok(()),
        Err(error) => cannot(reason(&error)),
    }
}

/// Writes a whole file or none: a temporary one beside it takes its name once it is complete.
/// Devices and pipes are written to as they are.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let written = if is_device(path) {
        std::fs::write(path, bytes)
    } else {
        replace(path, bytes)
    };
    written.map_err(|error| format!("cannot write `{}`: {}", path.display(), reason(&error)))
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // A link stays a link: what it points to is replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".impasto-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As for any new file, less what the user's mask takes away.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(&target))?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(&target)?;
    Ok(())
}

/// Does `path` name something that exists and is neither file nor folder?
fn is_device(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_replaces_the_one_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_whole(&path, b"first").expect("it is written");
        write_whole(&path, b"second").expect("it is written");
        assert_eq!(std::fs::read(&path).expect("the file"), b"second");
        assert_eq!(
            std::fs::read_dir(folder.path())
                .expect("the folder")
                .count(),
            1
        );
    }

    #[cfg(unix)]
    #[test]
    fn files_are_as_readable_as_others() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let mode = |name: &str| {
            let metadata = folder.path().join(name).metadata().expect("the file");
            metadata.permissions().mode()
        };
        write_whole(&folder.path().join("ours"), b"").expect("it is written");
        std::fs::write(folder.path().join("usual"), b"").expect("it is written");
        assert_eq!(mode("ours"), mode("usual"));
    }

    #[cfg(unix)]
    #[test]
    fn devices_stay_devices() {
        let null = Path::new("/dev/null");
        check_writable(null).expect("it can be written");
        write_whole(null, b"gone").expect("it can be written");
        assert!(is_device(null));
    }

    #[test]
    fn a_source_is_read_once() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.impasto"), b"first").expect("it is written");
        let mut loader = FileLoader::new(folder.path());
        assert_eq!(loader.load("a.impasto"), Ok(b"first".to_vec()));
        std::fs::write(folder.path().join("a.impasto"), b"second").expect("it is written");
        assert_eq!(loader.load("a.impasto"), Ok(b"first".to_vec()));
        assert!(loader.load("b.impasto").is_err());
    }

    #[test]
    fn reading_stops_when_a_source_is_too_large() {
        let bytes = read_source(io::repeat(b' ')).expect("endless input is read");
        assert_eq!(bytes.len(), MAX_SOURCE_BYTES + 1);
    }
}
