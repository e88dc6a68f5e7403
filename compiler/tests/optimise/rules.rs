//! Every rule of algebra, one by one: that it is applied, and that it gives the same bits in single
//! precision, or as near as it says. Expressions are written in Impasto, before and after.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Function, Module, Type, print};
use impasto_compiler::passes::pass;
use impasto_compiler::{MemoryLoader, passes};

use super::corpus::{Numbers, checked};

/// What a rule promises of its result in single precision.
#[derive(Clone, Copy, Debug)]
enum Promise {
    /// The same, but for the sign of zero.
    Bits,
    /// Relative to the result, or to one where that is less: what it replaces rounds that much.
    Within(f64),
}
use Promise::{Bits, Within};

/// Type, expression, what it becomes, promise.
type Rule = (&'static str, &'static str, &'static str, Promise);

const RULES: &[Rule] = &[
    // Sums and products
    ("float", "x + 0.0", "x", Bits),
    ("float", "0.0 + x", "x", Bits),
    ("vec3", "v + 0.0", "v", Bits),
    ("int", "i + 0", "i", Bits),
    ("float", "x - 0.0", "x", Bits),
    ("float", "x - x", "0.0", Bits),
    ("int", "i - i", "0", Bits),
    ("float", "0.0 - x", "-x", Bits),
    ("float", "-(-x)", "x", Bits),
    ("float", "x + -y", "x - y", Bits),
    ("float", "-x + y", "y - x", Bits),
    ("float", "x - -y", "x + y", Bits),
    ("float", "x * 1.0", "x", Bits),
    ("float", "1.0 * x", "x", Bits),
    ("vec3", "v * vec3(1.0)", "v", Bits),
    ("int", "i * 1", "i", Bits),
    ("float", "x * 0.0", "0.0", Bits),
    ("vec3", "0.0 * v", "vec3(0.0)", Bits),
    ("int", "i * 0", "0", Bits),
    ("float", "x * -1.0", "-x", Bits),
    ("float", "-x * -y", "x * y", Bits),
    ("float", "x / 1.0", "x", Bits),
    ("float", "x / -1.0", "-x", Bits),
    ("float", "x / 4.0", "x * 0.25", Bits),
    ("float", "x / -0.125", "x * -8.0", Bits),
    ("vec3", "v / 2.0", "v * 0.5", Bits),
    ("float", "0.0 / x", "0.0", Bits),
    ("float", "x / 0.0", "0.0", Bits),
    ("int", "i / 1", "i", Bits),
    ("int", "i / 0", "0", Bits),
    ("int", "i / -1", "-i", Bits),
    ("float", "mix(x, y, 0.0)", "x", Bits),
    ("float", "mix(x, y, 1.0)", "y", Bits),
    ("vec3", "mix(v, w, 0.0)", "v", Bits),
    ("float", "mix(x, x, saturate(y))", "x", Within(1e-6)),
    ("float", "mix(0.0, x, saturate(y))", "x * saturate(y)", Bits),
    // Those that round differently must stay
    ("float", "x / 3.0", "x / 3.0", Bits),
    ("float", "x / x", "x / x", Bits),
    ("float", "x + y - y", "x + y - y", Bits),
    ("float", "x * 3.0 * 5.0", "x * 3.0 * 5.0", Bits),
    // Limits
    ("float", "saturate(saturate(x))", "saturate(x)", Bits),
    ("float", "saturate(max(x, 0.0))", "saturate(x)", Bits),
    ("float", "saturate(max(x, -1.0))", "saturate(x)", Bits),
    ("float", "saturate(min(x, 2.0))", "saturate(x)", Bits),
    (
        "float",
        "saturate(max(x, 0.5))",
        "saturate(max(x, 0.5))",
        Bits,
    ),
    ("float", "clamp(x, 0.0, 1.0)", "saturate(x)", Bits),
    ("float", "clamp(abs(x), 0.0, 2.0)", "min(abs(x), 2.0)", Bits),
    (
        "float",
        "clamp(saturate(x), 0.5, 2.0)",
        "max(saturate(x), 0.5)",
        Bits,
    ),
    (
        "float",
        "clamp(saturate(x), -1.0, 1.0)",
        "saturate(x)",
        Bits,
    ),
    (
        "float",
        "clamp(clamp(x, -2.0, 0.5), -1.0, 3.0)",
        "clamp(x, -1.0, 0.5)",
        Bits,
    ),
    ("float", "clamp(x, 2.0, 1.0)", "clamp(x, 2.0, 1.0)", Bits),
    (
        "float",
        "clamp(saturate(x), 3.0, 2.0)",
        "clamp(saturate(x), 3.0, 2.0)",
        Bits,
    ),
    ("float", "max(abs(x), 0.0)", "abs(x)", Bits),
    ("float", "max(x, x)", "x", Bits),
    ("float", "min(max(x, 0.0), -1.0)", "-1.0", Bits),
    ("float", "max(max(x, 0.25), 0.5)", "max(x, 0.5)", Bits),
    ("float", "min(2.0, min(x, 3.0))", "min(x, 2.0)", Bits),
    ("float", "min(saturate(x), 1.0)", "saturate(x)", Bits),
    (
        "float",
        "max(1.0 - saturate(x), 0.0)",
        "1.0 - saturate(x)",
        Bits,
    ),
    ("float", "max(x - 1.0, 0.0)", "max(x - 1.0, 0.0)", Bits),
    ("float", "abs(abs(x))", "abs(x)", Bits),
    ("float", "abs(-x)", "abs(x)", Bits),
    ("float", "abs(x * x)", "x * x", Bits),
    ("float", "abs(x * y)", "abs(x * y)", Bits),
    ("float", "abs(sqrt(x) * exp(y))", "sqrt(x) * exp(y)", Bits),
    (
        "int",
        "clamp(clamp(i, 0, 9), 1, 99)",
        "clamp(i, 1, 9)",
        Bits,
    ),
    // Choices
    ("bool", "!!b", "b", Bits),
    ("bool", "b && true", "b", Bits),
    ("bool", "b && false", "false", Bits),
    ("bool", "b || true", "true", Bits),
    ("bool", "false || b", "b", Bits),
    ("bool", "b && b", "b", Bits),
    ("bool", "b == true", "b", Bits),
    ("bool", "b != true", "!b", Bits),
    ("bool", "x < x", "false", Bits),
    ("bool", "x <= x", "true", Bits),
    ("bool", "x == x", "true", Bits),
    ("bool", "abs(x) < 0.0", "false", Bits),
    ("bool", "saturate(x) >= 0.0", "true", Bits),
    ("bool", "saturate(x) > 1.0", "false", Bits),
    ("bool", "saturate(x) > 0.0", "saturate(x) > 0.0", Bits),
    ("bool", "saturate(x) == 2.0", "false", Bits),
    ("float", "select(b, x, x)", "x", Bits),
    ("bool", "select(b, true, false)", "b", Bits),
    ("bool", "select(b, false, true)", "!b", Bits),
    ("float", "select(!b, x, y)", "select(b, y, x)", Bits),
    (
        "float",
        "select(b, select(b, x, y), 0.0)",
        "select(b, x, 0.0)",
        Bits,
    ),
    (
        "float",
        "select(b, 0.0, select(b, x, y))",
        "select(b, 0.0, y)",
        Bits,
    ),
    ("float", "if b { x } else { y }", "select(b, x, y)", Bits),
    ("float", "if b { x } else { x }", "x", Bits),
    (
        "float",
        "if b { if b { x * y } else { 0.0 } } else { y }",
        "if b { x * y } else { y }",
        Bits,
    ),
    ("bool", "if !b { c } else { c && b }", "c", Bits),
    // Powers and roots
    ("float", "pow(x, 0.0)", "1.0", Bits),
    ("float", "pow(1.0, x)", "1.0", Bits),
    ("float", "pow(x, 1.0)", "max(x, 0.0)", Within(3e-7)),
    ("float", "pow(x, 0.5)", "sqrt(x)", Within(3e-7)),
    (
        "float",
        "pow(saturate(x), 2.0)",
        "saturate(x) * saturate(x)",
        Within(3e-7),
    ),
    (
        "float",
        "pow(x, 2.0)",
        "clamp(x, 0.0, 13043817825332782212.0) * clamp(x, 0.0, 13043817825332782212.0)",
        Within(3e-7),
    ),
    ("float", "pow(x, 3.0)", "pow(x, 3.0)", Bits),
    ("float", "sqrt(x * x)", "abs(x)", Within(3e-7)),
    ("float", "sqrt(x) * sqrt(x)", "max(x, 0.0)", Within(3e-7)),
    // Vectors
    (
        "vec3",
        "normalize(normalize(v))",
        "normalize(v)",
        Within(3e-7),
    ),
    ("float", "dot(v, vec3(0.0, 1.0, 0.0))", "v.y", Bits),
    ("float", "dot(vec3(0.0, 0.0, 1.0), v)", "v.z", Bits),
    ("float", "dot(v, vec3(0.0))", "0.0", Bits),
    ("vec3", "cross(v, v)", "vec3(0.0)", Bits),
    ("float", "max_component(vec3(x))", "x", Bits),
    ("vec3", "vec3(x) * v", "x * v", Bits),
    ("vec3", "vec3(v.x, v.y, v.z)", "v", Bits),
    ("float", "vec3(x, y, x).y", "y", Bits),
    ("vec2", "v.zy.yx", "v.yz", Bits),
];

/// Functions of the expressions `of` each rule, in order.
fn functions(of: impl Fn(&Rule) -> &'static str) -> Module {
    let text: String = RULES
        .iter()
        .enumerate()
        .map(|(i, rule)| {
            let (ty, expression) = (rule.0, of(rule));
            format!(
                "fn rule_{i}(x: float, y: float, v: vec3, w: vec3, b: bool, c: bool, i: int) \
                 -> {ty} {{ {expression} }}\n"
            )
        })
        .collect();
    let mut loader = MemoryLoader::default();
    loader.add("rules.impasto", text);
    checked("rules.impasto", &mut loader).ir
}

fn rule(module: &Module, i: usize) -> &Function {
    let name = format!("rule_{i}");
    module
        .functions
        .iter()
        .find(|f| f.name == name)
        .expect("the rule's function")
}

/// A function after the named passes.
fn after(module: &Module, f: &Function, names: &[&str]) -> Function {
    let mut f = f.clone();
    for name in names {
        let pass = pass(name).expect("a pass");
        pass.run(module, &mut f);
    }
    f
}

/// The passes that show a rule at work: some rules ask whether two operands are one.
const FOUND: [&str; 4] = ["cse", "simplify", "cse", "dead_code"];

#[test]
fn every_rule_is_applied() {
    let (before, wanted) = (functions(|r| r.1), functions(|r| r.2));
    let mut problems = Vec::new();
    for (i, (_, from, to, _)) in RULES.iter().enumerate() {
        let found = after(&before, rule(&before, i), &FOUND);
        let wanted_f = after(&wanted, rule(&wanted, i), &["fold", "cse", "dead_code"]);
        let found = print::function(&before, &found);
        if found != print::function(&wanted, &wanted_f) {
            problems.push(format!("`{from}` is not `{to}` but\n{found}"));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Where functions change, where floats end, and what rounds badly.
const EDGES: [f32; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    2.0,
    -2.0,
    3.0,
    1e-3,
    -1e-3,
    0.999_999_94,
    1.000_000_1,
    1e-30,
    -1e-30,
    1e15,
    -1e15,
    1e-39,
    16_777_217.0,
    f32::MIN_POSITIVE,
    0.1,
];

/// A finite number: an edge, or any bits, but not so large that products overflow.
fn float(n: &mut Numbers) -> f64 {
    if n.bits().is_multiple_of(3) {
        return f64::from(EDGES[(n.bits() % EDGES.len() as u64) as usize]);
    }
    let x = f32::from_bits(n.bits() as u32);
    let fits = x.abs() < 1e18;
    f64::from(if fits {
        x
    } else {
        (n.unit() * 4.0 - 2.0) as f32
    })
}

fn args(n: &mut Numbers) -> Vec<Value<f32>> {
    let mut vector = || Value::vector(&[float(n), float(n), float(n)]);
    let (v, w) = (vector(), vector());
    vec![
        Value::float(float(n)),
        Value::float(float(n)),
        v,
        w,
        Value::Bool(n.bits().is_multiple_of(2)),
        Value::Bool(n.bits().is_multiple_of(2)),
        Value::Int([0, 1, -1, 7, i32::MIN, i32::MAX, n.bits() as i32][(n.bits() % 7) as usize]),
    ]
}

/// All numbers of a value, exactly.
fn numbers(value: &Value<f32>) -> Vec<f64> {
    match value {
        Value::Bool(b) => vec![f64::from(u8::from(*b))],
        Value::Int(i) => vec![f64::from(*i)],
        other => other.to_f64(),
    }
}

fn keeps(promise: Promise, old: f64, new: f64) -> bool {
    match promise {
        Bits => old == new,
        Within(e) => (old - new).abs() <= e * old.abs().max(1.0),
    }
}

#[test]
fn every_rule_keeps_its_promise_in_single_precision() {
    let module = functions(|r| r.1);
    let mut problems = Vec::new();
    for (i, (_, from, _, promise)) in RULES.iter().enumerate() {
        let before = rule(&module, i);
        let simple = after(&module, before, &["simplify"]);
        let mut random = Numbers(i as u64);
        for _ in 0..2000 {
            let args = args(&mut random);
            let run = |f: &Function| {
                let value = Interpreter::<f32>::new(&module, 1000).run(f, args.clone());
                numbers(&value.expect("enough fuel"))
            };
            let (old, new) = (run(before), run(&simple));
            let fails = old.iter().zip(&new).any(|(a, b)| !keeps(*promise, *a, *b));
            if fails {
                problems.push(format!("`{from}` of {args:?} was {old:?}, is {new:?}"));
                break;
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn passes_up_to_one_can_be_run_by_name() {
    let module = functions(|r| r.1);
    let f = rule(&module, 0);
    let mut until = f.clone();
    assert!(passes::run_until(&module, &mut until, "simplify"));
    let by_hand = after(&module, f, &["inline", "fold", "simplify"]);
    assert_eq!(
        print::function(&module, &until),
        print::function(&module, &by_hand)
    );
    assert_ne!(
        print::function(&module, &until),
        print::function(&module, f)
    );
    assert!(!passes::run_until(&module, &mut until, "no_such_pass"));
    assert_eq!(f.params[0].ty, Type::Float);
}
