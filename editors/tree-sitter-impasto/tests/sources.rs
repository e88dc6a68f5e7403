//! Every source of the repository has a tree without errors.

use crate::{errors, good_sources, tree};

#[test]
fn every_good_source_parses_without_an_error() {
    for (path, text) in good_sources() {
        let tree = tree(&text);
        let errors = errors(&tree);
        assert!(errors.is_empty(), "{}: {errors:#?}", path.display());
        assert!(!tree.root_node().has_error(), "{}", path.display());
    }
}

#[test]
fn a_mark_of_byte_order_and_foreign_line_ends_are_read() {
    for text in [
        "\u{feff}const A: int = 1;\n",
        "//! File.\r\n\r\n/// A.\r\nconst A: int = 1; // one\r\n",
        "const A: int =\t1;\x0c\n",
    ] {
        let tree = tree(text);
        assert_eq!(errors(&tree), Vec::<String>::new(), "{text:?}");
    }
}
