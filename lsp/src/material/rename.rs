//! Renaming: which names change, and which new names are none.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, Role, Symbol, params};
use impasto_compiler::ast::ItemKind;
use impasto_compiler::lexer::{Token, lex};
use impasto_compiler::sema::{ItemRef, words};
use impasto_compiler::source::FileId;

use super::describe;
use super::references::{self, Definition};

/// What can be renamed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The bytes of the name at the cursor.
    pub place: Range<usize>,
    /// Where what it stands for is defined; its name is the one at the cursor.
    pub definition: Definition,
    /// Is it the name that an import of this file gave it (`as name`)? Then that changes, here alone.
    pub is_alias: bool,
}

/// What can be renamed at byte `at`.
///
/// # Errors
/// Why nothing can, in words for people.
pub fn target(analysis: &Analysis, at: usize) -> Result<Target, String> {
    let none = || "there is no name here".to_owned();
    let here = analysis.occurrence_at(at as u32).ok_or_else(none)?;
    if let Symbol::BuiltIn(name) | Symbol::Type(name) = &here.symbol {
        return Err(format!("`{name}` is a name of the language"));
    }
    if let Symbol::File(_) = here.symbol {
        return Err("a file is renamed with its file".to_owned());
    }
    let mut definition = references::of_symbol(analysis, &here.symbol).ok_or_else(none)?;
    let written = describe::text(analysis, here.span);
    let is_alias = written != definition.name;
    definition.name = written.to_owned();
    if definition.path.starts_with("std::") && !is_alias {
        let name = &definition.name;
        return Err(format!(
            "`{name}` is a name of the library ({})",
            definition.path
        ));
    }
    Ok(Target {
        place: here.span.range(),
        definition,
        is_alias,
    })
}

/// The places in the analysed file where what is defined somewhere is called by its name there, and not by another one.
pub fn changes(analysis: &Analysis, definition: &Definition) -> Vec<Range<usize>> {
    let Some(file) = analysis.file() else {
        return Vec::new();
    };
    let text = &analysis.sources.file(file).text;
    let places = references::occurrences(analysis, definition).map(|o| o.span.range());
    places
        .filter(|range| text.get(range.clone()) == Some(&definition.name))
        .collect()
}

/// Why a name cannot be that of a symbol; nothing if it can.
pub fn refused(analysis: &Analysis, definition: &Definition, new: &str) -> Option<String> {
    let (tokens, problems) = lex(FileId(0), new);
    let is_name =
        matches!(tokens.as_slice(), [(Token::Ident, span)] if span.range() == (0..new.len()));
    if !is_name || !problems.is_empty() {
        let word = if Token::KEYWORDS.contains(&new) {
            "a keyword"
        } else {
            "no name"
        };
        return Some(format!(
            "`{new}` is {word}: names have letters, digits and `_`, and begin with no digit"
        ));
    }
    if new == definition.name {
        return None;
    }
    let is_read = |symbol: &Symbol| matches!(symbol, Symbol::BuiltIn(name) if name == new);
    if words::is_input(new)
        || words::is_type(new)
        || words::built_in_functions().any(|f| f == new)
        || analysis.occurrences.iter().any(|o| is_read(&o.symbol))
    {
        return Some(format!("`{new}` is a name of the language"));
    }
    // What is defined at the top of a file must not meet another definition there, and no local may hide it where it
    // is used; a local must not meet another name in scope. The names of arguments meet nothing.
    let is_other = |symbol: &Symbol| {
        let found = references::of_symbol(analysis, symbol);
        found.is_none_or(|f| f.path != definition.path || f.place != definition.place)
    };
    let hiding = named(analysis, new, is_other);
    let mut is_named = false;
    for occurrence in references::occurrences(analysis, definition) {
        if let Symbol::Field(item, _) = occurrence.symbol {
            let ItemKind::Struct(fields) = &analysis.item(item).kind else {
                continue;
            };
            if fields.iter().any(|f| f.name.node == new) {
                return Some(format!("`{new}` is another field"));
            }
            continue;
        }
        if occurrence.role == Role::Give {
            continue;
        }
        is_named = true;
        if hiding.iter().any(|s| s.contains(&occurrence.span.start)) {
            return Some(format!("`{new}` is another name in scope here"));
        }
    }
    let item = analysis.module.and_then(|m| analysis.lookup(m, new));
    let is_item = item.is_some_and(|item| is_other(&Symbol::Item(item)));
    (is_item && is_named).then(|| format!("`{new}` is another definition"))
}

/// The scopes of the locals and parameters of a name.
fn named(analysis: &Analysis, name: &str, wanted: impl Fn(&Symbol) -> bool) -> Vec<Range<u32>> {
    let locals = analysis.locals.iter().enumerate();
    let locals = locals.filter(|(i, l)| l.name == name && wanted(&Symbol::Local(*i)));
    let mut scopes: Vec<Range<u32>> = locals.map(|(_, l)| l.scope.clone()).collect();
    let Some((module, ast)) = analysis.module.zip(analysis.ast()) else {
        return scopes;
    };
    for (index, item) in ast.items.iter().enumerate() {
        let of_name = params(item).iter().position(|p| p.name.node == name);
        let symbol = of_name.map(|i| Symbol::Param(ItemRef { module, index }, i));
        if symbol.is_some_and(|symbol| wanted(&symbol)) {
            scopes.push(item.span.start..item.span.end + 1);
        }
    }
    scopes
}
