//! What a function consists of, as its text needs to know: what it evaluates, calls, reads and
//! stores.

use std::collections::BTreeSet;

use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Stmt};

/// Every expression that a function evaluates.
pub fn evaluated(f: &Function) -> Vec<ExprId> {
    fn walk(block: &Block, out: &mut Vec<ExprId>) {
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => out.push(*id),
                Stmt::If(_, a, b) => {
                    walk(a, out);
                    walk(b, out);
                }
                Stmt::For { body, .. } => walk(body, out),
                Stmt::While { head, body, .. } => {
                    walk(head, out);
                    walk(body, out);
                }
                Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
            }
        }
    }
    let mut out = Vec::new();
    walk(&f.body, &mut out);
    out
}

/// Most blocks within each other in the body of a function: with the body's, WGSL allows 127.
pub const MAX_NESTING: usize = 126;

/// Blocks within each other in the text of a block, at most: fewer where an `else` has an `if` only.
pub fn nesting(block: &Block) -> usize {
    let each = block.iter().map(|stmt| match stmt {
        Stmt::If(_, a, b) => 1 + nesting(a).max(nesting(b)),
        Stmt::For { body, .. } => 1 + nesting(body),
        // The test stands in a block of its own.
        Stmt::While { head, body, .. } => 1 + nesting(head).max(nesting(body)).max(1),
        Stmt::Eval(_) | Stmt::Store(..) | Stmt::Break | Stmt::Continue => 0,
    });
    each.max().unwrap_or(0)
}

/// The functions that a function calls.
pub fn callees(f: &Function) -> BTreeSet<usize> {
    let called = evaluated(f)
        .into_iter()
        .filter_map(|id| match f.expr(id).kind {
            ExprKind::Call(callee, _) => Some(callee.index()),
            _ => None,
        });
    called.collect()
}

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

/// The uniforms that statements read, each expression once.
pub fn used_uniforms(f: &Function) -> BTreeSet<ExprId> {
    let mut used = BTreeSet::from([f.value]);
    read_by(f, &f.body, &mut used);
    used.retain(|&id| matches!(f.expr(id).kind, ExprKind::Uniform(_)));
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
    for id in evaluated(f) {
        if let ExprKind::Load(local) = f.expr(id).kind {
            out.insert(local);
        }
    }
    out
}
