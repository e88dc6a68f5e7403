//! Whether an expression will be a closure, seen from its syntax before anything is checked.

use crate::ast::{self, Arg, BinaryOp, Expr, ExprKind, ItemKind};
use crate::sema::body::{Binding, Body};
use crate::sema::expr::NO_MEDIUM;
use crate::sema::types::NAMED;

impl Body<'_, '_> {
    /// Does a block end in a closure? Seen from the syntax, before anything is checked.
    pub fn is_closure_block(&self, block: &ast::Block) -> bool {
        let in_block = |name: &str| {
            block.stmts.iter().any(|s| match &s.kind {
                ast::StmtKind::Let { name: n, value, .. } => {
                    n.node == name && self.is_closure(value)
                }
                _ => false,
            })
        };
        tail(block).is_some_and(|e| match &e.kind {
            ExprKind::Name(name) if in_block(name) => true,
            _ => self.is_closure(e),
        })
    }

    /// Will an expression be a closure?
    pub fn is_closure(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Name(name) => match self.scopes.find(name).map(|(_, binding)| binding) {
                Some(Binding::Fixed(operand)) => operand.ty().is_closure(),
                Some(_) => false,
                None => name == NO_MEDIUM && self.cx.lookup(self.module, name).is_none(),
            },
            ExprKind::Call { callee, args } => match self.cx.lookup(self.module, &callee.node) {
                Some(item) => match &self.cx.item(item).kind {
                    ItemKind::Closure(_) | ItemKind::Material(_) => true,
                    ItemKind::Function(f) => returns_closure(f),
                    _ => false,
                },
                None => makes_closure(&callee.node, args, |e| self.is_closure(e)),
            },
            ExprKind::Binary(BinaryOp::Mul | BinaryOp::Add | BinaryOp::Sub, a, b) => {
                self.is_closure(a) || self.is_closure(b)
            }
            ExprKind::If(branch) => {
                self.is_closure_block(&branch.then)
                    || branch
                        .otherwise
                        .as_ref()
                        .is_some_and(|b| self.is_closure_block(b))
            }
            ExprKind::Field(base, part) => part.node != "opacity" && self.is_closure(base),
            ExprKind::Block(block) => self.is_closure_block(block),
            _ => false,
        }
    }
}

/// Does a function return a closure? Seen from its text.
fn returns_closure(f: &ast::Function) -> bool {
    let mut closures = NAMED.iter().filter(|(_, ty)| ty.is_closure());
    closures.any(|(name, _)| *name == f.result.node)
}

/// Is the callee a closure-making function of the language itself?
fn makes_closure(callee: &str, args: &[Arg], is_closure: impl Fn(&Expr) -> bool) -> bool {
    match callee {
        "layer" | "medium" => true,
        "mix" => args.iter().any(|a| is_closure(&a.value)),
        _ => false,
    }
}

/// The last expression of a block, through nested blocks.
fn tail(block: &ast::Block) -> Option<&Expr> {
    let value = block.value.as_deref()?;
    match &value.kind {
        ExprKind::Block(inner) => tail(inner),
        _ => Some(value),
    }
}
