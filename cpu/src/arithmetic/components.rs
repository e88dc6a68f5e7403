//! What operations do with one component of their operands, as the interpreter defines it.

use naga::{BinaryOperator as Bin, MathFunction as Math, ScalarKind as Kind, UnaryOperator as Un};

use super::{Arithmetic, Called, Conversion, Float1, Float2, Order, Word1, Word2};
use crate::code::Op;

/// An operation on one component of each operand; `None` if it is not known.
pub(crate) fn component<M: Arithmetic>(m: &mut M, op: Op, x: &[M::Value]) -> Option<M::Value> {
    match (op, x) {
        (Op::Unary(op, kind), &[a]) => unary(m, op, kind, a),
        (Op::Binary(op, Kind::Float), &[a, b]) => of_floats(m, op, a, b),
        (Op::Binary(op, Kind::Bool), &[a, b]) => of_bools(m, op, a, b),
        (Op::Binary(op, kind), &[a, b]) => of_words(m, op, kind == Kind::Sint, a, b),
        (Op::Convert(from, to), &[a]) => convert(m, from, to, a),
        (Op::Bitcast(from, to), &[a]) => Some(match (from == Kind::Float, to == Kind::Float) {
            (true, false) => m.convert(Conversion::Bits, a),
            (false, true) => m.convert(Conversion::OfBits, a),
            _ => a,
        }),
        (Op::Select, &[condition, accept, reject]) => Some(m.select(condition, accept, reject)),
        (Op::Math(function, Kind::Float), &[x]) => of_one_float(m, function, x),
        (Op::Math(function, Kind::Float), &[a, b]) => of_two_floats(m, function, a, b),
        (Op::Math(function, Kind::Float), &[a, b, c]) => of_three_floats(m, function, a, b, c),
        (Op::Math(function, kind), x) => word_function(m, function, kind == Kind::Sint, x),
        _ => None,
    }
}

fn unary<M: Arithmetic>(m: &mut M, op: Un, kind: Kind, a: M::Value) -> Option<M::Value> {
    Some(match (op, kind) {
        (Un::Negate, Kind::Float) => m.float1(Float1::Negate, a),
        (Un::Negate, Kind::Sint) => {
            let zero = m.word(0);
            m.word2(Word2::Subtract, zero, a)
        }
        (Un::LogicalNot, Kind::Bool) => m.not_bool(a),
        (Un::BitwiseNot, Kind::Uint | Kind::Sint) => m.word1(Word1::Not, a),
        _ => return None,
    })
}

/// The order that an operator asks for.
fn order(op: Bin) -> Option<Order> {
    Some(match op {
        Bin::Equal => Order::Equal,
        Bin::NotEqual => Order::NotEqual,
        Bin::Less => Order::Less,
        Bin::LessEqual => Order::LessEqual,
        Bin::Greater => Order::Greater,
        Bin::GreaterEqual => Order::GreaterEqual,
        _ => return None,
    })
}

fn of_floats<M: Arithmetic>(m: &mut M, op: Bin, a: M::Value, b: M::Value) -> Option<M::Value> {
    if let Some(order) = order(op) {
        return Some(m.compare_floats(order, a, b));
    }
    let op = match op {
        Bin::Modulo => return Some(m.call(Called::Remainder, &[a, b])),
        Bin::Add => Float2::Add,
        Bin::Subtract => Float2::Subtract,
        Bin::Multiply => Float2::Multiply,
        Bin::Divide => Float2::Divide,
        _ => return None,
    };
    Some(m.float2(op, a, b))
}

fn of_bools<M: Arithmetic>(m: &mut M, op: Bin, a: M::Value, b: M::Value) -> Option<M::Value> {
    Some(match op {
        Bin::LogicalAnd | Bin::And => m.and_bools(a, b),
        Bin::LogicalOr | Bin::InclusiveOr => m.or_bools(a, b),
        Bin::NotEqual | Bin::ExclusiveOr => m.xor_bools(a, b),
        Bin::Equal => {
            let different = m.xor_bools(a, b);
            m.not_bool(different)
        }
        _ => return None,
    })
}

fn of_words<M: Arithmetic>(
    m: &mut M,
    op: Bin,
    signed: bool,
    a: M::Value,
    b: M::Value,
) -> Option<M::Value> {
    if let Some(order) = order(op) {
        return Some(m.compare_words(order, signed, a, b));
    }
    let op = match (op, signed) {
        (Bin::Divide | Bin::Modulo, _) => return Some(divided(m, op, signed, a, b)),
        (Bin::Add, _) => Word2::Add,
        (Bin::Subtract, _) => Word2::Subtract,
        (Bin::Multiply, _) => Word2::Multiply,
        (Bin::And, _) => Word2::And,
        (Bin::InclusiveOr, _) => Word2::Or,
        (Bin::ExclusiveOr, _) => Word2::Xor,
        (Bin::ShiftLeft, _) => Word2::ShiftLeft,
        (Bin::ShiftRight, false) => Word2::ShiftRight,
        (Bin::ShiftRight, true) => Word2::ShiftRightSigned,
        _ => return None,
    };
    Some(m.word2(op, a, b))
}

/// A quotient or rest. Of what WGSL lets nothing be divided by, the quotient is the dividend and the rest
/// zero, as of a division by one.
fn divided<M: Arithmetic>(m: &mut M, op: Bin, signed: bool, a: M::Value, b: M::Value) -> M::Value {
    let (zero, one) = (m.word(0), m.word(1));
    let is_zero = m.compare_words(Order::Equal, false, b, zero);
    let mut divisor = m.select(is_zero, one, b);
    if signed {
        let (least, minus) = (m.word(0x8000_0000), m.word(u32::MAX));
        let is_least = m.compare_words(Order::Equal, false, a, least);
        let is_minus = m.compare_words(Order::Equal, false, b, minus);
        let beyond = m.and_bools(is_least, is_minus);
        divisor = m.select(beyond, one, divisor);
    }
    let op = match (op, signed) {
        (Bin::Divide, false) => Word2::Divide,
        (Bin::Divide, true) => Word2::DivideSigned,
        (_, false) => Word2::Remainder,
        (_, true) => Word2::RemainderSigned,
    };
    m.word2(op, a, divisor)
}

fn convert<M: Arithmetic>(m: &mut M, from: Kind, to: Kind, a: M::Value) -> Option<M::Value> {
    let conversion = match (from, to) {
        (Kind::Float, Kind::Uint) => Conversion::ToUnsigned,
        (Kind::Float, Kind::Sint) => Conversion::ToSigned,
        (Kind::Float, Kind::Bool) => {
            let zero = m.float(0.0);
            return Some(m.compare_floats(Order::NotEqual, a, zero));
        }
        (Kind::Uint, Kind::Float) => Conversion::OfUnsigned,
        (Kind::Sint, Kind::Float) => Conversion::OfSigned,
        (Kind::Bool, Kind::Float) => {
            let (zero, one) = (m.float(0.0), m.float(1.0));
            return Some(m.select(a, one, zero));
        }
        (Kind::Uint | Kind::Sint, Kind::Bool) => Conversion::BoolOfWord,
        (Kind::Bool, Kind::Uint | Kind::Sint) => Conversion::WordOfBool,
        (Kind::Float, Kind::Float)
        | (Kind::Bool, Kind::Bool)
        | (Kind::Uint | Kind::Sint, Kind::Uint | Kind::Sint) => return Some(a),
        _ => return None,
    };
    Some(m.convert(conversion, a))
}

fn of_one_float<M: Arithmetic>(m: &mut M, function: Math, x: M::Value) -> Option<M::Value> {
    let op = match function {
        Math::Abs => Float1::Abs,
        Math::Ceil => Float1::Ceil,
        Math::Floor => Float1::Floor,
        Math::Round => Float1::Nearest,
        Math::Trunc => Float1::Trunc,
        Math::Sqrt => Float1::Sqrt,
        Math::Fract => {
            let floor = m.float1(Float1::Floor, x);
            return Some(m.float2(Float2::Subtract, x, floor));
        }
        Math::InverseSqrt => {
            let (one, root) = (m.float(1.0), m.float1(Float1::Sqrt, x));
            return Some(m.float2(Float2::Divide, one, root));
        }
        Math::Saturate => {
            let (zero, one) = (m.float(0.0), m.float(1.0));
            let raised = m.float2(Float2::Greatest, x, zero);
            return Some(m.float2(Float2::Least, raised, one));
        }
        Math::Sign => {
            let [zero, one, minus] = [0.0, 1.0, -1.0].map(|x| m.float(x));
            let above = m.compare_floats(Order::Greater, x, zero);
            let below = m.compare_floats(Order::Less, x, zero);
            let rest = m.select(below, minus, zero);
            return Some(m.select(above, one, rest));
        }
        Math::Radians | Math::Degrees => {
            let factor = match function {
                Math::Radians => m.float(1f32.to_radians()),
                _ => m.float(1f32.to_degrees()),
            };
            return Some(m.float2(Float2::Multiply, x, factor));
        }
        Math::Cos
        | Math::Cosh
        | Math::Sin
        | Math::Sinh
        | Math::Tan
        | Math::Tanh
        | Math::Acos
        | Math::Asin
        | Math::Atan
        | Math::Asinh
        | Math::Acosh
        | Math::Atanh
        | Math::Exp
        | Math::Exp2
        | Math::Log
        | Math::Log2
        | Math::QuantizeToF16 => return Some(m.call(Called::One(function), &[x])),
        _ => return None,
    };
    Some(m.float1(op, x))
}

fn of_two_floats<M: Arithmetic>(
    m: &mut M,
    function: Math,
    a: M::Value,
    b: M::Value,
) -> Option<M::Value> {
    Some(match function {
        Math::Min => m.float2(Float2::Least, a, b),
        Math::Max => m.float2(Float2::Greatest, a, b),
        Math::Step => {
            let (zero, one) = (m.float(0.0), m.float(1.0));
            let below = m.compare_floats(Order::Less, b, a);
            m.select(below, zero, one)
        }
        Math::Atan2 | Math::Pow => m.call(Called::Two(function), &[a, b]),
        _ => return None,
    })
}

fn of_three_floats<M: Arithmetic>(
    m: &mut M,
    function: Math,
    a: M::Value,
    b: M::Value,
    c: M::Value,
) -> Option<M::Value> {
    Some(match function {
        Math::Clamp => {
            let raised = m.float2(Float2::Greatest, a, b);
            m.float2(Float2::Least, raised, c)
        }
        Math::Fma => m.fused(a, b, c),
        Math::Mix => {
            let one = m.float(1.0);
            let rest = m.float2(Float2::Subtract, one, c);
            let a = m.float2(Float2::Multiply, a, rest);
            let b = m.float2(Float2::Multiply, b, c);
            m.float2(Float2::Add, a, b)
        }
        Math::SmoothStep => {
            let [zero, one, two, three] = [0.0, 1.0, 2.0, 3.0].map(|x| m.float(x));
            let up = m.float2(Float2::Subtract, c, a);
            let range = m.float2(Float2::Subtract, b, a);
            let t = m.float2(Float2::Divide, up, range);
            let t = m.float2(Float2::Greatest, t, zero);
            let t = m.float2(Float2::Least, t, one);
            let twice = m.float2(Float2::Multiply, two, t);
            let rest = m.float2(Float2::Subtract, three, twice);
            let square = m.float2(Float2::Multiply, t, t);
            m.float2(Float2::Multiply, square, rest)
        }
        _ => return None,
    })
}

fn word_function<M: Arithmetic>(
    m: &mut M,
    function: Math,
    signed: bool,
    x: &[M::Value],
) -> Option<M::Value> {
    Some(match (function, x) {
        (Math::Abs, &[x]) if signed => {
            let zero = m.word(0);
            let other = m.word2(Word2::Subtract, zero, x);
            m.word2(Word2::GreatestSigned, x, other)
        }
        (Math::Abs, &[x]) => x,
        (Math::Sign, &[x]) if signed => {
            let [zero, one, minus] = [0, 1, u32::MAX].map(|x| m.word(x));
            let above = m.compare_words(Order::Greater, true, x, zero);
            let below = m.compare_words(Order::Less, true, x, zero);
            let rest = m.select(below, minus, zero);
            m.select(above, one, rest)
        }
        (Math::CountTrailingZeros, &[x]) => m.word1(Word1::TrailingZeros, x),
        (Math::CountLeadingZeros, &[x]) => m.word1(Word1::LeadingZeros, x),
        (Math::CountOneBits, &[x]) => m.word1(Word1::Ones, x),
        (Math::ReverseBits, &[x]) => m.word1(Word1::Reverse, x),
        (Math::FirstTrailingBit, &[x]) => {
            let (zeros, zero, none) = (m.word1(Word1::TrailingZeros, x), m.word(0), m.word(!0));
            let empty = m.compare_words(Order::Equal, false, x, zero);
            m.select(empty, none, zeros)
        }
        (Math::FirstLeadingBit, &[x]) => {
            let highest = m.word(31);
            let x = if signed {
                let sign = m.word2(Word2::ShiftRightSigned, x, highest);
                m.word2(Word2::Xor, x, sign)
            } else {
                x
            };
            // All bits set where there is none: 31 - 32.
            let zeros = m.word1(Word1::LeadingZeros, x);
            m.word2(Word2::Subtract, highest, zeros)
        }
        (Math::Min, &[a, b]) => m.word2(least(signed), a, b),
        (Math::Max, &[a, b]) => m.word2(greatest(signed), a, b),
        (Math::Clamp, &[x, low, high]) => {
            let raised = m.word2(greatest(signed), x, low);
            m.word2(least(signed), raised, high)
        }
        (Math::ExtractBits, &[x, offset, count]) => extract(m, signed, x, offset, count),
        _ => return None,
    })
}

fn least(signed: bool) -> Word2 {
    if signed {
        Word2::LeastSigned
    } else {
        Word2::Least
    }
}

fn greatest(signed: bool) -> Word2 {
    if signed {
        Word2::GreatestSigned
    } else {
        Word2::Greatest
    }
}

/// Some bits of a word, cut to the word.
fn extract<M: Arithmetic>(
    m: &mut M,
    signed: bool,
    x: M::Value,
    offset: M::Value,
    count: M::Value,
) -> M::Value {
    let (zero, all) = (m.word(0), m.word(32));
    let offset = m.word2(Word2::Least, offset, all);
    let rest = m.word2(Word2::Subtract, all, offset);
    let count = m.word2(Word2::Least, count, rest);
    let used = m.word2(Word2::Add, offset, count);
    let left = m.word2(Word2::Subtract, all, used);
    let right = m.word2(Word2::Subtract, all, count);
    let up = m.word2(Word2::ShiftLeft, x, left);
    let shift = if signed {
        Word2::ShiftRightSigned
    } else {
        Word2::ShiftRight
    };
    let down = m.word2(shift, up, right);
    // A shift by 32 is one by 0.
    let none = m.compare_words(Order::Equal, false, count, zero);
    m.select(none, zero, down)
}
