//! Whole materials as distributions: the function that kernels call samples what it says it
//! samples, under bumped normals and through layers.

use std::sync::LazyLock;

use impasto_compiler::ir::value::Real;
use impasto_compiler::ir::{Const, Type};
use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, Program, compile, diag};

use super::cells::Measures;
use super::lanes::{self, Lanes};
use super::sampling::{AGAIN, Distribution, Outcome, examine, faults, tell, view};
use super::search::errors;
use super::statistics::{Numbers, direction};
use super::tally::Tally;
use crate::common::record::{Bound, effort};

/// Directions drawn for each material and view.
fn samples() -> usize {
    effort(1 << 14, 1 << 18)
}

/// Angles of `wo` to the geometric normal.
const VIEWS: [f64; 5] = [20.0, 60.0, 80.0, 88.0, 140.0];

/// Where in `MaterialSample`, flattened, each answer begins.
const WI: usize = 0;
const PDF: usize = 3;
const THROUGHPUT: usize = 4;
pub const LIGHT_PDF: usize = 7;
pub const LIGHT_THROUGHPUT: usize = 8;

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

/// Where in `SurfacePoint`, flattened, the texture coordinates begin and end, and how long it is.
const UV: usize = 12;
const UV_END: usize = 14;
const AFTER: usize = 25;

/// A surface point with the normal up, flattened, of numbers that single precision has.
pub fn point(position: [f64; 3], uv: [f64; 2]) -> Vec<f64> {
    let rest = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    let exterior_ior = 1.0;
    // What is asked for here is asked without filtering.
    let footprint = [0.0; 10];
    let around = position.into_iter().chain(rest).chain(uv);
    let all = around.chain([exterior_ior]).chain(footprint);
    all.map(|x| f64::from(x as f32)).collect()
}

/// The `SurfacePoint` of a program at a point as of [`point`], which is where it is in its object as
/// well, seen from `wo`.
fn seen<F: Real>(program: &Program, at: &[f64], wo: [f64; 3]) -> Lanes<F> {
    let evaluate = &program.compiled()[0].evaluate;
    let Some(Type::Struct(id)) = evaluate.params.first().map(|p| p.ty) else {
        panic!("evaluate takes no point");
    };
    let fields = program.ir().structs[id.index()].fields.iter();
    let numbers = |name: &str| -> Vec<f64> {
        match name {
            "position" | "object_position" => at[0..3].to_vec(),
            "normal" => at[3..6].to_vec(),
            "geometric_normal" => at[6..9].to_vec(),
            "tangent" => at[9..UV].to_vec(),
            "uv" | "uv1" => at[UV..UV_END].to_vec(),
            "exterior_ior" => at[UV_END..15].to_vec(),
            "footprint_x" => at[15..18].to_vec(),
            "footprint_y" => at[18..21].to_vec(),
            "footprint_uv_x" | "footprint_uv1_x" => at[21..23].to_vec(),
            "footprint_uv_y" | "footprint_uv1_y" => at[23..AFTER].to_vec(),
            "footprint_color_x" | "footprint_color_y" => vec![0.0; 3],
            "view" => wo.to_vec(),
            "object_scale" => vec![1.0],
            "object_from_world" | "world_from_object" => {
                vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            }
            "vertex_color" => vec![1.0; 3],
            other => panic!("no value for the field {other}"),
        }
    };
    let columns = fields.flat_map(|(name, ty)| match ty {
        Type::Int => lanes::constant(&Const::Int(0)),
        _ => lanes::uniform(&numbers(name)),
    });
    columns.collect()
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
        let args = vec![seen(program, at, wo), lanes::uniform(&wo), wl, u];
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

/// What throughputs add up to, discrete and continuous, from `samples` samples: of power, so what
/// goes into another medium counts with the square of its index.
pub fn reflected(program: &Program, at: &[f64], wo: [f64; 3], samples: usize) -> [f64; 3] {
    let medium = program.instances()[0].info.medium;
    let entered = medium.map_or(1.0, |m| f64::from(m.ior * m.ior));
    let mut n = Numbers::new(11);
    // In strata of the choice of a lobe, which is most of the noise.
    let stratified = |i: usize| {
        let [lobe, a, b, c] = n.four();
        [(i as f64 + lobe) / samples as f64, a, b, c]
    };
    let u: Vec<[f64; 4]> = (0..samples).map(stratified).collect();
    let args = vec![
        seen(program, at, wo),
        lanes::uniform(&wo),
        lanes::uniform(&[0.0; 3]),
        columns(&u),
    ];
    let out = lanes::run(program.ir(), &program.compiled()[0].evaluate, args);
    std::array::from_fn(|c| {
        (0..samples)
            .map(|l| {
                let enters = lanes::float_at(&out, WI + 2, l) * wo[2] < 0.0;
                lanes::float_at(&out, THROUGHPUT + c, l) * if enters { entered } else { 1.0 }
            })
            .sum::<f64>()
            / samples as f64
    })
}

/// Samples, integrates, and finds faults of a material; gain of energy is none from inside, where
/// radiance grows by leaving a dense medium.
///
/// Sharp lobes are integrated badly where few samples decide on the cells: a fault counts if more
/// samples show one too.
fn examined(
    d: &Distribution<'_>,
    inside: bool,
    tests: usize,
    seed: usize,
) -> (Outcome, Vec<String>) {
    let first = examined_by(d, inside, tests, (samples(), seed as u64));
    if first.1.is_empty() {
        return first;
    }
    examined_by(d, inside, tests, (8 * samples(), seed as u64 + AGAIN))
}

/// The same by so many samples from a seed.
fn examined_by(
    d: &Distribution<'_>,
    inside: bool,
    tests: usize,
    (samples, seed): (usize, u64),
) -> (Outcome, Vec<String>) {
    let outcome = examine(d, samples, seed);
    let most = outcome.energy.iter().fold(0.0f64, |a, &b| a.max(b));
    let spared = inside || most < 1.0 + FITTED;
    let gain = |f: &String| spared && f.starts_with("reflects") && !f.contains("by");
    let faults = faults(&outcome, tests);
    (outcome, faults.into_iter().filter(|f| !gain(f)).collect())
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
        let (_, mut faults) = examined(&d, *degrees > 90.0, work.len(), i);
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

/// Angles of `wo` to the geometric normal from which materials are seen.
const SEEN: [f64; 6] = [0.0, 30.0, 60.0, 80.0, 89.0, 130.0];

/// What a layered material reflects may exceed 1 by this much, since layers go by albedos that are
/// fitted.
const FITTED: f64 = 0.006;

/// What a material reflects may exceed 1 by this much of sampling's error.
const SAMPLED: f64 = 0.02;

/// A material of `materials/` or a model of the library with some values of its parameters.
struct Variant {
    name: String,
    label: String,
    program: Program,
}

/// Every material, with its defaults and with parameters drawn from their ranges, and every model
/// with what it asks to try. They are compiled once.
fn variants() -> &'static [Variant] {
    static ALL: LazyLock<Vec<Variant>> = LazyLock::new(compiled_variants);
    &ALL
}

fn compiled_variants() -> Vec<Variant> {
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
    let mut variants = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).expect("a text");
        let file = path.rsplit('/').next().unwrap_or("");
        let name = file.trim_end_matches(".impasto").to_owned();
        for seed in 0..=effort(1, 6) as u64 {
            let params = if seed == 0 {
                Vec::new()
            } else {
                drawn(&text, seed)
            };
            let label = format!("{name} {params:?}");
            let program = program_with(&path, params, &mut Files);
            variants.push(Variant {
                name: name.clone(),
                label,
                program,
            });
        }
    }
    let models = super::surfaces::surfaces().into_iter();
    variants.extend(models.map(|s| Variant {
        name: s.name,
        label: s.label,
        program: s.program,
    }));
    variants
}

/// Values for the parameters that a text declares: colors, and ends of ranges or what lies between.
/// Lengths stay: a pattern of a tenth of a millimetre a metre from its origin has few digits left.
fn drawn(text: &str, seed: u64) -> Vec<(String, String)> {
    let mut n = Numbers::new(seed);
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let declared = text.lines().filter_map(|l| l.trim().strip_prefix("param "));
    let values = declared.filter_map(|line| {
        // What a user interface is told comes after the range.
        let line = line.split(" {").next().unwrap_or(line);
        let (name, rest) = line.trim_end_matches(';').split_once(':')?;
        let (ty, value) = rest.split_once('=')?;
        let value = match (ty.trim(), value.split_once(" in ")) {
            ("color", within) => {
                let range = within.and_then(|(_, range)| range.split_once(".."));
                let ends = range.and_then(|(a, b)| Some((number(a)?, number(b)?)));
                let (low, high) = ends.unwrap_or((0.0, 1.0));
                let [r, g, b] = [(); 3].map(|()| low + (high - low) * n.unit());
                format!("color({r}, {g}, {b})")
            }
            ("float", Some((_, range))) => {
                let (low, high) = range.split_once("..")?;
                let between = number(low).zip(number(high));
                match (n.unit(), between) {
                    (u, _) if u < 0.2 => low.trim().to_owned(),
                    (u, _) if u < 0.4 => high.trim().to_owned(),
                    (_, Some((low, high))) => n.between(low, high).to_string(),
                    _ => return None,
                }
            }
            _ => return None,
        };
        Some((name.trim().to_owned(), value))
    });
    values.collect()
}

/// Points at which materials are asked.
fn points() -> [Vec<f64>; 2] {
    [
        point([0.013, 0.024, 0.5], [0.3137, 0.7193]),
        point([1.37, -2.61, 0.4], [2.6141, 0.1091]),
    ]
}

#[test]
fn every_material_is_sampled_as_it_is_evaluated() {
    let variants = variants();
    let at = points();
    let mut work = Vec::new();
    for (i, variant) in variants.iter().enumerate() {
        let which = effort(1, 2);
        for at in at.iter().cycle().skip(i).take(which) {
            work.extend(SEEN.map(|v| (variant, at, v)));
        }
    }
    let tally = Tally::default();
    super::each_in_parallel(&work, |i, (variant, at, degrees)| {
        let label = format!("{} from {degrees} degrees at {:?}", variant.label, &at[..3]);
        let (name, wo) = (variant.name.as_str(), view(*degrees));
        let mut faults = Vec::new();
        if !super::asked_for(name) {
            return (label, faults);
        }
        // Discrete directions and others together; radiance grows on the way out of glass.
        if *degrees < 90.0 {
            let all = reflected(&variant.program, at, wo, effort(2048, 1 << 15));
            let most = all.iter().fold(0.0f64, |a, &b| a.max(b));
            let key = ("energy", name, "most that is reflected of 1, sampled");
            tally.add(key, most, Bound::AtMost(1.0 + SAMPLED), &label);
            if most > 1.0 + SAMPLED {
                faults.push(format!("reflects {all:?}"));
            }
        }
        if !variant.program.infos()[0].delta_only {
            let d = distribution(label.clone(), &variant.program, at, wo);
            let (outcome, found) = examined(&d, *degrees > 90.0, work.len(), i);
            if *degrees < 90.0 {
                tell(&tally, (name, FITTED), &outcome, work.len(), &label);
            }
            faults.extend(found);
        }
        (label, faults)
    });
}

/// Answers of a material in one precision toward many light directions, sampled by many numbers.
pub fn answers<F: Real>(
    program: &Program,
    at: &[f64],
    wo: [f64; 3],
    wl: &[[f64; 3]],
    u: &[[f64; 4]],
) -> Lanes<F> {
    let args = vec![
        seen(program, at, wo),
        lanes::uniform(&wo),
        lanes::vectors(wl),
        lanes::vectors(u),
    ];
    lanes::run(program.ir(), &program.compiled()[0].evaluate, args)
}

/// The share of directions that may be further from double precision than `NEAR`: next to edges of
/// regions that BSDFs state.
const FEW: f64 = 0.01;

/// The same for materials that draw fractals. Both points of a variant count half: next to the
/// boundary of a fractal the last digit of what is computed from a coordinate decides on the color,
/// so all directions at one of the two may differ, but not all at both.
const FRACTAL: f64 = 0.5;
const FRACTALS: [&str; 1] = ["mandelbrot_wall"];

/// The relative error of all other directions, beside what `digits` says.
const NEAR: f64 = 1e-3;

/// How far a number is moved, in parts of itself: two units in its last place.
const LAST_DIGITS: f64 = 2.0 * f32::EPSILON as f64;

/// How far answers in double precision are from `exact` where the point's coordinates and `wo`
/// differ in their last digits, by direction. A noise of a tenth of a millimetre a metre from its
/// origin, or the boundary of a fractal, makes much of those digits. No arithmetic in single
/// precision can be nearer than that.
fn digits(
    (at, wo): (&[f64], [f64; 3]),
    n: &mut Numbers,
    (exact, count): (&Lanes<f64>, usize),
    answers: impl Fn(&[f64], [f64; 3]) -> Lanes<f64>,
) -> Vec<f64> {
    let mut most = vec![0.0f64; count];
    for _ in 0..3 {
        let signs: Vec<f64> = (0..at.len() + 3)
            .map(|i| match i {
                3..UV | UV_END..AFTER => 0.0,
                _ => n.between(-1.0, 1.0).signum(),
            })
            .collect();
        // There and back, so that one of the two is beyond an edge next to the point.
        for step in [LAST_DIGITS, -LAST_DIGITS] {
            let moved = |x: f64, i: usize| x * (1.0 + step * signs[i]);
            let at: Vec<f64> = at.iter().enumerate().map(|(i, x)| moved(*x, i)).collect();
            let wo = std::array::from_fn(|c| moved(wo[c], AFTER + c));
            let found = answers(&at, wo);
            for (l, most) in most.iter_mut().enumerate() {
                *most = most.max(error_toward_light(exact, &found, l));
            }
        }
    }
    most
}

/// The relative error of what is said of the light sample's direction in a lane.
fn error_toward_light<F: Real>(exact: &Lanes<f64>, found: &Lanes<F>, lane: usize) -> f64 {
    let a = [0, 1, 2, 3].map(|c| lanes::float_at(exact, LIGHT_PDF + c, lane));
    let b = [0, 1, 2, 3].map(|c| lanes::float_at(found, LIGHT_PDF + c, lane));
    let [pdf, value, _] = errors(&a, &b, true);
    pdf.max(value)
}

#[test]
fn every_material_is_near_double_precision_and_finite() {
    let variants = variants();
    let tally = Tally::default();
    super::each_in_parallel(variants, |i, variant| {
        let mut n = Numbers::new(i as u64);
        let (mut far, mut count, mut unsound) = (0usize, 0usize, 0usize);
        for at in points() {
            for _ in 0..effort(8, 128) {
                let wo = direction(n.between(-1.0, 1.0), n.between(0.0, std::f64::consts::TAU))
                    .map(|x| f64::from(x as f32));
                let wl: Vec<[f64; 3]> = (0..64)
                    .map(|_| n.direction().map(|x| f64::from(x as f32)))
                    .collect();
                let u: Vec<[f64; 4]> = wl.iter().map(|_| n.four()).collect();
                let exact = answers::<f64>(&variant.program, &at, wo, &wl, &u);
                let found = answers::<f32>(&variant.program, &at, wo, &wl, &u);
                let errors: Vec<f64> = (0..wl.len())
                    .map(|l| error_toward_light(&exact, &found, l))
                    .collect();
                if errors.iter().any(|error| *error > NEAR) {
                    let digits = digits((&at, wo), &mut n, (&exact, wl.len()), |at, wo| {
                        answers::<f64>(&variant.program, at, wo, &wl, &u)
                    });
                    let pairs = errors.iter().zip(&digits);
                    far += pairs
                        .filter(|(error, digits)| **error > NEAR + **digits)
                        .count();
                }
                count += wl.len();
                for l in 0..wl.len() {
                    let all = (PDF..LIGHT_THROUGHPUT + 3).flat_map(|c| {
                        [lanes::float_at(&exact, c, l), lanes::float_at(&found, c, l)]
                    });
                    unsound += all.filter(|x| !(x.is_finite() && *x >= 0.0)).count();
                }
            }
        }
        let share = far as f64 / count as f64;
        let (name, label) = (variant.name.as_str(), variant.label.as_str());
        let what = "share of directions further than 1e-3 from double";
        let few = if FRACTALS.contains(&name) {
            FRACTAL
        } else {
            FEW
        };
        tally.add(("precision", name, what), share, Bound::AtMost(few), label);
        let what = "answers that are not finite or negative";
        tally.add(
            ("finite", name, what),
            unsound as f64,
            Bound::AtMost(0.0),
            label,
        );
        let mut faults = Vec::new();
        if share > few {
            faults.push(format!(
                "{share} of all directions are far from double precision"
            ));
        }
        if unsound > 0 {
            faults.push(format!("{unsound} answers are not finite or negative"));
        }
        (label.to_owned(), faults)
    });
}
