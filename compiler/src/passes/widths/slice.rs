//! Which expressions and variables need tangents: those that vary over a footprint and that a width
//! depends on.

use super::{argument, input};
use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Module, Stmt, Type};

/// The expressions and variables of a function that need tangents, by number.
pub(super) struct Slice {
    pub exprs: Vec<bool>,
    pub locals: Vec<bool>,
}

impl Slice {
    fn empty(f: &Function) -> Self {
        Self {
            exprs: vec![false; f.exprs.len()],
            locals: vec![false; f.locals.len()],
        }
    }

    /// What needs tangents in a function.
    pub fn of(module: &Module, f: &Function) -> Self {
        let mut stores = Vec::new();
        collect_stores(&f.body, &mut stores);
        let evaluated = f.evaluated();
        let varying = varying(module, f, &evaluated, &stores);
        needed(f, &evaluated, &stores, &varying)
    }
}

fn collect_stores(block: &Block, stores: &mut Vec<(LocalId, ExprId)>) {
    for stmt in block {
        if let Stmt::Store(local, _, value) = stmt {
            stores.push((*local, *value));
        }
        stmt.blocks()
            .for_each(|inner| collect_stores(inner, stores));
    }
}

/// What changes over a footprint by more than steps, whether or not a width depends on it.
fn varying(
    module: &Module,
    f: &Function,
    evaluated: &[ExprId],
    stores: &[(LocalId, ExprId)],
) -> Slice {
    let mut found = Slice::empty(f);
    // A loop carries what it assigns to its start, so that more than one round may be needed.
    loop {
        for &id in evaluated {
            found.exprs[id.index()] = varies(module, f, &found, id);
        }
        let mut more = false;
        for (local, value) in stores {
            let new = found.exprs[value.index()] && !found.locals[local.index()];
            found.locals[local.index()] |= new;
            more |= new;
        }
        if !more {
            return found;
        }
    }
}

fn varies(module: &Module, f: &Function, found: &Slice, id: ExprId) -> bool {
    let expr = f.expr(id);
    if matches!(expr.ty, Type::Bool | Type::Int) {
        return false;
    }
    let operands = || expr.kind.operands().iter().any(|a| found.exprs[a.index()]);
    match &expr.kind {
        ExprKind::Load(local) => found.locals[local.index()],
        ExprKind::Op(op, _) => !op.is_step() && operands(),
        ExprKind::Field(base, field) => input(module, f, *base, *field).is_some() || operands(),
        _ => operands(),
    }
}

/// Of what varies, that on which a width depends.
fn needed(
    f: &Function,
    evaluated: &[ExprId],
    stores: &[(LocalId, ExprId)],
    varying: &Slice,
) -> Slice {
    let mut found = Slice::empty(f);
    let asked = evaluated.iter().filter_map(|&id| argument(f, id));
    let mut pending: Vec<ExprId> = asked.collect();
    while let Some(id) = pending.pop() {
        if !varying.exprs[id.index()] || std::mem::replace(&mut found.exprs[id.index()], true) {
            continue;
        }
        pending.extend(f.expr(id).kind.operands());
        if let ExprKind::Load(local) = f.expr(id).kind
            && !std::mem::replace(&mut found.locals[local.index()], true)
        {
            let values = stores.iter().filter(|(l, _)| *l == local);
            pending.extend(values.map(|(_, value)| *value));
        }
    }
    found
}
