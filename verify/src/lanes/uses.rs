//! How often the values of a function are read, so that each can go with its last reader.
//!
//! Told are values that are read only by the statements of the block that makes them: what a loop
//! or a branch reads from outside stays until the function ends.

use impasto_compiler::ir::{Block, ExprId, Function, Stmt};

/// No block, and so many reads that none is the last.
const KEPT: u32 = u32::MAX;

/// The readers of each value.
pub struct Uses {
    /// Of the values of one block; `KEPT` for the others.
    total: Vec<u32>,
    /// Those to come.
    left: Vec<u32>,
}

impl Uses {
    pub fn of(f: &Function) -> Self {
        let mut count = Count {
            f,
            home: vec![KEPT; f.exprs.len()],
            total: vec![0; f.exprs.len()],
            blocks: 0,
        };
        count.block(&f.body);
        count.read(f.value, KEPT);
        Self {
            left: count.total.clone(),
            total: count.total,
        }
    }

    /// A value was made, perhaps again.
    pub fn made(&mut self, id: ExprId) {
        self.left[id.index()] = self.total[id.index()];
    }

    /// A value is read: for the last time?
    pub fn was_last(&mut self, id: ExprId) -> bool {
        let left = &mut self.left[id.index()];
        if *left == KEPT || *left == 0 {
            return false;
        }
        *left -= 1;
        *left == 0
    }
}

/// Counting.
struct Count<'a> {
    f: &'a Function,
    /// The block that makes each value.
    home: Vec<u32>,
    total: Vec<u32>,
    blocks: u32,
}

impl Count<'_> {
    fn block(&mut self, block: &Block) {
        let here = self.blocks;
        self.blocks += 1;
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => {
                    let f = self.f;
                    let operands = f.expr(*id).kind.operands();
                    operands.iter().for_each(|&a| self.read(a, here));
                    self.home[id.index()] = here;
                }
                Stmt::Store(_, _, value) => self.read(*value, here),
                Stmt::If(cond, then, otherwise) => {
                    self.read(*cond, here);
                    self.block(then);
                    self.block(otherwise);
                }
                Stmt::For {
                    low, high, body, ..
                } => {
                    self.read(*low, here);
                    self.read(*high, here);
                    self.block(body);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    self.block(head);
                    self.read(*test, KEPT);
                    self.block(body);
                }
                Stmt::Break | Stmt::Continue => {}
            }
        }
    }

    /// A statement of block `here` reads a value.
    fn read(&mut self, id: ExprId, here: u32) {
        let i = id.index();
        let free = self.f.expr(id).kind.is_free();
        if free || self.home[i] != here || self.total[i] == KEPT {
            self.total[i] = KEPT;
        } else {
            self.total[i] += 1;
        }
    }
}
