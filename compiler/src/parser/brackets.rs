//! Balances brackets before the grammar reads the tokens.
//!
//! A missing closing bracket is reported and put in, a stray one reported and taken out. So the
//! grammar always finds where a broken construct ends. Where a bracket is missing is a guess,
//! from what cannot stand inside one (`;` in parentheses, a definition in braces) and from how
//! lines are indented. That a brace is missing often shows only much later; then a second pass
//! uses what the first one learned.

use std::collections::BTreeSet;

use super::lines::Lines;
use crate::diag::{Code, Diagnostic, Fix};
use crate::lexer::Token;
use crate::source::{FileId, Span};

/// Tokens with balanced brackets, and what was wrong with them.
pub(super) struct Balanced {
    pub(super) tokens: Vec<(Token, Span)>,
    /// Opening brackets without partner: where they are, and what to say.
    pub(super) unclosed: Vec<(Span, Diagnostic)>,
    /// Closing brackets without partner.
    pub(super) stray: Vec<(Span, Diagnostic)>,
}

/// Balances the brackets of `tokens`.
pub(super) fn balance(file: FileId, text: &str, tokens: Vec<(Token, Span)>) -> Balanced {
    if are_balanced(text, &tokens) {
        return Balanced {
            tokens,
            unclosed: Vec::new(),
            stray: Vec::new(),
        };
    }
    let tokens = &tokens;
    let unaware = Clues::default();
    let first = Balancer::run(file, text, tokens, &unaware);
    if first.learned.close.is_empty() && first.learned.drop.is_empty() {
        return first.out;
    }
    Balancer::run(file, text, tokens, &first.learned).out
}

/// Has every bracket its partner, and does nothing stand in one that seldom stands there? Of nearly all sources
/// that is so, and a [`Balancer`] would leave their tokens as they are.
fn are_balanced(text: &str, tokens: &[(Token, Span)]) -> bool {
    // The partners of open brackets; those of lists and those of blocks are told apart.
    let mut open: Vec<(Token, bool)> = Vec::new();
    let mut previous = None;
    for (token, span) in tokens {
        let starts_line = || {
            text.get(..span.start as usize)
                .is_some_and(|t| t.ends_with('\n'))
        };
        let in_list = open.last().is_some_and(|(_, is_list)| *is_list);
        if let Some(closer) = token.closer() {
            let is_brace = *token == Token::LeftBrace;
            if is_brace && in_list {
                return false;
            }
            open.push((closer, !is_brace || previous == Some(Token::PathSeparator)));
        } else if token.is_closer() {
            if open.pop().is_none_or(|(closer, _)| closer != *token) {
                return false;
            }
        } else if in_list && is_for_blocks(*token)
            || !open.is_empty() && may_define(*token) && starts_line()
        {
            return false;
        }
        previous = Some(*token);
    }
    open.is_empty()
}

/// Does a token seldom stand in a list?
fn is_for_blocks(token: Token) -> bool {
    use Token::*;
    matches!(
        token,
        Semicolon | Arrow | When | Let | Var | Param | For | While | Break | Continue
    )
}

/// May a definition begin with a token?
fn may_define(token: Token) -> bool {
    use Token::*;
    matches!(
        token,
        Material | Bsdf | Edf | Private | Delta | Fn | Struct | Const | Use
    )
}

/// What indentation tells about braces, by the byte they start at.
#[derive(Default)]
struct Clues {
    /// Those to be closed where a line is indented no further than theirs.
    close: BTreeSet<u32>,
    /// Closing ones to be taken out.
    drop: BTreeSet<u32>,
}

/// An opening bracket whose partner was not met yet.
#[derive(Clone, Copy)]
struct Open {
    token: Token,
    span: Span,
    /// The blanks at the start of its line.
    indent: u32,
    /// Is it a bracket that `;` cannot stand in?
    is_list: bool,
    /// Was there an `if` or `else` in it since its last `,`? Then a block may follow.
    branches: bool,
}

/// A bracket whose partner starts a line that is indented otherwise than the bracket's line.
#[derive(Clone, Copy)]
struct Suspect {
    open: Open,
    close: Span,
    close_indent: u32,
}

struct Balancer<'t> {
    tokens: &'t [(Token, Span)],
    clues: &'t Clues,
    lines: Lines<'t>,
    open: Vec<Open>,
    suspects: Vec<Suspect>,
    learned: Clues,
    /// Up to this token, what stands in a list by mistake is known to be inside it.
    closed_at: usize,
    out: Balanced,
}

impl<'t> Balancer<'t> {
    fn run(file: FileId, text: &'t str, tokens: &'t [(Token, Span)], clues: &'t Clues) -> Self {
        let mut balancer = Self {
            tokens,
            clues,
            lines: Lines::new(text),
            open: Vec::new(),
            suspects: Vec::new(),
            learned: Clues::default(),
            closed_at: 0,
            out: Balanced {
                tokens: Vec::with_capacity(tokens.len()),
                unclosed: Vec::new(),
                stray: Vec::new(),
            },
        };
        for index in 0..tokens.len() {
            balancer.take(index);
        }
        let end = Span::new(file, text.len()..text.len());
        balancer.close_down_to(0, end, "at the end of the file");
        balancer
    }

    fn take(&mut self, index: usize) {
        let (token, span) = self.tokens[index];
        self.lines.advance(span);
        self.close_by_indent(span);
        if self.starts_definition(index) {
            self.close_down_to(0, span, "before this definition");
        }
        if self.ends_list(index) {
            let place = format!("before this `{}`", token.spelling().unwrap_or_default());
            self.close_down_to(self.innermost_block(), span, &place);
        }
        match token {
            Token::If | Token::Else => self.set_branches(true),
            Token::Comma => self.set_branches(false),
            _ => {}
        }
        if token.closer().is_some() {
            self.open.push(Open {
                token,
                span,
                indent: self.lines.indent,
                is_list: token != Token::LeftBrace || self.follows_path(index),
                branches: false,
            });
        } else if token.is_closer() && !self.close(token, span) {
            return;
        }
        self.out.tokens.push((token, span));
    }

    fn set_branches(&mut self, branches: bool) {
        if let Some(open) = self.open.last_mut() {
            open.branches = branches;
        }
    }

    /// Is the brace at `index` that of a `use`?
    fn follows_path(&self, index: usize) -> bool {
        let previous = index.checked_sub(1).and_then(|i| self.tokens.get(i));
        previous.is_some_and(|(token, _)| *token == Token::PathSeparator)
    }

    /// Closes a brace that the first pass found unclosed, where the lines inside it end.
    fn close_by_indent(&mut self, span: Span) {
        if self.clues.close.is_empty() || !self.lines.is_first {
            return;
        }
        let ends = |open: &Open| {
            let known = self.clues.close.contains(&open.span.start);
            known && self.lines.indent <= open.indent
        };
        if let Some(depth) = self.open.iter().position(ends) {
            self.close_down_to(depth, span, "before this line");
        }
    }

    /// Definitions do not nest: one at the start of a line closes all that is open.
    fn starts_definition(&self, index: usize) -> bool {
        use Token::*;
        let keyword = match self.tokens[index].0 {
            // `material = ...;` is a statement.
            Material => self.tokens.get(index + 1).is_none_or(|t| t.0 != Assign),
            // They are types as well, and no name follows those.
            Bsdf | Edf => self.tokens.get(index + 1).is_none_or(|t| t.0 == Ident),
            token => may_define(token),
        };
        keyword && !self.open.is_empty() && self.lines.is_first && self.lines.indent == 0
    }

    /// Is the token at `index` one that cannot stand in the list it is in?
    fn ends_list(&mut self, index: usize) -> bool {
        use Token::*;
        let Some(open) = self.open.last().filter(|open| open.is_list) else {
            return false;
        };
        let branches = open.branches;
        match self.tokens[index].0 {
            LeftBrace => !branches && self.starts_body(index),
            token => is_for_blocks(token) && !self.closes_soon(index),
        }
    }

    /// Is the innermost bracket closed later on this line?
    fn closes_soon(&mut self, index: usize) -> bool {
        if index < self.closed_at {
            return true;
        }
        let mut depth = 0_usize;
        for (i, (token, span)) in self.tokens.iter().enumerate().skip(index + 1) {
            if self.lines.breaks(self.tokens[i - 1].1, *span) {
                return false;
            }
            if token.closer().is_some() {
                depth += 1;
            } else if token.is_closer() && depth > 0 {
                depth -= 1;
            } else if token.is_closer() {
                let closes = *token != Token::RightBrace;
                self.closed_at = if closes { i } else { 0 };
                return closes;
            }
        }
        false
    }

    /// Does the brace at `index` follow what cannot be followed by a block?
    fn starts_body(&self, index: usize) -> bool {
        let previous = index.checked_sub(1).map(|i| self.tokens[i].0);
        let after_operand = matches!(
            previous,
            Some(Token::Ident | Token::RightParen | Token::Int | Token::Float | Token::Hex)
        );
        // A struct made as in other languages, `f(S { a: 1 })`, closes soon enough.
        let named = matches!(self.tokens.get(index + 2), Some((Token::Colon, _)));
        after_operand && !named
    }

    /// Closes the bracket that `closer` belongs to, and those inside it. Gives false when there
    /// is none, and `closer` is not to be read.
    fn close(&mut self, closer: Token, span: Span) -> bool {
        // A `)` cannot reach over a block that is still open.
        let floor = match closer {
            Token::RightBrace => 0,
            _ => self.innermost_block(),
        };
        let is_partner = |open: &Open| open.token.closer() == Some(closer);
        let partner = self.open[floor..].iter().rposition(is_partner);
        let Some(at) = partner.filter(|_| !self.clues.drop.contains(&span.start)) else {
            self.reject(closer, span, floor);
            return false;
        };
        self.close_down_to(floor + at + 1, span, "before this bracket");
        if let Some(open) = self.open.pop()
            && self.lines.is_first
            && self.lines.indent != open.indent
        {
            self.suspects.push(Suspect {
                open,
                close: span,
                close_indent: self.lines.indent,
            });
        }
        true
    }

    /// Reports a closing bracket without partner. One of the wrong kind stands for the right one.
    fn reject(&mut self, closer: Token, span: Span, floor: usize) {
        let wrong = match closer {
            Token::RightBrace => None,
            _ => self.open[floor..].last().copied(),
        };
        if self.out.stray.len() < super::MAX_ERRORS {
            self.out.stray.push((span, stray(closer, span, wrong)));
        }
        if let Some(right) = wrong.and_then(|open| open.token.closer()) {
            self.open.pop();
            self.out.tokens.push((right, span));
        }
        if closer == Token::RightBrace {
            // Perhaps an earlier one, indented further than what it closed, was the stray one.
            let deeper = |s: &Suspect| s.close_indent > s.open.indent;
            if let Some(suspect) = self.suspects.iter().find(|s| deeper(s)) {
                self.learned.drop.insert(suspect.close.start);
            }
            self.suspects.clear();
        }
    }

    /// The number of open brackets up to the innermost block.
    fn innermost_block(&self) -> usize {
        let block = self.open.iter().rposition(|o| !o.is_list);
        block.map_or(0, |i| i + 1)
    }

    /// Reports one of the brackets above `depth`, and closes them all before `at`.
    fn close_down_to(&mut self, depth: usize, at: Span, place: &str) {
        let Some(innermost) = self.open[depth..].last().copied() else {
            return;
        };
        // One inside took the partner of this one if its own is missing.
        let took = |s: &&Suspect| {
            s.open.token == innermost.token && s.open.span.start > innermost.span.start
        };
        let culprit = self
            .suspects
            .iter()
            .find(took)
            .map_or(innermost, |s| s.open);
        self.suspects.clear();
        if culprit.token == Token::LeftBrace {
            self.learned.close.insert(culprit.span.start);
        }
        if self.out.unclosed.len() < super::MAX_ERRORS {
            let diagnostic = unclosed(culprit, at, place);
            self.out.unclosed.push((culprit.span, diagnostic));
        }
        let here = Span {
            end: at.start,
            ..at
        };
        for open in self.open.drain(depth..).rev() {
            let closer = open.token.closer();
            self.out.tokens.extend(closer.map(|closer| (closer, here)));
        }
    }
}

fn unclosed(open: Open, at: Span, place: &str) -> Diagnostic {
    let spelling = open.token.spelling().unwrap_or_default();
    let closer = open.token.closer().and_then(Token::spelling);
    let closer = closer.unwrap_or_default();
    let message = format!("`{spelling}` is never closed");
    Diagnostic::new(Code::Unclosed, open.span, message)
        .expected(format!("`{closer}` {place}"))
        .label(at, format!("`{closer}` is missing {place}"))
        .fix(Fix {
            title: format!("close it: `{closer}`"),
            span: Span {
                end: at.start,
                ..at
            },
            was: None,
            text: closer.to_owned(),
            imports: Vec::new(),
        })
}

/// `wrong` is the bracket of another kind that `closer` would have to close.
fn stray(closer: Token, span: Span, wrong: Option<Open>) -> Diagnostic {
    let spelling = closer.spelling().unwrap_or_default();
    let message = format!("`{spelling}` closes nothing");
    let diagnostic = Diagnostic::new(Code::Unclosed, span, message);
    match wrong {
        Some(open) => {
            let other = open.token.spelling().unwrap_or_default();
            let partner = open.token.closer().and_then(Token::spelling);
            diagnostic
                .label(open.span, format!("this `{other}` is still open"))
                .meant(spelling, partner.unwrap_or_default())
        }
        None => diagnostic
            .hint(format!("remove this `{spelling}`"))
            .fix(Fix {
                title: format!("remove this `{spelling}`"),
                span,
                was: Some(spelling.to_owned()),
                text: String::new(),
                imports: Vec::new(),
            }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lexer::lex;

    /// Both ways to find that nothing is wrong, on a text.
    fn agree(text: &str) -> bool {
        let file = FileId(0);
        let (tokens, _) = lex(file, text);
        let balanced = are_balanced(text, &tokens);
        let out = Balancer::run(file, text, &tokens, &Clues::default()).out;
        let is_left = out.tokens == tokens && out.unclosed.is_empty() && out.stray.is_empty();
        assert!(is_left || !balanced, "{text}");
        balanced
    }

    #[test]
    fn a_balancer_leaves_what_a_look_finds_balanced() {
        let files = impasto_stdlib::files().iter();
        let balanced = files.filter(|file| agree(file.text)).count();
        assert!(10 * balanced > 9 * impasto_stdlib::files().len());
        // Without a bracket, a semicolon or a line's indentation, nearly anything may be wrong.
        for file in impasto_stdlib::files() {
            let marks = file
                .text
                .match_indices(['(', ')', '{', '}', '[', ']', ';', '\n']);
            for (at, _) in marks.step_by(29) {
                agree(&[&file.text[..at], &file.text[at + 1..]].concat());
                agree(&[&file.text[..at], " ) ", &file.text[at + 1..]].concat());
            }
        }
    }
}
