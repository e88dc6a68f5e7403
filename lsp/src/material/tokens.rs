//! Semantic tokens: what kind of thing each name stands for.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, LocalKind, Role, Symbol};
use impasto_compiler::ast::ItemKind;
use impasto_compiler::sema::words;

/// The types of tokens, in the order of their numbers.
pub const TYPES: [&str; 9] = [
    "class",
    "function",
    "struct",
    "variable",
    "parameter",
    "property",
    "type",
    "namespace",
    "macro",
];

/// What modifies them, by their bits.
pub const MODIFIERS: [&str; 4] = ["declaration", "readonly", "modification", "defaultLibrary"];

const DECLARATION: u32 = 1;
const READONLY: u32 = 2;
const MODIFICATION: u32 = 4;
const LIBRARY: u32 = 8;

/// A name with what it stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colored {
    /// Its bytes.
    pub place: Range<usize>,
    /// Its type, as an index of [`TYPES`].
    pub kind: u32,
    /// Bits of [`MODIFIERS`].
    pub modifiers: u32,
}

/// The names of the analysed file, in their order.
pub fn tokens(analysis: &Analysis) -> Vec<Colored> {
    let mut all: Vec<Colored> = Vec::new();
    for occurrence in &analysis.occurrences {
        let (kind, mut modifiers) = kind(analysis, &occurrence.symbol);
        match occurrence.role {
            Role::Define => modifiers |= DECLARATION,
            Role::Write => modifiers |= MODIFICATION,
            Role::Read | Role::Import | Role::Give => {}
        }
        let place = occurrence.span.range();
        // Tokens must not overlap.
        if place.is_empty() || all.last().is_some_and(|last| last.place.end > place.start) {
            continue;
        }
        let kind = TYPES.iter().position(|t| *t == kind).unwrap_or(0) as u32;
        all.push(Colored {
            place,
            kind,
            modifiers,
        });
    }
    all
}

fn kind(analysis: &Analysis, symbol: &Symbol) -> (&'static str, u32) {
    match symbol {
        Symbol::Item(item) => {
            let library = if analysis.modules[item.module.0].is_std {
                LIBRARY
            } else {
                0
            };
            let (kind, more) = match analysis.item(*item).kind {
                ItemKind::Material(_) => ("class", 0),
                ItemKind::Closure(_) => ("macro", 0),
                ItemKind::Function(_) => ("function", 0),
                ItemKind::Struct(_) => ("struct", 0),
                ItemKind::Const(_) => ("variable", READONLY),
            };
            (kind, library | more)
        }
        Symbol::Param(..) => ("parameter", READONLY),
        Symbol::Field(..) => ("property", 0),
        Symbol::Local(index) => match analysis.locals[*index].kind {
            LocalKind::Var => ("variable", 0),
            LocalKind::Let | LocalKind::Loop => ("variable", READONLY),
            LocalKind::Argument => ("parameter", READONLY),
        },
        Symbol::File(_) => ("namespace", 0),
        Symbol::BuiltIn(name) if words::is_output(name) => ("property", LIBRARY),
        Symbol::BuiltIn(name) if words::is_input(name) || words::is_moment(name) => {
            ("variable", LIBRARY | READONLY)
        }
        Symbol::BuiltIn(name) if words::built_in_functions().any(|f| f == name) => {
            ("function", LIBRARY)
        }
        Symbol::BuiltIn(name) if words::is_type(name) => ("type", LIBRARY),
        Symbol::Type(_) => ("type", LIBRARY),
        Symbol::BuiltIn(name) if name == words::NO_MEDIUM => ("variable", LIBRARY | READONLY),
        // A method of a closure.
        Symbol::BuiltIn(_) => ("function", LIBRARY),
    }
}
