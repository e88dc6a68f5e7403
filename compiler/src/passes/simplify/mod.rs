//! Algebra that is safe in floating point.
//!
//! The language has no NaN and no infinity, every operation is total, and the sign of zero does not
//! matter. Under these rules, and no others, each rewrite here gives the same bits, or a result
//! at least as accurate; where bits may differ, the rule says by how much. Nothing is
//! reassociated or distributed: that would change how sums round.
//!
//! One function an operation holds its rules, each with its reason. The tests run every rule over
//! random and extreme operands against the expression it replaces.

use super::rewrite::{Change, New, Rewriter, Rules};
use crate::ir::ops::Op;
use crate::ir::{Block, Const, ExprId, ExprKind, Function, LocalId, Module, Stmt, Type};
use crate::source::Span;

mod arithmetic;
mod choice;
mod clamps;
mod powers;
mod range;
mod textures;
mod vectors;

/// Most variables that a branch may set to become selections.
const MAX_PICKS: usize = 2;

/// Applies the rules of this folder.
pub(super) fn simplify(_: &Module, _: &Function) -> Rules {
    Rules {
        simplify: true,
        forward: true,
        ..Rules::default()
    }
}

/// What an expression with final operands can be replaced by.
pub(super) fn rule(w: &mut Rewriter<'_>, id: ExprId) -> Option<New> {
    let site = Site {
        ty: w.f.ty(id),
        span: w.f.expr(id).span,
    };
    let (op, args) = w.operation(id)?;
    match *args {
        [a] => unary(w, site, op, a),
        [a, b] => binary(w, site, op, a, b),
        [a, b, c] => ternary(w, site, op, a, b, c),
        _ => None,
    }
}

fn unary(w: &mut Rewriter<'_>, site: Site, op: Op, a: ExprId) -> Option<New> {
    match op {
        Op::Neg => arithmetic::neg(w, a),
        Op::Abs => clamps::abs(w, a),
        Op::Saturate => clamps::saturate(w, a),
        Op::Sqrt => powers::sqrt(w, a),
        Op::Normalize => vectors::normalize(w, a),
        Op::MaxComponent | Op::MinComponent => vectors::extreme_component(w, site, a),
        Op::Not => choice::not(w, a),
        _ => None,
    }
}

fn binary(w: &mut Rewriter<'_>, site: Site, op: Op, a: ExprId, b: ExprId) -> Option<New> {
    let found = match op {
        Op::Add => arithmetic::add(w, site, a, b),
        Op::Sub => arithmetic::sub(w, site, a, b),
        Op::Mul => arithmetic::mul(w, site, a, b).or_else(|| powers::mul(w, site, a, b)),
        Op::Div => arithmetic::div(w, site, a, b),
        Op::Min => clamps::min(w, site, a, b),
        Op::Max => clamps::max(w, site, a, b),
        Op::Pow => powers::pow(w, site, a, b),
        Op::Dot => vectors::dot(w, site, a, b),
        Op::Cross => vectors::cross(w, site, a, b),
        Op::And | Op::Or => choice::logic(w, op, a, b),
        Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual => {
            choice::compare(w, site, op, a, b)
        }
        Op::Equal | Op::NotEqual => choice::equal(w, site, op, a, b),
        _ => None,
    };
    found.or_else(|| vectors::narrow(w, site, op, a, b))
}

fn ternary(
    w: &mut Rewriter<'_>,
    site: Site,
    op: Op,
    a: ExprId,
    b: ExprId,
    c: ExprId,
) -> Option<New> {
    match op {
        Op::Clamp => clamps::clamp(w, site, a, b, c),
        Op::Mix => arithmetic::mix(w, site, a, b, c),
        Op::Select => choice::select(w, a, b, c),
        Op::ImageAs | Op::ImageDataAs | Op::ImageAlphaAs => textures::lookup(w, site, op, a, b, c),
        _ => None,
    }
}

/// Type and origin of the expression that a rule looks at.
#[derive(Clone, Copy)]
struct Site {
    ty: Type,
    span: Span,
}

impl Site {
    /// `value` in the type of the site: a scalar fills the components of a vector.
    fn value(self, w: &Rewriter<'_>, value: ExprId) -> Option<New> {
        if w.f.ty(value) == self.ty {
            Some(New::Value(value))
        } else if w.f.ty(value) == Type::Float {
            Some(New::Kind(ExprKind::Compose(vec![value])))
        } else {
            None
        }
    }

    /// A number in the type of the site.
    fn number(self, x: f64) -> Option<New> {
        let constant = match self.ty {
            Type::Int => Const::Int(x as i32),
            ty => Const::Float(vec![x; ty.width()?]),
        };
        Some(New::Kind(ExprKind::Const(constant)))
    }
}

fn op(op: Op, args: &[ExprId]) -> Option<New> {
    Some(New::Kind(ExprKind::Op(op, args.to_vec())))
}

fn truth(value: bool) -> Option<New> {
    Some(New::Kind(ExprKind::Const(Const::Bool(value))))
}

/// The number that all components of a constant are.
fn number(w: &Rewriter<'_>, id: ExprId) -> Option<f64> {
    match w.f.constant(id)? {
        Const::Int(i) => Some(f64::from(*i)),
        Const::Float(v) => {
            let first = *v.first()?;
            v.iter().all(|x| *x == first).then_some(first)
        }
        Const::Bool(_) => None,
    }
}

fn is(w: &Rewriter<'_>, id: ExprId, x: f64) -> bool {
    number(w, id) == Some(x)
}

/// A branch that only chooses what variables hold becomes selections: a selection takes the place
/// of the load after it, and what follows can be simplified with the value at hand. True if it
/// was replaced.
///
/// Of a variable that only one side sets it must be known what it holds before; if that would have
/// to be loaded for the purpose, the branch is the better choice.
pub(super) fn pick(
    w: &mut Rewriter<'_>,
    cond: ExprId,
    then: &Block,
    otherwise: &Block,
    changes: [&[Change]; 2],
) -> bool {
    let (Some(then), Some(otherwise)) = (stores_only(then), stores_only(otherwise)) else {
        return false;
    };
    let mut locals: Vec<LocalId> = then.iter().chain(&otherwise).map(|s| s.0).collect();
    locals.sort();
    locals.dedup();
    if locals.len() > MAX_PICKS {
        return false;
    }
    let last = |stores: &[(LocalId, ExprId)], local: LocalId| {
        let own = stores.iter().rev().find(|s| s.0 == local).map(|s| s.1);
        own.or_else(|| w.before(local, changes))
    };
    let mut picks = Vec::new();
    for local in locals {
        let selectable = !matches!(w.f.locals[local.index()].ty, Type::Mat3 | Type::Struct(_));
        match (last(&then, local), last(&otherwise, local)) {
            (Some(a), Some(b)) if selectable => picks.push((local, a, b)),
            _ => return false,
        }
    }
    let span = w.f.expr(cond).span;
    for (local, a, b) in picks {
        if let Some(value) = w.op(Op::Select, &[cond, a, b], span) {
            w.store(local, None, value);
        }
    }
    true
}

/// The stores of a block that does nothing else.
fn stores_only(block: &Block) -> Option<Vec<(LocalId, ExprId)>> {
    let store = |stmt: &Stmt| match stmt {
        Stmt::Store(local, None, value) => Some((*local, *value)),
        _ => None,
    };
    block.iter().map(store).collect()
}
