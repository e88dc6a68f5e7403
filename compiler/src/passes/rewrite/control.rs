//! Statements, branches and loops of the shared walk, and what is known where they meet.

use super::Rewriter;
use crate::ir::ops::Op;
use crate::ir::{Block, Const, ExprId, LocalId, Stmt};
use crate::passes::{cse, simplify};

impl Rewriter<'_> {
    /// Rewrites statements into the open block. True if it is left by a jump.
    pub fn block(&mut self, stmts: Block) -> bool {
        stmts.into_iter().any(|s| self.stmt(s))
    }

    fn stmt(&mut self, stmt: Stmt) -> bool {
        self.walked += 1;
        match stmt {
            Stmt::Eval(id) => self.eval(id),
            Stmt::Store(local, part, value) => {
                let value = self.resolve(value);
                self.store(local, part, value);
            }
            Stmt::If(cond, then, otherwise) => return self.branch(cond, then, otherwise),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => return self.for_loop(local, low, high, body),
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => self.while_loop(head, test, limit, body),
            Stmt::Break | Stmt::Continue => {
                self.out.push(stmt);
                return true;
            }
        }
        false
    }

    /// Stores, unless the variable holds the value already.
    pub fn store(&mut self, local: LocalId, part: Option<u8>, value: ExprId) {
        let held = self.held[local.index()];
        if part.is_none() && held.is_some_and(|h| self.same(h, value)) {
            return;
        }
        self.held[local.index()] = if part.is_none() { Some(value) } else { None };
        self.out.push(Stmt::Store(local, part, value));
    }

    fn branch(&mut self, cond: ExprId, then: Block, otherwise: Block) -> bool {
        let cond = self.resolve(cond);
        if let Some(Const::Bool(taken)) = self.f.constant(cond) {
            return self.block(if *taken { then } else { otherwise });
        }
        let before = self.held.clone();
        let (then, then_left) = self.arm(cond, true, then);
        let after_then = std::mem::replace(&mut self.held, before.clone());
        // The first side may have brought variables of its own.
        self.held.resize(self.f.locals.len(), None);
        let (otherwise, otherwise_left) = self.arm(cond, false, otherwise);
        let after_otherwise = std::mem::take(&mut self.held);
        self.held = match (then_left, otherwise_left) {
            (true, _) => after_otherwise,
            (false, true) => after_then,
            (false, false) => self.agreed(&after_then, &after_otherwise),
        };
        self.held.resize(self.f.locals.len(), None);
        self.forget_unavailable();
        self.emit_branch(cond, then, otherwise, &before);
        then_left && otherwise_left
    }

    /// Rewrites one side of a branch, in which the condition is known.
    fn arm(&mut self, cond: ExprId, holds: bool, block: Block) -> (Block, bool) {
        let mut assumed = Vec::new();
        self.assume(cond, holds, &mut assumed);
        let result = self.scoped(block);
        for id in assumed {
            self.alias[id.index()] = None;
        }
        result
    }

    /// Takes a condition as decided: uses of it become constants, until `assumed` is undone.
    fn assume(&mut self, cond: ExprId, holds: bool, assumed: &mut Vec<ExprId>) {
        let cond = self.one_of_its_kind(cond);
        if self.alias[cond.index()].is_some() || self.f.constant(cond).is_some() {
            return;
        }
        let implied = match self.operation(cond) {
            Some((Op::Not, &[a])) => vec![(a, !holds)],
            Some((Op::And, &[a, b])) if holds => vec![(a, true), (b, true)],
            Some((Op::Or, &[a, b])) if !holds => vec![(a, false), (b, false)],
            _ => vec![],
        };
        let known = self.constant(Const::Bool(holds), self.f.expr(cond).span);
        self.bind(cond, known);
        assumed.push(cond);
        for (id, holds) in implied {
            self.assume(id, holds, assumed);
        }
    }

    fn emit_branch(
        &mut self,
        cond: ExprId,
        then: Block,
        otherwise: Block,
        before: &[Option<ExprId>],
    ) {
        if then == otherwise {
            // Nothing is evaluated twice, so these are empty, or the same stores and jumps.
            self.out.extend(then);
            return;
        }
        self.via = self.f.expr(cond).via;
        if self.rules.simplify && simplify::pick(self, cond, &then, &otherwise, before) {
            return;
        }
        let branch = match self.operation(cond) {
            Some((Op::Not, &[inner])) if self.rules.simplify => Stmt::If(inner, otherwise, then),
            _ => Stmt::If(cond, then, otherwise),
        };
        self.out.push(branch);
    }

    fn for_loop(&mut self, local: LocalId, low: ExprId, high: ExprId, body: Block) -> bool {
        let (low, high) = (self.resolve(low), self.resolve(high));
        if let (Some(&Const::Int(first)), Some(&Const::Int(end))) =
            (self.f.constant(low), self.f.constant(high))
        {
            if end <= first {
                return false;
            }
            if first.checked_add(1) == Some(end) && !jumps(&body) {
                // The counter is this constant wherever the body reads it.
                self.held[local.index()] = Some(low);
                return self.block(body);
            }
        }
        let mut stored = vec![local];
        stored_in(&body, &mut stored);
        self.forget(&stored);
        let (body, _) = self.scoped(body);
        self.forget(&stored);
        self.forget_unavailable();
        self.out.push(Stmt::For {
            local,
            low,
            high,
            body,
        });
        false
    }

    fn while_loop(&mut self, head: Block, test: ExprId, limit: u32, body: Block) {
        if limit == 0 {
            return;
        }
        let mut stored = Vec::new();
        stored_in(&head, &mut stored);
        stored_in(&body, &mut stored);
        self.forget(&stored);
        let outer = std::mem::take(&mut self.out);
        let mark = self.mark();
        self.block(head);
        let test = self.resolve(test);
        if let Some(Const::Bool(false)) = self.f.constant(test) {
            // The head runs once, for what it stores.
            let head = std::mem::replace(&mut self.out, outer);
            self.out.extend(head);
            return;
        }
        let head = std::mem::take(&mut self.out);
        let (body, _) = self.arm(test, true, body);
        self.close(mark);
        self.out = outer;
        self.forget(&stored);
        self.forget_unavailable();
        self.out.push(Stmt::While {
            head,
            test,
            limit,
            body,
        });
    }

    // ---- Scopes ----------------------------------------------------------------------------

    /// Rewrites a block of its own; what it computes is not available after it.
    fn scoped(&mut self, stmts: Block) -> (Block, bool) {
        let outer = std::mem::take(&mut self.out);
        let mark = self.mark();
        self.depth += 1;
        let left = self.block(stmts);
        self.depth -= 1;
        self.close(mark);
        (std::mem::replace(&mut self.out, outer), left)
    }

    fn mark(&self) -> (usize, usize) {
        let known = self.rules.table.as_ref().map_or(0, cse::Table::mark);
        (self.evaluated.len(), known)
    }

    fn close(&mut self, (evaluated, known): (usize, usize)) {
        for id in self.evaluated.drain(evaluated..) {
            self.available[id.index()] = false;
        }
        if let Some(table) = &mut self.rules.table {
            table.close(known);
        }
    }

    /// What variables hold after a branch both of whose sides go on.
    fn agreed(&self, a: &[Option<ExprId>], b: &[Option<ExprId>]) -> Vec<Option<ExprId>> {
        let both = a.iter().zip(b);
        let one = both.map(|pair| match pair {
            (Some(a), Some(b)) if self.same(*a, *b) => Some(*a),
            _ => None,
        });
        one.collect()
    }

    fn forget(&mut self, locals: &[LocalId]) {
        for local in locals {
            self.held[local.index()] = None;
        }
    }

    /// Forgets values that were computed in blocks now closed.
    fn forget_unavailable(&mut self) {
        for held in &mut self.held {
            if held.is_some_and(|id| {
                !self.available[id.index()] && !self.f.exprs[id.index()].kind.is_free()
            }) {
                *held = None;
            }
        }
    }
}

/// Adds the variables that a block stores to.
pub(in crate::passes) fn stored_in(block: &Block, out: &mut Vec<LocalId>) {
    for stmt in block {
        match stmt {
            Stmt::Store(local, ..) => out.push(*local),
            Stmt::If(_, a, b) => {
                stored_in(a, out);
                stored_in(b, out);
            }
            Stmt::For { local, body, .. } => {
                out.push(*local);
                stored_in(body, out);
            }
            Stmt::While { head, body, .. } => {
                stored_in(head, out);
                stored_in(body, out);
            }
            Stmt::Eval(_) | Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Does a loop's body leave or restart that loop?
fn jumps(block: &Block) -> bool {
    block.iter().any(|stmt| match stmt {
        Stmt::Break | Stmt::Continue => true,
        Stmt::If(_, a, b) => jumps(a) || jumps(b),
        Stmt::Eval(_) | Stmt::Store(..) | Stmt::For { .. } | Stmt::While { .. } => false,
    })
}
