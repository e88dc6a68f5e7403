//! What is shown of what the pointer is over: declaration, type, documentation, value.

use std::ops::Range;

use impasto_compiler::analysis::manual;
use impasto_compiler::analysis::{Analysis, Local, Symbol, TypeOf};
use impasto_compiler::ast::{ItemKind, Unit};
use impasto_compiler::lexer::Token;

use super::cursor::{self, Tokens};
use super::describe;

/// Markdown for what byte `at` is in, and the bytes that it is about. `last_good` is what the text meant when it last had
/// no syntax errors: a definition with one is not checked.
pub fn hover(
    now: &Analysis,
    last_good: Option<&Analysis>,
    at: usize,
) -> Option<(String, Range<usize>)> {
    let source = &now.sources.file(now.file()?).text;
    let tokens = cursor::tokens(source);
    if cursor::comment(source, &tokens, at).is_some() {
        return None;
    }
    if let Some(occurrence) = now.occurrence_at(at as u32)
        && let Some(mut description) = describe::describe(now, &occurrence.symbol)
    {
        if let Symbol::Local(index) = &occurrence.symbol
            && let Some(local) = now.locals.get(*index)
            && now.binding_type(local.span).is_none()
        {
            let ty = last_good.and_then(|good| type_before(now, local, good));
            description.declaration += &describe::type_text(ty);
        }
        let mut text = description.markdown();
        let value = match &occurrence.symbol {
            Symbol::Item(item) => match &now.item(*item).kind {
                ItemKind::Const(c) => describe::constant(now, &c.value),
                _ => None,
            },
            _ => describe::value(now, occurrence.span).map(|v| format!("`{v}`")),
        };
        if let Some(value) = value {
            text += &format!("\n\nValue: {value}");
        }
        return Some((text, occurrence.span.range()));
    }
    word(source, &tokens, at).or_else(|| expression(now, at))
}

/// The type of a local in the same definition before something in that broke: of the locals of its name, if they agree.
fn type_before<'a>(now: &Analysis, local: &Local, good: &'a Analysis) -> Option<&'a TypeOf> {
    let (_, item) = now.item_at(local.span.start)?;
    let own = good
        .ast()?
        .items
        .iter()
        .find(|i| i.name.node == item.name.node)?;
    let same = good.locals.iter().filter(|l| {
        let is_within = own.span.start <= l.span.start && l.span.end <= own.span.end;
        is_within && l.name == local.name && l.kind == local.kind
    });
    let mut types = same.map(|l| good.binding_type(l.span));
    let first = types.next()??;
    types.all(|ty| ty == Some(first)).then_some(first)
}

/// A keyword, as the grammar has it, or the unit of a number.
fn word(text: &str, tokens: &Tokens, at: usize) -> Option<(String, Range<usize>)> {
    let index = tokens
        .iter()
        .rposition(|(_, r)| r.start <= at && at <= r.end)?;
    let (token, range) = &tokens[index];
    let written = text.get(range.clone())?;
    if token.is_keyword() {
        let forms = manual::grammar(written);
        let shown = (!forms.is_empty()).then(|| format!("```text\n{}\n```", forms.join("\n")));
        return Some((shown?, range.clone()));
    }
    let number = tokens.get(index.checked_sub(1)?).map(|t| t.0);
    let is_unit = *token == Token::Ident && matches!(number, Some(Token::Int | Token::Float));
    let unit = Unit::from_name(written).filter(|_| is_unit)?;
    let base = if unit.is_angle() { "rad" } else { "m" };
    let text = format!(
        "```impasto\n1 {written} = {} {base}\n```",
        unit.scale() as f32
    );
    Some((text, range.clone()))
}

/// No name: the expression itself, as a number with a unit or a call of `srgb`.
fn expression(analysis: &Analysis, at: usize) -> Option<(String, Range<usize>)> {
    let (span, ty) = analysis.types_around(at as u32).into_iter().next()?;
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
