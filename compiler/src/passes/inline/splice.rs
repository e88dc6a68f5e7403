//! Copies the body of a function into its caller.

use crate::ir::walk::Renumber;
use crate::ir::{
    Block, CallSite, Const, Expr, ExprId, ExprKind, Function, FunctionId, LocalId, SiteId, Stmt,
    Type,
};
use crate::passes::rewrite::Rewriter;
use crate::source::Span;

/// Copies the body of a function, called by the expression `call`, into the open block; gives its
/// value.
pub(super) fn splice(
    w: &mut Rewriter<'_>,
    call: ExprId,
    callee: FunctionId,
    args: &[ExprId],
) -> ExprId {
    let module = w.module;
    let callee = &module.functions[callee.index()];
    let shift = Shift {
        exprs: w.f.exprs.len() as u32,
        locals: w.f.locals.len() as u32,
        site: w.f.sites.len() as u32,
        in_one: depth(&callee.sites) >= MAX_SITES,
    };
    let Expr { span, via, .. } = *w.f.expr(call);
    w.f.sites.push(CallSite { span, via });
    if !shift.in_one {
        w.f.sites.extend(callee.sites.iter().map(|site| CallSite {
            via: shift.via(site.via),
            ..*site
        }));
    }
    for local in &callee.locals {
        w.local(local.clone());
    }
    for expr in &callee.exprs {
        if let ExprKind::Param(i) = expr.kind {
            w.stand_in(args[i as usize], expr.span);
            continue;
        }
        let mut copy = expr.clone();
        shift.kind(&mut copy.kind);
        copy.via = shift.via(copy.via);
        w.adopt(copy);
    }
    w.via = shift.via(None);
    for local in unset(callee) {
        let zero = zero(w, callee.locals[local.index()].ty, callee.span);
        w.store(shift.local(local), None, zero);
    }
    w.depth += 1;
    w.block(shift.block(&callee.body));
    w.depth -= 1;
    w.resolve(shift.expr(callee.value))
}

/// Most calls within each other that are told apart in code in line. In a long chain of functions every
/// expression would have as many.
const MAX_SITES: u32 = 64;

/// How many calls stand within each other.
fn depth(sites: &[CallSite]) -> u32 {
    let mut depths: Vec<u32> = Vec::with_capacity(sites.len());
    for site in sites {
        // Those around a call come before it.
        let around = site.via.and_then(|id| depths.get(id.index()));
        depths.push(around.map_or(1, |d| d + 1));
    }
    depths.into_iter().max().unwrap_or(0)
}

/// How far a callee's numbers are moved in its caller.
struct Shift {
    exprs: u32,
    locals: u32,
    /// The call itself; those in the callee come after it.
    site: u32,
    /// Does the call stand for those in the callee as well?
    in_one: bool,
}

impl Shift {
    fn via(&self, via: Option<SiteId>) -> Option<SiteId> {
        let own = via.filter(|_| !self.in_one);
        Some(SiteId(own.map_or(self.site, |id| self.site + 1 + id.0)))
    }

    fn kind(&self, kind: &mut ExprKind) {
        if let ExprKind::Load(local) = kind {
            *local = self.local(*local);
        }
        for operand in kind.operands_mut() {
            *operand = self.expr(*operand);
        }
    }
}

impl Renumber for Shift {
    fn expr(&self, id: ExprId) -> ExprId {
        ExprId(id.0 + self.exprs)
    }

    fn local(&self, id: LocalId) -> LocalId {
        LocalId(id.0 + self.locals)
    }
}

/// Variables that may be read before they are stored. They are zero at first, and must be so
/// again each time when the callee now stands in a loop.
pub(in crate::passes) fn unset(f: &Function) -> Vec<LocalId> {
    let mut state = Unset {
        f,
        set: vec![false; f.locals.len()],
        read: vec![false; f.locals.len()],
        stored: Vec::new(),
    };
    state.block(&f.body);
    let ids = (0..f.locals.len() as u32).map(LocalId);
    ids.filter(|l| state.read[l.index()]).collect()
}

struct Unset<'a> {
    f: &'a Function,
    set: Vec<bool>,
    read: Vec<bool>,
    /// The variables that are set, in the order of their first stores.
    stored: Vec<LocalId>,
}

impl Unset<'_> {
    fn block(&mut self, block: &Block) {
        for stmt in block {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::Eval(id) => {
                if let ExprKind::Load(local) = self.f.expr(*id).kind {
                    self.read[local.index()] |= !self.set[local.index()];
                }
            }
            Stmt::Store(local, None, _) => self.store(*local),
            // The other components keep what they were.
            Stmt::Store(local, Some(_), _) => {
                self.read[local.index()] |= !self.set[local.index()];
            }
            Stmt::If(_, a, b) => {
                let before = self.stored.len();
                self.block(a);
                let by_a = self.back_to(before);
                self.block(b);
                let mut by_b = self.back_to(before);
                by_b.sort_unstable();
                let both = by_a.into_iter().filter(|l| by_b.binary_search(l).is_ok());
                both.for_each(|local| self.store(local));
            }
            Stmt::For { local, body, .. } => {
                let before = self.stored.len();
                self.store(*local);
                self.block(body);
                self.back_to(before);
            }
            Stmt::While { head, body, .. } => {
                self.block(head);
                let before = self.stored.len();
                self.block(body);
                self.back_to(before);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }

    fn store(&mut self, local: LocalId) {
        if !std::mem::replace(&mut self.set[local.index()], true) {
            self.stored.push(local);
        }
    }

    /// Takes back all stores but the first so many; gives their variables.
    fn back_to(&mut self, stores: usize) -> Vec<LocalId> {
        let undone = self.stored.split_off(stores);
        undone.iter().for_each(|l| self.set[l.index()] = false);
        undone
    }
}

/// The zero of a type, evaluated here.
fn zero(w: &mut Rewriter<'_>, ty: Type, span: Span) -> ExprId {
    match ty {
        Type::Bool => w.constant(Const::Bool(false), span),
        Type::Int => w.constant(Const::Int(0), span),
        Type::Mat3 => {
            let column = w.constant(Const::Float(vec![0.0; 3]), span);
            w.create(ExprKind::Compose(vec![column; 3]), ty, span)
        }
        Type::Struct(id) => {
            let types: Vec<Type> = w.module.structs[id.index()]
                .fields
                .iter()
                .map(|(_, ty)| *ty)
                .collect();
            let fields = types.into_iter().map(|ty| zero(w, ty, span)).collect();
            w.create(ExprKind::Make(id, fields), ty, span)
        }
        _ => w.constant(Const::Float(vec![0.0; ty.width().unwrap_or(1)]), span),
    }
}
