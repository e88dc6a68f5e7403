//! Expressions: operands, operators by binding power, calls, and `if` as a value.

use chumsky::prelude::*;

use super::common::{
    Extra, Input, Parse, Rule, Tokens, before, close, list, name, nothing, on_new_line, one, spell,
};
use super::error::{Expected, SyntaxError, Want};
use super::literal::literal;
use super::stmt::{self, RequiredBlock};
use crate::ast::{Arg, BinaryOp, Block, Expr, ExprKind, IfExpr, Name, UnaryOp};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// The rule for expressions. It fails only before a token that starts none, and takes nothing
/// then.
pub(super) fn expression<'t>(text: &'t str) -> Rule<'t, Expr> {
    recursive(|expression| {
        let expression = expression.boxed();
        let block = stmt::block(text, expression.clone());
        let operand = operand(text, expression.clone(), block)
            .recover_with(via_parser(missing()))
            .boxed();
        let operators = operators(text, operand, expression).boxed();
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
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> Rule<'t, (IfExpr, Span)> {
    let arm = headed(text, required(expression), |cond| cond, block.clone());
    let arm = arm.map_with(|(cond, then), e| (cond, then, e.span()));
    // Of `else a > b { ... }`, the `if` is missing.
    let forgotten = custom(move |inp: &mut Input<'t, '_>| {
        let here = inp.cursor();
        match inp.peek() {
            Some(token) if condition_starts(token) && !on_new_line(text, inp) => Ok(()),
            _ => Err(nothing(inp.span_since(&here))),
        }
    });
    let expected = Expected::tokens(&[Token::If, Token::LeftBrace]);
    let keyword = one(expected, |t| t == Token::If).ignored();
    let more = just(Token::Else)
        .ignore_then(keyword.recover_with(via_parser(forgotten)))
        .ignore_then(arm.clone())
        .repeated()
        .collect::<Vec<_>>();
    let last = just(Token::Else)
        .ignore_then(stmt::required_block(text, block))
        .map_with(|required, e| match required {
            RequiredBlock::Block(block) => block,
            RequiredBlock::Late(block, error) | RequiredBlock::Missing(block, error) => {
                e.emit(error);
                block
            }
        })
        .or_not();
    just(Token::If)
        .ignore_then(arm)
        .then(more)
        .then(last)
        .map_with(|((first, more), last), e| (chain(first, more, last), e.span()))
        .boxed()
}

/// Can `token` start the condition of an `else if` without its `if`?
fn condition_starts(token: Token) -> bool {
    starts(token) && !matches!(token, Token::LeftBrace | Token::If)
}

/// A header that ends in an expression, and its block. When an operand is missing before the
/// block, the block was read as that operand; it is put right here. Fails only if `header` does.
pub(super) fn headed<'t, H: 't>(
    text: &'t str,
    header: impl Parse<'t, H>,
    last: fn(&mut H) -> &mut Expr,
    block: Rule<'t, Block>,
) -> Rule<'t, (H, Block)> {
    header
        .then(stmt::required_block(text, block))
        .map_with(move |(mut head, required), e| {
            let (block, error) = match required {
                RequiredBlock::Block(block) => return (head, block),
                RequiredBlock::Late(block, error) => (block, error),
                RequiredBlock::Missing(empty, error) => match take_block(last(&mut head)) {
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
            e.emit(error);
            (head, block)
        })
        .boxed()
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
    let group = just(Token::LeftParen)
        .ignore_then(required(expression.clone()))
        .then_ignore(close(Token::RightParen))
        .map_with(move |inner: Expr, e| make(inner.kind, e.span()));
    let array = list(Token::LeftBracket, expression.clone(), Token::RightBracket)
        .map_with(move |elements, e| make(ExprKind::Array(elements), e.span()));
    let chosen = if_expression(text, expression.clone(), block.clone())
        .map(move |(chosen, span)| make(ExprKind::If(Box::new(chosen)), span));
    let block = block.map(move |b| {
        let span = b.span;
        make(ExprKind::Block(Box::new(b)), span)
    });
    // Already reported by the lexer.
    let unknown = just(Token::Unknown).map_with(move |_, e| make(ExprKind::Error, e.span()));
    choice((
        name_or_call(text, expression),
        literal(text),
        group,
        array,
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

/// An infix operator with its binding power.
fn operator<'t>() -> impl Parse<'t, (u16, BinaryOp)> + Copy {
    custom(|inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let found = inp.next();
        found.and_then(binary).ok_or_else(|| {
            let expected = Expected::want(Want::Operator);
            SyntaxError::new(inp.span_since(&start), found, expected)
        })
    })
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

/// `value op value op value`. Operators are read in a row and put in order after: asking for each
/// binding power at each place would take most of the time of parsing.
fn operators<'t>(
    text: &'t str,
    operand: Rule<'t, Expr>,
    expression: Rule<'t, Expr>,
) -> impl Parse<'t, Expr> {
    let value = value(text, operand, expression).boxed();
    let more = operator()
        .then(value.clone())
        .repeated()
        .collect::<Vec<_>>();
    value.then(more).map_with(|(first, more), e| {
        // What waits for its right side, by growing power.
        let mut open: Vec<(Expr, (u16, BinaryOp))> = Vec::new();
        let mut last = first;
        for ((power, op), next) in more {
            while let Some((left, (_, waiting))) = open.pop_if(|(_, (p, _))| *p >= power) {
                last = combine(left, waiting, last, e);
            }
            open.push((last, (power, op)));
            last = next;
        }
        for (left, (_, op)) in open.into_iter().rev() {
            last = combine(left, op, last, e);
        }
        last
    })
}

/// An operand with what binds closer than infix operators: signs before it, and fields and indices
/// after it, which bind closest.
fn value<'t>(
    text: &'t str,
    operand: Rule<'t, Expr>,
    expression: Rule<'t, Expr>,
) -> impl Parse<'t, Expr> {
    let sign = choice((
        just(Token::Minus).to(UnaryOp::Neg),
        just(Token::Not).to(UnaryOp::Not),
    ));
    let signs = sign.map_with(|op, e| (op, e.span())).repeated().collect();
    let field_name = name(text)
        .map(Some)
        .recover_with(via_parser(empty().to(None)));
    let field = just(Token::Dot).ignore_then(field_name).map(Part::Field);
    let index = just(Token::LeftBracket)
        .ignore_then(required(expression))
        .then_ignore(close(Token::RightBracket))
        .map(Part::Index);
    let parts = choice((field, index))
        .map_with(|part, e| (part, e.span()))
        .repeated()
        .collect();
    signs
        .then(operand)
        .then(parts)
        .map_with(with_signs_and_parts)
}

/// What follows an operand and names a part of it; a field's name may be missing.
enum Part {
    Field(Option<Name>),
    Index(Expr),
}

type Signed = ((Vec<(UnaryOp, Span)>, Expr), Vec<(Part, Span)>);

fn with_signs_and_parts<'t>(parts: Signed, e: &mut Extras<'t, '_>) -> Expr {
    let ((signs, mut value), parts) = parts;
    for (part, at) in parts {
        let span = value.span.to(at);
        let kind = match part {
            Part::Field(Some(name)) => ExprKind::Field(Box::new(value), name),
            Part::Field(None) => ExprKind::Error,
            Part::Index(index) => ExprKind::Index(Box::new(value), Box::new(index)),
        };
        value = Expr { kind, span };
    }
    let whole: Span = e.span();
    for (op, at) in signs.into_iter().rev() {
        value = Expr {
            kind: ExprKind::Unary(op, Box::new(value)),
            span: Span {
                end: whole.end,
                ..at
            },
        };
    }
    value
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
