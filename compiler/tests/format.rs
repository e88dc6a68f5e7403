//! `impasto fmt`: it keeps the meaning and every comment, changes nothing twice, and lays sources
//! out as the library is.

mod generate;

use std::fs;
use std::path::{Path, PathBuf};

use impasto_compiler::format::{Unformatted, format};
use impasto_compiler::lexer::lex;
use impasto_compiler::parser;
use impasto_compiler::source::{FileId, SourceMap};
use proptest::prelude::*;

fn file(text: &str) -> FileId {
    SourceMap::default().add("test.impasto", text)
}

/// The tree without places; `None` with syntax errors.
fn tree(text: &str) -> Option<String> {
    let (module, diagnostics) = parser::parse(file(text), text);
    diagnostics.is_empty().then(|| parser::print(&module))
}

/// Every comment that is no documentation, sorted. Found apart from the formatter's own way: by
/// what is left of a source without its tokens.
fn comments(text: &str) -> Vec<String> {
    let (tokens, _) = lex(file(text), text);
    let mut rest = text.as_bytes().to_vec();
    for (_, span) in tokens {
        rest[span.range()].fill(b'\n');
    }
    let rest = String::from_utf8_lossy(&rest).into_owned();
    let mut found = Vec::new();
    let mut rest = rest.as_str();
    while let Some(start) = rest.find("//").into_iter().chain(rest.find("/*")).min() {
        rest = &rest[start..];
        let end = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else {
            rest.find("*/").map_or(rest.len(), |at| at + 2)
        };
        found.push(rest[..end].trim_end().to_owned());
        rest = &rest[end..];
    }
    found.sort();
    found
}

/// What must hold for every source; gives the formatted text if there is one.
fn formatted(text: &str) -> Result<Option<String>, String> {
    let before = tree(text);
    let once = match (format(file(text), text), &before) {
        (Ok(once), Some(_)) => once,
        (Err(Unformatted::Syntax(_)), None) => return Ok(None),
        (outcome, _) => return Err(format!("{outcome:?} for\n{text}")),
    };
    if tree(&once) != before {
        return Err(format!("another tree:\n{text}\n=>\n{once}"));
    }
    if comments(&once) != comments(text) {
        return Err(format!("other comments:\n{text}\n=>\n{once}"));
    }
    match format(file(&once), &once) {
        Ok(twice) if twice == once => Ok(Some(once)),
        Ok(twice) => Err(format!("not stable:\n{}", difference(&once, &twice))),
        Err(why) => Err(format!("{why:?} for\n{once}")),
    }
}

/// The first lines that differ, with those before.
fn difference(a: &str, b: &str) -> String {
    let same = a.lines().zip(b.lines()).take_while(|(a, b)| a == b).count();
    let part = |text: &str| {
        let lines = text.lines().skip(same.saturating_sub(4)).take(10);
        lines.collect::<Vec<_>>().join("\n")
    };
    format!("{}\n=>\n{}", part(a), part(b))
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn sources_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources_below(&path));
        } else if path.extension().is_some_and(|e| e == "impasto") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn texts(folders: &[&str]) -> Vec<(String, String)> {
    let paths = folders.iter().flat_map(|f| sources_below(&root().join(f)));
    let read = |path: PathBuf| {
        let bytes = fs::read(&path).expect("a readable file");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        (path.display().to_string(), text)
    };
    paths.map(read).collect()
}

const ALL: [&str; 4] = [
    "stdlib",
    "materials",
    "tests/diagnostics",
    "compiler/tests/syntax",
];

#[test]
fn every_source_of_the_project_keeps_its_meaning_and_comments() {
    let texts = texts(&ALL);
    assert!(texts.len() > 120, "found only {} files", texts.len());
    let mut count = 0;
    let mut failures = Vec::new();
    for (name, text) in texts {
        match formatted(&text) {
            Ok(done) => count += usize::from(done.is_some()),
            Err(why) => failures.push(format!("{name}: {why}")),
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(count > 90, "only {count} files parse");
}

#[test]
fn lines_are_no_longer_than_they_need_to_be() {
    for (name, text) in texts(&["stdlib", "materials"]) {
        let done = format(file(&text), &text).expect("the library parses");
        for line in done.lines().filter(|line| !line.contains("//")) {
            assert!(line.chars().count() <= 100, "{name}: {line}");
        }
    }
}

/// Pairs of what is written and what becomes of it, between lines of `=>` and `---`.
#[test]
fn layouts_are_those_of_the_cases() {
    let cases = fs::read_to_string(root().join("compiler/tests/format/cases.txt"));
    let cases = cases.expect("the cases");
    let mut count = 0;
    for case in cases.split("\n---\n") {
        let (source, wanted) = case.split_once("\n=>\n").expect("a case has two halves");
        let source = source.strip_prefix("---\n").unwrap_or(source);
        let done = formatted(source).unwrap_or_else(|why| panic!("{why}"));
        let done = done.unwrap_or_else(|| panic!("does not parse:\n{source}"));
        assert_eq!(done.trim_end(), wanted.trim_end(), "from\n{source}");
        count += 1;
    }
    assert!(count >= 20, "only {count} cases");
}

#[test]
fn what_does_not_parse_is_left_alone() {
    let text = "material m { surface = ; }";
    let outcome = format(file(text), text);
    assert!(matches!(outcome, Err(Unformatted::Syntax(found)) if !found.is_empty()));
}

#[test]
fn foreign_line_ends_and_marks_become_plain_ones() {
    let text = "\u{feff}// a\r\nfn f() -> float = 1.0; // b\r\n\r\n\r\n\r\n// c";
    let done = format(file(text), text).expect("it parses");
    assert_eq!(done, "// a\nfn f() -> float = 1.0; // b\n\n// c\n");
    for empty in ["", "  \n\t\n"] {
        assert_eq!(format(file(empty), empty), Ok(String::new()));
    }
}

#[test]
fn deep_sources_are_formatted() {
    let nested = format!(
        "fn f() -> float = {}1.0{};",
        "(".repeat(240),
        ")".repeat(240)
    );
    let sums = format!("fn f() -> float = 1.0{};", " + 1.0".repeat(200));
    let calls = format!(
        "fn f() -> float = {}1.0{};",
        "abs(".repeat(120),
        ",)".repeat(120)
    );
    for text in [nested, sums, calls] {
        let done = formatted(&text).unwrap_or_else(|why| panic!("{why}"));
        assert!(done.is_some(), "it parses: {text}");
    }
}

/// The tokens of `text` with other white space and comments between them, chosen by `picks`.
fn respaced(text: &str, picks: &[u8]) -> String {
    let (tokens, _) = lex(file(text), text);
    let mut out = String::new();
    for (index, (_, span)) in tokens.iter().enumerate() {
        let slice = &text[span.range()];
        out += slice;
        let gap = match picks[index % picks.len()] {
            0 => "\n",
            1 => "\n\n\n",
            2 => " // trailing\n",
            3 => "\n// own line\n",
            4 => " /* within */ ",
            5 => "\n\n  /* own\n block */\n\n // and a line\n",
            6 => " /* a */ // b\n /* c */ ",
            7 => "\t \r\n",
            _ => " ",
        };
        out += if slice.starts_with("//") { "\n" } else { "" };
        out += gap;
    }
    out
}

/// What breaks lines everywhere, `bsdf` as a type among them.
#[test]
fn sources_survive_a_line_for_every_token() {
    for (path, text) in texts(&["stdlib", "materials"]) {
        let done = formatted(&respaced(&text, &[0])).unwrap_or_else(|why| panic!("{why}"));
        assert!(done.is_some(), "{path} parses");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sources_of_the_project_survive_any_spacing(
        (_, text) in prop::sample::select(texts(&["stdlib", "materials"])),
        picks in prop::collection::vec(0u8..40, 1..200),
    ) {
        let text = respaced(&text, &picks);
        let done = formatted(&text).map_err(TestCaseError::fail)?;
        prop_assert!(done.is_some(), "it parses:\n{}", text);
    }

    #[test]
    fn random_programs_keep_their_meaning(
        text in generate::program(),
        picks in prop::collection::vec(0u8..20, 1..60),
    ) {
        let plain = formatted(&text).map_err(TestCaseError::fail)?;
        prop_assert!(plain.is_some(), "it parses:\n{}", text);
        formatted(&respaced(&text, &picks)).map_err(TestCaseError::fail)?;
    }
}
