//! What there is to show: the files of the standard library and the materials, as `impasto::docs`
//! describes them. Nothing here reads Impasto by itself.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use impasto::docs::{self, FileDocs, Item};
use xtask::shell::{self, Result};

use super::prose::statements;

/// The folder name of materials, beside those of the library.
pub(super) const MATERIALS: &str = "materials";
/// The folder whose definitions are in scope everywhere. They have no pictures.
pub(super) const CORE: &str = "core";

/// One file with the definition that it is named after.
pub(super) struct Entry {
    /// `bsdf`, `noise`, ..., or `materials`.
    pub(super) folder: String,
    /// The file's name without `.impasto`.
    pub(super) name: String,
    pub(super) path: PathBuf,
    pub(super) text: String,
    pub(super) docs: FileDocs,
}

impl Entry {
    /// `bsdf/conductor`: what `--only` and the manifest call it.
    pub(super) fn id(&self) -> String {
        format!("{}/{}", self.folder, self.name)
    }

    /// The definition that the file is about: the one of its name, else its first material.
    pub(super) fn main(&self) -> Option<&Item> {
        let items = &self.docs.items;
        let named = items.iter().find(|i| i.name == self.name);
        named.or_else(|| items.iter().find(|i| i.kind() == "material"))
    }

    /// The values of the statements `Gallery: key = value` of the main definition, by key.
    pub(super) fn notes(&self) -> BTreeMap<String, String> {
        let lines = self.main().map_or(&[][..], |item| &item.docs);
        let statements = statements(lines).into_iter();
        let notes = statements.filter(|(word, _)| *word == "Gallery");
        let pair = |(_, note): (_, String)| {
            let (key, value) = note.split_once('=')?;
            Some((key.trim().to_owned(), value.trim().to_owned()))
        };
        notes.filter_map(pair).collect()
    }

    pub(super) fn has_picture(&self) -> bool {
        self.folder != CORE
    }
}

/// Everything that the library page shows, by folder and name.
pub(super) struct Library {
    pub(super) entries: Vec<Entry>,
    /// The folders that define a name of the library, outside of its core.
    pub(super) homes: BTreeMap<String, Vec<String>>,
}

/// Reads the standard library and the materials.
pub(super) fn read() -> Result<Library> {
    let root = shell::root();
    let mut entries = Vec::new();
    for folder in folders(&root.join("stdlib"))? {
        for path in sources(&root.join("stdlib").join(&folder))? {
            entries.push(entry(&folder, path)?);
        }
    }
    for path in sources(&root.join(MATERIALS))? {
        entries.push(entry(MATERIALS, path)?);
    }
    let mut homes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let public = entries
        .iter()
        .filter(|e| e.folder != CORE && e.folder != MATERIALS);
    for entry in public {
        for item in entry.docs.items.iter().filter(|i| !i.private) {
            let folders = homes.entry(item.name.clone()).or_default();
            folders.push(entry.folder.clone());
        }
    }
    Ok(Library { entries, homes })
}

/// The folders of the library, in the order of their names.
fn folders(stdlib: &Path) -> Result<Vec<String>> {
    let mut folders = Vec::new();
    for path in listed(stdlib)? {
        if path.is_dir() && !sources(&path)?.is_empty() {
            folders.push(stem(&path));
        }
    }
    Ok(folders)
}

/// The Impasto files in a folder, in the order of their names.
pub(super) fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut paths = listed(folder)?;
    paths.retain(|p| p.extension().is_some_and(|e| e == "impasto"));
    Ok(paths)
}

fn listed(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e: std::io::Error| format!("cannot read the folder {}: {e}", folder.display());
    let entries = fs::read_dir(folder).map_err(failed)?;
    let paths: std::io::Result<Vec<PathBuf>> = entries.map(|e| e.map(|e| e.path())).collect();
    let mut paths = paths.map_err(failed)?;
    paths.sort();
    Ok(paths)
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default()
}

fn entry(folder: &str, path: PathBuf) -> Result<Entry> {
    let name = path.display().to_string();
    let text = fs::read_to_string(&path).map_err(|e| format!("cannot read {name}: {e}"))?;
    Ok(Entry {
        folder: folder.to_owned(),
        name: stem(&path),
        docs: docs::of_text(&name, &text)?,
        path,
        text,
    })
}
