//! What must hold of the tokens before the grammar reads them: every bracket has its partner,
//! and nothing nests deeper than recursion can follow.
//!
//! Unbalanced brackets are reported here, and repaired: a missing closing bracket is put in and
//! a stray one taken out. So the grammar can tell where a broken construct ends.

use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::{FileId, Span};

/// How many brackets, operators, prefixes and `else`s may be open around one place in all.
pub const MAX_NESTING: usize = 256;

/// Finds the first place that nests too deep.
///
/// The depth of a tree node is at most the number of brackets around it plus, for each of those
/// and the node itself, the operators and `else`s of the statement or list element it is in.
pub(super) fn check_nesting(tokens: &[(Token, Span)]) -> Result<(), Diagnostic> {
    let mut chains = vec![0_usize];
    let mut total = 0;
    for (i, &(token, span)) in tokens.iter().enumerate() {
        let next = tokens.get(i + 1).map(|t| t.0);
        let previous = i.checked_sub(1).and_then(|i| tokens.get(i)).map(|t| t.0);
        if token.closer().is_some() {
            chains.push(0);
            total += 1;
        } else if token.is_closer() {
            if chains.len() > 1 {
                total -= 1 + chains.pop().unwrap_or(0);
            }
            let goes_on = next.is_some_and(is_link);
            if token == Token::RightBrace && !goes_on {
                total -= reset(&mut chains);
            }
        } else if matches!(token, Token::Semicolon | Token::Comma) {
            total -= reset(&mut chains);
        } else if is_link(token) || (token == Token::If && previous != Some(Token::Else)) {
            if let Some(chain) = chains.last_mut() {
                *chain += 1;
            }
            total += 1;
        }
        if total > MAX_NESTING {
            return Err(Diagnostic::new(
                Code::NestedTooDeep,
                span,
                "brackets, operators or `else`s nest too deeply here",
            )
            .expected(format!("at most {MAX_NESTING} levels"))
            .hint("name parts of the expression with `let`"));
        }
    }
    Ok(())
}

fn reset(chains: &mut [usize]) -> usize {
    chains.last_mut().map_or(0, std::mem::take)
}

/// Does `token` make the tree deeper by one?
fn is_link(token: Token) -> bool {
    use Token::*;
    matches!(
        token,
        Dot | OrOr
            | AndAnd
            | EqEq
            | NotEq
            | Less
            | LessEq
            | Greater
            | GreaterEq
            | Pipe
            | Caret
            | Ampersand
            | ShiftLeft
            | ShiftRight
            | Plus
            | Minus
            | Star
            | Slash
            | Percent
            | Not
            | Else
    )
}

/// Tokens with balanced brackets, and what was wrong with them.
pub(super) struct Balanced {
    pub(super) tokens: Vec<(Token, Span)>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Balances the brackets of `tokens`.
pub(super) fn balance(file: FileId, text: &str, tokens: Vec<(Token, Span)>) -> Balanced {
    let mut balancer = Balancer {
        text,
        open: Vec::new(),
        out: Balanced {
            tokens: Vec::with_capacity(tokens.len()),
            diagnostics: Vec::new(),
        },
    };
    for (token, span) in tokens {
        balancer.take(token, span);
    }
    let end = Span::new(file, text.len()..text.len());
    balancer.close_down_to(0, end, "at the end of the file");
    balancer.out
}

struct Balancer<'t> {
    text: &'t str,
    open: Vec<(Token, Span)>,
    out: Balanced,
}

impl Balancer<'_> {
    fn take(&mut self, token: Token, span: Span) {
        if token.closer().is_some() {
            self.open.push((token, span));
        } else if token.is_closer() {
            if !self.close(token, span) {
                return;
            }
        } else if token == Token::Semicolon {
            // Statements are found in braces only.
            self.close_down_to(self.innermost_brace(), span, "before this `;`");
        } else if self.starts_item(token, span) {
            self.close_down_to(0, span, "before this definition");
        }
        self.out.tokens.push((token, span));
    }

    /// Closes the bracket that `closer` belongs to, and those inside it. Gives false when there
    /// is none.
    fn close(&mut self, closer: Token, span: Span) -> bool {
        // A `)` cannot reach over a block that is still open.
        let floor = match closer {
            Token::RightBrace => 0,
            _ => self.innermost_brace(),
        };
        let partner = |(open, _): &(Token, Span)| open.closer() == Some(closer);
        match self.open[floor..].iter().rposition(partner) {
            Some(at) => {
                self.close_down_to(floor + at + 1, span, "before this bracket");
                self.open.pop();
                true
            }
            None => {
                let spelling = closer.spelling().unwrap_or_default();
                let message = format!("`{spelling}` closes nothing");
                let mut diagnostic = Diagnostic::new(Code::Unclosed, span, message);
                if let Some((open, at)) = self.open.last() {
                    let open = open.spelling().unwrap_or_default();
                    diagnostic = diagnostic.label(*at, format!("this `{open}` is open here"));
                }
                self.report(diagnostic.hint(format!("remove this `{spelling}`")));
                false
            }
        }
    }

    /// The number of open brackets up to the innermost brace.
    fn innermost_brace(&self) -> usize {
        let brace = self.open.iter().rposition(|(t, _)| *t == Token::LeftBrace);
        brace.map_or(0, |i| i + 1)
    }

    /// Definitions do not nest; a definition at the start of a line closes all that is open.
    fn starts_item(&self, token: Token, span: Span) -> bool {
        use Token::*;
        let starts = matches!(
            token,
            Material | Bsdf | Delta | Edf | Fn | Struct | Const | Use
        );
        let before = self.text.get(..span.start as usize).unwrap_or("");
        starts && !self.open.is_empty() && (before.is_empty() || before.ends_with('\n'))
    }

    /// Reports the innermost of the brackets above `depth` and closes them all before `at`.
    fn close_down_to(&mut self, depth: usize, at: Span, place: &str) {
        if self.open.len() <= depth {
            return;
        }
        if let Some((open, span)) = self.open.last().copied() {
            let spelling = open.spelling().unwrap_or_default();
            let closer = open.closer().and_then(Token::spelling).unwrap_or_default();
            let message = format!("`{spelling}` is never closed");
            self.report(
                Diagnostic::new(Code::Unclosed, span, message)
                    .expected(format!("`{closer}` {place}"))
                    .label(at, format!("`{closer}` is missing {place}")),
            );
        }
        let here = Span {
            end: at.start,
            ..at
        };
        while self.open.len() > depth {
            if let Some(closer) = self.open.pop().and_then(|(open, _)| open.closer()) {
                self.out.tokens.push((closer, here));
            }
        }
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        if self.out.diagnostics.len() < super::MAX_ERRORS {
            self.out.diagnostics.push(diagnostic);
        }
    }
}
