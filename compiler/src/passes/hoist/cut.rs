//! Decides which uniform work becomes a value of the table, and which the kernel does again.

use std::collections::BTreeSet;

use super::Uses;
use crate::ir::ops::{CostClass, Op};
use crate::ir::{ExprId, ExprKind, Function, Module};

/// Where uniform work is cut: what becomes a value, and what the kernel makes of values.
pub(super) struct Cut {
    pub(super) values: BTreeSet<ExprId>,
    pub(super) kept: BTreeSet<ExprId>,
}

impl Cut {
    pub(super) fn of(module: &Module, f: &Function, uses: &Uses) -> Self {
        let mut cut = Self {
            values: BTreeSet::new(),
            kept: BTreeSet::new(),
        };
        let mut pending: Vec<ExprId> = uses.read.iter().copied().collect();
        while let Some(id) = pending.pop() {
            if cut.values.contains(&id) || cut.kept.contains(&id) {
                continue;
            }
            let sources = sources(f, uses, id);
            if cheap(module, f, id, &sources) {
                cut.kept.insert(id);
                pending.extend(sources);
            } else {
                cut.values.insert(id);
            }
        }
        cut.keep_parts(f);
        cut
    }

    /// Components of what is there anyway need no value of their own. Fields do: structs are read
    /// by fields, so theirs is the value that is there.
    fn keep_parts(&mut self, f: &Function) {
        let param = |id: &ExprId| match f.expr(*id).kind {
            ExprKind::MaterialParam(i) => Some(i),
            _ => None,
        };
        let read: BTreeSet<u32> = self.values.iter().filter_map(param).collect();
        let there: BTreeSet<ExprId> = self.values.union(&self.kept).copied().collect();
        let is_part = |&id: &ExprId| match f.expr(id).kind {
            ExprKind::Swizzle(of, _) => {
                there.contains(&of) || param(&of).is_some_and(|i| read.contains(&i))
            }
            _ => false,
        };
        let parts: Vec<ExprId> = self.values.iter().copied().filter(is_part).collect();
        for id in parts {
            self.values.remove(&id);
            self.kept.insert(id);
            // One of several expressions that are this parameter; all are to read the value.
            self.values.extend(
                f.expr(id)
                    .kind
                    .operands()
                    .iter()
                    .filter(|o| param(o).is_some()),
            );
        }
    }
}

/// The uniform operands of an expression, each once.
fn sources(f: &Function, uses: &Uses, id: ExprId) -> Vec<ExprId> {
    let operands = f.expr(id).kind.operands().iter().copied();
    let all: BTreeSet<ExprId> = operands.filter(|o| uses.uniform[o.index()]).collect();
    all.into_iter().collect()
}

/// Is it cheaper for a kernel to make a value from its sources than to read it?
fn cheap(module: &Module, f: &Function, id: ExprId, sources: &[ExprId]) -> bool {
    let expr = f.expr(id);
    let read: usize = sources
        .iter()
        .map(|&s| f.ty(s).numbers(&module.structs))
        .sum();
    let made = expr.ty.numbers(&module.structs);
    match &expr.kind {
        ExprKind::Compose(_) | ExprKind::Make(..) | ExprKind::Swizzle(..) => read <= made,
        ExprKind::Op(Op::Neg, _) => read <= made,
        ExprKind::Op(op, _) => op.info().class == CostClass::Alu(1) && read < made,
        _ => false,
    }
}
