//! The GPU computes what the interpreter computes: every material in `materials/`, found by
//! walking the folder, asked at random points on both.
//!
//! One definition of each BSDF and noise gives both sides, so a difference is a defect of code
//! generation, of an op's WGSL, or of a driver.

use std::path::{Path, PathBuf};

use crate::support::{Random, Row, floats, points, row, run};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::{Loader, MaterialRequest, Program, compile, diag};
use impasto_runtime::wgsl::ShaderPart;

const QUERIES: usize = 400;
/// Rows of input and output a query.
const ASKED: usize = 5;
const ANSWERED: usize = 3;

/// What the interpreter gives for a texture, and the stand-in below as well.
const TEXTURE: &str =
    "fn texture_fetch(slot: u32, uv: vec2<f32>) -> vec4<f32> { return vec4<f32>(0.5); }
    fn texture_fetch_as(slot: u32, uv: vec2<f32>, mode: i32) -> vec4<f32> { return vec4<f32>(0.5); }
    ";

const BODY: &str = "
    let p = bitcast<vec4<f32>>(input[i * 5u]);
    let q = bitcast<vec4<f32>>(input[i * 5u + 1u]);
    let wo = bitcast<vec4<f32>>(input[i * 5u + 2u]).xyz;
    let wl = bitcast<vec4<f32>>(input[i * 5u + 3u]).xyz;
    let u = bitcast<vec4<f32>>(input[i * 5u + 4u]);
    let up = vec3<f32>(0.0, 0.0, 1.0);
    let point = SurfacePoint(p.xyz, up, up, vec3<f32>(1.0, 0.0, 0.0), q.xy, 1.0REST);
    let s = evaluate_material(0u, point, wo, wl, u);
    result[i * 3u] = bitcast<vec4<u32>>(vec4<f32>(s.wi, s.pdf));
    result[i * 3u + 1u] = bitcast<vec4<u32>>(vec4<f32>(s.throughput, s.light_pdf));
    result[i * 3u + 2u] = bitcast<vec4<u32>>(vec4<f32>(s.light_throughput, s.transmitted));";

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let entries = std::fs::read_dir(folder).expect("materials").flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    assert!(files.len() >= 5, "only {} materials", files.len());
    files
}

fn program(file: &Path) -> Program {
    let request = MaterialRequest::new("m", file.to_string_lossy());
    let compiled = compile(&[request], &mut Files);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled
        .program
        .unwrap_or_else(|| panic!("{}\n{problems}", file.display()))
}

/// Random questions; every fourth asks from inside, some at grazing angles.
fn questions() -> Vec<Row> {
    let mut random = Random::new(7);
    let mut rows = Vec::new();
    for i in 0..QUERIES {
        let position = random.point(-2.0, 2.0);
        let mut wo = random.direction();
        wo.z = wo.z.abs().max(1e-3) * if i % 4 == 0 { -1.0 } else { 1.0 };
        let (wo, wl) = (wo.normalize(), random.direction());
        rows.push(row(position.extend(0.0).into()));
        rows.push(row([random.uniform(), random.uniform(), 0.0, 0.0]));
        rows.push(row(wo.extend(0.0).into()));
        rows.push(row(wl.extend(0.0).into()));
        rows.push(row([(); 4].map(|()| random.uniform())));
    }
    rows
}

/// The interpreter's answer in single precision, in the order of the GPU's.
fn interpreted<'a>(run: &mut Interpreter<'a, f32>, program: &'a Program, rows: &[Row]) -> Vec<f64> {
    let wide = |i: usize, n: usize| -> Value<f32> {
        let values: Vec<f64> = floats(rows[i]).iter().map(|&x| f64::from(x)).collect();
        Value::vector(&values[..n])
    };
    let up = || Value::vector(&[0.0, 0.0, 1.0]);
    let along = Value::vector(&[1.0, 0.0, 0.0]);
    let mut point = vec![wide(0, 3), up(), up(), along, wide(1, 2), Value::float(1.0)];
    point.extend(points::values(program, &wide(0, 3), &wide(2, 3)));
    let args = vec![Value::Struct(point), wide(2, 3), wide(3, 3), wide(4, 4)];
    let answer = run
        .run(&program.compiled()[0].evaluate, args)
        .expect("ends");
    let fields = (0..6).map(|i| answer.field(i).expect("six fields").to_f64());
    fields.flatten().collect()
}

#[test]
fn gpu_and_interpreter_agree() {
    let asked = questions();
    for file in files() {
        let program = program(&file);
        let mut wgsl = program.wgsl(&[0]);
        if !program.textures().is_empty() {
            wgsl.push_str(TEXTURE);
        }
        let mut interpreter = Interpreter::new(program.ir(), u64::MAX);
        let part = ShaderPart {
            wgsl,
            buffers: Vec::new(),
        };
        let body = BODY.replace("REST", &points::arguments(&program));
        let answered = run(&[&part], &body, &asked, QUERIES, QUERIES * ANSWERED);
        let mut differing = 0;
        let mut lit = 0;
        for i in 0..QUERIES {
            let expected = interpreted(&mut interpreter, &program, &asked[i * ASKED..][..ASKED]);
            let rows = &answered[i * ANSWERED..][..ANSWERED];
            let found = rows.iter().flat_map(|r| floats(*r)).map(f64::from);
            lit += usize::from(expected[4..7].iter().any(|t| *t > 0.0));
            let near = |(a, b): (f64, &f64)| (a - b).abs() <= 2e-3 * b.abs().max(0.01);
            differing += usize::from(!found.zip(&expected).all(near));
        }
        // Where a pattern has an edge or a lobe is chosen, rounding can decide otherwise; a
        // fractal is all edge.
        assert!(
            differing * 12 <= QUERIES,
            "{}: {differing} of {QUERIES} answers differ",
            file.display()
        );
        let scatters = program.infos()[0].lobes > 0;
        assert_eq!(lit * 4 > QUERIES, scatters, "{}: {lit}", file.display());
    }
}
