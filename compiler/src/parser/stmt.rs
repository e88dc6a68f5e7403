//! Statements and blocks.

use super::common::{
    Input, broken_statement, close, ends_statement, need, note, read_name, recover,
    rest_of_statement, rule, semicolon, skip_docs, skip_one, spell, take, type_name,
};
use super::error::{Expected, SyntaxError, Want};
use super::expr::{body_after, expression, if_expression, required};
use crate::ast::{BinaryOp, Block, Expr, ExprKind, IfExpr, Stmt, StmtKind, UnaryOp};
use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

/// One entry of a block.
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

/// Reads `{ statements; value }`. Fails only before another token than `{`.
pub(super) fn block<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Block> {
    let start = inp.cursor();
    need(inp, Token::LeftBrace)?;
    // Sources nest as deep as `nesting` lets them.
    let pieces = stacker::maybe_grow(128 << 10, 1 << 20, || pieces(text, inp));
    close(inp, Token::RightBrace)?;
    Some(assemble(pieces, inp.span_since(&start)))
}

/// Reads statements up to the brace that closes their block.
fn pieces<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    while inp.peek() != Some(Token::RightBrace)
        && let Some(piece) = piece(text, inp)
    {
        pieces.push(piece);
    }
    pieces
}

/// A block where one has to be.
pub(super) enum RequiredBlock {
    /// It is there.
    Block(Block),
    /// It is there behind what does not belong.
    Late(Block, SyntaxError),
    /// There is none on this line; an empty block stands for it.
    Missing(Block, SyntaxError),
}

/// Reads a block where one has to be.
pub(super) fn required_block<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> RequiredBlock {
    let start = inp.save();
    let error = match inp.parse(rule(move |inp| block(text, inp))) {
        Ok(block) => return RequiredBlock::Block(block),
        Err(error) => error,
    };
    inp.rewind(start.clone());
    let span = inp.span_since(start.cursor());
    while let Some(token) = inp.peek() {
        if token == Token::LeftBrace
            && let Some(block) = block(text, inp)
        {
            return RequiredBlock::Late(block, error);
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
    RequiredBlock::Missing(empty, error)
}

/// Reads a statement or value. It always takes a token, and fails only before a closing bracket or the
/// end of the file.
pub(super) fn piece<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Piece> {
    let start = inp.save();
    let found = match inp.peek() {
        Some(token) if KEYWORDS.contains(&token) => statement_piece(text, token, inp),
        Some(Token::DocOuter | Token::DocInner) => stray_docs(inp).map(|()| Piece::Broken),
        _ => expression_piece(text, inp),
    };
    if found.is_some() {
        return found;
    }
    inp.rewind(start);
    note(
        inp,
        Expected::tokens(&KEYWORDS).with(Expected::want(Want::Expression)),
    );
    recover(inp, broken_statement()).map(|()| Piece::Broken)
}

/// Reads what starts with a keyword, the next token.
fn statement_piece<'t>(text: &'t str, token: Token, inp: &mut Input<'t, '_>) -> Option<Piece> {
    let start = inp.cursor();
    let kind = match token {
        Token::Let | Token::Var => binding(text, inp)?,
        Token::For => for_loop(text, inp)?,
        Token::While => while_loop(text, inp)?,
        Token::Assert => assertion(text, inp),
        Token::If => {
            let (chosen, span) = if_expression(text, inp);
            return Some(Piece::If(chosen, span));
        }
        _ => jump(text, inp),
    };
    let span = inp.span_since(&start);
    Some(Piece::Stmt(Stmt { kind, span }))
}

/// Keywords that a statement can start with.
const KEYWORDS: [Token; 8] = [
    Token::Let,
    Token::Var,
    Token::For,
    Token::While,
    Token::Break,
    Token::Continue,
    Token::Assert,
    Token::If,
];

/// Reads documentation where nothing can be documented. Before a `param` it fails: it is not the
/// documentation that is wrong with that.
pub(super) fn stray_docs(inp: &mut Input<'_, '_>) -> Option<()> {
    let start = inp.cursor();
    let last = skip_docs(inp)?;
    let span = inp.span_since(&start);
    if inp.peek() == Some(Token::Param) {
        return None;
    }
    inp.emit(SyntaxError::special(span, misplaced_docs(last, span)));
    Some(())
}

pub(super) fn misplaced_docs(found: Token, span: Span) -> Diagnostic {
    let message = "this documentation comment documents nothing";
    let hint = match found {
        Token::DocInner => "`//!` documents the file and stands at its top; write `//` here",
        _ => "`///` stands before a definition, a `param` or a field; write `//` here",
    };
    Diagnostic::new(Code::Syntax, span, message).hint(hint)
}

/// Reads `let name: type = value;` or `var name: type = value;` from its keyword.
pub(super) fn binding<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<StmtKind> {
    let mutable = take(inp, Token::Var);
    if !mutable {
        need(inp, Token::Let)?;
    }
    let name = read_name(text, inp)?;
    let ty = match need(inp, Token::Colon) {
        Some(()) => Some(type_name(text, inp)?),
        None => None,
    };
    need(inp, Token::Assign)?;
    let value = required(text, inp);
    semicolon(text, inp);
    Some(StmtKind::Let {
        mutable,
        name,
        ty,
        value,
    })
}

/// Reads `for name in low .. high { ... }` from its keyword.
fn for_loop<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<StmtKind> {
    inp.skip();
    let name = read_name(text, inp)?;
    need(inp, Token::In)?;
    let low = expression(text, inp)?;
    need(inp, Token::Range)?;
    let mut high = expression(text, inp)?;
    let body = body_after(text, &mut high, inp);
    Some(StmtKind::For {
        name,
        low,
        high,
        body,
    })
}

/// Reads `while cond limit count { ... }` from its keyword.
fn while_loop<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<StmtKind> {
    inp.skip();
    let mut cond = expression(text, inp)?;
    let mut limit = need(inp, Token::Limit).map(|()| required(text, inp));
    let body = body_after(text, limit.as_mut().unwrap_or(&mut cond), inp);
    Some(StmtKind::While { cond, limit, body })
}

/// Reads `break;` or `continue;`.
fn jump<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> StmtKind {
    let kind = if take(inp, Token::Break) {
        StmtKind::Break
    } else {
        inp.skip();
        StmtKind::Continue
    };
    semicolon(text, inp);
    kind
}

/// Reads `assert condition;` from its keyword.
fn assertion<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> StmtKind {
    inp.skip();
    let condition = required(text, inp);
    semicolon(text, inp);
    StmtKind::Assert(condition)
}

/// What follows an expression in a block.
enum Tail {
    Assign(Option<BinaryOp>, Expr),
    Value,
    Unused,
    Broken,
}

/// Reads the place of `material = value;`: the name of all outputs together. Fails, before it takes
/// anything, where no assignment follows.
fn whole_material<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Expr> {
    let start = inp.save();
    if take(inp, Token::Material) && inp.peek().is_some_and(is_assignment) {
        let span = inp.span_since(start.cursor());
        let kind = ExprKind::Name(spell(text, span).node);
        return Some(Expr { kind, span });
    }
    inp.rewind(start);
    None
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
    assignment(token).is_some()
}

/// What an assignment combines the old value by, if it does.
fn assignment(token: Token) -> Option<Option<BinaryOp>> {
    if token == Token::Assign {
        return Some(None);
    }
    let compound = COMPOUND.iter().find(|(t, _)| *t == token);
    compound.map(|(_, op)| Some(*op))
}

/// Reads `place = value;`, or the value of a block.
fn expression_piece<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Option<Piece> {
    let start = inp.cursor();
    let place = whole_material(text, inp).or_else(|| expression(text, inp))?;
    match tail(text, inp) {
        Tail::Assign(op, value) => {
            let kind = StmtKind::Assign { place, op, value };
            let span = inp.span_since(&start);
            Some(Piece::Stmt(Stmt { kind, span }))
        }
        Tail::Value => Some(Piece::Value(place)),
        Tail::Unused => {
            inp.emit(SyntaxError::special(place.span, unused_value(&place)));
            Some(Piece::Broken)
        }
        Tail::Broken => Some(Piece::Broken),
    }
}

fn tail<'t>(text: &'t str, inp: &mut Input<'t, '_>) -> Tail {
    let next = inp.peek();
    if let Some(op) = next.and_then(assignment) {
        inp.skip();
        let value = required(text, inp);
        semicolon(text, inp);
        return Tail::Assign(op, value);
    }
    if next == Some(Token::RightBrace) {
        return Tail::Value;
    }
    if take(inp, Token::Semicolon) {
        return Tail::Unused;
    }
    let compound = Expected::tokens(&COMPOUND.map(|(token, _)| token));
    let others = Expected::tokens(&[Token::Assign, Token::RightBrace]);
    note(inp, compound.with(others));
    recover(inp, rest_of_statement(text));
    Tail::Broken
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
