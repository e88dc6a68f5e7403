//! What every part of the grammar is built from: names, lists, and going on after an error.
//!
//! One rule keeps parsing linear in the length of the source: after the token that tells which
//! construct it is, an expression, block or list never fails. What is missing is reported and
//! replaced by an empty node, and nothing is read twice. The token stream has balanced brackets
//! (see `brackets`), so skipping to the end of a bracket always arrives.

use chumsky::input::{InputRef, MappedInput};
use chumsky::prelude::*;

use super::error::{Expected, SyntaxError, Want};
use crate::ast::{ArrayType, Expr, Name, TypeName};
use crate::lexer::{Token, doc_text};
use crate::source::{Span, Spanned};

/// The parsers' input.
pub(super) type Tokens<'t> = MappedInput<'t, Token, Span, &'t [(Token, Span)]>;
/// The parsers' error type.
pub(super) type Extra = extra::Err<SyntaxError>;
/// The input while it is read.
pub(super) type Input<'t, 'p> = InputRef<'t, 'p, Tokens<'t>, Extra>;
/// A parser behind a pointer, which keeps types and compile times small.
pub(super) type Rule<'t, T> = Boxed<'t, 't, Tokens<'t>, T, Extra>;

/// A parser of this grammar.
pub(super) trait Parse<'t, T>: Parser<'t, Tokens<'t>, T, Extra> + Clone + 't {}
impl<'t, T, P: Parser<'t, Tokens<'t>, T, Extra> + Clone + 't> Parse<'t, T> for P {}

/// One token that `accept` accepts; `expected` names it in errors. Gives its place.
pub(super) fn one<'t>(
    expected: Expected,
    accept: impl Fn(Token) -> bool + Copy + 't,
) -> impl Parse<'t, Span> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let before = inp.cursor();
        match inp.next() {
            Some(token) if accept(token) => Ok(inp.span_since(&before)),
            found => Err(SyntaxError::new(inp.span_since(&before), found, expected)),
        }
    })
}

/// Succeeds before a token that `accept` accepts, and takes nothing.
pub(super) fn before<'t>(
    expected: Expected,
    accept: impl Fn(Token) -> bool + Copy + 't,
) -> impl Parse<'t, ()> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        match inp.peek() {
            Some(token) if accept(token) => Ok(()),
            _ => {
                let found = inp.next();
                Err(SyntaxError::new(inp.span_since(&start), found, expected))
            }
        }
    })
}

/// A name.
pub(super) fn name<'t>(text: &'t str) -> impl Parse<'t, Name> + Copy {
    one(Expected::want(Want::Name), |t| t == Token::Ident).map(move |span| spell(text, span))
}

/// A name that is a word of the grammar before a token that `follows` accepts. Fails, before it takes anything, elsewhere.
pub(super) fn contextual<'t>(
    text: &'t str,
    word: &'static str,
    follows: impl Fn(Token) -> bool + Copy + 't,
) -> impl Parse<'t, Span> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.save();
        let found = inp.next();
        let span: Span = inp.span_since(start.cursor());
        let is_word = found == Some(Token::Ident) && text.get(span.range()) == Some(word);
        if is_word && inp.peek().is_some_and(follows) {
            return Ok(span);
        }
        inp.rewind(start);
        Err(nothing(span))
    })
}

/// A type: a name or a keyword that names a closure, and `[count]` or `[]` after it for an array.
pub(super) fn type_name<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, TypeName> {
    let accept = |t| matches!(t, Token::Ident | Token::Bsdf | Token::Edf);
    let element = one(Expected::want(Want::Type), accept).map(move |span| spell(text, span));
    let count = just(Token::LeftBracket)
        .ignore_then(expression.or_not())
        .then_ignore(close(Token::RightBracket))
        .or_not();
    element.then(count).map_with(move |(element, count), e| {
        let span: Span = e.span();
        let written = text.get(span.range()).unwrap_or("");
        TypeName {
            node: written.split_whitespace().collect(),
            span,
            array: count.map(|count| Box::new(ArrayType { element, count })),
        }
    })
}

/// The text at `span` as a name.
pub(super) fn spell(text: &str, span: Span) -> Name {
    Spanned {
        node: text.get(span.range()).unwrap_or("").to_owned(),
        span,
    }
}

/// `///` lines.
pub(super) fn docs<'t>(text: &'t str) -> Rule<'t, Vec<String>> {
    just(Token::DocOuter)
        .map_with(move |_, e| doc_line(text, e.span()))
        .repeated()
        .collect()
        .boxed()
}

pub(super) fn doc_line(text: &str, span: Span) -> String {
    doc_text(text.get(span.range()).unwrap_or("")).to_owned()
}

/// `;`. When it is missing, that is reported once and the statement ends all the same.
pub(super) fn semicolon<'t>(text: &'t str) -> impl Parse<'t, ()> {
    just(Token::Semicolon)
        .ignored()
        .recover_with(via_parser(rest_of_statement(text)))
}

/// `open item, item, ... close`, with one error an item at most.
pub(super) fn list<'t, T: 't>(
    open: Token,
    item: impl Parse<'t, T>,
    close: Token,
) -> impl Parse<'t, Vec<T>> {
    let ends = move |t| t == Token::Comma || t == close;
    let expected = Expected::tokens(&[Token::Comma, close]);
    let skipped = skip(1, ends);
    let item = item
        .map(Some)
        .recover_with(via_parser(skipped.map(|()| None)))
        .then_ignore(before(expected, ends).recover_with(via_parser(skip(0, ends))))
        .boxed();
    let items = item
        .separated_by(just(Token::Comma))
        .allow_trailing()
        .collect::<Vec<_>>();
    just(open)
        .ignore_then(items)
        .then_ignore(self::close(close))
        .map(|items| items.into_iter().flatten().collect())
}

/// A closing bracket; what stands before it and does not belong there is reported and skipped.
pub(super) fn close<'t>(close: Token) -> impl Parse<'t, ()> {
    let to_close = skip(0, move |t| t == close).then_ignore(just(close));
    just(close).ignored().recover_with(via_parser(to_close))
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
