//! Reads the text that [`super::print`] writes: for tests of passes, which are easier to read and
//! to write as text, and for whoever wants to change what `impasto emit --what ir` shows.
//!
//! What is read is verified, so it can be run, optimised and printed. Names are defined before
//! they are used; so there is no recursion in the text either.
//!
//! ```text
//! texture "wood.png"
//! struct Pair { a: float  b: vec2 }
//! fn twice(x: float) -> float {
//!     var @0.sum: float
//!     %0 start: float = mul x, 2.0
//!     @0.sum = %0
//!     for @1.i in 0 .. 3 { ... }
//!     loop limit 8 { ... } while %3 { ... }
//!     if %4 { ... } else { ... }
//!     return %5
//! }
//! bsdf clay(reflectance: vec3) { sample = clay_sample  eval = ...  pdf = ...  albedo = ... }
//! material wall(point: SurfacePoint) {
//!     uniform $0 scale: float as length = 0.1 in 0.0 .. 1.0
//!     %0: vec3 = point.position
//!     surface = layer lobe clay(reflectance: %0) mix $0 lobe ... lobe ...
//! }
//! ```

use std::collections::BTreeMap;
use std::ops::Range;

use super::{ClosureDefId, FunctionId, Local, Material, Module, StructId, Type, verify};
use crate::source::{FileId, MAX_SOURCE_BYTES, SourceMap, Span};

mod body;
mod expr;
mod item;
mod lex;
mod material;

use lex::Token;

/// How deep branches, loops and closures may nest in text.
pub const MAX_NESTING: usize = 256;

/// What a text defines.
#[derive(Clone, Debug, Default)]
pub struct Parsed {
    /// Structs, functions, closure definitions and textures.
    pub module: Module,
    /// Materials over them.
    pub materials: Vec<Material>,
}

/// Why a text is not IR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseError {
    /// Where.
    pub span: Span,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// What would have been accepted, where one thing would.
    pub expected: Option<String>,
}

impl std::fmt::Display for ParseError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {}", self.line, self.column, self.message)?;
        match &self.expected {
            Some(expected) => write!(f, "; expected {expected}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for ParseError {}

/// Reads and verifies IR. Spans of what is read are places in `text`, in `file`.
///
/// # Errors
/// The first place where the text is not IR, or the first part of it that is not well-formed.
pub fn parse(file: FileId, text: &str) -> Result<Parsed, ParseError> {
    read(file, text).map_err(|wrong| {
        let mut sources = SourceMap::default();
        sources.add("", text);
        let in_text = Span {
            file: FileId(0),
            ..wrong.span
        };
        let (line, column) = sources.line_column(in_text);
        ParseError {
            span: wrong.span,
            line,
            column,
            message: wrong.message,
            expected: wrong.expected,
        }
    })
}

fn read(file: FileId, text: &str) -> Result<Parsed, Wrong> {
    if text.len() > MAX_SOURCE_BYTES {
        let wrong = Wrong::new(Span::new(file, 0..0), "the text is too large");
        return Err(wrong.expected(format!("at most {MAX_SOURCE_BYTES} bytes")));
    }
    let tokens = lex::tokens(text)
        .map_err(|bad| Wrong::new(Span::new(file, bad.at), bad.message).expected(bad.expected))?;
    let mut parser = Parser {
        file,
        tokens,
        at: 0,
        parsed: Parsed::default(),
        structs: BTreeMap::new(),
        functions: BTreeMap::new(),
        closures: BTreeMap::new(),
    };
    while *parser.peek() != Token::End {
        parser.item()?;
    }
    let parsed = parser.parsed;
    let well_formed = verify::module(&parsed.module).and_then(|()| {
        let mut materials = parsed.materials.iter();
        materials.try_for_each(|m| verify::material(&parsed.module, m))
    });
    match well_formed {
        Ok(()) => Ok(parsed),
        Err(problem) => Err(Wrong::new(problem.span, problem.message)),
    }
}

/// An error before its line is known.
struct Wrong {
    span: Span,
    message: String,
    expected: Option<String>,
}

impl Wrong {
    fn new(span: Span, message: impl Into<String>) -> Self {
        Self {
            span,
            message: message.into(),
            expected: None,
        }
    }

    fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }
}

type Result<T, E = Wrong> = std::result::Result<T, E>;

struct Parser {
    file: FileId,
    /// Ends with `Token::End`.
    tokens: Vec<(Token, Range<usize>)>,
    at: usize,
    parsed: Parsed,
    structs: BTreeMap<String, StructId>,
    functions: BTreeMap<String, FunctionId>,
    closures: BTreeMap<String, ClosureDefId>,
}

impl Parser {
    // ---- Tokens ------------------------------------------------------------------------

    fn peek(&self) -> &Token {
        self.ahead(0)
    }

    fn ahead(&self, n: usize) -> &Token {
        let last = self.tokens.len() - 1;
        &self.tokens[(self.at + n).min(last)].0
    }

    fn next(&mut self) -> Token {
        let token = self.peek().clone();
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    /// The place of the next token.
    fn here(&self) -> Span {
        Span::new(self.file, self.tokens[self.at].1.clone())
    }

    /// From the start of `start` to the end of the last token.
    fn since(&self, start: Span) -> Span {
        match self.at.checked_sub(1) {
            Some(last) => start.to(Span::new(self.file, self.tokens[last].1.clone())),
            None => start,
        }
    }

    fn unexpected<T>(&self, expected: &str) -> Result<T> {
        let message = format!("unexpected {}", self.peek().describe());
        Err(Wrong::new(self.here(), message).expected(expected))
    }

    fn is(&self, punct: &str) -> bool {
        matches!(self.peek(), Token::Punct(p) if *p == punct)
    }

    fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Token::Ident(w) if w == word)
    }

    /// Passes `punct` if it is next.
    fn eat(&mut self, punct: &str) -> bool {
        let found = self.is(punct);
        self.at += usize::from(found);
        found
    }

    /// Passes `word` if it is next.
    fn eat_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, punct: &str) -> Result<()> {
        if self.eat(punct) {
            Ok(())
        } else {
            self.unexpected(&format!("`{punct}`"))
        }
    }

    fn expect_word(&mut self, word: &str) -> Result<()> {
        if self.eat_word(word) {
            Ok(())
        } else {
            self.unexpected(&format!("`{word}`"))
        }
    }

    fn name(&mut self, what: &str) -> Result<String> {
        match self.peek() {
            Token::Ident(name) => {
                let name = name.clone();
                self.at += 1;
                Ok(name)
            }
            _ => self.unexpected(what),
        }
    }

    /// An int from 0 to `most`.
    fn count(&mut self, most: u64, what: &str) -> Result<u64> {
        match self.peek() {
            Token::Int(n) if u64::try_from(*n).is_ok_and(|n| n <= most) => {
                let n = n.unsigned_abs();
                self.at += 1;
                Ok(n)
            }
            _ => self.unexpected(what),
        }
    }

    /// `item, item, ...` up to `end`, which is passed too.
    fn list<T>(
        &mut self,
        end: &str,
        mut item: impl FnMut(&mut Self) -> Result<T>,
    ) -> Result<Vec<T>> {
        let mut out = Vec::new();
        while !self.is(end) {
            out.push(item(self)?);
            if !self.eat(",") {
                break;
            }
        }
        self.expect(end)?;
        Ok(out)
    }

    // ---- Types -------------------------------------------------------------------------

    fn ty(&mut self) -> Result<Type> {
        let at = self.here();
        let name = self.name("a type")?;
        self.type_named(&name).ok_or_else(|| {
            Wrong::new(at, format!("unknown type `{name}`"))
                .expected("bool, int, float, vec2, vec3, vec4, mat3 or a struct defined above")
        })
    }

    fn type_named(&self, name: &str) -> Option<Type> {
        Some(match name {
            "bool" => Type::Bool,
            "int" => Type::Int,
            "float" => Type::Float,
            "vec2" => Type::Vec2,
            "vec3" => Type::Vec3,
            "vec4" => Type::Vec4,
            "mat3" => Type::Mat3,
            _ => Type::Struct(*self.structs.get(name)?),
        })
    }

    /// `name: type`
    fn local(&mut self) -> Result<Local> {
        let name = self.name("a name")?;
        self.expect(":")?;
        let ty = self.ty()?;
        Ok(Local { name, ty })
    }

    /// `(name: type, ...)`, of different names.
    fn params(&mut self) -> Result<Vec<Local>> {
        self.expect("(")?;
        let mut known: Vec<String> = Vec::new();
        self.list(")", |p| {
            let at = p.here();
            let local = p.local()?;
            if known.contains(&local.name) {
                let message = format!("`{}` is there twice", local.name);
                return Err(Wrong::new(at, message).expected("another name"));
            }
            known.push(local.name.clone());
            Ok(local)
        })
    }
}
