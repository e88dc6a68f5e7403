//! What `use` brings into a file: definitions of the library's folders and of files beside it.

use crate::ast::{self, Item, Name};
use crate::diag::{self, Code, Diagnostic};
use crate::source::Span;

use super::Checker;
use super::modules::{ItemRef, ModuleId, list, parent};

impl Checker<'_> {
    pub(super) fn import(&mut self, module: ModuleId, import: &ast::Use) {
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
            return self.allowed(item, wanted, &format!("std::{}", folder.node));
        }
        let names = self.std_names(&folder.node);
        let message = format!("`std::{}` has no `{}`", folder.node, wanted.node);
        let elsewhere = folders()
            .into_iter()
            .find(|f| self.std_names(f).contains(&wanted.node));
        let unknown = Diagnostic::new(Code::UnknownImport, wanted.span, message)
            .expected(format!("one of {}", list(names.iter().map(String::as_str))));
        self.report(match elsewhere {
            Some(other) => unknown.hint(format!("it is in `std::{other}`")).replaced(
                folder.span,
                Some(&folder.node),
                other,
            ),
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
        let ast = self.ast(from);
        if let Some(index) = ast.items.iter().position(|i| i.name.node == wanted.node) {
            let module = from;
            return self.allowed(ItemRef { module, index }, wanted, &path);
        }
        let names: Vec<&str> = public(&ast.items).map(|i| i.name.node.as_str()).collect();
        let message = format!("`{path}` has no `{}`", wanted.node);
        let unknown = Diagnostic::new(Code::UnknownImport, wanted.span, message)
            .expected(match names.as_slice() {
                [] => "a module that defines something".to_owned(),
                names => format!("one of {}", list(names.iter().copied())),
            })
            .did_you_mean(&wanted.node, names);
        self.report(unknown);
        None
    }

    /// `item`, unless it is private to its file, which is reported.
    fn allowed(&mut self, item: ItemRef, wanted: &Name, from: &str) -> Option<ItemRef> {
        let found = self.item(item);
        if !found.private {
            return Some(item);
        }
        let (name, is_std) = (found.name.span, self.modules[item.module.0].is_std);
        let message = format!("`{}` is private to `{from}`", wanted.node);
        let private = Diagnostic::new(Code::PrivateItem, wanted.span, message)
            .expected("a definition without the mark `private`")
            .label(name, "defined here");
        let hint = if is_std {
            "import what the library makes of it, or copy it"
        } else {
            "remove `private` there, or import what the module makes of it"
        };
        self.report(private.hint(hint));
        None
    }

    /// Warns of imports of a file that nothing in it uses, once all of the file is checked.
    pub fn report_unused_imports(&mut self, module: ModuleId) {
        let ast = self.ast(module);
        for wanted in ast.uses.iter().flat_map(|import| &import.names) {
            let name = wanted.alias.as_ref().unwrap_or(&wanted.name);
            let data = &self.modules[module.0];
            let is_used = data.looked_up.borrow().contains(&name.node);
            let is_meant = name.node.starts_with('_');
            if is_used || is_meant || data.is_std || !data.names.contains_key(&name.node) {
                continue;
            }
            let message = format!("the import `{}` is never used", name.node);
            let unused = Diagnostic::new(Code::Unused, name.span, message).hint(format!(
                "remove it, or call it `_{0}`: `{0} as _{0}`",
                wanted.name.node
            ));
            self.report(unused);
        }
    }

    /// The item called `name` in a folder of the standard library; a private one only if there is
    /// no other.
    pub(super) fn find_std(&mut self, folder: &str, name: &str) -> Option<ItemRef> {
        let files = impasto_stdlib::files()
            .iter()
            .filter(|f| f.folder == folder);
        // By convention the file is named after what it defines; other files are the exception.
        let (first, rest): (Vec<_>, Vec<_>) = files.partition(|f| f.name == name);
        let mut private = None;
        for file in first.into_iter().chain(rest) {
            let Some(module) = self.std_module(file) else {
                continue;
            };
            let items = &self.modules[module.0].ast.items;
            let Some(index) = items.iter().position(|i| i.name.node == name) else {
                continue;
            };
            let item = ItemRef { module, index };
            if !items[index].private {
                return Some(item);
            }
            private = private.or(Some(item));
        }
        private
    }

    fn std_names(&mut self, folder: &str) -> Vec<String> {
        let files: Vec<_> = impasto_stdlib::files()
            .iter()
            .filter(|f| f.folder == folder)
            .collect();
        let mut names = Vec::new();
        for file in files {
            if let Some(module) = self.std_module(file) {
                let items = public(&self.modules[module.0].ast.items);
                names.extend(items.map(|i| i.name.node.clone()));
            }
        }
        names.sort();
        names
    }

    /// The path of the definition of the standard library whose name is `name`.
    pub(super) fn in_library(&self, name: &str) -> Option<String> {
        let files = impasto_stdlib::files();
        let file = files
            .iter()
            .find(|f| f.name == name && f.folder != "core")?;
        Some(format!("std::{}::{}", file.folder, file.name))
    }

    /// The path of the definition of the standard library whose name is `name`, or near it.
    pub(super) fn importable(&self, name: &str) -> Option<String> {
        let files = || {
            impasto_stdlib::files()
                .iter()
                .filter(|f| f.folder != "core")
        };
        let nearest = diag::nearest(name, files().map(|f| f.name))?;
        let file = files().find(|f| f.name == nearest)?;
        Some(format!("std::{}::{}", file.folder, file.name))
    }
}

/// What other files can import.
fn public(items: &[Item]) -> impl Iterator<Item = &Item> {
    items.iter().filter(|i| !i.private)
}

/// Folders of the standard library that can be imported from.
pub(super) fn folders() -> Vec<&'static str> {
    let mut folders: Vec<&str> = impasto_stdlib::files().iter().map(|f| f.folder).collect();
    folders.dedup();
    folders.retain(|f| *f != "core");
    folders
}
