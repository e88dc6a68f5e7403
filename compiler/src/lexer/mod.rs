//! Source text to tokens.
//!
//! Lexing never fails: what is no token becomes [`Token::Unknown`] and a diagnostic, and goes
//! on behind it. Comments and white space leave no trace; documentation comments are tokens.

mod number;
mod token;

use std::fmt::Write as _;
use std::ops::Range;

use logos::Logos;

pub(crate) use number::{Number, read as read_number};
use token::LexError;
pub use token::Token;

use crate::diag::foreign::{self, Use};
use crate::diag::{Code, Diagnostic};
use crate::source::{FileId, MAX_SOURCE_BYTES, Span};

/// Lexical problems of one file that are reported; a binary file is one problem, not a million.
const MAX_ERRORS: usize = 64;

/// Checks that `bytes` are a source text, before anything else looks at them.
///
/// # Errors
/// E0101 when they are too many, E0102 when they are not UTF-8; `name` is the file's.
pub fn decode(name: &str, bytes: &[u8]) -> Result<String, Diagnostic> {
    if bytes.len() > MAX_SOURCE_BYTES {
        let message = format!("`{name}` has {} bytes", bytes.len());
        return Err(Diagnostic::without_span(Code::SourceTooLarge, message)
            .expected(format!("at most {MAX_SOURCE_BYTES} bytes (1 MiB)"))
            .hint("split it into modules and import them with `use`"));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => {
            let at = error.valid_up_to();
            let line = bytes[..at].iter().filter(|b| **b == b'\n').count() + 1;
            let message = format!("`{name}` is not UTF-8 text: bad byte in line {line}");
            Err(Diagnostic::without_span(Code::InvalidUtf8, message)
                .expected("a source file in UTF-8")
                .hint("if it is a text file, save it with the encoding UTF-8"))
        }
    }
}

/// The tokens of `text` in order, and its lexical problems.
pub fn lex(file: FileId, text: &str) -> (Vec<(Token, Span)>, Vec<Diagnostic>) {
    let mut tokens: Vec<(Token, Span)> = Vec::with_capacity(text.len() / 4);
    let mut problems = Problems::new(file, text);
    let mut lexer = Token::lexer(text);
    while let Some(next) = lexer.next() {
        let range = lexer.span();
        let token = match next {
            Ok(token) => {
                if matches!(token, Token::Int | Token::Hex | Token::Float) {
                    let negated = matches!(tokens.last(), Some((Token::Minus, _)));
                    problems.check_number(token, range.clone(), negated);
                }
                token
            }
            Err(LexError::OpenString) => {
                problems.report(open_string(Span::new(file, range.clone())));
                Token::Str
            }
            Err(LexError::OpenComment) => {
                problems.report(open_comment(Span::new(file, range.start..range.start + 2)));
                continue;
            }
            Err(LexError::UnknownCharacter) => {
                if problems.unknown(range.clone()) {
                    continue;
                }
                Token::Unknown
            }
        };
        tokens.push((token, Span::new(file, range)));
    }
    (tokens, problems.finish())
}

/// The text of a documentation token, without its marker and one leading space.
pub fn doc_text(slice: &str) -> &str {
    let text = slice.get(3..).unwrap_or("");
    text.strip_prefix(' ').unwrap_or(text).trim_end()
}

/// A listing of `tokens`, one a line: place, kind and text.
pub fn listing(text: &str, tokens: &[(Token, Span)]) -> String {
    let mut out = String::new();
    for (token, span) in tokens {
        let slice = text.get(span.range()).unwrap_or("").trim_end();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{span:?} {} {slice}", token.kind_name());
    }
    out
}

/// Collects the problems of one file.
struct Problems<'t> {
    file: FileId,
    text: &'t str,
    found: Vec<Diagnostic>,
    /// Adjacent characters that are no token, to be reported together.
    run: Option<Range<usize>>,
    dropped: usize,
}

impl<'t> Problems<'t> {
    fn new(file: FileId, text: &'t str) -> Self {
        Self {
            file,
            text,
            found: Vec::new(),
            run: None,
            dropped: 0,
        }
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        if self.found.len() < MAX_ERRORS {
            self.found.push(diagnostic);
        } else {
            self.dropped += 1;
        }
    }

    /// Notes characters that are no token. Gives true when they need no token of their own:
    /// when they continue the last ones, or are the mark that some editors start a file with.
    fn unknown(&mut self, range: Range<usize>) -> bool {
        if range.start == 0 && self.text.starts_with('\u{feff}') && range.end <= 3 {
            return true;
        }
        if let Some(run) = &mut self.run
            && run.end == range.start
        {
            run.end = range.end;
            return true;
        }
        self.flush_run();
        self.run = Some(range);
        false
    }

    fn flush_run(&mut self) {
        if let Some(run) = self.run.take() {
            let diagnostic = unknown_characters(self.file, self.text, run);
            self.report(diagnostic);
        }
    }

    fn check_number(&mut self, token: Token, range: Range<usize>, negated: bool) {
        if let Err((message, hint)) = read_number(token, &self.text[range.clone()], negated) {
            let span = Span::new(self.file, range);
            self.report(Diagnostic::new(Code::InvalidNumber, span, message).hint(hint));
        }
    }

    fn finish(mut self) -> Vec<Diagnostic> {
        self.flush_run();
        if self.dropped > 0 {
            let end = Span::new(self.file, self.text.len()..self.text.len());
            let message = format!("{} more of these problems are not shown", self.dropped);
            self.found
                .push(Diagnostic::new(Code::UnknownCharacter, end, message));
        }
        self.found
    }
}

fn open_string(span: Span) -> Diagnostic {
    Diagnostic::new(
        Code::Unterminated,
        span,
        "the string does not end on its line",
    )
    .expected("a closing `\"`")
}

fn open_comment(span: Span) -> Diagnostic {
    Diagnostic::new(
        Code::Unterminated,
        span,
        "the block comment is never closed",
    )
    .expected("a closing `*/`")
}

fn unknown_characters(file: FileId, text: &str, run: Range<usize>) -> Diagnostic {
    let slice = &text[run.clone()];
    let shown: String = slice
        .chars()
        .take(12)
        .flat_map(char::escape_debug)
        .collect();
    let more = if slice.chars().nth(12).is_some() {
        "..."
    } else {
        ""
    };
    let message = match slice.chars().count() {
        1 => format!("`{shown}` is not a character of the language"),
        _ => format!("`{shown}{more}` are not characters of the language"),
    };
    let diagnostic = Diagnostic::new(
        Code::UnknownCharacter,
        Span::new(file, run.clone()),
        message,
    );
    let word = text[run.end..].trim_start_matches([' ', '\t']);
    let word = word.split(|c: char| !c.is_alphanumeric()).next();
    let directive = word
        .filter(|_| slice == "#")
        .and_then(|word| foreign::hint(word, &[Use::Directive]));
    let hint = || {
        let own = slice.chars().next().and_then(character_hint)?;
        Some(own.to_owned())
    };
    match directive.or_else(hint) {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

/// What the writer of a foreign character most likely wants.
fn character_hint(character: char) -> Option<&'static str> {
    Some(match character {
        '\'' | '\u{2018}' | '\u{2019}' | '\u{201c}' | '\u{201d}' => {
            "strings are written in straight double quotes, as in \"wood.png\""
        }
        '?' => "a choice is written `if condition { a } else { b }`",
        '~' => "all bits of an int are flipped by `x ^ -1`",
        '#' => "comments start with `//`, and colors are written `srgb(0x8c1010)`",
        '\u{b0}' => "angles are written with the unit `deg`, as in `30 deg`",
        '\u{b5}' | '\u{3bc}' => "micrometres are written `um`",
        '\u{d7}' | '\u{b7}' => "multiplication is written `*`",
        '\u{f7}' => "division is written `/`",
        '\u{2212}' | '\u{2013}' | '\u{2014}' => "subtraction is written `-`",
        '\u{2264}' => "write `<=`",
        '\u{2265}' => "write `>=`",
        '\u{2260}' => "write `!=`",
        '\u{3c0}' => "write `PI`",
        '\u{a0}' | '\u{2003}' | '\u{3000}' => "this is a foreign kind of space; use a plain one",
        _ => return None,
    })
}
