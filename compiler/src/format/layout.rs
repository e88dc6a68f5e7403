//! Reads tokens with their comments and makes the document of a file. What every construct needs
//! is here; `item`, `stmt`, `expr` and `list` add a construct each.
//!
//! Only sources without syntax errors come here, so that it is enough to look at the next tokens.
//! What is not known is written as it comes, with blanks between.

use super::doc::Doc;
use super::trivia::{Lead, Piece};
use crate::lexer::Token;

pub(super) struct Layout<'t> {
    pieces: Vec<Piece<'t>>,
    next: usize,
}

impl<'t> Layout<'t> {
    pub(super) fn new(pieces: Vec<Piece<'t>>) -> Self {
        Self { pieces, next: 0 }
    }

    /// The whole file.
    pub(super) fn file(mut self) -> Doc<'t> {
        let mut parts = Vec::new();
        while self.peek().is_some() {
            parts.push(Doc::hard(self.blank()));
            parts.push(self.statement());
        }
        let end = self.take();
        parts.push(leads(&end.lead, true));
        Doc::concat(parts)
    }

    /// The next token; `None` at the end of the file.
    pub(super) fn peek(&self) -> Option<Token> {
        self.peek_at(0)
    }

    pub(super) fn peek_at(&self, ahead: usize) -> Option<Token> {
        self.pieces.get(self.next + ahead).and_then(|p| p.token)
    }

    pub(super) fn is(&self, token: Token) -> bool {
        self.peek() == Some(token)
    }

    /// Is the next token spelled `text`?
    pub(super) fn is_spelled(&self, text: &str) -> bool {
        self.pieces.get(self.next).is_some_and(|p| p.text == text)
    }

    /// Is the next token a closing bracket, or is there none?
    pub(super) fn at_end(&self) -> bool {
        self.peek().is_none_or(Token::is_closer)
    }

    /// Is there an empty line before the next token and its comments?
    pub(super) fn blank(&self) -> bool {
        let Some(piece) = self.pieces.get(self.next) else {
            return false;
        };
        match piece.lead.first() {
            Some(lead) if lead.own_line => lead.blank,
            _ => piece.blank,
        }
    }

    /// Does the next token start a line?
    pub(super) fn breaks(&self) -> bool {
        self.pieces.get(self.next).is_some_and(|p| p.breaks)
    }

    /// How many tokens are left.
    pub(super) fn remaining(&self) -> usize {
        self.pieces.len().saturating_sub(self.next)
    }

    pub(super) fn take(&mut self) -> Piece<'t> {
        let piece = self.pieces.get_mut(self.next);
        self.next += 1;
        piece.map(std::mem::take).unwrap_or_default()
    }

    /// The next token with its comments.
    pub(super) fn token(&mut self) -> Doc<'t> {
        let piece = self.take();
        let own_lines = piece.lead.iter().filter(|lead| lead.own_line).count();
        let (own, within) = piece.lead.split_at(own_lines);
        let mut parts = vec![leads(own, false)];
        if own_lines > 0 && piece.blank {
            parts.push(Doc::hard(true));
        }
        if !within.is_empty() {
            parts.extend([leads(within, false), Doc::space()]);
        }
        parts.push(body(piece));
        Doc::concat(parts)
    }

    /// A closing bracket: the comments before it, and the bracket itself. `is_first` if nothing
    /// else is in the brackets.
    pub(super) fn closer(&mut self, is_first: bool) -> (Option<Doc<'t>>, Doc<'t>) {
        let mut piece = self.take();
        let lead = std::mem::take(&mut piece.lead);
        let dangling = behind(std::mem::take(&mut piece.dangling), true);
        let inside = match (lead.is_empty(), dangling) {
            (true, None) => None,
            (_, dangling) => {
                let mut parts: Vec<Doc<'t>> = dangling.into_iter().collect();
                parts.push(leads(&lead, !is_first));
                Some(Doc::concat(parts))
            }
        };
        (inside, body(piece))
    }
}

/// Comments before something; `blank` if the first one keeps the empty line before it.
fn leads<'t>(leads: &[Lead<'t>], blank: bool) -> Doc<'t> {
    let mut parts = Vec::new();
    for (index, lead) in leads.iter().enumerate() {
        if lead.own_line {
            parts.push(Doc::hard(lead.blank && (blank || index > 0)));
            parts.push(Doc::comment(lead.text, true));
        } else {
            parts.extend((index > 0).then(Doc::space));
            parts.push(Doc::comment(lead.text, false));
        }
    }
    Doc::concat(parts)
}

/// A token with the comments behind it.
fn body(piece: Piece<'_>) -> Doc<'_> {
    let mut parts = vec![match piece.token {
        Some(Token::DocOuter | Token::DocInner) => Doc::comment(piece.text, true),
        _ => Doc::text(piece.text),
    }];
    let opens = piece.token.is_some_and(|t| t.closer().is_some());
    for (index, text) in piece.inline.into_iter().enumerate() {
        if index > 0 || !opens {
            parts.push(Doc::space());
        }
        parts.push(Doc::comment(text, false));
    }
    parts.extend(behind(piece.trailing, true));
    Doc::concat(parts)
}

/// Comments at the end of a line.
fn behind(comments: Vec<&str>, ends_line: bool) -> Option<Doc<'_>> {
    let last = comments.len().checked_sub(1)?;
    let mut parts = Vec::new();
    for (index, text) in comments.into_iter().enumerate() {
        parts.push(Doc::space());
        parts.push(Doc::comment(text, ends_line && index == last));
    }
    Some(Doc::concat(parts))
}
