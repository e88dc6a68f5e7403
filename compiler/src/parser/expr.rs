//! Expressions: operands, operators by binding power, calls, and `if` as a value.

use chumsky::prelude::*;

use super::common::{
    Input, close, list, need, note, nothing, on_new_line, read_name, recover, spell, take,
};
use super::error::{Expected, SyntaxError, Want};
use super::literal::literal;
use super::stmt::{self, RequiredBlock};
use crate::ast::{Arg, BinaryOp, Block, Expr, ExprKind, IfExpr, Name, UnaryOp};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// Reads an expression. Fails only before a token that starts none.
pub(super) fn expression<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Expr> {
    if inp.peek().is_some_and(starts) {
        return Some(operators(text, inp));
    }
    note(inp, Expected::want(Want::Expression));
    None
}

/// Reads an expression where one has to be; an [`ExprKind::Error`] when it is missing.
pub(super) fn required<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Expr {
    expression(text, inp).unwrap_or_else(|| missing(inp))
}

/// Reports that no expression is here, where one was noted to be missing.
fn missing(inp: &mut Input<'_, '_>) -> Expr {
    recover(inp, empty());
    let here = inp.cursor();
    Expr {
        kind: ExprKind::Error,
        span: inp.span_since(&here),
    }
}

/// Reads `if cond { ... } else if cond { ... } else { ... }` from its `if`, the next token.
pub(super) fn if_expression<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> (IfExpr, Span) {
    // Of `else a > b { ... }`, the `if` is missing.
    let forgotten = custom(move |inp: &mut Input<'t, '_>| {
        let here = inp.cursor();
        match inp.peek() {
            Some(token) if condition_starts(token) && !on_new_line(text, inp) => Ok(()),
            _ => Err(nothing(inp.span_since(&here))),
        }
    });
    let start = inp.cursor();
    inp.skip();
    let first = arm(text, inp);
    let mut more = Vec::new();
    let mut last = None;
    while need(inp, Token::Else).is_some() {
        if take(inp, Token::If) {
            more.push(arm(text, inp));
            continue;
        }
        if inp.peek() != Some(Token::LeftBrace) {
            note(inp, Expected::tokens(&[Token::If, Token::LeftBrace]));
            if recover(inp, forgotten).is_some() {
                more.push(arm(text, inp));
                continue;
            }
        }
        last = Some(match stmt::required_block(text, inp) {
            RequiredBlock::Block(block) => block,
            RequiredBlock::Late(block, error) | RequiredBlock::Missing(block, error) => {
                inp.emit(error);
                block
            }
        });
        break;
    }
    (chain(first, more, last), inp.span_since(&start))
}

/// Reads a condition and its block.
fn arm<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Arm {
    let start = inp.cursor();
    let mut cond = required(text, inp);
    let then = body_after(text, &mut cond, inp);
    (cond, then, inp.span_since(&start))
}

/// Can `token` start the condition of an `else if` without its `if`?
fn condition_starts(token: Token) -> bool {
    starts(token) && !matches!(token, Token::LeftBrace | Token::If)
}

/// Reads the block after a header whose last expression is `last`. When an operand is missing before the
/// block, the block was read as that operand; it is put right here.
pub(super) fn body_after<'t>(text: &'t str, last: &mut Expr, inp: &mut Input<'t, '_>) -> Block {
    let (block, error) = match stmt::required_block(text, inp) {
        RequiredBlock::Block(block) => return block,
        RequiredBlock::Late(block, error) => (block, error),
        RequiredBlock::Missing(empty, error) => match take_block(last) {
            Some(block) => {
                let brace = Span {
                    end: block.span.start + 1,
                    ..block.span
                };
                let expected = Expected::want(Want::Expression);
                (
                    block,
                    SyntaxError::new(brace, Some(Token::LeftBrace), expected),
                )
            }
            None => (empty, error),
        },
    };
    inp.emit(error);
    block
}

/// Takes the block that is the last operand of `value` out of it.
fn take_block(value: &mut Expr) -> Option<Block> {
    match &mut value.kind {
        ExprKind::Binary(_, _, operand) | ExprKind::Unary(_, operand) => take_block(operand),
        ExprKind::Block(block) if block.span == value.span => {
            match std::mem::replace(&mut value.kind, ExprKind::Error) {
                ExprKind::Block(block) => Some(*block),
                _ => None,
            }
        }
        _ => None,
    }
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
            | LeftBracket
            | LeftBrace
            | If
            | Minus
            | Not
            | Unknown
    )
}

/// Reads an operand. Fails only before a token that starts none.
fn operand<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Expr> {
    let start = inp.cursor();
    let kind = match inp.peek() {
        Some(Token::Ident) => name_or_call(text, inp)?,
        Some(token) if LITERALS.contains(&token) => return Some(literal(text, token, inp)),
        Some(Token::LeftParen) => {
            inp.skip();
            let inner = required(text, inp);
            close(inp, Token::RightParen)?;
            inner.kind
        }
        Some(Token::LeftBracket) => {
            let brackets = (Token::LeftBracket, Token::RightBracket);
            ExprKind::Array(list(inp, brackets, |inp| expression(text, inp))?)
        }
        Some(Token::If) => ExprKind::If(Box::new(if_expression(text, inp).0)),
        Some(Token::LeftBrace) => ExprKind::Block(Box::new(stmt::block(text, inp)?)),
        // Already reported by the lexer.
        Some(Token::Unknown) => {
            inp.skip();
            ExprKind::Error
        }
        _ => {
            let wants = Expected::want(Want::Name).with(Expected::want(Want::Expression));
            note(inp, Expected::tokens(&STARTS).with(wants));
            return None;
        }
    };
    let span = inp.span_since(&start);
    Some(Expr { kind, span })
}

/// What an operand can start with, signs before it included, beside names and numbers.
const STARTS: [Token; 10] = [
    Token::Minus,
    Token::Not,
    Token::LeftParen,
    Token::LeftBracket,
    Token::LeftBrace,
    Token::If,
    Token::Str,
    Token::True,
    Token::False,
    Token::Unknown,
];

/// Tokens that are literals.
const LITERALS: [Token; 6] = [
    Token::Int,
    Token::Hex,
    Token::Float,
    Token::Str,
    Token::True,
    Token::False,
];

/// Reads `name` or `name(a, b: c)`.
fn name_or_call<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<ExprKind> {
    let name = read_name(text, inp)?;
    if inp.peek() != Some(Token::LeftParen) {
        return Some(ExprKind::Name(name.node));
    }
    let args = list(inp, (Token::LeftParen, Token::RightParen), |inp| {
        let name = argument_name(text, inp);
        let value = expression(text, inp)?;
        Some(Arg { name, value })
    })?;
    Some(ExprKind::Call { callee: name, args })
}

/// Reads the `name:` before an argument, if it has one.
fn argument_name<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Name> {
    if inp.peek() != Some(Token::Ident) {
        return None;
    }
    let start = inp.save();
    inp.skip();
    let span = inp.span_since(start.cursor());
    let mark = inp.cursor();
    match inp.next() {
        Some(Token::Colon) => Some(spell(text, span)),
        Some(Token::Assign) => {
            let at = inp.span_since(&mark);
            let message = "unexpected `=` in a list of arguments";
            let diagnostic = Diagnostic::new(Code::Syntax, at, message)
                .expected("`:`")
                .hint("named arguments are written `name: value`");
            inp.emit(SyntaxError::special(at, diagnostic));
            Some(spell(text, span))
        }
        _ => {
            inp.rewind(start);
            None
        }
    }
}

/// An infix operator and its binding power.
pub(super) fn binary(token: Token) -> Option<(u16, BinaryOp)> {
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

/// Reads `value op value op value`. Operators are read in a row and put in order after: asking for each
/// binding power at each place would take most of the time of parsing.
fn operators<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Expr {
    // Sources nest as deep as `nesting` lets them.
    stacker::maybe_grow(128 << 10, 1 << 20, || {
        let first = value(text, inp);
        let mut more = Vec::new();
        while let Some(operator) = inp.peek().and_then(binary) {
            inp.skip();
            more.push((operator, value(text, inp)));
        }
        match <[_; 1]>::try_from(more) {
            Ok([((_, op), second)]) => combine(first, op, second, inp),
            Err(more) => in_order(first, more, inp),
        }
    })
}

/// Puts operators in order by their power.
fn in_order(first: Expr, more: Vec<((u16, BinaryOp), Expr)>, inp: &mut Input<'_, '_>) -> Expr {
    // What waits for its right side, by growing power.
    let mut open: Vec<(Expr, (u16, BinaryOp))> = Vec::new();
    let mut last = first;
    for ((power, op), next) in more {
        while let Some((left, (_, waiting))) = open.pop_if(|(_, (p, _))| *p >= power) {
            last = combine(left, waiting, last, inp);
        }
        open.push((last, (power, op)));
        last = next;
    }
    for (left, (_, op)) in open.into_iter().rev() {
        last = combine(left, op, last, inp);
    }
    last
}

/// Reads an operand with what binds closer than infix operators: signs before it, and fields and indices
/// after it, which bind closest.
fn value<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Expr {
    let start = inp.cursor();
    let mut signs: Vec<(UnaryOp, Span)> = Vec::new();
    while let Some(op) = inp.peek().and_then(sign) {
        let at = inp.cursor();
        inp.skip();
        signs.push((op, inp.span_since(&at)));
    }
    let is_word = inp.peek() == Some(Token::Ident);
    let mut value = operand(text, inp).unwrap_or_else(|| missing(inp));
    let is_name = is_word && matches!(value.kind, ExprKind::Name(_));
    value = with_parts(text, value, is_name, inp);
    if signs.is_empty() {
        return value;
    }
    let end = inp.span_since(&start).end;
    for (op, at) in signs.into_iter().rev() {
        value = Expr {
            kind: ExprKind::Unary(op, Box::new(value)),
            span: Span { end, ..at },
        };
    }
    value
}

/// A prefix operator.
fn sign(token: Token) -> Option<UnaryOp> {
    match token {
        Token::Minus => Some(UnaryOp::Neg),
        Token::Not => Some(UnaryOp::Not),
        _ => None,
    }
}

/// Reads the fields and indices after an operand, and notes what could follow the last of them. After a name,
/// which `is_name` tells, those are arguments as well.
fn with_parts<'t>(text: &'t str, mut value: Expr, is_name: bool, inp: &mut Input<'t, '_>) -> Expr {
    let mut follows = PARTS.with(Expected::want(Want::Operator));
    if is_name {
        follows = follows.with(Expected::token(Token::LeftParen));
    }
    loop {
        let (whole, start) = (value.span, inp.cursor());
        let next = inp.peek();
        let kind = match next {
            Some(Token::Dot) => {
                inp.skip();
                match read_name(text, inp) {
                    Some(name) => ExprKind::Field(Box::new(value), name),
                    None => {
                        recover(inp, empty());
                        ExprKind::Error
                    }
                }
            }
            Some(Token::LeftBracket) => {
                inp.skip();
                let index = required(text, inp);
                close(inp, Token::RightBracket);
                ExprKind::Index(Box::new(value), Box::new(index))
            }
            _ => {
                if next.and_then(binary).is_none() {
                    note(inp, follows);
                }
                return value;
            }
        };
        follows = PARTS.with(Expected::want(Want::Operator));
        let span = whole.to(inp.span_since(&start));
        value = Expr { kind, span };
    }
}

/// What starts a field or an index.
const PARTS: Expected = Expected::token(Token::Dot).with(Expected::token(Token::LeftBracket));

fn combine(a: Expr, op: BinaryOp, b: Expr, inp: &mut Input<'_, '_>) -> Expr {
    let span = a.span.to(b.span);
    if is_comparison(op) && is_bare_comparison(&a) {
        let message = "comparisons cannot be chained";
        let diagnostic = Diagnostic::new(Code::Syntax, span, message)
            .hint("compare in pairs, as in `a < b && b < c`");
        inp.emit(SyntaxError::special(span, diagnostic));
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
