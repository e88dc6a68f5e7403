//! Diagnostics as people and programs see them.

use impasto_compiler::diag::{Code, Diagnostic, render};
use impasto_compiler::source::{FileId, SourceMap, Span};

const TEXT: &str = "material a {\n    let ° = 1.0;\n    surface = diffuse(°);\n}\n";

fn sources() -> (SourceMap, FileId) {
    let mut sources = SourceMap::default();
    let file = sources.add("a.impasto", TEXT);
    sources.add("b.impasto", "// nothing\n");
    (sources, file)
}

fn at(file: FileId, text: &str) -> Span {
    let start = TEXT.find(text).expect("part of the text");
    Span::new(file, start..start + text.len())
}

fn some(file: FileId) -> Vec<Diagnostic> {
    let energy = Diagnostic::new(
        Code::EnergyGain,
        at(file, "surface"),
        "the sum may gain energy",
    );
    let unknown = Diagnostic::new(
        Code::UnknownName,
        at(file, "diffuse"),
        "`diffuse` is unknown",
    )
    .expected("a closure")
    .hint("import it with `use`")
    .label(at(file, "material"), "in this material");
    let elsewhere = Diagnostic::new(Code::NoMaterial, Span::new(FileId(1), 0..10), "no material");
    let nowhere = Diagnostic::without_span(Code::SourceTooLarge, "`c.impasto` is too large");
    vec![elsewhere, unknown.clone(), energy, nowhere, unknown]
}

#[test]
fn text_shows_the_lines() {
    let (sources, file) = sources();
    insta::assert_snapshot!(render::text(&sources, &some(file), false), @r"
    error[E0101]: `c.impasto` is too large

    warning[W0001]: the sum may gain energy
      ┌─ a.impasto:3:5
      │
    3 │     surface = diffuse(°);
      │     ^^^^^^^

    error[E0201]: `diffuse` is unknown
      ┌─ a.impasto:3:15
      │
    1 │ material a {
      │ -------- in this material
    2 │     let ° = 1.0;
    3 │     surface = diffuse(°);
      │               ^^^^^^^
      │
      = expected: a closure
      = hint: import it with `use`

    error[E0109]: no material
      ┌─ b.impasto:1:1
      │
    1 │ // nothing
      │ ^^^^^^^^^^
    ");
}

#[test]
fn color_changes_nothing_but_color() {
    let (sources, file) = sources();
    let colored = render::text(&sources, &some(file), true);
    assert!(colored.contains("\u{1b}["));
    let mut plain = String::new();
    let mut rest = colored.as_str();
    while let Some(start) = rest.find("\u{1b}[") {
        plain += &rest[..start];
        let end = rest[start..].find('m').expect("an escape ends");
        rest = &rest[start + end + 1..];
    }
    plain += rest;
    let trimmed: Vec<&str> = plain.lines().map(str::trim_end).collect();
    let text = render::text(&sources, &some(file), false);
    assert_eq!(trimmed, text.lines().collect::<Vec<_>>());
}

#[test]
fn json_has_the_documented_keys() {
    let (sources, file) = sources();
    let json = render::json(&sources, &some(file));
    let value: serde_json::Value = serde_json::from_str(&json).expect("valid JSON");
    let list = value.as_array().expect("an array");
    let codes: Vec<&str> = list.iter().filter_map(|d| d["code"].as_str()).collect();
    assert_eq!(
        codes,
        ["E0101", "W0001", "E0201", "E0109"],
        "sorted, each once"
    );
    assert!(list[0]["file"].is_null() && list[0]["line"].is_null());
    let unknown = &list[2];
    let expected = serde_json::json!({
        "code": "E0201",
        "severity": "error",
        "message": "`diffuse` is unknown",
        "file": "a.impasto",
        "line": 3,
        "column": 15,
        "end_line": 3,
        "end_column": 22,
        "start": 45,
        "end": 52,
        "expected": "a closure",
        "hint": "import it with `use`",
        "notes": [],
        "labels": [{
            "message": "in this material",
            "file": "a.impasto",
            "line": 1,
            "column": 1,
            "end_line": 1,
            "end_column": 9,
            "start": 0,
            "end": 8,
        }],
        "fixes": [],
    });
    assert_eq!(unknown, &expected);
    assert_eq!(list[1]["severity"], "warning");
}

#[test]
fn the_summary_counts_each_once() {
    let (sources, file) = sources();
    assert_eq!(
        render::summary(&sources, &some(file)),
        "3 errors, 1 warning"
    );
    assert_eq!(render::summary(&sources, &some(file)[..1]), "1 error");
    assert_eq!(render::summary(&sources, &[]), "");
}

/// A generated source may be one line of a megabyte: its diagnostics are still readable.
#[test]
fn a_line_too_long_for_a_terminal_is_not_shown() {
    let mut sources = SourceMap::default();
    let long = "x".repeat(100_000);
    let file = sources.add("long.impasto", long);
    let problem = Diagnostic::new(Code::Syntax, Span::new(file, 5..6), "unexpected `x`").hint("h");
    let text = render::text(&sources, &[problem], false);
    assert_eq!(
        text,
        "long.impasto:1:6: error[E0107]: unexpected `x`\n = hint: h\n\n"
    );
}

/// Spans come from other stages; a wrong one must not take the message away or panic.
#[test]
fn places_outside_the_text_are_brought_inside() {
    let (sources, file) = sources();
    let inside = TEXT.find('°').expect("part of the text") + 1;
    for range in [inside..inside + 1, 500..600, TEXT.len()..TEXT.len(), 0..0] {
        let problem = Diagnostic::new(Code::Syntax, Span::new(file, range), "broken");
        let text = render::text(&sources, std::slice::from_ref(&problem), false);
        assert!(text.contains("error[E0107]: broken"), "{text}");
        assert!(render::json(&sources, &[problem]).contains("broken"));
    }
}
