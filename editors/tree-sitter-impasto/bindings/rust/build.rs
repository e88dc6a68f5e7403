//! Builds the parser that `tree-sitter generate` wrote, and the scanner beside it. It needs a C compiler and nothing else.

use std::path::Path;

fn main() {
    let sources = Path::new("src");
    let mut build = cc::Build::new();
    build.std("c11").include(sources).warnings(false);
    for name in ["parser.c", "scanner.c"] {
        let file = sources.join(name);
        println!("cargo:rerun-if-changed={}", file.display());
        build.file(file);
    }
    build.compile("tree-sitter-impasto");
}
