//! Materials that call materials: a call means what the callee's statements mean in its place, an
//! argument is what it was given, and what a caller leaves at its default costs nothing.

use crate::common::asked::{Asked, direction, near, point4};
use impasto_compiler::abi::{Emission, Medium};
use impasto_compiler::ir::ops::Op;
use impasto_compiler::ir::{Closure, Expr, ExprKind, parse, print};
use impasto_compiler::source::{FileId, Span};
use impasto_compiler::{MaterialRequest, MemoryLoader, Parameters, Program, compile, diag};

/// A model with a coat, an inside and light of its own, in a file that others import it from.
const MODEL: &str = "
use std::bsdf::{diffuse, mirror, smooth_dielectric};
use std::edf::uniform;
/// Hides nothing.
const DIM: float = 0.5;
fn dimmed(c: color) -> color = DIM * c;
material model {
    param tint: color = color(0.8, 0.4, 0.2) in 0.0 .. 1.0;
    param coat: float = 0.0 in 0.0 .. 1.0;
    param cover: float = 1.0 in 0.0 .. 1.0;
    param glow: float = 0.0;
    param clear: bool = false;
    param bent: normal = normal;
    let under = dimmed(tint * (0.5 + 0.5 * uv.x));
    surface = layer(coat * mirror(1.5, normal: bent), diffuse(under, normal: bent));
    emission = glow * uniform(2.0);
    opacity = cover;
    interior = if clear { medium(absorption: tint, ior: 1.5) } else { none };
}";

fn compiled(user: &str, requests: &[MaterialRequest]) -> Program {
    let mut loader = MemoryLoader::default();
    loader.add("model.impasto", MODEL);
    loader.add("user.impasto", user);
    let compiled = compile(requests, &mut loader);
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled.program.unwrap_or_else(|| panic!("{text}"))
}

/// The only material of a text that may import the model.
fn user(text: &str) -> Asked {
    let text = format!("use model::model;\nuse std::bsdf::{{diffuse, mirror}};\n{text}");
    let request = MaterialRequest {
        material: Some("m".into()),
        ..MaterialRequest::new("m", "user.impasto")
    };
    Asked {
        program: Box::leak(Box::new(compiled(&text, &[request]))),
    }
}

/// The model as a scene names it, with parameters set to constants.
fn model(params: &[(&str, &str)]) -> Asked {
    let params = params.iter().map(|(n, v)| (n.to_string(), (*v).into()));
    let request = MaterialRequest {
        params: params.collect(),
        parameters: Parameters::Baked,
        ..MaterialRequest::new("m", "model.impasto")
    };
    Asked {
        program: Box::leak(Box::new(compiled("", &[request]))),
    }
}

/// Both answer the same numbers everywhere.
fn same(a: &Asked, b: &Asked) {
    for i in 0..64 {
        let u = point4(i);
        let wo = direction(85.0 * u[0], 6.0 * u[1]);
        let wl = direction(85.0 * u[2], 6.0 * u[3]);
        let (x, y) = (a.ask(wo, wl, u), b.ask(wo, wl, u));
        assert_eq!(format!("{x:?}"), format!("{y:?}"), "sample {i}");
    }
}

#[test]
fn a_call_is_the_material_with_these_arguments() {
    let called = user("material m { material = model(coat: 0.5, tint: color(0.3), cover: 0.75); }");
    let set = model(&[("coat", "0.5"), ("tint", "color(0.3)"), ("cover", "0.75")]);
    same(&called, &set);
    let positional = user("material m { material = model(color(0.3), 0.5, 0.75); }");
    same(&positional, &set);
}

#[test]
fn defaults_are_constants_that_leave_code_out() {
    let called = user("material m { material = model(); }");
    let lobes = |m: &Asked| m.program.compiled()[0].info.lobes;
    assert_eq!(lobes(&called), 1, "the coat of weight zero is gone");
    assert_eq!(called.program.instances()[0].info.emission, Emission::None);
    assert_eq!(called.program.instances()[0].info.medium, None);
    assert!(!called.program.compiled()[0].info.transmissive);
    same(&called, &model(&[]));
    let coated = user("material m { material = model(coat: 0.5); }");
    assert_eq!(lobes(&coated), 2);
}

#[test]
fn the_code_of_a_call_is_that_of_the_material() {
    let called = user("material m { material = model(coat: 0.5); }").program;
    let set = model(&[("coat", "0.5")]).program;
    let count = |p: &Program| p.compiled()[0].evaluate.exprs.len();
    assert_eq!(count(called), count(set));
}

#[test]
fn arguments_vary_and_are_held_to_the_range() {
    let beyond = user("material m { material = model(coat: 3.0 * uv.y); }");
    let most = user("material m { material = model(coat: 1.0); }");
    // The point has uv.y = 0.6.
    same(&beyond, &most);
    let below = user("material m { material = model(coat: -uv.y); }");
    let none = user("material m { material = model(coat: 0.0 * uv.y); }");
    same(&below, &none);
    let inside = user("material m { material = model(coat: 0.5 * uv.y); }");
    same(
        &inside,
        &user("material m { material = model(coat: 0.3); }"),
    );
}

#[test]
fn a_parameter_passed_on_is_clamped_where_it_can_leave_the_range_only() {
    let clamps = |text: &str| {
        let mut loader = MemoryLoader::default();
        loader.add("model.impasto", MODEL);
        loader.add("user.impasto", format!("use model::model;\n{text}"));
        let checked = impasto_compiler::check("user.impasto", &mut loader);
        let exprs = &checked.checked[0].body.exprs;
        let clamp = |e: &&Expr| matches!(&e.kind, ExprKind::Op(Op::Clamp, _));
        exprs.iter().filter(clamp).count()
    };
    let within = "material m { param c: float = 0.5 in 0.25 .. 1.0; material = model(coat: c); }";
    let beyond = "material m { param c: float = 0.5 in 0.25 .. 2.0; material = model(coat: c); }";
    assert_eq!(clamps(within), 0);
    assert_eq!(clamps(beyond), 1);
}

#[test]
fn outputs_are_fields() {
    let parts = user(
        "material m {
            let a = model(tint: color(0.9), cover: 0.5);
            let b = model(tint: color(0.1));
            surface = mix(a.surface, b.surface, 0.25);
            opacity = a.opacity * b.opacity;
        }",
    );
    let whole = Asked::material(
        "use std::bsdf::diffuse;
        material m {
            let share = 0.5 * (0.5 + 0.5 * uv.x);
            surface = mix(diffuse(share * 0.9), diffuse(share * 0.1), 0.25);
            opacity = 0.5;
        }",
    );
    let (wo, wl) = (direction(40.0, 0.3), direction(20.0, 2.0));
    let (a, b) = (parts.ask(wo, wl, point4(7)), whole.ask(wo, wl, point4(7)));
    near(
        a.light_throughput[1],
        b.light_throughput[1],
        1e-12,
        "toward a light",
    );
}

#[test]
fn what_a_material_lacks_is_absent() {
    let lacking = user(
        "use std::edf::uniform;
        private material lamp { emission = uniform(1.0); }
        material m {
            let l = lamp();
            let black = mix(l.surface, l.surface, 0.5);
            let half = mix(mirror(), if uv.x > 9.0 { mirror() } else { black }, 0.5);
            surface = layer(half, 0.5 * l.surface) + black;
            emission = l.emission;
            interior = l.interior;
            opacity = l.opacity;
        }",
    );
    let plain = Asked::material(
        "use std::bsdf::{diffuse, mirror};
        use std::edf::uniform;
        material m { surface = 0.5 * mirror(); emission = uniform(1.0); }",
    );
    same(&lacking, &plain);
}

#[test]
fn what_is_mixed_with_something_absent_keeps_its_own_share() {
    for (tree, share) in [
        ("mix(mirror(), l.surface, 0.25)", 0.75),
        ("mix(l.surface, mirror(), 0.25)", 0.25),
    ] {
        let mixed = user(&format!(
            "use std::edf::uniform;
            private material lamp {{ emission = uniform(1.0); }}
            material m {{ let l = lamp(); surface = {tree}; }}"
        ));
        let weighted = Asked::material(&format!(
            "use std::bsdf::mirror;
            material m {{ surface = {share:?} * mirror(); }}"
        ));
        same(&mixed, &weighted);
    }
}

#[test]
fn an_input_by_default_is_replaced_by_callers() {
    let bent = user("material m { material = model(bent: normalize(normal + 0.5 * tangent)); }");
    let flat = user("material m { material = model(bent: normal); }");
    same(&flat, &model(&[]));
    let (wo, wl) = (direction(40.0, 0.3), direction(20.0, 2.0));
    let (a, b) = (bent.ask(wo, wl, point4(3)), flat.ask(wo, wl, point4(3)));
    assert!((a.light_throughput[0] - b.light_throughput[0]).abs() > 1e-3);
}

#[test]
fn an_interior_is_there_where_its_condition_holds() {
    let request = |clear: &str| MaterialRequest {
        params: vec![("clear".into(), clear.into())],
        parameters: Parameters::Table,
        ..MaterialRequest::new(clear, "model.impasto")
    };
    let program = compiled("", &[request("true"), request("false")]);
    let media: Vec<Option<Medium>> = program.instances().iter().map(|i| i.info.medium).collect();
    assert!(media[0].is_some_and(|m| m.ior == 1.5), "{media:?}");
    assert_eq!(media[1], None);
}

#[test]
fn what_a_call_puts_in_place_knows_its_line_and_the_call() {
    let mut loader = MemoryLoader::default();
    loader.add("model.impasto", MODEL);
    let text = "use model::model;\nmaterial m { material = model(coat: uv.y); }";
    loader.add("user.impasto", text);
    let checked = impasto_compiler::check("user.impasto", &mut loader);
    let m = &checked.checked[0];
    let file = |span: Span| checked.sources.file(span.file).name.as_str();
    let from_model: Vec<&Expr> = m
        .body
        .exprs
        .iter()
        .filter(|e| file(e.span) == "model.impasto" && e.via.is_some())
        .collect();
    assert!(from_model.len() > 5);
    for expr in from_model {
        let call = m.body.calls_to(expr.via).last().expect("a call");
        assert_eq!(checked.sources.line_column(call.span), (2, 25));
        assert_eq!(file(call.span), "user.impasto");
    }
    for closure in &m.closures {
        if let Closure::Lobe(lobe) = closure {
            assert!(file(lobe.span) == "model.impasto" && lobe.via.is_some());
        }
    }
}

#[test]
fn materials_of_the_library_are_named_by_paths() {
    let compiled = compile(
        &[MaterialRequest::new("m", "std::bsdf::diffuse")],
        &mut MemoryLoader::default(),
    );
    // The module is found; that it defines no material is another matter.
    let codes: Vec<&str> = compiled.diagnostics.iter().map(|d| d.code.id()).collect();
    assert_eq!(codes, ["E0109"]);
    let compiled = compile(
        &[MaterialRequest::new("m", "std::surface::open_pdf")],
        &mut MemoryLoader::default(),
    );
    let codes: Vec<&str> = compiled.diagnostics.iter().map(|d| d.code.id()).collect();
    assert_eq!(codes, ["E0203"]);
}

#[test]
fn the_text_of_an_interior_with_a_condition_can_be_read() {
    let mut loader = MemoryLoader::default();
    loader.add("model.impasto", MODEL);
    let checked = impasto_compiler::check("model.impasto", &mut loader);
    let text = print::module(&checked.ir, &checked.checked);
    assert!(text.contains(") when $4\n"), "{text}");
    let parsed = parse::parse(FileId(0), &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(print::module(&parsed.module, &parsed.materials), text);
}

#[test]
fn a_private_material_is_meant_by_its_name_or_alone() {
    let names = |source: &str, name: Option<&str>| -> Result<Vec<String>, String> {
        let mut loader = MemoryLoader::default();
        loader.add("own.impasto", source);
        let mut request = MaterialRequest::new("own", "own.impasto");
        request.material = name.map(Into::into);
        let compiled = compile(&[request], &mut loader);
        let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
        let program = compiled.program.ok_or(text)?;
        Ok(program.materials().map(|m| m.name.clone()).collect())
    };
    let part = "private material part { surface = diffuse(color(0.5)); }";
    let head = "use std::bsdf::diffuse;\n";
    let one = format!("{head}{part}\nmaterial whole {{ material = part(); }}");
    assert_eq!(names(&one, None), Ok(vec!["whole".into()]));
    assert_eq!(names(&one, Some("part")), Ok(vec!["part".into()]));
    let alone = names(&format!("{head}{part}"), None);
    assert_eq!(alone, Ok(vec!["part".into()]));
    let two = format!("{one}\nmaterial other {{ material = part(); }}");
    let refused = names(&two, None).expect_err("there are two");
    assert!(
        refused.contains("E0109") && refused.contains("one of `whole`, `other`"),
        "{refused}"
    );
}
