//! Small tools on WGSL text: predicates, what an entry point comes to, and who mentions whom.

use std::collections::BTreeMap;

/// `text` without what its entry point does not come to: functions, structures, constants and variables,
/// each with the comment above it, and headings of what is left out whole. Items begin at the
/// start of a line, as all of ours do.
pub(crate) fn reachable(text: &str) -> String {
    let pieces = pieces(text);
    let named: BTreeMap<&str, usize> = pieces
        .iter()
        .enumerate()
        .filter_map(|(at, piece)| Some((piece.name?, at)))
        .collect();
    let mut kept = vec![false; pieces.len()];
    let entries = pieces.iter().enumerate().filter(|(_, p)| p.is_entry);
    let mut left: Vec<usize> = entries.map(|(at, _)| at).collect();
    while let Some(at) = left.pop() {
        if !std::mem::replace(&mut kept[at], true) {
            let code = without_comments(&pieces[at].text);
            left.extend(identifiers(&code).filter_map(|name| named.get(name)));
        }
    }
    for at in 0..pieces.len() {
        let of_heading = pieces[at + 1..].iter().zip(&kept[at + 1..]);
        let of_heading = of_heading.take_while(|(piece, _)| !piece.is_heading);
        kept[at] |= pieces[at].is_heading && of_heading.into_iter().any(|(_, kept)| *kept);
    }
    let kept = pieces.iter().zip(kept).filter(|(_, kept)| *kept);
    kept.map(|(piece, _)| piece.text.as_str()).collect()
}

/// Lines that stay or go together: an item with the comment above it, or a heading, which is a comment
/// with nothing below.
struct Piece<'a> {
    text: String,
    name: Option<&'a str>,
    is_heading: bool,
    is_entry: bool,
}

fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut pieces = Vec::new();
    let mut piece = Piece::empty();
    let mut open = 0i32;
    for line in text.lines() {
        let code = before_comment(line).trim_end();
        piece.text += line;
        piece.text.push('\n');
        if open == 0 {
            piece.name = piece.name.or_else(|| declared(code));
            piece.is_entry |= code.starts_with("@compute");
        }
        let opened = code.bytes().map(|byte| match byte {
            b'{' | b'(' | b'[' => 1,
            b'}' | b')' | b']' => -1,
            _ => 0,
        });
        open += opened.sum::<i32>();
        let ends = open == 0 && piece.name.is_some() && code.ends_with(['}', ';']);
        let is_gap = open == 0 && line.is_empty() && piece.name.is_none();
        if ends || is_gap {
            piece.is_heading = is_gap && !piece.text.trim().is_empty();
            pieces.push(std::mem::replace(&mut piece, Piece::empty()));
        }
    }
    pieces.push(piece);
    pieces
}

impl Piece<'_> {
    fn empty() -> Self {
        Self {
            text: String::new(),
            name: None,
            is_heading: false,
            is_entry: false,
        }
    }
}

/// The name that a line at module scope declares.
fn declared(code: &str) -> Option<&str> {
    let keywords = [
        "fn ",
        "const ",
        "struct ",
        "alias ",
        "var<private> ",
        "var<workgroup> ",
    ];
    let rest = keywords.iter().find_map(|k| code.strip_prefix(k))?;
    identifiers(rest).next()
}

/// The words of code that may be names.
fn identifiers(code: &str) -> impl Iterator<Item = &str> {
    let words = code.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    words.filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'))
}

/// Whether the identifier `name` occurs in `text`.
pub(crate) fn mentions(text: &str, name: &str) -> bool {
    let in_identifier = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + name.len()..].chars().next();
        !before.is_some_and(in_identifier) && !after.is_some_and(in_identifier)
    })
}

/// `text` without its `//` comments.
pub(crate) fn without_comments(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(before_comment).collect();
    lines.join("\n")
}

/// A line until its `//`. Byte by byte: searching for a string prepares for more than a line.
fn before_comment(line: &str) -> &str {
    let mut pairs = line.as_bytes().windows(2);
    pairs
        .position(|pair| pair == b"//")
        .map_or(line, |at| &line[..at])
}

/// A function of an instance, of some material `among` a few, that is true if that is one for which
/// a condition `holds`. Where all are alike, nothing is looked up.
pub(crate) fn predicate(name: &str, among: &[usize], holds: impl Fn(usize) -> bool) -> String {
    let members: Vec<usize> = among.iter().copied().filter(|i| holds(*i)).collect();
    let body = match members.len() {
        0 => "return false;".to_string(),
        n if n == among.len() => "return true;".to_string(),
        _ => format!(
            "switch material_of(instance) {{ case {}: {{ return true; }} default: {{ return false; }} }}",
            case_labels(&members)
        ),
    };
    format!("fn {name}(instance: u32) -> bool {{ {body} }}\n")
}

/// `0u, 2u, 5u`
pub(crate) fn case_labels(values: &[usize]) -> String {
    let labels: Vec<String> = values.iter().map(|v| format!("{v}u")).collect();
    labels.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn predicates_look_up_what_differs() {
        let none = predicate("p", &[0, 1, 2], |_| false);
        assert_eq!(none, "fn p(instance: u32) -> bool { return false; }\n");
        let all = predicate("p", &[0, 2], |i| i != 1);
        assert_eq!(all, "fn p(instance: u32) -> bool { return true; }\n");
        let some = predicate("p", &[0, 1, 2], |i| i != 1);
        assert!(some.contains("switch material_of(instance) { case 0u, 2u: { return true; }"));
    }

    #[test]
    fn what_the_entry_point_does_not_come_to_goes_with_its_comments() {
        let text = "// Heading of what stays.\n\nconst A: u32 = 1u;\n// B and its end.\nconst B: u32 = 2u;\n\
                    // Heading of what goes.\n\n// Gone.\nfn gone(x: u32) -> u32 {\n    return B;\n}\n\
                    // Kept.\nstruct S { x: u32 }\nfn used(s: S) -> u32 { return A + s.x; }\n\
                    @compute @workgroup_size(1)\nfn main(\n    @builtin(workgroup_id) id: vec3<u32>\n) {\n\
                    \n    _ = used(S(id.x)); // B\n}\n";
        let expected = "// Heading of what stays.\n\nconst A: u32 = 1u;\n// Heading of what goes.\n\n\
                        // Kept.\nstruct S { x: u32 }\n\
                        fn used(s: S) -> u32 { return A + s.x; }\n@compute @workgroup_size(1)\nfn main(\n    \
                        @builtin(workgroup_id) id: vec3<u32>\n) {\n\n    _ = used(S(id.x)); // B\n}\n";
        assert_eq!(reachable(text), expected);
        let short =
            "// Of this nothing is left.\n\nfn f() {}\n// The end.\n\n@compute\nfn main() {}\n";
        assert_eq!(reachable(short), "// The end.\n\n@compute\nfn main() {}\n");
    }

    #[test]
    fn mentions_are_whole_identifiers() {
        assert!(mentions("state[0]", "state"));
        assert!(!mentions("my_state[0] + states", "state"));
    }
}
