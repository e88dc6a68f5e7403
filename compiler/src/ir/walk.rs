//! Going over what a function does: the blocks within statements, what is evaluated and called.
//! Passes, code generation and analyses ask here, so that a new statement is taught to them once.

use super::{Block, ExprId, ExprKind, Function, FunctionId, LocalId, Stmt};

/// Most blocks within each other in the body of a function: with the body's, WGSL allows 127.
pub const MAX_NESTING: usize = 126;

impl Stmt {
    /// The blocks within a statement, in the order they run.
    pub fn blocks(&self) -> impl Iterator<Item = &Block> {
        let (first, second) = match self {
            Stmt::If(_, a, b) => (Some(a), Some(b)),
            Stmt::For { body, .. } => (Some(body), None),
            Stmt::While { head, body, .. } => (Some(head), Some(body)),
            Stmt::Eval(_) | Stmt::Store(..) | Stmt::Break | Stmt::Continue => (None, None),
        };
        first.into_iter().chain(second)
    }

    /// The statement with `change` made to each block within it.
    pub fn map_blocks(mut self, mut change: impl FnMut(Block) -> Block) -> Stmt {
        let mut replace = |block: &mut Block| *block = change(std::mem::take(block));
        match &mut self {
            Stmt::If(_, a, b) => {
                replace(a);
                replace(b);
            }
            Stmt::For { body, .. } => replace(body),
            Stmt::While { head, body, .. } => {
                replace(head);
                replace(body);
            }
            Stmt::Eval(_) | Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
        }
        self
    }
}

/// New numbers for the expressions and variables of statements that are copied elsewhere.
pub trait Renumber {
    /// The number of an expression in the copy.
    fn expr(&self, id: ExprId) -> ExprId;
    /// The number of a variable in the copy.
    fn local(&self, id: LocalId) -> LocalId;

    /// A copy of statements.
    fn block(&self, block: &Block) -> Block {
        block.iter().map(|s| self.stmt(s)).collect()
    }

    /// A copy of a statement.
    fn stmt(&self, stmt: &Stmt) -> Stmt {
        match stmt {
            Stmt::Eval(id) => Stmt::Eval(self.expr(*id)),
            Stmt::Store(local, part, value) => {
                Stmt::Store(self.local(*local), *part, self.expr(*value))
            }
            Stmt::If(cond, a, b) => Stmt::If(self.expr(*cond), self.block(a), self.block(b)),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => Stmt::For {
                local: self.local(*local),
                low: self.expr(*low),
                high: self.expr(*high),
                body: self.block(body),
            },
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => Stmt::While {
                head: self.block(head),
                test: self.expr(*test),
                limit: *limit,
                body: self.block(body),
            },
            Stmt::Break => Stmt::Break,
            Stmt::Continue => Stmt::Continue,
        }
    }
}

impl Function {
    /// Every expression that is evaluated, in the order of the text.
    pub fn evaluated(&self) -> Vec<ExprId> {
        let mut all = Vec::with_capacity(self.exprs.len());
        for_each_evaluated(&self.body, &mut |id| all.push(id));
        all
    }

    /// How many expressions are evaluated.
    pub fn evaluated_count(&self) -> usize {
        let mut count = 0;
        for_each_evaluated(&self.body, &mut |_| count += 1);
        count
    }

    /// The functions that are called, once for each call.
    pub fn calls(&self) -> impl Iterator<Item = FunctionId> {
        let called = |id| match self.expr(id).kind {
            ExprKind::Call(callee, _) => Some(callee),
            _ => None,
        };
        self.evaluated().into_iter().filter_map(called)
    }
}

fn for_each_evaluated(block: &Block, visit: &mut impl FnMut(ExprId)) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => visit(*id),
            _ => stmt
                .blocks()
                .for_each(|inner| for_each_evaluated(inner, visit)),
        }
    }
}

/// Blocks within each other in the text of a block, at most: fewer where an `else` has an `if` only.
pub fn nesting(block: &Block) -> usize {
    let each = block.iter().map(|stmt| {
        let inner = stmt.blocks().map(nesting).max();
        // The test of a `while` stands in a block of its own.
        let least = usize::from(matches!(stmt, Stmt::While { .. }));
        inner.map_or(0, |inner| 1 + inner.max(least))
    });
    each.max().unwrap_or(0)
}
