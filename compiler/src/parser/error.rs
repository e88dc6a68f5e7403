//! What the grammar reports: a place and the set of what would have been accepted there.
//!
//! The grammar notes what would have been accepted wherever something is left out, also in correct sources, and
//! chumsky merges what is noted at one place. So errors are small values and the set is a bit mask.

use chumsky::DefaultExpected;
use chumsky::error::{Error, LabelError};
use chumsky::util::MaybeRef;

use super::Tokens;
use crate::diag::Diagnostic;
use crate::lexer::Token;
use crate::source::{FileId, Span};

/// Something that can be expected and is not one certain token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Want {
    Name,
    Type,
    Expression,
    Operator,
    EndOfFile,
}

impl Want {
    const ALL: [(Want, &'static str); 5] = [
        (Want::Name, "a name"),
        (Want::Type, "a type"),
        (Want::Expression, "an expression"),
        (Want::Operator, "an operator"),
        (Want::EndOfFile, "the end of the file"),
    ];
}

/// A set of tokens and [`Want`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Expected(u128);

// Tokens take the low bits, wants the high ones.
const _: () = assert!(Token::ALL.len() + Want::ALL.len() <= 128);

impl Expected {
    pub(super) const fn token(token: Token) -> Self {
        Self(1 << token as u32)
    }

    pub(super) const fn want(want: Want) -> Self {
        Self(1 << (127 - want as u32))
    }

    /// All of `tokens`.
    pub(super) fn tokens(tokens: &[Token]) -> Self {
        let bits = tokens.iter().map(|t| Self::token(*t).0);
        Self(bits.fold(0, |set, bit| set | bit))
    }

    pub(super) const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(super) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    pub(super) fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The members in people's words.
    pub(super) fn words(self) -> Vec<String> {
        let wants = Want::ALL.iter().filter(|(w, _)| self.has(Self::want(*w)));
        let wants = wants.map(|(_, words)| (*words).to_owned());
        let tokens = Token::ALL.iter().filter(|t| self.has(Self::token(**t)));
        wants.chain(tokens.map(|t| describe(*t))).collect()
    }
}

/// A kind of token in people's words.
pub(super) fn describe(token: Token) -> String {
    match token {
        Token::Ident => "a name".to_owned(),
        Token::Int | Token::Hex | Token::Float => "a number".to_owned(),
        Token::Str => "a string".to_owned(),
        Token::DocOuter | Token::DocInner => "a documentation comment".to_owned(),
        _ => format!("`{}`", token.spelling().unwrap_or("?")),
    }
}

/// A place where the grammar does not match.
#[derive(Clone, Debug)]
pub(super) struct SyntaxError {
    /// The token found, or an empty span at the end of the file.
    pub(super) span: Span,
    /// Its kind.
    pub(super) found: Option<Token>,
    /// What would have been accepted.
    pub(super) expected: Expected,
    /// A diagnostic that says it better than the set does.
    pub(super) special: Option<Box<Diagnostic>>,
}

impl SyntaxError {
    pub(super) fn new(span: Span, found: Option<Token>, expected: Expected) -> Self {
        Self {
            span,
            found,
            expected,
            special: None,
        }
    }

    /// An error that is already in people's words.
    pub(super) fn special(span: Span, diagnostic: Diagnostic) -> Self {
        Self {
            special: Some(Box::new(diagnostic)),
            ..Self::new(span, None, Expected::default())
        }
    }
}

impl<'t> LabelError<'t, Tokens<'t>, DefaultExpected<'t, Token>> for SyntaxError {
    #[inline]
    fn expected_found<E: IntoIterator<Item = DefaultExpected<'t, Token>>>(
        expected: E,
        found: Option<MaybeRef<'t, Token>>,
        span: Span,
    ) -> Self {
        let mut set = Expected::default();
        for one in expected {
            match one {
                DefaultExpected::Token(token) => set = set.with(Expected::token(*token)),
                DefaultExpected::EndOfInput => set = set.with(Expected::want(Want::EndOfFile)),
                _ => {}
            }
        }
        Self::new(span, found.map(|t| *t), set)
    }
}

impl<'t> Error<'t, Tokens<'t>> for SyntaxError {
    #[inline]
    fn merge(mut self, other: Self) -> Self {
        self.expected = self.expected.with(other.expected);
        self.special = self.special.or(other.special);
        self
    }
}

impl chumsky::span::Span for Span {
    type Context = FileId;
    type Offset = u32;

    fn new(file: FileId, range: std::ops::Range<u32>) -> Self {
        // A match of no tokens "ends" at the token before its start.
        let end = range.end.max(range.start);
        Span {
            file,
            start: range.start,
            end,
        }
    }

    fn context(&self) -> FileId {
        self.file
    }

    fn start(&self) -> u32 {
        self.start
    }

    fn end(&self) -> u32 {
        self.end
    }
}
