//! Blocks and statements.

use super::doc::Doc;
use super::layout::Layout;
use super::list::Style;
use crate::lexer::Token;

impl<'t> Layout<'t> {
    /// `{ ... }`. One of a single entry may stand on one line, unless `broken`.
    pub(super) fn block(&mut self, broken: bool) -> Doc<'t> {
        let open = self.token();
        if self.at_end() {
            return self.empty(open, " ");
        }
        let starts_line = self.breaks();
        let mut entries = vec![self.statement()];
        let mut blanks = vec![false];
        while !self.at_end() {
            blanks.push(self.blank());
            entries.push(self.statement());
        }
        let is_short = !broken && !starts_line && entries.len() == 1;
        let mut inner = Vec::new();
        for (entry, blank) in entries.into_iter().zip(blanks) {
            inner.push(if is_short {
                Doc::line(" ")
            } else {
                Doc::hard(blank)
            });
            inner.push(entry);
        }
        let (comments, close) = self.closer(false);
        inner.extend(comments);
        Doc::concat(vec![open, Doc::concat(inner).nest(), Doc::line(" "), close])
    }

    /// A statement, definition, declaration, line of documentation, or value.
    pub(super) fn statement(&mut self) -> Doc<'t> {
        match self.peek() {
            Some(Token::DocOuter | Token::DocInner) => Doc::concat(vec![self.token()]),
            Some(Token::If) => self.if_chain(),
            Some(Token::For | Token::While) => self.turns(),
            Some(Token::Break | Token::Continue) => {
                let mut parts = vec![self.token()];
                self.semicolon(&mut parts);
                Doc::concat(parts)
            }
            Some(Token::Let | Token::Var | Token::Const | Token::Param) => self.binding(),
            Some(Token::Assert) => self.assertion(),
            Some(Token::Use) => self.import(),
            _ if self.starts_definition() => self.definition(),
            _ if self.starts_test() => self.test(),
            _ => self.assignment(),
        }
    }

    /// `assert condition;`
    fn assertion(&mut self) -> Doc<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.expr()];
        self.semicolon(&mut parts);
        Doc::concat(parts)
    }

    /// `for name in low .. high { ... }`, `while condition limit count { ... }`
    fn turns(&mut self) -> Doc<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.expr()];
        while matches!(self.peek(), Some(Token::In | Token::Range | Token::Limit)) {
            parts.extend([Doc::space(), self.token(), Doc::space(), self.expr()]);
        }
        parts.extend([Doc::space(), self.block(true)]);
        Doc::concat(parts)
    }

    /// `let name: type = value;`, also with `var`, `const` and `param`.
    fn binding(&mut self) -> Doc<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.token()];
        if self.is(Token::Colon) {
            parts.extend([self.token(), Doc::space(), self.operand()]);
        }
        parts.extend([Doc::space(), self.token()]);
        let breaks = self.breaks();
        let mut value = self.expr();
        while matches!(self.peek(), Some(Token::In | Token::Range)) {
            let bound = [Doc::space(), self.token(), Doc::space(), self.expr()];
            value = Doc::concat([value].into_iter().chain(bound).collect());
        }
        if self.is(Token::LeftBrace) {
            parts.extend([Doc::space(), value, Doc::space()]);
            parts.push(self.list(Style::PADDED));
        } else {
            parts.push(Doc::assign(value, None, breaks));
        }
        self.semicolon(&mut parts);
        Doc::concat(parts)
    }

    /// `place = value when condition;`, a method, or a value.
    fn assignment(&mut self) -> Doc<'t> {
        let before = self.remaining();
        let mut parts = vec![self.expr()];
        match self.peek() {
            Some(
                Token::Assign
                | Token::AddAssign
                | Token::SubAssign
                | Token::MulAssign
                | Token::DivAssign
                | Token::RemAssign
                | Token::AndAssign
                | Token::OrAssign
                | Token::XorAssign
                | Token::ShiftLeftAssign
                | Token::ShiftRightAssign,
            ) => {
                parts.push(Doc::space());
                self.assigned(&mut parts);
            }
            Some(Token::LeftBrace) => parts.extend([Doc::space(), self.block(true)]),
            Some(Token::Semicolon) => self.semicolon(&mut parts),
            _ => {}
        }
        if self.remaining() == before {
            // Nothing that is known starts here.
            parts.push(self.token());
        }
        Doc::concat(parts)
    }

    /// `= value when condition;`
    pub(super) fn assigned(&mut self, parts: &mut Vec<Doc<'t>>) {
        parts.push(self.token());
        let breaks = self.breaks();
        let value = self.expr();
        let is_when = self.is(Token::When);
        let when = is_when.then(|| Doc::concat(vec![self.token(), Doc::space(), self.expr()]));
        parts.push(Doc::assign(value, when, breaks));
        self.semicolon(parts);
    }

    pub(super) fn semicolon(&mut self, parts: &mut Vec<Doc<'t>>) {
        if self.is(Token::Semicolon) {
            parts.push(self.token());
        }
    }
}
