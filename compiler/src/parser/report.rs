//! Syntax errors to diagnostics, in people's words.
//!
//! One slip often makes the grammar stumble several times. Reported is the first error at a
//! place, and none on a line where a character or string was already reported.

use std::collections::BTreeSet;

use super::MAX_ERRORS;
use super::error::{Expected, SyntaxError, Want, describe};
use super::hints;
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::{FileId, Span};

/// What the errors are about.
pub(super) struct Source<'t> {
    pub(super) file: FileId,
    pub(super) text: &'t str,
    pub(super) tokens: &'t [(Token, Span)],
}

impl<'t> Source<'t> {
    /// The number of the first token at or after `place`.
    fn index_at(&self, place: u32) -> usize {
        self.tokens.partition_point(|(_, span)| span.start < place)
    }

    /// The kind of a token.
    pub(super) fn token(&self, index: usize) -> Option<Token> {
        self.tokens.get(index).map(|(token, _)| *token)
    }

    /// The text of a token; empty behind the last.
    pub(super) fn slice(&self, index: usize) -> &'t str {
        let span = self.tokens.get(index).map(|(_, span)| span.range());
        span.and_then(|range| self.text.get(range)).unwrap_or("")
    }

    /// Does one token follow the other without a space?
    pub(super) fn adjacent(&self, first: usize, second: usize) -> bool {
        match (self.tokens.get(first), self.tokens.get(second)) {
            (Some((_, a)), Some((_, b))) => a.end == b.start,
            _ => false,
        }
    }

    /// Is there a line break between two places?
    fn breaks(&self, from: u32, to: u32) -> bool {
        let between = self.text.get(from as usize..to as usize);
        between.is_some_and(|text| text.contains('\n'))
    }

    /// The start of the line of `place`.
    fn line_start(&self, place: u32) -> usize {
        let before = self.text.get(..place as usize).unwrap_or("");
        before.rfind('\n').map_or(0, |newline| newline + 1)
    }
}

/// Appends the diagnostics of `errors` to those of the tokens.
pub(super) fn report(source: &Source<'_>, errors: Vec<SyntaxError>, out: &mut Vec<Diagnostic>) {
    let mut places: BTreeSet<u32> = BTreeSet::new();
    let garbled: BTreeSet<usize> = out
        .iter()
        .filter(|d| matches!(d.code, Code::UnknownCharacter | Code::Unterminated))
        .filter_map(|d| d.span)
        .map(|span| source.line_start(span.start))
        .collect();
    let is_garbled = |span: Span| garbled.contains(&source.line_start(span.start));
    out.retain(|d| d.code != Code::Unclosed || !d.span.is_some_and(is_garbled));
    let mut reported = 0;
    for error in errors {
        let put_in =
            error.found.is_some_and(Token::is_closer) && error.span.start == error.span.end;
        if put_in || !places.insert(error.span.start) {
            continue;
        }
        let diagnostic = diagnose(source, error);
        if diagnostic.span.is_some_and(is_garbled) {
            continue;
        }
        if reported == MAX_ERRORS {
            let end = Span::new(source.file, source.text.len()..source.text.len());
            let message = "more syntax errors follow that are not shown";
            out.push(Diagnostic::new(Code::Syntax, end, message));
            return;
        }
        reported += 1;
        out.push(diagnostic);
    }
}

fn diagnose(source: &Source<'_>, error: SyntaxError) -> Diagnostic {
    if let Some(special) = error.special {
        return *special;
    }
    let index = source.index_at(error.span.start);
    let previous_end = index.checked_sub(1).and_then(|i| source.tokens.get(i));
    let previous_end = previous_end.map_or(0, |(_, span)| span.end);
    let hint = hints::hint(source, index, &error);
    let misses_semicolon = error.expected.has(Expected::token(Token::Semicolon));
    let ended = match error.found {
        None | Some(Token::RightBrace) => true,
        Some(_) => source.breaks(previous_end, error.span.start),
    };
    let diagnostic = if misses_semicolon && ended && hint.is_none() {
        let end = previous_end as usize..previous_end as usize;
        let after = Span::new(source.file, end);
        Diagnostic::new(Code::Syntax, after, "a `;` is missing here").expected("`;`")
    } else {
        let message = format!("unexpected {}", found(source, error.found, index));
        let diagnostic = Diagnostic::new(Code::Syntax, error.span, message);
        match either(&words(error.expected)) {
            Some(words) => diagnostic.expected(words),
            None => diagnostic,
        }
    };
    match hint {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

fn found(source: &Source<'_>, found: Option<Token>, index: usize) -> String {
    let slice = source.slice(index);
    match found {
        None => "end of the file".to_owned(),
        Some(Token::DocOuter | Token::DocInner) => "documentation comment".to_owned(),
        Some(Token::Str) => "string".to_owned(),
        Some(token) if token.is_keyword() => format!("keyword {}", describe(token)),
        Some(_) if slice.chars().count() > 40 => {
            let start: String = slice.chars().take(40).collect();
            format!("`{start}...`")
        }
        Some(_) => format!("`{slice}`"),
    }
}

/// The expected set in words, without what is always possible and so says nothing.
fn words(expected: Expected) -> Vec<String> {
    use Token::*;
    let mut rest = expected.without(Expected::tokens(&[DocOuter, DocInner, Else, Unknown]));
    let mut words = Vec::new();
    let expression = Expected::want(Want::Expression);
    let definition = Expected::tokens(&[Material, Bsdf, Delta, Edf, Fn, Struct, Const]);
    let statement = Expected::tokens(&[Let, Var, For, While, Break, Continue, If]).with(expression);
    let prefix = Expected::tokens(&[Minus, Not]);
    let operand = Expected::tokens(&[LeftParen, LeftBrace, Str, True, False, If]);
    let operand = operand
        .with(prefix)
        .with(expression)
        .with(Expected::want(Want::Name));
    let operator = Expected::want(Want::Operator).with(Expected::tokens(&[Dot, LeftParen]));
    let assign = Expected::tokens(&[Assign, AddAssign, SubAssign, MulAssign, DivAssign]);
    if rest.has(definition) {
        words.push("a definition, such as `material`, `bsdf` or `fn`".to_owned());
        rest = rest.without(definition.with(Expected::token(Use)));
    }
    if rest.has(statement) {
        words.push("a statement".to_owned());
        rest = rest.without(statement).without(Expected::token(Param));
    }
    if rest.has(expression) || rest.has(prefix) {
        words.push("an expression".to_owned());
        rest = rest.without(operand);
    }
    if rest.has(assign) {
        words.push("`=`".to_owned());
        rest = rest.without(assign);
    }
    if rest.has(Expected::want(Want::Operator)) {
        let without = rest.without(operator);
        if without.is_empty() && words.is_empty() {
            return vec!["an operator".to_owned()];
        }
        rest = without;
    }
    words.extend(rest.words());
    words
}

/// `a`, `a or b`, `a, b or c`
fn either(words: &[String]) -> Option<String> {
    let (last, rest) = words.split_last()?;
    if rest.is_empty() {
        return Some(last.clone());
    }
    Some(format!("{} or {last}", rest.join(", ")))
}
