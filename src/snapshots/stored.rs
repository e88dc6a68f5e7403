//! Where snapshots are kept: in the folder `snapshots` beside the sources, three files a material.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use impasto_runtime::film::Film;
use serde_json::Value;

use super::{Subject, facts, picture};

/// The folder beside sources in which snapshots are.
pub const FOLDER: &str = "snapshots";

/// What the first line of the WGSL begins with; the version follows.
const HEAD: &str = "// Impasto snapshot ";

/// The snapshot that was accepted.
#[derive(Clone, Debug)]
pub struct Stored {
    /// The WGSL.
    pub wgsl: String,
    /// Costs and parameters.
    pub facts: Value,
    /// The picture.
    pub picture: Film,
}

/// The files of a snapshot.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    pub wgsl: PathBuf,
    pub facts: PathBuf,
    pub picture: PathBuf,
}

impl Paths {
    fn all(&self) -> [&PathBuf; 3] {
        [&self.wgsl, &self.facts, &self.picture]
    }
}

/// The folder of the snapshots of a file's materials.
pub(super) fn folder(file: &str) -> PathBuf {
    let parent = Path::new(file).parent().unwrap_or(Path::new(""));
    parent.join(FOLDER)
}

/// Is there a folder beside which snapshots could be kept? Modules of the library and standard input have none.
pub fn has_place(file: &str) -> bool {
    Path::new(file).is_file()
}

/// Are snapshots kept of the materials of a file's folder?
pub fn keeps(file: &str) -> bool {
    has_place(file) && folder(file).is_dir()
}

/// What the names of a file's snapshots begin with: its name, without the extension of sources.
fn prefix(file: &Path) -> Option<String> {
    let is_source = file.extension().is_some_and(|e| e == "impasto");
    let name = if is_source {
        file.file_stem()
    } else {
        file.file_name()
    };
    Some(name?.to_string_lossy().into_owned())
}

pub(super) fn paths(file: &str, material: &str) -> Paths {
    let prefix = prefix(Path::new(file)).unwrap_or_default();
    let folder = folder(file);
    let of = |extension: &str| folder.join(format!("{prefix}.{material}.{extension}"));
    Paths {
        wgsl: of("wgsl"),
        facts: of("json"),
        picture: of("png"),
    }
}

/// The first line of the WGSL, which tells what it is of.
pub(super) fn head(file: &str, material: &str) -> String {
    let name = Path::new(file).file_name().unwrap_or_default();
    let name = name.to_string_lossy();
    format!("{HEAD}{}: {name}, {material}\n", facts::VERSION)
}

/// A number that changes with the files of a material's snapshot.
pub fn digest(subject: Subject<'_>) -> u64 {
    let mut hasher = DefaultHasher::new();
    for path in paths(subject.file, subject.name).all() {
        std::fs::read(path).ok().hash(&mut hasher);
    }
    hasher.finish()
}

/// The snapshot of a material; none if none of its files is there.
///
/// # Errors
/// What is wrong with it: the file, why, and what to do.
pub fn read(subject: Subject<'_>) -> Result<Option<Stored>, (PathBuf, String)> {
    let paths = paths(subject.file, subject.name);
    if paths.all().iter().all(|p| !p.exists()) {
        return Ok(None);
    }
    let text = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).map_err(|why| (path.clone(), why.to_string()))?;
        match text.lines().position(is_conflict) {
            Some(line) => {
                let why = format!("it has a merge conflict in line {}", line + 1);
                Err((path.clone(), why))
            }
            None => Ok(text),
        }
    };
    let wgsl = text(&paths.wgsl)?;
    let (first, rest) = wgsl.split_once('\n').unwrap_or((&wgsl, ""));
    let version = first.strip_prefix(HEAD).and_then(|v| v.split_once(':'));
    version_of(version.and_then(|(v, _)| v.parse().ok()))
        .map_err(|why| (paths.wgsl.clone(), why))?;
    let facts: Value = serde_json::from_str(&text(&paths.facts)?)
        .map_err(|why| (paths.facts.clone(), format!("it is no JSON: {why}")))?;
    version_of(facts["version"].as_u64()).map_err(|why| (paths.facts.clone(), why))?;
    let picture = picture::read(&paths.picture).map_err(|why| (paths.picture.clone(), why))?;
    Ok(Some(Stored {
        wgsl: rest.to_owned(),
        facts,
        picture,
    }))
}

/// A line that version control leaves where two changes meet.
fn is_conflict(line: &str) -> bool {
    ["<<<<<<< ", ">>>>>>> ", "||||||| "]
        .iter()
        .any(|mark| line.starts_with(mark))
        || line == "======="
}

fn version_of(found: Option<u64>) -> Result<(), String> {
    match found {
        Some(facts::VERSION) => Ok(()),
        Some(other) => Err(format!(
            "it has the form {other}, and this version of Impasto keeps the form {}",
            facts::VERSION
        )),
        None => Err("it does not say which form it has".into()),
    }
}

/// Files of snapshots in the folders of `files` that belong to no material. `materials` has the names of each file's.
pub fn orphans<'a>(files: impl IntoIterator<Item = (&'a str, Vec<&'a str>)>) -> Vec<PathBuf> {
    let mut wanted: BTreeSet<PathBuf> = BTreeSet::new();
    let mut folders: BTreeSet<PathBuf> = BTreeSet::new();
    for (file, materials) in files {
        folders.insert(folder(file));
        for material in materials {
            wanted.extend(paths(file, material).all().map(Clone::clone));
        }
    }
    let mut found = Vec::new();
    for folder in folders {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        // A file that is there but was not tested keeps its snapshots.
        let sources = sources_beside(&folder);
        for path in entries.flatten().map(|e| e.path()) {
            let is_part = path
                .extension()
                .is_some_and(|e| e == "wgsl" || e == "json" || e == "png");
            if is_part && !wanted.contains(&path) && !belongs(&path, &sources, &wanted) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// What the names of snapshots may begin with, by the sources beside their folder.
fn sources_beside(folder: &Path) -> BTreeSet<String> {
    let parent = match folder.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let entries = std::fs::read_dir(parent).into_iter().flatten().flatten();
    let sources = entries.map(|e| e.path());
    let sources = sources.filter(|p| p.extension().is_some_and(|e| e == "impasto" || e == "mtlx"));
    sources.filter_map(|p| prefix(&p)).collect()
}

/// Is it of a source that is there, of which nothing was tested?
fn belongs(path: &Path, sources: &BTreeSet<String>, wanted: &BTreeSet<PathBuf>) -> bool {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let Some((source, _)) = name.rsplit_once('.') else {
        return false;
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let prefix = format!("{source}.");
    let tested = wanted.iter().any(|p| {
        p.parent() == Some(folder)
            && p.file_stem()
                .is_some_and(|s| s.to_string_lossy().starts_with(&prefix))
    });
    sources.contains(source) && !tested
}
