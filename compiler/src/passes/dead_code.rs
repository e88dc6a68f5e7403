//! Removes what nothing reads: values, stores to variables that are never loaded, empty branches.
//!
//! All functions are pure, so an unused call goes as well. What is left is numbered anew in the
//! order of evaluation, so that equal code has equal text however it came about.

use crate::ir::{Block, CallSite, Expr, ExprId, ExprKind, Function, Local, LocalId, SiteId, Stmt};

/// The pass.
pub fn dead_code(f: &mut Function) -> bool {
    remove(f);
    true
}

/// Removes dead code in place.
pub fn remove(f: &mut Function) {
    let body = std::mem::take(&mut f.body);
    let live = Live::of(f, &body);
    f.body = sweep(body, &live);
    let kept = live.exprs.iter().filter(|is_live| **is_live).count();
    Renumber::function(f, kept);
}

/// What is read.
struct Live {
    exprs: Vec<bool>,
    locals: Vec<bool>,
    /// Room for expressions whose operands are to be marked.
    marking: Vec<ExprId>,
}

impl Live {
    /// What the value of a function with this body reads, and what decides how it comes to it.
    fn of(f: &Function, body: &Block) -> Self {
        let mut places = Places::of(body);
        let mut live = Self {
            exprs: vec![false; f.exprs.len()],
            locals: vec![false; f.locals.len()],
            marking: Vec::new(),
        };
        // Of variables that became live the stores are looked at, and of statements that became
        // needed what decides about them: each once.
        let mut pending = Vec::new();
        live.mark(f, f.value, &mut pending);
        while let Some(local) = pending.pop() {
            let first = places.stores.partition_point(|s| s.local < local);
            let stores = places.stores[first..].iter();
            let stores: Vec<Store> = stores.take_while(|s| s.local == local).copied().collect();
            for store in stores {
                live.mark(f, store.value, &mut pending);
                live.need(f, store.within, &mut places, &mut pending);
            }
        }
        live
    }

    /// Marks an expression and what it reads. Variables that become live go to `pending`.
    fn mark(&mut self, f: &Function, id: ExprId, pending: &mut Vec<LocalId>) {
        if std::mem::replace(&mut self.exprs[id.index()], true) {
            return;
        }
        self.marking.push(id);
        while let Some(id) = self.marking.pop() {
            let kind = &f.expr(id).kind;
            if let ExprKind::Load(local) = kind {
                self.mark_local(*local, pending);
            }
            for &operand in kind.operands() {
                if !std::mem::replace(&mut self.exprs[operand.index()], true) {
                    self.marking.push(operand);
                }
            }
        }
    }

    fn mark_local(&mut self, local: LocalId, pending: &mut Vec<LocalId>) {
        if !std::mem::replace(&mut self.locals[local.index()], true) {
            pending.push(local);
        }
    }

    /// A branch or loop is needed, and so is what it stands in. With a loop its jumps are.
    fn need(
        &mut self,
        f: &Function,
        within: Option<usize>,
        places: &mut Places,
        pending: &mut Vec<LocalId>,
    ) {
        let mut all: Vec<usize> = within.into_iter().collect();
        while let Some(at) = all.pop() {
            let place = &mut places.all[at];
            if std::mem::replace(&mut place.needed, true) {
                continue;
            }
            all.extend(place.within);
            all.append(&mut place.jumps);
            let (reads, counter) = (place.reads, place.counter);
            for id in reads.into_iter().flatten() {
                self.mark(f, id, pending);
            }
            if let Some(local) = counter {
                self.mark_local(local, pending);
            }
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

/// The branches and loops of a body, and its stores.
#[derive(Default)]
struct Places {
    all: Vec<Place>,
    /// In the order of variables.
    stores: Vec<Store>,
}

/// A branch or loop.
struct Place {
    /// The branch or loop that it stands in.
    within: Option<usize>,
    /// What decides about it.
    reads: [Option<ExprId>; 2],
    /// The variable of a loop.
    counter: Option<LocalId>,
    /// Of a loop, the branches in which it is left or goes to its next turn.
    jumps: Vec<usize>,
    needed: bool,
}

/// A store to a variable.
#[derive(Clone, Copy)]
struct Store {
    local: LocalId,
    value: ExprId,
    /// The branch or loop that it stands in.
    within: Option<usize>,
}

impl Places {
    fn of(body: &Block) -> Self {
        let mut places = Self::default();
        places.block(body, None, None);
        places.stores.sort_by_key(|s| s.local);
        places
    }

    /// Adds what stands in a block: in the branch or loop `within`, and in the loop `innermost`.
    fn block(&mut self, block: &Block, within: Option<usize>, innermost: Option<usize>) {
        for stmt in block {
            match stmt {
                Stmt::Eval(_) => {}
                &Stmt::Store(local, _, value) => self.stores.push(Store {
                    local,
                    value,
                    within,
                }),
                Stmt::If(cond, a, b) => {
                    let at = self.add(within, [Some(*cond), None], None);
                    self.block(a, at, innermost);
                    self.block(b, at, innermost);
                }
                Stmt::For {
                    local,
                    low,
                    high,
                    body,
                } => {
                    let at = self.add(within, [Some(*low), Some(*high)], Some(*local));
                    self.block(body, at, at);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    let at = self.add(within, [Some(*test), None], None);
                    self.block(head, at, at);
                    self.block(body, at, at);
                }
                // Branches around the innermost in which it stands are needed with that one.
                Stmt::Break | Stmt::Continue => {
                    if let (Some(looped), Some(branch)) = (innermost, within)
                        && looped != branch
                    {
                        self.all[looped].jumps.push(branch);
                    }
                }
            }
        }
    }

    fn add(
        &mut self,
        within: Option<usize>,
        reads: [Option<ExprId>; 2],
        counter: Option<LocalId>,
    ) -> Option<usize> {
        self.all.push(Place {
            within,
            reads,
            counter,
            jumps: Vec::new(),
            needed: false,
        });
        Some(self.all.len() - 1)
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
    /// Numbers a function anew, of whose expressions so many are read.
    fn function(f: &mut Function, kept: usize) {
        let mut body = std::mem::take(&mut f.body);
        let mut this = Renumber {
            expr_ids: vec![None; f.exprs.len()],
            local_ids: vec![None; f.locals.len()],
            exprs: Vec::with_capacity(kept),
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
        for operand in expr.kind.operands_mut() {
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
