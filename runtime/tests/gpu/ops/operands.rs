//! Operands from the edges of what ops are defined for.
//!
//! What overflows gives infinity by IEEE's rules and anything by WGSL's, so the operands of
//! arithmetic stay where its results are finite; ops that define their result everywhere get all.

use impasto_compiler::ir::Type;
use impasto_compiler::ir::ops::{Op, Shape};
use impasto_compiler::ir::value::Value;

/// Floats of the whole range, a denormal one among them.
const ALL: [f32; 30] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    1.5,
    2.5,
    -2.5,
    0.3,
    2.999_999_8,
    -7.0,
    0.04045,
    1e-3,
    -1e-20,
    1e-40,
    -1e-40,
    f32::MIN_POSITIVE,
    1.0 - f32::EPSILON / 2.0,
    -f32::EPSILON,
    8_388_607.5,
    -16_777_216.0,
    2_147_483_648.0,
    -2_147_483_648.0,
    1e10,
    -1e20,
    f32::MAX,
    f32::MIN,
    88.0,
    127.5,
];

/// Floats whose sums, products and quotients are finite.
const MODERATE: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -1.5,
    0.3,
    2.999_999_8,
    -7.0,
    1000.0,
    1e-3,
    -1e-18,
    1.0 + f32::EPSILON,
    8_388_607.5,
    1e18,
    -1e18,
];

/// Floats that stand for parts of a color, which is all that is decoded.
const COLORS: [f32; 8] = [0.0, 1e-40, 1e-3, 0.04044, 0.04045, 0.04046, 0.5, 1.0];

const INTS: [i32; 15] = [
    0,
    1,
    -1,
    2,
    -2,
    7,
    -8,
    31,
    32,
    33,
    1_000_003,
    0x5555_5555,
    i32::MAX,
    i32::MIN + 1,
    i32::MIN,
];

/// Vectors: none, along an axis, unit, parallel, opposite, tiny, huge.
const VECTORS: [[f32; 4]; 14] = [
    [0.0; 4],
    [-0.0; 4],
    [1.0, 0.0, 0.0, 0.0],
    [0.0, -1.0, 0.0, 0.0],
    [0.6, 0.0, -0.8, 0.0],
    [1.0, -2.0, 3.0, -4.0],
    [2.0, -4.0, 6.0, -8.0],
    [-1.0, 2.0, -3.0, 4.0],
    [-0.25, 7.0, 100.0, 0.3],
    [1e-3, 2e-3, -1e-3, 0.0],
    [3e-19, 0.0, 0.0, 0.0],
    [1e-20, -1e-20, 0.0, 1e-20],
    [1e9, -3e8, 1e9, 1e9],
    [1.0, 1.0, 1.0, 1.0],
];

/// The floats that an op is asked for.
fn floats(op: Op) -> &'static [f32] {
    match op {
        Op::SrgbDecode => &COLORS,
        op if defined_everywhere(op) => &ALL,
        _ => &MODERATE,
    }
}

/// Is the op's result finite for all finite operands?
fn defined_everywhere(op: Op) -> bool {
    use Op::*;
    let one = matches!(op.info().shape, Shape::Float(1) | Shape::Number(1));
    let selecting = matches!(
        op,
        Min | Max | Clamp | Step | Select | Pow | Atan2 | ToInt | ToUnsigned
    );
    let testing = matches!(op.info().shape, Shape::Compare | Shape::Equal);
    one || selecting || testing
}

/// How many values there are for an operand of a type.
fn choices(floats: &[f32], geometric: bool, ty: Type) -> usize {
    match ty {
        Type::Bool => 2,
        Type::Int => INTS.len(),
        _ if geometric => VECTORS.len(),
        _ => floats.len(),
    }
}

/// Value `i` for an operand of a type. The components of a vector go through the same numbers out
/// of step.
fn value(floats: &[f32], geometric: bool, ty: Type, i: usize) -> Value<f32> {
    let float = |c: usize| floats[(i + 5 * c) % floats.len()];
    let vector = |i: usize| VECTORS[i % VECTORS.len()];
    match (ty, ty.width()) {
        (Type::Bool, _) => Value::Bool(i == 1),
        (Type::Int, _) => Value::Int(INTS[i]),
        (Type::Mat3, _) => Value::Mat3([0, 3, 8].map(|c| {
            let [x, y, z, _] = vector(i + c);
            [x, y, z]
        })),
        (_, Some(width)) if geometric => Value::floats(&vector(i)[..width]),
        (_, width) => {
            let components: Vec<f32> = (0..width.unwrap_or(1)).map(float).collect();
            Value::floats(&components)
        }
    }
}

/// Most questions that a case with vectors asks: those without ask all.
const MAX_WITH_VECTORS: usize = 600;

/// Operands for an op on operands of some types: all combinations, or an even choice of them.
pub fn tuples(op: Op, types: &[Type]) -> Vec<Vec<Value<f32>>> {
    use Shape::{Cross, MatVec, Reduce, Vector};
    let shape = op.info().shape;
    let geometric = matches!(shape, Reduce(_) | Vector(_) | Cross | MatVec);
    let floats = floats(op);
    let counts: Vec<usize> = types
        .iter()
        .map(|ty| choices(floats, geometric, *ty))
        .collect();
    let all: usize = counts.iter().product();
    let scalar = types.iter().all(|ty| ty.width().is_none_or(|w| w == 1));
    let step = if scalar {
        1
    } else {
        // Odd, so that it meets all values of every operand.
        (all / MAX_WITH_VECTORS) | 1
    };
    let tuple = |mut number: usize| {
        let operand = |(ty, count): (&Type, &usize)| {
            let i = number % count;
            number /= count;
            value(floats, geometric, *ty, i)
        };
        types.iter().zip(&counts).map(operand).collect()
    };
    (0..all).step_by(step).map(tuple).collect()
}

/// The value with zeros in place of floats below the least normal one.
pub fn flushed(value: &Value<f32>) -> Value<f32> {
    match value {
        Value::Floats(v) => {
            let flush = |x: &f32| if x.is_subnormal() { 0.0 } else { *x };
            let components: Vec<f32> = v.as_slice().iter().map(flush).collect();
            Value::floats(&components)
        }
        other => other.clone(),
    }
}
