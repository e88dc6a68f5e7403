//! `layer(a, b)` and `mix(a, b, t)` of closures.

use super::closure_or_nothing;
use crate::ast::Arg;
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Closure, ClosureId};
use crate::sema::body::{Body, Operand, Place};
use crate::sema::types::Ty;
use crate::source::Span;

/// A closure to combine, if there is one, with its kind and place.
type Part = (Option<ClosureId>, Ty, Span);

impl Body<'_, '_> {
    /// Closures of arguments without names, all of one type.
    fn closures_of(&mut self, what: &str, args: &[Arg]) -> Option<Vec<Part>> {
        let mut all = Vec::new();
        let mut ok = true;
        for arg in args {
            let at = arg.value.span;
            match self.expr(&arg.value) {
                _ if arg.name.is_some() => {
                    let named = Diagnostic::new(
                        Code::UnknownArgument,
                        at,
                        format!("`{what}` takes its closures by position"),
                    )
                    .expected("closures without names");
                    self.report::<()>(named);
                    ok = false;
                }
                Some(Operand::Closure(id, ty)) => all.push((Some(id), ty, at)),
                Some(Operand::Nothing(ty)) if ty != Ty::Medium => all.push((None, ty, at)),
                Some(other) => {
                    let found = self.cx.a_type(other.ty());
                    let message = format!("`{what}` combines bsdfs and edfs, and this is {found}");
                    let wrong =
                        Diagnostic::new(Code::TypeMismatch, at, message).expected("a bsdf or edf");
                    self.report::<()>(match other {
                        Operand::Value(..) => {
                            wrong.hint("a weight is multiplied: `w * diffuse(...)`")
                        }
                        Operand::Material(_) => {
                            wrong.hint("take the surface of the material: `m.surface`")
                        }
                        _ => wrong.hint("a medium is assigned to `interior`"),
                    });
                    ok = false;
                }
                None => ok = false,
            }
        }
        ok.then_some(all)
    }

    /// `layer(a, b, ...)`, top first. With an edf at the bottom, it is emission seen through the
    /// layers above.
    pub fn layer(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        self.require_closures("layer", span)?;
        let closures = self.closures_of("layer", args)?;
        let Some((&(bottom, ty, _), above)) =
            closures.split_last().filter(|(_, above)| !above.is_empty())
        else {
            let few = Diagnostic::new(
                Code::MissingArgument,
                span,
                "`layer` needs two closures at least",
            )
            .expected("`layer(top, ..., bottom)`");
            return self.report(few);
        };
        if let Some((_, _, at)) = above.iter().find(|c| c.1 == Ty::Edf) {
            let wrong = Diagnostic::new(
                Code::TypeMismatch,
                *at,
                "an edf covers nothing, so it cannot lie above another layer",
            )
            .expected("a bsdf; an edf only at the bottom of `layer`")
            .hint("emission from under a coat is `emission = layer(coat, edf);`");
            return self.report(wrong);
        }
        let mut stack = bottom;
        for &(top, ..) in above.iter().rev() {
            stack = match (top, stack) {
                (Some(top), Some(under)) => Some(self.add(Closure::Layer(top, under))),
                // What is black stays so under a coat, and the coat is what is seen.
                (Some(top), None) if ty == Ty::Bsdf => Some(top),
                (_, stack) => stack,
            };
        }
        Some(closure_or_nothing(stack, ty))
    }

    /// `mix(a, b, t)` of closures.
    pub fn mix_closures(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        self.require_closures("mix", span)?;
        let named_weight = args
            .iter()
            .position(|a| a.name.as_ref().is_some_and(|n| n.node == "t"));
        let [a, b, t] = args else {
            let wrong = Diagnostic::new(
                Code::MissingArgument,
                span,
                format!("`mix` takes 3 arguments, not {}", args.len()),
            )
            .expected("`mix(a, b, t)`");
            return self.report(wrong);
        };
        if named_weight.is_some_and(|i| i != 2) {
            let wrong = Diagnostic::new(Code::UnknownArgument, span, "the weight comes last")
                .expected("`mix(a, b, t)`");
            return self.report(wrong);
        }
        let closures = self.closures_of("mix", &[a.clone(), b.clone()]);
        let weight = self.value_as(&t.value, Ty::Float, "the weight of `mix`");
        let (closures, weight) = (closures?, weight?);
        let [(x, xt, _), (y, yt, at)] = closures.as_slice() else {
            return None;
        };
        self.same_kind(*xt, *yt, *at)?;
        let weight = self.builder.op(Op::Saturate, &[weight], t.value.span);
        let mixed = match (*x, *y) {
            (Some(x), Some(y)) => Some(self.add(Closure::Mix(x, y, weight))),
            (Some(x), None) => {
                let one = self.builder.float(1.0, span);
                let rest = self.builder.op(Op::Sub, &[one, weight], span);
                Some(self.add(Closure::Weight(rest, x)))
            }
            (None, y) => y.map(|y| self.add(Closure::Weight(weight, y))),
        };
        Some(closure_or_nothing(mixed, *xt))
    }

    fn require_closures(&mut self, what: &str, span: Span) -> Option<()> {
        if self.place != Place::Values {
            return Some(());
        }
        let message = format!("`{what}` combines closures, which are no values");
        let wrong = Diagnostic::new(Code::ClosureUse, span, message)
            .expected("closures in materials, and in functions that return one");
        self.report(wrong)
    }

    pub(super) fn same_kind(&mut self, a: Ty, b: Ty, span: Span) -> Option<()> {
        if a == b {
            return Some(());
        }
        let (a, b) = (self.cx.a_type(a), self.cx.a_type(b));
        let wrong = Diagnostic::new(
            Code::TypeMismatch,
            span,
            format!("{a} and {b} do not combine"),
        )
        .expected(a);
        self.report(wrong)
    }
}
