//! Widths through branches, loops, variables, structs and calls: against differences of the same code
//! without `filter_width`.

use impasto_compiler::ir::interp::{Interpreter, TextureRequest};
use impasto_compiler::ir::value::Value;

use crate::common::program;

/// How position and uv change along both directions of the footprint.
const AXES: [([f64; 3], [f64; 2]); 2] = [
    ([0.3, -0.1, 0.2], [0.05, -0.4]),
    ([-0.2, 0.25, 0.4], [0.3, 0.15]),
];

/// What `x` is in a material with these statements, at a point moved by `s` along the first and `t`
/// along the second direction.
fn evaluate(items: &str, statements: &str, x: &str, [s, t]: [f64; 2]) -> Vec<f64> {
    let text = format!(
        "use std::edf::uniform;\n{items}\nmaterial m {{ {statements}\n emission = uniform({BIAS:.1} + color({x})); }}"
    );
    let program = program(&text);
    let moved = |start: &[f64], x: &[f64], y: &[f64]| -> Vec<f64> {
        (0..start.len())
            .map(|c| start[c] + s * x[c] + t * y[c])
            .collect()
    };
    let [(px, ux), (py, uy)] = AXES;
    let up = || Value::vector(&[0.0, 0.0, 1.0]);
    let point = Value::Struct(vec![
        Value::vector(&moved(&[0.31, -0.72, 0.53], &px, &py)),
        up(),
        up(),
        Value::vector(&[1.0, 0.0, 0.0]),
        Value::vector(&moved(&[0.37, 0.64], &ux, &uy)),
        Value::float(1.0),
        Value::vector(&px),
        Value::vector(&py),
        Value::vector(&ux),
        Value::vector(&uy),
    ]);
    let picture = |of: &TextureRequest| {
        let [u, v] = of.uv;
        [u * u, v, u * v, 1.0]
    };
    let emission = program.compiled()[0].emission.as_ref().expect("emits");
    Interpreter::<f64>::new(program.ir(), 1 << 22)
        .with_texture(&picture)
        .run(emission, vec![point, up()])
        .expect("ends")
        .to_f64()
        .iter()
        .map(|x| x - BIAS)
        .collect()
}

/// Added to what is asked for, since no emission is below zero.
const BIAS: f64 = 256.0;

/// The value of `x`, a vec3, has the width that differences say.
fn check(items: &str, statements: &str, x: &str) {
    const STEP: f64 = 1e-5;
    let at = |s, t| evaluate(items, statements, x, [s, t]);
    let slope = |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b) / (2.0 * STEP))
            .collect()
    };
    let dx = slope(at(STEP, 0.0), at(-STEP, 0.0));
    let dy = slope(at(0.0, STEP), at(0.0, -STEP));
    let found = evaluate(items, statements, &format!("filter_width({x})"), [0.0; 2]);
    for c in 0..3 {
        let expected = dx[c].hypot(dy[c]);
        let off = (found[c] - expected).abs();
        assert!(
            off < 1e-6 * (1.0 + expected),
            "{statements} {x}: {found:?}, expected {dx:?} {dy:?}"
        );
    }
    assert!(
        found.iter().any(|w| *w > 1e-3),
        "{statements} {x}: {found:?}"
    );
}

#[test]
fn inputs_have_the_widths_that_they_are_given() {
    let width = |x: &str| evaluate("", "", &format!("vec3(filter_width({x}))"), [0.0; 2]);
    let [(px, ux), (py, uy)] = AXES;
    let expected = [0, 1, 2].map(|c| px[c].hypot(py[c]));
    for (found, expected) in width("position").iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-12,
            "{found}, expected {expected}"
        );
    }
    assert!((width("uv.y")[0] - ux[1].hypot(uy[1])).abs() < 1e-12);
    // Directions are constant over a footprint.
    assert_eq!(width("normal.x * 3.0"), [0.0; 3]);
    assert_eq!(width("vec3(tangent)"), [0.0; 3]);
    assert_eq!(width("exterior_ior"), [0.0; 3]);
}

#[test]
fn widths_go_through_expressions() {
    check("", "", "vec3(8.0 * uv, uv.x * uv.y)");
    check("", "", "vec3(position.zyx * position.y / (2.0 + uv.x))");
    check(
        "",
        "let m = mat3(vec3(position), vec3(uv, 0.0), vec3(1.0, 2.0, uv.x));",
        "vec3(m * position)",
    );
    check(
        "",
        "",
        "vec3(length(position), distance(position, point(uv, 0.0)), sin(uv.x / 0.1))",
    );
}

#[test]
fn widths_go_through_branches() {
    check(
        "",
        "let a = if uv.x < 0.5 { uv * uv } else { vec2(0.0) };",
        "vec3(a, 0.0)",
    );
    check(
        "",
        "let a = if uv.x > 0.5 { uv * uv } else { 3.0 * uv };",
        "vec3(a, 1.0)",
    );
    check(
        "",
        "var a = vec3(1.0); if uv.y > 0.1 { a = vec3(position); if uv.x > 0.1 { a.y = uv.x * a.z; } } else { a.x = uv.x; }",
        "a",
    );
}

/// A variable that is given a constant again has no width, whatever it had.
#[test]
fn constants_end_what_variables_had() {
    let text = "var a = uv.x; if uv.y > 0.1 { a = 2.0; }";
    let found = evaluate(
        "",
        text,
        "vec3(filter_width(a), filter_width(a + uv.x), 0.0)",
        [0.0; 2],
    );
    assert_eq!(found[0], 0.0);
    assert!(found[1] > 0.1);
    let part = evaluate(
        "",
        "var a = uv; a.y = 1.0;",
        "vec3(filter_width(a), 0.0)",
        [0.0; 2],
    );
    assert!(part[0] > 0.0 && part[1] == 0.0, "{part:?}");
}

#[test]
fn widths_go_through_loops() {
    check(
        "",
        "var a = uv.x; for i in 0 .. 4 { a = a * uv.y + float(i) * a; }",
        "vec3(a)",
    );
    check(
        "",
        "var a = vec3(position); var n = 0; while a.x < 40.0 limit 30 { a = 1.3 * a + a.yzx * a.x; n += 1; if n > 5 { break; } if a.y < 0.0 { continue; } a.z += uv.x; }",
        "a",
    );
    // What a turn leaves is there in the next.
    check(
        "",
        "var a = uv.x; var b = 0.0; for i in 0 .. 3 { let old = b; b = a; a = a * uv.y + old; }",
        "vec3(a, b, 0.0)",
    );
}

#[test]
fn widths_go_through_structs() {
    let items = "struct Pair { first: vec2, second: float, id: int }
        fn swap(p: Pair) -> Pair = Pair(p.first.yx * p.second, p.first.x, p.id + 1);";
    check(
        items,
        "let a = swap(swap(Pair(uv, position.x, 3)));",
        "vec3(a.first, a.second)",
    );
    check(
        items,
        "var a = Pair(uv, 1.0, 0); for i in 0 .. 3 { a = swap(a); }",
        "vec3(a.first, a.second)",
    );
}

#[test]
fn widths_go_through_calls() {
    let items = "
        fn inner(x: float, n: int) -> float {
            var sum = 0.0;
            for i in 0 .. 5 {
                if i < n { sum += x * x + 0.3 * sum; } else { sum -= 0.1 * x; }
            }
            sum
        }
        fn outer(p: vec2, n: int) -> vec2 = vec2(inner(p.x, n), inner(p.y * p.x, 2));";
    check(items, "let a = outer(uv, 3);", "vec3(a, 0.0)");
    // In a loop a callee's variables begin anew.
    check(
        items,
        "var a = uv; for i in 0 .. 3 { a = 2.0 * outer(a, i); }",
        "vec3(a, 0.0)",
    );
    check(
        "use std::noise::perlin;",
        "",
        "vec3(perlin(3.0 * position), 0.0, 0.0)",
    );
}

/// A picture has no derivative; what counts is by how much it differs a step further.
#[test]
fn pictures_vary_by_what_they_are_at_the_end_of_a_step() {
    let item = "const NONE: float = 0.0;";
    let statements = "let a = image(\"picture.png\", uv);";
    let found = evaluate(item, statements, "filter_width(vec3(a))", [0.0; 2]);
    let at = |s, t| evaluate(item, statements, "vec3(a)", [s, t]);
    let (here, x, y) = (at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0));
    for c in 0..3 {
        let expected = (x[c] - here[c]).hypot(y[c] - here[c]);
        assert!(
            (found[c] - expected).abs() < 1e-9,
            "{found:?}, expected {expected}"
        );
        assert!(expected > 0.01);
    }
}

/// An instance's values do not vary over the surface, known or not before rendering.
#[test]
fn parameters_have_no_width() {
    let text = "let a = uv.x;";
    let found = evaluate(
        "",
        text,
        "vec3(filter_width(2.0), filter_width(floor(8.0 * a)), 0.0)",
        [0.0; 2],
    );
    assert_eq!(found, [0.0; 3]);
}
