//! Where source texts come from: the file system, with `-` for standard input.
//!
//! The compiler does no I/O of its own; it asks a [`Loader`] for every file it meets.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use impasto_compiler::source::{MAX_SOURCE_BYTES, Origin};
use impasto_compiler::{Loader, library_text};
use impasto_runtime::film::output;
pub use impasto_runtime::film::output::Unwritten;
pub use impasto_runtime::input::reason;
use impasto_runtime::input::{self, Source};

use crate::set;

/// The name by which standard input is asked for.
pub const STDIN: &str = "-";

/// How many entries of a folder are looked at for a hint.
const MAX_BESIDE: usize = 4096;

/// Loads sources from files; relative paths are taken from `base`, and `std::...` from the library.
///
/// A source is read once, so that all of one compilation sees one version of it.
#[derive(Clone, Debug, Default)]
pub struct FileLoader {
    base: PathBuf,
    loaded: BTreeMap<String, Result<Source, String>>,
}

impl FileLoader {
    /// A loader for paths relative to `base`; an empty `base` is the working directory.
    pub fn new(base: impl Into<PathBuf>) -> Self {
        Self {
            base: base.into(),
            loaded: BTreeMap::new(),
        }
    }

    /// The files that were asked for, whether they were there or not, with what documents include; those of the library
    /// are none.
    pub fn asked(&self) -> impl Iterator<Item = PathBuf> {
        let paths = self.loaded.keys().map(|path| self.base.join(path));
        let made = self.loaded.values().flatten();
        let made = made.filter_map(|source| source.origin.as_ref());
        let included = made.flat_map(|origin| origin.documents().iter().skip(1));
        let included = included.map(|(path, _)| PathBuf::from(path));
        let paths = paths.chain(included);
        paths.map(|path| input::on_disk(&path).to_owned())
    }

    fn read(&self, path: &str) -> io::Result<Source> {
        if path == STDIN {
            Ok(input::at_most(io::stdin().lock(), MAX_SOURCE_BYTES)?.into())
        } else {
            input::source(&self.base.join(path), MAX_SOURCE_BYTES)
        }
    }
}

impl Loader for FileLoader {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if let Some(text) = library_text(path) {
            return Ok(text?.as_bytes().to_vec());
        }
        if let Some((_, text)) = set::SOURCES.iter().find(|(name, _)| *name == path) {
            return Ok(text.as_bytes().to_vec());
        }
        if !self.loaded.contains_key(path) {
            let bytes = self.read(path).map_err(|error| reason(&error));
            self.loaded.insert(path.to_owned(), bytes);
        }
        self.loaded[path]
            .as_ref()
            .map(|source| source.bytes.clone())
            .map_err(String::clone)
    }

    fn origin(&mut self, path: &str) -> Option<Arc<Origin>> {
        let source = self.loaded.get(path)?.as_ref().ok()?;
        source.origin.clone()
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

/// Checks that there is a file at `path` that can be read.
pub fn check_readable(path: &Path) -> Result<(), String> {
    let opened = input::open(path).map(drop);
    opened.map_err(|error| format!("cannot read `{}`: {}", path.display(), reason(&error)))
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

/// Makes a folder, if it is not there.
///
/// # Errors
/// What the file system says.
pub fn make_folder(folder: &Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| {
        format!(
            "cannot make the folder `{}`: {}",
            folder.display(),
            reason(&e)
        )
    })
}

/// Writes a whole file or none: a temporary one beside it takes its name once it is complete.
/// Devices and pipes are written to as they are.
///
/// # Errors
/// Why it could not be written, with its name.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Unwritten> {
    let written = if is_device(path) {
        std::fs::write(path, bytes).map_err(Unwritten::from)
    } else {
        output::replace(path, |file| Ok(file.write_all(bytes)?))
    };
    written.map_err(|why| Unwritten {
        reason: format!("cannot write `{}`: {why}", path.display()),
        ..why
    })
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

/// Why a file is not kept to this process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LockError {
    /// Another process has it.
    InUse(String),
    /// The file beside it cannot be made or locked.
    Failed(String),
}

impl fmt::Display for LockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::InUse(message) | Self::Failed(message)) = self;
        f.write_str(message)
    }
}

/// Keeps a file to one process at a time. The operating system ends it with the process, however that ends.
///
/// What is locked is a file of its own beside it, since a file that is replaced while it is kept up to date is
/// another one each time.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: Option<File>,
}

impl Lock {
    /// Keeps others from the file at `path`, which need not exist.
    ///
    /// # Errors
    /// If another process has it, or the file beside it cannot be made.
    pub fn take(path: &Path) -> Result<Self, LockError> {
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut name = target.into_os_string();
        name.push(".lock");
        let lock = PathBuf::from(name);
        let cannot = |error: io::Error| {
            let (name, why) = (lock.display(), reason(&error));
            LockError::Failed(format!(
                "cannot lock `{}` by `{name}`: {why}",
                path.display()
            ))
        };
        loop {
            let mut options = OpenOptions::new();
            let options = options.create(true).truncate(false).write(true);
            let file = options.open(&lock).map_err(cannot)?;
            match file.try_lock() {
                // Whoever had it may have removed it after it was opened.
                Ok(()) if !is_at(&file, &lock) => {}
                Ok(()) => {
                    return Ok(Self {
                        path: lock,
                        file: Some(file),
                    });
                }
                Err(TryLockError::WouldBlock) => {
                    let name = path.display();
                    let message = format!("`{name}` is in use by another process");
                    return Err(LockError::InUse(message));
                }
                // A file system without locks holds nobody back, as before.
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    return Ok(Self {
                        path: lock,
                        file: None,
                    });
                }
                Err(TryLockError::Error(error)) => return Err(cannot(error)),
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // It is removed while it is locked: nobody else can have it then.
        if self
            .file
            .as_ref()
            .is_none_or(|file| is_at(file, &self.path))
        {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Is an open file the one at `path`?
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    let found = path.metadata().map(place).ok();
    found.is_some() && found == file.metadata().map(place).ok()
}

/// Is an open file the one at `path`? Where open files cannot be removed, it is.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use std::io::Read;

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

    /// Whoever reads the file before keeps it as it was: no moment has half of either.
    #[cfg(unix)]
    #[test]
    fn a_file_that_is_open_is_not_written_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_whole(&path, b"first").expect("it is written");
        let mut before = File::open(&path).expect("the file");
        write_whole(&path, b"second").expect("it is written");
        let mut text = String::new();
        before.read_to_string(&mut text).expect("it can be read");
        assert_eq!(text, "first");
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
    fn a_lock_is_held_once_and_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("c.film");
        let held = Lock::take(&path).expect("it is free");
        let refusal = Lock::take(&path).expect_err("it is held").to_string();
        assert!(refusal.contains("in use by another process"), "{refusal}");
        drop(held);
        assert!(!folder.path().join("c.film.lock").exists());
        // What a killed process leaves is a file that nobody has locked.
        std::fs::write(folder.path().join("c.film.lock"), "").expect("written");
        drop(Lock::take(&path).expect("it is free"));
        let missing = folder.path().join("missing/c.film");
        let refusal = Lock::take(&missing)
            .expect_err("there is no folder")
            .to_string();
        assert!(refusal.contains("no such file or folder"), "{refusal}");
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_by_another_name_is_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("c.film"), "").expect("written");
        std::os::unix::fs::symlink(at("c.film"), at("link.film")).expect("a link");
        let _held = Lock::take(&at("c.film")).expect("it is free");
        Lock::take(&at("link.film")).expect_err("it is held");
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.txt"), "first").expect("written");
        std::os::unix::fs::symlink(at("a.txt"), at("link.txt")).expect("a link");
        write_whole(&at("link.txt"), b"second").expect("written");
        assert!(at("link.txt").is_symlink());
        assert_eq!(std::fs::read(at("a.txt")).expect("the file"), b"second");
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
        let bytes =
            input::at_most(io::repeat(b' '), MAX_SOURCE_BYTES).expect("endless input is read");
        assert_eq!(bytes.len(), MAX_SOURCE_BYTES + 1);
    }
}
