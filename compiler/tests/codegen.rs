//! What reaches the WGSL, what does not, and that the text is legal whatever names an author uses.

use crate::common::{codes, compilation, program, wgsl};
use impasto_compiler::abi::{Emission, Input, TextureSpace};
use impasto_compiler::ir::build::Builder;
use impasto_compiler::ir::ops::Op;
use impasto_compiler::ir::{Local, Type};
use impasto_compiler::source::{FileId, Span};
use impasto_compiler::{MaterialRequest, MemoryLoader, codegen, compile};

const DIFFUSE: &str = "use std::bsdf::diffuse;";

#[test]
fn equal_input_gives_equal_text() {
    let text = format!(
        "{DIFFUSE} use std::noise::perlin; material m {{ surface = diffuse(0.5 + 0.5 * perlin(position / 1 m)); }}"
    );
    assert_eq!(wgsl(&text), wgsl(&text));
}

#[test]
fn what_is_not_reached_is_absent() {
    let text = format!(
        "{DIFFUSE} use std::noise::{{perlin, worley}};
        fn unused(x: float) -> float = perlin(point(x));
        material m {{ let _unused = worley(position / 1 m); surface = diffuse(0.5); }}"
    );
    let text = wgsl(&text);
    for absent in ["perlin", "worley", "unused", "hash"] {
        assert!(!text.contains(absent), "`{absent}` in\n{text}");
    }
}

#[test]
fn loops_without_effect_vanish() {
    let text = wgsl(&format!(
        "{DIFFUSE} material m {{
            var _x = 0.0;
            for i in 0..9 {{ _x += float(i); if _x > 5 {{ break; }} }}
            while _x < 3 limit 7 {{ _x += 1; }}
            surface = diffuse(0.5);
        }}"
    ));
    assert!(!text.contains("< 9i") && !text.contains("< 7i"), "{text}");
}

#[test]
fn constants_are_computed_before() {
    // WGSL makes overflow and division by zero in constant expressions errors.
    let text = wgsl(&format!(
        "{DIFFUSE} const BIG: float = 3e38;
        material m {{
            let a = BIG * 10.0 - BIG * 10.0;
            let b = 1.0 / 0.0 + 5 % 0;
            let c = 2147483647 + 1;
            let d = sqrt(-1.0) + log(0.0) + pow(-2.0, 0.5) + pow(0.0, 0.0);
            surface = diffuse(saturate(a + b + float(c) + d + uv.x));
        }}"
    ));
    codegen::validate(&text).expect("valid");
}

#[test]
fn every_reserved_word_is_a_usable_name() {
    let words = [
        "array",
        "fn_",
        "f32",
        "vec3f",
        "switch",
        "loop",
        "override",
        "ptr",
        "sampler",
        "self",
        "class",
        "discard",
        "bitcast",
        "select_",
        "texture_fetch",
        "evaluate_material",
        "wi",
        "wo",
        "u",
        "point_",
        "turn",
        "v1",
        "choice",
        "total",
        "diffuse_eval",
        "op_hash",
        "SurfacePoint_",
        "material_",
        "var_",
        "enable",
        "alias",
        "atomic",
        "workgroup",
    ];
    for word in words {
        let text = format!(
            "{DIFFUSE} fn f_{word}({word}: float) -> float {{ let x_{word} = {word} * 2; x_{word} }} material {word} {{ let {word} = f_{word}(uv.x); surface = diffuse(saturate({word})); }}"
        );
        let compiled = compilation(&text, &[]);
        assert!(
            compiled.program.is_some(),
            "{word}: {:?}",
            compiled.diagnostics
        );
    }
}

#[test]
fn locals_never_hide_what_they_call() {
    // The function is `user_f` in WGSL; so is the variable, were names not kept apart.
    let text = format!(
        "{DIFFUSE} fn f(x: float) -> float = x * x; material m {{ let user_f = f(uv.x); let b = f(user_f); surface = diffuse(saturate(b)); }}"
    );
    codegen::validate(&wgsl(&text)).expect("valid");
}

#[test]
fn materials_of_one_name_are_kept_apart() {
    let mut files = MemoryLoader::default();
    files.add(
        "a.impasto",
        format!(
            "{DIFFUSE} fn tint() -> color = color(0.9); material x {{ surface = diffuse(tint()); }}"
        ),
    );
    files.add(
        "b.impasto",
        format!(
            "{DIFFUSE} fn tint() -> color = color(0.1); material x {{ surface = diffuse(tint()); }}"
        ),
    );
    let requests = [
        MaterialRequest::new("x", "a.impasto"),
        MaterialRequest::new("x", "b.impasto"),
        MaterialRequest::new("material", "b.impasto"),
    ];
    let compiled = compile(&requests, &mut files);
    let program = compiled.program.expect("compiles");
    let names: Vec<String> = program.infos().into_iter().map(|i| i.name).collect();
    assert_eq!(names.len(), 2, "the last two are one material");
    assert_ne!(names[0], names[1]);
    codegen::validate(&program.complete_wgsl(codegen::Target::Native)).expect("valid");
    assert!(
        !program.wgsl(&[0]).contains("0.1"),
        "one member's module has the other's code"
    );
}

#[test]
fn parameters_take_a_scenes_values() {
    let text = format!(
        "{DIFFUSE} material m {{ param tint: color = 0.5; param size: length = 1 mm in 0.1 mm .. 10 mm; surface = diffuse(tint * saturate(float(size) * position.x)); }}"
    );
    let set = compilation(&text, &[("tint", "srgb(0xff0000)"), ("size", "4 mm")])
        .program
        .expect("compiles")
        .wgsl(&[0]);
    assert!(
        set.contains("vec3f(1.0, 0.0, 0.0)") && set.contains("0.004"),
        "{set}"
    );
    assert_eq!(codes(&text, &[("size", "20 mm")]), ["E0305"]);
    assert_eq!(codes(&text, &[("size", "4")]), ["E0303"]);
    assert_eq!(codes(&text, &[("sise", "4 mm")]), ["E0214"]);
    assert!(
        compilation(&text, &[("tint", "color(1, 2")])
            .program
            .is_none()
    );
    assert_eq!(codes(&text, &[("tint", "position")]), ["E0201"]);
}

#[test]
fn only_read_textures_are_asked_for() {
    let text = format!(
        "{DIFFUSE} material m {{ param a: texture = \"a.png\"; param b: texture = \"b.png\"; surface = diffuse(image(a, uv) * image_data(b, uv).x); }}"
    );
    let set = compilation(&text, &[("b", "\"c.png\"")])
        .program
        .expect("compiles");
    let textures = set.textures();
    let paths: Vec<&str> = textures.iter().map(|t| t.path.as_str()).collect();
    assert!(
        paths.contains(&"a.png") && paths.contains(&"c.png") && !paths.contains(&"b.png"),
        "{paths:?}"
    );
    let wgsl = set.wgsl(&[0]);
    for (slot, texture) in textures.iter().enumerate() {
        let wanted = match (texture.path.as_str(), texture.space) {
            ("a.png", TextureSpace::Color) | ("c.png", TextureSpace::Data) => true,
            _ => continue,
        };
        assert_eq!(
            wgsl.contains(&format!("texture_fetch({slot}u, ")),
            wanted,
            "slot {slot} in\n{wgsl}"
        );
    }
}

#[test]
fn emission_is_classified() {
    let kind = |emission: &str| {
        let text = format!("use std::edf::uniform; material m {{ emission = {emission}; }}");
        program(&text).instances()[0].info.emission
    };
    assert_eq!(
        kind("uniform(color(1, 2, 3))"),
        Emission::Uniform([1.0, 2.0, 3.0])
    );
    assert_eq!(
        kind("2.0 * uniform(color(1, 2, 3))"),
        Emission::Uniform([2.0, 4.0, 6.0])
    );
    assert_eq!(kind("0.0 * uniform(color(1, 2, 3))"), Emission::None);
    assert_eq!(kind("uniform(color(uv.x))"), Emission::Varying);
    assert_eq!(
        kind("if uv.x > 0.5 { uniform(1.0) } else { uniform(2.0) }"),
        Emission::Varying
    );
    let bsdf_only = program(&format!(
        "{DIFFUSE} material m {{ surface = diffuse(0.5); }}"
    ));
    assert_eq!(bsdf_only.instances()[0].info.emission, Emission::None);
}

#[test]
fn inputs_are_those_read() {
    let text = format!(
        "{DIFFUSE} material m {{ let _p = position.x; surface = diffuse(saturate(uv.x)); }}"
    );
    let inputs = program(&text).infos()[0].inputs;
    assert!(
        inputs.has(Input::Uv)
            && inputs.has(Input::Normal)
            && inputs.has(Input::GeometricNormal)
            && !inputs.has(Input::Position),
        "{inputs:?}"
    );
}

#[test]
fn work_that_cannot_end_is_refused() {
    let deep = |n: usize| {
        let mut text = String::from(DIFFUSE);
        text.push_str("fn f0(x: float) -> float = x * 1.01 + 0.1;\n");
        for i in 1..n {
            text.push_str(&format!(
                "fn f{i}(x: float) -> float = f{0}(x) + f{0}(x + 1);\n",
                i - 1
            ));
        }
        text.push_str(&format!(
            "material m {{ surface = diffuse(saturate(f{}(uv.x))); }}",
            n - 1
        ));
        text
    };
    assert_eq!(codes(&deep(60), &[]), ["E0315"]);
    assert!(codes(&deep(8), &[]).is_empty());
    let constant = deep(60).replace("uv.x", "0.5").replace(
        "material m {",
        "const C: float = f59(0.5); material m { let _c = C;",
    );
    assert!(
        codes(&constant, &[]).contains(&"E0304"),
        "a constant that takes for ever"
    );
    let looped = format!(
        "{DIFFUSE} fn g(x: float) -> float {{ var y = x; for i in 0..300 {{ y += 1; }} y }} material m {{ var z = 0.0; for i in 0..300 {{ z += g(z); }} surface = diffuse(saturate(z)); }}"
    );
    assert_eq!(codes(&looped, &[]), ["E0308"]);
}

#[test]
fn too_many_lobes_are_refused() {
    let sum = vec!["0.01 * diffuse(0.5)"; 65].join(", ");
    assert!(
        codes(
            &format!("{DIFFUSE} material m {{ surface = layer({sum}); }}"),
            &[]
        )
        .contains(&"E0312")
    );
    let sum = vec!["0.01 * diffuse(0.5)"; 64].join(", ");
    assert!(
        codes(
            &format!("{DIFFUSE} material m {{ surface = layer({sum}); }}"),
            &[]
        )
        .is_empty()
    );
}

#[test]
fn matrices_can_be_chosen() {
    // WGSL's own `select` takes none.
    let text = wgsl(
        "use std::bsdf::diffuse;
        material m {
            let a = mat3(vec3(normal), vec3(tangent), vec3(position));
            let b = mat3(vec3(tangent), vec3(position), vec3(normal));
            let v = select(uv.x > 0.5, a, b) * vec3(uv.x, 1, uv.y);
            surface = diffuse(color(saturate(v)));
        }",
    );
    assert!(text.contains("op_select_mat3x3f("), "{text}");
}

#[test]
fn comparisons_that_face_each_other_are_no_template_list() {
    // Compiling includes validation. In WGSL `select` takes the value for false first.
    crate::common::program(
        "use std::bsdf::diffuse;
        fn faces(h: float, t: bool) -> bool = select(t, h > 0.0, h < 0.0);
        material m { surface = diffuse(select(faces(uv.x, uv.y > 0.0), 1.0, 0.0)); }",
    );
}

/// A material whose color goes through `depth` blocks within each other.
fn blocks(depth: usize, open: impl Fn(usize) -> String, close: &str) -> String {
    let open: String = (0..depth).map(open).collect();
    format!(
        "{DIFFUSE} fn low(x: float) -> bool = x < 0.5;
        fn f(x: float) -> float {{ var y = x; {open} y += sin(y); {} y }}
        material m {{ surface = diffuse(saturate(f(uv.x))); }}",
        close.repeat(depth)
    )
}

#[test]
fn blocks_nest_as_deep_as_wgsl_allows() {
    // Loops of more turns meet the bound on turns before.
    let repeated = |_| "while low(y) limit 1 { y += cos(y);".to_owned();
    let chosen = |_| "if low(y) { y += cos(y);".to_owned();
    for depth in [60, 80, 120] {
        let found = codes(&blocks(depth, repeated, "}"), &[]);
        assert!(found.is_empty(), "{depth} loops: {found:?}");
    }
    let found = codes(&blocks(120, chosen, "}"), &[]);
    assert!(found.is_empty(), "120 branches: {found:?}");
    assert_eq!(codes(&blocks(127, repeated, "}"), &[]), ["E0106"]);
}

#[test]
fn functions_in_line_stay_within_what_wgsl_allows() {
    let open = |_| "while low(y) limit 1 { y += cos(y);".to_owned();
    let caller = blocks(100, open, "}");
    let callee = caller.split("material").next().unwrap_or_default();
    let callee = callee.split("fn f(").nth(1).unwrap_or_default();
    let callee = "fn g(".to_owned() + callee;
    let caller = caller.replace("sin(y)", "g(y)");
    assert!(codes(&(caller + &callee), &[]).is_empty());
}

#[test]
fn whatever_a_source_may_nest_compiles() {
    let parentheses = "(".repeat(240) + "uv.x" + &")".repeat(240);
    let calls = "sin(".repeat(240) + "uv.x" + &")".repeat(240);
    let sum = vec!["uv.x"; 120].join(" + ");
    let powers = "0.5 * (uv.x + ".repeat(55) + "uv.y" + &")".repeat(55);
    let choices = (0..60).map(|i| format!("if uv.x < {i}.5 {{ {i}.25 * uv.y }} else "));
    let choices = choices.collect::<String>() + "{ 0.5 }";
    let values = "{ let a = uv.x; a * ".repeat(80) + "uv.y" + &" }".repeat(80);
    for value in [parentheses, calls, sum, powers, choices, values] {
        let text =
            format!("{DIFFUSE} material m {{ let v = {value}; surface = diffuse(saturate(v)); }}");
        assert!(
            codes(&text, &[]).is_empty(),
            "{value}: {:?}",
            codes(&text, &[])
        );
    }
    let layers = "layer(uv.x * diffuse(0.1), ".repeat(60) + "diffuse(0.5)" + &")".repeat(60);
    let text = format!("{DIFFUSE} material m {{ surface = {layers}; }}");
    assert!(codes(&text, &[]).is_empty(), "{:?}", codes(&text, &[]));
}

/// A variable's value stands where it is read, not where it is used: a store may lie between.
#[test]
fn reads_do_not_move_across_stores() {
    let none = Span::new(FileId(0), 0..0);
    let a = Local {
        name: "a".into(),
        ty: Type::Float,
    };
    let mut b = Builder::new("f", vec![a], none);
    let (x, a) = (b.local("x", Type::Float), b.param(0, none));
    b.store(x, a);
    let old = b.load(x, none);
    let two = b.float(2.0, none);
    b.store(x, two);
    let new = b.load(x, none);
    let sum = b.op(Op::Sub, &[old, new], none);
    let program = program(&format!(
        "{DIFFUSE} material m {{ surface = diffuse(0.5); }}"
    ));
    let text = codegen::functions(&program, &[b.finish(sum)]);
    let (read, store) = (text.find("= x;"), text.find("x = 2.0;"));
    assert!(read.is_some() && read < store, "{text}");
}
