//! The top level of a file: documentation, `use` declarations, definitions, and going on behind
//! a broken one.

use chumsky::prelude::*;

use super::common::{
    Input, Parse, Rule, doc_line, docs, list, name, nothing, one, semicolon, skip_docs, skip_one,
    spell,
};
use super::error::{Expected, SyntaxError, Want};
use super::item::{item, test};
use super::stmt::misplaced_docs;
use crate::ast::{Expr, Item, Module, Test, Use, UseName};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// A whole file.
pub(super) fn module<'t>(text: &'t str, expression: Rule<'t, Expr>) -> Rule<'t, Module> {
    let docs = just(Token::DocInner)
        .map_with(move |_, e| doc_line(text, e.span()))
        .repeated()
        .collect::<Vec<_>>();
    let entry =
        entry(text, expression).recover_with(via_parser(broken_entry(text).to(Entry::Broken)));
    docs.then(entry.repeated().collect::<Vec<_>>())
        .map_with(|(docs, entries), e| {
            let mut module = Module {
                docs,
                uses: Vec::new(),
                items: Vec::new(),
                tests: Vec::new(),
            };
            for entry in entries {
                match entry {
                    Entry::Use(declaration) => {
                        if !(module.items.is_empty() && module.tests.is_empty()) {
                            let late = late_use(declaration.span);
                            e.emit(SyntaxError::special(declaration.span, late));
                        }
                        module.uses.push(declaration);
                    }
                    Entry::Item(item) => module.items.push(*item),
                    Entry::Test(test) => module.tests.push(*test),
                    Entry::Broken => {}
                }
            }
            module
        })
        .boxed()
}

#[derive(Clone)]
enum Entry {
    Use(Use),
    Item(Box<Item>),
    Test(Box<Test>),
    Broken,
}

fn late_use(span: Span) -> Diagnostic {
    let message = "`use` after a definition";
    Diagnostic::new(Code::Syntax, span, message).hint("move it to the top of the file")
}

fn entry<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, Entry> {
    let test = test(text, expression.clone()).map(|test| Entry::Test(Box::new(test)));
    let item = item(text, expression);
    let private = just(Token::Private).or_not().map(|word| word.is_some());
    let item = docs(text)
        .then(
            private
                .then(item)
                .map_with(|(private, item), e| (private, item, e.span())),
        )
        .map(|(docs, (private, (name, kind), span))| {
            Entry::Item(Box::new(Item {
                docs,
                name,
                private,
                kind,
                span,
            }))
        });
    choice((
        docs(text).ignore_then(test),
        item,
        use_declaration(text).map(Entry::Use),
        undocumented().to(Entry::Broken),
    ))
    .boxed()
}

/// Documentation at the top level that belongs to no definition.
fn undocumented<'t>() -> impl Parse<'t, ()> + Copy {
    custom(|inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let marker = skip_docs(inp);
        let span = inp.span_since(&start);
        match (marker, inp.peek()) {
            (Some(Token::DocInner), _) | (Some(_), None | Some(Token::Use)) => {
                inp.emit(SyntaxError::special(span, misplaced_docs(marker, span)));
                Ok(())
            }
            _ => Err(nothing(span)),
        }
    })
}

/// Skips a broken definition, at least its first token, to the next one.
fn broken_entry<'t>(text: &'t str) -> impl Parse<'t, ()> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        if inp.peek().is_none() {
            return Err(nothing(inp.span_since(&start)));
        }
        skip_docs(inp);
        skip_one(inp);
        while !at_entry(text, inp) {
            skip_one(inp);
        }
        Ok(())
    })
}

/// Is the input at its end, before a definition or at a word that starts a line without blanks?
fn at_entry<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> bool {
    use Token::*;
    let before = inp.save();
    let first = inp.next();
    let span: Span = inp.span_since(before.cursor());
    let second = inp.peek();
    inp.rewind(before);
    let line_starts = text
        .get(..span.start as usize)
        .unwrap_or("")
        .ends_with('\n');
    match first {
        None | Some(Private | Material | Fn | Struct | Const | Use | Delta) => true,
        // These two are also types.
        Some(Bsdf | Edf) => line_starts || second == Some(Ident),
        // `test "title" { ... }`
        Some(Ident) if second == Some(Str) => true,
        Some(token) => line_starts && (matches!(token, Ident | DocOuter) || token.is_keyword()),
    }
}

/// `use std::noise::{flakes, perlin as noise};`
fn use_declaration<'t>(text: &'t str) -> impl Parse<'t, Use> {
    // Folders of the standard library are named like the closures they hold.
    let segment = one(Expected::want(Want::Name), |t| {
        matches!(t, Token::Ident | Token::Bsdf | Token::Edf)
    })
    .map(move |span| spell(text, span));
    let alias = just(Token::As).ignore_then(name(text)).or_not();
    let imported = name(text)
        .then(alias)
        .map(|(name, alias)| UseName { name, alias });
    let group = list(Token::LeftBrace, imported, Token::RightBrace);
    let next = just(Token::PathSeparator);
    let single = segment
        .then(alias)
        .map(|(name, alias)| vec![UseName { name, alias }]);
    let path = segment
        .then_ignore(next)
        .repeated()
        .at_least(1)
        .collect::<Vec<_>>();
    just(Token::Use)
        .ignore_then(path)
        .then(choice((group, single)))
        .then_ignore(semicolon(text))
        .map_with(|(path, names), e| Use {
            path,
            names,
            span: e.span(),
        })
}
