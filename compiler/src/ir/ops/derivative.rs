//! The op table's column of derivatives: how the result of an op changes with its operands.
//!
//! A rule adds to a function the operations that give the tangent of an op's result (its change
//! along one direction) from those of its operands; `None` is a tangent that is zero everywhere and costs
//! nothing. Steps (`floor`, `step`, comparisons, hashes: `zero` in the table) have derivative 0 wherever
//! they have one, and so everywhere, as in OSL.
//!
//! Rules give finite numbers, as operations do ("Nothing is undefined"): what `x / 0` makes 0 has derivative
//! 0 there, and a derivative that grows beyond every bound near a pole is cut at [`STEEPEST`].

use super::Op;
use crate::ir::build::Builder;
use crate::ir::{Const, ExprId, Type};
use crate::source::Span;

/// The change of a value along one direction, of the value's type; zero when absent.
pub type Tangent = Option<ExprId>;

/// Derivatives are cut here: their squares are finite in single precision.
pub const STEEPEST: f64 = 1e18;

/// An op of a function whose tangent is wanted.
pub struct Rule<'r> {
    /// Where operations are added.
    pub b: &'r mut Builder,
    /// The op.
    pub op: Op,
    /// Its operands.
    pub args: &'r [ExprId],
    /// Its result.
    pub value: ExprId,
    /// The tangents of its operands.
    pub tangents: &'r [Tangent],
    /// Where the op was written.
    pub span: Span,
}

impl Op {
    /// Does its result change by steps only, so that its derivative is 0?
    pub fn is_step(self) -> bool {
        self.derivative().is_none()
    }

    /// Adds the tangent of an op's result.
    pub fn tangent(mut rule: Rule<'_>) -> Tangent {
        if rule.tangents.iter().all(Option::is_none) {
            return None;
        }
        let derivative = rule.op.derivative()?;
        let tangent = derivative(&mut rule)?;
        Some(rule.as_wide_as_value(tangent))
    }
}

// ---- What rules are written in ---------------------------------------------------------------

impl Rule<'_> {
    fn op(&mut self, op: Op, args: &[ExprId]) -> ExprId {
        self.b.op(op, args, self.span)
    }

    fn number(&mut self, x: f64) -> ExprId {
        self.b.float(x, self.span)
    }

    fn times(&mut self, a: Tangent, by: ExprId) -> Tangent {
        Some(self.op(Op::Mul, &[a?, by]))
    }

    fn scaled(&mut self, a: Tangent, by: f64) -> Tangent {
        let by = self.number(by);
        self.times(a, by)
    }

    fn over(&mut self, a: Tangent, by: ExprId) -> Tangent {
        Some(self.op(Op::Div, &[a?, by]))
    }

    fn negative(&mut self, a: Tangent) -> Tangent {
        Some(self.op(Op::Neg, &[a?]))
    }

    fn plus(&mut self, a: Tangent, b: Tangent) -> Tangent {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.op(Op::Add, &[a, b])),
            (one, other) => one.or(other),
        }
    }

    fn minus(&mut self, a: Tangent, b: Tangent) -> Tangent {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.op(Op::Sub, &[a, b])),
            (Some(a), None) => Some(a),
            (None, b) => self.negative(b),
        }
    }

    /// `a` where `t` is 0, `b` where it is 1, by component.
    fn between(&mut self, a: Tangent, b: Tangent, t: ExprId) -> Tangent {
        match (a, b) {
            (None, b) => self.times(b, t),
            (Some(a), b) => {
                let b = b.unwrap_or_else(|| self.number(0.0));
                Some(self.op(Op::Mix, &[a, b, t]))
            }
        }
    }

    /// Held within the finite, where the op has a pole.
    fn cut(&mut self, a: Tangent) -> Tangent {
        let (low, high) = (self.number(-STEEPEST), self.number(STEEPEST));
        Some(self.op(Op::Clamp, &[a?, low, high]))
    }

    /// 0 in components where `x` is.
    fn unless_zero(&mut self, a: Tangent, x: ExprId) -> Tangent {
        match self.b.function().constant(x) {
            Some(Const::Float(v)) if v.iter().all(|x| *x != 0.0) => a,
            _ => {
                let sign = self.op(Op::Sign, &[x]);
                let mask = self.op(Op::Abs, &[sign]);
                self.times(a, mask)
            }
        }
    }

    /// A float in every component, where the value is a vector.
    fn as_wide_as_value(&mut self, tangent: ExprId) -> ExprId {
        let ty = self.b.ty(self.value);
        match ty.width() {
            Some(width) if width > 1 && self.b.ty(tangent) == Type::Float => {
                self.b.compose(ty, &[tangent], self.span)
            }
            _ => tangent,
        }
    }
}

// ---- Rules -----------------------------------------------------------------------------------

pub(super) fn neg(r: &mut Rule<'_>) -> Tangent {
    r.negative(r.tangents[0])
}

pub(super) fn add(r: &mut Rule<'_>) -> Tangent {
    r.plus(r.tangents[0], r.tangents[1])
}

pub(super) fn sub(r: &mut Rule<'_>) -> Tangent {
    r.minus(r.tangents[0], r.tangents[1])
}

/// Of anything linear in both operands: products of numbers, of vectors, of a matrix and a vector.
pub(super) fn product(r: &mut Rule<'_>) -> Tangent {
    let (op, args) = (r.op, r.args);
    let a = r.tangents[0].map(|da| r.op(op, &[da, args[1]]));
    let b = r.tangents[1].map(|db| r.op(op, &[args[0], db]));
    r.plus(a, b)
}

/// (da - y db) / b
pub(super) fn div(r: &mut Rule<'_>) -> Tangent {
    let (b, value) = (r.args[1], r.value);
    let lost = r.times(r.tangents[1], value);
    let left = r.minus(r.tangents[0], lost);
    let change = r.over(left, b);
    match r.b.function().constant(b) {
        Some(_) => change,
        None => r.cut(change),
    }
}

/// x - n y with a whole number n, which is (x - value) / y.
pub(super) fn remainder(r: &mut Rule<'_>) -> Tangent {
    let [x, y] = [r.args[0], r.args[1]];
    let lost = match r.tangents[1] {
        Some(dy) => {
            let whole = r.op(Op::Sub, &[x, r.value]);
            let quotient = r.op(Op::Div, &[whole, y]);
            let count = r.op(Op::Round, &[quotient]);
            let count = r.cut(Some(count))?;
            Some(r.op(Op::Mul, &[dy, count]))
        }
        None => None,
    };
    let change = r.minus(r.tangents[0], lost);
    r.unless_zero(change, y)
}

pub(super) fn min(r: &mut Rule<'_>) -> Tangent {
    let first = r.op(Op::Step, &[r.args[0], r.args[1]]);
    r.between(r.tangents[1], r.tangents[0], first)
}

pub(super) fn max(r: &mut Rule<'_>) -> Tangent {
    let first = r.op(Op::Step, &[r.args[1], r.args[0]]);
    r.between(r.tangents[1], r.tangents[0], first)
}

/// min(max(x, low), high)
pub(super) fn clamp(r: &mut Rule<'_>) -> Tangent {
    let [x, low, high] = [r.args[0], r.args[1], r.args[2]];
    let above_low = r.op(Op::Step, &[low, x]);
    let raised = r.op(Op::Max, &[x, low]);
    let below_high = r.op(Op::Step, &[raised, high]);
    let inner = r.between(r.tangents[1], r.tangents[0], above_low);
    r.between(r.tangents[2], inner, below_high)
}

pub(super) fn saturate(r: &mut Rule<'_>) -> Tangent {
    let (zero, one) = (r.number(0.0), r.number(1.0));
    let above = r.op(Op::Step, &[zero, r.args[0]]);
    let below = r.op(Op::Step, &[r.args[0], one]);
    let within = r.op(Op::Mul, &[above, below]);
    r.times(r.tangents[0], within)
}

/// (1 - t) da + t db + (b - a) dt
pub(super) fn mix(r: &mut Rule<'_>) -> Tangent {
    let [a, b, t] = [r.args[0], r.args[1], r.args[2]];
    let ends = r.between(r.tangents[0], r.tangents[1], t);
    let moved = r.tangents[2].map(|dt| {
        let apart = r.op(Op::Sub, &[b, a]);
        r.op(Op::Mul, &[dt, apart])
    });
    r.plus(ends, moved)
}

/// With t the place between the ends: 6 t (1 - t) (dx - mix(dlow, dhigh, t)) / (high - low)
pub(super) fn smoothstep(r: &mut Rule<'_>) -> Tangent {
    let [low, high, x] = [r.args[0], r.args[1], r.args[2]];
    let range = r.op(Op::Sub, &[high, low]);
    let from_low = r.op(Op::Sub, &[x, low]);
    let place = r.op(Op::Div, &[from_low, range]);
    let t = r.op(Op::Saturate, &[place]);
    let one = r.number(1.0);
    let rest = r.op(Op::Sub, &[one, t]);
    let bump = r.op(Op::Mul, &[t, rest]);
    let ends = r.between(r.tangents[0], r.tangents[1], t);
    let moved = r.minus(r.tangents[2], ends);
    let change = r.times(moved, bump);
    let change = r.scaled(change, 6.0);
    let change = r.over(change, range);
    match r.b.function().constant(range) {
        Some(_) => change,
        None => r.cut(change),
    }
}

pub(super) fn abs(r: &mut Rule<'_>) -> Tangent {
    let sign = r.op(Op::Sign, &[r.args[0]]);
    r.times(r.tangents[0], sign)
}

/// What differs from its operand by steps only.
pub(super) fn same(r: &mut Rule<'_>) -> Tangent {
    r.tangents[0]
}

pub(super) fn sqrt(r: &mut Rule<'_>) -> Tangent {
    let inverse = r.op(Op::InverseSqrt, &[r.args[0]]);
    let change = r.times(r.tangents[0], inverse);
    let change = r.scaled(change, 0.5);
    r.cut(change)
}

/// y = x^-1/2, so dy = -1/2 y^3 dx.
pub(super) fn inverse_sqrt(r: &mut Rule<'_>) -> Tangent {
    let squared = r.op(Op::Mul, &[r.value, r.value]);
    let cubed = r.op(Op::Mul, &[squared, r.value]);
    let slope = r.cut(Some(cubed))?;
    let change = r.times(r.tangents[0], slope);
    let change = r.scaled(change, -0.5);
    r.cut(change)
}

pub(super) fn exp(r: &mut Rule<'_>) -> Tangent {
    let change = r.times(r.tangents[0], r.value);
    r.cut(change)
}

pub(super) fn exp2(r: &mut Rule<'_>) -> Tangent {
    let change = r.times(r.tangents[0], r.value);
    let change = r.scaled(change, std::f64::consts::LN_2);
    r.cut(change)
}

/// dx / x; below 0 the logarithm is constant.
pub(super) fn log(r: &mut Rule<'_>) -> Tangent {
    let zero = r.number(0.0);
    let x = r.op(Op::Max, &[r.args[0], zero]);
    let change = r.over(r.tangents[0], x);
    r.cut(change)
}

pub(super) fn log2(r: &mut Rule<'_>) -> Tangent {
    let change = log(r);
    r.scaled(change, std::f64::consts::LOG2_E)
}

/// y x^(y - 1) dx + log(x) x^y dy; below 0 a power is constant.
pub(super) fn pow(r: &mut Rule<'_>) -> Tangent {
    let [x, y] = [r.args[0], r.args[1]];
    let (zero, one) = (r.number(0.0), r.number(1.0));
    let by_base = r.tangents[0].map(|dx| {
        let less = r.op(Op::Sub, &[y, one]);
        let power = r.op(Op::Pow, &[x, less]);
        let slope = r.op(Op::Mul, &[y, power]);
        let positive = r.op(Op::Step, &[zero, x]);
        let slope = r.op(Op::Mul, &[slope, positive]);
        (dx, slope)
    });
    let by_exponent = r.tangents[1].map(|dy| {
        let log = r.op(Op::Log, &[x]);
        let slope = r.op(Op::Mul, &[log, r.value]);
        // 0^0 is 1, but 0^y is 0 beside it.
        let inside = r.op(Op::Sign, &[x]);
        let inside = r.op(Op::Max, &[inside, zero]);
        let slope = r.op(Op::Mul, &[slope, inside]);
        (dy, slope)
    });
    let [by_base, by_exponent] = [by_base, by_exponent].map(|part| {
        let (tangent, slope) = part?;
        let slope = r.cut(Some(slope))?;
        let change = r.times(Some(tangent), slope);
        r.cut(change)
    });
    r.plus(by_base, by_exponent)
}

pub(super) fn sin(r: &mut Rule<'_>) -> Tangent {
    let cos = r.op(Op::Cos, &[r.args[0]]);
    r.times(r.tangents[0], cos)
}

pub(super) fn cos(r: &mut Rule<'_>) -> Tangent {
    let sin = r.op(Op::Sin, &[r.args[0]]);
    let change = r.times(r.tangents[0], sin);
    r.negative(change)
}

/// (1 + y^2) dx
pub(super) fn tan(r: &mut Rule<'_>) -> Tangent {
    let slope = one_and_square(r, r.value);
    let change = r.times(r.tangents[0], slope);
    r.cut(change)
}

/// dx / sqrt(1 - x^2); beyond 1 it is constant.
pub(super) fn asin(r: &mut Rule<'_>) -> Tangent {
    let squared = r.op(Op::Mul, &[r.args[0], r.args[0]]);
    let one = r.number(1.0);
    let rest = r.op(Op::Sub, &[one, squared]);
    let slope = r.op(Op::InverseSqrt, &[rest]);
    r.times(r.tangents[0], slope)
}

pub(super) fn acos(r: &mut Rule<'_>) -> Tangent {
    let change = asin(r);
    r.negative(change)
}

pub(super) fn atan(r: &mut Rule<'_>) -> Tangent {
    let steep = one_and_square(r, r.args[0]);
    r.over(r.tangents[0], steep)
}

/// 1 + x^2
fn one_and_square(r: &mut Rule<'_>, x: ExprId) -> ExprId {
    let squared = r.op(Op::Mul, &[x, x]);
    let one = r.number(1.0);
    r.op(Op::Add, &[one, squared])
}

/// (x dy - y dx) / (x^2 + y^2)
pub(super) fn atan2(r: &mut Rule<'_>) -> Tangent {
    let [y, x] = [r.args[0], r.args[1]];
    let by_y = r.times(r.tangents[0], x);
    let by_x = r.times(r.tangents[1], y);
    let turned = r.minus(by_y, by_x);
    let (xx, yy) = (r.op(Op::Mul, &[x, x]), r.op(Op::Mul, &[y, y]));
    let squared = r.op(Op::Add, &[xx, yy]);
    let change = r.over(turned, squared);
    r.cut(change)
}

pub(super) fn srgb_decode(r: &mut Rule<'_>) -> Tangent {
    let c = r.args[0];
    let (knee, toe, linear) = (r.number(0.04045), r.number(0.055), r.number(1.0 / 12.92));
    let (white, exponent) = (r.number(1.055), r.number(1.4));
    let shifted = r.op(Op::Add, &[c, toe]);
    let ratio = r.op(Op::Div, &[shifted, white]);
    let power = r.op(Op::Pow, &[ratio, exponent]);
    let scale = r.number(2.4 / 1.055);
    let curved = r.op(Op::Mul, &[power, scale]);
    let dark = r.op(Op::Step, &[c, knee]);
    let slope = r.op(Op::Mix, &[curved, linear, dark]);
    r.times(r.tangents[0], slope)
}

pub(super) fn length(r: &mut Rule<'_>) -> Tangent {
    let along = r.op(Op::Dot, &[r.args[0], r.tangents[0]?]);
    r.over(Some(along), r.value)
}

pub(super) fn distance(r: &mut Rule<'_>) -> Tangent {
    let between = r.op(Op::Sub, &[r.args[0], r.args[1]]);
    let moved = r.minus(r.tangents[0], r.tangents[1])?;
    let along = r.op(Op::Dot, &[between, moved]);
    r.over(Some(along), r.value)
}

/// What of dv is across the direction n, over the length: (dv - n (n . dv)) / |v|
pub(super) fn normalize(r: &mut Rule<'_>) -> Tangent {
    let (n, dv) = (r.value, r.tangents[0]?);
    let along = r.op(Op::Dot, &[n, dv]);
    let along = r.op(Op::Mul, &[n, along]);
    let across = r.op(Op::Sub, &[dv, along]);
    let length = r.op(Op::Length, &[r.args[0]]);
    let change = r.over(Some(across), length);
    r.cut(change)
}

/// v - 2 (n . v) n
pub(super) fn reflect(r: &mut Rule<'_>) -> Tangent {
    let [v, n] = [r.args[0], r.args[1]];
    let (dv, dn) = (r.tangents[0], r.tangents[1]);
    let by_v = dv.map(|dv| r.op(Op::Dot, &[dv, n]));
    let by_n = dn.map(|dn| r.op(Op::Dot, &[v, dn]));
    let longer = r.plus(by_v, by_n);
    let moved = r.times(longer, n);
    let turned = dn.map(|dn| {
        let along = r.op(Op::Dot, &[v, n]);
        r.op(Op::Mul, &[dn, along])
    });
    let lost = r.plus(moved, turned);
    let lost = r.scaled(lost, 2.0);
    r.minus(dv, lost)
}

pub(super) fn max_component(r: &mut Rule<'_>) -> Tangent {
    let extreme = r.op(Op::Step, &[r.value, r.args[0]]);
    of_components(r, extreme)
}

pub(super) fn min_component(r: &mut Rule<'_>) -> Tangent {
    let extreme = r.op(Op::Step, &[r.args[0], r.value]);
    of_components(r, extreme)
}

/// The mean change of the components where `extreme` is 1: several may be equally extreme.
fn of_components(r: &mut Rule<'_>, extreme: ExprId) -> Tangent {
    let sum = r.op(Op::Dot, &[extreme, r.tangents[0]?]);
    let count = r.op(Op::Dot, &[extreme, extreme]);
    r.over(Some(sum), count)
}

/// The op of the tangent, where it is linear.
pub(super) fn linear(r: &mut Rule<'_>) -> Tangent {
    let op = r.op;
    Some(r.op(op, &[r.tangents[0]?]))
}

/// A choice changes as what it chooses.
pub(super) fn select(r: &mut Rule<'_>) -> Tangent {
    let (a, b) = (r.tangents[1]?, r.tangents[2]?);
    Some(r.op(Op::Select, &[r.args[0], a, b]))
}

/// What a picture changes by from here to the end of the step: the picture has no derivative of its own
/// between the places where it is known.
pub(super) fn lookup(r: &mut Rule<'_>) -> Tangent {
    let moved = r.op(Op::Add, &[r.args[1], r.tangents[1]?]);
    let mut there = r.args.to_vec();
    there[1] = moved;
    let op = r.op;
    let other = r.op(op, &there);
    Some(r.op(Op::Sub, &[other, r.value]))
}
