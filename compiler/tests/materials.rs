//! Every material in `materials/`, found by walking the folder, held to what any material must
//! keep: finite and not negative, no more light out than in, and one answer whether a direction
//! was sampled or asked for. Run by the interpreter in f64 and in f32.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::{Loader, MaterialRequest, Program, compile, diag};

use crate::common::kept;

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("materials")
        .flatten()
        .map(|e| e.path())
        .collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    assert!(files.len() >= 5, "only {} materials", files.len());
    files
}

/// The program of a material, which is compiled once.
fn program(file: &Path) -> &'static Program {
    static MADE: Mutex<BTreeMap<PathBuf, &Program>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let new = || &*Box::leak(Box::new(compiled(file)));
    made.entry(file.to_owned()).or_insert_with(new)
}

fn compiled(file: &Path) -> Program {
    let compiled = compile(
        &[MaterialRequest::new("m", file.to_string_lossy())],
        &mut Files,
    );
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    assert_eq!(problems, "", "{} has diagnostics", file.display());
    compiled.program.expect("compiles")
}

/// Numbers that look random and are the same in every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }

    fn direction(&mut self) -> [f64; 3] {
        let (z, turn) = (2.0 * self.next() - 1.0, std::f64::consts::TAU * self.next());
        let s = (1.0 - z * z).max(0.0).sqrt();
        [s * turn.cos(), s * turn.sin(), z]
    }
}

/// One point of a surface, with the directions and numbers that a kernel would pass.
struct Query {
    position: [f64; 3],
    uv: [f64; 2],
    wo: [f64; 3],
    u: [f64; 4],
}

impl Query {
    fn new(n: &mut Numbers) -> Self {
        let mut wo = n.direction();
        // Exactly along the surface there is nothing to see.
        if wo[2].abs() < 1e-3 {
            wo = [0.0, 0.0, 1.0];
        }
        let position = std::array::from_fn(|_| 4.0 * n.next() - 2.0);
        Self {
            position,
            uv: [n.next(), n.next()],
            wo,
            u: std::array::from_fn(|_| n.next()),
        }
    }
}

/// wi, pdf, throughput, light_pdf, light_throughput.
fn ask<F: Real + 'static>(
    program: &'static Program,
    q: &Query,
    wl: &[f64],
) -> (Vec<f64>, f64, Vec<f64>, f64, Vec<f64>) {
    let z = || Value::vector(&[0.0, 0.0, 1.0]);
    let point = vec![
        Value::vector(&q.position),
        z(),
        z(),
        Value::vector(&[1.0, 0.0, 0.0]),
        Value::vector(&q.uv),
        Value::float(1.0),
    ];
    let args = vec![
        Value::Struct(point),
        Value::vector(&q.wo),
        Value::vector(wl),
        Value::vector(&q.u),
    ];
    let evaluate = &program.compiled()[0].evaluate;
    let run = |run: &mut Interpreter<'static, F>| run.run(evaluate, args);
    let out = kept::interpreter(program.ir(), run).expect("fuel");
    let field = |i: usize| out.field(i).expect("field").to_f64();
    (field(0), field(1)[0], field(2), field(3)[0], field(4))
}

#[test]
fn answers_are_finite_and_not_negative() {
    for file in files() {
        let program = program(&file);
        let mut n = Numbers(1);
        for _ in 0..300 {
            let q = Query::new(&mut n);
            let wl = n.direction();
            for (bits, answer) in [
                (64, ask::<f64>(program, &q, &wl)),
                (32, ask::<f32>(program, &q, &wl)),
            ] {
                let (wi, pdf, throughput, light_pdf, light) = answer;
                let values = wi
                    .iter()
                    .chain([&pdf, &light_pdf])
                    .chain(&throughput)
                    .chain(&light);
                assert!(
                    values.clone().all(|v| v.is_finite()),
                    "{} in f{bits}: {:?}",
                    file.display(),
                    values.collect::<Vec<_>>()
                );
                let light_values = throughput.iter().chain(&light).chain([&pdf, &light_pdf]);
                assert!(
                    light_values.clone().all(|v| *v >= 0.0),
                    "{} in f{bits}: negative",
                    file.display()
                );
            }
        }
    }
}

#[test]
fn a_sampled_direction_and_a_lights_get_one_answer() {
    for file in files() {
        let program = program(&file);
        let mut n = Numbers(2);
        let mut continuous = 0;
        for _ in 0..300 {
            let q = Query::new(&mut n);
            let (wi, pdf, throughput, ..) = ask::<f64>(program, &q, &[0.0; 3]);
            if pdf > 0.0 && throughput.iter().any(|t| *t > 0.0) {
                continuous += 1;
                let (_, _, _, light_pdf, light) = ask::<f64>(program, &q, &wi);
                let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
                assert!(
                    same(light_pdf, pdf),
                    "{}: pdf {pdf} and {light_pdf}",
                    file.display()
                );
                for c in 0..3 {
                    assert!(
                        same(light[c], throughput[c] * pdf),
                        "{}: value",
                        file.display()
                    );
                }
            }
        }
        let info = &program.infos()[0];
        assert_eq!(
            continuous == 0,
            info.delta_only,
            "{}: {continuous} continuous samples",
            file.display()
        );
    }
}

#[test]
fn no_material_makes_light() {
    for file in files() {
        let program = program(&file);
        let mut n = Numbers(3);
        for _ in 0..5 {
            let mut q = Query::new(&mut n);
            q.wo[2] = q.wo[2].abs();
            let samples = 1000;
            let mut sum = [0.0; 3];
            for _ in 0..samples {
                q.u = std::array::from_fn(|_| n.next());
                let (_, _, throughput, ..) = ask::<f64>(program, &q, &[0.0; 3]);
                (0..3).for_each(|c| sum[c] += throughput[c]);
            }
            let albedo = sum.map(|s| s / f64::from(samples));
            // Three standard deviations of the mean are about 0.05 with weights below 2.
            assert!(
                albedo.iter().all(|a| *a < 1.06),
                "{} reflects {albedo:?} towards {:?}",
                file.display(),
                q.wo
            );
        }
    }
}

#[test]
fn single_precision_agrees_with_double() {
    for file in files() {
        let program = program(&file);
        let mut n = Numbers(4);
        let (mut compared, mut differing) = (0, 0);
        for _ in 0..200 {
            let q = Query::new(&mut n);
            let wl = n.direction();
            let (a, b) = (ask::<f64>(program, &q, &wl), ask::<f32>(program, &q, &wl));
            for (x, y) in a.4.iter().chain([&a.3]).zip(b.4.iter().chain([&b.3])) {
                compared += 1;
                differing += usize::from((x - y).abs() > 1e-3 * x.abs().max(1e-3));
            }
        }
        // A pattern has edges (a flake, a tile, a Voronoi cell) that rounding moves, but few; only
        // a fractal has many.
        assert!(
            differing * 10 <= compared,
            "{}: {differing} of {compared} differ",
            file.display()
        );
    }
}
