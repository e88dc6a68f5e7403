//! The grammar for editors held to the compiler, which decides what Impasto is.

mod agreement;
mod broken;
mod corpus;
mod editors;
mod installed;
mod printed;
mod queries;
mod random;
mod snippets;
mod sources;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

use impasto_compiler::ast::Module;
use impasto_compiler::diag::Diagnostic;
use impasto_compiler::parser;
use impasto_compiler::source::SourceMap;
use tree_sitter::{Node, Parser, Tree};

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every file below `folder` whose name ends so, in the order of their paths.
fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            let name = path.file_name().expect("a name");
            if name != "node_modules" && name != "target" {
                found.extend(files_below(&path, extension));
            }
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Every good source of the repository, with its path.
fn good_sources() -> Vec<(PathBuf, String)> {
    let folders = ["stdlib", "materials", "examples"].map(|name| root().join(name));
    let paths = folders.iter().flat_map(|f| files_below(f, "impasto"));
    let read = |path: PathBuf| (path.clone(), fs::read_to_string(path).expect("a text"));
    let sources: Vec<_> = paths.map(read).collect();
    assert!(sources.len() > 100, "the folders of sources have moved");
    sources
}

fn parser() -> Parser {
    let mut parser = Parser::new();
    let language = tree_sitter_impasto::LANGUAGE.into();
    parser.set_language(&language).expect("the language loads");
    parser
}

/// The tree that editors see.
fn tree(text: &str) -> Tree {
    parser().parse(text, None).expect("parsing always ends")
}

/// The tree that the compiler sees, and what it complains about.
fn compiled(text: &str) -> (Module, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let file = sources.add("test.impasto", text);
    parser::parse(file, text)
}

/// Every node below `node`, itself first, each before what is in it.
fn nodes(node: Node<'_>) -> Vec<Node<'_>> {
    let mut all = vec![node];
    let mut next = 0;
    while next < all.len() {
        let node = all[next];
        let mut cursor = node.walk();
        all.extend(node.children(&mut cursor));
        next += 1;
    }
    all
}

/// The lines of errors in a tree, for messages.
fn errors(tree: &Tree) -> Vec<String> {
    let wrong = nodes(tree.root_node());
    let wrong = wrong.iter().filter(|n| n.is_error() || n.is_missing());
    wrong
        .map(|n| format!("line {}: {}", n.start_position().row + 1, n.to_sexp()))
        .collect()
}
