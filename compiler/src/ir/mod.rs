//! The typed intermediate representation: what checking produces and everything after reads.
//!
//! A [`Module`] holds structs, functions and closure definitions. A [`Function`] is an arena of
//! pure expressions plus structured statements that say in which order they are evaluated:
//! every expression that is not a constant, a parameter or a value of the parameter table stands in exactly one
//! [`Stmt::Eval`], which dominates its uses. Surface types (color, point, length, ...) are gone;
//! what is left are the machine's types.
//!
//! A [`Material`] is a function that computes patterns, plus a tree of [`Closure`]s over its
//! expressions; [`crate::closure`] turns it into ordinary functions.

use self::ops::Op;
use crate::source::Span;

pub mod build;
mod count;
pub mod interp;
pub mod ops;
pub mod parse;
pub mod print;
pub mod surface;
pub mod value;
pub mod verify;
pub mod walk;

/// A machine type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Type {
    Bool,
    /// 32 bits, two's complement, wrapping.
    Int,
    Float,
    Vec2,
    Vec3,
    Vec4,
    /// Three columns of three floats.
    Mat3,
    Struct(StructId),
}

impl Type {
    /// Number of float components, for `Float` and vectors.
    pub fn width(self) -> Option<usize> {
        match self {
            Type::Float => Some(1),
            Type::Vec2 => Some(2),
            Type::Vec3 => Some(3),
            Type::Vec4 => Some(4),
            _ => None,
        }
    }

    /// The float or vector of `width` components.
    pub fn of_width(width: usize) -> Type {
        match width {
            1 => Type::Float,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        }
    }
}

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);

        impl $name {
            /// The position in its arena.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    /// A struct of a module.
    StructId,
    /// A function of a module.
    FunctionId,
    /// A bsdf or edf definition of a module.
    ClosureDefId,
    /// An expression of a function.
    ExprId,
    /// A variable of a function.
    LocalId,
    /// A closure of a material.
    ClosureId,
    /// A call of a function whose body stands in its caller.
    SiteId
}

/// Everything the materials of a compilation are made of.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// Struct types.
    pub structs: Vec<Struct>,
    /// Functions, callees before callers.
    pub functions: Vec<Function>,
    /// Bsdfs and edfs.
    pub closures: Vec<ClosureDef>,
    /// Paths of image files; a texture value is an index into these.
    pub textures: Vec<String>,
}

/// A struct type.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Name in the source.
    pub name: String,
    /// Names and types of its fields.
    pub fields: Vec<(String, Type)>,
    /// Where it is defined.
    pub span: Span,
}

/// A parameter or variable.
#[derive(Clone, Debug)]
pub struct Local {
    /// Name in the source.
    pub name: String,
    /// Its type.
    pub ty: Type,
}

/// A function without side effects.
#[derive(Clone, Debug)]
pub struct Function {
    /// Name in the source, or `bsdf_method`.
    pub name: String,
    /// Parameters.
    pub params: Vec<Local>,
    /// Type of the value.
    pub result: Type,
    /// Variables.
    pub locals: Vec<Local>,
    /// Expressions.
    pub exprs: Vec<Expr>,
    /// What is done.
    pub body: Block,
    /// The value returned after the body.
    pub value: ExprId,
    /// Most turns that nested loops can take together, callees included.
    pub turns: u64,
    /// Calls in whose place the callee's expressions stand.
    pub sites: Vec<CallSite>,
    /// Where it is defined.
    pub span: Span,
}

/// A call in whose place the callee's expressions stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CallSite {
    /// Where the call was written.
    pub span: Span,
    /// The call that put this one there, if it stands in a callee's body itself.
    pub via: Option<SiteId>,
}

impl Function {
    /// The expression `id`.
    pub fn expr(&self, id: ExprId) -> &Expr {
        &self.exprs[id.index()]
    }

    /// The type of the expression `id`.
    pub fn ty(&self, id: ExprId) -> Type {
        self.exprs[id.index()].ty
    }

    /// The constant that `id` is, if it is one.
    pub fn constant(&self, id: ExprId) -> Option<&Const> {
        match &self.expr(id).kind {
            ExprKind::Const(c) => Some(c),
            _ => None,
        }
    }

    /// Does it mention a parameter of its material, as functions do before hoisting?
    pub fn reads_material_params(&self) -> bool {
        let mut exprs = self.exprs.iter();
        exprs.any(|e| matches!(e.kind, ExprKind::MaterialParam(_)))
    }

    /// Does it mention a value of the parameter table, as functions do after hoisting?
    pub fn reads_table(&self) -> bool {
        let mut exprs = self.exprs.iter();
        exprs.any(|e| matches!(e.kind, ExprKind::TableValue(_)))
    }

    /// The calls that put something here, from the innermost out.
    pub fn calls_to(&self, mut via: Option<SiteId>) -> impl Iterator<Item = CallSite> {
        std::iter::from_fn(move || {
            let site = *self.sites.get(via?.index())?;
            via = site.via;
            Some(site)
        })
    }
}

/// An expression with its type and origin.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it computes.
    pub kind: ExprKind,
    /// Its type.
    pub ty: Type,
    /// Where it was written.
    pub span: Span,
    /// The call that put it here, if it was written in the body of another function.
    pub via: Option<SiteId>,
    /// The `let` that names it.
    pub name: Option<String>,
}

/// A constant value. Floats are kept in f64, so that the f64 interpreter sees what was written.
#[derive(Clone, Debug, PartialEq)]
pub enum Const {
    /// A bool.
    Bool(bool),
    /// An int.
    Int(i32),
    /// A float or vector: as many components as its type has.
    Float(Vec<f64>),
}

/// What an expression computes.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// A constant.
    Const(Const),
    /// Parameter of the function.
    Param(u32),
    /// Parameter of the material, before uniform hoisting.
    MaterialParam(u32),
    /// Value of the parameter table, after it: what the host computed from the parameters.
    TableValue(u32),
    /// The present value of a variable.
    Load(LocalId),
    /// An operation of the op table.
    Op(Op, Vec<ExprId>),
    /// A vector or matrix from parts; one float fills all components.
    Compose(Vec<ExprId>),
    /// Components of a vector, by index.
    Swizzle(ExprId, Vec<u8>),
    /// A call.
    Call(FunctionId, Vec<ExprId>),
    /// A struct from its fields.
    Make(StructId, Vec<ExprId>),
    /// A field of a struct.
    Field(ExprId, u32),
}

impl ExprKind {
    /// The expressions it reads, in order.
    pub fn operands(&self) -> &[ExprId] {
        use ExprKind::*;
        match self {
            Const(_) | Param(_) | MaterialParam(_) | TableValue(_) | Load(_) => &[],
            Op(_, args) | Compose(args) | Call(_, args) | Make(_, args) => args,
            Swizzle(arg, _) | Field(arg, _) => std::slice::from_ref(arg),
        }
    }

    /// The same, to be changed.
    pub fn operands_mut(&mut self) -> &mut [ExprId] {
        use ExprKind::*;
        match self {
            Const(_) | Param(_) | MaterialParam(_) | TableValue(_) | Load(_) => &mut [],
            Op(_, args) | Compose(args) | Call(_, args) | Make(_, args) => args,
            Swizzle(arg, _) | Field(arg, _) => std::slice::from_mut(arg),
        }
    }

    /// Is its value available without being evaluated by a statement?
    pub fn is_free(&self) -> bool {
        matches!(
            self,
            ExprKind::Const(_)
                | ExprKind::Param(_)
                | ExprKind::MaterialParam(_)
                | ExprKind::TableValue(_)
        )
    }
}

/// Statements in order.
pub type Block = Vec<Stmt>;

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub enum Stmt {
    /// Evaluates an expression here.
    Eval(ExprId),
    /// Assigns a variable, or one component of it. Variables begin as zero.
    Store(LocalId, Option<u8>, ExprId),
    /// A branch.
    If(ExprId, Block, Block),
    /// Sets the int `local` to `low`, `low + 1`, ... below `high`. Only the body reads it, and
    /// nothing else assigns it.
    For {
        /// The loop variable.
        local: LocalId,
        /// First value.
        low: ExprId,
        /// One past the last value.
        high: ExprId,
        /// What is repeated.
        body: Block,
    },
    /// Repeats `body` while `test` (evaluated anew by `head`) holds, at most `limit` times. What
    /// `head` evaluates is there in `body` too; `head` does not leave the loop otherwise.
    While {
        /// Evaluates the test.
        head: Block,
        /// Goes on while it holds.
        test: ExprId,
        /// Most turns.
        limit: u32,
        /// What is repeated.
        body: Block,
    },
    /// Leaves the innermost loop.
    Break,
    /// Goes to the next turn of the innermost loop.
    Continue,
}

/// A bsdf or edf: its methods as functions over (parameters..., directions...).
#[derive(Clone, Debug)]
pub struct ClosureDef {
    /// Name in the source.
    pub name: String,
    /// Discrete directions only.
    pub delta: bool,
    /// Parameters.
    pub params: Vec<Local>,
    /// What it defines.
    pub methods: Methods,
    /// Where it is defined.
    pub span: Span,
}

/// The methods of a closure.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Methods {
    Bsdf {
        sample: FunctionId,
        eval: FunctionId,
        pdf: FunctionId,
        albedo: FunctionId,
        /// What it lets through to what lies under it, where that is not all that it leaves.
        passes: Option<FunctionId>,
        /// What light meets below the surface, where it walks there from the direction sampled.
        walk: Option<FunctionId>,
    },
    Edf {
        emit: FunctionId,
    },
}

impl Methods {
    /// All of them.
    pub fn functions(&self) -> Vec<FunctionId> {
        match *self {
            Methods::Bsdf {
                sample,
                eval,
                pdf,
                albedo,
                passes,
                walk,
            } => [sample, eval, pdf, albedo]
                .into_iter()
                .chain(passes)
                .chain(walk)
                .collect(),
            Methods::Edf { emit } => vec![emit],
        }
    }
}

/// A node of a material's closure tree; expressions belong to the material's body.
#[derive(Clone, Debug, PartialEq)]
pub enum Closure {
    /// A bsdf or edf with its arguments.
    Lobe(Lobe),
    /// The first over the second: `f_a + p_a f_b`, p_a being what a passes, as a rule 1 - E_a.
    Layer(ClosureId, ClosureId),
    /// `(1 - t) a + t b`, t a float.
    Mix(ClosureId, ClosureId, ExprId),
    /// Weighted by a float or three floats.
    Weight(ExprId, ClosureId),
    /// The sum.
    Add(ClosureId, ClosureId),
    /// The first where the bool holds, else the second.
    Select(ExprId, ClosureId, ClosureId),
}

/// An instance of a bsdf or edf.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// Which.
    pub def: ClosureDefId,
    /// Its arguments.
    pub args: Vec<ExprId>,
    /// The normal of its frame; the surface's when absent.
    pub normal: Option<ExprId>,
    /// The tangent of its frame; the surface's when absent.
    pub tangent: Option<ExprId>,
    /// Where it was written.
    pub span: Span,
    /// The call that put it here, if it was written in the body of a function.
    pub via: Option<SiteId>,
}

/// A parameter of a material.
#[derive(Clone, Debug)]
pub struct MaterialParam {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub docs: Vec<String>,
    /// Its type as written.
    pub surface_type: &'static str,
    /// Its machine type; a texture is an `Int`.
    pub ty: Type,
    /// Its default.
    pub default: Const,
    /// Least and greatest allowed value (by component).
    pub range: Option<(f64, f64)>,
    /// It is an input that has one value everywhere (`time`, `frame`): who renders gives it, and no scene.
    pub is_input: bool,
    /// Where it is declared.
    pub span: Span,
}

/// The medium inside an object. Its expressions depend on parameters only, not on the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Where there is a medium at all, a bool; always when absent.
    pub when: Option<ExprId>,
    /// Its values, in the order of [`Interior::PARTS`].
    pub parts: [ExprId; 5],
    /// Where it was written.
    pub span: Span,
}

impl Interior {
    /// What a medium is told by: names and types, in the order in which they are written and
    /// printed.
    pub const PARTS: [(&'static str, Type); 5] = [
        ("absorption", Type::Vec3),
        ("ior", Type::Float),
        ("priority", Type::Int),
        ("scattering", Type::Vec3),
        ("anisotropy", Type::Float),
    ];

    /// Its values with their names and types.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, Type, ExprId)> {
        let parts = Self::PARTS.into_iter().zip(self.parts);
        parts.map(|((name, ty), id)| (name, ty, id))
    }
}

/// Most lobes of a material.
pub const MAX_LOBES: usize = 64;

/// A checked material, before its closures are lowered.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the source.
    pub name: String,
    /// Its documentation.
    pub docs: Vec<String>,
    /// Its parameters, in the order of [`ExprKind::MaterialParam`].
    pub params: Vec<MaterialParam>,
    /// Computes the patterns. Its parameters are `point: SurfacePoint`; its value is not used.
    pub body: Function,
    /// The closures.
    pub closures: Vec<Closure>,
    /// What scatters light.
    pub surface: Option<ClosureId>,
    /// What emits light.
    pub emission: Option<ClosureId>,
    /// What fills the objects that it covers; thin-walled without.
    pub interior: Option<Interior>,
    /// Share of the light that meets the surface at all, a float from 0 to 1; 1 when absent.
    /// The rest goes straight through: `mix(transparent(), surface, opacity)`.
    pub opacity: Option<ExprId>,
    /// Where it is defined.
    pub span: Span,
}
