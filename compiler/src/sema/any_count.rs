//! Functions of arrays of any length: `fn curve(x: float, values: float[]) -> float`.
//!
//! Such a function is lowered once for each combination of lengths that it is called with, so that
//! its loops have constant bounds and its indices are known. Like a function that returns a closure
//! it is also checked on its own, so that its errors are reported whether or not it is called.

use std::sync::Arc;

use crate::ast::{self, Arg, ItemKind, Name};
use crate::ir::{ExprId, FunctionId, StructId};
use crate::source::Span;

use super::body::{Body, Operand};
use super::modules::{ItemRef, ModuleId};
use super::types::Ty;
use super::{Checked, Checker, Param, Signature};

/// The length of the arrays for which a function is checked on its own.
pub const STAND_IN: usize = 8;

/// Does any of `params` take an array of any length?
pub fn takes_any_count(params: &[Param]) -> bool {
    params.iter().any(|p| matches!(p.ty, Ty::AnyCount(_)))
}

impl Checker<'_> {
    /// Checks a function of arrays of any length on its own.
    pub(super) fn any_count(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        f: &ast::Function,
        signature: Signature,
    ) -> Option<Checked> {
        let mut types = Vec::new();
        for param in &signature.params {
            types.push(match param.ty {
                Ty::AnyCount(id) => {
                    let element = self.arrays.get(&id)?.element;
                    self.array(element, STAND_IN, item.span)?
                }
                ty => ty,
            });
        }
        self.lower_signature(module, item, f, &types, signature.result, true)?;
        Some(Checked::AnyCount(Arc::new(signature)))
    }

    /// Lowers a function for parameters of certain types, which may only stand in for others.
    pub(super) fn lower_signature(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        f: &ast::Function,
        types: &[Ty],
        result: Ty,
        stands_in: bool,
    ) -> Option<FunctionId> {
        let names = f.params.iter().map(|p| p.name.clone());
        let args: Vec<(Name, Ty)> = names.zip(types.iter().copied()).collect();
        let (name, span) = (&item.name.node, item.span);
        let prologue = |body: &mut Body| {
            body.stands_in = stands_in;
            Some(())
        };
        self.lower_function(module, name, span, &args, result, prologue, &f.body)
    }

    /// The function `item` for arguments of certain types, of which arrays have the given structs.
    fn instance(
        &mut self,
        item: ItemRef,
        arrays: Vec<StructId>,
        types: &[Ty],
        result: Ty,
    ) -> Option<FunctionId> {
        let key = (item, arrays);
        if let Some(known) = self.instances.get(&key) {
            return Some(*known);
        }
        let ast = self.ast(item.module);
        let definition = &ast.items[item.index];
        let ItemKind::Function(f) = &definition.kind else {
            return None;
        };
        let lowered = self.lower_signature(item.module, definition, f, types, result, false)?;
        self.instances.insert(key, lowered);
        Some(lowered)
    }
}

impl Body<'_, '_> {
    /// A call of a function of arrays of any length.
    pub fn call_any_count(
        &mut self,
        callee: &Name,
        item: ItemRef,
        signature: &Signature,
        args: &[Arg],
        span: Span,
    ) -> Option<Operand> {
        let operands = self.arguments(callee, args, &signature.params)?;
        let types: Vec<Ty> = operands.iter().map(|operand| operand.ty()).collect();
        let any = |(param, ty): (&Param, &Ty)| match param.ty {
            Ty::AnyCount(_) => ty.array(),
            _ => None,
        };
        let arrays = signature
            .params
            .iter()
            .zip(&types)
            .filter_map(any)
            .collect();
        let known = self.cx.diagnostics.len();
        let id = self.cx.instance(item, arrays, &types, signature.result);
        self.found_in_call(known, span);
        let id = id?;
        let value = |operand: Operand| match operand {
            Operand::Value(id, _) => Some(id),
            _ => None,
        };
        let args: Option<Vec<ExprId>> = operands.into_iter().map(value).collect();
        Some(Operand::Value(
            self.call_of(id, &args?, span)?,
            signature.result,
        ))
    }

    /// A call of a function of the module, whose loops count towards those around the call.
    pub fn call_of(&mut self, id: FunctionId, args: &[ExprId], span: Span) -> Option<ExprId> {
        let turns = self.cx.ir.functions[id.index()].turns;
        self.check_turns(self.turns.saturating_mul(turns), span)?;
        Some(self.builder.call(&self.cx.ir, id, args, span))
    }
}
