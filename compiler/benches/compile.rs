//! From source text to validated WGSL, per material file: the time an artist waits. `compile`
//! generates the text and has naga validate it.
//!
//! `cargo bench -p impasto-compiler`

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use impasto_compiler::{Loader, MaterialRequest, compile};

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

criterion_group!(benches, materials);
criterion_main!(benches);
