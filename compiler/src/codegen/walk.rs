//! What the text of a function must know of it beforehand: its loop variables, the values of the
//! parameter table it reads, the variables it stores.

use std::collections::BTreeSet;

use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Stmt};

/// Variables that loops declare.
pub fn counters(block: &Block) -> BTreeSet<LocalId> {
    let mut found = BTreeSet::new();
    for stmt in block {
        match stmt {
            Stmt::For { local, body, .. } => {
                found.insert(*local);
                found.extend(counters(body));
            }
            Stmt::If(_, a, b) => {
                found.extend(counters(a));
                found.extend(counters(b));
            }
            Stmt::While { body, .. } => found.extend(counters(body)),
            _ => {}
        }
    }
    found
}

/// The values of the parameter table that statements read, each expression once.
pub fn table_values(f: &Function) -> BTreeSet<ExprId> {
    let mut used = BTreeSet::from([f.value]);
    read_by(f, &f.body, &mut used);
    used.retain(|&id| matches!(f.expr(id).kind, ExprKind::TableValue(_)));
    used
}

/// The expressions that statements and what they evaluate read.
fn read_by(f: &Function, block: &Block, out: &mut BTreeSet<ExprId>) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => out.extend(f.expr(*id).kind.operands()),
            Stmt::Store(_, _, value) => drop(out.insert(*value)),
            Stmt::If(cond, a, b) => {
                out.insert(*cond);
                read_by(f, a, out);
                read_by(f, b, out);
            }
            Stmt::For {
                low, high, body, ..
            } => {
                out.extend([*low, *high]);
                read_by(f, body, out);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                read_by(f, head, out);
                out.insert(*test);
                read_by(f, body, out);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Variables that are ever loaded or stored.
pub fn stored(f: &Function) -> BTreeSet<LocalId> {
    fn walk(block: &Block, out: &mut BTreeSet<LocalId>) {
        for stmt in block {
            match stmt {
                Stmt::Store(local, ..) => drop(out.insert(*local)),
                Stmt::If(_, a, b) => {
                    walk(a, out);
                    walk(b, out);
                }
                Stmt::For { body, .. } | Stmt::While { body, .. } => walk(body, out),
                _ => {}
            }
        }
    }
    let mut out = BTreeSet::new();
    walk(&f.body, &mut out);
    for id in f.evaluated() {
        if let ExprKind::Load(local) = f.expr(id).kind {
            out.insert(local);
        }
    }
    out
}
