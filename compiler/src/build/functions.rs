//! The functions that materials call, optimised as far as materials needed them yet.

use std::collections::BTreeSet;

use crate::ir::{ExprKind, Function, FunctionId, Module};
use crate::passes;

/// The checker's module, with what passes made of its functions.
#[derive(Default)]
pub(super) struct Functions {
    pub(super) module: Module,
    /// Expressions of each function with its calls put in line; none if it is as it was checked.
    sizes: Vec<Option<u64>>,
    /// Statements that passes walked.
    pub(super) effort: u64,
}

impl Functions {
    /// Takes over what was checked since the last material.
    pub(super) fn take_over(&mut self, checked: &Module) {
        let extent = |m: &Module| {
            [
                m.structs.len(),
                m.closures.len(),
                m.textures.len(),
                m.functions.len(),
            ]
        };
        if extent(&self.module) == extent(checked) {
            return;
        }
        self.module.structs.clone_from(&checked.structs);
        self.module.closures.clone_from(&checked.closures);
        self.module.textures.clone_from(&checked.textures);
        let known = self.module.functions.len();
        let new = &checked.functions[known..];
        self.module.functions.extend_from_slice(new);
        self.sizes.resize(self.module.functions.len(), None);
    }

    /// Runs the passes over functions and all they call, unless that is done.
    pub(super) fn optimise(&mut self, wanted: Vec<FunctionId>) {
        let mut pending = wanted;
        let mut found = BTreeSet::new();
        while let Some(id) = pending.pop() {
            if self.sizes[id.index()].is_none() && found.insert(id) {
                pending.extend(self.module.functions[id.index()].calls());
            }
        }
        // Callees stand before their callers.
        for id in found {
            let mut f = self.module.functions[id.index()].clone();
            self.effort += passes::run_callee(&self.module, &mut f);
            self.sizes[id.index()] = Some(self.size(&f));
            self.module.functions[id.index()] = f;
        }
    }

    /// Expressions of a function with its calls put in line.
    pub(super) fn size(&self, f: &Function) -> u64 {
        f.evaluated().into_iter().fold(0u64, |n, id| {
            let inner = match f.expr(id).kind {
                ExprKind::Call(callee, _) => self.sizes[callee.index()].unwrap_or(0),
                _ => 1,
            };
            n.saturating_add(inner)
        })
    }
}
