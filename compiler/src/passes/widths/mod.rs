//! Puts derivatives in the place of `filter_width(x)`.
//!
//! A ray sees a small patch of the surface. The runtime says how large: along two directions on the
//! surface, across each other, it gives how position and texture coordinates change from one
//! side of the patch to the other (fields `footprint_*` of `SurfacePoint`). How another value changes
//! follows from the chain rule, value by value in the order of evaluation: forward
//! differentiation (Wengert 1964), with two tangents beside every value and variable that a
//! width depends on. Rules of operations are a column of the op table ([`Op::tangent`]); the width of x is
//! sqrt(dx^2 + dy^2) by component, as OSL's `filterwidth`: for what is linear over the
//! patch it does not depend on how the two directions lie.
//!
//! Directions (normals, tangents) are taken as constant over the patch, and so is what a parameter
//! says. Calls with arguments that vary are put in line first, so that derivatives exist only of what a
//! width needs: an absent tangent is a zero that costs nothing.

mod calls;
mod slice;

use crate::abi::{Input, Tangents};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::ops::{Op, Rule, STEEPEST, Tangent};
use crate::ir::{Block, Const, ExprId, ExprKind, Function, LocalId, Material, Module, Stmt, Type};
use crate::source::Span;
use slice::Slice;

/// Expressions that calls put in line may add to one material.
const MAX_GROWTH: usize = 50_000;

/// Computes every width in a material's body, whose first parameter is the surface point. Expressions
/// keep their numbers, since closures refer to them.
pub fn widths(
    module: &Module,
    material: &mut Material,
    _: &[Option<Const>],
) -> Result<bool, Diagnostic> {
    let asks = asks(&material.body);
    if asks {
        compute(module, &mut material.body).map_err(|call| too_large(material, call))?;
    }
    Ok(asks)
}

/// A material whose widths depend on too much.
fn too_large(material: &Material, call: Span) -> Diagnostic {
    let message = format!(
        "what the widths of `{}` depend on grows too large",
        material.name
    );
    Diagnostic::new(Code::TooLarge, call, message)
        .expected("`filter_width` of what takes few operations")
        .hint("ask for the width of the coordinate, and pass it to the function as an argument")
}

/// Computes every width in a body; an error is the call by which it grows too large.
fn compute(module: &Module, body: &mut Function) -> Result<(), Span> {
    let mut room = MAX_GROWTH;
    loop {
        let slice = Slice::of(module, body);
        let calls = calls::in_slice(body, &slice);
        let Some(first) = calls.first() else {
            differentiate(module, body, &slice);
            return Ok(());
        };
        match room.checked_sub(calls::growth(module, body, &calls)) {
            Some(left) => room = left,
            None => return Err(body.expr(*first).span),
        }
        calls::put_in_line(module, body, &slice);
    }
}

/// Does a function ask for a width?
fn asks(f: &Function) -> bool {
    let mut evaluated = f.evaluated().into_iter();
    evaluated.any(|id| argument(f, id).is_some())
}

/// What an expression asks the width of, if it does.
fn argument(f: &Function, id: ExprId) -> Option<ExprId> {
    match &f.expr(id).kind {
        ExprKind::Op(Op::FilterWidth, args) => args.first().copied(),
        _ => None,
    }
}

/// How a field of the surface point varies over the footprint, by numbers of fields.
enum Varies {
    /// As two fields say.
    As([usize; 2]),
    /// As a matrix maps what two fields say.
    Mapped(usize, [usize; 2]),
}

/// How an expression varies that is a field of the surface point, if it does and what says so is there.
fn input(module: &Module, f: &Function, base: ExprId, field: u32) -> Option<Varies> {
    let (ExprKind::Param(0), Type::Struct(id)) = (&f.expr(base).kind, f.ty(base)) else {
        return None;
    };
    let fields = &module.structs[id.index()].fields;
    let number = |name: &str| fields.iter().position(|(n, _)| n == name);
    let both = |[x, y]: [&str; 2]| Some([number(x)?, number(y)?]);
    match Input::of_field(&fields.get(field as usize)?.0)?.tangents() {
        Tangents::None => None,
        Tangents::Fields(names) => Some(Varies::As(both(names)?)),
        Tangents::Mapped(matrix, names) => Some(Varies::Mapped(number(matrix)?, both(names)?)),
    }
}

/// Adds tangents to what a slice has, and computes the widths.
fn differentiate(module: &Module, f: &mut Function, slice: &Slice) {
    let (body, value) = (std::mem::take(&mut f.body), f.value);
    let mut walk = Walk {
        module,
        slice,
        tangents: vec![[None; 2]; f.exprs.len()],
        locals: vec![None; f.locals.len()],
        b: Builder::resume(f.clone()),
    };
    for (index, varies) in slice.locals.iter().enumerate() {
        if *varies {
            let local = walk.b.function().locals[index].clone();
            let duals =
                ["dx", "dy"].map(|d| walk.b.local(&format!("{}_{d}", local.name), local.ty));
            walk.locals[index] = Some(duals);
        }
    }
    walk.block(body);
    *f = walk.b.finish(value);
}

struct Walk<'a> {
    module: &'a Module,
    slice: &'a Slice,
    /// The function; its body is built anew.
    b: Builder,
    /// Of each expression, along both directions.
    tangents: Vec<[Tangent; 2]>,
    /// The variables that hold the tangents of variables.
    locals: Vec<Option<[LocalId; 2]>>,
}

impl Walk<'_> {
    fn block(&mut self, block: Block) {
        for stmt in block {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: Stmt) {
        match stmt {
            Stmt::Eval(id) => self.eval(id),
            Stmt::Store(local, part, value) => {
                self.b.stmt(Stmt::Store(local, part, value));
                for axis in 0..self.locals[local.index()].map_or(0, |duals| duals.len()) {
                    self.store_tangent(local, part, value, axis);
                }
            }
            Stmt::Break | Stmt::Continue => self.b.stmt(stmt),
            branching => {
                let branching = branching.map_blocks(|block| {
                    self.b.open();
                    self.block(block);
                    self.b.close()
                });
                self.b.stmt(branching);
            }
        }
    }

    fn store_tangent(&mut self, local: LocalId, part: Option<u8>, value: ExprId, axis: usize) {
        let Some(duals) = self.locals[local.index()] else {
            return;
        };
        let ty = self.b.ty(value);
        let span = self.b.function().expr(value).span;
        let tangent = self.tangents[value.index()][axis];
        let tangent = tangent.unwrap_or_else(|| self.b.zero(self.module, ty, span));
        self.b.stmt(Stmt::Store(duals[axis], part, tangent));
    }

    fn eval(&mut self, id: ExprId) {
        let caller = self.b.set_via(self.b.function().expr(id).via);
        match argument(self.b.function(), id) {
            Some(x) => self.width(id, self.tangents[x.index()]),
            None => {
                self.b.stmt(Stmt::Eval(id));
                if self.slice.exprs[id.index()] {
                    self.tangents[id.index()] = [0, 1].map(|axis| self.tangent(id, axis));
                }
            }
        }
        self.b.set_via(caller);
    }

    /// Lets the expression `id` be the width of what has these tangents.
    fn width(&mut self, id: ExprId, tangents: [Tangent; 2]) {
        let span = self.b.function().expr(id).span;
        let size = match tangents {
            [None, None] => {
                let width = self.b.ty(id).width().unwrap_or(1);
                let zero = ExprKind::Const(Const::Float(vec![0.0; width]));
                return self.b.redefine(id, zero);
            }
            [Some(one), None] | [None, Some(one)] => self.b.op(Op::Abs, &[one], span),
            [Some(x), Some(y)] => {
                let [xx, yy] = [x, y].map(|d| self.b.op(Op::Mul, &[d, d], span));
                let sum = self.b.op(Op::Add, &[xx, yy], span);
                self.b.op(Op::Sqrt, &[sum], span)
            }
        };
        let most = self.b.float(STEEPEST, span);
        let kind = ExprKind::Op(Op::Min, vec![size, most]);
        self.b.redefine(id, kind);
        self.b.stmt(Stmt::Eval(id));
    }

    /// The tangent of an expression that was just evaluated.
    fn tangent(&mut self, id: ExprId, axis: usize) -> Tangent {
        let expr = self.b.function().expr(id);
        let (kind, ty, span) = (expr.kind.clone(), expr.ty, expr.span);
        match kind {
            ExprKind::Op(op, args) => self.of_operation(id, op, &args, axis),
            ExprKind::Load(local) => {
                let dual = self.locals[local.index()]?[axis];
                Some(self.b.load(dual, span))
            }
            ExprKind::Field(base, field) => {
                if let Some(varies) = input(self.module, self.b.function(), base, field) {
                    return Some(self.of_input(base, &varies, axis, span));
                }
                let base = self.tangents[base.index()][axis]?;
                Some(self.b.field(self.module, base, field as usize, span))
            }
            ExprKind::Swizzle(value, components) => {
                let value = self.tangents[value.index()][axis]?;
                Some(self.b.swizzle(value, &components, span))
            }
            ExprKind::Compose(parts) => {
                let parts = self.of_parts(&parts, axis)?;
                Some(self.b.compose(ty, &parts, span))
            }
            ExprKind::Make(structure, fields) => {
                let fields = self.of_parts(&fields, axis)?;
                Some(self.b.make(structure, &fields, span))
            }
            ExprKind::Const(_)
            | ExprKind::Param(_)
            | ExprKind::MaterialParam(_)
            | ExprKind::TableValue(_)
            | ExprKind::Call(..) => None,
        }
    }

    fn of_input(&mut self, point: ExprId, varies: &Varies, axis: usize, span: Span) -> ExprId {
        match *varies {
            Varies::As(fields) => self.b.field(self.module, point, fields[axis], span),
            Varies::Mapped(matrix, fields) => {
                let matrix = self.b.field(self.module, point, matrix, span);
                let change = self.b.field(self.module, point, fields[axis], span);
                self.b.op(Op::MatVec, &[matrix, change], span)
            }
        }
    }

    fn of_operation(&mut self, id: ExprId, op: Op, args: &[ExprId], axis: usize) -> Tangent {
        let mut tangents: Vec<Tangent> = args
            .iter()
            .map(|a| self.tangents[a.index()][axis])
            .collect();
        let span = self.b.function().expr(id).span;
        if op == Op::Select && tangents.iter().any(Option::is_some) {
            for (tangent, arg) in tangents.iter_mut().zip(args).skip(1) {
                let ty = self.b.ty(*arg);
                tangent.get_or_insert_with(|| self.b.zero(self.module, ty, span));
            }
        }
        Op::tangent(Rule {
            b: &mut self.b,
            op,
            args,
            value: id,
            tangents: &tangents,
            span,
        })
    }

    /// The tangents of parts, zeros where they are absent; none if all are.
    fn of_parts(&mut self, parts: &[ExprId], axis: usize) -> Option<Vec<ExprId>> {
        let tangents = parts.iter().map(|p| self.tangents[p.index()][axis]);
        let tangents: Vec<Tangent> = tangents.collect();
        tangents.iter().any(Option::is_some).then(|| {
            let pairs = parts.iter().zip(tangents);
            pairs
                .map(|(part, tangent)| {
                    let (ty, span) = (self.b.ty(*part), self.b.function().expr(*part).span);
                    tangent.unwrap_or_else(|| self.b.zero(self.module, ty, span))
                })
                .collect()
        })
    }
}
