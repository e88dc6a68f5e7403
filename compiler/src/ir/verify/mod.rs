//! Checks that IR is well-formed: everything that is referred to is there, types fit, every value
//! is computed before it is used, and nothing calls itself.
//!
//! Run after lowering and after every pass in debug builds, where a failure is a compiler defect,
//! and over IR that was read as text. It accepts no IR that anything after it would panic on.

use std::fmt;

use super::{
    Block, Const, ExprId, ExprKind, Function, FunctionId, LocalId, Module, Stmt, StructId, Type,
    print,
};
use crate::source::Span;

mod items;

pub use items::{MAX_FIELDS, material, module};

/// What is wrong with a piece of IR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The nearest place that is known.
    pub span: Span,
    /// What is wrong, with the name of the function or material it is in.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Problem {}

/// What is wrong with `f`, a function over `module`, if anything.
///
/// # Errors
/// The first problem in the order of evaluation.
pub fn function(module: &Module, f: &Function) -> Result<(), Problem> {
    check(module, f).map(|_| ())
}

/// What is wrong with `f` as hoisting leaves it, if anything: it reads values of a table of the
/// types `table`, and no parameter of its material.
///
/// # Errors
/// The first problem.
pub fn hoisted(module: &Module, f: &Function, table: &[Type]) -> Result<(), Problem> {
    function(module, f)?;
    let wrong = f.exprs.iter().find_map(|e| match e.kind {
        ExprKind::MaterialParam(i) => Some((e, format!("reads ${i} of its material"))),
        ExprKind::TableValue(i) if table.get(i as usize) != Some(&e.ty) => Some((
            e,
            format!("there is no value #{i} of its type in the table"),
        )),
        _ => None,
    });
    wrong.map_or(Ok(()), |(e, message)| {
        Err(Problem {
            span: e.span,
            message: format!("{}: {message}", f.name),
        })
    })
}

/// Checks a function; gives which expressions are available at its end.
fn check(module: &Module, f: &Function) -> Result<Vec<bool>, Problem> {
    let mut v = Verifier::new(module, f);
    v.whole().map_err(|message| Problem {
        span: v.at,
        message: format!("{}: {message}", f.name),
    })?;
    Ok(v.ready)
}

struct Verifier<'a> {
    module: &'a Module,
    f: &'a Function,
    /// Which expressions are available at this place.
    ready: Vec<bool>,
    /// Which expressions some statement evaluates.
    evaluated: Vec<bool>,
    /// What became available, in that order, to take it back at the end of a block.
    trail: Vec<ExprId>,
    /// For each variable: is it the counter of a loop, and is that loop around this place?
    counters: Vec<Option<bool>>,
    loops: usize,
    /// The place that a problem is reported at.
    at: Span,
}

type Checked<T = ()> = Result<T, String>;

impl<'a> Verifier<'a> {
    fn new(module: &'a Module, f: &'a Function) -> Self {
        let mut counters = vec![None; f.locals.len()];
        find_counters(&f.body, &mut counters);
        Self {
            module,
            f,
            ready: f.exprs.iter().map(|e| e.kind.is_free()).collect(),
            evaluated: vec![false; f.exprs.len()],
            trail: Vec::new(),
            counters,
            loops: 0,
            at: f.span,
        }
    }

    fn whole(&mut self) -> Checked {
        let f = self.f;
        let variables = f.params.iter().chain(&f.locals).map(|l| l.ty);
        let mut types = variables.chain([f.result]);
        types.try_for_each(|ty| self.known(ty))?;
        for e in f.exprs.iter().filter(|e| e.kind.is_free()) {
            self.at = e.span;
            self.free(&e.kind, e.ty)?;
        }
        self.at = f.span;
        if f.reads_material_params() && f.reads_table() {
            return Err(
                "reads both parameters of the material and what hoisting made of them".into(),
            );
        }
        self.block(&f.body)?;
        self.at = f.span;
        self.used(f.value)?;
        self.expect(f.value, f.result)
    }

    // ---- Statements --------------------------------------------------------------------

    /// Checks a block; what it computes is not visible after it.
    fn scoped(&mut self, block: &Block) -> Checked {
        let before = self.trail.len();
        self.block(block)?;
        self.forget(before);
        Ok(())
    }

    fn forget(&mut self, before: usize) {
        for id in self.trail.drain(before..) {
            self.ready[id.index()] = false;
        }
    }

    fn block(&mut self, block: &Block) -> Checked {
        block.iter().try_for_each(|s| self.stmt(s))
    }

    fn stmt(&mut self, stmt: &Stmt) -> Checked {
        match stmt {
            Stmt::Eval(id) => self.eval(*id),
            Stmt::Store(local, part, value) => self.store(*local, *part, *value),
            Stmt::If(cond, then, otherwise) => {
                self.used(*cond)?;
                self.expect(*cond, Type::Bool)?;
                self.scoped(then)?;
                self.scoped(otherwise)
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => self.for_loop(*local, [*low, *high], body),
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => self.while_loop(head, *test, *limit, body),
            Stmt::Break | Stmt::Continue if self.loops == 0 => {
                Err("a jump outside of loops, or in the head of one".into())
            }
            Stmt::Break | Stmt::Continue => Ok(()),
        }
    }

    fn eval(&mut self, id: ExprId) -> Checked {
        let Some(e) = self.f.exprs.get(id.index()) else {
            return Err(format!("there is no expression {}", id.0));
        };
        self.at = e.span;
        if e.kind.is_free() || std::mem::replace(&mut self.evaluated[id.index()], true) {
            return Err(format!("{} is evaluated twice", self.text(id)));
        }
        self.expr(id)?;
        self.ready[id.index()] = true;
        self.trail.push(id);
        Ok(())
    }

    fn store(&mut self, local: LocalId, part: Option<u8>, value: ExprId) -> Checked {
        let ty = self.variable(local)?;
        if self.counters[local.index()].is_some() {
            return Err(format!("the counter @{} is assigned", local.0));
        }
        self.used(value)?;
        let width = ty.width().unwrap_or(1);
        match part {
            None => self.expect(value, ty),
            Some(part) if width > usize::from(part) && width > 1 => self.expect(value, Type::Float),
            Some(part) => Err(format!("{ty:?} has no component {part}")),
        }
    }

    fn for_loop(&mut self, local: LocalId, bounds: [ExprId; 2], body: &Block) -> Checked {
        for bound in bounds {
            self.used(bound)?;
            self.expect(bound, Type::Int)?;
        }
        if self.variable(local)? != Type::Int {
            return Err(format!("the counter @{} is not an int", local.0));
        }
        if self.counters[local.index()] == Some(true) {
            return Err(format!("@{} counts two loops at once", local.0));
        }
        self.counters[local.index()] = Some(true);
        self.loops += 1;
        self.scoped(body)?;
        self.loops -= 1;
        self.counters[local.index()] = Some(false);
        Ok(())
    }

    fn while_loop(&mut self, head: &Block, test: ExprId, limit: u32, body: &Block) -> Checked {
        if limit == 0 {
            return Err("a loop of no turns".into());
        }
        let (before, loops) = (self.trail.len(), std::mem::take(&mut self.loops));
        self.block(head)?;
        self.used(test)?;
        self.expect(test, Type::Bool)?;
        self.loops = loops + 1;
        self.block(body)?;
        self.loops = loops;
        self.forget(before);
        Ok(())
    }

    // ---- Expressions -------------------------------------------------------------------

    /// An expression as text prints it.
    fn text(&self, id: ExprId) -> String {
        print::operand(self.module, self.f, id)
    }

    fn used(&self, id: ExprId) -> Checked {
        match self.ready.get(id.index()) {
            Some(true) => Ok(()),
            _ => Err(format!("{} is used before it is evaluated", self.text(id))),
        }
    }

    /// Has an expression that is there the type `ty`?
    fn expect(&self, id: ExprId, ty: Type) -> Checked {
        let found = self.f.ty(id);
        if found == ty {
            Ok(())
        } else {
            Err(format!("{} is {found:?}, not {ty:?}", self.text(id)))
        }
    }

    /// Is a type there?
    fn known(&self, ty: Type) -> Checked {
        match ty {
            Type::Struct(id) if id.index() >= self.module.structs.len() => {
                Err(format!("there is no struct {}", id.0))
            }
            _ => Ok(()),
        }
    }

    /// The type of a variable.
    fn variable(&self, local: LocalId) -> Checked<Type> {
        let local = self.f.locals.get(local.index()).ok_or(local);
        local
            .map(|l| l.ty)
            .map_err(|id| format!("there is no variable @{}", id.0))
    }

    fn structure(&self, id: StructId) -> Checked<&'a [(String, Type)]> {
        let structure = self.module.structs.get(id.index());
        let fields = structure.map(|s| s.fields.as_slice());
        fields.ok_or_else(|| format!("there is no struct {}", id.0))
    }

    fn callee(&self, id: FunctionId) -> Checked<&'a Function> {
        let callee = self.module.functions.get(id.index());
        callee.ok_or_else(|| format!("there is no function {}", id.0))
    }

    /// An expression that needs no evaluation.
    fn free(&self, kind: &ExprKind, ty: Type) -> Checked {
        self.known(ty)?;
        match kind {
            ExprKind::Const(c) if !is_constant_of(c, ty) => Err(format!("{c:?} is not a {ty:?}")),
            ExprKind::Param(i) if self.f.params.get(*i as usize).map(|p| p.ty) != Some(ty) => {
                Err(format!("there is no parameter {i} of type {ty:?}"))
            }
            _ => Ok(()),
        }
    }

    fn expr(&self, id: ExprId) -> Checked {
        let e = self.f.expr(id);
        self.known(e.ty)?;
        e.kind.operands().iter().try_for_each(|&a| self.used(a))?;
        let types: Vec<Type> = e.kind.operands().iter().map(|&a| self.f.ty(a)).collect();
        if self.fits(&e.kind, &types, e.ty)? {
            Ok(())
        } else {
            let id = self.text(id);
            Err(format!("{id}: operands {types:?} do not give {:?}", e.ty))
        }
    }

    /// Do operands of `types` give a value of type `ty`?
    fn fits(&self, kind: &ExprKind, types: &[Type], ty: Type) -> Checked<bool> {
        Ok(match kind {
            ExprKind::Op(op, _) => op.result(types) == Some(ty),
            ExprKind::Load(local) => {
                if self.variable(*local).is_ok() && self.counters[local.index()] == Some(false) {
                    return Err(format!("the counter @{} is read outside its loop", local.0));
                }
                self.variable(*local)? == ty
            }
            ExprKind::Call(callee, _) => {
                let callee = self.callee(*callee)?;
                let params = callee.params.iter().map(|p| p.ty);
                callee.result == ty && params.eq(types.iter().copied())
            }
            ExprKind::Make(id, _) => {
                let fields = self.structure(*id)?.iter().map(|f| f.1);
                ty == Type::Struct(*id) && fields.eq(types.iter().copied())
            }
            ExprKind::Field(_, i) => match types[0] {
                Type::Struct(id) => {
                    let field = self.structure(id)?.get(*i as usize);
                    field.map(|f| f.1) == Some(ty)
                }
                _ => false,
            },
            ExprKind::Swizzle(_, c) => {
                let width = types[0].width().unwrap_or(0);
                (1..=4).contains(&c.len())
                    && ty == Type::of_width(c.len())
                    && c.iter().all(|&c| usize::from(c) < width)
            }
            ExprKind::Compose(_) => composes(ty, types),
            ExprKind::Const(_)
            | ExprKind::Param(_)
            | ExprKind::MaterialParam(_)
            | ExprKind::TableValue(_) => false,
        })
    }
}

/// Notes the variables that count loops, as not counting now.
fn find_counters(block: &Block, counters: &mut [Option<bool>]) {
    for stmt in block {
        match stmt {
            Stmt::For { local, body, .. } => {
                if let Some(counter) = counters.get_mut(local.index()) {
                    *counter = Some(false);
                }
                find_counters(body, counters);
            }
            Stmt::If(_, a, b) => {
                find_counters(a, counters);
                find_counters(b, counters);
            }
            Stmt::While { head, body, .. } => {
                find_counters(head, counters);
                find_counters(body, counters);
            }
            Stmt::Eval(_) | Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Is `c` a constant of type `ty`, with all its floats finite?
fn is_constant_of(c: &Const, ty: Type) -> bool {
    match c {
        Const::Bool(_) => ty == Type::Bool,
        Const::Int(_) => ty == Type::Int,
        Const::Float(v) => ty.width() == Some(v.len()) && v.iter().all(|x| x.is_finite()),
    }
}

/// Can parts of types `parts` make a `ty`?
fn composes(ty: Type, parts: &[Type]) -> bool {
    if ty == Type::Mat3 {
        return parts == [Type::Vec3; 3];
    }
    let widths: Option<usize> = parts.iter().map(|p| p.width()).sum();
    ty.width()
        .is_some_and(|w| widths == Some(w) || parts == [Type::Float])
}
