//! The op table: every operation of the language, declared once.
//!
//! A row gives an op's text, what operands it takes, what class of hardware cost it has, how it
//! is written in WGSL, and how it is interpreted. Checking, printing, verifying, folding,
//! interpretation, code generation and cost all read this table; a row that lacks a column does
//! not compile.

use crate::ir::Type;
use crate::ir::value::{Floats, Real, Value};

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
    /// A texture (int) and a vec2, giving a vec3 or a vec4.
    Lookup(usize),
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
    ($($name:ident $text:literal $call:ident $shape:expr, $class:expr, $wgsl:expr, $int:expr, $eval:expr;)*) => {
        /// An operation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[allow(missing_docs)]
        pub enum Op { $($name),* }

        impl Op {
            /// Every op in table order.
            pub const ALL: &'static [Op] = &[$(Op::$name),*];

            /// The op's row.
            pub fn info(self) -> OpInfo {
                use Shape::*;
                use CostClass::*;
                use Wgsl::*;
                match self {
                    $(Op::$name => OpInfo {
                        text: $text, shape: $shape, class: $class, wgsl: $wgsl, wgsl_int: $int,
                        callable: ops!(@$call),
                    }),*
                }
            }
        }

        /// Applies `op` to operands that fit its shape. Texture ops are the interpreter's.
        pub fn evaluate<F: Real>(op: Op, args: &[Value<F>]) -> Value<F> {
            match op { $(Op::$name => { let f: fn(&[Value<F>]) -> Value<F> = $eval; f(args) })* }
        }
    };
    (@function) => { true };
    (@operator) => { false };
}

/// The least normal f32: `log` and divisions clamp to it.
pub const TINY: f64 = f32::MIN_POSITIVE as f64;

ops! {
    // Arithmetic
    Neg "neg" operator Number(1), Alu(1), Prefix("-"), None,
        |a| number1(a, |x| -x, i32::wrapping_neg);
    Add "add" operator Number(2), Alu(1), Infix("+"), None,
        |a| number2(a, |x, y| x + y, i32::wrapping_add);
    Sub "sub" operator Number(2), Alu(1), Infix("-"), None,
        |a| number2(a, |x, y| x - y, i32::wrapping_sub);
    Mul "mul" operator Number(2), Alu(1), Infix("*"), None,
        |a| number2(a, |x, y| x * y, i32::wrapping_mul);
    Div "div" operator Number(2), Special(1),
        Helper("safe_div", "(a: T, b: T) -> T { return select(a / select(b, T(1), b == T(0)), T(0), b == T(0)); }"),
        Some(Helper("safe_div_int", "(a: T, b: T) -> T { return select(a / select(b, T(1), b == T(0)), T(0), b == T(0)); }")),
        |a| number2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x / y }, |x, y| if y == 0 { 0 } else { x.wrapping_div(y) });
    Rem "rem" operator Number(2), Special(2),
        Helper("safe_rem", "(a: T, b: T) -> T { return select(a % select(b, T(1), b == T(0)), T(0), b == T(0)); }"),
        Some(Helper("safe_rem_int", "(a: T, b: T) -> T { return select(a % select(b, T(1), b == T(0)), T(0), b == T(0)); }")),
        |a| number2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x % y }, |x, y| if y == 0 { 0 } else { x.wrapping_rem(y) });
    Mod "mod" function Float(2), Special(2),
        Helper("floor_mod", "(a: T, b: T) -> T { let d = select(b, T(1), b == T(0)); return select(a - d * floor(a / d), T(0), b == T(0)); }"), None,
        |a| float2(a, |x, y| if is_zero(y) { F::of(0.0) } else { x - y * (x / y).map(f64::floor) });
    Min "min" function Number(2), Alu(1), Builtin("min"), None,
        |a| number2(a, |x, y| if y < x { y } else { x }, i32::min);
    Max "max" function Number(2), Alu(1), Builtin("max"), None,
        |a| number2(a, |x, y| if x < y { y } else { x }, i32::max);
    Clamp "clamp" function Number(3), Alu(2),
        Helper("clamp_to", "(x: T, low: T, high: T) -> T { return min(max(x, low), high); }"),
        Some(Helper("clamp_to_int", "(x: T, low: T, high: T) -> T { return min(max(x, low), high); }")),
        |a| number3(a, |x, l, h| low_of(high_of(x, l), h), |x, l, h| x.max(l).min(h));
    Saturate "saturate" function Float(1), Alu(1), Builtin("saturate"), None,
        |a| float1(a, |x| low_of(high_of(x, F::of(0.0)), F::of(1.0)));
    Mix "mix" function Float(3), Alu(2), Builtin("mix"), None,
        |a| float3(a, |x, y, t| x * (F::of(1.0) - t) + y * t);
    Step "step" function Float(2), Alu(1), Builtin("step"), None,
        |a| float2(a, |edge, x| F::of(f64::from(u8::from(edge <= x))));
    Smoothstep "smoothstep" function Float(3), Alu(6),
        Helper("smooth_ramp", "(low: T, high: T, x: T) -> T { let d = high - low; let t = saturate((x - low) / select(d, T(1), d == T(0))); return select(t * t * (T(3) - T(2) * t), step(low, x), d == T(0)); }"), None,
        |a| float3(a, smoothstep);
    Abs "abs" function Number(1), Alu(1), Builtin("abs"), None,
        |a| number1(a, |x| x.map(f64::abs), i32::wrapping_abs);
    Sign "sign" function Float(1), Alu(1), Builtin("sign"), None,
        |a| float1(a, |x| x.map(|v| if v > 0.0 { 1.0 } else if v < 0.0 { -1.0 } else { 0.0 }));
    Floor "floor" function Float(1), Alu(1), Builtin("floor"), None, |a| float1(a, |x| x.map(f64::floor));
    Ceil "ceil" function Float(1), Alu(1), Builtin("ceil"), None, |a| float1(a, |x| x.map(f64::ceil));
    Round "round" function Float(1), Alu(1), Builtin("round"), None, |a| float1(a, |x| x.map(f64::round_ties_even));
    Fract "fract" function Float(1), Alu(2),
        Helper("fraction", "(x: T) -> T { return min(x - floor(x), T(0.99999994)); }"), None,
        |a| float1(a, |x| low_of(x - x.map(f64::floor), F::of(0.999_999_94)));
    // Powers and transcendentals
    Sqrt "sqrt" function Float(1), Special(1),
        Helper("safe_sqrt", "(x: T) -> T { return sqrt(max(x, T(0))); }"), None,
        |a| float1(a, |x| high_of(x, F::of(0.0)).sqrt());
    InverseSqrt "inverse_sqrt" function Float(1), Special(1),
        Helper("safe_inverse_sqrt", "(x: T) -> T { return select(T(0), inverseSqrt(max(x, T(1.1754944e-38))), x > T(0)); }"), None,
        |a| float1(a, |x| if x > F::of(0.0) { F::of(1.0) / high_of(x, F::of(TINY)).sqrt() } else { F::of(0.0) });
    Exp "exp" function Float(1), Special(1),
        Helper("safe_exp", "(x: T) -> T { return exp(min(x, T(88))); }"), None,
        |a| float1(a, |x| x.map(|v| v.min(88.0).exp()));
    Exp2 "exp2" function Float(1), Special(1),
        Helper("safe_exp2", "(x: T) -> T { return exp2(min(x, T(127))); }"), None,
        |a| float1(a, |x| x.map(|v| v.min(127.0).exp2()));
    Log "log" function Float(1), Special(1),
        Helper("safe_log", "(x: T) -> T { return log(max(x, T(1.1754944e-38))); }"), None,
        |a| float1(a, |x| x.map(|v| v.max(TINY).ln()));
    Log2 "log2" function Float(1), Special(1),
        Helper("safe_log2", "(x: T) -> T { return log2(max(x, T(1.1754944e-38))); }"), None,
        |a| float1(a, |x| x.map(|v| v.max(TINY).log2()));
    Pow "pow" function Float(2), Special(2),
        Helper("safe_pow", "(x: T, y: T) -> T { let p = exp2(min(y * log2(max(x, T(1.1754944e-38))), T(127))); return select(select(T(0), p, x > T(0)), T(1), y == T(0)); }"), None,
        |a| float2(a, |x, y| F::of(power(x.f64(), y.f64())));
    Sin "sin" function Float(1), Special(1), Builtin("sin"), None, |a| float1(a, |x| x.map(f64::sin));
    Cos "cos" function Float(1), Special(1), Builtin("cos"), None, |a| float1(a, |x| x.map(f64::cos));
    Tan "tan" function Float(1), Special(2), Builtin("tan"), None, |a| float1(a, |x| x.map(f64::tan));
    Asin "asin" function Float(1), Special(2),
        Helper("safe_asin", "(x: T) -> T { return asin(clamp(x, T(-1), T(1))); }"), None,
        |a| float1(a, |x| x.map(|v| v.clamp(-1.0, 1.0).asin()));
    Acos "acos" function Float(1), Special(2),
        Helper("safe_acos", "(x: T) -> T { return acos(clamp(x, T(-1), T(1))); }"), None,
        |a| float1(a, |x| x.map(|v| v.clamp(-1.0, 1.0).acos()));
    Atan "atan" function Float(1), Special(2), Builtin("atan"), None, |a| float1(a, |x| x.map(f64::atan));
    Atan2 "atan2" function Float(2), Special(3),
        Helper("safe_atan2", "(y: T, x: T) -> T { let o = (x == T(0)) & (y == T(0)); return select(atan2(y, select(x, T(1), o)), T(0), o); }"), None,
        |a| float2(a, |y, x| F::of(if is_zero(x) && is_zero(y) { 0.0 } else { y.f64().atan2(x.f64()) }));
    SrgbDecode "srgb_decode" operator Float(1), Special(2),
        Helper("srgb_decode", "(c: T) -> T { return select(pow((max(c, T(0)) + T(0.055)) / T(1.055), T(2.4)), c / T(12.92), c <= T(0.04045)); }"), None,
        |a| float1(a, |x| x.map(srgb_decode));
    // Geometry
    Dot "dot" function Reduce(2), Alu(2), Builtin("dot"), None,
        |a| one(sum(a[0].components(), a[1].components()));
    Length "length" function Reduce(1), Special(2), Builtin("length"), None,
        |a| one(sum(a[0].components(), a[0].components()).sqrt());
    Distance "distance" function Reduce(2), Special(2), Builtin("distance"), None,
        |a| { let d = float2(a, |x, y| x - y); one(sum(d.components(), d.components()).sqrt()) };
    Normalize "normalize" function Vector(1), Special(2),
        Helper("safe_normalize", "(v: T) -> T { let d = dot(v, v); return select(T(0), v * inverseSqrt(max(d, 1.1754944e-38)), d > 1.1754944e-38); }"), None,
        |a| normalize(&a[0]);
    Reflect "reflect" function Vector(2), Alu(3), Builtin("reflect"), None,
        |a| reflect(&a[0], &a[1]);
    Cross "cross" function Cross, Alu(3), Builtin("cross"), None, |a| cross(a[0].components(), a[1].components());
    MaxComponent "max_component" function Reduce(1), Alu(1),
        Helper("max_component", ""), None,
        |a| one(a[0].components().iter().copied().fold(F::of(f64::MIN), high_of));
    MinComponent "min_component" function Reduce(1), Alu(1),
        Helper("min_component", ""), None,
        |a| one(a[0].components().iter().copied().fold(F::of(f64::MAX), low_of));
    Luminance "luminance" function Reduce(1), Alu(2),
        Helper("luminance", "(c: T) -> f32 { return dot(c, vec3<f32>(0.2126, 0.7152, 0.0722)); }"), None,
        |a| one(sum(a[0].components(), &[F::of(0.2126), F::of(0.7152), F::of(0.0722)]));
    MatVec "transform" operator MatVec, Alu(5), Infix("*"), None, mat_vec;
    // Choice
    Select "select" function Select, Alu(1), Builtin("select"), None,
        |a| if a[0].as_bool() { a[1].clone() } else { a[2].clone() };
    Less "lt" operator Compare, Alu(1), Infix("<"), None, |a| compare(a, |o| o.is_lt());
    LessEqual "le" operator Compare, Alu(1), Infix("<="), None, |a| compare(a, |o| o.is_le());
    Greater "gt" operator Compare, Alu(1), Infix(">"), None, |a| compare(a, |o| o.is_gt());
    GreaterEqual "ge" operator Compare, Alu(1), Infix(">="), None, |a| compare(a, |o| o.is_ge());
    Equal "eq" operator Equal, Alu(1), Infix("=="), None, |a| Value::Bool(equal(a));
    NotEqual "ne" operator Equal, Alu(1), Infix("!="), None, |a| Value::Bool(!equal(a));
    And "and" operator Bool(2), Integer(1), Infix("&"), None, |a| Value::Bool(a[0].as_bool() & a[1].as_bool());
    Or "or" operator Bool(2), Integer(1), Infix("|"), None, |a| Value::Bool(a[0].as_bool() | a[1].as_bool());
    Not "not" operator Bool(1), Integer(1), Prefix("!"), None, |a| Value::Bool(!a[0].as_bool());
    // Integers
    BitAnd "bit_and" operator Int(2), Integer(1), Infix("&"), None, |a| int2(a, |x, y| x & y);
    BitOr "bit_or" operator Int(2), Integer(1), Infix("|"), None, |a| int2(a, |x, y| x | y);
    BitXor "bit_xor" operator Int(2), Integer(1), Infix("^"), None, |a| int2(a, |x, y| x ^ y);
    ShiftLeft "shift_left" operator Int(2), Integer(1), Helper("shift_left", "(a: T, b: T) -> T { return a << (u32(b) & 31u); }"), None,
        |a| int2(a, |x, y| x.wrapping_shl(y as u32));
    ShiftRight "shift_right" operator Int(2), Integer(1), Helper("shift_right", "(a: T, b: T) -> T { return a >> (u32(b) & 31u); }"), None,
        |a| int2(a, |x, y| x.wrapping_shr(y as u32));
    Hash1 "hash" function Int(1), Integer(8), Helper("hash", HASH1), None,
        |a| Value::Int(pcg(a[0].as_int() as u32) as i32);
    Hash2 "hash" function Int(2), Integer(16), Helper("hash2", HASH2), None,
        |a| Value::Int(hash_all(a) as i32);
    Hash3 "hash" function Int(3), Integer(24), Helper("hash3", HASH3), None,
        |a| Value::Int(hash_all(a) as i32);
    ToFloat "to_float" operator IntToFloat, Integer(1), Builtin("f32"), None,
        |a| Value::float(f64::from(a[0].as_int()));
    ToInt "to_int" operator FloatToInt, Integer(1),
        Helper("to_int", "(x: T) -> i32 { return i32(clamp(x, -2147483648.0, 2147483520.0)); }"), None,
        |a| Value::Int(a[0].as_float().f64().clamp(-2_147_483_648.0, 2_147_483_520.0) as i32);
    UnitFloat "unit_float" function IntToFloat, Integer(2),
        Helper("unit_float", "(i: T) -> f32 { return f32(bitcast<u32>(i) >> 8u) * 5.9604645e-8; }"), None,
        |a| Value::float(f64::from(a[0].as_int() as u32 >> 8) / 16_777_216.0);
    // Textures: a texture is an index
    Image "image" function Lookup(3), Texture, Builtin("texture_fetch"), None, |_| Value::vector(&[0.5; 3]);
    ImageData "image_data" function Lookup(4), Texture, Builtin("texture_fetch"), None, |_| Value::vector(&[0.5; 4]);
}

const HASH1: &str = "(a: T) -> i32 { let s = bitcast<u32>(a) * 747796405u + 2891336453u; let w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u; return bitcast<i32>((w >> 22u) ^ w); }";
const HASH2: &str = "(a: T, b: T) -> i32 { return op_hash(op_hash(a) + b); }";
const HASH3: &str = "(a: T, b: T, c: T) -> i32 { return op_hash(op_hash(op_hash(a) + b) + c); }";

impl Op {
    /// Ops called by `name`; several where the number of operands decides.
    pub fn by_name(name: &str) -> impl Iterator<Item = Op> + use<'_> {
        let callable = move |op: &Op| op.info().callable && op.info().text == name;
        Self::ALL.iter().copied().filter(callable)
    }

    /// Number of operands.
    pub fn arity(self) -> usize {
        match self.info().shape {
            Shape::Float(n) | Shape::Number(n) | Shape::Int(n) | Shape::Bool(n) => n,
            Shape::Reduce(n) | Shape::Vector(n) => n,
            Shape::Compare | Shape::Equal | Shape::Cross | Shape::Lookup(_) | Shape::MatVec => 2,
            Shape::Select => 3,
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
            Shape::MatVec => (args == [Mat3, Vec3]).then_some(Vec3),
        }
    }
}

/// The widest of float types that combine: all scalars or of one width.
fn widest(args: &[Type]) -> Option<Type> {
    let widths: Option<Vec<usize>> = args.iter().map(|a| a.width()).collect();
    let widths = widths?;
    let widest = widths.iter().copied().max()?;
    widths
        .iter()
        .all(|&w| w == 1 || w == widest)
        .then(|| Type::of_width(widest))
}

fn one<F: Real>(x: F) -> Value<F> {
    Value::Floats(Floats::new(&[x]))
}

fn is_zero<F: Real>(x: F) -> bool {
    x == F::of(0.0)
}

fn low_of<F: Real>(a: F, b: F) -> F {
    if b < a { b } else { a }
}

fn high_of<F: Real>(a: F, b: F) -> F {
    if a < b { b } else { a }
}

fn by_component<F: Real>(args: &[Value<F>], f: impl Fn(&dyn Fn(usize) -> F) -> F) -> Value<F> {
    let width = args
        .iter()
        .map(|a| a.components().len())
        .max()
        .unwrap_or(1)
        .max(1);
    let mut out = [F::of(0.0); 4];
    for (i, slot) in out.iter_mut().enumerate().take(width) {
        *slot = f(&|k| match &args[k] {
            Value::Floats(v) => v.get(i),
            _ => F::of(0.0),
        });
    }
    Value::Floats(Floats::new(&out[..width]))
}

fn float1<F: Real>(a: &[Value<F>], f: impl Fn(F) -> F) -> Value<F> {
    by_component(a, |x| f(x(0)))
}

fn float2<F: Real>(a: &[Value<F>], f: impl Fn(F, F) -> F) -> Value<F> {
    by_component(a, |x| f(x(0), x(1)))
}

fn float3<F: Real>(a: &[Value<F>], f: impl Fn(F, F, F) -> F) -> Value<F> {
    by_component(a, |x| f(x(0), x(1), x(2)))
}

fn number1<F: Real>(a: &[Value<F>], f: impl Fn(F) -> F, g: impl Fn(i32) -> i32) -> Value<F> {
    match a {
        [Value::Int(x)] => Value::Int(g(*x)),
        _ => float1(a, f),
    }
}

fn number2<F: Real>(
    a: &[Value<F>],
    f: impl Fn(F, F) -> F,
    g: impl Fn(i32, i32) -> i32,
) -> Value<F> {
    match a {
        [Value::Int(x), Value::Int(y)] => Value::Int(g(*x, *y)),
        _ => float2(a, f),
    }
}

fn number3<F: Real>(
    a: &[Value<F>],
    f: impl Fn(F, F, F) -> F,
    g: impl Fn(i32, i32, i32) -> i32,
) -> Value<F> {
    match a {
        [Value::Int(x), Value::Int(y), Value::Int(z)] => Value::Int(g(*x, *y, *z)),
        _ => float3(a, f),
    }
}

fn int2<F: Real>(a: &[Value<F>], f: impl Fn(i32, i32) -> i32) -> Value<F> {
    Value::Int(f(a[0].as_int(), a[1].as_int()))
}

fn compare<F: Real>(a: &[Value<F>], test: impl Fn(std::cmp::Ordering) -> bool) -> Value<F> {
    let ordering = match a {
        [Value::Int(x), Value::Int(y)] => Some(x.cmp(y)),
        _ => a[0].as_float().partial_cmp(&a[1].as_float()),
    };
    Value::Bool(ordering.is_some_and(test))
}

fn equal<F: Real>(a: &[Value<F>]) -> bool {
    match a {
        [Value::Int(x), Value::Int(y)] => x == y,
        [Value::Bool(x), Value::Bool(y)] => x == y,
        _ => a[0].as_float() == a[1].as_float(),
    }
}

fn sum<F: Real>(a: &[F], b: &[F]) -> F {
    a.iter().zip(b).fold(F::of(0.0), |s, (x, y)| s + *x * *y)
}

fn cross<F: Real>(a: &[F], b: &[F]) -> Value<F> {
    let c = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    Value::Floats(Floats::new(&[c(1, 2), c(2, 0), c(0, 1)]))
}

fn normalize<F: Real>(v: &Value<F>) -> Value<F> {
    let squared = sum(v.components(), v.components());
    if squared > F::of(TINY) {
        let inverse = F::of(1.0) / squared.sqrt();
        float1(std::slice::from_ref(v), |x| x * inverse)
    } else {
        float1(std::slice::from_ref(v), |_| F::of(0.0))
    }
}

fn reflect<F: Real>(v: &Value<F>, n: &Value<F>) -> Value<F> {
    let twice = F::of(2.0) * sum(v.components(), n.components());
    by_component(&[v.clone(), n.clone()], |x| x(0) - twice * x(1))
}

fn mat_vec<F: Real>(a: &[Value<F>]) -> Value<F> {
    let (Value::Mat3(m), Value::Floats(v)) = (&a[0], &a[1]) else {
        return one(F::of(0.0));
    };
    let row = |r: usize| m[0][r] * v.get(0) + m[1][r] * v.get(1) + m[2][r] * v.get(2);
    Value::Floats(Floats::new(&[row(0), row(1), row(2)]))
}

fn smoothstep<F: Real>(low: F, high: F, x: F) -> F {
    let d = high - low;
    if is_zero(d) {
        return F::of(f64::from(u8::from(low <= x)));
    }
    let t = low_of(high_of((x - low) / d, F::of(0.0)), F::of(1.0));
    t * t * (F::of(3.0) - F::of(2.0) * t)
}

fn power(x: f64, y: f64) -> f64 {
    if y == 0.0 {
        1.0
    } else if x > 0.0 {
        (y * x.max(TINY).log2()).min(127.0).exp2()
    } else {
        0.0
    }
}

fn srgb_decode(c: f64) -> f64 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// The PCG output permutation as a hash (Jarzynski and Olano 2020).
fn pcg(a: u32) -> u32 {
    let s = a.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let w = ((s >> ((s >> 28) + 4)) ^ s).wrapping_mul(277_803_737);
    (w >> 22) ^ w
}

fn hash_all<F: Real>(args: &[Value<F>]) -> u32 {
    args.iter()
        .fold(None, |h: Option<u32>, a| {
            let a = a.as_int() as u32;
            Some(pcg(h.map_or(a, |h| h.wrapping_add(a))))
        })
        .unwrap_or(0)
}
