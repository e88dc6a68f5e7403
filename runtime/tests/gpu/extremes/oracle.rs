//! Generated code on the GPU, in single precision, against the interpreter in double precision:
//! every BSDF of the library with the values that its documentation asks to try, and every
//! material in `materials/`.
//!
//! Value and density are asked for a light's direction, which no random choice decides about.

use std::path::PathBuf;

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, Program, compile, diag};
use impasto_runtime::wgsl::ShaderPart;
use impasto_verify::promise::promise;

use crate::library;
use crate::record::{Bound, Row, effort};
use crate::support::{Random, Row as Words, floats, points, row, run};

/// The greatest relative error that is fine where a BSDF's documentation promises nothing.
const FINE: f64 = 1e-3;

/// By how much a GPU may exceed what is stated of regions: it contracts and reorders.
const REORDERED: f64 = 3.0;

const BODY: &str = "
    let p = bitcast<vec4<f32>>(input[i * 3u]);
    let wo = bitcast<vec4<f32>>(input[i * 3u + 1u]).xyz;
    let wl = bitcast<vec4<f32>>(input[i * 3u + 2u]).xyz;
    let up = vec3<f32>(0.0, 0.0, 1.0);
    let point = SurfacePoint(p.xyz, up, up, vec3<f32>(1.0, 0.0, 0.0), p.xy, 1.0REST);
    let s = evaluate_material(0u, point, wo, wl, vec4<f32>(0.5));
    result[i] = bitcast<vec4<u32>>(vec4<f32>(s.light_throughput, s.light_pdf));";

/// What the interpreter gives for a texture, and the stand-in below as well.
const TEXTURE: &str =
    "fn texture_fetch(slot: u32, uv: vec2<f32>) -> vec4<f32> { return vec4<f32>(0.5); }
    fn texture_fetch_as(slot: u32, uv: vec2<f32>, mode: i32) -> vec4<f32> { return vec4<f32>(0.5); }
    ";

/// Point, direction of view and of light; every fourth question is about transmission, every
/// other about directions near mirroring, where lobes are.
fn questions(count: usize) -> Vec<Words> {
    let mut random = Random::new(41);
    let mut rows = Vec::new();
    for i in 0..count {
        let mut wo = random.direction();
        wo.z = wo.z.abs().max(0.02) * if i % 8 == 7 { -1.0 } else { 1.0 };
        let wo = wo.normalize();
        let mut wl = match i % 2 {
            0 => random.direction(),
            _ => (glam::Vec3::new(-wo.x, -wo.y, wo.z)
                + 0.2 * random.uniform() * random.direction())
            .normalize(),
        };
        if wl.z.abs() < 0.02 {
            wl = glam::Vec3::Z;
        }
        let position = random.point(-2.0, 2.0);
        rows.push(row(position.extend(0.0).into()));
        rows.push(row(wo.extend(0.0).into()));
        rows.push(row(wl.extend(0.0).into()));
    }
    rows
}

/// The oracle's answer: value in three channels, and density.
fn exact<'a>(
    interpreter: &mut Interpreter<'a, f64>,
    program: &'a Program,
    rows: &[Words],
) -> [f64; 4] {
    let wide = |row: Words, n: usize| {
        let values: Vec<f64> = floats(row).iter().map(|&x| f64::from(x)).collect();
        Value::<f64>::vector(&values[..n])
    };
    let up = || Value::vector(&[0.0, 0.0, 1.0]);
    let mut point = vec![
        wide(rows[0], 3),
        up(),
        up(),
        Value::vector(&[1.0, 0.0, 0.0]),
        wide(rows[0], 2),
        Value::float(1.0),
    ];
    point.extend(points::values(
        program,
        &wide(rows[0], 3),
        &wide(rows[1], 3),
    ));
    let args = vec![
        Value::Struct(point),
        wide(rows[1], 3),
        wide(rows[2], 3),
        Value::vector(&[0.5; 4]),
    ];
    let answer = interpreter
        .run(&program.compiled()[0].evaluate, args)
        .expect("ends");
    let field = |i: usize| answer.field(i).expect("a field").to_f64();
    let (pdf, value) = (field(3), field(4));
    [value[0], value[1], value[2], pdf[0]]
}

/// The greatest relative error of a program's answers, where it is, and how many are not near.
fn worst(program: &Program, asked: &[Words], near: f64) -> (f64, String, usize) {
    let mut wgsl = program.wgsl(&[0]);
    if !program.textures().is_empty() {
        wgsl.push_str(TEXTURE);
    }
    let part = ShaderPart {
        wgsl,
        buffers: Vec::new(),
    };
    let count = asked.len() / 3;
    let body = BODY.replace("REST", &points::arguments(program));
    let answers = run(&[&part], &body, asked, count, count);
    let mut interpreter = Interpreter::new(program.ir(), u64::MAX);
    let (mut worst, mut place, mut far) = (0.0, String::from("nowhere"), 0);
    for (rows, answer) in asked.chunks(3).zip(answers) {
        let (exact, found) = (
            exact(&mut interpreter, program, rows),
            floats(answer).map(f64::from),
        );
        // Where next to nothing of what comes is reflected, relative errors say nothing of pictures.
        let least = 1e-3 * exact[3].max(1.0);
        let error = |k: usize| (found[k] - exact[k]).abs() / exact[k].abs().max(least);
        let error = (0..4)
            .map(error)
            .fold(0.0, |a: f64, b| if b <= a { a } else { b });
        far += usize::from(error.is_nan() || error > near);
        if error.is_nan() || error > worst {
            worst = error;
            place = format!(
                "wo {:?}, wi {:?}",
                &floats(rows[1])[..3],
                &floats(rows[2])[..3]
            );
        }
    }
    (worst, place, far)
}

fn program(request: MaterialRequest, files: &mut impl Loader) -> Program {
    let name = request.file.clone();
    let compiled = compile(&[request], files);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled
        .program
        .unwrap_or_else(|| panic!("{name}\n{problems}"))
}

#[test]
fn every_bsdf_of_the_library_computes_what_it_says() {
    let asked = questions(effort(200, 3000));
    for file in impasto_stdlib::folder("bsdf") {
        let name = file.name;
        let documented = library::documented(name, file.text, &[]);
        let stated = documented.lines.iter();
        let stated = stated.filter_map(|l| promise(l, "Region:"));
        let promised = stated.fold(FINE, |a, b| a.max(REORDERED * b));
        // The default and one from the middle; all of them where time is no concern.
        let all = documented.calls.len();
        let calls = match effort(0, 1) {
            0 => vec![0, all / 2],
            _ => (0..all).collect(),
        };
        let mut most = (0.0, String::new(), 0);
        for call in calls.into_iter().map(|i| &documented.calls[i]) {
            let mut files = MemoryLoader::default();
            files.add(
                "m.impasto",
                format!("use std::bsdf::{name};\nmaterial m {{ surface = {name}({call}); }}\n"),
            );
            let program = program(MaterialRequest::new("m", "m.impasto"), &mut files);
            let found = worst(&program, &asked, promised);
            if found.0.is_nan() || found.0 > most.0 {
                most = (found.0, format!("{name}({call}): {}", found.1), found.2);
            }
        }
        let good = Row {
            table: "precision",
            subject: name,
            what: "GPU in single against double precision, relative error of value and density",
            worst: most.0,
            bound: Bound::AtMost(promised),
            place: &most.1,
        }
        .note();
        assert!(good, "{name}: {:e}, {} answers, {}", most.0, most.2, most.1);
    }
}

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

/// Materials have edges of patterns, where rounding decides which side a point is on: what is told
/// is the share of answers that are not near.
#[test]
fn every_material_computes_what_it_says() {
    let asked = questions(effort(200, 3000));
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let entries = std::fs::read_dir(folder).expect("materials").flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    assert!(files.len() >= 20, "only {} materials", files.len());
    for file in files {
        let name = file.file_stem().and_then(|n| n.to_str()).expect("a name");
        let program = program(
            MaterialRequest::new("m", file.to_string_lossy()),
            &mut Files,
        );
        let (_, place, far) = worst(&program, &asked, 2e-3);
        let share = far as f64 / (asked.len() / 3) as f64;
        let good = Row {
            table: "precision",
            subject: name,
            what: "GPU in single against double precision, share of answers off by more than 0.002",
            worst: share,
            // A fractal is all edge.
            bound: Bound::AtMost(0.08),
            place: &place,
        }
        .note();
        assert!(good, "{name}: {share}, {place}");
    }
}
