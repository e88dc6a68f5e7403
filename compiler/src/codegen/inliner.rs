//! Which values stand where they are used, so that text reads as a person would write it: those used
//! once, right after, and not too large.

use crate::ir::{Block, ExprId, ExprKind, Function, Stmt};

/// Operations that may stand in one expression before it gets a name.
const MAX_INLINE: u32 = 7;

/// Is a value written where it is used? By expression.
pub fn decide(f: &Function) -> Vec<bool> {
    Inliner::decide(f)
}

/// Decides which values stand where they are used.
struct Inliner<'a> {
    f: &'a Function,
    uses: Vec<u32>,
    inline: Vec<bool>,
    size: Vec<u32>,
    loads: Vec<bool>,
}

impl<'a> Inliner<'a> {
    fn decide(f: &'a Function) -> Vec<bool> {
        let n = f.exprs.len();
        let mut this = Self {
            f,
            uses: vec![0; n],
            inline: vec![false; n],
            size: vec![1; n],
            loads: vec![false; n],
        };
        this.count(&f.body);
        this.uses[f.value.index()] += 1;
        let mut pending = this.block(&f.body);
        this.consume(f.value, &mut pending);
        this.inline
    }

    fn count(&mut self, block: &Block) {
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => self
                    .f
                    .expr(*id)
                    .kind
                    .operands()
                    .iter()
                    .for_each(|a| self.uses[a.index()] += 1),
                Stmt::Store(_, _, value) => self.uses[value.index()] += 1,
                Stmt::If(cond, a, b) => {
                    self.uses[cond.index()] += 1;
                    self.count(a);
                    self.count(b);
                }
                Stmt::For {
                    low, high, body, ..
                } => {
                    self.uses[low.index()] += 1;
                    // The bound stands in the loop's condition: never move work into it.
                    self.uses[high.index()] += 2;
                    self.count(body);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    self.count(head);
                    self.uses[test.index()] += 1;
                    self.count(body);
                }
                Stmt::Break | Stmt::Continue => {}
            }
        }
    }

    /// Walks a block; gives the values that could still move to a use right after it.
    fn block(&mut self, block: &Block) -> Vec<ExprId> {
        let mut pending: Vec<ExprId> = Vec::new();
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => {
                    for operand in self.f.expr(*id).kind.operands() {
                        self.consume(*operand, &mut pending);
                    }
                    self.measure(*id);
                    pending.push(*id);
                }
                Stmt::Store(_, _, value) => {
                    self.consume(*value, &mut pending);
                    pending.retain(|p| !self.loads[p.index()]);
                }
                Stmt::If(cond, a, b) => {
                    self.consume(*cond, &mut pending);
                    self.block(a);
                    self.block(b);
                    pending.retain(|p| !self.loads[p.index()]);
                }
                Stmt::For { low, body, .. } => {
                    self.consume(*low, &mut pending);
                    self.block(body);
                    pending.retain(|p| !self.loads[p.index()]);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    let mut inner = self.block(head);
                    self.consume(*test, &mut inner);
                    self.block(body);
                    pending.retain(|p| !self.loads[p.index()]);
                }
                Stmt::Break | Stmt::Continue => {}
            }
        }
        pending
    }

    fn consume(&mut self, id: ExprId, pending: &mut Vec<ExprId>) {
        let movable = self.uses[id.index()] == 1
            && self.f.expr(id).name.is_none()
            && self.size[id.index()] <= MAX_INLINE;
        if let Some(at) = pending.iter().position(|p| *p == id)
            && movable
        {
            self.inline[id.index()] = true;
            pending.remove(at);
        }
    }

    fn measure(&mut self, id: ExprId) {
        let kind = &self.f.expr(id).kind;
        let inlined = kind.operands().iter().filter(|a| self.inline[a.index()]);
        let size: u32 = inlined.clone().map(|a| self.size[a.index()]).sum();
        self.size[id.index()] = size + 1;
        self.loads[id.index()] =
            matches!(kind, ExprKind::Load(_)) || inlined.clone().any(|a| self.loads[a.index()]);
    }
}
