//! Definitions: materials, closures, functions, structs and constants.

use chumsky::prelude::*;

use super::common::{
    Parse, Rule, broken_statement, close, contextual, docs, list, name, semicolon, spell, type_name,
};
use super::error::SyntaxError;
use super::expr::required;
use super::stmt::{self, Piece, piece, stray_docs};
use crate::ast::{
    Block, Body, ClosureDef, ClosureKind, Const, Entry, Expr, Field, Function, ItemKind, Material,
    MaterialParam, Method, Name, Param, Stmt, Test,
};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// A definition: its name and what it is.
pub(super) fn item<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
) -> impl Parse<'t, (Name, ItemKind)> {
    let block = stmt::block(text, expression.clone());
    let body = body(text, expression.clone(), block.clone());
    let parameters = parameters(text, expression.clone());
    choice((
        material(text, expression.clone(), block),
        closure(text, expression.clone(), parameters.clone(), body.clone()),
        function(text, expression.clone(), parameters, body),
        structure(text, expression.clone()),
        constant(text, expression),
    ))
}

/// `test "title" { statements }`. The word is none of the language's where no title follows it.
pub(super) fn test<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, Test> {
    let title = just(Token::Str).map_with(move |_, e| {
        let quoted = spell(text, e.span());
        Name {
            node: quoted.node.trim_matches('"').to_owned(),
            ..quoted
        }
    });
    contextual(text, "test", |t| t == Token::Str)
        .ignore_then(title)
        .then(stmt::block(text, expression))
        .map_with(|(title, body), e| Test {
            title,
            body,
            span: e.span(),
        })
        .boxed()
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

/// `param name: type = default in low .. high { key: value };`
fn material_param<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, MaterialParam> {
    let range = just(Token::In)
        .ignore_then(expression.clone())
        .then_ignore(just(Token::Range))
        .then(required(expression.clone()))
        .or_not();
    just(Token::Param)
        .ignore_then(name(text))
        .then_ignore(just(Token::Colon))
        .then(type_name(text, expression.clone()))
        .then_ignore(just(Token::Assign))
        .then(required(expression.clone()))
        .then(range)
        .then(metadata(text, expression))
        .then_ignore(semicolon(text))
        .map_with(
            |((((name, ty), default), range), metadata), e| MaterialParam {
                docs: Vec::new(),
                name,
                ty,
                default,
                range,
                metadata,
                span: e.span(),
            },
        )
        .boxed()
}

/// `{ label: "IOR", soft: 1.2 .. 2.0 }`, or nothing.
fn metadata<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, Vec<Entry>> {
    let high = just(Token::Range)
        .ignore_then(required(expression.clone()))
        .or_not();
    let entry = name(text)
        .then_ignore(just(Token::Colon))
        .then(expression)
        .then(high)
        .map(|((key, value), high)| Entry { key, value, high });
    let entries = list(Token::LeftBrace, entry, Token::RightBrace);
    entries.or_not().map(Option::unwrap_or_default)
}

/// `(name: type = default, ...)`
fn parameters<'t>(text: &'t str, expression: Rule<'t, Expr>) -> Rule<'t, Vec<Param>> {
    let default = just(Token::Assign)
        .ignore_then(required(expression.clone()))
        .or_not();
    let param = name(text)
        .then_ignore(just(Token::Colon))
        .then(type_name(text, expression.clone()))
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
    expression: Rule<'t, Expr>,
    parameters: Rule<'t, Vec<Param>>,
    body: Rule<'t, Body>,
) -> impl Parse<'t, (Name, ItemKind)> {
    just(Token::Fn)
        .ignore_then(name(text))
        .then(parameters)
        .then_ignore(just(Token::Arrow))
        .then(type_name(text, expression.clone()))
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
fn structure<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, (Name, ItemKind)> {
    let field = docs(text)
        .then(name(text))
        .then_ignore(just(Token::Colon))
        .then(type_name(text, expression.clone()))
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
        .then(type_name(text, expression.clone()))
        .then_ignore(just(Token::Assign))
        .then(required(expression))
        .then_ignore(semicolon(text))
        .map(|((name, ty), value)| (name, ItemKind::Const(Const { ty, value })))
        .boxed()
}
