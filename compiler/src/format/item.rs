//! Definitions and `use` declarations.

use super::doc::Doc;
use super::layout::Layout;
use super::list::Style;
use crate::lexer::Token;

impl<'t> Layout<'t> {
    /// Does a definition start here, perhaps behind `private`? `material = ...;` is an assignment.
    pub(super) fn starts_definition(&self) -> bool {
        use Token::*;
        let at = usize::from(self.is_private());
        let is_definition = |t| matches!(t, Material | Bsdf | Delta | Edf | Fn | Struct | Const);
        self.peek_at(at).is_some_and(is_definition)
            && matches!(self.peek_at(at + 1), Some(Ident | Bsdf))
    }

    /// Does `test "title" { ... }` start here?
    pub(super) fn starts_test(&self) -> bool {
        self.is_spelled("test") && self.peek_at(1) == Some(Token::Str)
    }

    pub(super) fn test(&mut self) -> Doc<'t> {
        let mut parts = vec![self.token(), Doc::space(), self.token()];
        if self.is(Token::LeftBrace) {
            parts.extend([Doc::space(), self.block(true)]);
        }
        Doc::concat(parts)
    }

    fn is_private(&self) -> bool {
        self.is_spelled("private") && self.peek_at(1).is_some_and(Token::is_keyword)
    }

    pub(super) fn definition(&mut self) -> Doc<'t> {
        let mut parts = Vec::new();
        if self.is_private() {
            parts.extend([self.token(), Doc::space()]);
        }
        if self.is(Token::Const) {
            parts.push(self.statement());
            return Doc::concat(parts);
        }
        let is_struct = self.is(Token::Struct);
        parts.push(self.token());
        loop {
            match self.peek() {
                None => break,
                Some(Token::LeftParen) => parts.push(self.list(Style::TIGHT)),
                Some(Token::LeftBracket) => parts.push(self.brackets()),
                Some(Token::LeftBrace) if is_struct => {
                    parts.extend([Doc::space(), self.list(Style::BROKEN)]);
                    break;
                }
                Some(Token::LeftBrace) => {
                    parts.extend([Doc::space(), self.block(true)]);
                    break;
                }
                Some(Token::Assign) => {
                    parts.push(Doc::space());
                    self.assigned(&mut parts);
                    break;
                }
                Some(_) => parts.extend([Doc::space(), self.token()]),
            }
        }
        Doc::concat(parts)
    }

    /// `use path::{a, b as c};`
    pub(super) fn import(&mut self) -> Doc<'t> {
        let mut parts = vec![self.token(), Doc::space()];
        loop {
            match self.peek() {
                None => break,
                Some(Token::Semicolon) => {
                    parts.push(self.token());
                    break;
                }
                Some(Token::LeftBrace) => parts.push(self.list(Style::TIGHT)),
                Some(Token::As) => parts.extend([Doc::space(), self.token(), Doc::space()]),
                Some(_) => parts.push(self.token()),
            }
        }
        Doc::concat(parts)
    }
}
