//! What each op gives, in both precisions, at ordinary operands and where mathematics gives
//! nothing ("Nothing is undefined" in docs/language.md).

use impasto_compiler::ir::build::{Builder, const_type};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::ops::{self, Op, Shape};
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{Const, Local, Module, Type};

use super::HERE;

/// An op, its operands and its result, written as `div 1 0 = 0`. Floats and vectors are numbers
/// separated by commas (a vector of one is a float), `i` begins an int, `t` and `f` are bools.
const MEANINGS: &str = "
neg 1.5,-2,0 = -1.5,2,-0
neg i5 = i-5
neg i-2147483648 = i-2147483648
add 1.5 2 = 3.5
add 1,2,3 10 = 11,12,13
add i2147483647 i1 = i-2147483648
sub 10 1,2 = 9,8
sub i-2147483648 i1 = i2147483647
mul 2,3,4,5 1,10,100,-1 = 2,30,400,-5
mul i65536 i65536 = i0
div 7 2 = 3.5
div 1 0 = 0
div -1,0,8 0,0,2 = 0,0,4
div i7 i-2 = i-3
div i7 i0 = i0
div i-2147483648 i-1 = i-2147483648
rem 7.5 2 = 1.5
rem -7.5 2 = -1.5
rem 1 0 = 0
rem i-7 i2 = i-1
rem i7 i0 = i0
rem i-2147483648 i-1 = i0
mod 7.5 2 = 1.5
mod -7.5 2 = 0.5
mod 7.5,-1 -2 = -0.5,-1
mod 3 0 = 0
min 1,5 3 = 1,3
min i-4 i3 = i-4
max 1,5 3 = 3,5
max i-4 i3 = i3
clamp -1,0.25,9 0 1 = 0,0.25,1
clamp 5 3 1 = 1
clamp i9 i1 i4 = i4
saturate -0.5,0.5,1.5 = 0,0.5,1
mix 2,4 4,8 0.25 = 2.5,5
mix 2 4 1.5 = 5
step 1 0.5,1,2 = 0,1,1
smoothstep 0 2 -1,1,0.5,3 = 0,0.5,0.15625,1
smoothstep 1 1 0.5,1,2 = 0,1,1
smoothstep 2 0 0.5 = 0.84375
abs -2,2,-0 = 2,2,0
abs i-7 = i7
abs i-2147483648 = i-2147483648
sign -3,0,0.5 = -1,0,1
filter_width 3,-4 = 0,0
floor -1.5,1.5,2 = -2,1,2
ceil -1.5,1.5,2 = -1,2,2
round 0.5,1.5,2.5,-0.5 = 0,2,2,-0
fract 1.75,-0.25,2 = 0.75,0.75,0
fract -1e-20 = 0.99999994
sqrt 9,0,-4 = 3,0,0
inverse_sqrt 4,0,-4 = 0.5,0,0
inverse_sqrt 1e-40 = 9.223372036854775808e18
exp 0,1 = 1,2.718281828459045
exp 1000 = 1.6516362549940018e38
exp -1000 = 0
exp2 3,-1 = 8,0.5
exp2 1000 = 1.7014118346046923e38
log 1,2.718281828459045 = 0,1
log 0,-5 = -87.33654475055310,-87.33654475055310
log2 8,0.5 = 3,-1
log2 0,-5 = -126,-126
pow 2,3,9 10,2,0.5 = 1024,9,3
pow 0,0,-8,-8 0,2,3,0 = 1,0,0,1
pow 0 -1 = 0
pow 10 100 = 1.7014118346046923e38
sin 0,0.5,-0.5 = 0,0.479425538604203,-0.479425538604203
cos 0,0.5,3 = 1,0.8775825618903728,-0.9899924966004454
tan 0.5 = 0.5463024898437905
asin 0.5,2,-2 = 0.5235987755982989,1.5707963267948966,-1.5707963267948966
acos 0.5,2,-2 = 1.0471975511965979,0,3.141592653589793
atan 1,-2 = 0.7853981633974483,-1.1071487177940904
atan2 1,-1,0 -1,-1,0 = 2.356194490192345,-2.356194490192345,0
srgb_decode 0.02,0.5,1,-1 = 0.0015479876160990713,0.21404114048223255,1,-0.07739938080495357
dot 1,2,3 4,-5,6 = 12
dot 1,2 3,4 = 11
length 2,3,6 = 7
length 0,0,0,0 = 0
distance 1,1,1 3,4,7 = 7
normalize 3,0,4 = 0.6,0,0.8
normalize 0,0,0 = 0,0,0
normalize 1e-20,0 = 0,0
reflect 1,-2,0 0,1,0 = 1,2,0
cross 1,2,3 4,5,7 = -1,5,-3
max_component -1,-5,-2 = -1
min_component 4,9,3 = 3
luminance 1,0,0 = 0.2126
luminance 1,1,1 = 1
select t 1,2,3 4,5,6 = 1,2,3
select f 1,2,3 4,5,6 = 4,5,6
select f i1 i2 = i2
select t f t = f
lt 1 2 = t
lt 2 2 = f
lt i-1 i0 = t
le 2 2 = t
le i3 i2 = f
gt 2 1 = t
gt i2 i2 = f
ge 2 2 = t
ge i1 i2 = f
eq 0 -0 = t
eq i1 i2 = f
eq t t = t
ne 0 1 = t
ne i2 i2 = f
ne t f = t
and t f = f
and t t = t
or t f = t
or f f = f
not t = f
not f = t
bit_and i12 i10 = i8
bit_or i12 i10 = i14
bit_xor i12 i-1 = i-13
shift_left i1 i31 = i-2147483648
shift_left i1 i33 = i2
shift_right i-8 i1 = i-4
shift_right i8 i33 = i4
unsigned_shift_right i-8 i1 = i2147483644
unsigned_shift_right i-8 i33 = i2147483644
unsigned_shift_right i-1 i31 = i1
unsigned_div i-1 i2 = i2147483647
unsigned_div i5 i-1 = i0
unsigned_div i7 i0 = i0
unsigned_rem i-1 i10 = i5
unsigned_rem i7 i0 = i0
to_float i-3 = -3
unsigned_to_float i-2147483648 = 2147483648
to_unsigned 2.9 = i2
to_unsigned -2.9 = i0
to_unsigned 3e9 = i-1294967296
to_unsigned 1e20 = i-256
to_int 2.9 = i2
to_int -2.9 = i-2
to_int 1e20 = i2147483520
to_int -1e20 = i-2147483648
unit_float i-1 = 0.999999940395355224609375
unit_float i256 = 5.9604644775390625e-8
image i0 0.5,0.5 = 0.5,0.5,0.5
image_data i0 0.5,0.5 = 0.5,0.5,0.5,0.5
image_alpha i0 0.5,0.5 = 0.5
image i0 0.5,0.5 i1 = 0.5,0.5,0.5
image_data i0 0.5,0.5,0.1,0.1 i0 = 0.5,0.5,0.5,0.5
image_alpha i0 0.5,0.5 i7 = 0.5
";

/// A row that was read: op, operands, result.
type Meaning<F> = (Op, Vec<Value<F>>, Value<F>);

fn value<F: Real>(text: &str) -> Value<F> {
    match text {
        "t" => Value::Bool(true),
        "f" => Value::Bool(false),
        _ => match text.strip_prefix('i') {
            Some(int) => Value::Int(int.parse().expect("an int")),
            None => {
                let parts = text.split(',').map(|x| x.parse().expect("a float"));
                Value::vector(&parts.collect::<Vec<f64>>())
            }
        },
    }
}

fn types<F: Real>(values: &[Value<F>]) -> Vec<Type> {
    values.iter().filter_map(Value::plain_type).collect()
}

/// Ops of one name differ in what they take.
fn named<F: Real>(name: &str, args: &[Value<F>]) -> Op {
    let fits = |op: &Op| op.info().text == name && op.result(&types(args)).is_some();
    let found = Op::ALL.iter().copied().find(fits);
    found.unwrap_or_else(|| panic!("no op `{name}` takes {args:?}"))
}

fn meanings<F: Real>() -> Vec<Meaning<F>> {
    let row = |line: &str| {
        let (left, right) = line.split_once(" = ").expect("an equation");
        let mut words = left.split(' ');
        let name = words.next().expect("an op");
        let args: Vec<Value<F>> = words.map(value).collect();
        (named(name, &args), args, value(right))
    };
    MEANINGS
        .lines()
        .filter(|l| !l.is_empty())
        .map(row)
        .collect()
}

/// Is it the value expected, up to a few roundings of the precision?
fn is<F: Real>(found: &Value<F>, expected: &Value<F>) -> bool {
    let (a, b) = (found.to_f64(), expected.to_f64());
    let epsilon = if size_of::<F>() == 4 { 2.4e-7 } else { 1e-14 };
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= epsilon * b.abs();
    found.plain_type() == expected.plain_type()
        && found.as_int() == expected.as_int()
        && found.as_bool() == expected.as_bool()
        && a.iter().zip(&b).all(near)
}

/// Runs an op as the whole of a function.
fn run<F: Real>(op: Op, args: &[Value<F>]) -> Value<F> {
    let params = types(args).into_iter().map(|ty| Local {
        name: "x".into(),
        ty,
    });
    let mut b = Builder::new("f", params.collect(), HERE);
    let ids: Vec<_> = (0..args.len()).map(|i| b.param(i, HERE)).collect();
    let value = b.op(op, &ids, HERE);
    let (f, module) = (b.finish(value), Module::default());
    let mut run = Interpreter::<F>::new(&module, 10);
    run.run(&f, args.to_vec()).expect("enough fuel")
}

fn check<F: Real>() {
    for (op, args, expected) in meanings::<F>() {
        let bits = 8 * size_of::<F>();
        let found = run(op, &args);
        assert!(
            is(&found, &expected),
            "{op:?} {args:?} in f{bits}: {found:?}, expected {expected:?}"
        );
        let folded = ops::evaluate(op, &args);
        assert!(
            is(&folded, &found),
            "{op:?} {args:?}: {folded:?} outside functions"
        );
    }
}

#[test]
fn every_op_gives_what_the_table_says() {
    check::<f64>();
    check::<f32>();
}

#[test]
fn every_op_is_in_the_table() {
    let known = meanings::<f64>();
    for &op in Op::ALL {
        let here = known.iter().any(|(other, ..)| *other == op);
        // Hashes have a test of their own, matrices no literal.
        let elsewhere = matches!(op, Op::Hash1 | Op::Hash2 | Op::Hash3 | Op::MatVec);
        assert!(here != elsewhere, "{op:?}");
    }
}

#[test]
fn single_precision_rounds_every_operation() {
    let third = run::<f32>(Op::Div, &[value("1"), value("3")]).to_f64()[0];
    assert_eq!(third, f64::from(1.0f32 / 3.0));
    // A sum of products, rounded at each step: the small product is lost.
    let args = [value("4096,1,-4096"), value("4096,1,4096")];
    assert_eq!(run::<f32>(Op::Dot, &args).to_f64(), [0.0]);
    assert_eq!(
        run::<f64>(Op::Dot, &args.map(|a: Value<f32>| wide(&a))).to_f64(),
        [1.0]
    );
}

fn wide(v: &Value<f32>) -> Value<f64> {
    Value::vector(&v.to_f64())
}

/// Numbers at which ops are special, or overflow.
const EDGES: [f64; 12] = [
    0.0, -0.0, 1.0, -1.0, 0.5, 2.0, -2.5, 1e-30, -1e-30, 1e30, -3e38, 3e38,
];
const EDGE_INTS: [i32; 7] = [0, 1, -1, 2, 13, i32::MAX, i32::MIN];

/// The constants of a type that are tried; vectors have an edge in one component.
fn edges(ty: Type) -> Vec<Const> {
    match ty {
        Type::Bool => [false, true].map(Const::Bool).to_vec(),
        Type::Int => EDGE_INTS.map(Const::Int).to_vec(),
        Type::Float => EDGES.map(|x| Const::Float(vec![x])).to_vec(),
        _ => EDGES.map(|x| Const::Float(vec![0.25, x, -1.5])).to_vec(),
    }
}

/// Every choice of one element of each list.
fn products(lists: &[Vec<Const>]) -> Vec<Vec<Const>> {
    lists.iter().fold(vec![Vec::new()], |all, list| {
        let longer = |c: &Vec<Const>| {
            list.iter()
                .map(|x| [&c[..], std::slice::from_ref(x)].concat())
                .collect()
        };
        all.iter().flat_map(|c| -> Vec<_> { longer(c) }).collect()
    })
}

/// What the builder makes of an op on constants.
fn folded(op: Op, args: &[Const]) -> Option<Const> {
    let mut b = Builder::new("f", Vec::new(), HERE);
    let constants = args.iter().map(|c| b.constant(c.clone(), HERE));
    let ids: Vec<_> = constants.collect();
    let value = b.op(op, &ids, HERE);
    b.finish(value).constant(value).cloned()
}

/// A constant is what the op gives at run time, within the range of single precision.
#[test]
fn constants_fold_to_what_every_op_gives() {
    const MAX: f64 = f32::MAX as f64;
    let mut tried = 0;
    for &op in Op::ALL {
        let types = [Type::Bool, Type::Int, Type::Float, Type::Vec3];
        let lists = (1..=3).flat_map(|n| products(&vec![types.map(marker).to_vec(); n]));
        for list in lists {
            let types: Vec<Type> = list.iter().map(const_type).collect();
            if op.result(&types).is_none() {
                continue;
            }
            for args in products(&types.iter().map(|ty| edges(*ty)).collect::<Vec<_>>()) {
                let Some(found) = folded(op, &args) else {
                    continue;
                };
                let values: Vec<Value<f64>> = args.iter().map(Value::constant).collect();
                let expected = match run(op, &values).to_const() {
                    Some(Const::Float(v)) => {
                        Const::Float(v.into_iter().map(|x| x.clamp(-MAX, MAX)).collect())
                    }
                    Some(other) => other,
                    None => panic!("{op:?} {args:?} is no constant at run time"),
                };
                assert_eq!(found, expected, "{op:?} {args:?}");
                tried += 1;
            }
        }
    }
    assert!(tried > 20_000, "{tried} foldings");
}

/// Components of a constant, and constants put together, are what they are of a value that is not known.
#[test]
fn parts_of_constants_are_those_of_values() {
    let numbers = [1.0, 2.0, 3.0, 4.0];
    let build = |known: bool, width: usize, picked: &[u8], times: usize| {
        let whole = Const::Float(numbers[..width].to_vec());
        let param = Local {
            name: "x".into(),
            ty: Type::of_width(width),
        };
        let mut b = Builder::new("f", vec![param], HERE);
        let value = if known {
            b.constant(whole.clone(), HERE)
        } else {
            b.param(0, HERE)
        };
        let part = b.swizzle(value, picked, HERE);
        let ty = Type::of_width(picked.len() * times);
        let result = match times {
            1 => part,
            _ => {
                // Of two parts the other way round, so that their order is seen.
                let turned: Vec<u8> = picked.iter().rev().copied().collect();
                let other = b.swizzle(value, &turned, HERE);
                b.compose(ty, &[part, other], HERE)
            }
        };
        let f = b.finish(result);
        assert_eq!(f.constant(f.value).is_some(), known, "{picked:?}");
        let module = Module::default();
        let mut run = Interpreter::<f64>::new(&module, 100);
        let value = run.run(&f, vec![Value::constant(&whole)]);
        value.expect("enough fuel").to_f64()
    };
    for width in 2..=4u8 {
        let all = (0..width).flat_map(|a| (0..width).map(move |b| [a, b]));
        for pair in all {
            for (picked, times) in [(&pair[..1], 1), (&pair[..], 1), (&pair[..], 2)] {
                let [known, unknown] =
                    [true, false].map(|known| build(known, width.into(), picked, times));
                assert_eq!(known, unknown, "{picked:?} of {width}, {times} times");
                assert_eq!(known[0], f64::from(picked[0]) + 1.0);
            }
        }
    }
}

/// Some constant of a type.
fn marker(ty: Type) -> Const {
    edges(ty).swap_remove(0)
}

/// By-component ops treat every component alike, and floats as vectors of equal components.
#[test]
fn components_do_not_mix() {
    let parts = [0.25, -3.0, 0.0, 7.5];
    for &op in Op::ALL {
        let (Shape::Float(n) | Shape::Number(n)) = op.info().shape else {
            continue;
        };
        for width in 1..=4 {
            // Every choice of which operands are vectors, at least one.
            for vectors in 1..1u32 << n {
                let operand = |k: usize, c: usize| match vectors >> k & 1 {
                    1 => parts[(c + k) % 4],
                    _ => parts[k],
                };
                let args: Vec<Value<f64>> = (0..n)
                    .map(|k| {
                        let all: Vec<f64> = (0..width).map(|c| operand(k, c)).collect();
                        Value::vector(if vectors >> k & 1 == 1 {
                            &all
                        } else {
                            &all[..1]
                        })
                    })
                    .collect();
                let whole = run(op, &args).to_f64();
                let single = (0..width).map(|c| {
                    let args: Vec<Value<f64>> =
                        (0..n).map(|k| Value::float(operand(k, c))).collect();
                    run(op, &args).to_f64()[0]
                });
                assert_eq!(whole, single.collect::<Vec<f64>>(), "{op:?} {args:?}");
            }
        }
    }
}

/// The function of Jarzynski and Olano 2020, written down anew.
fn pcg(input: u32) -> u32 {
    let state = u64::from(input) * 747_796_405 + 2_891_336_453;
    let state = state as u32;
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

#[test]
fn hashes_chain() {
    let ints = [3i32, -7, 1_000_000];
    let chain = |n: usize| {
        ints[1..n]
            .iter()
            .fold(pcg(3), |h, i| pcg(h.wrapping_add(*i as u32))) as i32
    };
    for (n, op) in [(1, Op::Hash1), (2, Op::Hash2), (3, Op::Hash3)] {
        let args: Vec<Value<f64>> = ints[..n].iter().map(|i| Value::Int(*i)).collect();
        assert_eq!(run(op, &args).as_int(), chain(n), "{op:?}");
    }
}
