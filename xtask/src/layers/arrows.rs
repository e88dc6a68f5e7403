//! Who names whom: the paths of a crate's sources, from one folder below `src` to another.
//!
//! A folder, or a file that stands alone, is a module at the crate's root. Only code counts: comments,
//! strings and unit tests may name anything.

use std::collections::{BTreeMap, BTreeSet};

/// A source file of a crate.
pub(super) struct Source {
    /// Its path below `src`, with `/`.
    pub path: String,
    /// What it says.
    pub text: String,
}

/// Where one folder names another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Arrow {
    /// The folder that names.
    pub from: String,
    /// The folder that is named.
    pub to: String,
    /// The first file and line, from 1, that does.
    pub place: (String, usize),
}

/// The module at the root that holds what `lib.rs` itself defines.
pub(super) const ROOT: &str = "lib";

/// The folders of a crate, in the order of their names.
pub(super) fn folders(sources: &[Source]) -> BTreeSet<&str> {
    let folders = sources.iter().map(|source| folder(&source.path));
    folders.filter(|folder| !is_root(folder)).collect()
}

/// Every pair of folders of which one names the other, once.
pub(super) fn arrows(sources: &[Source]) -> Vec<Arrow> {
    let folders = folders(sources);
    let exports = exports(sources);
    let mut found: BTreeMap<(String, String), Arrow> = BTreeMap::new();
    for source in sources.iter().filter(|s| !is_root(folder(&s.path))) {
        let from = folder(&source.path);
        let code = code(&source.text);
        for (at, name) in named_at_root(&code, depth(&source.path)) {
            let to = match folders.get(name.as_str()) {
                Some(folder) => (*folder).to_owned(),
                None => exports.get(&name).cloned().unwrap_or(ROOT.to_owned()),
            };
            if to == from || to.is_empty() {
                continue;
            }
            let line = code[..at].matches('\n').count() + 1;
            let arrow = Arrow {
                from: from.to_owned(),
                to: to.clone(),
                place: (source.path.clone(), line),
            };
            found.entry((from.to_owned(), to)).or_insert(arrow);
        }
    }
    found.into_values().collect()
}

/// The first part of a path below `src`.
fn folder(path: &str) -> &str {
    let first = path.split('/').next().unwrap_or(path);
    first.strip_suffix(".rs").unwrap_or(first)
}

fn is_root(folder: &str) -> bool {
    matches!(folder, "lib" | "main")
}

/// How many modules deep a file is: `super` as often leads to the crate's root.
fn depth(path: &str) -> usize {
    let path = path.strip_suffix("/mod.rs").unwrap_or(path);
    path.split('/').count()
}

/// What the root exports from modules or other crates by another path: the module, or nothing for what is
/// not of this crate.
fn exports(sources: &[Source]) -> BTreeMap<String, String> {
    let folders = folders(sources);
    let mut exports = BTreeMap::new();
    for root in sources.iter().filter(|s| is_root(folder(&s.path))) {
        for statement in code(&root.text).split(';') {
            let Some((_, path)) = statement.rsplit_once("use ") else {
                continue;
            };
            let first = path.trim().trim_start_matches("crate::");
            let module = first.split("::").next().unwrap_or(first);
            let module = if folders.contains(module) { module } else { "" };
            for name in words(path) {
                exports.insert(name.to_owned(), module.to_owned());
            }
        }
    }
    exports
}

/// The names that paths from the crate's root begin with, each with its place: those after `crate::`, and
/// after as many `super::` as lead there.
fn named_at_root(code: &str, depth: usize) -> Vec<(usize, String)> {
    let supers = "super::".repeat(depth);
    let mut names = Vec::new();
    for prefix in ["crate::", &supers] {
        for (at, _) in code.match_indices(prefix) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
                continue;
            }
            let rest = &code[at + prefix.len()..];
            match rest.strip_prefix('{') {
                Some(group) => {
                    names.extend(first_words(group).into_iter().map(|name| (at, name)));
                }
                None => names.extend(words(rest).next().map(|name| (at, name.to_owned()))),
            }
        }
    }
    names.sort_unstable();
    names
}

/// The first word of each path in a group of a `use`, up to the brace that closes it.
fn first_words(group: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut nesting = 0usize;
    let mut begins = true;
    for (at, c) in group.char_indices() {
        match c {
            '{' => nesting += 1,
            '}' if nesting == 0 => break,
            '}' => nesting -= 1,
            ',' if nesting == 0 => begins = true,
            c if begins && (c.is_alphabetic() || c == '_') => {
                names.extend(words(&group[at..]).next().map(str::to_owned));
                begins = false;
            }
            _ => {}
        }
    }
    names
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    words.filter(|word| !word.is_empty())
}

/// A file's code: comments and the contents of strings are blank, and the unit tests at its end are gone.
/// Lines stay where they are.
fn code(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.lines() {
        if line.trim_start().starts_with("#[cfg(test)]") && !line.starts_with(' ') {
            break;
        }
        let mut is_string = false;
        let mut escaped = false;
        let mut before = ' ';
        for c in line.chars() {
            if !is_string && c == '/' && before == '/' {
                out.pop();
                break;
            }
            if c == '"' && !escaped && before != '\'' {
                is_string = !is_string;
            }
            escaped = is_string && c == '\\' && !escaped;
            out.push(if is_string { ' ' } else { c });
            before = c;
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crate_of(files: &[(&str, &str)]) -> Vec<Source> {
        let source = |(path, text): &(&str, &str)| Source {
            path: (*path).to_owned(),
            text: (*text).to_owned(),
        };
        files.iter().map(source).collect()
    }

    fn pairs(files: &[(&str, &str)]) -> Vec<(String, String)> {
        let arrows = arrows(&crate_of(files));
        arrows.into_iter().map(|a| (a.from, a.to)).collect()
    }

    #[test]
    fn every_way_to_name_a_folder_is_an_arrow() {
        let targets = [("a/mod.rs", ""), ("b.rs", ""), ("c.rs", "")];
        for text in [
            "use crate::b::{X, Y};",
            "use crate::{b::X, Z};\n",
            "use crate::{\n    Z,\n    b,\n};\n",
            "fn f() { crate::b::f(); }",
            "use super::super::b::X;",
            "pub(in crate::b) fn f() {}",
        ] {
            let mut files = targets.to_vec();
            files.push(("lib.rs", "pub use other::Z;"));
            files.push(("a/inner.rs", text));
            assert_eq!(pairs(&files), [("a".to_owned(), "b".to_owned())], "{text}");
        }
    }

    #[test]
    fn what_is_no_code_is_no_arrow() {
        for text in [
            "// use crate::b::X;",
            "//! [`crate::b`]",
            "const T: &str = \"crate::b::X\";",
            "use crate::a::X;",
            "use super::b::X;",
            "#[cfg(test)]\nmod tests { use crate::b::X; }",
        ] {
            let found = pairs(&[("a/inner.rs", text), ("b.rs", "")]);
            assert_eq!(found, [], "{text}");
        }
    }

    #[test]
    fn what_the_root_exports_is_named_where_it_stands() {
        let files = [
            ("lib.rs", "pub use b::X;\npub struct Own;"),
            ("b.rs", ""),
            ("a.rs", "use crate::{Own, X};"),
        ];
        let expected = [("a", "b"), ("a", ROOT)].map(|(a, b)| (a.to_owned(), b.to_owned()));
        assert_eq!(pairs(&files), expected);
    }

    #[test]
    fn an_arrow_has_the_place_of_its_first_mention() {
        let files = [
            ("a.rs", "\n\nuse crate::b::X;\nuse crate::b::Y;\n"),
            ("b.rs", ""),
        ];
        assert_eq!(arrows(&crate_of(&files))[0].place, ("a.rs".to_owned(), 3));
    }
}
