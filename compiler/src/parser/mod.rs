//! Tokens to syntax tree.
//!
//! The grammar reads chumsky's input token by token, a file for each level: `file`, `item`, `stmt`,
//! `expr`, `literal`, on what `common` provides; chumsky keeps what was expected where, and goes on
//! after errors. Before it runs, `nesting` bounds how deep the source nests and `brackets` balances its
//! brackets; after it, `report` turns what did not match into diagnostics with the `hints`.

mod brackets;
mod common;
mod error;
mod expr;
mod file;
mod hints;
mod item;
mod lines;
mod literal;
mod nesting;
mod print;
mod report;
mod stmt;

use chumsky::input::Input as _;
use chumsky::prelude::*;

use common::{Input, Tokens, rule};
pub use nesting::MAX_NESTING;
pub use print::{print, print_expression};

use crate::ast::{Expr, Module};
use crate::diag::Diagnostic;
use crate::lexer::{Token, lex};
use crate::source::{FileId, Span};

/// Syntax errors of one file that are reported.
const MAX_ERRORS: usize = 64;

/// Parses a source file. The module holds what could be understood; it is all of the file if
/// there are no diagnostics.
pub fn parse(file: FileId, text: &str) -> (Module, Vec<Diagnostic>) {
    let empty = Module {
        docs: Vec::new(),
        uses: Vec::new(),
        items: Vec::new(),
        tests: Vec::new(),
    };
    let (module, diagnostics) = run(file, text, file::module);
    (module.unwrap_or(empty), diagnostics)
}

/// Parses one expression, such as the value a scene gives to a parameter.
pub fn parse_expression(file: FileId, text: &str) -> (Option<Expr>, Vec<Diagnostic>) {
    run(file, text, expr::expression)
}

/// How tightly an infix operator binds; `None` for other tokens.
pub(crate) fn binding_power(token: Token) -> Option<u16> {
    expr::binary(token).map(|(power, _)| power)
}

fn run<T>(
    file: FileId,
    text: &str,
    read: for<'t> fn(&'t str, &mut Input<'t, '_>) -> Option<T>,
) -> (Option<T>, Vec<Diagnostic>) {
    let (tokens, mut diagnostics) = lex(file, text);
    if let Err(diagnostic) = nesting::check_nesting(&tokens) {
        diagnostics.push(diagnostic);
        return (None, diagnostics);
    }
    let balanced = brackets::balance(file, text, tokens);
    let tokens: &[(Token, Span)] = &balanced.tokens;
    let (value, errors) = {
        let end = Span::new(file, text.len()..text.len());
        let input: Tokens<'_> = tokens.split_token_span(end);
        let grammar = rule(move |inp| read(text, inp));
        grammar.parse(input).into_output_errors()
    };
    if !(errors.is_empty() && balanced.unclosed.is_empty() && balanced.stray.is_empty()) {
        let source = report::Source::new(file, text, &balanced);
        report::report(&source, errors, &mut diagnostics);
    }
    (value, diagnostics)
}
