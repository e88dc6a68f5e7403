//! Every diagnostic, checked against markers in the sources that provoke it.
//!
//! `//~ E0201 text` says that a diagnostic with this code starts on this line and mentions the
//! text; `//~^` is about the line above, `//~?` about no line of this file. Every diagnostic
//! needs a marker and every marker a diagnostic. `//@ param NAME = VALUE` and
//! `//@ material NAME` compile the file the way a scene would.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use impasto::FileLoader;
use impasto::compiler::diag::{Code, Diagnostic};
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, MaterialRequest};

/// Codes that no source can provoke, and why.
const INTERNAL: [Code; 14] = [
    Code::InvalidWgsl, // a defect of the compiler itself
    Code::NotExported, // of the command `export`, whose tests provoke it
    Code::NotSound,    // this and what follows of the command `test`, as do its tests and examples
    Code::MakesLight,
    Code::WrongDensity,
    Code::Imprecise,
    Code::NotReciprocal,
    Code::BrokenPromise,
    Code::UnreadPromise,
    Code::NotEvaluated,
    Code::FailedAssertion,
    Code::SnapshotDiffers,
    Code::NoSnapshot,
    Code::BadSnapshot,
];

#[test]
fn diagnostics_are_those_that_are_marked() {
    let differences: Vec<String> = cases().iter().flat_map(|case| differences(case)).collect();
    assert!(differences.is_empty(), "\n{}", differences.join("\n"));
}

#[test]
fn every_code_is_provoked() {
    let marked = cases().into_iter().flat_map(|path| {
        let text = std::fs::read_to_string(path).expect("a case is readable");
        markers(&text).into_iter().map(|marker| marker.code)
    });
    let generated = generated()
        .into_iter()
        .map(|case| case.code.id().to_owned());
    let provoked: BTreeSet<String> = marked.chain(generated).collect();
    let expected = Code::ALL.iter().filter(|code| !INTERNAL.contains(code));
    let missing: Vec<&str> = expected
        .map(|code| code.id())
        .filter(|id| !provoked.contains(*id))
        .collect();
    assert!(missing.is_empty(), "no test provokes {missing:?}");
}

#[test]
fn inputs_that_are_no_sources_are_errors() {
    for case in generated() {
        let checked = compiler::check("input.impasto", &mut Memory(&case.bytes));
        let codes: Vec<&str> = checked.diagnostics.iter().map(|d| d.code.id()).collect();
        assert_eq!(codes, [case.code.id()], "{}", case.name);
    }
}

#[test]
fn modules_that_import_each_other_are_an_error() {
    struct Circle;
    impl Loader for Circle {
        fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
            match path {
                "a.impasto" => Ok(b"use b::g;\nfn f() -> float = g();\n".to_vec()),
                "b.impasto" => Ok(b"use a::f;\nfn g() -> float = f();\n".to_vec()),
                other => Err(format!("no file {other}")),
            }
        }
    }
    let checked = compiler::check("a.impasto", &mut Circle);
    let codes: BTreeSet<Code> = checked.diagnostics.iter().map(|d| d.code).collect();
    assert!(codes.contains(&Code::ImportCycle), "{codes:?}");
}

/// An input too large or too odd to keep as a file.
struct Generated {
    name: &'static str,
    bytes: Vec<u8>,
    code: Code,
}

fn generated() -> Vec<Generated> {
    let case = |name, bytes, code| Generated { name, bytes, code };
    let nested = |depth: usize| {
        let (open, close) = ("(".repeat(depth), ")".repeat(depth));
        format!("fn f() -> float = {open}1.0{close};").into_bytes()
    };
    vec![
        case(
            "10 MB of spaces",
            vec![b' '; 10 << 20],
            Code::SourceTooLarge,
        ),
        case(
            "binary",
            vec![0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0, 1],
            Code::InvalidUtf8,
        ),
        case("100,000 parentheses", nested(100_000), Code::NestedTooDeep),
    ]
}

/// One text under every name.
struct Memory<'a>(&'a [u8]);

impl Loader for Memory<'_> {
    fn load(&mut self, _: &str) -> Result<Vec<u8>, String> {
        Ok(self.0.to_vec())
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnostics")
}

/// Every file of the folder, in the order of their names.
fn cases() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).expect("the folder of cases");
    let paths = entries.map(|entry| entry.expect("a folder entry").path());
    let mut cases: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "impasto"))
        .collect();
    cases.sort();
    assert!(!cases.is_empty(), "no cases in {}", folder().display());
    cases
}

/// A diagnostic that a source announces.
#[derive(Debug)]
struct Marker {
    line: Option<usize>,
    code: String,
    text: String,
}

fn markers(source: &str) -> Vec<Marker> {
    let lines = source.lines().enumerate();
    let on_line = |(index, line): (usize, &str)| {
        let marks = line.split("//~").skip(1);
        marks
            .map(|mark| marker(index + 1, mark))
            .collect::<Vec<_>>()
    };
    lines.flat_map(on_line).collect()
}

fn marker(line: usize, mark: &str) -> Marker {
    let (line, mark) = match mark.strip_prefix('?') {
        Some(rest) => (None, rest),
        None => {
            let rest = mark.trim_start_matches('^');
            (Some(line - (mark.len() - rest.len())), rest)
        }
    };
    let (code, text) = mark.trim().split_once(' ').unwrap_or((mark.trim(), ""));
    assert!(
        Code::from_id(code).is_some(),
        "a marker names the unknown code `{code}`"
    );
    let text = text.trim().to_owned();
    let code = code.to_owned();
    Marker { line, code, text }
}

/// The request that a file's directives describe, if it has any.
fn request(name: &str, source: &str) -> Option<MaterialRequest> {
    let directives: Vec<&str> = source
        .lines()
        .filter_map(|l| l.strip_prefix("//@ "))
        .collect();
    let params = directives.iter().filter_map(|d| d.strip_prefix("param "));
    let params = params.map(|param| {
        let (name, value) = param.split_once('=').expect("//@ param NAME = VALUE");
        (name.trim().to_owned(), value.trim().into())
    });
    let material = directives.iter().find_map(|d| d.strip_prefix("material "));
    (!directives.is_empty()).then(|| MaterialRequest {
        material: material.map(|m| m.trim().to_owned()),
        params: params.collect(),
        ..MaterialRequest::new("probe", name)
    })
}

/// Where the diagnostics of a file and its markers differ.
fn differences(path: &Path) -> Vec<String> {
    let source = std::fs::read_to_string(path).expect("a case is readable");
    let name = path
        .file_name()
        .expect("a file")
        .to_string_lossy()
        .into_owned();
    let mut loader = FileLoader::new(folder());
    let (sources, diagnostics) = match request(&name, &source) {
        Some(request) => {
            let compiled = compiler::compile(&[request], &mut loader);
            (compiled.sources, compiled.diagnostics)
        }
        None => {
            let checked = compiler::check(&name, &mut loader);
            (checked.sources, checked.diagnostics)
        }
    };
    let mut unmet = markers(&source);
    let mut differences = Vec::new();
    for diagnostic in &diagnostics {
        let line = line_of(diagnostic, &sources, &name);
        let text = text_of(diagnostic);
        let code = diagnostic.code.id();
        let fits = |m: &Marker| m.line == line && m.code == code && text.contains(&m.text);
        match unmet.iter().position(fits) {
            Some(index) => drop(unmet.remove(index)),
            None => {
                let line = line.map_or("?".into(), |l| l.to_string());
                differences.push(format!("{name}:{line}: not marked: {code} {text}"));
            }
        }
    }
    differences.extend(unmet.into_iter().map(|m| {
        let line = m.line.map_or("?".into(), |l| l.to_string());
        format!("{name}:{line}: not reported: {} {}", m.code, m.text)
    }));
    differences
}

/// The line of `name` that a diagnostic starts on.
fn line_of(diagnostic: &Diagnostic, sources: &SourceMap, name: &str) -> Option<usize> {
    let span = diagnostic.span?;
    let here = sources.file(span.file).name == name;
    here.then(|| sources.line_column(span).0)
}

fn text_of(diagnostic: &Diagnostic) -> String {
    let parts = [
        Some(&diagnostic.message),
        diagnostic.expected.as_ref(),
        diagnostic.hint.as_ref(),
    ];
    let parts: Vec<&str> = parts.into_iter().flatten().map(String::as_str).collect();
    parts.join(" | ")
}
