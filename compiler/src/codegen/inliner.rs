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
    /// The block, by its number from 1, in which a value could still move to a use right after
    /// it; 0 for none.
    movable: Vec<u32>,
    blocks: u32,
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
            movable: vec![0; n],
            blocks: 0,
        };
        this.count(&f.body);
        this.uses[f.value.index()] += 1;
        let body = this.block(&f.body);
        this.consume(f.value, body);
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

    /// Walks a block; gives its number.
    fn block(&mut self, block: &Block) -> u32 {
        self.blocks += 1;
        let own = self.blocks;
        // Values that read variables, since the last change of any.
        let mut reads: Vec<ExprId> = Vec::new();
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => {
                    for operand in self.f.expr(*id).kind.operands() {
                        self.consume(*operand, own);
                    }
                    self.measure(*id);
                    self.movable[id.index()] = own;
                    if self.loads[id.index()] {
                        reads.push(*id);
                    }
                    continue;
                }
                Stmt::Store(_, _, value) => self.consume(*value, own),
                Stmt::If(cond, a, b) => {
                    self.consume(*cond, own);
                    self.block(a);
                    self.block(b);
                }
                Stmt::For { low, body, .. } => {
                    self.consume(*low, own);
                    self.block(body);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    let head = self.block(head);
                    self.consume(*test, head);
                    self.block(body);
                }
                Stmt::Break | Stmt::Continue => continue,
            }
            for id in reads.drain(..) {
                self.movable[id.index()] = 0;
            }
        }
        own
    }

    /// Notes a use in the block `own`.
    fn consume(&mut self, id: ExprId, own: u32) {
        let wanted = self.uses[id.index()] == 1
            && self.f.expr(id).name.is_none()
            && self.size[id.index()] <= MAX_INLINE;
        if wanted && self.movable[id.index()] == own {
            self.inline[id.index()] = true;
            self.movable[id.index()] = 0;
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
