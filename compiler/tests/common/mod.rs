//! Compiling texts in tests.

pub mod answered;
pub mod asked;
pub mod kept;
pub mod listed;
pub mod record;

use impasto_compiler::{Compilation, MaterialRequest, MemoryLoader, Program, compile, diag};

/// Compiles the only material of `text` with parameters.
pub fn compilation(text: &str, params: &[(&str, &str)]) -> Compilation {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let params = params
        .iter()
        .map(|(n, v)| ((*n).to_owned(), (*v).into()))
        .collect();
    let request = MaterialRequest {
        params,
        ..MaterialRequest::new("m", "m.impasto")
    };
    compile(&[request], &mut files)
}

/// The program of a text that must compile.
pub fn program(text: &str) -> Program {
    let compiled = compilation(text, &[]);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled
        .program
        .unwrap_or_else(|| panic!("{text}\n{problems}"))
}

/// The WGSL of a text that must compile.
#[allow(dead_code)]
pub fn wgsl(text: &str) -> String {
    program(text).wgsl(&[0])
}

/// Ids of the diagnostics of a text.
#[allow(dead_code)]
pub fn codes(text: &str, params: &[(&str, &str)]) -> Vec<&'static str> {
    compilation(text, params)
        .diagnostics
        .iter()
        .map(|d| d.code.id())
        .collect()
}
