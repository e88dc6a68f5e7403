//! Expressions: operands, operators by binding power, calls, and `if` as a value.

use chumsky::pratt::{infix, left, postfix, prefix};
use chumsky::prelude::*;

use super::common::{Extra, Input, Parse, Rule, Tokens, before, close, list, name, spell};
use super::error::{Expected, SyntaxError, Want};
use super::stmt;
use crate::ast::{Arg, BinaryOp, Block, Expr, ExprKind, IfExpr, Name, UnaryOp, Unit};
use crate::diag::{Code, Diagnostic, nearest};
use crate::lexer::{Number, Token, read_number};
use crate::source::{Span, Spanned};

/// The rule for expressions. It fails only before a token that starts none, and takes nothing
/// then.
pub(super) fn expression<'t>(text: &'t str) -> Rule<'t, Expr> {
    recursive(|expression| {
        let expression = expression.boxed();
        let block = stmt::block(text, expression.clone());
        let operand = operand(text, expression, block)
            .recover_with(via_parser(missing()))
            .boxed();
        let operators = operators(text, operand).boxed();
        before(Expected::want(Want::Expression), starts).ignore_then(operators)
    })
    .boxed()
}

/// An expression where one has to be; an [`ExprKind::Error`] when it is missing.
pub(super) fn required<'t>(expression: Rule<'t, Expr>) -> impl Parse<'t, Expr> {
    expression.recover_with(via_parser(missing()))
}

/// `if cond { ... } else if cond { ... } else { ... }`
pub(super) fn if_expression<'t>(
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> Rule<'t, (IfExpr, Span)> {
    let block = block.recover_with(via_parser(empty().map_with(|(), e| Block {
        stmts: Vec::new(),
        value: None,
        span: e.span(),
    })));
    let arm = just(Token::If)
        .ignore_then(required(expression))
        .then(block.clone())
        .map_with(|(cond, then), e| (cond, then, e.span()))
        .boxed();
    let more = just(Token::Else)
        .ignore_then(arm.clone())
        .repeated()
        .collect::<Vec<_>>();
    let last = just(Token::Else).ignore_then(block).or_not();
    arm.then(more)
        .then(last)
        .map_with(|((first, more), last), e| (chain(first, more, last), e.span()))
        .boxed()
}

type Arm = (Expr, Block, Span);

/// Nests the arms of an `else if` chain, from the last to the first.
fn chain(first: Arm, more: Vec<Arm>, last: Option<Block>) -> IfExpr {
    let mut otherwise = last;
    for (cond, then, span) in more.into_iter().rev() {
        let span = otherwise.as_ref().map_or(span, |b| span.to(b.span));
        let nested = IfExpr {
            cond,
            then,
            otherwise,
        };
        otherwise = Some(stmt::block_of_if(nested, span));
    }
    let (cond, then, _) = first;
    IfExpr {
        cond,
        then,
        otherwise,
    }
}

/// Can `token` start an expression?
fn starts(token: Token) -> bool {
    use Token::*;
    matches!(
        token,
        Ident
            | Int
            | Hex
            | Float
            | Str
            | True
            | False
            | LeftParen
            | LeftBrace
            | If
            | Minus
            | Not
            | Unknown
    )
}

fn missing<'t>() -> impl Parse<'t, Expr> {
    empty().map_with(|(), e| Expr {
        kind: ExprKind::Error,
        span: e.span(),
    })
}

fn operand<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> impl Parse<'t, Expr> {
    let make = |kind, span| Expr { kind, span };
    let boolean = choice((
        just(Token::True).to(ExprKind::Bool(true)),
        just(Token::False).to(ExprKind::Bool(false)),
    ))
    .map_with(move |kind, e| make(kind, e.span()));
    let string =
        just(Token::Str).map_with(move |_, e| make(string_value(text, e.span()), e.span()));
    let group = just(Token::LeftParen)
        .ignore_then(required(expression.clone()))
        .then_ignore(close(Token::RightParen))
        .map_with(move |inner: Expr, e| make(inner.kind, e.span()));
    let chosen = if_expression(expression.clone(), block.clone())
        .map(move |(chosen, span)| make(ExprKind::If(Box::new(chosen)), span));
    let block = block.map(move |b| {
        let span = b.span;
        make(ExprKind::Block(Box::new(b)), span)
    });
    // Already reported by the lexer.
    let unknown = just(Token::Unknown).map_with(move |_, e| make(ExprKind::Error, e.span()));
    choice((
        name_or_call(text, expression),
        number(text),
        group,
        string,
        boolean,
        chosen,
        block,
        unknown,
    ))
}

/// `name` or `name(a, b: c)`
fn name_or_call<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, Expr> {
    let argument = argument_name(text)
        .then(expression)
        .map(|(name, value)| Arg { name, value });
    let arguments = list(Token::LeftParen, argument, Token::RightParen).or_not();
    name(text).then(arguments).map_with(|(name, args), e| Expr {
        kind: match args {
            Some(args) => ExprKind::Call { callee: name, args },
            None => ExprKind::Name(name.node),
        },
        span: e.span(),
    })
}

/// The `name:` before an argument, if it has one.
fn argument_name<'t>(text: &'t str) -> impl Parse<'t, Option<Name>> {
    custom(move |inp: &mut Input<'t, '_>| {
        if inp.peek() != Some(Token::Ident) {
            return Ok(None);
        }
        let start = inp.save();
        inp.skip();
        let span = inp.span_since(start.cursor());
        let mark = inp.cursor();
        match inp.next() {
            Some(Token::Colon) => Ok(Some(spell(text, span))),
            Some(Token::Assign) => {
                let at = inp.span_since(&mark);
                let message = "unexpected `=` in a list of arguments";
                let diagnostic = Diagnostic::new(Code::Syntax, at, message)
                    .expected("`:`")
                    .hint("named arguments are written `name: value`");
                inp.emit(SyntaxError::special(at, diagnostic));
                Ok(Some(spell(text, span)))
            }
            _ => {
                inp.rewind(start);
                Ok(None)
            }
        }
    })
}

fn string_value(text: &str, span: Span) -> ExprKind {
    let slice = text.get(span.range()).unwrap_or("");
    let inner = slice.strip_prefix('"').unwrap_or(slice);
    ExprKind::Str(inner.strip_suffix('"').unwrap_or(inner).to_owned())
}

/// A number, with a unit when a name follows it.
fn number<'t>(text: &'t str) -> impl Parse<'t, Expr> {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let found = inp.next();
        let span = inp.span_since(&start);
        let Some(token @ (Token::Int | Token::Hex | Token::Float)) = found else {
            let expected = Expected::want(Want::Expression);
            return Err(SyntaxError::new(span, found, expected));
        };
        // A number that has no value was reported by the lexer.
        let slice = text.get(span.range()).unwrap_or("");
        let number = read_number(token, slice, true).unwrap_or(Number::Int(0));
        let kind = match (unit(text, span, inp), number) {
            (UnitAfter::None, Number::Int(value)) => ExprKind::Int(value),
            (UnitAfter::None, Number::Float(value)) => ExprKind::Float(value),
            (UnitAfter::Unknown, _) => ExprKind::Error,
            (UnitAfter::Unit(unit), Number::Int(value)) => ExprKind::Quantity(value as f64, unit),
            (UnitAfter::Unit(unit), Number::Float(value)) => ExprKind::Quantity(value, unit),
        };
        Ok(Expr {
            kind,
            span: inp.span_since(&start),
        })
    })
}

enum UnitAfter {
    None,
    Unit(Spanned<Unit>),
    Unknown,
}

/// The unit after the number at `number`. A name on the next line is none, unless it is spelled
/// like a unit: there a `;` is missing.
fn unit<'t>(text: &'t str, number: Span, inp: &mut Input<'t, '_>) -> UnitAfter {
    if inp.peek() != Some(Token::Ident) {
        return UnitAfter::None;
    }
    let before = inp.save();
    inp.skip();
    let span = inp.span_since(before.cursor());
    let name = text.get(span.range()).unwrap_or("");
    if let Some(unit) = Unit::from_name(name) {
        return UnitAfter::Unit(Spanned { node: unit, span });
    }
    let between = text.get(number.end as usize..span.start as usize);
    let words = ["and", "or", "xor", "mod"];
    if words.contains(&name) || between.unwrap_or("").contains('\n') {
        inp.rewind(before);
        return UnitAfter::None;
    }
    inp.emit(SyntaxError::special(
        span,
        unknown_unit(text, number, name, span),
    ));
    UnitAfter::Unknown
}

fn unknown_unit(text: &str, number: Span, name: &str, span: Span) -> Diagnostic {
    let digits = text.get(number.range()).unwrap_or("");
    let diagnostic = Diagnostic::new(Code::UnknownUnit, span, format!("`{name}` is not a unit"))
        .expected("um, mm, cm, m or km after a length, deg or rad after an angle");
    if name.starts_with('_') {
        return diagnostic.hint("the digits of a number are written without separators");
    }
    if digits == "0"
        && matches!(name.as_bytes(), [b'b' | b'o' | b'X', rest @ ..] if !rest.is_empty())
    {
        return diagnostic.hint("ints are written in decimal or, with `0x`, in hexadecimal");
    }
    if matches!(name, "f" | "u" | "i" | "h" | "f32" | "u32" | "i32" | "lf") {
        return diagnostic.hint("numbers have no suffix for their type; a float has a point");
    }
    let units = Unit::ALL.iter().map(|(_, name, _)| *name);
    let known = match name {
        "degree" | "degrees" => Some("deg"),
        "radian" | "radians" => Some("rad"),
        "micron" | "microns" | "micrometer" | "micrometre" => Some("um"),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some("mm"),
        "meter" | "meters" | "metre" | "metres" => Some("m"),
        _ if name.len() > 1 => {
            let as_long = units.clone().filter(|unit| unit.len() == name.len());
            nearest(name, as_long).or_else(|| nearest(name, units))
        }
        _ => None,
    };
    match known {
        Some(unit) => diagnostic.hint(format!("did you mean `{digits} {unit}`?")),
        None => diagnostic.hint(format!("to multiply, write `{digits} * {name}`")),
    }
}

/// An operator of one level of binding power.
fn operator<'t>(level: u16) -> impl Parse<'t, BinaryOp> + Copy {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let found = inp.next();
        match found.and_then(binary) {
            Some((at, op)) if at == level => Ok(op),
            _ => {
                let expected = Expected::want(Want::Operator);
                Err(SyntaxError::new(inp.span_since(&start), found, expected))
            }
        }
    })
}

/// An infix operator and its binding power.
fn binary(token: Token) -> Option<(u16, BinaryOp)> {
    Some(match token {
        Token::OrOr => (1, BinaryOp::Or),
        Token::AndAnd => (2, BinaryOp::And),
        Token::EqEq => (COMPARISON, BinaryOp::Eq),
        Token::NotEq => (COMPARISON, BinaryOp::Ne),
        Token::Less => (COMPARISON, BinaryOp::Lt),
        Token::LessEq => (COMPARISON, BinaryOp::Le),
        Token::Greater => (COMPARISON, BinaryOp::Gt),
        Token::GreaterEq => (COMPARISON, BinaryOp::Ge),
        Token::Pipe => (4, BinaryOp::BitOr),
        Token::Caret => (5, BinaryOp::BitXor),
        Token::Ampersand => (6, BinaryOp::BitAnd),
        Token::ShiftLeft => (7, BinaryOp::Shl),
        Token::ShiftRight => (7, BinaryOp::Shr),
        Token::Plus => (8, BinaryOp::Add),
        Token::Minus => (8, BinaryOp::Sub),
        Token::Star => (9, BinaryOp::Mul),
        Token::Slash => (9, BinaryOp::Div),
        Token::Percent => (9, BinaryOp::Rem),
        _ => return None,
    })
}

const COMPARISON: u16 = 3;
const PREFIX: u16 = 10;
const FIELD: u16 = 11;

fn operators<'t>(text: &'t str, operand: Rule<'t, Expr>) -> impl Parse<'t, Expr> {
    let level = |level| infix(left(level), operator(level), combine);
    let unary = choice((
        just(Token::Minus).to(UnaryOp::Neg),
        just(Token::Not).to(UnaryOp::Not),
    ));
    let field_name = name(text)
        .map(Some)
        .recover_with(via_parser(empty().to(None)));
    let field = just(Token::Dot).ignore_then(field_name);
    operand.pratt((
        postfix(
            FIELD,
            field,
            |base: Expr, name: Option<Name>, e: &mut Extras<'t, '_>| {
                let kind = match name {
                    Some(name) => ExprKind::Field(Box::new(base), name),
                    None => ExprKind::Error,
                };
                Expr {
                    kind,
                    span: e.span(),
                }
            },
        ),
        prefix(PREFIX, unary, |op, value: Expr, e: &mut Extras<'t, '_>| {
            Expr {
                kind: ExprKind::Unary(op, Box::new(value)),
                span: e.span(),
            }
        }),
        level(9),
        level(8),
        level(7),
        level(6),
        level(5),
        level(4),
        level(COMPARISON),
        level(2),
        level(1),
    ))
}

type Extras<'t, 'p> = chumsky::input::MapExtra<'t, 'p, Tokens<'t>, Extra>;

fn combine<'t>(a: Expr, op: BinaryOp, b: Expr, e: &mut Extras<'t, '_>) -> Expr {
    let span = a.span.to(b.span);
    if is_comparison(op) && is_bare_comparison(&a) {
        let message = "comparisons cannot be chained";
        let diagnostic = Diagnostic::new(Code::Syntax, span, message)
            .hint("compare in pairs, as in `a < b && b < c`");
        e.emit(SyntaxError::special(span, diagnostic));
    }
    Expr {
        kind: ExprKind::Binary(op, Box::new(a), Box::new(b)),
        span,
    }
}

fn is_comparison(op: BinaryOp) -> bool {
    use BinaryOp::*;
    matches!(op, Eq | Ne | Lt | Le | Gt | Ge)
}

/// Is it a comparison without parentheses around it? Those belong to the span.
fn is_bare_comparison(value: &Expr) -> bool {
    match &value.kind {
        ExprKind::Binary(op, left, _) => is_comparison(*op) && left.span.start == value.span.start,
        _ => false,
    }
}
