//! Moves what does not change from turn to turn out of loops.
//!
//! Everything is pure and total, so moving is always safe; the question is what it costs. Only
//! what every turn computes is moved, never what stands under a branch of the loop: a branch that
//! is not taken would then be paid for. A loop that happens to run no turn pays for one turn's
//! constant part; loops that are known to run none are gone by now. Reads of fields, variables
//! and components go out only along with an operation that needs them: alone they save nothing
//! and would hold a register across the loop.

use super::rewrite::stored_in;
use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Stmt};

/// Moves invariant work out of loops in place; false if there are no loops.
pub fn licm(f: &mut Function) -> bool {
    if !has_loop(&f.body) {
        return false;
    }
    let body = std::mem::take(&mut f.body);
    f.body = block(f, &mut Flags::new(f), body);
    true
}

fn has_loop(block: &Block) -> bool {
    block.iter().any(|stmt| {
        matches!(stmt, Stmt::For { .. } | Stmt::While { .. }) || stmt.blocks().any(has_loop)
    })
}

/// Rewrites a block; inner loops first, so that their invariants can go on moving out.
fn block(f: &Function, flags: &mut Flags, stmts: Block) -> Block {
    let mut out = Vec::with_capacity(stmts.len());
    for stmt in stmts {
        match stmt {
            Stmt::If(cond, a, b) => {
                let (a, b) = (block(f, flags, a), block(f, flags, b));
                out.push(Stmt::If(cond, a, b));
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let mut body = block(f, flags, body);
                let looped = Loop::new(f, flags, &[&body], Some(local));
                looped.take_out(&mut [&mut body], &mut out);
                out.push(Stmt::For {
                    local,
                    low,
                    high,
                    body,
                });
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                let (mut head, mut body) = (block(f, flags, head), block(f, flags, body));
                let looped = Loop::new(f, flags, &[&head, &body], None);
                looped.take_out(&mut [&mut head, &mut body], &mut out);
                out.push(Stmt::While {
                    head,
                    test,
                    limit,
                    body,
                });
            }
            other => out.push(other),
        }
    }
    out
}

/// What is known of the variables and expressions of a function in one loop, by id. Every loop
/// leaves them unset, since there may be as many loops as expressions.
struct Flags {
    /// Variables that some turn changes.
    stored: Vec<bool>,
    /// Expressions that are evaluated in the loop and may change.
    varying: Vec<bool>,
    /// Expressions that every turn computes alike.
    invariant: Vec<bool>,
    /// Those of them that go out of the loop.
    moved: Vec<bool>,
}

impl Flags {
    fn new(f: &Function) -> Self {
        Self {
            stored: vec![false; f.locals.len()],
            varying: vec![false; f.exprs.len()],
            invariant: vec![false; f.exprs.len()],
            moved: vec![false; f.exprs.len()],
        }
    }
}

/// What is known of one loop.
struct Loop<'a> {
    f: &'a Function,
    flags: &'a mut Flags,
    /// Variables that some turn changes.
    changed: Vec<LocalId>,
    /// Expressions that are evaluated in the loop.
    evaluated: Vec<ExprId>,
}

impl<'a> Loop<'a> {
    fn new(
        f: &'a Function,
        flags: &'a mut Flags,
        blocks: &[&Block],
        counter: Option<LocalId>,
    ) -> Self {
        let mut changed: Vec<LocalId> = counter.into_iter().collect();
        let mut evaluated = Vec::new();
        for block in blocks {
            stored_in(block, &mut changed);
            evaluated_in(block, &mut evaluated);
        }
        changed.iter().for_each(|l| flags.stored[l.index()] = true);
        evaluated
            .iter()
            .for_each(|e| flags.varying[e.index()] = true);
        Self {
            f,
            flags,
            changed,
            evaluated,
        }
    }

    /// Moves what is invariant and worth it from the blocks to `out`.
    fn take_out(mut self, blocks: &mut [&mut Block], out: &mut Block) {
        let invariant = self.invariant(blocks);
        if !invariant.is_empty() {
            self.choose_moved(&invariant);
            let moved = &self.flags.moved;
            let goes = |id: &ExprId| moved[id.index()];
            out.extend(invariant.iter().copied().filter(goes).map(Stmt::Eval));
            for block in blocks {
                block.retain(|s| !matches!(s, Stmt::Eval(id) if goes(id)));
            }
        }
        self.unset_flags();
    }

    fn unset_flags(self) {
        let Flags {
            stored,
            varying,
            invariant,
            moved,
        } = self.flags;
        for local in self.changed {
            stored[local.index()] = false;
        }
        for id in self.evaluated {
            for flags in [&mut *varying, &mut *invariant, &mut *moved] {
                flags[id.index()] = false;
            }
        }
    }

    /// What every turn computes anew and alike, in order of evaluation.
    fn invariant(&mut self, blocks: &[&mut Block]) -> Vec<ExprId> {
        let mut found = Vec::new();
        for stmt in blocks.iter().flat_map(|b| b.iter()) {
            if let Stmt::Eval(id) = stmt
                && self.is_invariant(*id)
            {
                self.flags.varying[id.index()] = false;
                found.push(*id);
            }
        }
        found
    }

    fn is_invariant(&self, id: ExprId) -> bool {
        match &self.f.expr(id).kind {
            ExprKind::Load(local) => !self.flags.stored[local.index()],
            kind => !kind
                .operands()
                .iter()
                .any(|a| self.flags.varying[a.index()]),
        }
    }

    /// Of what is invariant, operations and calls go out, and what these read.
    fn choose_moved(&mut self, of: &[ExprId]) {
        let Flags {
            invariant, moved, ..
        } = &mut *self.flags;
        of.iter().for_each(|id| invariant[id.index()] = true);
        for &id in of.iter().rev() {
            let kind = &self.f.expr(id).kind;
            if moved[id.index()] || matches!(kind, ExprKind::Op(..) | ExprKind::Call(..)) {
                moved[id.index()] = true;
                for operand in kind.operands() {
                    moved[operand.index()] |= invariant[operand.index()];
                }
            }
        }
    }
}

/// Adds the expressions that a block evaluates.
fn evaluated_in(block: &Block, out: &mut Vec<ExprId>) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => out.push(*id),
            Stmt::If(_, a, b) => {
                evaluated_in(a, out);
                evaluated_in(b, out);
            }
            Stmt::For { body, .. } => evaluated_in(body, out),
            Stmt::While { head, body, .. } => {
                evaluated_in(head, out);
                evaluated_in(body, out);
            }
            Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
        }
    }
}
