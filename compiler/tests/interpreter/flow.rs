//! Control flow, calls and aggregates of the interpreter, its fuel and its counts.

use impasto_compiler::ir::build::Builder;
use impasto_compiler::ir::interp::{Interpreter, OutOfFuel, TextureRequest};
use impasto_compiler::ir::ops::{Counts, Op};
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, ExprKind, Function, FunctionId, Local, Module, Type};
use impasto_compiler::{MemoryLoader, check, diag};

use super::HERE;

pub(super) fn module(text: &str) -> Module {
    let mut files = MemoryLoader::default();
    files.add("t.impasto", text);
    let checked = check("t.impasto", &mut files);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(!diag::has_errors(&checked.diagnostics), "{problems}");
    checked.ir
}

fn id(module: &Module, name: &str) -> FunctionId {
    let found = module.functions.iter().position(|f| f.name == name);
    FunctionId(found.expect("the function") as u32)
}

pub(super) fn call(module: &Module, name: &str, args: Vec<Value<f64>>) -> Value<f64> {
    let mut run = Interpreter::new(module, 1 << 20);
    run.call(id(module, name), args).expect("enough fuel")
}

const LOOPS: &str = "
fn sum_to(n: int) -> int {
    var sum = 0;
    for i in 0 .. min(n, 5000) { sum = sum + i; }
    sum
}
fn odd_until(n: int, last: int) -> int {
    var sum = 0;
    for i in 0 .. min(n, 5000) {
        if i == last { break; }
        if i % 2 == 0 { continue; }
        for j in 0 .. 2 {
            if j == 1 { break; }
            sum = sum + i;
        }
    }
    sum
}
fn halvings(start: float, least: float) -> int {
    var x = start;
    var n = 0;
    while x > least limit 40 {
        x = x / 2.0;
        n = n + 1;
        if n == 30 { break; }
    }
    n
}
fn sign_of(x: float) -> float {
    var s = 0.0;
    if x > 0.0 { s = 1.0; } else if x < 0.0 { s = -1.0; }
    s
}
";

#[test]
fn loops_turn_as_often_as_they_say() {
    let m = module(LOOPS);
    let int = |name: &str, args: &[i32]| {
        call(&m, name, args.iter().map(|i| Value::Int(*i)).collect()).as_int()
    };
    assert_eq!([-3, 0, 1, 10].map(|n| int("sum_to", &[n])), [0, 0, 0, 45]);
    assert_eq!(int("odd_until", &[10, 100]), 1 + 3 + 5 + 7 + 9);
    assert_eq!(int("odd_until", &[10, 6]), 1 + 3 + 5);
    assert_eq!(int("odd_until", &[10, 0]), 0);
}

#[test]
fn while_ends_by_its_test_its_limit_or_a_break() {
    let m = module(LOOPS);
    let halvings = |x: f64, limit: f64| {
        call(&m, "halvings", vec![Value::float(x), Value::float(limit)]).as_int()
    };
    assert_eq!(halvings(8.0, 1.0), 3);
    assert_eq!(halvings(0.5, 1.0), 0);
    assert_eq!(halvings(8.0, 0.0), 30);
    let long = module(&LOOPS.replace("n == 30", "n == 300"));
    let mut run = Interpreter::<f64>::new(&long, 1 << 20);
    let args = vec![Value::float(8.0), Value::float(0.0)];
    let most = run.call(id(&long, "halvings"), args).expect("fuel");
    assert_eq!(most.as_int(), 40);
}

#[test]
fn branches_take_one_side() {
    let m = module(LOOPS);
    let sign = |x: f64| call(&m, "sign_of", vec![Value::float(x)]).to_f64()[0];
    assert_eq!([2.0, -2.0, 0.0].map(sign), [1.0, -1.0, 0.0]);
}

const AGGREGATES: &str = "
struct Inner { v: vec3, n: int }
struct Outer { ok: bool, a: Inner, x: float }
fn make(x: float, n: int) -> Outer {
    Outer(ok: x > 0.0, a: Inner(v: vec3(x, 2.0 * x, 3.0 * x), n: n), x: -x)
}
fn take(o: Outer) -> vec4 { vec4(o.a.v.zx, float(o.a.n), o.x) }
fn twice(x: float) -> vec4 {
    let a = make(x, 7);
    let b = make(10.0 * x, 9);
    let c = take(a);
    c + take(b)
}
fn part(v: vec3) -> vec3 {
    var w = v;
    let before = w;
    w.y = 9.0;
    w + before * 100.0
}
fn columns(a: vec3, b: vec3, c: vec3, v: vec3) -> vec3 { mat3(a, b, c) * v }
";

#[test]
fn structs_are_made_read_and_passed_whole() {
    let m = module(AGGREGATES);
    let made = call(&m, "make", vec![Value::float(2.0), Value::Int(5)]);
    let inner = made.field(1).expect("a struct");
    assert!(made.field(0).is_some_and(Value::as_bool));
    assert_eq!(inner.field(0).map(Value::to_f64), Some(vec![2.0, 4.0, 6.0]));
    assert_eq!(inner.field(1).map(Value::as_int), Some(5));
    assert_eq!(made.field(2).map(Value::to_f64), Some(vec![-2.0]));
    let sum = call(&m, "twice", vec![Value::float(1.0)]);
    assert_eq!(sum.to_f64(), [33.0, 11.0, 16.0, -11.0]);
}

#[test]
fn variables_change_by_component_and_values_do_not() {
    let m = module(AGGREGATES);
    let found = call(&m, "part", vec![Value::vector(&[1.0, 2.0, 3.0])]);
    assert_eq!(found.to_f64(), [101.0, 209.0, 303.0]);
}

#[test]
fn matrices_are_columns() {
    let m = module(AGGREGATES);
    let columns = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]];
    let mut args: Vec<Value<f64>> = columns.iter().map(|c| Value::vector(c)).collect();
    args.push(Value::vector(&[1.0, 10.0, 100.0]));
    assert_eq!(call(&m, "columns", args).to_f64(), [741.0, 852.0, 1063.0]);
}

/// Whole structs and matrices can be chosen too, which no source text says yet.
#[test]
fn select_chooses_whole_structs_and_matrices() {
    let m = module(AGGREGATES);
    let outer = m.functions[id(&m, "make").index()].result;
    let values = |k: f64| call(&m, "make", vec![Value::float(k), Value::Int(k as i32)]);
    let matrix = |k: f64| Value::Mat3([[k, k + 1.0, k + 2.0]; 3]);
    for (ty, a, b) in [
        (outer, values(1.0), values(-2.0)),
        (Type::Mat3, matrix(1.0), matrix(5.0)),
    ] {
        let params = [Type::Bool, ty, ty].map(|ty| Local {
            name: "x".into(),
            ty,
        });
        let mut f = Builder::new("f", params.to_vec(), HERE);
        let ids: Vec<_> = (0..3).map(|i| f.param(i, HERE)).collect();
        let value = f.add(ExprKind::Op(Op::Select, ids), ty, HERE);
        let f = f.finish(value);
        for (taken, expected) in [(true, &a), (false, &b)] {
            let mut run = Interpreter::<f64>::new(&m, 100);
            let args = vec![Value::Bool(taken), a.clone(), b.clone()];
            let found = run.run(&f, args).expect("fuel");
            assert_eq!(format!("{found:?}"), format!("{expected:?}"));
        }
    }
}

/// `(x) -> x + 1` called through `depth` functions, each calling the one before.
fn chain(depth: u32) -> Module {
    let mut m = Module::default();
    for i in 0..depth {
        let param = Local {
            name: "x".into(),
            ty: Type::Float,
        };
        let mut b = Builder::new(format!("f{i}"), vec![param], HERE);
        let x = b.param(0, HERE);
        let value = match i.checked_sub(1) {
            Some(before) => b.call(&m, FunctionId(before), &[x], HERE),
            None => x,
        };
        let one = b.float(1.0, HERE);
        let value = b.op(Op::Add, &[value, one], HERE);
        let f: Function = b.finish(value);
        m.functions.push(f);
    }
    m
}

#[test]
fn deep_calls_need_no_native_stack() {
    let deep = || {
        let m = chain(100_000);
        let mut run = Interpreter::<f64>::new(&m, 1 << 20);
        run.call(FunctionId(99_999), vec![Value::float(0.5)])
    };
    let thread = std::thread::Builder::new().stack_size(64 << 10);
    let value = thread.spawn(deep).expect("a thread").join();
    let value = value.expect("no overflow").expect("enough fuel");
    assert_eq!(value.to_f64(), [100_000.5]);
}

#[test]
fn fuel_ends_what_takes_too_long_and_nothing_else() {
    let m = module(LOOPS);
    let sum = id(&m, "sum_to");
    let mut run = Interpreter::<f64>::new(&m, u64::MAX);
    run.call(sum, vec![Value::Int(50)]).expect("fuel");
    let needed = run.executed();
    // A turn, two loads and an addition; the bound and the result once.
    assert!((200..=204).contains(&needed), "{needed}");
    for (fuel, enough) in [(needed, true), (needed - 1, false), (10, false), (0, false)] {
        let mut run = Interpreter::<f64>::new(&m, fuel);
        let result = run.call(sum, vec![Value::Int(50)]);
        assert_eq!(result.is_ok(), enough, "{fuel}");
        assert!(enough || result.is_err_and(|e| e == OutOfFuel));
    }
    let mut run = Interpreter::<f64>::new(&m, 19_000);
    assert!(run.call(sum, vec![Value::Int(i32::MAX)]).is_err());
    // An empty loop burns fuel as well.
    let idle =
        module("fn idle(n: int) -> int { var k = 0; for i in 0 .. min(n, 5000) { k = 1; } k }");
    let mut run = Interpreter::<f64>::new(&idle, 4_900);
    assert!(
        run.call(id(&idle, "idle"), vec![Value::Int(i32::MAX)])
            .is_err()
    );
}

#[test]
fn work_is_counted_by_class() {
    let text = "
fn inner(v: vec3) -> float { dot(v, v) }
fn outer(v: vec3, n: int) -> float {
    var sum = 0.0;
    for i in 0 .. min(n, 5000) { sum = sum + sqrt(inner(v * 2.0)) * unit_float(hash(i)); }
    sum
}";
    let m = module(text);
    let mut run = Interpreter::<f64>::new(&m, 1 << 20);
    let args = || vec![Value::vector(&[1.0, 2.0, 2.0]), Value::Int(3)];
    run.call(id(&m, "outer"), args()).expect("fuel");
    // The bound; in a turn, v * 2 over three components, a dot of two operations each, a product
    // and a sum.
    let once = Counts {
        alu: 1 + 3 * (3 + 6 + 1 + 1),
        special: 3,
        integer: 3 * (8 + 2),
        texture: 0,
        calls: 3,
        turns: 3,
    };
    assert_eq!(run.counts(), once);
    run.call(id(&m, "outer"), args()).expect("fuel");
    let mut twice = Counts::default();
    twice.add(&once, 2);
    assert_eq!(run.counts(), twice);
}

#[test]
fn parameters_and_textures_come_from_outside() {
    let m = Module::default();
    let mut b = Builder::new("f", Vec::new(), HERE);
    let tint = b.add(ExprKind::MaterialParam(1), Type::Vec3, HERE);
    let slot = b.add(ExprKind::MaterialParam(0), Type::Int, HERE);
    let uv = b.constant(Const::Float(vec![0.25, 0.75]), HERE);
    let texel = b.op(Op::Image, &[slot, uv], HERE);
    let value = b.op(Op::Mul, &[tint, texel], HERE);
    let f = b.finish(value);
    let params = [Const::Int(3), Const::Float(vec![2.0, 3.0, 4.0])];
    let texture = |of: &TextureRequest| {
        assert_eq!((of.texture, of.op), (3, Op::Image));
        assert_eq!((of.width, of.mode), ([0.0; 2], 0));
        [of.uv[0], of.uv[1], 10.0, 99.0]
    };
    let mut run = Interpreter::<f64>::new(&m, 100)
        .with_params(&params)
        .with_texture(&texture);
    let found = run.run(&f, Vec::new()).expect("fuel");
    assert_eq!(found.to_f64(), [0.5, 2.25, 40.0]);
    assert_eq!(run.counts().texture, 1);
    // Other values for the same function.
    let mut run = run.with_params(&[Const::Int(3), Const::Float(vec![1.0; 3])]);
    assert_eq!(
        run.run(&f, Vec::new()).expect("fuel").to_f64(),
        [0.25, 0.75, 10.0]
    );
    let mut bare = Interpreter::<f64>::new(&m, 100).with_params(&params);
    assert_eq!(
        bare.run(&f, Vec::new()).expect("fuel").to_f64(),
        [1.0, 1.5, 2.0]
    );
}
