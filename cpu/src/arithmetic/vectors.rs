//! What operations do with all components of their operands, as the interpreter defines it.

use naga::{MathFunction as Math, ScalarKind as Kind};

use super::{Arithmetic, Called, Conversion, Float1, Float2, Order, Word2};
use crate::code::{Op, product_sizes};

/// An operation on all components. `of` gives so many components of an operand, by its place. `None` if it
/// is not known.
pub(crate) fn vectors<M: Arithmetic>(
    m: &mut M,
    op: Op,
    width: u32,
    of: impl Fn(&mut M, usize, u32) -> Vec<M::Value>,
) -> Option<Vec<M::Value>> {
    if op == Op::Product {
        let [rows, inner, columns] = product_sizes(width);
        let (a, b) = (of(m, 0, rows * inner), of(m, 1, inner * columns));
        return Some(product(m, &a, &b, rows as usize, inner as usize));
    }
    let x = of(m, 0, width);
    Some(match op {
        Op::All => vec![fold(m, &x, M::and_bools)],
        Op::Any => vec![fold(m, &x, M::or_bools)],
        Op::Vector(function, kind) => {
            return of_numbers(m, function, kind, &x, |m, at, width| of(m, at, width));
        }
        _ => return None,
    })
}

fn of_numbers<M: Arithmetic>(
    m: &mut M,
    function: Math,
    kind: Kind,
    x: &[M::Value],
    of: impl Fn(&mut M, usize, u32) -> Vec<M::Value>,
) -> Option<Vec<M::Value>> {
    let width = x.len() as u32;
    Some(match function {
        Math::Dot => {
            let y = of(m, 1, width);
            vec![match kind {
                Kind::Float => dot(m, x, &y),
                _ => dot_of_words(m, x, &y),
            }]
        }
        Math::Length => vec![length(m, x)],
        Math::Distance => {
            let y = of(m, 1, width);
            let difference = zip(m, x, &y, Float2::Subtract);
            vec![length(m, &difference)]
        }
        Math::Cross => {
            let y = of(m, 1, width);
            cross(m, x, &y)
        }
        Math::Normalize => {
            let length = length(m, x);
            let each = |x: &M::Value| m.float2(Float2::Divide, *x, length);
            x.iter().map(each).collect()
        }
        Math::Reflect => {
            let normal = of(m, 1, width);
            let (two, cosine) = (m.float(2.0), dot(m, &normal, x));
            let twice = m.float2(Float2::Multiply, two, cosine);
            let along = scaled(m, &normal, twice);
            zip(m, x, &along, Float2::Subtract)
        }
        Math::Refract => {
            let (normal, eta) = (of(m, 1, width), of(m, 2, 1));
            refract(m, x, &normal, *eta.first()?)
        }
        Math::FaceForward => {
            let (v, reference) = (of(m, 1, width), of(m, 2, width));
            let (cosine, zero) = (dot(m, &v, &reference), m.float(0.0));
            let behind = m.compare_floats(Order::Less, cosine, zero);
            let each = |x: &M::Value| {
                let other = m.float1(Float1::Negate, *x);
                m.select(behind, *x, other)
            };
            x.iter().map(each).collect()
        }
        _ => return packed(m, function, x),
    })
}

fn packed<M: Arithmetic>(m: &mut M, function: Math, x: &[M::Value]) -> Option<Vec<M::Value>> {
    let first = *x.first()?;
    Some(match function {
        Math::Unpack2x16float => halves(m, first).map(|half| of_half(m, half)).to_vec(),
        Math::Pack2x16float => {
            let low = m.call(Called::HalfBits, &[first]);
            let high = m.call(Called::HalfBits, &[*x.get(1)?]);
            let high = shifted(m, Word2::ShiftLeft, high, 16);
            vec![m.word2(Word2::Or, low, high)]
        }
        Math::Unpack2x16unorm => halves(m, first)
            .map(|word| share(m, word, 65535.0))
            .to_vec(),
        Math::Unpack2x16snorm => {
            let up = shifted(m, Word2::ShiftLeft, first, 16);
            let each = |word| {
                let short = shifted(m, Word2::ShiftRightSigned, word, 16);
                let share = share(m, short, 32767.0);
                let least = m.float(-1.0);
                m.float2(Float2::Greatest, share, least)
            };
            [up, first].map(each).to_vec()
        }
        Math::Unpack4xU8 => bytes(m, first).to_vec(),
        Math::Unpack4xI8 => {
            let each = |shift| {
                let up = shifted(m, Word2::ShiftLeft, first, shift);
                shifted(m, Word2::ShiftRightSigned, up, 24)
            };
            [24, 16, 8, 0].map(each).to_vec()
        }
        Math::Unpack4x8unorm => bytes(m, first).map(|byte| share(m, byte, 255.0)).to_vec(),
        _ => return None,
    })
}

fn fold<M: Arithmetic>(
    m: &mut M,
    x: &[M::Value],
    f: impl Fn(&mut M, M::Value, M::Value) -> M::Value,
) -> M::Value {
    let (first, rest) = (x[0], &x[1..]);
    rest.iter().fold(first, |sum, x| f(m, sum, *x))
}

fn zip<M: Arithmetic>(m: &mut M, x: &[M::Value], y: &[M::Value], op: Float2) -> Vec<M::Value> {
    x.iter().zip(y).map(|(x, y)| m.float2(op, *x, *y)).collect()
}

fn dot<M: Arithmetic>(m: &mut M, x: &[M::Value], y: &[M::Value]) -> M::Value {
    let products = zip(m, x, y, Float2::Multiply);
    fold(m, &products, |m, p, q| m.float2(Float2::Add, p, q))
}

fn dot_of_words<M: Arithmetic>(m: &mut M, x: &[M::Value], y: &[M::Value]) -> M::Value {
    let product = |(x, y): (&M::Value, &M::Value)| m.word2(Word2::Multiply, *x, *y);
    let products: Vec<M::Value> = x.iter().zip(y).map(product).collect();
    fold(m, &products, |m, p, q| m.word2(Word2::Add, p, q))
}

fn length<M: Arithmetic>(m: &mut M, x: &[M::Value]) -> M::Value {
    let square = dot(m, x, x);
    m.float1(Float1::Sqrt, square)
}

fn scaled<M: Arithmetic>(m: &mut M, x: &[M::Value], scale: M::Value) -> Vec<M::Value> {
    let each = |x: &M::Value| m.float2(Float2::Multiply, *x, scale);
    x.iter().map(each).collect()
}

fn cross<M: Arithmetic>(m: &mut M, x: &[M::Value], y: &[M::Value]) -> Vec<M::Value> {
    let component = |i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let one = m.float2(Float2::Multiply, x[j], y[k]);
        let other = m.float2(Float2::Multiply, x[k], y[j]);
        m.float2(Float2::Subtract, one, other)
    };
    (0..3).map(component).collect()
}

fn refract<M: Arithmetic>(
    m: &mut M,
    v: &[M::Value],
    normal: &[M::Value],
    eta: M::Value,
) -> Vec<M::Value> {
    let (zero, one) = (m.float(0.0), m.float(1.0));
    let cosine = dot(m, normal, v);
    let square = m.float2(Float2::Multiply, cosine, cosine);
    let sine = m.float2(Float2::Subtract, one, square);
    let ratio = m.float2(Float2::Multiply, eta, eta);
    let rest = m.float2(Float2::Multiply, ratio, sine);
    let k = m.float2(Float2::Subtract, one, rest);
    let beyond = m.compare_floats(Order::Less, k, zero);
    let root = m.float1(Float1::Sqrt, k);
    let along = m.float2(Float2::Multiply, eta, cosine);
    let along = m.float2(Float2::Add, along, root);
    let (v, normal) = (scaled(m, v, eta), scaled(m, normal, along));
    let refracted = zip(m, &v, &normal, Float2::Subtract);
    refracted
        .into_iter()
        .map(|x| m.select(beyond, zero, x))
        .collect()
}

/// A matrix product, column by column.
fn product<M: Arithmetic>(
    m: &mut M,
    a: &[M::Value],
    b: &[M::Value],
    rows: usize,
    inner: usize,
) -> Vec<M::Value> {
    let mut cells = Vec::new();
    for column in b.chunks(inner) {
        for row in 0..rows {
            let row: Vec<M::Value> = a[row..].iter().step_by(rows).copied().collect();
            cells.push(dot(m, &row, column));
        }
    }
    cells
}

fn shifted<M: Arithmetic>(m: &mut M, shift: Word2, word: M::Value, bits: u32) -> M::Value {
    let bits = m.word(bits);
    m.word2(shift, word, bits)
}

/// The lower and the upper half of a word.
fn halves<M: Arithmetic>(m: &mut M, word: M::Value) -> [M::Value; 2] {
    let mask = m.word(0xffff);
    let low = m.word2(Word2::And, word, mask);
    [low, shifted(m, Word2::ShiftRight, word, 16)]
}

fn bytes<M: Arithmetic>(m: &mut M, word: M::Value) -> [M::Value; 4] {
    let mask = m.word(0xff);
    [0, 8, 16, 24].map(|bits| {
        let down = shifted(m, Word2::ShiftRight, word, bits);
        m.word2(Word2::And, down, mask)
    })
}

/// A word of at most 16 bits as a share of the largest.
fn share<M: Arithmetic>(m: &mut M, word: M::Value, largest: f32) -> M::Value {
    let x = m.convert(Conversion::OfSigned, word);
    let largest = m.float(largest);
    m.float2(Float2::Divide, x, largest)
}

/// A float of 16 bits. Its exponent is moved by a multiplication, which also makes numbers of those below
/// the smallest exponent.
fn of_half<M: Arithmetic>(m: &mut M, half: M::Value) -> M::Value {
    let magnitude = m.word(0x7fff);
    let magnitude = m.word2(Word2::And, half, magnitude);
    let bits = shifted(m, Word2::ShiftLeft, magnitude, 13);
    let small = m.convert(Conversion::OfBits, bits);
    let scale = m.float(f32::from_bits((127 + 112) << 23));
    let scaled = m.float2(Float2::Multiply, small, scale);
    let scaled = m.convert(Conversion::Bits, scaled);
    let limit = m.word(0x7c00);
    let unbounded = m.compare_words(Order::GreaterEqual, true, magnitude, limit);
    let exponent = m.word(0x7f80_0000);
    let beyond = m.word2(Word2::Or, bits, exponent);
    let bits = m.select(unbounded, beyond, scaled);
    let sign = m.word(0x8000);
    let sign = m.word2(Word2::And, half, sign);
    let sign = shifted(m, Word2::ShiftLeft, sign, 16);
    let bits = m.word2(Word2::Or, bits, sign);
    m.convert(Conversion::OfBits, bits)
}
