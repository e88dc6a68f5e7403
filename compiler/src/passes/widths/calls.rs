//! Puts the calls that widths depend on in line, where their values get tangents.
//!
//! A call stays an expression of its number: it becomes the load of a variable that holds the
//! callee's value.

use super::slice::Slice;
use crate::ir::build::Builder;
use crate::ir::walk::Renumber;
use crate::ir::{
    Block, Const, ExprId, ExprKind, Function, FunctionId, LocalId, Module, SiteId, Stmt, Type,
};
use crate::passes::inline::unset;

/// The calls that need tangents.
pub(super) fn in_slice(f: &Function, slice: &Slice) -> Vec<ExprId> {
    let mut calls = f.evaluated();
    calls.retain(|&id| call(f, slice, id).is_some());
    calls
}

/// How many expressions some calls bring, without what is called in what they call.
pub(super) fn growth(module: &Module, f: &Function, calls: &[ExprId]) -> usize {
    let brought = calls.iter().map(|&id| match f.expr(id).kind {
        ExprKind::Call(callee, _) => module.functions[callee.index()].exprs.len(),
        _ => 0,
    });
    brought.sum()
}

/// The callee and arguments of an expression that is a call and needs a tangent.
fn call<'f>(f: &'f Function, slice: &Slice, id: ExprId) -> Option<(FunctionId, &'f [ExprId])> {
    match &f.expr(id).kind {
        ExprKind::Call(callee, args) if slice.exprs.get(id.index()) == Some(&true) => {
            Some((*callee, args))
        }
        _ => None,
    }
}

/// Puts every call that needs a tangent in line; not the calls in what they call.
pub(super) fn put_in_line(module: &Module, f: &mut Function, slice: &Slice) {
    let (body, value) = (std::mem::take(&mut f.body), f.value);
    let mut b = Builder::resume(f.clone());
    block(module, &mut b, slice, body);
    *f = b.finish(value);
}

fn block(module: &Module, b: &mut Builder, slice: &Slice, stmts: Block) {
    for stmt in stmts {
        let stmt = stmt.map_blocks(|inner| {
            b.open();
            block(module, b, slice, inner);
            b.close()
        });
        if let Stmt::Eval(id) = stmt
            && let Some((callee, args)) = call(b.function(), slice, id)
        {
            let args = args.to_vec();
            copy(module, b, id, &module.functions[callee.index()], &args);
        }
        b.stmt(stmt);
    }
}

/// Copies a callee's body into the open block, and lets the call `id` read its value.
fn copy(module: &Module, b: &mut Builder, id: ExprId, callee: &Function, args: &[ExprId]) {
    let call = b.function().expr(id);
    let (span, via) = (call.span, call.via);
    let caller = b.set_via(via);
    b.enter_call(span);
    let sites = copy_sites(b, callee);
    let copy = Copy {
        callee,
        args,
        exprs: b.function().exprs.len() as u32,
        locals: b.function().locals.len() as u32,
    };
    let here = b.via();
    for expr in &callee.exprs {
        let mut expr = expr.clone();
        expr.via = expr.via.map_or(here, |via| sites.get(via.index()).copied());
        if let ExprKind::Param(_) = expr.kind {
            // Arguments stand for parameters, which leave a number that nothing refers to.
            (expr.kind, expr.ty) = (ExprKind::Const(Const::Bool(false)), Type::Bool);
        }
        copy.kind(&mut expr.kind);
        b.adopt(expr);
    }
    for local in &callee.locals {
        b.local(&local.name, local.ty);
    }
    for local in unset(callee) {
        let zero = b.zero(module, callee.locals[local.index()].ty, span);
        b.store(copy.local(local), zero);
    }
    copy.block(&callee.body).into_iter().for_each(|s| b.stmt(s));
    let value = b.local(&callee.name, callee.result);
    b.store(value, copy.expr(callee.value));
    b.redefine(id, ExprKind::Load(value));
    b.set_via(caller);
}

/// Adds the calls that were put in line in a callee, under the call of it; gives their numbers.
fn copy_sites(b: &mut Builder, callee: &Function) -> Vec<SiteId> {
    let here = b.via();
    let mut sites: Vec<SiteId> = Vec::new();
    for site in &callee.sites {
        b.set_via(site.via.map_or(here, |via| sites.get(via.index()).copied()));
        b.enter_call(site.span);
        sites.extend(b.via());
    }
    b.set_via(here);
    sites
}

/// What a callee's numbers are in its caller.
struct Copy<'a> {
    callee: &'a Function,
    args: &'a [ExprId],
    exprs: u32,
    locals: u32,
}

impl Copy<'_> {
    fn kind(&self, kind: &mut ExprKind) {
        if let ExprKind::Load(local) = kind {
            *local = self.local(*local);
        }
        for operand in kind.operands_mut() {
            *operand = self.expr(*operand);
        }
    }
}

impl Renumber for Copy<'_> {
    fn expr(&self, id: ExprId) -> ExprId {
        match self.callee.expr(id).kind {
            ExprKind::Param(i) => self.args[i as usize],
            _ => ExprId(id.0 + self.exprs),
        }
    }

    fn local(&self, id: LocalId) -> LocalId {
        LocalId(id.0 + self.locals)
    }
}
