//! Puts the values of a material's parameters into its body.

use crate::ir::{Const, ExprKind, Function};

/// Replaces every parameter that has a value by it.
pub fn bake(body: &mut Function, values: &[Option<Const>]) {
    for expr in &mut body.exprs {
        if let ExprKind::MaterialParam(i) = expr.kind
            && let Some(Some(value)) = values.get(i as usize)
        {
            expr.kind = ExprKind::Const(value.clone());
        }
    }
}
