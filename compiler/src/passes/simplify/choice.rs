//! Rules for bools, comparisons and selections.

use super::range::range;
use super::{New, Site, op, truth};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, Type};
use crate::passes::rewrite::Rewriter;

pub(super) fn not(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    match w.operation(a)? {
        (Op::Not, &[inner]) => Some(New::Value(inner)),
        _ => None,
    }
}

/// And, or: with a known side, or with twice the same.
pub(super) fn logic(w: &Rewriter<'_>, this: Op, a: ExprId, b: ExprId) -> Option<New> {
    if w.same(a, b) {
        return Some(New::Value(a));
    }
    // `true & x` is x, `true | x` is true; the other way round for false.
    let neutral = this == Op::And;
    for (known, other) in [(a, b), (b, a)] {
        if let Some(Const::Bool(known)) = w.f.constant(known) {
            return if *known == neutral {
                Some(New::Value(other))
            } else {
                truth(*known)
            };
        }
    }
    None
}

pub(super) fn select(w: &Rewriter<'_>, cond: ExprId, a: ExprId, b: ExprId) -> Option<New> {
    if w.same(a, b) {
        return Some(New::Value(a));
    }
    match (w.f.constant(a), w.f.constant(b)) {
        (Some(Const::Bool(true)), Some(Const::Bool(false))) => return Some(New::Value(cond)),
        (Some(Const::Bool(false)), Some(Const::Bool(true))) => return op(Op::Not, &[cond]),
        _ => {}
    }
    if let Some((Op::Not, &[inner])) = w.operation(cond) {
        return op(Op::Select, &[inner, b, a]);
    }
    // The same question asked again within a side has the same answer.
    match (w.operation(a), w.operation(b)) {
        (Some((Op::Select, &[c, inner, _])), _) if w.same(c, cond) => {
            op(Op::Select, &[cond, inner, b])
        }
        (_, Some((Op::Select, &[c, _, inner]))) if w.same(c, cond) => {
            op(Op::Select, &[cond, a, inner])
        }
        _ => None,
    }
}

/// Comparisons that ranges decide, and of a value with itself. Nothing is NaN.
pub(super) fn compare(w: &Rewriter<'_>, _: Site, this: Op, a: ExprId, b: ExprId) -> Option<New> {
    let (less, strict, a, b) = match this {
        Op::Less => (true, true, a, b),
        Op::LessEqual => (true, false, a, b),
        Op::Greater => (true, true, b, a),
        Op::GreaterEqual => (true, false, b, a),
        _ => (false, false, a, b),
    };
    if !less {
        return None;
    }
    if w.same(a, b) {
        return truth(!strict);
    }
    let (x, y) = (range(w.f, a), range(w.f, b));
    let (holds, fails) = if strict {
        (x.high < y.low, x.low >= y.high)
    } else {
        (x.high <= y.low, x.low > y.high)
    };
    match (holds, fails) {
        (true, _) => truth(true),
        (_, true) => truth(false),
        _ => None,
    }
}

pub(super) fn equal(w: &Rewriter<'_>, _: Site, this: Op, a: ExprId, b: ExprId) -> Option<New> {
    if w.same(a, b) {
        return truth(this == Op::Equal);
    }
    let (x, y) = (range(w.f, a), range(w.f, b));
    if x.high < y.low || y.high < x.low {
        return truth(this == Op::NotEqual);
    }
    if w.f.ty(a) != Type::Bool {
        return None;
    }
    // `x == true` is x, `x != true` is its opposite.
    for (known, other) in [(a, b), (b, a)] {
        if let Some(Const::Bool(known)) = w.f.constant(known) {
            return if *known == (this == Op::Equal) {
                Some(New::Value(other))
            } else {
                op(Op::Not, &[other])
            };
        }
    }
    None
}
