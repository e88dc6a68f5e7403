//! The functions that materials call, optimised as far as materials needed them yet.

use std::collections::BTreeSet;

use crate::ir::{Block, ExprKind, Function, FunctionId, Module, Stmt};
use crate::passes;

/// How large a function is.
#[derive(Clone, Copy, Default)]
pub(super) struct Size {
    /// Its expressions with its calls put in line.
    pub(super) expanded: u64,
    /// What the longest function among it and those that it calls has of expressions, constants that
    /// they read, and assignments.
    pub(super) longest: u64,
}

/// The checker's module, with what passes made of its functions.
#[derive(Default)]
pub(super) struct Functions {
    pub(super) module: Module,
    /// Each function's size; none if it is as it was checked.
    sizes: Vec<Option<Size>>,
    /// Statements that passes walked.
    pub(super) effort: u64,
    /// Of these, those of functions that others call and that are not of the library.
    in_callees: u64,
}

/// Statements that passes walk in functions of users that others call before these keep their calls:
/// copies of callees in callers make code grow with the square of the source.
const MOST_COPIED: u64 = 1 << 20;

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
            // Nothing that it calls leads back to it.
            let mut f = take(&mut self.module.functions[id.index()]);
            let run = if self.in_callees < MOST_COPIED {
                passes::run_callee
            } else {
                passes::run_callee_of_many
            };
            let walked = run(&self.module, &mut f);
            if !f.span.file.is_library() {
                self.in_callees += walked;
            }
            self.effort += walked;
            self.sizes[id.index()] = Some(self.size(&f));
            self.module.functions[id.index()] = f;
        }
    }

    /// The size of a function whose callees are optimised.
    pub(super) fn size(&self, f: &Function) -> Size {
        let mut size = Size::default();
        let mut own = stores(&f.body);
        for id in f.evaluated() {
            let kind = &f.expr(id).kind;
            let inner = match kind {
                ExprKind::Call(callee, _) => {
                    let callee = self.sizes[callee.index()].unwrap_or_default();
                    size.longest = size.longest.max(callee.longest);
                    callee.expanded
                }
                _ => 1,
            };
            size.expanded = size.expanded.saturating_add(inner);
            let constants = kind
                .operands()
                .iter()
                .filter(|id| f.constant(**id).is_some());
            own += 1 + constants.count() as u64;
        }
        size.longest = size.longest.max(own);
        size
    }
}

/// Takes the code of a function, which leaves one that does nothing.
fn take(f: &mut Function) -> Function {
    let nothing = Function {
        name: String::new(),
        params: Vec::new(),
        locals: Vec::new(),
        exprs: Vec::new(),
        body: Block::new(),
        sites: Vec::new(),
        ..*f
    };
    std::mem::replace(f, nothing)
}

/// Assignments of a block.
fn stores(block: &Block) -> u64 {
    let count = |stmt: &Stmt| {
        let inner: u64 = stmt.blocks().map(stores).sum();
        u64::from(matches!(stmt, Stmt::Store(..))) + inner
    };
    block.iter().map(count).sum()
}
