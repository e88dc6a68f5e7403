//! How large a function is once constant arguments have decided its branches, and which of its calls
//! may go with them.

use crate::ir::build::fold_op;
use crate::ir::{Block, Const, ExprId, ExprKind, Function, FunctionId, Stmt};

/// Operations within operations that a condition is looked into.
const DEPTH: u32 = 8;

/// Do constants among `args` decide branches of `callee`, called from `f`, so that at most `most`
/// expressions are left of it?
pub(super) fn leaves(callee: &Function, f: &Function, args: &[ExprId], most: u32) -> bool {
    let constants: Vec<Option<&Const>> = args.iter().map(|&a| f.constant(a)).collect();
    if constants.iter().all(Option::is_none) {
        return false;
    }
    let mut count = Count {
        callee,
        constants,
        decided: false,
        left: 0,
        most,
    };
    count.block(&callee.body);
    count.decided && count.left <= most
}

struct Count<'a> {
    callee: &'a Function,
    /// The arguments, where constant.
    constants: Vec<Option<&'a Const>>,
    /// Was a branch decided?
    decided: bool,
    /// Expressions that are left, as far as counted: no further than `most`.
    left: u32,
    most: u32,
}

impl Count<'_> {
    fn block(&mut self, block: &Block) {
        for stmt in block {
            if self.left > self.most {
                return;
            }
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::Eval(_) => self.left += 1,
            Stmt::If(cond, then, otherwise) => match self.value(*cond, DEPTH) {
                Some(Const::Bool(taken)) => {
                    self.decided = true;
                    self.block(if taken { then } else { otherwise });
                }
                _ => {
                    self.block(then);
                    self.block(otherwise);
                }
            },
            Stmt::For { body, .. } => self.block(body),
            Stmt::While { head, body, .. } => {
                self.block(head);
                self.block(body);
            }
            Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
        }
    }

    /// The constant that an expression of the callee is in this call.
    fn value(&self, id: ExprId, depth: u32) -> Option<Const> {
        match &self.callee.expr(id).kind {
            ExprKind::Const(c) => Some(c.clone()),
            ExprKind::Param(i) => self.constants.get(*i as usize).copied().flatten().cloned(),
            ExprKind::Op(op, args) if depth > 0 => {
                let values = args.iter().map(|&a| self.value(a, depth - 1));
                let values: Vec<Const> = values.collect::<Option<_>>()?;
                fold_op(*op, &values.iter().collect::<Vec<_>>())
            }
            _ => None,
        }
    }
}

/// The functions that `f` calls in branches that its arguments alone decide.
pub(super) fn optional_calls(f: &Function) -> Vec<FunctionId> {
    let mut found = Vec::new();
    calls_in(f, &f.body, false, &mut found);
    found
}

fn calls_in(f: &Function, block: &Block, optional: bool, found: &mut Vec<FunctionId>) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => match f.expr(*id).kind {
                ExprKind::Call(callee, _) if optional => found.push(callee),
                _ => {}
            },
            Stmt::If(cond, then, otherwise) => {
                let optional = optional || of_arguments(f, *cond, DEPTH);
                calls_in(f, then, optional, found);
                calls_in(f, otherwise, optional, found);
            }
            Stmt::For { body, .. } => calls_in(f, body, optional, found),
            Stmt::While { head, body, .. } => {
                calls_in(f, head, optional, found);
                calls_in(f, body, optional, found);
            }
            Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Do parameters and constants alone make an expression?
fn of_arguments(f: &Function, id: ExprId, depth: u32) -> bool {
    match &f.expr(id).kind {
        ExprKind::Const(_) | ExprKind::Param(_) => true,
        ExprKind::Op(_, args) if depth > 0 => args.iter().all(|&a| of_arguments(f, a, depth - 1)),
        _ => false,
    }
}
