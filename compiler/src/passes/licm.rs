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

/// Moves invariant work out of loops in place.
pub fn licm(f: &mut Function) -> bool {
    let body = std::mem::take(&mut f.body);
    f.body = block(f, body);
    true
}

/// Rewrites a block; inner loops first, so that their invariants can go on moving out.
fn block(f: &Function, stmts: Block) -> Block {
    let mut out = Vec::with_capacity(stmts.len());
    for stmt in stmts {
        match stmt {
            Stmt::If(cond, a, b) => out.push(Stmt::If(cond, block(f, a), block(f, b))),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let mut body = block(f, body);
                let mut looped = Loop::new(f, &[&body], Some(local));
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
                let (mut head, mut body) = (block(f, head), block(f, body));
                let mut looped = Loop::new(f, &[&head, &body], None);
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

/// What is known of one loop.
struct Loop<'a> {
    f: &'a Function,
    /// Variables that some turn changes.
    stored: Vec<bool>,
    /// Expressions that are evaluated in the loop and may change. By id, as all flags here.
    varying: Vec<bool>,
}

impl<'a> Loop<'a> {
    fn new(f: &'a Function, blocks: &[&Block], counter: Option<LocalId>) -> Self {
        let mut changed: Vec<LocalId> = counter.into_iter().collect();
        let mut evaluated = Vec::new();
        for block in blocks {
            stored_in(block, &mut changed);
            evaluated_in(block, &mut evaluated);
        }
        let mut looped = Self {
            f,
            stored: vec![false; f.locals.len()],
            varying: vec![false; f.exprs.len()],
        };
        changed.iter().for_each(|l| looped.stored[l.index()] = true);
        evaluated
            .iter()
            .for_each(|e| looped.varying[e.index()] = true);
        looped
    }

    /// Moves what is invariant and worth it from the blocks to `out`.
    fn take_out(&mut self, blocks: &mut [&mut Block], out: &mut Block) {
        let invariant = self.invariant(blocks);
        if invariant.is_empty() {
            return;
        }
        let moved = self.worth_moving(&invariant);
        let goes = |id: &ExprId| moved[id.index()];
        out.extend(invariant.into_iter().filter(goes).map(Stmt::Eval));
        for block in blocks {
            block.retain(|s| !matches!(s, Stmt::Eval(id) if goes(id)));
        }
    }

    /// What every turn computes anew and alike, in order of evaluation.
    fn invariant(&mut self, blocks: &[&mut Block]) -> Vec<ExprId> {
        let mut found = Vec::new();
        for stmt in blocks.iter().flat_map(|b| b.iter()) {
            if let Stmt::Eval(id) = stmt
                && self.is_invariant(*id)
            {
                self.varying[id.index()] = false;
                found.push(*id);
            }
        }
        found
    }

    fn is_invariant(&self, id: ExprId) -> bool {
        match &self.f.expr(id).kind {
            ExprKind::Load(local) => !self.stored[local.index()],
            kind => !kind.operands().iter().any(|a| self.varying[a.index()]),
        }
    }

    /// Of what is invariant, operations and calls, and what these read.
    fn worth_moving(&self, invariant: &[ExprId]) -> Vec<bool> {
        let mut inside = vec![false; self.f.exprs.len()];
        invariant.iter().for_each(|id| inside[id.index()] = true);
        let mut moved = vec![false; self.f.exprs.len()];
        for &id in invariant.iter().rev() {
            let kind = &self.f.expr(id).kind;
            if moved[id.index()] || matches!(kind, ExprKind::Op(..) | ExprKind::Call(..)) {
                moved[id.index()] = true;
                for operand in kind.operands() {
                    moved[operand.index()] |= inside[operand.index()];
                }
            }
        }
        moved
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
