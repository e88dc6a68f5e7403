//! Hints for common slips, most of them habits from other languages.

use super::error::{Expected, SyntaxError, Want};
use super::report::Source;
use crate::diag::foreign::{self, Use};
use crate::diag::nearest;
use crate::lexer::Token;

/// What to try instead of what stands at token `at`.
pub(super) fn hint(source: &Source<'_>, at: usize, error: &SyntaxError) -> Option<String> {
    let slip = Slip {
        source,
        at,
        expected: error.expected,
        found: error.found?,
    };
    let rules = [
        Slip::definition,
        Slip::foreign_word,
        Slip::foreign_operator,
        Slip::declaration,
        Slip::foreign_statement,
        Slip::foreign_module,
        Slip::module_path,
        Slip::loop_range,
        Slip::assignment,
        Slip::bracket,
        Slip::reserved_name,
    ];
    rules.iter().find_map(|rule| rule(&slip))
}

struct Slip<'s, 't> {
    source: &'s Source<'t>,
    at: usize,
    expected: Expected,
    found: Token,
}

impl<'t> Slip<'_, 't> {
    fn expects(&self, token: Token) -> bool {
        self.expected.has(Expected::token(token))
    }

    fn wants(&self, want: Want) -> bool {
        self.expected.has(Expected::want(want))
    }

    /// The kind of the token `back` tokens before the one found.
    fn before(&self, back: usize) -> Option<Token> {
        self.source.token(self.at.checked_sub(back)?)
    }

    /// The text of that token.
    fn text_before(&self, back: usize) -> &'t str {
        let index = self.at.checked_sub(back);
        index.map_or("", |index| self.source.slice(index))
    }

    fn text(&self) -> &'t str {
        self.source.slice(self.at)
    }

    /// The first token of the statement that the one found is in.
    fn statement_start(&self) -> usize {
        self.source.statement_start(self.at)
    }

    /// Something else where a definition is expected.
    fn definition(&self) -> Option<String> {
        if !(self.expects(Token::Material) && self.expects(Token::Struct)) {
            return None;
        }
        if self.found == Token::Semicolon {
            return Some("no `;` follows a definition in braces; remove it".to_owned());
        }
        let keywords = [
            "material", "bsdf", "delta", "edf", "fn", "struct", "const", "private", "use",
        ];
        if let Some(hint) = foreign::hint(self.text(), &[Use::Definition]) {
            return Some(hint);
        }
        let hint = match self.text() {
            "func" | "function" | "def" | "fun" | "float" | "vec3" => {
                "functions are written `fn name(a: float) -> float { ... }`"
            }
            "import" | "include" | "from" | "using" | "require" => {
                "imports are written `use std::bsdf::diffuse;`"
            }
            "class" | "type" | "record" => "structs are written `struct Name { a: float, }`",
            "brdf" | "btdf" | "lobe" => "scattering functions are written `bsdf name(...) { ... }`",
            "let" | "var" | "define" | "constexpr" => {
                "at the top level, values are written `const NAME: float = 1.0;`"
            }
            "param" | "surface" | "emission" | "if" | "for" | "while" => {
                "statements belong in a material or function"
            }
            "pub" | "export" | "public" => {
                "everything in a file can be imported but what is `private`; leave it out"
            }
            "static" | "local" | "internal" | "hidden" => {
                "a definition that only this file may use is marked `private`"
            }
            other => {
                let best = nearest(other, keywords)?;
                return Some(format!("did you mean `{best}`?"));
            }
        };
        Some(hint.to_owned())
    }

    /// A word that other languages use between or before operands.
    fn foreign_word(&self) -> Option<String> {
        let written = match (self.text(), self.text_before(1)) {
            ("and", _) => "`and` is written `&&`",
            ("or", _) => "`or` is written `||`",
            ("xor", _) => "`xor` is written `^` for ints and `!=` for bools",
            ("is", _) => "equality is written `==`",
            ("mod", _) => "the remainder is written `a % b`, or `mod(a, b)`",
            (_, "not") => "`not` is written `!`",
            (_, "mut") => "variables are written `var name = value;`",
            _ => return None,
        };
        (self.found == Token::Ident || self.text_before(1) == "not").then(|| written.to_owned())
    }

    /// An operator that does not exist, which was read as two.
    fn foreign_operator(&self) -> Option<String> {
        let joined = self.source.adjacent(self.at.checked_sub(1)?, self.at);
        let name = self.text_before(3);
        match (self.before(1)?, self.found) {
            (Token::Star, Token::Star) if joined => {
                Some("powers are written `pow(a, b)`".to_owned())
            }
            (Token::Plus, Token::Plus) | (Token::Minus, Token::Minus) if joined => {
                let op = self.text();
                let name = self.text_before(2);
                Some(format!("write `{name} {op}= 1;`"))
            }
            (Token::Minus, Token::Semicolon) if self.before(2) == Some(Token::Minus) => {
                Some(format!("write `{name} -= 1;`"))
            }
            (Token::Range, Token::Assign) => {
                Some("a range leaves its upper bound out; write `low .. high + 1`".to_owned())
            }
            (Token::Assign, Token::Greater) if joined => {
                Some("a value follows `=`, and to compare, write `>=`".to_owned())
            }
            (Token::Assign, Token::Less) if joined => Some("did you mean `<=`?".to_owned()),
            (op, Token::Assign) if joined && self.wants(Want::Expression) => {
                let op = op.spelling()?;
                let place = self.text_before(2);
                Some(format!("write `{place} = {place} {op} ...`"))
            }
            (_, Token::Plus) if self.wants(Want::Expression) => {
                Some("a number has no sign `+`; leave it out".to_owned())
            }
            _ => None,
        }
    }

    /// A statement of another language.
    fn foreign_statement(&self) -> Option<String> {
        let start = self.statement_start();
        if start >= self.at || self.source.token(start) != Some(Token::Ident) {
            return None;
        }
        if let Some(hint) = foreign::hint(self.source.slice(start), &[Use::Statement]) {
            return Some(hint);
        }
        let hint = match self.source.slice(start) {
            "elif" | "elsif" | "elseif" | "elseIf" => "write `else if`",
            "switch" | "match" | "case" => "write a chain of `if` and `else if`",
            "loop" | "do" | "foreach" | "repeat" => {
                "loops are written `for i in 0 .. n { ... }` or `while condition limit n { ... }`"
            }
            "print" | "printf" | "assert" | "goto" | "yield" => "there is no such statement",
            "const" | "auto" | "val" | "mut" | "local" => "values are named by `let name = value;`",
            output @ ("surface" | "emission") if start + 1 == self.at => {
                return Some(format!("write `{output} = ...;`"));
            }
            ty if is_type(ty) && start + 1 == self.at && self.found == Token::Ident => {
                let name = self.text();
                return Some(format!("write `let {name}: {ty} = ...;`"));
            }
            _ => return None,
        };
        Some(hint.to_owned())
    }

    /// A declaration in the order of other languages, or with a part left out.
    fn declaration(&self) -> Option<String> {
        let keyword = self.source.slice(self.statement_start());
        if self.expects(Token::Arrow) {
            let hint = "a function states the type of its value, as in `fn f() -> float`";
            return Some(hint.to_owned());
        }
        if self.expects(Token::Colon) && self.found == Token::Ident && is_type(self.text_before(1))
        {
            let hint = format!("write `{}: {}`", self.text(), self.text_before(1));
            return Some(hint);
        }
        if self.expects(Token::Colon) && is_type(self.text()) {
            let hint = format!("write `{}: {}`", self.text_before(1), self.text());
            return Some(hint);
        }
        if self.expects(Token::Colon) && matches!(keyword, "param" | "const") {
            let name = self.text_before(1);
            return Some(format!("state its type, as in `{keyword} {name}: float`"));
        }
        if self.wants(Want::Type) && self.found == Token::Assign {
            return Some("state a type behind the `:`, or leave out the `:`".to_owned());
        }
        if self.expects(Token::Assign) && self.found == Token::Semicolon {
            return match keyword {
                "param" => Some("every parameter has a default, as in `= 0.5`".to_owned()),
                "let" | "var" => {
                    Some("every variable starts with a value, as in `= 0.0`".to_owned())
                }
                _ => None,
            };
        }
        if self.found == Token::LeftParen && self.before(2) == Some(Token::Material) {
            let hint = "parameters of a material are declared between its braces, with `param`";
            return Some(hint.to_owned());
        }
        None
    }

    /// `df::diffuse_reflection_bsdf()`, `use df::*;`
    fn foreign_module(&self) -> Option<String> {
        let back = match self.found {
            Token::PathSeparator => 1,
            Token::Star if self.before(1) == Some(Token::PathSeparator) => 2,
            _ => return None,
        };
        foreign::hint(self.text_before(back), &[Use::Module])
    }

    fn module_path(&self) -> Option<String> {
        if self.source.slice(self.statement_start()) != "use" {
            return None;
        }
        match self.found {
            Token::Star => Some("name what is imported, as in `use std::bsdf::{diffuse, mirror};`"),
            Token::Dot | Token::Slash | Token::Colon => Some("parts of a path are joined by `::`"),
            Token::Str => Some("modules are named without quotes, as in `use paints::gloss;`"),
            Token::Semicolon if self.expects(Token::PathSeparator) => {
                Some("name the module and what is imported, as in `use std::bsdf::diffuse;`")
            }
            _ => None,
        }
        .map(str::to_owned)
    }

    fn loop_range(&self) -> Option<String> {
        if self.source.slice(self.statement_start()) != "for" {
            return None;
        }
        Some("loops are written `for i in 0 .. n { ... }`".to_owned())
    }

    fn assignment(&self) -> Option<String> {
        if self.found != Token::Assign {
            return None;
        }
        if self.wants(Want::Operator) && !self.expects(Token::Assign) {
            return Some("to compare, write `==`".to_owned());
        }
        None
    }

    fn bracket(&self) -> Option<String> {
        match (self.found, self.before(1)?) {
            (Token::LeftBracket, _) => {
                let hint = "the number of elements follows the type, as in `values: float[3]`";
                Some(hint.to_owned())
            }
            (Token::LeftParen, Token::Ident) if self.before(2) == Some(Token::Dot) => {
                let name = self.text_before(1);
                Some(format!("there are no methods; write `{name}(value)`"))
            }
            (Token::LeftBrace, Token::Ident) if self.wants(Want::Operator) => {
                let name = self.text_before(1);
                Some(format!(
                    "a struct is made by calling it: `{name}(field: value)`"
                ))
            }
            (Token::Semicolon, _) if self.expects(Token::Comma) => {
                Some("entries of a list are separated by `,`".to_owned())
            }
            _ => None,
        }
    }

    /// A keyword where a name or statement is expected.
    fn reserved_name(&self) -> Option<String> {
        use Token::*;
        match self.found {
            Else => Some("`else` follows the closing brace of an `if`".to_owned()),
            Private | Material | Fn | Struct | Const | Use | Bsdf | Edf | Delta
                if self.expects(Let) =>
            {
                Some("definitions stand at the top level of a file".to_owned())
            }
            When => Some("`when` follows a value, as in `= value when condition;`".to_owned()),
            found if found.is_keyword() && self.wants(Want::Name) => {
                let word = self.text();
                Some(format!(
                    "`{word}` is a keyword; choose another name, such as `{word}_`"
                ))
            }
            _ => None,
        }
    }
}

fn is_type(word: &str) -> bool {
    matches!(
        word,
        "bool"
            | "int"
            | "float"
            | "length"
            | "angle"
            | "vec2"
            | "vec3"
            | "vec4"
            | "point"
            | "vector"
            | "normal"
            | "color"
            | "mat2"
            | "uint"
            | "mat3"
            | "texture"
    )
}
