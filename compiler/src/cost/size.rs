//! How large code is with its calls in line, as drivers put them.

use std::collections::BTreeMap;

use crate::ir::{Block, ExprKind, Function, Module, Stmt};

/// The size of code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Size {
    /// Operations, whether they are executed or not; a loop is one and what it repeats.
    pub code: u64,
    /// Loops.
    pub loops: u64,
}

impl Size {
    /// The size of `f`, a function over `module`. A function that is called twice counts twice.
    pub fn of(module: &Module, f: &Function) -> Self {
        let mut sizes: BTreeMap<usize, Size> = BTreeMap::new();
        // Callees stand before their callers.
        for index in called(module, f) {
            let size = Self::own(module, &module.functions[index], &sizes);
            sizes.insert(index, size);
        }
        Self::own(module, f, &sizes)
    }

    /// The size of a function whose callees' sizes are known.
    fn own(module: &Module, f: &Function, sizes: &BTreeMap<usize, Size>) -> Self {
        let loops = loops(&f.body);
        let mut size = Size { code: loops, loops };
        for id in f.evaluated() {
            size.add(match f.expr(id).kind {
                ExprKind::Call(callee, _) => sizes[&callee.index()],
                _ => Size {
                    code: f.counts(&module.structs, id).operations(),
                    loops: 0,
                },
            });
        }
        size
    }

    pub fn add(&mut self, other: Size) {
        self.code = self.code.saturating_add(other.code);
        self.loops = self.loops.saturating_add(other.loops);
    }
}

/// The functions that a function calls, directly or not, ascending.
fn called(module: &Module, f: &Function) -> Vec<usize> {
    let mut wanted = vec![false; module.functions.len()];
    let mut pending: Vec<&Function> = vec![f];
    while let Some(f) = pending.pop() {
        for callee in f.calls() {
            if !std::mem::replace(&mut wanted[callee.index()], true) {
                pending.push(&module.functions[callee.index()]);
            }
        }
    }
    (0..wanted.len()).filter(|&i| wanted[i]).collect()
}

fn loops(block: &Block) -> u64 {
    let one = |stmt: &Stmt| {
        let this = u64::from(matches!(stmt, Stmt::For { .. } | Stmt::While { .. }));
        this + stmt.blocks().map(loops).sum::<u64>()
    };
    block.iter().map(one).sum()
}
