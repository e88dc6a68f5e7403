//! Copies the body of a function into its caller.

use crate::ir::walk::Renumber;
use crate::ir::{
    Block, CallSite, Const, Expr, ExprId, ExprKind, Function, FunctionId, LocalId, SiteId, Stmt,
    Type,
};
use crate::passes::rewrite::{Rewriter, operands_mut};
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
    };
    let Expr { span, via, .. } = *w.f.expr(call);
    w.f.sites.push(CallSite { span, via });
    w.f.sites.extend(callee.sites.iter().map(|site| CallSite {
        via: shift.via(site.via),
        ..*site
    }));
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

/// How far a callee's numbers are moved in its caller.
struct Shift {
    exprs: u32,
    locals: u32,
    /// The call itself; those in the callee come after it.
    site: u32,
}

impl Shift {
    fn via(&self, via: Option<SiteId>) -> Option<SiteId> {
        Some(SiteId(via.map_or(self.site, |id| self.site + 1 + id.0)))
    }

    fn kind(&self, kind: &mut ExprKind) {
        if let ExprKind::Load(local) = kind {
            *local = self.local(*local);
        }
        for operand in operands_mut(kind) {
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
    };
    state.block(&f.body);
    let ids = (0..f.locals.len() as u32).map(LocalId);
    ids.filter(|l| state.read[l.index()]).collect()
}

struct Unset<'a> {
    f: &'a Function,
    set: Vec<bool>,
    read: Vec<bool>,
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
            Stmt::Store(local, None, _) => self.set[local.index()] = true,
            // The other components keep what they were.
            Stmt::Store(local, Some(_), _) => {
                self.read[local.index()] |= !self.set[local.index()];
            }
            Stmt::If(_, a, b) => {
                let before = self.set.clone();
                self.block(a);
                let after = std::mem::replace(&mut self.set, before);
                self.block(b);
                for (b, a) in self.set.iter_mut().zip(after) {
                    *b &= a;
                }
            }
            Stmt::For { local, body, .. } => {
                let before = self.set.clone();
                self.set[local.index()] = true;
                self.block(body);
                self.set = before;
            }
            Stmt::While { head, body, .. } => {
                self.block(head);
                let before = self.set.clone();
                self.block(body);
                self.set = before;
            }
            Stmt::Break | Stmt::Continue => {}
        }
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
