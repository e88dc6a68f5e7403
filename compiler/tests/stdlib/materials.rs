//! Whole materials as distributions: the function that kernels call samples what it says it
//! samples, under bumped normals and through layers.

use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, Program, compile, diag};

use super::cells::Measures;
use super::lanes::{self, Lanes};
use super::sampling::{Distribution, examine, faults, view};
use super::statistics::Numbers;

/// Directions drawn for each material and view.
const SAMPLES: usize = 1 << 16;

/// Angles of `wo` to the geometric normal.
const VIEWS: [f64; 5] = [20.0, 60.0, 80.0, 88.0, 140.0];

/// Where in `MaterialSample`, flattened, each answer begins.
const WI: usize = 0;
const PDF: usize = 3;
const THROUGHPUT: usize = 4;
const LIGHT_PDF: usize = 7;
const LIGHT_THROUGHPUT: usize = 8;

fn program(file: &str, loader: &mut dyn Loader) -> Program {
    let compiled = compile(&[MaterialRequest::new("m", file)], loader);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled
        .program
        .unwrap_or_else(|| panic!("{file}:\n{problems}"))
}

/// A surface point with the normal up, flattened.
fn point(position: [f64; 3], uv: [f64; 2]) -> Vec<f64> {
    let rest = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    let exterior_ior = 1.0;
    let around = position.into_iter().chain(rest).chain(uv);
    around.chain([exterior_ior]).collect()
}

fn columns<const N: usize>(values: &[[f64; N]]) -> Lanes {
    (0..N)
        .map(|c| lanes::floats(values.iter().map(|v| v[c]).collect()))
        .collect()
}

/// The continuous part of a material at a point.
fn distribution<'a>(
    label: String,
    program: &'a Program,
    at: &'a [f64],
    wo: [f64; 3],
) -> Distribution<'a> {
    let ask = move |wl: Lanes, u: Lanes| {
        let args = vec![lanes::uniform(at), lanes::uniform(&wo), wl, u];
        lanes::run(program.ir(), &program.compiled()[0].evaluate, args)
    };
    let sample = move |u: &[[f64; 4]]| {
        let out = ask(lanes::uniform(&[0.0; 3]), columns(u));
        let one = |l: usize| -> [f64; 3] {
            let drawn = lanes::float_at(&out, PDF, l) > 0.0;
            std::array::from_fn(|c| {
                if drawn {
                    lanes::float_at(&out, WI + c, l)
                } else {
                    0.0
                }
            })
        };
        (0..u.len()).map(one).collect()
    };
    let measure = move |wi: &[[f64; 3]]| {
        let out = ask(columns(wi), lanes::uniform(&[0.5; 4]));
        let one = |l: usize| -> Measures {
            let value = |c: usize| lanes::float_at(&out, LIGHT_THROUGHPUT + c, l);
            [
                lanes::float_at(&out, LIGHT_PDF, l),
                value(0),
                value(1),
                value(2),
            ]
        };
        (0..wi.len()).map(one).collect()
    };
    Distribution {
        label,
        sample: Box::new(sample),
        measure: Box::new(measure),
    }
}

/// What throughputs add up to, discrete and continuous, from `samples` samples.
fn reflected(program: &Program, at: &[f64], wo: [f64; 3], samples: usize) -> [f64; 3] {
    let mut n = Numbers::new(11);
    let u: Vec<[f64; 4]> = (0..samples).map(|_| n.four()).collect();
    let args = vec![
        lanes::uniform(at),
        lanes::uniform(&wo),
        lanes::uniform(&[0.0; 3]),
        columns(&u),
    ];
    let out = lanes::run(program.ir(), &program.compiled()[0].evaluate, args);
    std::array::from_fn(|c| {
        (0..samples)
            .map(|l| lanes::float_at(&out, THROUGHPUT + c, l))
            .sum::<f64>()
            / samples as f64
    })
}

/// Faults of a material, except gain of energy where radiance grows by leaving a dense medium.
fn examined(d: &Distribution<'_>, tests: usize, seed: usize) -> Vec<String> {
    let outcome = examine(d, SAMPLES, seed as u64);
    let gain = |f: &String| f.starts_with("reflects") && !f.contains("by");
    faults(&outcome, tests)
        .into_iter()
        .filter(|f| !gain(f))
        .collect()
}

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
        let mut faults = examined(&d, work.len(), i);
        let seen = reflected(program, &at, wo, 4096);
        if seen.iter().any(|s| *s < 0.01) {
            faults.push(format!("black: reflects {seen:?}"));
        }
        (d.label, faults)
    });
}

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

#[test]
fn every_material_is_sampled_as_it_is_evaluated() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../materials");
    let paths = std::fs::read_dir(folder)
        .expect("materials/")
        .flatten()
        .map(|e| e.path());
    let mut paths: Vec<String> = paths
        .filter(|p| p.extension().is_some_and(|e| e == "impasto"))
        .map(|p| p.to_string_lossy().into_owned())
        .collect();
    paths.sort();
    assert!(paths.len() >= 5, "only {} materials", paths.len());
    let programs: Vec<(&str, Program)> = paths
        .iter()
        .map(|p| (p.rsplit('/').next().unwrap_or(""), program(p, &mut Files)))
        .filter(|(_, p)| !p.infos()[0].delta_only)
        .collect();
    let at: Vec<Vec<f64>> = vec![
        point([0.013, 0.024, 0.5], [0.3, 0.7]),
        point([1.37, -2.61, 0.4], [2.6, 0.1]),
    ];
    let mut work = Vec::new();
    for (name, program) in &programs {
        for at in &at {
            work.extend([20.0, 75.0].map(|v| (*name, program, at, v)));
        }
    }
    super::each_in_parallel(&work, |i, (name, program, at, degrees)| {
        let label = format!("{name} from {degrees} degrees at {:?}", &at[..3]);
        let d = distribution(label, program, at, view(*degrees));
        let faults = examined(&d, work.len(), i);
        (d.label, faults)
    });
}
