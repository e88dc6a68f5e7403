//! What passed already: files of a cache folder, named by a digest of all that a verdict depends on, so that materials
//! that did not change are not tested again.
//!
//! Where there is no folder, or it cannot be written to, everything is tested every time.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use impasto::verify::check::File;
use impasto::{cache, files};

/// Verdicts that are kept; the oldest go first.
const MOST: usize = 20_000;

/// A folder of verdicts.
pub(super) struct Cache {
    folder: Option<PathBuf>,
    /// Which program this is: one that was built anew tests anew.
    program: u64,
}

/// What a verdict was made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key(u64);

impl Cache {
    pub fn open() -> Self {
        let mut program = DefaultHasher::new();
        env!("CARGO_PKG_VERSION").hash(&mut program);
        let known = std::env::current_exe().ok().and_then(|exe| stamp(&exe));
        known.hash(&mut program);
        Self {
            folder: known.and(cache::folder("tests")),
            program: program.finish(),
        }
    }

    /// The key of a verdict on something called `name` in `file`; `more` is whatever else it depends on.
    pub fn key(&self, file: &File, name: &str, more: &impl Hash) -> Key {
        let mut hasher = DefaultHasher::new();
        (self.program, &file.path, name).hash(&mut hasher);
        // The library is part of the program.
        for (_, source) in file.sources.files().filter(|(id, _)| !id.is_library()) {
            (&source.name, &source.text).hash(&mut hasher);
        }
        more.hash(&mut hasher);
        Key(hasher.finish())
    }

    /// How many checks passed, if all did when this was last asked.
    pub fn passed(&self, key: Key) -> Option<usize> {
        let text = std::fs::read_to_string(self.path(key)?).ok()?;
        let mut lines = text.lines();
        let checks = lines.next()?.parse().ok()?;
        // Pictures that it reads: they are as they were.
        let mut files = lines.map(|line| {
            let (then, path) = line.split_once(' ')?;
            let then: u64 = then.parse().ok()?;
            (stamp(Path::new(path))? == then).then_some(())
        });
        files.all(|same| same.is_some()).then_some(checks)
    }

    /// Notes that everything passed, reading the pictures `files`. Where that fails, it will be tested again.
    pub fn note(&self, key: Key, checks: usize, pictures: &[PathBuf]) {
        let Some(path) = self.path(key) else { return };
        let mut text = format!("{checks}\n");
        for picture in pictures {
            let Some(stamp) = stamp(picture) else { return };
            text += &format!("{stamp} {}\n", picture.display());
        }
        let made = path.parent().map(std::fs::create_dir_all);
        if matches!(made, Some(Ok(()))) {
            // A cache that is full or read-only only costs time.
            let _ = files::write_whole(&path, text.as_bytes());
        }
    }

    /// Removes the oldest verdicts where there are too many.
    pub fn tidy(&self) {
        let Some(entries) = self.folder.as_ref().and_then(|f| std::fs::read_dir(f).ok()) else {
            return;
        };
        let aged = entries.flatten().filter_map(|e| {
            let age = e.metadata().ok()?.modified().ok()?;
            Some((age, e.path()))
        });
        let mut all: Vec<_> = aged.collect();
        if all.len() > MOST {
            all.sort();
            for (_, path) in &all[..all.len() - MOST / 2] {
                let _ = std::fs::remove_file(path);
            }
        }
    }

    fn path(&self, key: Key) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{:016x}", key.0)))
    }
}

/// A number that changes with a file: of its size and the time it was written.
fn stamp(path: &Path) -> Option<u64> {
    let found = path.metadata().ok()?;
    let written = found.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    let mut hasher = DefaultHasher::new();
    (found.len(), written).hash(&mut hasher);
    Some(hasher.finish())
}
