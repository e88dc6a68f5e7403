//! How far an op on the GPU may be from the interpreter, after the accuracy table of the WGSL
//! specification: exact where that asks for correct rounding, so many units in the last place
//! for quotients and roots, absolute bounds for trigonometry. Results are finite everywhere.

use impasto_compiler::ir::Type;
use impasto_compiler::ir::ops::{Op, Shape};
use impasto_compiler::ir::value::Value;

use crate::support::{Row, floats};

/// A unit in the last place of 1.
const EPSILON: f64 = f32::EPSILON as f64;

/// Numbers below the least normal one may count as zero.
const FLUSHED: f64 = 1.18e-38;

/// What the kernel wrote for a question.
type Result = [Row; 3];

/// Are `rows` what the op gives for `args`, as exactly as can be asked, where the interpreter says
/// `expected`?
pub fn agrees(op: Op, args: &[Value<f32>], rows: Result, expected: &Value<f32>) -> bool {
    let [row, ..] = rows;
    match expected {
        Value::Mat3(columns) => {
            let same = |(found, column): (Row, &[f32; 3])| floats(found)[..3] == column[..];
            rows.into_iter().zip(columns).all(same)
        }
        Value::Bool(b) => row[0] == u32::from(*b),
        Value::Int(i) => row[0] == *i as u32,
        value => {
            let components = value.components();
            let mut pairs = components.iter().zip(floats(row)).enumerate();
            !components.is_empty()
                && pairs.all(|(c, (x, found))| {
                    let (x, found) = (f64::from(*x), f64::from(found));
                    found.is_finite() && x.is_finite() && component_agrees(op, args, c, found, x)
                })
        }
    }
}

/// A result for people.
pub fn shown(rows: Result, ty: Type) -> String {
    let [row, ..] = rows;
    match ty {
        Type::Bool => format!("{}", row[0] != 0),
        Type::Int => format!("{}", row[0] as i32),
        Type::Mat3 => format!("{:?}", rows.map(floats)),
        ty => format!("{:?}", &floats(row)[..ty.width().unwrap_or(1)]),
    }
}

fn component_agrees(op: Op, args: &[Value<f32>], c: usize, found: f64, expected: f64) -> bool {
    let off = (found - expected).abs();
    if matches!(op.info().shape, Shape::Float(_) | Shape::Number(_)) {
        let operand = |k: usize| {
            let v = args.get(k).map_or(&[][..], Value::components);
            f64::from(v.get(c).or(v.first()).copied().unwrap_or(0.0))
        };
        let at = [operand(0), operand(1), operand(2)];
        return !specified(op, at) || off <= by_component(op, at, off, expected) + FLUSHED;
    }
    off <= of_whole(op, largest(args.first()), largest(args.get(1))) + FLUSHED
}

/// The largest component of an operand.
fn largest(value: Option<&Value<f32>>) -> f64 {
    let all: Vec<f32> = match value {
        Some(Value::Mat3(columns)) => columns.concat(),
        Some(value) => value.components().to_vec(),
        None => Vec::new(),
    };
    all.iter().fold(0.0, |m, x| m.max(f64::from(x.abs())))
}

/// Does the specification bound the error at these operands? Elsewhere a result need only be
/// finite.
fn specified(op: Op, [a, b, _]: [f64; 3]) -> bool {
    match op {
        Op::Sin | Op::Cos => a.abs() <= std::f64::consts::PI,
        Op::Tan => a.abs() <= 1.5,
        // What is left of a huge quotient has no correct digit.
        Op::Rem | Op::Mod => b == 0.0 || (a / b).abs() < 1e6,
        // The quotient that it is defined by must not leave the range.
        Op::Atan2 => {
            let ratio = (a / b).abs();
            let normal = |x: f64| x.abs() >= FLUSHED && x.abs() < 8.5e37;
            (a == 0.0 && b == 0.0) || (normal(a) && normal(b) && (1e-30..1e30).contains(&ratio))
        }
        _ => true,
    }
}

/// How far a component may be off that is `off` off, at operands `a`, `b`, `c`, where the op
/// gives `x`.
fn by_component(op: Op, [a, b, c]: [f64; 3], off: f64, x: f64) -> f64 {
    let ulps = |n: f64| n * EPSILON * x.abs();
    match op {
        Op::Div => ulps(2.5),
        Op::Sqrt | Op::InverseSqrt => ulps(4.0),
        Op::Exp | Op::Exp2 => ulps(3.0 + 2.0 * a.abs().min(127.0)),
        Op::Log | Op::Log2 => logarithm(a),
        Op::Pow if a > 0.0 => power(a, b, x),
        Op::Sin | Op::Cos => 2f64.powi(-11),
        Op::Tan => 2f64.powi(-10) * (1.0 + x * x),
        // The worse of an absolute bound and what they are as `atan2`.
        Op::Asin | Op::Acos => ulps(4096.0).max(6.81e-5),
        Op::Atan | Op::Atan2 => ulps(4096.0),
        Op::SrgbDecode => 2f64.powi(-19) * (1.0 + x.abs()),
        Op::Mix => 4.0 * EPSILON * ((a * (1.0 - c)).abs() + (b * c).abs() + (a * c).abs()),
        Op::Smoothstep => 1e-5,
        Op::Rem | Op::Mod => {
            // A quotient that is a whole number but for rounding may be cut to either side.
            let quotient = a / b;
            let whole = (quotient - quotient.round()).abs() <= 3.0 * EPSILON * quotient.abs();
            let rounding = 4.0 * EPSILON * a.abs().max(b.abs());
            let near = b != 0.0 && whole && (off - b.abs()).abs() <= rounding;
            if near { off } else { rounding }
        }
        _ => 0.0,
    }
}

/// The error of a logarithm: absolute about 1, else relative.
fn logarithm(x: f64) -> f64 {
    if (0.5..=2.0).contains(&x) {
        2f64.powi(-21)
    } else {
        4.0 * EPSILON * x.max(FLUSHED).log2().abs()
    }
}

/// The error of `exp2(b * log2(a))`, which is `x`.
fn power(a: f64, b: f64, x: f64) -> f64 {
    let exponent = (b * a.max(FLUSHED).log2()).abs().min(150.0);
    let off = (b.abs() * logarithm(a) + EPSILON * exponent).min(200.0);
    x.abs() * (off.exp2() - 1.0) + (4.0 + 2.0 * exponent) * EPSILON * x.abs()
}

/// How far an op on whole operands, of at most `v` and `w` in a component, may be off.
fn of_whole(op: Op, v: f64, w: f64) -> f64 {
    // The square root of what is flushed.
    let root = 1.1e-19;
    let rounding = |size: f64| 3.0 * EPSILON * size;
    match op {
        Op::Dot => rounding(4.0 * v * w),
        Op::Length => rounding(4.0 * v) + root,
        Op::Distance => rounding(4.0 * (v + w)) + root,
        Op::Luminance => rounding(v),
        Op::Normalize => rounding(2.0),
        Op::Reflect => rounding(v + 8.0 * v * w * w),
        Op::Cross => rounding(2.0 * v * w),
        Op::MatVec => rounding(3.0 * v * w),
        _ => 0.0,
    }
}
