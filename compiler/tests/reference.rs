//! docs/language.md against the tables of the compiler: what the reference lists is what there is.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use impasto_compiler::ast::Unit;
use impasto_compiler::diag::{self, Code};
use impasto_compiler::format::format;
use impasto_compiler::ir::ops::Op;
use impasto_compiler::lexer::Token;
use impasto_compiler::parser;
use impasto_compiler::sema::types::NAMED;
use impasto_compiler::source::SourceMap;
use impasto_compiler::{MemoryLoader, check};

fn page() -> String {
    read("language.md")
}

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(docs().join(name)).expect("a page")
}

/// The text from `from` up to the next `to`.
fn between<'p>(page: &'p str, from: &str, to: &str) -> &'p str {
    let start = page
        .find(from)
        .unwrap_or_else(|| panic!("`{from}` is gone"));
    let rest = &page[start + from.len()..];
    &rest[..rest.find(to).unwrap_or_else(|| panic!("`{to}` is gone"))]
}

/// What stands in backquotes, word by word.
fn quoted(text: &str) -> Vec<&str> {
    let parts = text.split('`').skip(1).step_by(2);
    parts.flat_map(str::split_whitespace).collect()
}

/// The cells of the rows of the table under the heading `title`.
fn table(page: &str, title: &str) -> Vec<Vec<String>> {
    let section = between(page, &format!("\n## {title}\n"), "\n## ");
    // The first table of the section.
    let lines = section.lines().skip_while(|line| !line.starts_with('|'));
    let rows = lines.take_while(|line| line.starts_with('|'));
    let rows = rows.filter(|line| line.starts_with("| `"));
    rows.map(|row| {
        let row = row.replace("\\|", "\u{1}");
        let cells = row.trim_matches('|').split('|');
        cells
            .map(|cell| cell.trim().replace('\u{1}', "|"))
            .collect()
    })
    .collect()
}

#[test]
fn keywords_are_those_of_the_lexer() {
    let page = page();
    let listed = quoted(between(&page, "Keywords: ", ". "));
    assert_eq!(listed, Token::KEYWORDS);
}

#[test]
fn units_are_those_of_the_language() {
    let page = page();
    let section = between(&page, "| unit | is |", "\n\n");
    let listed = quoted(section);
    let known: Vec<&str> = Unit::ALL.iter().map(|(_, name, _)| *name).collect();
    assert_eq!(listed, known);
    let grammar = between(&page, "UNIT     = ", "\n\n");
    let listed: Vec<&str> = grammar.split('"').skip(1).step_by(2).collect();
    assert_eq!(listed, known);
}

#[test]
fn types_are_those_of_the_checker() {
    let page = page();
    let rows = table(&page, "Types");
    let listed: BTreeSet<&str> = rows.iter().flat_map(|row| quoted(&row[0])).collect();
    let listed: BTreeSet<&str> = listed.iter().map(|word| word.trim_matches(',')).collect();
    let known: BTreeSet<&str> = NAMED.iter().map(|(name, _)| *name).collect();
    assert_eq!(listed, known);
}

#[test]
fn every_operation_has_its_formula() {
    let page = page();
    let rows = table(&page, "Operations");
    let listed: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    let mut known: Vec<&str> = Vec::new();
    for op in Op::ALL {
        if !known.contains(&op.info().text) {
            known.push(op.info().text);
        }
    }
    assert_eq!(
        listed, known,
        "rows in the order of the table of operations"
    );
    for row in &rows {
        assert_eq!(row.len(), 3, "{row:?}");
        assert!(row[2].len() > 3, "{row:?}");
        let op = Op::ALL
            .iter()
            .find(|op| op.info().text == row[0].trim_matches('`'));
        let info = op.expect("an operation").info();
        if info.callable {
            let written = row[1].starts_with(&format!("`{}(", info.text));
            assert!(written, "`{}` is called by its name: {row:?}", info.text);
        }
    }
}

#[test]
fn what_is_written_in_the_table_parses() {
    for row in table(&page(), "Operations") {
        for written in row[1].split('`').skip(1).step_by(2) {
            let written = written.replace("0xRRGGBB", "0x8c1010");
            let file = SourceMap::default().add("row", &*written);
            let (_, diagnostics) = parser::parse_expression(file, &written);
            assert!(diagnostics.is_empty(), "{written}: {diagnostics:?}");
        }
    }
}

#[test]
fn functions_that_are_no_operations_are_described() {
    let page = page();
    for name in ["gradient", "srgb", "layer", "medium", "filter_width"] {
        assert!(page.contains(&format!("`{name}(")), "`{name}`");
    }
}

/// Every path of the library that a text names, such as `std::bsdf::diffuse`.
fn library_paths(text: &str) -> BTreeSet<String> {
    let part = |c: char| c == ':' || c == '_' || c.is_ascii_alphanumeric();
    let starts = text.match_indices("std::").map(|(at, _)| &text[at..]);
    let paths = starts.map(|rest| rest.split(|c| !part(c)).next().unwrap_or(""));
    let whole = paths.filter(|path| path.split("::").count() == 3 && !path.ends_with(':'));
    whole.map(str::to_owned).collect()
}

#[test]
fn names_of_the_table_of_features_exist() {
    let paths = library_paths(&read("features.md"));
    assert!(paths.len() > 40, "only {} names", paths.len());
    for path in paths {
        let mut files = MemoryLoader::default();
        files.add("m.impasto", format!("use {path};\n"));
        let checked = check("m.impasto", &mut files);
        let shown = diag::render::text(&checked.sources, &checked.diagnostics, false);
        assert!(!diag::has_errors(&checked.diagnostics), "{shown}");
    }
}

#[test]
fn functions_that_the_table_of_features_writes_with_brackets_exist() {
    let language = page();
    for call in ["image(", "hash(", "filter_width(", "gradient(", "medium("] {
        assert!(read("features.md").contains(call), "{call} is gone");
        assert!(language.contains(&format!("`{call}")), "{call}");
    }
}

#[test]
fn the_page_of_diagnostics_is_current() {
    let written = read("diagnostics.md");
    let current = diag::examples::page();
    assert!(
        written == current,
        "run `impasto explain --markdown > docs/diagnostics.md`"
    );
    assert!(Code::ALL.len() > 40);
}

#[test]
fn pictures_of_the_tutorial_are_there_and_small() {
    let text = read("tutorial.md");
    let pictures: Vec<&str> = text
        .split("](images/")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .collect();
    assert_eq!(pictures.len(), 8);
    for picture in pictures {
        let bytes = std::fs::read(docs().join("images").join(picture)).expect("a picture");
        assert!(bytes.starts_with(b"\x89PNG"), "{picture}");
        assert!(
            bytes.len() <= 60 << 10,
            "{picture} has {} bytes",
            bytes.len()
        );
    }
}

#[test]
fn examples_of_the_tutorial_and_of_ports_are_formatted() {
    for page in ["tutorial.md", "features.md"] {
        let text = read(page);
        let examples = text.split("```impasto\n").skip(1);
        let examples: Vec<&str> = examples.filter_map(|e| e.split("```").next()).collect();
        assert!(examples.len() >= 3, "{page} lost its examples");
        for example in examples {
            let file = SourceMap::default().add(page, example);
            let formatted = format(file, example).expect("an example parses");
            assert_eq!(formatted, example, "in {page}");
        }
    }
}
