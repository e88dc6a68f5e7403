//! Balances brackets before the grammar reads the tokens.
//!
//! A missing closing bracket is reported and put in, a stray one reported and taken out. So the
//! grammar always finds where a broken construct ends. Where a bracket is missing is a guess:
//! from what cannot stand inside one (`;` in parentheses, a definition in braces) and from how
//! lines are indented.

use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::{FileId, Span};

/// Tokens with balanced brackets, and what was wrong with them.
pub(super) struct Balanced {
    pub(super) tokens: Vec<(Token, Span)>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Balances the brackets of `tokens`.
pub(super) fn balance(file: FileId, text: &str, tokens: &[(Token, Span)]) -> Balanced {
    let mut balancer = Balancer {
        tokens,
        lines: Lines::new(text),
        open: Vec::new(),
        suspects: Vec::new(),
        closed_at: 0,
        out: Balanced {
            tokens: Vec::with_capacity(tokens.len()),
            diagnostics: Vec::new(),
        },
    };
    for index in 0..tokens.len() {
        balancer.take(index);
    }
    let end = Span::new(file, text.len()..text.len());
    balancer.close_down_to(0, end, "at the end of the file");
    balancer.out
}

/// An opening bracket whose partner was not met yet.
#[derive(Clone, Copy)]
struct Open {
    token: Token,
    span: Span,
    /// The blanks at the start of its line.
    indent: u32,
    /// Was there an `if` or `else` in it since its last `,`? Then a block may follow.
    branches: bool,
}

struct Balancer<'t> {
    tokens: &'t [(Token, Span)],
    lines: Lines<'t>,
    open: Vec<Open>,
    /// Braces whose partner is indented otherwise.
    suspects: Vec<Open>,
    /// Up to this token, a `;` in parentheses is known to be in them by mistake.
    closed_at: usize,
    out: Balanced,
}

impl Balancer<'_> {
    fn take(&mut self, index: usize) {
        let (token, span) = self.tokens[index];
        self.lines.advance(span);
        match token {
            Token::Semicolon if self.in_parens() && !self.closes_soon(index) => {
                self.close_down_to(self.innermost_brace(), span, "before this `;`");
            }
            Token::LeftBrace if self.in_parens() && self.starts_body(index) => {
                self.close_down_to(self.innermost_brace(), span, "before this `{`");
            }
            Token::If | Token::Else => self.set_branches(true),
            Token::Comma => self.set_branches(false),
            _ if self.starts_definition(token) => {
                self.close_down_to(0, span, "before this definition");
            }
            _ => {}
        }
        if token.closer().is_some() {
            self.open.push(Open {
                token,
                span,
                indent: self.lines.indent,
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

    /// Is the innermost open bracket another than a brace?
    fn in_parens(&self) -> bool {
        self.open
            .last()
            .is_some_and(|o| o.token != Token::LeftBrace)
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
            } else if token.is_closer() && depth == 0 {
                self.closed_at = i;
                return *token != Token::RightBrace;
            } else if token.is_closer() {
                depth -= 1;
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
        after_operand && !named && self.open.last().is_some_and(|o| !o.branches)
    }

    /// Definitions do not nest: one at the start of a line closes all that is open.
    fn starts_definition(&self, token: Token) -> bool {
        use Token::*;
        let keyword = matches!(
            token,
            Material | Bsdf | Delta | Edf | Fn | Struct | Const | Use
        );
        keyword && !self.open.is_empty() && self.lines.is_first && self.lines.indent == 0
    }

    /// Closes the bracket that `closer` belongs to, and those inside it. Gives false when there
    /// is none, and `closer` is not to be read.
    fn close(&mut self, closer: Token, span: Span) -> bool {
        // A `)` cannot reach over a block that is still open.
        let floor = match closer {
            Token::RightBrace => 0,
            _ => self.innermost_brace(),
        };
        let is_partner = |open: &Open| open.token.closer() == Some(closer);
        let Some(at) = self.open[floor..].iter().rposition(is_partner) else {
            let wrong = self.open.get(floor..).and_then(<[Open]>::last).copied();
            self.report(stray(closer, span, wrong));
            // A closing bracket of another kind stands for the right one.
            if let Some(right) = wrong.and_then(|open| open.token.closer()) {
                self.open.pop();
                self.out.tokens.push((right, span));
            }
            return false;
        };
        self.close_down_to(floor + at + 1, span, "before this bracket");
        if let Some(open) = self.open.pop() {
            let moved = self.lines.is_first && self.lines.indent != open.indent;
            if closer == Token::RightBrace && moved {
                self.suspects.push(open);
            }
        }
        true
    }

    /// The number of open brackets up to the innermost brace.
    fn innermost_brace(&self) -> usize {
        let brace = self.open.iter().rposition(|o| o.token == Token::LeftBrace);
        brace.map_or(0, |i| i + 1)
    }

    /// Reports one of the brackets above `depth`, and closes them all before `at`.
    fn close_down_to(&mut self, depth: usize, at: Span, place: &str) {
        let Some(innermost) = self.open[depth..].last().copied() else {
            return;
        };
        let inside = |o: &&Open| o.token == innermost.token && o.span.start > innermost.span.start;
        let culprit = self.suspects.iter().find(inside).copied();
        self.report(unclosed(culprit.unwrap_or(innermost), at, place));
        self.suspects.clear();
        let here = Span {
            end: at.start,
            ..at
        };
        for open in self.open.drain(depth..).rev() {
            let closer = open.token.closer();
            self.out.tokens.extend(closer.map(|closer| (closer, here)));
        }
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        if self.out.diagnostics.len() < super::MAX_ERRORS {
            self.out.diagnostics.push(diagnostic);
        }
    }
}

fn unclosed(open: Open, at: Span, place: &str) -> Diagnostic {
    let spelling = open.token.spelling().unwrap_or_default();
    let closer = open.token.closer().and_then(Token::spelling);
    let closer = closer.unwrap_or_default();
    Diagnostic::new(
        Code::Unclosed,
        open.span,
        format!("`{spelling}` is never closed"),
    )
    .expected(format!("`{closer}` {place}"))
    .label(at, format!("`{closer}` is missing {place}"))
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
                .hint(format!("did you mean `{}`?", partner.unwrap_or_default()))
        }
        None => diagnostic.hint(format!("remove this `{spelling}`")),
    }
}

/// Follows the lines of the text from token to token.
struct Lines<'t> {
    text: &'t str,
    /// Where looking for line breaks goes on.
    scanned: usize,
    line_start: usize,
    /// The blanks before the first token of the line.
    indent: u32,
    /// Is the token the first of its line?
    is_first: bool,
}

impl<'t> Lines<'t> {
    fn new(text: &'t str) -> Self {
        Self {
            text,
            scanned: 0,
            line_start: 0,
            indent: 0,
            is_first: false,
        }
    }

    /// Goes on to the token at `span`.
    fn advance(&mut self, span: Span) {
        let start = span.start as usize;
        let skipped = self.text.get(self.scanned..start).unwrap_or("");
        let newline = skipped.rfind('\n');
        self.is_first = newline.is_some() || self.scanned == 0;
        if let Some(newline) = newline {
            self.line_start = self.scanned + newline + 1;
        }
        if self.is_first {
            self.indent = (start - self.line_start) as u32;
        }
        self.scanned = span.end as usize;
    }

    /// Is there a line break between two tokens?
    fn breaks(&self, first: Span, second: Span) -> bool {
        let between = self.text.get(first.end as usize..second.start as usize);
        between.is_some_and(|text| text.contains('\n'))
    }
}
