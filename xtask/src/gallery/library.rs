//! What there is to show: the files of the standard library and the materials, as the compiler's
//! `emit --what docs` describes them. Nothing here reads Impasto by itself.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;

use super::prose::statements;
use crate::shell::{self, Result};

/// The folder name of materials, beside those of the library.
pub(super) const MATERIALS: &str = "materials";
/// The folder whose definitions are in scope everywhere. They have no pictures.
pub(super) const CORE: &str = "core";

/// What `emit --what docs` prints.
#[derive(Deserialize)]
pub(super) struct FileDocs {
    pub(super) docs: Vec<String>,
    pub(super) items: Vec<Item>,
}

/// A definition. Which of its fields are there depends on its kind.
#[derive(Deserialize)]
pub(super) struct Item {
    /// `material`, `bsdf`, `delta bsdf`, `edf`, `fn`, `struct` or `const`.
    pub(super) kind: String,
    pub(super) name: String,
    pub(super) docs: Vec<String>,
    #[serde(default)]
    pub(super) private: bool,
    #[serde(default)]
    pub(super) parameters: Vec<Parameter>,
    #[serde(default)]
    pub(super) fields: Vec<Field>,
    /// What a function gives.
    pub(super) result: Option<String>,
    /// The type of a constant.
    #[serde(rename = "type")]
    pub(super) ty: Option<String>,
    /// The value of a constant.
    pub(super) value: Option<String>,
}

/// A parameter, in the words of its source.
#[derive(Deserialize)]
pub(super) struct Parameter {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) ty: String,
    pub(super) default: Option<String>,
    pub(super) range: Option<[String; 2]>,
    #[serde(default)]
    pub(super) docs: Vec<String>,
    #[serde(default)]
    pub(super) metadata: Metadata,
}

/// What a parameter tells user interfaces, of which the pages show this much.
#[derive(Default, Deserialize)]
pub(super) struct Metadata {
    pub(super) label: Option<String>,
    pub(super) group: Option<String>,
}

/// A field of a struct.
#[derive(Deserialize)]
pub(super) struct Field {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) ty: String,
    #[serde(default)]
    pub(super) docs: Vec<String>,
}

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
        named.or_else(|| items.iter().find(|i| i.kind == "material"))
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

/// Reads the standard library and the materials through the built command.
pub(super) fn read(impasto: &Path) -> Result<Library> {
    let root = shell::root();
    let mut entries = Vec::new();
    for folder in folders(&root.join("stdlib"))? {
        for path in sources(&root.join("stdlib").join(&folder))? {
            entries.push(entry(impasto, &folder, path)?);
        }
    }
    for path in sources(&root.join(MATERIALS))? {
        entries.push(entry(impasto, MATERIALS, path)?);
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

fn entry(impasto: &Path, folder: &str, path: PathBuf) -> Result<Entry> {
    let text =
        fs::read_to_string(&path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
    let mut emit = Command::new(impasto);
    emit.arg("emit").arg(&path).args(["--what", "docs"]);
    let json = shell::capture(&mut emit)?;
    let docs = serde_json::from_str(&json)
        .map_err(|e| format!("cannot understand the docs of {}: {e}", path.display()))?;
    Ok(Entry {
        folder: folder.to_owned(),
        name: stem(&path),
        path,
        text,
        docs,
    })
}
