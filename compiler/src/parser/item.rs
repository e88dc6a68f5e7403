//! Definitions: materials, closures, functions, structs and constants.

use super::common::{
    Input, broken_statement, close, docs, list, need, note, optional, read_name, recover,
    semicolon, spell, take, type_name,
};
use super::error::{Expected, SyntaxError, Want};
use super::expr::{expression, required};
use super::stmt::{self, Piece, piece, stray_docs};
use crate::ast::{
    Body, ClosureDef, ClosureKind, Const, Entry, Expr, Field, Function, ItemKind, Material,
    MaterialParam, Method, Name, Param, Stmt, Test,
};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// Reads a definition: its name and what it is.
pub(super) fn item<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    match inp.peek() {
        Some(Token::Material) => material(text, inp),
        Some(Token::Bsdf | Token::Delta | Token::Edf) => closure(text, inp),
        Some(Token::Fn) => function(text, inp),
        Some(Token::Struct) => structure(text, inp),
        Some(Token::Const) => constant(text, inp),
        _ => {
            note(inp, Expected::tokens(&KEYWORDS));
            None
        }
    }
}

/// Keywords that definitions start with.
const KEYWORDS: [Token; 7] = [
    Token::Material,
    Token::Bsdf,
    Token::Delta,
    Token::Edf,
    Token::Fn,
    Token::Struct,
    Token::Const,
];

/// Reads `test "title" { statements }`. The word is none of the language's where no title follows it.
pub(super) fn test<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Test> {
    let start = inp.cursor();
    if !take(inp, Token::Ident) {
        return None;
    }
    let word: Span = inp.span_since(&start);
    let before_title = inp.cursor();
    if text.get(word.range()) != Some("test") || !take(inp, Token::Str) {
        return None;
    }
    let quoted = spell(text, inp.span_since(&before_title));
    let title = Name {
        node: quoted.node.trim_matches('"').to_owned(),
        ..quoted
    };
    let body = stmt::block(text, inp)?;
    Some(Test {
        title,
        body,
        span: inp.span_since(&start),
    })
}

/// Reads `material name { params and statements }` from its keyword.
fn material<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    inp.skip();
    let name = read_name(text, inp)?;
    need(inp, Token::LeftBrace)?;
    let mut material = Material {
        params: Vec::new(),
        body: Vec::new(),
    };
    let mut lost = Vec::new();
    while inp.peek() != Some(Token::RightBrace) {
        if let Some(param) = optional(inp, |inp| material_param(text, inp)) {
            material.params.push(param);
            continue;
        }
        match piece(text, inp) {
            Some(Piece::Value(value)) => lost.push(value),
            Some(piece) => material.body.extend(stmt::statement(piece)),
            None => break,
        }
    }
    close(inp, Token::RightBrace)?;
    for value in lost {
        inp.emit(SyntaxError::special(value.span, lost_value(&value)));
    }
    Some((name, ItemKind::Material(material)))
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

/// Reads `param name: type = default in low .. high { key: value };` with its documentation.
fn material_param<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<MaterialParam> {
    let docs = docs(text, inp);
    let start = inp.cursor();
    need(inp, Token::Param)?;
    let name = read_name(text, inp)?;
    need(inp, Token::Colon)?;
    let ty = type_name(text, inp)?;
    need(inp, Token::Assign)?;
    let default = required(text, inp);
    let range = optional(inp, |inp| {
        need(inp, Token::In)?;
        let low = expression(text, inp)?;
        need(inp, Token::Range)?;
        Some((low, required(text, inp)))
    });
    let metadata = metadata(text, inp);
    semicolon(text, inp);
    Some(MaterialParam {
        docs,
        name,
        ty,
        default,
        range,
        metadata,
        span: inp.span_since(&start),
    })
}

/// Reads `{ label: "IOR", soft: 1.2 .. 2.0 }`, or nothing.
fn metadata<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Vec<Entry> {
    let braces = (Token::LeftBrace, Token::RightBrace);
    let entries = list(inp, braces, |inp| {
        let key = read_name(text, inp)?;
        need(inp, Token::Colon)?;
        let value = expression(text, inp)?;
        let high = need(inp, Token::Range).map(|()| required(text, inp));
        Some(Entry { key, value, high })
    });
    entries.unwrap_or_default()
}

/// Reads `(name: type = default, ...)`.
fn parameters<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Vec<Param>> {
    list(inp, (Token::LeftParen, Token::RightParen), |inp| {
        let name = read_name(text, inp)?;
        need(inp, Token::Colon)?;
        let ty = type_name(text, inp)?;
        let default = need(inp, Token::Assign).map(|()| required(text, inp));
        Some(Param { name, ty, default })
    })
}

/// Reads `= value when condition;` or a block.
fn body<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Body> {
    if need(inp, Token::Assign).is_none() {
        return stmt::block(text, inp).map(Body::Block);
    }
    let value = required(text, inp);
    let when = need(inp, Token::When).map(|()| required(text, inp));
    semicolon(text, inp);
    Some(Body::Expr { value, when })
}

/// Reads `bsdf name(params) { lets methods }` from its keyword.
fn closure<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    let kind = if take(inp, Token::Edf) {
        ClosureKind::Edf
    } else if take(inp, Token::Delta) {
        need(inp, Token::Bsdf)?;
        ClosureKind::DeltaBsdf
    } else {
        need(inp, Token::Bsdf)?;
        ClosureKind::Bsdf
    };
    let name = read_name(text, inp)?;
    let params = parameters(text, inp)?;
    need(inp, Token::LeftBrace)?;
    let mut closure = ClosureDef {
        kind,
        params,
        lets: Vec::new(),
        methods: Vec::new(),
    };
    let mut late = Vec::new();
    while inp.peek() != Some(Token::RightBrace)
        && let Some(member) = member(text, inp)
    {
        match member {
            Member::Let(stmt) => {
                if !closure.methods.is_empty() {
                    late.push(stmt.span);
                }
                closure.lets.push(stmt);
            }
            Member::Method(method) => closure.methods.push(method),
            Member::Broken => {}
        }
    }
    close(inp, Token::RightBrace)?;
    for span in late {
        inp.emit(SyntaxError::special(span, late_let(span)));
    }
    Some((name, ItemKind::Closure(closure)))
}

fn late_let(span: Span) -> Diagnostic {
    Diagnostic::new(Code::Syntax, span, "`let` after a method")
        .hint("move it before the methods, which all share it")
}

enum Member {
    Let(Stmt),
    Method(Method),
    Broken,
}

/// Reads one of what stands between the braces of a closure.
fn member<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Member> {
    let start = inp.save();
    let found = match inp.peek() {
        Some(Token::Let) => stmt::binding(text, inp).map(|kind| {
            let span = inp.span_since(start.cursor());
            Member::Let(Stmt { kind, span })
        }),
        Some(Token::Ident) => method(text, inp).map(Member::Method),
        _ => stray_docs(inp).map(|()| Member::Broken),
    };
    if found.is_some() {
        return found;
    }
    inp.rewind(start);
    let expected = Expected::token(Token::Let).with(Expected::want(Want::Name));
    note(inp, expected);
    recover(inp, broken_statement()).map(|()| Member::Broken)
}

/// Reads `pdf(wo, wi) = ...;`.
fn method<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Method> {
    let start = inp.cursor();
    let name = read_name(text, inp)?;
    let parens = (Token::LeftParen, Token::RightParen);
    let args = list(inp, parens, |inp| read_name(text, inp))?;
    let body = body(text, inp)?;
    Some(Method {
        name,
        args,
        body,
        span: inp.span_since(&start),
    })
}

/// Reads `fn name(params) -> type body` from its keyword.
fn function<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    inp.skip();
    let name = read_name(text, inp)?;
    let params = parameters(text, inp)?;
    need(inp, Token::Arrow)?;
    let result = type_name(text, inp)?;
    let body = body(text, inp)?;
    let function = Function {
        params,
        result,
        body,
    };
    Some((name, ItemKind::Function(function)))
}

/// Reads `struct name { field: type, ... }` from its keyword.
fn structure<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    inp.skip();
    let name = read_name(text, inp)?;
    let fields = list(inp, (Token::LeftBrace, Token::RightBrace), |inp| {
        let docs = docs(text, inp);
        let name = read_name(text, inp)?;
        need(inp, Token::Colon)?;
        let ty = type_name(text, inp)?;
        Some(Field { docs, name, ty })
    })?;
    Some((name, ItemKind::Struct(fields)))
}

/// Reads `const name: type = value;` from its keyword.
fn constant<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<(Name, ItemKind)> {
    inp.skip();
    let name = read_name(text, inp)?;
    need(inp, Token::Colon)?;
    let ty = type_name(text, inp)?;
    need(inp, Token::Assign)?;
    let value = required(text, inp);
    semicolon(text, inp);
    Some((name, ItemKind::Const(Const { ty, value })))
}
