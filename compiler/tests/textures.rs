//! Lookups of textures in sources: what they become, which textures must be loaded and how, and the
//! patterns of the library that look pictures up.

use crate::common::{codes, compilation, program, wgsl};
use impasto_compiler::abi::{Lookups, TextureSpace, texture_mode};
use impasto_compiler::codegen::{self, Target};
use impasto_compiler::ir::interp::{Interpreter, TextureRequest};
use impasto_compiler::ir::value::Value;
use impasto_compiler::{MaterialRequest, MemoryLoader, check, compile};

/// A material with two pictures whose color is `expr`.
fn material(expr: &str) -> String {
    format!(
        "use std::bsdf::diffuse;
        fn handed_on(t: texture, uv: vec2, width: vec2 = vec2(0.0), wrap: int = REPEAT) -> color =
            image(t, uv, width: width, wrap: wrap);
        material m {{
            param picture: texture = \"a.png\";
            param other: texture = \"b.png\";
            param way: int = MIRROR;
            surface = diffuse({expr});
        }}"
    )
}

#[test]
fn lookups_that_ask_for_nothing_are_the_plain_ones() {
    // Lines tell where code is from; what it is must be the same.
    let code = |expr: &str| -> Vec<String> {
        let text = wgsl(&material(expr));
        let lines = text
            .lines()
            .map(|l| l.split("//").next().unwrap_or("").trim_end().to_owned());
        lines.collect()
    };
    let plain = code("image(picture, 3.0 * uv)");
    let fetches = plain.iter().any(|line| line.contains("texture_fetch(0u, "));
    assert!(fetches, "{plain:#?}");
    for same in [
        "image(picture, 3.0 * uv, width: vec2(0.0))",
        "image(picture, 3.0 * uv, wrap: REPEAT, filter: BILINEAR)",
        "image(picture, 3.0 * uv, vec2(0.0), MIRROR, REPEAT, REPEAT)",
        "image(uv: 3.0 * uv, picture: picture, wrap_v: REPEAT)",
        "handed_on(picture, 3.0 * uv)",
        "handed_on(picture, 3.0 * uv, width: 0.0 * vec2(1.0, 2.0), wrap: 1 - 1)",
    ] {
        assert!(code(same) == plain, "{same} is not {plain:#?}");
    }
}

#[test]
fn wraps_and_filters_are_bits_of_one_number() {
    for (arguments, mode) in [
        ("wrap: MIRROR", texture_mode(1, 1, 0)),
        ("wrap: CLAMP", texture_mode(2, 2, 0)),
        ("wrap_u: BORDER", texture_mode(3, 0, 0)),
        ("wrap: MIRROR, wrap_v: BORDER", texture_mode(1, 3, 0)),
        ("filter: NEAREST", texture_mode(0, 0, 1)),
        ("wrap_v: CLAMP, filter: BICUBIC", texture_mode(0, 2, 2)),
    ] {
        let text = wgsl(&material(&format!("image(picture, uv, {arguments})")));
        let call = format!("texture_fetch_as(0u, point.uv, {mode}i).xyz");
        assert!(text.contains(&call), "{arguments}: no {call} in\n{text}");
    }
    let text = wgsl(&material("image(picture, uv, width: 0.1 * uv)"));
    assert!(text.contains("texture_fetch_wide(0u, vec4f("), "{text}");
    assert!(
        !text.contains("texture_fetch(") && !text.contains("texture_fetch_as("),
        "{text}"
    );
}

#[test]
fn textures_are_loaded_as_they_are_looked_up() {
    let lookups = |expr: &str| {
        let textures = program(&material(expr)).textures().into_iter();
        let found = textures.map(|t| (t.path, t.space, t.lookups));
        found.collect::<Vec<_>>()
    };
    let wide = Lookups {
        levels: true,
        ..Lookups::of_mode(0)
    };
    let (color, data) = (TextureSpace::Color, TextureSpace::Data);
    let plain = Lookups::default();
    // Each in its own way, and in no other.
    assert_eq!(
        lookups("image(picture, uv, width: uv) * image_data(other, uv).x"),
        [("a.png".into(), color, wide), ("b.png".into(), data, plain)]
    );
    let alpha = Lookups {
        alpha: true,
        ..plain
    };
    assert_eq!(
        lookups("image(picture, uv) * image_alpha(picture, uv) * image_data(picture, uv).x"),
        [
            ("a.png".into(), color, alpha),
            ("a.png".into(), data, plain)
        ]
    );
    let mirrored = Lookups::of_mode(texture_mode(1, 1, 0));
    assert_eq!(
        lookups("image(picture, uv, wrap: way)"),
        [("a.png".into(), color, mirrored)]
    );
    // What does not reach the surface is not loaded.
    assert_eq!(lookups("0.0 * image(picture, uv, width: uv) + 0.5"), []);
}

#[test]
fn what_instances_differ_in_is_decided_when_it_runs() {
    let mut files = MemoryLoader::default();
    let text = material("image(picture, uv, wrap: way) * image_data(other, uv).x");
    files.add("m.impasto", text.as_str());
    let request = |name: &str, way: &str, picture: &str| MaterialRequest {
        params: vec![
            ("way".into(), way.into()),
            ("picture".into(), format!("{picture:?}").into()),
        ],
        ..MaterialRequest::new(name, "m.impasto")
    };
    let requests = [request("m1", "CLAMP", "c.png"), request("m2", "7", "d.png")];
    let compiled = compile(&requests, &mut files);
    let program = compiled.program.expect("compiles");
    let color = program.textures().into_iter();
    let color: Vec<_> = color.filter(|t| t.space == TextureSpace::Color).collect();
    assert!(color.iter().any(|t| t.path == "c.png") && color.iter().any(|t| t.path == "d.png"));
    assert!(
        color.iter().all(|t| t.lookups == Lookups::ANY_MODE),
        "{color:?}"
    );
    let data = program.textures().into_iter();
    let data: Vec<_> = data.filter(|t| t.space == TextureSpace::Data).collect();
    assert_eq!(data.len(), 1, "`other` is the same for both: {data:?}");
    for target in [Target::Native, Target::WebGpu] {
        codegen::validate(&program.complete_wgsl(target)).expect("valid");
    }
}

#[test]
fn modules_for_browsers_hold_every_lookup() {
    for expr in [
        "image(picture, uv)",
        "image(picture, uv, wrap: MIRROR)",
        "image(picture, uv, wrap: CLAMP, filter: NEAREST) * image(other, uv)",
        "image(picture, uv, wrap: BORDER, filter: BICUBIC, width: 0.1 * uv)",
        "image_data(picture, uv, width: uv).xxx * image_alpha(other, uv, wrap_u: CLAMP)",
    ] {
        let program = program(&material(&expr.replace(".xxx", ".x")));
        let text = program.complete_wgsl(Target::WebGpu);
        codegen::validate(&text).unwrap_or_else(|e| panic!("{expr}: {e}\n{text}"));
        let plain = text.contains("fn texture_fetch(");
        assert_eq!(text.contains("sampler"), plain, "{expr}");
        for (part, argument) in [
            ("fn texture_fetch_wide", "width"),
            ("texture_bicubic", "BICUBIC"),
            ("wrap == 1", "MIRROR"),
            ("wrap == 2", "CLAMP"),
            ("wrap == 3", "BORDER"),
        ] {
            assert_eq!(
                text.contains(part),
                expr.contains(argument),
                "{part} for {expr}"
            );
        }
        codegen::validate(&program.complete_wgsl(Target::Native)).expect("valid");
    }
}

/// Evaluates a function without parameters of a source, where `texture` is every texture.
fn value(source: &str, texture: &dyn Fn(&TextureRequest) -> [f64; 4]) -> Vec<f64> {
    let mut files = MemoryLoader::default();
    let source = format!("{source} material m {{ surface = std_diffuse(0.5); }}");
    let source = format!("use std::bsdf::diffuse as std_diffuse; {source}");
    files.add("m.impasto", source.as_str());
    let checked = check("m.impasto", &mut files);
    let module = checked.ir;
    let f = module.functions.iter().find(|f| f.name == "asked");
    let f = f.unwrap_or_else(|| panic!("{:?}", checked.diagnostics));
    let mut run = Interpreter::<f64>::new(&module, 100_000).with_texture(texture);
    let slot = Value::Int(0);
    run.run(f, vec![slot]).expect("fuel").to_f64()
}

#[test]
fn the_interpreter_asks_for_what_the_source_says() {
    let seen = std::cell::RefCell::new(Vec::new());
    let texture = |of: &TextureRequest| {
        seen.borrow_mut().push(*of);
        [0.1, 0.2, 0.3, 0.4]
    };
    let source = "fn asked(t: texture) -> vec4 {
        let a = image_alpha(t, vec2(0.1, 0.2), width: vec2(0.3, 0.4), wrap: MIRROR, wrap_v: CLAMP);
        image_data(t, vec2(0.5, 0.6), filter: NEAREST) + vec4(vec3(image(t, vec2(0.0))), a)
    }";
    let sum = value(source, &texture);
    let expected = [0.2, 0.4, 0.6, 0.8];
    assert!(
        sum.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
        "{sum:?}"
    );
    let seen = seen.into_inner();
    let found: Vec<_> = seen.iter().map(|of| (of.uv, of.width, of.mode)).collect();
    assert_eq!(
        found,
        [
            ([0.1, 0.2], [0.3, 0.4], texture_mode(1, 2, 0)),
            ([0.5, 0.6], [0.0, 0.0], texture_mode(0, 0, 1)),
            ([0.0, 0.0], [0.0, 0.0], 0),
        ]
    );
}

#[test]
fn wrong_lookups_are_explained() {
    for (expr, code) in [
        ("image(picture, uv, wrap: 4)", "E0305"),
        ("image(picture, uv, wrap_u: -1)", "E0305"),
        ("image(picture, uv, filter: 3)", "E0305"),
        ("image(picture, uv, wrap: 1.5)", "E0301"),
        ("image(picture, uv, width: 0.1)", "E0301"),
        ("image(uv, uv)", "E0301"),
        ("image(picture)", "E0211"),
        ("image(picture, uv, mode: CLAMP)", "E0210"),
        ("image(picture, uv, uv: uv)", "E0212"),
        ("image_alpha(picture, uv).x", "E0208"),
    ] {
        assert_eq!(codes(&material(expr), &[])[..1], [code], "{expr}");
    }
    let found = compilation(&material("image(picture, uv, wrap_v: 9)"), &[]).diagnostics;
    assert!(found[0].message.contains("`wrap_v` is 9"), "{found:?}");
    let expected = found[0].expected.as_deref().unwrap_or_default();
    assert!(
        expected.contains("`REPEAT`, `MIRROR`, `CLAMP`"),
        "{expected}"
    );
}

/// A texture that is `f` of (u, v) in all of its numbers.
fn of_uv(f: impl Fn(f64, f64) -> f64) -> impl Fn(&TextureRequest) -> [f64; 4] {
    move |of| [f(of.uv[0], of.uv[1]); 4]
}

#[test]
fn place2d_moves_what_is_seen() {
    // The texel at uv is seen at: pivot + offset + turned (scale * (uv - pivot)).
    let at = |args: &str| {
        let source = format!(
            "use std::pattern::place2d;
            fn asked(t: texture) -> vec2 = place2d(vec2(0.7, 0.4), {args});"
        );
        value(&source, &of_uv(|_, _| 0.0))
    };
    let close = |found: &[f64], expected: [f64; 2]| {
        found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-6)
    };
    for (args, expected) in [
        ("offset: vec2(0.1, 0.3)", [0.6, 0.1]),
        ("scale: vec2(2.0, 0.5)", [0.35, 0.8]),
        ("rotate: 90 deg", [0.4, -0.7]),
        ("rotate: 90 deg, pivot: vec2(0.5, 0.5)", [0.4, 0.3]),
        (
            "scale: vec2(2.0), pivot: vec2(0.5), offset: vec2(0.1)",
            [0.5, 0.35],
        ),
        ("scale: vec2(0.0)", [0.0, 0.0]),
    ] {
        let found = at(args);
        assert!(close(&found, expected), "{args}: {found:?}");
    }
}

#[test]
fn lat_long_pictures_lie_as_environment_maps_do() {
    let at = |direction: &str| {
        let source = format!(
            "use std::pattern::latlong_uv;
            fn asked(t: texture) -> vec2 = latlong_uv(vector({direction}));"
        );
        value(&source, &of_uv(|_, _| 0.0))
    };
    for (direction, expected) in [
        ("0, 0, -3", [0.5, 0.5]),
        ("1, 0, 0", [0.75, 0.5]),
        ("-1, 0, 0", [0.25, 0.5]),
        ("0, 2, 0", [0.5, 1.0]),
        ("0, -1, -1", [0.5, 0.25]),
        ("0, 0, 0", [0.5, 0.5]),
        ("-1, 0, 0), rotate: (90 deg", [0.5, 0.5]),
    ] {
        let found = at(direction);
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6, "{direction}: {found:?}");
    }
}

#[test]
fn triplanar_is_one_picture_where_a_side_faces_an_axis_and_a_blend_between() {
    let at = |p: &str, n: &str| {
        let source = format!(
            "use std::pattern::triplanar;
            fn asked(t: texture) -> color = triplanar(t, point({p}), normalize(normal({n})));"
        );
        value(&source, &of_uv(|u, v| 10.0 * u + v))[0]
    };
    // To the right and up on each side, as seen from outside: mirrored nowhere.
    for (p, n, expected) in [
        ("1, 2, 3", "0, 0, 1", 10.0 + 2.0),
        ("1, 2, 3", "0, 0, -1", -10.0 + 2.0),
        ("1, 2, 3", "1, 0, 0", -30.0 + 2.0),
        ("1, 2, 3", "-1, 0, 0", 30.0 + 2.0),
        ("1, 2, 3", "0, 1, 0", 10.0 - 3.0),
        ("1, 2, 3", "0, -1, 0", 10.0 + 3.0),
        ("1, 2, 3", "1, 1, 1", (-28.0 + 7.0 + 12.0) / 3.0),
        ("1, 2, 3", "1, 1, 0", (-28.0 + 7.0) / 2.0),
    ] {
        let found = at(p, n);
        assert!(
            (found - expected).abs() < 1e-6,
            "{n}: {found} instead of {expected}"
        );
    }
    // No jump where the side that is faced changes.
    let near = [
        at("1, 2, 3", "1e-4, 0.6, 0.8"),
        at("1, 2, 3", "-1e-4, 0.6, 0.8"),
    ];
    assert!((near[0] - near[1]).abs() < 1e-6, "{near:?}");
}

#[test]
fn triplanar_normals_lean_with_the_slopes_of_the_map() {
    // A map of the plane z = 0.5 u: the normal is (-0.5, 0, 1).
    let level = |x: f64| 0.5 * (x / 1.25f64.sqrt() + 1.0);
    let map = move |_: &TextureRequest| [level(-0.5), 0.5, level(1.0), 1.0];
    for (n, expected) in [
        ("0, 0, 1", [-0.5, 0.0, 1.0]),
        ("0, 0, -1", [0.5, 0.0, -1.0]),
        ("1, 0, 0", [1.0, 0.0, 0.5]),
        ("-1, 0, 0", [-1.0, 0.0, -0.5]),
        ("0, 1, 0", [-0.5, 1.0, 0.0]),
        ("0, -1, 0", [-0.5, -1.0, 0.0]),
    ] {
        let source = format!(
            "use std::pattern::triplanar_normal;
            fn asked(t: texture) -> normal = triplanar_normal(t, point(1, 2, 3), normal({n}));"
        );
        let found = value(&source, &map);
        for (found, expected) in found.iter().zip(expected) {
            let expected = expected / 1.25f64.sqrt();
            assert!(
                (found - expected).abs() < 1e-6,
                "{n}: {found} instead of {expected}"
            );
        }
    }
}

#[test]
fn maps_of_normals_may_have_green_down() {
    let at = |args: &str| {
        let source = format!(
            "use std::pattern::normal_map;
            fn asked(t: texture) -> normal = normal_map(
                color(image_data(t, vec2(0.5)).xyz), normal(0, 0, 1), vector(1, 0, 0){args});"
        );
        value(&source, &|_: &TextureRequest| [0.5, 0.9, 0.9, 1.0])
    };
    let (up, down) = (at(""), at(", flip_green: true"));
    assert!(up[1] > 0.5, "{up:?}");
    assert_eq!([up[0], -up[1], up[2]], down[..]);
    assert_eq!(at(", scale: -1.0, flip_green: true")[1], up[1]);
}

#[test]
fn height_maps_bend_normals_down_the_slope() {
    let source = |args: &str| {
        format!(
            "use std::pattern::height_map;
            fn asked(t: texture) -> normal =
                height_map(t, vec2(0.3, 0.2), normal(0, 0, 1), vector(1, 0, 0), {args});"
        )
    };
    let plane = of_uv(|u, v| 2.0 * u - v);
    let found = value(&source("height: 0.25, step: 0.01"), &plane);
    let length = (0.25f64 + 0.0625 + 1.0).sqrt();
    for (found, expected) in found.iter().zip([-0.5, 0.25, 1.0]) {
        assert!((found - expected / length).abs() < 1e-6, "{found:?}");
    }
    assert_eq!(value(&source("height: 0.0"), &plane), [0.0, 0.0, 1.0]);
}

/// The mean of `expr` over many places `uv`, and how much it jumps at most between places that are
/// `step` apart.
fn over_uv(expr: &str, texture: &dyn Fn(&TextureRequest) -> [f64; 4], step: f64) -> (f64, f64) {
    let source = format!(
        "use std::pattern::{{hex_tiling, hex_tiling_slope}};
        fn asked(t: texture, uv: vec2) -> float = {expr};
        material m {{ surface = diffuse(0.5); }}"
    );
    let mut files = MemoryLoader::default();
    files.add("m.impasto", format!("use std::bsdf::diffuse; {source}"));
    let checked = check("m.impasto", &mut files);
    let module = checked.ir;
    let f = module.functions.iter().find(|f| f.name == "asked");
    let f = f.unwrap_or_else(|| panic!("{:?}", checked.diagnostics));
    let mut run = Interpreter::<f64>::new(&module, u64::MAX).with_texture(texture);
    let mut at = |u: f64, v: f64| {
        let args = vec![Value::Int(0), Value::vector(&[u, v])];
        run.run(f, args).expect("fuel").to_f64()[0]
    };
    let n = 3000;
    let (mut sum, mut jump) = (0.0, 0.0f64);
    for k in 0..n {
        let (u, v) = (
            f64::from(k) * 0.618_034 % 40.0 - 20.0,
            f64::from(k) * 0.013_27 - 20.0,
        );
        let here = at(u, v);
        sum += here;
        jump = jump.max((at(u + step, v + 0.7 * step) - here).abs());
    }
    (sum / f64::from(n), jump)
}

#[test]
fn hex_tiling_has_no_seams_and_keeps_the_mean() {
    let wave = |u: f64, v: f64| {
        let turn = std::f64::consts::TAU;
        0.5 + 0.25 * (turn * u).sin() + 0.2 * (turn * (v + 2.0 * u)).cos()
    };
    let texture = of_uv(wave);
    let step = 1e-5;
    // Slopes of the picture, and of weights: no seam is steeper.
    for args in [
        "",
        ", rotate: 360 deg",
        ", tiles: 8.0, sharpness: 1.0, seed: 3",
    ] {
        let (mean, jump) = over_uv(
            &format!("hex_tiling(t, uv, contrast: 0.0{args}).r"),
            &texture,
            step,
        );
        assert!((mean - 0.5).abs() < 0.02, "{args}: {mean}");
        assert!(jump < 60.0 * step, "{args}: jumps by {jump}");
    }
    // Bright texels win with contrast, by little.
    let (mean, _) = over_uv("hex_tiling(t, uv).r", &texture, step);
    assert!((0.5..0.56).contains(&mean), "{mean}");
    // It does not repeat, unlike the picture.
    let (difference, _) = over_uv(
        "abs(hex_tiling(t, uv).r - hex_tiling(t, uv + vec2(1.0, 0.0)).r)",
        &texture,
        step,
    );
    assert!(difference > 0.1, "{difference}");
}

#[test]
fn hex_tiled_slopes_point_where_those_of_the_map_do() {
    // A map whose slope is the same everywhere: tiles that are turned show it turned.
    let level = |x: f64| 0.5 * (x / 1.25f64.sqrt() + 1.0);
    let map = move |_: &TextureRequest| [level(-0.5), 0.5, level(1.0), 1.0];
    let (x, jump) = over_uv("hex_tiling_slope(t, uv).x", &map, 1e-5);
    assert!((x - 0.5).abs() < 1e-9 && jump < 1e-9, "{x} {jump}");
    let (y, _) = over_uv("hex_tiling_slope(t, uv).y", &map, 1e-5);
    assert!(y.abs() < 1e-9, "{y}");
    // Turned by up to 90 degrees either way, slopes shrink on average by the mean cosine, 2 / pi.
    let (x, _) = over_uv("hex_tiling_slope(t, uv, rotate: 180 deg).x", &map, 1e-5);
    assert!((x - 0.5 * 2.0 / std::f64::consts::PI).abs() < 0.03, "{x}");
}
