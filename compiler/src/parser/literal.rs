//! Literals: numbers with their units, strings and truth values.

use super::common::Input;
use super::error::SyntaxError;
use crate::ast::{Expr, ExprKind, Unit};
use crate::diag::{Code, Diagnostic, nearest};
use crate::lexer::{Number, Token, read_number};
use crate::source::{Span, Spanned};

/// Reads the literal that starts with `token`, the next one.
pub(super) fn literal<'t>(text: &'t str, token: Token, inp: &mut Input<'t, '_>) -> Expr {
    let start = inp.cursor();
    inp.skip();
    let span = inp.span_since(&start);
    let kind = match token {
        Token::True => ExprKind::Bool(true),
        Token::False => ExprKind::Bool(false),
        Token::Str => string_value(text, span),
        _ => number(text, token, span, inp),
    };
    Expr {
        kind,
        span: inp.span_since(&start),
    }
}

fn string_value(text: &str, span: Span) -> ExprKind {
    let slice = text.get(span.range()).unwrap_or("");
    let inner = slice.strip_prefix('"').unwrap_or(slice);
    ExprKind::Str(inner.strip_suffix('"').unwrap_or(inner).to_owned())
}

/// The number at `span`, with a unit when a name follows it.
fn number<'t>(text: &'t str, token: Token, span: Span, inp: &mut Input<'t, '_>) -> ExprKind {
    // A number that has no value was reported by the lexer.
    let slice = text.get(span.range()).unwrap_or("");
    let number = read_number(token, slice, true).unwrap_or(Number::Int(0));
    if let Number::Uint(value) = number {
        return ExprKind::Uint(value);
    }
    match (unit(text, span, inp), number) {
        (UnitAfter::None, Number::Int(value)) => ExprKind::Int(value),
        (UnitAfter::None, Number::Float(value)) => ExprKind::Float(value),
        (UnitAfter::Unknown, _) | (_, Number::Uint(_)) => ExprKind::Error,
        (UnitAfter::Unit(unit), Number::Int(value)) => ExprKind::Quantity(value as f64, unit),
        (UnitAfter::Unit(unit), Number::Float(value)) => ExprKind::Quantity(value, unit),
    }
}

enum UnitAfter {
    None,
    Unit(Spanned<Unit>),
    Unknown,
}

/// The unit after the number at `number`. A name on the next line is none, unless it is spelled
/// like a unit: there a `;` is missing.
fn unit<'t>(text: &'t str, number: Span, inp: &mut Input<'t, '_>) -> UnitAfter {
    if inp.peek() != Some(Token::Ident) {
        return UnitAfter::None;
    }
    let before = inp.save();
    inp.skip();
    let span = inp.span_since(before.cursor());
    let name = text.get(span.range()).unwrap_or("");
    if let Some(unit) = Unit::from_name(name) {
        return UnitAfter::Unit(Spanned { node: unit, span });
    }
    let between = text.get(number.end as usize..span.start as usize);
    let words = ["and", "or", "xor", "mod"];
    if words.contains(&name) || between.unwrap_or("").contains('\n') {
        inp.rewind(before);
        return UnitAfter::None;
    }
    inp.emit(SyntaxError::special(
        span,
        unknown_unit(text, number, name, span),
    ));
    UnitAfter::Unknown
}

fn unknown_unit(text: &str, number: Span, name: &str, span: Span) -> Diagnostic {
    let digits = text.get(number.range()).unwrap_or("");
    let diagnostic = Diagnostic::new(Code::UnknownUnit, span, format!("`{name}` is not a unit"))
        .expected("nm, um, mm, cm, m or km after a length, deg or rad after an angle");
    if name.starts_with('_') {
        return diagnostic.hint("the digits of a number are written without separators");
    }
    if digits == "0"
        && matches!(name.as_bytes(), [b'b' | b'o' | b'X', rest @ ..] if !rest.is_empty())
    {
        return diagnostic.hint("ints are written in decimal or, with `0x`, in hexadecimal");
    }
    if matches!(name, "u" | "U" | "u32") {
        return diagnostic.hint("an unsigned int ends in `u`, right after its digits: `12u`");
    }
    if matches!(name, "f" | "i" | "h" | "f32" | "i32" | "lf") {
        let is_whole = digits.bytes().all(|b| b.is_ascii_digit()) && !name.starts_with('i');
        let plain = format!("{digits}{}", if is_whole { ".0" } else { "" });
        return diagnostic
            .replaced(number.to(span), None, &plain)
            .hint("numbers have no suffix for their type; a float has a point");
    }
    let units = Unit::ALL.iter().map(|(_, name, _)| *name);
    let known = match name {
        "degree" | "degrees" => Some("deg"),
        "radian" | "radians" => Some("rad"),
        "nanometer" | "nanometers" | "nanometre" | "nanometres" => Some("nm"),
        "micron" | "microns" | "micrometer" | "micrometre" => Some("um"),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some("mm"),
        "meter" | "meters" | "metre" | "metres" => Some("m"),
        _ if name.len() > 1 => {
            let as_long = units.clone().filter(|unit| unit.len() == name.len());
            nearest(name, as_long).or_else(|| nearest(name, units))
        }
        _ => None,
    };
    let whole = number.to(span);
    let fixed = |diagnostic: Diagnostic, text: String| diagnostic.replaced(whole, None, &text);
    match known {
        Some(unit) => fixed(diagnostic, format!("{digits} {unit}"))
            .hint(format!("did you mean `{digits} {unit}`?")),
        None => fixed(diagnostic, format!("{digits} * {name}"))
            .hint(format!("to multiply, write `{digits} * {name}`")),
    }
}
