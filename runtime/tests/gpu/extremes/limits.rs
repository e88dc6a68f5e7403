//! What is as large as it may be renders, and what is larger is a clear error: layers, lobes,
//! turns of loops, values of parameters.

use impasto_compiler::{MaterialRequest, MemoryLoader, compile, diag};

use crate::gpu::scene::{load_with, render};
use crate::gpu::stub::{mean, red, samples};
use crate::record::{Bound, Row};

/// What compiling a material with these parameters says, as text.
fn problems(source: &str, params: &[(&str, &str)]) -> String {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", source.to_owned());
    let mut request = MaterialRequest::new("m", "m.impasto");
    let owned = params.iter().map(|(k, v)| ((*k).to_owned(), (*v).into()));
    request.params = owned.collect();
    let compiled = compile(&[request], &mut files);
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    let failed = diag::has_errors(&compiled.diagnostics);
    assert_eq!(compiled.program.is_none(), failed, "{text}");
    if failed { text } else { String::new() }
}

/// Row 7: an index of 0, below it, infinite or no number never reaches a kernel.
#[test]
fn impossible_indices_are_errors_that_name_the_parameter() {
    let source = "use std::bsdf::dielectric;
material m { param glass_ior: float = 1.5 in 1.0 .. 3.0; surface = dielectric(ior: glass_ior); }";
    assert_eq!(problems(source, &[("glass_ior", "1.0")]), "");
    for value in [
        "0.0",
        "-1.5",
        "1e30",
        "1.0 / 0.0",
        "0.0 / 0.0",
        "1e39",
        "sqrt(-1.0)",
    ] {
        let text = problems(source, &[("glass_ior", value)]);
        assert!(
            text.contains("error") && text.contains("glass_ior"),
            "{value}: {text}"
        );
    }
}

/// A material of `source` on a block in an even sky of 1.
fn furnace(source: &str) -> (f64, u64) {
    let toml = "film = { width = 8, height = 8 }\n\
                integrator = { max_depth = 3, roulette_start = 1000 }\n\
                camera = { position = [1.1, 0.9, 1.3], look_at = [0, 0, 0], fov = 10 }\n\
                environment = { color = 1, sample = true }\n\
                [[geometry]]\nobj = 'block.obj'\n\
                [materials.block]\nfile = 'deep.impasto'\n";
    let (scene, program) = load_with(toml, &[("deep.impasto", source)]);
    let rendering = render(&scene, &program, "wavefront", &samples(16));
    (mean(red(&rendering)).0, rendering.report.nonfinite_samples)
}

/// Row 30: sixteen layers in one another, and as many lobes as a material may have.
#[test]
fn deep_nests_and_many_lobes_render() {
    let nest = (0..16).fold("diffuse(1)".to_owned(), |below, i| {
        format!(
            "layer(blinn_phong(exponent: {}, reflectance: color(0.05)), {below})",
            10 * (i + 1)
        )
    });
    let lobes: Vec<String> = (0..64)
        .map(|i| {
            format!(
                "{} * diffuse(color({}))",
                1.0 / 64.0,
                0.5 + f64::from(i) / 128.0
            )
        })
        .collect();
    for (name, surface) in [("16 layers", nest), ("64 lobes", lobes.join(" + "))] {
        let source = format!(
            "use std::bsdf::{{blinn_phong, diffuse}};\nmaterial deep {{ surface = {surface}; }}\n"
        );
        let (found, lost) = furnace(&source);
        assert_eq!(lost, 0, "{name}");
        let good = Row {
            table: "30",
            subject: name,
            what: "brightness in an even sky of 1",
            worst: found,
            bound: Bound::AtMost(1.005),
            place: "rendered",
        }
        .note();
        assert!(good && found > 0.5, "{name}: {found}");
    }
    let more: Vec<String> = (0..65)
        .map(|i| format!("0.01 * diffuse(color({}))", 0.5 + f64::from(i) / 200.0))
        .collect();
    let text = problems(
        &format!(
            "use std::bsdf::diffuse;\nmaterial m {{ surface = {}; }}\n",
            more.join(" + ")
        ),
        &[],
    );
    assert!(text.contains("64") && text.contains("lobes"), "{text}");
}

/// Row 31: the longest loop that may be asked for ends, and a longer one is refused.
#[test]
fn long_loops_end_and_endless_ones_are_refused() {
    let source = |turns: &str| {
        format!(
            "use std::bsdf::diffuse;
fn long(x: float) -> float {{
    var y = x;
    for i in 0 .. {turns} {{ y = y * 0.5 + 0.25; }}
    y
}}
material m {{ surface = diffuse(color(long(fract(position.x * 100.0)))); }}\n"
        )
    };
    let text = problems(&source("1000000"), &[]);
    assert!(
        text.contains("E0308") && text.contains("at most 65536 turns"),
        "{text}"
    );
    let (found, lost) = furnace(&source("65536").replace("material m", "material deep"));
    assert!(lost == 0 && (found - 0.5).abs() < 0.01, "{found}");
}
