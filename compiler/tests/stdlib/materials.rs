//! Whole materials: what tests ask of them, and whether they sample what they say they sample under bumped normals.

use impasto_compiler::ir::value::Real;
use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, Program, compile, diag};
use impasto_verify::material::{self, distribution};

use super::lanes::Lanes;
use super::sampling::{AGAIN, Distribution, examine, faults, view};
use crate::common::record::effort;

pub use impasto_verify::material::{LIGHT_PDF, LIGHT_THROUGHPUT, point};

/// Directions drawn for each material and view.
fn samples() -> usize {
    effort(1 << 14, 1 << 18)
}

/// Angles of `wo` to the geometric normal.
const VIEWS: [f64; 5] = [20.0, 60.0, 80.0, 88.0, 140.0];

fn program(file: &str, loader: &mut dyn Loader) -> Program {
    program_with(file, Vec::new(), loader)
}

/// The program of a file's material with values for its parameters.
fn program_with(file: &str, params: Vec<(String, String)>, loader: &mut dyn Loader) -> Program {
    let request = MaterialRequest {
        params: params.into_iter().map(|(n, v)| (n, v.into())).collect(),
        ..MaterialRequest::new("m", file)
    };
    let compiled = compile(&[request], loader);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled
        .program
        .unwrap_or_else(|| panic!("{file}:\n{problems}"))
}

/// What throughputs add up to, discrete and continuous.
pub fn reflected(program: &Program, at: &[f64], wo: [f64; 3], samples: usize) -> [f64; 3] {
    material::reflected(program, at, wo, samples).expect("answers")
}

/// Answers of a material in one precision toward many light directions.
pub fn answers<F: Real>(
    program: &Program,
    at: &[f64],
    wo: [f64; 3],
    wl: &[[f64; 3]],
    u: &[[f64; 4]],
) -> Lanes<F> {
    material::answers(program, at, wo, wl, u).expect("answers")
}

/// Samples, integrates, and finds faults of a material; gain of energy is none from inside, where
/// radiance grows by leaving a dense medium.
///
/// Sharp lobes are integrated badly where few samples decide on the cells: a fault counts if more
/// samples show one too.
fn examined(d: &Distribution<'_>, inside: bool, tests: usize, seed: usize) -> Vec<String> {
    let most = if inside { f64::INFINITY } else { 1.0 + FITTED };
    let found = |samples, seed| faults(&examine(d, samples, seed), tests, most);
    let first = found(samples(), seed as u64);
    if first.is_empty() {
        return first;
    }
    found(8 * samples(), seed as u64 + AGAIN)
}

/// How much more than 1 may be reflected, of sampling's error.
const FITTED: f64 = 0.006;

/// A BSDF of each kind under normals that are tilted, look away from the viewer, or are none.
const BUMPED: [&str; 5] = [
    "diffuse(0.8",
    "blinn_phong(exponent: 40",
    "metal(roughness: 0.4",
    "conductor(roughness: 0.5, anisotropy: 0.6",
    "dielectric(roughness: 0.4",
];
const NORMALS: [&str; 4] = [
    "normal(0.3, 0.2, 1.0)",
    "normal(-0.9, 0.1, 0.3)",
    "normal(0.8, 0.5, -0.2)",
    "normal(0.0, 0.0, 0.0)",
];

#[test]
fn bumped_surfaces_are_sampled_as_they_are_evaluated() {
    let mut programs = Vec::new();
    for bsdf in BUMPED {
        for normal in NORMALS {
            let name = bsdf.split('(').next().unwrap_or("");
            let text = format!(
                "use std::bsdf::{name}; material m {{ surface = {bsdf}, normal: {normal}); }}"
            );
            let mut files = MemoryLoader::default();
            files.add("m.impasto", text);
            programs.push((
                format!("{bsdf}) at {normal}"),
                program("m.impasto", &mut files),
            ));
        }
    }
    let at = point([0.1, 0.2, 0.3], [0.4, 0.6]);
    let work: Vec<(&String, &Program, f64)> = programs
        .iter()
        .flat_map(|(l, p)| VIEWS.map(|v| (l, p, v)))
        .collect();
    super::each_in_parallel(&work, |i, (label, program, degrees)| {
        let wo = view(*degrees);
        let d = distribution(format!("{label} from {degrees} degrees"), program, &at, wo);
        let mut faults = examined(&d, *degrees > 90.0, work.len(), i);
        let seen = reflected(program, &at, wo, 4096);
        if seen.iter().any(|s| *s < 0.01) {
            faults.push(format!("black: reflects {seen:?}"));
        }
        (d.label, faults)
    });
}
