//! Where layers and pictures of a USD file are: in its own folder or below, or in its archive. Whatever the reader opens it
//! opens here, so that each layer is looked at before it is parsed, and all together are bounded.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeSet, HashMap};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use openusd::ar::{Asset, ResolvedPath, Resolver};

use super::{archive, binary, text};
use crate::input::file;

/// Bytes that are read of all layers, and how often a layer is opened.
const MOST_BYTES: u64 = 8 << 30;
const MOST_OPENED: usize = 20_000;

/// What the reader asks.
#[derive(Clone)]
pub(super) struct Files(Rc<Inner>);

struct Inner {
    /// The folder of the file, by which paths begin that may be read.
    folder: PathBuf,
    /// What was opened last: layers are opened several times.
    last: RefCell<Option<(PathBuf, Arc<Vec<u8>>)>>,
    /// The last archive.
    archive: RefCell<Option<Archive>>,
    opened: Cell<usize>,
    bytes: Cell<u64>,
    /// Why something was not opened.
    refused: RefCell<Option<String>>,
    /// Files that layers were read of.
    layers: RefCell<BTreeSet<PathBuf>>,
    /// The real paths of files, or none if they may not be read.
    found: RefCell<HashMap<PathBuf, Option<PathBuf>>>,
}

/// An archive, and where its files are.
#[derive(Clone)]
struct Archive {
    path: PathBuf,
    bytes: Arc<Vec<u8>>,
    files: Rc<Vec<(String, std::ops::Range<usize>)>>,
}

impl Files {
    /// Files beside the one at `path`, which is a real path.
    pub(super) fn beside(path: &Path) -> Self {
        Self(Rc::new(Inner {
            folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            last: RefCell::default(),
            archive: RefCell::default(),
            opened: Cell::default(),
            bytes: Cell::default(),
            refused: RefCell::default(),
            layers: RefCell::default(),
            found: RefCell::default(),
        }))
    }

    /// The files that layers were read of, by their paths from the folder.
    pub(super) fn layers(&self) -> Vec<PathBuf> {
        let layers = self.0.layers.borrow();
        let within = layers
            .iter()
            .filter_map(|path| path.strip_prefix(&self.0.folder).ok());
        within.map(Path::to_path_buf).collect()
    }

    /// Why something was not opened, if something was not.
    pub(super) fn refused(&self) -> Option<String> {
        self.0.refused.borrow().clone()
    }

    fn refuse(&self, why: String) {
        self.0.refused.borrow_mut().get_or_insert(why);
    }

    /// The bytes of what a path names that this has resolved, without a look at them.
    pub(super) fn bytes(&self, resolved: &str) -> io::Result<Vec<u8>> {
        match packed(resolved) {
            Some((package, inner)) => {
                let archive = self.archive(Path::new(package))?;
                let found = archive.files.iter().find(|(name, _)| name == inner);
                let (_, range) = found.ok_or(io::ErrorKind::NotFound)?;
                Ok(archive.bytes[range.clone()].to_vec())
            }
            None => self.spend(file::open(Path::new(resolved))?),
        }
    }

    /// The whole of a file, if it is not too much.
    fn spend(&self, mut file: std::fs::File) -> io::Result<Vec<u8>> {
        let left = MOST_BYTES.saturating_sub(self.0.bytes.get());
        let bytes = crate::input::at_most(&mut file, usize::try_from(left).unwrap_or(usize::MAX))?;
        if bytes.len() as u64 > left {
            return Err(io::Error::other(format!(
                "layers of more than {MOST_BYTES} bytes"
            )));
        }
        self.0.bytes.set(self.0.bytes.get() + bytes.len() as u64);
        Ok(bytes)
    }

    fn archive(&self, path: &Path) -> io::Result<Archive> {
        if let Some(known) = self.0.archive.borrow().as_ref().filter(|a| a.path == path) {
            return Ok(known.clone());
        }
        let bytes = self.spend(file::open(path)?)?;
        let files = archive::files(&bytes).map_err(io::Error::other)?;
        let (bytes, files) = (Arc::new(bytes), Rc::new(files));
        let archive = Archive {
            path: path.to_owned(),
            bytes,
            files,
        };
        *self.0.archive.borrow_mut() = Some(archive.clone());
        Ok(archive)
    }

    /// A layer that was looked at.
    fn layer(&self, resolved: &Path) -> io::Result<Arc<Vec<u8>>> {
        if let Some((path, bytes)) = &*self.0.last.borrow()
            && path == resolved
        {
            return Ok(Arc::clone(bytes));
        }
        self.0.opened.set(self.0.opened.get() + 1);
        if self.0.opened.get() > MOST_OPENED {
            return Err(io::Error::other("too many layers"));
        }
        let name = resolved.to_string_lossy();
        let bytes = self.bytes(&name)?;
        let on_disk = packed(&name).map_or(&*name, |(package, _)| package);
        self.0.layers.borrow_mut().insert(PathBuf::from(on_disk));
        let looked_at = if bytes.starts_with(binary::MAGIC) {
            binary::check(&bytes)
        } else {
            text::check(&bytes)
        };
        looked_at.map_err(io::Error::other)?;
        let bytes = Arc::new(bytes);
        *self.0.last.borrow_mut() = Some((resolved.to_owned(), Arc::clone(&bytes)));
        Ok(bytes)
    }

    /// The real path of a file in the folder.
    fn real(&self, path: &Path) -> Option<PathBuf> {
        if let Some(known) = self.0.found.borrow().get(path) {
            return known.clone();
        }
        let real = path.canonicalize().ok().filter(|real| real.is_file());
        let allowed = real.filter(|real| {
            let is_inside = real.starts_with(&self.0.folder);
            if !is_inside {
                let folder = self.0.folder.display();
                self.refuse(format!(
                    "`{}` lies outside of its folder `{folder}`",
                    path.display()
                ));
            }
            is_inside
        });
        let mut found = self.0.found.borrow_mut();
        found.insert(path.to_owned(), allowed.clone());
        allowed
    }
}

impl Resolver for Files {
    fn create_identifier(&self, asset_path: &str, anchor: Option<&ResolvedPath>) -> String {
        if asset_path.is_empty() {
            return String::new();
        }
        let Some(anchor) = anchor.map(|anchor| anchor.to_string_lossy().into_owned()) else {
            return asset_path.to_owned();
        };
        match packed(&anchor) {
            Some((package, inner)) => {
                let folder = Path::new(inner).parent().unwrap_or(Path::new(""));
                let inner = cleaned(&folder.join(asset_path));
                format!("{package}[{}]", inner.to_string_lossy().replace('\\', "/"))
            }
            None => {
                let folder = Path::new(&anchor).parent().unwrap_or(Path::new(""));
                // What is in a package beside.
                match packed(asset_path) {
                    Some((package, inner)) => {
                        format!("{}[{inner}]", cleaned(&folder.join(package)).display())
                    }
                    None => cleaned(&folder.join(asset_path))
                        .to_string_lossy()
                        .into_owned(),
                }
            }
        }
    }

    fn resolve(&self, asset_path: &str) -> Option<ResolvedPath> {
        if asset_path.is_empty() {
            return None;
        }
        if let Some((package, inner)) = packed(asset_path) {
            let package = self.real(Path::new(package))?;
            let archive = self.archive(&package);
            let archive = archive
                .map_err(|e| self.refuse(reason(&package, &e)))
                .ok()?;
            let is_there = archive.files.iter().any(|(name, _)| name == inner);
            return is_there.then(|| ResolvedPath::new(format!("{}[{inner}]", package.display())));
        }
        let real = self.real(Path::new(asset_path))?;
        if !is_archive(&real) {
            return Some(ResolvedPath::new(real));
        }
        let archive = self.archive(&real);
        let archive = archive.map_err(|e| self.refuse(reason(&real, &e))).ok()?;
        let Some(shown) = archive::shown(&archive.files) else {
            self.refuse(format!("`{}` does not begin with a layer", real.display()));
            return None;
        };
        Some(ResolvedPath::new(format!("{}[{shown}]", real.display())))
    }

    fn resolve_for_new_asset(&self, _asset_path: &str) -> Option<ResolvedPath> {
        None
    }

    fn open_asset(&self, resolved_path: &ResolvedPath) -> io::Result<Box<dyn Asset>> {
        match self.layer(resolved_path) {
            Ok(bytes) => Ok(Box::new(Open { bytes, at: 0 })),
            Err(error) => {
                self.refuse(reason(resolved_path, &error));
                Err(error)
            }
        }
    }

    fn identity(&self) -> String {
        self.0.folder.to_string_lossy().into_owned()
    }
}

/// Bytes of a layer, which others may have too.
struct Open {
    bytes: Arc<Vec<u8>>,
    at: u64,
}

impl Asset for Open {
    fn size(&self) -> io::Result<u64> {
        Ok(self.bytes.len() as u64)
    }
}

impl Read for Open {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let start = usize::try_from(self.at)
            .unwrap_or(usize::MAX)
            .min(self.bytes.len());
        let length = (&self.bytes[start..]).read(into)?;
        self.at += length as u64;
        Ok(length)
    }
}

impl Seek for Open {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => (self.bytes.len() as u64).checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

fn reason(path: &Path, error: &io::Error) -> String {
    format!(
        "`{}` cannot be read: {}",
        path.display(),
        file::reason(error)
    )
}

pub(super) fn is_archive(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("usdz"))
}

/// The archive and the name in it of a path such as `a.usdz[b.png]`.
fn packed(path: &str) -> Option<(&str, &str)> {
    let start = path
        .find(".usdz[")
        .or_else(|| path.to_ascii_lowercase().find(".usdz["))?;
    let (package, inner) = path.split_at_checked(start + ".usdz".len())?;
    Some((package, inner.strip_prefix('[')?.strip_suffix(']')?))
}

/// A path without `.` and, where it can be, without `..`.
fn cleaned(path: &Path) -> PathBuf {
    let mut cleaned = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(cleaned.components().next_back(), Some(Component::Normal(_))) =>
            {
                cleaned.pop();
            }
            part => cleaned.push(part),
        }
    }
    cleaned
}
