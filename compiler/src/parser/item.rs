//! The top level: `use`, materials, closures, functions, structs and constants.

use chumsky::prelude::*;

use super::common::{
    Input, Parse, Rule, broken_statement, close, list, name, nothing, one, semicolon, skip_one,
    spell, type_name,
};
use super::error::{Expected, SyntaxError, Want};
use super::expr::required;
use super::stmt::{self, Piece, misplaced_docs, piece, stray_docs};
use crate::ast::{
    Block, Body, ClosureDef, ClosureKind, Const, Expr, Field, Function, Item, ItemKind, Material,
    MaterialParam, Method, Module, Name, Param, Stmt, Use, UseName,
};
use crate::diag::{Code, Diagnostic};
use crate::lexer::{Token, doc_text};
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
            };
            for entry in entries {
                match entry {
                    Entry::Use(declaration) => {
                        if !module.items.is_empty() {
                            let late = late_use(declaration.span);
                            e.emit(SyntaxError::special(declaration.span, late));
                        }
                        module.uses.push(declaration);
                    }
                    Entry::Item(item) => module.items.push(*item),
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
    Broken,
}

fn late_use(span: Span) -> Diagnostic {
    let message = "`use` after a definition";
    Diagnostic::new(Code::Syntax, span, message).hint("move it to the top of the file")
}

fn entry<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, Entry> {
    let block = stmt::block(text, expression.clone());
    let body = body(text, expression.clone(), block.clone());
    let parameters = parameters(text, expression.clone());
    let item = choice((
        material(text, expression.clone(), block),
        closure(text, expression.clone(), parameters.clone(), body.clone()),
        function(text, parameters, body),
        structure(text),
        constant(text, expression),
    ));
    let item = docs(text)
        .then(item.map_with(|(name, kind), e| (name, kind, e.span())))
        .map(|(docs, (name, kind, span))| {
            Entry::Item(Box::new(Item {
                docs,
                name,
                kind,
                span,
            }))
        });
    choice((
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
        let mut marker = None;
        while let Some(token @ (Token::DocOuter | Token::DocInner)) = inp.peek() {
            inp.skip();
            marker = marker.max(Some(token));
        }
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

/// `///` lines.
fn docs<'t>(text: &'t str) -> Rule<'t, Vec<String>> {
    just(Token::DocOuter)
        .map_with(move |_, e| doc_line(text, e.span()))
        .repeated()
        .collect()
        .boxed()
}

fn doc_line(text: &str, span: Span) -> String {
    doc_text(text.get(span.range()).unwrap_or("")).to_owned()
}

/// Skips a broken definition, at least its first token, to the next one.
fn broken_entry<'t>(text: &'t str) -> impl Parse<'t, ()> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        if inp.peek().is_none() {
            return Err(nothing(inp.span_since(&start)));
        }
        while matches!(inp.peek(), Some(Token::DocOuter)) {
            inp.skip();
        }
        loop {
            let first = inp.peek();
            skip_one(inp);
            let ended = matches!(first, Some(Token::Semicolon | Token::LeftBrace));
            if ended || at_entry(text, inp) {
                return Ok(());
            }
        }
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
        None | Some(Material | Fn | Struct | Const | Use | Delta | DocOuter) => true,
        // These two are also types.
        Some(Bsdf | Edf) => line_starts || second == Some(Ident),
        Some(token) => line_starts && (token == Ident || token.is_keyword()),
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

#[derive(Clone)]
enum Entered {
    Param(MaterialParam),
    Piece(Piece),
}

/// `material name { params and statements }`
fn material<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> impl Parse<'t, (Name, ItemKind)> {
    let param = docs(text)
        .then(material_param(text, expression.clone()))
        .map(|(docs, param)| Entered::Param(MaterialParam { docs, ..param }));
    let entered = choice((param, piece(text, expression, block).map(Entered::Piece)));
    just(Token::Material)
        .ignore_then(name(text))
        .then_ignore(just(Token::LeftBrace))
        .then(entered.repeated().collect::<Vec<_>>())
        .then_ignore(close(Token::RightBrace))
        .map_with(|(name, entries), e| {
            let mut material = Material {
                params: Vec::new(),
                body: Vec::new(),
            };
            for entered in entries {
                match entered {
                    Entered::Param(param) => material.params.push(param),
                    Entered::Piece(Piece::Value(value)) => {
                        let lost = lost_value(&value);
                        e.emit(SyntaxError::special(value.span, lost));
                    }
                    Entered::Piece(piece) => material.body.extend(stmt::statement(piece)),
                }
            }
            (name, ItemKind::Material(material))
        })
        .boxed()
}

fn lost_value(value: &Expr) -> Diagnostic {
    Diagnostic::new(
        Code::Syntax,
        value.span,
        "a material has no value of its own",
    )
    .expected("a statement")
    .hint("assign what it scatters, as in `surface = ...;`")
}

/// `param name: type = default in low .. high;`
fn material_param<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, MaterialParam> {
    let range = just(Token::In)
        .ignore_then(expression.clone())
        .then_ignore(just(Token::Range))
        .then(required(expression.clone()))
        .or_not();
    just(Token::Param)
        .ignore_then(name(text))
        .then_ignore(just(Token::Colon))
        .then(type_name(text))
        .then_ignore(just(Token::Assign))
        .then(required(expression))
        .then(range)
        .then_ignore(semicolon(text))
        .map_with(|(((name, ty), default), range), e| MaterialParam {
            docs: Vec::new(),
            name,
            ty,
            default,
            range,
            span: e.span(),
        })
        .boxed()
}

/// `(name: type = default, ...)`
fn parameters<'t>(text: &'t str, expression: Rule<'t, Expr>) -> Rule<'t, Vec<Param>> {
    let default = just(Token::Assign)
        .ignore_then(required(expression))
        .or_not();
    let param = name(text)
        .then_ignore(just(Token::Colon))
        .then(type_name(text))
        .then(default)
        .map(|((name, ty), default)| Param { name, ty, default });
    list(Token::LeftParen, param, Token::RightParen).boxed()
}

/// `= value when condition;` or a block.
fn body<'t>(text: &'t str, expression: Rule<'t, Expr>, block: Rule<'t, Block>) -> Rule<'t, Body> {
    let when = just(Token::When)
        .ignore_then(required(expression.clone()))
        .or_not();
    let short = just(Token::Assign)
        .ignore_then(required(expression))
        .then(when)
        .then_ignore(semicolon(text))
        .map(|(value, when)| Body::Expr { value, when });
    choice((short, block.map(Body::Block))).boxed()
}

/// `bsdf name(params) { lets methods }`
fn closure<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    parameters: Rule<'t, Vec<Param>>,
    body: Rule<'t, Body>,
) -> impl Parse<'t, (Name, ItemKind)> {
    let kind = choice((
        just(Token::Bsdf).to(ClosureKind::Bsdf),
        just(Token::Delta)
            .then(just(Token::Bsdf))
            .to(ClosureKind::DeltaBsdf),
        just(Token::Edf).to(ClosureKind::Edf),
    ));
    kind.then(name(text))
        .then(parameters)
        .then_ignore(just(Token::LeftBrace))
        .then(members(text, expression, body))
        .then_ignore(close(Token::RightBrace))
        .map_with(|(((kind, name), params), members), e| {
            let mut closure = ClosureDef {
                kind,
                params,
                lets: Vec::new(),
                methods: Vec::new(),
            };
            for member in members {
                match member {
                    Member::Let(stmt) => {
                        if !closure.methods.is_empty() {
                            e.emit(SyntaxError::special(stmt.span, late_let(stmt.span)));
                        }
                        closure.lets.push(stmt);
                    }
                    Member::Method(method) => closure.methods.push(method),
                    Member::Broken => {}
                }
            }
            (name, ItemKind::Closure(closure))
        })
        .boxed()
}

fn late_let(span: Span) -> Diagnostic {
    Diagnostic::new(Code::Syntax, span, "`let` after a method")
        .hint("move it before the methods, which all share it")
}

#[derive(Clone)]
enum Member {
    Let(Stmt),
    Method(Method),
    Broken,
}

/// What stands between the braces of a closure.
fn members<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    body: Rule<'t, Body>,
) -> impl Parse<'t, Vec<Member>> {
    let shared = stmt::binding(text, false, expression).map_with(|kind, e| {
        let span = e.span();
        Member::Let(Stmt { kind, span })
    });
    let arguments = list(Token::LeftParen, name(text), Token::RightParen);
    let method = name(text)
        .then(arguments)
        .then(body)
        .map_with(|((name, args), body), e| {
            Member::Method(Method {
                name,
                args,
                body,
                span: e.span(),
            })
        });
    choice((shared, method, stray_docs().to(Member::Broken)))
        .recover_with(via_parser(broken_statement().to(Member::Broken)))
        .boxed()
        .repeated()
        .collect()
}

/// `fn name(params) -> type body`
fn function<'t>(
    text: &'t str,
    parameters: Rule<'t, Vec<Param>>,
    body: Rule<'t, Body>,
) -> impl Parse<'t, (Name, ItemKind)> {
    just(Token::Fn)
        .ignore_then(name(text))
        .then(parameters)
        .then_ignore(just(Token::Arrow))
        .then(type_name(text))
        .then(body)
        .map(|(((name, params), result), body)| {
            let function = Function {
                params,
                result,
                body,
            };
            (name, ItemKind::Function(function))
        })
        .boxed()
}

/// `struct name { field: type, ... }`
fn structure<'t>(text: &'t str) -> impl Parse<'t, (Name, ItemKind)> {
    let field = docs(text)
        .then(name(text))
        .then_ignore(just(Token::Colon))
        .then(type_name(text))
        .map(|((docs, name), ty)| Field { docs, name, ty });
    just(Token::Struct)
        .ignore_then(name(text))
        .then(list(Token::LeftBrace, field, Token::RightBrace))
        .map(|(name, fields)| (name, ItemKind::Struct(fields)))
        .boxed()
}

/// `const name: type = value;`
fn constant<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, (Name, ItemKind)> {
    just(Token::Const)
        .ignore_then(name(text))
        .then_ignore(just(Token::Colon))
        .then(type_name(text))
        .then_ignore(just(Token::Assign))
        .then(required(expression))
        .then_ignore(semicolon(text))
        .map(|((name, ty), value)| (name, ItemKind::Const(Const { ty, value })))
        .boxed()
}
