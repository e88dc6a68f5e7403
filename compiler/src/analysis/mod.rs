//! What a source text means, for whoever shows or edits it: where each name is defined and used, what type
//! an expression has, what is in scope where.
//!
//! [`analyse`] ends after checking, so it takes a few milliseconds. Names are resolved on the syntax tree, also
//! in definitions that do not check, since a text that is being written is wrong most of the time. Types are
//! those that the checker noted. A test holds the two to each other.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use crate::ast::{self, ItemKind};
use crate::diag::{self, Diagnostic};
use crate::ir::Const;
use crate::loader::Loader;
use crate::sema::notes::{Meaning, Notes};
use crate::sema::{Checker, ItemRef, ModuleId};
use crate::source::{FileId, SourceMap, Span};

pub mod manual;
mod resolve;

pub use crate::sema::notes::{Module, TypeOf};
pub use resolve::{Local, LocalKind, Occurrence, Role, Symbol, params};

/// What a source text means.
pub struct Analysis {
    /// The texts that spans point into.
    pub sources: SourceMap,
    /// What was found wrong, sorted by place. Code generation and what follows from it are not run.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that take part, by [`ModuleId`]; the one that is analysed is [`Analysis::module`].
    pub modules: Vec<Module>,
    /// The file that is analysed; nothing if it cannot be read.
    pub module: Option<ModuleId>,
    /// What is in scope everywhere.
    pub core: BTreeMap<String, ItemRef>,
    /// Every name in the file, in the order of the text.
    pub occurrences: Vec<Occurrence>,
    /// What bodies of the file define, in the order of the text.
    pub locals: Vec<Local>,
    types: HashMap<Span, TypeOf>,
    bindings: HashMap<Span, TypeOf>,
    constants: HashMap<Span, Const>,
}

/// Reads the file at `path` and everything that it imports.
pub fn analyse(path: &str, loader: &mut dyn Loader) -> Analysis {
    let mut checker = Checker::new(loader);
    let module = checker.load(path);
    if let Some(module) = module {
        checker.take_notes(module);
        checker.check_all(module);
    }
    diag::drop_unsure(&mut checker.diagnostics);
    Analysis::new(checker, module)
}

impl Analysis {
    fn new(mut checker: Checker<'_>, module: Option<ModuleId>) -> Self {
        let notes = checker.notes.take();
        let diagnostics = diag::render::ordered(&checker.sources, &checker.diagnostics);
        let mut analysis = Self {
            diagnostics,
            modules: checker.all_modules(),
            module,
            core: checker.core_names(),
            occurrences: Vec::new(),
            locals: Vec::new(),
            types: HashMap::new(),
            bindings: HashMap::new(),
            constants: HashMap::new(),
            sources: std::mem::take(&mut checker.sources),
        };
        let (Some(module), Some(notes)) = (module, notes) else {
            return analysis;
        };
        let fields = &notes.fields;
        let fields = fields.iter().filter_map(|(span, (id, index))| {
            let item = checker.struct_item(*id)?;
            Some((*span, (item, *index)))
        });
        let resolved = resolve::resolve(&analysis, module, &fields.collect());
        (analysis.occurrences, analysis.locals) = resolved;
        let Notes {
            types,
            bindings,
            constants,
            ..
        } = notes;
        let mut texts: Vec<(crate::ir::surface::Ty, TypeOf)> = Vec::new();
        let mut text = |ty| {
            if let Some((_, known)) = texts.iter().find(|(t, _)| *t == ty) {
                return known.clone();
            }
            let new = checker.described(ty);
            texts.push((ty, new.clone()));
            new
        };
        analysis.types = types.into_iter().map(|(s, ty)| (s, text(ty))).collect();
        analysis.bindings = bindings.into_iter().map(|(s, ty)| (s, text(ty))).collect();
        analysis.constants = constants;
        analysis
    }

    /// The syntax tree of the file that is analysed.
    pub fn ast(&self) -> Option<&Arc<ast::Module>> {
        Some(&self.modules[self.module?.0].ast)
    }

    /// The text of the file that is analysed.
    pub fn file(&self) -> Option<FileId> {
        Some(self.modules[self.module?.0].file)
    }

    /// A definition.
    pub fn item(&self, item: ItemRef) -> &ast::Item {
        &self.modules[item.module.0].ast.items[item.index]
    }

    /// What a name of a file means, or one of the library's core.
    pub fn lookup(&self, module: ModuleId, name: &str) -> Option<ItemRef> {
        let own = self.modules[module.0].names.get(name);
        own.or_else(|| self.core.get(name)).copied()
    }

    /// The type of the expression at exactly `span`, if it was checked.
    pub fn type_at(&self, span: Span) -> Option<&TypeOf> {
        self.types.get(&span)
    }

    /// The type of the local name that is defined at `span`.
    pub fn binding_type(&self, span: Span) -> Option<&TypeOf> {
        self.bindings.get(&span)
    }

    /// The value of the expression at exactly `span`, if it is a constant.
    pub fn constant_at(&self, span: Span) -> Option<&Const> {
        self.constants.get(&span)
    }

    /// The smallest expressions around byte `at` that were checked, innermost first.
    pub fn types_around(&self, at: u32) -> Vec<(Span, &TypeOf)> {
        let Some(file) = self.file() else {
            return Vec::new();
        };
        let around = |s: &Span| s.file == file && s.start <= at && at <= s.end;
        let found = self.types.iter().filter(|(s, _)| around(s));
        let mut found: Vec<_> = found.map(|(s, t)| (*s, t)).collect();
        found.sort_by_key(|(s, _)| (s.end - s.start, s.start));
        found
    }

    /// The name that byte `at` is in or behind.
    pub fn occurrence_at(&self, at: u32) -> Option<&Occurrence> {
        let touching = |o: &&Occurrence| o.span.start <= at && at <= o.span.end;
        let mut touching = self.occurrences.iter().filter(touching);
        let first = touching.next()?;
        // Of two names with nothing between, the one that begins here.
        Some(touching.next().unwrap_or(first))
    }

    /// Where what a symbol stands for is defined: the place of its name.
    pub fn definition(&self, symbol: &Symbol) -> Option<Span> {
        match symbol {
            Symbol::Item(item) => Some(self.item(*item).name.span),
            Symbol::Local(index) => Some(self.locals.get(*index)?.span),
            Symbol::Param(item, index) => Some(resolve::param(self.item(*item), *index)?.span),
            Symbol::Field(item, index) => match &self.item(*item).kind {
                ItemKind::Struct(fields) => Some(fields.get(*index)?.name.span),
                _ => None,
            },
            Symbol::File(module) => Some(Span::new(self.modules[module.0].file, 0..0)),
            Symbol::BuiltIn(_) | Symbol::Type(_) => None,
        }
    }

    /// What is in scope at byte `at` of the bodies of the file, innermost and last first; a name that another one
    /// hides is left out.
    pub fn visible_at(&self, at: u32) -> Vec<(&str, Symbol)> {
        let (mut seen, mut names) = (Vec::new(), HashSet::new());
        let locals = self.locals.iter().enumerate().rev();
        for (index, local) in locals {
            if local.scope.contains(&at) && names.insert(&*local.name) {
                seen.push((&*local.name, Symbol::Local(index)));
            }
        }
        let Some((module, ast)) = self.module.zip(self.ast()) else {
            return seen;
        };
        for (index, item) in ast.items.iter().enumerate() {
            if !(item.span.start..=item.span.end).contains(&at) {
                continue;
            }
            for (i, param) in resolve::params(item).into_iter().enumerate() {
                if names.insert(&*param.name.node) {
                    let symbol = Symbol::Param(ItemRef { module, index }, i);
                    seen.push((&*param.name.node, symbol));
                }
            }
        }
        seen
    }

    /// The definition that byte `at` is in, with its place among those of the file.
    pub fn item_at(&self, at: u32) -> Option<(ItemRef, &ast::Item)> {
        let module = self.module?;
        let items = self.ast()?.items.iter().enumerate();
        let mut inside = items.filter(|(_, i)| i.span.start <= at && at <= i.span.end);
        let (index, item) = inside.next()?;
        Some((ItemRef { module, index }, item))
    }
}

/// What a call or a scene can give to a definition.
#[derive(Clone, Copy, Debug)]
pub struct ParamRef<'a> {
    /// Its name.
    pub name: &'a ast::Name,
    /// Its type.
    pub ty: &'a ast::TypeName,
    /// Its value where none is given.
    pub default: Option<&'a ast::Expr>,
    /// All that is declared of it, if it is a material's.
    pub of_material: Option<&'a ast::MaterialParam>,
}

/// Does what the checker noted of names agree with how they were resolved? What does not, for tests.
pub fn disagreements(path: &str, loader: &mut dyn Loader) -> Vec<String> {
    let mut checker = Checker::new(loader);
    let Some(module) = checker.load(path) else {
        return Vec::new();
    };
    checker.take_notes(module);
    checker.check_all(module);
    let noted = checker.notes.as_ref().map(|n| n.names.clone());
    let analysis = Analysis::new(checker, Some(module));
    let mut wrong = Vec::new();
    let noted: BTreeMap<Span, Meaning> = noted.unwrap_or_default().into_iter().collect();
    for (span, meaning) in noted {
        let found = analysis.occurrences.iter().find(|o| o.span == span);
        let defined = found.and_then(|o| analysis.definition(&o.symbol));
        let expected = match meaning {
            Meaning::Local(span) => span,
            Meaning::Item(item) => analysis.item(item).name.span,
        };
        if defined != Some(expected) {
            let place = analysis.sources.file_line(span);
            let text = &analysis.sources.file(span.file).text[span.range()];
            wrong.push(format!(
                "{place}: `{text}` is {expected:?} to the checker, and {found:?} on the tree"
            ));
        }
    }
    wrong
}
