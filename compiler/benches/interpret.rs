//! Samples of a material a second on one core: what the interpreter makes of car paint, its
//! noise included, in both precisions. Numerics tests take millions of them.
//!
//! `cargo bench -p impasto-compiler --bench interpret`: about 85,000 a second in f64 and in
//! f32 (12 us each) on one core of a server whose other work takes turns with it.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::{Loader, MaterialRequest, Program, compile};

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

fn program() -> Program {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials/car_paint.impasto");
    let request = [MaterialRequest::new("car_paint", file.to_string_lossy())];
    compile(&request, &mut Files).program.expect("compiles")
}

/// Points along a line, so that flakes are hit and missed.
fn arguments<F: Real>(k: u32) -> Vec<Value<F>> {
    let t = f64::from(k % 1009) / 1009.0;
    let z = || Value::vector(&[0.0, 0.0, 1.0]);
    let along = Value::vector(&[1.0, 0.0, 0.0]);
    let position = Value::vector(&[t, 0.37 * t, 0.11]);
    vec![
        Value::Struct(vec![
            position,
            z(),
            z(),
            along,
            Value::vector(&[t, 0.5]),
            Value::float(1.0),
        ]),
        Value::vector(&[0.6, 0.0, 0.8]),
        Value::vector(&[0.0, 0.6, 0.8]),
        Value::vector(&[t, 0.3, 0.7, 0.1]),
    ]
}

fn sample<F: Real>(c: &mut Criterion, name: &str) {
    let program = program();
    let material = &program.compiled()[0].evaluate;
    let mut group = c.benchmark_group("interpret/car_paint");
    group.throughput(Throughput::Elements(1));
    group.bench_function(name, |b| {
        let mut run = Interpreter::<F>::new(program.ir(), u64::MAX);
        let mut k = 0;
        b.iter(|| {
            k += 1;
            black_box(run.run(material, arguments(k)))
        });
    });
    group.finish();
}

fn both(c: &mut Criterion) {
    sample::<f64>(c, "f64");
    sample::<f32>(c, "f32");
}

criterion_group!(benches, both);
criterion_main!(benches);
