//! The op table: every operation of the language, declared once.
//!
//! A row gives an op's text, what operands it takes, what class of hardware cost it has, how it
//! is written in WGSL, how it is interpreted, and how its result changes with its operands.
//! Checking, printing, verifying, folding, interpretation, code generation, cost and
//! differentiation all read this table; a row that lacks a column does not compile.

mod derivative;
mod meaning;

use std::sync::OnceLock;

use crate::abi::TextureSpace;
use crate::ir::Type;
use crate::ir::value::{Real, Value};
use meaning::*;

pub use derivative::{Rule, STEEPEST, Tangent};
pub use meaning::{Kernel, Operands};

/// What operands an op takes and what it gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// n floats or vectors, by component; scalars combine with vectors. Result as the widest.
    Float(usize),
    /// As `Float`, or n ints.
    Number(usize),
    /// n ints.
    Int(usize),
    /// Two float or int scalars, giving a bool.
    Compare,
    /// Two scalars of any one type, giving a bool.
    Equal,
    /// n bools.
    Bool(usize),
    /// n vectors of one width, giving a float.
    Reduce(usize),
    /// Two vectors of one width, giving such a vector.
    Vector(usize),
    /// Two vectors of three.
    Cross,
    /// A bool and two values of one type.
    Select,
    /// An int, giving a float.
    IntToFloat,
    /// A float, giving an int.
    FloatToInt,
    /// A texture (int) and a vec2, giving so many floats.
    Lookup(usize),
    /// As `Lookup`, with the bits of [`crate::abi::texture_mode`]; a vec4 in place of the vec2 holds
    /// the width to average over in its second half.
    LookupAs(usize),
    /// A matrix and a vector of three.
    MatVec,
}

/// Which part of the machine an op keeps busy; the cost model gives each class a weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostClass {
    /// Float arithmetic; the number is operations a component.
    Alu(u32),
    /// Special-function unit; the number is operations a component.
    Special(u32),
    /// Integer and bit arithmetic; the number is operations a component.
    Integer(u32),
    /// A texture lookup.
    Texture,
}

/// How an op is written in WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wgsl {
    /// `-a`
    Prefix(&'static str),
    /// `a + b`
    Infix(&'static str),
    /// A WGSL function over operands of one type.
    Builtin(&'static str),
    /// A function of our own: `T` stands for the operand type, `B` for its bools. The name gets
    /// the width as suffix; text is the body after `fn name`.
    Helper(&'static str, &'static str),
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct OpInfo {
    /// Name in the language and in printed IR.
    pub text: &'static str,
    /// Operands and result.
    pub shape: Shape,
    /// Cost.
    pub class: CostClass,
    /// Spelling in WGSL for floats and bools.
    pub wgsl: Wgsl,
    /// Spelling in WGSL for ints, where it differs.
    pub wgsl_int: Option<Wgsl>,
    /// Can be called by its text as a function.
    pub callable: bool,
}

macro_rules! ops {
    ($($name:ident $text:literal $call:ident $shape:expr, $class:expr, $wgsl:expr, $int:expr, $eval:expr, $derivative:ident;)*) => {
        /// An operation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[allow(missing_docs)]
        pub enum Op { $($name),* }

        impl Op {
            /// Every op in table order.
            pub const ALL: &'static [Op] = &[$(Op::$name),*];

            /// The op's row.
            pub fn info(self) -> &'static OpInfo {
                use Shape::*;
                use CostClass::*;
                use Wgsl::*;
                static ROWS: &[OpInfo] = &[
                    $(OpInfo {
                        text: $text, shape: $shape, class: $class, wgsl: $wgsl, wgsl_int: $int,
                        callable: ops!(@$call),
                    }),*
                ];
                &ROWS[self as usize]
            }
        }

        impl Op {
            /// How its result changes with its operands; none if by steps only.
            fn derivative(self) -> Option<fn(&mut Rule<'_>) -> Tangent> {
                match self { $(Op::$name => ops!(@rule $derivative)),* }
            }
        }

        /// What `op` does to `width` components; 0 stands for ints and bools.
        pub fn kernel<F: Real>(op: Op, width: usize) -> Kernel<F> {
            match op {
                $(Op::$name => {
                    fn run<F: Real, const W: usize>(f: &mut [F], i: &mut [i32], at: &Operands) {
                        apply(Args::<F, W> { floats: f, ints: i, at }, $eval);
                    }
                    let kernels: [Kernel<F>; 5] =
                        [run::<F, 0>, run::<F, 1>, run::<F, 2>, run::<F, 3>, run::<F, 4>];
                    kernels[width.min(4)]
                })*
            }
        }
    };
    (@function) => { true };
    (@operator) => { false };
    (@rule zero) => { None };
    (@rule $rule:ident) => { Some(derivative::$rule) };
}

/// The least normal f32: `log` and divisions clamp to it.
pub const TINY: f64 = f32::MIN_POSITIVE as f64;

ops! {
    // Arithmetic
    Neg "neg" operator Number(1), Alu(1), Prefix("-"), None,
        |a| number1(a, |x| -x, i32::wrapping_neg), neg;
    Add "add" operator Number(2), Alu(1), Infix("+"), None,
        |a| number2(a, |x, y| x + y, i32::wrapping_add), add;
    Sub "sub" operator Number(2), Alu(1), Infix("-"), None,
        |a| number2(a, |x, y| x - y, i32::wrapping_sub), sub;
    Mul "mul" operator Number(2), Alu(1), Infix("*"), None,
        |a| number2(a, |x, y| x * y, i32::wrapping_mul), product;
    Div "div" operator Number(2), Special(1),
        Helper("safe_div", "(a: T, b: T) -> T { return select(a / select(b, T(1), b == T(0)), T(0), b == T(0)); }"),
        Some(Helper("safe_div_int", "(a: T, b: T) -> T { return select(a / select(b, T(1), b == T(0)), T(0), b == T(0)); }")),
        |a| number2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x / y }, |x, y| if y == 0 { 0 } else { x.wrapping_div(y) }), div;
    Rem "rem" operator Number(2), Special(2),
        Helper("safe_rem", "(a: T, b: T) -> T { return select(a % select(b, T(1), b == T(0)), T(0), b == T(0)); }"),
        Some(Helper("safe_rem_int", "(a: T, b: T) -> T { return select(a % select(b, T(1), b == T(0)), T(0), b == T(0)); }")),
        |a| number2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x % y }, |x, y| if y == 0 { 0 } else { x.wrapping_rem(y) }), remainder;
    Mod "mod" function Float(2), Special(2),
        Helper("floor_mod", "(a: T, b: T) -> T { let d = select(b, T(1), b == T(0)); return select(a - d * floor(a / d), T(0), b == T(0)); }"), None,
        |a| float2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x - y * (x / y).map(f64::floor) }), remainder;
    Min "min" function Number(2), Alu(1), Builtin("min"), None,
        |a| number2(a, |x, y| if y < x { y } else { x }, i32::min), min;
    Max "max" function Number(2), Alu(1), Builtin("max"), None,
        |a| number2(a, |x, y| if x < y { y } else { x }, i32::max), max;
    Clamp "clamp" function Number(3), Alu(2),
        Helper("clamp_to", "(x: T, low: T, high: T) -> T { return min(max(x, low), high); }"),
        Some(Helper("clamp_to_int", "(x: T, low: T, high: T) -> T { return min(max(x, low), high); }")),
        |a| number3(a, |x, l, h| low_of(high_of(x, l), h), |x, l, h| x.max(l).min(h)), clamp;
    Saturate "saturate" function Float(1), Alu(1), Builtin("saturate"), None,
        |a| float1(a, |x| low_of(high_of(x, F::of(0.0)), F::of(1.0))), saturate;
    Mix "mix" function Float(3), Alu(2), Builtin("mix"), None,
        |a| float3(a, |x, y, t| x * (F::of(1.0) - t) + y * t), mix;
    Step "step" function Float(2), Alu(1), Builtin("step"), None,
        |a| float2(a, |edge, x| unit(edge <= x)), zero;
    Smoothstep "smoothstep" function Float(3), Alu(6),
        Helper("smooth_ramp", "(low: T, high: T, x: T) -> T { let d = high - low; let t = saturate((x - low) / select(d, T(1), d == T(0))); return select(t * t * (T(3) - T(2) * t), step(low, x), d == T(0)); }"), None,
        |a| float3(a, smoothstep), smoothstep;
    Abs "abs" function Number(1), Alu(1), Builtin("abs"), None,
        |a| number1(a, |x| x.map(f64::abs), i32::wrapping_abs), abs;
    Sign "sign" function Float(1), Alu(1), Builtin("sign"), None,
        |a| float1(a, |x| x.map(|v| if v > 0.0 { 1.0 } else if v < 0.0 { -1.0 } else { 0.0 })), zero;
    Floor "floor" function Float(1), Alu(1), Builtin("floor"), None, |a| float1(a, |x| x.map(f64::floor)), zero;
    Ceil "ceil" function Float(1), Alu(1), Builtin("ceil"), None, |a| float1(a, |x| x.map(f64::ceil)), zero;
    Round "round" function Float(1), Alu(1), Builtin("round"), None, |a| float1(a, |x| x.map(f64::round_ties_even)), zero;
    Fract "fract" function Float(1), Alu(2),
        Helper("fraction", "(x: T) -> T { return min(x - floor(x), T(0.99999994)); }"), None,
        |a| float1(a, |x| low_of(x - x.map(f64::floor), F::of(0.999_999_94))), same;
    // Powers and transcendentals
    Sqrt "sqrt" function Float(1), Special(1),
        Helper("safe_sqrt", "(x: T) -> T { return sqrt(max(x, T(0))); }"), None,
        |a| float1(a, |x| high_of(x, F::of(0.0)).sqrt()), sqrt;
    InverseSqrt "inverse_sqrt" function Float(1), Special(1),
        Helper("safe_inverse_sqrt", "(x: T) -> T { return select(T(0), inverseSqrt(max(x, T(1.1754944e-38))), x > T(0)); }"), None,
        |a| float1(a, |x| if x > F::of(0.0) { F::of(1.0) / high_of(x, F::of(TINY)).sqrt() } else { F::of(0.0) }), inverse_sqrt;
    Exp "exp" function Float(1), Special(1),
        Helper("safe_exp", "(x: T) -> T { return exp(min(x, T(88))); }"), None,
        |a| float1(a, |x| x.map(|v| v.min(88.0).exp())), exp;
    Exp2 "exp2" function Float(1), Special(1),
        Helper("safe_exp2", "(x: T) -> T { return exp2(min(x, T(127))); }"), None,
        |a| float1(a, |x| x.map(|v| v.min(127.0).exp2())), exp2;
    Log "log" function Float(1), Special(1),
        Helper("safe_log", "(x: T) -> T { return log(max(x, T(1.1754944e-38))); }"), None,
        |a| float1(a, |x| x.map(|v| v.max(TINY).ln())), log;
    Log2 "log2" function Float(1), Special(1),
        Helper("safe_log2", "(x: T) -> T { return log2(max(x, T(1.1754944e-38))); }"), None,
        |a| float1(a, |x| x.map(|v| v.max(TINY).log2())), log2;
    Pow "pow" function Float(2), Special(2),
        Helper("safe_pow", "(x: T, y: T) -> T { let p = exp2(min(y * log2(max(x, T(1.1754944e-38))), T(127))); return select(select(T(0), p, x > T(0)), T(1), y == T(0)); }"), None,
        |a| float2(a, |x, y| F::of(power(x.f64(), y.f64()))), pow;
    Sin "sin" function Float(1), Special(1), Builtin("sin"), None, |a| float1(a, |x| x.map(f64::sin)), sin;
    Cos "cos" function Float(1), Special(1), Builtin("cos"), None, |a| float1(a, |x| x.map(f64::cos)), cos;
    Tan "tan" function Float(1), Special(2), Builtin("tan"), None, |a| float1(a, |x| x.map(f64::tan)), tan;
    Asin "asin" function Float(1), Special(2),
        Helper("safe_asin", "(x: T) -> T { return asin(clamp(x, T(-1), T(1))); }"), None,
        |a| float1(a, |x| x.map(|v| v.clamp(-1.0, 1.0).asin())), asin;
    Acos "acos" function Float(1), Special(2),
        Helper("safe_acos", "(x: T) -> T { return acos(clamp(x, T(-1), T(1))); }"), None,
        |a| float1(a, |x| x.map(|v| v.clamp(-1.0, 1.0).acos())), acos;
    Atan "atan" function Float(1), Special(2), Builtin("atan"), None, |a| float1(a, |x| x.map(f64::atan)), atan;
    Atan2 "atan2" function Float(2), Special(3),
        Helper("safe_atan2", "(y: T, x: T) -> T { let o = (x == T(0)) & (y == T(0)); return select(atan2(y, select(x, T(1), o)), T(0), o); }"), None,
        |a| float2(a, |y, x| F::of(if is_zero(x) && is_zero(y) { 0.0 } else { y.f64().atan2(x.f64()) })), atan2;
    SrgbDecode "srgb_decode" operator Float(1), Special(2),
        Helper("srgb_decode", "(c: T) -> T { return select(pow((max(c, T(0)) + T(0.055)) / T(1.055), T(2.4)), c / T(12.92), c <= T(0.04045)); }"), None,
        |a| float1(a, |x| x.map(srgb_decode)), srgb_decode;
    // Geometry
    Dot "dot" function Reduce(2), Alu(2), Builtin("dot"), None,
        |a| reduce2(a, |v, w| sum(&v, &w)), product;
    Length "length" function Reduce(1), Special(2), Builtin("length"), None,
        |a| reduce1(a, |v| sum(&v, &v).sqrt()), length;
    Distance "distance" function Reduce(2), Special(2), Builtin("distance"), None,
        |a| reduce2(a, distance), distance;
    Normalize "normalize" function Vector(1), Special(2),
        Helper("safe_normalize", "(v: T) -> T { let d = dot(v, v); return select(T(0), v * inverseSqrt(max(d, 1.1754944e-38)), d > 1.1754944e-38); }"), None,
        normalize, normalize;
    Reflect "reflect" function Vector(2), Alu(3), Builtin("reflect"), None,
        reflect, reflect;
    Cross "cross" function Cross, Alu(3), Builtin("cross"), None, cross, product;
    MaxComponent "max_component" function Reduce(1), Alu(1),
        Helper("max_component", ""), None,
        |a| reduce1(a, |v| v.into_iter().fold(F::of(f64::MIN), high_of)), max_component;
    MinComponent "min_component" function Reduce(1), Alu(1),
        Helper("min_component", ""), None,
        |a| reduce1(a, |v| v.into_iter().fold(F::of(f64::MAX), low_of)), min_component;
    Luminance "luminance" function Reduce(1), Alu(2),
        Helper("luminance", "(c: T) -> f32 { return dot(c, vec3<f32>(0.2126, 0.7152, 0.0722)); }"), None,
        |a| reduce1(a, |v| sum(&v, &[F::of(0.2126), F::of(0.7152), F::of(0.0722)])), linear;
    MatVec "transform" operator MatVec, Alu(5), Infix("*"), None, mat_vec, product;
    // Differentiation: of what is left after the pass `widths`, nothing varies
    FilterWidth "filter_width" operator Float(1), Alu(1), Helper("filter_width", "(x: T) -> T { return T(0); }"), None,
        |a| all(a, 0.0), zero;
    // Choice
    Select "select" function Select, Alu(1), Builtin("select"), None,
        choose, select;
    Less "lt" operator Compare, Alu(1), Infix("<"), None, |a| test(a, |x, y| x < y, |x, y| x < y), zero;
    LessEqual "le" operator Compare, Alu(1), Infix("<="), None, |a| test(a, |x, y| x <= y, |x, y| x <= y), zero;
    Greater "gt" operator Compare, Alu(1), Infix(">"), None, |a| test(a, |x, y| x > y, |x, y| x > y), zero;
    GreaterEqual "ge" operator Compare, Alu(1), Infix(">="), None, |a| test(a, |x, y| x >= y, |x, y| x >= y), zero;
    Equal "eq" operator Equal, Alu(1), Infix("=="), None, |a| test(a, |x, y| x == y, |x, y| x == y), zero;
    NotEqual "ne" operator Equal, Alu(1), Infix("!="), None, |a| test(a, |x, y| x != y, |x, y| x != y), zero;
    And "and" operator Bool(2), Integer(1), Infix("&"), None, |a| int2(a, |x, y| x & y), zero;
    Or "or" operator Bool(2), Integer(1), Infix("|"), None, |a| int2(a, |x, y| x | y), zero;
    Not "not" operator Bool(1), Integer(1), Prefix("!"), None, |a| int1(a, |x| x ^ 1), zero;
    // Integers
    BitAnd "bit_and" operator Int(2), Integer(1), Infix("&"), None, |a| int2(a, |x, y| x & y), zero;
    BitOr "bit_or" operator Int(2), Integer(1), Infix("|"), None, |a| int2(a, |x, y| x | y), zero;
    BitXor "bit_xor" operator Int(2), Integer(1), Infix("^"), None, |a| int2(a, |x, y| x ^ y), zero;
    ShiftLeft "shift_left" operator Int(2), Integer(1), Helper("shift_left", "(a: T, b: T) -> T { return a << (u32(b) & 31u); }"), None,
        |a| int2(a, |x, y| x.wrapping_shl(y as u32)), zero;
    ShiftRight "shift_right" operator Int(2), Integer(1), Helper("shift_right", "(a: T, b: T) -> T { return a >> (u32(b) & 31u); }"), None,
        |a| int2(a, |x, y| x.wrapping_shr(y as u32)), zero;
    UnsignedShiftRight "unsigned_shift_right" operator Int(2), Integer(1),
        Helper("unsigned_shift_right", "(a: T, b: T) -> T { return bitcast<i32>(bitcast<u32>(a) >> (u32(b) & 31u)); }"), None,
        |a| int2(a, |x, y| (x as u32).wrapping_shr(y as u32) as i32), zero;
    UnsignedDiv "unsigned_div" operator Int(2), Special(1),
        Helper("unsigned_div", "(a: T, b: T) -> T { let d = bitcast<u32>(b); return select(bitcast<i32>(bitcast<u32>(a) / select(d, 1u, d == 0u)), 0, d == 0u); }"), None,
        |a| int2(a, |x, y| (x as u32).checked_div(y as u32).unwrap_or(0) as i32), zero;
    UnsignedRem "unsigned_rem" operator Int(2), Special(2),
        Helper("unsigned_rem", "(a: T, b: T) -> T { let d = bitcast<u32>(b); return select(bitcast<i32>(bitcast<u32>(a) % select(d, 1u, d == 0u)), 0, d == 0u); }"), None,
        |a| int2(a, |x, y| (x as u32).checked_rem(y as u32).unwrap_or(0) as i32), zero;
    Hash1 "hash" function Int(1), Integer(8), Helper("hash", HASH1), None,
        |a| hash(a, 1), zero;
    Hash2 "hash" function Int(2), Integer(16), Helper("hash2", HASH2), None,
        |a| hash(a, 2), zero;
    Hash3 "hash" function Int(3), Integer(24), Helper("hash3", HASH3), None,
        |a| hash(a, 3), zero;
    ToFloat "to_float" operator IntToFloat, Integer(1), Builtin("f32"), None,
        |a| to_float(a, f64::from), zero;
    ToInt "to_int" operator FloatToInt, Integer(1), Builtin("i32"), None,
        |a| to_int(a, |x| x.clamp(-2_147_483_648.0, 2_147_483_520.0) as i32), zero;
    UnsignedToFloat "unsigned_to_float" operator IntToFloat, Integer(1),
        Helper("unsigned_to_float", "(i: T) -> f32 { return f32(bitcast<u32>(i)); }"), None,
        |a| to_float(a, |i| f64::from(i as u32)), zero;
    ToUnsigned "to_unsigned" operator FloatToInt, Integer(1),
        Helper("to_unsigned", "(x: T) -> i32 { return bitcast<i32>(u32(x)); }"), None,
        |a| to_int(a, |x| x.clamp(0.0, 4_294_967_040.0) as u32 as i32), zero;
    UnitFloat "unit_float" function IntToFloat, Integer(2),
        Helper("unit_float", "(i: T) -> f32 { return f32(bitcast<u32>(i) >> 8u) * 5.9604645e-8; }"), None,
        |a| to_float(a, |i| f64::from(i as u32 >> 8) / 16_777_216.0), zero;
    // Textures: a texture is an index
    Image "image" function Lookup(3), Texture, Builtin("texture_fetch"), None, |a| all(a, 0.5), lookup;
    ImageData "image_data" function Lookup(4), Texture, Builtin("texture_fetch"), None, |a| all(a, 0.5), lookup;
    ImageAlpha "image_alpha" function Lookup(1), Texture, Builtin("texture_fetch"), None, |a| all(a, 0.5), lookup;
    ImageAs "image" function LookupAs(3), Texture, Builtin("texture_fetch_as"), None, |a| all(a, 0.5), lookup;
    ImageDataAs "image_data" function LookupAs(4), Texture, Builtin("texture_fetch_as"), None, |a| all(a, 0.5), lookup;
    ImageAlphaAs "image_alpha" function LookupAs(1), Texture, Builtin("texture_fetch_as"), None, |a| all(a, 0.5), lookup;
}

const HASH1: &str = "(a: T) -> i32 { let s = bitcast<u32>(a) * 747796405u + 2891336453u; let w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u; return bitcast<i32>((w >> 22u) ^ w); }";
const HASH2: &str = "(a: T, b: T) -> i32 { return op_hash(op_hash(a) + b); }";
const HASH3: &str = "(a: T, b: T, c: T) -> i32 { return op_hash(op_hash(op_hash(a) + b) + c); }";

impl Op {
    /// Ops called by `name`; several where the number of operands decides.
    pub fn by_name(name: &str) -> impl Iterator<Item = Op> + use<'_> {
        // By their names; those of one name in the order of the table.
        static CALLABLE: OnceLock<Vec<(&str, Op)>> = OnceLock::new();
        let callable = CALLABLE.get_or_init(|| {
            let all = Self::ALL.iter().map(|op| (op.info(), *op));
            let callable = all.filter(|(info, _)| info.callable);
            let mut named: Vec<_> = callable.map(|(info, op)| (info.text, op)).collect();
            named.sort_by_key(|(name, _)| *name);
            named
        });
        let first = callable.partition_point(|(n, _)| *n < name);
        let named = callable[first..]
            .iter()
            .take_while(move |(n, _)| *n == name);
        named.map(|(_, op)| *op)
    }

    /// Number of operands.
    pub fn arity(self) -> usize {
        match self.info().shape {
            Shape::Float(n) | Shape::Number(n) | Shape::Int(n) | Shape::Bool(n) => n,
            Shape::Reduce(n) | Shape::Vector(n) => n,
            Shape::Compare | Shape::Equal | Shape::Cross | Shape::Lookup(_) | Shape::MatVec => 2,
            Shape::Select | Shape::LookupAs(_) => 3,
            Shape::IntToFloat | Shape::FloatToInt => 1,
        }
    }

    /// The type of the result for operands of types `args`, if they fit.
    pub fn result(self, args: &[Type]) -> Option<Type> {
        use Type::*;
        if args.len() != self.arity() {
            return None;
        }
        let all = |ty: Type| args.iter().all(|&a| a == ty);
        let same_vectors =
            args.iter().all(|&a| a == args[0]) && args[0].width().is_some_and(|w| w > 1);
        match self.info().shape {
            Shape::Number(_) if all(Int) => Some(Int),
            Shape::Number(_) | Shape::Float(_) => widest(args),
            Shape::Int(_) => all(Int).then_some(Int),
            Shape::Compare => (all(Int) || all(Float)).then_some(Bool),
            Shape::Equal => (all(Int) || all(Float) || all(Bool)).then_some(Bool),
            Shape::Bool(_) => all(Bool).then_some(Bool),
            Shape::Reduce(_) if self == Op::Luminance => all(Vec3).then_some(Float),
            Shape::Reduce(_) => same_vectors.then_some(Float),
            Shape::Vector(_) => same_vectors.then_some(args[0]),
            Shape::Cross => all(Vec3).then_some(Vec3),
            Shape::Select => (args[0] == Bool && args[1] == args[2]).then_some(args[1]),
            Shape::IntToFloat => all(Int).then_some(Float),
            Shape::FloatToInt => all(Float).then_some(Int),
            Shape::Lookup(n) => (args == [Int, Vec2]).then_some(Type::of_width(n)),
            Shape::LookupAs(n) => {
                let fits = args == [Int, Vec2, Int] || args == [Int, Vec4, Int];
                fits.then_some(Type::of_width(n))
            }
            Shape::MatVec => (args == [Mat3, Vec3]).then_some(Vec3),
        }
    }
}

impl Op {
    /// How a lookup of a texture reads it; `None` of other ops.
    pub fn texture_space(self) -> Option<TextureSpace> {
        match self {
            Op::Image | Op::ImageAs | Op::ImageAlpha | Op::ImageAlphaAs => {
                Some(TextureSpace::Color)
            }
            Op::ImageData | Op::ImageDataAs => Some(TextureSpace::Data),
            _ => None,
        }
    }

    /// Which of the four numbers of a texel a lookup gives.
    pub fn texel_part(self) -> std::ops::Range<usize> {
        match self.info().shape {
            Shape::Lookup(1) | Shape::LookupAs(1) => 3..4,
            Shape::Lookup(n) | Shape::LookupAs(n) => 0..n,
            _ => 0..0,
        }
    }

    /// The lookup of the same kind that says how to wrap, filter and average.
    pub fn with_mode(self) -> Op {
        match self {
            Op::Image => Op::ImageAs,
            Op::ImageData => Op::ImageDataAs,
            Op::ImageAlpha => Op::ImageAlphaAs,
            other => other,
        }
    }

    /// The lookup of the same kind that repeats, is bilinear and averages over nothing.
    pub fn without_mode(self) -> Op {
        match self {
            Op::ImageAs => Op::Image,
            Op::ImageDataAs => Op::ImageData,
            Op::ImageAlphaAs => Op::ImageAlpha,
            other => other,
        }
    }

    /// How many components [`kernel`] works on for operands of types `args`; 0 for ints.
    pub fn components(self, args: &[Type]) -> usize {
        match self.info().shape {
            Shape::Lookup(n) | Shape::LookupAs(n) => n,
            _ => args.iter().filter_map(|a| a.width()).max().unwrap_or(0),
        }
    }

    /// Where [`kernel`] finds operands of types `args` that lie at `from`.
    pub fn operands(self, args: &[Type], to: u32, from: [u32; 3]) -> Operands {
        let step = |k: usize| u8::from(args.get(k) != Some(&Type::Float));
        Operands {
            to,
            from,
            step: [step(0), step(1), step(2)],
        }
    }
}

/// The widest of float types that combine: all scalars or of one width.
fn widest(args: &[Type]) -> Option<Type> {
    let mut widest = None;
    for ty in args {
        widest = widest.max(Some(ty.width()?));
    }
    let widest = widest?;
    args.iter()
        .all(|ty| matches!(ty.width(), Some(w) if w == 1 || w == widest))
        .then(|| Type::of_width(widest))
}

/// Applies `op` to bools, ints, floats and vectors that fit its shape; what does not fit gives
/// zero. Matrices, and textures that are there, are the interpreter's.
pub fn evaluate<F: Real>(op: Op, args: &[Value<F>]) -> Value<F> {
    let mut types = [Type::Mat3; 3];
    for (ty, arg) in types.iter_mut().zip(args) {
        *ty = arg.plain_type().unwrap_or(Type::Mat3);
    }
    let types = &types[..args.len().min(3)];
    let fits = args.len() == types.len() && !types.contains(&Type::Mat3);
    let Some(ty) = op.result(types).filter(|_| fits) else {
        return Value::float(0.0);
    };
    let mut floats = [F::of(0.0); 16];
    let mut ints = [0; 4];
    // The result, then the operands, in steps of the widest.
    for (k, arg) in args.iter().enumerate() {
        match arg {
            Value::Bool(b) => ints[k + 1] = i32::from(*b),
            Value::Int(i) => ints[k + 1] = *i,
            other => {
                let v = other.components();
                floats[4 * k + 4..][..v.len()].copy_from_slice(v);
            }
        }
    }
    let from = |k: usize| match types.get(k) {
        Some(Type::Bool | Type::Int) => k as u32 + 1,
        _ => 4 * k as u32 + 4,
    };
    let at = op.operands(types, 0, [from(0), from(1), from(2)]);
    kernel::<F>(op, op.components(types))(&mut floats, &mut ints, &at);
    match ty {
        Type::Bool => Value::Bool(ints[0] != 0),
        Type::Int => Value::Int(ints[0]),
        _ => Value::floats(&floats[..ty.width().unwrap_or(1)]),
    }
}

/// Operations by the class of hardware they keep busy, each component counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Float arithmetic.
    pub alu: u64,
    /// Divisions, roots and transcendentals.
    pub special: u64,
    /// Integer and bit arithmetic.
    pub integer: u64,
    /// Texture lookups.
    pub texture: u64,
    /// Calls of functions.
    pub calls: u64,
    /// Turns of loops.
    pub turns: u64,
}

impl Counts {
    /// Counts one `op` over `components`.
    pub fn op(&mut self, op: Op, components: usize) {
        let times = components.max(1) as u64;
        match op.info().class {
            CostClass::Alu(n) => self.alu += u64::from(n) * times,
            CostClass::Special(n) => self.special += u64::from(n) * times,
            CostClass::Integer(n) => self.integer += u64::from(n) * times,
            CostClass::Texture => self.texture += 1,
        }
    }

    /// What was counted after `before`, an earlier state of these counts.
    pub fn since(&self, before: &Counts) -> Counts {
        Counts {
            alu: self.alu - before.alu,
            special: self.special - before.special,
            integer: self.integer - before.integer,
            texture: self.texture - before.texture,
            calls: self.calls - before.calls,
            turns: self.turns - before.turns,
        }
    }

    /// All operations on single numbers, a turn of a loop being one. Calls are none: drivers put
    /// them in line.
    pub fn operations(&self) -> u64 {
        self.alu + self.special + self.integer + self.texture + self.turns
    }

    /// Adds `other`, `times` over.
    pub fn add(&mut self, other: &Counts, times: u64) {
        self.alu += other.alu * times;
        self.special += other.special * times;
        self.integer += other.integer * times;
        self.texture += other.texture * times;
        self.calls += other.calls * times;
        self.turns += other.turns * times;
    }
}
