//! What operators and functions of WGSL do with the cells of one component.
//!
//! Each is a plain function pointer, so that code of the interpreter holds what to call and nothing
//! has to be looked up while it runs. Integer arithmetic wraps, and division by zero gives what
//! the WGSL specification says.

use naga::{BinaryOperator as Bin, MathFunction as Math, ScalarKind as Kind, UnaryOperator as Un};

use super::float::{Float, as_signed, signed};

/// Functions of one to three components.
pub(super) type Fn1 = fn(u64) -> u64;
pub(super) type Fn2 = fn(u64, u64) -> u64;
pub(super) type Fn3 = fn(u64, u64, u64) -> u64;

fn f<F: Float>(cell: u64) -> F {
    F::of_cell(cell)
}

fn truth(value: bool) -> u64 {
    value.into()
}

/// A binary operator on operands of one kind.
pub(super) fn binary<F: Float>(op: Bin, kind: Kind) -> Option<Fn2> {
    match kind {
        Kind::Float => of_floats::<F>(op),
        Kind::Uint => of_unsigned(op),
        Kind::Sint => of_signed(op),
        Kind::Bool => of_bools(op),
        Kind::AbstractInt | Kind::AbstractFloat => None,
    }
}

fn of_floats<F: Float>(op: Bin) -> Option<Fn2> {
    let function: Fn2 = match op {
        Bin::Add => |a, b| (f::<F>(a) + f(b)).cell(),
        Bin::Subtract => |a, b| (f::<F>(a) - f(b)).cell(),
        Bin::Multiply => |a, b| (f::<F>(a) * f(b)).cell(),
        Bin::Divide => |a, b| (f::<F>(a) / f(b)).cell(),
        Bin::Modulo => |a, b| (f::<F>(a) % f(b)).cell(),
        Bin::Equal => |a, b| truth(f::<F>(a) == f(b)),
        Bin::NotEqual => |a, b| truth(f::<F>(a) != f(b)),
        Bin::Less => |a, b| truth(f::<F>(a) < f(b)),
        Bin::LessEqual => |a, b| truth(f::<F>(a) <= f(b)),
        Bin::Greater => |a, b| truth(f::<F>(a) > f(b)),
        Bin::GreaterEqual => |a, b| truth(f::<F>(a) >= f(b)),
        _ => return None,
    };
    Some(function)
}

fn of_unsigned(op: Bin) -> Option<Fn2> {
    let function: Fn2 = match op {
        Bin::Add => |a, b| (a as u32).wrapping_add(b as u32).into(),
        Bin::Subtract => |a, b| (a as u32).wrapping_sub(b as u32).into(),
        Bin::Multiply => |a, b| (a as u32).wrapping_mul(b as u32).into(),
        Bin::Divide => |a, b| (a as u32).checked_div(b as u32).unwrap_or(a as u32).into(),
        Bin::Modulo => |a, b| (a as u32).checked_rem(b as u32).unwrap_or(0).into(),
        Bin::Less => |a, b| truth((a as u32) < b as u32),
        Bin::LessEqual => |a, b| truth((a as u32) <= b as u32),
        Bin::Greater => |a, b| truth((a as u32) > b as u32),
        Bin::GreaterEqual => |a, b| truth((a as u32) >= b as u32),
        Bin::ShiftRight => |a, b| (a as u32).wrapping_shr(b as u32).into(),
        _ => return of_bits(op),
    };
    Some(function)
}

fn of_signed(op: Bin) -> Option<Fn2> {
    let function: Fn2 = match op {
        Bin::Add => |a, b| signed(as_signed(a).wrapping_add(as_signed(b))),
        Bin::Subtract => |a, b| signed(as_signed(a).wrapping_sub(as_signed(b))),
        Bin::Multiply => |a, b| signed(as_signed(a).wrapping_mul(as_signed(b))),
        Bin::Divide => |a, b| {
            let quotient = as_signed(a).checked_div(as_signed(b));
            signed(quotient.unwrap_or(as_signed(a)))
        },
        Bin::Modulo => |a, b| signed(as_signed(a).checked_rem(as_signed(b)).unwrap_or(0)),
        Bin::Less => |a, b| truth(as_signed(a) < as_signed(b)),
        Bin::LessEqual => |a, b| truth(as_signed(a) <= as_signed(b)),
        Bin::Greater => |a, b| truth(as_signed(a) > as_signed(b)),
        Bin::GreaterEqual => |a, b| truth(as_signed(a) >= as_signed(b)),
        Bin::ShiftRight => |a, b| signed(as_signed(a).wrapping_shr(b as u32)),
        _ => return of_bits(op),
    };
    Some(function)
}

/// What signed and unsigned integers have in common.
fn of_bits(op: Bin) -> Option<Fn2> {
    let function: Fn2 = match op {
        Bin::Equal => |a, b| truth((a as u32) == b as u32),
        Bin::NotEqual => |a, b| truth((a as u32) != b as u32),
        Bin::And => |a, b| ((a & b) as u32).into(),
        Bin::InclusiveOr => |a, b| ((a | b) as u32).into(),
        Bin::ExclusiveOr => |a, b| ((a ^ b) as u32).into(),
        Bin::ShiftLeft => |a, b| (a as u32).wrapping_shl(b as u32).into(),
        _ => return None,
    };
    Some(function)
}

fn of_bools(op: Bin) -> Option<Fn2> {
    let function: Fn2 = match op {
        Bin::LogicalAnd | Bin::And => |a, b| a & b,
        Bin::LogicalOr | Bin::InclusiveOr => |a, b| a | b,
        Bin::Equal => |a, b| truth(a == b),
        Bin::NotEqual | Bin::ExclusiveOr => |a, b| truth(a != b),
        _ => return None,
    };
    Some(function)
}

/// A unary operator.
pub(super) fn unary<F: Float>(op: Un, kind: Kind) -> Option<Fn1> {
    let function: Fn1 = match (op, kind) {
        (Un::Negate, Kind::Float) => |a| (-f::<F>(a)).cell(),
        (Un::Negate, Kind::Sint) => |a| signed(as_signed(a).wrapping_neg()),
        (Un::LogicalNot, Kind::Bool) => |a| a ^ 1,
        (Un::BitwiseNot, Kind::Uint | Kind::Sint) => |a| (!(a as u32)).into(),
        _ => return None,
    };
    Some(function)
}

/// A conversion of values.
pub(super) fn convert<F: Float>(from: Kind, to: Kind) -> Option<Fn1> {
    let function: Fn1 = match (from, to) {
        (Kind::Float, Kind::Uint) => |a| (f::<F>(a).f64() as u32).into(),
        (Kind::Float, Kind::Sint) => |a| signed(f::<F>(a).f64() as i32),
        (Kind::Float, Kind::Bool) => |a| truth(f::<F>(a).f64() != 0.0),
        (Kind::Uint | Kind::Bool, Kind::Float) => |a| F::of(f64::from(a as u32)).cell(),
        (Kind::Sint, Kind::Float) => |a| F::of(f64::from(as_signed(a))).cell(),
        (Kind::Uint | Kind::Sint, Kind::Bool) => |a| truth(a as u32 != 0),
        (Kind::Float, Kind::Float)
        | (Kind::Bool, Kind::Bool)
        | (Kind::Uint | Kind::Sint | Kind::Bool, Kind::Uint | Kind::Sint) => |a| a,
        _ => return None,
    };
    Some(function)
}

/// The same bits as another type.
pub(super) fn bitcast<F: Float>(from: Kind, to: Kind) -> Option<Fn1> {
    let word = |kind| matches!(kind, Kind::Uint | Kind::Sint);
    let function: Fn1 = match (from, to) {
        (Kind::Float, Kind::Float) => |a| a,
        (Kind::Float, to) if word(to) => |a| f::<F>(a).word(),
        (from, Kind::Float) if word(from) => |a| F::of_word(a).cell(),
        (from, to) if word(from) && word(to) => |a| a,
        _ => return None,
    };
    Some(function)
}

/// A function of each component alone.
pub(super) fn math1<F: Float>(function: Math, kind: Kind) -> Option<Fn1> {
    match kind {
        Kind::Float => of_float::<F>(function),
        Kind::Uint | Kind::Sint => of_integer(function, kind == Kind::Sint),
        _ => None,
    }
}

/// Applies a function of f64 to a cell.
fn map<F: Float>(cell: u64, g: impl Fn(f64) -> f64) -> u64 {
    f::<F>(cell).map(g).cell()
}

fn of_float<F: Float>(function: Math) -> Option<Fn1> {
    let function: Fn1 = match function {
        Math::Abs => |a| map::<F>(a, f64::abs),
        Math::Saturate => |a| map::<F>(a, |x| x.clamp(0.0, 1.0)),
        Math::Cos => |a| map::<F>(a, f64::cos),
        Math::Cosh => |a| map::<F>(a, f64::cosh),
        Math::Sin => |a| map::<F>(a, f64::sin),
        Math::Sinh => |a| map::<F>(a, f64::sinh),
        Math::Tan => |a| map::<F>(a, f64::tan),
        Math::Tanh => |a| map::<F>(a, f64::tanh),
        Math::Acos => |a| map::<F>(a, f64::acos),
        Math::Asin => |a| map::<F>(a, f64::asin),
        Math::Atan => |a| map::<F>(a, f64::atan),
        Math::Asinh => |a| map::<F>(a, f64::asinh),
        Math::Acosh => |a| map::<F>(a, f64::acosh),
        Math::Atanh => |a| map::<F>(a, f64::atanh),
        Math::Radians => |a| (f::<F>(a) * F::of(1f64.to_radians())).cell(),
        Math::Degrees => |a| (f::<F>(a) * F::of(1f64.to_degrees())).cell(),
        Math::Ceil => |a| map::<F>(a, f64::ceil),
        Math::Floor => |a| map::<F>(a, f64::floor),
        Math::Round => |a| map::<F>(a, f64::round_ties_even),
        Math::Trunc => |a| map::<F>(a, f64::trunc),
        Math::Fract => |a| (f::<F>(a) - f::<F>(a).map(f64::floor)).cell(),
        Math::Exp => |a| map::<F>(a, f64::exp),
        Math::Exp2 => |a| map::<F>(a, f64::exp2),
        Math::Log => |a| map::<F>(a, f64::ln),
        Math::Log2 => |a| map::<F>(a, f64::log2),
        Math::Sqrt => |a| f::<F>(a).sqrt().cell(),
        Math::InverseSqrt => |a| (F::of(1.0) / f::<F>(a).sqrt()).cell(),
        Math::Sign => |a| {
            map::<F>(a, |x| match x {
                x if x > 0.0 => 1.0,
                x if x < 0.0 => -1.0,
                _ => 0.0,
            })
        },
        Math::QuantizeToF16 => |a| {
            let half = half::f16::from_f32(f::<F>(a).single());
            F::of_single(half.to_f32()).cell()
        },
        _ => return None,
    };
    Some(function)
}

fn of_integer(function: Math, is_signed: bool) -> Option<Fn1> {
    let function: Fn1 = match function {
        Math::Abs if is_signed => |a| signed(as_signed(a).wrapping_abs()),
        Math::Abs => |a| (a as u32).into(),
        Math::Sign if is_signed => |a| signed(as_signed(a).signum()),
        Math::CountTrailingZeros => |a| (a as u32).trailing_zeros().into(),
        Math::CountLeadingZeros => |a| (a as u32).leading_zeros().into(),
        Math::CountOneBits => |a| (a as u32).count_ones().into(),
        Math::ReverseBits => |a| (a as u32).reverse_bits().into(),
        Math::FirstTrailingBit => |a| match a as u32 {
            0 => u32::MAX.into(),
            bits => bits.trailing_zeros().into(),
        },
        Math::FirstLeadingBit if is_signed => |a| {
            let x = as_signed(a);
            highest(if x < 0 { !x as u32 } else { x as u32 })
        },
        Math::FirstLeadingBit => |a| highest(a as u32),
        _ => return None,
    };
    Some(function)
}

/// The place of the highest bit that is set; all bits set if there is none.
fn highest(bits: u32) -> u64 {
    bits.checked_ilog2().unwrap_or(u32::MAX).into()
}

/// A function of two arguments, component by component.
pub(super) fn math2<F: Float>(function: Math, kind: Kind) -> Option<Fn2> {
    let function: Fn2 = match (function, kind) {
        (Math::Min, Kind::Float) => |a, b| if f::<F>(b) < f(a) { b } else { a },
        (Math::Max, Kind::Float) => |a, b| if f::<F>(a) < f(b) { b } else { a },
        (Math::Min, Kind::Uint) => |a, b| (a as u32).min(b as u32).into(),
        (Math::Max, Kind::Uint) => |a, b| (a as u32).max(b as u32).into(),
        (Math::Min, Kind::Sint) => |a, b| signed(as_signed(a).min(as_signed(b))),
        (Math::Max, Kind::Sint) => |a, b| signed(as_signed(a).max(as_signed(b))),
        (Math::Atan2, _) => |a, b| F::of(f::<F>(a).f64().atan2(f::<F>(b).f64())).cell(),
        (Math::Pow, _) => |a, b| F::of(f::<F>(a).f64().powf(f::<F>(b).f64())).cell(),
        (Math::Step, _) => |a, b| F::of(if f::<F>(b) < f(a) { 0.0 } else { 1.0 }).cell(),
        (Math::Ldexp, _) => |a, b| {
            let exponent = f64::from(as_signed(b));
            F::of(f::<F>(a).f64() * exponent.exp2()).cell()
        },
        _ => return None,
    };
    Some(function)
}

/// A function of three arguments, component by component.
pub(super) fn math3<F: Float>(function: Math, kind: Kind) -> Option<Fn3> {
    let function: Fn3 = match (function, kind) {
        (Math::Clamp, Kind::Float) => |x, low, high| {
            let raised = if f::<F>(x) < f(low) { low } else { x };
            if f::<F>(high) < f(raised) {
                high
            } else {
                raised
            }
        },
        (Math::Clamp, Kind::Uint) => {
            |x, low, high| (x as u32).max(low as u32).min(high as u32).into()
        }
        (Math::Clamp, Kind::Sint) => |x, low, high| {
            let [x, low, high] = [x, low, high].map(as_signed);
            signed(x.max(low).min(high))
        },
        (Math::Mix, _) => |a, b, t| {
            let (one, t) = (F::of(1.0), f::<F>(t));
            (f::<F>(a) * (one - t) + f::<F>(b) * t).cell()
        },
        (Math::Fma, _) => |a, b, c| f::<F>(a).fused(f(b), f(c)).cell(),
        (Math::SmoothStep, _) => |low, high, x| {
            let [low, high, x] = [low, high, x].map(f::<F>);
            let [zero, one] = [0.0, 1.0].map(F::of);
            let t = (x - low) / (high - low);
            let t = if t < zero { zero } else { t };
            let t = if one < t { one } else { t };
            (t * t * (F::of(3.0) - F::of(2.0) * t)).cell()
        },
        (Math::ExtractBits, Kind::Uint) => |x, offset, count| {
            let (offset, count) = window(offset, count);
            let mask = 1u64.wrapping_shl(count).wrapping_sub(1);
            (u64::from(x as u32) >> offset) & mask
        },
        (Math::ExtractBits, Kind::Sint) => |x, offset, count| match window(offset, count) {
            (_, 0) => 0,
            (offset, count) => {
                let up = as_signed(x).wrapping_shl(32 - offset - count);
                signed(up >> (32 - count))
            }
        },
        _ => return None,
    };
    Some(function)
}

/// Which bits a window has, cut to the word.
fn window(offset: u64, count: u64) -> (u32, u32) {
    let offset = (offset as u32).min(32);
    (offset, (count as u32).min(32 - offset))
}

/// Selects by a bool.
pub(super) fn select() -> Fn3 {
    |condition, accept, reject| if condition != 0 { accept } else { reject }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn f32s(function: Fn2, a: f32, b: f32) -> f32 {
        f32::of_cell(function(a.cell(), b.cell()))
    }

    fn bits(function: Option<Fn2>, a: u32, b: u32) -> u32 {
        function.expect("known")(a.into(), b.into()) as u32
    }

    #[test]
    fn floats_round_as_their_type_does() {
        let add = binary::<f32>(Bin::Add, Kind::Float).expect("known");
        assert_eq!(f32s(add, 1.0, 1e-9), 1.0);
        let add = binary::<f64>(Bin::Add, Kind::Float).expect("known");
        assert_eq!(f64::of_cell(add(1f64.cell(), 1e-9f64.cell())), 1.0 + 1e-9);
        let rem = binary::<f32>(Bin::Modulo, Kind::Float).expect("known");
        assert_eq!(f32s(rem, -5.5, 2.0), -1.5);
        let less = binary::<f32>(Bin::Less, Kind::Float).expect("known");
        assert_eq!(less((-1f32).cell(), 0f32.cell()), 1);
        assert_eq!(less(f32::NAN.cell(), 0f32.cell()), 0);
    }

    #[test]
    fn integers_wrap_and_divide_by_zero_as_specified() {
        let unsigned = |op| binary::<f32>(op, Kind::Uint);
        assert_eq!(bits(unsigned(Bin::Add), u32::MAX, 2), 1);
        assert_eq!(bits(unsigned(Bin::Subtract), 1, 2), u32::MAX);
        assert_eq!(bits(unsigned(Bin::Multiply), 1664525, 1 << 31), 1 << 31);
        assert_eq!(bits(unsigned(Bin::Divide), 7, 0), 7);
        assert_eq!(bits(unsigned(Bin::Modulo), 7, 0), 0);
        assert_eq!(bits(unsigned(Bin::ShiftLeft), 3, 31), 1 << 31);
        assert_eq!(bits(unsigned(Bin::ShiftRight), 1 << 31, 31), 1);
        let sint = |op| binary::<f32>(op, Kind::Sint);
        assert_eq!(bits(sint(Bin::ShiftRight), 1 << 31, 31), u32::MAX);
        assert_eq!(bits(sint(Bin::Divide), 1 << 31, u32::MAX), 1 << 31);
        assert_eq!(bits(sint(Bin::Modulo), (-7i32) as u32, 4), (-3i32) as u32);
        assert_eq!(bits(sint(Bin::Less), u32::MAX, 0), 1);
    }

    #[test]
    fn bits_of_floats_are_those_of_the_nearest_single() {
        let cast = bitcast::<f64>(Kind::Float, Kind::Uint).expect("known");
        assert_eq!(cast(0.1f64.cell()) as u32, 0.1f32.to_bits());
        assert_eq!(cast(1e60f64.cell()), u64::from(f32::INFINITY.to_bits()));
        let back = bitcast::<f64>(Kind::Uint, Kind::Float).expect("known");
        let x = back(u64::from(0.1f32.to_bits()));
        assert_eq!(f64::of_cell(x), f64::from(0.1f32));
        let to = convert::<f32>(Kind::Float, Kind::Uint).expect("known");
        assert_eq!(to((-3f32).cell()), 0);
        assert_eq!(to(5e9f32.cell()), u64::from(u32::MAX));
        assert_eq!(to(f32::NAN.cell()), 0);
    }

    #[test]
    fn functions_of_bits_agree_with_the_specification() {
        let one =
            |function, kind, x: u32| math1::<f32>(function, kind).expect("known")(x.into()) as u32;
        assert_eq!(one(Math::FirstLeadingBit, Kind::Uint, 0), u32::MAX);
        assert_eq!(one(Math::FirstLeadingBit, Kind::Uint, 40), 5);
        assert_eq!(one(Math::FirstLeadingBit, Kind::Sint, u32::MAX), u32::MAX);
        assert_eq!(one(Math::FirstLeadingBit, Kind::Sint, (-9i32) as u32), 3);
        assert_eq!(one(Math::FirstTrailingBit, Kind::Uint, 40), 3);
        assert_eq!(one(Math::FirstTrailingBit, Kind::Uint, 0), u32::MAX);
        assert_eq!(one(Math::ReverseBits, Kind::Uint, 1), 1 << 31);
        assert_eq!(one(Math::CountOneBits, Kind::Uint, 0xf0f0), 8);
        let extract = |kind, x: u32, offset, count| {
            math3::<f32>(Math::ExtractBits, kind).expect("known")(x.into(), offset, count) as u32
        };
        assert_eq!(extract(Kind::Uint, 0xabcd, 4, 8), 0xbc);
        assert_eq!(extract(Kind::Sint, 0xabcd, 4, 8), (0xbcu8 as i8) as u32);
        assert_eq!(extract(Kind::Uint, u32::MAX, 0, 32), u32::MAX);
        assert_eq!(extract(Kind::Uint, u32::MAX, 40, 9), 0);
    }

    #[test]
    fn functions_of_floats_agree_with_constants() {
        let one = |function, x: f32| {
            f32::of_cell(math1::<f32>(function, Kind::Float).expect("known")(
                x.cell(),
            ))
        };
        for (function, x, y) in [
            (Math::Sqrt, 2.0, std::f32::consts::SQRT_2),
            (Math::InverseSqrt, 4.0, 0.5),
            (Math::Fract, -0.25, 0.75),
            (Math::Round, 2.5, 2.0),
            (Math::Round, 3.5, 4.0),
            (Math::Sign, -3.0, -1.0),
            (Math::Sign, 0.0, 0.0),
            (Math::Saturate, 7.0, 1.0),
            (Math::Exp2, 3.0, 8.0),
            (Math::Log2, 8.0, 3.0),
            (Math::QuantizeToF16, 1.0 + 1.0 / 4096.0, 1.0),
        ] {
            assert_eq!(one(function, x), y, "{function:?} of {x}");
        }
        let two = |function, a, b| f32s(math2::<f32>(function, Kind::Float).expect("known"), a, b);
        assert_eq!(two(Math::Pow, 2.0, 0.5), std::f32::consts::SQRT_2);
        assert_eq!(two(Math::Step, 1.0, 1.0), 1.0);
        assert_eq!(two(Math::Step, 1.0, 0.9), 0.0);
        assert!(two(Math::Max, f32::NAN, 1.0).is_nan());
        assert_eq!(two(Math::Min, 2.0, 1.0), 1.0);
        let mix = math3::<f32>(Math::Mix, Kind::Float).expect("known");
        let mixed = mix(2f32.cell(), 4f32.cell(), 0.25f32.cell());
        assert_eq!(f32::of_cell(mixed), 2.5);
        assert!(math1::<f32>(Math::Modf, Kind::Float).is_none());
    }
}
