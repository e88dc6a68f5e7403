//! `impasto fmt`: a source in the one layout that all sources have.
//!
//! Only white space, and commas before closing brackets, ever change: [`format()`] compares tokens
//! and comments before and after, and gives up rather than lose one. Formatting what is formatted
//! changes nothing.
//!
//! The layout, in short: four blanks a level, at most 100 columns where that is possible, at most
//! one empty line in a row. What fits on one line stands on one; of a list that does not, every
//! element gets a line, with a comma behind the last. The author decides where both are right: a
//! list with a comma behind its last element stays broken, as does an `if` whose first block
//! starts a line, and chains of operators break where they were broken before.

mod doc;
mod expr;
mod item;
mod layout;
mod list;
mod output;
mod render;
mod stmt;
mod trivia;

use crate::diag::{self, Diagnostic};
use crate::lexer::{Token, lex};
use crate::parser;
use crate::source::{FileId, Span};

/// Why a source was left as it is.
#[derive(Clone, Debug, PartialEq)]
pub enum Unformatted {
    /// It has syntax errors.
    Syntax(Vec<Diagnostic>),
    /// Formatting would have lost something: a defect of the formatter.
    Lost,
}

/// The text of a source file in the layout of the language. It ends in a line break unless there
/// is nothing in it.
///
/// # Errors
/// Sources that do not parse are not formatted.
pub fn format(file: FileId, text: &str) -> Result<String, Unformatted> {
    let (_, diagnostics) = parser::parse(file, text);
    if diag::has_errors(&diagnostics) {
        return Err(Unformatted::Syntax(diagnostics));
    }
    let (tokens, _) = lex(file, text);
    let mut formatted = laid_out(file, text);
    // Comments in odd places may end up where the layout would have put the rest otherwise.
    for _ in 0..MOST_ROUNDS {
        let again = laid_out(file, &formatted);
        if again == formatted {
            break;
        }
        formatted = again;
    }
    let (after, _) = lex(file, &formatted);
    let kept = significant(text, &tokens) == significant(&formatted, &after)
        && sorted_comments(text, &tokens) == sorted_comments(&formatted, &after);
    if kept {
        Ok(formatted)
    } else {
        Err(Unformatted::Lost)
    }
}

/// A layout is laid out at most so many times more until it stays as it is.
const MOST_ROUNDS: usize = 4;

fn laid_out(file: FileId, text: &str) -> String {
    let (tokens, _) = lex(file, text);
    let document = layout::Layout::new(trivia::pieces(text, &tokens)).file();
    render::render(&document)
}

/// All tokens with their texts, but for commas before closing brackets.
fn significant<'t>(text: &'t str, tokens: &[(Token, Span)]) -> Vec<(Token, &'t str)> {
    let next = tokens.iter().skip(1).map(|(token, _)| Some(*token));
    let pairs = tokens.iter().zip(next.chain([None]));
    let kept = pairs.filter(|((token, _), next)| {
        let trailing = *token == Token::Comma && next.is_some_and(Token::is_closer);
        !trailing
    });
    kept.map(|((token, span), _)| (*token, text.get(span.range()).unwrap_or("").trim_end()))
        .collect()
}

fn sorted_comments<'t>(text: &'t str, tokens: &[(Token, Span)]) -> Vec<&'t str> {
    let mut comments = trivia::comments(text, tokens);
    comments.sort_unstable();
    comments
}
