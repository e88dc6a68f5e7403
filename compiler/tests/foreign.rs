//! The words of other shading languages: each gets its hint, and what that says to write compiles.

use impasto_compiler::diag::foreign::{Foreign, TABLE, Use};
use impasto_compiler::{MemoryLoader, check};

/// The diagnostics of a source: code, message and hint in a line each.
fn said(source: &str) -> Vec<String> {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", source);
    let checked = check("m.impasto", &mut files);
    let line = |d: &impasto_compiler::diag::Diagnostic| {
        let hint = d.hint.as_deref().unwrap_or_default();
        format!("{} {} | {hint}", d.code.id(), d.message)
    };
    checked.diagnostics.iter().map(line).collect()
}

const REST: &str = "surface = std_diffuse(0.5);";

fn material(body: &str) -> String {
    format!("material m {{ {body} {REST} }}\n{STAND_IN}")
}

/// So that imports of the rows meet none of ours.
const STAND_IN: &str = "bsdf std_diffuse(c: color) {
    eval(wo, wi) = c * (INV_PI * abs_cos(wi)) when same_side(wo, wi);
    sample(wo, u) = flip_to(wo, cosine_hemisphere(u.xy));
    pdf(wo, wi) = INV_PI * abs_cos(wi) when same_side(wo, wi);
    albedo(wo) = c;
}";

/// A source that uses the word as its language does.
fn using(row: &Foreign, name: &str) -> String {
    match row.used {
        Use::Value => material(&format!("let _a = {name};")),
        Use::Call => material(&format!("let _a = {name}(1.0);")),
        Use::Output => material(&format!("{name} = 0.5;")),
        Use::Module => material(&format!("let _a = {name}::{name}(0.5);")),
        Use::Type => format!("fn f(a: {name}) -> float = 1.0;\n{}", material("")),
        Use::Statement => material(&format!("{name} x = 1.0;")),
        Use::Definition => format!("{name} x;\n{}", material("")),
        Use::Directive => format!("#{name} x\n{}", material("")),
    }
}

/// A source that does what the hint says.
fn following(row: &Foreign) -> Option<String> {
    let instead = Some(row.instead).filter(|text| !text.is_empty())?;
    let imports = row.imports.iter().map(|path| format!("use {path};\n"));
    let imports: String = imports.collect();
    let source = match row.used {
        Use::Type if ["bsdf", "edf"].contains(&instead) => {
            format!("fn f(a: {instead}) -> {instead} = a;\n{}", material(""))
        }
        Use::Type => format!("fn f(_a: {instead}) -> float = 1.0;\n{}", material("")),
        _ => material(&format!("let _a = {instead};")),
    };
    Some(imports + &source)
}

#[test]
fn every_word_gets_its_hint() {
    let mut lacking = Vec::new();
    let each = |row: &'static Foreign| row.names.iter().map(move |name| (row, *name));
    for (row, name) in TABLE.iter().flat_map(each) {
        let said = said(&using(row, name));
        if !said.iter().any(|line| line.contains(&row.hint(name))) {
            lacking.push(format!(
                "`{name}` of {row:?}: no hint; is it a real name by now? {said:#?}"
            ));
        }
    }
    assert!(lacking.is_empty(), "{}", lacking.join("\n"));
}

#[test]
fn what_a_hint_says_compiles() {
    let mut wrong = Vec::new();
    for row in TABLE {
        let Some(source) = following(row) else {
            assert!(!row.note.is_empty(), "{row:?} says nothing");
            continue;
        };
        let errors = said(&source).into_iter().filter(|l| l.starts_with('E'));
        let errors: Vec<String> = errors.collect();
        if !errors.is_empty() {
            wrong.push(format!("{:?}: {errors:#?}", row.names));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_word_is_there_twice() {
    for (i, row) in TABLE.iter().enumerate() {
        let same = |other: &Foreign| {
            other.used == row.used && other.names.iter().any(|n| row.names.contains(n))
        };
        assert!(!TABLE[..i].iter().any(same), "{row:?}");
    }
}

/// An exact name of the library comes before anything near.
#[test]
fn names_of_the_library_win() {
    for (call, import) in [
        ("fractal(position)", "use std::noise::fractal;"),
        ("mirror()", "use std::bsdf::mirror;"),
        ("open_pbr()", "use std::surface::open_pbr;"),
    ] {
        let said = said(&material(&format!("let _a = {call};")));
        assert!(
            said[0].contains(&format!("import it: `{import}`")),
            "{said:?}"
        );
    }
}

/// What the hints of the cases below say to write, where it is no row of the table.
#[test]
fn what_slips_say_to_write_compiles() {
    for (imports, body) in [
        ("use std::noise::random;", "let _a = random(uv.x);"),
        ("", "let _a = atan2(1.0, 2.0);"),
        ("", "let x = 3 mm; let _a = smoothstep(0.0, 1.0, x / 1 cm);"),
        (
            "use std::bsdf::{transparent, diffuse};",
            "param tint: color = 0.5; let _a = mix(transparent(color: tint), diffuse(0.5), 0.5);",
        ),
        (
            "",
            "param n: int = 5 in 1 .. 32; var a = 0; for i in 0 .. n { a += i; } let _b = a;",
        ),
        ("", "var p = vec3(0.0); p.xz = uv; let _a = p;"),
        ("", "let _a = vec2(position.x, time);"),
    ] {
        let said = said(&format!("{imports}\n{}", material(body)));
        assert_eq!(said, Vec::<String>::new(), "{body}");
    }
}

/// One slip is one error: what follows from a `?` or from `df::` is not told.
#[test]
fn what_follows_from_a_slip_is_not_told() {
    for (source, hint) in [
        (
            "fn f(x: float) -> float = x > 0.0 ? 1.0 : 2.0;",
            "`if condition { a } else { b }`",
        ),
        (
            &material("let _a: float = uv.x > 0.5 ? 1.0 : 0.0;"),
            "`if condition { a } else { b }`",
        ),
        (&material("let _a: float = df::tint(0.5);"), "`df` of MDL"),
        ("use df::*;", "`df` of MDL"),
    ] {
        let said = said(source);
        assert!(said.len() == 1 && said[0].contains(hint), "{said:?}");
    }
}

/// What a beginner writes and nothing was said of: colors that are too bright, see `tests/diagnostics/bright.impasto`;
/// of scenes, see `tests/cli/check.rs`. What was misleading: below, and the table. What files of other kinds and
/// missing ones get: `tests/cli/check.rs`, `tests/cli/shot.rs`.
///
/// What newcomers were misled by: the source, and what the hint is now.
#[test]
fn slips_get_what_to_write() {
    let cases = [
        (
            "let _a = position * 3 cm;",
            "divide by the size of a feature: `position / 3 cm`",
        ),
        (
            "let _a = 3 cm * position;",
            "divide by the size of a feature: `position / 3 cm`",
        ),
        ("let _a = uv.x ^ 2.0;", "powers are written `pow(a, b)`"),
        (
            "let _a = color(\"rgb\", 1, 0, 0);",
            "`color(1.0, 0.0, 0.0)`",
        ),
        ("let _a = texture(uv);", "write `image(map, uv)`"),
        ("emission = 3.0;", "after `use std::edf::uniform;`"),
        ("var x = 1.0; x++;", "write `x += 1;`"),
        (
            "let _a = uv.x > 0.5 ? 1.0 : 0.0;",
            "`if condition { a } else { b }`",
        ),
        (
            "let _a = noise(\"perlin\", position);",
            "`perlin(position / 3 cm)`",
        ),
        ("let _a = microfacet(\"ggx\", normal);", "`conductor()`"),
        ("let _a = atan(1.0, 2.0);", "`atan2(y, x)`"),
        ("let _a = smoothstep(0.0, 1.0, 1 cm);", "`x / 1 cm`"),
        ("let _a = sin(1 cm);", "`x / 1 cm`"),
        (
            "let _a = refract(-view, normal, 1.5);",
            "`dielectric(ior: 1.5)`",
        ),
        (
            "let _a = hash(uv.x);",
            "`random(x)`, after `use std::noise::random;`",
        ),
        (
            "opacity = color(0.5, 0.2, 0.2);",
            "`mix(transparent(color: tint), diffuse(0.5), 0.5)`",
        ),
        (
            "param map: texture = ball.png; let _a = image(map, uv);",
            "`\"ball.png\"`",
        ),
        (
            "param tint: color = [255, 0, 0];",
            "a color is `color(1.0, 0.5, 0.0)`, linear; one in bytes is `srgb(0xff8000)`",
        ),
        (
            "let _a: vec3 = [1.0, 0.0, 0.0];",
            "components stand in `vec3(...)`",
        ),
        (
            "let _a = position / 10;",
            "write its unit, as in `position / 10 cm`",
        ),
        (
            "param n: int = 5; var a = 0; for i in 0 .. n { a += i; } let _b = a;",
            "`param n: int = 5 in 1 .. 32;`",
        ),
    ];
    for (body, hint) in cases {
        let said = said(&material(body));
        assert!(
            said.iter().any(|line| line.contains(hint)),
            "{body}: {said:#?}"
        );
    }
    let bump = format!(
        "use std::pattern::bump;\n{}",
        material("let h = 0.1; let _n = bump(normal, h);")
    );
    let said = said(&bump);
    assert!(said[0].contains("`gradient(height)`"), "{said:?}");
}
