//! Which values an expression can have, as far as its operations tell.
//!
//! Bounds hold for the computed value in f64, in f32 and on a GPU, not only for the exact one. So
//! only correctly rounded operations get numeric bounds: rounding is monotone, and a rounded
//! bound bounds what is rounded. Of others no more than the sign is used.

use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, ExprKind, Function};

/// How deep operands are followed.
const MAX_DEPTH: u32 = 6;

/// An interval that all components lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    /// No component is less; minus infinity if nothing is known.
    pub low: f64,
    /// No component is greater; infinity if nothing is known.
    pub high: f64,
}

const ALL: Range = Range::new(f64::NEG_INFINITY, f64::INFINITY);
const NOT_NEGATIVE: Range = Range::new(0.0, f64::INFINITY);
const UNIT: Range = Range::new(0.0, 1.0);

/// The range of an expression.
pub(super) fn range(f: &Function, id: ExprId) -> Range {
    bounded(f, id, MAX_DEPTH)
}

fn bounded(f: &Function, id: ExprId, depth: u32) -> Range {
    let Some(depth) = depth.checked_sub(1) else {
        return ALL;
    };
    let of = |id: ExprId| bounded(f, id, depth);
    match &f.expr(id).kind {
        ExprKind::Const(Const::Float(v)) => {
            let each = v.iter().map(|&x| rounded(x, x));
            each.reduce(Range::hull).unwrap_or(ALL)
        }
        ExprKind::Const(Const::Int(i)) => Range::new(f64::from(*i), f64::from(*i)),
        ExprKind::Compose(parts) => parts
            .iter()
            .map(|&p| of(p))
            .reduce(Range::hull)
            .unwrap_or(ALL),
        ExprKind::Swizzle(v, _) => of(*v),
        ExprKind::Op(op, args) => operation(f, *op, args, of),
        _ => ALL,
    }
}

fn operation(f: &Function, op: Op, args: &[ExprId], of: impl Fn(ExprId) -> Range) -> Range {
    let all_floats = args.iter().all(|&a| f.ty(a).width().is_some());
    match (op, args) {
        (Op::Min, &[a, b]) => of(a).min(of(b)),
        (Op::Max, &[a, b]) => of(a).max(of(b)),
        (Op::Clamp, &[x, low, high]) => of(x).max(of(low)).min(of(high)),
        (Op::Select, &[_, a, b]) => of(a).hull(of(b)),
        (Op::MaxComponent | Op::MinComponent, &[a]) => of(a),
        // What follows may wrap around in integers.
        _ if !all_floats => match op {
            Op::UnitFloat => UNIT,
            _ => ALL,
        },
        (Op::Neg, &[a]) => of(a).negated(),
        (Op::Add, &[a, b]) => of(a).plus(of(b)),
        (Op::Sub, &[a, b]) => of(a).plus(of(b).negated()),
        (Op::Mul, &[a, b]) if same(f, a, b) => of(a).times(of(b)).max(Range::new(0.0, 0.0)),
        (Op::Mul, &[a, b]) => of(a).times(of(b)),
        (Op::Saturate, &[a]) => of(a).max(Range::new(0.0, 0.0)).min(Range::new(1.0, 1.0)),
        (Op::Abs, &[a]) => of(a).magnitude(),
        (Op::Fract | Op::Step, _) => UNIT,
        (Op::Floor, &[a]) => of(a).map(f64::floor),
        (Op::Ceil, &[a]) => of(a).map(f64::ceil),
        (Op::Round, &[a]) => of(a).map(f64::round_ties_even),
        (Op::Div, &[a, b]) if of(a).low >= 0.0 && of(b).low >= 0.0 => NOT_NEGATIVE,
        (Op::Dot, &[a, b]) if same(f, a, b) => NOT_NEGATIVE,
        (Op::Luminance | Op::SrgbDecode, &[a]) if of(a).low >= 0.0 => NOT_NEGATIVE,
        (Op::Mix, &[a, b, t]) if of(a).low >= 0.0 && of(b).low >= 0.0 && of(t).within(UNIT) => {
            NOT_NEGATIVE
        }
        (Op::Smoothstep | Op::Sqrt | Op::InverseSqrt | Op::Exp | Op::Exp2 | Op::Pow, _) => {
            NOT_NEGATIVE
        }
        (Op::Length | Op::Distance, _) => NOT_NEGATIVE,
        _ => ALL,
    }
}

/// Are two operands one value? Parameters may have an expression for each use.
fn same(f: &Function, a: ExprId, b: ExprId) -> bool {
    let (x, y) = (&f.expr(a).kind, &f.expr(b).kind);
    a == b || x.is_free() && x == y
}

/// Bounds of what rounds from within `low` and `high`, in either precision.
fn rounded(low: f64, high: f64) -> Range {
    let (low32, high32) = (f64::from(low as f32), f64::from(high as f32));
    Range::new(low.min(low32), high.max(high32))
}

impl Range {
    const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    fn hull(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.max(other.high))
    }

    fn within(self, other: Self) -> bool {
        self.low >= other.low && self.high <= other.high
    }

    fn min(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.min(other.high))
    }

    fn max(self, other: Self) -> Self {
        Self::new(self.low.max(other.low), self.high.max(other.high))
    }

    fn negated(self) -> Self {
        Self::new(-self.high, -self.low)
    }

    fn magnitude(self) -> Self {
        let high = self.low.abs().max(self.high.abs());
        let low = if self.low <= 0.0 && self.high >= 0.0 {
            0.0
        } else {
            self.low.abs().min(self.high.abs())
        };
        Self::new(low, high)
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.low), f(self.high))
    }

    fn plus(self, other: Self) -> Self {
        rounded(self.low + other.low, self.high + other.high)
    }

    fn times(self, other: Self) -> Self {
        // An infinite bound stands for some large finite value, of which zero times is zero.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let corners = [
            product(self.low, other.low),
            product(self.low, other.high),
            product(self.high, other.low),
            product(self.high, other.high),
        ];
        let low = corners.iter().copied().fold(f64::INFINITY, f64::min);
        let high = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        rounded(low, high)
    }
}
