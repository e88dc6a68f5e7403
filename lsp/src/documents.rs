//! The files that a client has open, and what is known of them.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use gen_lsp_types as lsp;
use impasto_compiler::Loader;
use impasto_compiler::analysis::{self, Analysis};
use impasto_compiler::source::{MAX_SOURCE_BYTES, Origin};
use impasto_runtime::input::mtlx::{self, Disk, Files, ImportError};
use impasto_runtime::input::{self, Source};

use crate::library;
use crate::margin::Margin;
use crate::text::{Encoding, Text};

/// An open file.
pub struct Document {
    /// What the client calls it.
    pub uri: lsp::Uri,
    /// What the compiler calls it: a path, a module of the library, or else the URI.
    pub path: String,
    /// What it is written in.
    pub language: Language,
    /// The client's count of its versions.
    pub version: i32,
    /// The text as the client has it.
    pub text: Text,
    /// What is known of its cost.
    pub margin: Margin,
    /// What it means; nothing before that is asked, or when something changed since.
    analysis: Option<Arc<Analysis>>,
    /// What it meant when it had no syntax errors: its definitions are there while one of them is being written.
    last_good: Option<Arc<Analysis>>,
    /// The files that the analysis asked for.
    asked: Vec<String>,
}

/// What a file is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Impasto.
    Material,
    /// A scene file.
    Scene,
    /// MaterialX: a document that others read as a source.
    MaterialX,
    /// TOML that is no scene.
    Other,
}

/// All open files.
pub struct Documents {
    encoding: Encoding,
    open: HashMap<String, Document>,
}

impl Documents {
    /// None yet, of a client that counts in `encoding`.
    pub fn new(encoding: Encoding) -> Self {
        Self {
            encoding,
            open: HashMap::new(),
        }
    }

    /// In what the client counts columns.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Notes that a file was opened.
    pub fn open(&mut self, item: lsp::TextDocumentItem) {
        let path = path_of(&item.uri);
        let language = language_of(&path, &item.text);
        let document = Document {
            uri: item.uri,
            language,
            version: item.version,
            text: Text::new(item.text, self.encoding),
            margin: Margin::default(),
            analysis: None,
            last_good: None,
            asked: Vec::new(),
            path: path.clone(),
        };
        self.open.insert(path.clone(), document);
        self.outdate(&path);
    }

    /// Notes what changed in a file; a file that is not open stays so.
    pub fn change(
        &mut self,
        uri: &lsp::Uri,
        version: i32,
        changes: Vec<lsp::TextDocumentContentChangeEvent>,
    ) -> Option<String> {
        use lsp::TextDocumentContentChangeEvent as Event;
        let path = path_of(uri);
        let encoding = self.encoding;
        let document = self.open.get_mut(&path)?;
        for change in changes {
            match change {
                Event::TextDocumentContentChangePartial(part) => {
                    let (text, lines) = document.text.changed(part.range, &part.text);
                    document.text = text;
                    document.margin.shift(lines);
                }
                Event::TextDocumentContentChangeWholeDocument(whole) => {
                    document.text = Text::new(whole.text, encoding);
                    document.margin = Margin::default();
                }
            }
        }
        document.version = version;
        if matches!(document.language, Language::Scene | Language::Other) {
            document.language = language_of(&path, document.text.as_str());
        }
        self.outdate(&path);
        Some(path)
    }

    /// Notes that a file was closed.
    pub fn close(&mut self, uri: &lsp::Uri) -> Option<Document> {
        let path = path_of(uri);
        let closed = self.open.remove(&path);
        self.outdate(&path);
        closed
    }

    /// Forgets what was made of the file at `path`, which is another one now.
    pub fn outdate(&mut self, path: &str) {
        for document in self.open.values_mut() {
            if document.path == path || document.asked.iter().any(|p| p == path) {
                document.analysis = None;
            }
        }
    }

    /// Forgets what was made of any file.
    pub fn outdate_all(&mut self) {
        let all = self.open.values_mut();
        all.for_each(|document| document.analysis = None);
    }

    /// The open file of a URI.
    pub fn get(&self, uri: &lsp::Uri) -> Option<&Document> {
        self.open.get(&path_of(uri))
    }

    /// The open file at a path.
    pub fn at(&self, path: &str) -> Option<&Document> {
        self.open.get(path)
    }

    /// The same, to note something of it.
    pub fn at_mut(&mut self, path: &str) -> Option<&mut Document> {
        self.open.get_mut(path)
    }

    /// All open files.
    pub fn all(&self) -> impl Iterator<Item = &Document> {
        self.open.values()
    }

    /// Open files that are made of the file at `path`, itself included, in the order of their paths.
    pub fn made_of(&self, path: &str) -> Vec<String> {
        let uses = |d: &&Document| d.path == path || d.asked.iter().any(|p| p == path);
        let mut paths: Vec<String> = self
            .open
            .values()
            .filter(uses)
            .map(|d| d.path.clone())
            .collect();
        paths.sort();
        paths
    }

    /// What an open source means, as it is now.
    pub fn analysis(&mut self, path: &str) -> Option<Arc<Analysis>> {
        let document = self.open.get(path)?;
        if document.language != Language::Material {
            return None;
        }
        if let Some(known) = &document.analysis {
            return Some(known.clone());
        }
        let mut loader = Overlay::new(self.texts());
        let analysis = Arc::new(analysis::analyse(path, &mut loader));
        let asked = loader.asked;
        let document = self.open.get_mut(path)?;
        document.asked = asked;
        document.analysis = Some(analysis.clone());
        if !has_syntax_errors(&analysis) {
            document.last_good = Some(analysis.clone());
        }
        Some(analysis)
    }

    /// What an open document of MaterialX means as a source, or what keeps it from being one.
    pub fn imported(&mut self, path: &str) -> Result<Analysis, Vec<ImportError>> {
        let mut loader = Overlay::new(self.texts());
        let imported = loader.imported(path);
        let analysis = imported.map(|source| {
            loader.given = Some((path.to_owned(), source));
            analysis::analyse(path, &mut loader)
        });
        if let Some(document) = self.open.get_mut(path) {
            document.asked = loader.asked;
        }
        analysis
    }

    /// What an open source means now, and what it meant when it last had no syntax errors.
    pub fn both(&mut self, path: &str) -> Option<(Arc<Analysis>, Option<Arc<Analysis>>)> {
        let now = self.analysis(path)?;
        Some((now, self.open.get(path)?.last_good.clone()))
    }

    /// The texts of all open files, by path.
    pub fn texts(&self) -> Texts {
        let texts = self
            .open
            .iter()
            .map(|(path, d)| (path.clone(), d.text.shared()));
        Arc::new(texts.collect())
    }
}

/// Texts that take the place of files, by path.
pub type Texts = Arc<HashMap<String, Arc<str>>>;

/// Where the analysed file is no text of the language, in bytes.
pub fn syntax_errors(analysis: &Analysis) -> impl Iterator<Item = usize> {
    let own = analysis.file();
    let syntax = analysis
        .diagnostics
        .iter()
        .filter(|d| d.code.id().starts_with("E01"));
    syntax
        .filter_map(|d| d.span)
        .filter(move |s| Some(s.file) == own)
        .map(|s| s.start as usize)
}

/// Has the analysed file syntax errors?
pub fn has_syntax_errors(analysis: &Analysis) -> bool {
    analysis.module.is_none() || syntax_errors(analysis).next().is_some()
}

/// Reads files as they are in the editor, and else from the disk.
pub struct Overlay {
    texts: Texts,
    base: PathBuf,
    /// The paths that were asked for.
    pub asked: Vec<String>,
    /// A source that is at hand, and its path.
    given: Option<(String, Source)>,
    /// What texts were made from, by path.
    origins: HashMap<String, Arc<Origin>>,
}

impl Overlay {
    /// Of absolute paths.
    pub fn new(texts: Texts) -> Self {
        Self::within(texts, PathBuf::new())
    }

    /// Of paths that are relative to a folder.
    pub fn within(texts: Texts, base: PathBuf) -> Self {
        Self {
            texts,
            base,
            asked: Vec::new(),
            given: None,
            origins: HashMap::new(),
        }
    }

    /// The source at a normal path.
    fn source(&mut self, path: &str) -> io::Result<Source> {
        if let Some((_, source)) = self.given.take_if(|(given, _)| given == path) {
            return Ok(source);
        }
        if mtlx::is_document(Path::new(path)) {
            return mtlx::source(Path::new(path), &mut Edited(self));
        }
        if let Some(text) = self.texts.get(path) {
            return Ok(text.as_bytes().to_vec().into());
        }
        input::source(Path::new(path), MAX_SOURCE_BYTES)
    }

    /// The source that a document at a normal path becomes.
    fn imported(&mut self, path: &str) -> Result<Source, Vec<ImportError>> {
        mtlx::imported(Path::new(path), &mut Edited(self))
    }
}

/// Files that documents include, as they are in the editor, and else from the disk.
struct Edited<'o>(&'o mut Overlay);

impl Files for Edited<'_> {
    fn read(&mut self, path: &str, most: usize) -> Result<Vec<u8>, String> {
        let path = normal(Path::new(path));
        let read = match self.0.texts.get(&path) {
            Some(text) => Ok(text.as_bytes().to_vec()),
            None => Disk.read(&path, most),
        };
        self.0.asked.push(path);
        read
    }

    fn exists(&mut self, path: &str) -> bool {
        Disk.exists(path)
    }
}

impl Loader for Overlay {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if path.starts_with("std::") {
            return Err("it is the library's".into());
        }
        let path = normal(&self.base.join(path));
        self.asked.push(path.clone());
        let source = self.source(&path);
        let source = source.map_err(|error| input::reason(&error))?;
        if let Some(origin) = source.origin {
            self.origins.insert(path, origin);
        }
        Ok(source.bytes)
    }

    fn origin(&mut self, path: &str) -> Option<Arc<Origin>> {
        let path = normal(&self.base.join(path));
        self.origins.get(&path).cloned()
    }

    fn beside(&mut self, path: &str) -> Vec<String> {
        let folder = self.base.join(path);
        let Some(folder) = folder.parent() else {
            return Vec::new();
        };
        let prefix = path.rfind('/').map_or("", |slash| &path[..=slash]);
        names(folder, "impasto")
            .into_iter()
            .map(|name| format!("{prefix}{name}"))
            .collect()
    }
}

/// Names of the files of a folder with an extension, in their order; not of more than a few thousand.
pub fn names(folder: &Path, extension: &str) -> Vec<String> {
    const MOST: usize = 4096;
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let names = entries.flatten().take(MOST);
    let names = names.filter_map(|entry| entry.file_name().into_string().ok());
    let is_it = |name: &String| Path::new(name).extension().is_some_and(|e| e == extension);
    let mut names: Vec<String> = names.filter(is_it).collect();
    names.sort();
    names
}

/// The text of a file on the disk, if it is one and is text.
pub fn text_at(path: &str) -> Option<String> {
    /// Documents of MaterialX may be longer than sources.
    const MOST: usize = 16 << 20;
    let file = input::open(Path::new(path)).ok()?;
    String::from_utf8(input::at_most(file, MOST).ok()?).ok()
}

/// What the compiler calls the file of a URI.
pub fn path_of(uri: &lsp::Uri) -> String {
    if let Some(module) = library::module_of(uri) {
        return module;
    }
    match uri.to_file_path() {
        Ok(path) => normal(&path),
        Err(()) => uri.to_string(),
    }
}

/// A path without `.` and `..`, so that a file has one name.
pub fn normal(path: &Path) -> String {
    use std::path::Component;
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                if !parts.pop() {
                    parts.push("..");
                }
            }
            part => parts.push(part),
        }
    }
    parts.to_string_lossy().into_owned()
}

fn language_of(path: &str, text: &str) -> Language {
    if mtlx::is_document(Path::new(path)) {
        return Language::MaterialX;
    }
    if !path.ends_with(".toml") {
        return Language::Material;
    }
    let is_scene = path.ends_with("scene.toml")
        || ["[camera]", "[[geometry]]", "[materials."]
            .iter()
            .any(|header| text.contains(header));
    if is_scene {
        Language::Scene
    } else {
        Language::Other
    }
}
