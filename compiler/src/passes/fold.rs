//! Computes what depends on constants only, and drops branches that are never taken.
//!
//! WGSL makes an overflow in a constant expression an error, so operations on constants must
//! not reach it; folding is needed for correct code, not only for fast code.

use crate::ir::build::{fold_compose, fold_op};
use crate::ir::{Block, Const, ExprId, ExprKind, Function, Stmt};

/// Folds a function in place.
pub fn fold(f: &mut Function) {
    let body = std::mem::take(&mut f.body);
    f.body = block(f, body);
}

fn block(f: &mut Function, stmts: Block) -> Block {
    let mut out = Vec::with_capacity(stmts.len());
    for stmt in stmts {
        match stmt {
            Stmt::Eval(id) => {
                if let Some(value) = folded(f, id) {
                    f.exprs[id.index()].kind = ExprKind::Const(value);
                } else {
                    out.push(stmt);
                }
            }
            Stmt::If(cond, then, otherwise) => match f.constant(cond) {
                Some(Const::Bool(taken)) => {
                    let taken = if *taken { then } else { otherwise };
                    out.extend(block(f, taken));
                }
                _ => {
                    let (then, otherwise) = (block(f, then), block(f, otherwise));
                    out.push(Stmt::If(cond, then, otherwise));
                }
            },
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let body = block(f, body);
                out.push(Stmt::For {
                    local,
                    low,
                    high,
                    body,
                });
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                let (head, body) = (block(f, head), block(f, body));
                out.push(Stmt::While {
                    head,
                    test,
                    limit,
                    body,
                });
            }
            other => out.push(other),
        }
    }
    out
}

/// The constant that an expression always is.
fn folded(f: &Function, id: ExprId) -> Option<Const> {
    let expr = f.expr(id);
    let constants = |args: &[ExprId]| {
        args.iter()
            .map(|&a| f.constant(a))
            .collect::<Option<Vec<_>>>()
    };
    match &expr.kind {
        ExprKind::Op(op, args) => fold_op(*op, &constants(args)?),
        ExprKind::Compose(args) => fold_compose(expr.ty, &constants(args)?),
        ExprKind::Swizzle(v, components) => match f.constant(*v)? {
            Const::Float(v) => {
                let picked = components.iter().map(|&c| v.get(usize::from(c)).copied());
                Some(Const::Float(picked.collect::<Option<_>>()?))
            }
            _ => None,
        },
        _ => None,
    }
}
