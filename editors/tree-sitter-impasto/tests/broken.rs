//! Sources that are half typed: the parser always ends, covers the text, and finds what is whole.

use tree_sitter::InputEdit;

use crate::agreement::edit;
use crate::random::Random;
use crate::{compiled, good_sources, nodes, parser, tree};

/// The names of the definitions in a tree, wherever they are.
fn definitions(text: &str) -> Vec<String> {
    let tree = tree(text);
    let all = nodes(tree.root_node());
    let named = all.iter().filter(|n| n.kind().ends_with("_definition"));
    let names = named.filter_map(|n| n.child_by_field_name("name"));
    names.map(|n| text[n.byte_range()].to_owned()).collect()
}

#[test]
fn cut_sources_have_a_tree_of_all_their_text() {
    let mut random = Random(4);
    for (path, text) in good_sources() {
        for _ in 0..20 {
            let mut end = random.below(text.len());
            while !text.is_char_boundary(end) {
                end -= 1;
            }
            let tree = tree(&text[..end]);
            assert_eq!(tree.root_node().end_byte(), end, "{}", path.display());
        }
    }
}

#[test]
fn what_is_no_source_has_a_tree() {
    let mut random = Random(5);
    let pieces = [
        "\0",
        "\u{1f600}",
        "///",
        "//!",
        "/*",
        "*/",
        "\"",
        "\n",
        "\r",
        "{",
        "}",
        "(",
        ")",
        "[",
        "]",
        "material",
        "0x",
        "1e",
        "1.",
        "..",
        "é",
        "\u{feff}",
        "if",
        "else",
        "#",
        "'",
        "\\",
        ";",
        "m",
        "12u",
        "\u{2028}",
    ];
    for _ in 0..2000 {
        let count = random.below(40);
        let text: String = (0..count).map(|_| random.pick(&pieces)).collect();
        let tree = tree(&text);
        assert_eq!(tree.root_node().end_byte(), text.len(), "{text:?}");
    }
}

#[test]
fn an_incomplete_source_has_error_nodes() {
    for text in [
        "material",
        "material a",
        "material a {",
        "material a { let",
        "material a { let x = ",
        "material a { surface = diffuse(",
        "material a { surface = diffuse(0.5); ",
        "fn f(x: float) ->",
        "use std::",
        "fn f() -> float { \"open",
        "/* never closed",
        "struct",
    ] {
        assert!(tree(text).root_node().has_error(), "{text:?}");
    }
}

/// Lines that somebody has not finished. (Heads of loops from `in` on are not
/// here: they take the next block for their own.)
const HALF_TYPED: [&str; 30] = [
    "let",
    "let x",
    "let x =",
    "let x = 3",
    "let x = diffuse(",
    "let x = diffuse(0.5,",
    "let x = diffuse(reflectance:",
    "let x = position.",
    "let x = a +",
    "let x = [1, 2",
    "let x = \"wood",
    "param",
    "param x",
    "param x: ",
    "param x: color =",
    "param x: float = 1.0 in",
    "param x: float = 1.0 in 0 ..",
    "param x: float = 1.0 { label:",
    "if",
    "if a {",
    "if a { x = 1; } else",
    "for",
    "for i in 0 .. 8 {",
    "while a",
    "surface",
    "surface =",
    "surface = layer(mirror(",
    "x.y",
    "/// documentation",
    "#",
];

/// Each in a material between two whole definitions.
#[test]
fn what_stands_around_a_half_typed_line_is_found() {
    for line in HALF_TYPED {
        let text = format!(
            "fn before(x: float) -> float = x;\n\nmaterial middle {{\n    let a = 1;\n    {line}\n    \
             surface = diffuse(a);\n}}\n\nfn after(x: float) -> float = x;\n\nmaterial last {{\n    surface = mirror();\n}}\n"
        );
        let found = definitions(&text);
        for name in ["before", "after", "last"] {
            let is_found = found.iter().any(|n| n == name);
            assert!(
                is_found,
                "`{name}` is lost behind {line:?}: {}",
                tree(&text).root_node().to_sexp()
            );
        }
    }
}

/// Behind an open bracket at the end of a block, a parser that does not know of lines cannot tell. It may not get worse.
#[test]
fn few_half_typed_lines_at_the_end_of_a_block_cost_what_follows() {
    let lost = HALF_TYPED.iter().filter(|line| {
        let text = format!(
            "material a {{\n    let a = 1;\n    {line}\n}}\n\nfn after(x: float) -> float = x;\n"
        );
        !definitions(&text).iter().any(|n| n == "after")
    });
    let lost: Vec<&&str> = lost.collect();
    assert!(lost.len() <= 10, "{lost:?}");
}

/// One wrong token costs few of the other definitions.
#[test]
fn most_definitions_survive_an_error() {
    let mut random = Random(6);
    let sources = good_sources();
    let (mut whole, mut found) = (0, 0);
    for _ in 0..2000 {
        let (_, text) = &sources[random.below(sources.len())];
        let edited = edit(&mut random, text);
        let (module, diagnostics) = compiled(&edited);
        if diagnostics.is_empty() {
            continue;
        }
        let names = definitions(&edited);
        whole += module.items.len();
        let is_found = |name: &String| names.contains(name);
        found += module
            .items
            .iter()
            .filter(|i| is_found(&i.name.node))
            .count();
    }
    assert!(whole > 3000, "only {whole} definitions: the test is idle");
    let lost = whole - found;
    assert!(
        lost * 100 <= whole,
        "{lost} of {whole} that the compiler finds are lost"
    );
}

/// An editor parses anew only around an edit: it comes to the same tree.
#[test]
fn an_edit_that_is_taken_back_leaves_the_tree_as_it_was() {
    let mut random = Random(7);
    let mut parser = parser();
    for (path, text) in good_sources() {
        let first = parser.parse(&text, None).expect("a tree");
        let mut at = random.below(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        let inserted = random.pick(&["{", ")", "\"", "/", "x", "\n", "///", "1.", ";"]);
        let edited = format!("{}{inserted}{}", &text[..at], &text[at..]);
        let mut tree = first.clone();
        tree.edit(&input_edit(&text, &edited, at, 0, inserted.len()));
        let mut middle = parser.parse(&edited, Some(&tree)).expect("a tree");
        middle.edit(&input_edit(&edited, &text, at, inserted.len(), 0));
        let last = parser.parse(&text, Some(&middle)).expect("a tree");
        assert_eq!(
            first.root_node().to_sexp(),
            last.root_node().to_sexp(),
            "{}: {inserted:?} at {at}",
            path.display()
        );
    }
}

fn input_edit(old: &str, new: &str, at: usize, removed: usize, added: usize) -> InputEdit {
    let point = |text: &str, byte: usize| {
        let before = &text[..byte];
        let row = before.matches('\n').count();
        let column = byte - before.rfind('\n').map_or(0, |n| n + 1);
        tree_sitter::Point { row, column }
    };
    InputEdit {
        start_byte: at,
        old_end_byte: at + removed,
        new_end_byte: at + added,
        start_position: point(old, at),
        old_end_position: point(old, at + removed),
        new_end_position: point(new, at + added),
    }
}
