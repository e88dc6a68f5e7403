//! The tokens of the language, each declared once with its spelling.

use logos::{FilterResult, Lexer, Logos};

/// What a piece of text that is no token turned out to be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LexError {
    /// Characters that the language does not use.
    #[default]
    UnknownCharacter,
    /// `/* ...` up to the end of the file.
    OpenComment,
    /// `"...` up to the end of the line.
    OpenString,
}

/// Declares [`Token`] and the tables over it.
macro_rules! tokens {
    (
        keywords { $($keyword:ident $keyword_text:tt)* }
        punctuation { $($mark:ident $mark_text:tt)* }
    ) => {
        /// The kind of a token; its text is found by its span.
        #[derive(Clone, Copy, Debug, Logos, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[logos(error = LexError)]
        #[logos(skip r"[ \t\r\n\f]+")]
        #[allow(missing_docs)]
        pub enum Token {
            /// A name that is not a keyword.
            #[regex("[A-Za-z_][A-Za-z0-9_]*")]
            Ident,
            /// `12`, `12u`
            #[regex("[0-9]+", number)]
            Int,
            /// `0xff8800`, `0xffu`
            #[regex("0x[0-9A-Za-z_]*")]
            Hex,
            /// `1.5`, `.5`, `2.`, `1e-3`
            #[regex(r"\.[0-9]+", fraction)]
            Float,
            /// `"wood.png"`, with its quotes.
            #[token("\"", string)]
            Str,
            /// `/// text`, documentation of what follows.
            #[regex("//[^\n]*", comment, allow_greedy = true)]
            #[token("/*", block_comment)]
            DocOuter,
            /// `//! text`, documentation of the file.
            DocInner,
            /// Characters that were already reported as an error.
            Unknown,
            $(#[token($keyword_text)] $keyword,)*
            $(#[token($mark_text)] $mark,)*
        }

        impl Token {
            /// Every keyword in the order of the reference.
            pub const KEYWORDS: &'static [&'static str] = &[$($keyword_text),*];

            /// Every other token with one spelling, in the order of their declarations.
            pub const MARKS: &'static [&'static str] = &[$($mark_text),*];

            /// Every kind, by its number.
            pub(crate) const ALL: &'static [Token] = &[
                Token::Ident, Token::Int, Token::Hex, Token::Float, Token::Str,
                Token::DocOuter, Token::DocInner, Token::Unknown,
                $(Token::$keyword,)* $(Token::$mark,)*
            ];

            /// The spelling, for tokens that have only one.
            pub fn spelling(self) -> Option<&'static str> {
                match self {
                    $(Token::$keyword => Some($keyword_text),)*
                    $(Token::$mark => Some($mark_text),)*
                    _ => None,
                }
            }

            /// Is it a reserved word?
            pub fn is_keyword(self) -> bool {
                matches!(self, $(Token::$keyword)|*)
            }
        }
    };
}

tokens! {
    keywords {
        Material "material" Bsdf "bsdf" Delta "delta" Edf "edf" Fn "fn" Struct "struct"
        Const "const" Private "private" Use "use" As "as" Param "param" Let "let" Var "var" If "if" Else "else"
        For "for" In "in" While "while" Limit "limit" Break "break" Continue "continue"
        Assert "assert" When "when" True "true" False "false"
    }
    punctuation {
        Comma "," Semicolon ";" Colon ":" PathSeparator "::" Dot "." Range ".." Arrow "->"
        LeftParen "(" RightParen ")" LeftBracket "[" RightBracket "]" LeftBrace "{" RightBrace "}"
        Assign "=" AddAssign "+=" SubAssign "-=" MulAssign "*=" DivAssign "/="
        RemAssign "%=" AndAssign "&=" OrAssign "|=" XorAssign "^=" ShiftLeftAssign "<<=" ShiftRightAssign ">>="
        OrOr "||" AndAnd "&&" EqEq "==" NotEq "!=" Less "<" LessEq "<=" Greater ">" GreaterEq ">="
        Pipe "|" Caret "^" Ampersand "&" ShiftLeft "<<" ShiftRight ">>"
        Plus "+" Minus "-" Star "*" Slash "/" Percent "%" Not "!"
    }
}

impl Token {
    /// The name of the kind in token listings.
    pub fn kind_name(self) -> &'static str {
        match self {
            Token::Ident => "name",
            Token::Int => "int",
            Token::Hex => "hex",
            Token::Float => "float",
            Token::Str => "string",
            Token::DocOuter => "doc",
            Token::DocInner => "file-doc",
            Token::Unknown => "unknown",
            _ if self.is_keyword() => "keyword",
            _ => "mark",
        }
    }

    /// The closing bracket that belongs to an opening one.
    pub(crate) fn closer(self) -> Option<Token> {
        match self {
            Token::LeftParen => Some(Token::RightParen),
            Token::LeftBracket => Some(Token::RightBracket),
            Token::LeftBrace => Some(Token::RightBrace),
            _ => None,
        }
    }

    /// Is it a closing bracket?
    pub(crate) fn is_closer(self) -> bool {
        matches!(
            self,
            Token::RightParen | Token::RightBracket | Token::RightBrace
        )
    }
}

/// Continues a number after its first digits: `1.5`, `2.`, `1e-3`, but `0..8` is three tokens
/// and `2.x` a field of a number.
fn number(lexer: &mut Lexer<'_, Token>) -> Token {
    let rest = lexer.remainder().as_bytes();
    let mut length = 0;
    if rest.first() == Some(&b'.') {
        let digits = count_digits(&rest[1..]);
        let after = rest.get(1 + digits);
        if digits > 0 || !after.is_some_and(|&b| b == b'.' || b == b'_' || b.is_ascii_alphabetic())
        {
            length = 1 + digits;
        }
    }
    length += exponent_length(&rest[length..]);
    if length == 0 && has_suffix(rest) {
        lexer.bump(1);
        return Token::Int;
    }
    lexer.bump(length);
    if length == 0 {
        Token::Int
    } else {
        Token::Float
    }
}

/// Is the next letter the suffix of an unsigned int, and no name?
fn has_suffix(rest: &[u8]) -> bool {
    let goes_on = |b: &u8| *b == b'_' || b.is_ascii_alphanumeric();
    rest.first() == Some(&b'u') && !rest.get(1).is_some_and(goes_on)
}

/// Continues `.5` with its exponent.
fn fraction(lexer: &mut Lexer<'_, Token>) {
    lexer.bump(exponent_length(lexer.remainder().as_bytes()));
}

/// The length of `e-3` at the start of `text`; 0 when that is no exponent.
fn exponent_length(text: &[u8]) -> usize {
    if !matches!(text.first(), Some(b'e' | b'E')) {
        return 0;
    }
    let sign = usize::from(matches!(text.get(1), Some(b'+' | b'-')));
    match count_digits(&text[1 + sign..]) {
        0 => 0,
        digits => 1 + sign + digits,
    }
}

fn count_digits(text: &[u8]) -> usize {
    text.iter().take_while(|b| b.is_ascii_digit()).count()
}

/// Takes the rest of a string, which ends on its line.
fn string(lexer: &mut Lexer<'_, Token>) -> Result<(), LexError> {
    let rest = lexer.remainder();
    let line_end = rest.find(['\n', '\r']).unwrap_or(rest.len());
    match rest[..line_end].find('"') {
        Some(quote) => {
            lexer.bump(quote + 1);
            Ok(())
        }
        None => {
            lexer.bump(line_end);
            Err(LexError::OpenString)
        }
    }
}

/// Tells documentation from comments; `////` is a comment, as rulers of slashes are.
fn comment(lexer: &mut Lexer<'_, Token>) -> FilterResult<Token, LexError> {
    let text = lexer.slice();
    if text.starts_with("//!") {
        FilterResult::Emit(Token::DocInner)
    } else if text.starts_with("///") && !text.starts_with("////") {
        FilterResult::Emit(Token::DocOuter)
    } else {
        FilterResult::Skip
    }
}

/// Skips the rest of a block comment.
fn block_comment(lexer: &mut Lexer<'_, Token>) -> FilterResult<Token, LexError> {
    match lexer.remainder().find("*/") {
        Some(end) => {
            lexer.bump(end + 2);
            FilterResult::Skip
        }
        None => {
            lexer.bump(lexer.remainder().len());
            FilterResult::Error(LexError::OpenComment)
        }
    }
}
