//! What checking a file found out about its text, for whoever shows or edits it.
//!
//! Types of expressions leave the IR with the surface (a color is a vec3 there), and scopes end with
//! their blocks. A checker that is asked to take notes keeps both, of one file: where an expression
//! stands and what it is. A text that is checked more than once, such as a loop that is unrolled, has
//! the notes of its last time.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::ast;
use crate::ir::{Const, StructId};
use crate::source::{FileId, Span};

use super::body::{Body, Operand};
use super::modules::{ItemRef, ModuleId};
use super::types::Ty;
use super::{Checked, Checker};

/// Notes on one file.
pub struct Notes {
    /// The file.
    pub module: ModuleId,
    /// The types of its expressions.
    pub types: HashMap<Span, Ty>,
    /// The values of those that are constants.
    pub constants: HashMap<Span, Const>,
    /// The types of names that it defines within bodies, by their places.
    pub bindings: HashMap<Span, Ty>,
    /// What names of values and callees mean, by their places.
    pub names: HashMap<Span, Meaning>,
    /// Fields of structs that are read, by the places of their names.
    pub fields: HashMap<Span, (StructId, usize)>,
}

/// What a name means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// What is defined in the same body, by the name's place there.
    Local(Span),
    /// A definition.
    Item(ItemRef),
}

/// A file that takes part.
pub struct Module {
    /// Its text.
    pub file: FileId,
    /// The path that it was asked for by; of the library `std/folder/name.impasto`.
    pub path: String,
    /// Is it part of the library?
    pub is_std: bool,
    /// Its syntax tree.
    pub ast: Arc<ast::Module>,
    /// What its own and imported names mean.
    pub names: BTreeMap<String, ItemRef>,
}

/// A type as an author sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeOf {
    /// How it is written.
    pub text: Arc<str>,
    /// The struct that it is.
    pub item: Option<ItemRef>,
}

impl Notes {
    /// None yet on a file.
    pub fn new(module: ModuleId) -> Self {
        Self {
            module,
            types: HashMap::new(),
            constants: HashMap::new(),
            bindings: HashMap::new(),
            names: HashMap::new(),
            fields: HashMap::new(),
        }
    }
}

impl Body<'_, '_> {
    /// The notes, if there are any to take on what is being checked.
    pub fn notes(&mut self) -> Option<&mut Notes> {
        let module = self.module;
        self.cx.notes.as_mut().filter(|n| n.module == module)
    }

    /// Notes what an expression is.
    pub fn note_expr(&mut self, span: Span, operand: Operand) {
        if self.cx.notes.is_none() {
            return;
        }
        let constant = match operand {
            Operand::Value(id, _) => self.builder.function().constant(id).cloned(),
            _ => None,
        };
        if let Some(notes) = self.notes() {
            notes.types.insert(span, operand.ty());
            match constant {
                Some(value) => notes.constants.insert(span, value),
                None => notes.constants.remove(&span),
            };
        }
    }

    /// Notes what a name means.
    pub fn note_name(&mut self, span: Span, meaning: Meaning) {
        if let Some(notes) = self.notes() {
            notes.names.insert(span, meaning);
        }
    }
}

impl Checker<'_> {
    /// Notes from now on what checking finds out about a file.
    pub fn take_notes(&mut self, module: ModuleId) {
        self.notes = Some(Notes::new(module));
    }

    /// The definition of a struct.
    pub fn struct_item(&self, id: StructId) -> Option<ItemRef> {
        let mut all = self.checked.iter();
        let (item, _) = all.find(|(_, c)| matches!(c, Checked::Struct(s) if *s == id))?;
        Some(*item)
    }

    /// A type as an author sees it.
    pub fn described(&self, ty: Ty) -> TypeOf {
        let item = match ty {
            Ty::Struct(id) => self.struct_item(id),
            _ => None,
        };
        TypeOf {
            text: self.type_text(ty).into(),
            item,
        }
    }

    /// The files that take part, by [`ModuleId`].
    pub fn all_modules(&self) -> Vec<Module> {
        let modules = self.modules.iter().map(|m| Module {
            file: m.file,
            path: m.path.clone(),
            is_std: m.is_std,
            ast: m.ast.clone(),
            names: m.names.clone(),
        });
        modules.collect()
    }

    /// What is in scope everywhere.
    pub fn core_names(&self) -> BTreeMap<String, ItemRef> {
        self.core.clone()
    }
}
