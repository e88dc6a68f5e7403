//! Files that may change: what `--watch` waits for.
//!
//! They are looked at again and again, which works on every file system, for files that editors replace by others, and
//! for such as are not there yet. A path that stands for the tiles of a texture is all of them, and those that come.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use impasto_runtime::world::texture;

/// How often files are looked at.
pub const EVERY: Duration = Duration::from_millis(50);

/// Files, and how each of them was when it was looked at last.
#[derive(Clone, Debug, Default)]
pub struct Watched {
    files: BTreeMap<PathBuf, Looks>,
}

/// What is at a path: a file, nothing, or tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Looks {
    One(Option<Look>),
    Tiles(Vec<(PathBuf, Option<Look>)>),
}

/// What tells one version of a file from the next.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Look {
    modified: Option<SystemTime>,
    length: u64,
    /// Which file it is, since one that replaces another may be as old and as long.
    number: u64,
    is_folder: bool,
}

impl Watched {
    /// The files at `paths`, as they are now.
    pub fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut watched = Self::default();
        watched.add(paths);
        watched
    }

    /// Watches more files, as they are now.
    pub fn add(&mut self, paths: impl IntoIterator<Item = PathBuf>) {
        for path in paths {
            self.files
                .entry(path)
                .or_insert_with_key(|path| looks(path));
        }
    }

    /// The files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.keys().map(PathBuf::as_path)
    }

    /// Has a file changed since it was looked at last? Everything is looked at.
    pub fn changed(&mut self) -> bool {
        let mut changed = false;
        for (path, last) in &mut self.files {
            let now = looks(path);
            changed |= now != *last;
            *last = now;
        }
        changed
    }

    /// Takes over how files look in `other`, of those that both have.
    pub fn update(&mut self, other: &Self) {
        for (path, last) in &mut self.files {
            if let Some(now) = other.files.get(path) {
                last.clone_from(now);
            }
        }
    }

    /// The same, while others are still looking.
    pub fn has_changed(&self) -> bool {
        let mut files = self.files.iter();
        files.any(|(path, last)| looks(path) != *last)
    }
}

fn looks(path: &Path) -> Looks {
    let tile = |path: PathBuf| {
        let look = look(&path);
        (path, look)
    };
    match texture::tiles(path) {
        Some(tiles) => Looks::Tiles(tiles.into_iter().map(tile).collect()),
        None => Looks::One(look(path)),
    }
}

fn look(path: &Path) -> Option<Look> {
    let metadata = std::fs::metadata(path).ok()?;
    Some(Look {
        modified: metadata.modified().ok(),
        length: metadata.len(),
        number: number(&metadata),
        is_folder: metadata.is_dir(),
    })
}

#[cfg(unix)]
fn number(metadata: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> u64 {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_come_go_and_change_are_seen_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.impasto");
        let mut watched = Watched::new([path.clone()]);
        assert!(!watched.changed());
        let seen = |watched: &mut Watched| {
            assert!(watched.has_changed());
            assert!(watched.changed());
            assert!(!watched.changed());
        };
        std::fs::write(&path, "a").expect("written");
        seen(&mut watched);
        std::fs::write(&path, "ab").expect("written");
        seen(&mut watched);
        let other = folder.path().join("b");
        std::fs::write(&other, "ba").expect("written");
        std::fs::rename(&other, &path).expect("renamed");
        seen(&mut watched);
        std::fs::remove_file(&path).expect("removed");
        seen(&mut watched);
        std::fs::create_dir(&path).expect("a folder");
        seen(&mut watched);
    }

    #[test]
    fn tiles_are_watched_and_other_files_beside_them_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let mut watched = Watched::new([at("wall.<UDIM>.png")]);
        assert!(!watched.changed());
        for (name, text, is_seen) in [
            ("wall.1001.png", "a", true),
            ("wall.1012.png", "a", true),
            ("wall.1012.png", "ab", true),
            ("wall.png", "a", false),
            ("wall.0999.png", "a", false),
            ("picture.png", "a", false),
        ] {
            std::fs::write(at(name), text).expect("written");
            assert_eq!(watched.changed(), is_seen, "{name}");
        }
        std::fs::remove_file(at("wall.1001.png")).expect("removed");
        assert!(watched.changed());
        assert!(!watched.changed());
    }
}
