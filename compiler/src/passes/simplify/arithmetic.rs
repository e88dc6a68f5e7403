//! Rules for sums, products, quotients and blends.

use super::{New, Site, is, number, op};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, Type};
use crate::passes::rewrite::Rewriter;

/// Exponents of the powers of two whose reciprocals are normal in single precision.
const NORMAL_EXPONENTS: std::ops::RangeInclusive<f64> = -126.0..=126.0;

pub(super) fn neg(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    // Negation is exact, so two of them are none.
    negated(w, a).map(New::Value)
}

pub(super) fn add(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if is(w, b, 0.0) {
        // Exact; the sign of a zero does not matter.
        return site.value(w, a);
    }
    if is(w, a, 0.0) {
        return site.value(w, b);
    }
    // IEEE 754 defines x - y as x + (-y).
    match (negated(w, a), negated(w, b)) {
        (_, Some(b)) => op(Op::Sub, &[a, b]),
        (Some(a), None) => op(Op::Sub, &[b, a]),
        (None, None) => None,
    }
}

pub(super) fn sub(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if is(w, b, 0.0) {
        return site.value(w, a);
    }
    if w.same(a, b) {
        // Exact for everything finite.
        return site.number(0.0);
    }
    if is(w, a, 0.0) && w.f.ty(b) == site.ty {
        return op(Op::Neg, &[b]);
    }
    op(Op::Add, &[a, negated(w, b)?])
}

pub(super) fn mul(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if is(w, a, 0.0) || is(w, b, 0.0) {
        // Nothing is infinite, so zero times anything is zero.
        return site.number(0.0);
    }
    if is(w, b, 1.0) {
        return site.value(w, a);
    }
    if is(w, a, 1.0) {
        return site.value(w, b);
    }
    if is(w, b, -1.0) && w.f.ty(a) == site.ty {
        return op(Op::Neg, &[a]);
    }
    if is(w, a, -1.0) && w.f.ty(b) == site.ty {
        return op(Op::Neg, &[b]);
    }
    // Signs of products are exact.
    op(Op::Mul, &[negated(w, a)?, negated(w, b)?])
}

pub(super) fn div(w: &mut Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if is(w, a, 0.0) || is(w, b, 0.0) {
        // Zero over anything is zero, and anything over zero is by definition.
        return site.number(0.0);
    }
    if is(w, b, 1.0) {
        return site.value(w, a);
    }
    if is(w, b, -1.0) && w.f.ty(a) == site.ty {
        return op(Op::Neg, &[a]);
    }
    if site.ty != Type::Int
        && let Some(c) = number(w, b)
        && is_power_of_two(c)
    {
        // Both round the same real number. A product costs no special-function unit.
        let width = w.f.ty(b).width()?;
        let reciprocal = w.constant(Const::Float(vec![1.0 / c; width]), site.span);
        return op(Op::Mul, &[a, reciprocal]);
    }
    None
}

pub(super) fn mix(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId, t: ExprId) -> Option<New> {
    if is(w, t, 0.0) || w.same(a, b) {
        // a (1 - t) + a t is a, but for rounding: within an ulp of a for t in [0, 1].
        return site.value(w, a);
    }
    if is(w, t, 1.0) {
        return site.value(w, b);
    }
    if is(w, a, 0.0) {
        // 0 (1 - t) + b t, with the first term exactly zero.
        let typed = [b, t].iter().any(|&x| w.f.ty(x) == site.ty);
        return typed.then_some(()).and_then(|()| op(Op::Mul, &[b, t]));
    }
    None
}

fn negated(w: &Rewriter<'_>, id: ExprId) -> Option<ExprId> {
    match w.operation(id)? {
        (Op::Neg, &[inner]) => Some(inner),
        _ => None,
    }
}

fn is_power_of_two(c: f64) -> bool {
    let exponent = c.abs().log2();
    c != 0.0 && exponent.fract() == 0.0 && NORMAL_EXPONENTS.contains(&exponent)
}
