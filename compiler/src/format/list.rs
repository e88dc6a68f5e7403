//! Lists in brackets: arguments, parameters, fields, imported names, descriptions of parameters.

use super::doc::Doc;
use super::layout::Layout;
use crate::lexer::Token;

/// How a list is written.
#[derive(Clone, Copy)]
pub(super) struct Style {
    /// Between brackets and elements on one line.
    pub(super) pad: &'static str,
    /// Does every element have a line of its own?
    pub(super) broken: bool,
}

impl Style {
    /// `(a, b)`
    pub(super) const TIGHT: Style = Style {
        pad: "",
        broken: false,
    };
    /// `{ a, b }`
    pub(super) const PADDED: Style = Style {
        pad: " ",
        broken: false,
    };
    /// An element a line.
    pub(super) const BROKEN: Style = Style {
        pad: " ",
        broken: true,
    };
}

impl<'t> Layout<'t> {
    /// A list from its opening bracket to the closing one.
    pub(super) fn list(&mut self, style: Style) -> Doc<'t> {
        let open = self.token();
        if self.at_end() {
            return self.empty(open, style.pad);
        }
        let mut inner = vec![Doc::line(style.pad)];
        if style.broken {
            inner.push(Doc::forced());
        }
        loop {
            inner.push(self.element());
            let more = self.comma(&mut inner);
            if !more || self.at_end() {
                break;
            }
            inner.push(if self.blank() {
                Doc::hard(true)
            } else {
                Doc::line(" ")
            });
        }
        let (comments, close) = self.closer(false);
        inner.extend(comments);
        let inner = Doc::concat(inner).nest();
        Doc::concat(vec![open, inner, Doc::line(style.pad), close]).group()
    }

    /// Brackets with nothing but comments in them, `open` being read already.
    pub(super) fn empty(&mut self, open: Doc<'t>, pad: &'static str) -> Doc<'t> {
        let (comments, close) = self.closer(true);
        let Some(comments) = comments else {
            return Doc::concat(vec![open, close]);
        };
        let inner = Doc::concat(vec![Doc::line(pad), comments]).nest();
        Doc::concat(vec![open, inner, Doc::line(pad), close]).group()
    }

    /// The comma behind an element. One behind the last element says that the list stays broken.
    fn comma(&mut self, inner: &mut Vec<Doc<'t>>) -> bool {
        if !self.is(Token::Comma) {
            inner.push(Doc::when_broken(","));
            return false;
        }
        inner.push(self.token());
        if self.at_end() {
            inner.push(Doc::forced());
        }
        true
    }

    /// `/// docs` `name: type = value`, `name: value`, `name as other`, `low .. high`.
    fn element(&mut self) -> Doc<'t> {
        let mut parts = Vec::new();
        while matches!(self.peek(), Some(Token::DocOuter | Token::DocInner)) {
            parts.push(self.token());
            parts.push(Doc::hard(self.blank()));
        }
        parts.push(self.expr());
        while !self.at_end() && !self.is(Token::Comma) {
            if !self.is(Token::Colon) {
                parts.push(Doc::space());
            }
            parts.push(self.token());
            parts.push(Doc::space());
            parts.push(self.expr());
        }
        Doc::concat(parts)
    }
}
