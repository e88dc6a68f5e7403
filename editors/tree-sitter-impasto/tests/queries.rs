//! The queries of every editor: they fit the grammar, and color each node once.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use tree_sitter::{Language, Query, QueryCursor, StreamingIterator as _};

use crate::editors::{EDITORS, files};
use crate::words::inputs_and_outputs;
use crate::{files_below, good_sources, nodes, root, tree};

fn query(text: &str) -> Query {
    Query::new(&Language::from(tree_sitter_impasto::LANGUAGE), text)
        .expect("the query fits the grammar")
}

#[test]
fn every_query_of_every_editor_fits_the_grammar() {
    let language = Language::from(tree_sitter_impasto::LANGUAGE);
    let files = files_below(&root().join("editors"), "scm");
    assert!(files.len() > 12, "the queries have moved");
    for path in files {
        let text = fs::read_to_string(&path).expect("a text");
        if let Err(error) = Query::new(&language, &text) {
            panic!("{}: {error}", path.display());
        }
    }
}

#[test]
fn the_queries_of_editors_are_made_from_the_grammars() {
    for (path, text) in EDITORS.iter().flat_map(files) {
        let file = root().join("editors").join(&path);
        let found = fs::read_to_string(file).unwrap_or_default();
        assert!(
            found == text,
            "{} is old: cargo run -p tree-sitter-impasto --example queries",
            path.display()
        );
    }
}

/// The colors of each node of a source, by its place.
fn colors(query: &Query, text: &str) -> BTreeMap<(usize, usize), BTreeSet<String>> {
    let tree = tree(text);
    let mut cursor = QueryCursor::new();
    let mut found: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
    let mut captures = cursor.captures(query, tree.root_node(), text.as_bytes());
    while let Some((matched, which)) = captures.next() {
        let capture = matched.captures()[*which];
        let range = capture.node.byte_range();
        let name = query.capture_names()[capture.index as usize];
        found
            .entry((range.start, range.end))
            .or_default()
            .insert(name.to_owned());
    }
    found
}

/// Editors differ in which of two patterns wins, so there must not be two.
#[test]
fn no_node_has_two_colors() {
    let query = query(tree_sitter_impasto::HIGHLIGHTS_QUERY);
    for (path, text) in good_sources() {
        for ((start, end), names) in colors(&query, &text) {
            assert_eq!(
                names.len(),
                1,
                "{}: `{}` {names:?}",
                path.display(),
                &text[start..end]
            );
        }
    }
}

/// Keywords, marks, literals and names have colors, but for variables.
#[test]
fn every_other_token_has_a_color() {
    let query = query(tree_sitter_impasto::HIGHLIGHTS_QUERY);
    let mut plain = BTreeSet::new();
    for (_, text) in good_sources() {
        let colored = colors(&query, &text);
        let is_colored = |range: std::ops::Range<usize>| {
            colored
                .keys()
                .any(|(start, end)| *start <= range.start && range.end <= *end)
        };
        let tree = tree(&text);
        let leaves = nodes(tree.root_node())
            .into_iter()
            .filter(|n| n.child_count() == 0);
        let bare = leaves.filter(|n| !is_colored(n.byte_range()));
        plain.extend(bare.map(|n| n.kind().to_owned()));
    }
    // Names of `let`, `var` and `for`, and where they are used.
    let variables = ["identifier", "name"].map(str::to_owned);
    assert_eq!(plain, BTreeSet::from(variables));
}

#[test]
fn the_names_that_a_surface_has_are_the_compilers() {
    let text = tree_sitter_impasto::HIGHLIGHTS_QUERY;
    let list = text
        .split_once("(#any-of? @variable.builtin")
        .expect("the list")
        .1;
    let list = list.split_once(')').expect("its end").0;
    let names: BTreeSet<String> = list
        .split('"')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect();
    assert_eq!(names, inputs_and_outputs());
}

/// What stands where in a small source, by queries that have no other test.
#[test]
fn folds_objects_and_documentation_are_where_they_should_be() {
    let text = "\
//! File.

/// A `fn`.
///
/// Source: nobody.
fn twice(x: float) -> float {
    x * 2.0
}
";
    let captured = |query_text: &str, name: &str| {
        let query = query(query_text);
        let tree = tree(text);
        let mut cursor = QueryCursor::new();
        let mut captures = cursor.captures(&query, tree.root_node(), text.as_bytes());
        let mut found = Vec::new();
        while let Some((matched, which)) = captures.next() {
            let capture = matched.captures()[*which];
            if query.capture_names()[capture.index as usize] == name {
                found.push(text[capture.node.byte_range()].to_owned());
            }
        }
        found
    };
    let docs = captured(tree_sitter_impasto::INJECTIONS_QUERY, "injection.content");
    assert_eq!(docs.concat(), " File.\n A `fn`.\n\n Source: nobody.\n");
    let folds = captured(tree_sitter_impasto::FOLDS_QUERY, "fold");
    assert_eq!(folds.len(), 4, "{folds:?}");
    let functions = captured(tree_sitter_impasto::TEXTOBJECTS_QUERY, "function.inner");
    assert_eq!(functions, ["{\n    x * 2.0\n}"]);
    let parameters = captured(tree_sitter_impasto::TEXTOBJECTS_QUERY, "parameter.inner");
    assert_eq!(parameters, ["x: float"]);
}
