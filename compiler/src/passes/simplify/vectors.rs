//! Rules for vectors.

use super::{New, Site, is, op};
use crate::ir::ops::{Op, Shape};
use crate::ir::{Const, ExprId, ExprKind, Type};
use crate::passes::rewrite::Rewriter;

pub(super) fn normalize(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    match w.operation(a)? {
        // What has length one or zero keeps it; once more would only add rounding.
        (Op::Normalize, _) => Some(New::Value(a)),
        _ => None,
    }
}

pub(super) fn dot(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if is(w, a, 0.0) || is(w, b, 0.0) {
        return site.number(0.0);
    }
    // The other components are multiplied by zero, which adds exactly nothing.
    for (axis, other) in [(a, b), (b, a)] {
        if let Some(component) = unit_axis(w, axis) {
            return Some(New::Kind(ExprKind::Swizzle(other, vec![component])));
        }
    }
    None
}

/// The axis that a constant vector is the unit vector of.
fn unit_axis(w: &Rewriter<'_>, id: ExprId) -> Option<u8> {
    let Const::Float(v) = w.f.constant(id)? else {
        return None;
    };
    let axis = v.iter().position(|&x| x == 1.0)?;
    let zeros = v.iter().filter(|&&x| x == 0.0).count();
    (zeros + 1 == v.len()).then_some(axis as u8)
}

pub(super) fn cross(w: &Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    // Every component is a difference of equal products.
    (w.same(a, b) || is(w, a, 0.0) || is(w, b, 0.0))
        .then(|| site.number(0.0))
        .flatten()
}

/// The greatest or least of equal components is that component.
pub(super) fn extreme_component(w: &Rewriter<'_>, site: Site, a: ExprId) -> Option<New> {
    splat(w, a).and_then(|x| site.value(w, x))
}

/// An operation by component takes a scalar for a vector of equal components, as long as another
/// operand is wide.
pub(super) fn narrow(w: &Rewriter<'_>, site: Site, this: Op, a: ExprId, b: ExprId) -> Option<New> {
    let by_component = matches!(this.info().shape, Shape::Float(2) | Shape::Number(2));
    if !by_component || site.ty == Type::Float {
        return None;
    }
    match (splat(w, a), splat(w, b)) {
        (Some(x), None) if w.f.ty(b) == site.ty => op(this, &[x, b]),
        (None, Some(y)) if w.f.ty(a) == site.ty => op(this, &[a, y]),
        _ => None,
    }
}

/// The scalar that fills a vector.
fn splat(w: &Rewriter<'_>, id: ExprId) -> Option<ExprId> {
    match w.kind(id) {
        ExprKind::Compose(parts) if w.f.ty(id) != Type::Mat3 => match parts.as_slice() {
            [only] if w.f.ty(*only) == Type::Float => Some(*only),
            _ => None,
        },
        _ => None,
    }
}
