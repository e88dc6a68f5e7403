//! Which files take part in a compilation and what names each of them sees.
//!
//! A file is loaded when something imports it. The standard library is one namespace a folder;
//! a file of it is parsed only when a name in it is asked for.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use impasto_stdlib::StdFile;

use super::Checker;
use crate::ast::{self, ItemKind, Name};
use crate::diag::{self, Code, Diagnostic};
use crate::parser;
use crate::source::{FileId, Span};

/// A loaded file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModuleId(pub usize);

/// A definition: a module and the position among its items.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ItemRef {
    /// The file that defines it.
    pub module: ModuleId,
    /// Position in [`ast::Module::items`].
    pub index: usize,
}

/// A loaded file and its names.
pub struct ModuleData {
    /// Its syntax tree.
    pub ast: Arc<ast::Module>,
    /// Path it was loaded by.
    pub path: String,
    /// Is it part of the standard library?
    pub is_std: bool,
    /// Names of its own and imported items.
    pub names: BTreeMap<String, ItemRef>,
}

/// What became of a file that was asked for.
#[derive(Clone, Copy)]
pub enum Loading {
    /// Its imports are being resolved: asking again is a cycle.
    InProgress(ModuleId),
    /// It is ready.
    Done(ModuleId),
    /// It could not be read; that is reported.
    Failed,
}

impl Checker<'_> {
    /// Loads a user's file; `asked` is the import that needs it.
    pub(super) fn load_module(&mut self, path: &str, asked: Option<&Name>) -> Option<ModuleId> {
        match self.loading.get(path) {
            Some(Loading::Done(id)) => return Some(*id),
            Some(Loading::Failed) => return None,
            Some(Loading::InProgress(_)) => {
                if let Some(name) = asked {
                    let message = format!("`{}` imports itself through other modules", name.node);
                    let cycle = Diagnostic::new(Code::ImportCycle, name.span, message)
                        .expected("modules that import each other in one direction only")
                        .hint("move what both need into a third module");
                    self.report(cycle);
                }
                return None;
            }
            None => {}
        }
        let loaded = self
            .read(path, asked)
            .map(|text| self.add_module(path, &text));
        if loaded.is_none() {
            self.loading.insert(path.to_owned(), Loading::Failed);
        }
        loaded
    }

    fn read(&mut self, path: &str, asked: Option<&Name>) -> Option<String> {
        let problem = match self.loader.load(path) {
            Ok(bytes) => match crate::lexer::decode(path, &bytes) {
                Ok(text) => return Some(text),
                Err(diagnostic) => diagnostic,
            },
            Err(message) => {
                let text = format!("cannot read `{path}`: {message}");
                Diagnostic::without_span(Code::UnknownModule, text)
            }
        };
        let problem = match asked {
            Some(name) => Diagnostic {
                span: Some(name.span),
                ..problem
            }
            .expected("a folder of the standard library (`std::...`) or a file beside this one"),
            None => problem,
        };
        self.report(problem);
        None
    }

    /// Parses a text and resolves its imports.
    fn add_module(&mut self, path: &str, text: &str) -> ModuleId {
        let file = self.sources.add(path, text);
        let (ast, diagnostics) = parser::parse(file, text);
        self.define_module(path, Arc::new(ast), diagnostics, false)
    }

    fn define_module(
        &mut self,
        path: &str,
        ast: Arc<ast::Module>,
        diagnostics: Vec<Diagnostic>,
        is_std: bool,
    ) -> ModuleId {
        let id = ModuleId(self.modules.len());
        self.leave_out_broken(id, &ast, &diagnostics);
        diagnostics.into_iter().for_each(|d| self.report(d));
        self.modules.push(ModuleData {
            ast: ast.clone(),
            path: path.to_owned(),
            is_std,
            names: BTreeMap::new(),
        });
        self.loading
            .insert(path.to_owned(), Loading::InProgress(id));
        self.define_items(id, &ast);
        for import in &ast.uses {
            if self.has_enough_errors() {
                break;
            }
            self.import(id, import);
        }
        self.loading.insert(path.to_owned(), Loading::Done(id));
        id
    }

    /// Definitions with an error of syntax are not checked: what the parser left of them would
    /// only give errors that follow from the first.
    fn leave_out_broken(&mut self, module: ModuleId, ast: &ast::Module, found: &[Diagnostic]) {
        let syntax = found
            .iter()
            .filter(|d| matches!(d.code, Code::Syntax | Code::Unclosed));
        let places: Vec<Span> = syntax.filter_map(|d| d.span).collect();
        for (index, item) in ast.items.iter().enumerate() {
            let inside = |p: &Span| item.span.start <= p.start && p.start < item.span.end;
            if places.iter().any(inside) {
                self.broken.insert(ItemRef { module, index });
            }
        }
    }

    fn define_items(&mut self, module: ModuleId, ast: &ast::Module) {
        for (index, item) in ast.items.iter().enumerate() {
            self.define(module, &item.name, ItemRef { module, index });
        }
    }

    fn define(&mut self, module: ModuleId, name: &Name, item: ItemRef) {
        let names = &mut self.modules[module.0].names;
        match names.get(&name.node).copied() {
            Some(first) if first != item => {
                let first = self.item(first).name.span;
                let message = format!("`{}` is defined twice", name.node);
                let duplicate = Diagnostic::new(Code::Duplicate, name.span, message)
                    .expected("one definition a name")
                    .label(first, "first defined here")
                    .hint("rename one of them, or import it with `as`");
                self.report(duplicate);
            }
            _ => drop(names.insert(name.node.clone(), item)),
        }
    }

    fn import(&mut self, module: ModuleId, import: &ast::Use) {
        let Some(first) = import.path.first() else {
            return;
        };
        for wanted in &import.names {
            let item = if first.node == "std" {
                self.import_std(import, &wanted.name)
            } else {
                self.import_file(module, import, &wanted.name)
            };
            if let Some(item) = item {
                self.define(module, wanted.alias.as_ref().unwrap_or(&wanted.name), item);
            }
        }
    }

    fn import_std(&mut self, import: &ast::Use, wanted: &Name) -> Option<ItemRef> {
        let [_, folder] = import.path.as_slice() else {
            self.unknown_std_folder(import.span, import.path.get(1).map_or("", |n| &n.node));
            return None;
        };
        if !folders().contains(&folder.node.as_str()) {
            self.unknown_std_folder(folder.span, &folder.node);
            return None;
        }
        if let Some(item) = self.find_std(&folder.node, &wanted.node) {
            return Some(item);
        }
        let names = self.std_names(&folder.node);
        let message = format!("`std::{}` has no `{}`", folder.node, wanted.node);
        let elsewhere = folders()
            .into_iter()
            .find(|f| self.std_names(f).contains(&wanted.node));
        let unknown = Diagnostic::new(Code::UnknownImport, wanted.span, message)
            .expected(format!("one of {}", list(names.iter().map(String::as_str))));
        self.report(match elsewhere {
            Some(other) => unknown.hint(format!("it is in `std::{other}`")),
            None => unknown.did_you_mean(&wanted.node, names.iter().map(String::as_str)),
        });
        None
    }

    fn unknown_std_folder(&mut self, span: Span, name: &str) {
        let folders = folders();
        let message = format!("the standard library has no module `{name}`");
        let unknown = Diagnostic::new(Code::UnknownModule, span, message)
            .expected(format!("one of {}", list(folders.iter().copied())))
            .did_you_mean(name, folders.iter().copied());
        self.report(unknown);
    }

    fn import_file(
        &mut self,
        module: ModuleId,
        import: &ast::Use,
        wanted: &Name,
    ) -> Option<ItemRef> {
        let folder = parent(&self.modules[module.0].path);
        let names: Vec<&str> = import.path.iter().map(|n| n.node.as_str()).collect();
        let path = format!("{folder}{}.impasto", names.join("/"));
        let from = self.load_module(&path, import.path.last())?;
        let found = self.modules[from.0]
            .ast
            .items
            .iter()
            .position(|i| i.name.node == wanted.node);
        if found.is_none() {
            let ast = self.modules[from.0].ast.clone();
            let names = ast.items.iter().map(|i| i.name.node.as_str());
            let message = format!("`{path}` has no `{}`", wanted.node);
            let unknown = Diagnostic::new(Code::UnknownImport, wanted.span, message)
                .expected("a name that the module defines")
                .did_you_mean(&wanted.node, names);
            self.report(unknown);
        }
        found.map(|index| ItemRef {
            module: from,
            index,
        })
    }

    /// The item called `name` in a folder of the standard library.
    pub(super) fn find_std(&mut self, folder: &str, name: &str) -> Option<ItemRef> {
        let files = impasto_stdlib::files()
            .iter()
            .filter(|f| f.folder == folder);
        // By convention the file is named after what it defines; other files are the exception.
        let (first, rest): (Vec<_>, Vec<_>) = files.partition(|f| f.name == name);
        first.into_iter().chain(rest).find_map(|file| {
            let module = self.std_module(file)?;
            let items = &self.modules[module.0].ast.items;
            let index = items.iter().position(|i| i.name.node == name)?;
            Some(ItemRef { module, index })
        })
    }

    fn std_names(&mut self, folder: &str) -> Vec<String> {
        let files: Vec<_> = impasto_stdlib::files()
            .iter()
            .filter(|f| f.folder == folder)
            .collect();
        let mut names = Vec::new();
        for file in files {
            if let Some(module) = self.std_module(file) {
                let items = self.modules[module.0].ast.items.iter();
                names.extend(items.map(|i| i.name.node.clone()));
            }
        }
        names.sort();
        names
    }

    /// Loads a file of the standard library. One that is being loaded is visible already: its
    /// items are known before its imports are.
    pub(super) fn std_module(&mut self, file: &StdFile) -> Option<ModuleId> {
        let path = std_path(file);
        match self.loading.get(&path) {
            Some(Loading::Done(id) | Loading::InProgress(id)) => Some(*id),
            Some(Loading::Failed) => None,
            None => {
                let (ast, diagnostics) = parsed_std(file)?;
                Some(self.define_module(&path, ast, diagnostics, true))
            }
        }
    }

    /// Adds the texts of the standard library, so that each has the same id in every compilation.
    pub(super) fn add_std_sources(&mut self) {
        for file in impasto_stdlib::files() {
            self.sources.add(std_path(file), file.text);
        }
    }

    /// Loads `std::core`, which every file sees.
    pub(super) fn load_core(&mut self) {
        for file in impasto_stdlib::files()
            .iter()
            .filter(|f| f.folder == "core")
        {
            if let Some(module) = self.std_module(file) {
                let items = self.modules[module.0].ast.clone();
                for (index, item) in items.items.iter().enumerate() {
                    self.core
                        .insert(item.name.node.clone(), ItemRef { module, index });
                }
            }
        }
    }

    /// What `name` means in `module`.
    pub(super) fn lookup(&self, module: ModuleId, name: &str) -> Option<ItemRef> {
        let own = self.modules[module.0].names.get(name);
        own.or_else(|| self.core.get(name)).copied()
    }

    /// The definition itself.
    pub(super) fn item(&self, item: ItemRef) -> &ast::Item {
        &self.modules[item.module.0].ast.items[item.index]
    }

    /// Names of items of some kind that `module` sees, for hints.
    pub(super) fn visible(
        &self,
        module: ModuleId,
        wanted: impl Fn(&ItemKind) -> bool,
    ) -> Vec<String> {
        let all = self.modules[module.0].names.iter().chain(&self.core);
        let wanted = all.filter(|(_, item)| wanted(&self.item(**item).kind));
        wanted.map(|(name, _)| name.clone()).collect()
    }

    /// The `use` that brings the definition of the standard library whose name is `name`, or
    /// near it.
    pub(super) fn importable(&self, name: &str) -> Option<String> {
        let files = || {
            impasto_stdlib::files()
                .iter()
                .filter(|f| f.folder != "core")
        };
        let nearest = diag::nearest(name, files().map(|f| f.name))?;
        let file = files().find(|f| f.name == nearest)?;
        Some(format!("use std::{}::{};", file.folder, file.name))
    }
}

/// The syntax tree of a standard library file with its errors: parsed at most once a process,
/// since the library never changes and its files have the same ids in every compilation.
fn parsed_std(file: &StdFile) -> Option<(Arc<ast::Module>, Vec<Diagnostic>)> {
    type Parsed = OnceLock<(Arc<ast::Module>, Vec<Diagnostic>)>;
    static TREES: OnceLock<Vec<Parsed>> = OnceLock::new();
    let files = impasto_stdlib::files();
    let trees = TREES.get_or_init(|| files.iter().map(|_| OnceLock::new()).collect());
    let index = files.iter().position(|f| f == file)?;
    let parse = || {
        let (ast, diagnostics) = parser::parse(FileId(index as u32), file.text);
        (Arc::new(ast), diagnostics)
    };
    Some(trees[index].get_or_init(parse).clone())
}

/// The path of a standard library file in diagnostics.
pub fn std_path(file: &StdFile) -> String {
    format!("std/{}/{}.impasto", file.folder, file.name)
}

/// Folders of the standard library that can be imported from.
fn folders() -> Vec<&'static str> {
    let mut folders: Vec<&str> = impasto_stdlib::files().iter().map(|f| f.folder).collect();
    folders.dedup();
    folders.retain(|f| *f != "core");
    folders
}

/// `a`, `b` and `c`
pub(super) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|n| format!("`{n}`")).collect();
    names.join(", ")
}

/// The folder of a path with its slash, or nothing.
pub(super) fn parent(path: &str) -> &str {
    path.rfind('/').map_or("", |slash| &path[..=slash])
}
