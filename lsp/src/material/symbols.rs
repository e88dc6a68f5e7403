//! Lists of definitions: those of the library, and those of files that nobody has open.

use std::ops::Range;
use std::sync::OnceLock;

use impasto_compiler::ast::Item;
use impasto_compiler::parser;
use impasto_compiler::source::FileId;
use impasto_stdlib::StdFile;

use super::completion::{Listed, ProposalKind, kind_of, listed};

/// A public definition of the library.
pub struct InLibrary {
    /// Its file.
    pub file: &'static StdFile,
    /// What is told of it.
    pub item: Listed,
}

/// Every public definition of the library, in the order of its files. The first call takes a moment.
pub fn library() -> impl Iterator<Item = &'static InLibrary> {
    static ALL: OnceLock<Vec<InLibrary>> = OnceLock::new();
    let all = ALL.get_or_init(|| {
        let files = impasto_stdlib::files().iter();
        let of = |file: &'static StdFile| {
            let items = listed(file).into_iter();
            items.map(move |item| InLibrary { file, item })
        };
        files.flat_map(of).collect()
    });
    all.iter()
}

/// A definition of some file, for a list of all.
pub struct Found {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: ProposalKind,
    /// The bytes of its name.
    pub place: Range<usize>,
}

/// The definitions of a text whose names have the letters of `query` in their order.
pub fn find(text: &str, query: &str) -> Vec<Found> {
    let (ast, _) = parser::parse(FileId(0), text);
    let fits = |item: &&Item| has_letters(&item.name.node, query);
    let found = |item: &Item| Found {
        name: item.name.node.clone(),
        kind: kind_of(&item.kind),
        place: item.name.span.range(),
    };
    ast.items.iter().filter(fits).map(found).collect()
}

/// Does a name have the letters of a query in their order, in either case?
pub fn has_letters(name: &str, query: &str) -> bool {
    let mut letters = name.chars().map(|c| c.to_ascii_lowercase());
    let wanted = query.chars().map(|c| c.to_ascii_lowercase());
    wanted
        .filter(|c| !c.is_whitespace())
        .all(|w| letters.any(|l| l == w))
}
