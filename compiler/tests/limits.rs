//! The worst inputs of 64 KiB that we could think of: each takes less than a second and less than
//! 256 MiB. And long sources of every shape, whose time must not grow with the square of their length.
//! One test alone in its process, since it measures the process's memory.

use std::time::Duration;

use impasto_fuzz::sources::{SHAPES, shape};
use impasto_fuzz::{MAX_INPUT, MAX_TIME, Target, checked_and_formatted, ir, run, source, timed};

/// `part(0)`, `part(1)`, ... as long as they and `rest` fit.
fn fill(rest: usize, part: impl Fn(usize) -> String) -> (String, usize) {
    let (mut out, mut n) = (String::new(), 0);
    loop {
        let next = part(n);
        if out.len() + next.len() + rest > MAX_INPUT {
            return (out, n);
        }
        out += &next;
        n += 1;
    }
}

fn repeated(part: &str, rest: usize) -> String {
    part.repeat((MAX_INPUT - rest) / part.len())
}

/// Sources, each with what it is.
fn sources() -> Vec<(&'static str, String)> {
    let material = |inside: &str| {
        format!("use std::bsdf::diffuse;\nmaterial m {{ {inside} surface = diffuse(0.5); }}")
    };
    let last = |(text, n): (String, usize)| (text, n - 1);
    let mut all = vec![
        (
            "brackets",
            format!("const A: float = {}", repeated("(", 20)),
        ),
        ("pairs", material(&repeated("( ) ", 100))),
        (
            "operators",
            material(&format!("let a = 1.0{};", repeated(" + 1.0", 100))),
        ),
        (
            "signs",
            material(&format!("let a = {}1;", repeated("-", 100))),
        ),
        ("else", material(&repeated("if true {} else ", 100))),
        ("comments", repeated("/*", 0)),
        ("quotes", repeated("\" ", 0)),
        (
            "one name",
            format!("const {}: int = 1;", "a".repeat(60_000)),
        ),
        (
            "one number",
            format!("const A: float = {};", "9".repeat(60_000)),
        ),
        (
            "misspelled names",
            material(&fill(200, |i| format!("let v{i} = noisee{i};")).0),
        ),
        ("unknown imports", repeated("use std::bsdf::difuse;\n", 0)),
        (
            "lets",
            material(&fill(200, |i| format!("let a{i} = {i}.0;")).0),
        ),
        (
            "blocks",
            material(&format!("{}{}", "{".repeat(30_000), "}".repeat(30_000))),
        ),
        (
            "loops in loops",
            material(&fill(200, |i| format!("for i{i} in 0..65536 {{")).0),
        ),
        (
            "loops",
            material(&format!(
                "var x = 0.0; {}",
                fill(300, |i| format!("for i{i} in 0..65536 {{ x += 1.0; }}")).0
            )),
        ),
        (
            "constant loops",
            format!(
                "fn f() -> float {{ var x = 0.0; for i in 0..65536 {{ x += 1.0; }} x }}\n{}",
                fill(400, |i| format!("const C{i}: float = f();\n")).0
            ),
        ),
        (
            "parameters",
            material(&fill(200, |i| format!("param p{i}: float = 1.0;")).0),
        ),
        (
            "arguments",
            format!(
                "fn f({}) -> float = 1.0;",
                fill(100, |i| format!("a{i}: float, ")).0
            ),
        ),
        (
            "fields",
            format!(
                "struct S {{ {} }}",
                fill(100, |i| format!("a{i}: float, ")).0
            ),
        ),
        (
            "materials",
            format!(
                "use std::bsdf::diffuse;\n{}",
                fill(100, |i| format!(
                    "material m{i} {{ surface = diffuse(0.5); }}\n"
                ))
                .0
            ),
        ),
    ];
    let (calls, n) = last(fill(400, |i| match i {
        0 => "fn f0(x: float) -> float = sin(x);\n".into(),
        i => format!("fn f{i}(x: float) -> float = f{}(x);\n", i - 1),
    }));
    let used = material(&format!("let a = f{n}(position.x); let b = color(a);"));
    all.push((
        "a chain of calls",
        calls.clone() + &used.replace("(0.5)", "(b)"),
    ));
    all.push((
        "a chain of constant calls",
        format!("{calls}const A: float = f{n}(1.0);"),
    ));
    let (calls, n) = last(fill(400, |i| match i {
        0 => "fn f0(x: float) -> float = sin(x);\n".into(),
        i => format!("fn f{i}(x: float) -> float = f{0}(x) + f{0}(-x);\n", i - 1),
    }));
    let used = material(&format!("let b = color(f{n}(position.x));"));
    all.push((
        "calls that double",
        calls.clone() + &used.replace("(0.5)", "(b)"),
    ));
    all.push((
        "constant calls that double",
        format!("{calls}const A: float = f{n}(1.0);"),
    ));
    let (structs, n) = last(fill(400, |i| match i {
        0 => "struct S0 { a: float, b: float }\n".into(),
        i => format!("struct S{i} {{ a: S{0}, b: S{0} }}\n", i - 1),
    }));
    all.push((
        "structs that double",
        format!("{structs}fn f(s: S{n}) -> S{n} = s;"),
    ));
    let (lets, n) = last(fill(400, |i| match i {
        0 => "let l0 = diffuse(0.5);\n".into(),
        i => format!("let l{i} = layer(l{0}, l{0});\n", i - 1),
    }));
    let sums = material(&lets).replace("surface = diffuse(0.5)", &format!("surface = l{n}"));
    all.push(("closures that double", sums));
    let (lets, n) = last(fill(400, |i| match i {
        0 => "let l0 = diffuse(0.5);\n".into(),
        i => format!("let l{i} = 0.5 * l{};\n", i - 1),
    }));
    let weights = material(&lets).replace("surface = diffuse(0.5)", &format!("surface = l{n}"));
    all.push(("weights of weights", weights));
    all
}

/// IR, each with what it is.
fn irs() -> Vec<(&'static str, String)> {
    let main = |inside: &str| format!("fn f(x: float) -> float {{ {inside} return x }}");
    let mut all = vec![
        ("blocks", main(&repeated("if true { ", 100))),
        (
            "expressions",
            main(&fill(100, |i| format!("%{i}: float = sin x ")).0),
        ),
        (
            "a chain of expressions",
            main(
                &fill(100, |i| match i {
                    0 => "%0: float = sin x ".into(),
                    i => format!("%{i}: float = sin %{} ", i - 1),
                })
                .0,
            ),
        ),
        (
            "variables",
            main(&fill(100, |i| format!("var @{i}.a: vec4 ")).0),
        ),
        (
            "branches that follow each other",
            main(&format!(
                "var @0.a: float %0: bool = lt x, 1.0 {}",
                repeated("if %0 { @0.a = x } ", 200)
            )),
        ),
        (
            "loops that follow each other",
            main(&format!(
                "var @0.i: int {}",
                repeated("for @0.i in 0 .. 2147483647 { } ", 200)
            )),
        ),
        (
            "loops in loops",
            main(&format!(
                "{}{}",
                "loop limit 4294967295 { } while true { ".repeat(250),
                "} ".repeat(250)
            )),
        ),
        (
            "uniforms",
            "fn f() -> int { uniform $4294967295: int return $4294967295 }".into(),
        ),
    ];
    let last = |(text, n): (String, usize)| (text, n - 1);
    let chain = |body: &str| {
        last(fill(200, |i| match i {
            0 => "fn f0(x: float) -> float { return x } ".into(),
            i => {
                let body = body.replace("callee", &format!("f{}", i - 1));
                format!("fn f{i}(x: float) -> float {{ {body} }} ")
            }
        }))
    };
    all.push((
        "a chain of calls",
        chain("%0: float = call callee(x) return %0").0,
    ));
    all.push((
        "calls that double",
        chain("%0: float = call callee(x) %1: float = call callee(%0) return %1").0,
    ));
    all.push((
        "calls in blocks",
        chain("var @0.y: float if true { if true { %0: float = call callee(x) @0.y = %0 } } %1: float = load @0.y return %1").0,
    ));
    all.push((
        "calls in branches",
        chain("var @0.y: float %2: bool = lt x, 0.5 if %2 { if %2 { %0: float = call callee(x) @0.y = %0 } } %1: float = load @0.y return %1").0,
    ));
    all.push((
        "structs that double",
        fill(100, |i| match i {
            0 => "struct S0 { a: float } ".into(),
            i => format!("struct S{i} {{ a: S{0} b: S{0} }} ", i - 1),
        })
        .0,
    ));
    all
}

#[test]
fn the_worst_inputs_take_little_time_and_memory() {
    let mut problems = Vec::new();
    let targets = [(source as Target, "source", sources()), (ir, "ir", irs())];
    for (target, kind, inputs) in targets {
        for (what, input) in inputs {
            assert!(input.len() <= MAX_INPUT + 200, "{what}: {}", input.len());
            if let Err(failure) = run(target, input.as_bytes()) {
                problems.push(format!("{kind}: {what}: {failure:?}"));
            }
        }
    }
    problems.extend(short_sources());
    problems.extend(COMPARED.iter().filter_map(|name| growth(name)));
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// What is wrong with sources of each shape of a length that takes no time.
fn short_sources() -> Vec<String> {
    let failed = SHAPES.iter().filter_map(|shape| {
        let source = shape.source(4 << 10);
        assert!(source.len() <= 32 << 10, "{}: {}", shape.name, source.len());
        let failure = run(checked_and_formatted, source.as_bytes()).err()?;
        Some(format!("{}: {failure:?}", shape.name))
    });
    failed.collect()
}

/// A shape for each stage whose work once grew with the square of a source: what a longer one takes is
/// compared with what a shorter one takes. `cargo run --release -p impasto-fuzz --bin long all` measures
/// all shapes at the longest that a source may be.
const COMPARED: [&str; 9] = [
    "constant lets",
    "branches",
    "branches on one condition",
    "chains of stores",
    "loops without effect",
    "unread closures",
    "a chain of functions",
    "a chain of functions that grow",
    "a call with many arguments",
];

/// Lengths of sources that are compared, in bytes.
const LENGTHS: [usize; 2] = [64 << 10, 256 << 10];

/// How much longer the longer may take: four times what the shorter does, as it should, and as much for
/// caches and chance; with the square of the length it would be sixteen times.
const MOST_GROWTH: f64 = 8.0;

/// What is wrong with how the time of a shape grows, if anything.
fn growth(name: &str) -> Option<String> {
    let shape = shape(name).expect("the table has it");
    let sources = LENGTHS.map(|bytes| shape.source(bytes));
    let mut least = [Duration::MAX; 2];
    let mut told = None;
    // The least of two, and of more where that is too much: a busy machine only adds.
    for round in 0..6 {
        for (source, least) in sources.iter().zip(&mut least) {
            match timed(checked_and_formatted, source.as_bytes()) {
                Ok(time) => *least = time.min(*least),
                Err(failure) => return Some(format!("{name}: {failure:?}")),
            }
        }
        let [short, long] = least;
        let growth = long.as_secs_f64() / short.as_secs_f64();
        let fine = growth < MOST_GROWTH && long < 2 * MAX_TIME;
        told = (!fine).then(|| format!("{name}: {short:?} grow to {long:?}"));
        if fine && round > 0 {
            break;
        }
    }
    told
}
