//! `impasto explain`: every code has an example that really provokes it, and a repaired one about
//! which the compiler has nothing to say.

use impasto_compiler::diag::examples::{Example, FILE};
use impasto_compiler::diag::{Code, Diagnostic, render};
use impasto_compiler::format::format;
use impasto_compiler::instance::instance;
use impasto_compiler::source::SourceMap;
use impasto_compiler::{MaterialRequest, MemoryLoader, check, compile};
use impasto_verify::check::Options;

/// Checks an example by itself, and compiles it if it is a material's, or if none was found.
fn found(example: &Example, code: Code) -> (SourceMap, Vec<Diagnostic>) {
    let mut files = MemoryLoader::default();
    for (name, text) in &example.files {
        files.add(name, &**text);
    }
    files.add(FILE, example.bytes());
    let checked = check(FILE, &mut files);
    let request = MaterialRequest {
        params: example
            .params
            .iter()
            .map(|(n, v)| (n.clone(), v.as_str().into()))
            .collect(),
        ..MaterialRequest::new("example", FILE)
    };
    if code.id().starts_with("E05") {
        return tested(&mut files);
    }
    if code == Code::NotExported {
        let found = instance(&request, &mut files);
        return (found.sources, found.diagnostics);
    }
    if code != Code::NoMaterial && example.params.is_empty() {
        return (checked.sources, checked.diagnostics);
    }
    let compiled = compile(&[request], &mut files);
    (compiled.sources, compiled.diagnostics)
}

/// What `impasto test` finds.
fn tested(files: &mut MemoryLoader) -> (SourceMap, Vec<Diagnostic>) {
    let mut file = impasto_verify::check::read(FILE, files);
    let mut found = std::mem::take(&mut file.diagnostics);
    for subject in &file.subjects {
        let verdict = impasto_verify::check::examine(&file, subject, files, Options::default());
        found.extend(verdict.diagnostics);
    }
    (file.sources, found)
}

/// Codes without an example: what no source can provoke, or none in a second.
fn has_example(code: Code) -> bool {
    // What needs more than one source has none.
    let kept = [Code::SnapshotDiffers, Code::NoSnapshot, Code::BadSnapshot];
    ![Code::InvalidWgsl, Code::NotEvaluated].contains(&code) && !kept.contains(&code)
}

#[test]
fn every_example_provokes_its_code_and_no_error_besides() {
    let mut wrong = Vec::new();
    for code in Code::ALL.iter().copied().filter(|c| has_example(*c)) {
        let id = code.id();
        let Some((broken, _)) = code.example() else {
            wrong.push(format!("{id} has no example"));
            continue;
        };
        let (sources, diagnostics) = found(&broken, code);
        let comes = diagnostics.iter().any(|d| d.code == code);
        // What could not be imported is not known, either.
        let imports = id.starts_with("E02");
        let follows = |d: &Diagnostic| imports && d.code == Code::UnknownName;
        let others = |d: &Diagnostic| d.is_error() && d.code != code && !follows(d);
        let others = diagnostics.iter().any(others);
        if !comes || others {
            let shown = render::text(&sources, &diagnostics, false);
            wrong.push(format!("{id} comes: {comes}, others: {others}\n{shown}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_repaired_example_is_right() {
    for code in Code::ALL.iter().copied().filter(|c| has_example(*c)) {
        let (broken, repaired) = code.example().expect("an example");
        assert_ne!(broken, repaired, "{}", code.id());
        let (sources, diagnostics) = found(&repaired, code);
        let shown = render::text(&sources, &diagnostics, false);
        assert!(diagnostics.is_empty(), "{}:\n{shown}", code.id());
        for (name, text) in &repaired.files {
            let file = SourceMap::default().add(&**name, &**text);
            assert_eq!(format(file, text).as_deref(), Ok(&**text), "{}", code.id());
        }
    }
}

#[test]
fn the_page_has_every_code() {
    let page = impasto_compiler::diag::examples::page();
    for code in Code::ALL {
        assert!(
            page.contains(&format!("\n## {}\n", code.id())),
            "{}",
            code.id()
        );
    }
}
