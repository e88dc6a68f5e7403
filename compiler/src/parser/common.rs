//! What every part of the grammar is built from: names, lists, and going on after an error.
//!
//! The grammar is functions that read token by token: the next one tells which construct it is, so that no
//! other is tried. They give `None` where they do not match, and leave it to their callers to go back.
//! What would have been accepted is noted then, and where an optional part is left out: an error names
//! everything that was noted at the furthest place. [`recover`] reports it.
//!
//! One rule keeps parsing linear in the length of the source: after the token that tells which
//! construct it is, an expression, block or list never fails. What is missing is reported and
//! replaced by an empty node, and nothing is read twice. The token stream has balanced brackets
//! (see `brackets`), so skipping to the end of a bracket always arrives.

use chumsky::input::{InputRef, MappedInput};
use chumsky::prelude::*;

use super::error::{Expected, SyntaxError, Want};
use super::expr;
use crate::ast::{ArrayType, Name, TypeName};
use crate::lexer::{Token, doc_text};
use crate::source::{Span, Spanned};

/// The parsers' input.
pub(super) type Tokens<'t> = MappedInput<'t, Token, Span, &'t [(Token, Span)]>;
/// The parsers' error type.
pub(super) type Extra = extra::Err<SyntaxError>;
/// The input while it is read.
pub(super) type Input<'t, 'p> = InputRef<'t, 'p, Tokens<'t>, Extra>;

/// A parser of this grammar.
pub(super) trait Parse<'t, T>: Parser<'t, Tokens<'t>, T, Extra> + Clone + 't {}
impl<'t, T, P: Parser<'t, Tokens<'t>, T, Extra> + Clone + 't> Parse<'t, T> for P {}

/// The parser of what `read` reads: chumsky's, for a whole source and for what recovers.
pub(super) fn rule<'t, T: 't>(
    read: impl Fn(&mut Input<'t, '_>) -> Option<T> + Copy + 't,
) -> impl Parse<'t, T> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        // What was expected is noted already.
        read(inp).ok_or_else(|| nothing(inp.span_since(&start)))
    })
}

/// Takes the next token if it is `token`.
pub(super) fn take(inp: &mut Input<'_, '_>, token: Token) -> bool {
    let found = inp.peek() == Some(token);
    if found {
        inp.skip();
    }
    found
}

/// Takes the next token, which has to be `token`.
pub(super) fn need(inp: &mut Input<'_, '_>, token: Token) -> Option<()> {
    if take(inp, token) {
        return Some(());
    }
    note(inp, Expected::token(token));
    None
}

/// Notes what would be accepted in the place of the next token.
pub(super) fn note<'t>(inp: &mut Input<'t, '_>, expected: Expected) {
    // The parser keeps the errors of what does not match, those of one place together.
    let unmatched = custom(move |inp: &mut Input<'t, '_>| {
        let here = inp.cursor();
        let found = inp.next();
        Err::<(), _>(SyntaxError::new(inp.span_since(&here), found, expected))
    });
    let noted = inp.parse(unmatched.or_not());
    debug_assert!(matches!(noted, Ok(None)));
}

/// Reports what was noted as missing, and goes on by `by`, unless that fails.
pub(super) fn recover<'t>(inp: &mut Input<'t, '_>, by: impl Parse<'t, ()>) -> Option<()> {
    let missing = rule(|_: &mut Input<'t, '_>| None);
    let gone_on = inp.parse(missing.recover_with(via_parser(by)).or_not());
    gone_on.ok().flatten()
}

/// Reads a name.
pub(super) fn read_name<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Name> {
    let start = inp.cursor();
    if !take(inp, Token::Ident) {
        note(inp, Expected::want(Want::Name));
        return None;
    }
    Some(spell(text, inp.span_since(&start)))
}

/// What `read` reads, or nothing: then it has taken nothing.
pub(super) fn optional<'t, T>(
    inp: &mut Input<'t, '_>,
    read: impl FnOnce(&mut Input<'t, '_>) -> Option<T>,
) -> Option<T> {
    let start = inp.save();
    let found = read(inp);
    if found.is_none() {
        inp.rewind(start);
    }
    found
}

/// Reads `///` lines.
pub(super) fn docs<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Vec<String> {
    let mut lines = Vec::new();
    let mut start = inp.cursor();
    while need(inp, Token::DocOuter).is_some() {
        lines.push(doc_line(text, inp.span_since(&start)));
        start = inp.cursor();
    }
    lines
}

/// Reads a type: a name or a keyword that names a closure, and `[count]` or `[]` after it for an array.
pub(super) fn type_name<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<TypeName> {
    let start = inp.cursor();
    let Some(Token::Ident | Token::Bsdf | Token::Edf) = inp.peek() else {
        note(inp, Expected::want(Want::Type));
        return None;
    };
    inp.skip();
    let element = spell(text, inp.span_since(&start));
    if !take(inp, Token::LeftBracket) {
        note(inp, Expected::token(Token::LeftBracket));
        return Some(TypeName {
            node: element.node,
            span: element.span,
            array: None,
        });
    }
    let count = expr::expression(text, inp);
    close(inp, Token::RightBracket)?;
    let span: Span = inp.span_since(&start);
    let written = text.get(span.range()).unwrap_or("");
    Some(TypeName {
        node: written.split_whitespace().collect(),
        span,
        array: Some(Box::new(ArrayType { element, count })),
    })
}

/// The text at `span` as a name.
pub(super) fn spell(text: &str, span: Span) -> Name {
    Spanned {
        node: text.get(span.range()).unwrap_or("").to_owned(),
        span,
    }
}

pub(super) fn doc_line(text: &str, span: Span) -> String {
    doc_text(text.get(span.range()).unwrap_or("")).to_owned()
}

/// Reads `;`. When it is missing, that is reported once and the statement ends all the same.
pub(super) fn semicolon<'t>(text: &'t str, inp: &mut Input<'t, '_>) {
    if need(inp, Token::Semicolon).is_none() {
        recover(inp, rest_of_statement(text));
    }
}

/// Reads `open item, item, ... close`, with one error an item at most. Fails only before another token than `open`.
pub(super) fn list<'t, T>(
    inp: &mut Input<'t, '_>,
    (open, close): (Token, Token),
    item: impl Fn(&mut Input<'t, '_>) -> Option<T>,
) -> Option<Vec<T>> {
    need(inp, open)?;
    let ends = move |t| t == Token::Comma || t == close;
    let mut items = Vec::new();
    while inp.peek() != Some(close) {
        let before = inp.save();
        match item(inp) {
            Some(item) => items.push(item),
            None => {
                inp.rewind(before);
                if recover(inp, skip(1, ends)).is_none() {
                    break;
                }
            }
        }
        if !inp.peek().is_some_and(ends) {
            note(inp, Expected::tokens(&[Token::Comma, close]));
            recover(inp, skip(0, ends));
        }
        if !take(inp, Token::Comma) {
            break;
        }
    }
    self::close(inp, close)?;
    Some(items)
}

/// Reads a closing bracket; what stands before it and does not belong there is reported and skipped.
pub(super) fn close(inp: &mut Input<'_, '_>, close: Token) -> Option<()> {
    if need(inp, close).is_some() {
        return Some(());
    }
    recover(inp, skip(0, move |t| t == close).then_ignore(just(close)))
}

/// Skips over whole brackets to a token that ends the construct, which it does not take, or to
/// the end of the enclosing bracket. Fails if that skips less than `least` tokens.
pub(super) fn skip<'t>(
    least: usize,
    ends: impl Fn(Token) -> bool + Copy + 't,
) -> impl Parse<'t, ()> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let mut count = 0;
        while let Some(token) = inp.peek() {
            if token.is_closer() || ends(token) {
                break;
            }
            skip_one(inp);
            count += 1;
        }
        if count < least {
            return Err(nothing(inp.span_since(&start)));
        }
        Ok(())
    })
}

/// Skips what is left of a broken statement: to its `;` or before the next statement, which may
/// be right here. Never fails.
pub(super) fn rest_of_statement<'t>(text: &'t str) -> impl Parse<'t, ()> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        if !on_new_line(text, inp) {
            skip_statement(inp, 0);
        }
        Ok(())
    })
}

/// Skips a broken statement from its first token, documentation included. Fails where no
/// statement can be.
pub(super) fn broken_statement<'t>() -> impl Parse<'t, ()> + Copy {
    custom(|inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        skip_docs(inp);
        match inp.peek() {
            Some(token) if !token.is_closer() => {
                skip_statement(inp, 1);
                Ok(())
            }
            _ => Err(nothing(inp.span_since(&start))),
        }
    })
}

/// Skips documentation comments and gives the last one's kind.
pub(super) fn skip_docs(inp: &mut Input<'_, '_>) -> Option<Token> {
    let mut last = None;
    while let Some(token @ (Token::DocOuter | Token::DocInner)) = inp.peek() {
        inp.skip();
        last = Some(token);
    }
    last
}

fn skip_statement(inp: &mut Input<'_, '_>, least: usize) {
    let mut count = 0;
    while let Some(token) = inp.peek() {
        if token.is_closer() || (count >= least && begins_statement(token)) {
            return;
        }
        skip_one(inp);
        count += 1;
        let goes_on = matches!(inp.peek(), Some(Token::Else | Token::When));
        let block_ended = token == Token::LeftBrace && !goes_on;
        if token == Token::Semicolon || (block_ended && inp.peek() != Some(Token::Semicolon)) {
            return;
        }
    }
}

/// Does the statement before `token`, the next one, end there at the latest?
pub(super) fn ends_statement<'t>(text: &'t str, token: Token, inp: &mut Input<'t, '_>) -> bool {
    let ends = token.is_closer() || token == Token::Semicolon;
    ends || begins_statement(token) || on_new_line(text, inp)
}

/// Keywords that only ever start a statement or declaration.
fn begins_statement(token: Token) -> bool {
    use Token::*;
    matches!(
        token,
        Let | Var | For | While | Break | Continue | Param | DocOuter | DocInner
    )
}

/// Does the next token start a line, or is there none?
pub(super) fn on_new_line<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> bool {
    let here = inp.cursor();
    let previous_end = here.inner().1.unwrap_or(0) as usize;
    let before = inp.save();
    let found = inp.next();
    let next_start = inp.span_since(&here).start as usize;
    inp.rewind(before);
    let between = text.get(previous_end..next_start).unwrap_or("");
    found.is_none() || between.contains('\n')
}

/// Skips one token, or a whole bracket if it opens one.
pub(super) fn skip_one(inp: &mut Input<'_, '_>) {
    let mut depth = 0_usize;
    while let Some(token) = inp.next() {
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth = depth.saturating_sub(1);
        }
        if depth == 0 {
            return;
        }
    }
}

/// The error of a recovery that does not apply; the first error is the one reported.
pub(super) fn nothing(span: Span) -> SyntaxError {
    SyntaxError::new(span, None, Expected::default())
}
