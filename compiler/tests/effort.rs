//! What it takes to compile, in statements that the passes walk: a number that is the same on every
//! machine, so that a pass which goes over everything too often fails here and not in somebody's
//! patience.

use impasto_compiler::diag::Diagnostic;
use impasto_compiler::{MaterialRequest, MemoryLoader, Program, check, compile, diag};

const IMPORTS: &str = "use std::bsdf::{conductor, dielectric_reflection, diffuse, generalized_schlick, sheen_zeltner};\n";

fn compiled(text: &str, params: &[(&str, &str)]) -> Program {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let mut request = MaterialRequest::new("m", "m.impasto");
    let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).into());
    request.params = params.iter().map(owned).collect();
    let compilation = compile(&[request], &mut files);
    let problems = diag::render::text(&compilation.sources, &compilation.diagnostics, false);
    compilation.program.unwrap_or_else(|| panic!("{problems}"))
}

/// A material of `n` lobes that have nothing in common but their kinds.
fn lobes(n: usize) -> Program {
    let lobe = |i: usize| {
        let x = (1 + i) as f64 / (n + 1) as f64;
        match i % 3 {
            0 => format!("dielectric_reflection(ior: 1.5 + 0.1 * p, roughness: {x} * p)"),
            1 => format!("generalized_schlick(color0: {x} * tint, roughness: p)"),
            _ => format!("sheen_zeltner(tint * {x}, roughness: p)"),
        }
    };
    let sum = (1..n).fold(lobe(0), |sum, i| format!("mix({sum}, {}, 0.5)", lobe(i)));
    compiled(
        &format!(
            "{IMPORTS}material m {{
                let p = fract(position.x);
                let tint = color(p, 0.5, 0.25);
                surface = {sum};
            }}"
        ),
        &[],
    )
}

/// Growth from each size to twice it: an algorithm that is quadratic would give 4.
#[test]
fn effort_grows_with_the_lobes_and_not_faster() {
    let efforts: Vec<u64> = [8, 16, 32].into_iter().map(|n| lobes(n).effort()).collect();
    for pair in efforts.windows(2) {
        let growth = pair[1] as f64 / pair[0] as f64;
        assert!(growth < 2.2, "{efforts:?}");
    }
    assert!(efforts[0] > 1000, "{efforts:?}: nothing is counted");
}

/// Lobes that a constant switches off cost nothing, not even their methods.
#[test]
fn what_is_switched_off_is_not_worked_on() {
    let text = |more: &str| {
        format!(
            "{IMPORTS}material m {{
                param on: float = 1.0;
                param metal: float = 1.0;
                let base = layer(dielectric_reflection(roughness: 0.3), diffuse(0.5));
                surface = {more};
            }}"
        )
    };
    let off = [("on", "0.0"), ("metal", "0.0")];
    let plain = compiled(&text("base"), &off).effort();
    let switched = "layer(on * sheen_zeltner(1.0), mix(base, conductor(), metal))";
    let pruned = compiled(&text(switched), &off).effort();
    let full = compiled(&text(switched), &[]).effort();
    assert_eq!(pruned, plain, "{full} with everything on");
    assert!(full > plain);
}

/// A file of this repository, or a path of the library, with its defaults.
fn file(path: &str) -> Program {
    struct Disk;
    impl impasto_compiler::Loader for Disk {
        fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
            let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
            std::fs::read(root.join(path)).map_err(|e| e.to_string())
        }
    }
    let compilation = compile(&[MaterialRequest::new("m", path)], &mut Disk);
    let problems = diag::render::text(&compilation.sources, &compilation.diagnostics, false);
    compilation.program.unwrap_or_else(|| panic!("{problems}"))
}

fn operations(program: &Program) -> usize {
    program.compiled()[0].evaluate.evaluated().len()
}

/// What OpenPBR does not use of itself costs a render nothing: base and specular are the gloss on a
/// matte base that one would write by hand.
#[test]
fn open_pbr_by_default_is_two_lobes() {
    let model = file("std::surface::open_pbr");
    let by_hand = file("compiler/benches/compile/two_lobes.impasto");
    let (all, two) = (operations(&model), operations(&by_hand));
    assert!(
        20 * all <= 21 * two && two > 100,
        "{all} operations, {two} by hand"
    );
    assert_eq!(model.infos()[0].lobes, 2);
}

#[test]
fn car_paint_by_open_pbr_fits_a_reviewer() {
    let lines = file("materials/open_pbr_carpaint.impasto")
        .wgsl(&[0])
        .lines()
        .count();
    assert!((100..600).contains(&lines), "{lines} lines");
}

fn errors(text: &str) -> Vec<Diagnostic> {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let found = check("m.impasto", &mut files).diagnostics;
    found.into_iter().filter(Diagnostic::is_error).collect()
}

/// Sizes that are refused, each with what is said of them.
#[test]
fn what_is_too_large_is_said() {
    let list = |n: usize, part: &dyn Fn(usize) -> String| (0..n).map(part).collect::<String>();
    let parameter = |i: usize| format!("a{i}: float, ");
    let function = |n: usize| format!("fn f({}) -> float = a0;", list(n, &parameter));
    let structure = |n: usize| format!("struct S {{ {} }}", list(n, &parameter));
    let materials = |n: usize| {
        let material = |i: usize| format!("material m{i} {{ surface = diffuse(0.5); }}\n");
        format!("use std::bsdf::diffuse;\n{}", list(n, &material))
    };
    let sums = |n: usize| {
        let sum = |i: usize| format!("x += uv.x * {i}.5;\n");
        let sums = list(n, &sum);
        format!(
            "use std::bsdf::diffuse;\nmaterial m {{ var x = uv.y; {sums} surface = diffuse(x); }}"
        )
    };
    let cases: [(String, Option<&str>); 7] = [
        (function(250), None),
        (function(251), Some("251 parameters are too many")),
        (structure(1023), None),
        (structure(1024), Some("`S` has 1024 fields")),
        (materials(1025), Some("the file defines too many materials")),
        (sums(10_000), None),
        (sums(18_000), Some("`m` needs a function of")),
    ];
    for (text, refused) in cases {
        let found = errors(&text);
        let first = found.first();
        match refused {
            Some(why) => assert!(
                first.is_some_and(|d| d.message.starts_with(why) && d.code.id() == "E0315"),
                "{why}: {found:?}"
            ),
            None => assert_eq!(first, None),
        }
    }
}
