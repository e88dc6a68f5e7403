//! Puts the values of a material's parameters into its body.

use crate::ir::{Const, ExprKind, Function};

/// Replaces every parameter by its value.
pub fn bake(body: &mut Function, values: &[Const]) {
    for expr in &mut body.exprs {
        if let ExprKind::Uniform(i) = expr.kind
            && let Some(value) = values.get(i as usize)
        {
            expr.kind = ExprKind::Const(value.clone());
        }
    }
}
