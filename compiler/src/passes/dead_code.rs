//! Removes what nothing reads: values, stores to variables that are never loaded, empty branches.
//!
//! All functions are pure, so an unused call goes as well. What is left is numbered anew in the
//! order of evaluation, so that equal code has equal text however it came about.

use super::rewrite::operands_mut;
use crate::ir::{Block, CallSite, Expr, ExprId, ExprKind, Function, Local, LocalId, SiteId, Stmt};

/// The pass.
pub fn dead_code(f: &mut Function) -> bool {
    remove(f);
    true
}

/// Removes dead code in place.
pub fn remove(f: &mut Function) {
    let mut live = Live {
        exprs: vec![false; f.exprs.len()],
        locals: vec![false; f.locals.len()],
    };
    live.mark(f, f.value);
    // A store matters once its variable is loaded by something live, and makes its operand live;
    // repeat until nothing changes.
    let body = std::mem::take(&mut f.body);
    while live.block(f, &body) {}
    f.body = sweep(body, &live);
    Renumber::function(f);
}

struct Live {
    exprs: Vec<bool>,
    locals: Vec<bool>,
}

impl Live {
    /// Marks an expression and what it reads; true if that is new.
    fn mark(&mut self, f: &Function, id: ExprId) -> bool {
        if std::mem::replace(&mut self.exprs[id.index()], true) {
            return false;
        }
        let mut pending = vec![id];
        while let Some(id) = pending.pop() {
            let kind = &f.expr(id).kind;
            if let ExprKind::Load(local) = kind {
                self.locals[local.index()] = true;
            }
            for &operand in kind.operands() {
                if !std::mem::replace(&mut self.exprs[operand.index()], true) {
                    pending.push(operand);
                }
            }
        }
        true
    }

    /// Marks what live stores and control flow read; true if anything was new.
    fn block(&mut self, f: &Function, block: &Block) -> bool {
        let mut changed = false;
        // From the end: what is read there says what matters before.
        for stmt in block.iter().rev() {
            changed |= self.stmt(f, stmt);
        }
        changed
    }

    fn stmt(&mut self, f: &Function, stmt: &Stmt) -> bool {
        if !self.needed(stmt) {
            return false;
        }
        match stmt {
            Stmt::Eval(_) | Stmt::Break | Stmt::Continue => false,
            Stmt::Store(_, _, value) => self.mark(f, *value),
            Stmt::If(cond, then, otherwise) => {
                self.block(f, otherwise) | self.block(f, then) | self.mark(f, *cond)
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let counter = !std::mem::replace(&mut self.locals[local.index()], true);
                let bounds = self.mark(f, *low) | self.mark(f, *high);
                self.block(f, body) | counter | bounds
            }
            Stmt::While {
                head, test, body, ..
            } => self.block(f, body) | self.block(f, head) | self.mark(f, *test),
        }
    }

    /// Is a statement seen from outside? Jumps are, as long as their loop is there at all.
    fn needed(&self, stmt: &Stmt) -> bool {
        match stmt {
            Stmt::Eval(id) => self.exprs[id.index()],
            Stmt::Store(local, ..) => self.locals[local.index()],
            Stmt::If(_, a, b) => a
                .iter()
                .chain(b)
                .any(|s| self.needed(s) && !matches!(s, Stmt::Eval(_))),
            Stmt::For { body, .. } => self.has_effect(body),
            Stmt::While { head, body, .. } => self.has_effect(head) || self.has_effect(body),
            Stmt::Break | Stmt::Continue => true,
        }
    }

    /// Does a block change a variable that matters?
    fn has_effect(&self, block: &Block) -> bool {
        block.iter().any(|stmt| match stmt {
            Stmt::Store(local, ..) => self.locals[local.index()],
            Stmt::If(_, a, b) => self.has_effect(a) || self.has_effect(b),
            Stmt::For { body, .. } => self.has_effect(body),
            Stmt::While { head, body, .. } => self.has_effect(head) || self.has_effect(body),
            Stmt::Eval(_) | Stmt::Break | Stmt::Continue => false,
        })
    }
}

/// Keeps what is needed. Statements of a loop that is dropped are dropped with it.
fn sweep(block: Block, live: &Live) -> Block {
    let kept = block.into_iter().filter(|stmt| live.needed(stmt));
    kept.map(|stmt| stmt.map_blocks(|inner| sweep(inner, live)))
        .collect()
}

/// Numbers expressions and variables in the order in which statements mention them.
struct Renumber<'a> {
    old: &'a mut Function,
    exprs: Vec<Expr>,
    expr_ids: Vec<Option<ExprId>>,
    locals: Vec<Local>,
    local_ids: Vec<Option<LocalId>>,
}

impl Renumber<'_> {
    fn function(f: &mut Function) {
        let mut body = std::mem::take(&mut f.body);
        let mut this = Renumber {
            expr_ids: vec![None; f.exprs.len()],
            local_ids: vec![None; f.locals.len()],
            exprs: Vec::new(),
            locals: Vec::new(),
            old: f,
        };
        this.block(&mut body);
        let value = this.expr(this.old.value);
        let (exprs, locals) = (this.exprs, this.locals);
        (f.exprs, f.locals, f.value, f.body) = (exprs, locals, value, body);
        number_sites(f);
    }

    /// The new number of an expression, which is taken over with what it reads.
    fn expr(&mut self, id: ExprId) -> ExprId {
        if let Some(known) = self.expr_ids[id.index()] {
            return known;
        }
        // Operands have been evaluated, or are free and read nothing: no deep recursion.
        let mut expr = take(&mut self.old.exprs[id.index()]);
        if let ExprKind::Load(local) = &mut expr.kind {
            *local = self.local(*local);
        }
        for operand in operands_mut(&mut expr.kind) {
            *operand = self.expr(*operand);
        }
        let new = ExprId(self.exprs.len() as u32);
        self.exprs.push(expr);
        self.expr_ids[id.index()] = Some(new);
        new
    }

    fn local(&mut self, id: LocalId) -> LocalId {
        if let Some(known) = self.local_ids[id.index()] {
            return known;
        }
        let new = LocalId(self.locals.len() as u32);
        self.locals.push(self.old.locals[id.index()].clone());
        self.local_ids[id.index()] = Some(new);
        new
    }

    fn block(&mut self, block: &mut Block) {
        for stmt in block {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &mut Stmt) {
        match stmt {
            Stmt::Eval(id) => *id = self.expr(*id),
            Stmt::Store(local, _, value) => {
                *value = self.expr(*value);
                *local = self.local(*local);
            }
            Stmt::If(cond, a, b) => {
                *cond = self.expr(*cond);
                self.block(a);
                self.block(b);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                *low = self.expr(*low);
                *high = self.expr(*high);
                *local = self.local(*local);
                self.block(body);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                self.block(head);
                *test = self.expr(*test);
                self.block(body);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Numbers the calls that some expression stands in place of in the order of the expressions, and
/// forgets the others.
fn number_sites(f: &mut Function) {
    let old = std::mem::take(&mut f.sites);
    let mut known: Vec<Option<SiteId>> = vec![None; old.len()];
    let mut pending = Vec::new();
    for i in 0..f.exprs.len() {
        let mut via = f.exprs[i].via;
        while let Some(id) = via.filter(|id| known[id.index()].is_none()) {
            pending.push(id);
            via = old[id.index()].via;
        }
        // From the outermost in.
        while let Some(id) = pending.pop() {
            let CallSite { span, via } = old[id.index()];
            let via = via.and_then(|outer| known[outer.index()]);
            known[id.index()] = Some(SiteId(f.sites.len() as u32));
            f.sites.push(CallSite { span, via });
        }
        f.exprs[i].via = f.exprs[i].via.and_then(|id| known[id.index()]);
    }
}

/// Takes an expression out of an arena that is thrown away.
fn take(expr: &mut Expr) -> Expr {
    let (ty, span, via) = (expr.ty, expr.span, expr.via);
    let kind = std::mem::replace(&mut expr.kind, ExprKind::Param(0));
    let name = expr.name.take();
    Expr {
        kind,
        ty,
        span,
        via,
        name,
    }
}
