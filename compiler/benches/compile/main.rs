//! From source text to validated WGSL: the time an artist waits for each file of `materials/`, and
//! the time a scene of a thousand materials waits, all of them distinct. `compile` generates the
//! text and has naga validate it.
//!
//! `cargo bench -p impasto-compiler --bench compile` prints where the time goes, stage by stage;
//! with `-- growth`, how it grows with the number of lobes; with a filter, `-- compile/`, criterion
//! measures all that match.

// Tables are what this program is for.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group};
use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, compile, diag};

mod stages;

/// That of the command.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

/// Every material of the folder, found by walking it.
fn materials(c: &mut Criterion) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .expect("materials")
        .flatten()
        .map(|e| e.path())
        .collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    let mut group = c.benchmark_group("compile");
    group
        .sample_size(20)
        .measurement_time(std::time::Duration::from_secs(2));
    for file in files {
        let name = file
            .file_stem()
            .expect("name")
            .to_string_lossy()
            .into_owned();
        let request = [MaterialRequest::new(&name, file.to_string_lossy())];
        group.bench_function(&name, |b| {
            b.iter(|| {
                let compilation = compile(black_box(&request), &mut Files);
                assert!(compilation.program.is_some(), "{name} does not compile");
                black_box(compilation.program)
            });
        });
    }
}

/// Numbers that look random and are the same in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    /// From 0.01 to 0.99.
    fn fraction(&mut self) -> f64 {
        (1 + self.below(98)) as f64 / 100.0
    }
}

/// A material that is unlike the others: one to three layers over patterns.
fn generated(index: usize, n: &mut Numbers) -> String {
    let pattern = |n: &mut Numbers| {
        let scale = 1 + n.below(40);
        match n.below(4) {
            0 => format!("0.5 + 0.5 * perlin(position * {scale}.0)"),
            1 => format!("fractal(position * {scale}.0, octaves: {})", 2 + n.below(5)),
            2 => format!("checker(uv * {scale}.0)"),
            _ => format!("cell(position * {scale}.0)"),
        }
    };
    let base = |n: &mut Numbers| match n.below(3) {
        0 => format!("diffuse(mix(color({}), tint, p))", n.fraction()),
        1 => format!("metal(reflectance: tint, roughness: {} * p)", n.fraction()),
        _ => "fresnel_diffuse(tint, color(p))".to_owned(),
    };
    let top = |n: &mut Numbers| match n.below(3) {
        0 => format!("mirror(1.{})", 1 + n.below(8)),
        1 => format!(
            "{} * blinn_phong(exponent: {}.0)",
            n.fraction(),
            1 + n.below(500)
        ),
        _ => format!("q * metal(reflectance: {}, roughness: 0.2)", n.fraction()),
    };
    let mut layers: Vec<String> = (0..n.below(3)).map(|_| top(n)).collect();
    layers.push(base(n));
    let surface = match layers.as_slice() {
        [only] => only.clone(),
        all => format!("layer({})", all.join(", ")),
    };
    format!(
        "use std::bsdf::{{blinn_phong, diffuse, fresnel_diffuse, metal, mirror}};
         use std::noise::{{cell, fractal, perlin}};
         use std::pattern::checker;
         fn shade(x: float) -> float = saturate(x * {} + {});
         material generated_{index} {{
             param tint: color = color({}, {}, {});
             let p = shade({});
             let q = shade({});
             surface = {surface};
         }}",
        n.fraction(),
        n.fraction(),
        n.fraction(),
        n.fraction(),
        n.fraction(),
        pattern(n),
        pattern(n),
    )
}

/// A thousand distinct materials in as many files.
fn thousand(c: &mut Criterion) {
    let mut files = MemoryLoader::default();
    let mut requests = Vec::new();
    let mut numbers = Numbers(1);
    for i in 0..1000 {
        let file = format!("generated_{i}.impasto");
        files.add(file.as_str(), generated(i, &mut numbers));
        requests.push(MaterialRequest::new(format!("m{i}"), file));
    }
    let mut group = c.benchmark_group("compile");
    group.sample_size(10);
    group.bench_function("thousand", |b| {
        b.iter(|| {
            let compilation = compile(black_box(&requests), &mut files);
            let problems =
                diag::render::text(&compilation.sources, &compilation.diagnostics, false);
            let program = compilation.program.unwrap_or_else(|| panic!("{problems}"));
            assert_eq!(program.materials().len(), 1000);
        });
    });
}

criterion_group!(benches, materials, thousand);

fn main() {
    // Cargo adds `--bench`.
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    match args.as_slice() {
        // Only the tables, unless a filter asks for others.
        [] => stages::table(),
        [growth] if growth == "growth" => stages::growth(),
        [once, name] if once == stages::ONCE => stages::once(name),
        _ => {
            benches();
            Criterion::default().configure_from_args().final_summary();
        }
    }
}
