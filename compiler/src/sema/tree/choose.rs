//! An `if` between closures.

use crate::ast;
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Closure, Const, ExprId};
use crate::sema::body::{Body, Operand};
use crate::source::Span;

impl Body<'_, '_> {
    /// An `if` between closures. Both sides' patterns are computed, so neither may assign what
    /// is seen outside.
    pub fn if_closure(
        &mut self,
        cond: ExprId,
        then: &ast::Block,
        otherwise: &ast::Block,
        span: Span,
    ) -> Option<Operand> {
        let outside = std::mem::replace(&mut self.fixed_scopes, self.scopes.depth());
        let a = self.scoped(|cx| cx.block_value(then, span));
        let b = self.scoped(|cx| cx.block_value(otherwise, span));
        self.fixed_scopes = outside;
        match (a?.0, b?) {
            (a, (b, at)) if a.ty().is_closure() && b.ty().is_closure() => {
                self.same_kind(a.ty(), b.ty(), at)?;
                self.choose_closure(cond, a, b, span)
            }
            (_, (_, at)) => {
                let wrong = Diagnostic::new(
                    Code::TypeMismatch,
                    at,
                    "one branch is a closure and the other is not",
                )
                .expected("closures in both branches")
                .hint("`0.0 * diffuse(0.0)` is a closure that does nothing");
                self.report(wrong)
            }
        }
    }

    /// The first of two closures of one kind where `cond` holds, else the second.
    pub fn choose_closure(
        &mut self,
        cond: ExprId,
        a: Operand,
        b: Operand,
        span: Span,
    ) -> Option<Operand> {
        use Operand::{Closure as C, Material, Medium, Nothing};
        if let Some(Const::Bool(holds)) = self.builder.function().constant(cond)
            && matches!((a, b), (Nothing(_), _) | (_, Nothing(_)) | (Medium(_), _))
        {
            return Some(if *holds { a } else { b });
        }
        Some(match (a, b) {
            (C(x, ty), C(y, _)) => self.add_closure(Closure::Select(cond, x, y), ty),
            (C(x, ty), Nothing(_)) | (Nothing(_), C(x, ty)) => {
                let (one, zero) = (self.builder.float(1.0, span), self.builder.float(0.0, span));
                let share = match a {
                    Nothing(_) => [cond, zero, one],
                    _ => [cond, one, zero],
                };
                let share = self.builder.op(Op::Select, &share, span);
                self.add_closure(Closure::Weight(share, x), ty)
            }
            (Medium(x), Medium(y)) => self.choose_medium(cond, x, y, span),
            (Medium(x), Nothing(_)) => self.medium_when(cond, true, x, span),
            (Nothing(_), Medium(y)) => self.medium_when(cond, false, y, span),
            (Material(x), Material(y)) => return self.choose_material(cond, x, y, span),
            (nothing @ Nothing(_), _) => nothing,
            _ => return None,
        })
    }
}
