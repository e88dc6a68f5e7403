//! The top level of a file: documentation, `use` declarations, definitions, and going on behind
//! a broken one.

use chumsky::prelude::*;

use super::common::{
    Input, Parse, doc_line, docs, list, need, note, nothing, optional, read_name, recover,
    semicolon, skip_docs, skip_one, spell,
};
use super::error::{Expected, SyntaxError, Want};
use super::item::{item, test};
use super::stmt::misplaced_docs;
use crate::ast::{Item, Module, Name, Test, Use, UseName};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// Reads a whole file.
pub(super) fn module<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Module> {
    let mut module = Module {
        docs: Vec::new(),
        uses: Vec::new(),
        items: Vec::new(),
        tests: Vec::new(),
    };
    let mut late = Vec::new();
    let mut line = inp.cursor();
    while need(inp, Token::DocInner).is_some() {
        module.docs.push(doc_line(text, inp.span_since(&line)));
        line = inp.cursor();
    }
    while let Some(entry) = entry(text, inp) {
        match entry {
            Entry::Use(declaration) => {
                if !(module.items.is_empty() && module.tests.is_empty()) {
                    late.push(declaration.span);
                }
                module.uses.push(declaration);
            }
            Entry::Item(item) => module.items.push(*item),
            Entry::Test(test) => module.tests.push(test),
            Entry::Broken => {}
        }
    }
    for span in late {
        inp.emit(SyntaxError::special(span, late_use(span)));
    }
    Some(module)
}

enum Entry {
    Use(Use),
    Item(Box<Item>),
    Test(Test),
    Broken,
}

fn late_use(span: Span) -> Diagnostic {
    let message = "`use` after a definition";
    Diagnostic::new(Code::Syntax, span, message).hint("move it to the top of the file")
}

fn entry<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Entry> {
    let documented_test = |inp: &mut Input<'t, '_>| {
        while need(inp, Token::DocOuter).is_some() {}
        test(text, inp)
    };
    if let Some(test) = optional(inp, documented_test) {
        return Some(Entry::Test(test));
    }
    if let Some(item) = optional(inp, |inp| documented_item(text, inp)) {
        return Some(Entry::Item(Box::new(item)));
    }
    if let Some(declaration) = optional(inp, |inp| use_declaration(text, inp)) {
        return Some(Entry::Use(declaration));
    }
    let skipped = optional(inp, undocumented).or_else(|| recover(inp, broken_entry(text)));
    skipped.map(|()| Entry::Broken)
}

fn documented_item<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Item> {
    let docs = docs(text, inp);
    let start = inp.cursor();
    let private = need(inp, Token::Private).is_some();
    let (name, kind) = item(text, inp)?;
    Some(Item {
        docs,
        name,
        private,
        kind,
        span: inp.span_since(&start),
    })
}

/// Reads documentation at the top level that belongs to no definition.
fn undocumented(inp: &mut Input<'_, '_>) -> Option<()> {
    let start = inp.cursor();
    let marker = skip_docs(inp)?;
    let span = inp.span_since(&start);
    if marker == Token::DocOuter && !matches!(inp.peek(), None | Some(Token::Use)) {
        return None;
    }
    inp.emit(SyntaxError::special(span, misplaced_docs(marker, span)));
    Some(())
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

/// Reads `use std::noise::{flakes, perlin as noise};`.
fn use_declaration<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Use> {
    let start = inp.cursor();
    need(inp, Token::Use)?;
    let step = |inp: &mut Input<'t, '_>| {
        let segment = segment(text, inp)?;
        need(inp, Token::PathSeparator)?;
        Some(segment)
    };
    let mut path = Vec::new();
    while let Some(segment) = optional(inp, step) {
        path.push(segment);
    }
    if path.is_empty() {
        return None;
    }
    let group = list(inp, (Token::LeftBrace, Token::RightBrace), |inp| {
        let name = read_name(text, inp)?;
        let alias = alias(text, inp);
        Some(UseName { name, alias })
    });
    let names = match group {
        Some(names) => names,
        None => {
            let name = segment(text, inp)?;
            let alias = alias(text, inp);
            vec![UseName { name, alias }]
        }
    };
    semicolon(text, inp);
    Some(Use {
        path,
        names,
        span: inp.span_since(&start),
    })
}

/// Reads a name in a path: folders of the standard library are named like the closures they hold.
fn segment<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Name> {
    let start = inp.cursor();
    let Some(Token::Ident | Token::Bsdf | Token::Edf) = inp.peek() else {
        note(inp, Expected::want(Want::Name));
        return None;
    };
    inp.skip();
    Some(spell(text, inp.span_since(&start)))
}

/// Reads `as name`, or nothing.
fn alias<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Name> {
    optional(inp, |inp| {
        need(inp, Token::As)?;
        read_name(text, inp)
    })
}
