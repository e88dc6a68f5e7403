//! Faults planted in a user's materials are found and named; sound ones pass, and findings are the same in every run.

use impasto_compiler::MemoryLoader;
use impasto_compiler::diag::{Code, Diagnostic};

use super::{Options, examine, read};

/// What is wrong with a text, and the texts of the places.
fn found(text: &str, options: Options) -> Vec<(Diagnostic, String)> {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let file = read("m.impasto", &mut files);
    assert!(
        file.diagnostics.iter().all(|d| !d.is_error()),
        "{:?}",
        file.diagnostics
    );
    assert!(!file.subjects.is_empty(), "nothing to test");
    let each = file.subjects.iter().flat_map(|s| {
        let verdict = examine(&file, s, &mut files, options);
        assert!(verdict.checks > 0, "{}: nothing was checked", s.name);
        verdict.diagnostics
    });
    let placed = each.map(|d| {
        let place = d.span.and_then(|s| text.get(s.range())).unwrap_or_default();
        (d, place.to_owned())
    });
    placed.collect()
}

/// Fails unless a text has one fault alone, whose message has all of `words`.
#[track_caller]
fn has(text: &str, code: Code, words: &[&str], place: &str) {
    let all = found(text, Options::default());
    let [(d, at)] = &all[..] else {
        panic!("{all:#?}")
    };
    assert_eq!(d.code, code, "{d:#?}");
    for word in words {
        assert!(d.message.contains(word), "`{word}` is not in {}", d.message);
    }
    assert_eq!(at, place);
    assert_eq!(
        found(text, Options::default()),
        all,
        "another run has other findings"
    );
}

#[test]
fn a_sound_material_passes_for_any_seed() {
    let text = "use std::bsdf::{diffuse, mirror};
        /// Lacquer.
        /// Furnace: within 0.01 with base = color(1.0, 1.0, 1.0),
        ///     coat = 0.0
        /// Albedo: 0.3 .. 0.6
        /// Cost: at most 400 operations
        /// Registers: at most 100
        /// Lines: at most 1000
        /// Weights: at most 2
        material lacquer {
            param base: color = 0.4;
            param coat: float = 1.0 in 0.0 .. 1.0;
            surface = layer(coat * mirror(fresnel: 1.5), diffuse(base));
        }";
    for seed in 0..3 {
        let options = Options {
            seed,
            ..Options::default()
        };
        assert_eq!(found(text, options), []);
    }
}

#[test]
fn a_gain_of_energy_is_named_with_the_parameters() {
    let text = "use std::bsdf::diffuse;
        material snow {
            param glow: float = 1.0 in 0.0 .. 1.5;
            surface = glow * diffuse(0.9);
        }";
    let words = ["`snow` reflects 1.35", "glow = 1.5", "seed 0", "degrees"];
    has(text, Code::MakesLight, &words, "snow");
}

const MATTE: &str = "/// A matte surface.
/// Albedo: exact.
bsdf matte(reflectance: color = 0.5) {
    eval(wo, wi) = reflectance * INV_PI * abs_cos(wi) when same_side(wo, wi);
    sample(wo, u) = flip_to(wo, cosine_hemisphere(u.xy));
    pdf(wo, wi) = INV_PI * abs_cos(wi) when same_side(wo, wi);
    albedo(wo) = reflectance;
}
";

#[test]
fn a_wrong_density_and_a_wrong_albedo_are_named() {
    assert_eq!(found(MATTE, Options::default()), []);
    let wrong = MATTE.replace("pdf(wo, wi) = INV_PI", "pdf(wo, wi) = 1.1 * INV_PI");
    let words = ["`matte(", "density integrates to 1.1"];
    has(&wrong, Code::WrongDensity, &words, "matte");
    let wrong = MATTE.replace("albedo(wo) = reflectance", "albedo(wo) = 0.9 * reflectance");
    let all = found(&wrong, Options::default());
    assert!(
        all.iter().all(|(d, _)| d.code == Code::BrokenPromise),
        "{all:#?}"
    );
    assert!(
        all.iter().all(|(_, at)| at == "/// Albedo: exact."),
        "{all:#?}"
    );
    assert!(!all.is_empty());
}

#[test]
fn a_rise_of_cost_is_named_at_the_line_of_the_promise() {
    let text = "use std::bsdf::diffuse;
        use std::noise::fractal;
        /// Granite.
        /// Cost: at most 300 operations, on any machine.
        material granite {
            surface = diffuse(saturate(0.5 + 0.2 * fractal(position / 2 cm)));
        }";
    let words = ["`granite` takes ", " operations"];
    let line = "/// Cost: at most 300 operations, on any machine.";
    has(text, Code::BrokenPromise, &words, line);
}

#[test]
fn a_furnace_that_loses_light_is_named_at_its_line() {
    let text = "use std::bsdf::diffuse;
        /// Furnace: within 0.05 with base = color(1.0, 1.0, 1.0)
        private const LOST: float = 0.8;
        /// Chalk.
        /// Furnace: within 0.05 with base = color(1.0, 1.0, 1.0)
        material chalk {
            param base: color = 0.4;
            surface = LOST * diffuse(base);
        }";
    let line = "/// Furnace: within 0.05 with base = color(1.0, 1.0, 1.0)";
    has(text, Code::BrokenPromise, &["`chalk` keeps 0.8"], line);
}

#[test]
fn promises_that_cannot_be_read_or_set_are_errors() {
    for line in [
        "Cost: 300",
        "Furnace: always",
        "Albedo: 0.5",
        "Lines: at most many",
    ] {
        let text = format!(
            "use std::bsdf::diffuse;\n/// {line}\nmaterial m {{ surface = diffuse(0.5); }}"
        );
        has(&text, Code::UnreadPromise, &["`m`"], &format!("/// {line}"));
    }
    let text = "use std::bsdf::diffuse;
        /// Furnace: within 0.1 with shine = 1.0
        material m { surface = diffuse(1.0); }";
    let line = "/// Furnace: within 0.1 with shine = 1.0";
    has(text, Code::UnknownParameter, &["shine"], line);
}

#[test]
fn a_bsdf_is_reciprocal_unless_it_says_otherwise() {
    let dull = MATTE
        .replace("* abs_cos(wi) when", "* abs_cos(wo) * abs_cos(wi) when")
        .replace("pdf(wo, wi) = INV_PI * abs_cos(wo)", "pdf(wo, wi) = INV_PI")
        .replace(
            "albedo(wo) = reflectance",
            "albedo(wo) = reflectance * abs_cos(wo)",
        );
    has(&dull, Code::NotReciprocal, &["`matte("], "matte");
    let said = dull.replace("A matte surface.", "A matte surface. Not reciprocal.");
    assert_eq!(found(&said, Options::default()), []);
}

#[test]
fn materials_whose_lanes_part_are_tested_one_by_one() {
    let text = "use std::bsdf::diffuse;
        material steps {
            var x = fract(position.x * 10.0 + uv.x);
            var n = 0;
            while x < 0.9 limit 40 { x += 0.07 + 0.01 * view.z; n += 1; }
            surface = diffuse(float(n) / 40.0);
        }";
    assert_eq!(found(text, Options::default()), []);
}
