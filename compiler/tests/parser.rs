//! The lexer and parser from outside: which diagnostics broken sources give, what the tree of
//! good ones is, and that no input makes them panic or hang.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use impasto_compiler::diag::{Diagnostic, render};
use impasto_compiler::lexer::{self, Token};
use impasto_compiler::parser;
use impasto_compiler::source::{FileId, MAX_SOURCE_BYTES, SourceMap};
use impasto_fuzz::Stopwatch;

fn folder(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// Every `.impasto` file below `folder`, in the order of their paths.
fn sources_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else {
        return found;
    };
    for entry in entries {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            found.extend(sources_below(&path));
        } else if path.extension().is_some_and(|e| e == "impasto") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn parse(text: &str) -> (SourceMap, impasto_compiler::ast::Module, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let file = sources.add("test.impasto", text);
    let (module, diagnostics) = parser::parse(file, text);
    (sources, module, diagnostics)
}

/// `//~ CODE text` announces a diagnostic of its line, `//~^` of the line above, and so on.
struct Marker {
    line: usize,
    code: String,
    text: String,
}

fn markers(source: &str) -> Vec<Marker> {
    let mut found = Vec::new();
    for (index, line) in source.lines().enumerate() {
        for marker in line.split("//~").skip(1) {
            let up = marker.bytes().take_while(|b| *b == b'^').count();
            let rest = marker[up..].trim();
            let (code, text) = rest.split_once(' ').unwrap_or((rest, ""));
            found.push(Marker {
                line: index + 1 - up,
                code: code.to_owned(),
                text: text.trim().to_owned(),
            });
        }
    }
    found
}

/// All that a diagnostic says, with the line it starts on.
fn said(sources: &SourceMap, diagnostic: &Diagnostic) -> (usize, String) {
    let line = diagnostic.span.map_or(0, |s| sources.line_column(s).0);
    let expected = diagnostic.expected.as_deref().unwrap_or("");
    let hint = diagnostic.hint.as_deref().unwrap_or("");
    let labels: Vec<&str> = diagnostic
        .labels
        .iter()
        .map(|l| l.message.as_str())
        .collect();
    let text = format!(
        "{} | expected: {expected} | hint: {hint} | {}",
        diagnostic.message,
        labels.join(" | ")
    );
    (line, text)
}

/// Pairs diagnostics with markers; gives what is left of either.
fn mismatches(source: &str) -> Vec<String> {
    let (sources, _, diagnostics) = parse(source);
    let mut markers = markers(source);
    let mut problems = Vec::new();
    for diagnostic in &diagnostics {
        let (line, text) = said(&sources, diagnostic);
        let announced = markers.iter().position(|m| {
            m.line == line && m.code == diagnostic.code.id() && text.contains(&m.text)
        });
        match announced {
            Some(index) => drop(markers.remove(index)),
            None => problems.push(format!(
                "{line}: not announced: {} {text}",
                diagnostic.code.id()
            )),
        }
    }
    for Marker { line, code, text } in markers {
        problems.push(format!("{line}: did not come: {code} {text}"));
    }
    problems
}

#[test]
fn broken_sources_give_the_diagnostics_that_their_markers_announce() {
    let files = sources_below(&folder("tests/syntax"));
    assert!(files.len() >= 10, "found only {} files", files.len());
    let mut failures = Vec::new();
    for path in files {
        let source = fs::read_to_string(&path).expect("a readable file");
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        failures.extend(
            mismatches(&source)
                .into_iter()
                .map(|p| format!("{name}:{p}")),
        );
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

#[test]
fn every_shipped_source_parses() {
    let mut failures = String::new();
    for path in ["../stdlib", "../materials"]
        .iter()
        .flat_map(|f| sources_below(&folder(f)))
    {
        let source = fs::read_to_string(&path).expect("a readable file");
        let (sources, _, diagnostics) = parse(&source);
        if !diagnostics.is_empty() {
            failures += &format!("{}\n", path.display());
            failures += &render::text(&sources, &diagnostics, false);
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn operators_bind_as_the_reference_says() {
    let cases = [
        ("a || b && c", "(|| a (&& b c))"),
        ("a && b == c", "(&& a (== b c))"),
        ("a == b | c", "(== a (| b c))"),
        ("a | b ^ c & d", "(| a (^ b (& c d)))"),
        ("a & b << c", "(& a (<< b c))"),
        ("a << b + c", "(<< a (+ b c))"),
        ("a + b * c", "(+ a (* b c))"),
        ("a - b - c", "(- (- a b) c)"),
        ("a / b % c * d", "(* (% (/ a b) c) d)"),
        ("-a * b", "(* (- a) b)"),
        ("-a.x", "(- (. a x))"),
        ("!-a", "(! (- a))"),
        ("a - -b", "(- a (- b))"),
        ("!a && b", "(&& (! a) b)"),
        ("(a + b) * c", "(* (+ a b) c)"),
        ("a.b.c", "(. (. a b) c)"),
        ("f(a).x + 1", "(+ (. (call f a) x) 1)"),
        ("a < b == (c < d)", "<chained>"),
        ("a >> 1 << 2", "(<< (>> a 1) 2)"),
        ("0.6 mm * 2", "(* 0.6mm 2)"),
        ("30deg", "30.0deg"),
        ("0xff + 1e3", "(+ 255 1000.0)"),
        ("f(a, b: 2, )", "(call f a (b: 2))"),
        ("f()", "(call f)"),
        ("\"a b.png\"", "\"a b.png\""),
        ("true != false", "(!= true false)"),
        ("{ let a = 1; a }", "(block (let a 1) (value a))"),
        (
            "if a { 1 } else if b { 2 } else { 3 }",
            "(if a (then (value 1)) (else (value (if b (then (value 2)) (else (value 3))))))",
        ),
    ];
    for (source, tree) in cases {
        let (value, diagnostics) = parser::parse_expression(FileId(0), source);
        if tree == "<chained>" {
            assert_eq!(diagnostics.len(), 1, "{source}: {diagnostics:?}");
            continue;
        }
        assert_eq!(diagnostics, [], "{source}");
        let value = value.expect("no diagnostics");
        assert_eq!(parser::print_expression(&value), tree, "{source}");
    }
}

#[test]
fn an_expression_of_a_scene_is_the_whole_text() {
    let broken = [
        ("0.5 0.6", "unexpected `0.6`"),
        ("", "unexpected end"),
        ("srgb(0x8c1010", "never closed"),
        ("1;", "unexpected `;`"),
        ("0.6 mmm", "`mmm` is not a unit"),
    ];
    for (source, message) in broken {
        let (_, diagnostics) = parser::parse_expression(FileId(0), source);
        let messages: Vec<&str> = diagnostics.iter().map(|d| d.message.as_str()).collect();
        assert_eq!(messages.len(), 1, "{source}: {messages:?}");
        assert!(messages[0].contains(message), "{source}: {messages:?}");
    }
}

#[test]
fn the_tree_of_a_file_is_printed_without_places() {
    let source = include_str!("syntax/tree.impasto");
    let (_, module, diagnostics) = parse(source);
    assert_eq!(diagnostics, []);
    insta::assert_snapshot!(parser::print(&module));
}

#[test]
fn tokens_are_listed_one_a_line() {
    let source = "//! Doc \nparam x: length = 0.6mm; // no\n/// d\n0..8 \"a b\"";
    let (tokens, diagnostics) = lexer::lex(FileId(0), source);
    assert_eq!(diagnostics, []);
    let expected = "\
0..8 file-doc //! Doc
9..14 keyword param
15..16 name x
16..17 mark :
18..24 name length
25..26 mark =
27..30 float 0.6
30..32 name mm
32..33 mark ;
40..45 doc /// d
46..47 int 0
47..49 mark ..
49..50 int 8
51..56 string \"a b\"
";
    assert_eq!(lexer::listing(source, &tokens), expected);
}

#[test]
fn numbers_and_ranges_split_where_people_read_them() {
    use Token::*;
    let cases: [(&str, &[Token]); 12] = [
        ("0..8", &[Int, Range, Int]),
        ("0 .. 8", &[Int, Range, Int]),
        ("0.05 mm .. 10 mm", &[Float, Ident, Range, Int, Ident]),
        ("1.0..2.0", &[Float, Range, Float]),
        ("0...5", &[Int, Range, Float]),
        ("2.", &[Float]),
        ("2.x", &[Int, Dot, Ident]),
        ("v.x", &[Ident, Dot, Ident]),
        (".5e-3", &[Float]),
        ("1e3m", &[Float, Ident]),
        ("1e", &[Int, Ident]),
        ("0x1Fu", &[Hex]),
    ];
    for (source, kinds) in cases {
        let (tokens, _) = lexer::lex(FileId(0), source);
        let found: Vec<Token> = tokens.iter().map(|t| t.0).collect();
        assert_eq!(found, kinds, "{source}");
    }
}

#[test]
fn what_is_no_source_text_is_refused() {
    let large = vec![b' '; MAX_SOURCE_BYTES + 1];
    let refused = lexer::decode("large.impasto", &large).expect_err("too large");
    assert_eq!(refused.code.id(), "E0101");
    assert!(lexer::decode("just.impasto", &large[1..]).is_ok());
    let refused = lexer::decode("binary.impasto", b"fn\n\xff\x00").expect_err("not UTF-8");
    assert_eq!(refused.code.id(), "E0102");
    assert!(refused.message.contains("line 2"), "{}", refused.message);
    let marked = "\u{feff}fn f() -> int = 1;";
    assert_eq!(parse(marked).2, [], "the mark of some editors");
}

/// The time for one source. Reading twice what can nest would take hours, so builds that are
/// not optimised, on machines that are busy, may take a few seconds.
const PATIENCE: Duration = Duration::from_secs(if cfg!(debug_assertions) { 10 } else { 1 });

/// Parses and renders in time and gives the diagnostics.
fn survives(name: &str, source: &str) -> Vec<Diagnostic> {
    let start = Stopwatch::start();
    let (sources, module, diagnostics) = parse(source);
    let _ = parser::print(&module);
    let _ = render::text(&sources, &diagnostics, true);
    let _ = render::json(&sources, &diagnostics);
    let taken = start.elapsed();
    assert!(taken < PATIENCE, "{name} took {taken:?}");
    assert!(diagnostics.len() <= 200, "{name}: {}", diagnostics.len());
    diagnostics
}

#[test]
fn hostile_sources_are_refused_quickly() {
    let f = |inner: String| format!("fn f() -> int {{ {inner} }}");
    let deep = [
        (
            "parentheses",
            format!("const A: int = {}", "(".repeat(100_000)),
        ),
        ("braces", "{".repeat(1 << 20)),
        (
            "minuses",
            format!("const A: int = {}1;", "-".repeat(100_000)),
        ),
        ("nots", format!("const A: bool = {}a;", "!".repeat(100_000))),
        (
            "else if",
            f(format!("if a {{ }} {}", "else if a { }".repeat(60_000))),
        ),
        ("sum", format!("const A: int = {}1;", "a+".repeat(500_000))),
        (
            "fields",
            format!("const A: int = a{};", ".x".repeat(500_000)),
        ),
        (
            "blocks",
            format!("const A: int = {}1;", "{1}+".repeat(250_000)),
        ),
        ("conditions", f("if ".repeat(100_000))),
        ("calls", f("f(".repeat(100_000))),
        ("loops", f("for i in 0 .. 1 { ".repeat(50_000))),
    ];
    for (name, source) in deep {
        let diagnostics = survives(name, &source);
        assert_eq!(diagnostics.len(), 1, "{name}");
        assert_eq!(diagnostics[0].code.id(), "E0106", "{name}");
    }
    let broken = [
        ("closers", "}".repeat(1 << 20)),
        ("names", "a ".repeat(500_000)),
        ("keywords", "fn ".repeat(300_000)),
        ("lets", f("let ".repeat(250_000))),
        (
            "commas",
            format!("const A: int = f({});", ",".repeat(500_000)),
        ),
        (
            "semicolons",
            format!("const A: int = f({});", ";".repeat(500_000)),
        ),
        (
            "semicolons in lines",
            format!("const A: int = f({});", ";\n".repeat(500_000)),
        ),
        ("dots", format!("const A: int = a{};", ".".repeat(500_000))),
        ("characters", "@ ".repeat(500_000)),
        ("one run of characters", "@".repeat(1 << 20)),
        ("strings", "\"\n".repeat(500_000)),
        ("comment", format!("/*{}", " *".repeat(500_000))),
        ("docs", "/// a\n".repeat(150_000)),
        (
            "docs in a material",
            format!("material a {{ {} }}", "/// a\n".repeat(150_000)),
        ),
        ("numbers", "9".repeat(1 << 20)),
        ("nul", "\0".repeat(1 << 20)),
        ("brackets", "([{".repeat(80) + &"}])".repeat(80)),
        ("crossed brackets", "([)]".repeat(250_000)),
    ];
    for (name, source) in broken {
        assert!(!survives(name, &source).is_empty(), "{name}");
    }
    for (name, source) in [
        ("nothing", ""),
        ("blank", " \n\t\r\n"),
        ("comments", "// a\n/* b */"),
    ] {
        assert!(survives(name, source).is_empty(), "{name}");
    }
}

#[test]
fn large_sources_without_nesting_are_fine() {
    let statements = "    let a = 1 + 2 * f(3, b: 4.0).x;\n".repeat(28_000);
    let source = format!("fn f() -> int {{\n{statements}    1\n}}\n");
    assert!(source.len() <= MAX_SOURCE_BYTES);
    assert_eq!(parse(&source).2, []);
}

/// Takes each token of a good source away in turn. One slip should give one diagnostic; where a
/// bracket is gone, a few more may follow.
#[test]
fn one_slip_gives_about_one_diagnostic() {
    let source = include_str!("syntax/tree.impasto");
    let (tokens, _) = lexer::lex(FileId(0), source);
    let mut counts = Vec::new();
    for (_, span) in &tokens {
        let mut broken = source.to_owned();
        broken.replace_range(span.range(), "");
        let count = parse(&broken).2.len();
        assert!(count <= 5, "{count} without {span:?}");
        counts.push(count);
    }
    let broken = counts.iter().filter(|n| **n > 0).count();
    let total: usize = counts.iter().sum();
    assert!(broken > tokens.len() / 2, "{broken} of {}", tokens.len());
    assert!(total * 10 <= broken * 11, "{total} for {broken} slips");
}

/// Nesting up to the limit is parsed, printed and dropped on the small stack of a test's thread.
#[test]
fn the_limit_of_nesting_is_exact_and_safe() {
    let limit = parser::MAX_NESTING;
    let nested = |n: usize| {
        [
            format!("const A: int = {}1{};", "(".repeat(n), ")".repeat(n)),
            format!("const A: int = {}1;", "-".repeat(n)),
            format!("const A: int = {}1;", "1+".repeat(n)),
            format!("const A: int = a{};", ".x".repeat(n)),
            format!("const A: int = {}1{};", "f(".repeat(n), ")".repeat(n)),
            format!("const A: int = {}1{};", "{".repeat(n), "}".repeat(n)),
            format!(
                "const A: int = {}1{};",
                "-(".repeat(n / 2),
                ")".repeat(n / 2)
            ),
            // The `if` of the chain is one level, and so are the function's braces.
            format!(
                "fn f() -> int {{ if a {{}} {} }}",
                "else if a {}".repeat(n - 3)
            ),
        ]
    };
    for source in nested(limit) {
        let (_, module, diagnostics) = parse(&source);
        assert_eq!(diagnostics, [], "{}", &source[..40]);
        assert!(!parser::print(&module).is_empty());
    }
    for source in nested(limit + 2) {
        let (_, module, diagnostics) = parse(&source);
        assert_eq!(diagnostics.len(), 1, "{}", &source[..40]);
        assert_eq!(diagnostics[0].code.id(), "E0106");
        assert!(module.items.is_empty());
    }
}

/// Failing inside deep nesting costs no more than succeeding: nothing is read twice.
#[test]
fn errors_inside_nesting_do_not_multiply() {
    let all_levels = "a||b&&c==d|e^f&g<<h+i*(".repeat(25);
    let cases = [
        format!("const A: int = {all_levels} ;"),
        format!("const A: int = {all_levels} ? {};", ")".repeat(25)),
        format!("const A: int = {};", "a+b*if ".repeat(60)),
        format!(
            "fn f() -> int {{ {} {} }}",
            "for i in { ".repeat(120),
            "}".repeat(120)
        ),
        format!(
            "fn f() -> int {{ {} x y {} }}",
            "{ let a = 1 + ".repeat(100),
            "}".repeat(100)
        ),
        format!(
            "const A: int = {} 1 2 {};",
            "f(1, g: 2 3, ".repeat(200),
            ")".repeat(200)
        ),
    ];
    for source in cases {
        let start = Stopwatch::start();
        let (_, _, diagnostics) = parse(&source);
        assert!(!diagnostics.is_empty());
        let taken = start.elapsed();
        assert!(taken < PATIENCE, "{taken:?}: {}", &source[..40]);
    }
}

mod random {
    use super::*;
    use proptest::prelude::*;

    /// Pieces of sources, so that random sequences get past the first token.
    const PIECES: &[&str] = &[
        "material",
        "bsdf",
        "delta",
        "edf",
        "fn",
        "struct",
        "const",
        "use",
        "as",
        "param",
        "let",
        "var",
        "if",
        "else",
        "for",
        "in",
        "while",
        "limit",
        "break",
        "continue",
        "when",
        "true",
        "false",
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        ",",
        ";",
        ":",
        "::",
        ".",
        "..",
        "->",
        "=",
        "+=",
        "-=",
        "||",
        "&&",
        "==",
        "<",
        ">=",
        "|",
        "^",
        "&",
        "<<",
        "+",
        "-",
        "*",
        "/",
        "%",
        "!",
        "a",
        "b",
        "surface",
        "float",
        "1",
        "0.5",
        "0xff",
        "mm",
        "\"s\"",
        "\"",
        "///d\n",
        "//!d\n",
        "/*",
        "*/",
        "\n",
        "@",
        "°",
        "fn f(a: float) -> float {",
        "material m {",
        "let x =",
        "if a { 1 } else",
        "for i in 0 .. 3 {",
        "f(a, b: 2)",
    ];

    fn check(source: &str) -> Result<(), TestCaseError> {
        let (sources, module, diagnostics) = parse(source);
        let printed = parser::print(&module);
        prop_assert!(!printed.contains("<error>") || !diagnostics.is_empty());
        for diagnostic in &diagnostics {
            prop_assert!(!diagnostic.message.is_empty());
            let spans = diagnostic
                .labels
                .iter()
                .map(|l| l.span)
                .chain(diagnostic.span);
            for span in spans {
                prop_assert!(span.start <= span.end, "{diagnostic:?}");
                prop_assert!(source.get(span.range()).is_some(), "{diagnostic:?}");
            }
        }
        let text = render::text(&sources, &diagnostics, false);
        prop_assert_eq!(text.is_empty(), diagnostics.is_empty());
        let json = render::json(&sources, &diagnostics);
        prop_assert!(serde_json::from_str::<serde_json::Value>(&json).is_ok());
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn token_soup(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..60)) {
            check(&pieces.join(" "))?;
        }

        #[test]
        fn bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            match lexer::decode("random", &bytes) {
                Ok(text) => check(&text)?,
                Err(diagnostic) => prop_assert_eq!(diagnostic.code.id(), "E0102"),
            }
        }

        #[test]
        fn characters(text in ".{0,120}") {
            check(&text)?;
        }

        /// A good source with some of its pieces replaced, dropped or doubled.
        #[test]
        fn slips(edits in prop::collection::vec((0_usize..2000, 0_usize..4, prop::sample::select(PIECES)), 1..6)) {
            let source = include_str!("syntax/tree.impasto");
            let (tokens, _) = lexer::lex(FileId(0), source);
            let mut pieces: Vec<&str> = tokens.iter().map(|t| &source[t.1.range()]).collect();
            for (at, kind, piece) in edits {
                let at = at % pieces.len();
                match kind {
                    0 => drop(pieces.remove(at)),
                    1 => pieces.insert(at, piece),
                    2 => pieces.insert(at, pieces[at]),
                    _ => pieces[at] = piece,
                }
            }
            check(&pieces.join("\n"))?;
        }
    }
}
