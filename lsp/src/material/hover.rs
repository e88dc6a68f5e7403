//! What is shown of what the pointer is over: declaration, type, documentation, value.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, Symbol};
use impasto_compiler::ast::ItemKind;

use super::describe;

/// Markdown for what byte `at` is in, and the bytes that it is about.
pub fn hover(analysis: &Analysis, at: usize) -> Option<(String, Range<usize>)> {
    let at = at as u32;
    if let Some(occurrence) = analysis.occurrence_at(at)
        && let Some(description) = describe::describe(analysis, &occurrence.symbol)
    {
        let mut text = description.markdown();
        let value = match &occurrence.symbol {
            Symbol::Item(item) => match &analysis.item(*item).kind {
                ItemKind::Const(c) => describe::constant(analysis, &c.value),
                _ => None,
            },
            _ => describe::value(analysis, occurrence.span).map(|v| format!("`{v}`")),
        };
        if let Some(value) = value {
            text += &format!("\n\nValue: {value}");
        }
        return Some((text, occurrence.span.range()));
    }
    // No name: the expression itself, as a number with a unit or a call of `srgb`.
    let (span, ty) = analysis.types_around(at).into_iter().next()?;
    let written = describe::text(analysis, span);
    if written.len() > 200 {
        return None;
    }
    let mut text = format!("```impasto\n{}\n```", ty.text);
    if let Some(value) = describe::value(analysis, span).filter(|value| value != written) {
        text += &format!("\n\nValue: `{value}`");
    }
    Some((text, span.range()))
}
