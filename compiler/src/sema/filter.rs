//! `filter_width(x)`: how far `x` varies over what a ray sees of the surface, by component.
//!
//! Only a material knows its surface, so only a material may ask; a function is given widths as
//! arguments. What is checked here stays one operation of the IR until the pass `widths` puts
//! derivatives in its place.

use crate::ast::{Arg, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::source::Span;

use super::body::{Body, Operand, Place};
use super::types::Ty;

impl Body<'_, '_> {
    /// `filter_width(x)`, of the type of `x`; a vec3 for points, vectors and normals.
    pub fn filter_width(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        if self.place != Place::Material {
            let message = "`filter_width` is known in materials only";
            let wrong = Diagnostic::new(Code::UnknownName, callee.span, message)
                .expected("a function that needs no surface")
                .hint("functions see no surface: take the width as a parameter, and let the material pass `filter_width(x)`");
            return self.report(wrong);
        }
        let values = self.positional(&callee.node, args)?;
        let [(id, ty, at)] = values[..] else {
            let (code, message) = if values.is_empty() {
                (Code::MissingArgument, "`filter_width` needs a value")
            } else {
                (Code::TooManyArguments, "`filter_width` takes one value")
            };
            let wrong = Diagnostic::new(code, span, message).expected("`filter_width(8.0 * uv)`");
            return self.report(wrong);
        };
        match result(ty) {
            Some(result) => Some(Operand::Value(
                self.builder.op(Op::FilterWidth, &[id], span),
                result,
            )),
            None => self.has_no_width(ty, at),
        }
    }

    fn has_no_width(&mut self, ty: Ty, at: Span) -> Option<Operand> {
        let message = format!("{} has no width", self.cx.a_type(ty));
        let wrong = Diagnostic::new(Code::TypeMismatch, at, message)
            .expected("a float, length, angle, vector, point, normal or color");
        let wrong = match ty {
            Ty::Int | Ty::Uint | Ty::Bool => {
                wrong.hint("it changes in steps; take the width of what it is made from")
            }
            Ty::Struct(_) => wrong.hint("take the width of one of its fields"),
            _ => wrong,
        };
        self.report(wrong)
    }
}

/// The type of the width of a `ty`, which must vary continuously.
fn result(ty: Ty) -> Option<Ty> {
    match ty {
        Ty::Float | Ty::Length | Ty::Angle | Ty::Vec2 | Ty::Vec4 | Ty::Color | Ty::Error => {
            Some(ty)
        }
        ty if ty.is_geometric() => Some(Ty::Vec3),
        _ => None,
    }
}
