//! Where in a function's text variables change, and how long what was read of them is used.

use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Stmt};

/// Positions of statements, counted in the order of the text.
pub(super) struct Positions {
    /// Where each expression is evaluated.
    evaluated: Vec<usize>,
    /// Where the last statement stands that names it.
    named: Vec<usize>,
    /// Where it is last used, itself or as part of something.
    last_use: Vec<usize>,
    /// Where each variable changes, ascending.
    changes: Vec<Vec<usize>>,
    /// First and last position of each loop, and the loop around it.
    loops: Vec<(usize, usize, Option<usize>)>,
    /// The innermost loop around each position.
    around: Vec<Option<usize>>,
}

impl Positions {
    /// Of a function whose expressions are evaluated where they are used if they are `inlined`.
    pub fn of(f: &Function, inlined: &[bool]) -> Self {
        let mut this = Self {
            evaluated: vec![0; f.exprs.len()],
            named: vec![0; f.exprs.len()],
            last_use: vec![0; f.exprs.len()],
            changes: vec![Vec::new(); f.locals.len()],
            loops: Vec::new(),
            around: Vec::new(),
        };
        let mut uses = Vec::new();
        this.block(&f.body, None, &mut uses);
        let end = this.next(None);
        uses.push((end, Use::By(f.value)));
        // Last first: when an expression is met, all that use it have been.
        for (at, used) in uses.into_iter().rev() {
            match used {
                Use::By(id) => this.use_at(id, at, at),
                Use::Eval(id) => this.operands(f, id, at, inlined),
            }
        }
        this
    }

    /// Does `local` keep, as long as it is used, the value that the expression `load` reads of it?
    pub fn stays(&self, load: ExprId, local: LocalId) -> bool {
        let from = self.evaluated[load.index()];
        let mut to = self.last_use[load.index()];
        // What is used in a loop that it was not made in is used until the loop's end.
        let mut around = self.around.get(to).copied().flatten();
        while let Some(i) = around {
            let (first, last, outer) = self.loops[i];
            if first <= from {
                break;
            }
            to = last;
            around = outer;
        }
        let changes = &self.changes[local.index()];
        let next = changes.partition_point(|&at| at <= from);
        changes.get(next).is_none_or(|&at| at >= to)
    }

    fn next(&mut self, inside: Option<usize>) -> usize {
        self.around.push(inside);
        self.around.len() - 1
    }

    /// A use by what stands at `at`, the last as part of that being at `until`.
    fn use_at(&mut self, id: ExprId, at: usize, until: usize) {
        let named = &mut self.named[id.index()];
        *named = at.max(*named);
        let last = &mut self.last_use[id.index()];
        *last = until.max(*last);
    }

    /// The uses by an expression that stands at `at`.
    fn operands(&mut self, f: &Function, id: ExprId, at: usize, inlined: &[bool]) {
        let at = if inlined[id.index()] {
            self.named[id.index()]
        } else {
            at
        };
        self.evaluated[id.index()] = at;
        let kind = &f.expr(id).kind;
        // Parts are used as long as what they are part of.
        let until = match kind {
            ExprKind::Op(..) | ExprKind::Call(..) => at,
            _ => at.max(self.last_use[id.index()]),
        };
        for &operand in kind.operands() {
            self.use_at(operand, at, until);
        }
    }

    fn block(&mut self, block: &Block, inside: Option<usize>, uses: &mut Vec<(usize, Use)>) {
        for stmt in block {
            self.stmt(stmt, inside, uses);
        }
    }

    fn stmt(&mut self, stmt: &Stmt, inside: Option<usize>, uses: &mut Vec<(usize, Use)>) {
        let at = self.next(inside);
        match stmt {
            Stmt::Eval(id) => uses.push((at, Use::Eval(*id))),
            Stmt::Store(local, _, value) => {
                self.changes[local.index()].push(at);
                uses.push((at, Use::By(*value)));
            }
            Stmt::If(cond, a, b) => {
                uses.push((at, Use::By(*cond)));
                self.block(a, inside, uses);
                self.block(b, inside, uses);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                uses.extend([(at, Use::By(*low)), (at, Use::By(*high))]);
                let this = self.open(inside);
                let start = self.next(Some(this));
                self.changes[local.index()].push(start);
                // The bound is asked for in every turn.
                uses.push((start, Use::By(*high)));
                self.block(body, Some(this), uses);
                self.close(this);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                let this = self.open(inside);
                self.block(head, Some(this), uses);
                let tested = self.next(Some(this));
                uses.push((tested, Use::By(*test)));
                self.block(body, Some(this), uses);
                self.close(this);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }

    fn open(&mut self, outer: Option<usize>) -> usize {
        let here = self.around.len();
        self.loops.push((here, here, outer));
        self.loops.len() - 1
    }

    fn close(&mut self, this: usize) {
        self.loops[this].1 = self.next(Some(this));
    }
}

/// A statement's use of values.
enum Use {
    /// It needs this one.
    By(ExprId),
    /// It evaluates this expression, and needs its operands.
    Eval(ExprId),
}
