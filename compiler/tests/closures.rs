//! Functions that return closures, and the outputs of a material, seen from outside: a call means
//! what its body would mean if it were written there, and no call can make the compiler hang.

use std::time::Duration;

use crate::common::{codes, compilation, program};
use impasto_compiler::abi::Input;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, ExprId, ExprKind, Material};
use impasto_compiler::{Checked, MemoryLoader, Program, check, diag};
use impasto_fuzz::Stopwatch;

const USES: &str = "use std::bsdf::{diffuse, mirror, specular};\nuse std::edf::uniform;\n";

/// Functions are checked on their own, too, where nobody knows yet what their arguments reflect.
#[test]
fn sums_of_parameters_are_weighed() {
    for (sum, expected) in [
        ("base + base", &["W0001"][..]),
        ("0.5 * base + base", &["W0001"]),
        ("0.5 * base + 0.5 * base", &[]),
    ] {
        let text = format!(
            "{USES}fn f(base: bsdf) -> bsdf = {sum};\nmaterial m {{ surface = f(diffuse(0.2)); }}\n"
        );
        assert_eq!(codes(&text, &[]), expected, "{sum}");
    }
}

/// What the material answers about some directions, at one point, exactly.
fn answers(program: &Program) -> Vec<Vec<f64>> {
    let vector = |v: &[f64]| Value::<f64>::vector(v);
    let point = [
        vector(&[0.3, -1.2, 0.7]),
        vector(&[0.0, 0.0, 1.0]),
        vector(&[0.0, 0.0, 1.0]),
        vector(&[1.0, 0.0, 0.0]),
        vector(&[0.7, 0.4]),
        Value::float(1.25),
    ];
    let mut run = Interpreter::<f64>::new(program.ir(), u64::MAX);
    let ask = |i: i32| {
        let u = [0.37, 0.59, 0.71, 0.83].map(|g: f64| (g * f64::from(i)).fract());
        let turn = f64::from(i);
        let wl = [0.6 * turn.cos(), 0.6 * turn.sin(), 0.8];
        let args = vec![
            Value::Struct(point.to_vec()),
            vector(&[0.28, 0.0, 0.96]),
            vector(&wl),
            vector(&u),
        ];
        let answer = run
            .run(&program.compiled()[0].evaluate, args)
            .expect("fuel");
        (0..6)
            .flat_map(|i| answer.field(i).expect("six fields").to_f64())
            .collect()
    };
    (0..40).map(ask).collect()
}

#[track_caller]
fn same(with_functions: &str, written_out: &str) {
    let a = program(&format!("{USES}{with_functions}"));
    let b = program(&format!("{USES}{written_out}"));
    assert_eq!(a.infos()[0].lobes, b.infos()[0].lobes);
    assert_eq!(answers(&a), answers(&b));
}

fn checked(text: &str) -> Checked {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", format!("{USES}{text}"));
    let checked = check("m.impasto", &mut files);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(!diag::has_errors(&checked.diagnostics), "{problems}");
    checked
}

#[test]
fn a_call_is_its_body() {
    same(
        "fn varnish(base: bsdf, amount: float) -> bsdf = layer(amount * specular(0.5), base);
         material m {
             param shade: float = 0.25;
             surface = varnish(amount: uv.x, base: diffuse(shade));
         }",
        "material m {
             param shade: float = 0.25;
             surface = layer(uv.x * specular(0.5), diffuse(shade));
         }",
    );
}

#[test]
fn calls_nest_and_keep_their_names_apart() {
    same(
        "fn two(x: float) -> float = 2.0 * x;
         fn inner(x: float) -> bsdf {
             let shade = two(x);
             diffuse(shade)
         }
         fn outer(a: bsdf, x: float) -> bsdf {
             let shade = 0.5;
             if x > shade { inner(x) } else { mix(a, inner(shade * x), shade) }
         }
         material m {
             let x = uv.y;
             let shade = uv.x;
             surface = outer(outer(inner(shade), x), shade);
         }",
        "fn two(x: float) -> float = 2.0 * x;
         material m {
             let x = uv.y;
             let shade = uv.x;
             let first = diffuse(two(shade));
             let second = if x > 0.5 { diffuse(two(x)) } else { mix(first, diffuse(two(0.5 * x)), 0.5) };
             surface = if shade > 0.5 { diffuse(two(shade)) } else { mix(second, diffuse(two(0.5 * shade)), 0.5) };
         }",
    );
}

#[test]
fn functions_of_other_modules_see_their_own_names() {
    let mut files = MemoryLoader::default();
    files.add(
        "paints/gloss.impasto",
        "use std::bsdf::{diffuse, specular as shine};
         const AMOUNT: float = 0.125;
         fn shade() -> color = color(0.75);
         fn gloss(base: bsdf) -> bsdf = layer(AMOUNT * shine(0.5), mix(base, diffuse(shade()), 0.25));",
    );
    files.add(
        "m.impasto",
        "use paints::gloss::gloss as glossy;
         use std::bsdf::diffuse;
         const AMOUNT: float = 0.875;
         fn shade() -> color = color(0.1);
         material m { surface = glossy(AMOUNT * diffuse(shade())); }",
    );
    let checked = check("m.impasto", &mut files);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(problems.is_empty(), "{problems}");
    let m = &checked.checked[0];
    let constants: Vec<f64> = m.body.exprs.iter().filter_map(scalar).collect();
    assert!(constants.contains(&0.125) && constants.contains(&0.875));
    let places: Vec<String> = (m.closures.iter())
        .filter_map(|c| match c {
            impasto_compiler::ir::Closure::Lobe(lobe) => Some(lobe.span),
            _ => None,
        })
        .map(|span| checked.sources.file(span.file).name.clone())
        .collect();
    let gloss = "paints/gloss.impasto";
    assert_eq!(
        places,
        ["m.impasto", gloss, gloss],
        "lobes keep their places"
    );
}

fn scalar(expr: &impasto_compiler::ir::Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Const(Const::Float(v)) if v.len() == 1 => Some(v[0]),
        _ => None,
    }
}

#[test]
fn emission_and_media_come_from_functions_too() {
    let checked = checked(
        "fn glow(strength: float) -> edf = strength * uniform(2.0);
         fn filled(by: medium, other: bool) -> medium = if other { medium() } else { by };
         fn kept(by: medium) -> medium = by;
         material m {
             param thick: float = 3.0;
             emission = layer(mirror(), glow(0.5));
             interior = kept(filled(medium(thick, priority: 7), false));
         }",
    );
    let m = &checked.checked[0];
    assert!(m.surface.is_none() && m.emission.is_some());
    let medium = m.interior.expect("an interior");
    assert_eq!(constant(m, medium.parts[2]), Some(&Const::Int(7)));
    assert_eq!(constant(m, medium.parts[1]), Some(&Const::Float(vec![1.0])));
    assert_eq!(constant(m, medium.parts[0]), None, "by the parameter");
}

fn constant(m: &Material, id: ExprId) -> Option<&Const> {
    m.body.constant(id)
}

#[test]
fn media_have_defaults_and_keep_to_their_ranges() {
    let checked = checked(
        "material m {
             param ior: float = 1.5;
             param level: int = 3;
             param dense: color = 0.5;
             surface = diffuse(0.5);
             interior = medium(dense, ior, level);
         }
         material plain { surface = diffuse(0.5); interior = medium(color(1.0, 2.0, 3.0)); }
         material empty { surface = diffuse(0.5); interior = medium(); }
         material none { surface = diffuse(0.5); }",
    );
    let [m, plain, empty, none] = checked.checked.as_slice() else {
        panic!("four materials");
    };
    let medium = plain.interior.expect("an interior");
    let given = Const::Float(vec![1.0, 2.0, 3.0]);
    assert_eq!(constant(plain, medium.parts[0]), Some(&given));
    let text = impasto_compiler::ir::print::material(&checked.ir, m);
    assert!(text.contains("clamp $0, 0.1, 10.0"), "{text}");
    assert!(text.contains("clamp $1, 0, 1000"), "{text}");
    assert!(
        text.contains("max $2, 0.0") && !text.contains("inf"),
        "{text}"
    );
    let medium = empty.interior.expect("an interior");
    let parts = medium.parts.map(|id| constant(empty, id));
    let (zero, one) = (Const::Float(vec![0.0; 3]), Const::Float(vec![1.0]));
    let none_at_all = Const::Float(vec![0.0]);
    let expected = [&zero, &one, &Const::Int(0), &zero, &none_at_all];
    assert_eq!(parts, expected.map(Some));
    assert!(none.interior.is_none() && none.opacity.is_none());
}

/// What is the same everywhere may take any way to get there.
#[test]
fn media_may_use_variables_loops_and_functions_of_parameters() {
    let checked = checked(
        "fn half(x: float) -> float = 0.5 * x;
         material m {
             param ior: float = 1.5;
             var at = 1.0;
             for i in 0 .. 3 {
                 if ior > 1.4 { at += half(ior); } else { break; }
             }
             var elsewhere = 0.0;
             if uv.x > 0.5 { elsewhere = 1.0; }
             surface = diffuse(elsewhere);
             interior = medium(ior: at);
         }",
    );
    assert!(checked.checked[0].interior.is_some());
}

/// Each way in which a point can decide about a value, without being part of it.
#[test]
fn media_that_a_point_decides_about_are_found() {
    for body in [
        "if uv.x > 0.5 { at = 2.0; }",
        "for i in 0 .. 4 { if uv.x > 0.5 { break; } at += 0.1; }",
        "for i in 0 .. 4 { at += 0.1; if uv.x > 0.5 { continue; } at += 0.1; }",
        "for i in 0 .. min(int(uv.x), 4) { at = float(i); }",
        "while at < uv.x limit 8 { at += 0.1; }",
        "var b = 1.0; for i in 0 .. 4 { at = b; b = uv.x; }",
        "at = if uv.x > 0.5 { 1.0 } else { 2.0 };",
        "at = length(vec2(1.0, uv.x));",
    ] {
        let text = format!(
            "{USES}material m {{ surface = diffuse(0.5); var at = 1.0; {body} interior = medium(ior: at); }}"
        );
        assert_eq!(codes(&text, &[]), ["E0316"], "{body}");
    }
}

#[test]
fn opacity_is_saturated_and_may_be_called_as_a_parameter() {
    let checked = checked(
        "material m {
             param opacity: float = 0.5;
             surface = diffuse(0.5);
             opacity = opacity;
         }
         material above { emission = uniform(1.0); opacity = 3.0; }",
    );
    let opacity = checked.checked[0].opacity.expect("an opacity");
    let text = impasto_compiler::ir::print::material(&checked.ir, &checked.checked[0]);
    assert!(text.contains("saturate $0"), "{text}");
    assert_eq!(constant(&checked.checked[0], opacity), None);
    assert_eq!(checked.checked[1].opacity, None, "opaque, as without");
}

/// Longest that a compilation may take; it is well below a second where nothing else runs.
const LONGEST: Duration = Duration::from_secs(3);

/// The text is refused with `code` before long.
#[track_caller]
fn ends(text: &str, code: &str) {
    let start = Stopwatch::start();
    let found = compilation(&format!("{USES}{text}"), &[]);
    let took = start.elapsed();
    let ids: Vec<&str> = found.diagnostics.iter().map(|d| d.code.id()).collect();
    assert!(ids.contains(&code), "{:?}", &ids[..ids.len().min(5)]);
    assert!(ids.len() < 50, "{} diagnostics", ids.len());
    assert!(took < LONGEST, "took {took:?}");
}

#[test]
fn expansion_ends() {
    let doubling = |call: &str| {
        let functions = (1..60).map(|i| {
            let inner = call.replace('F', &format!("f{}", i - 1));
            format!("fn f{i}(a: bsdf) -> bsdf = {inner};\n")
        });
        let functions: String = functions.collect();
        format!("fn f0(a: bsdf) -> bsdf = a;\n{functions}material m {{ surface = f20(mirror()); }}")
    };
    ends(&doubling("layer(F(a), F(a))"), "E0315");
    ends(&doubling("F(F(a))"), "E0315");
    let long: String = (1..1200)
        .map(|i| format!("fn f{i}() -> bsdf = f{}();\n", i - 1))
        .collect();
    let first = "fn f0() -> bsdf = mirror();\n";
    ends(
        &format!("{first}{long}material m {{ surface = f1199(); }}"),
        "E0315",
    );
}

#[test]
fn many_large_calls_end() {
    let lets: String = (0..1000).map(|i| format!("let a{i} = x;\n")).collect();
    let large = format!("fn large(x: float) -> bsdf {{ {lets} diffuse(a999) }}\n");
    let calls: String = (0..1000)
        .map(|i| format!("fn g{i}(x: float) -> bsdf = mix(large(x), large(x), x);\n"))
        .collect();
    let text = format!("{large}{calls}material m {{ surface = g0(0.5); }}");
    assert!(text.len() < 80 << 10);
    let start = Stopwatch::start();
    let mut files = MemoryLoader::default();
    files.add("m.impasto", format!("{USES}{text}"));
    check("m.impasto", &mut files);
    assert!(start.elapsed() < LONGEST, "{:?}", start.elapsed());
}

#[test]
fn trees_that_share_branches_end() {
    let doubled: String = (1..60)
        .map(|i| format!("let a{i} = layer(a{}, a{});\n", i - 1, i - 1))
        .collect();
    let material = |lets: &str, last: &str| {
        format!("material m {{ let a0 = mirror(); {lets} surface = {last}; }}")
    };
    ends(&material(&doubled, "a59"), "E0312");
    let deep: String = (1..2500)
        .map(|i| format!("let a{i} = 0.5 * a{};\n", i - 1))
        .collect();
    ends(&material(&deep, "a2499"), "E0315");
}

#[test]
fn the_index_outside_is_an_input() {
    same(
        "material m { surface = specular(exterior_ior / 2.0); }",
        "material m { surface = specular(0.625); }",
    );
    let reads = |surface: &str| {
        let text = format!("{USES}material m {{ surface = {surface}; }}");
        program(&text).infos()[0].inputs.has(Input::ExteriorIor)
    };
    assert!(reads("specular(exterior_ior / 2.0)") && !reads("specular(uv.x)"));
}
