//! Syntax errors to diagnostics, in people's words.
//!
//! One slip often makes the grammar stumble several times. So an error is not reported that
//! follows another at the same or next token, that is about an expression with an error inside,
//! or that is on a line where a character or string was already reported.

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
    newlines: Vec<u32>,
}

impl<'t> Source<'t> {
    pub(super) fn new(file: FileId, text: &'t str, tokens: &'t [(Token, Span)]) -> Self {
        let newlines = text.bytes().zip(0_u32..).filter(|(byte, _)| *byte == b'\n');
        Self {
            file,
            text,
            tokens,
            newlines: newlines.map(|(_, at)| at).collect(),
        }
    }

    /// The number of the first token at or after `place`.
    fn index_at(&self, place: u32) -> usize {
        self.tokens.partition_point(|(_, span)| span.start < place)
    }

    /// The end of the last token before `place`.
    fn end_before(&self, place: u32) -> u32 {
        let index = self.index_at(place).checked_sub(1);
        let token = index.and_then(|index| self.tokens.get(index));
        token.map_or(0, |(_, span)| span.end)
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

    /// The number of the line of `place`, from 0.
    fn line(&self, place: u32) -> usize {
        self.newlines.partition_point(|newline| *newline < place)
    }
}

/// Appends the diagnostics of `errors` to those of the tokens.
pub(super) fn report(source: &Source<'_>, errors: Vec<SyntaxError>, out: &mut Vec<Diagnostic>) {
    let garbled: BTreeSet<usize> = out
        .iter()
        .filter(|d| matches!(d.code, Code::UnknownCharacter | Code::Unterminated))
        .filter_map(|d| d.span)
        .map(|span| source.line(span.start))
        .collect();
    let is_garbled = |place: u32| garbled.contains(&source.line(place));
    out.retain(|d| d.code != Code::Unclosed || !d.span.is_some_and(|s| is_garbled(s.start)));
    let mut reported: Vec<Span> = Vec::new();
    for error in errors {
        let previous = source.end_before(error.span.start);
        let garbled = is_garbled(error.span.start) || is_garbled(previous);
        if garbled
            || is_put_in(&error)
            || reported.last().is_some_and(|r| follows(source, *r, &error))
        {
            continue;
        }
        if reported.len() == MAX_ERRORS {
            let end = Span::new(source.file, source.text.len()..source.text.len());
            let message = "more syntax errors follow that are not shown";
            out.push(Diagnostic::new(Code::Syntax, end, message));
            return;
        }
        reported.push(error.span);
        out.push(diagnose(source, error));
    }
}

/// Is `error` a consequence of the one at `reported`, which the grammar met before?
fn follows(source: &Source<'_>, reported: Span, error: &SyntaxError) -> bool {
    let (first, second) = (reported.start, error.span.start);
    if second <= first {
        return first <= error.span.end;
    }
    if error.special.is_some() {
        return false;
    }
    let at = source.index_at(first);
    let ends = matches!(source.token(at), Some(Token::Semicolon | Token::RightBrace));
    !ends && source.index_at(second) - at <= 1
}

/// Is the token found one that was put in because brackets are not balanced?
fn is_put_in(error: &SyntaxError) -> bool {
    error.found.is_some_and(Token::is_closer) && error.span.start == error.span.end
}

fn diagnose(source: &Source<'_>, error: SyntaxError) -> Diagnostic {
    if let Some(special) = error.special {
        return *special;
    }
    let index = source.index_at(error.span.start);
    let previous = source.end_before(error.span.start);
    let hint = hints::hint(source, index, &error);
    let diagnostic = match missing(source, previous, &error) {
        Some(missing) if hint.is_none() => {
            let end = previous as usize;
            let after = Span::new(source.file, end..end);
            let message = format!("{missing} is missing here");
            Diagnostic::new(Code::Syntax, after, message).expected(missing)
        }
        _ => {
            let message = format!("unexpected {}", found(source, error.found, index));
            let diagnostic = Diagnostic::new(Code::Syntax, error.span, message);
            match either(&words(error.expected)) {
                Some(words) => diagnostic.expected(words),
                None => diagnostic,
            }
        }
    };
    match hint {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

/// What is to be put in at the end of a line, where another line or a `}` comes too early.
fn missing(source: &Source<'_>, previous: u32, error: &SyntaxError) -> Option<&'static str> {
    let ended = match error.found {
        None | Some(Token::RightBrace) => true,
        Some(_) => source.line(previous) < source.line(error.span.start),
    };
    let expects = |token| error.expected.has(Expected::token(token));
    let only_block =
        expects(Token::LeftBrace) && !error.expected.has(Expected::want(Want::Expression));
    match () {
        () if !ended => None,
        () if expects(Token::Semicolon) => Some("`;`"),
        () if only_block && !expects(Token::Assign) => Some("a block `{ ... }`"),
        () => None,
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
