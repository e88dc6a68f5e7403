//! Bounds how deep a source nests before the grammar reads it, so that neither parsing nor any
//! later walk over the tree by recursion can exhaust the stack.

use crate::diag::{Code, Diagnostic};
use crate::lexer::Token;
use crate::source::Span;

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
