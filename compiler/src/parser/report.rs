//! Syntax errors to diagnostics, in people's words.
//!
//! One slip often makes the grammar stumble several times. So an error is not reported that
//! follows another within two tokens, that is about an expression with an error inside,
//! or that is on a line where a character, string or bracket was already reported.

use std::collections::{BTreeMap, BTreeSet};

use super::MAX_ERRORS;
use super::brackets::Balanced;
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
    balanced: &'t Balanced,
    newlines: Vec<u32>,
}

impl<'t> Source<'t> {
    pub(super) fn new(file: FileId, text: &'t str, balanced: &'t Balanced) -> Self {
        let newlines = text.bytes().zip(0_u32..).filter(|(byte, _)| *byte == b'\n');
        Self {
            file,
            text,
            tokens: &balanced.tokens,
            balanced,
            newlines: newlines.map(|(_, at)| at).collect(),
        }
    }

    /// The number of the first token at or after `place`, of those that were written.
    fn index_at(&self, place: u32) -> usize {
        let index = self.tokens.partition_point(|(_, span)| span.start < place);
        let put_in = |t: &&(Token, Span)| t.1.start == t.1.end;
        index + self.tokens[index..].iter().take_while(put_in).count()
    }

    /// The first token of the statement that the token at `index` is in.
    pub(super) fn statement_start(&self, index: usize) -> usize {
        let mut depth = 0_usize;
        let mut start = index;
        while let Some(token) = start.checked_sub(1).and_then(|i| self.token(i)) {
            use Token::*;
            match token {
                RightParen | RightBracket => depth += 1,
                LeftParen | LeftBracket if depth == 0 => break,
                LeftParen | LeftBracket => depth -= 1,
                Semicolon | LeftBrace | RightBrace | DocOuter | DocInner if depth == 0 => break,
                Use | Let | Var | For | While | Param if depth == 0 => return start - 1,
                _ => {}
            }
            start -= 1;
        }
        start
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

/// Appends the diagnostics of brackets and of `errors` to those of the lexer.
pub(super) fn report(source: &Source<'_>, errors: Vec<SyntaxError>, out: &mut Vec<Diagnostic>) {
    let is_garbage =
        |d: &&Diagnostic| matches!(d.code, Code::UnknownCharacter | Code::Unterminated);
    let garbled = out.iter().filter(is_garbage).filter_map(|d| d.span);
    let garbled: BTreeSet<usize> = garbled.map(|span| source.line(span.start)).collect();
    let is_garbled = |place: u32| garbled.contains(&source.line(place));
    let unclosed = &source.balanced.unclosed;
    let unclosed = unclosed.iter().filter(|(at, _)| !is_garbled(at.start));
    out.extend(unclosed.map(|(_, diagnostic)| diagnostic.clone()));

    let unclosed = &source.balanced.unclosed;
    let unclosed: BTreeMap<usize, u32> = unclosed
        .iter()
        .map(|(at, _)| (source.line(at.start), at.start))
        .collect();
    let behind_unclosed = |place: u32| {
        let on_line = unclosed.get(&source.line(place));
        on_line.is_some_and(|open| *open < place)
    };
    let mut reported: Vec<SyntaxError> = Vec::new();
    let mut more = false;
    for error in errors {
        let place = error.span.start;
        if reported
            .last()
            .is_some_and(|last| follows(source, last, &error))
            || is_garbled(place)
            || is_garbled(source.end_before(place))
            || behind_unclosed(place)
            || is_at_put_in(source, &error)
        {
            continue;
        }
        more = reported.len() == MAX_ERRORS;
        if more {
            break;
        }
        reported.push(error);
    }
    let stray = source.balanced.stray.iter();
    let stray =
        stray.filter(|(at, _)| !is_garbled(at.start) && !is_explained(source, *at, &reported));
    out.extend(stray.map(|(_, diagnostic)| diagnostic.clone()));
    if more {
        let end = Span::new(source.file, source.text.len()..source.text.len());
        let message = "more syntax errors follow that are not shown";
        out.push(Diagnostic::new(Code::Syntax, end, message));
    }
    out.extend(reported.into_iter().map(|error| diagnose(source, error)));
}

/// Is `error` a consequence of `last`, which the grammar met before?
fn follows(source: &Source<'_>, last: &SyntaxError, error: &SyntaxError) -> bool {
    let (first, second) = (last.span.start, error.span.start);
    if second <= first {
        return first <= error.span.end;
    }
    let at = source.index_at(first);
    let ends = matches!(source.token(at), Some(Token::Semicolon | Token::RightBrace));
    let apart = source.line(first) < source.line(second) && last.special.is_none();
    !ends && !apart && error.special.is_none() && source.index_at(second) - at <= 2
}

/// Is `error` at or behind a bracket that was put in?
fn is_at_put_in(source: &Source<'_>, error: &SyntaxError) -> bool {
    let put_in = |span: Span| span.start == span.end;
    let before = source.index_at(error.span.start).checked_sub(1);
    let before = before.and_then(|index| source.tokens.get(index));
    let at = error.found.is_some_and(Token::is_closer) && put_in(error.span);
    at || before.is_some_and(|(_, span)| put_in(*span))
}

/// Does a syntax error before the stray bracket at `stray` say why it has no partner?
fn is_explained(source: &Source<'_>, stray: Span, reported: &[SyntaxError]) -> bool {
    let index = source.index_at(stray.start);
    let start = source.tokens.get(source.statement_start(index));
    let start = start.map_or(stray.start, |(_, span)| span.start);
    let is_brace = source.text.get(stray.range()) == Some("}");
    reported.iter().any(|error| {
        let brace = Expected::token(Token::LeftBrace);
        let operand = Expected::token(Token::Minus);
        let misses_brace = error.expected.has(brace) && !error.expected.has(operand);
        let inside = error.span.start >= start || (is_brace && misses_brace);
        inside && error.span.start <= stray.start
    })
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
            let lacking = Diagnostic::new(Code::Syntax, after, message).expected(missing);
            match missing.strip_prefix('`').and_then(|m| m.strip_suffix('`')) {
                Some(mark) => lacking.replaced(after, None, mark),
                None => lacking,
            }
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
    let mut rest = expected.without(Expected::tokens(&[
        DocOuter,
        DocInner,
        Else,
        Unknown,
        LeftBracket,
    ]));
    let mut words = Vec::new();
    let expression = Expected::want(Want::Expression);
    let definition = Expected::tokens(&[Material, Bsdf, Delta, Edf, Fn, Struct, Const]);
    let statement = Expected::tokens(&[Let, Var, For, While, Break, Continue, If]).with(expression);
    let prefix = Expected::tokens(&[Minus, Not]);
    let operand = Expected::tokens(&[LeftParen, LeftBracket, LeftBrace, Str, True, False, If]);
    let operand = operand
        .with(prefix)
        .with(expression)
        .with(Expected::want(Want::Name));
    let operator =
        Expected::want(Want::Operator).with(Expected::tokens(&[Dot, LeftParen, LeftBracket]));
    let assign = Expected::tokens(&[
        Assign,
        AddAssign,
        SubAssign,
        MulAssign,
        DivAssign,
        RemAssign,
        AndAssign,
        OrAssign,
        XorAssign,
        ShiftLeftAssign,
        ShiftRightAssign,
    ]);
    if rest.has(definition) {
        words.push("a definition, such as `material`, `bsdf` or `fn`".to_owned());
        rest = rest.without(definition.with(Expected::tokens(&[Private, Use])));
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
