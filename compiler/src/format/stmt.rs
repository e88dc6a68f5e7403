//! Blocks and statements.

use super::doc::Doc;
use super::layout::Layout;
use super::list::Style;
use crate::lexer::Token;

/// An entry of a block or file.
pub(super) struct Entry<'t> {
    pub(super) doc: Doc<'t>,
    /// Is it the value of its block?
    pub(super) is_value: bool,
}

impl<'t> Entry<'t> {
    pub(super) fn statement(parts: Vec<Doc<'t>>) -> Self {
        let doc = Doc::concat(parts);
        Self {
            doc,
            is_value: false,
        }
    }
}

impl<'t> Layout<'t> {
    /// `{ ... }`. One of a value alone may stand on one line, unless `broken`.
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
        let is_short = !broken && !starts_line && matches!(&entries[..], [entry] if entry.is_value);
        let mut inner = Vec::new();
        for (entry, blank) in entries.into_iter().zip(blanks) {
            inner.push(if is_short {
                Doc::line(" ")
            } else {
                Doc::hard(blank)
            });
            inner.push(entry.doc);
        }
        let (comments, close) = self.closer(false);
        inner.extend(comments);
        Doc::concat(vec![open, Doc::concat(inner).nest(), Doc::line(" "), close])
    }

    /// A statement, definition, declaration, line of documentation, or value.
    pub(super) fn statement(&mut self) -> Entry<'t> {
        match self.peek() {
            Some(Token::DocOuter | Token::DocInner) => Entry::statement(vec![self.token()]),
            Some(Token::If) => Entry {
                doc: self.if_chain(),
                is_value: true,
            },
            Some(Token::For | Token::While) => self.turns(),
            Some(Token::Break | Token::Continue) => {
                let mut parts = vec![self.token()];
                self.semicolon(&mut parts);
                Entry::statement(parts)
            }
            Some(Token::Let | Token::Var | Token::Const | Token::Param) => self.binding(),
            Some(Token::Use) => self.import(),
            _ if self.starts_definition() => self.definition(),
            _ => self.assignment(),
        }
    }

    /// `for name in low .. high { ... }`, `while condition limit count { ... }`
    fn turns(&mut self) -> Entry<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.expr()];
        while matches!(self.peek(), Some(Token::In | Token::Range | Token::Limit)) {
            parts.extend([Doc::space(), self.token(), Doc::space(), self.expr()]);
        }
        parts.extend([Doc::space(), self.block(true)]);
        Entry::statement(parts)
    }

    /// `let name: type = value;`, also with `var`, `const` and `param`.
    fn binding(&mut self) -> Entry<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.token()];
        if self.is(Token::Colon) {
            parts.extend([self.token(), Doc::space(), self.token()]);
        }
        parts.extend([Doc::space(), self.token()]);
        let mut value = vec![self.expr()];
        while matches!(self.peek(), Some(Token::In | Token::Range)) {
            value.extend([Doc::space(), self.token(), Doc::space(), self.expr()]);
        }
        let value = Doc::concat(value);
        if self.is(Token::LeftBrace) {
            parts.extend([Doc::space(), value, Doc::space()]);
            parts.push(self.list(Style::PADDED));
        } else {
            parts.push(Doc::assign(value, None));
        }
        self.semicolon(&mut parts);
        Entry::statement(parts)
    }

    /// `place = value when condition;`, a method, or a value.
    fn assignment(&mut self) -> Entry<'t> {
        let before = self.remaining();
        let mut parts = vec![self.expr()];
        let mut is_value = false;
        match self.peek() {
            Some(
                Token::Assign
                | Token::AddAssign
                | Token::SubAssign
                | Token::MulAssign
                | Token::DivAssign,
            ) => {
                parts.push(Doc::space());
                self.assigned(&mut parts);
            }
            Some(Token::LeftBrace) => parts.extend([Doc::space(), self.block(true)]),
            Some(Token::Semicolon) => self.semicolon(&mut parts),
            _ => is_value = true,
        }
        if self.remaining() == before {
            // Nothing that is known starts here.
            parts.push(self.token());
        }
        let doc = Doc::concat(parts);
        Entry { doc, is_value }
    }

    /// `= value when condition;`
    pub(super) fn assigned(&mut self, parts: &mut Vec<Doc<'t>>) {
        parts.push(self.token());
        let value = self.expr();
        let is_when = self.is(Token::When);
        let when = is_when.then(|| Doc::concat(vec![self.token(), Doc::space(), self.expr()]));
        parts.push(Doc::assign(value, when));
        self.semicolon(parts);
    }

    pub(super) fn semicolon(&mut self, parts: &mut Vec<Doc<'t>>) {
        if self.is(Token::Semicolon) {
            parts.push(self.token());
        }
    }
}
