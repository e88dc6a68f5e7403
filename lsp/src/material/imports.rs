//! The `use` declarations of a source: which to add, and how to take one out.

use std::ops::Range;

use impasto_compiler::ast;

/// The change that imports what is at a path, such as `std::noise::perlin`: where, and what is written there. Nothing
/// if it is imported.
pub fn added(ast: &ast::Module, text: &str, path: &str) -> Option<(Range<usize>, String)> {
    let (folder, name) = path.rsplit_once("::")?;
    let of_folder = |u: &&ast::Use| joined(u) == folder;
    let mut same = ast.uses.iter().filter(of_folder);
    if same
        .clone()
        .flat_map(|u| &u.names)
        .any(|n| n.name.node == name)
    {
        return None;
    }
    if let Some(existing) = same.next() {
        let names: Vec<&ast::UseName> = existing.names.iter().collect();
        let written = text.get(existing.span.range())?;
        if let Some(brace) = written.find('{') {
            // In the order of the alphabet, if it is one.
            let is_sorted = names.is_sorted_by_key(|n| &n.name.node);
            let after = names.iter().rev().find(|n| n.name.node.as_str() < name);
            let after = if is_sorted { after } else { names.last() };
            return Some(match after {
                Some(n) => {
                    let end = n.alias.as_ref().unwrap_or(&n.name).span.end as usize;
                    (end..end, format!(", {name}"))
                }
                None => {
                    let at = existing.span.start as usize + brace + 1;
                    let at =
                        at + written[brace + 1..].len() - written[brace + 1..].trim_start().len();
                    (at..at, format!("{name}, "))
                }
            });
        }
        let only = names.first()?;
        let start = only.name.span.start as usize;
        let end = only.alias.as_ref().unwrap_or(&only.name).span.end as usize;
        let mut both = [text.get(start..end)?.to_owned(), name.to_owned()];
        both.sort();
        return Some((start..end, format!("{{{}}}", both.join(", "))));
    }
    let line = format!("use {path};\n");
    // Behind the imports that are there, in the order of the alphabet if they are in it.
    let before = ast.uses.iter().rev().find(|u| joined(u).as_str() < folder);
    if let Some(before) = before {
        let end = line_end(text, before.span.end as usize);
        return Some((end..end, line));
    }
    if let Some(first) = ast.uses.first() {
        let start = first.span.start as usize;
        return Some((start..start, line));
    }
    // Behind the documentation of the file, or the mark that some editors start a file with.
    let docs: usize = text
        .split_inclusive('\n')
        .take_while(|line| line.trim_start().starts_with("//!"))
        .map(str::len)
        .sum();
    if docs == 0 {
        let at = if text.starts_with('\u{feff}') { 3 } else { 0 };
        return Some((at..at, format!("{line}\n")));
    }
    let has_gap = text[docs..].starts_with('\n');
    let rest = text[docs..].trim_start_matches('\n');
    if has_gap {
        let at = text.len() - rest.len();
        return Some((at..at, format!("{line}\n")));
    }
    Some((docs..docs, format!("\n{line}")))
}

/// The bytes that go with an imported name whose place here is `at`: the name with its comma, or all of a declaration
/// that has no other.
pub fn removed(ast: &ast::Module, text: &str, at: usize) -> Option<Range<usize>> {
    let has = |n: &ast::UseName| {
        let name = n.alias.as_ref().unwrap_or(&n.name);
        name.span.range().contains(&at)
    };
    let import = ast.uses.iter().find(|u| u.names.iter().any(has))?;
    let index = import.names.iter().position(has)?;
    if import.names.len() == 1 {
        let start = import.span.start as usize;
        return Some(start..line_end(text, import.span.end as usize));
    }
    let end_of = |n: &ast::UseName| n.alias.as_ref().unwrap_or(&n.name).span.end as usize;
    let (name, next) = (&import.names[index], import.names.get(index + 1));
    Some(match next {
        Some(next) => name.name.span.start as usize..next.name.span.start as usize,
        None => end_of(&import.names[index - 1])..end_of(name),
    })
}

/// The end of a line with its break, if there is only white space up to it.
fn line_end(text: &str, at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    let end = rest.find('\n').map_or(rest.len(), |n| n + 1);
    if rest[..end].trim().is_empty() {
        at + end
    } else {
        at
    }
}

fn joined(import: &ast::Use) -> String {
    let names: Vec<&str> = import.path.iter().map(|n| n.node.as_str()).collect();
    names.join("::")
}

#[cfg(test)]
mod tests {
    use super::*;
    use impasto_compiler::parser;
    use impasto_compiler::source::FileId;

    fn with(text: &str, path: &str) -> String {
        let (ast, _) = parser::parse(FileId(0), text);
        let mut out = text.to_owned();
        if let Some((range, new)) = added(&ast, text, path) {
            out.replace_range(range, &new);
        }
        out
    }

    #[test]
    fn an_import_goes_where_an_author_would_write_it() {
        let m = "material m {}\n";
        for (text, expected) in [
            ("", "use std::noise::perlin;\n\n"),
            (
                "//! About.\n\n",
                "//! About.\n\nuse std::noise::perlin;\n\n",
            ),
            ("//! About.\n", "//! About.\n\nuse std::noise::perlin;\n"),
            (
                "use std::noise::flakes;\n\n",
                "use std::noise::{flakes, perlin};\n\n",
            ),
            (
                "use std::noise::{flakes, worley};\n\n",
                "use std::noise::{flakes, perlin, worley};\n\n",
            ),
            (
                "use std::noise::{worley};\n\n",
                "use std::noise::{perlin, worley};\n\n",
            ),
            (
                "use std::bsdf::diffuse;\nuse std::pattern::checker;\n\n",
                "use std::bsdf::diffuse;\nuse std::noise::perlin;\nuse std::pattern::checker;\n\n",
            ),
            ("use std::noise::perlin;\n\n", "use std::noise::perlin;\n\n"),
        ] {
            let found = with(&format!("{text}{m}"), "std::noise::perlin");
            assert_eq!(found, format!("{expected}{m}"), "{text:?}");
        }
    }

    #[test]
    fn a_name_is_taken_out_with_its_comma() {
        for (text, name, expected) in [
            ("use std::a::x;\nfn f", "x", "fn f"),
            ("use std::a::{x, y};\n", "x", "use std::a::{y};\n"),
            ("use std::a::{x, y};\n", "y", "use std::a::{x};\n"),
            ("use std::a::{x as z, y};\n", "z", "use std::a::{y};\n"),
        ] {
            let (ast, _) = parser::parse(FileId(0), text);
            let at = text.rfind(name).unwrap_or(0);
            let range = removed(&ast, text, at).expect("it is imported");
            let mut out = text.to_owned();
            out.replace_range(range, "");
            assert_eq!(out, expected, "{text:?}");
        }
    }
}
