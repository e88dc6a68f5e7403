//! What `impasto eval` tells of materials, closures and functions, against values found by hand.

use std::f64::consts::PI;

use impasto_compiler::diag::Code;
use impasto_compiler::inspect::{Answer, Inspection, Precision, Query, Shown, inspect};
use impasto_compiler::{MemoryLoader, diag};

fn asked(
    file: &str,
    text: &str,
    item: Option<&str>,
    at: &str,
    params: &[(&str, &str)],
) -> Inspection {
    let mut files = MemoryLoader::default();
    files.add("t.impasto", text);
    let query = Query {
        file: file.into(),
        item: item.map(str::to_owned),
        params: params
            .iter()
            .map(|(n, v)| ((*n).into(), (*v).into()))
            .collect(),
        at: at.parse().expect("a point"),
        precisions: vec![Precision::F64, Precision::F32],
    };
    inspect(&query, &mut files).expect("readable")
}

fn answers(text: &str, item: Option<&str>, at: &str, params: &[(&str, &str)]) -> Vec<Answer> {
    let found = asked("t.impasto", text, item, at, params);
    let problems = diag::render::text(&found.sources, &found.diagnostics, false);
    assert!(!diag::has_errors(&found.diagnostics), "{problems}");
    found.answers
}

fn only(text: &str, at: &str, params: &[(&str, &str)]) -> Answer {
    answers(text, None, at, params).pop().expect("an answer")
}

#[track_caller]
fn near(found: &Shown, expected: &[f64]) {
    let found = match found {
        Shown::Float(x) => vec![*x],
        Shown::Vector(v) => v.clone(),
        other => panic!("{other:?}"),
    };
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9 * b.abs().max(1.0);
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(close),
        "{found:?}, expected {expected:?}"
    );
}

const LAYERS: &str = "
use std::bsdf::{diffuse, mirror};
use std::edf::uniform;
struct Pair { a: float, b: vec3 }
fn pair(x: float) -> Pair = Pair(a: x, b: vec3(1, x, 2));
material layers {
    param grey: float = 0.4;
    param tint: color = color(1.0, 0.5, 0.25);
    let both = pair(uv.x);
    let half = 0.5;
    surface = layer(mirror(fresnel: 1.5), half * tint * diffuse(color(grey)));
    emission = grey * uniform(tint);
}";

#[test]
fn weights_albedos_and_shares_are_those_of_the_layers() {
    let answer = only(LAYERS, "wo=(0,0,1), wi=(0,0.6,0.8), uv=(0.125, 0)", &[]);
    assert_eq!(answer.parameters.len(), 2);
    near(&answer.parameters[1].value, &[1.0, 0.5, 0.25]);
    let results = &answer.results[0];
    let patterns: Vec<(&str, String)> = results
        .patterns
        .iter()
        .map(|p| (p.name.as_str(), p.value.to_string()))
        .collect();
    assert!(
        patterns.contains(&("both", "{ a: 0.125, b: (1, 0.125, 2) }".into())),
        "{patterns:?}"
    );
    let surface = results.surface.as_ref().expect("a surface");
    let [mirror, diffuse] = surface.lobes.as_slice() else {
        panic!("{:?}", surface.lobes)
    };
    assert_eq!((mirror.bsdf.as_str(), mirror.delta), ("mirror", true));
    assert_eq!((diffuse.bsdf.as_str(), diffuse.delta), ("diffuse", false));
    assert_eq!(diffuse.arguments[0].name, "reflectance");
    near(&diffuse.arguments[0].value, &[0.4; 3]);
    // At normal incidence ((1.5 - 1) / (1.5 + 1))^2 is reflected and the rest passes.
    let passed = 0.96;
    near(&mirror.albedo, &[0.04; 3]);
    near(&mirror.weight, &[1.0; 3]);
    near(&diffuse.albedo, &[0.4; 3]);
    near(
        &diffuse.weight,
        &[0.5 * passed, 0.25 * passed, 0.125 * passed],
    );
    // The lobes are chosen by the brightest component of what they reflect.
    let (a, b) = (0.04, 0.5 * passed * 0.4);
    near(&mirror.share, &[a / (a + b)]);
    near(&diffuse.share, &[b / (a + b)]);
    near(
        &surface.albedo,
        &[1.0, 0.5, 0.25].map(|t| 0.04 + 0.5 * t * passed * 0.4),
    );
    let value = |t: f64| 0.5 * t * passed * 0.4 * 0.8 / PI;
    near(&surface.toward.value, &[1.0, 0.5, 0.25].map(value));
    near(&surface.toward.pdf, &[b / (a + b) * 0.8 / PI]);
    near(
        results.emission.as_ref().expect("emission"),
        &[0.4, 0.2, 0.1],
    );
    assert!(results.operations.alu > 20 && results.operations.special > 0);
}

#[test]
fn numbers_choose_the_lobe_and_parameters_change_it() {
    let mirrored = only(LAYERS, "wo=(0.6,0,0.8), u=(0,0.3,0.3,0.3)", &[]);
    let sampled = &mirrored.results[0]
        .surface
        .as_ref()
        .expect("a surface")
        .sampled;
    near(&sampled.wi, &[-0.6, 0.0, 0.8]);
    near(&sampled.pdf, &[0.0]);
    assert!(!sampled.transmitted);
    let dark = only(LAYERS, "wo=(0,0,1)", &[("grey", "0.5 - 0.5")]);
    let surface = dark.results[0].surface.as_ref().expect("a surface");
    near(&surface.toward.value, &[0.0; 3]);
    near(&dark.parameters[0].value, &[0.0]);
}

#[test]
fn closures_are_evaluated_as_surfaces() {
    let found = asked(
        "std::bsdf::diffuse",
        "",
        None,
        "wi=(0,0,1)",
        &[("reflectance", "color(0.5, 0.2, 0)")],
    );
    let [answer] = found.answers.as_slice() else {
        panic!("{}", found.answers.len())
    };
    assert_eq!(answer.kind.text(), "bsdf");
    assert_eq!(answer.arguments[0].value.to_string(), "color(0.5, 0.2, 0)");
    let surface = answer.results[0].surface.as_ref().expect("a surface");
    near(&surface.toward.value, &[0.5 / PI, 0.2 / PI, 0.0]);
    let lamp = asked("std::edf::uniform", "", None, "", &[("radiance", "3.0")]);
    let emission = lamp.answers[0].results[0].emission.clone();
    near(&emission.expect("emission"), &[3.0; 3]);
}

const FUNCTIONS: &str = "
struct Inner { n: int, p: point }
struct Outer { inner: Inner, w: vector }
fn sum(a: float, b: float = 0.25) -> float = a + b;
fn read(o: Outer, ok: bool) -> vec3 = if ok { o.w * float(o.inner.n) } else { vec3(0) };
fn lost(x: float = 1.0) -> float = (x + 0.00000001) - x;
fn seen(wo: vector, wi: vector, position: point, uv: vec2) -> vec4 =
    vec4(wo.x, wi.y, position.z, uv.y);
fn colored(t: texture) -> color = image(t, vec2(0.5));
fn turned(m: mat3) -> vec3 = m * vec3(1.0);
";

#[test]
fn functions_get_their_defaults_stand_ins_and_the_point() {
    let all = answers(
        FUNCTIONS,
        None,
        "wo=(0.6,0,0.8), wi=(0,0.6,0.8), position=(1,2,3), uv=(0,7)",
        &[],
    );
    let value = |name: &str| {
        let answer = all.iter().find(|a| a.name == name).expect(name);
        answer.results[0].value.clone().expect("a value")
    };
    near(&value("sum"), &[0.75]);
    near(&value("read"), &[0.6, 0.0, 0.8]);
    near(&value("seen"), &[0.6, 0.6, 3.0, 7.0]);
    // Pictures are not read.
    near(&value("colored"), &[0.5, 0.5, 0.5]);
    assert!(all.iter().all(|a| a.name != "turned"));
    let given = answers(FUNCTIONS, Some("sum"), "", &[("b", "2 * PI"), ("a", "1")]);
    near(
        given[0].results[0].value.as_ref().expect("a value"),
        &[1.0 + 2.0 * PI],
    );
}

#[test]
fn the_worst_difference_of_precisions_is_named() {
    let lost = answers(FUNCTIONS, Some("lost"), "", &[])
        .pop()
        .expect("an answer");
    let worst = lost.worst_difference.expect("two precisions");
    assert_eq!(worst.of, "value");
    // Half a unit in the last place of 1 in f32 is 6e-8: the addition is lost.
    assert!(
        (worst.values[0] - 1e-8).abs() < 1e-15 && worst.values[1] == 0.0,
        "{worst:?}"
    );
    assert!((worst.relative - 1e-5).abs() < 1e-9, "{worst:?}");
}

#[test]
fn what_cannot_be_evaluated_is_said() {
    let found = asked("t.impasto", FUNCTIONS, None, "", &[]);
    assert_eq!(found.skipped.len(), 1);
    assert_eq!(found.skipped[0].reason, "nothing stands in for `m: mat3`");
    for (item, params, code, hint) in [
        (Some("turned"), None, Code::MissingArgument, ""),
        (
            Some("turnde"),
            None,
            Code::NoMaterial,
            "did you mean `turned`?",
        ),
        (Some("sum"), Some(("c", "1")), Code::UnknownArgument, ""),
        (Some("sum"), Some(("a", "true")), Code::TypeMismatch, ""),
        (Some("sum"), Some(("a", "1 +")), Code::Syntax, ""),
    ] {
        let found = asked("t.impasto", FUNCTIONS, item, "", params.as_slice());
        let problem = found.diagnostics.iter().find(|d| d.is_error());
        let problem = problem.unwrap_or_else(|| panic!("{item:?} {params:?} is fine"));
        assert_eq!(problem.code, code, "{problem:?}");
        assert!(
            problem.hint.as_deref().unwrap_or("").contains(hint),
            "{problem:?}"
        );
        assert!(found.answers.is_empty());
    }
    let found = asked("t.impasto", LAYERS, None, "", &[("gray", "1")]);
    let errors = found.diagnostics.iter().filter(|d| d.is_error());
    let codes: Vec<Code> = errors.map(|d| d.code).collect();
    assert_eq!(codes, [Code::UnknownParameter]);
    let missing = Query {
        file: "std::bsdf::difuse".into(),
        item: None,
        params: Vec::new(),
        at: Default::default(),
        precisions: vec![Precision::F64],
    };
    let error = inspect(&missing, &mut MemoryLoader::default())
        .err()
        .expect("no such module");
    assert!(
        error.contains("did you mean `std::bsdf::diffuse`"),
        "{error}"
    );
}

#[test]
fn opacity_and_interior_are_outputs() {
    let text = "
use std::bsdf::diffuse;
material leaf {
    param thick: float = 2.0;
    surface = diffuse(color(0.4));
    opacity = 0.25;
    interior = medium(absorption: thick * color(1, 2, 3), ior: 1.25);
}";
    let answer = only(text, "", &[]);
    let results = &answer.results[0];
    let output = |name: &str| {
        let found = results.outputs.iter().find(|o| o.name == name);
        found.map(|o| o.value.clone()).expect(name)
    };
    near(&output("opacity"), &[0.25]);
    near(&output("interior.absorption"), &[2.0, 4.0, 6.0]);
    near(&output("interior.ior"), &[1.25]);
    let lobes = &results.surface.as_ref().expect("a surface").lobes;
    let weight = |bsdf: &str| {
        let lobe = lobes.iter().find(|l| l.bsdf == bsdf);
        lobe.map(|l| l.weight.clone()).expect(bsdf)
    };
    near(&weight("transparent"), &[0.75; 3]);
    near(&weight("diffuse"), &[0.25; 3]);
}
