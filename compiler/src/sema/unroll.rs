//! Loops over arrays: where the body of a `for` indexes something by the loop's variable, its turns
//! are lowered one by one, so that each index is known.

use crate::ast::{Block, Expr, ExprKind, IfExpr, Name, Stmt, StmtKind};
use crate::ir::Const;

use super::body::{Binding, Body, Operand};
use super::types::Ty;

/// Most turns of loops that are lowered one by one, those around them included.
const MAX_UNROLLED: u64 = 1024;

impl Body<'_, '_> {
    /// Is a loop over these turns lowered turn by turn?
    pub fn unrolls(&self, name: &Name, low: i64, high: i64, body: &Block) -> bool {
        let turns = u64::try_from(high.saturating_sub(low)).unwrap_or(0);
        turns > 0
            && self.turns.saturating_mul(turns) <= MAX_UNROLLED
            && indexes_by(body, &name.node)
            && !jumps(&body.stmts)
    }

    /// The turns of a loop from `low` to below `high`, one after the other.
    pub fn unrolled(&mut self, name: &Name, low: i64, high: i64, body: &Block) -> Option<()> {
        let outer = self.turns;
        self.turns = outer.saturating_mul(high.abs_diff(low));
        let mut ok = true;
        for turn in low..high {
            let known = self.cx.diagnostics.len();
            let value = self.constant(Const::Int(i32::try_from(turn).ok()?), name.span);
            self.scopes.open();
            let binding = Binding::Fixed(Operand::Value(value, Ty::Int));
            self.bind(name, binding, false);
            let (block, checks) = self.nested(body);
            self.scopes.close();
            for stmt in block {
                self.builder.stmt(stmt);
            }
            self.forget_repeated(known);
            ok = checks;
            if !ok {
                break;
            }
        }
        self.turns = outer;
        ok.then_some(())
    }

    /// Drops what was found from position `known` on and was reported before.
    fn forget_repeated(&mut self, known: usize) {
        for new in self.cx.diagnostics.split_off(known) {
            let same = |old: &crate::diag::Diagnostic| {
                (old.code, old.span, &old.message) == (new.code, new.span, &new.message)
            };
            if !self.cx.diagnostics.iter().any(same) {
                self.cx.diagnostics.push(new);
            }
        }
    }
}

/// Does a block index anything by a value that mentions `name`?
fn indexes_by(block: &Block, name: &str) -> bool {
    any_in_block(block, &mut |expr| match &expr.kind {
        ExprKind::Index(_, index) => any(index, &mut |e| match &e.kind {
            ExprKind::Name(used) => used == name,
            _ => false,
        }),
        _ => false,
    })
}

/// Do any of these statements leave the loop around them, or go to its next turn?
fn jumps(stmts: &[Stmt]) -> bool {
    stmts.iter().any(|stmt| match &stmt.kind {
        StmtKind::Break | StmtKind::Continue => true,
        StmtKind::If(branch) => branch_jumps(branch),
        _ => false,
    })
}

fn branch_jumps(branch: &IfExpr) -> bool {
    let within = |block: &Block| {
        let last = block.value.as_deref().map(|value| &value.kind);
        jumps(&block.stmts) || matches!(last, Some(ExprKind::If(inner)) if branch_jumps(inner))
    };
    within(&branch.then) || branch.otherwise.as_ref().is_some_and(within)
}

/// Does `found` hold for an expression in a block?
fn any_in_block(block: &Block, found: &mut dyn FnMut(&Expr) -> bool) -> bool {
    let mut in_stmt = |stmt: &Stmt| match &stmt.kind {
        StmtKind::Let { value, .. } => any(value, found),
        StmtKind::Assign { place, value, .. } => any(place, found) || any(value, found),
        StmtKind::If(branch) => any_in_branch(branch, found),
        StmtKind::For {
            low, high, body, ..
        } => any(low, found) || any(high, found) || any_in_block(body, found),
        StmtKind::While { cond, body, .. } => any(cond, found) || any_in_block(body, found),
        StmtKind::Assert(condition) => any(condition, found),
        StmtKind::Break | StmtKind::Continue => false,
    };
    block.stmts.iter().any(&mut in_stmt)
        || block.value.as_ref().is_some_and(|value| any(value, found))
}

fn any_in_branch(branch: &IfExpr, found: &mut dyn FnMut(&Expr) -> bool) -> bool {
    any(&branch.cond, found)
        || any_in_block(&branch.then, found)
        || branch
            .otherwise
            .as_ref()
            .is_some_and(|block| any_in_block(block, found))
}

/// Does `found` hold for an expression or one in it?
fn any(expr: &Expr, found: &mut dyn FnMut(&Expr) -> bool) -> bool {
    if found(expr) {
        return true;
    }
    match &expr.kind {
        ExprKind::Call { args, .. } => args.iter().any(|arg| any(&arg.value, found)),
        ExprKind::Array(elements) => elements.iter().any(|element| any(element, found)),
        ExprKind::Field(base, _) | ExprKind::Unary(_, base) => any(base, found),
        ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) => any(a, found) || any(b, found),
        ExprKind::If(branch) => any_in_branch(branch, found),
        ExprKind::Block(block) => any_in_block(block, found),
        _ => false,
    }
}
