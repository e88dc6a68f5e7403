//! Expressions: operators by binding power, calls, and `if` as a value.

use super::doc::{Doc, Operation};
use super::layout::Layout;
use super::list::Style;
use crate::lexer::Token;
use crate::parser::binding_power;

/// An operator between two operands.
struct Operator<'t> {
    power: u16,
    doc: Doc<'t>,
    breaks: bool,
}

impl<'t> Layout<'t> {
    /// An expression; nothing where there is none.
    pub(super) fn expr(&mut self) -> Doc<'t> {
        stacker::maybe_grow(128 << 10, 1 << 20, || self.operations())
    }

    fn operations(&mut self) -> Doc<'t> {
        let mut operands = vec![self.operand()];
        let mut operators = Vec::new();
        while let Some(power) = self.peek().and_then(binding_power) {
            let before = self.breaks();
            let doc = self.token();
            let breaks = before || self.breaks();
            operators.push(Operator { power, doc, breaks });
            operands.push(self.operand());
        }
        chain(operands, operators)
    }

    /// An operand with its signs and parts; a type, too.
    pub(super) fn operand(&mut self) -> Doc<'t> {
        let mut parts = Vec::new();
        while matches!(self.peek(), Some(Token::Minus | Token::Not)) {
            parts.push(self.token());
        }
        match self.peek() {
            Some(Token::If) => parts.push(self.if_chain()),
            Some(Token::LeftBrace) => parts.push(self.block(false).group()),
            Some(Token::LeftParen) => parts.push(self.brackets()),
            Some(Token::LeftBracket) => parts.push(self.list(Style::TIGHT)),
            Some(Token::Int | Token::Hex | Token::Float) => {
                parts.push(self.token());
                if self.is(Token::Ident) {
                    parts.push(Doc::space());
                    parts.push(self.token());
                }
            }
            Some(Token::Comma | Token::Semicolon) => {}
            Some(token) if token.is_closer() => {}
            None => {}
            Some(_) => {
                parts.push(self.token());
                if self.is(Token::LeftParen) {
                    parts.push(self.list(Style::TIGHT));
                }
            }
        }
        loop {
            match self.peek() {
                Some(Token::Dot) => parts.extend([self.token(), self.token()]),
                Some(Token::LeftBracket) => parts.push(self.brackets()),
                _ => break Doc::concat(parts),
            }
        }
    }

    /// `(a)`, `[i]`, or `[]` of a type.
    pub(super) fn brackets(&mut self) -> Doc<'t> {
        let open = self.token();
        let value = self.expr();
        let (comments, close) = self.closer(false);
        let mut parts = vec![open, value];
        parts.extend(comments);
        parts.push(close);
        Doc::concat(parts)
    }

    /// `if a { b } else if c { d } else { e }`; its blocks break together.
    pub(super) fn if_chain(&mut self) -> Doc<'t> {
        let mut parts = Vec::new();
        while self.is(Token::If) {
            parts.extend([self.token(), Doc::space(), self.expr(), Doc::space()]);
            parts.push(self.block(false));
            if !self.is(Token::Else) {
                break;
            }
            parts.extend([Doc::space(), self.token(), Doc::space()]);
            if self.is(Token::LeftBrace) {
                parts.push(self.block(false));
            }
        }
        Doc::concat(parts).group()
    }
}

/// Operands with the operators between them, nested by binding power.
fn chain<'t>(operands: Vec<Doc<'t>>, operators: Vec<Operator<'t>>) -> Doc<'t> {
    let loosest = operators.iter().map(|operator| operator.power).min();
    let mut operands = operands.into_iter();
    let mut parts = vec![operands.next().unwrap_or_else(Doc::nothing)];
    let mut tighter: Vec<Operator<'t>> = Vec::new();
    let mut first: Option<Doc<'t>> = None;
    let mut rest: Vec<Operation<'t>> = Vec::new();
    let mut pending: Option<(Doc<'t>, bool)> = None;
    let mut finish = |parts: Vec<Doc<'t>>, tighter, pending: Option<(Doc<'t>, bool)>| {
        let operand = match parts.len() {
            1 => parts.into_iter().next().unwrap_or_else(Doc::nothing),
            _ => chain(parts, tighter),
        };
        match pending {
            None => first = Some(operand),
            Some((operator, breaks)) => rest.push(Operation {
                operator,
                operand,
                breaks,
            }),
        }
    };
    for (operator, operand) in operators.into_iter().zip(operands) {
        if Some(operator.power) == loosest {
            finish(
                std::mem::take(&mut parts),
                std::mem::take(&mut tighter),
                pending.take(),
            );
            pending = Some((operator.doc, operator.breaks));
        } else {
            tighter.push(operator);
        }
        parts.push(operand);
    }
    finish(parts, tighter, pending);
    match first {
        Some(first) if rest.is_empty() => first,
        first => Doc::fill(first.unwrap_or_else(Doc::nothing), rest),
    }
}
