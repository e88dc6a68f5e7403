//! Values known before rendering: defaults, ranges, `const` items, and what a scene sets.

use crate::ast;
use crate::diag::{Code, Diagnostic};
use crate::ir::Const;
use crate::ir::build::Builder;
use crate::ir::interp::Interpreter;
use crate::ir::value::Value;

use super::body::{Body, Operand};
use super::modules::ModuleId;
use super::purpose::Purpose;
use super::types::Ty;
use super::{Checked, Checker};

/// Expressions that evaluating one constant may take.
const FUEL: u64 = 1 << 20;

/// Expressions that evaluating all constants of a compilation may take.
const FUEL_IN_ALL: u64 = 1 << 22;

impl Checker<'_> {
    /// The value of a constant expression as a `ty`, which is no array; `what` names it in messages.
    pub fn constant<'p>(
        &mut self,
        module: ModuleId,
        expr: &ast::Expr,
        ty: Ty,
        what: impl Into<Purpose<'p>>,
    ) -> Option<Const> {
        self.constants(module, expr, ty, what)?.pop()
    }

    /// As [`Checker::constant`]; of an array, the values of its elements.
    fn constants<'p>(
        &mut self,
        module: ModuleId,
        expr: &ast::Expr,
        ty: Ty,
        what: impl Into<Purpose<'p>>,
    ) -> Option<Vec<Const>> {
        let what = what.into();
        let builder = Builder::new("constant", Vec::new(), expr.span);
        let mut body = Body::new(self, module, builder);
        let Operand::Value(id, _) = body.expr_as(expr, ty, what)? else {
            return body.report(not_constant(expr, "closures are not constants"));
        };
        let function = body.builder.finish(id);
        let value = match function.constant(id) {
            Some(value) => Some(vec![value.clone()]),
            None => {
                let fuel = FUEL.min(FUEL_IN_ALL.saturating_sub(self.evaluated));
                let mut run = Interpreter::<f64>::new(&self.ir, fuel);
                let value = run.run(&function, Vec::new());
                self.evaluated += run.executed();
                value.ok().and_then(|value| plain(&value, ty))
            }
        };
        if let (Some([value]), Some(notes)) = (value.as_deref(), self.notes.as_mut())
            && notes.module == module
        {
            notes.constants.insert(expr.span, value.clone());
        }
        match value {
            Some(values) if values.iter().all(is_finite) => Some(values),
            Some(_) => {
                let message = format!("{what} is not a finite number");
                self.report(
                    Diagnostic::new(Code::NotFinite, expr.span, message)
                        .expected("a finite number"),
                );
                None
            }
            None => {
                self.report(not_constant(
                    expr,
                    "the value takes too long to compute, or is not a plain value",
                ));
                None
            }
        }
    }

    /// Checks a `const` item.
    pub(super) fn constant_item(&mut self, module: ModuleId, c: &ast::Const) -> Option<Checked> {
        let ty = self.type_name(module, &c.ty)?;
        let values = self.constants(module, &c.value, ty, "the constant")?;
        Some(Checked::Const(values, ty))
    }
}

/// The constant that a value is, or those that the elements of an array are.
fn plain(value: &Value<f64>, ty: Ty) -> Option<Vec<Const>> {
    match value {
        Value::Struct(elements) if ty.array().is_some() => {
            elements.iter().map(Value::to_const).collect()
        }
        _ => Some(vec![value.to_const()?]),
    }
}

fn not_constant(expr: &ast::Expr, message: &str) -> Diagnostic {
    Diagnostic::new(Code::NotConstant, expr.span, message)
        .expected("literals, constants, and functions of those")
}

fn is_finite(value: &Const) -> bool {
    match value {
        Const::Float(v) => v.iter().all(|&x| (x as f32).is_finite()),
        Const::Bool(_) | Const::Int(_) => true,
    }
}
