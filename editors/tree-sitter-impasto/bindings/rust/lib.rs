//! The grammar of Impasto for tree-sitter: what editors color, fold and indent by, also while a source is half typed.
//!
//! ```
//! let mut parser = tree_sitter::Parser::new();
//! parser.set_language(&tree_sitter_impasto::LANGUAGE.into()).expect("a version that this library reads");
//! let tree = parser.parse("const HALF: float = 1.0 / 2.0;", None).expect("a tree");
//! assert!(!tree.root_node().has_error());
//! ```

// The parser is C.
#![allow(unsafe_code)]

use tree_sitter_language::LanguageFn;

unsafe extern "C" {
    fn tree_sitter_impasto() -> *const ();
}

/// The language, for `tree_sitter::Parser::set_language`.
// SAFETY: the function is that of `src/parser.c`, which takes nothing and gives a pointer to constant data.
pub const LANGUAGE: LanguageFn = unsafe { LanguageFn::from_raw(tree_sitter_impasto) };

/// What the nodes are: each kind with its fields, as JSON.
pub const NODE_TYPES: &str = include_str!("../../src/node-types.json");

/// What to color, by the capture names of tree-sitter and Neovim.
pub const HIGHLIGHTS_QUERY: &str = include_str!("../../queries/highlights.scm");

/// Documentation is Markdown.
pub const INJECTIONS_QUERY: &str = include_str!("../../queries/injections.scm");

/// Where names are defined and how far they reach.
pub const LOCALS_QUERY: &str = include_str!("../../queries/locals.scm");

/// What to fold.
pub const FOLDS_QUERY: &str = include_str!("../../queries/folds.scm");

/// Where lines are indented.
pub const INDENTS_QUERY: &str = include_str!("../../queries/indents.scm");

/// What may be selected and jumped to.
pub const TEXTOBJECTS_QUERY: &str = include_str!("../../queries/textobjects.scm");
