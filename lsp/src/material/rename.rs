//! Renaming: which names change, and which new names are none.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, Role, Symbol};
use impasto_compiler::lexer::{Token, lex};
use impasto_compiler::sema::words;
use impasto_compiler::source::FileId;

use super::references::{self, Definition};

/// What can be renamed at byte `at`: the bytes of the name, and where it is defined.
///
/// # Errors
/// Why nothing can, in words for people.
pub fn target(analysis: &Analysis, at: usize) -> Result<(Range<usize>, Definition), String> {
    let none = || "there is no name here".to_owned();
    let here = analysis.occurrence_at(at as u32).ok_or_else(none)?;
    if let Symbol::BuiltIn(name) = &here.symbol {
        return Err(format!("`{name}` is a name of the language"));
    }
    if let Symbol::File(_) = here.symbol {
        return Err("a file is renamed with its file".to_owned());
    }
    let definition = references::of_symbol(analysis, &here.symbol).ok_or_else(none)?;
    if definition.path.starts_with("std::") {
        let name = &definition.name;
        return Err(format!(
            "`{name}` is a name of the library ({})",
            definition.path
        ));
    }
    Ok((here.span.range(), definition))
}

/// The changes in the analysed file that give what is defined somewhere another name. Aliases stay.
pub fn changes(analysis: &Analysis, definition: &Definition) -> Vec<Range<usize>> {
    let Some(file) = analysis.file() else {
        return Vec::new();
    };
    let text = &analysis.sources.file(file).text;
    let places = references::occurrences(analysis, definition).map(|o| o.span.range());
    places
        .filter(|range| text[range.clone()] == definition.name)
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
    if words::is_input(new) || words::is_type(new) || words::built_in_functions().any(|f| f == new)
    {
        return Some(format!("`{new}` is a name of the language"));
    }
    // What is defined at the top of a file must not meet another definition there, and no local may hide it where it
    // is used; a local must not meet another name in scope.
    for occurrence in references::occurrences(analysis, definition) {
        let at = occurrence.span.start;
        let visible = analysis.visible_at(at);
        let meets = visible.iter().any(|(name, symbol)| {
            *name == new && references::of_symbol(analysis, symbol).as_ref() != Some(definition)
        });
        if meets && occurrence.role != Role::Give {
            return Some(format!("`{new}` is another name in scope here"));
        }
    }
    let is_item = analysis
        .module
        .and_then(|m| analysis.lookup(m, new))
        .is_some_and(|item| analysis.item(item).name.node == new);
    let defines = references::occurrences(analysis, definition)
        .any(|o| matches!(o.symbol, Symbol::Item(_)) || o.role == Role::Read);
    (is_item && defines).then(|| format!("`{new}` is another definition"))
}
