//! Statements and blocks.

use chumsky::prelude::*;

use super::common::{
    Input, Parse, Rule, before, broken_statement, close, ends_statement, name, nothing, one,
    rest_of_statement, semicolon, skip_docs, skip_one, spell, type_name,
};
use super::error::{Expected, SyntaxError};
use super::expr::{headed, if_expression, required};
use crate::ast::{BinaryOp, Block, Expr, ExprKind, IfExpr, Stmt, StmtKind, UnaryOp};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// One entry of a block.
#[derive(Clone)]
pub(super) enum Piece {
    /// A statement.
    Stmt(Stmt),
    /// An `if` that is a statement or, at the end of a block, its value.
    If(IfExpr, Span),
    /// An expression before the closing brace.
    Value(Expr),
    /// A part with an error that is already reported.
    Broken,
}

/// `{ statements; value }`. Fails only before another token than `{`.
pub(super) fn block<'t>(text: &'t str, expression: Rule<'t, Expr>) -> Rule<'t, Block> {
    recursive(|block| {
        let piece = piece(text, expression, block.boxed());
        just(Token::LeftBrace)
            .ignore_then(piece.repeated().collect::<Vec<_>>())
            .then_ignore(close(Token::RightBrace))
            .map_with(|pieces, e| assemble(pieces, e.span()))
    })
    .boxed()
}

/// A block where one has to be.
#[derive(Clone)]
pub(super) enum RequiredBlock {
    /// It is there.
    Block(Block),
    /// It is there behind what does not belong.
    Late(Block, SyntaxError),
    /// There is none on this line; an empty block stands for it.
    Missing(Block, SyntaxError),
}

/// A block where one has to be. Never fails.
pub(super) fn required_block<'t>(text: &'t str, block: Rule<'t, Block>) -> Rule<'t, RequiredBlock> {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.save();
        let error = match inp.parse(&block) {
            Ok(block) => return Ok(RequiredBlock::Block(block)),
            Err(error) => error,
        };
        inp.rewind(start.clone());
        let span = inp.span_since(start.cursor());
        while let Some(token) = inp.peek() {
            if token == Token::LeftBrace {
                return Ok(RequiredBlock::Late(inp.parse(&block)?, error));
            }
            if token == Token::Else || ends_statement(text, token, inp) {
                break;
            }
            skip_one(inp);
        }
        inp.rewind(start);
        let empty = Block {
            stmts: Vec::new(),
            value: None,
            span,
        };
        Ok(RequiredBlock::Missing(empty, error))
    })
    .boxed()
}

/// A statement or value. It always takes a token, and fails only before a closing bracket or the
/// end of the file.
pub(super) fn piece<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> Rule<'t, Piece> {
    let statement = choice((
        binding(text, false, expression.clone()),
        binding(text, true, expression.clone()),
        for_loop(text, expression.clone(), block.clone()),
        while_loop(text, expression.clone(), block.clone()),
        jump(text),
        assertion(text, expression.clone()),
    ))
    .map_with(|kind, e| {
        Piece::Stmt(Stmt {
            kind,
            span: e.span(),
        })
    });
    let branch = if_expression(text, expression.clone(), block)
        .map(|(chosen, span)| Piece::If(chosen, span));
    choice((
        statement.boxed(),
        branch,
        expression_piece(
            text,
            choice((whole_material(text), expression.clone())).boxed(),
            expression,
        ),
        stray_docs().to(Piece::Broken),
    ))
    .recover_with(via_parser(broken_statement().to(Piece::Broken)))
    .boxed()
}

/// Documentation where nothing can be documented. Before a `param` it fails: it is not the
/// documentation that is wrong with that.
pub(super) fn stray_docs<'t>() -> impl Parse<'t, ()> {
    custom(|inp: &mut Input<'t, '_>| {
        let start = inp.cursor();
        let last = skip_docs(inp);
        let span = inp.span_since(&start);
        if last.is_none() || inp.peek() == Some(Token::Param) {
            return Err(nothing(span));
        }
        inp.emit(SyntaxError::special(span, misplaced_docs(last, span)));
        Ok(())
    })
}

pub(super) fn misplaced_docs(found: Option<Token>, span: Span) -> Diagnostic {
    let message = "this documentation comment documents nothing";
    let hint = match found {
        Some(Token::DocInner) => "`//!` documents the file and stands at its top; write `//` here",
        _ => "`///` stands before a definition, a `param` or a field; write `//` here",
    };
    Diagnostic::new(Code::Syntax, span, message).hint(hint)
}

/// `let name: type = value;` or, when `mutable`, `var name: type = value;`
pub(super) fn binding<'t>(
    text: &'t str,
    mutable: bool,
    expression: Rule<'t, Expr>,
) -> impl Parse<'t, StmtKind> {
    let keyword = just(if mutable { Token::Var } else { Token::Let });
    let ty = just(Token::Colon)
        .ignore_then(type_name(text, expression.clone()))
        .or_not();
    keyword
        .ignore_then(name(text))
        .then(ty)
        .then_ignore(just(Token::Assign))
        .then(required(expression))
        .then_ignore(semicolon(text))
        .map(move |((name, ty), value)| StmtKind::Let {
            mutable,
            name,
            ty,
            value,
        })
}

/// `for name in low .. high { ... }`
fn for_loop<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> impl Parse<'t, StmtKind> {
    let header = just(Token::For)
        .ignore_then(name(text))
        .then_ignore(just(Token::In))
        .then(expression.clone())
        .then_ignore(just(Token::Range))
        .then(expression);
    headed(text, header, |(_, high)| high, block).map(|(((name, low), high), body)| StmtKind::For {
        name,
        low,
        high,
        body,
    })
}

/// `while cond limit count { ... }`
fn while_loop<'t>(
    text: &'t str,
    expression: Rule<'t, Expr>,
    block: Rule<'t, Block>,
) -> impl Parse<'t, StmtKind> {
    let limit = just(Token::Limit)
        .ignore_then(required(expression.clone()))
        .or_not();
    let header = just(Token::While).ignore_then(expression).then(limit);
    headed(
        text,
        header,
        |(cond, limit)| limit.as_mut().unwrap_or(cond),
        block,
    )
    .map(|((cond, limit), body)| StmtKind::While { cond, limit, body })
}

/// `break;`, `continue;`
fn jump<'t>(text: &'t str) -> impl Parse<'t, StmtKind> {
    choice((
        just(Token::Break).to(StmtKind::Break),
        just(Token::Continue).to(StmtKind::Continue),
    ))
    .then_ignore(semicolon(text))
}

/// `assert condition;`
fn assertion<'t>(text: &'t str, expression: Rule<'t, Expr>) -> impl Parse<'t, StmtKind> {
    just(Token::Assert)
        .ignore_then(required(expression))
        .then_ignore(semicolon(text))
        .map(StmtKind::Assert)
}

/// What follows an expression in a block.
#[derive(Clone)]
enum Tail {
    Assign(Option<BinaryOp>, Expr),
    Value,
    Unused,
    Broken,
}

/// The place of `material = value;`: the name of all outputs together. Fails, before it takes
/// anything, where no assignment follows.
fn whole_material<'t>(text: &'t str) -> impl Parse<'t, Expr> {
    custom(move |inp: &mut Input<'t, '_>| {
        let start = inp.save();
        let word = inp.next();
        let span = inp.span_since(start.cursor());
        let assigned = matches!(inp.peek(), Some(t) if is_assignment(t));
        if word == Some(Token::Material) && assigned {
            let kind = ExprKind::Name(spell(text, span).node);
            return Ok(Expr { kind, span });
        }
        inp.rewind(start);
        Err(nothing(span))
    })
}

/// Assignments that combine with the old value.
const COMPOUND: [(Token, BinaryOp); 10] = [
    (Token::AddAssign, BinaryOp::Add),
    (Token::SubAssign, BinaryOp::Sub),
    (Token::MulAssign, BinaryOp::Mul),
    (Token::DivAssign, BinaryOp::Div),
    (Token::RemAssign, BinaryOp::Rem),
    (Token::AndAssign, BinaryOp::BitAnd),
    (Token::OrAssign, BinaryOp::BitOr),
    (Token::XorAssign, BinaryOp::BitXor),
    (Token::ShiftLeftAssign, BinaryOp::Shl),
    (Token::ShiftRightAssign, BinaryOp::Shr),
];

fn is_assignment(token: Token) -> bool {
    COMPOUND.iter().any(|(t, _)| *t == token) || token == Token::Assign
}

/// `place = value;`, or the value of a block.
fn expression_piece<'t>(
    text: &'t str,
    place: Rule<'t, Expr>,
    expression: Rule<'t, Expr>,
) -> impl Parse<'t, Piece> {
    let compound = COMPOUND.map(|(token, op)| just(token).to(Some(op)));
    let operator = choice((just(Token::Assign).to(None), choice(compound)));
    let assign = operator
        .then(required(expression))
        .then_ignore(semicolon(text))
        .map(|(op, value)| Tail::Assign(op, value));
    let brace = Expected::token(Token::RightBrace);
    let value = before(brace, |t| t == Token::RightBrace).to(Tail::Value);
    let unused = one(Expected::default(), |t| t == Token::Semicolon).to(Tail::Unused);
    let tail = choice((assign, value, unused))
        .recover_with(via_parser(rest_of_statement(text).to(Tail::Broken)));
    place.then(tail).map_with(|(value, tail), e| {
        let span: Span = e.span();
        match tail {
            Tail::Assign(op, new) => Piece::Stmt(Stmt {
                kind: StmtKind::Assign {
                    place: value,
                    op,
                    value: new,
                },
                span,
            }),
            Tail::Value => Piece::Value(value),
            Tail::Unused => {
                e.emit(SyntaxError::special(value.span, unused_value(&value)));
                Piece::Broken
            }
            Tail::Broken => Piece::Broken,
        }
    })
}

fn unused_value(value: &Expr) -> Diagnostic {
    let message = "this value is not used";
    let diagnostic = Diagnostic::new(Code::Syntax, value.span, message)
        .expected("a statement, such as `let name = value;`");
    match &value.kind {
        ExprKind::Call { .. } => diagnostic.hint(
            "functions only have a value: name it, or leave out the `;` at the end of a block",
        ),
        ExprKind::Binary(BinaryOp::Eq, ..) => diagnostic.hint("to assign, write `=`"),
        ExprKind::Unary(UnaryOp::Neg, inner) if matches!(inner.kind, ExprKind::Unary(..)) => {
            diagnostic.hint("to count down, write `name -= 1;`")
        }
        _ => diagnostic.hint("to make it the value of the block, leave out the `;`"),
    }
}

/// Makes a block of its entries.
fn assemble(mut pieces: Vec<Piece>, span: Span) -> Block {
    let value = match pieces.pop() {
        Some(Piece::Value(value)) => Some(Box::new(value)),
        Some(Piece::If(chosen, span)) if has_value(&chosen) => {
            Some(Box::new(if_value(chosen, span)))
        }
        Some(other) => {
            pieces.push(other);
            None
        }
        None => None,
    };
    let stmts = pieces.into_iter().filter_map(statement).collect();
    Block { stmts, value, span }
}

/// The statement of a piece that is one.
pub(super) fn statement(piece: Piece) -> Option<Stmt> {
    match piece {
        Piece::Stmt(stmt) => Some(stmt),
        Piece::If(chosen, span) => Some(Stmt {
            kind: StmtKind::If(chosen),
            span,
        }),
        Piece::Value(_) | Piece::Broken => None,
    }
}

/// The block that stands for the `if` of an `else if`.
pub(super) fn block_of_if(chosen: IfExpr, span: Span) -> Block {
    assemble(vec![Piece::If(chosen, span)], span)
}

fn if_value(chosen: IfExpr, span: Span) -> Expr {
    Expr {
        kind: ExprKind::If(Box::new(chosen)),
        span,
    }
}

/// Does some branch end in a value? Blocks of `else if` were given theirs when they were made.
fn has_value(chosen: &IfExpr) -> bool {
    let otherwise = chosen.otherwise.as_ref();
    chosen.then.value.is_some() || otherwise.is_some_and(|b| b.value.is_some())
}
