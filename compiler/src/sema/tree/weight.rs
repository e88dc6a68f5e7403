//! `weight * closure` and `closure + closure`, and what would create light.

use crate::ast::BinaryOp;
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Closure, ClosureId, Const, ExprId};
use crate::sema::body::{Body, Operand};
use crate::sema::types::Ty;
use crate::source::Span;

impl Body<'_, '_> {
    /// `w * a` and `a + b` where a closure takes part.
    pub fn closure_operator(
        &mut self,
        op: BinaryOp,
        a: Operand,
        b: Operand,
        span: Span,
    ) -> Option<Operand> {
        match (op, a, b) {
            (BinaryOp::Mul, Operand::Value(w, wt), Operand::Closure(c, ty))
            | (BinaryOp::Mul, Operand::Closure(c, ty), Operand::Value(w, wt)) => {
                self.weight(w, wt, c, ty, span)
            }
            (BinaryOp::Mul, Operand::Value(..), Operand::Nothing(ty))
            | (BinaryOp::Mul, Operand::Nothing(ty), Operand::Value(..))
                if ty != Ty::Medium =>
            {
                Some(Operand::Nothing(ty))
            }
            (
                BinaryOp::Add,
                Operand::Nothing(xt),
                y @ (Operand::Closure(..) | Operand::Nothing(_)),
            )
            | (BinaryOp::Add, y @ Operand::Closure(..), Operand::Nothing(xt))
                if xt != Ty::Medium =>
            {
                self.same_kind(y.ty(), xt, span)?;
                Some(y)
            }
            (BinaryOp::Add, Operand::Closure(x, xt), Operand::Closure(y, yt)) => {
                self.same_kind(xt, yt, span)?;
                if xt == Ty::Bsdf && self.may_gain(x, y) {
                    let gain = Diagnostic::new(Code::EnergyGain, span, "this sum of closures can reflect more light than it receives")
                        .hint("use `layer(top, bottom)` or `mix(a, b, t)`, or weights that sum to at most one");
                    self.report::<()>(gain);
                }
                Some(self.add_closure(Closure::Add(x, y), xt))
            }
            _ => {
                let message = format!("`{}` does not combine closures this way", op.symbol());
                let wrong = Diagnostic::new(Code::ClosureUse, span, message)
                    .expected("`weight * closure` or `closure + closure`");
                self.report(match (a, b) {
                    (Operand::Material(_), _) | (_, Operand::Material(_)) => {
                        wrong.hint("take the surface of the material: `m.surface`")
                    }
                    _ => wrong.hint("to take light away, multiply by a weight below one"),
                })
            }
        }
    }

    /// May a sum of closures reflect more than comes? Not if constant weights keep it to one.
    fn may_gain(&self, x: ClosureId, y: ClosureId) -> bool {
        let (x, y) = (self.most_reflected(x), self.most_reflected(y));
        x.iter().zip(y).any(|(x, y)| x + y > 1.0 + 1e-9)
    }

    /// How much a closure reflects at most in each channel, by its constant weights.
    fn most_reflected(&self, id: ClosureId) -> [f64; 3] {
        // Closures that stand in for parameters are not there.
        let Some(closure) = self.closures.get(id.index()) else {
            return [1.0; 3];
        };
        match closure {
            Closure::Weight(w, a) => match self.builder.function().constant(*w) {
                Some(Const::Float(w)) => {
                    let a = self.most_reflected(*a);
                    std::array::from_fn(|c| a[c] * w.get(c).or(w.first()).copied().unwrap_or(1.0))
                }
                _ => self.most_reflected(*a),
            },
            Closure::Add(a, b) => {
                let (a, b) = (self.most_reflected(*a), self.most_reflected(*b));
                std::array::from_fn(|c| a[c] + b[c])
            }
            Closure::Mix(..) | Closure::Layer(..) | Closure::Select(..) | Closure::Lobe(_) => {
                [1.0; 3]
            }
        }
    }

    fn weight(&mut self, w: ExprId, wt: Ty, c: ClosureId, ty: Ty, span: Span) -> Option<Operand> {
        let w = match wt {
            Ty::Int | Ty::Uint => self.promoted(w, wt, span),
            Ty::Float | Ty::Color => w,
            _ => {
                let message = format!("a closure cannot be weighted by {}", self.cx.a_type(wt));
                return self.report(
                    Diagnostic::new(Code::TypeMismatch, span, message)
                        .expected("a float or a color"),
                );
            }
        };
        if let (Ty::Bsdf, Some(Const::Float(v))) = (ty, self.builder.function().constant(w)) {
            let (most, least) = v
                .iter()
                .fold((f64::MIN, f64::MAX), |(a, b), &x| (a.max(x), b.min(x)));
            let warning = if most > 1.0 {
                Some(
                    Diagnostic::new(
                        Code::WeightAboveOne,
                        span,
                        format!("a weight of {most} can create light"),
                    )
                    .expected("a weight from 0 to 1"),
                )
            } else if most <= 0.0 && least <= 0.0 {
                Some(
                    Diagnostic::new(
                        Code::LobesNeverSampled,
                        span,
                        "the weight is zero, so the closure never shows",
                    )
                    .expected("a weight above 0"),
                )
            } else {
                None
            };
            if let Some(warning) = warning {
                self.report::<()>(warning);
            }
        }
        // Light cannot be negative; emission may be as strong as it likes.
        let zero = self.builder.float(0.0, span);
        let w = self.builder.op(Op::Max, &[w, zero], span);
        Some(self.add_closure(Closure::Weight(w, c), ty))
    }
}
