//! Which files take part in a compilation and what names each of them sees.
//!
//! A file is loaded when something imports it. The standard library is one namespace a folder;
//! a file of it is parsed only when a name in it is asked for.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use impasto_stdlib::StdFile;

use super::Checker;
use super::imports::folders;
use crate::ast::{self, ItemKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::loader::library_text;
use crate::parser;
use crate::source::{FileId, Span};
use crate::stages::Stage;

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
    /// Its text.
    pub file: FileId,
    /// Its syntax tree.
    pub ast: Arc<ast::Module>,
    /// Path it was loaded by.
    pub path: String,
    /// Is it part of the standard library?
    pub is_std: bool,
    /// Names of its own and imported items.
    pub names: BTreeMap<String, ItemRef>,
    /// Those that something in it uses; not kept of the library.
    pub looked_up: RefCell<BTreeSet<String>>,
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

/// Most materials of a file. Each is compiled, however small.
const MAX_MATERIALS: usize = 1024;

impl Checker<'_> {
    /// Loads a user's file; `asked` is the import that needs it.
    pub(super) fn load_module(&mut self, path: &str, asked: Option<&Name>) -> Option<ModuleId> {
        match self.loading.get(path) {
            Some(Loading::Done(id)) => return Some(*id),
            Some(Loading::Failed) => return None,
            Some(Loading::InProgress(_)) => {
                self.import_cycle(path, asked);
                return None;
            }
            None => {}
        }
        self.importing.push(path.to_owned());
        let loaded = self
            .read(path, asked)
            .map(|text| self.add_module(path, &text));
        self.importing.pop();
        if loaded.is_none() {
            self.loading.insert(path.to_owned(), Loading::Failed);
        }
        loaded
    }

    /// Reports an import that leads back to the file at `path`.
    fn import_cycle(&mut self, path: &str, asked: Option<&Name>) {
        let Some(name) = asked else { return };
        let first = self.importing.iter().position(|p| p == path).unwrap_or(0);
        let chain = self.importing[first..].iter().map(String::as_str);
        let names: Vec<&str> = chain
            .chain([path])
            .map(|p| p.strip_suffix(".impasto").unwrap_or(p))
            .collect();
        let cycle = match names.as_slice() {
            [_, _] => {
                let message = format!("`{}` imports itself", name.node);
                Diagnostic::new(Code::ImportCycle, name.span, message)
                    .expected("another module")
                    .hint("what a file defines is in scope in it already")
            }
            names => {
                let message = format!("modules import each other: {}", names.join(" -> "));
                Diagnostic::new(Code::ImportCycle, name.span, message)
                    .expected("modules that import each other in one direction only")
                    .hint("move what both need into a third module")
            }
        };
        self.report(cycle);
    }

    fn read(&mut self, path: &str, asked: Option<&Name>) -> Option<String> {
        let loaded = match (self.loader.load(path), library_text(path)) {
            (Err(_), Some(text)) => text.map(|text| text.as_bytes().to_vec()),
            (loaded, _) => loaded,
        };
        let problem = match loaded {
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
            Some(name) => {
                let problem = Diagnostic {
                    span: Some(name.span),
                    ..problem
                };
                let expected =
                    "a folder of the standard library (`std::...`) or a file beside this one";
                self.suggest_module(problem.expected(expected), path, &name.node)
            }
            None => problem,
        };
        self.report(problem);
        None
    }

    /// Hints at the module that a name for one that is not there may mean.
    fn suggest_module(&mut self, problem: Diagnostic, path: &str, name: &str) -> Diagnostic {
        if folders().contains(&name) {
            let fixed = match problem.span {
                Some(span) => problem.replaced(span, Some(name), &format!("std::{name}")),
                None => problem,
            };
            return fixed.hint(format!("the library is in `std`: `use std::{name}::...;`"));
        }
        let beside = self.loader.beside(path);
        let own = self.importing.iter().rev().nth(1);
        let known = |p: &&String| own != Some(*p);
        let names = beside.iter().filter(known).filter_map(|p| {
            let file = p.rsplit('/').next().unwrap_or(p);
            file.strip_suffix(".impasto")
        });
        problem.did_you_mean(name, names)
    }

    /// Parses a text and resolves its imports.
    fn add_module(&mut self, path: &str, text: &str) -> ModuleId {
        let file = match self.loader.origin(path) {
            Some(origin) => self.sources.add_made(path, text, origin),
            None => self.sources.add(path, text),
        };
        let before = self.progress.enter(Stage::Parse);
        let (ast, diagnostics) = parser::parse(file, text);
        self.progress.enter(before);
        let is_std = path.starts_with("std::");
        self.define_module(path, file, (Arc::new(ast), diagnostics), is_std)
    }

    fn define_module(
        &mut self,
        path: &str,
        file: FileId,
        (ast, diagnostics): Parsed,
        is_std: bool,
    ) -> ModuleId {
        let id = ModuleId(self.modules.len());
        self.leave_out_broken(id, &ast, &diagnostics);
        diagnostics.into_iter().for_each(|d| self.report(d));
        self.modules.push(ModuleData {
            file,
            ast: ast.clone(),
            path: path.to_owned(),
            is_std,
            names: BTreeMap::new(),
            looked_up: RefCell::default(),
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
        // `a ? b : c`: what comes before the mark is no value of what is wanted.
        let is_choice = |d: &Diagnostic| {
            let text = |span: Span| self.sources.file(span.file).text.get(span.range());
            d.code == Code::UnknownCharacter && d.span.and_then(text) == Some("?")
        };
        let syntax = found
            .iter()
            .filter(|d| matches!(d.code, Code::Syntax | Code::Unclosed) || is_choice(d));
        let places: Vec<Span> = syntax.filter_map(|d| d.span).collect();
        for (index, item) in ast.items.iter().enumerate() {
            let inside = |p: &Span| item.span.start <= p.start && p.start < item.span.end;
            if places.iter().any(inside) {
                self.broken.insert(ItemRef { module, index });
            }
        }
    }

    fn define_items(&mut self, module: ModuleId, ast: &ast::Module) {
        let is_material = |item: &&ast::Item| matches!(item.kind, ItemKind::Material(_));
        if let Some(extra) = ast.items.iter().filter(is_material).nth(MAX_MATERIALS) {
            let message = "the file defines too many materials";
            let wrong = Diagnostic::new(Code::TooLarge, extra.name.span, message)
                .expected(format!("at most {MAX_MATERIALS}"))
                .hint("divide it into several files, or let instances of one material differ in parameters");
            self.report(wrong);
        }
        for (index, item) in ast.items.iter().enumerate() {
            self.define(module, &item.name, ItemRef { module, index });
        }
    }

    pub(super) fn define(&mut self, module: ModuleId, name: &Name, item: ItemRef) {
        let names = &mut self.modules[module.0].names;
        match names.get(&name.node).copied() {
            Some(first) if first != item => {
                let is_function = |i: ItemRef| matches!(self.item(i).kind, ItemKind::Function(_));
                let functions =
                    first.module == item.module && is_function(first) && is_function(item);
                let first_span = self.item(first).name.span;
                let message = format!("`{}` is defined twice", name.node);
                let duplicate = Diagnostic::new(Code::Duplicate, name.span, message)
                    .expected("one definition a name")
                    .label(first_span, "first defined here");
                let hint = if functions {
                    "functions are not overloaded: give each a name of its own, or one of them defaults"
                } else {
                    "rename one of them, or import it with `as`"
                };
                self.report(duplicate.hint(hint));
            }
            _ => drop(names.insert(name.node.clone(), item)),
        }
    }

    /// Loads a file of the standard library. One that is being loaded is visible already: its
    /// items are known before its imports are.
    pub(super) fn std_module(&mut self, file: &StdFile) -> Option<ModuleId> {
        let path = std_path(file);
        match self.loading.get(&path) {
            Some(Loading::Done(id) | Loading::InProgress(id)) => Some(*id),
            Some(Loading::Failed) => None,
            None => {
                let before = self.progress.enter(Stage::Parse);
                let parsed = parsed_std(file);
                self.progress.enter(before);
                let (file, parsed) = parsed?;
                Some(self.define_module(&path, file, parsed, true))
            }
        }
    }

    /// Adds the texts of the standard library, so that each has the same id in every compilation.
    pub(super) fn add_std_sources(&mut self) {
        for file in impasto_stdlib::files() {
            self.sources.add_library(std_path(file), file.text);
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
                let public = items.items.iter().enumerate().filter(|(_, i)| !i.private);
                for (index, item) in public {
                    self.core
                        .insert(item.name.node.clone(), ItemRef { module, index });
                }
            }
        }
    }

    /// What `name` means in `module`, which uses it.
    pub(super) fn lookup(&self, module: ModuleId, name: &str) -> Option<ItemRef> {
        let data = &self.modules[module.0];
        if !data.is_std && data.names.contains_key(name) {
            data.looked_up.borrow_mut().insert(name.to_owned());
        }
        let own = data.names.get(name);
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
}

/// A syntax tree with its errors.
type Parsed = (Arc<ast::Module>, Vec<Diagnostic>);

/// The syntax tree of a standard library file with its errors: parsed at most once a process,
/// since the library never changes and its files have the same ids in every compilation.
fn parsed_std(file: &StdFile) -> Option<(FileId, Parsed)> {
    static TREES: OnceLock<Vec<OnceLock<Parsed>>> = OnceLock::new();
    let files = impasto_stdlib::files();
    let trees = TREES.get_or_init(|| files.iter().map(|_| OnceLock::new()).collect());
    let index = files.iter().position(|f| f == file)?;
    let id = FileId(index as u32);
    let parse = || {
        let (ast, diagnostics) = parser::parse(id, file.text);
        (Arc::new(ast), diagnostics)
    };
    Some((id, trees[index].get_or_init(parse).clone()))
}

/// The path of a standard library file in diagnostics.
pub fn std_path(file: &StdFile) -> String {
    format!("std/{}/{}.impasto", file.folder, file.name)
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
