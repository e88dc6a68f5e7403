//! Tokens of the IR's text. Line breaks mean nothing; `//` starts a comment.

use std::ops::Range;

/// A token with what it says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// A name, a keyword, or an op.
    Ident(String),
    /// `%3`: an evaluated expression.
    Value(u32),
    /// `$3`: a parameter of the material.
    MaterialParam(u32),
    /// `#3`: a value of the parameter table.
    TableValue(u32),
    /// `@3`: a variable.
    Local(u32),
    Int(i64),
    Float(f64),
    Str(String),
    /// One of [`PUNCTUATION`].
    Punct(&'static str),
    End,
}

impl Token {
    /// The token for messages.
    pub(super) fn describe(&self) -> String {
        match self {
            Token::Ident(name) => format!("`{name}`"),
            Token::Value(n) => format!("`%{n}`"),
            Token::MaterialParam(n) => format!("`${n}`"),
            Token::TableValue(n) => format!("`#{n}`"),
            Token::Local(n) => format!("`@{n}`"),
            Token::Int(n) => format!("`{n}`"),
            Token::Float(x) => format!("`{x:?}`"),
            Token::Str(_) => "a string".into(),
            Token::Punct(p) => format!("`{p}`"),
            Token::End => "the end of the text".into(),
        }
    }
}

/// Longer ones before those they begin with.
const PUNCTUATION: [&str; 10] = ["->", "..", "{", "}", "(", ")", ":", ",", "=", "."];

/// What could not be read, and where.
pub(super) struct Bad {
    pub(super) at: Range<usize>,
    pub(super) message: String,
    pub(super) expected: &'static str,
}

/// Splits text into tokens with their places; the last one is `End`.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Bad> {
    let mut lexer = Lexer { text, at: 0 };
    let mut out = Vec::new();
    loop {
        lexer.skip();
        let start = lexer.at;
        let token = lexer.token()?;
        let done = token == Token::End;
        out.push((token, start..lexer.at));
        if done {
            return Ok(out);
        }
    }
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Passes blanks and comments.
    fn skip(&mut self) {
        loop {
            self.take(|c| c.is_ascii_whitespace());
            if !self.rest().starts_with("//") {
                return;
            }
            self.take(|c| c != '\n');
        }
    }

    /// Passes characters while they fit, and returns them.
    fn take(&mut self, fits: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let length = rest.find(|c| !fits(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn bad<T>(&self, start: usize, message: String, expected: &'static str) -> Result<T, Bad> {
        Err(Bad {
            at: start..self.at,
            message,
            expected,
        })
    }

    fn token(&mut self) -> Result<Token, Bad> {
        let mut ahead = self.rest().chars();
        let (Some(c), next) = (ahead.next(), ahead.next()) else {
            return Ok(Token::End);
        };
        let signed = c == '-' && next.is_some_and(|c| c.is_ascii_digit());
        match c {
            'a'..='z' | 'A'..='Z' | '_' => Ok(Token::Ident(self.take(in_name).to_owned())),
            '%' => self.numbered(Token::Value),
            '$' => self.numbered(Token::MaterialParam),
            '#' => self.numbered(Token::TableValue),
            '@' => self.numbered(Token::Local),
            '"' => self.string(),
            _ if signed || c.is_ascii_digit() => self.number(),
            _ => self.punctuation(c),
        }
    }

    fn punctuation(&mut self, c: char) -> Result<Token, Bad> {
        match PUNCTUATION.iter().find(|p| self.rest().starts_with(**p)) {
            Some(p) => {
                self.at += p.len();
                Ok(Token::Punct(p))
            }
            None => {
                let start = self.at;
                self.at += c.len_utf8();
                self.bad(
                    start,
                    format!("unknown character {c:?}"),
                    "IR text is ASCII",
                )
            }
        }
    }

    /// A sign such as `%` and a number below 2^32.
    fn numbered(&mut self, token: fn(u32) -> Token) -> Result<Token, Bad> {
        let start = self.at;
        self.at += 1;
        match self.take(|c| c.is_ascii_digit()).parse() {
            Ok(n) => Ok(token(n)),
            Err(_) => self.bad(start, "a number is missing".into(), "a sign and its number"),
        }
    }

    /// An int, or a float if there is a point or an exponent.
    fn number(&mut self) -> Result<Token, Bad> {
        let start = self.at;
        self.at += usize::from(self.rest().starts_with('-'));
        self.take(|c| c.is_ascii_digit());
        let mut float = false;
        let after_point = self.rest().strip_prefix('.');
        if after_point.is_some_and(|r| r.starts_with(|c: char| c.is_ascii_digit())) {
            float = true;
            self.at += 1;
            self.take(|c| c.is_ascii_digit());
        }
        if self.rest().starts_with('e') {
            float = true;
            self.at += 1;
            self.at += usize::from(self.rest().starts_with(['-', '+']));
            self.take(|c| c.is_ascii_digit());
        }
        let text = &self.text[start..self.at];
        let read = if float {
            let finite = text.parse().ok().filter(|x: &f64| x.is_finite());
            finite.map(Token::Float)
        } else {
            text.parse().ok().map(Token::Int)
        };
        let expected = "a finite float, or an int of 32 bits";
        read.map_or_else(
            || self.bad(start, format!("no number: `{text}`"), expected),
            Ok,
        )
    }

    /// A string on one line, with the escapes that Rust's `{:?}` writes.
    fn string(&mut self) -> Result<Token, Bad> {
        let start = self.at;
        let mut out = String::new();
        let mut chars = self.rest().char_indices().skip(1);
        while let Some((i, c)) = chars.next() {
            let escaped = match c {
                '"' => {
                    self.at = start + i + 1;
                    return Ok(Token::Str(out));
                }
                '\n' => break,
                '\\' => escape(&mut chars),
                c => Some(c),
            };
            let Some(c) = escaped else { break };
            out.push(c);
        }
        self.take(|c| c != '\n');
        let message = "the string does not end, or has an unknown escape";
        self.bad(start, message.into(), "`\"...\"` on one line")
    }
}

/// The character that what follows a backslash stands for.
fn escape(chars: &mut impl Iterator<Item = (usize, char)>) -> Option<char> {
    match chars.next()?.1 {
        'n' => Some('\n'),
        'r' => Some('\r'),
        't' => Some('\t'),
        '0' => Some('\0'),
        c @ ('"' | '\'' | '\\') => Some(c),
        'u' => {
            chars.next().filter(|c| c.1 == '{')?;
            let digits: String = chars
                .map(|c| c.1)
                .take_while(|&c| c != '}')
                .take(8)
                .collect();
            char::from_u32(u32::from_str_radix(&digits, 16).ok()?)
        }
        _ => None,
    }
}

/// Names may be numbered: `fade#2`.
fn in_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '#'
}
