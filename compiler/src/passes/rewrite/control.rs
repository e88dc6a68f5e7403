//! Statements, branches and loops of the shared walk, and what is known where they meet.

use super::Rewriter;
use super::held::{self, Change, Mark};
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
        let held = self.held.get(local);
        if part.is_none() && held.is_some_and(|h| self.same(h, value)) {
            return;
        }
        self.held.set(local, part.is_none().then_some(value));
        self.out.push(Stmt::Store(local, part, value));
    }

    fn branch(&mut self, cond: ExprId, then: Block, otherwise: Block) -> bool {
        let cond = self.resolve(cond);
        if let Some(Const::Bool(taken)) = self.f.constant(cond) {
            return self.block(if *taken { then } else { otherwise });
        }
        let before = self.held.mark();
        let (then, then_left) = self.arm(cond, true, then);
        let by_then = self.held.back_to(before);
        let (otherwise, otherwise_left) = self.arm(cond, false, otherwise);
        let by_otherwise = self.held.back_to(before);
        match (then_left, otherwise_left) {
            (true, _) => self.go_on(&by_otherwise),
            (false, true) => self.go_on(&by_then),
            (false, false) => self.meet(&by_then, &by_otherwise),
        }
        self.emit_branch(cond, then, otherwise, [&by_then, &by_otherwise]);
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
        changes: [&[Change]; 2],
    ) {
        if then == otherwise {
            // Nothing is evaluated twice, so these are empty, or the same stores and jumps.
            self.out.extend(then);
            return;
        }
        self.via = self.f.expr(cond).via;
        if self.rules.simplify && simplify::pick(self, cond, &then, &otherwise, changes) {
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
                self.held.set(local, Some(low));
                return self.block(body);
            }
        }
        let mut stored = vec![local];
        stored_in(&body, &mut stored);
        let before = self.held.mark();
        self.forget(&stored);
        let (body, _) = self.scoped(body);
        self.forget(&stored);
        self.forget_unavailable(before);
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
        let before = self.held.mark();
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
        self.forget_unavailable(before);
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

    /// What a variable held before a branch whose sides made these changes.
    pub fn before(&self, local: LocalId, changes: [&[Change]; 2]) -> Option<ExprId> {
        let changed = changes.iter().find_map(|side| held::find(side, local));
        changed.map_or_else(|| self.held.get(local), |c| c.before)
    }

    /// Goes on after a branch of which one side does.
    fn go_on(&mut self, changes: &[Change]) {
        for change in changes {
            self.hold(change.local, change.after);
        }
    }

    /// Goes on after a branch both of whose sides do: variables hold what they agree on.
    fn meet(&mut self, then: &[Change], otherwise: &[Change]) {
        let alone = |c: &&Change| held::find(then, c.local).is_none();
        let by_then = then.iter().map(|c| {
            let other = held::find(otherwise, c.local);
            (c.local, c.after, other.map_or(c.before, |o| o.after))
        });
        let by_otherwise = otherwise.iter().filter(alone);
        let by_otherwise = by_otherwise.map(|c| (c.local, c.before, c.after));
        for (local, a, b) in by_then.chain(by_otherwise) {
            let agreed = match (a, b) {
                (Some(a), Some(b)) if self.same(a, b) => Some(a),
                _ => None,
            };
            self.hold(local, agreed);
        }
    }

    fn forget(&mut self, locals: &[LocalId]) {
        for local in locals {
            self.held.set(*local, None);
        }
    }

    /// Forgets values since `mark` that were computed in blocks now closed.
    fn forget_unavailable(&mut self, mark: Mark) {
        for local in self.held.since(mark) {
            self.hold(local, self.held.get(local));
        }
    }

    /// A variable holds a value from now on, if that is still there.
    fn hold(&mut self, local: LocalId, value: Option<ExprId>) {
        let is_free = |id: &ExprId| self.f.expr(*id).kind.is_free();
        let there = value.filter(|id| self.available[id.index()] || is_free(id));
        self.held.set(local, there);
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
