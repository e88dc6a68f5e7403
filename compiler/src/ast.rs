//! The syntax tree: what the parser makes of a source text, before any name is resolved.
//!
//! Every node carries its span. Trees are at most as deep as the parser's stated nesting
//! limit, so walking (and dropping) one by recursion is safe.

use crate::source::{Span, Spanned};

/// An identifier with its place.
pub type Name = Spanned<String>;

/// One source file.
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// Lines of the `//!` comment, without the marker.
    pub docs: Vec<String>,
    /// `use` declarations.
    pub uses: Vec<Use>,
    /// Everything the file defines.
    pub items: Vec<Item>,
    /// What it asserts of that; `impasto test` runs them.
    pub tests: Vec<Test>,
}

/// `test "a title" { statements }`: it defines nothing, and nothing can name it.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Its title, without quotes.
    pub title: Name,
    /// Statements, [`StmtKind::Assert`] among them.
    pub body: Block,
    /// The whole test, without docs.
    pub span: Span,
}

/// `use std::noise::{flakes, perlin as noise};`
#[derive(Clone, Debug, PartialEq)]
pub struct Use {
    /// `std`, `noise`: all segments before the imported names.
    pub path: Vec<Name>,
    /// What is imported.
    pub names: Vec<UseName>,
    /// The whole declaration.
    pub span: Span,
}

/// One imported name.
#[derive(Clone, Debug, PartialEq)]
pub struct UseName {
    /// The name in the module it comes from.
    pub name: Name,
    /// The name here, when `as` renames it.
    pub alias: Option<Name>,
}

/// A top-level definition.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Lines of the `///` comment, without the marker.
    pub docs: Vec<String>,
    /// Its name.
    pub name: Name,
    /// Is it marked `private`, so that other files cannot import it?
    pub private: bool,
    /// What it is.
    pub kind: ItemKind,
    /// The whole definition, without docs.
    pub span: Span,
}

/// The kinds of definitions.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `material name { ... }`
    Material(Material),
    /// `bsdf name(...) { ... }`, `delta bsdf name(...) { ... }` or `edf name(...) { ... }`
    Closure(ClosureDef),
    /// `fn name(...) -> type { ... }`
    Function(Function),
    /// `struct name { field: type, ... }`
    Struct(Vec<Field>),
    /// `const name: type = expr;`
    Const(Const),
}

/// The body of a material: parameters, statements and outputs in source order.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// `param` declarations.
    pub params: Vec<MaterialParam>,
    /// Statements; an assignment to an output (`surface = ...;`) or to all of them
    /// (`material = ...;`, whose place is the name `material`) is a [`StmtKind::Assign`].
    pub body: Vec<Stmt>,
}

/// `/// docs` `param name: type = default in low .. high { key: value, ... };`
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialParam {
    /// Lines of the doc comment.
    pub docs: Vec<String>,
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: TypeName,
    /// The default value.
    pub default: Expr,
    /// Least and greatest allowed value, both included.
    pub range: Option<(Expr, Expr)>,
    /// What a user interface may want to know of it, in source order.
    pub metadata: Vec<Entry>,
    /// The whole declaration, without docs.
    pub span: Span,
}

/// An entry of a parameter's metadata: `label: "IOR"`, `soft: 1.2 .. 2.0` or `unit: mm`
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What is told.
    pub key: Name,
    /// The value, or the lower end of a range. A unit is a [`ExprKind::Name`].
    pub value: Expr,
    /// The upper end of a range.
    pub high: Option<Expr>,
}

/// Which closure a definition makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosureKind {
    /// A scattering function with a density.
    Bsdf,
    /// A scattering function of discrete directions; `eval` and `pdf` are masses.
    DeltaBsdf,
    /// An emission distribution.
    Edf,
}

/// A `bsdf` or `edf`.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosureDef {
    /// Bsdf, delta bsdf or edf.
    pub kind: ClosureKind,
    /// Parameters.
    pub params: Vec<Param>,
    /// `let`s that all methods share; they see the parameters only.
    pub lets: Vec<Stmt>,
    /// `eval`, `sample`, `pdf`, `albedo` or `emit`.
    pub methods: Vec<Method>,
}

/// One method of a closure definition, such as `pdf(wo, wi) = ...;`
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// Its name.
    pub name: Name,
    /// Names of the arguments; their types follow from the method.
    pub args: Vec<Name>,
    /// Its body.
    pub body: Body,
    /// The whole definition.
    pub span: Span,
}

/// A function.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Parameters.
    pub params: Vec<Param>,
    /// Type of the value.
    pub result: TypeName,
    /// Its body.
    pub body: Body,
}

/// A parameter of a function or closure: `name: type = default`
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: TypeName,
    /// Its default.
    pub default: Option<Expr>,
}

/// A field of a struct.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Lines of the doc comment.
    pub docs: Vec<String>,
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: TypeName,
}

/// A named constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Const {
    /// Its type.
    pub ty: TypeName,
    /// Its value.
    pub value: Expr,
}

/// A type as written.
#[derive(Clone, Debug, PartialEq)]
pub struct TypeName {
    /// Its text without spaces: `color`, `color[5]`, `color[]`.
    pub node: String,
    /// Where it is written.
    pub span: Span,
    /// What it is an array of.
    pub array: Option<Box<ArrayType>>,
}

/// `element[count]`
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayType {
    /// The type of the elements.
    pub element: Name,
    /// How many there are, a constant; any number where it is left out.
    pub count: Option<Expr>,
}

/// A function body: `= expr when condition;` or a block whose last expression is the value.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// `= value when condition;` (zero where the condition does not hold)
    Expr {
        /// The value.
        value: Expr,
        /// Where the value is not zero.
        when: Option<Expr>,
    },
    /// `{ ... }`
    Block(Block),
}

/// `{ statements; value }`
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Statements in order.
    pub stmts: Vec<Stmt>,
    /// The last expression, without a semicolon.
    pub value: Option<Box<Expr>>,
    /// From brace to brace.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub struct Stmt {
    /// What it is.
    pub kind: StmtKind,
    /// The whole statement.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Clone, Debug, PartialEq)]
pub enum StmtKind {
    /// `let name: type = value;` or, mutable, `var name: type = value;`
    Let {
        /// Is it `var`?
        mutable: bool,
        /// Its name.
        name: Name,
        /// Its type, when written.
        ty: Option<TypeName>,
        /// Its value.
        value: Expr,
    },
    /// `place = value;`, also `+=`, `-=`, `*=`, `/=`
    Assign {
        /// A variable, an element or component of one (`a[0]`, `v.x`), or an output of a material.
        place: Expr,
        /// The operator of a compound assignment.
        op: Option<BinaryOp>,
        /// The value.
        value: Expr,
    },
    /// `if cond { ... } else { ... }` whose value is not used
    If(IfExpr),
    /// `for name in low .. high { ... }`
    For {
        /// The loop variable, an int.
        name: Name,
        /// First value.
        low: Expr,
        /// One past the last value.
        high: Expr,
        /// What is repeated.
        body: Block,
    },
    /// `while cond limit N { ... }`
    While {
        /// Goes on while this holds.
        cond: Expr,
        /// At most so many times; absent when the author forgot it (an error for the checker).
        limit: Option<Expr>,
        /// What is repeated.
        body: Block,
    },
    /// `break;`
    Break,
    /// `continue;`
    Continue,
    /// `assert condition;`, in a test
    Assert(Expr),
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// The whole expression.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// `true`, `false`
    Bool(bool),
    /// `12`, `0xff8800`
    Int(i64),
    /// `12u`, `0xffu`
    Uint(u32),
    /// `1.5`, `2e-3`
    Float(f64),
    /// `0.6 mm`, `30 deg`: a number and its unit
    Quantity(f64, Spanned<Unit>),
    /// `"wood.png"`
    Str(String),
    /// `name`
    Name(String),
    /// `f(a, b: c)`
    Call {
        /// What is called; only a name can be.
        callee: Name,
        /// Arguments in source order.
        args: Vec<Arg>,
    },
    /// `value.field`: a field of a struct, or a swizzle
    Field(Box<Expr>, Name),
    /// `[a, b, c]`
    Array(Vec<Expr>),
    /// `values[index]`
    Index(Box<Expr>, Box<Expr>),
    /// `-a`, `!a`
    Unary(UnaryOp, Box<Expr>),
    /// `a + b`
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `if cond { a } else { b }`
    If(Box<IfExpr>),
    /// `{ let a = ...; a * a }`
    Block(Box<Block>),
    /// A place where the parser recovered; the error is already reported.
    Error,
}

/// An argument of a call, named or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Arg {
    /// The parameter's name, when given.
    pub name: Option<Name>,
    /// The value.
    pub value: Expr,
}

/// `if cond { ... } else { ... }`; `else if` is an else block whose only content is an `if`.
#[derive(Clone, Debug, PartialEq)]
pub struct IfExpr {
    /// The condition.
    pub cond: Expr,
    /// Taken when it holds.
    pub then: Block,
    /// Taken when it does not.
    pub otherwise: Option<Block>,
}

/// Prefix operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `!`
    Not,
}

/// Infix operators, loosest first: `||`, `&&`, comparisons, `|`, `^`, `&`, shifts, sums, products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BinaryOp {
    Or,
    And,
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
    BitOr,
    BitXor,
    BitAnd,
    Shl,
    Shr,
    Add,
    Sub,
    Mul,
    Div,
    Rem,
}

impl BinaryOp {
    /// The operator as written.
    pub fn symbol(self) -> &'static str {
        use BinaryOp::*;
        match self {
            Or => "||",
            And => "&&",
            Eq => "==",
            Ne => "!=",
            Lt => "<",
            Le => "<=",
            Gt => ">",
            Ge => ">=",
            BitOr => "|",
            BitXor => "^",
            BitAnd => "&",
            Shl => "<<",
            Shr => ">>",
            Add => "+",
            Sub => "-",
            Mul => "*",
            Div => "/",
            Rem => "%",
        }
    }
}

/// Units of lengths (in metres) and angles (in radians).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Unit {
    Nanometre,
    Micrometre,
    Millimetre,
    Centimetre,
    Metre,
    Kilometre,
    Degree,
    Radian,
}

impl Unit {
    /// Every unit with its spelling and its size in metres or radians.
    pub const ALL: [(Unit, &'static str, f64); 8] = [
        (Unit::Nanometre, "nm", 1e-9),
        (Unit::Micrometre, "um", 1e-6),
        (Unit::Millimetre, "mm", 1e-3),
        (Unit::Centimetre, "cm", 1e-2),
        (Unit::Metre, "m", 1.0),
        (Unit::Kilometre, "km", 1e3),
        (Unit::Degree, "deg", std::f64::consts::PI / 180.0),
        (Unit::Radian, "rad", 1.0),
    ];

    /// The unit spelled `name`.
    pub fn from_name(name: &str) -> Option<Unit> {
        Self::ALL
            .iter()
            .find(|(_, n, _)| *n == name)
            .map(|(u, _, _)| *u)
    }

    /// The unit's spelling.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(u, _, _)| *u == self)
            .map_or("", |(_, n, _)| n)
    }

    /// The unit's size in metres or radians.
    pub fn scale(self) -> f64 {
        Self::ALL
            .iter()
            .find(|(u, _, _)| *u == self)
            .map_or(1.0, |(_, _, s)| *s)
    }

    /// Is it a unit of angle?
    pub fn is_angle(self) -> bool {
        matches!(self, Unit::Degree | Unit::Radian)
    }
}
