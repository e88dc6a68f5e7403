//! Puts the values of a material's parameters into its body.

use crate::diag::Diagnostic;
use crate::ir::{Const, ExprKind, Material, Module};

/// Replaces every parameter whose value is known for good by it.
pub fn bake(
    _: &Module,
    material: &mut Material,
    values: &[Option<Const>],
) -> Result<bool, Diagnostic> {
    for expr in &mut material.body.exprs {
        if let ExprKind::MaterialParam(i) = expr.kind
            && let Some(Some(value)) = values.get(i as usize)
        {
            expr.kind = ExprKind::Const(value.clone());
        }
    }
    Ok(true)
}
