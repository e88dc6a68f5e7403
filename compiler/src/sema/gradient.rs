//! `gradient(f(position, ...), step: e)`: how fast a function of a point grows, and where to.
//!
//! Central differences along the three axes: exact for polynomials of the second degree, with an
//! error that falls with the square of the step otherwise. (Four points of a tetrahedron would
//! do with fewer calls, but err with the step itself wherever the function is twisted.)

use crate::ast::{Arg, Expr, ExprKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId, FunctionId, Stmt};
use crate::source::Span;

use super::body::{Body, Operand};
use super::types::Ty;
use super::{Checked, Signature};

/// Points at which the function is called.
const POINTS: i32 = 6;

impl Body<'_, '_> {
    /// `gradient(x)` along the surface, or `gradient(f(position, ...), step: e)` in space; a vector: per metre
    /// for a float, plain for a length.
    pub fn gradient(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        if let [Arg { name: None, value }] = args {
            return self.slope(value, span);
        }
        let (call, step) = self.gradient_arguments(args, span)?;
        let step_value = self.step_of_gradient(step);
        let (f, values) = self.sampled_function(call)?;
        let callee_turns = self.cx.ir.functions[f.index()].turns;
        let turns = self.turns.saturating_mul(POINTS as u64);
        self.check_turns(turns.saturating_mul(callee_turns), span)?;
        let gradient = self.central_differences(f, &values, step_value?, span);
        Some(Operand::Value(gradient, Ty::Vector))
    }

    fn gradient_arguments<'a>(
        &mut self,
        args: &'a [Arg],
        span: Span,
    ) -> Option<(&'a Expr, &'a Expr)> {
        let usage = "`gradient(f(position), step: 1 mm)`";
        let mut unnamed = args.iter().filter(|a| a.name.is_none());
        let mut step = None;
        for arg in args {
            match &arg.name {
                Some(name) if name.node == "step" && step.is_none() => step = Some(&arg.value),
                Some(name) => {
                    let message = match step {
                        Some(_) if name.node == "step" => "`step` is given twice".to_owned(),
                        _ => format!("`gradient` has no parameter `{}`", name.node),
                    };
                    let unknown = Diagnostic::new(Code::UnknownArgument, name.span, message);
                    return self.report(unknown.expected(usage).did_you_mean(&name.node, ["step"]));
                }
                None => {}
            }
        }
        let call = unnamed.next();
        let step = step.or_else(|| unnamed.next().map(|a| &a.value));
        if let Some(extra) = unnamed.next() {
            let message = "`gradient` takes a call and a step";
            let many = Diagnostic::new(Code::TooManyArguments, extra.value.span, message);
            return self.report(many.expected(usage));
        }
        match (call, step) {
            (Some(call), Some(step)) => Some((&call.value, step)),
            _ => {
                let message = "`gradient` needs a call and the distance between its points";
                let few = Diagnostic::new(Code::MissingArgument, span, message);
                self.report(few.expected(usage))
            }
        }
    }

    fn step_of_gradient(&mut self, step: &Expr) -> Option<ExprId> {
        let id = self.value_as(step, Ty::Length, "the step of `gradient`")?;
        if let Some(Const::Float(v)) = self.builder.function().constant(id)
            && v.iter().any(|&x| x <= 0.0)
        {
            let message = "the step of `gradient` is not above zero";
            let wrong = Diagnostic::new(Code::OutOfRange, step.span, message)
                .expected("a length well below the size of what the function draws");
            return self.report(wrong);
        }
        Some(id)
    }

    /// The function that `call` calls, and its arguments; the first is a point.
    fn sampled_function(&mut self, call: &Expr) -> Option<(FunctionId, Vec<ExprId>)> {
        let ExprKind::Call { callee, args } = &call.kind else {
            self.expr(call);
            return self.not_sampled(call.span, "`gradient` differentiates a call");
        };
        let Some(item) = self.cx.lookup(self.module, &callee.node) else {
            // An unknown function is reported as one; a built-in one is known.
            self.expr(call)?;
            let message = format!("`{}` is no function of a point", callee.node);
            return self.not_sampled(call.span, &message);
        };
        let Some(Checked::Function(f)) = self.cx.demand(item, Some(callee.span)) else {
            self.expr(call)?;
            let message = format!("`{}` has no value that could grow", callee.node);
            return self.not_sampled(call.span, &message);
        };
        let signature = self.cx.signatures[&f].clone();
        self.function_of_a_point(callee, &signature)?;
        let values = self.value_arguments(callee, args, &signature.params)?;
        Some((f, values))
    }

    fn function_of_a_point(&mut self, callee: &Name, f: &Signature) -> Option<()> {
        let name = &callee.node;
        if !f.params.first().is_some_and(|p| p.ty.is_geometric()) {
            let message = format!("the first parameter of `{name}` is no point");
            return self.not_sampled(callee.span, &message);
        }
        if !matches!(f.result, Ty::Float | Ty::Length) {
            let message = format!("`{name}` gives {}", self.cx.a_type(f.result));
            return self.not_sampled(callee.span, &message);
        }
        Some(())
    }

    fn not_sampled<T>(&mut self, span: Span, message: &str) -> Option<T> {
        let wrong = Diagnostic::new(Code::TypeMismatch, span, message)
            .expected("a call of a function of a point, whose value is a float or a length")
            .hint("write one: `fn height(p: point) -> length { ... }`");
        self.report(wrong)
    }

    /// The sum over both directions of each axis of (direction times value), over twice the step.
    /// One call in a loop: the function stands once in the code, however large it is.
    fn central_differences(
        &mut self,
        f: FunctionId,
        values: &[ExprId],
        step: ExprId,
        span: Span,
    ) -> ExprId {
        let total = self.sum_of_sides(POINTS, span, |cx, index| {
            let direction = cx.axis(index, span);
            let offset = cx.builder.op(Op::Mul, &[direction, step], span);
            let mut args = values.to_vec();
            args[0] = cx.builder.op(Op::Add, &[values[0], offset], span);
            let value = cx.builder.call(&cx.cx.ir, f, &args, span);
            cx.builder.op(Op::Mul, &[direction, value], span)
        });
        let two = self.builder.float(2.0, span);
        let width = self.builder.op(Op::Mul, &[step, two], span);
        self.builder.op(Op::Div, &[total, width], span)
    }

    /// The sum of three floats that `term` makes of 0 to below `sides`, in a loop.
    pub(super) fn sum_of_sides(
        &mut self,
        sides: i32,
        span: Span,
        term: impl FnOnce(&mut Self, ExprId) -> ExprId,
    ) -> ExprId {
        let zero = self.constant(Const::Float(vec![0.0; 3]), span);
        let sum = self.builder.local("gradient", ir::Type::Vec3);
        self.builder.store(sum, zero);
        let turn = self.builder.local("side", ir::Type::Int);
        let low = self.constant(Const::Int(0), span);
        let high = self.constant(Const::Int(sides), span);
        self.builder.open();
        let index = self.builder.load(turn, span);
        let term = term(self, index);
        let so_far = self.builder.load(sum, span);
        let more = self.builder.op(Op::Add, &[so_far, term], span);
        self.builder.store(sum, more);
        let body = self.builder.close();
        self.builder.stmt(Stmt::For {
            local: turn,
            low,
            high,
            body,
        });
        self.builder.load(sum, span)
    }

    /// x, -x, y, -y, z, -z for 0 to 5.
    fn axis(&mut self, index: ExprId, span: Span) -> ExprId {
        let int = |cx: &mut Self, i| cx.constant(Const::Int(i), span);
        let one = int(self, 1);
        let odd = self.builder.op(Op::BitAnd, &[index, one], span);
        let odd = self.promote(odd, span);
        let (two, plus, none) = [2.0, 1.0, 0.0].map(|x| self.builder.float(x, span)).into();
        let back = self.builder.op(Op::Mul, &[odd, two], span);
        let sign = self.builder.op(Op::Sub, &[plus, back], span);
        let which = self.builder.op(Op::ShiftRight, &[index, one], span);
        let parts = [0, 1, 2].map(|axis| {
            let axis = int(self, axis);
            let here = self.builder.op(Op::Equal, &[which, axis], span);
            self.builder.op(Op::Select, &[here, sign, none], span)
        });
        self.builder.compose(ir::Type::Vec3, &parts, span)
    }
}
