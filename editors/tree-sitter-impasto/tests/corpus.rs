//! The corpus of `tree-sitter test`, run without its command line.

use std::fs;
use std::path::Path;

use crate::{files_below, tree};

/// Blanks as one, and none before a closing bracket.
fn flat(tree: &str) -> String {
    tree.split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace(" )", ")")
}

/// The cases of a file: name, source and tree.
fn cases(text: &str) -> Vec<(String, String, String)> {
    let is_rule = |line: &str, mark: char| line.len() >= 3 && line.chars().all(|c| c == mark);
    let lines: Vec<&str> = text.lines().collect();
    let heads: Vec<usize> = (0..lines.len().saturating_sub(2))
        .filter(|i| is_rule(lines[*i], '=') && is_rule(lines[i + 2], '='))
        .collect();
    let ends = heads.iter().skip(1).copied().chain([lines.len()]);
    heads
        .iter()
        .zip(ends)
        .map(|(head, end)| {
            let body = &lines[head + 3..end];
            let rule = body
                .iter()
                .position(|line| is_rule(line, '-'))
                .expect("a line of dashes");
            // The blank line before the dashes is the corpus's.
            let source = body[..rule.saturating_sub(1)].join("\n");
            (
                lines[head + 1].to_owned(),
                source,
                body[rule + 1..].join("\n"),
            )
        })
        .collect()
}

#[test]
fn the_corpus_has_the_trees_that_it_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("test/corpus");
    let mut count = 0;
    for path in files_below(&folder, "txt") {
        let text = fs::read_to_string(&path).expect("a text");
        for (name, source, expected) in cases(&text) {
            let source = source.trim_start_matches('\n');
            let found = tree(source).root_node().to_sexp();
            assert_eq!(flat(&found), flat(&expected), "{}: {name}", path.display());
            count += 1;
        }
    }
    assert!(count > 15, "only {count} cases");
}
