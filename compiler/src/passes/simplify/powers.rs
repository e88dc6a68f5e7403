//! Rules for powers and roots.

use super::range::range;
use super::{New, Site, is, number, op};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId};
use crate::passes::rewrite::Rewriter;

/// The square root of 2^127, to which `pow` limits its results.
const ROOT_OF_LIMIT: f64 = 13_043_817_825_332_782_212.0;

/// `pow` is 1 for an exponent of 0, else 0 for bases that are not positive; results are limited
/// to 2^127. The replacements keep that, and are nearer to the true power than `exp2(y log2 x)`:
/// within an ulp of it.
pub(super) fn pow(w: &mut Rewriter<'_>, site: Site, x: ExprId, y: ExprId) -> Option<New> {
    if is(w, x, 1.0) {
        return site.number(1.0);
    }
    let exponent = number(w, y)?;
    if exponent == 0.0 {
        return site.number(1.0);
    }
    if w.f.ty(x) != site.ty {
        return None;
    }
    if exponent == 0.5 {
        return op(Op::Sqrt, &[x]);
    }
    if exponent == 1.0 {
        let zero = w.constant(Const::Float(vec![0.0]), site.span);
        return op(Op::Max, &[x, zero]);
    }
    if exponent == 2.0 {
        let base = limited(w, site, x)?;
        return op(Op::Mul, &[base, base]);
    }
    None
}

/// `x`, at least zero and at most what can be squared.
fn limited(w: &mut Rewriter<'_>, site: Site, x: ExprId) -> Option<ExprId> {
    let known = range(w.f, x);
    if known.low >= 0.0 && known.high <= ROOT_OF_LIMIT {
        return Some(x);
    }
    let low = w.constant(Const::Float(vec![0.0]), site.span);
    let high = w.constant(Const::Float(vec![ROOT_OF_LIMIT]), site.span);
    w.op(Op::Clamp, &[x, low, high], site.span)
}

pub(super) fn sqrt(w: &Rewriter<'_>, a: ExprId) -> Option<New> {
    match w.operation(a)? {
        // Nearer to the root: the square is not rounded, nor lost where it is tiny.
        (Op::Mul, &[x, y]) if w.same(x, y) => op(Op::Abs, &[x]),
        _ => None,
    }
}

/// The square of a root is what it is the root of; `sqrt` takes what is negative as zero.
pub(super) fn mul(w: &mut Rewriter<'_>, site: Site, a: ExprId, b: ExprId) -> Option<New> {
    if !w.same(a, b) {
        return None;
    }
    let (Op::Sqrt, &[x]) = w.operation(a)? else {
        return None;
    };
    let zero = w.constant(Const::Float(vec![0.0]), site.span);
    op(Op::Max, &[x, zero])
}
