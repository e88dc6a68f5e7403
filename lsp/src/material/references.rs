//! Where else a symbol is: in its file, and in the files that import it.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, Occurrence, Role, Symbol};
use impasto_compiler::source::Span;

use crate::library;

/// What a symbol is for all files: where its name is defined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// The file, as [`library::canonical`] calls it.
    pub path: String,
    /// The bytes of the name.
    pub place: Range<usize>,
    /// The name.
    pub name: String,
}

/// Where the symbol at byte `at` is defined; nothing of what the language has.
pub fn definition(analysis: &Analysis, at: usize) -> Option<Definition> {
    of_symbol(analysis, &analysis.occurrence_at(at as u32)?.symbol)
}

/// Where a symbol is defined.
pub fn of_symbol(analysis: &Analysis, symbol: &Symbol) -> Option<Definition> {
    let span = analysis.definition(symbol)?;
    let file = analysis.sources.file(span.file);
    Some(Definition {
        path: library::canonical(&file.name),
        place: span.range(),
        name: file.text.get(span.range())?.to_owned(),
    })
}

/// The places of the names in the analysed file that stand for what is defined there or elsewhere.
pub fn occurrences<'a>(
    analysis: &'a Analysis,
    definition: &Definition,
) -> impl Iterator<Item = &'a Occurrence> + use<'a> {
    let mut files = analysis.sources.files();
    let file = files.find(|(_, f)| library::canonical(&f.name) == definition.path);
    let defined = file.map(|(id, _)| Span::new(id, definition.place.clone()));
    let is_it =
        move |o: &&Occurrence| defined.is_some() && analysis.definition(&o.symbol) == defined;
    analysis.occurrences.iter().filter(is_it)
}

/// The names in the file that stand for the same as the one at byte `at`, and whether it is written there.
pub fn highlights(analysis: &Analysis, at: usize) -> Vec<(Range<usize>, bool)> {
    let Some(here) = analysis.occurrence_at(at as u32) else {
        return Vec::new();
    };
    let same = analysis
        .occurrences
        .iter()
        .filter(|o| o.symbol == here.symbol);
    let is_written = |role| matches!(role, Role::Define | Role::Write | Role::Give);
    same.map(|o| (o.span.range(), is_written(o.role))).collect()
}
