//! Rules for limits: those that cannot matter go, and nested ones become one.

use super::range::range;
use super::{New, Site, is, number, op};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, Type};
use crate::passes::rewrite::Rewriter;

pub(super) fn abs(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    if range(w.f, a).low >= 0.0 {
        return Some(New::Value(a));
    }
    match w.operation(a)? {
        (Op::Neg, &[inner]) => op(Op::Abs, &[inner]),
        _ => None,
    }
}

pub(super) fn saturate(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    let known = range(w.f, a);
    if known.low >= 0.0 && known.high <= 1.0 {
        return Some(New::Value(a));
    }
    // Limits outside [0, 1] are passed by it anyway.
    match w.operation(a)? {
        (Op::Max, &[x, y]) if limits(w, a, x, y, |c| c <= 0.0) => op(Op::Saturate, &[x]),
        (Op::Max, &[x, y]) if limits(w, a, y, x, |c| c <= 0.0) => op(Op::Saturate, &[y]),
        (Op::Min, &[x, y]) if limits(w, a, x, y, |c| c >= 1.0) => op(Op::Saturate, &[x]),
        (Op::Min, &[x, y]) if limits(w, a, y, x, |c| c >= 1.0) => op(Op::Saturate, &[y]),
        _ => None,
    }
}

/// Is `limit` a constant that passes `test`, and `value` as wide as the result `of` limiting it?
fn limits(
    w: &Rewriter<'_>,
    of: ExprId,
    value: ExprId,
    limit: ExprId,
    test: impl Fn(f64) -> bool,
) -> bool {
    w.f.ty(value) == w.f.ty(of) && number(w, limit).is_some_and(test)
}

pub(super) fn min(w: &mut Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    let (x, y) = (range(w.f, a), range(w.f, b));
    if w.same(a, b) || x.high <= y.low {
        return site.value(w, a);
    }
    if y.high <= x.low {
        return site.value(w, b);
    }
    nested(w, site, Op::Min, a, b)
}

pub(super) fn max(w: &mut Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    let (x, y) = (range(w.f, a), range(w.f, b));
    if w.same(a, b) || x.low >= y.high {
        return site.value(w, a);
    }
    if y.low >= x.high {
        return site.value(w, b);
    }
    nested(w, site, Op::Max, a, b)
}

/// `min(min(x, c), d)` is `min(x, min(c, d))`: choosing the least does not round.
fn nested(w: &mut Rewriter<'_>, site: Site, this: Op, a: ExprId, b: ExprId) -> Option<New> {
    let (inner, outer_limit) = match (w.f.constant(a), w.f.constant(b)) {
        (None, Some(_)) => (a, b),
        (Some(_), None) => (b, a),
        _ => return None,
    };
    let (value, limit) = match w.operation(inner)? {
        (op, &[x, c]) if op == this && w.f.constant(c).is_some() => (x, c),
        (op, &[c, x]) if op == this && w.f.constant(c).is_some() => (x, c),
        _ => return None,
    };
    let limit = w.op(this, &[limit, outer_limit], site.span)?;
    let typed = w.f.ty(value) == site.ty || w.f.ty(limit) == site.ty;
    typed.then_some(()).and_then(|()| op(this, &[value, limit]))
}

pub(super) fn clamp(
    w: &mut Rewriter<'_>,
    site: Site,
    x: ExprId,
    low: ExprId,
    high: ExprId,
) -> Option<New> {
    if w.f.ty(x) != site.ty {
        return None;
    }
    nested_clamp(w, site, x, low, high).or_else(|| needed_limits(w, site, x, low, high))
}

/// Limits that what is known of `x` leaves to be applied.
fn needed_limits(
    w: &Rewriter<'_>,
    site: Site,
    x: ExprId,
    low: ExprId,
    high: ExprId,
) -> Option<New> {
    let (known, least, most) = (range(w.f, x), range(w.f, low), range(w.f, high));
    let (above, below) = (known.low >= least.high, known.high <= most.low);
    if above && below {
        return Some(New::Value(x));
    }
    if above {
        return op(Op::Min, &[x, high]);
    }
    // The upper limit is applied last, so it may be left out only if the lower cannot pass it.
    if below && least.high <= most.low {
        return op(Op::Max, &[x, low]);
    }
    if site.ty != Type::Int && is(w, low, 0.0) && is(w, high, 1.0) {
        return op(Op::Saturate, &[x]);
    }
    None
}

/// Limits of limits, where both are constant and in order.
fn nested_clamp(
    w: &mut Rewriter<'_>,
    site: Site,
    x: ExprId,
    low: ExprId,
    high: ExprId,
) -> Option<New> {
    let (l, h) = (number(w, low)?, number(w, high)?);
    let (Op::Clamp, &[inner, inner_low, inner_high]) = w.operation(x)? else {
        return None;
    };
    let (a, b) = (number(w, inner_low)?, number(w, inner_high)?);
    if a > b || l > h || w.f.ty(inner) != site.ty {
        return None;
    }
    let [low, high] = [a, b].map(|c| {
        let c = c.max(l).min(h);
        let constant = match site.ty {
            Type::Int => Const::Int(c as i32),
            ty => Const::Float(vec![c; ty.width().unwrap_or(1)]),
        };
        w.constant(constant, site.span)
    });
    op(Op::Clamp, &[inner, low, high])
}
