//! Checking: names and types of a syntax tree, and its lowering to IR in the same walk.
//!
//! Definitions are checked when something asks for them, callees before callers, so what a
//! material does not reach never exists after this stage. [`Checker`] owns the modules and the
//! IR under construction; `body::Body` checks one function or material.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::ast::{self, ItemKind};
use crate::diag::{Code, Diagnostic, foreign};
use crate::ir::verify::MAX_FIELDS;
use crate::ir::{self, ClosureDefId, Const, FunctionId, StructId};
use crate::loader::Loader;
use crate::source::{SourceMap, Span};
use crate::stages::{Progress, Stage};

mod any_count;
mod array;
mod assign;
mod body;
mod call;
mod called;
mod closure;
mod constant;
mod convert;
mod expr;
mod filter;
mod given;
mod gradient;
mod imports;
mod inline;
mod inputs;
mod material;
mod matrix;
mod medium;
mod metadata;
mod modules;
pub mod notes;
mod outputs;
mod params;
mod purpose;
mod scopes;
mod slope;
mod stmt;
mod test;
mod texture;
mod tree;
pub mod types;
mod unroll;
mod unsigned;
mod varying;
pub mod words;

use called::MaterialSignature;
pub use called::{Declared, Origin, Whole, WholeArgument};
pub use metadata::Metadata;
pub use modules::{ItemRef, ModuleId, std_path};
use modules::{Loading, ModuleData};
use notes::Notes;
pub use test::{Assertion, Test};
use types::Ty;

/// Everything known while a compilation's sources are checked.
pub struct Checker<'a> {
    /// Texts read so far.
    pub sources: SourceMap,
    /// What was found wrong.
    pub diagnostics: Vec<Diagnostic>,
    /// What was lowered so far.
    pub ir: ir::Module,
    /// Textures that sources name outside parameters.
    pub literal_textures: BTreeSet<usize>,
    /// Tells which stage the compilation is at.
    pub progress: Progress<'a>,
    loader: &'a mut dyn Loader,
    modules: Vec<ModuleData>,
    loading: BTreeMap<String, Loading>,
    core: BTreeMap<String, ItemRef>,
    checked: BTreeMap<ItemRef, Checked>,
    /// Materials that were checked on their own.
    materials: BTreeMap<ItemRef, Option<ir::Material>>,
    /// Of those that are a call of another material, whole, that call.
    wholes: BTreeMap<ItemRef, Whole>,
    /// Materials being checked, each called by the one before it.
    expanding: Vec<ItemRef>,
    /// Files that are being loaded, each imported by the one before it.
    importing: Vec<String>,
    /// Private definitions that something of their file uses.
    used: BTreeSet<ItemRef>,
    /// Definitions with errors of syntax, which are not checked.
    broken: BTreeSet<ItemRef>,
    /// Signatures of `ir.functions` that a call can name.
    signatures: BTreeMap<FunctionId, Arc<Signature>>,
    /// Surface types of the fields of `ir.structs`.
    fields: Vec<Arc<[Param]>>,
    /// Signatures of `ir.closures`.
    closure_params: Vec<Arc<[Param]>>,
    /// Array types, by the structs that store them.
    arrays: BTreeMap<StructId, array::Array>,
    /// Functions of arrays of any length, by what they are called with.
    instances: BTreeMap<(ItemRef, Vec<StructId>), FunctionId>,
    /// Expressions and statements that calls of closure functions were replaced by.
    expanded: u64,
    /// Errors reported.
    errors: usize,
    /// Warnings reported.
    warnings: usize,
    /// Expressions that evaluating constants took.
    evaluated: u64,
    /// What is kept of the checking of one file, if anything is.
    pub(crate) notes: Option<Notes>,
}

/// Errors of checking that are reported; what is as wrong as that is not looked at further.
const MAX_ERRORS: usize = 64;

/// Warnings that are reported.
const MAX_WARNINGS: usize = 256;

/// How far an item is checked.
#[derive(Clone, Debug)]
enum Checked {
    InProgress,
    Failed,
    Function(FunctionId),
    /// A function of arrays of any length; each call has its own, for the lengths given.
    AnyCount(Arc<Signature>),
    Struct(StructId),
    Closure(ClosureDefId, Ty),
    /// A function that returns a closure.
    ClosureFunction(Arc<Signature>),
    /// A material, by its parameters.
    Material(MaterialSignature),
    /// The value of a constant; of an array, those of its elements.
    Const(Vec<Const>, Ty),
}

/// A parameter or field with its type as seen by authors.
#[derive(Clone, Debug)]
struct Param {
    name: String,
    ty: Ty,
    default: Option<Const>,
}

/// How a function is called.
#[derive(Clone, Debug)]
struct Signature {
    params: Vec<Param>,
    result: Ty,
}

impl<'a> Checker<'a> {
    /// A checker that reads files through `loader`.
    pub fn new(loader: &'a mut dyn Loader) -> Self {
        Self::with_progress(loader, Progress::silent())
    }

    /// A checker that reads files through `loader` and says which stage it is at.
    pub fn with_progress(loader: &'a mut dyn Loader, progress: Progress<'a>) -> Self {
        let mut checker = Self {
            sources: SourceMap::default(),
            diagnostics: Vec::new(),
            ir: ir::Module::default(),
            literal_textures: Default::default(),
            progress,
            loader,
            modules: Vec::new(),
            loading: BTreeMap::new(),
            core: BTreeMap::new(),
            checked: BTreeMap::new(),
            materials: BTreeMap::new(),
            wholes: BTreeMap::new(),
            expanding: Vec::new(),
            importing: Vec::new(),
            used: BTreeSet::new(),
            broken: BTreeSet::new(),
            signatures: BTreeMap::new(),
            fields: Vec::new(),
            closure_params: Vec::new(),
            arrays: BTreeMap::new(),
            instances: BTreeMap::new(),
            expanded: 0,
            errors: 0,
            warnings: 0,
            evaluated: 0,
            notes: None,
        };
        checker.add_std_sources();
        checker.load_core();
        checker.progress.enter(Stage::Check);
        checker
    }

    /// Loads the file at `path`, with everything it imports.
    pub fn load(&mut self, path: &str) -> Option<ModuleId> {
        self.load_module(path, None)
    }

    /// The syntax tree of a loaded file.
    pub fn ast(&self, module: ModuleId) -> std::sync::Arc<ast::Module> {
        self.modules[module.0].ast.clone()
    }

    /// Checks every definition of a file, used or not; of its materials, the parameters only.
    pub fn check_items(&mut self, module: ModuleId) {
        for index in 0..self.ast(module).items.len() {
            if self.has_enough_errors() {
                return;
            }
            self.demand(ItemRef { module, index }, None);
        }
    }

    /// Checks all of a file, the bodies of its materials and its tests too; gives those of them that check.
    pub fn check_all(&mut self, module: ModuleId) -> (Vec<ir::Material>, Vec<Test>) {
        self.check_items(module);
        let mut materials = Vec::new();
        for (index, item) in self.ast(module).items.iter().enumerate() {
            if let ItemKind::Material(_) = item.kind {
                materials.extend(self.material(module, index));
            }
        }
        let tests = self.tests(module);
        self.report_unused_items(module);
        self.report_unused_imports(module);
        (materials, tests)
    }

    /// Warns of private definitions of a file that nothing uses, once all of the file is checked.
    pub fn report_unused_items(&mut self, module: ModuleId) {
        let ast = self.ast(module);
        for (index, item) in ast.items.iter().enumerate() {
            let used = self.used.contains(&ItemRef { module, index });
            let name = &item.name;
            if !item.private || used || name.node.starts_with('_') {
                continue;
            }
            let message = format!("`{}` is private and never used", name.node);
            let unused = Diagnostic::new(Code::Unused, name.span, message)
                .hint(format!("remove it, or call it `_{}`", name.node))
                .replaced(name.span, Some(&name.node), &format!("_{}", name.node));
            self.report(unused);
        }
    }

    /// The call that a checked material is, if it is one whole.
    pub fn whole(&self, item: ItemRef) -> Option<&Whole> {
        self.wholes.get(&item)
    }

    /// What a definition is called, and the folder of the library that has it.
    pub fn named(&self, item: ItemRef) -> (Option<&'static str>, String) {
        let name = self.item(item).name.node.clone();
        let file = self.modules[item.module.0].file;
        let own = impasto_stdlib::files().get(file.0 as usize);
        (own.map(|own| own.folder), name)
    }

    /// The struct of `std::core` called `name`.
    pub fn core_struct(&mut self, name: &str) -> Option<StructId> {
        let item = self.core.get(name).copied()?;
        match self.demand(item, None)? {
            Checked::Struct(id) => Some(id),
            _ => None,
        }
    }

    /// The function of `std::core` called `name`.
    pub fn core_function(&mut self, name: &str) -> Option<FunctionId> {
        let item = self.core.get(name).copied()?;
        match self.demand(item, None)? {
            Checked::Function(id) => Some(id),
            _ => None,
        }
    }

    /// The bsdf or edf that the file `name` of a folder of the library defines.
    pub fn library_closure(&mut self, folder: &str, name: &str) -> Option<ClosureDefId> {
        let files = impasto_stdlib::files().iter();
        let file = files
            .copied()
            .find(|f| f.folder == folder && f.name == name)?;
        let module = self.std_module(&file)?;
        let ast = self.ast(module);
        let index = ast.items.iter().position(|item| item.name.node == name)?;
        match self.demand(ItemRef { module, index }, None)? {
            Checked::Closure(id, _) => Some(id),
            _ => None,
        }
    }

    /// Notes a problem.
    fn report(&mut self, mut diagnostic: Diagnostic) {
        let (count, most, word) = if diagnostic.is_error() {
            (&mut self.errors, MAX_ERRORS, "error")
        } else {
            (&mut self.warnings, MAX_WARNINGS, "warning")
        };
        *count += 1;
        let count = *count;
        if count > most || (self.has_enough_errors() && !diagnostic.is_error()) {
            return;
        }
        if count == most {
            let more = format!("this is the last {word} that is shown; there may be more");
            let hint = diagnostic.hint.map_or(String::new(), |h| h + "; ");
            diagnostic.hint = Some(hint + &more);
        }
        self.diagnostics.push(diagnostic);
    }

    /// Is so much wrong that checking ends?
    fn has_enough_errors(&self) -> bool {
        self.errors >= MAX_ERRORS
    }

    /// Checks an item if that has not happened, of a material its parameters; `None` if it does
    /// not check.
    fn demand(&mut self, item: ItemRef, asked: Option<Span>) -> Option<Checked> {
        if asked.is_some() {
            self.used.insert(item);
        }
        if self.broken.contains(&item) {
            return None;
        }
        match self.checked.get(&item) {
            Some(Checked::InProgress) => {
                self.recursion(item, asked);
                return None;
            }
            Some(Checked::Failed) => return None,
            Some(done) => return Some(done.clone()),
            None => {}
        }
        self.checked.insert(item, Checked::InProgress);
        let ast = self.ast(item.module);
        let definition = &ast.items[item.index];
        // Definitions may ask for each other in a long chain.
        let checked = stacker::maybe_grow(256 << 10, 2 << 20, || match &definition.kind {
            ItemKind::Function(f) => self.function(item.module, definition, f),
            ItemKind::Struct(fields) => self.structure(item.module, definition, fields),
            ItemKind::Closure(c) => self.closure_def(item.module, definition, c),
            ItemKind::Const(c) => self.constant_item(item.module, c),
            ItemKind::Material(m) => Some(self.material_signature(item.module, m)),
        });
        self.checked
            .insert(item, checked.clone().unwrap_or(Checked::Failed));
        checked
    }

    fn recursion(&mut self, item: ItemRef, asked: Option<Span>) {
        let name = self.item(item).name.clone();
        let message = format!("`{}` is defined in terms of itself", name.node);
        let recursion = Diagnostic::new(Code::Recursion, asked.unwrap_or(name.span), message)
            .expected("definitions that do not lead back to themselves")
            .hint("use a bounded loop: `for i in 0..n { ... }`")
            .label(name.span, "defined here");
        self.report(recursion);
    }

    fn structure(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        fields: &[ast::Field],
    ) -> Option<Checked> {
        if let Some(extra) = fields.get(MAX_FIELDS) {
            let message = format!("`{}` has {} fields", item.name.node, fields.len());
            let wrong = Diagnostic::new(Code::TooLarge, extra.name.span, message)
                .expected(format!("at most {MAX_FIELDS}"))
                .hint("put some together in structs of their own");
            self.report(wrong);
            return None;
        }
        let mut typed: Vec<Param> = Vec::new();
        for field in fields {
            let ty = self.type_name(module, &field.ty)?;
            if ty.is_closure() {
                self.closure_in_data(field.ty.span);
                return None;
            }
            if typed.iter().any(|p| p.name == field.name.node) {
                let message = format!("`{}` has two fields `{}`", item.name.node, field.name.node);
                self.report(
                    Diagnostic::new(Code::Duplicate, field.name.span, message)
                        .expected("fields of different names"),
                );
                return None;
            }
            typed.push(Param {
                name: field.name.node.clone(),
                ty,
                default: None,
            });
        }
        let id = StructId(self.ir.structs.len() as u32);
        let fields = typed
            .iter()
            .filter_map(|p| Some((p.name.clone(), p.ty.ir()?)))
            .collect();
        self.ir.structs.push(ir::Struct {
            name: item.name.node.clone(),
            fields,
            span: item.span,
        });
        self.fields.push(typed.into());
        Some(Checked::Struct(id))
    }

    /// The type called `name` in `module`; an unknown one is reported.
    fn named_type(&mut self, module: ModuleId, name: &str, span: Span) -> Option<Ty> {
        if let Some((_, ty)) = types::NAMED.iter().find(|(n, _)| *n == name) {
            return Some(*ty);
        }
        if let Some(item) = self.lookup(module, name)
            && let ItemKind::Struct(_) = self.item(item).kind
        {
            return match self.demand(item, Some(span))? {
                Checked::Struct(id) => Some(Ty::Struct(id)),
                _ => None,
            };
        }
        let structs = self.visible(module, |k| matches!(k, ItemKind::Struct(_)));
        let known = types::NAMED
            .iter()
            .map(|(n, _)| *n)
            .chain(structs.iter().map(String::as_str));
        let unknown = Diagnostic::new(Code::UnknownType, span, format!("unknown type `{name}`"))
            .expected("a type such as float, color, vec3, length or a struct");
        let unknown = match foreign::row(name, &[foreign::Use::Type]) {
            Some(row) => {
                let hinted = unknown.hint(row.hint(name));
                row.fix(name, span)
                    .into_iter()
                    .fold(hinted, Diagnostic::fix)
            }
            None => unknown.did_you_mean(name, known),
        };
        self.report(unknown);
        None
    }

    fn closure_in_data(&mut self, span: Span) {
        let wrong = Diagnostic::new(Code::ClosureUse, span, "closures cannot be stored")
            .expected("a value type")
            .hint("combine closures in the material, with `let`, `layer` and `mix`");
        self.report(wrong);
    }

    /// A type with its article: `a float`, `an int`.
    fn a_type(&self, ty: Ty) -> String {
        let name = self.type_text(ty);
        // `uint` begins with the sound of `you`.
        let vowel = name.starts_with(['a', 'e', 'i', 'o', 'u']) && !name.starts_with("uint");
        format!("{} {name}", if vowel { "an" } else { "a" })
    }

    /// How authors see a type.
    fn type_text(&self, ty: Ty) -> String {
        match ty {
            Ty::Struct(id) => self.ir.structs[id.index()].name.clone(),
            Ty::Array(id) | Ty::AnyCount(id) => {
                let array = self.arrays.get(&id);
                let count = array.filter(|_| ty == Ty::Array(id)).map(|a| a.count);
                let element = array.map_or(Ty::Error, |a| a.element);
                let count = count.map_or(String::new(), |count| count.to_string());
                format!("{}[{count}]", self.type_text(element))
            }
            Ty::Error => "unknown".into(),
            Ty::Material => "material".into(),
            named => types::NAMED
                .iter()
                .find(|(_, t)| *t == named)
                .map_or(String::new(), |(n, _)| (*n).into()),
        }
    }
}
