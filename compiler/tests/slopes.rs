//! `gradient(x)` of values of a material: against the same values, evaluated at the ends of the footprint.

use impasto_compiler::abi::Input;
use impasto_compiler::ir::interp::{Interpreter, TextureRequest};
use impasto_compiler::ir::value::Value;

use crate::common::{codes, program};

type Vector = [f64; 3];

/// The axes of the footprint, at right angles, and how both sets of coordinates and the color change along them.
const AXES: [Vector; 2] = [[0.03, 0.0, -0.04], [0.0, 0.02, 0.0]];
const UV_CHANGES: [[f64; 2]; 2] = [[0.05, -0.01], [0.02, 0.03]];
const UV1_CHANGES: [[f64; 2]; 2] = [[-0.2, 0.1], [0.04, 0.3]];
const COLOR_CHANGES: [Vector; 2] = [[0.1, 0.0, -0.2], [0.0, 0.3, 0.0]];

/// From vectors of the world to those of the object, by columns: a quarter turn about z, and a stretch.
const TO_OBJECT: [Vector; 3] = [[0.0, 2.0, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.0, 4.0]];
const TO_WORLD: [Vector; 3] = [[0.0, -2.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.25]];

fn times(m: [Vector; 3], v: Vector) -> Vector {
    [0, 1, 2].map(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
}

fn moved<const N: usize>(start: [f64; N], along: [[f64; N]; 2], [s, t]: [f64; 2]) -> Value<f64> {
    let at: [f64; N] = std::array::from_fn(|c| start[c] + s * along[0][c] + t * along[1][c]);
    Value::vector(&at)
}

/// The surface point, or one beside it, whose footprint is scaled.
fn point(by: [f64; 2], scale: f64) -> Value<f64> {
    let vector = |v: Vector| Value::vector(&v);
    let scaled = |v: Vector| Value::vector(&v.map(|x| scale * x));
    let pair = |v: [f64; 2]| Value::vector(&v.map(|x| scale * x));
    Value::Struct(vec![
        moved([0.31, -0.72, 0.53], AXES, by),
        vector([0.8, 0.0, 0.6]),
        vector([0.8, 0.0, 0.6]),
        vector([0.0, 1.0, 0.0]),
        moved([0.37, 0.64], UV_CHANGES, by),
        Value::float(1.0),
        scaled(AXES[0]),
        scaled(AXES[1]),
        pair(UV_CHANGES[0]),
        pair(UV_CHANGES[1]),
        vector([0.0, 0.6, 0.8]),
        Value::Int(7),
        moved([1.5, 0.25, -2.0], AXES.map(|a| times(TO_OBJECT, a)), by),
        Value::float(0.5),
        Value::Mat3(TO_OBJECT),
        Value::Mat3(TO_WORLD),
        moved([0.4, 0.8], UV1_CHANGES, by),
        pair(UV1_CHANGES[0]),
        pair(UV1_CHANGES[1]),
        moved([0.4, 0.5, 0.6], COLOR_CHANGES, by),
        scaled(COLOR_CHANGES[0]),
        scaled(COLOR_CHANGES[1]),
    ])
}

/// Added to what is asked for, since no emission is below zero.
const BIAS: f64 = 4096.0;

/// What the vec3 `x` is in a material with these statements.
fn evaluate(items: &str, statements: &str, x: &str, point: Value<f64>) -> Vec<f64> {
    let text = format!(
        "use std::edf::uniform;\n{items}\nmaterial m {{ param picture: texture = \"p.png\"; param zero: int = 0;\n\
         {statements}\n emission = uniform({BIAS:.1} + color({x}) + 0.0 * image(picture, uv) * float(zero)); }}"
    );
    let program = program(&text);
    let picture = |of: &TextureRequest| {
        let [u, v] = of.uv;
        [u * u, v, u * v, 1.0]
    };
    let emission = program.compiled()[0].emission.as_ref().expect("emits");
    let up = Value::vector(&[0.0, 0.0, 1.0]);
    let value = Interpreter::<f64>::new(program.ir(), 1 << 22)
        .with_texture(&picture)
        .with_table(&program.instances()[0].values)
        .run(emission, vec![point, up]);
    let value = value.expect("ends").to_f64();
    value.iter().map(|x| x - BIAS).collect()
}

/// The gradient of `h` is what its values at the ends of the footprint say.
fn check(items: &str, statements: &str, h: &str) {
    let value = |by| evaluate(items, statements, &format!("vec3({h})"), point(by, 1.0))[0];
    let [dx, dy] = [[0.5, 0.0], [0.0, 0.5]].map(|[s, t]: [f64; 2]| value([s, t]) - value([-s, -t]));
    let squared = AXES.map(|a| a.iter().map(|x| x * x).sum::<f64>());
    let expected = [0, 1, 2].map(|c| AXES[0][c] * dx / squared[0] + AXES[1][c] * dy / squared[1]);
    let found = evaluate(
        items,
        statements,
        &format!("vec3(gradient({h}))"),
        point([0.0; 2], 1.0),
    );
    for c in 0..3 {
        assert!(
            (found[c] - expected[c]).abs() < 1e-9 * (1.0 + expected[c].abs()) * BIAS,
            "{statements} {h}: {found:?}, expected {expected:?}"
        );
    }
    assert!(
        found.iter().any(|x| x.abs() > 1e-2),
        "{statements} {h} is flat: {found:?}"
    );
}

#[test]
fn slopes_of_every_input_that_varies() {
    check("", "", "3.0 * position.x - position.y * position.z");
    check("", "", "uv.x * uv.y + sin(9.0 * uv.x)");
    check("", "", "uv1.x - 2.0 * uv1.y * uv1.y");
    check("", "", "vertex_color.r * vertex_color.g");
    check("", "", "object_position.x * object_position.y");
    check(
        "",
        "",
        "position.x * uv.x * uv1.y * vertex_color.b * object_position.z",
    );
    check(
        "",
        "",
        "object_from_world(position + vector(1.0, 2.0, 3.0)).y",
    );
}

#[test]
fn slopes_of_pictures_steps_and_cells() {
    check("", "", "image_data(picture, 3.0 * uv).x");
    check("", "", "step(0.36, uv.x)");
    check("", "", "floor(40.0 * uv.y)");
    check(
        "",
        "",
        "unit_float(hash(int(100.0 * uv.x), int(100.0 * uv.y)))",
    );
    check(
        "use std::noise::{cell, perlin};",
        "",
        "perlin(position / 10 cm) + cell(position / 1 cm)",
    );
    check(
        "use std::pattern::brick;",
        "",
        "filter_width(uv * uv.x).x + uv.y",
    );
}

#[test]
fn slopes_through_variables_branches_loops_and_calls() {
    check(
        "",
        "var h = uv.x; if uv.y > 0.65 { h = h + position.x; } h *= 2.0;",
        "h",
    );
    check(
        "",
        "var v = vec2(1.0); v.y = uv.x; if v.y > 0.36 { v.x = v.y; }",
        "v.x + v.y",
    );
    check(
        "",
        "var h = 0.0; var k = 1.0; for i in 0 .. 5 { h += k * sin(float(i) * uv.x); k *= 0.5; if h > 0.9 + uv.y { break; } }",
        "h",
    );
    check(
        "",
        "var h = uv.x; while h < 3.0 limit 20 { h = h * (1.1 + uv.y); }",
        "h",
    );
    // A loop whose turns depend on the point, around one that starts anew each time.
    check(
        "",
        "var h = 0.0; for i in 0 .. min(int(20.0 * uv.x), 20) { var k = 0.0; for j in 0 .. min(i, 20) { k += 0.1; } h += k * uv.y; }",
        "h",
    );
    // What does not vary is taken from where it is known, inside of what does as well.
    check(
        "",
        "var a = 2.0; a = a * normal.x; var h = 0.0; if uv.x > 0.36 { h = a * uv.x; } a = 100.0;",
        "h + a * uv.y",
    );
    check(
        "",
        "let h = if uv.x > 0.37 { uv.y } else { position.y };",
        "2.0 * h",
    );
    check(
        "fn f(x: float, y: vec2) -> float { var s = 0.0; for i in 0 .. 3 { s += x * y.x; } s }",
        "",
        "f(uv.x, uv)",
    );
    check("", "let g = gradient(uv.x * uv.x * uv.y);", "g.x * uv.y");
}

/// A block of an `if` sees what came before it outside.
#[test]
fn slopes_in_branches() {
    check(
        "",
        "var h = uv.x; h = h * uv.y; var g = vector(0.0); if normal.x > 0.5 { let k = h + position.z; g = gradient(k * 3.0); }",
        "dot(g, g) * uv.x + uv.y",
    );
}

#[test]
fn heights_are_lengths_and_slopes_plain() {
    let at = |x: &str| evaluate("", "", x, point([0.0; 2], 1.0));
    let plain = at("vec3(gradient(3.0 * position.x))");
    let height = at("vec3(gradient(position.x * 3 mm))");
    for c in 0..3 {
        assert!(
            (plain[c] * 1e-3 - height[c]).abs() < 1e-9,
            "{plain:?} {height:?}"
        );
    }
    // Along the surface only: x has a part of it.
    assert!((plain[0] - 3.0 * 0.36).abs() < 1e-9 && (plain[2] + 3.0 * 0.48).abs() < 1e-9);
}

/// Points never are so near that single precision cannot tell them apart.
#[test]
fn small_footprints_are_widened() {
    let slope = |scale: f64| {
        let text = "vec3(gradient(3.0 * position.x * position.x))";
        evaluate("", "", text, point([0.0; 2], scale))[0]
    };
    let expected = slope(1.0);
    for scale in [1e-3, 1e-6, 1e-12] {
        assert!(
            (slope(scale) - expected).abs() < 1e-6,
            "{scale}: {}",
            slope(scale)
        );
    }
    assert_eq!(slope(0.0), 0.0, "no footprint has no slope");
    // Steps between them are seen if they lie within the widened distance.
    let step = |scale: f64| {
        let text = "vec3(gradient(step(0.310001, position.x)))";
        evaluate("", "", text, point([0.0; 2], scale))[0]
    };
    assert!(step(1e-7) > 1e3, "{}", step(1e-7));
}

#[test]
fn what_does_not_vary_is_flat_and_costs_nothing() {
    let flat = |x: &str| {
        evaluate(
            "",
            "",
            &format!("vec3(gradient({x}))"),
            point([0.0; 2], 1.0),
        )
    };
    assert_eq!(flat("normal.x * 3.0"), [0.0; 3]);
    assert_eq!(flat("facing"), [0.0; 3]);
    assert_eq!(flat("2.0"), [0.0; 3]);
    let inputs = |x: &str| {
        let text =
            format!("use std::edf::uniform;\nmaterial m {{ emission = uniform(color({x})); }}");
        program(&text).infos()[0].inputs
    };
    assert!(!inputs("vec3(gradient(normal.x))").has(Input::Footprint));
    let of_uv = inputs("vec3(gradient(uv.x))");
    assert!(of_uv.has(Input::Footprint) && of_uv.has(Input::FootprintUv) && of_uv.has(Input::Uv));
    assert!(!of_uv.has(Input::Position) && !of_uv.has(Input::ObjectFromWorld));
}

#[test]
fn views_and_spaces() {
    let at = |x: &str| evaluate("", "", x, point([0.0; 2], 1.0));
    let near = |a: Vec<f64>, b: [f64; 3]| {
        let off = a
            .iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 1e-9, "{a:?}, expected {b:?}");
    };
    near(at("vec3(facing)"), [0.48; 3]);
    near(at("vec3(view)"), [0.0, 0.6, 0.8]);
    near(at("vec3(object_position)"), [1.5, 0.25, -2.0]);
    near(at("vec3(object_scale)"), [0.5; 3]);
    near(at("vec3(float(instance_id))"), [7.0; 3]);
    near(
        at("vec3(object_from_world(vector(1.0, 0.0, 0.0)))"),
        [0.0, 2.0, 0.0],
    );
    near(
        at("vec3(world_from_object(vector(0.0, 2.0, 0.0)))"),
        [1.0, 0.0, 0.0],
    );
    near(at("vec3(object_from_world(position))"), [1.5, 0.25, -2.0]);
    near(
        at("vec3(world_from_object(object_position))"),
        [0.31, -0.72, 0.53],
    );
    // The inverse transpose, and unit: the normal stays at right angles to what was at right angles to it.
    let normal = at("vec3(object_normal)");
    let tangent = times(TO_OBJECT, [0.6, 0.0, -0.8]);
    let dot: f64 = normal.iter().zip(tangent).map(|(a, b)| a * b).sum();
    let length: f64 = normal.iter().map(|x| x * x).sum();
    assert!(
        dot.abs() < 1e-9 && (length - 1.0).abs() < 1e-9,
        "{normal:?}"
    );
    near(
        at("vec3(world_from_object(object_normal))"),
        [0.8, 0.0, 0.6],
    );
    let random = |seed: i32| at(&format!("vec3(instance_random({seed}))"))[0];
    assert!((0.0..1.0).contains(&random(1)) && random(1) != random(2));
    assert_eq!(at("vec3(instance_random())")[0], random(0));
}

#[test]
fn what_grows_without_end_is_an_error() {
    let mut statements = "let h0 = uv.x;\n".to_owned();
    for i in 1..40 {
        statements += &format!("let h{i} = gradient(h{0} * h{0} + uv.y).x;\n", i - 1);
    }
    let text = format!(
        "use std::edf::uniform;\nmaterial m {{ {statements} emission = uniform(color(h39)); }}"
    );
    let codes = codes(&text, &[]);
    assert!(
        codes.contains(&"E0308") || codes.contains(&"E0315"),
        "{codes:?}"
    );
}
